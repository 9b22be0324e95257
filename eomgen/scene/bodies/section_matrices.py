"""Inertia and stiffness of sections of geometrically exact beams as 6 x 6 matrices: reading of the inertia, key by key,
from a section, or as a matrix; conditions on both.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from eomgen.base.arrays import Array, Flags, Numbers
from eomgen.base.data import dataclass
from eomgen.formula.nodes import ZERO, Formula, Vector
from eomgen.scene.bodies.arithmetic import folded, product, total
from eomgen.scene.bodies.beam_schema import Keys
from eomgen.scene.bodies.cosserat import CONSTRAINED, STRAINS
from eomgen.scene.bodies.cross_sections import SectionReader
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.geometry.inertia import NO_INERTIA, impossible
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import Values

#: Part of the largest entry by which entries across the diagonal may differ: written matrices have few digits.
_ROUNDING = 1e-9
#: Eigenvalue of a matrix scaled to a diagonal of 1 that is none.
_NONE = 1e-12
_DEFINITE = "a positive definite matrix"


@dataclass(frozen=True)
class ResistsItsStrains:
    """Rule for the 36 entries of the stiffness of a section, row by row, of a beam of a model."""

    stage: ClassVar[int] = 1

    model: str

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        matrices = np.stack(np.broadcast_arrays(*numbers), axis=-1).astype(float).reshape(-1, 6, 6)
        result = np.array([bool(_stiffness_fault(matrix, self.model)[0]) for matrix in matrices])
        return result.reshape(np.broadcast_shapes(*map(np.shape, numbers)))

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        return _stiffness_fault(np.array(numbers, dtype=float).reshape(6, 6), self.model)


def unlike(matrix: Array) -> tuple[int, int] | None:
    """Return the first entry of a matrix that differs from its mirror across the diagonal; None if it is symmetric."""
    result = np.argwhere(np.abs(matrix - matrix.T) > _ROUNDING * float(np.max(np.abs(matrix))))
    return (int(result[0][0]), int(result[0][1])) if len(result) else None


def _stiffness_fault(matrix: Array, model: str) -> tuple[str, str]:
    """Return the fault of a stiffness matrix and a hint, both empty for a valid one: a matrix without a potential, one
    that does not resist some strain, or one that resists a strain that the model constrains."""
    if not np.all(np.isfinite(matrix)):
        return "", ""
    if (pair := unlike(matrix)) is not None:
        fault = f"the matrix is not symmetric, so it has no potential: entry [{pair[0]}][{pair[1]}] differs from"
        return f"{fault} [{pair[1]}][{pair[0]}]", "the mean of both"
    for place in map(STRAINS.index, CONSTRAINED[model]):
        if matrix[place].any():
            fault = f"a beam of the model {model} has no {STRAINS[place]}, and row [{place}] of the matrix is not 0"
            return fault, "0 in rows and columns of strains that it does not have"
    free = [place for place, strain in enumerate(STRAINS) if strain not in CONSTRAINED[model]]
    diagonal = np.diag(matrix)
    if weak := [place for place in free if not diagonal[place] > 0.0]:
        place = min(weak, key=lambda place: float(diagonal[place]))
        entry = f"entry [{place}][{place}] is {matrix[place, place]:.6g}"
        return f"the section does not resist {STRAINS[place]}: {entry}", _DEFINITE
    scale = np.sqrt(diagonal[free])
    smallest = float(np.linalg.eigvalsh(matrix[np.ix_(free, free)] / np.outer(scale, scale))[0])
    if smallest > _NONE:
        return "", ""
    fault = "the matrix is not positive definite, so the section gives way to some strain: scaled to a diagonal of 1,"
    return f"{fault} its smallest eigenvalue is {smallest:.6g}", _DEFINITE


#: Part of its size by which a block of a matrix may miss its form: written matrices have few digits.
_INERTIA_ROUNDING = 1e-6
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
        result = np.array([bool(_inertia_fault(matrix)[0]) for matrix in matrices])
        return result.reshape(np.broadcast_shapes(*map(np.shape, numbers)))

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        return _inertia_fault(np.array(numbers, dtype=float).reshape(6, 6))


def _inertia_fault(matrix: Array) -> tuple[str, str]:
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
        if np.any(apart > _INERTIA_ROUNDING * scale):
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


#: Keys in whose place the matrix stands.
_BY_KEYS = ("mass_per_length", "rotary_inertia", "center_of_mass", "section")
_ZEROS = SectionInertia(ZERO, (ZERO, ZERO, ZERO))


def read_inertia(keys: Keys, section: SectionReader | None, values: Values) -> SectionInertia:
    """Return the inertia of a section; missing and faulty values go to the report of ``values``."""
    if keys["inertia_matrix"] is not None:
        return _of_matrix(keys, values)
    mass = _mass_per_length(keys, section, values)
    rotary = _rotary_inertia(keys, section, values)
    given = keys["center_of_mass"]
    if given is None:
        return SectionInertia(mass, rotary)
    place = keys.of("center_of_mass")
    y, z = (values.formula(f"{place}[{axis}]", part, PARAMETERS) for axis, part in enumerate(given))
    return SectionInertia(mass, rotary, (y, z))


def _of_matrix(keys: Keys, values: Values) -> SectionInertia:
    place = keys.of("inertia_matrix")
    for field in _BY_KEYS:
        if keys[field] is not None and keys.together(field, "inertia_matrix"):
            values.report.add(keys.of(field), f"{field} is given, and inertia_matrix too, which has it", "one of them")
    matrix = [
        [values.formula(f"{place}[{row}][{column}]", entry, PARAMETERS) for column, entry in enumerate(line)]
        for row, line in enumerate(keys["inertia_matrix"])
    ]
    if not values.report.concerns(place):
        values.require(place, MovesAsRigidSection(), [entry for line in matrix for entry in line])
    return _ZEROS if values.report.concerns(place) else inertia_of_matrix(matrix)


def _mass_per_length(keys: Keys, section: SectionReader | None, values: Values) -> Formula:
    given = keys["mass_per_length"]
    if given is not None:
        if section is not None and keys.together("mass_per_length", "section"):
            fault = "mass_per_length is given, and follows from the section too"
            values.report.add(keys.of("mass_per_length"), fault, "one of them")
        return values.formula(keys.of("mass_per_length"), given, PARAMETERS)
    if section is None:
        fault, hint = "the key mass_per_length is missing", "mass_per_length = ..., or a section"
        values.report.add(keys.key, fault, hint)
        return ZERO
    return product(section.density, section.needed("area"))


def _rotary_inertia(keys: Keys, section: SectionReader | None, values: Values) -> Vector:
    given = keys["rotary_inertia"]
    if given is not None:
        entries = values.vector(keys.of("rotary_inertia"), given, PARAMETERS)
        if not values.report.concerns(keys.of("rotary_inertia")):
            values.require(keys.of("rotary_inertia"), RELATIONS["rotary inertia"], entries)
        return _not_thin(keys.of("rotary_inertia"), entries, values)
    if section is None:
        fault = "the sections have no rotary inertia, without which their rotations have none"
        values.report.add(keys.key, fault, "rotary_inertia = [polar, about y, about z], or a section")
        return ZERO, ZERO, ZERO
    across_y, across_z = section.needed_pair("second_moments")
    density = section.density
    result = product(density, total(across_y, across_z)), product(density, across_z), product(density, across_y)
    return _not_thin(keys.of("section"), result, values)


def _not_thin(key: str, entries: Vector, values: Values) -> Vector:
    """Require of the rotary inertia of sections that all three are there to the digits of numbers."""
    if not values.report.concerns(key):
        values.require(key, RELATIONS["thin section"], entries)
    return entries
