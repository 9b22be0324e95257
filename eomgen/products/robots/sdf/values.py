"""Values of SDF elements, which are texts of children, and a record of all that is not read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import IntEnum
from functools import partial
from pathlib import Path

import numpy as np

from eomgen.base.messages import shown
from eomgen.products.robots.draft import WrittenPose
from eomgen.products.robots.leftovers import ElementPlace, Leftovers, read_table
from eomgen.products.robots.visuals import read_numbers, turn_of
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import Element
from eomgen.scene.rotations import roll_pitch_yaw, snapped_rotation

#: How each child and attribute of an element is taken.
STATUSES = read_table(Path(__file__).with_name("coverage.txt"))
_BOOLEANS = {"true": True, "1": True, "false": False, "0": False}
_INFINITE = {"inf": math.inf, "+inf": math.inf, "-inf": -math.inf}


class Minor(IntEnum):
    """Minor versions of SDF 1: the oldest and the newest that are read, and the first ones with axes in joints' frames,
    with gravity in the world, and with named frames."""

    FIRST = 4
    JOINT_AXES = 5
    WORLD_GRAVITY = 6
    FRAMES = 7
    NEWEST = 12


class SdfValues:
    """Reads values of elements of one file, and records the parts of these elements that are not read.

    A faulty value is reported, and a default or neutral value returned.

    Parameters
    ----------
    file : str
        The name for messages.
    report, leftovers : Report, Leftovers
        Take the faults, and the parts that are not read.
    minor : int
        Minor version of the file's format.
    """

    def __init__(self, file: str, report: Report, leftovers: Leftovers, minor: int = Minor.NEWEST) -> None:
        self.file, self.report, self.leftovers, self.minor = file, report, leftovers, minor

    def place(self, element: Element) -> ElementPlace:
        """Return the place of an element."""
        return ElementPlace(self.file, element.line)

    def keep(self, element: Element, key: str, owner: str) -> None:
        """Record the parts of an element that are not read; ``key`` is its row in the table, ``owner`` the name in
        notes."""
        self.leftovers.keep(element, key, self.file, owner)

    def refuse(self, element: Element, fault: str, hint: str) -> None:
        """Report a fault of an element."""
        self.report.add_place(self.file, element.line, "", fault, hint)

    def text(self, element: Element, tag: str, default: str = "") -> str:
        """Return the text of the first child with this tag; the default without the child."""
        child = element.first(tag)
        if child is None:
            return default
        text = child.text()
        self.keep(child, "value", element.get("name"))
        return text

    def flag(self, element: Element, tag: str, *, default: bool) -> bool:
        """Return the Boolean value of the first child with this tag; the default without the child, False for a faulty
        text."""
        child = element.first(tag)
        return default if child is None else self._boolean(child, tag, self.text(element, tag))

    def flag_of(self, element: Element, attribute: str) -> bool:
        """Return a Boolean attribute, False by default."""
        return element.has(attribute) and self._boolean(element, attribute, element.get(attribute))

    def _boolean(self, element: Element, name: str, text: str) -> bool:
        if text.lower() not in _BOOLEANS:
            self.refuse(element, f"{name}: true or false is needed here, not {shown(text)} [E1968]", "true or false")
        return _BOOLEANS.get(text.lower(), False)

    def number(self, element: Element, tag: str, default: float, *, infinite: bool = False) -> float:
        """Return the number of the first child with this tag; the default without the child or for a fault.
        ``infinite`` allows inf and -inf, which a size of 1e16 or more stands for, too."""
        child = element.first(tag)
        if child is None:
            return default
        text = self.text(element, tag)
        if infinite and text.lower() in _INFINITE:
            return _INFINITE[text.lower()]
        (value,) = self.numbers(child, tag, text, (default,))
        return math.copysign(math.inf, value) if infinite and abs(value) >= 1e16 else value

    def row(self, element: Element, tag: str, owner: str, defaults: Mapping[str, float]) -> list[float]:
        """Return the numbers of the grandchildren named in ``defaults`` within the child ``tag``, in this order, with
        their defaults; ``owner`` is the name under which other grandchildren are noted as not read."""
        child = element.first(tag)
        if child is None:
            return [*defaults.values()]
        numbers = [self.number(child, name, default) for name, default in defaults.items()]
        self.keep(child, tag, owner)
        return numbers

    def vector(self, element: Element, tag: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return the numbers of the first child with this tag, as many as the default has; the default without the
        child or for a fault."""
        child = element.first(tag)
        if child is None:
            return default
        text = child.text()
        if tag not in STATUSES:
            self.keep(child, "value", "")
        return self.numbers(child, tag, text, default)

    def numbers(self, element: Element, name: str, text: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return as many finite numbers as the default has."""
        hint = "blanks between the numbers" if "," in text else ""
        return read_numbers(name, text, default, partial(self.refuse, element), hint)

    def pose(self, element: Element, owner: str, *, framed: bool = True) -> WrittenPose:
        """Return the pose of an element, with the frame that it names; the neutral pose without one. Faults are
        reported. Angles are roll, pitch and yaw, rad, or degrees if the file says so; quaternions are also read.
        ``owner`` is the name for notes; a frame is reported unless ``framed``."""
        child = element.first("pose")
        if child is None:
            return WrittenPose(self.place(element))
        # the attribute ``frame`` of 1.5 and 1.6 became ``relative_to`` of 1.7, which is read from older files, too
        naming, frame = "relative_to", child.get("relative_to")
        if self.minor < Minor.FRAMES and child.get("frame"):
            naming, frame = "frame", child.get("frame")
        if frame and not framed:
            fault = f"pose: the pose of <{element.tag}> has no {naming} [E1725]"
            self.refuse(child, fault, "the pose in the link's frame")
        kind = child.get("rotation_format", "euler_rpy")
        degrees = self.flag_of(child, "degrees")
        if kind not in ("euler_rpy", "quat_xyzw"):
            self.refuse(child, f"rotation_format: {shown(kind)} is not known [E1726]", "euler_rpy or quat_xyzw")
        text = child.text()
        self.keep(child, "pose", owner)
        size = 7 if kind == "quat_xyzw" else 6
        neutral = (0.0,) * 6 + (1.0,) * (size == 7)
        values = self.numbers(child, "pose", text, neutral) if text else neutral
        if size == 7:
            turned = turn_of("pose", values[3:], partial(self.refuse, child))
        else:
            angles = [math.radians(value) if degrees else value for value in values[3:]]
            self.leftovers.keep_angles(owner, angles)
            turned = roll_pitch_yaw(*angles)
        orientation = np.eye(3) if turned is None else snapped_rotation(turned)
        return WrittenPose(self.place(child), orientation, np.array(values[:3]), frame)
