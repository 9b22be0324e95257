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
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from eomgen.base.data import dataclass
from eomgen.base.messages import close_names, legal_name, listed, shown
from eomgen.formula.words import RESERVED
from eomgen.products.robots.scene_draft import Actuation
from eomgen.products.robots.urdf.reading import Robot
from eomgen.products.robots.visuals import NUMBER
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import Element

_REDUCTIONS = ("mechanicalReduction", "mechanical_reduction")
#: Elements for positions or the control software; efforts do not depend on them.
_WITHOUT_EFFECT = ("hardwareInterface", "offset", "motorTorqueConstant", "simulated_actuated_joint")

#: Rows of joints, columns of actuators, from the reductions of joints and of actuators.
_Matrix = Sequence[Sequence[float]]


def _simple(joint: Sequence[float], actuator: Sequence[float]) -> _Matrix:
    return ((joint[0] * actuator[0],),)


def _differential(joint: Sequence[float], actuator: Sequence[float]) -> _Matrix:
    return tuple((n * actuator[0], sign * n * actuator[1]) for n, sign in zip(joint, (1.0, -1.0), strict=True))


#: By the last part of a type's name: how many joints, which are as many as actuators, and the matrix.
TYPES: Mapping[str, tuple[int, Callable[[Sequence[float], Sequence[float]], _Matrix]]] = {
    "SimpleTransmission": (1, _simple),
    "DifferentialTransmission": (2, _differential),
}


@dataclass(frozen=True)
class UrdfTransmission:
    """A transmission of a known type; joints and actuators by name in the file, in the order of their roles. ``matrix``
    has a row for each joint and a column for each actuator: efforts of joints = matrix times efforts of actuators."""

    name: str
    line: int
    joints: tuple[str, ...]
    actuators: tuple[str, ...]
    matrix: _Matrix


@dataclass(frozen=True)
class Transmissions:
    """The transmissions of known types in a file, and the names of other transmissions by type."""

    known: tuple[UrdfTransmission, ...]
    unknown: Mapping[str, Sequence[str]]


def read_transmissions(root: Element, report: Report) -> Transmissions:
    """Return the transmissions of a file, also in ``<ros2_control>``; faults go to the report. Transmissions of unknown
    types are listed by type."""
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
    return Transmissions(tuple(known), unknown)


def _type_of(element: Element) -> str:
    """Return the type: an attribute, or the text of <type> or of ros2_control's <plugin>."""
    children = [child for tag in ("type", "plugin") for child in element.children_with_tag(tag)]
    return element.get("type") or next((child.text() for child in children), "")


def _read(element: Element, name: str, kind: str, report: Report) -> UrdfTransmission | None:
    """Return the transmission of an element with the matrix; None for a wrong number of joints or actuators, which is
    reported. ``kind`` is a key of ``TYPES``."""
    size, matrix = TYPES[kind]
    key = f"transmissions.{name}"
    sides = {}
    for tag in ("joint", "actuator"):
        parts = _by_role(tuple(element.children_with_tag(tag)), tag)
        if len(parts) != size or not all(child.get("name") for child in parts):
            count = f"{size} <{tag} name=...>{'s' if size > 1 else ''}"
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
    return UrdfTransmission(name, element.line, joints, actuators, matrix(joint, actuator))


def _by_role(elements: Sequence[Element], tag: str) -> list[Element]:
    """Return joints or actuators in the order of their roles, ``joint1`` before ``joint2``; else in the order of the
    file."""

    def role(element: Element) -> str:
        return element.get("role") or next((child.text() for child in element.children_with_tag("role")), "")

    roles = [role(element) for element in elements]
    known = [f"{tag}{k + 1}" for k in range(len(elements))]
    if sorted(roles) == known:
        return [elements[roles.index(wanted)] for wanted in known]
    return list(elements)


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


def actuation(
    robot: Robot, transmissions: Transmissions, held: Collection[str], followers: Collection[str]
) -> Actuation:
    """Return inputs and efforts of actuators: an effort input for each actuator of a transmission that moves a joint.

    The name of an input is the name of the actuator, made legal. The unit is N m if all joints turn; empty if a joint
    travels, because the format does not say whether the actuator turns or travels. Joints that are ``held``, follow
    others (``followers``) or have not one coordinate are listed in a note, missing joints in a warning.
    """
    by_written = {robot.original.get(name, name): name for name in robot.joints}
    shares: dict[str, dict[str, float]] = {}  # of actuators by name in the file, by joint
    idle: dict[str, None] = {}
    missing: dict[str, int] = {}
    for transmission in transmissions.known:
        for written, row in zip(transmission.joints, transmission.matrix, strict=True):
            if written not in by_written:
                missing.setdefault(written, transmission.line)
                continue
            joint = by_written[written]
            if joint in held or joint in followers or not robot.joints[joint].unit:
                idle[joint] = None
                continue
            for actuator, factor in zip(transmission.actuators, row, strict=True):
                share = shares.setdefault(actuator, {})
                share[joint] = share.get(joint, 0.0) + factor
    names: dict[str, str] = {}
    for actuator in shares:
        names[actuator] = legal_name(actuator, RESERVED | set(names.values()))
    inputs, sums = dict[str, Any](), dict[str, list[str]]()
    for actuator, share in shares.items():
        turning = all(robot.joints[joint].unit == "rad" for joint in share)
        driven = " and ".join(f"{joint} ({factor:.6g})" for joint, factor in share.items() if factor)
        inputs[names[actuator]] = {"description": f"effort of actuator {actuator} on {driven}"}
        inputs[names[actuator]] |= {"unit": "N m"} if turning else {}
        for joint, factor in share.items():
            if factor:
                sums.setdefault(joint, []).append(f"{factor!r} * {names[actuator]}")
    efforts = {joint: {"joint": joint, "effort": " + ".join(terms)} for joint, terms in sums.items()}
    notes = [f"inputs are efforts of actuators with transmissions: {listed(list(inputs))}"] if inputs else []
    if idle:
        note = "transmissions have no effect on joints that are held, follow others or have not one coordinate"
        notes.append(f"{note}: {listed(list(idle))} [W0198]")
    return Actuation(inputs, efforts, notes, _not_modelled(transmissions, missing, by_written))


def _not_modelled(
    transmissions: Transmissions, missing: Mapping[str, int], by_written: Collection[str]
) -> list[tuple[int, str]]:
    """Return line and text of warnings on transmissions of unknown types, and to joints that the file lacks.
    ``missing`` has the line by name of such a joint, ``by_written`` the names of all joints in the file."""
    warnings = [
        (1, f"not modelled: transmissions of the type {shown(kind)} ({len(names)}: {listed(names)}) [W0197]")
        for kind, names in transmissions.unknown.items()
    ]
    if missing:
        close = [name for written in missing for name in close_names(written, by_written, 1)]
        perhaps = f", perhaps {listed(dict.fromkeys(close))}" if close else ""
        names = f"({len(missing)}: {listed(list(missing))}){perhaps}"
        note = f"not modelled: transmissions to joints that are not there {names} [W0199]"
        warnings.append((next(iter(missing.values())), note))
    return warnings
