"""Reading of bodies and body-fixed points."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from eomgen.base.messages import key_of
from eomgen.scene.bodies import schema as written
from eomgen.scene.bodies.model import Body
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading import report
from eomgen.scene.reading.values import Values, read_orientation, read_placement
from eomgen.scene.rotations import quaternion_of_matrix, rows
from eomgen.system.description import BASE, WORLD, FixedFrame, Point


def read_body(name: str, body: written.Body, values: Values) -> Body:
    """Return a rigid body."""
    key, formula = key_of("bodies", name), values.formula
    entries = enumerate(body.inertia)
    xx, yy, zz, xy, xz, yz = (formula(f"{key}.inertia[{place}]", entry, PARAMETERS) for place, entry in entries)
    center = values.vector(f"{key}.center_of_mass", body.center_of_mass, PARAMETERS)
    return Body(name, formula(f"{key}.mass", body.mass, PARAMETERS), center, (xx, yy, zz, xy, xz, yz))


def read_body_frame(name: str, frame: written.BodyFrame, bodies: Collection[str], values: Values) -> FixedFrame:
    """Return a frame of a body; ``bodies`` are the names of bodies that can carry it."""
    key = key_of("frames", name)
    if frame.body not in bodies:
        report.check_reference(f"{key}.body", frame.body, [BASE, WORLD, *bodies], "body", values.report)
    position = values.vector(f"{key}.position", frame.position, PARAMETERS)
    orientation = read_orientation(key, frame.rotation, frame.orientation, values)
    positioned = "position" in frame.model_fields_set
    position, orientation = read_placement(key, frame.given_in, positioned, frame.body, position, orientation, values)
    return FixedFrame(name, frame.body, position, orientation, quaternion_of_matrix(orientation))


def read_point(name: str, point: written.Point, bodies: Collection[str], values: Values) -> Point:
    """Return a point; ``bodies`` are the names of bodies that can carry it."""
    key = key_of("points", name)
    if point.body not in bodies:
        report.check_reference(f"{key}.body", point.body, [BASE, WORLD, *bodies], "body", values.report)
    given, positioned = (
        values.vector(f"{key}.position", point.position, PARAMETERS),
        "position" in point.model_fields_set,
    )
    position, _ = read_placement(key, point.given_in, positioned, point.body, given, rows(np.eye(3)), values)
    return Point(name, point.body, position)
