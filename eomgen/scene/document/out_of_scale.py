"""Notes on lengths and inertias far beyond the size of a scene: in mm, or in kg cm^2, without their unit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import NamedTuple

from eomgen.base.text import key_of
from eomgen.formula.nodes import Formula, Vector
from eomgen.scene.bodies.model import Body
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.forces.springs import Spring
from eomgen.scene.forces.tyres import Tyre
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading.values import Values
from eomgen.system.description import BASE, WORLD, Point

#: How many times as large as the scene a length has to be to be doubted.
_FACTOR = 100.0
#: The same for a radius of gyration, if enough arms give the size of the scene: kg cm^2 make it ten times as large.
_OF_GYRATION, _ARMS = 10.0, 3
#: Density of steel, kg/m^3.
_DENSEST = 8_000.0
#: Least number of arms for a check of masses against densities.
_OF_A_BODY = 2
#: Arms below this, m, give no scale of a scene.
_SHORTEST = 1e-3


class _Arm(NamedTuple):
    """A place in a body: its key, its description, its distance from the body's origin in m, and whether its body
    moves."""

    key: str
    quantity: str
    length: float
    moves: bool


def out_of_scale(
    bodies: Iterable[Body],
    joints: Iterable[Joint],
    points: Iterable[Point],
    frames: Collection[str],
    elements: Iterable[object],
    shaped: Collection[str],
    values: Values,
) -> list[str]:
    """Return a note on each mass, radius of gyration, length of a spring, radius of a tyre and place in a body that is
    far beyond the other arms in the scene, at the default parameters; empty for a scene without arms.

    Parameters
    ----------
    frames : names of the points that are origins of frames
    shaped : names of the beams whose sections have a shape, the sizes of which are judged by the length of the beam
    """
    bodies, joints, elements = list(bodies), list(joints), list(elements)
    arms = [arm for arm in _arms(bodies, joints, points, frames, values) if math.isfinite(arm.length)]
    far = _far(arms)
    notes = []
    if far:
        rest = max(arm.length for arm in arms if arm not in far)
        for arm in far:
            if arm.moves:
                beside = f"{arm.length:.3g} m from the body's origin, and all else is within {rest:.3g} m"
                notes.append(f"{arm.key}: {arm.quantity} is {beside}; numbers without a unit are in m")
    near = [arm.length for arm in arms if arm not in far]
    known = [*near, *(abs(start) for joint in joints for start in joint.initial_position or ())]
    known += [body.beam.length for body in bodies if body.beam is not None]
    known += [element.beam.length for element in elements if isinstance(element, CosseratBeam)]
    size = max((length for length in known if math.isfinite(length)), default=0.0)
    if not size > 0.0:
        return notes
    apart = [length for length in near if length >= _SHORTEST]
    if len(apart) >= _OF_A_BODY:
        notes += _too_heavy(bodies, max(apart), values)
    well_known = len(apart) >= _ARMS
    for key, quantity, length, hint in _lengths(bodies, elements, shaped, values):
        factor = _OF_GYRATION if well_known and key.endswith(".inertia") else _FACTOR
        if key.endswith(".rotary_inertia"):
            factor = 1.0  # no section is as large as all that is joined
        if length >= factor * size and math.isfinite(length):
            beside = f"{length:.3g} m, and the scene is no larger than {size:.3g} m"
            notes.append(f"{key}: {quantity} is {beside}; numbers without a unit are in {hint}")
    return notes


def _too_heavy(bodies: Iterable[Body], size: float, values: Values) -> Iterator[str]:
    """Yield a note on each body that no solid of the scene's size could be as heavy as."""
    for body in bodies:
        mass = values.value(body.mass)
        if body.beam is None and not body.node_of and mass > _DENSEST * size**3:
            note = f"the mass is {mass:.6g} kg, and a cube of steel as large as the scene, {size:.3g} m, has less"
            yield f"{key_of('bodies', body.name, 'mass')}: {note}; numbers without a unit are in kg"


def _arms(
    bodies: Iterable[Body], joints: Iterable[Joint], points: Iterable[Point], frames: Collection[str], values: Values
) -> Iterator[_Arm]:
    def length(position: Vector) -> float:
        return math.hypot(*(values.value(part) for part in position))

    for body in bodies:
        key = key_of("beams" if body.beam is not None else "bodies", body.name, "center_of_mass")
        yield _Arm(key, "the centre of mass", length(body.center_of_mass), body.beam is None)
    fixed = (BASE, WORLD)
    for joint in joints:
        moves = joint.parent not in fixed
        yield _Arm(key_of("joints", joint.name, "position"), "the joint", length(joint.position), moves)
    for point in points:
        key = key_of("frames" if point.name in frames else "points", point.name, "position")
        yield _Arm(key, "the point", length(point.position), point.body not in fixed)


def _far(arms: Sequence[_Arm]) -> list[_Arm]:
    """Return the few arms that are a hundred times as long as all others, of which there are more than one."""
    ordered = sorted((arm for arm in arms if arm.length >= _SHORTEST), key=lambda arm: -arm.length)
    for count, (longer, shorter) in enumerate(itertools.pairwise(ordered), 1):
        if 2 * count > len(ordered) or len(ordered) - count < 2:
            break
        if longer.length >= _FACTOR * shorter.length:
            return ordered[:count]
    return []


def _lengths(
    bodies: Iterable[Body], elements: Iterable[object], shaped: Collection[str], values: Values
) -> Iterator[tuple[str, str, float, str]]:
    for body in bodies:
        if body.node_of in shaped:
            continue
        mass, largest = values.value(body.mass), max(values.value(entry) for entry in body.inertia[:3])
        if body.beam is None and mass > 0.0 and largest > 0.0 and body.node_of in ("", body.name):
            gyration = math.sqrt(largest / mass)
            if body.node_of:
                key = key_of("beams", body.name)
                yield f"{key}.rotary_inertia", "the radius of gyration of the sections", gyration, "kg m"
            else:
                yield key_of("bodies", body.name, "inertia"), "the radius of gyration", gyration, "kg m^2"
    lengths: list[tuple[str, str, str, Formula]] = []
    for element in elements:
        if isinstance(element, Spring):
            lengths.append(("springs", element.name, "length", element.length))
        elif isinstance(element, Tyre):
            lengths.append(("tyres", element.name, "radius", element.radius))
    for section, name, field, formula in lengths:
        yield key_of(section, name, field), f"the {field}", values.value(formula), "m"
