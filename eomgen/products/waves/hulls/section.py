"""Slender hulls in water: columns, pontoons and braces with buoyancy, added mass and drag."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Self

import numpy as np

from eomgen.base.arrays import Flags, Numbers
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import key_of
from eomgen.formula.nodes import Formula, Number, Vector
from eomgen.products.waves.formula.fields import WaveField
from eomgen.products.waves.section.level_water import level_gravity
from eomgen.scene.forces.element import Attach, ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.joints.frames import Site
from eomgen.scene.reading.key_metadata import Table, key, of_parameters
from eomgen.scene.reading.kinds import Triple, Value
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.requirements import Row, above_zero, not_below_zero
from eomgen.scene.section import Reading
from eomgen.system.description import BASE, WORLD


class HullEntry(Table):
    """A straight slender part of a rigid body in water."""

    body: str = key("body that carries the hull", refers="bodies", kind="rigid body, not the base")
    start: Triple = key(
        "one end of its axis, in the body's frame: the lower one of a column", unit="m", names=PARAMETERS
    )
    end: Triple = key("the other end", unit="m", names=PARAMETERS)
    diameter: Value = key("diameter across its axis", unit="m", names=PARAMETERS)
    area: Value | None = of_parameters("area of its section", unit="m^2", shown_default="of the circle")
    waves: str = key("waves around the hull", "", refers="waves", shown_default='`""`, water at rest')
    level: Value = key("z of water at rest, without `waves`", 0.0, unit="m", names=PARAMETERS)
    density: Value = key("density of the water", 1025.0, unit="kg/m^3", names=PARAMETERS)
    added_mass: Value = key("coefficient of the water that it moves across its axis", 1.0, names=PARAMETERS)
    wet: Value | None = of_parameters(
        "length from `start` on that moves water at rest, for the added mass", unit="m", shown_default="all of it"
    )
    drag: Value = key("coefficient of drag across its axis", 1.0, names=PARAMETERS)
    axial_added_mass: Value = key("water that `start` moves along the axis", 0.0, unit="kg", names=PARAMETERS)
    axial_drag: Value = key("force on `start` along the axis by squared velocity", 0.0, unit="kg/m", names=PARAMETERS)
    stations: int = key("places at which water is looked at", 8, ge=1, le=200, kind="whole number, 1 to 200")


@dataclass(frozen=True)
class Hull(ForceElement):
    """A straight slender part of a rigid body in water.

    Attributes
    ----------
    area : None for the area of the circle
    waves : None for water at rest
    wet : None for the whole length
    """

    section: ClassVar[str] = "hulls"
    law: ClassVar[str] = "eomgen.products.waves.hulls.law:LAW"
    added_masses: ClassVar[str] = "eomgen.products.waves.hulls.law:added_masses"

    body: str
    start: Vector  # body frame, formulas of parameters
    end: Vector
    diameter: Formula
    area: Formula | None
    waves: WaveField | None
    level: Formula
    density: Formula
    added_mass: Formula
    wet: Formula | None
    drag: Formula
    axial_added_mass: Formula
    axial_drag: Formula
    stations: int

    def passive(self) -> None:
        return None

    @property
    def adds_mass_to(self) -> str:
        return self.body if any(value != Number(0.0) for value in (self.added_mass, self.axial_added_mass)) else ""

    def lengths(self) -> tuple[Formula, ...]:
        return (self.diameter,)

    def places(self) -> Iterator[tuple[tuple[str, ...], str, Vector]]:
        yield ("start",), self.body, self.start
        yield ("end",), self.body, self.end

    def attached(self, at: Attach) -> Self:
        (body, start), (_, end) = at(("start",), self.body, self.start), at(("end",), self.body, self.end)
        return replace(self, body=body, start=start, end=end)


def _length(*ends: Numbers) -> Numbers:
    """Return the distance of two places, x, y and z of both, numbers or arrays."""
    x, y, z = (last - first for first, last in zip(ends[:3], ends[3:], strict=True))
    return np.hypot(np.hypot(x, y), z)  # squares of large numbers overflow


def _at_one_place(*ends: Numbers) -> Flags:
    return np.equal(_length(*ends), 0.0)


def _too_long(*numbers: Numbers) -> Flags:
    *ends, wet = numbers
    length = _length(*ends)
    return np.logical_and(np.greater(wet, length), np.greater(length, 0.0))


def _told_too_long(*numbers: float) -> str:
    *ends, wet = numbers
    return f"{wet:.6g} m of it move water, and it is {_length(*ends):.6g} m long [E1163]"


#: Of a hull's ends, and of the length that moves water.
_APART = Row(
    ("hulls.end",),
    _at_one_place,
    "both ends are at the same place, so it has no axis [E1162]",
    "ends at two places",
)
_WITHIN = Row(("hulls.wet",), _too_long, _told_too_long, "the distance of its ends or less")


def read_hull(name: str, entry: HullEntry, site: Site) -> Hull:
    """Return the hull of an entry, checked; ``site`` has bodies, beams and values. Faults are reported."""
    key, values, report = key_of("hulls", name), site.values, site.values.report
    if entry.body in (BASE, WORLD):
        why = "its motion is prescribed" if entry.body == BASE else "it rests"
        report.add(f"{key}.body", f"a hull on the {entry.body} has no effect: {why} [E1164]", "a body")
    elif entry.body in site.beams:
        fault = f"{entry.body} is a beam, and a hull is a part of a rigid body [E1165]"
        report.add(f"{key}.body", fault, "a distributed load by water_velocity.NAME(...) and velocity.here")
    else:
        check_reference(f"{key}.body", entry.body, site.bodies, "body", report)
    waves = None
    if entry.waves:
        known = values.names.entries.get("waves", {})
        if check_reference(f"{key}.waves", entry.waves, known, "wave", report):
            waves = known[entry.waves]
        values.mentioned.add(("waves", entry.waves))
        if entry.level != 0.0:
            report.add(f"{key}.level", "the waves have a level of their own [E1166]", f"level of [waves.{entry.waves}]")
    made: dict[str, Any] = {"area": None, "wet": None, "waves": waves}
    made |= values.keys(key, entry, "body", "start", "end", "area", "wet")
    ends = [*made["start"], *made["end"]]
    values.require(f"{key}.end", _APART, ends)
    if made["wet"] is not None:
        values.require(f"{key}.wet", _WITHIN, [*ends, made["wet"]])
    words = ("diameter", "level", "density", "added_mass", "drag", "axial_added_mass", "axial_drag", "stations")
    return Hull(name, **made, **values.keys(key, entry, *words))


_BOUNDS = {
    "start": None,
    "end": None,
    "level": None,
    "diameter": above_zero("the diameter of a hull [E1730]"),
    "area": above_zero("the area of a hull [E1731]"),
    "density": above_zero("the density of water [E1732]"),
    "wet": above_zero("the length that moves water [E1733]"),
    "added_mass": not_below_zero("the coefficient of added mass [E1757]"),
    "drag": not_below_zero("the coefficient of drag [E1758]"),
    "axial_added_mass": not_below_zero("the added mass along the axis [E1759]"),
    "axial_drag": not_below_zero("the drag along the axis [E1760]"),
}


class _Hulls(ElementSection):
    def read(self, reading: Reading) -> Mapping[str, Any]:
        document = reading.document
        if document.section("hulls") and not document.section("waves"):  # which require it for both
            level_gravity(reading)
        return super().read(reading)


SECTION = _Hulls(
    key="hulls",
    entry=HullEntry,
    model=Hull,
    reader=read_hull,
    bounds=_BOUNDS,
    positional=("body",),
    documentation="Add a slender part of a rigid body in water: buoyancy, added mass and drag.",
)
