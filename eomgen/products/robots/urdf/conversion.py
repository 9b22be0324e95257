"""Conversion of a URDF to a scene: fixed joints are merged, mimic elements followed, unsupported elements listed.

A link's frame is its joint's frame at zero, in URDF as here, so placements stay.

A joint at rest (fixed, or locked by the user) may be followed too; its follower then rests at multiplier 0 + offset.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

from eomgen.base.data import replace
from eomgen.base.messages import first_of, listed, nearest, shown
from eomgen.products.robots.conversion import Conversion, joints_to_hold
from eomgen.products.robots.draft import Draft, DraftJoint, DraftMimic, DraftModel, WrittenPose
from eomgen.products.robots.leftovers import NAMED, ElementPlace
from eomgen.products.robots.scene_draft import SceneDraft
from eomgen.products.robots.urdf.reading import JOINT_TYPES, NEWEST, Robot, link_key, read_robot
from eomgen.products.robots.urdf.transmissions import convert_transmissions, read_transmissions
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import read_xml
from eomgen.scene.sources.source import ConvertedScene, OptionError

_ROOT_JOINT = "root_joint"
#: A range of a joint that ends beyond this, in rad, and a bit more for digits, may be meant in degrees.
_TURN = 2.0 * math.pi + 1e-3


def _mimic_of(joint: DraftJoint) -> DraftMimic | None:
    return next((axis.mimic for axis in (joint.around, *joint.axes) if axis is not None and axis.mimic), None)


def held_and_following(robot: Robot, locked: set[str], report: Report) -> tuple[dict[str, float], dict[str, str]]:
    """Return the coordinates, rad or m, of joints that do not move, by name, and the leader of each joint that follows
    another.

    Fixed and locked joints are held at 0, followers of held joints at the coordinate of their mimic relation. Raises
    DescriptionError for leaders that do not exist, joints without exactly one coordinate, and circles.
    """
    held = {joint.name: 0.0 for joint in robot.joints.values() if not joint.components or joint.name in locked}
    leaders: dict[str, str] = {}
    for joint in robot.joints.values():
        mimic = _mimic_of(joint)
        if mimic is None or joint.name in held:
            continue
        key, line = f"joints.{joint.name}", mimic.place.line
        if mimic.joint not in robot.joint_names:
            fault = f"there is no joint {shown(mimic.joint)} to mimic [E1688]"
            report.add_at(line, key, fault, nearest(mimic.joint, robot.joint_names))
            continue
        leader = robot.joints[robot.joint_names[mimic.joint]]
        for role, part in (("mimic another", joint), ("be mimicked", leader)):
            if part.components > 1:
                fault = f"the {part.written} joint {part.name} cannot {role}: it has not one coordinate [E1689]"
                *most, last = (name for name, kind in JOINT_TYPES.items() if JOINTS[kind].v_size == 1)
                report.add_at(line, key, fault, f"a {', '.join(most)} or {last} joint")
        leaders[joint.name] = leader.name
    try:
        for name in TopologicalSorter({name: [leader] for name, leader in leaders.items()}).static_order():
            mimic = _mimic_of(robot.joints[name])
            if mimic is not None and leaders.get(name) in held:
                held[name] = mimic.multiplier * held[leaders[name]] + mimic.offset
    except CycleError as error:
        first, *others = reversed(error.args[1])
        fault = f"the joints mimic one another in a circle: {listed([first, *others])} [E1690]"
        report.add_at(robot.joints[first].place.line, f"joints.{first}", fault, "one joint that leads")
    report.raise_problems()
    return held, {name: leader for name, leader in leaders.items() if name not in held}


def urdf_data(
    text: str,
    *,
    file: str = "robot.urdf",
    strict: bool = False,
    included: bool = False,
    root: str = "fixed",
    lock: Sequence[str] = (),
    limits: bool = False,
    friction: bool = False,
    actuated: bool = False,
    transmissions: bool = False,
    tunable: Sequence[str] = (),
) -> ConvertedScene:
    """Return a URDF in the form of a scene file, with notes on changed and left out elements.

    `text` and `file` are the text and its name in messages; `strict` refuses elements that would be left out. The root
    link is the base (`root` "fixed"; a body fixed to the base if a scene includes the file, `included`), or a body on a
    free joint ("free"). `lock` names joints to hold at zero; `limits` and `friction` take stops and dry friction;
    inputs are efforts of joints (`actuated`) or of actuators (`transmissions`); `tunable` names links whose mass
    properties are parameters. Raises DescriptionError, OptionError.
    """
    report = Report(file, {})
    root_element = read_xml(text, file)
    gears = read_transmissions(root_element, report) if transmissions else None
    robot = read_robot(root_element, report)
    locked = {robot.joint_names[name] for name in joints_to_hold(lock, robot.joint_names, file)}
    tunable_links = _tunable_links(robot, (tunable,) if isinstance(tunable, str) else tunable, file)
    report.raise_problems()
    root_link = _root_of(robot, report)
    held, leaders = held_and_following(robot, locked, report)
    draft = _draft_of(robot, held, leaders, file)
    draft.tunable = tunable_links
    draft.notes = [*root_element.liberties, *robot.notes]
    rests = root == "fixed" and not included
    if rests:
        name = robot.links[root_link].name
        draft.notes.append(f"the root link {name} is fixed to the base, and so are the links fixed to it [W0178]")
    else:
        draft.root = root
        draft.root_joint = _ROOT_JOINT if _ROOT_JOINT not in robot.joints else f"{_ROOT_JOINT}_free"
    conversion = Conversion(draft, SceneDraft(report, {}), limits=limits, friction=friction)
    conversion.connect({((), _joint_key(name)): value for name, value in held.items()}, [root_link] if rests else [])
    for feature, names in robot.left_out.items():
        for name in names:
            conversion.scene.left_out(feature, name)
    if gears is not None:
        convert_transmissions(conversion.scene, robot, *gears, {*held, *leaders})
    conversion.convert(actuated=actuated)
    conversion.scene.notes += [
        *([f"joints locked at zero: {listed(sorted(locked))} [W0171]"] if locked else []),
        *notes_of(robot, locked, held, leaders),
    ]
    if robot.minor > NEWEST:
        note = f"version 1.{robot.minor} of URDF is newer than 1.{NEWEST}: its new elements are not known [W0194]"
        conversion.scene.leave_out(ElementPlace(file, 1), note)
    motors = {
        name: {"name": written, "effort": robot.joints[name].axes[0].effort}
        for written, name in robot.joint_names.items()
        if name in robot.joints and robot.joints[name].axes
    }
    return replace(conversion.result(strict=strict), metadata={"motors": motors})


def notes_of(robot: Robot, locked: set[str], held: Mapping[str, float], leaders: Mapping[str, str]) -> list[str]:
    """Return notes on changed names, on angles and ranges of more than a turn, on joints that are held because their
    leaders are held, and on joints that follow others. ``locked`` are joints that the user holds, ``held`` coordinates
    of all held joints, ``leaders`` the leader by follower."""
    notes = []
    names = [*robot.link_names.items(), *robot.joint_names.items(), *robot.loop_names.items()]
    if pairs := [f"{shown(written)} is {name}" for written, name in dict.fromkeys(names) if written != name]:
        notes.append(f"names made legal: {first_of(pairs, NAMED)} [W0184]")
    wide = [
        joint.name
        for joint in robot.joints.values()
        for axis in joint.axes
        if joint.unit == "rad" and any(_TURN < abs(end) < math.inf for end in (axis.lower, axis.upper))
    ]
    for word, owners in (("rpy", robot.several_turns), ("limits", wide)):
        if owners:
            note = f"{word} of more than a turn at {listed(dict.fromkeys(owners))}"
            notes.append(f"{note}: angles of URDF are in radians, and 90 degrees are {math.pi / 2!r} [W0185]")
    if resting := [name for name in held if name not in locked and robot.joints[name].components]:
        notes.append(f"joints held because their leaders are held: {listed(resting)} [W0189]")
    if leaders:
        pairs = [f"{follower} follows {leader}" for follower, leader in leaders.items()]
        notes.append(f"joints that mimic others are not independent coordinates: {first_of(pairs, NAMED)} [W0190]")
    return notes


def _joint_key(name: str) -> str:
    return f"joint {name}"


def _draft_of(robot: Robot, held_joints: Collection[str], leaders: Mapping[str, str], file: str) -> Draft:
    """Return the draft of a robot, with each link at the carrying joint, and with leaders of mimics by their keys.
    Damping of joints of several coordinates is removed, and the joints are added to ``robot.left_out``. ``held_joints``
    do not move, ``leaders`` has the leader by follower, ``file`` the name in messages."""
    location = ElementPlace(file, 1)
    world = DraftModel("", location, WrittenPose(location))
    carrier = {joint.child: _joint_key(joint.name) for joint in robot.joints.values()}
    for key, link in robot.links.items():
        world.links[key] = replace(link, pose=WrittenPose(link.place, relative_to=carrier.get(key, "")))
    for name, joint in robot.joints.items():
        axes, around = joint.axes, joint.around
        if joint.components != 1 and name not in held_joints:
            if any(axis.damping for axis in (*axes, around) if axis is not None):
                robot.left_out.setdefault(f"damping of a {joint.written} joint", []).append(name)
            axes = tuple(replace(axis, damping=0.0) for axis in axes)
            around = around and replace(around, damping=0.0)
        elif axes and axes[0].mimic is not None and name in leaders:
            axes = (replace(axes[0], mimic=replace(axes[0].mimic, joint=_joint_key(leaders[name]))),)
        world.joints[_joint_key(name)] = replace(joint, axes=axes, around=around)
    loops = list(robot.loops.values())
    return Draft(robot.name, world, robot.leftovers, undrawn=robot.undrawn, loops=loops, legal=True)


def _tunable_links(robot: Robot, tunable: Sequence[str], file: str) -> set[str]:
    """Return the keys in ``robot.links`` of the links named in ``tunable``. Raises OptionError for a name that the file
    lacks."""
    for name in tunable:
        if name not in robot.link_names:
            raise OptionError("tunable", f"{file} has no link {shown(name)} [E1973]", nearest(name, robot.link_names))
    return {link_key(robot.link_names[name]) for name in tunable}


def _root_of(robot: Robot, report: Report) -> str:
    """Return the key of the root link. Raises DescriptionError without links, for a link that two joints carry, without
    exactly one root, and for joints in a circle."""
    if not robot.links:
        report.add_at(1, "", "the robot has no link [E1691]", "xacro first, if the file was meant for it")
        report.raise_problems()
    carrier: dict[str, DraftJoint] = {}
    children: dict[str, list[DraftJoint]] = {key: [] for key in robot.links}
    for joint in robot.joints.values():
        if joint.child in carrier:
            link, carrying = robot.links[joint.child].name, carrier[joint.child].name
            fault = f"the link {link} is already carried by the joint {carrying} [E1694]"
            hint = "one joint for each link; a <loop_joint> closes a loop"
            report.add_at(joint.place.line, f"joints.{joint.name}", fault, hint)
        carrier.setdefault(joint.child, joint)
        children[joint.parent].append(joint)
    report.raise_problems()
    roots = [key for key in robot.links if key not in carrier]
    reached = [*roots]
    for key in reached:
        reached += [joint.child for joint in children[key]]
    lost = [joint.name for joint in robot.joints.values() if joint.child not in reached]
    if lost:
        fault = f"the joints {listed(lost)} run in a circle [E1695]"
        report.add_at(robot.joints[lost[0]].place.line, "", fault, "one link that is not a joint's child")
    elif len(roots) > 1:
        fault = f"there are {len(roots)} root links: {listed([robot.links[key].name for key in roots])} [E1692]"
        report.add_at(1, "", fault, "one link that is not a joint's child")
    report.raise_problems()
    return roots[0]
