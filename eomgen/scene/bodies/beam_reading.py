"""Reading of beams: a body with the mass of the undeformed beam, and its deformation.

Properties along a beam are formulas times polynomials in s = (x - start) / length; only the formulas may be tunable.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Literal, cast

import numpy as np

from eomgen.base.data import replace
from eomgen.base.messages import key_of
from eomgen.formula.nodes import ZERO, ZERO_VECTOR, Formula, Number
from eomgen.formula.substitution import product, times, total
from eomgen.scene.bodies import beam_schema as written
from eomgen.scene.bodies.cross_sections import SectionReader
from eomgen.scene.bodies.model import KINDS, Beam, Body, Deformation, DeformationKind, free_nodal
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import Values, percent_of_critical

_UNIFORM = (1.0,)


def read_beam(name: str, entry: written.BeamEntry, values: Values) -> Body:
    """Return the body of an entry of [beams] with shape functions: mass properties of the straight beam, and
    deformation. Faults go to the report of ``values``, and other numbers stand for faulty ones."""
    key = key_of("beams", name)
    start = values.constant(f"{key}.start", entry.start)
    if entry.length is None:
        values.report.add(key, "the key length is missing [E1311]", "length = 1.0")
    length = 1.0 if entry.length is None else values.constant(f"{key}.length", entry.length)
    if length <= 0.0:
        values.report.add(f"{key}.length", f"the length of a beam is {length:.6g} [E1312]", "a number above 0")
    section = _Section(key, entry, values)
    mass_per_length, polar = section.mass_per_length(), section.polar_inertia()
    profiles = {
        "mass": _profile(f"{key}.mass_profile", entry.mass_profile, "mass", values),
        "polar": _profile(f"{key}.polar_profile", entry.polar_profile, "polar inertia", values),
    }
    line = Beam(start, length, mass_per_length, (), polar)
    deformations = []
    for kind in KINDS:
        entry_of_kind = getattr(entry, kind)
        if entry_of_kind is not None:
            profiles[kind] = _profile(f"{key}.{kind}.profile", entry_of_kind.profile, "stiffness", values)
            stiffness = section.stiffness(kind, entry_of_kind)
            deformations.append(_deformation(f"{key}.{kind}", kind, entry_of_kind, stiffness, line, values))
    if not deformations:
        fault = "the beam deforms in no way [E1313]"
        values.report.add(key, fault, f"one of {', '.join(KINDS)}, or a body of [bodies]")
    if entry.torsion is not None and not values.report.concerns(f"{key}.polar_inertia"):
        values.require(f"{key}.torsion", RELATIONS["inertia of torsion"], [polar])
    beam = replace(
        line,
        deformations=tuple(deformations),
        profiles={kind: profile for kind, profile in profiles.items() if profile != _UNIFORM},
        order=cast("Literal[1, 2]", entry.order),
        stiffening=entry.stiffening,
    )
    try:
        origin, span = (
            Fraction(number) if math.isfinite(number) else Fraction(1) for number in (beam.start, beam.length)
        )
        zeroth, first, second = (_moment(beam.profiles.get("mass", _UNIFORM), power) for power in range(3))
        polar = times(span * _moment(beam.profiles.get("polar", _UNIFORM), 0), beam.polar_inertia)
        across = times(span**3 * (second - first**2 / zeroth), beam.mass_per_length)
        center = Number(float(origin + span * first / zeroth))
        mass = times(span * zeroth, beam.mass_per_length)
        return Body(name, mass, (center, ZERO, ZERO), (polar, across, across, ZERO, ZERO, ZERO), beam)
    except OverflowError:
        fault = "the mass or the inertia of the beam is out of the range of double precision [E1314]"
        values.report.add(key, fault, "SI units")
        return Body(name, ZERO, ZERO_VECTOR, (ZERO,) * 6, beam)


def _moment(profile: Sequence[float], power: int) -> Fraction:
    """Return the integral of a polynomial times a power of s over s = 0 .. 1."""
    terms = (Fraction(entry) / (power_of_s + power + 1) for power_of_s, entry in enumerate(profile))
    return sum(terms, Fraction(0))


class _Section:
    """Masses and stiffnesses of a beam, as given or computed from the section."""

    def __init__(self, key: str, entry: written.BeamEntry, values: Values) -> None:
        self.key, self.entry, self.values = key, entry, values
        self.section = None if entry.section is None else SectionReader(f"{key}.section", entry.section, values)

    def mass_per_length(self) -> Formula:
        if self.entry.mass_per_length is not None:
            if self.entry.section is not None:
                fault = "mass_per_length is given, and follows from the section too [E1318]"
                self.values.report.add(f"{self.key}.mass_per_length", fault, "one of them")
            return self.values.formula(f"{self.key}.mass_per_length", self.entry.mass_per_length, PARAMETERS)
        if self.section is None:
            fault = "the key mass_per_length is missing [E1315]"
            self.values.report.add(self.key, fault, "mass_per_length = ..., or a section")
            return ZERO
        if self.section.area is None:
            if not self.values.report.concerns(self.section.key):
                self.values.report.add(self.section.key, "the key area is missing [E1316]", "area = ..., or a shape")
            return ZERO
        return product(self.section.density, self.section.area)

    def polar_inertia(self) -> Formula:
        if self.entry.polar_inertia is not None:
            return self.values.formula(f"{self.key}.polar_inertia", self.entry.polar_inertia, PARAMETERS)
        if self.section is None or self.section.second_moments is None:
            return ZERO
        return product(self.section.density, total(*self.section.second_moments))

    def stiffness(self, kind: DeformationKind, entry: written.Bending | written.Stretch | written.Torsion) -> Formula:
        """Return the stiffness of a deformation, N or N m^2, from ``entry`` or the section; zero, after a
        report, if both lack the stiffness."""
        key = f"{self.key}.{kind}.stiffness"
        if entry.stiffness is not None:
            return self.values.formula(key, entry.stiffness, PARAMETERS)
        hint, section = "a section", self.section
        if section is not None:
            (in_y, in_z), modulus = section.second_moments or (None, None), section.elastic_modulus
            factors, needed = {
                "stretch": ((modulus, section.area), "area"),
                "bending_y": ((modulus, in_y), "second_moments"),
                "bending_z": ((modulus, in_z), "second_moments"),
                "torsion": ((section.shear_modulus, section.torsion_constant), "shear_modulus and torsion_constant"),
            }[kind]
            if all(factors):
                return product(*filter(None, factors))
            if self.values.report.concerns(section.key):
                return ZERO
            hint = f"{needed} in the section"
        fault = "the key stiffness is missing [E1317]"
        self.values.report.add(f"{self.key}.{kind}", fault, f"stiffness = ..., or {hint}")
        return ZERO


def _profile(key: str, entries: Sequence[float | str], quantity: str, values: Values) -> tuple[float, ...]:
    """Return the coefficients, constant first, of a polynomial in s from 0 to 1 that multiplies a ``quantity`` of the
    beam; (1,) after a report, if the list is empty or the polynomial is not positive along the beam."""
    coefficients = tuple(values.constants(key, entries))
    if not coefficients:
        values.report.add(key, "the list of coefficients is empty [E1319]", "[1, -0.5]")
        return _UNIFORM
    if not all(math.isfinite(entry) for entry in coefficients):
        return _UNIFORM
    polynomial = np.polynomial.Polynomial(coefficients)
    roots = np.asarray(polynomial.deriv().roots(), complex)
    turns = [float(root.real) for root in roots if 0.0 < root.real < 1.0 and abs(root.imag) < 1e-9]
    lowest = min([0.0, *turns, 1.0], key=lambda s: float(polynomial(s)))
    if polynomial(lowest) <= 0.0:
        how = "vanishes" if polynomial(lowest) == 0.0 else f"is {float(polynomial(lowest)):.6g} of its value"
        text = f"the profile of the {quantity} {how} at s = {lowest:.6g} [E1320]"
        values.report.add(key, text, "coefficients of a polynomial above 0 for s from 0 to 1")
        return _UNIFORM
    return coefficients


def _deformation(
    key: str, kind: DeformationKind, entry: written.DeformationEntry, stiffness: Formula, beam: Beam, values: Values
) -> Deformation:
    """Return a deformation of a beam with modes, initial state, damping and masses; faults are reported under ``key``.
    ``stiffness`` is the stiffness of the sections, ``beam`` the beam without deformations. Masses are by the beam's
    mass, or polar inertia for torsion, per length."""
    modes = _modes(key, kind, entry, values)
    start, end = beam.start, beam.start + beam.length
    unit_mass = values.value(beam.polar_inertia if kind == "torsion" else beam.mass_per_length) or math.nan
    # of its children
    initial = cast("written.ElasticInitial | written.TwistInitial", getattr(entry, "initial"))  # noqa: B009
    position = _state(f"{key}.initial.position", initial.position, modes, values)
    velocity = _state(f"{key}.initial.velocity", initial.velocity, modes, values)
    ratio = values.constant(f"{key}.damping_ratio", entry.damping_ratio)
    if ratio < 0.0:
        values.report.add(f"{key}.damping_ratio", f"the damping ratio is {ratio:.6g} [E1321]", "0 or more")
    if note := percent_of_critical(ratio):
        values.notes.append(f"{key}.damping_ratio: {note}")
    masses: list[tuple[float, float, float]] = []
    for index, mass in enumerate(entry.masses):
        at, amount, inertia = values.keys(f"{key}.masses[{index}]", mass).values()
        if beam.is_beyond(at):
            fault = f"x = {at:.6g} m is beyond the beam, which goes from {start:.6g} m to {end:.6g} m [E1322]"
            values.report.add(f"{key}.masses[{index}].at", fault, "a place on the beam")
        for field, number in (("mass", amount), ("inertia", inertia)):
            if number < 0.0:
                fault = f"the {field} {number:.6g} is negative [E1323]"
                values.report.add(f"{key}.masses[{index}].{field}", fault, "0 or more")
        masses.append((beam.nearest(at), amount / unit_mass, inertia / unit_mass))
    return Deformation(
        kind=kind,
        shapes=entry.shapes,
        modes=modes,
        stiffness=stiffness,
        elements=entry.elements or 0,
        ends=entry.ends or Deformation.ends,
        damping_ratio=ratio,
        **values.keys(key, entry, "stiffness_damping", "inertia_factor"),
        initial_position=position,
        initial_velocity=velocity,
        nodal=entry.coordinates == "nodal",
        normalisation=entry.normalisation,
        masses=tuple(masses),
    )


def _modes(key: str, kind: DeformationKind, entry: written.DeformationEntry, values: Values) -> int:
    """Return the number of elastic coordinates of a deformation, as given or as the nodal coordinates of the mesh;
    report a missing or too large number, and keys that do not fit the shapes."""
    report = values.report
    meshed = entry.shapes == "finite_elements"
    for field in ("elements", "coordinates", "masses"):
        if getattr(entry, field) and not meshed:
            fault = f"{field} is for a mesh, and the shapes are {entry.shapes} [E1325]"
            report.add(f"{key}.{field}", fault, 'shapes = "finite_elements"')
    if entry.ends is not None and not meshed and entry.shapes != "polynomial":
        fault = f"the shapes {entry.shapes} have their own conditions at the ends [E1324]"
        report.add(f"{key}.ends", fault, f'shapes = "{entry.ends}", or "polynomial"')
    if meshed and entry.elements is None:
        report.add(key, "finite elements need their number [E1326]", "elements = 8")
    size = len(free_nodal(kind, entry.ends or Deformation.ends, entry.elements or 0))
    if entry.coordinates == "nodal" and meshed:
        if entry.modes not in (None, size):
            report.add(f"{key}.modes", f"the mesh has {size} nodal coordinates, not {entry.modes} [E1327]", "no modes")
        if size > (most := written.MOST_MODES):
            fault = f"{entry.elements} elements have {size} nodal coordinates, and {most} are the most [E1329]"
            report.add(f"{key}.elements", fault, "modal coordinates, with modes = 3")
        return max(size, 1)
    if entry.modes is None:
        report.add(key, "the key modes is missing [E1330]", "modes = 3")
        return 1
    rigid = (1 + kind.startswith("bending")) * (entry.ends == "free_free")
    if meshed and entry.elements is not None and entry.modes > size - rigid:
        fault = f"{entry.modes} modes are requested from a mesh that has {size - rigid} [E1328]"
        report.add(f"{key}.modes", fault, f"at most {size - rigid} modes, or more elements: 3 for each mode")
    return entry.modes


def _state(key: str, entries: Sequence[float | str], modes: int, values: Values) -> tuple[float, ...]:
    if entries and len(entries) != modes:
        count = f"{modes} values, one for each mode, are" if modes > 1 else "one value, for the one mode, is"
        values.report.add(key, f"{count} needed here, not {len(entries)} [E1331]", "")
        return ()
    return tuple(values.constants(key, entries))
