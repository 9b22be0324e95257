"""Samples of an ensemble side by side: varied quantities as arrays of parameters, inputs and initial states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.compiled.initial_state import initial_state
from eomgen.compiled.model import CompiledModel
from eomgen.errors import EomgenError
from eomgen.products.ensembles.input_laws import variables_of_seed
from eomgen.products.ensembles.side_by_side import Alike, Beside, SideBySide, side_by_side
from eomgen.products.ensembles.variations import VariedOptions, with_scenes_laws


@dataclass
class Lanes:
    """Runs samples side by side.

    Attributes
    ----------
    runs : their source
    """

    model: CompiledModel
    options: VariedOptions
    runs: SideBySide

    def tables(self, values: Array) -> Beside:
        """Return columns (samples, columns, rows) of samples with the values (samples, varied), and which of them have
        to be run alone."""
        parameters, alone = self._parameters(values)
        inputs = self._input_tables(values, parameters) if self.runs.tabled else self._held_inputs(values)
        starts, refused = self._starts(values, parameters)
        result = self.runs.tables(parameters, inputs, starts)
        return replace(result, alone=result.alone | alone | refused | self.runs.unfollowed(parameters))

    def _parameters(self, values: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return parameters (samples, np), and which of them may be refused; these have the scene's in their place."""
        base, names = self.runs.run.parameters, list(self.model.parameters)
        parameters = np.repeat(base[np.newaxis], len(values), axis=0)
        for item, column in zip(self.options.items, values.T, strict=True):
            if item.block == "parameters":
                parameters[:, names.index(item.name)] = column
            elif item.block == "process":
                drawn = [variables_of_seed(self.model, item.place, seed) for seed in column]
                places = [names.index(name) for name in drawn[0]]
                parameters[:, places] = [list(row.values()) for row in drawn]
        alone = np.zeros(len(values), dtype=bool)
        try:
            self.model.parameter_array(parameters)
        except EomgenError:
            for k, row in enumerate(parameters):
                try:
                    self.model.parameter_array(row)
                except EomgenError:
                    alone[k], parameters[k] = True, base
        return parameters, alone

    def _input_tables(self, values: Array, parameters: Array) -> Array:
        """Return inputs that change with time, (samples, rows, nu)."""
        held = {
            item.name: column
            for item, column in zip(self.options.items, values.T, strict=True)
            if item.block == "inputs"
        }
        laws = [self.options.laws(row, partial(np.asarray, p)) for row, p in zip(values, parameters, strict=True)]
        return self.runs.input_tables(parameters, held, laws)

    def _held_inputs(self, values: Array) -> Array | None:
        held = self.runs.held_inputs
        if held is None:
            return None
        inputs = np.repeat(held[np.newaxis], len(values), axis=0)
        for item, column in zip(self.options.items, values.T, strict=True):
            if item.block == "inputs":
                inputs[:, self.model.inputs.index(item.name)] = column
        return inputs

    def _starts(self, values: Array, parameters: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return initial states (samples, nq + nv + nz) on the constraints, and which of them cannot be."""
        model, common = self.model, self.options.common
        changed = bool(common.get("initial")) or common.get("parameters") is not None
        changed = changed or any(item.block != "inputs" for item in self.options.items)
        guesses, refused = self._guesses(values, parameters, asked=changed)
        if not changed and self.runs.run.grid.start == 0.0:
            return guesses, refused
        q, v, z = np.split(guesses, [model.nq, model.nq + model.nv], axis=1)
        result = self.runs.assembled(q, v, parameters)
        if result is None:
            return self._starts_one_by_one(values, parameters)
        return np.concatenate([result.q, result.v, z], axis=1), refused | ~result.met

    def _guesses(self, values: Array, parameters: Array, *, asked: bool) -> tuple[Array, NDArray[np.bool_]]:
        """Return initial states (samples, nq + nv + nz) as they are given, and which of them are refused; ``asked``:
        before they are moved onto constraints."""
        model, common = self.model, self.options.common.get("initial")
        first = initial_state(model, common, self.runs.run.parameters, asked=asked)
        starts = np.repeat(np.concatenate([first.q, first.v, first.z])[np.newaxis], len(values), axis=0)
        refused = np.zeros(len(values), dtype=bool)
        if model.initial_at is not None:  # joints place the bodies at the parameters of each sample
            for k in np.flatnonzero((parameters != self.runs.run.parameters).any(axis=1)):
                try:
                    own = initial_state(model, common, parameters[k], asked=asked)
                except EomgenError:
                    refused[k] = True
                else:
                    starts[k] = np.concatenate([own.q, own.v, own.z])
        begins = {"q": 0, "v": model.nq, "z": model.nq + model.nv}
        for item, column in zip(self.options.items, values.T, strict=True):
            if item.block in begins:
                starts[:, begins[item.block] + item.place] = column
        return starts, refused

    def _starts_one_by_one(self, values: Array, parameters: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the same with rows that were left out checked for each."""
        model = self.model
        starts = np.repeat(
            np.concatenate([model.initial_q, model.initial_v, model.initial_z])[np.newaxis], len(values), axis=0
        )
        refused = np.zeros(len(values), dtype=bool)
        for k, row in enumerate(values):
            given = self.options.of(row)
            initial = given.get("initial")
            changed = bool(initial) or given.get("parameters") is not None
            try:
                starts[k] = self.runs.start_of(parameters[k], initial, changed=changed)
            except EomgenError:
                refused[k] = True
        return starts, refused


def lanes_of(model: CompiledModel, options: VariedOptions, alike: Alike, columns: Sequence[str]) -> Lanes | str:
    """Return the runner of samples side by side, or the reason for which they run one after the other."""
    common = with_scenes_laws(model, options.items, options.common)
    inputs = [item.name for item in options.items if item.block == "inputs"]
    initial = any(item.block in ("q", "v", "z") for item in options.items)
    runs = side_by_side(model, common, inputs, alike, columns, initial_varies=initial)
    return runs if isinstance(runs, str) else Lanes(model, options, runs)
