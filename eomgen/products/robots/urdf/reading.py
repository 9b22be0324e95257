"""Supported elements of a URDF, links and joints, and a list of all unread ones.

The format is the Unified Robot Description Format, http://wiki.ros.org/urdf/XML, versions 1.0 to 1.2. Every element
records its requested parts, and the rest is reported.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field, replace
from eomgen.base.messages import is_legal, legal_name, nearest, shown
from eomgen.products.robots.draft import Axis, DraftJoint, DraftLink, DraftLoop, DraftMimic, Visual, WrittenPose
from eomgen.products.robots.leftovers import ElementPlace, Leftovers, read_table
from eomgen.products.robots.visuals import LEFT_OUT, Numbers, Row, color_of, read_numbers, solid_of, turn_of, visuals_of
from eomgen.scene.inertia import NOTHING, Inertia, tensor
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import Element
from eomgen.scene.rotations import frame_about, roll_pitch_yaw, snapped_rotation, unit_axis

#: Types of joints by name in the format.
_HOLDING = {name: name for name in ("revolute", "prismatic", "fixed", "planar")} | {"continuous": "revolute"}
JOINT_TYPES = {**_HOLDING, "floating": "free"}
#: Types of constraints by the types of loop joints.
LOOP_TYPES = {"spherical": "spherical", "ball": "spherical", **_HOLDING}
#: The same by the types of constraints.
_CONSTRAINT_TYPES = {**LOOP_TYPES, "universal": "universal"}
#: Drake's own joints, and their types; a universal joint turns about x, then y.
_OF_DRAKE = "drake:joint"
_SCREWS = ("screw",)
_TYPES_OF_DRAKE = {"ball": "spherical", "universal": "universal", "planar": "planar", "screw": "helical"}
#: Status by child or attribute, of each element.
STATUSES = read_table(Path(__file__).with_name("coverage.txt"))
_VERSION = re.compile(r"([0-9]{1,9})(?:\.([0-9]{1,9}))?")
#: The newest minor version of URDF 1 that is read.
NEWEST = 2
#: Numbers of the format that are left out with their limits; acceleration, deceleration and jerk are of version 1.2.
_OTHER_LIMITS = ("velocity", "acceleration", "deceleration", "jerk")
#: Elements to be seen and touched, which have no part in the equations of motion.
_GEOMETRY = ("visual", "collision", "material")
#: Elements whose unread parts are kept with their own names, or not at all.
_WITH_OWNERS = ("link", "joint", _OF_DRAKE, "loop_joint", "constraint", *_GEOMETRY)


@dataclass
class Robot:
    """Elements of a URDF, with legal and unique names.

    Attributes
    ----------
    minor : minor version of the format, which is 1.minor
    link_names, joint_names, loop_names : legal names by the names of the file
    several_turns : links and joints whose rpy has an angle of more than a turn
    links : by the keys of ``link_key``
    left_out : properties that no joint of a type has in a scene, with the names of joints
    leftovers : parts that are not read
    notes : on the file
    undrawn : as of a draft
    """

    name: str
    minor: int = 0
    links: dict[str, DraftLink] = field(default_factory=dict)
    joints: dict[str, DraftJoint] = field(default_factory=dict)
    loops: dict[str, DraftLoop] = field(default_factory=dict)
    link_names: dict[str, str] = field(default_factory=dict)
    joint_names: dict[str, str] = field(default_factory=dict)
    loop_names: dict[str, str] = field(default_factory=dict)
    several_turns: list[str] = field(default_factory=list)
    left_out: dict[str, list[str]] = field(default_factory=dict)
    leftovers: Leftovers = field(default_factory=lambda: Leftovers(STATUSES))
    notes: list[str] = field(default_factory=list)
    undrawn: dict[tuple[str, str], list[str]] = field(default_factory=dict)


def read_robot(root: Element, report: Report) -> Robot:
    """Return the robot of a URDF; faults go to the report.

    Children of the root that a further reader has requested before count as read.
    """
    if root.tag != "robot":
        report.add_at(root.line, "", f"the outermost element is {shown(root.tag)}, not 'robot' [E1697]", "a URDF file")
        report.raise_problems()
    if any(element.tag.startswith("xacro:") for element in root.everything()):
        report.add_at(root.line, "", "the file holds xacro macros [E1698]", "xacro first, to make a URDF of it")
        report.raise_problems()
    return _UrdfReader(report).robot(root)


class _UrdfReader:
    def __init__(self, report: Report) -> None:
        self.report = report
        self.out = Robot("")
        self.link_names = self.out.link_names
        self.materials: dict[str, Element] = {}
        self.kept: set[str] = set()
        self.used: dict[str, set[str]] = {kind: set() for kind in ("link", "joint", "loop_joint", "constraint")}

    def robot(self, root: Element) -> Robot:
        """Read all links, joints, loops and constraints of a robot, and return the robot; faults are reported."""
        self.out.name = legal_name(root.get("name") or "robot", ())
        self.out.minor = self.version(root)
        self.materials = {item.get("name"): item for item in root.children_with_tag("material")}
        links, joints, loops = (tuple(root.children_with_tag(tag)) for tag in ("link", "joint", "loop_joint"))
        joints += tuple(root.children_with_tag(_OF_DRAKE))
        constraints = tuple(root.children_with_tag("constraint"))
        self.kept = {name for element in (*joints, *loops, *constraints) if is_legal(name := element.get("name"))}
        self.kept |= {name for element in links if is_legal(name := element.get("name"))}
        self.tell_left_over(root, "")
        for name, element in self.named_elements(links, "link", self.link_names):
            link = self.link(name, element)
            self.out.links[link_key(name)] = replace(link, visuals=self.visuals(name, element))
        self.add_world(joints)
        for name, element in self.named_elements(joints, "joint", self.out.joint_names):
            self.out.joints[name] = self.joint(name, element)
        self.used["loop_joint"] |= self.used["joint"]
        for name, element in self.named_elements(loops, "loop_joint", self.out.loop_names):
            self.out.loops[name] = self.loop(name, element)
        self.used["constraint"] |= self.used["loop_joint"]
        for name, element in self.named_elements(constraints, "constraint", self.out.loop_names):
            self.out.loops[name] = self.loop(name, element)
        return self.out

    def named_elements(
        self, elements: Iterable[Element], kind: str, taken: dict[str, str]
    ) -> Iterator[tuple[str, Element]]:
        """Yield the legal name and the element of each link, joint or loop that has a valid name. ``kind`` is the tag,
        ``taken`` maps names of the file to legal ones and grows. After the caller has read an element, unread parts are
        recorded."""
        for element in elements:
            if name := self.name(element, kind, taken):
                yield name, element
                self.tell_left_over(element, name)

    def add_world(self, joints: Iterable[Element]) -> None:
        """Add the link ``world`` if a joint names it and the file has none."""
        ends = [end for element in joints for tag in ("parent", "child") for end in element.children_with_tag(tag)]
        lines = [end.line for end in ends if end.get("link") == "world"]
        if lines and "world" not in self.link_names:
            self.link_names["world"] = "world"
            self.out.links[link_key("world")] = self.bare_link("world", lines[0])
            self.out.notes.append("joints name the link world, which the file lacks: it is a link without mass [W0271]")

    def version(self, root: Element) -> int:
        """Return k of version 1.k; 0 for a file that gives no version. Other texts and other major versions are
        reported."""
        written = root.get("version", "1.0")
        version = _VERSION.fullmatch(written)
        if version is None:
            fault = f"version: {shown(written)} is not a version of URDF [E1699]"
            self.report.add_at(root.line, "", fault, 'version="1.0"')
        elif int(version[1]) != 1:
            hint = f"a file of version 1.0 to 1.{NEWEST}"
            self.report.add_at(root.line, "", f"version {shown(written)} of URDF is not known [E1700]", hint)
        return int(version[2] or 0) if version else 0

    def name(self, element: Element, kind: str, taken: dict[str, str]) -> str:
        """Return a legal and unique name for an element, added to ``taken`` by the name in the file; empty for an
        element without a name or with one that is there twice, which is reported. ``kind`` is the tag."""
        written = element.get("name")
        if not written:
            self.report.add_at(element.line, "", f"the {kind} has no name [E1701]", f'<{kind} name="...">')
        elif written in taken:
            self.report.add_at(element.line, "", f"the {kind} {shown(written)} is there twice [E1702]", "another name")
        else:
            taken[written] = legal_name(written, self.used[kind], self.kept)
            self.used[kind].add(taken[written])
            return taken[written]
        return ""

    def tell_left_over(self, element: Element, owner: str) -> None:
        """Record the unread parts of an element and of read children. ``owner`` is the name in notes. An attribute
        ``unit`` is reported: the format has SI units."""
        for attribute in element.unread_attributes:
            if attribute in ("unit", "units"):
                fault = f"<{element.tag}> has the attribute {attribute}, and URDF has SI units and radians only [E1703]"
                self.report.add_at(element.line, "", fault, f"the value in SI units, without {attribute}")
                element.get(attribute)
        self.out.leftovers.keep(element, element.tag, self.report.file, owner)
        for child in element.read_children:
            if element.tag == "transmission" or child.tag not in _WITH_OWNERS:
                self.tell_left_over(child, owner or child.get("name"))

    def numbers(self, element: Element | None, attribute: str, default: Row, key: str = "") -> Row:
        """Return the numbers of an attribute, as many as the default has; the default without the element or attribute,
        or for a fault, which is reported under ``key``."""
        if element is None or not element.has(attribute):
            return default
        written = element.get(attribute)
        hint = "numbers alone: the units of URDF are SI units" if re.search(r"\d\s*[A-Za-z]", written) else ""
        if "," in written:
            hint = f"blanks between the numbers: {shown(' '.join(written.replace(',', ' ').split()))[1:-1]}"
        return read_numbers(attribute, written, default, partial(self.report.add_at, element.line, key), hint)

    def placement(self, element: Element, key: str, name: str) -> tuple[Array, Array, Sequence[float]]:
        """Return orientation (3, 3), position (3,), m, and roll, pitch and yaw of an element's origin. ``key`` is the
        entry for messages; ``name`` is added to the names with more than a turn if an angle is larger."""
        exact, position, angles = self.origin(element.first("origin"), key)
        if max(map(abs, angles)) > 2.0 * math.pi:
            self.out.several_turns.append(name)
        return snapped_rotation(exact), position, angles

    def origin(self, origin: Element | None, key: str) -> tuple[Array, Array, Sequence[float]]:
        """Return orientation (3, 3), position (3,), m, and roll, pitch and yaw, rad, of an element ``<origin>``;
        neutral without one. The orientation is by ``quat_xyzw`` if given."""
        angles = self.numbers(origin, "rpy", (0.0, 0.0, 0.0), key)
        quaternion = self.quaternion(origin, key)
        position = np.array(self.numbers(origin, "xyz", (0.0, 0.0, 0.0), key))
        return roll_pitch_yaw(*angles) if quaternion is None else quaternion, position, angles

    def quaternion(self, origin: Element | None, key: str) -> Array | None:
        """Return the rotation matrix (3, 3) of an origin's ``quat_xyzw``; None without one, or for a length other than
        1, which is reported. An origin that has ``rpy``, too, is reported."""
        if origin is None or not origin.has("quat_xyzw"):
            return None
        if origin.has("rpy"):
            fault = "the origin has rpy and quat_xyzw, and only one of them can say how it is turned [E1707]"
            self.report.add_at(origin.line, key, fault, "one of them")
        values = self.numbers(origin, "quat_xyzw", (0.0, 0.0, 0.0, 1.0), key)
        return turn_of("quat_xyzw", values, partial(self.report.add_at, origin.line, key))

    def bare_link(self, name: str, line: int, inertia: Inertia = NOTHING) -> DraftLink:
        location = ElementPlace(self.report.file, line)
        return DraftLink(name, location, inertia, WrittenPose(location))

    def link(self, name: str, element: Element) -> DraftLink:
        key = f"links.{name}"
        inertial = element.first("inertial")
        if inertial is None:
            return self.bare_link(name, element.line)
        (mass,) = self.required_numbers(inertial, "mass", ("value",), key)
        if mass < 0.0:
            fault = f"the mass {mass:.6g} is negative [E1709]"
            self.report.add_at(inertial.line, key, fault, "a positive number of kg")
        entries = self.required_numbers(inertial, "inertia", ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), key)
        orientation, center, _ = self.placement(inertial, key, name)
        inertia = Inertia(mass, np.zeros(3), tensor(entries)).transform(orientation, center)
        return self.bare_link(name, element.line, inertia)

    def required_numbers(self, inertial: Element, tag: str, attributes: Sequence[str], key: str) -> list[float]:
        """Return the numbers of the attributes of the child ``tag`` of ``<inertial>``; zeros for missing ones, which
        are reported."""
        element = inertial.first(tag)
        if element is None:
            fault = f"<inertial> has no <{tag}> [E1710]"
            self.report.add_at(inertial.line, key, fault, f"<{tag} .../> or no <inertial>")
            return [0.0] * len(attributes)
        for missing in [attribute for attribute in attributes if not element.has(attribute)]:
            self.report.add_at(element.line, key, f"<{tag}> has no {missing} [E1711]", f'<{tag} {missing}="...">')
        return [self.numbers(element, attribute, (0.0,), key)[0] for attribute in attributes]

    def joint(self, name: str, element: Element) -> DraftJoint:
        """Return the joint of an element, with axes, dynamics and limits; faults are reported. Elements without effect
        on a joint of this type, and placements that are nearly exact, are recorded."""
        key = f"joints.{name}"
        written = element.get("type")
        types = _TYPES_OF_DRAKE if element.tag == _OF_DRAKE else JOINT_TYPES
        if written not in types:
            fault = f"the joint type {shown(written)} is not known [E1712]"
            self.report.add_at(element.line, key, fault, nearest(written, types))
        orientation, position, angles = self.placement(element, key, name)
        self.out.leftovers.keep_angles(name, angles)
        kind = JOINTS.get(types.get(written, ""))
        without_effect = ("axis",) if kind and kind.moves else ("axis", "dynamics", "limit", "mimic")
        for tag in without_effect if kind and not kind.coordinates else ():
            if element.first(tag) is not None:
                self.out.leftovers.count(f"{tag} of {written} joints")
        parent, child = (self.end(element, tag, key) for tag in ("parent", "child"))
        axis = self.axis(element, key)
        axes, around = [axis], None
        if kind and not kind.coordinates:
            axes, around = [], axis if kind.moves else None
        elif kind and kind.name == "universal":
            axes, around = [Axis(axis.place, vector) for vector in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))], axis
        location = ElementPlace(self.report.file, element.line)
        return DraftJoint(
            name=name,
            place=location,
            pose=WrittenPose(location, orientation, position, link_key(parent)),
            type=kind.name if kind else "",
            written=written,
            parent=link_key(parent),
            child=link_key(child),
            axes=tuple(axes),
            pitch=self.pitch(element, key) if written in _SCREWS else 0.0,
            around=around,
        )

    def axis(self, element: Element, key: str) -> Axis:
        """Return the axis of a joint with the dynamics and limits of the joint."""
        vector = self.numbers(element.first("axis"), "xyz", (1.0, 0.0, 0.0), key)
        dynamics, mimic, limit = (element.first(tag) for tag in ("dynamics", "mimic", "limit"))
        damping, friction = (self.numbers(dynamics, tag, (0.0,), key)[0] for tag in ("damping", "friction"))
        result = Axis(ElementPlace(self.report.file, element.line), vector, damping=damping, friction=friction)
        if mimic is not None:
            (multiplier,) = self.numbers(mimic, "multiplier", (1.0,), key)
            (offset,) = self.numbers(mimic, "offset", (0.0,), key)
            location = ElementPlace(self.report.file, mimic.line)
            result = replace(result, mimic=DraftMimic(location, mimic.get("joint"), multiplier, offset))
        if limit is None:
            return result
        for tag in _OTHER_LIMITS:
            limit.get(tag)
        most = math.inf if self.out.minor >= 2 else 0.0  # ranges are open by default since version 1.2
        defaults = {"lower": -most, "upper": most, "effort": most}
        lower, upper, effort = (self.numbers(limit, tag, (default,), key)[0] for tag, default in defaults.items())
        effort = effort if effort >= 0.0 else math.inf
        return replace(result, lower=lower, upper=upper, effort=effort, limited=("position", "velocity", "effort"))

    def pitch(self, element: Element, key: str) -> float:
        """Return the travel of a screw of Drake, m/rad; files have m per turn."""
        (travel,) = self.numbers(element.first("drake:screw_thread_pitch"), "value", (0.0,), key)
        if not travel:
            hint = '<drake:screw_thread_pitch value="..."/>'
            self.report.add_at(element.line, key, "the thread pitch of a screw joint is not 0 [E1962]", hint)
        return travel / (2.0 * math.pi)

    def loop(self, name: str, element: Element) -> DraftLoop:
        """Return the loop of a ``<loop_joint>`` or a ``<constraint>``, with a frame in each of two links: z along the
        axis, of a universal constraint x along the parent's and y along the child's axis. A <loop_joint> has the same
        axis in both frames. Unknown types and axes without direction are reported."""
        written, location = element.get("type"), ElementPlace(self.report.file, element.line)
        if element.tag == "loop_joint":
            key, title, types, ends = f"loop_joints.{name}", "loop joint", LOOP_TYPES, ("link1", "link2")
            origins, axes = ends, ("axis", "axis")
        else:
            key, title, types, ends = f"constraints.{name}", "constraint", _CONSTRAINT_TYPES, ("parent", "child")
            origins, axes = ("parent_origin", "child_origin"), ("parent_axis", "child_axis")
        if written not in types:
            fault = f"the type {shown(written)} of a {title} is not known [E1713]"
            self.report.add_at(element.line, key, fault, nearest(written, types))
        vectors = {}
        for tag in dict.fromkeys(axes):
            vectors[tag] = self.numbers(element.first(tag), "xyz", (1.0, 0.0, 0.0), key)
            if not any(vectors[tag]):
                fault = f"the {tag} of the {title} has no direction [E1714]"
                self.report.add_at(element.line, key, fault, f'<{tag} xyz="0 0 1"/>')
        links = tuple(link_key(self.end(element, tag, key, title)) for tag in ends)
        kind, poses = types.get(written, ""), []
        for tag, axis, columns in zip(origins, axes, ((2, 0, 1), (1, 2, 0)), strict=True):
            orientation, position, _ = self.origin(element.first(tag), key)
            along = unit_axis(vectors[axis])
            of_axis = np.array(frame_about(np.array([0.0, 0.0, 1.0]) if along is None else along))
            of_axis = of_axis[:, columns] if kind == "universal" else of_axis
            poses.append(WrittenPose(location, snapped_rotation(orientation) @ of_axis, position))
        return DraftLoop(name, location, kind, links, tuple(poses))

    def end(self, element: Element, tag: str, key: str, title: str = "joint") -> str:
        """Return the legal name of the link that the child ``tag`` of a joint or loop names; empty for a missing link,
        which is reported. ``title`` is the kind of element in messages."""
        end = element.first(tag)
        written = end.get("link") if end else ""
        if not written:
            self.report.add_at(element.line, key, f"the {title} has no <{tag} link=...> [E1717]", "")
        elif written not in self.link_names:
            line = end.line if end else element.line
            hint = nearest(written, self.link_names)
            self.report.add_at(line, key, f"there is no link {shown(written)} [E1718]", hint)
        return self.link_names.get(written, "")

    # -- visuals -----------------------------------------------------------------------------------------------------

    def visuals(self, name: str, element: Element) -> Sequence[Visual]:
        """Return the visuals of a link, or its collision geometry if no visual can be drawn; a faulty visual does not
        refuse a robot."""

        def read(visual: Element, report: Report) -> Visual:
            reader = _UrdfReader(report)
            entry = solid_of(
                visual,
                reader.numbers,
                lambda mesh: (mesh.get("filename"), reader.numbers(mesh, "scale", (1.0, 1.0, 1.0))),
            )
            entry |= self.color(name, visual, reader.numbers)
            orientation, position, _ = reader.placement(visual, "", "")
            return Visual(WrittenPose(ElementPlace("", visual.line), orientation, position), entry)

        drawn, reasons = visuals_of(element.children_with_tag("visual"), read)
        collisions = element.children_with_tag("collision") if reasons and not drawn else ()
        instead, _ = visuals_of(collisions, read)
        note = "pictures show collision geometry in place of visuals [W0200]" if instead else LEFT_OUT
        for reason in reasons:
            self.out.undrawn.setdefault((note, reason), []).append(name)
        return drawn or instead

    def color(self, name: str, element: Element, numbers: Numbers) -> dict[str, Any]:
        """Return ``color`` and ``opacity`` of a visual of the link ``name``: by the colour in the visual, or of the
        named material; empty without a colour. Parts beyond 0 to 1 are noted. A colour in a visual also defines the
        material."""
        material = element.first("material")
        if material is not None and material.first("color") is not None:
            self.materials[material.get("name")] = material
        named = self.materials.get(material.get("name")) if material is not None else None
        color = named.first("color") if named is not None else None
        if color is None:
            return {}
        parts = numbers(color, "rgba", (0.5, 0.5, 0.5, 1.0))
        if any(not 0.0 <= part <= 1.0 for part in parts):
            written = " ".join(f"{part:g}" for part in parts)
            limited = "colours that pictures limit to parts from 0 to 1 [W0201]"
            reason = f'rgba="{written}"; try: parts of 255 divided by 255'
            self.out.undrawn.setdefault((limited, reason), []).append(name)
        return color_of(parts)


def link_key(name: str) -> str:
    """Return the key of a link in a draft, in which joints may not have the names of links."""
    return f"link {name}"
