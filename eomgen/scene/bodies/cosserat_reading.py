"""Reading of geometrically exact beams: sections, damping and the shape at rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from eomgen.formula.nodes import ZERO, Formula, Number
from eomgen.scene.bodies import beam_schema as written
from eomgen.scene.bodies.arithmetic import product, total
from eomgen.scene.bodies.cosserat import CONSTRAINED, STRAINS, Cosserat, Rows
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.values import Values
from eomgen.text import key_of

#: Keys that belong to one model alone.
_OF_DEFLECTIONS = (
    "start", "polar_inertia", "mass_profile", "polar_profile", "order", "stiffening", "bending_y", "bending_z",
    "stretch", "torsion",
)  # fmt: skip  # a table
_OF_EXACT = (
    "elements", "stiffness", "stiffness_matrix", "damping", "stiffness_damping", "rotary_inertia", "curvature",
)  # fmt: skip  # a table
#: What nothing can be made of goes on with these.
_SECTION_UNKNOWN = (Number(math.nan),) * 6


def is_exact(entry: written.Beam) -> bool:
    """Return whether a beam is geometrically exact."""
    return entry.model in CONSTRAINED


def check_keys(name: str, entry: written.Beam, values: Values) -> None:
    """Report the keys of a beam that belong to another model than its own."""
    exact, model = is_exact(entry), entry.model or "euler_bernoulli"
    for field in _OF_DEFLECTIONS if exact else _OF_EXACT:
        if field in entry.model_fields_set:
            what = f"a beam of the model {model} has no {field}"
            hint = _COUNTERPARTS.get(field, "without it") if exact else 'model = "cosserat"'
            values.report.add(key_of("beams", name, field), what, hint)
    if not exact and entry.section is not None and entry.section.shear_factors is not None:
        what = "a beam of the model euler_bernoulli does not shear"
        values.report.add(key_of("beams", name, "section", "shear_factors"), what, 'model = "cosserat"')
    if exact:
        _check_strains(name, entry, values)


def _check_strains(name: str, entry: written.Beam, values: Values) -> None:
    """Report stiffnesses and damping of strains that a beam does not have."""
    model = str(entry.model)
    without = CONSTRAINED[model]
    factors = entry.section is not None and entry.section.shear_factors is not None and "shear_y" in without
    given = [("section", "shear_factors")] if factors else []
    for field in ("stiffness", "damping"):
        table = getattr(entry, field)
        given += [(field, strain) for strain in without if table is not None and strain in table.model_fields_set]
    for parts in given:
        what = f"a beam of the model {model} does not {'stretch' if parts[1] == 'stretch' else 'shear'}"
        models = [other for other, strains in CONSTRAINED.items() if parts[1] not in strains and other != model]
        hint = " or ".join(f'model = "{other}"' for other in (models if parts[1] in STRAINS else ["cosserat"]))
        values.report.add(key_of("beams", name, *parts), what, f"without it, or {hint}")


_COUNTERPARTS: Mapping[str, str] = {
    "start": "the frame at the beam's first end",
    "polar_inertia": "rotary_inertia = [polar, about y, about z]",
    **dict.fromkeys(("bending_y", "bending_z", "stretch", "torsion"), "stiffness = { ... }, for all strains at once"),
}


def read_cosserat(name: str, entry: written.Beam, values: Values) -> Cosserat:
    """Return a geometrically exact beam; what is wrong with it goes to the report of ``values``."""
    key, report = key_of("beams", name), values.report
    length = values.constant(f"{key}.length", entry.length)
    if not length > 0.0:
        report.add(f"{key}.length", f"the length of a beam is {length:.6g}", "a number above 0")
    if entry.elements is None:
        report.add(key, f"a beam of the model {entry.model} needs the number of its elements", "elements = 16")
    elements = entry.elements or 1
    mass = _mass_per_length(key, entry, values)
    stiffness = _stiffness(key, entry, values)
    beam = Cosserat(
        name,
        length if length > 0.0 else 1.0,
        elements,
        mass,
        _rotary_inertia(key, entry, values),
        stiffness,
        _damping(key, entry, stiffness, values),
        str(entry.model),
        _curvature(key, entry, values),
    )
    _check_fold(key, beam, values)
    return beam


def _mass_per_length(key: str, entry: written.Beam, values: Values) -> Formula:
    section = entry.section
    if entry.mass_per_length is not None:
        if section is not None:
            what = "mass_per_length is given, and follows from the section too"
            values.report.add(f"{key}.mass_per_length", what, "one of them")
        return values.formula(f"{key}.mass_per_length", entry.mass_per_length, PARAMETERS)
    if section is None:
        values.report.add(key, "the key mass_per_length is missing", "mass_per_length = ..., or a section")
        return ZERO
    return product(*(_of_section(key, section, field, values) for field in ("density", "area")))


def _of_section(key: str, section: written.Section, field: str, values: Values) -> Formula:
    """Return a value of the section; what is not there is reported."""
    given = getattr(section, field)
    if given is None:
        what = f"the section has no {field}, which a geometrically exact beam needs"
        values.report.add(f"{key}.section", what, f"{field} = ..., or stiffness = {{ ... }} without a section")
        return ZERO
    return values.formula(f"{key}.section.{field}", given, PARAMETERS)


def _pair_of_section(key: str, section: written.Section, field: str, values: Values) -> list[Formula]:
    given: Sequence[float | str] | None = getattr(section, field)
    if given is None:
        _of_section(key, section, field, values)
        return [ZERO, ZERO]
    return [values.formula(f"{key}.section.{field}[{place}]", part, PARAMETERS) for place, part in enumerate(given)]


def _rotary_inertia(key: str, entry: written.Beam, values: Values) -> tuple[Formula, Formula, Formula]:
    if entry.rotary_inertia is not None:
        return values.vector(f"{key}.rotary_inertia", entry.rotary_inertia, PARAMETERS)
    if entry.section is None:
        what = "the sections have no rotary inertia, without which their rotations have none"
        values.report.add(key, what, "rotary_inertia = [polar, about y, about z], or a section")
        return ZERO, ZERO, ZERO
    density = _of_section(key, entry.section, "density", values)
    across_y, across_z = _pair_of_section(key, entry.section, "second_moments", values)
    return product(density, total(across_y, across_z)), product(density, across_z), product(density, across_y)


def _stiffness(key: str, entry: written.Beam, values: Values) -> Rows:
    given = [field for field in ("stiffness", "stiffness_matrix") if getattr(entry, field) is not None]
    if len(given) == 2:
        values.report.add(f"{key}.stiffness_matrix", "stiffness and stiffness_matrix are both given", "one of them")
    free = [strain for strain in STRAINS if strain not in CONSTRAINED[str(entry.model)]]
    if entry.stiffness_matrix is not None:
        _check_matrix(f"{key}.stiffness_matrix", str(entry.model), entry.stiffness_matrix, values)
        return tuple(tuple(Number(number) for number in row) for row in entry.stiffness_matrix)
    if entry.stiffness is not None:
        return _diagonal(_given(f"{key}.stiffness", entry.stiffness, free, values))
    if entry.section is None:
        what = "the sections have no stiffness"
        values.report.add(key, what, f"stiffness = {{ {free[-1]} = ..., ... }}, stiffness_matrix, or a section")
        return _diagonal(_SECTION_UNKNOWN)
    section = entry.section
    modulus, area, shear, torsion = (
        _of_section(key, section, field, values)
        for field in ("elastic_modulus", "area", "shear_modulus", "torsion_constant")
    )
    across_y, across_z = _pair_of_section(key, section, "second_moments", values)
    shears = "shear_y" in free
    along_y, along_z = _pair_of_section(key, section, "shear_factors", values) if shears else (ZERO, ZERO)
    found = {
        "torsion": product(shear, torsion),
        "bending_z": product(modulus, across_z),
        "bending_y": product(modulus, across_y),
        "stretch": product(modulus, area),
        "shear_y": product(shear, area, along_y),
        "shear_z": product(shear, area, along_z),
    }
    return _diagonal([found[strain] if strain in free else ZERO for strain in STRAINS])


def _given(key: str, table: written.SectionStiffness, free: Sequence[str], values: Values) -> list[Formula]:
    """Return the stiffness by each strain, 0 for those that the beam does not have."""
    for strain in free:
        if getattr(table, strain) is None:
            values.report.add(key, f"the key {strain} is missing", f"{strain} = ...")
    return [
        values.formula(f"{key}.{strain}", getattr(table, strain), PARAMETERS)
        if strain in free and getattr(table, strain) is not None
        else ZERO
        for strain in STRAINS
    ]


def _damping(key: str, entry: written.Beam, stiffness: Rows, values: Values) -> Rows:
    own: Sequence[Formula] = (ZERO,) * 6
    if entry.damping is not None:
        own = [values.formula(f"{key}.damping.{kind}", getattr(entry.damping, kind), PARAMETERS) for kind in STRAINS]
    rows = _diagonal(own)
    if entry.stiffness_damping is None:
        return rows
    share = values.formula(f"{key}.stiffness_damping", entry.stiffness_damping, PARAMETERS)
    return tuple(
        tuple(
            total(part, product(share, elastic)) if elastic != ZERO else part
            for part, elastic in zip(*pair, strict=True)
        )
        for pair in zip(rows, stiffness, strict=True)
    )


def _curvature(key: str, entry: written.Beam, values: Values) -> tuple[float, float, float]:
    numbers = values.constants(f"{key}.curvature", entry.curvature or (0.0, 0.0, 0.0))
    x, y, z = numbers if all(map(math.isfinite, numbers)) else (0.0, 0.0, 0.0)
    return x, y, z


def _diagonal(entries: Sequence[Formula]) -> Rows:
    return tuple(tuple(entries[row] if row == column else ZERO for column in range(6)) for row in range(6))


def _check_matrix(key: str, model: str, given: Sequence[Sequence[float]], values: Values) -> None:
    """Report a stiffness without a potential, and one that does not resist some strain, or resists one too many."""
    matrix = np.array(given)
    size = float(np.max(np.abs(matrix)))
    for row, column in np.argwhere(np.abs(matrix - matrix.T) > 1e-9 * size).tolist():
        what = f"the matrix is not symmetric, so it has no potential: entry [{row}][{column}] differs from"
        values.report.add(key, f"{what} [{column}][{row}]", "the mean of both")
        return
    for place in map(STRAINS.index, CONSTRAINED[model]):
        if matrix[place].any():
            what = f"a beam of the model {model} has no {STRAINS[place]}, and row [{place}] of the matrix is not 0"
            values.report.add(key, what, "0 in rows and columns of strains that it does not have")
            return
    free = [place for place, strain in enumerate(STRAINS) if strain not in CONSTRAINED[model]]
    diagonal = np.diag(matrix)
    if weak := [place for place in free if not diagonal[place] > 0.0]:
        place = min(weak, key=lambda place: float(diagonal[place]))
        what = f"the section does not resist {STRAINS[place]}: entry [{place}][{place}] is {matrix[place, place]:.6g}"
        values.report.add(key, what, "a positive definite matrix")
        return
    scale = np.sqrt(diagonal[free])
    smallest = float(np.linalg.eigvalsh(matrix[np.ix_(free, free)] / np.outer(scale, scale))[0])
    if smallest <= 1e-12:
        what = (
            "the matrix is not positive definite, so the section gives way to some strain: scaled to a diagonal of 1,"
        )
        values.report.add(key, f"{what} its smallest eigenvalue is {smallest:.6g}", "a positive definite matrix")


def _check_fold(key: str, beam: Cosserat, values: Values) -> None:
    """Report a shape at rest of which an element turns by half a turn or more."""
    turn = beam.spacing * math.hypot(*beam.curvature)
    if turn >= math.pi:
        least = math.floor(turn * beam.elements / math.pi) + 1
        degrees = f"{math.degrees(turn):.6g} degrees"
        what = f"each of the {beam.elements} elements turns by {degrees} at rest, and only less than 180 can be told"
        values.report.add(f"{key}.curvature", what, f"elements = {4 * least}; {least} is the least")
