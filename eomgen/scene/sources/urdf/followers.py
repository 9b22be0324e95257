"""Mimic elements of a URDF: which joints follow a leader, and which are locked because their leader is.

A joint at rest (fixed, or locked by the user) may be followed too; its follower then rests at multiplier 0 + offset.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from eomgen.base.text import listed, nearest, shown
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.reading.report import Report
from eomgen.scene.sources.urdf.reading import Robot


def held_and_following(
    robot: Robot, locked: Collection[str], report: Report
) -> tuple[dict[str, float], dict[str, str]]:
    """Return the joints that are held, with their coordinates, and for each joint that follows another its leader.

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
            fault = f"there is no joint {shown(joint.mimic.joint)} to mimic"
            report.add_at(joint.mimic.line, key, fault, nearest(joint.mimic.joint, by_written))
            continue
        leader = robot.joints[by_written[joint.mimic.joint]]
        for role, one in (("mimic another", joint), ("be mimicked", leader)):
            if one.components > 1:
                fault = f"the {one.written_type} joint {one.name} cannot {role}: it has not one coordinate"
                *most, last = (name for row in JOINTS.values() if row.v_size == 1 for name in row.urdf)
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
            fault = f"the joints mimic one another in a circle: {listed([*path, name])}"
            report.add_at(robot.joints[name].line, f"joints.{name}", fault, "one joint that leads")


def _resolve(robot: Robot, name: str, leaders: Mapping[str, str], held: dict[str, float]) -> None:
    """Hold a joint if the last leader in its chain is held."""
    path = [name]
    while path[-1] not in held and path[-1] in leaders:
        path.append(leaders[path[-1]])
    for follower in reversed(path[:-1]):
        mimic = robot.joints[follower].mimic
        if mimic is not None and leaders[follower] in held:
            held[follower] = mimic.multiplier * held[leaders[follower]] + mimic.offset
