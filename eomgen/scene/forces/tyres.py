"""Tyres in scene files, keys, bounds and data: point contacts between wheels and a road of given height, with slip."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from eomgen.base.data import dataclass
from eomgen.base.messages import key_of
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Number
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.formula.scope import FIXED_PARAMETERS, PARAMETERS, ROAD
from eomgen.scene.joints.frames import Site
from eomgen.scene.reading.key_metadata import Table, key, optional
from eomgen.scene.reading.kinds import Triple, Value
from eomgen.scene.reading.kinds import Values as ValuesEntry
from eomgen.scene.reading.requirements import above_zero, not_below_zero
from eomgen.scene.reading.values import Values
from eomgen.system.description import BASE, WORLD, Wheel


class SlipEntry(Table):
    """Forces of a tyre in the plane of the road."""

    axis: Triple = key("spin axis, in axes of the centre's body; any length", (0.0, 1.0, 0.0), names=FIXED_PARAMETERS)
    stiffness: ValuesEntry = key("force per slip and load; two values: longitudinal, lateral", names=PARAMETERS)
    friction: Value = key("largest force per load", 1.0, names=PARAMETERS)
    velocity: Value = key("added in squares to rolling speed, for wheels at rest", 0.1, unit="m/s", names=PARAMETERS)


class TyreEntry(Table):
    """A point contact between a wheel and the road, which can lift off."""

    center: str = key("centre of the wheel", refers="points")
    radius: Value = key("radius of the wheel without load", unit="m", names=PARAMETERS)
    stiffness: Value = key("vertical stiffness", unit="N/m", names=PARAMETERS)
    damping: Value = key("vertical damping", 0.0, unit="N s/m", names=PARAMETERS)
    onset: Value = key("deflection over which the tyre reaches its full stiffness", 1e-3, unit="m", names=PARAMETERS)
    road: Value = key("height of the road under the centre, in the world", 0.0, unit="m", names=ROAD)
    road_rate: Value | None = optional(
        "its rate from time and inputs; needed with `damping` if the road has an input", unit="m/s", names=ROAD
    )
    slip: SlipEntry | None = optional("forces in the plane of the road")


@dataclass(frozen=True)
class Slip:
    """Forces of a tyre in the road's plane: load times stiffness times slip, bounded by friction times load.

    Attributes
    ----------
    axis : unit vector of the wheel's spin in the axes of the body at the wheel centre
    stiffness : longitudinal and lateral, per unit of slip and of load
    velocity : added in squares to the rolling speed, m/s
    """

    axis: tuple[float, float, float]
    stiffness: tuple[Formula, Formula]
    friction: Formula
    velocity: Formula


@dataclass(frozen=True)
class Tyre(ForceElement):
    """A point contact between a wheel and a road of given height; the wheel may lift off.

    Attributes
    ----------
    center : point, the centre of the wheel
    road : height of the road in the world, formula of time, inputs and the centre's x and y
    road_rate : rate of the height due to time and inputs; None if the rate follows from the formula
    moving_road : whether time or inputs move the road
    """

    section: ClassVar[str] = "tyres"
    law: ClassVar[str] = "eomgen.mechanics.forces.tyres:LAW"

    center: str
    radius: Formula
    stiffness: Formula
    damping: Formula
    onset: Formula
    road: Formula
    road_rate: Formula | None
    moving_road: bool
    slip: Slip | None = None

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        yield self.road, 1  # damping depends on the rate of the road
        if self.road_rate is not None:
            yield self.road_rate, 0

    def lengths(self) -> tuple[Formula, ...]:
        return (self.radius,)

    def drawn(self) -> Wheel:
        axis = self.slip.axis if self.slip is not None else None
        return Wheel(self.name, self.center, self.radius, self.road, self.stiffness, axis)


def read_tyre(name: str, entry: TyreEntry, site: Site) -> Tyre:
    """Return the tyre of an entry of [tyres]; faults are reported: a wheel on the base, positions of other points in
    the road, and damping on a road whose rate is unknown."""
    key, values, points, report = key_of("tyres", name), site.values, site.points, site.values.report
    known = values.point(f"{key}.center", entry.center)
    if known and entry.center in points and points[entry.center].body in (BASE, WORLD):
        body = points[entry.center].body
        fault = f"the point {entry.center} is on the {body}, on which a wheel's force has no effect [E1512]"
        report.add(f"{key}.center", fault, "a point of the wheel's body")
    numbers = values.keys(key, entry, "damping")
    road = _height(f"{key}.road", entry.road, entry.center, values)
    kinds = {symbol.kind for symbol in symbols(road)}
    moving = bool(kinds & {"time", "input"})
    rate = None
    if entry.road_rate is not None:
        rate = _height(f"{key}.road_rate", entry.road_rate, entry.center, values)
        if not moving and not report.concerns(f"{key}.road"):
            fault = "neither time nor an input moves the road, so it has no rate of its own [E1513]"
            report.add(f"{key}.road_rate", fault, "a road that moves, or no road_rate")
    elif "input" in kinds and numbers["damping"] != Number(0.0):
        fault = "the damping needs the rate of the road, which does not follow from an input [E1514]"
        report.add(key, fault, _KNOWN_RATE)
    return Tyre(
        name=name,
        center=entry.center,
        **numbers,
        **values.keys(key, entry, "radius", "stiffness", "onset"),
        road=road,
        road_rate=rate,
        moving_road=moving,
        slip=_slip(f"{key}.slip", entry.slip, values) if entry.slip is not None else None,
    )


def _height(key: str, value: float | str, center: str, values: Values) -> Formula:
    """Return the height of a road, m, or the rate, m/s, as a formula; a position other than x and y of the wheel's
    ``center`` is reported."""
    formula = values.formula(key, value, ROAD)
    for symbol in sorted((s for s in symbols(formula) if s.kind == "position"), key=lambda s: (s.name, s.index)):
        if symbol.name != center or symbol.index == 2:
            fault = f"position.{symbol.name}[{symbol.index}] is not x or y of the road's own wheel [E1515]"
            values.report.add(key, fault, f"position.{center}[0] or position.{center}[1]")
            break
    return formula


def _slip(key: str, slip: SlipEntry, values: Values) -> Slip | None:
    axis = values.axis(f"{key}.axis", slip.axis)
    if len(slip.stiffness) not in (1, 2):
        fault = f"one stiffness, or two, longitudinal and lateral, are needed, not {len(slip.stiffness)} [E1516]"
        values.report.add(f"{key}.stiffness", fault, "[15, 12]")
        return None
    numbers = values.keys(key, slip, "stiffness", "friction", "velocity")
    if axis is None:
        return None
    stiffness = numbers.pop("stiffness")
    return Slip((float(axis[0]), float(axis[1]), float(axis[2])), (stiffness[0], stiffness[-1]), **numbers)


#: Roads whose rates are known.
_KNOWN_RATE = (
    'the road as a table in [curves.profile] with road = "profile(speed * t)", whose rate is known; or road_rate = '
    '"...", a second input for instance; or no damping'
)
_BOUNDS = {
    "radius": above_zero("the radius of a tyre [E1740]"),
    "stiffness": above_zero("the stiffness of a tyre [E1752]"),
    "damping": not_below_zero("the damping of a tyre [E1763]"),
    "onset": above_zero("the onset of a tyre [E1741]"),
    "slip.stiffness": not_below_zero("a slip stiffness [E1764]"),
    "slip.friction": above_zero("the friction of a tyre [E1742]"),
    "slip.velocity": above_zero("the velocity of a slip [E1743]"),
}
SECTION = ElementSection(
    key="tyres",
    entry=TyreEntry,
    model=Tyre,
    reader=read_tyre,
    bounds=_BOUNDS,
    offers={"load": "element", "deflection": "element"},
    positional=("center",),
    documentation="""
    Add a tyre, a point contact below a wheel's centre that can lift off.

    ``road`` is the height of the road, a formula of time, inputs and the centre's x and y; stiffnesses of
    ``slip`` are per load, one value or longitudinal and lateral.""",
)
