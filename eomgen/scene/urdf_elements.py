"""The elements of a URDF that eomgen takes, links and joints, and a list of those it leaves out.

The format is that of the Unified Robot Description Format, http://wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field

import numpy as np

from eomgen.scene.inertia import NOTHING, Inertia, tensor
from eomgen.scene.names import NAME_LENGTH, is_legal, nearest, shown
from eomgen.scene.report import Report
from eomgen.scene.rotation import SNAP, Array, roll_pitch_yaw, snapped_rotation
from eomgen.scene.xml_reader import Element

JOINT_TYPES = {
    "revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed", "floating": "free",
    "planar": "planar",
}  # fmt: skip
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_SILENT = {"visual", "collision", "material"}  # geometry has no part in the equations of motion
_KNOWN = {
    "robot": {"link", "joint"},
    "link": {"inertial"},
    "joint": {"origin", "parent", "child", "axis", "dynamics", "mimic", "limit"},
}


@dataclass(frozen=True)
class Link:
    """A link: its mass properties in its own frame."""

    name: str
    line: int
    inertia: Inertia


@dataclass(frozen=True)
class Mimic:
    """What a joint follows, by the name in the file: q = multiplier q_leader + offset."""

    joint: str
    multiplier: float
    offset: float
    line: int


@dataclass(frozen=True)
class Limit:
    """Range of a joint's coordinate, and its largest effort; zeros where nothing is said, as the format has it."""

    lower: float
    upper: float
    effort: float


@dataclass(frozen=True)
class Joint:
    """A joint: its type in eomgen's words, empty where there is none; placement of the child's frame in the parent's."""

    name: str
    line: int
    type: str
    parent: str
    child: str
    orientation: Array
    position: Array
    axis: tuple[float, ...]
    damping: float
    written_type: str
    mimic: Mimic | None = None
    limit: Limit | None = None
    friction: float = 0.0


#: How near to a right angle an angle has to be for its few digits to be worth a note, in rad.
NEARLY = 1e-3


@dataclass
class Robot:
    """What a URDF holds, with legal and unique names; ``original`` maps them back to those in the file.

    ``snapped`` are joints whose placement became exact; ``nearly_right`` are those with an angle near a right one that did not,
    with that angle.
    """

    name: str
    links: dict[str, Link] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)
    original: dict[str, str] = field(default_factory=dict)
    snapped: list[str] = field(default_factory=list)
    nearly_right: dict[str, str] = field(default_factory=dict)
    left_out: dict[str, list[str]] = field(default_factory=dict)


def read_robot(root: Element, report: Report) -> Robot:
    """Return what a URDF holds; what is wrong goes to the report."""
    if root.tag != "robot":
        report.add_at(root.line, "", f"the outermost element is {shown(root.tag)}, not 'robot'", "a URDF file")
        report.raise_problems()
    if any(element.tag.startswith("xacro:") for element in _all(root)):
        report.add_at(root.line, "", "the file holds xacro macros", "xacro first, to make a URDF of it")
        report.raise_problems()
    return _Reader(report).robot(root)


def _all(root: Element) -> Iterator[Element]:
    waiting = [root]
    while waiting:
        element = waiting.pop()
        yield element
        waiting += element.children


class _Reader:
    def __init__(self, report: Report) -> None:
        self.report = report
        self.out = Robot("")
        self.link_names: dict[str, str] = {}
        self.joint_names: dict[str, str] = {}
        self.used: dict[str, set[str]] = {"link": set(), "joint": set()}

    def robot(self, root: Element) -> Robot:
        self.out.name = _legal(root.attributes.get("name", "") or "robot", ())
        self.leave_out("robot", root, "")
        for element in root.named("link"):
            if name := self.name(element, "link", self.link_names):
                self.out.links[name] = self.link(name, element)
        for element in root.named("joint"):
            if name := self.name(element, "joint", self.joint_names):
                self.out.joints[name] = self.joint(name, element)
        return self.out

    def name(self, element: Element, kind: str, taken: dict[str, str]) -> str:
        """Return the legal name of a link or joint; empty where it cannot be taken."""
        written = element.attributes.get("name", "")
        if not written:
            self.report.add_at(element.line, "", f"the {kind} has no name", f'<{kind} name="...">')
        elif written in taken:
            self.report.add_at(element.line, "", f"the {kind} {shown(written)} is there twice", "another name")
        else:
            taken[written] = _legal(written, self.used[kind])
            self.used[kind].add(taken[written])
            if taken[written] != written:
                self.out.original[taken[written]] = written
            return taken[written]
        return ""

    def leave_out(self, kind: str, element: Element, name: str) -> None:
        """Note the children that are not modelled."""
        for child in element.children:
            if child.tag not in _KNOWN[kind] | _SILENT:
                self.out.left_out.setdefault(child.tag, []).append(name or child.attributes.get("name", ""))

    def numbers(self, element: Element | None, attribute: str, key: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return as many finite numbers as the default has."""
        if element is None or attribute not in element.attributes:
            return default
        written = element.attributes[attribute]
        words = written.split()
        if len(words) != len(default) or not all(_NUMBER.fullmatch(word) for word in words):
            count = f"{len(default)} numbers are" if len(default) > 1 else "a number is"
            self.report.add_at(element.line, key, f"{attribute}: {count} needed here, not {shown(written)}", "")
            return default
        values = tuple(float(word) for word in words)
        if not all(math.isfinite(value) for value in values):
            self.report.add_at(element.line, key, f"{attribute}: {shown(written)} is too large", "")
            return default
        return values

    def placement(self, element: Element, key: str) -> tuple[Array, Array, bool, str]:
        """Return orientation, position, whether right angles were snapped, and an angle that is nearly right but not exact."""
        origin = element.first("origin")
        roll, pitch, yaw = self.numbers(origin, "rpy", key, (0.0, 0.0, 0.0))
        exact = roll_pitch_yaw(roll, pitch, yaw)
        orientation = snapped_rotation(exact)
        position = np.array(self.numbers(origin, "xyz", key, (0.0, 0.0, 0.0)))
        nearly = next((angle for angle in (roll, pitch, yaw) if SNAP < _off_right(angle) <= NEARLY), None)
        made_exact = bool(np.any((orientation != exact) & np.isin(orientation, (-1.0, 0.0, 1.0))))
        return orientation, position, made_exact, "" if nearly is None else f"{nearly:.9g}"

    def link(self, name: str, element: Element) -> Link:
        key = f"links.{name}"
        self.leave_out("link", element, name)
        inertial = element.first("inertial")
        if inertial is None:
            return Link(name, element.line, NOTHING)
        for tag in ("mass", "inertia"):
            if inertial.first(tag) is None:
                self.report.add_at(inertial.line, key, f"<inertial> has no <{tag}>", f"<{tag} .../> or no <inertial>")
        (mass,) = self.numbers(inertial.first("mass"), "value", key, (0.0,))
        entries = [
            self.numbers(inertial.first("inertia"), f"i{entry}", key, (0.0,))[0] for entry in ("xx", "yy", "zz", "xy", "xz", "yz")
        ]
        orientation, center, _, _ = self.placement(inertial, key)
        return Link(name, element.line, Inertia(mass, np.zeros(3), tensor(entries)).moved(orientation, center))

    def joint(self, name: str, element: Element) -> Joint:
        key = f"joints.{name}"
        self.leave_out("joint", element, name)
        written = element.attributes.get("type", "")
        if written not in JOINT_TYPES:
            self.report.add_at(element.line, key, f"the joint type {shown(written)} is not known", nearest(written, JOINT_TYPES))
        orientation, position, was_snapped, nearly = self.placement(element, key)
        if nearly:
            self.out.nearly_right[name] = nearly
        elif was_snapped:
            self.out.snapped.append(name)
        dynamics = element.first("dynamics")
        (damping,) = self.numbers(dynamics, "damping", key, (0.0,))
        (friction,) = self.numbers(dynamics, "friction", key, (0.0,))
        return Joint(
            name=name,
            line=element.line,
            type=JOINT_TYPES.get(written, ""),
            parent=self.end(element, "parent", key),
            child=self.end(element, "child", key),
            orientation=orientation,
            position=position,
            axis=self.numbers(element.first("axis"), "xyz", key, (1.0, 0.0, 0.0)),
            damping=damping,
            written_type=written,
            mimic=self.mimic(element, key),
            limit=self.limit(element, key),
            friction=friction,
        )

    def mimic(self, element: Element, key: str) -> Mimic | None:
        found = element.first("mimic")
        if found is None:
            return None
        (multiplier,) = self.numbers(found, "multiplier", key, (1.0,))
        (offset,) = self.numbers(found, "offset", key, (0.0,))
        return Mimic(found.attributes.get("joint", ""), multiplier, offset, found.line)

    def limit(self, element: Element, key: str) -> Limit | None:
        found = element.first("limit")
        if found is None:
            return None
        lower, upper, effort = (self.numbers(found, name, key, (0.0,))[0] for name in ("lower", "upper", "effort"))
        return Limit(lower, upper, effort)

    def end(self, element: Element, tag: str, key: str) -> str:
        """Return the name of a joint's parent or child link; empty where there is none."""
        end = element.first(tag)
        written = end.attributes.get("link", "") if end else ""
        if not written:
            self.report.add_at(element.line, key, f"the joint has no <{tag} link=...>", "")
        elif written not in self.link_names:
            self.report.add_at(
                end.line if end else element.line, key, f"there is no link {shown(written)}", nearest(written, self.link_names)
            )
        return self.link_names.get(written, "")


def _off_right(angle: float) -> float:
    """Return how far an angle is from the nearest right or straight one; 0 for those nearest to zero, which round nothing."""
    quarters = round(angle / (0.5 * math.pi))
    return abs(angle - quarters * 0.5 * math.pi) if quarters else 0.0


def _legal(name: str, taken: Collection[str]) -> str:
    """Return a legal name close to ``name`` that is not taken."""
    legal = re.sub(r"[^A-Za-z0-9_]", "_", name)[: NAME_LENGTH - 4]
    legal = name if is_legal(name) else legal if is_legal(legal) else f"_{legal}"
    result, number = legal, 2
    while result in taken:
        result, number = f"{legal[: NAME_LENGTH - 5]}_{number}", number + 1
    return result
