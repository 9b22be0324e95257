"""Mass properties of bodies as numbers: inertias turned, moved to another point (Steiner) and combined, and whether
they are physical or singular.

Conditions on the second moments of a density: Wensing, Kim, Slotine, "Linear matrix inequalities for physically
consistent inertial parameter identification", IEEE RA-L 3(1), 2018.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array, Flags, Numbers
from eomgen.base.data import dataclass
from eomgen.base.rounding import SUMMED, WRITTEN
from eomgen.lie.numeric import skew

_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
#: Places of (xx, yy, zz, xy, xz, yz) in a symmetric matrix.
PLACES = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])
#: A moment of inertia below this part of the largest is none.
NO_INERTIA = SUMMED


@dataclass(frozen=True)
class Inertia:
    """Mass, kg, centre of mass (3,), m, and inertia (3, 3) about the centre of mass, kg m^2, in the axes of one
    frame."""

    mass: float
    center: Array
    about_center: Array

    def transform(self, orientation: Array, position: Array) -> Inertia:
        """Return the inertia in a frame in which the present one sits at ``position`` and ``orientation``."""
        about = tensor(rotate_inertia(orientation, entries_of(self.about_center)))
        return Inertia(self.mass, orientation @ self.center + position, about)

    def spatial(self, length: float) -> Array:
        """Return the (6, 6) spatial inertia about the frame's origin, angular part first, with lengths in multiples of
        ``length``, m, so that all entries are in kg."""
        arm = skew(self.mass * self.center) / length
        spatial = np.empty((6, 6))
        about_origin = self.about_center + tensor(steiner(self.mass, self.center.tolist()))
        spatial[:3, :3], spatial[:3, 3:] = about_origin / length**2, arm
        spatial[3:, :3], spatial[3:, 3:] = arm.T, self.mass * np.eye(3)
        return spatial


NOTHING = Inertia(0.0, np.zeros(3), np.zeros((3, 3)))


def tensor(entries: Sequence[Numbers]) -> Array:
    """Return the (3, 3) matrix of (xx, yy, zz, xy, xz, yz)."""
    return np.asarray(np.array(entries)[PLACES])


def entries_of(matrix: Array) -> list[Numbers]:
    """Return (xx, yy, zz, xy, xz, yz) of a symmetric (3, 3) matrix."""
    return [matrix[i, j].item() for i, j in _ENTRIES]


def rotate_inertia(rotation: Array, entries: Sequence[Numbers]) -> list[Numbers]:
    """Return the entries of R I R^T for a symmetric I with entries (xx, yy, zz, xy, xz, yz), numbers or batches."""
    xx, yy, zz, xy, xz, yz = entries
    rows = rotation.tolist()
    along = [(xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z) for x, y, z in rows]
    return [rows[i][0] * along[j][0] + rows[i][1] * along[j][1] + rows[i][2] * along[j][2] for i, j in _ENTRIES]


def steiner(mass: Numbers, arm: Sequence[Numbers]) -> list[Numbers]:
    """Return the entries (xx, yy, zz, xy, xz, yz) of m (|r|^2 1 - r r^T) for a mass at r, numbers or batches."""
    x, y, z = arm
    return [mass * part for part in (y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z)]


def combine_inertias(parts: Sequence[Inertia]) -> Inertia:
    """Return the inertia of several bodies fixed to one another, all in one frame, about their common centre of mass;
    zero mass at the origin, with the sum of the inertias, if all masses are zero."""
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
    """Return the reason why no real body has a mass, kg, and an inertia (3, 3) about the centre of mass, as a clause:
    negative mass or moment, or the triangle inequality; empty for a possible body."""
    if mass < 0.0:
        return f"the mass {mass:.6g} is negative [E1709]"
    moments = np.linalg.eigvalsh(about_center)
    listed = ", ".join(f"{moment:.6g}" for moment in moments)
    if _not_positive(moments):
        return f"the inertia is not positive semidefinite: its principal moments are {listed} [E1785]"
    if _one_sided(moments, 0.0):
        others = moments[0] + moments[1]
        excess = f" by {100.0 * (moments[2] / others - 1.0):.2g} %" if 2.0 * others > moments[2] else ""
        fault = "violate the triangle inequality: the largest exceeds the sum of the other two"
        return f"the principal moments {listed} {fault}{excess} [E1786]"
    return ""


def _not_positive(moments: NDArray[np.floating[Any]]) -> NDArray[np.bool_]:
    """Return whether one of the principal moments (..., 3), increasing, is negative."""
    return np.asarray(moments[..., 0] < -WRITTEN * np.max(np.abs(moments), axis=-1))


def _one_sided(moments: NDArray[np.floating[Any]], tolerance: float) -> NDArray[np.bool_]:
    """Return a flag for each triple of principal moments (..., 3), increasing, whose largest exceeds the sum of the
    other two by more than the part ``tolerance`` of this sum."""
    others, largest = moments[..., 0] + moments[..., 1], moments[..., 2]
    return np.asarray((1.0 + tolerance) * others < largest - WRITTEN * np.max(np.abs(moments), axis=-1))


def not_physical(entries: Sequence[Numbers], tolerance: float = 0.0, *, rotors: bool = False) -> Flags:
    """Return flags of inertias (xx, yy, zz, xy, xz, yz) about a centre of mass that no real body has, numbers or
    batches: a negative principal moment, or a moment larger than the other two together.

    Both conditions are that half the trace less the inertia, the second moments of the density, is positive
    semidefinite.

    Parameters
    ----------
    tolerance : part of the sum of two principal moments by which the third one may exceed the sum
    rotors : whether inertia about one axis alone is accepted, which stands for a rotor whose other moments belong to
        its carrier
    """
    moments = _principal_moments(entries)
    one_sided = _one_sided(moments, tolerance)
    if rotors:
        one_sided = one_sided & (moments[..., 1] > WRITTEN * moments[..., 2])
    return _not_positive(moments) | one_sided


def not_positive(*entries: Numbers) -> Flags:
    """Return flags of symmetric matrices (xx, yy, zz, xy, xz, yz), numbers or batches, with a negative moment."""
    return _not_positive(_principal_moments(entries))


def stack_numbers(entries: Sequence[Numbers]) -> Array:
    """Return numbers, or batches that broadcast, as one array (..., n); numbers alone without broadcasting, which is
    ten times slower."""
    batches = any(isinstance(entry, np.ndarray) for entry in entries)
    return np.stack(np.broadcast_arrays(*entries), axis=-1) if batches else np.array(entries, dtype=float)


def _principal_moments(entries: Sequence[Numbers]) -> Array:
    """Return the eigenvalues (..., 3), increasing, of symmetric matrices (xx, yy, zz, xy, xz, yz), numbers or batches;
    ones for matrices that are not finite."""
    numbers = stack_numbers(entries)
    finite = np.isfinite(numbers).all(axis=-1, keepdims=True)
    if numbers.ndim == 1 and not numbers[3:].any():  # along the axes, as most inertias are
        return np.sort(np.where(finite, numbers[:3], 1.0))
    return np.linalg.eigvalsh(np.where(np.expand_dims(finite, -1), numbers[..., PLACES], np.eye(3)))
