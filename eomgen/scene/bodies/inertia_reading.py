"""Reading of section inertia of geometrically exact beams: key by key, from a section, or as a matrix."""

from __future__ import annotations

from eomgen.formula.nodes import ZERO, Formula, Vector
from eomgen.scene.bodies.arithmetic import product, total
from eomgen.scene.bodies.beam_keys import Keys
from eomgen.scene.bodies.section_inertia import MovesAsRigidSection, SectionInertia, inertia_of_matrix
from eomgen.scene.bodies.section_reading import SectionReader
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import Values

#: Keys in whose place the matrix stands.
_BY_KEYS = ("mass_per_length", "rotary_inertia", "center_of_mass", "section")
_NONE = SectionInertia(ZERO, (ZERO, ZERO, ZERO))


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
    return _NONE if values.report.concerns(place) else inertia_of_matrix(matrix)


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
