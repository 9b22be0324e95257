"""Whether an inertia can belong to a real body, and whether a joint moves any inertia at all.

Conditions on the second moments of a density: Wensing, Kim, Slotine, "Linear matrix inequalities for physically consistent
inertial parameter identification", IEEE RA-L 3(1), 2018.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.scene.rotation import Array

_RELATIVE = 1e-6  # inertias are written with few digits; a violation below this is rounding


@dataclass(frozen=True)
class Inertia:
    """Mass, centre of mass (3,) and inertia (3, 3) about the centre of mass, in one frame."""

    mass: float
    center: Array
    about_center: Array

    def moved(self, orientation: Array, position: Array) -> Inertia:
        """Return the inertia in a frame in which the present one sits at ``position`` and ``orientation``."""
        turned = orientation @ self.about_center @ orientation.T
        return Inertia(self.mass, orientation @ self.center + position, (turned + turned.T) / 2.0)

    def about_origin(self) -> Array:
        """Return the (3, 3) inertia about the frame's origin (Steiner)."""
        center = self.center
        return self.about_center + self.mass * (center @ center * np.eye(3) - np.outer(center, center))


NOTHING = Inertia(0.0, np.zeros(3), np.zeros((3, 3)))


def tensor(entries: Sequence[float]) -> Array:
    """Return the (3, 3) matrix of (xx, yy, zz, xy, xz, yz)."""
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


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
        offset = part.center - center
        about = about + part.about_center + part.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return Inertia(mass, center, about)


def impossible(mass: float, about_center: Array) -> str:
    """Return why no real body has this mass and inertia; empty where one does."""
    if mass < 0.0:
        return f"the mass {mass:.6g} is negative"
    moments = np.linalg.eigvalsh(about_center)
    smallest, largest = float(moments[0]), float(np.max(np.abs(moments)))
    listed = ", ".join(f"{moment:.6g}" for moment in moments)
    if smallest < -_RELATIVE * largest:
        return f"the inertia is not positive semidefinite: its principal moments are {listed}"
    if moments[0] + moments[1] < moments[2] - _RELATIVE * largest:
        return f"the principal moments {listed} violate the triangle inequality: the largest exceeds the sum of the other two"
    return ""


def immovable(joint_type: str, axes: Array, carried: Inertia, rotor_inertias: Sequence[float], pitch: float = 0.0) -> str:
    """Return why a joint moves no inertia, so that M is singular; empty where it does.

    Parameters
    ----------
    joint_type : str
        A moving joint that carries one rigid assembly and no further moving joint.
    axes : (3, 3) array
        Axis (the normal of a planar joint), direction across it (a universal joint's second axis) and the third of
        the frame, in the joint's frame, row by row.
    carried : Inertia
        Of the assembly, in the joint's frame.
    rotor_inertias : sequence of float
        One for each velocity component.
    pitch : float
        Of a helical joint, m/rad.
    """
    rotor_inertia = max(rotor_inertias, default=0.0)
    if carried.mass == 0.0 and not carried.about_center.any() and rotor_inertia == 0.0:
        return "it carries neither mass nor inertia"
    axis, about_origin = axes[0], carried.about_origin()
    scale = float(np.max(np.abs(about_origin)))
    along_axis = carried.mass * pitch * pitch if joint_type == "helical" else 0.0
    turns = ("revolute", "helical", "cylindrical")
    if joint_type in turns and axis @ about_origin @ axis + along_axis + rotor_inertias[0] <= 1e-12 * scale:
        return "what it carries has no inertia about its axis"
    if joint_type in ("prismatic", "cylindrical") and carried.mass + rotor_inertias[-1] == 0.0:
        return "what it carries has no mass"
    if joint_type in ("universal", "planar"):
        return _immovable_by_two(joint_type, axes, carried, rotor_inertias)
    if joint_type == "spherical" and np.linalg.eigvalsh(about_origin)[0] <= 1e-12 * scale:
        return "what it carries has no inertia about some axis through its centre"
    if joint_type == "free":
        moments = np.linalg.eigvalsh(carried.about_center)
        if carried.mass == 0.0 or moments[0] <= 1e-12 * moments[2]:
            return "what it carries lacks mass, or inertia about some axis through its centre of mass"
    return ""


def _immovable_by_two(joint_type: str, axes: Array, carried: Inertia, rotor_inertias: Sequence[float]) -> str:
    """The same for joints of two elementary motions, whose M at neutral position is small enough to be looked at."""
    if joint_type == "universal":
        M = axes[:2] @ carried.about_origin() @ axes[:2].T
    else:
        coupling = carried.mass * np.cross(axes[0], carried.center) @ axes[1:].T
        turning = np.atleast_2d(axes[0] @ carried.about_origin() @ axes[0])
        M = np.block([[turning, coupling[np.newaxis]], [coupling[:, np.newaxis], carried.mass * np.eye(2)]])
    moments = np.linalg.eigvalsh(M + np.diag(rotor_inertias))
    if moments[0] <= 1e-12 * moments[-1]:
        needed = "two axes through its centre" if joint_type == "universal" else "its normal, or mass"
        return f"what it carries lacks inertia about {needed}"
    return ""
