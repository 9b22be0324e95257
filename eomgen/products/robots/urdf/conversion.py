"""Conversion of a URDF to a scene: fixed joints are merged, mimic elements followed, unsupported elements listed.

A link's frame is its joint's frame at zero, in URDF as here, so placements are taken over as they are.

A joint at rest (fixed, or locked by the user) may be followed too; its follower then rests at multiplier 0 + offset.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import legal_name, listed, nearest, shown
from eomgen.products.robots.urdf.notes import (
    GIVE,
    friction_of,
    inertia_warnings,
    left_out,
    notes_of_mimics,
    notes_of_names_and_angles,
    notes_of_sizes,
    notes_of_what_has_no_effect,
    stops_of,
)
from eomgen.products.robots.urdf.reading import JOINT_TYPES, Joint, LoopJoint, Robot, read_robot
from eomgen.products.robots.urdf.transmissions import Transmissions, actuation, effort_inputs, read_transmissions
from eomgen.scene.inertia import Inertia, combined
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.tree import displaced
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import read_xml
from eomgen.scene.rotations import frame_about, quaternion_of_matrix, rows, snapped_rotation, unit_axis
from eomgen.scene.sources.source import OptionError
from eomgen.system.description import BASE, WORLD

_ENTRIES = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


def body_entry(inertia: Inertia) -> dict[str, Any]:
    """Return the entry of a body with the given mass properties."""
    tensor = [float(inertia.about_center[place]) for place in _ENTRIES.values()]
    return {"mass": inertia.mass, "center_of_mass": np.asarray(inertia.center).tolist(), "inertia": tensor}


def tunable_body(link: str, inertia: Inertia) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return ten tunable parameters with the values of a link, and the entry of a body that uses these parameters.

    The parameters are ``LINK_mass``, ``LINK_center_x`` (and y, z), m in the link's frame, and ``LINK_inertia_xx`` (yy,
    zz, xy, xz, yz), kg m^2 about the centre of mass in the link's axes.
    """
    fixed = body_entry(inertia)
    values = {f"{link}_mass": (fixed["mass"], "kg")}
    values |= {f"{link}_center_{x}": (value, "m") for x, value in zip("xyz", fixed["center_of_mass"], strict=True)}
    values |= {f"{link}_inertia_{x}": (value, "kg m^2") for x, value in zip(_ENTRIES, fixed["inertia"], strict=True)}
    names = list(values)
    parameters = {name: {"value": value, "unit": unit, "tunable": True} for name, (value, unit) in values.items()}
    return parameters, {"mass": names[0], "center_of_mass": names[1:4], "inertia": names[4:]}


def held_and_following(
    robot: Robot, locked: Collection[str], report: Report
) -> tuple[dict[str, float], dict[str, str]]:
    """Return the held joints with coordinates, and the leader of each following joint.

    Faults go to the report: leaders that do not exist or have not one coordinate, and circles.
    """
    held = {joint.name: 0.0 for joint in robot.joints.values() if not joint.components or joint.name in locked}
    leaders: dict[str, str] = {}
    by_written = {robot.original.get(name, name): name for name in robot.joints}
    for joint in robot.joints.values():
        if joint.mimic is None or joint.name in held:
            continue
        key = f"joints.{joint.name}"
        if joint.mimic.joint not in by_written:
            fault = f"there is no joint {shown(joint.mimic.joint)} to mimic [E1688]"
            report.add_at(joint.mimic.line, key, fault, nearest(joint.mimic.joint, by_written))
            continue
        leader = robot.joints[by_written[joint.mimic.joint]]
        for role, one in (("mimic another", joint), ("be mimicked", leader)):
            if one.components > 1:
                fault = f"the {one.written_type} joint {one.name} cannot {role}: it has not one coordinate [E1689]"
                *most, last = (name for name, kind in JOINT_TYPES.items() if JOINTS[kind].v_size == 1)
                report.add_at(joint.mimic.line, key, fault, f"a {', '.join(most)} or {last} joint")
        leaders[joint.name] = leader.name
    _check_circles(robot, leaders, report)
    report.raise_problems()
    for name in leaders:
        _resolve(robot, name, leaders, held)
    return held, {name: leader for name, leader in leaders.items() if name not in held}


def _check_circles(robot: Robot, leaders: Mapping[str, str], report: Report) -> None:
    reported: set[str] = set()
    for name in leaders:
        path = [name]
        while (leader := leaders.get(path[-1])) is not None and leader not in path:
            path.append(leader)
        if leader == name and name not in reported:
            reported.update(path)
            fault = f"the joints mimic one another in a circle: {listed([*path, name])} [E1690]"
            report.add_at(robot.joints[name].line, f"joints.{name}", fault, "one joint that leads")


def _resolve(robot: Robot, name: str, leaders: Mapping[str, str], held: dict[str, float]) -> None:
    """Hold a joint if the last leader in the chain of leaders is held."""
    path = [name]
    while path[-1] not in held and path[-1] in leaders:
        path.append(leaders[path[-1]])
    for follower in reversed(path[:-1]):
        mimic = robot.joints[follower].mimic
        if mimic is not None and leaders[follower] in held:
            held[follower] = mimic.multiplier * held[leaders[follower]] + mimic.offset


_RESERVED = {BASE: "the frame that carries the tree", WORLD: "the frame at rest while the base moves"}
_ROOT_JOINT = "root_joint"


def urdf_data(
    text: str,
    *,
    file: str,
    strict: bool = False,
    root: str = "fixed",
    lock: Sequence[str] = (),
    limits: bool = False,
    friction: bool = False,
    actuated: bool = False,
    transmissions: bool = False,
    tunable: Sequence[str] = (),
) -> tuple[dict[str, Any], dict[str, int | str], list[str]]:
    """Return a URDF in the form of a scene file, the line of each key, and notes on changed and left out elements.

    Parameters
    ----------
    root : str
        ``fixed``: the root link is the base. ``attached``: the root link is a body, fixed to the base. ``free``: a body
        on a free joint.

    Raises
    ------
    DescriptionError, OptionError
    """
    lock = (lock,) if isinstance(lock, str) else lock
    tunable = (tunable,) if isinstance(tunable, str) else tunable
    report = Report(file, {})
    root_element = read_xml(text, file)
    gears = read_transmissions(root_element, report) if transmissions else Transmissions((), {})
    robot = read_robot(root_element, report)
    locked = _locked_joints(robot, lock, file)
    own = _tunable_links(robot, tunable, file)
    if limits:
        check_ranges(robot, report)
    report.raise_problems()
    order = _from_root(robot, report)
    held, leaders = held_and_following(robot, locked, report)
    merger = _Merger(robot, order, held, leaders, root, own, report, limits=limits, friction=friction)
    report.raise_problems()
    motors = actuation(robot, gears, held.keys(), leaders.keys())
    own_inputs = [joint for joint in order if joint.name not in held and joint.name not in leaders] if actuated else []
    units = {joint.name: joint.unit for joint in own_inputs if joint.name not in motors.driven}
    merger.data |= effort_inputs(units, motors)
    notes = [
        *root_element.liberties,
        *merger.notes,
        *motors.notes,
        *notes_of_names_and_angles(robot, locked),
        *notes_of_sizes(robot),
        *notes_of_mimics(robot, locked, held, leaders),
    ]
    if transmissions and not gears.known and not gears.unknown:
        notes.append(
            "the file has no <transmission>, so none gives inputs; actuated=True gives one for each joint [W0176]"
        )
    if friction and not any(friction_of(joint) for joint in robot.joints.values()):
        notes.append("friction=True changes nothing: no joint has <dynamics> with a friction above 0 [W0177]")
    notes += notes_of_what_has_no_effect(robot, held)
    notes += robot.visuals.notes()
    warnings = [*inertia_warnings(robot), *left_out(robot, set(held)), *motors.warnings]
    if strict:
        for line, note in warnings:
            report.add_at(line, "", note, "no --strict (strict=False), to go on without")
        report.raise_problems()
    return merger.data, merger.lines, [*notes, *(note for _, note in warnings)]


def _locked_joints(robot: Robot, lock: Sequence[str], file: str) -> set[str]:
    """Return the joints to lock by their names in the scene; raise OptionError for a name that the file lacks."""
    by_written = {robot.original.get(name, name): name for name in robot.joints}
    for name in lock:
        if name not in by_written:
            several = [part.strip() for part in name.split(",")]
            hint = nearest(name, by_written)
            if len(several) > 1 and all(part in by_written for part in several):
                hint = f"one name for each: lock={several!r}, or --lock {' --lock '.join(several)}"
            raise OptionError("lock", f"{file} has no joint {shown(name)} to lock [E1938]", hint)
    return {by_written[name] for name in lock}


def _tunable_links(robot: Robot, tunable: Sequence[str], file: str) -> set[str]:
    """Return the links with tunable inertia by their names in the scene; raise OptionError for a name that the file
    lacks."""
    links = {robot.original.get(name, name): name for name in robot.links}
    for name in tunable:
        if name not in links:
            raise OptionError("tunable", f"{file} has no link {shown(name)} [E1973]", nearest(name, links))
    return {links[name] for name in tunable}


def _from_root(robot: Robot, report: Report) -> list[Joint]:
    """Return the joints with parents first, in the file's order otherwise; raise an error for faults of the tree."""
    if not robot.links:
        report.add_at(1, "", "the robot has no link [E1691]", "xacro first, if the file was meant for it")
        report.raise_problems()
    carrier: dict[str, Joint] = {}
    children: dict[str, list[Joint]] = {name: [] for name in robot.links}
    for joint in robot.joints.values():
        if joint.child in carrier:
            fault = f"the link {joint.child} is already carried by the joint {carrier[joint.child].name} [E1694]"
            report.add_at(
                joint.line,
                f"joints.{joint.name}",
                fault,
                "one joint for each link; a <loop_joint> closes a loop",
            )
        carrier.setdefault(joint.child, joint)
        children[joint.parent].append(joint)
    roots = [name for name in robot.links if name not in carrier]
    if len(roots) != 1:
        fault = (
            f"there are {len(roots)} root links: {listed(roots)} [E1692]"
            if roots
            else "no link is the root: the joints run in a circle [E1693]"
        )
        report.add_at(1, "", fault, "one link that is not a joint's child")
    report.raise_problems()
    order: list[Joint] = []
    waiting = children[roots[0]][::-1]
    while waiting:
        joint = waiting.pop()
        order.append(joint)
        waiting += children[joint.child][::-1]
    reached = {joint.name for joint in order}
    lost = [name for name in robot.joints if name not in reached]
    if lost:
        report.add_at(
            robot.joints[lost[0]].line,
            "",
            f"the joints {listed(lost)} run in a circle, away from the root {roots[0]} [E1695]",
            "",
        )
    report.raise_problems()
    return order


@dataclass(frozen=True)
class _Place:
    """Body and pose of a link."""

    body: str
    orientation: Array
    position: Array


#: Ends of a loop meet within this part of their distance from the origin of their body, as digits of files allow.
_MET = 1e-6


class _Merger:
    """Merges links that are fixed to one another into one body; frames of links keep their names."""

    def __init__(
        self,
        robot: Robot,
        order: Sequence[Joint],
        held: Mapping[str, float],
        leaders: Mapping[str, str],
        root: str,
        tunable: Collection[str],
        report: Report,
        *,
        limits: bool,
        friction: bool,
    ) -> None:
        self.robot = robot
        self.report = report
        self.tunable = tunable
        self.held = held
        self.leaders = leaders
        self.limits = limits
        self.friction = friction
        self.notes: list[str] = []
        self.lines: dict[str, int | str] = {}
        self.parts: dict[str, dict[str, Inertia]] = {}
        children = {joint.child for joint in order}
        root_link = next(name for name in robot.links if name not in children)
        self.data: dict[str, Any] = {"format": 1, "name": robot.name, "bodies": {}, "joints": {}, "frames": {}}
        identity = (np.eye(3), np.zeros(3))
        self.places = {root_link: _Place(BASE if root == "fixed" else self.body_name(root_link), *identity)}
        if root != "fixed":
            joint_name = _ROOT_JOINT if _ROOT_JOINT not in robot.joints else f"{_ROOT_JOINT}_free"
            kind = "free" if root == "free" else "fixed"
            self.data["joints"][joint_name] = {"type": kind, "parent": BASE, "child": self.places[root_link].body}
        self.add_part(root_link)
        if robot.implied_world:
            self.notes.append("joints name the link world, which the file lacks: it is a link without mass [W0271]")
        if root == "fixed":
            self.data["frames"][root_link] = {"body": BASE}
            self.notes.append(
                f"the root link {root_link} is fixed to the base, and so are the links fixed to it [W0178]"
            )
        for joint in order:
            self.attach(joint)
        for loop in robot.loops.values():
            self.close(loop)
        self.make_bodies()
        self.make_shapes()

    def body_name(self, link: str) -> str:
        if link not in _RESERVED:
            return link
        name = f"{link}_link" if f"{link}_link" not in self.robot.links else f"{link}_body"
        while name in self.robot.links:
            name += "_"
        self.notes.append(
            f"the link {link} is the body {name}, because {link} is the name of {_RESERVED[link]} [W0179]"
        )
        return name

    def add_part(self, link: str) -> None:
        place = self.places[link]
        inertia = self.robot.links[link].inertia
        self.parts.setdefault(place.body, {})[link] = inertia.moved(place.orientation, place.position)
        if place.body == BASE and link in self.tunable:
            fault = f"the link {link} is fixed to the base, so its mass and inertia move nothing [E1975]"
            raise OptionError("tunable", fault, "a link that a joint moves")
        self.lines.setdefault(f"bodies.{place.body}", self.robot.links[link].line)

    def attach(self, joint: Joint) -> None:
        """Place a joint's child: on the body of the parent for a fixed joint, else as a separate body."""
        parent = self.places[joint.parent]
        orientation = snapped_rotation(parent.orientation @ joint.orientation)
        position = parent.orientation @ joint.position + parent.position
        self.lines[f"joints.{joint.name}"] = joint.line
        if joint.name in self.held:
            turn, shift = _moved(joint, self.held[joint.name])
            orientation, position = snapped_rotation(orientation @ turn), position + orientation @ shift
        if joint.name in self.held and joint.child in self.tunable and parent.body != BASE:
            self.fix(joint.name, parent.body, joint.child, orientation, position)
        elif joint.name in self.held:
            self.places[joint.child] = _Place(parent.body, orientation, position)
            turned = [list(row) for row in rows(orientation)]
            self.data["frames"][joint.child] = {
                "body": parent.body,
                "position": position.tolist(),
                "orientation": turned,
            }
            self.lines[f"frames.{joint.child}"] = joint.line
        else:
            self.places[joint.child] = _Place(self.body_name(joint.child), np.eye(3), np.zeros(3))
            entry: dict[str, Any] = {"type": joint.type, "parent": parent.body, "child": self.places[joint.child].body}
            entry |= {"position": position.tolist(), "orientation": [list(row) for row in rows(orientation)]}
            if JOINTS[joint.type].coordinates:
                entry["axis"] = list(joint.axis)
            if joint.type == "universal":
                entry |= {"axis": [1.0, 0.0, 0.0], "second_axis": [0.0, 1.0, 0.0]}
            if joint.pitch:
                entry["pitch"] = joint.pitch
            if joint.unit:
                entry["damping"] = joint.damping
            elif joint.damping:
                self.robot.left_out.setdefault(f"damping of a {joint.written_type} joint", []).append(joint.name)
            if joint.mimic is not None:
                leader = {"joint": self.leaders[joint.name]}
                entry["mimic"] = leader | {"multiplier": joint.mimic.multiplier, "offset": joint.mimic.offset}
            self.add_friction(joint, entry)
            self.add_limits(joint, entry)
            self.data["joints"][joint.name] = entry
        self.add_part(joint.child)

    def fix(self, joint: str, parent: str, link: str, orientation: Array, position: Array) -> None:
        """Make a separate body of a link that is fixed to another body."""
        self.places[link] = _Place(self.body_name(link), np.eye(3), np.zeros(3))
        self.data["joints"][joint] = {
            "type": "fixed",
            "parent": parent,
            "child": self.places[link].body,
            "position": position.tolist(),
            "orientation": [list(row) for row in rows(orientation)],
        }

    def close(self, loop: LoopJoint) -> None:
        """Make a constraint of a joint that closes a loop: frames in the bodies of both links, z along the axis of the
        joint; of a universal joint the first x and the second y."""
        entry: dict[str, Any] = {"type": loop.type}
        ends: list[tuple[Array, Array]] = []
        for side, end, columns in (("first", loop.first, (2, 0, 1)), ("second", loop.second, (1, 2, 0))):
            along = unit_axis(end.axis)
            assert along is not None  # the reader refuses an axis of no length
            frame_of_axis = np.array(frame_about(along))
            if loop.type == "universal":
                frame_of_axis = frame_of_axis[:, columns]
            place = self.places[end.link]
            turned = snapped_rotation(place.orientation @ end.orientation @ frame_of_axis)
            position = place.orientation @ end.position + place.position
            frame: dict[str, Any] = {"body": place.body, "position": position.tolist()}
            if loop.type != "spherical":
                frame |= {"axis": turned[:, 2].tolist(), "x_axis": turned[:, 0].tolist()}
            entry[side] = frame
            ends.append((turned, position))
        if entry["first"]["body"] == entry["second"]["body"]:
            self.drop(loop, ends)
            return
        self.data.setdefault("constraints", {})[loop.name] = entry
        self.lines[f"constraints.{loop.name}"] = loop.line

    def drop(self, loop: LoopJoint, ends: Sequence[tuple[Array, Array]]) -> None:
        """Note a loop whose ends are in one body, which meet; report ends that do not."""
        (first, start), (second, end) = ends
        gap = first.T @ (end - start)
        apart = {"prismatic": gap[:2], "planar": gap[2:]}.get(loop.type, gap)
        about = {"revolute": first[:, :2].T @ second[:, 2], "planar": first[:, :2].T @ second[:, 2]}
        about |= {"universal": first[:, 2:].T @ second[:, 2], "spherical": np.zeros(1)}
        turned = about.get(loop.type, first.T @ second - np.eye(3))
        size = float(max(np.linalg.norm(start), np.linalg.norm(end)))
        if np.linalg.norm(apart) <= _MET * size and np.max(np.abs(turned)) <= _MET:
            self.notes.append(
                f"the loop {loop.name} is left out: held joints make one body of its ends, which meet [W0272]"
            )
            return
        fault = (
            f"held joints make one body of the ends of {loop.name}, with a gap of {np.linalg.norm(apart):.3g} m [E2207]"
        )
        angle = float(np.degrees(np.arcsin(min(1.0, float(np.max(np.abs(turned)))))))
        fault += f" and turned by {angle:.3g} degrees" if angle > np.degrees(_MET) else ""
        self.report.add_at(loop.line, f"constraints.{loop.name}", fault, "a joint of the loop that is not locked")

    def add_limits(self, joint: Joint, entry: dict[str, Any]) -> None:
        """Turn a joint's limits into stops if requested, and note the limits that are left out."""
        stops = stops_of(joint) if self.limits else None
        if stops is not None:
            entry["limits"] = stops
            self.robot.left_out.setdefault("limits of velocity and effort", []).append(joint.name)
        elif joint.limit is not None:
            self.robot.left_out.setdefault("limit", []).append(joint.name)

    def add_friction(self, joint: Joint, entry: dict[str, Any]) -> None:
        """Take a joint's dry friction if requested, and note friction that is left out."""
        friction = friction_of(joint) if self.friction else None
        if friction is not None:
            entry["friction"] = friction
        elif joint.friction != 0.0:
            self.robot.left_out.setdefault("friction", []).append(joint.name)

    def make_bodies(self) -> None:
        merged = [name for name in self.data["frames"] if name in self.robot.links]
        if merged:
            one = len(merged) == 1
            many = (
                "1 link is merged into the body it is"
                if one
                else f"{len(merged)} links are merged into the bodies they are"
            )
            self.notes.append(f"{many} fixed to and kept as {'a frame' if one else 'frames'}: {listed(merged)} [W0180]")
        for body, parts in self.parts.items():
            own = next((link for link in parts if link in self.tunable), "")
            if body == BASE:
                continue
            if not own:
                self.data["bodies"][body] = body_entry(combined(list(parts.values())))
                continue
            parameters, self.data["bodies"][body] = tunable_body(own, self.robot.links[own].inertia)
            self.data.setdefault("parameters", {}).update(parameters)
            others = combined([part for link, part in parts.items() if link != own])
            if others.mass or np.any(others.about_center):
                name = f"{body}_others"
                self.data["bodies"][name] = body_entry(others)
                self.data["joints"][name] = {"type": "fixed", "parent": body, "child": name}
                self.notes.append(f"links fixed to the tunable link {own} become the body {name} [W0181]")

    def make_shapes(self) -> None:
        """Make shapes of the visuals, named by their links."""
        shapes: dict[str, dict[str, Any]] = {}
        for link, visuals in self.robot.visuals.by_link.items():
            place = self.places[link]
            for visual in visuals:
                name = legal_name(link, shapes)
                position = place.orientation @ visual.position + place.position
                turned = snapped_rotation(place.orientation @ visual.orientation)
                placed = {"body": place.body, "position": position.tolist(), "rotation": turns_of(turned)}
                shapes[name] = {**visual.entry, **placed}
        if shapes:
            self.data["shapes"] = shapes


def turns_of(orientation: Array) -> list[dict[str, Any]]:
    """Return a rotation as the entries of a key ``rotation``."""
    w, *vector = quaternion_of_matrix(orientation.tolist())
    sine = float(np.linalg.norm(vector))
    return [{"axis": vector, "angle": 2.0 * float(np.arctan2(sine, w))}] if sine else []


def _moved(joint: Joint, value: float) -> tuple[Array, Array]:
    """Return rotation and shift of the child of a held joint."""
    axis = unit_axis(joint.axis) if value != 0.0 else None
    if axis is None:
        return np.eye(3), np.zeros(3)
    return displaced(JOINTS[joint.type], axis, np.zeros(3), [value])[:2]


def check_ranges(robot: Robot, report: Report) -> None:
    """Report ranges of joints whose lower end is above the upper one, of which no stops can be made."""
    for joint in robot.joints.values():
        limit = joint.limit
        if limit is None or joint.unit not in GIVE or joint.written_type == "continuous":
            continue
        if limit.lower > limit.upper:
            fault = (
                f"the lower limit, {limit.lower:.9g}, is above the upper one, {limit.upper:.9g} {joint.unit} [E1696]"
            )
            report.add_at(joint.line, f"joints.{joint.name}.limit", fault, "the smaller number as lower")
