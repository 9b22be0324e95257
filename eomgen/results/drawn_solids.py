"""Equivalent solid of a body for pictures: the homogeneous solid of the same mass, centre and inertia."""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.base.arrays import Array

#: Principal moments that differ by less than this part of the largest are drawn as equal.
EQUAL = 1e-3
#: Thinnest solid that is drawn, as part of its longest side.
THINNEST = 0.02


def equivalent_solid(mass: float, center: Array, inertia: Array) -> dict[str, Any]:
    """Return kind, sizes (m), centre and axes of the solid with this mass and inertia (3, 3) about the centre of mass.

    ``sphere`` with its radius, ``cylinder`` with radius and height along its z axis, or ``box`` with three sides, as
    the principal moments are all equal, two of them, or none; ``point`` for a mass without inertia; ``none`` without
    mass. The rows of ``axes`` are the solid's axes in the body.
    """
    shape: dict[str, Any] = {"kind": "none", "size": [], "center": center.tolist(), "axes": np.eye(3).tolist()}
    if not mass > 0.0:
        return shape
    moments, vectors = np.linalg.eigh(inertia)
    largest = moments[-1]
    if not largest > 0.0:
        return {**shape, "kind": "point"}
    low, high = moments[1] - moments[0] <= EQUAL * largest, moments[2] - moments[1] <= EQUAL * largest
    if low and high:
        return {**shape, "kind": "sphere", "size": [float(np.sqrt(2.5 * largest / mass))]}
    if low or high:
        along, across = (0, 2) if high else (2, 0)
        radius = np.sqrt(max(2.0 * moments[along] / mass, 0.0))
        height = np.sqrt(max(12.0 * moments[across] / mass - 3.0 * radius**2, 0.0))
        thickness = THINNEST * max(radius, height)
        size = [float(max(radius, thickness)), float(max(height, thickness))]
        axes = _right_handed(vectors[:, [(along + 1) % 3, (along + 2) % 3, along]])
        return {**shape, "kind": "cylinder", "size": size, "axes": axes}
    sides = np.sqrt(np.maximum(6.0 * (moments.sum() - 2.0 * moments) / mass, 0.0))
    sides = np.maximum(sides, THINNEST * sides.max())
    return {**shape, "kind": "box", "size": sides.tolist(), "axes": _right_handed(vectors)}


def _right_handed(columns: Array) -> list[list[float]]:
    """Return the columns as rows, the second one turned if they are left-handed."""
    axes = columns.T.copy()
    if np.linalg.det(axes) < 0.0:
        axes[1] = -axes[1]
    rows: list[list[float]] = axes.tolist()
    return rows
