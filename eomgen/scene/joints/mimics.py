"""Mimic joints: which joints can be leaders."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from eomgen.base.text import key_of, listed, nearest, shown
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading.report import Report


def check_mimics(joints: Mapping[str, Joint], refused: Iterable[str], report: Report) -> None:
    """Report joints that follow one that is not there, has not one coordinate, or follows them in its turn.

    Parameters
    ----------
    refused : iterable of str
        Joints with invalid entries: they exist, but their data are unknown.
    """
    for joint in joints.values():
        key, path = key_of("joints", joint.name, "mimic"), [joint.name]
        leader = joint
        while leader.mimic is not None and leader.mimic.joint in joints and leader.mimic.joint not in path:
            leader = joints[leader.mimic.joint]
            path.append(leader.name)
        if leader.mimic is not None and leader.mimic.joint == joint.name == next(
            name for name in joints if name in path
        ):
            circle = listed([*path, joint.name]) if len(path) > 1 else ""
            fault = (
                f"the joints follow one another in a circle: {circle}"
                if circle
                else f"the joint {joint.name} follows itself"
            )
            report.add(f"{key}.joint", fault, "one joint that leads")
        if joint.mimic is None or joint.mimic.joint in refused:
            continue
        if joint.mimic.joint not in joints:
            report.add(
                f"{key}.joint", f"there is no joint {shown(joint.mimic.joint)}", nearest(joint.mimic.joint, joints)
            )
            continue
        first = joints[joint.mimic.joint]
        if first.kind.v_size != 1:
            count = first.kind.v_size or "no"
            fault = f"the {first.type} joint {first.name} cannot be followed: it has {count} coordinates, not one"
            *most, last = (name for name, row in JOINTS.items() if row.v_size == 1)
            report.add(f"{key}.joint", fault, f"a {', '.join(most)} or {last} joint")
