"""Whether the outermost joints of a tree move inertia, alone or with their mimic joints; otherwise M is singular."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array, Flags, Numbers
from eomgen.base.data import dataclass
from eomgen.base.messages import key_of
from eomgen.formula.nodes import Formula, Number
from eomgen.scene.bodies.model import Body
from eomgen.scene.inertia import NO_INERTIA, dot, rotate_inertia, singular, steiner, times
from eomgen.scene.joint_types import AXIS, JOINTS, Connection
from eomgen.scene.joints.model import Joint, LightJoint

if TYPE_CHECKING:
    from eomgen.scene.reading.values import Values

Triple = tuple[Numbers, Numbers, Numbers]


@dataclass(frozen=True)
class MovedPart:
    """A body of a rigid assembly; the body's values stand in a list of numbers, by index.

    Attributes
    ----------
    start : index of mass, centre of mass (3) and inertia (6), which follow one another
    orientation : (3, 3), axes of the body in the frame of the assembly's first part
    carrier : index of the part to which a fixed joint connects the body; None for the first part
    position : index of that joint's position (3) in the list
    """

    start: int
    orientation: Array
    carrier: int | None = None
    position: int = 0


@dataclass(frozen=True)
class PlacedBody:
    """A body in the frame of an assembly: mass, centre of mass, inertia (xx, yy, zz, xy, xz, yz) about the centre."""

    mass: Numbers
    center: Triple
    inertia: Sequence[Numbers]


def _place_bodies(parts: Sequence[MovedPart], numbers: Sequence[Numbers]) -> list[PlacedBody]:
    """Return the bodies of an assembly in the frame of the first part; carriers come before the carried parts.
    ``numbers`` are the values to which the parts' indices refer, floats or batches."""
    result: list[PlacedBody] = []
    origins: list[Triple] = []
    for part in parts:
        origin: Triple = (0.0, 0.0, 0.0)
        if part.carrier is not None:
            shift = _rotate(parts[part.carrier].orientation, numbers[part.position :][:3])
            origin = _plus(origins[part.carrier], shift)
        origins.append(origin)
        mass, center, inertia = numbers[part.start], numbers[part.start + 1 :][:3], numbers[part.start + 4 :][:6]
        if part.carrier is not None:
            center, inertia = _rotate(part.orientation, center), rotate_inertia(part.orientation, inertia)
        result.append(PlacedBody(mass, _plus(origin, center), inertia))
    return result


def _plus(first: Sequence[Numbers], second: Sequence[Numbers]) -> Triple:
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]


def _rotate(rotation: Array, vector: Sequence[Numbers]) -> Triple:
    first, second, third = rotation.tolist()
    return dot(first, vector), dot(second, vector), dot(third, vector)


def _about(point: Sequence[Numbers], bodies: Sequence[PlacedBody]) -> list[Numbers]:
    """Return the inertia (xx, yy, zz, xy, xz, yz) of bodies about a point, added up (Steiner)."""
    total: list[Numbers] = [0.0] * 6
    for body in bodies:
        arm = [x - y for x, y in zip(body.center, point, strict=True)]
        parts = zip(total, body.inertia, steiner(body.mass, arm), strict=True)
        total = [whole + part + moved for whole, part, moved in parts]
    return total


@dataclass(frozen=True)
class MovableInertia:
    """Rule that a joint which carries one rigid assembly, and no further moving joint, has inertia to move; ``broken``
    and ``fault`` take the numbers to which all indices refer.

    Attributes
    ----------
    kind : of the joint; free in absolute coordinates
    axes : (3, 3), axis (the normal of a planar joint), an orthogonal direction (a universal joint's second axis) and
        the third axis, in the joint frame, row by row
    parts : of the assembly
    rotors, pitch : indices of the joint's rotor inertias and pitch
    followers : indices of the multipliers of joints that follow this joint: the rule applies to the joint alone, while
        all multipliers are zero
    words, hint : the fault, with ``{}`` for the cause, and the remedy
    """

    kind: Connection
    axes: Array
    parts: tuple[MovedPart, ...]
    rotors: tuple[int, ...]
    pitch: int
    followers: tuple[int, ...]
    words: str
    hint: str
    stage: int = 2

    def _causes(self, numbers: Sequence[Numbers]) -> list[tuple[Flags, str]]:
        """Return all possible causes of a singular M, each with flags of the values, numbers or batches, at which the
        cause applies, and as the end of a sentence."""
        bodies = _place_bodies(self.parts, numbers)
        rotors = [numbers[index] for index in self.rotors] or [0.0]
        mass, about_origin = sum((body.mass for body in bodies), 0.0), _about((0.0, 0.0, 0.0), bodies)
        nothing = _all_zero((mass, *chain.from_iterable(body.inertia for body in bodies), *rotors))
        causes: list[tuple[Flags, str]] = [(nothing, "it carries neither mass nor inertia")]
        axis, second, _ = self.axes.tolist()
        about_axis = dot(axis, times(about_origin, axis)) + rotors[0]
        none: Flags
        turns, travels = len(self.kind.turned_about), self.kind.travels
        across = bool(turns) and any(axis != AXIS for axis in travels)
        if turns == 1 and not across:
            pitch = numbers[self.pitch] if self.kind.has("screw") else 0.0
            none = about_axis + mass * pitch * pitch <= NO_INERTIA * (
                about_origin[0] + about_origin[1] + about_origin[2]
            )
            causes.append((none, "the bodies that it carries have no inertia about its axis"))
        if travels and not across:
            causes.append((mass + rotors[-1] == 0.0, "the bodies that it carries have no mass"))
        if turns == 2:
            about_second = dot(second, times(about_origin, second)) + rotors[1]
            mean, coupling = 0.5 * (about_axis + about_second), dot(axis, times(about_origin, second))
            radius = np.hypot(0.5 * (about_axis - about_second), coupling)
            none = mean - radius <= NO_INERTIA * (mean + radius)
            causes.append((none, "the bodies that it carries lack inertia about two axes through their centre"))
        if across:
            moment = _first_moment(bodies)
            couplings = [dot(np.cross(self.axes[k], axis).tolist(), moment) for k in travels]
            none = _lacks_planar_inertia(about_axis, [mass + rotor for rotor in rotors[1:]], couplings)
            causes.append((none, "the bodies that it carries lack inertia about its normal, or mass"))
        if self.kind.has("ball"):
            cause = "the bodies that it carries have no inertia about some axis through their centre"
            causes.append((singular(about_origin), cause))
        if self.kind.has("free"):
            divisor = mass + np.equal(mass, 0.0)
            center = [part / divisor for part in _first_moment(bodies)]
            none = np.logical_or(np.equal(mass, 0.0), singular(_about(center, bodies)))
            cause = "the bodies that it carries lack mass, or inertia about some axis through their centre of mass"
            causes.append((none, cause))
        return causes

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        result: Flags = False
        for flags, _ in self._causes(numbers):
            result = result | flags
        return result & _all_zero([numbers[index] for index in self.followers])

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        cause = next(words for flags, words in self._causes(numbers) if flags)
        return self.words.format(cause), self.hint


def _lacks_planar_inertia(about_normal: Numbers, masses: Sequence[Numbers], couplings: Sequence[Numbers]) -> Flags:
    """Return flags of a singular inertia matrix of the rotation about a normal and of travels across the normal.

    Parameters
    ----------
    masses, couplings : of each travel, on the diagonal and in the row of the rotation
    """
    diagonal = [about_normal, *masses, 1.0][:3]
    scales = [np.sqrt(np.where(np.greater(x, 0.0), x, 1.0)) for x in diagonal]
    # without units: each row and column is scaled by the root of the diagonal entry
    scaled = [coupling / (scales[0] * scale) for coupling, scale in zip(couplings, scales[1:], strict=False)]
    return singular([*(np.greater(x, 0.0) + 0.0 for x in diagonal), *scaled, 0.0, 0.0][:6])


def _first_moment(bodies: Sequence[PlacedBody]) -> Triple:
    total: Triple = (0.0, 0.0, 0.0)
    for body in bodies:
        total = _plus(total, [body.mass * part for part in body.center])
    return total


@dataclass(frozen=True)
class MimicInertia:
    """Rule that a leader of mimic joints, or a follower, moves mass or inertia; ``broken`` and ``fault`` take the
    numbers to which all indices refer.

    Attributes
    ----------
    leader : indices of masses, inertias and rotor inertias beyond the joint
    followers : for each following joint, the index of the multiplier, and the same indices beyond this joint
    words, hint : the fault and the remedy
    """

    leader: tuple[int, ...]
    followers: tuple[tuple[int, tuple[int, ...]], ...]
    words: str
    hint: str
    stage: int = 2

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        follows: Flags = np.asarray(False)
        light = _all_zero([numbers[index] for index in self.leader])
        for multiplier, beyond in self.followers:
            still = np.asarray(np.equal(numbers[multiplier], 0.0))
            follows = follows | ~still
            light = light & (still | _all_zero([numbers[index] for index in beyond]))
        return light & follows

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        return self.words, self.hint


def _all_zero(numbers: Sequence[Numbers]) -> Flags:
    result = np.asarray(True)
    for number in numbers:
        result = result & np.equal(number, 0.0)
    return result


class _Places:
    """List of the formulas that a rule takes; ``put`` appends formulas and returns the index of the first."""

    def __init__(self) -> None:
        self.formulas: list[Formula] = []

    def put(self, *formulas: Formula) -> int:
        self.formulas += formulas
        return len(self.formulas) - len(formulas)

    def put_each(self, formulas: Sequence[Formula]) -> tuple[int, ...]:
        start = self.put(*formulas)
        return tuple(range(start, start + len(formulas)))


def _assemblies(joints: Sequence[Joint]) -> tuple[dict[str, list[Joint]], set[str]]:
    """Return the fixed joints that connect further bodies to each body with a moving joint, by name of this body, and
    the names of bodies with a moving joint whose assembly carries further moving joints. A body without further bodies
    has an empty list. Joints have parents first.
    """
    assemblies: dict[str, list[Joint]] = {joint.child: [] for joint in joints if joint.kind.moves}
    host = {child: child for child in assemblies}
    for joint in joints:
        if not joint.kind.moves and joint.parent in host:
            host[joint.child] = host[joint.parent]
            assemblies[host[joint.child]].append(joint)
    carrying = {host[joint.parent] for joint in joints if joint.kind.moves and joint.parent in host}
    return assemblies, carrying


def check_motion(
    joints: Sequence[Joint],
    bodies: Mapping[str, Body],
    values: Values,
    *,
    absolute: bool = False,
    constrained: bool = False,
    allowed: Collection[str] = (),
) -> tuple[list[str], list[LightJoint]]:
    """Report a tree without a moving joint, and outermost moving joints that move no inertia, for which M is singular.

    In ``absolute`` coordinates every moving body is free, and each free body with the bodies fixed to it needs mass and
    inertia. If a scene is ``constrained``, joints without inertia at the default parameters are returned instead: [M
    B^T; B 0] may be regular. Faults, and rules on tunable parameters, go to ``values``. ``joints`` have parents first;
    ``allowed`` are bodies that need no inertia, as for inverse dynamics and kinematics.

    Returns
    -------
    list of str
        Leaders of mimic joints that move such bodies alone.
    list of LightJoint
        Joints that need constraints.
    """
    if not any(joint.kind.moves or bodies[joint.child].beam is not None for joint in joints):
        values.report.add("joints", "no joint can move [E1640]", "a revolute, prismatic, spherical or free joint")
    light = _check_leaders(joints, bodies, values, allowed)
    followers = _followers(joints)
    assemblies, carrying = _assemblies(joints)
    sound: set[tuple[object, ...]] = set()
    determined: list[LightJoint] = []

    def needs_no_inertia(joint: Joint) -> bool:
        if not joint.kind.moves or values.report.concerns(key_of("joints", joint.name)):
            return True
        driven = all(joint.drive or [None])  # M need not be positive definite in directions that a drive prescribes
        return not absolute and (joint.child in carrying or joint.mimic is not None or joint.child in allowed or driven)

    for joint in joints:
        if needs_no_inertia(joint):
            continue
        fixed, alike = assemblies[joint.child], _formulas_of(joint, bodies)
        known = alike in sound and not fixed and joint.name not in followers
        if known or any(_has_fault(bodies[item.child], values) for item in (joint, *fixed)):
            continue
        places = _Places()
        parts = _parts(joint, fixed, bodies, places)
        rotors, led, pitch = tuple[int, ...](), tuple[int, ...](), places.put(joint.pitch)
        if absolute:
            words = f"in absolute coordinates the body {joint.child} has a free joint, and {{}} [E1641]"
            key, kind, hint = key_of("bodies", joint.child), JOINTS["free"], _ABSOLUTE_HINT
        else:
            words = (
                f"the joint {joint.name} cannot be moved by a force: {{}}, so the inertia matrix would be"
                f" singular [E1642]"
            )
            key, kind, hint = key_of("joints", joint.name), joint.kind, joint.kind.light.format(joint.child)
            if bodies[joint.child].beam is not None:
                hint = "polar_inertia for the beam, or another joint"
            rotors = places.put_each(joint.each(joint.rotor_inertia))
            led = places.put_each(
                [item.mimic.multiplier for item in followers.get(joint.name, ()) if item.mimic is not None]
            )
        rule = MovableInertia(kind, _directions(joint), parts, rotors, pitch, led, words, hint)
        later = type(values.report)(values.report.file, values.report.lines) if constrained else None
        if values.require(key, rule, places.formulas, later) and not fixed:
            sound.add(alike)
        if later is not None:
            determined += [LightJoint(joint.name, joint.child, problem) for _, problem in later.noted]
    return light, determined


def _parts(joint: Joint, fixed: Sequence[Joint], bodies: Mapping[str, Body], places: _Places) -> tuple[MovedPart, ...]:
    """Return the assembly that a joint carries: the child, and the bodies that the joints ``fixed`` connect to the
    child; the formulas of their values are appended to ``places``."""
    parts = [MovedPart(places.put(*_values_of(bodies[joint.child])), np.eye(3))]
    numbered = {joint.child: 0}
    for item in fixed:
        carrier = numbered[item.parent]
        numbered[item.child] = len(parts)
        start, position = places.put(*_values_of(bodies[item.child])), places.put(*item.position)
        parts.append(MovedPart(start, parts[carrier].orientation @ np.array(item.orientation), carrier, position))
    return tuple(parts)


def _formulas_of(joint: Joint, bodies: Mapping[str, Body]) -> tuple[object, ...]:
    """Return a key that is equal for joints which carry one body with the same axes and values: numbers by value,
    formulas by identity, because nodes of a beam share these."""
    formulas = (*_values_of(bodies[joint.child]), joint.pitch, *joint.each(joint.rotor_inertia))
    alike = [(formula.value,) if isinstance(formula, Number) else id(formula) for formula in formulas]
    return (joint.type, joint.axis, joint.second_axis, *alike)


_ABSOLUTE_HINT = "inertia = [xx, yy, zz] above zero, or joint coordinates"


def _directions(joint: Joint) -> Array:
    """Return the axes of a joint in the joint frame: axis, second axis orthogonal to it, and third axis."""
    axis, second = np.array(joint.axis), np.array(joint.second_axis)
    return np.array([axis, second, np.cross(axis, second)])


def _values_of(body: Body) -> tuple[Formula, ...]:
    return (body.mass, *body.center_of_mass, *body.inertia)


def _has_fault(body: Body, values: Values) -> bool:
    if body.node_of:
        return values.report.concerns(key_of("beams", body.node_of))
    return values.report.concerns(key_of("bodies" if body.beam is None else "beams", body.name))


def _followers(joints: Sequence[Joint]) -> dict[str, list[Joint]]:
    """Return the mimic joints that follow each leader, directly or through further followers, by the leader's name."""
    named = {joint.name: joint for joint in joints}
    result: dict[str, list[Joint]] = {}
    for joint in joints:
        first = joint
        for _ in joints:  # no way to the first is longer, circles are reported elsewhere
            if first.mimic is None or first.mimic.joint not in named:
                break
            first = named[first.mimic.joint]
        if joint.mimic is not None and first is not joint:
            result.setdefault(first.name, []).append(joint)
    return result


def coupled_by_mimic(joints: Sequence[Joint], values: Values) -> set[str]:
    """Return the names of mimic joints, and of leaders with a follower whose multiplier is not zero at the default
    parameters: the inertia of a leader depends on followers."""
    leaders = {
        first
        for first, following in _followers(joints).items()
        if any(joint.mimic is not None and values.value(joint.mimic.multiplier) != 0.0 for joint in following)
    }
    return {*leaders, *(joint.name for joint in joints if joint.mimic is not None)}


def _check_leaders(
    joints: Sequence[Joint], bodies: Mapping[str, Body], values: Values, allowed: Collection[str]
) -> list[str]:
    """Report leaders of mimic joints if the bodies moved by a leader and by its followers have neither mass nor
    inertia; return the names of such leaders whose child is among the bodies ``allowed``, which are not reported."""
    light: list[str] = []
    named = {joint.name: joint for joint in joints}
    for first, following in _followers(joints).items():
        places = _Places()
        beyond = [_beyond(named[first], joints, bodies, values, places)]
        beyond += [_beyond(joint, joints, bodies, values, places) for joint in following]
        if None in beyond:
            continue
        leader, *rest = (item for item in beyond if item is not None)
        multipliers = [places.put(joint.mimic.multiplier) for joint in following if joint.mimic is not None]
        words = f"the joint {first} cannot be moved by a force: neither it nor its followers carry mass or inertia"
        hint = f"mass for a body that it moves, rotor_inertia, or a fixed joint (of other formats: lock {first})"
        rule = MimicInertia(
            leader,
            tuple(zip(multipliers, rest, strict=True)),
            f"{words}, so the inertia matrix would be singular [E1643]",
            hint,
        )
        if named[first].child not in allowed:
            values.require(key_of("joints", first), rule, places.formulas)
        elif rule.broken([values.value(formula) for formula in places.formulas]):
            light.append(first)
    return light


def _beyond(
    joint: Joint, joints: Sequence[Joint], bodies: Mapping[str, Body], values: Values, places: _Places
) -> tuple[int, ...] | None:
    """Append the formulas of rotor inertias, masses and inertias of a joint and of all bodies and joints beyond to
    ``places``, and return their indices there; None, without a change, if an entry has a fault."""
    reached, formulas = {joint.child: joint}, [*joint.each(joint.rotor_inertia)]
    for next_joint in joints:
        if next_joint.parent in reached:
            reached[next_joint.child] = next_joint
            formulas += next_joint.each(next_joint.rotor_inertia)
    for name in reached:
        formulas += [bodies[name].mass, *bodies[name].inertia]
    if any(_has_fault(bodies[name], values) for name in reached):
        return None
    return places.put_each(formulas)
