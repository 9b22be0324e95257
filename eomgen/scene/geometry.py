"""Rotations and mass properties of bodies as numbers: right angles are exact, inertias are physical.

Constant rotations: from axis and angle, roll-pitch-yaw and quaternions, with right angles made exact.

A matrix maps the rotated frame's axes to the fixed frame's; sequences are intrinsic, in order.

All decisions on directions near a coordinate axis and angles near a right angle are made here. Within ``SNAP`` they are
made exact, which changes results by no more than that; beyond, a direction is like any other. A frame that has to be
chosen is the same for directions that differ by less than ``ALIKE``: it does not change between an axis and one a
little off a coordinate axis, or off a diagonal between two of them.

Mass properties of bodies, and whether they are physical.

Conditions on the second moments of a density: Wensing, Kim, Slotine, "Linear matrix inequalities for physically
consistent inertial parameter identification", IEEE RA-L 3(1), 2018.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array, Flags, Numbers
from eomgen.base.data import dataclass
from eomgen.formula.nodes import Formula
from eomgen.lie.numeric import quaternion_product, skew, unit


@dataclass(frozen=True)
class Rotation:
    """Rotation by ``angle`` about a unit ``axis``; lists of these are intrinsic, in order."""

    axis: tuple[float, float, float]
    angle: Formula


SNAP = 1e-10
#: Components of unit vectors and quaternions that differ by less say the same.
ALIKE = 1e-6
_ORTHONORMAL = 1e-14


class CoordinateAxis(NamedTuple):
    """A coordinate axis, 0 to 2, and which way along it, 1 or -1."""

    place: int
    sense: float

    @property
    def unit(self) -> tuple[float, float, float]:
        """The unit vector along it."""
        x, y, z = (self.sense if k == self.place else 0.0 for k in range(3))
        return x, y, z


def coordinate_axis(axis: Sequence[float]) -> CoordinateAxis | None:
    """Return the coordinate axis equal to a unit vector; None for any other vector, however near to an axis.

    A component of 1.0 is no proof: (1e-9, 0, 1) has length one in double precision.
    """
    along = [k for k in range(3) if axis[k] != 0.0]
    return CoordinateAxis(along[0], math.copysign(1.0, axis[along[0]])) if len(along) == 1 else None


def axis_beside(direction: Sequence[float]) -> CoordinateAxis | None:
    """Return the coordinate axis within ``ALIKE`` of a unit vector; None without one."""
    place = max(range(3), key=lambda k: abs(direction[k]))
    if any(abs(direction[k]) > ALIKE for k in range(3) if k != place):
        return None
    return CoordinateAxis(place, math.copysign(1.0, direction[place]))


def first_near(values: Sequence[float], wanted: float) -> int:
    """Return the place of the first value that is ``wanted`` within ``ALIKE``."""
    return next(place for place, value in enumerate(values) if abs(value - wanted) <= ALIKE)


def snapped(entries: Array) -> Array:
    """Return the entries with those within 1e-10 of 0, 1 or -1 rounded, which repairs angles written to few digits."""
    rounded = np.round(entries)
    return np.where((np.abs(entries - rounded) <= SNAP) & (np.abs(rounded) <= 1.0), rounded, entries) + 0.0


def snapped_rotation(matrix: Array) -> Array:
    """Return a rotation with right angles made exact, and still a rotation.

    If only some entries of a row are near 0 or 1, as for a turn by 1e-5, rounding them alone leaves the matrix skew
    by up to 1e-10; then the nearest rotation (the orthogonal polar factor) is taken instead.
    """
    result = snapped(matrix)
    if np.max(np.abs(result @ result.T - np.eye(3))) <= _ORTHONORMAL:
        return result
    u, _, v = np.linalg.svd(result)
    nearest = u @ v
    rounded = np.round(nearest)
    exact: Array = np.where(np.abs(nearest - rounded) <= _ORTHONORMAL, rounded, nearest) + 0.0
    return exact


def unit_axis(axis: Sequence[float]) -> Array | None:
    """Return the unit vector along ``axis``, snapped to coordinate axes; None for an axis without direction."""
    vector = np.array(axis, dtype=float)
    largest = float(np.max(np.abs(vector)))
    if not (math.isfinite(largest) and largest > 1e-150):
        return None
    vector = vector / largest
    result = snapped(vector / np.linalg.norm(vector))
    return result / np.linalg.norm(result)


def about_axis(axis: Array, angle: float) -> Array:
    """Return the matrix of a rotation by ``angle`` about a unit ``axis`` (Rodrigues)."""
    sine, cosine = math.sin(angle), math.cos(angle)
    return cosine * np.eye(3) + sine * skew(axis) + (1.0 - cosine) * np.outer(axis, axis)


def sequence(rotations: Iterable[tuple[Array, float]]) -> Array:
    """Return the matrix of intrinsic rotations, in order, snapped."""
    matrix = np.eye(3)
    for axis, angle in rotations:
        matrix = matrix @ snapped_rotation(about_axis(axis, angle))
    return snapped_rotation(matrix)


def frame_about(axis: Array, x_axis: Array | None = None) -> Array:
    """Return a right-handed matrix whose third column is a unit ``axis``; exact for coordinate axes.

    Parameters
    ----------
    x_axis : (3,) array, optional
        The first column is along its part across ``axis``; by default the coordinate axis farthest from ``axis``,
        the first of equally far ones.
    """
    sizes = np.abs(axis)
    wanted = np.eye(3)[first_near(sizes.tolist(), sizes.min())] if x_axis is None else x_axis
    across = wanted - (wanted @ axis) * axis
    first = across / np.linalg.norm(across)
    return snapped_rotation(np.column_stack([first, np.cross(axis, first), axis]))


def roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Array:
    """Return the matrix of URDF's ``rpy``: extrinsic about x, y, z, that is intrinsic about z, y, x; not snapped."""
    x, y, z = np.eye(3)
    return about_axis(z, yaw) @ about_axis(y, pitch) @ about_axis(x, roll)


def quaternion_of(rotations: Iterable[tuple[Array, float]]) -> tuple[float, float, float, float]:
    """Return the unit quaternion (w, x, y, z) of intrinsic rotations, in order."""
    quaternion = np.array([1.0, 0.0, 0.0, 0.0])
    for axis, angle in rotations:
        turn = np.array([math.cos(angle / 2.0), *(math.sin(angle / 2.0) * axis)])
        quaternion = quaternion_product(quaternion, turn)
    w, x, y, z = unit(quaternion).tolist()
    return w, x, y, z


def is_rotation(matrix: Array) -> bool:
    """Tell whether a matrix is orthonormal and right-handed, to 1e-6."""
    if not np.max(np.abs(matrix)) <= 1.0 + ALIKE:  # before squares of large numbers overflow
        return False
    return bool(np.max(np.abs(matrix @ matrix.T - np.eye(3))) <= ALIKE and np.linalg.det(matrix) > 0.0)


def rows(matrix: Array) -> tuple[tuple[float, float, float], ...]:
    """Return a 3x3 matrix as a tuple of rows of plain floats."""
    return tuple((float(row[0]), float(row[1]), float(row[2])) for row in matrix)


def quaternion_of_matrix(m: Sequence[Sequence[float]]) -> tuple[float, float, float, float]:
    """Return the unit quaternion (w, x, y, z) of a rotation matrix (Shepperd's largest-component rule).

    Its w is positive; for angles within tolerance of pi, w is about 0 and the first of the largest components is
    positive, so that signs of poses do not change there.
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


_RELATIVE = 1e-6  # inertias are written with few digits; a violation below this is rounding
_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
#: A moment of inertia below this part of the largest is none.
NO_INERTIA = 1e-12


@dataclass(frozen=True)
class Inertia:
    """Mass, centre of mass (3,) and inertia (3, 3) about the centre of mass, in one frame."""

    mass: float
    center: Array
    about_center: Array

    def moved(self, orientation: Array, position: Array) -> Inertia:
        """Return the inertia in a frame in which the present one sits at ``position`` and ``orientation``."""
        about = tensor(turned(orientation, entries_of(self.about_center)))
        return Inertia(self.mass, orientation @ self.center + position, about)

    def about_origin(self) -> Array:
        """Return the (3, 3) inertia about the frame's origin (Steiner)."""
        return self.about_center + tensor(steiner(self.mass, self.center.tolist()))


NOTHING = Inertia(0.0, np.zeros(3), np.zeros((3, 3)))


def tensor(entries: Sequence[Numbers]) -> Array:
    """Return the (3, 3) matrix of (xx, yy, zz, xy, xz, yz)."""
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def entries_of(matrix: Array) -> list[Numbers]:
    """Return (xx, yy, zz, xy, xz, yz) of a symmetric (3, 3) matrix."""
    return [matrix[i, j].item() for i, j in _ENTRIES]


def turned(rotation: Array, entries: Sequence[Numbers]) -> list[Numbers]:
    """Return the entries of R I R^T for a symmetric I by its entries (xx, yy, zz, xy, xz, yz), numbers or batches."""
    rows = rotation.tolist()
    along = [times(entries, row) for row in rows]
    return [dot(rows[i], along[j]) for i, j in _ENTRIES]


def times(entries: Sequence[Numbers], vector: Sequence[float]) -> tuple[Numbers, Numbers, Numbers]:
    """Return the product of a symmetric matrix by its entries (xx, yy, zz, xy, xz, yz) and a vector."""
    xx, yy, zz, xy, xz, yz = entries
    x, y, z = vector
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


def dot(first: Sequence[Numbers], second: Sequence[Numbers]) -> Numbers:
    """Return the product of two vectors of three components, numbers or batches."""
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


def steiner(mass: Numbers, arm: Sequence[Numbers]) -> list[Numbers]:
    """Return the entries (xx, yy, zz, xy, xz, yz) of m (|r|^2 1 - r r^T) for a mass at r, numbers or batches."""
    x, y, z = arm
    return [mass * part for part in (y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z)]


def combined(parts: Sequence[Inertia]) -> Inertia:
    """Return the inertia of several bodies fixed to one another, about their common centre of mass."""
    present = [part for part in parts if part.mass != 0.0 or part.about_center.any()]
    if len(present) == 1:
        return present[0]
    mass = sum(part.mass for part in present)
    if mass == 0.0:
        return Inertia(0.0, np.zeros(3), sum((part.about_center for part in present), np.zeros((3, 3))))
    center = sum((part.mass * part.center for part in present), np.zeros(3)) / mass
    about = np.zeros((3, 3))
    for part in present:
        about = about + part.about_center + tensor(steiner(part.mass, (part.center - center).tolist()))
    return Inertia(mass, center, about)


def impossible(mass: float, about_center: Array) -> str:
    """Return the reason why no real body has this mass and inertia; empty for a possible one."""
    if mass < 0.0:
        return f"the mass {mass:.6g} is negative"
    moments = np.linalg.eigvalsh(about_center)
    not_positive, one_sided = _impossible_moments(moments)
    listed = ", ".join(f"{moment:.6g}" for moment in moments)
    if not_positive:
        return f"the inertia is not positive semidefinite: its principal moments are {listed}"
    if one_sided:
        return (
            f"the principal moments {listed} violate the triangle inequality: the largest exceeds the sum of the"
            " other two"
        )
    return ""


def _impossible_moments(moments: NDArray[np.floating[Any]]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell whether principal moments (..., 3), increasing, are negative, and whether they violate the triangle
    inequality."""
    smallest, middle, largest = moments[..., 0], moments[..., 1], moments[..., 2]
    rounding = _RELATIVE * np.max(np.abs(moments), axis=-1)
    return np.asarray(smallest < -rounding), np.asarray(smallest + middle < largest - rounding)


def not_physical(entries: Sequence[Numbers]) -> Flags:
    """Tell of inertias (xx, yy, zz, xy, xz, yz) about a centre of mass, numbers or batches, whether no real body has
    them.

    Both conditions are that half the trace less the inertia, the second moments of the density, is positive
    semidefinite.
    """
    xx, yy, zz, xy, xz, yz = entries
    second_moments = (0.5 * (yy + zz - xx), 0.5 * (xx + zz - yy), 0.5 * (xx + yy - zz), -xy, -xz, -yz)

    def exactly(matrices: Array) -> Flags:
        not_positive, one_sided = _impossible_moments(np.linalg.eigvalsh(matrices))
        return not_positive | one_sided

    return _unless(smallest_moment_above(second_moments, 0.0), exactly, entries)


def singular(entries: Sequence[Numbers]) -> Flags:
    """Tell of symmetric matrices (xx, yy, zz, xy, xz, yz), numbers or batches, whether the smallest moment is none."""
    trace = entries[0] + entries[1] + entries[2]

    def exactly(matrices: Array) -> Flags:
        moments = np.linalg.eigvalsh(matrices)
        return np.asarray(moments[..., 0] <= NO_INERTIA * moments[..., -1])

    return _unless(smallest_moment_above(entries, 2.0 * NO_INERTIA * trace), exactly, entries)


def smallest_moment_above(entries: Sequence[Numbers], least: Numbers) -> Flags:
    """Tell of symmetric matrices whether their smallest eigenvalue is surely above ``least``; False is inconclusive.

    If the leading minors are positive, the product of the two larger eigenvalues is below the square of half the
    trace.
    """
    xx, yy, zz, xy, xz, yz = entries
    with np.errstate(over="ignore", invalid="ignore"):  # an overflow proves no bound
        minor = xx * yy - xy * xy
        determinant = zz * minor - xx * yz * yz - yy * xz * xz + 2.0 * xy * xz * yz
        trace = xx + yy + zz
        above = 4.0 * determinant > least * trace * trace
    return np.logical_and(
        np.logical_and(np.greater(xx, 0.0), np.greater(minor, 0.0)), np.logical_and(determinant > 0.0, above)
    )


def _unless(sure: Flags, exactly: Callable[[Array], Flags], entries: Sequence[Numbers]) -> Flags:
    """Return ``exactly`` of matrices (n, 3, 3); False for matrices that are ``sure`` or not finite."""
    sure = np.asarray(sure)
    result = np.zeros(sure.shape, dtype=bool)
    if not sure.all():
        judged = np.logical_not(sure)
        for entry in entries:
            judged = judged & np.isfinite(entry)
        xx, yy, zz, xy, xz, yz = (np.broadcast_to(entry, sure.shape)[judged] for entry in entries)
        result[judged] = exactly(np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=-1).reshape(-1, 3, 3))
    return result
