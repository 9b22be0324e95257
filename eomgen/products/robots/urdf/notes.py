"""Notes on a converted URDF: changes, implausible values, unsupported elements, and values that a scene needs and a
URDF does not give.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np

from eomgen.base.messages import listed, shown
from eomgen.products.robots.draft import Axis
from eomgen.products.robots.leftovers import ElementPlace, beginning
from eomgen.products.robots.scene_draft import SceneDraft
from eomgen.products.robots.urdf.reading import NEWEST, WITH_QUATERNIONS, Robot

#: A range of a joint that ends beyond this, in rad, and a bit more for digits, may be meant in degrees.
_TURN = 2.0 * math.pi + 1e-3
#: Elements left out of moving joints, without effect on held joints.
_OF_MOVING_JOINTS = ("safety_controller", "calibration")


def notes_of_friction(robot: Robot) -> list[str]:
    """Return the note that friction=True has no effect, in a list, if no joint of one coordinate has friction; else an
    empty list."""
    axes = [axis for joint in robot.joints.values() if joint.unit for axis in joint.axes]
    if any(axis.friction > 0.0 for axis in axes):
        return []
    return ["friction=True has no effect: no joint has <dynamics> with a friction above 0 [W0177]"]


def notes_of_what_has_no_effect(robot: Robot, still: Collection[str]) -> list[str]:
    """Return notes on elements without effect on the motion, which are not a reason to refuse a file. ``still`` are
    joints that are held: elements for moving joints on them are moved out of ``robot.leftovers``."""
    notes = []
    counts = [f"{count} <{kind}>" for kind, count in robot.geometry.items() if count]
    if counts:
        notes.append(f"geometry and colours have no part in the equations of motion: {', '.join(counts)} [W0182]")
    idle = dict(robot.without_effect)
    for tag in _OF_MOVING_JOINTS:
        places = robot.leftovers.noted.pop(tag, [])
        if names := [name for _, name in places if name in still]:
            idle[tag] = names
        if moving := [(location, name) for location, name in places if name not in still]:
            robot.leftovers.noted[tag] = moving
    if idle:
        named = [f"<{tag}> ({len(names)}: {listed(names)})" for tag, names in idle.items()]
        notes.append(f"without effect on the joints that have it: {', '.join(named)} [W0183]")
    return notes


def notes_of_names_and_angles(robot: Robot) -> list[str]:
    """Return notes on changed names, angles of more than a turn and angles made exact."""
    notes = []
    if robot.original:
        pairs = [f"{shown(written)} is {name}" for name, written in robot.original.items()]
        notes.append(f"names made legal: {beginning(pairs)} [W0184]")
    if robot.several_turns:
        note = f"rpy of more than a turn at {listed(dict.fromkeys(robot.several_turns))}"
        notes.append(f"{note}: angles of URDF are in radians, and 90 degrees are {math.pi / 2!r} [W0185]")
    if robot.snapped:
        joints = f"the joint{'s' * (len(robot.snapped) != 1)} {beginning(robot.snapped)}"
        notes.append(f"right angles made exact in the placement of {joints} [W0186]")
    return notes


def notes_of_sizes(robot: Robot) -> list[str]:
    """Return notes on numbers that look like another unit: ranges of more than a turn, and moments of inertia too large
    for the robot."""
    notes = []
    turning = [joint for joint in robot.joints.values() if joint.unit == "rad"]
    wide = [joint.name for joint in turning for axis in joint.axes if axis.limited and _is_wide(axis)]
    if wide:
        note = f"limits of more than a turn at {listed(wide)}"
        notes.append(f"{note}: angles of URDF are in radians, and 90 degrees are {math.pi / 2!r} [W0185]")
    lengths = [float(np.linalg.norm(joint.pose.position)) for joint in robot.joints.values()]
    offsets = [float(np.linalg.norm(link.inertia.center)) for link in robot.links.values()]
    size = sum(lengths) + max(offsets, default=0.0)
    for link in robot.links.values():
        if link.inertia.mass <= 0.0 or size == 0.0:
            continue
        moment = float(np.linalg.norm(link.inertia.about_center, 2))
        radius = math.sqrt(moment / link.inertia.mass)
        if radius >= 100.0 * size:
            note = f"link {link.name}: the radius of gyration {radius:.3g} m is large for the robot, {size:.3g} m"
            notes.append(f"{note}; moments of inertia of URDF are in kg m^2 [W0188]")
    return notes


def _is_wide(axis: Axis) -> bool:
    return max(abs(axis.lower), abs(axis.upper)) > _TURN


def notes_of_mimics(robot: Robot, locked: set[str], held: Mapping[str, float], leaders: Mapping[str, str]) -> list[str]:
    """Return notes on joints that are held because their leaders are held, and on joints that follow others. ``locked``
    are joints that the user holds, ``held`` coordinates of all held joints, ``leaders`` the leader by follower."""
    resting = [name for name in held if name not in locked and robot.joints[name].components]
    notes = []
    if resting:
        notes.append(f"joints held because their leaders are held: {listed(resting)} [W0189]")
    if leaders:
        pairs = beginning([f"{follower} follows {leader}" for follower, leader in leaders.items()])
        notes.append(f"joints that mimic others are not independent coordinates: {pairs} [W0190]")
    return notes


def note_versions(scene: SceneDraft, robot: Robot) -> None:
    """Note as left out a version newer than the ones that are read, and quaternions in an older version."""
    file = scene.report.file
    if robot.minor > NEWEST:
        note = f"version 1.{robot.minor} of URDF is newer than 1.{NEWEST}: its new elements are not known [W0194]"
        scene.leave_out(ElementPlace(file, 1), note)
    if robot.quaternions and robot.minor < WITH_QUATERNIONS:
        names = f"({len(robot.quaternions)}: {listed([name for _, name in robot.quaternions])})"
        version = f"version 1.{WITH_QUATERNIONS} of URDF, and is read from this file of version 1.{robot.minor}"
        note = f"quat_xyzw belongs to {version} {names} [W0195]"
        scene.leave_out(ElementPlace(file, robot.quaternions[0][0]), note)
