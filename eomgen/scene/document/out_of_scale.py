"""Notes on lengths and inertias that are far beyond the size of a scene: in mm, or in kg mm^2, without their unit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

from eomgen.formula.nodes import Formula
from eomgen.scene.bodies.model import Body
from eomgen.scene.forces.springs import Spring
from eomgen.scene.forces.tyres import Tyre
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading.values import Values
from eomgen.system.description import Point
from eomgen.text import key_of

#: How many times as large as the scene a length has to be to be doubted.
_FACTOR = 100.0


def out_of_scale(
    bodies: Iterable[Body],
    joints: Iterable[Joint],
    points: Mapping[str, Point],
    elements: Iterable[object],
    values: Values,
) -> list[str]:
    """Return a note on each radius of gyration, length of a spring and radius of a tyre that is a hundred times as
    large as the longest arm in the scene, at the default parameters; none where no place is apart from another."""
    bodies, joints, elements = list(bodies), list(joints), list(elements)
    arms = [body.center_of_mass for body in bodies] + [joint.position for joint in joints]
    arms += [point.position for point in points.values()]
    known = [math.hypot(*(values.value(part) for part in arm)) for arm in arms]
    known += [abs(start) for joint in joints for start in joint.initial_position or ()]
    known += [body.beam.length for body in bodies if body.beam is not None]
    size = max((length for length in known if math.isfinite(length)), default=0.0)
    if not size > 0.0:
        return []
    notes = []
    for key, what, length, hint in _lengths(bodies, elements, values):
        if length >= _FACTOR * size and math.isfinite(length):
            beside = f"{length:.3g} m, and the scene is no larger than {size:.3g} m"
            notes.append(f"{key}: {what} is {beside}; numbers without a unit are in {hint}")
    return notes


def _lengths(
    bodies: Iterable[Body], elements: Iterable[object], values: Values
) -> Iterator[tuple[str, str, float, str]]:
    for body in bodies:
        mass, largest = values.value(body.mass), max(values.value(entry) for entry in body.inertia[:3])
        if body.beam is None and mass > 0.0 and largest > 0.0:
            gyration = math.sqrt(largest / mass)
            yield key_of("bodies", body.name, "inertia"), "the radius of gyration", gyration, "kg m^2"
    lengths: list[tuple[str, str, str, Formula]] = []
    for element in elements:
        if isinstance(element, Spring):
            lengths.append(("springs", element.name, "length", element.length))
        elif isinstance(element, Tyre):
            lengths.append(("tyres", element.name, "radius", element.radius))
    for section, name, field, formula in lengths:
        yield key_of(section, name, field), f"the {field}", values.value(formula), "m"
