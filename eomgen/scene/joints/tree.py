"""The joint tree: one joint per body, rooted at the base, ordered with parents first; leaders of mimic joints;
displacement of a child body by its joint."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import key_of, listed, nearest, shown
from eomgen.lie.numeric import rotation_matrix, skew
from eomgen.scene.joint_types import GROUPS, JOINTS, Connection, ElementaryMotion
from eomgen.scene.joints.model import Joint
from eomgen.scene.rotations import about_axis
from eomgen.system.description import BASE, WORLD

if TYPE_CHECKING:
    from eomgen.scene.reading.report import Report

Vector = Sequence[float] | Array


def joint_displacement(
    kind: Connection, axis: Vector, second_axis: Vector, q: Vector, pitch: float = 0.0
) -> tuple[Array, Array, Array]:
    """Return the pose of a joint's child at coordinates q, relative to neutral coordinates, and the motion subspace of
    the joint.

    Parameters
    ----------
    axis, second_axis : (3,) in the child's frame
    q : (nq,) coordinates; orientations as quaternions (w, x, y, z)
    pitch : of screws, m/rad

    Returns
    -------
    rotation : (3, 3) child axes to the axes at neutral q
    shift : (3,) of the child's origin, in the axes at neutral q
    subspace : (6, nv) motion subspace in the child's frame, angular part first
    """
    directions = np.array([axis, second_axis, np.cross(axis, second_axis)])
    rotation, shift, subspace = np.eye(3), np.zeros(3), np.zeros((6, kind.v_size))
    for motion in kind.chain:
        turn, travel, columns = _displacement(motion, directions[list(motion.axes)], q, pitch)
        subspace = twist_transform(turn, travel) @ subspace
        subspace[:, motion.components] = columns
        rotation, shift = rotation @ turn, shift + rotation @ travel
    return rotation, shift, subspace


def motion_subspace(kind: Connection, axis: Vector, second_axis: Vector, pitch: float = 0.0) -> Array:
    """Return the motion subspace (6, nv) of a joint at neutral coordinates; arguments as of ``joint_displacement``."""
    neutral = np.zeros(kind.q_size)
    if kind.group in GROUPS.values():
        neutral[0] = 1.0
    return joint_displacement(kind, axis, second_axis, neutral, pitch)[2]


def _displacement(motion: ElementaryMotion, axes: Array, q: Vector, pitch: float) -> tuple[Array, Array, Array]:
    """Return rotation (3, 3), shift (3,) and motion subspace (6, n) of an elementary motion at the coordinates q of the
    joint; ``axes`` (n, 3) are the motion's directions, ``pitch`` is in m/rad."""
    none = np.zeros(3)
    match motion.kind:
        case "ball":
            return rotation_matrix(np.asarray(q[:4])), none, np.eye(6)[:, :3]
        case "free":
            return rotation_matrix(np.asarray(q[:4])), np.asarray(q[4:7]), np.eye(6)
    x = np.array([q[k] for k in motion.components])
    if motion.kind == "travel":
        return np.eye(3), x @ axes, np.hstack([np.zeros_like(axes), axes]).T
    along = pitch * axes[0] if motion.kind == "screw" else none
    return about_axis(axes[0], x[0]), x[0] * along, np.concatenate([axes[0], along])[:, np.newaxis]


def twist_transform(rotation: Array, position: Array) -> Array:
    """Return the (6, 6) map from a body's twist to the twist of a frame placed on the body at the pose ``rotation``
    (frame axes to body axes) and ``position``, each twist in the axes of the respective frame, angular part first."""
    R = rotation.T
    return np.block([[R, np.zeros((3, 3))], [-R @ skew(position), R]])


class JointEdge(NamedTuple):
    """A joint in the view of the tree: names of joint, parent and child."""

    name: str
    parent: str
    child: str


def order_joints(
    links: Sequence[JointEdge], bodies: Mapping[str, str], refused: Collection[str], complete: bool, report: Report
) -> list[JointEdge]:
    """Return the joints that the base carries with parents before children, in the user's order otherwise; report
    faults of the tree.

    Parameters
    ----------
    links : in the user's order
    bodies : the section in which each body is declared, by name
    refused : bodies with invalid entries: these bodies exist, but the data are unknown
    complete : whether every joint and body could be read; if not, missing joints are not reported
    """
    known = dict.fromkeys([*bodies, *refused])
    carrier: dict[str, JointEdge] = {}
    for link in links:
        key = key_of("joints", link.name)
        if link.parent != BASE and link.parent not in known:
            hint = BASE if link.parent == WORLD else nearest(link.parent, [BASE, *known])
            report.add(f"{key}.parent", f"there is no body {shown(link.parent)} [E1587]", hint)
        if link.child == BASE:
            hint = "the base as parent, or a free joint for a floating body"
            report.add(f"{key}.child", "the base cannot be a child: it carries the tree [E1670]", hint)
        elif link.child not in known:
            report.add(f"{key}.child", f"there is no body {shown(link.child)} [E1587]", nearest(link.child, known))
        elif link.child in carrier:
            fault = f"the body {link.child} is already carried by the joint {carrier[link.child].name} [E1671]"
            report.add(f"{key}.child", fault, "one joint for each body, and [constraints] for loop closures")
        elif link.parent == link.child:
            report.add(f"{key}.parent", f"the joint connects the body {link.child} to itself [E1672]", "another parent")
        carrier.setdefault(link.child, link)
    order = _parents_first(links, carrier, known)
    if complete:
        _report_lost(order, carrier, bodies, report)
    return order


def _parents_first(
    links: Sequence[JointEdge], carrier: Mapping[str, JointEdge], known: Collection[str]
) -> list[JointEdge]:
    """Return the joints that the base carries, directly or not, each after the joint of the parent, otherwise in the
    order of ``links``. ``carrier`` is the first joint of each child, ``known`` the names of bodies."""
    children: dict[str, list[int]] = {}
    for number, link in enumerate(links):
        if carrier.get(link.child) is link and link.child in known and link.child not in (BASE, link.parent):
            children.setdefault(link.parent, []).append(number)
    ready = list(children.get(BASE, []))
    heapq.heapify(ready)
    order: list[JointEdge] = []
    while ready:
        link = links[heapq.heappop(ready)]
        order.append(link)
        for number in children.get(link.child, []):
            heapq.heappush(ready, number)
    return order


def _report_lost(
    order: Sequence[JointEdge], carrier: Mapping[str, JointEdge], bodies: Mapping[str, str], report: Report
) -> None:
    """Report joints in a circle, and bodies without a joint together with the bodies that hang from them, unless as
    many joints have an unknown child, which is reported. ``order`` has the joints of the tree, ``carrier`` the first
    joint of each child, ``bodies`` the section of each body."""
    reached = {link.child for link in order}
    end_of: dict[str, str] = {}
    hanging: dict[str, list[str]] = {}
    for body in bodies:
        path: dict[str, None] = {}
        while body in carrier and body not in end_of and body not in path and body not in reached:
            path[body] = None
            body = carrier[body].parent  # noqa: PLW2901 - follows the joints towards the base
        if body in path:
            cycle = list(path)[list(path).index(body) :][::-1]
            if len(cycle) > 1:
                fault = f"the joints carry the bodies {listed(cycle)} in a circle [E1673]"
                report.add(key_of("joints", carrier[body].name), fault, f"{BASE} as the parent of one of them")
        end = end_of.get(body, body)
        end_of.update(dict.fromkeys([*path, body], end))
        if end not in carrier and path:
            hanging.setdefault(end, []).extend(path)
    lost = {body for body in bodies if body not in carrier}
    if len(lost) <= len(carrier.keys() - bodies.keys() - {BASE}):  # joints whose misspelt child is reported
        return
    for body, section in bodies.items():
        if body in lost:
            others = hanging.get(body, [])
            rest = f", nor the bodies that hang from it: {listed(others)}" if others else ""
            fault = f"no joint carries the body {body}{rest} [E1674]"
            report.add(key_of(section, body), fault, f'a joint with child = "{body}"')


def check_mimics(joints: Mapping[str, Joint], refused: Iterable[str], report: Report) -> None:
    """Report mimic joints whose leader does not exist or does not have exactly one coordinate, and mimic joints that
    follow one another in a circle. ``refused`` are joints with invalid entries: these exist, but the data are
    unknown."""
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
            fault = f"the joint {joint.name} follows itself [E1676]"
            if circle:
                fault = f"the joints follow one another in a circle: {circle} [E1675]"
            report.add(f"{key}.joint", fault, "one joint that leads")
        if joint.mimic is None or joint.mimic.joint in refused:
            continue
        if joint.mimic.joint not in joints:
            fault = f"there is no joint {shown(joint.mimic.joint)} [E1433]"
            report.add(f"{key}.joint", fault, nearest(joint.mimic.joint, joints))
            continue
        first = joints[joint.mimic.joint]
        if first.kind.v_size != 1:
            count = first.kind.v_size or "no"
            fault = f"the {first.type} joint {first.name} has {count} coordinates, and leaders have one [E1677]"
            *most, last = (name for name, row in JOINTS.items() if row.v_size == 1)
            report.add(f"{key}.joint", fault, f"a {', '.join(most)} or {last} joint")
