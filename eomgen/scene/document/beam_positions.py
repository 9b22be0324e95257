"""Places on beams that something is attached to: on the beam, and at an x that is known when the C is made.

Shape functions are evaluated there once, so y and z may depend on tunable parameters, as on a rigid body, and x may not.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from eomgen.scene.forces.elements import Bushing
from eomgen.scene.forces.model import Force
from eomgen.scene.formula.evaluate import symbols
from eomgen.scene.formula.nodes import Formula
from eomgen.scene.joints.constraint_model import Constraint
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading.values import Values
from eomgen.scene.scene import Body, Point
from eomgen.text import key_of


def check_places(
    bodies: Mapping[str, Body],
    joints: Iterable[Joint],
    points: Iterable[Point],
    forces: Iterable[Force],
    framed: Mapping[str, Iterable[Constraint | Bushing]],
    values: Values,
) -> None:
    """Report what is attached to a beam where the beam is not; ``framed`` has constraints and bushings, by section."""
    places = [(key_of("joints", joint.name, "position"), joint.parent, joint.position) for joint in joints]
    places += [(key_of("points", point.name, "position"), point.body, point.position) for point in points]
    places += [(key_of("forces", force.name, "point"), force.body, force.point) for force in forces]
    for section, entries in framed.items():
        for entry in entries:
            for field, frame in (("first", entry.first), ("second", entry.second)):
                places.append((key_of(section, entry.name, field, "position"), frame.body, frame.position))
    judged = set()
    for key, body, position in places:
        if (body, position) not in judged:  # a frame in a point is the point's matter, and points come before
            _check_place(key, body, position, bodies, values)
        judged.add((body, position))


def _check_place(key: str, name: str, position: Sequence[Formula], bodies: Mapping[str, Body], values: Values) -> None:
    body = bodies.get(name)
    if body is None or body.beam is None or values.report.concerns(key) or values.report.concerns(key_of("beams", name)):
        return
    beam, along = body.beam, position[0]
    tunable = sorted(symbol.name for symbol in symbols(along) if values.names.parameters.get(symbol.name))
    if tunable:
        what = f"x on the beam {name} depends on the tunable parameter {tunable[0]}, and shape functions are evaluated once"
        values.report.add(f"{key}[0]", what, f"{tunable[0]} without tunable, or a number")
        return
    x = values.value(along)
    if beam.is_beyond(x):
        reach = f"{beam.start:.6g} m to {beam.start + beam.length:.6g} m"
        what = f"x = {x:.6g} m is beyond the beam {name}, which goes from {reach}"
        values.report.add(f"{key}[0]", what, "a place on the beam, or a body fixed to its end")
