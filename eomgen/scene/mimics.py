"""Joints that follow others: whom they can follow, and whether what they move together has any inertia."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from eomgen.scene.inertia import Inertia
from eomgen.scene.joint import SIZES, Joint
from eomgen.scene.names import key_of, listed, nearest, shown
from eomgen.scene.report import Report
from eomgen.scene.values import Values


def check_mimics(joints: Mapping[str, Joint], refused: Iterable[str], report: Report) -> None:
    """Report joints that follow one that is not there, has not one coordinate, or follows them in its turn.

    Parameters
    ----------
    refused : iterable of str
        Joints whose declarations are broken: they exist, but nothing is known of them.
    """
    for joint in joints.values():
        key, path = key_of("joints", joint.name, "mimic"), [joint.name]
        leader = joint
        while leader.mimic is not None and leader.mimic.joint in joints and leader.mimic.joint not in path:
            leader = joints[leader.mimic.joint]
            path.append(leader.name)
        if leader.mimic is not None and leader.mimic.joint == joint.name == next(name for name in joints if name in path):
            circle = listed([*path, joint.name]) if len(path) > 1 else ""
            what = f"the joints follow one another in a circle: {circle}" if circle else f"the joint {joint.name} follows itself"
            report.add(f"{key}.joint", what, "one joint that leads")
        if joint.mimic is None or joint.mimic.joint in refused:
            continue
        if joint.mimic.joint not in joints:
            report.add(f"{key}.joint", f"there is no joint {shown(joint.mimic.joint)}", nearest(joint.mimic.joint, joints))
            continue
        first = joints[joint.mimic.joint]
        if SIZES[first.type] != (1, 1):
            count = SIZES[first.type][1] or "no"
            what = f"the {first.type} joint {first.name} cannot be followed: it has {count} coordinates, not one"
            report.add(f"{key}.joint", what, "a revolute, prismatic or helical joint")


def led_or_following(joints: Sequence[Joint], inertias: Mapping[str, Inertia], values: Values) -> set[str]:
    """Return the joints whose inertia is that of others too: those that follow, and those that a moving one follows.

    Joints that lead are reported where nothing that they move, by themselves or by others, has mass or inertia.
    """
    mimics = {joint.name: joint.mimic for joint in joints if joint.mimic is not None}
    light = _carrying_nothing(joints, inertias, values)
    groups: dict[str, list[str]] = {}
    for name, mimic in mimics.items():
        if values.value(mimic.multiplier) == 0.0:
            continue
        first = mimic.joint
        for _ in mimics:  # no way to the first is longer, circles are reported elsewhere
            first = mimics[first].joint if first in mimics else first
        groups.setdefault(first, [first]).append(name)
    for first, members in groups.items():
        if light.issuperset(members):
            what = f"the joint {first} cannot be moved by a force: neither it nor what follows it carries mass or inertia"
            hint = f"mass for a body that it moves, rotor_inertia, or a fixed joint (URDF: lock {first})"
            values.report.add(key_of("joints", first), f"{what}, so the inertia matrix would be singular", hint)
    return {*mimics, *(name for members in groups.values() for name in members)}


def _carrying_nothing(joints: Sequence[Joint], inertias: Mapping[str, Inertia], values: Values) -> set[str]:
    """Return the joints beyond which nothing has mass or inertia, their own rotors included."""
    heavy: set[str] = set()
    light: set[str] = set()
    for joint in reversed(joints):
        own = inertias.get(joint.child)
        rotors = any(values.value(formula) != 0.0 for formula in joint.each(joint.rotor_inertia))
        if joint.child in heavy or own is None or own.mass != 0.0 or own.about_center.any() or rotors:
            heavy.add(joint.parent)
        else:
            light.add(joint.name)
    return light
