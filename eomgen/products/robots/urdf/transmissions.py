"""Actuation of a URDF: effort inputs, and transmissions, efforts of joints from efforts of actuators, tau = T tau_a
with a constant matrix T.

The types are ROS types, https://wiki.ros.org/urdf/XML/Transmission, with the maps that ``transmission_interface`` of
ros_control documents. Its FourBarLinkageTransmission and the HalfDifferentialTransmission of pal_transmissions are left
out: their maps of efforts and of velocities do not fit together, the power of joints differs from the actuators' power.

Reductions are read at their places in ros_control (``mechanicalReduction`` in the actuator or joint), ros2_control
(``mechanical_reduction``) and the first transmissions of the PR2 (``mechanicalReduction`` of the transmission).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from eomgen.base.data import dataclass
from eomgen.base.messages import close_names, legal_name, listed, shown
from eomgen.formula.words import RESERVED
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.products.robots.scene_draft import SceneDraft
from eomgen.products.robots.urdf.reading import Robot
from eomgen.products.robots.visuals import NUMBER
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import Element

_REDUCTIONS = ("mechanicalReduction", "mechanical_reduction")
#: Elements for positions or the control software; efforts do not depend on them.
_WITHOUT_EFFECT = ("hardwareInterface", "offset", "motorTorqueConstant", "simulated_actuated_joint")

#: Signs of the efforts of joints (rows) by efforts of actuators (columns), by the last part of a type's name.
TYPES: Mapping[str, Sequence[Sequence[float]]] = {
    "SimpleTransmission": ((1.0,),),
    "DifferentialTransmission": ((1.0, 1.0), (1.0, -1.0)),
}


@dataclass(frozen=True)
class UrdfTransmission:
    """A transmission of a known type; joints and actuators by name in the file, in the order of their roles. ``matrix``
    has a row for each joint and a column for each actuator: efforts of joints = matrix times efforts of actuators."""

    name: str
    line: int
    joints: tuple[str, ...]
    actuators: tuple[str, ...]
    matrix: Sequence[Sequence[float]]


def read_transmissions(root: Element, report: Report) -> tuple[list[UrdfTransmission], dict[str, list[str]]]:
    """Return the transmissions of a file, also in ``<ros2_control>``, and the names of others by their unknown types;
    faults go to the report."""
    elements = list(root.children_with_tag("transmission"))
    for control in root.children_with_tag("ros2_control"):
        elements += control.children_with_tag("transmission")
        control.read_whole()
    known, unknown = [], dict[str, list[str]]()
    for element in elements:
        kind = _type_of(element).rsplit("/", 1)[-1]
        name = element.get("name") or "transmission"
        if kind not in TYPES:
            unknown.setdefault(kind, []).append(name)
            element.read_whole()
        elif (transmission := _read(element, name, kind, report)) is not None:
            known.append(transmission)
    return known, unknown


def _type_of(element: Element) -> str:
    """Return the type: an attribute, or the text of <type> or of ros2_control's <plugin>."""
    children = [child for tag in ("type", "plugin") for child in element.children_with_tag(tag)]
    return element.get("type") or next((child.text() for child in children), "")


def _read(element: Element, name: str, kind: str, report: Report) -> UrdfTransmission | None:
    """Return the transmission of an element with the matrix; None for a wrong number of joints or actuators, which is
    reported. ``kind`` is a key of ``TYPES``."""
    signs = TYPES[kind]
    key = f"transmissions.{name}"
    sides = {}
    for tag in ("joint", "actuator"):
        parts = _by_role(tuple(element.children_with_tag(tag)), tag)
        if len(parts) != len(signs) or not all(child.get("name") for child in parts):
            count = f"{len(signs)} <{tag} name=...>{'s' if len(signs) > 1 else ''}"
            report.add_at(element.line, key, f"a {kind} has {count}, and there are {len(parts)} [E1719]", count)
            return None
        sides[tag] = parts
    common = _reduction(element, key, report)
    joint, actuator = ([_reduction(child, key, report) for child in sides[tag]] for tag in sides)
    actuator[0] *= common
    for tag in _WITHOUT_EFFECT:
        for parent in (element, *sides["joint"], *sides["actuator"]):
            for child in parent.children_with_tag(tag):
                child.read_whole()
    joints, actuators = (tuple(child.get("name") for child in sides[tag]) for tag in sides)
    matrix = (np.array(signs) * np.array(joint)[:, np.newaxis] * np.array(actuator)).tolist()
    return UrdfTransmission(name, element.line, joints, actuators, matrix)


def _by_role(elements: Sequence[Element], tag: str) -> list[Element]:
    """Return joints or actuators in the order of their roles, ``joint1`` before ``joint2``; else in the order of the
    file."""

    def role(element: Element) -> str:
        return element.get("role") or next((child.text() for child in element.children_with_tag("role")), "")

    roles = [role(element) for element in elements]
    known = [f"{tag}{k + 1}" for k in range(len(elements))]
    return [elements[roles.index(wanted)] for wanted in known] if sorted(roles) == known else list(elements)


def _reduction(element: Element, key: str, report: Report) -> float:
    """Return the mechanical reduction of an element, given as an attribute or as a child; 1 by default, or for a text
    that is not a number other than 0, which is reported under ``key``."""
    written = [(element.get(tag), element.line) for tag in _REDUCTIONS if element.has(tag)]
    written += [(child.text(), child.line) for tag in _REDUCTIONS for child in element.children_with_tag(tag)]
    if not written:
        return 1.0
    text, line = written[0]
    value = float(text) if NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value) or value == 0.0:
        fault = f"the mechanical reduction {shown(text)} is not a number other than 0 [E1720]"
        report.add_at(line, key, fault, "efforts of the joint over efforts of the actuator, e.g. 50")
        return 1.0
    return value


def convert_transmissions(
    scene: SceneDraft,
    robot: Robot,
    transmissions: Sequence[UrdfTransmission],
    unknown: Mapping[str, Sequence[str]],
    still: Collection[str],
) -> None:
    """Add an effort input for each actuator of a transmission that moves a joint, and the efforts of these joints.

    The name of an input is the name of the actuator, made legal. The unit is N m if all joints turn; empty if a joint
    travels, because the format does not say whether the actuator turns or travels. Joints that are held or follow
    others (``still``), or have not one coordinate, are listed in a note, missing joints and transmissions of unknown
    types, by type, in warnings.
    """
    shares = _shares(scene, robot, transmissions, still)
    sums = dict[str, list[str]]()
    for actuator, share in shares.items():
        driven = " and ".join(f"{joint} ({factor:.6g})" for joint, factor in share.items() if factor)
        entry = {"description": f"effort of actuator {actuator} on {driven}"}
        entry |= {"unit": "N m"} if all(robot.joints[joint].unit == "rad" for joint in share) else {}
        name = legal_name(actuator, RESERVED | scene.section("inputs").keys())
        scene.section("inputs")[name] = entry
        for joint, factor in share.items():
            if factor:
                sums.setdefault(joint, []).append(f"{factor!r} * {name}")
    for joint, terms in sums.items():
        scene.section("efforts")[joint] = {"joint": joint, "effort": " + ".join(terms)}
    if shares:
        scene.notes.append(f"inputs are efforts of actuators with transmissions: {listed(scene.data['inputs'])}")
    for kind, names in unknown.items():
        note = f"not modelled: transmissions of the type {shown(kind)} ({len(names)}: {listed(names)}) [W0197]"
        scene.leave_out(ElementPlace(scene.report.file, 1), note)
    if not transmissions and not unknown:
        scene.notes.append("the file has no <transmission>; actuated=True gives an input for each joint [W0176]")


def _shares(
    scene: SceneDraft, robot: Robot, transmissions: Sequence[UrdfTransmission], still: Collection[str]
) -> dict[str, dict[str, float]]:
    """Return the efforts of joints by unit efforts of actuators, by actuator in the file and by joint; note joints that
    are ``still`` or not there."""
    shares: dict[str, dict[str, float]] = {}  # of actuators by name in the file, by joint
    idle: dict[str, None] = {}
    missing: dict[str, int] = {}
    for transmission in transmissions:
        for written, row in zip(transmission.joints, transmission.matrix, strict=True):
            if written not in robot.joint_names:
                missing.setdefault(written, transmission.line)
                continue
            joint = robot.joint_names[written]
            if joint in still or not robot.joints[joint].unit:
                idle[joint] = None
                continue
            for actuator, factor in zip(transmission.actuators, row, strict=True):
                share = shares.setdefault(actuator, {})
                share[joint] = share.get(joint, 0.0) + factor
    if idle:
        note = "transmissions have no effect on joints that are held, follow others or have not one coordinate"
        scene.notes.append(f"{note}: {listed(list(idle))} [W0198]")
    if missing:
        close = [name for written in missing for name in close_names(written, robot.joint_names, 1)]
        perhaps = f", perhaps {listed(dict.fromkeys(close))}" if close else ""
        names = f"({len(missing)}: {listed(list(missing))}){perhaps}"
        note = f"not modelled: transmissions to joints that are not there {names} [W0199]"
        scene.leave_out(ElementPlace(scene.report.file, next(iter(missing.values()))), note)
    return shares
