"""Notes on numbers that look as if they had another unit: lengths and inertias far beyond the size of a scene, angles
of more than a turn, delays and sampling times as numbers of samples.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.limits import Limit
from eomgen.base.messages import key_of
from eomgen.formula.curves import Curve
from eomgen.formula.nodes import Application, Formula, Number, Operation, Symbol, Vector, distinct_nodes, infix
from eomgen.formula.units.labels import several_turns
from eomgen.scene.bodies.model import Body
from eomgen.scene.document.notes import SceneFacts
from eomgen.scene.document.quantities import quantities
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.formula.namespaces import read_as_written
from eomgen.scene.formula.scope import ANYWHERE_ALONG_A_BEAM
from eomgen.scene.formula.tokens import FormulaError
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.model import Constraint, Joint
from eomgen.scene.reading.values import Values
from eomgen.system.description import BASE, WORLD, Point, Shape

FACTOR = Limit(100.0, "1", "length in parts of the size of the scene", "a length in mm is 1000 times too long")
GYRATION = Limit(
    10.0,
    "1",
    "radius of gyration in parts of the size of the scene",
    "inertias in kg cm^2 make the radius ten times too long",
)
DENSEST = Limit(8_000.0, "kg/m^3", "mass by the cube of the size of the scene", "density of steel")
HEAVIEST = Limit(25_000.0, "kg/m^3", "mass by the cube of the size of the body", "osmium has 22 590")
#: Arms below this, m, give no scale of a scene.
_SHORTEST = 1e-3


class _Arm(NamedTuple):
    """A place in a body: key, description, distance from the body's origin in m, and whether the body moves."""

    key: str
    quantity: str
    length: float
    moves: bool


def scene_size(facts: SceneFacts) -> float:
    """Return the largest length of the places in bodies, of beams and of initial travels, m; places that are far beyond
    all others are left out. 0 without lengths."""
    arms, scene = facts.once(_arms), facts.scene
    far = _far(arms)
    known = [arm.length for arm in arms if arm not in far]
    known += [abs(travel) for joint in scene["joints"] for travel in _travels(joint)]
    known += [body.beam.length for body in scene["bodies"] if body.beam is not None]
    known += [element.beam.length for element in scene["elements"] if isinstance(element, CosseratBeam)]
    return max((length for length in known if math.isfinite(length)), default=0.0)


def out_of_scale(facts: SceneFacts) -> list[str]:
    """Return a note on each mass, length, size or position that is much larger than the other lengths in the scene, at
    the default parameters: radii of gyration, springs, tyres, shapes, constraints with their curves, parameters in m,
    places in bodies. Without any length only places are judged."""
    scene, values, arms = facts.scene, facts.values, facts.once(_arms)
    far, bodies = _far(arms), scene["bodies"]
    notes = _far_places(far, arms)
    size = facts.once(scene_size)
    if not size > 0.0:
        return notes
    known = [arm.length for arm in arms if arm not in far and arm.length >= _SHORTEST]
    notes += _too_heavy(bodies, scene["joints"], scene["points"], max(known) if len(known) > 1 else math.inf, values)
    beams = facts.document.section("beams")
    shaped = [name for name, beam in beams.items() if beam.section is not None and beam.section.shape]
    lengths = [*_lengths(bodies, scene["elements"], shaped, values)]
    lengths += [*_lengths_of_shapes(scene.get("shapes", ()), values)]
    lengths += _lengths_of_constraints(scene["constraints"], bodies, values)
    parameters = (item for item in facts.reading.parameters if item.unit == "m")
    lengths += [(key_of("parameters", item.name), "the length", abs(item.value), "m") for item in parameters]
    return notes + _too_long(lengths, size, well_known=len(known) > 2)


def _travels(joint: Joint) -> list[float]:
    """Return the initial coordinates of a joint in the directions in which it travels, m; angles and components of
    quaternions are left out."""
    start = joint.initial_position
    if not start or not any(start):
        return []
    units = joint.kind.units
    turns = ("rad",) * (len(start) - len(units))  # a quaternion, which has one component more than its velocities
    return [value for value, unit in zip(start, (*turns, *units), strict=False) if unit == "m"]


def _far_places(far: Sequence[_Arm], arms: Sequence[_Arm]) -> list[str]:
    """Return a note on each place that is far beyond the other arms and moves with its body."""
    rest = max((arm.length for arm in arms if arm not in far), default=0.0)
    return [
        f"{arm.key}: {arm.quantity} is {arm.length:.3g} m from the body's origin, and all else is within {rest:.3g} m;"
        " numbers without a unit are in m [W0119]"
        for arm in far
        if arm.moves
    ]


def _too_long(lengths: Iterable[tuple[str, str, float, str]], size: float, *, well_known: bool) -> list[str]:
    """Return a note on each length that is far beyond the size of the scene, m; ``lengths`` have key, quantity, value
    in m, and the unit for the hint. ``well_known``: the size is known from several lengths, so that radii of gyration
    are judged more strictly."""
    notes = []
    for key, quantity, length, hint in lengths:
        factor: float = GYRATION if well_known and key.endswith(".inertia") else FACTOR
        if key.endswith(".rotary_inertia"):
            factor = 1.0  # no section is as large as all that is joined
        if length >= factor * size and math.isfinite(length):
            beside = f"{length:.3g} m, and the scene is no larger than {size:.3g} m"
            notes.append(f"{key}: {quantity} is {beside}; numbers without a unit are in {hint} [W0120]")
    return notes


def _too_heavy(
    bodies: Iterable[Body], joints: Iterable[Joint], points: Iterable[Point], size: float, values: Values
) -> Iterator[str]:
    """Yield a note on each rigid body that is heavier than a cube of steel as large as the scene (``size``, m), or
    denser than any material within a cube twice as large as the reach (the farthest place in the body), and within a
    cube as large as the box of the inertia; the latter not for bodies without a reach or an inertia."""
    reach: dict[str, float] = {}
    for owner, position in (
        *((body.name, body.center_of_mass) for body in bodies),
        *((joint.parent, joint.position) for joint in joints),
        *((point.body, point.position) for point in points),
    ):
        reach[owner] = max(reach.get(owner, 0.0), _length(position, values))
    for body in bodies:
        if body.beam is not None or body.node_of:
            continue
        mass, inertia = values.value(body.mass), [values.value(entry) for entry in body.inertia[:3]]
        side = math.sqrt(6.0 * max(sum(inertia) - 2.0 * entry for entry in inertia) / mass) if mass > 0.0 else 0.0
        extent = max(2.0 * reach[body.name], side)
        if mass > DENSEST * size * size * size:
            cube = f"a cube of steel as large as the scene, {size:.3g} m, has less"
        elif min(inertia) > 0.0 and reach[body.name] > _SHORTEST and mass > HEAVIEST * extent * extent * extent:
            cube = f"a cube of {extent:.3g} m, the size of the body, has less of any material"
        else:
            continue
        note = f"the mass is {mass:.6g} kg, and {cube}; numbers without a unit are in kg [W0118]"
        yield f"{key_of('bodies', body.name, 'mass')}: {note}"


def _length(position: Vector, values: Values) -> float:
    return math.hypot(*(values.value(part) for part in position))


def _arms(facts: SceneFacts) -> list[_Arm]:
    """Return the finite distances of centres of mass, joints and points from the origins of their bodies."""
    scene, values, fixed = facts.scene, facts.values, (BASE, WORLD)
    frames, arms = {frame.name for frame in scene["frames"]}, list[_Arm]()
    for body in scene["bodies"]:
        key = key_of("beams" if body.beam is not None else "bodies", body.name, "center_of_mass")
        arms.append(_Arm(key, "the centre of mass", _length(body.center_of_mass, values), body.beam is None))
    for joint in scene["joints"]:
        key = key_of("joints", joint.name, "position")
        arms.append(_Arm(key, "the joint", _length(joint.position, values), joint.parent not in fixed))
    for point in scene["points"]:
        key = key_of("frames" if point.name in frames else "points", point.name, "position")
        arms.append(_Arm(key, "the point", _length(point.position, values), point.body not in fixed))
    return [arm for arm in arms if math.isfinite(arm.length)]


def _far(arms: Sequence[_Arm]) -> list[_Arm]:
    """Return the few lengths, less than half of all, that are a hundred times as long as all others, of which there are
    at least two; else an empty list."""
    ordered = sorted((arm for arm in arms if arm.length >= _SHORTEST), key=lambda arm: -arm.length)
    for count, (longer, shorter) in enumerate(itertools.pairwise(ordered), 1):
        if 2 * count > len(ordered) or len(ordered) - count < 2:
            break
        if longer.length >= FACTOR * shorter.length:
            return ordered[:count]
    return []


def _gyration(body: Body, values: Values) -> float:
    """Return the largest radius of gyration of a body, m; 0 without mass or inertia."""
    mass, largest = values.value(body.mass), max(values.value(entry) for entry in body.inertia[:3])
    return math.sqrt(largest / mass) if mass > 0.0 and largest > 0.0 else 0.0


def _lengths(
    bodies: Iterable[Body], elements: Iterable[ForceElement], shaped: Collection[str], values: Values
) -> Iterator[tuple[str, str, float, str]]:
    """Yield radii of gyration and lengths of force elements, with key, name, value and unit."""
    for body in bodies:
        if body.node_of in shaped:
            continue
        gyration = _gyration(body, values)
        if body.beam is None and gyration > 0.0 and body.node_of in ("", body.name):
            if body.node_of:
                key = key_of("beams", body.name)
                yield f"{key}.rotary_inertia", "the radius of gyration of the sections", gyration, "kg m"
            else:
                yield key_of("bodies", body.name, "inertia"), "the radius of gyration", gyration, "kg m^2"
    for element in elements:
        if field := {"springs": "length", "tyres": "radius"}.get(element.section):
            key = key_of(element.section, element.name, field)
            yield key, f"the {field}", values.value(getattr(element, field)), "m"


def _lengths_of_constraints(
    constraints: Iterable[Constraint], bodies: Iterable[Body], values: Values
) -> Iterator[tuple[str, str, float, str]]:
    """Yield key, quantity, value and unit for each length in constraints, and for the height of each curve that is a
    summand in an equation or a surface in m. The radius of a rolling body is left out if the radius of gyration is
    similar."""
    gyrations = {body.name: _gyration(body, values) for body in bodies}
    for item in constraints:
        key = key_of("constraints", item.name)
        for name, formula in item.given_lengths():
            length = values.value(formula)
            if name == "length" or length >= FACTOR * gyrations.get(item.second.body, 0.0):
                yield f"{key}.{name}", f"the {name.partition('[')[0]}", length, "m"
        height = item.equation if item.surface is None else item.surface
        if item.framed and height is not None and item.unit == "m":
            for curve in _summands(height):
                largest = float(np.max(np.abs(curve.y)))
                yield key_of("curves", curve.name), "the largest value of the curve", largest, "m"


def _summands(formula: Formula) -> Iterator[Curve]:
    """Yield the curves whose values are summands of a formula."""
    if isinstance(formula, Application):
        if formula.derivative == 0 and isinstance(formula.curve, Curve):
            yield formula.curve
    elif isinstance(formula, Operation) and formula.name in ("add", "sub", "neg"):
        for argument in formula.arguments:
            yield from _summands(argument)


def _lengths_of_shapes(shapes: Iterable[Shape], values: Values) -> Iterator[tuple[str, str, float, str]]:
    """Yield key, quantity, value in m and unit for the largest size of each shape on a moving body, and for the
    distance of each shape from the body's origin."""
    for shape in shapes:
        sizes, hint = [values.value(size) for size in shape.sizes], "m"
        if shape.kind == "mesh":
            corners = np.frombuffer(shape.vertices, "<f4").reshape(-1, 3)
            sizes = list(np.abs(np.ptp(corners, axis=0) * sizes)) if len(corners) else []
            hint = 'm; scale = "1 mm" is for a file in millimetres'
        if shape.body not in (BASE, WORLD):
            yield key_of("shapes", shape.name), "the size of the shape", max(sizes, default=0.0), hint
            if not shape.implied:
                away = _length(shape.position, values)
                yield f"{key_of('shapes', shape.name)}.position", "the distance from the body's origin", away, "m"


def angles_of_several_turns(facts: SceneFacts) -> list[str]:
    """Return a note on each angle of more than a turn that is written as a plain number: starts, limits, rests and
    offsets of joints, rotations, and angles in other sections."""
    data = facts.data
    result = [*_joint_angles(data), *_rotation_angles(data)]
    result += [
        (f"the torsion spring {name} rests at", value)
        for name, spring in data.get("torsion_springs", {}).items()
        if isinstance(value := spring.get("rest"), int | float)
    ]
    result += [
        angle for row in facts.reading.rows if not row.single for angle in row.plain_angles(data.get(row.key, {}))
    ]
    return list(dict.fromkeys(note for subject, angle in result if (note := several_turns(subject, angle))))


def _joint_angles(data: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    """Yield text and angle, rad, of each start, rest, offset and limit of a joint that is written as a plain number."""
    for name, joint in data.get("joints", {}).items():
        limits = joint.get("limits") or {}
        places = (
            (f"the joint {name} starts at", (joint.get("initial") or {}).get("position")),
            (f"the spring of the joint {name} rests at", joint.get("rest")),
            (f"the joint {name} is offset from its leader by", (joint.get("mimic") or {}).get("offset")),
            (f"the joint {name} has its lower limit at", limits.get("lower")),
            (f"the joint {name} has its upper limit at", limits.get("upper")),
        )
        # of free and spherical joints a start has no angles: a place in m, and rotations by axis and angle
        units = tuple(JOINTS[joint["type"]].coordinates.values())
        for subject, written in places:
            values = written if isinstance(written, list | tuple) else (written,) * len(units)
            for value, unit in zip(values, units, strict=False):
                if unit == "rad" and isinstance(value, int | float):
                    yield subject, value


def _rotation_angles(data: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    turned = [("the base is turned by", data.get("base") or {})]
    for section, kind in (("joints", "joint"), ("frames", "frame")):
        turned += [(f"the {kind} {name} is turned by", entry) for name, entry in data.get(section, {}).items()]
    for name, constraint in data.get("constraints", {}).items():
        sides = [constraint.get(side) for side in ("first", "second")]
        turned += [(f"a frame of the constraint {name} is turned by", side) for side in sides if isinstance(side, dict)]
    for subject, entry in turned:
        for rotation in entry.get("rotation") or ():
            if isinstance(value := rotation.get("angle"), int | float):
                yield subject, value


def angles_against_numbers(facts: SceneFacts) -> list[str]:
    """Return a note on each plain number of more than a turn that formulas compare with, add to or subtract from an
    angle of a joint."""
    notes = []
    for key, angle, unit, value in facts.once(_against_numbers):
        if unit == "rad" and (note := several_turns(f"{key}: {angle} stands against", value)):
            turned = note.partition(":")[0] + ":" + note.partition(":")[2].partition(":")[0]
            notes.append(
                f'{turned}: angles in formulas are radians; try: a parameter of "{value:.6g} deg" in its place [W0121]'
            )
    return list(dict.fromkeys(notes))


def lengths_against_numbers(facts: SceneFacts) -> list[str]:
    """Return a note on each plain number, a hundred times the scene's size or more, that a formula compares with, adds
    to or subtracts from a length: a point's position or a joint's travel."""
    notes = []
    for key, length, unit, value in facts.once(_against_numbers):
        size = facts.once(scene_size) if unit == "m" else 0.0
        if size > 0.0 and abs(value) >= FACTOR * size:
            beside = f"{length} stands against {abs(value):.6g} m, and the size of the scene is {size:.3g} m"
            notes.append(
                f'{key}: {beside}: lengths in formulas are in m; try: a parameter of "{abs(value):.6g} mm" in its'
                f" place [W0122]"
            )
    return list(dict.fromkeys(notes))


def _against_numbers(facts: SceneFacts) -> list[tuple[str, str, str, float]]:
    """Return the key of a formula, text and unit of a position or a coordinate there, and the plain number that it is
    compared with, added to or subtracted from."""
    joints, result = facts.data.get("joints", {}), []
    coordinates = {name: tuple(JOINTS[joint["type"]].coordinates.values()) for name, joint in joints.items()}

    def units_of(symbol: Symbol) -> tuple[str, ...]:
        """Return the units of a position's components or a joint's coordinates; none for other quantities."""
        if symbol.kind == "position":
            return ("m",) * 3
        return coordinates.get(symbol.name, ()) if symbol.kind == "q" else ()

    for quantity in quantities(facts.data):
        if not isinstance(quantity.value, str):
            continue
        try:
            formula = read_as_written(quantity.value, facts.values.names, ANYWHERE_ALONG_A_BEAM)
        except FormulaError:
            continue
        for node in distinct_nodes(formula):
            if isinstance(node, Operation) and node.name in ("lt", "le", "add", "sub"):
                for symbol, constant in itertools.permutations(node.arguments):
                    if isinstance(symbol, Symbol) and isinstance(constant, Number) and (units := units_of(symbol)):
                        text = infix(symbol, {symbol: len(units)}.__getitem__)
                        result.append((quantity.key, text, units[symbol.index], constant.value))
    return result


MANY_SAMPLES = Limit(50.0, "1", "delay in samples, a whole number of seconds", "a choice")
RARE = Limit(10.0, "s", "time between samples without a unit", "controllers are faster")


def doubtful_times(facts: SceneFacts) -> list[str]:
    """Return a note on each delay that is a whole number of seconds, without a unit, and many samples; and on each time
    between samples of 10 s or more without a unit, which may be a frequency."""
    notes = []
    for section in ("states", "controllers"):
        for name, entry in facts.document.section(section).items():
            as_written, period = facts.data[section][name], entry.sample
            delay, written = as_written.get("delay"), as_written.get("sample")
            if isinstance(written, int | float) and written >= RARE:
                note = f"the time between two samples is {written:g} s"
                notes.append(
                    f'{key_of(section, name)}.sample: {note}; {written:g} a second are "{1 / written:.6g} s" [W0123]'
                )
            if not (isinstance(delay, int | float) and isinstance(period, int | float)):
                continue
            if float(delay).is_integer() and delay >= MANY_SAMPLES * period:
                note = f"the delay {delay:g} is {delay:g} s, {delay / period:.4g} samples"
                notes.append(
                    f"{key_of(section, name)}.delay: {note}: times without a unit are in s, and one sample is"
                    f' "{period:.6g} s" [W0124]'
                )
    return notes
