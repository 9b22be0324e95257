"""The section [tyres]: contacts of a follower about a named point with a road of the world, by a linear law of the
normal force and steady slip."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from eomgen.base.data import dataclass
from eomgen.base.messages import key_of
from eomgen.formula.nodes import ZERO, ZERO_VECTOR, Symbol
from eomgen.products.contacts.laws import AppliedLaw
from eomgen.products.contacts.section import Contact, PairSection
from eomgen.products.contacts.surfaces import FOLLOWER, ROAD, surface_fields
from eomgen.scene.formula.scope import FIXED_PARAMETERS, PARAMETERS
from eomgen.scene.joints.frames import Site
from eomgen.scene.joints.model import Frame
from eomgen.scene.reading.key_metadata import Table, key, optional
from eomgen.scene.reading.kinds import Triple, Value
from eomgen.scene.reading.kinds import Values as ValuesEntry
from eomgen.scene.reading.requirements import above_zero, not_below_zero
from eomgen.scene.rotations import frame_about, rows
from eomgen.system.description import BASE, WORLD, Point, Wheel


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
class Tyre(Contact):
    """A contact of a wheel with a road; ``center`` is the point at the centre of the wheel."""

    section: ClassVar[str] = "tyres"
    law: ClassVar[str] = "eomgen.products.contacts.law:TYRES"
    axis_key: ClassVar[str] = "slip.axis"

    center: str = ""

    def _place(self, symbol: Symbol) -> Symbol:
        return Symbol("position", self.center, symbol.index) if symbol.kind == "local" else symbol

    def frames(self) -> None:
        return None

    def drawn(self) -> Wheel:
        road = next(self.heights())[0]
        x, y, z = (row[2] for row in self.second.orientation)
        axis = None if self.tangential is None else (x, y, z)
        return Wheel(self.name, self.center, self.radius, road, self.normal.values["stiffness"], axis)


def read_tyre(name: str, entry: TyreEntry, site: Site) -> Tyre:
    """Return the tyre of an entry of [tyres]; faults are reported: a wheel on the base, positions of other points in
    the road, and damping on a road whose rate is unknown."""
    key, values, points, report = key_of("tyres", name), site.values, site.points, site.values.report
    known = values.point(f"{key}.center", entry.center)
    if known and entry.center in points and points[entry.center].body in (BASE, WORLD):
        body = points[entry.center].body
        fault = f"the point {entry.center} is on the {body}, on which a wheel's force has no effect [E1512]"
        report.add(f"{key}.center", fault, "a point of the wheel's body")
    normal, slip = values.keys(key, entry, "damping", "stiffness", "onset"), entry.slip
    axis, tangential = None, None
    if slip is not None:
        axis = values.axis(f"{key}.slip.axis", slip.axis)
        if len(slip.stiffness) not in (1, 2):
            fault = f"one stiffness, or two, longitudinal and lateral, are needed, not {len(slip.stiffness)} [E1516]"
            report.add(f"{key}.slip.stiffness", fault, "[15, 12]")
        else:
            numbers = values.keys(f"{key}.slip", slip, "stiffness", "friction", "velocity")
            stiffness = numbers.pop("stiffness")
            names = {"STIFFNESS_X": stiffness[0], "STIFFNESS_Y": stiffness[-1]}
            tangential = AppliedLaw("steady_slip", names | {name.upper(): value for name, value in numbers.items()})
    center = points.get(entry.center, Point("", BASE, ZERO_VECTOR))
    return Tyre(
        name,
        Frame(WORLD),
        Frame(center.body, center.position, rows(frame_about(np.array([0.0, 1.0, 0.0]) if axis is None else axis))),
        FOLLOWER,
        AppliedLaw("linear", normal),
        tangential,
        **values.keys(key, entry, "radius"),
        **surface_fields(key, "road", entry, values, "damping", needed=normal["damping"] != ZERO),
        center=entry.center,
    )


SECTION = PairSection(
    key="tyres",
    entry=TyreEntry,
    model=Tyre,
    reader=read_tyre,
    bounds={
        "radius": above_zero("the radius of a tyre [E1740]"),
        "stiffness": above_zero("the stiffness of a tyre [E1752]"),
        "damping": not_below_zero("the damping of a tyre [E1763]"),
        "onset": above_zero("the onset of a tyre [E1741]"),
        "slip.stiffness": not_below_zero("a slip stiffness [E1764]"),
        "slip.friction": above_zero("the friction of a tyre [E1742]"),
        "slip.velocity": above_zero("the velocity of a slip [E1743]"),
    },
    offers={"load": "element", "deflection": "element"},
    positional=("center",),
    documentation="""
    Add a tyre, a point contact below a wheel's centre that can lift off.

    ``road`` is the height of the road, a formula of time, inputs and the centre's x and y; stiffnesses of
    ``slip`` are per load, one value or longitudinal and lateral.""",
)
