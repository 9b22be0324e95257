"""Bushings from the written form: six stiffnesses and dampings, given along and about axes or as matrices."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from eomgen.scene.forces import schema as written
from eomgen.scene.forces.elements import Bushing
from eomgen.scene.formula.nodes import ZERO, ZERO_VECTOR, Formula, Number
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.geometry.rotations import rows, sequence
from eomgen.scene.joints.frames import read_frame
from eomgen.scene.reading.values import Values
from eomgen.scene.scene import Point
from eomgen.text import key_of

Rows = tuple[tuple[Formula, ...], ...]


def read_bushing(
    name: str, entry: written.Bushing, bodies: Collection[str], points: Mapping[str, Point], values: Values
) -> Bushing:
    """Return a checked bushing; what is wrong with it goes to the report of ``values``."""
    key = key_of("bushings", name)
    first, second = (
        read_frame(f"{key}.{side}", "bushing", frame, "any", bodies, points, values)
        for side, frame in (("first", entry.first), ("second", entry.second))
    )
    stiffness, damping = _rows(key, entry, "stiffness", values), _rows(key, entry, "damping", values)
    rotational = values.vector(f"{key}.rotational_preload", entry.rotational_preload, PARAMETERS)
    preload = (*rotational, *values.vector(f"{key}.preload", entry.preload, PARAMETERS))
    parts = [entry for row in (*stiffness, *damping, preload) for entry in row]
    if not values.report.concerns(key) and all(part in (ZERO, Number(-0.0)) for part in parts):
        values.report.add(key, "the bushing has no stiffness, damping or preload", "stiffness = [1e5, 1e5, 1e5]")
    return Bushing(
        name=name,
        first=first,
        second=second,
        stiffness=stiffness,
        damping=damping,
        rest=values.vector(f"{key}.rest", entry.rest, PARAMETERS),
        rest_orientation=rows(sequence(values.constant_rotations(f"{key}.rest_rotation", entry.rest_rotation) or [])),
        preload=preload,
    )


def _rows(key: str, entry: written.Bushing, what: str, values: Values) -> Rows:
    """Return the six rows of the stiffness or the damping, rotations first."""
    fields = (f"rotational_{what}", what)
    matrix = getattr(entry, f"{what}_matrix")
    if matrix is None:
        diagonal: list[Formula] = []
        for field in fields:
            given = getattr(entry, field)
            diagonal += ZERO_VECTOR if given is None else values.vector(f"{key}.{field}", given, PARAMETERS)
        return tuple(tuple(diagonal[i] if i == j else ZERO for j in range(6)) for i in range(6))
    for field in fields:
        if getattr(entry, field) is not None:
            values.report.add(f"{key}.{field}", f"{field} and {what}_matrix are both given", "one of them")
    _check_matrix(f"{key}.{what}_matrix", matrix, what, values)
    return tuple(tuple(Number(number) for number in row) for row in matrix)


def _check_matrix(key: str, rows_given: Sequence[Sequence[float]], what: str, values: Values) -> None:
    """Report a stiffness without a potential, and a stiffness or damping that would hand out energy."""
    matrix = np.array(rows_given)
    size = float(np.max(np.abs(matrix)))
    for row, column in zip(*np.nonzero(np.abs(matrix - matrix.T) > 1e-9 * size), strict=True):
        if what == "stiffness" and row < column:
            fault = f"the matrix is not symmetric, so it has no potential: entry [{row}][{column}] differs from [{column}][{row}]"
            values.report.add(key, fault, "the mean of both")
            return
    smallest = float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0])
    if smallest < -1e-9 * size:
        fault = f"the {what} is negative in some direction: the smallest eigenvalue of the matrix is {smallest:.6g}"
        values.report.add(key, fault, "a positive semidefinite matrix")
