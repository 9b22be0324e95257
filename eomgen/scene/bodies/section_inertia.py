"""Inertia of sections of geometrically exact beams: the form of its 6 x 6 matrix, and the values read from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from eomgen.base.arrays import Array, Flags, Numbers
from eomgen.formula.nodes import ZERO, Formula
from eomgen.scene.bodies.arithmetic import folded
from eomgen.scene.bodies.section_stiffness import unlike
from eomgen.scene.geometry.inertia import NO_INERTIA, impossible

#: Part of its size by which a block of a matrix may miss its form: written matrices have few digits.
_ROUNDING = 1e-6
_FORM = "[[J, S], [-S, m]], of rotary inertia J, mass m, and S = m [[0, -z, y], [z, 0, 0], [-y, 0, 0]]"


@dataclass(frozen=True)
class SectionInertia:
    """Inertia of a section, with the fields of ``BeamSection``."""

    mass_per_length: Formula
    rotary_inertia: tuple[Formula, Formula, Formula]
    center_of_mass: tuple[Formula, Formula] = (ZERO, ZERO)
    products: tuple[Formula, Formula, Formula] = (ZERO, ZERO, ZERO)


def inertia_of_matrix(matrix: Sequence[Sequence[Formula]]) -> SectionInertia:
    """Return the inertia that a matrix about the beam's axis tells, with moments about the centre of mass.

    Twists (omega, v) of the section have the kinetic energy 1/2 twist^T matrix twist (Hodges, *Nonlinear Composite Beam
    Theory*, AIAA 2006, section 5.1, there with v first).
    """
    mass = matrix[3][3]
    by_y, by_z = matrix[0][5], matrix[1][3]
    y, z = folded(by_y / mass), folded(by_z / mass)
    xx, yy, zz = (matrix[place][place] for place in range(3))
    moments = (folded(xx - y * by_y - z * by_z), folded(yy - z * by_z), folded(zz - y * by_y))
    return SectionInertia(mass, moments, (y, z), (matrix[0][1], matrix[0][2], folded(matrix[1][2] + y * by_z)))


@dataclass(frozen=True)
class MovesAsRigidSection:
    """Rule for the 36 entries of the inertia of a section, row by row."""

    stage: ClassVar[int] = 1

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        matrices = np.stack(np.broadcast_arrays(*numbers), axis=-1).astype(float).reshape(-1, 6, 6)
        result = np.array([bool(_fault(matrix)[0]) for matrix in matrices])
        return result.reshape(np.broadcast_shapes(*map(np.shape, numbers)))

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        return _fault(np.array(numbers, dtype=float).reshape(6, 6))


def _fault(matrix: Array) -> tuple[str, str]:
    """Return the fault of an inertia matrix and a hint, both empty for a valid one."""
    if not np.all(np.isfinite(matrix)):
        return "", ""
    if (pair := unlike(matrix)) is not None:
        message = f"the matrix is not symmetric, as an inertia is: entry [{pair[0]}][{pair[1]}] differs from"
        return f"{message} [{pair[1]}][{pair[0]}]", "the mean of both"
    mass = matrix[3, 3]
    if not mass > 0.0:
        return f"the mass per length, entry [3][3], is {mass:.6g}", "a number above 0"
    y, z = matrix[0, 5] / mass, matrix[1, 3] / mass
    static = mass * np.array([[0.0, -z, y], [z, 0.0, 0.0], [-y, 0.0, 0.0]])
    size = float(np.sqrt(mass * np.abs(matrix[:3, :3]).max()))
    for block, corner, form, scale in (
        ("mass", (3, 3), mass * np.eye(3), mass),
        ("product of mass and place", (0, 3), static, size),
    ):
        given = matrix[corner[0] : corner[0] + 3, corner[1] : corner[1] + 3]
        apart = np.abs(given - form)
        if np.any(apart > _ROUNDING * scale):
            row, column = np.unravel_index(int(apart.argmax()), (3, 3))
            message = f"no rigid section has this inertia: entry [{corner[0] + row}][{corner[1] + column}], a {block},"
            return f"{message} is {given[row, column]:.6g} where {form[row, column]:.6g} belongs", _FORM
    about = matrix[:3, :3] - mass * np.array([[y * y + z * z, 0.0, 0.0], [0.0, z * z, -y * z], [0.0, -y * z, y * y]])
    least, _, largest = np.linalg.eigvalsh(about).tolist()
    hint = "moments about the beam's axis, not about the centre of mass"
    if not least > NO_INERTIA * largest:
        message = "the rotary inertia about the centre of mass is not positive definite: its smallest eigenvalue is"
        return f"{message} {least:.6g}", hint
    fault = impossible(mass, about)
    return (f"about the centre of mass, {fault}", hint) if fault else ("", "")
