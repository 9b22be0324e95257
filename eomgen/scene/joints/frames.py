"""Reading of frames, positions and axes, for constraints and bushings.

Two axes do not give the angle between two bodies. So if the angle matters, a frame given by its axis needs an
``x_axis`` too: the frame's x is the part of x_axis across the axis.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from eomgen.base.data import dataclass, field
from eomgen.base.messages import listed
from eomgen.formula.nodes import ZERO_VECTOR
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.joint_types import Need
from eomgen.scene.joints.model import Frame, Joint
from eomgen.scene.reading.report import Report, check_reference
from eomgen.scene.reading.values import Values, read_orientation, read_placement
from eomgen.scene.rotations import frame_about, rows, sequence
from eomgen.system.description import BASE, WORLD, Point

if TYPE_CHECKING:
    from eomgen.scene.bodies.beam_schema import BeamEntry
    from eomgen.scene.bodies.cosserat import Cosserat
    from eomgen.scene.joints import constraint_schema as written
    from eomgen.scene.section import Reading


@dataclass(frozen=True)
class Site:
    """Data for a reader of a force element: names of bodies and of beams, points, and the scene's values.

    ``exact``: geometrically exact beams read so far.
    """

    bodies: Collection[str]
    beams: Mapping[str, BeamEntry]
    points: Mapping[str, Point]
    values: Values
    exact: Mapping[str, Cosserat] = field(default_factory=dict)


def site_of(reading: Reading) -> Site:
    """Return the data for readers of elements and constraints between bodies."""
    items, beams = reading.items, reading.document.section("beams")
    return Site(reading.bodies, beams, items["points"], reading.values, items.get("beams", {}))


def read_frame(key: str, title: str, frame: written.FrameEntry, need: Need, site: Site) -> Frame:
    """Return a checked frame of a constraint or bushing, with position and axes in the body; faults are reported at
    ``key``. ``title`` is the owner of the frame in messages, ``need`` says which axes the owner uses. After a fault the
    frame has the identity or the base in place of the unknown data."""
    values, report = site.values, site.values.report
    orientation = _orientation(key, title, frame, need, values)
    if frame.point is None:
        position = (
            ZERO_VECTOR if frame.position is None else values.vector(f"{key}.position", frame.position, PARAMETERS)
        )
        if frame.body is None:
            report.add(key, "the frame belongs to no body [E1630]", f'body = "{BASE}", or a point')
            return Frame(BASE, position, orientation)
        check_reference(f"{key}.body", frame.body, [BASE, *site.bodies], "body", report)
        placement = position, orientation
        return Frame(
            frame.body, *read_placement(key, frame.given_in, frame.position is not None, frame.body, *placement, values)
        )
    for name in ("body", "position"):
        if getattr(frame, name) is not None:
            report.add(f"{key}.{name}", f"the point gives the {name} already [E1631]", f"either point or {name}")
    if frame.point in (BASE, *site.bodies) and frame.point not in values.names.points:
        report.add(f"{key}.point", f"{frame.point} is a body, not a point [E1632]", f'{{ body = "{frame.point}" }}')
    else:
        check_reference(f"{key}.point", frame.point, values.names.points, "point", report)
    point = site.points.get(frame.point, Point(frame.point, "", ZERO_VECTOR))
    if point.body:
        _, orientation = read_placement(key, frame.given_in, True, point.body, ZERO_VECTOR, orientation, values)
    return Frame(point.body, point.position, orientation)


def _orientation(
    key: str, title: str, frame: written.FrameEntry, need: Need, values: Values
) -> tuple[tuple[float, float, float], ...]:
    """Return the frame's axes in the body as rows of a (3, 3) rotation: by rotations, or by z and, if the angle
    matters, x; the identity by default and after a fault, which is reported. ``need`` says which axes the owner
    ``title`` uses."""
    report = values.report
    if frame.rotation is not None or frame.orientation is not None:
        field = "orientation" if frame.rotation is None else "rotation"
        for name in ("axis", "x_axis"):
            if getattr(frame, name) is not None:
                report.add(f"{key}.{name}", f"{name} and {field} are both given [E1633]", "one of them")
        return read_orientation(key, frame.rotation, frame.orientation, values)
    if frame.axis is None:
        if frame.x_axis is not None:
            fault = "x_axis has no meaning without axis, the z axis of the frame [E1634]"
            report.add(f"{key}.x_axis", fault, "axis = [0, 0, 1]")
        elif need not in ("nothing", "any"):
            extra = ", x_axis = [1, 0, 0]" if need == "x and z" else ""
            report.add(key, f"a {title} needs the axes of this frame [E1635]", f"axis = [0, 0, 1]{extra}, or rotation")
        return rows(sequence([]))
    if need == "nothing":
        fault = f"a {title} has no axis in this frame [E1636]"
        report.add(f"{key}.axis", fault, "its position alone, without axis and x_axis")
    axis = values.axis(f"{key}.axis", frame.axis)
    if frame.x_axis is None:
        if need in ("x and z", "any"):
            fault = f"the angle about the axis matters to a {title}, and axis does not say it [E1637]"
            report.add(key, fault, "x_axis = [1, 0, 0], in the axes of this body, or rotation")
        return rows(sequence([]) if axis is None else frame_about(axis))
    x_axis = values.axis(f"{key}.x_axis", frame.x_axis)
    if axis is None or x_axis is None:
        return rows(sequence([]))
    if abs(float(axis @ x_axis)) > 1.0 - 1e-9:
        report.add(f"{key}.x_axis", "x_axis is parallel to axis [E1638]", "a direction across it")
        return rows(sequence([]))
    return rows(frame_about(axis, x_axis))


def check_two_bodies(
    pairs: Iterable[tuple[str, tuple[Frame, ...]]], joints: Sequence[Joint], beams: Collection[str], report: Report
) -> None:
    """Report entries whose two frames are in one rigid body, which fixed joints may make of several bodies.

    Parameters
    ----------
    pairs : dotted key of an entry, and both frames
    joints : parents first
    beams : bodies that are not rigid, alone or with the bodies fixed to the beam
    """
    host = {BASE: BASE, WORLD: WORLD}
    for joint in joints:
        rigid = not joint.kind.moves and joint.parent not in beams and joint.child not in beams
        host[joint.child] = host.get(joint.parent, joint.parent) if rigid else joint.child
    for key, frames in pairs:
        first, second = (frame.body for frame in frames)
        if first not in beams and first in host and second in host and host[first] == host[second]:
            which = first if first == second else listed([first, second]) + ", which fixed joints make one body"
            hint = "frames in two bodies that move against each other"
            report.add(f"{key}.second", f"both frames are in the same rigid body: {which} [E1639]", hint)
