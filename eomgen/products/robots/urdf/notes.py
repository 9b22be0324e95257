"""Notes on a converted URDF: changes, implausible values, unsupported elements, and values that a scene needs and a
URDF does not give.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from eomgen.base.messages import first_of, listed, shown
from eomgen.products.robots.leftovers import NAMED, ElementPlace
from eomgen.products.robots.scene_draft import SceneDraft
from eomgen.products.robots.urdf.reading import NEWEST, Robot

#: A range of a joint that ends beyond this, in rad, and a bit more for digits, may be meant in degrees.
_TURN = 2.0 * math.pi + 1e-3


def notes_of(robot: Robot, locked: set[str], held: Mapping[str, float], leaders: Mapping[str, str]) -> list[str]:
    """Return notes on changed names, on angles and ranges of more than a turn, on joints that are held because their
    leaders are held, and on joints that follow others. ``locked`` are joints that the user holds, ``held`` coordinates
    of all held joints, ``leaders`` the leader by follower."""
    notes = []
    names = [*robot.link_names.items(), *robot.joint_names.items(), *robot.loop_names.items()]
    if pairs := [f"{shown(written)} is {name}" for written, name in dict.fromkeys(names) if written != name]:
        notes.append(f"names made legal: {first_of(pairs, NAMED)} [W0184]")
    turning = [joint for joint in robot.joints.values() if joint.unit == "rad"]
    wide = [joint.name for joint in turning for axis in joint.axes if any(map(_is_wide, (axis.lower, axis.upper)))]
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


def _is_wide(end: float) -> bool:
    return _TURN < abs(end) < math.inf


def note_version(scene: SceneDraft, robot: Robot) -> None:
    """Note as left out a version newer than the ones that are read."""
    if robot.minor > NEWEST:
        note = f"version 1.{robot.minor} of URDF is newer than 1.{NEWEST}: its new elements are not known [W0194]"
        scene.leave_out(ElementPlace(scene.report.file, 1), note)
