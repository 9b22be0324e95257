"""What is said of a URDF that was taken over: what was changed, what is doubtful, and what is not modelled."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from eomgen.scene.inertia import impossible
from eomgen.scene.names import listed, shown
from eomgen.scene.urdf_elements import Robot

_MEANING = {
    "limit": "limits of position, velocity and effort",
    "friction": "dry friction",
    "safety_controller": "safety controllers",
    "calibration": "calibration",
    "transmission": "transmissions",
    "gazebo": "settings of Gazebo",
}


def notes_of_names_and_angles(robot: Robot, locked: set[str]) -> list[str]:
    """Return what was locked, renamed, and made exact or not."""
    notes = []
    if locked:
        notes.append(f"joints locked at zero: {listed(sorted(locked))}")
    if robot.original:
        pairs = [f"{shown(written)} is {name}" for name, written in robot.original.items()]
        notes.append(f"names made legal: {', '.join(pairs[:8])}{f' and {len(pairs) - 8} more' if len(pairs) > 8 else ''}")
    if robot.snapped:
        notes.append(f"right angles made exact in the placement of {_joints(robot.snapped)}")
    if robot.nearly_right:
        angles = [f"{name} ({angle})" for name, angle in list(robot.nearly_right.items())[:8]]
        more = f" and {len(robot.nearly_right) - 8} more" if len(robot.nearly_right) > 8 else ""
        notes.append(
            f"angles near a right angle, but not exact, are kept in the placement of {_joints(angles)}{more}: "
            f"pi/2 written in full, {math.pi / 2!r}, would be made exact and save operations"
        )
    return notes


def notes_of_mimics(robot: Robot, locked: set[str], held: Mapping[str, float], leaders: Mapping[str, str]) -> list[str]:
    """Return what became of the joints that mimic others."""
    resting = [name for name in held if name not in locked and robot.joints[name].type != "fixed"]
    notes = []
    if resting:
        notes.append(f"joints held where those that they mimic are held: {listed(resting)}")
    if leaders:
        pairs = [f"{follower} follows {leader}" for follower, leader in list(leaders.items())[:8]]
        more = f" and {len(leaders) - 8} more" if len(leaders) > 8 else ""
        notes.append(f"joints that mimic others are no coordinates of their own: {', '.join(pairs)}{more}")
    return notes


def _joints(names: Sequence[str]) -> str:
    return f"the joint{'s' * (len(names) != 1)} {', '.join(names[:8])}{f' and {len(names) - 8} more' if len(names) > 8 else ''}"


def doubtful_inertias(robot: Robot) -> list[tuple[int, str]]:
    """Return the line and the fault of each link that no body can be."""
    found = []
    for link in robot.links.values():
        fault = impossible(link.inertia.mass, link.inertia.about_center)
        if fault:
            found.append((link.line, f"link {link.name}: {fault}"))
    return found


def left_out(robot: Robot, still: set[str]) -> list[tuple[int, str]]:
    """Return one note for each kind of thing that is not modelled, of joints that move."""
    found = []
    for tag, names in robot.left_out.items():
        concerned = [name for name in names if name not in still]
        if concerned:
            meaning = _MEANING.get(tag, tag if " " in tag else f"elements <{tag[:64]}>")
            named = [name for name in dict.fromkeys(concerned) if name]
            found.append((1, f"not modelled: {meaning} ({len(concerned)}{': ' if named else ''}{listed(named)})"))
    return found
