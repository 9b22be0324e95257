"""Constant rotations of a scene as numbers: from axis and angle, roll-pitch-yaw and quaternions, with right angles made
exact.

A matrix maps the rotated frame's axes to the fixed frame's; sequences are intrinsic, in order.

All decisions on directions near a coordinate axis and angles near a right angle are made here. Within ``SNAP`` they are
made exact, which changes results by no more than that; beyond, a direction is like any other. A frame that has to be
chosen is the same for directions that differ by less than ``ALIKE``: it does not change between an axis and one a
little off a coordinate axis, or off a diagonal between two of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import WRITTEN
from eomgen.formula.nodes import Formula
from eomgen.lie.numeric import quaternion_product, skew, unit


@dataclass(frozen=True)
class Rotation:
    """Rotation by ``angle`` about a unit ``axis``; lists of these are intrinsic, in order."""

    axis: tuple[float, float, float]
    angle: Formula


SNAP = 1e-10
#: Components of unit vectors and quaternions that differ by less say the same.
ALIKE = WRITTEN
_ORTHONORMAL = 1e-14


class CoordinateAxis(NamedTuple):
    """A coordinate axis, 0 to 2, and a direction along this axis, 1 or -1."""

    place: int
    sense: float

    @property
    def unit(self) -> tuple[float, float, float]:
        """The unit vector along the axis."""
        x, y, z = (self.sense if k == self.place else 0.0 for k in range(3))
        return x, y, z


def coordinate_axis(axis: Sequence[float]) -> CoordinateAxis | None:
    """Return the coordinate axis equal to a unit vector; None for any other vector, however near to an axis.

    A component of 1.0 is not a proof: (1e-9, 0, 1) has length one in double precision.
    """
    along = [k for k in range(3) if axis[k] != 0.0]
    return CoordinateAxis(along[0], math.copysign(1.0, axis[along[0]])) if len(along) == 1 else None


def axis_beside(direction: Sequence[float]) -> CoordinateAxis | None:
    """Return the coordinate axis from which each component of a unit vector differs by at most 1e-6; None without such
    an axis."""
    index = max(range(3), key=lambda k: abs(direction[k]))
    if any(abs(direction[k]) > ALIKE for k in range(3) if k != index):
        return None
    return CoordinateAxis(index, math.copysign(1.0, direction[index]))


def first_near(values: Sequence[float], target: float) -> int:
    """Return the index of the first value that is ``target`` within ``ALIKE``."""
    return next(index for index, value in enumerate(values) if abs(value - target) <= ALIKE)


def snap(entries: Array) -> Array:
    """Return an array with entries within 1e-10 of 0, 1 or -1 rounded, which repairs angles written to few digits."""
    rounded = np.round(entries)
    return np.where((np.abs(entries - rounded) <= SNAP) & (np.abs(rounded) <= 1.0), rounded, entries) + 0.0


def snapped_rotation(matrix: Array) -> Array:
    """Return a (3, 3) rotation matrix with entries within 1e-10 of 0, 1 or -1 made exact, and still a rotation. If only
    some entries of a row are near 0 or 1, as for a turn by 1e-5, rounding these entries alone makes the matrix
    non-orthogonal by up to 1e-10; then the nearest rotation (the orthogonal polar factor) is taken instead."""
    result = snap(matrix)
    if np.max(np.abs(result @ result.T - np.eye(3))) <= _ORTHONORMAL:
        return result
    u, _, v = np.linalg.svd(result)
    nearest = u @ v
    rounded = np.round(nearest)
    exact: Array = np.where(np.abs(nearest - rounded) <= _ORTHONORMAL, rounded, nearest) + 0.0
    return exact


def unit_axis(axis: Sequence[float]) -> Array | None:
    """Return the (3,) unit vector along ``axis``, with components near 0, 1 or -1 made exact; None for an axis that is
    not finite or is zero."""
    vector = np.array(axis, dtype=float)
    largest = float(np.max(np.abs(vector)))
    if not (math.isfinite(largest) and largest > 1e-150):
        return None
    vector = vector / largest
    result = snap(vector / np.linalg.norm(vector))
    return result / np.linalg.norm(result)


def about_axis(axis: Array, angle: float) -> Array:
    """Return the matrix of a rotation by ``angle`` about a unit ``axis`` (Rodrigues)."""
    sine, cosine = math.sin(angle), math.cos(angle)
    return cosine * np.eye(3) + sine * skew(axis) + (1.0 - cosine) * np.outer(axis, axis)


def sequence(rotations: Iterable[tuple[Array, float]]) -> Array:
    """Return the (3, 3) matrix of intrinsic rotations given as pairs of unit axis and angle, rad, in order; entries
    within 1e-10 of 0, 1 or -1 are exact."""
    matrix = np.eye(3)
    for axis, angle in rotations:
        matrix = matrix @ snapped_rotation(about_axis(axis, angle))
    return snapped_rotation(matrix)


def frame_about(axis: Array, x_axis: Array | None = None) -> Array:
    """Return a right-handed (3, 3) matrix whose third column is a unit ``axis``; exact for coordinate axes.

    Parameters
    ----------
    x_axis : (3,) array, optional
        The first column is along the component of ``x_axis`` orthogonal to ``axis``; by default the coordinate axis
        farthest from ``axis``, the first of several equally distant axes.
    """
    sizes = np.abs(axis)
    wanted = np.eye(3)[first_near(sizes.tolist(), sizes.min())] if x_axis is None else x_axis
    across = wanted - (wanted @ axis) * axis
    first = across / np.linalg.norm(across)
    return snapped_rotation(np.column_stack([first, np.cross(axis, first), axis]))


def roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Array:
    """Return the (3, 3) matrix of URDF's ``rpy``, angles in rad: extrinsic about x, y, z, that is intrinsic about z, y,
    x; entries near 0 or 1 are not rounded."""
    if roll == pitch == yaw == 0.0:  # of most elements
        return np.eye(3)
    turns = ((2, yaw), (1, pitch), (0, roll))
    about_z, about_y, about_x = (_about_coordinate_axis(axis, angle) for axis, angle in turns)
    return about_z @ about_y @ about_x


def _about_coordinate_axis(axis: int, angle: float) -> Array:
    """Return the (3, 3) matrix of a rotation by ``angle``, rad, about a coordinate ``axis``, 0 to 2, with the
    same bits as ``about_axis``."""
    sine, cosine = math.sin(angle), math.cos(angle)
    matrix = np.zeros((3, 3))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix[axis, axis] = cosine + (1.0 - cosine)
    matrix[first, first] = matrix[second, second] = cosine
    matrix[second, first], matrix[first, second] = sine + 0.0, 0.0 - sine
    return matrix


def quaternion_of(rotations: Iterable[tuple[Array, float]]) -> tuple[float, float, float, float]:
    """Return the unit quaternion (w, x, y, z) of intrinsic rotations given as pairs (unit axis, angle in rad), in
    order. Its sign follows from the product of half angles."""
    quaternion = np.array([1.0, 0.0, 0.0, 0.0])
    for axis, angle in rotations:
        turn = np.array([math.cos(angle / 2.0), *(math.sin(angle / 2.0) * axis)])
        quaternion = quaternion_product(quaternion, turn)
    w, x, y, z = unit(quaternion).tolist()
    return w, x, y, z


def is_rotation(matrix: Array) -> bool:
    """Return whether a matrix is orthonormal and right-handed, to 1e-6."""
    if not np.max(np.abs(matrix)) <= 1.0 + ALIKE:  # before squares of large numbers overflow
        return False
    return bool(np.max(np.abs(matrix @ matrix.T - np.eye(3))) <= ALIKE and np.linalg.det(matrix) > 0.0)


def rows(matrix: Array) -> tuple[tuple[float, float, float], ...]:
    """Return a 3x3 matrix as a tuple of rows of plain floats."""
    return tuple((float(row[0]), float(row[1]), float(row[2])) for row in matrix)


def quaternion_of_matrix(m: Sequence[Sequence[float]]) -> tuple[float, float, float, float]:
    """Return the unit quaternion (w, x, y, z) of a rotation matrix (Shepperd's largest-component rule).

    w is positive; for angles within tolerance of pi, w is about 0 and the first of the largest components is positive,
    so that signs of poses do not change there.
    """
    squares = [
        1.0 + m[0][0] + m[1][1] + m[2][2],
        1.0 + m[0][0] - m[1][1] - m[2][2],
        1.0 - m[0][0] + m[1][1] - m[2][2],
        1.0 - m[0][0] - m[1][1] + m[2][2],
    ]
    largest = max(range(4), key=squares.__getitem__)
    scale = 0.5 / math.sqrt(squares[largest])
    pairs = {
        (0, 1): m[2][1] - m[1][2],
        (0, 2): m[0][2] - m[2][0],
        (0, 3): m[1][0] - m[0][1],
        (1, 2): m[1][0] + m[0][1],
        (1, 3): m[0][2] + m[2][0],
        (2, 3): m[2][1] + m[1][2],
    }
    parts = [
        squares[largest] * scale if k == largest else pairs[min(k, largest), max(k, largest)] * scale for k in range(4)
    ]
    sizes = [abs(part) for part in parts]
    leading = 0 if sizes[0] > ALIKE else first_near(sizes, max(sizes))
    sign = -1.0 if parts[leading] < 0.0 else 1.0
    w, x, y, z = (sign * part for part in parts)
    return w, x, y, z
