"""A double wishbone by its constraints alone, written by hand: lengths between points, solved by Newton's method with
derivatives by complex steps. Hard points are rows of (x, y, z)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Points = Mapping[str, Array]
#: Distances that stay: moving points among themselves, and to points of the body.
_RODS = (
    ("lower_ball", "upper_ball"),
    ("lower_ball", "tie"),
    ("upper_ball", "tie"),
    ("lower_ball", "lower_front"),
    ("lower_ball", "lower_rear"),
    ("upper_ball", "upper_front"),
    ("upper_ball", "upper_rear"),
    ("tie", "rack"),
)
_MOVING = ("lower_ball", "upper_ball", "tie")


def _length(vector):
    return np.sqrt(np.sum(vector * vector))


def _carrier(places):
    """Return the origin and the axes, as columns, of the carrier."""
    first = places[1] - places[0]
    first = first / _length(first)
    second = places[2] - places[0]
    second = second - first * np.sum(first * second)
    second = second / _length(second)
    return places[0], np.stack([first, second, np.cross(first, second)], axis=1)


def solve(points: Points, carried: Points, height, start: Array | None = None) -> tuple[Array, Points]:
    """Return the places (3, 3) of the moving points, and of points that the carrier carries.

    ``height(places of the carried points)`` is a number that is 0 in the state. ``points`` are all points at the design
    position, with the point ``rack`` at its present place as ``rack`` and at the design position as ``rack_design``.
    """
    origin, axes = _carrier(np.stack([points[name] for name in _MOVING]))
    local = {name: axes.T @ (place - origin) for name, place in carried.items()}
    design = {**points, "rack": points["rack_design"]}
    lengths = [_length(design[first] - design[second]) for first, second in _RODS]

    def carried_by(x):
        origin, axes = _carrier(x.reshape(3, 3))
        return {name: origin + axes @ place for name, place in local.items()}

    def rows(x):
        places = {**points, **dict(zip(_MOVING, x.reshape(3, 3), strict=True))}
        rods = [_length(places[a] - places[b]) - length for (a, b), length in zip(_RODS, lengths, strict=True)]
        return np.array([*rods, height(carried_by(x))])

    x = (np.stack([points[name] for name in _MOVING]) if start is None else start).ravel()
    for _ in range(30):
        jacobian = np.stack([rows(x + 1e-30j * unit).imag / 1e-30 for unit in np.eye(9)], axis=1)
        step = np.linalg.solve(jacobian, -rows(x))
        x = x + step
        if np.abs(step).max() < 1e-15:
            break
    return x.reshape(3, 3), carried_by(x)
