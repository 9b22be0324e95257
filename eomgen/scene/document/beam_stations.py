"""Stations of geometrically exact beams: the places along the axis at which anything of a scene is attached."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from eomgen.formula.nodes import Vector
from eomgen.scene.bodies.reading import read_body_frame, read_point
from eomgen.scene.document import schema as written
from eomgen.scene.document.beam_nodes import Attachments
from eomgen.scene.forces.element import Site
from eomgen.scene.forces.register import ELEMENTS
from eomgen.scene.joints.constraint_reading import read_constraint
from eomgen.scene.joints.reading import read_joint
from eomgen.scene.reading.values import Values
from eomgen.system.description import Point


class _Stations(Attachments):
    """Takes down the places on beams, and leaves what is attached there where it is."""

    def __init__(self, beams: Sequence[str], values: Values) -> None:
        self.values = values
        self.found: dict[str, list[float]] = {name: [] for name in beams}

    def at(self, key: str, body: str, position: Vector) -> tuple[str, Vector]:
        if body in self.found and not self.values.report.concerns(key):
            self.found[body].append(self.values.value(position[0]))
        return body, position


def stations_of(
    document: written.Document, beams: Sequence[str], bodies: Collection[str], values: Values
) -> Mapping[str, Sequence[float]]:
    """Return x of every station, m, by beam, NaN where it is not known.

    Parameters
    ----------
    beams : names of those that are geometrically exact
    bodies : names of all bodies
    values : a reader with a report of its own, since all of this is read again with the nodes that follow
    """
    stations = _Stations(beams, values)
    if not beams:
        return stations.found
    for name, joint in document.joints.items():
        stations.joint(read_joint(name, joint, values))
    points = {
        name: stations.point("points", read_point(name, point, bodies, values))
        for name, point in document.points.items()
    }
    for name, frame in document.frames.items():
        fixed = stations.point("frames", read_body_frame(name, frame, bodies, values))
        points[name] = Point(name, fixed.body, fixed.position)
    for name, constraint in document.constraints.items():
        stations.constraint(read_constraint(name, constraint, bodies, points, values))
    site = Site(bodies, document.beams, points, values)
    for row in ELEMENTS:
        for name, entry in document.section(row.section).items():
            stations.element(row.read(name, entry, site))
    return stations.found
