"""One measured run on a model: predicted outputs at the measured times, with their derivatives in the unknowns."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.text import shown
from eomgen.compiled.initial_state import InitialState
from eomgen.errors import Problem, UsageError
from eomgen.lie.product import tangent, update
from eomgen.products.derivatives.functionals import component
from eomgen.products.derivatives.linearise import newton_settings
from eomgen.products.studies.identification.measurements import Measurements

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model

#: Part of a step by which a time may miss the end of a step, as rounded times of files do.
_ROUNDED = 1e-6


@dataclass(frozen=True)
class Rows:
    """Values at times from values at the ends of steps: a cubic through the four nearest ones, of order 4 in the step.

    Attributes
    ----------
    steps : of the run
    places : (n, 4) rows of the run
    weights : (n, 4)
    ends : (n,) rows of the run if all times are ends of steps
    """

    steps: int
    places: Array
    weights: Array
    ends: Array | None

    @classmethod
    def of(cls, t: Array, start: float, step: float) -> Rows:
        """Return the rows for times (n,) of a run from ``start``, s."""
        position = (t - start) / step
        near = np.rint(position)
        position = np.where(np.abs(position - near) < _ROUNDED, near, position)
        steps = max(3, int(np.ceil(position[-1])))
        first = np.clip(np.floor(position).astype(int) - 1, 0, steps - 3)
        s = position - first
        nodes = np.arange(4.0)
        weights = np.empty((len(t), 4))
        for k in range(4):
            others = nodes[nodes != k]
            weights[:, k] = np.prod((s[:, np.newaxis] - others) / (k - others), axis=1)
        ends = position.astype(int) if np.all(position == near) else None
        return cls(steps, first[:, np.newaxis] + np.arange(4), weights, ends)

    def at(self, table: Array) -> Array:
        """Return values (n, ...) from a table of all rows (rows, ...)."""
        if self.ends is not None:
            return np.asarray(table[self.ends])
        result: Array = np.einsum("nk,nk...->n...", self.weights, table[self.places])
        return result


@dataclass(frozen=True)
class Begun:
    """Start of a run: initial values as they were given, if any, and the whole state with these."""

    given: Mapping[str, Any] | None
    state: InitialState


class Experiment:
    """One measured run.

    Parameters
    ----------
    states : components of the initial state that are unknown; if there are none, the start follows from parameters
        as in any run
    initial : the others, and the start of these
    options : of ``sensitivities``
    """

    def __init__(
        self,
        model: Model,
        data: Measurements,
        parameters: Sequence[str],
        states: Sequence[str],
        initial: Begun,
        step: float,
        start: float | None,
        options: Mapping[str, Any],
    ) -> None:
        self.model, self.data, self.states = model, data, tuple(states)
        self._start = float(data.t[0]) if start is None else start
        if data.t[0] < self._start - _ROUNDED * step:
            fault = f"{data.name} begins at t = {data.t[0]:.9g} s, before the run at {self._start:.9g} s"
            raise UsageError(Problem("t_start", fault, f"t_start = {data.t[0]:.9g}, or none"))
        self.step, self._initial, self._given = step, initial.state, initial.given
        self._rows = Rows.of(data.t, self._start, step)
        self._parameters = tuple(parameters)
        known = [*(f"q{name[1:]}" for name in model.v_names), *model.v_names, *model.z_names]
        for name in states:
            if name not in known:
                hint = " or ".join(difflib.get_close_matches(str(name), known, n=3)) or f"one of {', '.join(known[:8])}"
                fault = f"there is no component {shown(name)} of the initial state"
                raise UsageError(Problem("states", fault, hint))
        self._places = [known.index(name) for name in states]
        self._by = (*parameters, *self._directions(known))
        self._known = known
        self._labels = tuple(data.outputs)
        self.present = np.stack([np.isfinite(values) for values in data.outputs.values()])
        self._options = dict(options)
        self._options["inputs"] = {**(self._options.get("inputs") or {}), **self._driven()} or None
        tight = newton_settings(model, self._options.get("method"))
        self._options["settings"] = {**tight, **(self._options.get("settings") or {})} or None

    @property
    def starts(self) -> Array:
        """Start of the unknown components, (states,): numbers of the state, 0 of rotations of a joint."""
        model, state = self.model, self._initial
        q = np.zeros(model.nv)
        for factor in model.factors:
            if factor.group == "R":
                q[factor.v] = state.q[factor.q]
        result: Array = np.concatenate([q, state.v, state.z])[self._places]
        return result

    @property
    def units(self) -> list[str]:
        """Units of the unknown components."""
        model = self.model
        of_q = [unit.removesuffix("/s") for unit in model.v_units]
        every = [*of_q, *model.v_units, *model.z_units]
        return [every[place] for place in self._places]

    def __call__(self, parameters: Mapping[str, float], states: Array) -> tuple[Array, Array]:
        """Return outputs at the measured times (outputs, n), and derivatives (outputs, n, parameters + states).

        Raises
        ------
        EomgenError
            The run fails.
        """
        initial, of_states = self._initial_at(states)
        start = initial if self.states else self._given
        names = list(dict.fromkeys(label.partition("[")[0] for label in self._labels))
        found = self.model.sensitivities(
            self._start + self._rows.steps * self.step,
            self.step,
            by=list(self._by),
            of=names,
            parameters=dict(parameters),
            initial=start,
            t_start=self._start,
            record_every=1,
            **self._options,
        )
        values = np.stack([component(found.outputs, label) for label in self._labels])
        slopes = np.stack([component(found.derivatives, label) for label in self._labels])
        if found.by != self._by:
            slopes = slopes[..., [found.by.index(name) for name in self._by]]
        if self.states:
            count = len(self._parameters)
            slopes = np.concatenate([slopes[..., :count], slopes[..., count:] @ of_states], axis=-1)
        at = self._rows.at
        return np.stack([at(one) for one in values]), np.stack([at(one) for one in slopes])

    def initial_state(self, parameters: Mapping[str, float], states: Array) -> dict[str, Array]:
        """Return the initial state at values of the unknowns, as of ``simulate``."""
        if self.states:
            return self._initial_at(states)[0]
        options = dict(self._options)
        end, start = self._start + self._rows.steps * self.step, self._start
        run = self.model.simulate(
            end,
            self.step,
            initial=self._given,
            parameters=dict(parameters),
            t_start=start,
            error_estimate=False,
            **options,
        )
        return {name: getattr(run, name)[0] for name in ("q", "v", *("z" for _ in range(bool(self.model.nz))))}

    def _initial_at(self, states: Array) -> tuple[dict[str, Array], Array]:
        """Return the initial state, and its directions by the unknown components, (directions, states)."""
        model, nv = self.model, self.model.nv
        whole = np.zeros(2 * nv + model.nz)
        whole[self._places] = np.asarray(states) - self.starts
        theta = whole[:nv]
        q = update(model.factors, self._initial.q, theta)
        initial = {"q": q, "v": self._initial.v + whole[nv : 2 * nv]}
        if model.nz:
            initial["z"] = self._initial.z + whole[2 * nv :]
        turned = np.eye(len(whole))
        turned[:nv, :nv] = tangent(model.factors, theta)
        rows = [self._known.index(name) for name in self._by[len(self._parameters) :]]
        return initial, turned[np.ix_(rows, self._places)]

    def _directions(self, known: Sequence[str]) -> list[str]:
        """Return the components of derivatives: components of a joint that rotates together."""
        places = set(self._places)
        for factor in self.model.factors:
            components = range(factor.v_start, factor.v_start + factor.v_size)
            if factor.group != "R" and places & set(components):
                places |= set(components)
        return [known[place] for place in sorted(places)]

    def _driven(self) -> dict[str, Array]:
        """Return measured inputs on the grid of the steps, linear between samples."""
        times = self._start + self.step * np.arange(self._rows.steps + 1)
        return {name: np.interp(times, self.data.t, values) for name, values in self.data.inputs.items()}
