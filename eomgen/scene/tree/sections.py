"""Sections of the tree and its attachments: bodies, beams, joints, constraints, points, frames, reactions, the base.

They are read together because places on geometrically exact beams are places on their nodes, which follow from all
attachments.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.data import dataclass, replace
from eomgen.base.messages import key_of
from eomgen.formula.nodes import Number
from eomgen.scene.bodies.cosserat import CONSTRAINED, Cosserat
from eomgen.scene.bodies.model import Body
from eomgen.scene.bodies.reading import placed_body, read_base, read_body, read_body_frame, read_point
from eomgen.scene.design_poses import DesignPoses, FramePlacement
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.inertia import Inertia, impossible, not_physical, tensor
from eomgen.scene.joint_types import JOINTS as TYPES
from eomgen.scene.joint_types import is_own
from eomgen.scene.joints.constraint_reading import read_constraint
from eomgen.scene.joints.frames import check_two_bodies
from eomgen.scene.joints.model import Constraint, Joint, LightJoint
from eomgen.scene.joints.moved_inertia import check_motion
from eomgen.scene.joints.reading import read_joint, read_reaction
from eomgen.scene.joints.tree import JointEdge, check_mimics, order_joints
from eomgen.scene.joints.unresisted import unresisted_motions
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import Values, read_placement
from eomgen.scene.section import Entries, Reading, Section
from eomgen.scene.tree.beam_attachments import check_frames
from eomgen.scene.tree.beam_nodes import check_names_of_nodes, node_at, node_joints, section_formulas, stations_of
from eomgen.system.description import BASE as BASE_NAME
from eomgen.system.description import WORLD, FixedFrame, Point

if TYPE_CHECKING:
    from eomgen.scene.bodies import schema as bodies
    from eomgen.scene.bodies.beam_schema import BeamEntry
    from eomgen.scene.joints import schema as joints


def body_inertias(bodies: Iterable[Body], values: Values) -> dict[str, Inertia]:
    """Return the mass properties of each body at the default parameters, in the body's frame, by name; inertias are
    about the centre of mass, and NaN if unknown."""
    known: dict[str, Inertia] = {}
    alike: dict[tuple[int, int, int], Inertia] = {}  # formulas by identity: nodes of a beam share these
    for body in bodies:
        key = id(body.mass), id(body.center_of_mass), id(body.inertia)
        if key not in alike:
            center = [values.value(entry) for entry in body.center_of_mass]
            entries = [values.value(entry) for entry in body.inertia]
            alike[key] = Inertia(values.value(body.mass), np.array(center), tensor(entries))
        known[body.name] = alike[key]
    return known


def check_inertias(bodies: Iterable[Body], entries: Mapping[str, bodies.BodyEntry], values: Values) -> None:
    """Report rigid bodies with an inertia that no body can have, and add notes on inertias that miss the condition
    by a few per cent; beams, and bodies without the check, are passed over. ``entries`` are the entries of [bodies]
    by name."""
    sound: set[tuple[float, ...]] = set()
    for body in bodies:
        key = key_of("bodies", body.name)
        checked = body.name not in entries or entries[body.name].check_inertia
        numbers = (checked, *[entry.value for entry in body.inertia if isinstance(entry, Number)])
        known = len(numbers) > len(body.inertia) and numbers in sound
        if body.beam is None and not body.node_of and not known and not values.report.concerns(key):
            rule = RELATIONS["inertia" if checked else "inertia without its check"]
            if values.require(f"{key}.inertia", replace(rule, hint=rule.hint.format(body.name)), body.inertia):
                sound.add(numbers)
            if checked and f"{key}.inertia" not in values.judged and not values.report.concerns(key):
                moments = [values.value(entry) for entry in body.inertia]
                if not_physical(moments, rotors=True):
                    fault = impossible(0.0, tensor(moments))
                    values.note([f"{key}.inertia: {fault}; try: check_inertia = false, if these values are meant"])


@dataclass(frozen=True)
class TreeSections:
    """The joint tree of a scene.

    Attributes
    ----------
    joints : parents first
    complete : whether every body and every joint could be read
    unresisted : notes on joints that move without moving any mass
    light : joints without inertia, whose motion constraints have to determine
    """

    joints: Sequence[Joint]
    complete: bool
    unresisted: Sequence[str]
    light: Sequence[LightJoint] = ()


def _reserved_name_fault(name: str) -> tuple[str, str]:
    """Return the fault of a body's name that stands for another frame."""
    if name == BASE_NAME:
        return f"the name {BASE_NAME} is reserved for the frame that carries the tree [E1459]", "another name"
    if name == WORLD:
        return f"the name {WORLD} is reserved for the frame at rest while the base moves [E1460]", "another name"
    return "", ""


class _Bodies(Section):
    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        return _reserved_name_fault(name)

    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {"bodies": dict.fromkeys(reading.document.section("bodies"))}  # looked up for every point and element

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        entries = reading.document.section("bodies").items()
        return {"groups": {name: entry.group for name, entry in entries if entry.group is not None}}


class _Beams(Section):
    """Geometrically exact beams are items of this section; other beams are bodies."""

    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        fault, hint = _reserved_name_fault(name)
        joint = document.section("joints").get(name)
        if not fault and name in document.section("bodies"):
            fault, hint = f"the name {name} is both a body and a beam [E1461]", "another name for one of them"
        elif not fault and joint is not None and joint.type != "fixed":
            fault = f"the name {name} is both a joint and a beam, and q.{name} would be both [E1461]"
            hint = "another name for one of them"
        return fault, hint

    def names(self, reading: Reading) -> Mapping[str, Any]:
        exact = (name for name, beam in reading.document.section("beams").items() if beam.model in CONSTRAINED)
        return {"beams": dict.fromkeys(reading.names_in("beams"), 0), "exact_beams": tuple(exact)}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        """Return the geometrically exact beams by name, and add elastic beams and the nodes of exact beams to the
        bodies of ``reading``, whose functions ``attach`` and ``section_formulas`` are set."""
        values = reading.values
        entries: Mapping[str, BeamEntry] = reading.document.section("beams")
        exact: dict[str, Cosserat] = {}
        flexible: dict[str, Body] = {}
        if entries:
            from eomgen.scene.bodies.beam_reading import read_beam  # noqa: PLC0415  # most scenes have no beams
            from eomgen.scene.bodies.cosserat_reading import check_keys, read_cosserat  # noqa: PLC0415

            for name, beam in entries.items():
                check_keys(name, beam, values)
            stations = stations_of(reading.names.exact_beams, reading)
            exact |= {name: read_cosserat(name, entries[name], values, places) for name, places in stations.items()}
            flexible |= {name: read_beam(name, beam, values) for name, beam in entries.items() if name not in exact}
        reading.tables["beams"] |= {name: body.beam.size for name, body in flexible.items() if body.beam is not None}
        nodes = {node.name: node for beam in exact.values() for node in beam.bodies()}
        reading.items["bodies"] = {**reading.items["bodies"], **flexible, **nodes}
        check_names_of_nodes(exact, reading.document.section("joints"), values.report)
        reading.attach = partial(node_at, exact, values)
        reading.section_formulas = partial(section_formulas, exact, values)
        return exact

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        exact: Mapping[str, Cosserat] = reading.items["beams"]
        entries = reading.document.section("beams")
        groups = {node: entries[name].group for name, beam in exact.items() for node in beam.nodes}
        return {
            "elements": tuple(CosseratBeam(name, beam) for name, beam in exact.items()),
            "groups": {node: group for node, group in groups.items() if group is not None},
        }


class _Joints(Section):
    def names(self, reading: Reading) -> Mapping[str, Any]:
        types: dict[str, str] = {name: joint.type for name, joint in reading.document.section("joints").items()}
        for name in sorted(reading.refused["joints"]):
            entry = reading.data["joints"].get(name)
            kind = entry.get("type") if isinstance(entry, Mapping) else None
            types[name] = kind if isinstance(kind, str) and kind in TYPES else ""
        return {"joints": types}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        entries: Mapping[str, joints.JointEntry] = reading.document.section("joints")
        if reading.document.coordinates == "absolute":
            _check_types(entries, reading.report)
        read = {name: read_joint(name, entry, reading.values) for name, entry in entries.items()}
        reading.values.design = self._design(read, entries, reading)
        written = reading.document.section("bodies")
        reading.items["bodies"] = {
            name: placed_body(body, written[name], reading.values) if name in written else body
            for name, body in reading.items["bodies"].items()
        }
        return {name: self._place(joint, entries[name], reading) for name, joint in read.items()}

    def _design(
        self, read: Mapping[str, Joint], entries: Mapping[str, joints.JointEntry], reading: Reading
    ) -> DesignPoses:
        """Return the poses of the bodies with every joint at zero."""
        placements: dict[str, FramePlacement] = {}
        for name, joint in read.items():
            placement = FramePlacement(entries[name].given_in or joint.parent, joint.position, joint.orientation)
            placements.setdefault(joint.child, placement)
        return DesignPoses(placements, reading.names.exact_beams, reading.document.table("base") is not None)

    def _place(self, joint: Joint, entry: joints.JointEntry, reading: Reading) -> Joint:
        """Return a joint with the placement in the frame of the parent in place of the frame named in the key ``in``;
        on an exact beam the parent becomes the node at the place."""
        if entry.given_in is not None:
            positioned = "position" in entry.model_fields_set
            placement = joint.parent, joint.position, joint.orientation
            position, orientation = read_placement(
                key_of("joints", joint.name), entry.given_in, positioned, *placement, reading.values
            )
            joint = replace(joint, position=position, orientation=orientation)
        parent, position = reading.attach(key_of("joints", joint.name, "position"), joint.parent, joint.position)
        return replace(joint, parent=parent, position=position)

    def check(self, reading: Reading) -> None:
        """Order the tree, parents first, with joints of beams' nodes, and report faults in tree, mimic joints and
        inertias; the result is kept in ``reading`` as TreeSections."""
        document, values = reading.document, reading.values
        bodies, of_nodes = reading.items["bodies"], node_joints(reading.items["beams"].values())
        read = {name: joint for name, joint in reading.items["joints"].items() if joint.child not in of_nodes}
        joints = reading.items["joints"] = {**read, **of_nodes}
        links = [JointEdge(joint.name, joint.parent, joint.child) for joint in joints.values()]
        complete = not reading.refused["joints"] and not reading.broken
        sections = {name: "beams" if name in document.section("beams") else "bodies" for name in bodies}
        order = order_joints(links, sections, reading.broken, complete, reading.report)
        check_mimics(joints, reading.refused["joints"], reading.report)
        check_inertias(bodies.values(), document.section("bodies"), values)
        tree = [joints[link.name] for link in order]
        unresisted: Sequence[str] = ()
        determined: Sequence[LightJoint] = ()
        if complete and len(order) == len(links) == len(bodies):
            free = not document.section("constraints") and not any(joint.drive for joint in tree)
            alone = document.coordinates == "joint" and free
            judged = {name for name in bodies if key_of("bodies", name, "mass") in values.judged} if alone else set()
            absolute = document.coordinates == "absolute"
            constrained = bool(document.section("constraints")) and not absolute
            light, determined = check_motion(
                tree, bodies, values, absolute=absolute, constrained=constrained, allowed=judged
            )
            if alone and not reading.report.noted:
                inertias = body_inertias(bodies.values(), values)
                unresisted = unresisted_motions(tree, inertias, sections, values, light)
            check_frames(tree, bodies, values)
        reading.keep(TreeSections(tree, complete, unresisted, determined))

    def notes(self, reading: Reading) -> Iterable[str]:
        return reading.kept(TreeSections).unresisted

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        kept, bodies = reading.kept(TreeSections), reading.items["bodies"]
        return {
            "bodies": tuple(bodies[joint.child] for joint in kept.joints if joint.child in bodies),
            "joints": tuple(kept.joints),
            "light": tuple(kept.light),
        }


class _Points(Section):
    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {"points": dict.fromkeys(reading.names_in("points"))}


class _Frames(Section):
    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {"points": dict.fromkeys(reading.names_in("frames"))}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        frames: Mapping[str, FixedFrame] = super().read(reading)
        origins = {name: Point(name, frame.body, frame.position) for name, frame in frames.items()}
        reading.items["points"] = {**reading.items["points"], **origins}
        return frames


def _check_types(entries: Mapping[str, joints.JointEntry], report: Report) -> None:
    """Report joints of other distributions' types, and held coordinates, in absolute coordinates."""
    for name, entry in entries.items():
        if entry.initial.hold:
            fault = "absolute coordinates have no coordinates of joints that could be held [E2215]"
            report.add(f"{key_of('joints', name)}.initial.hold", fault, 'coordinates = "joint"')
        if not is_own(entry.type):
            fault = f"the joint type {entry.type} is not eomgen's and has no equations between absolute bodies [E1990]"
            report.add(key_of("joints", name, "type"), fault, 'coordinates = "joint"')


class _Constraints(Section):
    def check(self, reading: Reading) -> None:
        tree, beams = reading.kept(TreeSections), reading.document.section("beams")
        items: Mapping[str, Constraint] = reading.items["constraints"]
        if tree.complete:
            closed = [(key_of("constraints", name), item.frames) for name, item in items.items() if item.framed]
            check_two_bodies(closed, tree.joints, beams, reading.report)
        flexible = [name for name in beams if name not in reading.items["beams"]]
        for name in flexible if reading.document.coordinates == "absolute" else ():
            fault = "absolute coordinates know rigid bodies only, and this is a beam [E1981]"
            reading.report.add(key_of("beams", name), fault, 'coordinates = "joint"')


class _Base(Section):
    def read(self, reading: Reading) -> Mapping[str, Any]:
        gravity = reading.values.vector("gravity", reading.document.gravity, PARAMETERS)
        return {"gravity": gravity, "base": read_base(reading)}

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return reading.items["base"]


BASE = _Base(
    key="base",
    entry="eomgen.scene.bodies.base_schema:BaseEntry",
    single=True,
    after=("outputs",),
    last=True,
    positional=("position", "rotation"),
    documentation="""
    Prescribe the motion of the base: position in world axes, intrinsic rotations (axis, angle); of time and
    parameters. ``acceleration``, of a record or a formula, is integrated and added to the position. ``follow`` waves
    to go with their surface.""",
)
BODIES = _Bodies(
    key="bodies",
    entry="eomgen.scene.bodies.schema:BodyEntry",
    singular="body",
    after=("curves",),
    item=read_body,
    positional=("mass",),
    documentation="""
    Add a rigid body: mass (kg), centre of mass in its frame (m), inertia there (kg m^2; 3, 6, table or 3x3).

    ``group`` is for absolute coordinates: SE3 (the default) suits bodies jointed to the ground or to slow
    bodies, R3xSO3 bodies that spin fast and freely.""",
)
BEAMS = _Beams(
    key="beams",
    entry="eomgen.scene.bodies.beam_schema:BeamEntry",
    after=("bodies",),
    positional=("length",),
    documentation="""
    Add an elastic beam along x of its frame, from ``start`` on (m), with mass_per_length (kg/m) or a section.

    Each way to deform is a table; ways that are not given do not happen. Joints carry a beam as any body.""",
)
JOINTS = _Joints(
    key="joints",
    entry="eomgen.scene.joints.schema:JointEntry",
    after=("beams",),
    attached=True,
    positional=("type", "parent", "child"),
    documentation="""
    Add a joint of type fixed, revolute, prismatic, helical, cylindrical, universal, planar, spherical or free.

    Its placement is in the parent's frame; a joint of several coordinates takes lists of coefficients, angles
    first.""",
)
CONSTRAINTS = _Constraints(
    key="constraints",
    entry="eomgen.scene.joints.constraint_schema:ConstraintEntry",
    scene_field="constraints",
    after=("frames",),
    attached=True,
    unlike={"joints": ("a joint and a constraint", "another name for one of them")},
    item=read_constraint,
    positional=("type", "first", "second"),
    documentation="""
    Add a constraint that closes a loop between two frames.

    A frame is a point's name, or a table with body and position (or point) and with axis, the frame's z (x_axis
    too if the angle about it matters), or rotation. Types: spherical, revolute, universal, cylindrical,
    helical (with pitch), prismatic, planar, fixed, distance (with length), point_on_line, orientation, rolling (with
    radius, and shape disc or sphere).""",
)
REACTIONS = Section(
    key="reactions",
    entry="eomgen.scene.joints.constraint_schema:ReactionEntry",
    scene_field="reactions",
    after=("base",),
    last=True,
    item=read_reaction,
    documentation="Set the point and the axes of ``reaction.NAME`` for a joint or a constraint.",
)
POINTS = _Points(
    key="points",
    entry="eomgen.scene.bodies.schema:PointEntry",
    scene_field="points",
    after=("joints",),
    attached=True,
    item=read_point,
    positional=("body", "position"),
    documentation="""
    Add a point fixed in a body, in the ``base``, or in the ``world`` (at rest while the base moves).""",
)
FRAMES = _Frames(
    key="frames",
    entry="eomgen.scene.bodies.schema:BodyFrame",
    scene_field="frames",
    after=("points",),
    attached=True,
    unlike={
        "points": ("a point and a frame", "the frame alone: its origin is a point"),
        **dict.fromkeys(("bodies", "beams"), ("a body and a frame", "another name for the frame")),
    },
    item=read_body_frame,
    positional=("body", "position"),
    documentation="""
    Add a frame fixed in a body, in the ``base`` or in the ``world``; its origin is a point of that name.""",
)
