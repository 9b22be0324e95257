"""Tyres from the written form: what their road may depend on, and when its rate has to be given."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.scene.document.checks import check_reference
from eomgen.scene.forces import schema as written
from eomgen.scene.forces.elements import Slip, Tyre
from eomgen.scene.formula.evaluate import symbols
from eomgen.scene.formula.nodes import Formula, Number
from eomgen.scene.formula.scope import PARAMETERS, ROAD
from eomgen.scene.reading.values import Values
from eomgen.scene.scene import BASE, WORLD, Point
from eomgen.text import key_of


def read_tyre(name: str, entry: written.Tyre, points: Mapping[str, Point], values: Values) -> Tyre:
    """Return a checked tyre; what is wrong with it goes to the report of ``values``."""
    key, report = key_of("tyres", name), values.report
    known = check_reference(f"{key}.center", entry.center, values.names.points, "point", report)
    if known and entry.center in points and points[entry.center].body in (BASE, WORLD):
        what = f"the point {entry.center} is on the {points[entry.center].body}, where a wheel's force moves nothing"
        report.add(f"{key}.center", what, "a point of the wheel's body")
    damping = values.formula(f"{key}.damping", entry.damping, PARAMETERS)
    road = _height(f"{key}.road", entry.road, entry.center, values)
    kinds = {symbol.kind for symbol in symbols(road)}
    moving = bool(kinds & {"time", "input"})
    rate = None
    if entry.road_rate is not None:
        rate = _height(f"{key}.road_rate", entry.road_rate, entry.center, values)
        if not moving and not report.concerns(f"{key}.road"):
            what = "neither time nor an input moves the road, so it has no rate of its own"
            report.add(f"{key}.road_rate", what, "a road that moves, or no road_rate")
    elif "input" in kinds and damping != Number(0.0):
        what = "the damping needs the rate of the road, which does not follow from an input"
        report.add(key, what, 'road_rate = "...", a second input for instance, or no damping')
    return Tyre(
        name=name,
        center=entry.center,
        radius=values.formula(f"{key}.radius", entry.radius, PARAMETERS),
        stiffness=values.formula(f"{key}.stiffness", entry.stiffness, PARAMETERS),
        damping=damping,
        onset=values.formula(f"{key}.onset", entry.onset, PARAMETERS),
        road=road,
        road_rate=rate,
        moving_road=moving,
        slip=_slip(f"{key}.slip", entry.slip, values) if entry.slip is not None else None,
    )


def _height(key: str, value: float | str, center: str, values: Values) -> Formula:
    """Return the height of a road or its rate; of all positions it may use its own wheel's x and y only."""
    formula = values.formula(key, value, ROAD)
    for symbol in sorted((s for s in symbols(formula) if s.kind == "position"), key=lambda s: (s.name, s.index)):
        if symbol.name != center or symbol.index == 2:
            what = f"position.{symbol.name}[{symbol.index}] cannot be used here: a road has a height over its own wheel's x and y"
            values.report.add(key, what, f"position.{center}[0] or position.{center}[1]")
            break
    return formula


def _slip(key: str, slip: written.Slip, values: Values) -> Slip | None:
    axis = values.axis(f"{key}.axis", slip.axis)
    if len(slip.stiffness) not in (1, 2):
        what = f"one stiffness, or a longitudinal and a lateral one, are needed here, not {len(slip.stiffness)}"
        values.report.add(f"{key}.stiffness", what, "[15, 12]")
        return None
    places = [f"{key}.stiffness[{place}]" for place in range(len(slip.stiffness))]
    stiffness = [values.formula(place, value, PARAMETERS) for place, value in zip(places, slip.stiffness, strict=True)]
    friction = values.formula(f"{key}.friction", slip.friction, PARAMETERS)
    velocity = values.formula(f"{key}.velocity", slip.velocity, PARAMETERS)
    if axis is None:
        return None
    return Slip((float(axis[0]), float(axis[1]), float(axis[2])), (stiffness[0], stiffness[-1]), friction, velocity)
