"""Unknowns of several measured runs of a model: names, start, data, and predictions with their derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.products.studies.identification.experiment import Experiment

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model


@dataclass(frozen=True)
class Unknowns:
    """Unknowns of several runs in one row: parameters, then the states of each run.

    Attributes
    ----------
    parameters, states : names of unknowns
    experiments : the runs
    held : values of parameters that differ from the scene's, with the start of unknown ones
    """

    model: Model
    parameters: tuple[str, ...]
    states: tuple[str, ...]
    experiments: Sequence[Experiment]
    held: Mapping[str, float]

    @property
    def names(self) -> list[str]:
        several = len(self.experiments) > 1
        return [
            *self.parameters,
            *(f"{name} of {one.data.name}" if several else name for one in self.experiments for name in self.states),
        ]

    @property
    def units(self) -> list[str]:
        known = {item.name: item.unit for item in self.model.description.parameters}
        return [known.get(name, "") for name in self.parameters] + [u for one in self.experiments for u in one.units]

    @property
    def start(self) -> Array:
        values = {**self.model.parameters, **self.held}
        return np.concatenate(
            [np.array([float(values[name]) for name in self.parameters]), *(one.starts for one in self.experiments)]
        )

    @property
    def labels(self) -> list[str]:
        """Measured columns of all runs."""
        return list(dict.fromkeys(label for one in self.experiments for label in one.data.outputs))

    @property
    def data(self) -> Array:
        """(rows,) measured values, run by run and column by column."""
        parts = [np.stack(list(one.data.outputs.values()))[one.present] for one in self.experiments]
        return np.concatenate(parts)

    @property
    def columns(self) -> Array:
        """(rows,) places of columns among ``labels``."""
        labels = self.labels
        return np.concatenate(
            [
                np.full(int(np.count_nonzero(row)), labels.index(label))
                for one in self.experiments
                for label, row in zip(one.data.outputs, one.present, strict=True)
            ]
        )

    def states_of(self, x: Array, number: int) -> Array:
        count = len(self.states)
        first = len(self.parameters) + number * count
        return x[first : first + count]

    def values_of(self, x: Array) -> dict[str, float]:
        return {**self.held, **dict(zip(self.parameters, x.tolist(), strict=False))}

    def predict(self, x: Array) -> tuple[Array, Array]:
        """Return the model's values (rows,) and derivatives (rows, n)."""
        count, parts, slopes = len(self.parameters), [], []
        for number, one in enumerate(self.experiments):
            values, derivatives = one(self.values_of(x), self.states_of(x, number))
            block = np.zeros((*values.shape, len(x)))
            first = count + number * len(self.states)
            block[..., :count] = derivatives[..., :count]
            block[..., first : first + len(self.states)] = derivatives[..., count:]
            parts.append(values[one.present])
            slopes.append(block[one.present])
        return np.concatenate(parts), np.concatenate(slopes)
