"""Units and references of the signals that a controller adds to a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypedDict

import numpy as np

from eomgen.base.arrays import Array
from eomgen.linear.state_space import KINDS, StateSpace


class Labels(TypedDict):
    """Units and references of signals by kind, as of a ``StateSpace``."""

    units: dict[str, tuple[str, ...]]
    references: dict[str, Array]


def labels(space: StateSpace, kind: str, names: Sequence[str]) -> list[tuple[str, float]]:
    """Return the unit and the reference of each of some signals of a kind."""
    return [(space.unit(kind, name), space.reference(kind, name)) for name in names]


def with_more(space: StateSpace, more: Mapping[str, Sequence[tuple[str, float]]]) -> Labels:
    """Return the labels of a model's signals with more appended to some kinds."""
    units, references = {}, {}
    for kind in KINDS:
        every = [*labels(space, kind, getattr(space, kind)), *more.get(kind, ())]
        units[kind] = tuple(unit for unit, _ in every)
        references[kind] = np.array([reference for _, reference in every], dtype=float)
    return {"units": units, "references": references}
