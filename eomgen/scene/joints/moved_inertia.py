"""Whether the outermost joints of a tree move inertia, alone or with mimic joints; otherwise M is singular."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array, Flags, Numbers
from eomgen.base.data import dataclass
from eomgen.base.messages import key_of
from eomgen.formula.nodes import Formula, Number
from eomgen.lie.numeric import skew
from eomgen.scene.bodies.model import Body
from eomgen.scene.inertia import NO_INERTIA, PLACES, stack_numbers
from eomgen.scene.joint_types import JOINTS, Connection
from eomgen.scene.joints.model import Joint, LightJoint

if TYPE_CHECKING:
    from eomgen.scene.reading.values import Values


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


def _moved_bodies(parts: Sequence[MovedPart], numbers: Sequence[Numbers]) -> list[tuple[Array, Array, Array]]:
    """Return for each part of an assembly the mass (...), the centre of mass (..., 3) in the frame of the first part,
    and the inertia (..., 3, 3) about this centre; carriers come before the carried parts. Numbers that are alike in a
    whole batch are not repeated."""
    origins: list[Array] = []
    bodies: list[tuple[Array, Array, Array]] = []
    for part in parts:
        origin = np.zeros(3)
        if part.carrier is not None:
            shift = stack_numbers(numbers[part.position : part.position + 3])
            origin = origins[part.carrier] + shift @ parts[part.carrier].orientation.T
        origins.append(origin)
        mass, *center = numbers[part.start : part.start + 4]
        inertia = stack_numbers(numbers[part.start + 4 : part.start + 10])[..., PLACES]
        turned = part.orientation @ inertia @ part.orientation.T
        bodies.append((np.asarray(mass), origin + stack_numbers(center) @ part.orientation.T, turned))
    return bodies


@dataclass(frozen=True)
class MovableInertia:
    """Rule that a joint which carries one rigid assembly, and no further moving joint, has inertia to move; ``broken``
    and ``fault`` take the numbers to which all indices refer.

    Attributes
    ----------
    kind : of the joint; free in absolute coordinates
    subspaces : two arrays (6, n), the motion subspace at neutral coordinates without pitch, and the share of a pitch
    parts : of the assembly
    rotors, pitch : indices of the joint's rotor inertias and pitch
    followers : indices of the multipliers of joints that follow this joint: the rule applies to the joint alone, while
        all multipliers are zero
    words, hint : the fault, with ``{}`` for the cause, and the remedy
    """

    kind: Connection
    subspaces: tuple[Array, Array]
    parts: tuple[MovedPart, ...]
    rotors: tuple[int, ...]
    pitch: int
    followers: tuple[int, ...]
    words: str
    hint: str
    stage: int = 2

    def _inertia(self, numbers: Sequence[Numbers]) -> Array:
        """Return the joint's inertia matrix (..., n, n) without units: turns by the trace of the inertia, travels by
        the mass."""
        bodies, point = _moved_bodies(self.parts, numbers), np.zeros(3)
        mass = np.asarray(sum(body[0] for body in bodies))
        if self.kind.has("free"):
            point = sum(body[0][..., np.newaxis] * body[1] for body in bodies) / (mass + (mass == 0.0))[..., np.newaxis]
        subspace = self.subspaces[0] + np.asarray(numbers[self.pitch])[..., np.newaxis, np.newaxis] * self.subspaces[1]
        turning, travel = subspace[..., :3, :], subspace[..., 3:, :]
        inertia, trace = np.zeros(()), np.zeros(())
        for weight, center, about_center in bodies:
            speeds = travel - skew(center - point) @ turning
            inertia = inertia + np.swapaxes(turning, -1, -2) @ about_center @ turning
            inertia = inertia + weight[..., np.newaxis, np.newaxis] * (np.swapaxes(speeds, -1, -2) @ speeds)
            turned = about_center[..., 0, 0] + about_center[..., 1, 1] + about_center[..., 2, 2]
            trace = trace + turned + 2.0 * weight * np.sum((center - point) ** 2, axis=-1)
        turns = np.array([unit == "rad" for unit in self.kind.units])
        if self.rotors:
            rotors = stack_numbers([numbers[index] for index in self.rotors])
            inertia = inertia + rotors[..., np.newaxis] * np.eye(len(turns))
            trace, mass = trace + rotors @ turns, mass + rotors @ ~turns
        size = np.where(turns, trace[..., np.newaxis], mass[..., np.newaxis])
        size = np.sqrt(np.where(size > 0.0, size, 1.0))
        return np.asarray(inertia / (size[..., np.newaxis] * size[..., np.newaxis, :]))

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        with np.errstate(all="ignore"):  # numbers near the largest double are refused elsewhere
            inertia = self._inertia(numbers)
        sound = np.where(np.isfinite(inertia).all(axis=(-2, -1), keepdims=True), inertia, np.eye(inertia.shape[-1]))
        least = sound[..., 0, 0] if sound.shape[-1] == 1 else np.linalg.eigvalsh(sound)[..., 0]
        return (least <= NO_INERTIA) & _all_zero([numbers[index] for index in self.followers])

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        inertias = [number for part in self.parts for number in (numbers[part.start], *numbers[part.start + 4 :][:6])]
        if not any((*inertias, *(numbers[index] for index in self.rotors))):
            return self.words.format("it carries neither mass nor inertia"), self.hint
        turns = self.kind.units.count("rad")
        needed = ["mass"] * (turns < len(self.kind.units))
        needed += ["inertia about its axis" if turns == 1 else "inertia about some axis"] * (turns > 0)
        return self.words.format(f"the bodies that it carries lack {', or '.join(needed)}"), self.hint


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
    """List of the formulas that a rule takes; ``put`` appends formulas and returns the indices."""

    def __init__(self) -> None:
        self.formulas: list[Formula] = []

    def put(self, *formulas: Formula) -> tuple[int, ...]:
        self.formulas += formulas
        return tuple(range(len(self.formulas) - len(formulas), len(self.formulas)))


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
        rotors, led, (pitch,) = tuple[int, ...](), tuple[int, ...](), places.put(joint.pitch)
        if absolute:
            words = f"in absolute coordinates the body {joint.child} has a free joint, and {{}} [E1641]"
            key, kind, hint = key_of("bodies", joint.child), JOINTS["free"], _ABSOLUTE_HINT
        else:
            words = (
                f"the joint {joint.name} cannot be moved by a force: {{}}, so the inertia matrix is singular [E1642]"
            )
            key, kind, hint = key_of("joints", joint.name), joint.kind, joint.kind.light.format(joint.child)
            if bodies[joint.child].beam is not None:
                hint = "polar_inertia for the beam, or another joint"
            rotors = places.put(*joint.each(joint.rotor_inertia))
            led = places.put(
                *(item.mimic.multiplier for item in followers.get(joint.name, ()) if item.mimic is not None)
            )
        subspaces = _subspaces(kind.name, joint.axis, joint.second_axis)
        rule = MovableInertia(kind, subspaces, parts, rotors, pitch, led, words, hint)
        later = type(values.report)(values.report.file, values.report.lines) if constrained else None
        if values.require(key, rule, places.formulas, later) and not fixed:
            sound.add(alike)
        if later is not None:
            determined += [LightJoint(joint.name, joint.child, problem) for _, problem in later.noted]
    return light, determined


def _parts(joint: Joint, fixed: Sequence[Joint], bodies: Mapping[str, Body], places: _Places) -> tuple[MovedPart, ...]:
    """Return the assembly that a joint carries: the child, and the bodies that the joints ``fixed`` connect to the
    child; the formulas of their values are appended to ``places``."""
    parts = [MovedPart(places.put(*_values_of(bodies[joint.child]))[0], np.eye(3))]
    numbered = {joint.child: 0}
    for item in fixed:
        carrier = numbered[item.parent]
        numbered[item.child] = len(parts)
        (start, *_), (position, *_) = places.put(*_values_of(bodies[item.child])), places.put(*item.position)
        parts.append(MovedPart(start, parts[carrier].orientation @ np.array(item.orientation), carrier, position))
    return tuple(parts)


def _formulas_of(joint: Joint, bodies: Mapping[str, Body]) -> tuple[object, ...]:
    """Return a key that is equal for joints which carry one body with the same axes and values: numbers by value,
    formulas by identity, because nodes of a beam share these."""
    formulas = (*_values_of(bodies[joint.child]), joint.pitch, *joint.each(joint.rotor_inertia))
    alike = [(formula.value,) if isinstance(formula, Number) else id(formula) for formula in formulas]
    return (joint.type, joint.axis, joint.second_axis, *alike)


@lru_cache
def _subspaces(joint_type: str, axis: tuple[float, ...], second_axis: tuple[float, ...]) -> tuple[Array, Array]:
    """Return the motion subspace of a joint at neutral coordinates, and the share of a pitch of 1."""
    from eomgen.scene.joints.tree import motion_subspace  # noqa: PLC0415  # a scene of a record is not read

    still, screwed = (motion_subspace(JOINTS[joint_type], axis, second_axis, pitch) for pitch in (0.0, 1.0))
    return still, screwed - still


_ABSOLUTE_HINT = "inertia = [xx, yy, zz] above zero, or joint coordinates"


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
        multipliers = places.put(*(joint.mimic.multiplier for joint in following if joint.mimic is not None))
        words = f"no force moves the joint {first}: neither it nor its followers carry mass or inertia [E1643]"
        hint = f"mass for a body that it moves, rotor_inertia, or a fixed joint (of other formats: lock {first})"
        rule = MimicInertia(leader, tuple(zip(multipliers, rest, strict=True)), words, hint)
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
    return places.put(*formulas)
