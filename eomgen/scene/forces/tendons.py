"""Tendons in scene files, keys, bounds and data: springs, dampers and actuators along a path of points, which may wrap
around spheres and cylinders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import ClassVar, Literal, Self

from eomgen.base.data import dataclass, replace
from eomgen.base.messages import key_of, listed
from eomgen.formula.nodes import ZERO, Formula, Vector
from eomgen.scene.design_poses import attach
from eomgen.scene.forces.element import Attach, ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.formula.scope import PARAMETERS, SPRING_FORCE
from eomgen.scene.joint_types import Need
from eomgen.scene.joints.constraint_schema import FrameEntry
from eomgen.scene.joints.frames import Site, read_frame
from eomgen.scene.joints.model import Frame
from eomgen.scene.reading.key_metadata import Table, key, optional
from eomgen.scene.reading.kinds import Value
from eomgen.scene.reading.requirements import above_zero, not_below_zero
from eomgen.system.description import Line, Obstacle


class WrapEntry(Table):
    """A sphere or a cylinder around which a tendon wraps between two successive points."""

    after: str = key("point of the path before the obstacle", refers="points")
    shape: Literal["sphere", "cylinder"] = key("shape of the obstacle; a cylinder has no ends", "sphere")
    center: FrameEntry = key("a frame; z is the axis of a cylinder", kind="frame")
    radius: Value = key("radius of the obstacle", unit="m", names=PARAMETERS)
    side: str | None = optional(
        "point outside the obstacle, on the side on which the tendon passes; without one the shorter way",
        refers="points",
    )
    inside: bool = key("the path goes through a ring of this radius, and touches the obstacle from within", False)


class TendonEntry(Table):
    """A spring, damper or actuator along a path of points; the same tension acts along the whole path."""

    points: tuple[str, ...] = key("the path, two points or more", refers="points", kind="list of points", strict=False)
    wraps: tuple[WrapEntry, ...] = key("obstacles of the path", (), shown_default="`[]`", strict=False)
    stiffness: Value = key("tension by length beyond `length`", 0.0, unit="N/m", names=PARAMETERS)
    damping: Value = key("tension by rate of length", 0.0, unit="N s/m", names=PARAMETERS)
    length: Value = key("length at which the tendon is slack", 0.0, unit="m", names=PARAMETERS)
    force: Value = key("an actuator in parallel", 0.0, unit="N", names=SPRING_FORCE)


@dataclass(frozen=True)
class Wrap:
    """An obstacle of a tendon.

    Attributes
    ----------
    after : index of the point of the path before the obstacle
    cylinder : whether the obstacle is a cylinder about the z axis of ``frame``, not a sphere about the origin
    side : point outside the obstacle, on the side on which the tendon passes; empty for the shorter way
    inside : whether the obstacle is a ring that the path goes through
    """

    after: int
    cylinder: bool
    frame: Frame
    radius: Formula
    side: str = ""
    inside: bool = False


@dataclass(frozen=True)
class Tendon(ForceElement):
    """Spring-damper along a path of points: tension = stiffness (l - length) + damping l' + force.

    ``force`` is a formula of everything (an actuator in parallel), a tension: positive shortens the path. Stiffness,
    damping and free length are formulas of parameters.
    """

    section: ClassVar[str] = "tendons"
    law: ClassVar[str] = "eomgen.mechanics.forces.tendons:LAW"

    points: tuple[str, ...]
    wraps: tuple[Wrap, ...]
    stiffness: Formula
    damping: Formula
    length: Formula
    force: Formula = ZERO

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        yield self.force, 0

    def passive(self) -> Self:
        return replace(self, force=ZERO)

    def lengths(self) -> tuple[Formula, ...]:
        return (self.length, *(wrap.radius for wrap in self.wraps))

    def places(self) -> Iterator[tuple[tuple[str, ...], str, Vector]]:
        for index, wrap in enumerate(self.wraps):
            yield _place(index), wrap.frame.body, wrap.frame.position

    def attached(self, at: Attach) -> Self:
        wraps = enumerate(self.wraps)
        return replace(self, wraps=tuple(replace(wrap, frame=attach(wrap.frame, at, _place(k))) for k, wrap in wraps))

    def drawn(self) -> Line:
        placed = [(wrap, (wrap.frame.body, wrap.frame.position, wrap.frame.orientation)) for wrap in self.wraps]
        obstacles = tuple(
            Obstacle(wrap.after, wrap.cylinder, *pose, wrap.radius, wrap.side, wrap.inside) for wrap, pose in placed
        )
        path = self.points if len(self.points) > 2 or obstacles else ()
        return Line(self.name, self.points[0], self.points[-1], False, self.length, path, obstacles)


def _place(index: int) -> tuple[str, ...]:
    return (f"wraps[{index}]", "center", "position")


def read_tendon(name: str, entry: TendonEntry, site: Site) -> Tendon:
    """Return the tendon of an entry of [tendons], with obstacles in the order of the path; faults are reported, and
    obstacles without a place on the path are left out."""
    key, values, report = key_of("tendons", name), site.values, site.values.report
    for index, point in enumerate(entry.points):
        values.point(f"{key}.points[{index}]", point)
    if len(entry.points) < 2:
        fault = f"a path needs two points, not {len(entry.points)} [E1506]"
        report.add(f"{key}.points", fault, 'points = ["first", "second"]')
    for point, following in pairwise(entry.points):
        if point == following:
            report.add(f"{key}.points", f"the path goes from the point {point} to itself [E1507]", "another point")
    wraps = [_wrap(f"{key}.wraps[{index}]", wrap, entry.points, site) for index, wrap in enumerate(entry.wraps)]
    kept = sorted((wrap for wrap in wraps if wrap is not None), key=lambda wrap: wrap.after)
    for before, behind in pairwise(kept):
        if before.after == behind.after:
            fault = f"two obstacles follow the point {entry.points[before.after]} [E1508]"
            report.add(f"{key}.wraps", fault, "a point of the path between the obstacles")
    numbers = values.keys(key, entry, "stiffness", "damping", "length", "force")
    return Tendon(name, entry.points, tuple(kept), **numbers)


def _wrap(key: str, entry: WrapEntry, points: Sequence[str], site: Site) -> Wrap | None:
    """Return an obstacle of a tendon along ``points``; None, after a report, if the place on the path is not
    determined."""
    values, report = site.values, site.values.report
    need: Need = "any" if entry.shape == "sphere" else "z"
    frame = read_frame(f"{key}.center", entry.shape, entry.center, need, site)
    radius = values.formula(f"{key}.radius", entry.radius, PARAMETERS)
    if entry.side is not None:
        values.point(f"{key}.side", entry.side)
    if entry.side is not None and entry.inside:
        report.add(f"{key}.side", "a path through a ring has no side [E1509]", "no side, or inside = false")
    if entry.after not in points[:-1]:
        fault = f"no point of the path follows a point {entry.after} [E1510]"
        report.add(f"{key}.after", fault, f"one of {listed(points[:-1])}")
        return None
    if points.count(entry.after) > 1:
        fault = f"the path passes the point {entry.after} twice, so the place of the obstacle is not determined [E1511]"
        report.add(f"{key}.after", fault, "another point at the same place")
        return None
    return Wrap(points.index(entry.after), entry.shape == "cylinder", frame, radius, entry.side or "", entry.inside)


SECTION = ElementSection(
    key="tendons",
    entry=TendonEntry,
    model=Tendon,
    reader=read_tendon,
    bounds={
        **dict.fromkeys(("stiffness", "damping")),
        "length": not_below_zero("the length of a tendon [E1762]"),
        "wraps.radius": above_zero("the radius of an obstacle [E1739]"),
        "wraps.center.position": None,
    },
    offers={"path_length": "element", "path_rate": "element", "path_tension": "tension"},
    positional=("points",),
    documentation="""
    Add a spring, damper or actuator along a path of points; ``force`` is a tension.

    Between two points the path may wrap around a sphere or a cylinder.""",
)
