"""Conversion of SDF to a scene: fixed joints are merged, loops become exact constraints, links that no joint holds are
free."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import legal_name, listed, nearest, shown
from eomgen.products.robots.draft import LinkPlace, Place, SceneDraft, matrix
from eomgen.products.robots.mjcf.draft import number
from eomgen.products.robots.sdf.elements import (
    MODEL_FRAME,
    WORLD_FRAME,
    SdfAxis,
    SdfJoint,
    SdfLink,
    SdfModel,
    WrittenPose,
)
from eomgen.products.robots.sdf.followers import add_followers
from eomgen.products.robots.sdf.frames import WORLD_NODE, Frames, Node, Pose, pose_of
from eomgen.products.robots.sdf.joints import (
    SCENE_TYPES,
    UNITS,
    are_perpendicular,
    axes_in_world,
    forces_of,
    friction_of,
    loop_frame,
    stops_of,
)
from eomgen.products.robots.sdf.reading import SdfReader
from eomgen.products.robots.sdf.tree import Edge, Step, Tree, tree_of
from eomgen.products.robots.urdf.conversion import body_entry, turns_of
from eomgen.products.robots.urdf.transmissions import NO_ACTUATION, effort_inputs
from eomgen.products.robots.uris import package_folders
from eomgen.scene.inertia import Inertia, combined, impossible
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import read_xml
from eomgen.scene.rotations import quaternion_of_matrix, snapped_rotation
from eomgen.scene.sources.source import ConvertedScene, OptionError
from eomgen.system.description import BASE, WORLD

#: A joint is at the origin of a link below this part of the lengths of their poses: rounding of several turns.
_AT_ORIGIN = 1e-12


def sdf_data(
    text: str,
    *,
    file: str,
    strict: bool = False,
    path: Path | None = None,
    lock: Sequence[str] = (),
    limits: bool = False,
    friction: bool = False,
    actuated: bool = False,
    weld: Sequence[str] = (),
    packages: Sequence[str] = (),
    included: bool = False,
) -> ConvertedScene:
    """Return an SDF file in the form of a scene file, with notes on all that is left out; the options as in ``SDF``.

    Raises
    ------
    DescriptionError, OptionError
    """
    home = Path() if path is None else path.parent
    report = Report(file, {})
    reader = SdfReader(report, package_folders(packages), home)
    world = reader.world(read_xml(text, file), file, home)
    converter = _Converter(reader, world, file, report, limits=limits, friction=friction)
    converter.draft.included = included
    converter.connect([lock] if isinstance(lock, str) else lock, [weld] if isinstance(weld, str) else weld)
    converter.convert(actuated=actuated)
    draft, notes = converter.draft, converter.notes()
    omissions = [*draft.all_warnings(), *reader.leftovers.warnings()]
    if strict:
        for place, note in omissions:
            draft.refuse(place, "", note, "no --strict (strict=False), to go on without")
    report.raise_problems()
    return ConvertedScene(draft.data, draft.lines, [*notes, *(note for _, note in omissions)], inertias_checked=True)


class _Converter:
    """Makes the sections of a scene of a file that is read."""

    def __init__(
        self, reader: SdfReader, world: SdfModel, file: str, report: Report, *, limits: bool, friction: bool
    ) -> None:
        self.reader, self.world, self.file = reader, world, file
        self.limits, self.friction = limits, friction
        self.frames = Frames(world, report)
        only = next(iter(world.models)) if len(world.models) == 1 else ""
        self.only = only
        name = legal_name(only or reader.world_name or Path(file).stem or "model", ())
        self.draft = SceneDraft(report, {"format": 1, "name": name, "bodies": {}, "joints": {}, "frames": {}})
        if reader.gravity is not None:
            self.draft.data["gravity"] = list(reader.gravity)
        self.links: dict[Node, SdfLink] = {}
        self.static: set[Node] = set()
        self.edges: list[Edge] = []
        self.places: dict[Node, LinkPlace] = {WORLD_NODE: LinkPlace(BASE, np.eye(3), np.zeros(3))}
        self.parts: dict[str, list[Inertia]] = {}
        self.joint_names: dict[Node, str] = {}
        self.units: dict[str, str] = {}
        self.merged: list[str] = []
        self.shifted: list[str] = []
        self.free: list[str] = []
        self.locked: list[str] = []
        for kind, sections in (("body", ("links", "frames")), ("joint", ("joints",)), ("constraint", ("joints",))):
            nodes = [
                (path, name) for path, model in world.every() for part in sections for name in getattr(model, part)
            ]
            self.draft.keep(kind, map(self.called, nodes))

    def called(self, node: Node) -> str:
        """Return the name of a link, frame or joint in the file, from its only model."""
        path, name = node
        parts = [part for part in path if not part.startswith("_merged__")]
        return "::".join([*(parts[1:] if parts[:1] == [self.only] else parts), name])

    def connect(self, lock: Sequence[str], weld: Sequence[str]) -> None:
        """Find the links that all joints connect; check all frames.

        Raises
        ------
        DescriptionError, OptionError
        """
        for path, model in self.world.every():
            static = any(self.frames.models[path[:depth]].static for depth in range(1, len(path) + 1))
            for name, link in model.links.items():
                self.links[path, name] = link
                if static:
                    self.static.add((path, name))
            for name in model.names:
                if name not in model.merged:
                    self.frames.resolve((path, name))
            for name in model.frames:
                self.frames.link(path, name)
            if path:
                self.frames.link(path, MODEL_FRAME)
        names = {self.called((path, name)): (path, name) for path, model in self.world.every() for name in model.joints}
        for written in lock:
            if written not in names:
                fault = f"{self.file} has no joint {shown(written)} to lock [E1938]"
                raise OptionError("lock", fault, nearest(written, names))
        held = {names[written] for written in lock}
        for path, model in self.world.every():
            for joint in model.joints.values():
                self.connected(path, joint, held)
        self.locked = [self.called(node) for node in names.values() if node in held]
        for written in weld:
            self.edges.append(self.welded(written))
        self.draft.report.raise_problems()

    def connected(self, path: tuple[str, ...], joint: SdfJoint, held: Collection[Node]) -> None:
        """Add the edge of a joint."""
        ends = []
        for attribute, name in (("parent", joint.parent), ("child", joint.child)):
            if not self.frames.known(path, name, joint.place, attribute):
                return
            link = self.frames.link(path, name)
            ends.append(WORLD_NODE if link in self.static else link)
        if ends[0] == ends[1]:
            if ends[0] == WORLD_NODE:
                self.reader.leftovers.count("joints of links that rest")
                return
            fault = f"the joint {shown(joint.name)} connects the link {shown(ends[0][1])} with itself [E1939]"
            self.draft.refuse(joint.place, "", fault, "two links")
            return
        key = (path, joint.name)
        axes_in_world(self.frames, Edge(key, joint, ends[0], ends[1], held=False))  # faults of frames, once
        self.edges.append(Edge(key, joint, ends[0], ends[1], held=key in held))

    def welded(self, written: str) -> Edge:
        """Return the joint that fixes a frame to the world."""
        path = (self.only,) if self.only else ()
        place = Place(self.file, 1)
        if not self.frames.known(path, written, place, "") or written == WORLD_FRAME:
            every = [self.called((path, name)) for path, model in self.world.every() for name in model.names]
            raise OptionError(
                "weld", f"{self.file} has no link or frame {shown(written)} [E1940]", nearest(written, every)
            )
        link = self.frames.link(path, written)
        joint = SdfJoint(f"{written}_weld", place, WrittenPose(place), "fixed", WORLD_FRAME, link[1])
        return Edge((path, joint.name), joint, WORLD_NODE, link, held=False)

    def convert(self, *, actuated: bool) -> None:
        """Fill the sections."""
        moving = [link for link in self.links if link not in self.static]
        roots = {link: self.frames.link(link[0][:1], MODEL_FRAME) for link in moving}
        gears = [edge for edge in self.edges if edge.joint.gear is not None]
        tree = tree_of(moving, [edge for edge in self.edges if edge.joint.gear is None], roots)
        self.place_links(tree)
        for name, inertias in self.parts.items():
            if name != BASE:
                self.draft.data["bodies"][name] |= body_entry(combined(inertias))
            else:
                self.draft.carry_mass(body_entry(combined(inertias)))
        self.draft.report.raise_problems()
        steps = [step for walk in tree.walks.values() for step in walk]
        following = add_followers(self.draft, self.frames, steps, gears, self.joint_names, self.places)
        for gear in gears:
            for axis in gear.joint.axes:
                self.leave_dynamics(axis, self.called(gear.key), "gearboxes")
        if actuated:
            units = {name: unit for name, unit in self.units.items() if name not in following}
            for section, entries in effort_inputs(units, NO_ACTUATION).items():
                self.draft.data[section] = {**entries, **self.draft.data.get(section, {})}
        self.add_shapes()
        if not self.draft.data["frames"]:
            del self.draft.data["frames"]

    def place_links(self, tree: Tree) -> None:
        """Add the links and their joints, frames, and the joints that close loops."""
        for link in self.static:
            self.rest(link)
        for start, steps in tree.walks.items():
            if start != WORLD_NODE:
                self.free_link(start)
            for step in steps:
                self.step(step)
        self.add_frames()
        for edge in tree.loops:
            self.close(edge)

    def add_part(self, node: Node) -> None:
        """Add mass properties, and the force by which gravity does not pull a link."""
        link, place = self.links[node], self.places[node]
        self.parts.setdefault(place.body, []).append(link.inertia.moved(place.orientation, place.position))
        fault = impossible(float(link.inertia.mass), link.inertia.about_center)
        if fault:
            self.draft.leave_out(link.place, f"link {self.called(node)}: {fault}")
        gravity = np.array(self.draft.data.get("gravity", (0.0, 0.0, -9.81)))
        if not link.pulled and link.inertia.mass and gravity.any() and place.body != BASE:
            at = place.of(np.array(link.inertia.center))
            force = {"body": at.body, "point": at.position.tolist(), "force": (-link.inertia.mass * gravity).tolist()}
            self.draft.section("forces")[self.draft.name("force", "", f"no_gravity_{self.legal(node)}")] = force

    def legal(self, node: Node) -> str:
        """Return the name of a link, frame or joint in the scene, unless it is taken."""
        name = self.called(node).replace("::", "__")
        return f"{name}_link" if name in (BASE, WORLD) else name

    def named(self, kind: str, node: Node, ending: str = "") -> str:
        """Return a new name for a link, frame or joint of the file."""
        return self.draft.name(kind, self.legal(node) + ending, "", joined=bool(ending) or "::" in self.called(node))

    def body(self, node: Node, ending: str = "") -> str:
        """Return a new body for a link."""
        name = self.named("body", node, ending)
        self.draft.data["bodies"][name] = {"mass": 0.0}
        self.draft.lines[f"bodies.{name}"] = str(self.links[node].place)
        return name

    def frame(self, node: Node, place: LinkPlace, line: Place) -> None:
        """Add a frame."""
        name = self.named("body", node)
        self.draft.data["frames"][name] = place.entry
        self.draft.lines[f"frames.{name}"] = str(line)

    def rest(self, link: Node) -> None:
        """Put a link of a static model on the base."""
        pose = self.frames.pose(link)
        self.places[link] = LinkPlace(BASE, pose.orientation, pose.position)
        self.frame(link, self.places[link], self.links[link].place)

    def free_link(self, link: Node) -> None:
        """Add a free joint for a link that no joint holds."""
        pose = self.frames.pose(link)
        body = self.body(link)
        self.places[link] = LinkPlace(body, np.eye(3), np.zeros(3))
        name = self.draft.name("joint", "", f"{body}_free")
        entry: dict[str, Any] = {"type": "free", "parent": BASE, "child": body}
        if pose.position.any() or not np.array_equal(pose.orientation, np.eye(3)):
            turned = quaternion_of_matrix(pose.orientation.tolist())
            entry["initial"] = {"position": pose.position.tolist(), "orientation": list(turned)}
        self.draft.data["joints"][name] = entry
        self.draft.lines[f"joints.{name}"] = str(self.links[link].place)
        self.free.append(self.called(link))
        self.add_part(link)

    def step(self, step: Step) -> None:
        """Place the link that a joint carries: on the body of the other link for a fixed joint, else as a body."""
        start, end = self.places[step.start], step.end
        between = self.frames.between(step.start, end)
        rest = _of(start, between)
        if step.edge.fixed:
            self.places[end] = rest
            self.frame(end, rest, self.links[end].place)
            self.merged.append(self.called(end))
        else:
            self.carry(step, start, rest)
        self.add_part(end)

    def carry(self, step: Step, start: LinkPlace, rest: LinkPlace) -> None:
        """Add a joint that moves, and the body that it carries: of a link whose origin is not at the joint a body with
        its origin there, in which the link is a frame."""
        edge, end = step.edge, step.end
        joint, key = edge.joint, edge.key
        offset = self.frames.between(end, key).position
        lengths = [float(np.linalg.norm(self.frames.pose(node).position)) for node in (end, key)]
        at_origin = float(np.linalg.norm(offset)) <= _AT_ORIGIN * max(lengths)
        body = self.body(end, "" if at_origin else "_body")
        self.places[end] = LinkPlace(body, np.eye(3), np.zeros(3) if at_origin else -offset)
        if not at_origin:
            self.frame(end, self.places[end], self.links[end].place)
            self.shifted.append(self.called(end))
        anchor = self.frames.between(step.start, key).position
        placed = rest if at_origin else LinkPlace(rest.body, rest.orientation, start.of(anchor).position)
        turned = self.frames.pose(end).orientation.T
        axes = [turned @ axis for axis in axes_in_world(self.frames, edge)]
        written = list(joint.axes)
        if step.turned:
            axes, written = [-axis for axis in axes[::-1]], written[::-1]
        name = self.joint_names[key] = self.named("joint", key)
        self.draft.lines[f"joints.{name}"] = str(joint.place)
        kind = SCENE_TYPES[joint.type]
        entry: dict[str, Any] = {"type": kind, "parent": placed.body, "child": body}
        if kind == "universal" and not are_perpendicular(axes):
            self.carry_by_two(name, entry, placed, axes, written)
            return
        self.place(entry, placed)
        if axes:
            entry["axis"] = axes[0].tolist()
        if kind == "universal":
            entry["second_axis"] = axes[1].tolist()
        if kind == "helical":
            entry["pitch"] = joint.pitch
        self.add_forces(name, joint, entry, written)
        self.draft.data["joints"][name] = entry
        if joint.around is not None:
            self.resist_turning(joint.around, name)

    def carry_by_two(
        self, name: str, entry: dict[str, Any], placed: LinkPlace, axes: Sequence[Array], written: Sequence[Any]
    ) -> None:
        """Add two revolute joints with a massless body between them, for axes that are not perpendicular."""
        middle = self.draft.name("body", "", f"{name}_between")
        self.draft.data["bodies"][middle] = {"mass": 0.0}
        first = {"type": "revolute", "parent": placed.body, "child": middle, "axis": axes[0].tolist()}
        self.place(first, placed)
        second = {"type": "revolute", "parent": middle, "child": entry["child"], "axis": axes[1].tolist()}
        for part, own, axis in ((first, name, written[0]), (second, f"{name}_second", written[1])):
            own = own if part is first else self.draft.name("joint", "", own)  # noqa: PLW2901
            self.add_forces(own, None, part, [axis])
            self.draft.data["joints"][own] = part
        note = f"axes of {name} are not perpendicular: revolute joints {name} and {name}_second take its place [W0165]"
        self.draft.notes.append(note)

    @staticmethod
    def place(entry: dict[str, Any], placed: LinkPlace) -> None:
        """Add the pose of a joint."""
        entry |= {"position": placed.position.tolist(), "orientation": matrix(placed.orientation)}

    def add_forces(self, name: str, joint: SdfJoint | None, entry: dict[str, Any], axes: Sequence[Any]) -> None:
        """Add springs and dampers, and friction and stops if asked for; note the omissions."""
        kind = "revolute" if joint is None else joint.type
        unit = UNITS.get(kind, "rad")
        if len(axes) == 1:
            self.units[name] = unit
        entry |= forces_of(axes)
        friction = friction_of(axes, unit) if axes else None
        if friction is not None and self.friction:
            entry["friction"] = friction
        elif friction is not None:
            self.draft.left_out("dry friction", name)
        limited = {quantity for axis in axes for quantity in axis.limited}
        bounded = "position" in limited and kind != "continuous"
        for axis in axes:
            if axis.lower > axis.upper:
                fault = f"the lower limit, {axis.lower:.9g}, is above the upper one, {axis.upper:.9g} {unit} [E1696]"
                self.draft.refuse(axis.place, f"joints.{name}", fault, "the smaller number as lower")
        stops = stops_of(axes, unit) if self.limits and bounded else None
        if stops is not None:
            entry["limits"] = stops
        elif bounded:
            self.draft.left_out("limits of position", name)
        elif "position" in limited:
            self.reader.leftovers.count("limits of continuous joints")
        for quantity in ("velocity", "effort"):
            if quantity in limited:
                self.draft.left_out(f"limits of {quantity}", name)

    def add_frames(self) -> None:
        """Add the frames of the file."""
        for path, model in self.world.every():
            for name, frame in model.frames.items():
                carrier = self.frames.link(path, name)
                within = self.frames.pose((path, name)).seen_from(self.frames.pose(carrier))
                place = self.places[carrier]
                at = place.of(within.position)
                self.frame(
                    (path, name), LinkPlace(at.body, place.orientation @ within.orientation, at.position), frame.place
                )

    def close(self, edge: Edge) -> None:
        """Make a constraint of a joint that closes a loop."""
        joint, key = edge.joint, edge.key
        name = self.joint_names[key] = self.named("constraint", key)
        sides = [self.places[edge.parent], self.places[edge.child]]
        self.draft.lines[f"constraints.{name}"] = str(joint.place)
        if sides[0].body == sides[1].body:
            self.reader.leftovers.count("joints within one body")
            return
        kind = "fixed" if edge.fixed else SCENE_TYPES[joint.type]
        axes = [] if edge.fixed else axes_in_world(self.frames, edge)
        if kind == "universal" and not are_perpendicular(axes):
            fault = f"the axes of {shown(joint.name)}, which closes a loop, are not perpendicular [E1941]"
            self.draft.refuse(joint.place, f"joints.{name}", fault, "another joint of the loop with must_be_loop_joint")
            return
        turned = loop_frame(kind, axes)
        frames = []
        for link, place in zip((edge.parent, edge.child), sides, strict=True):
            pose = self.frames.pose(link)
            within = Pose(turned, self.frames.pose(key).position).seen_from(pose)
            at = _of(place, Pose(within.orientation, self.frames.between(link, key).position))
            frame: dict[str, Any] = {"body": at.body, "position": at.position.tolist()}
            if kind != "spherical":
                frame |= {"axis": at.orientation[:, 2].tolist(), "x_axis": at.orientation[:, 0].tolist()}
            frames.append(frame)
        entry: dict[str, Any] = {"type": kind, "first": frames[0], "second": frames[1]}
        if kind == "helical":
            entry["pitch"] = joint.pitch
        self.draft.section("constraints")[name] = entry
        self.forces_of_loop(joint, name, kind, frames)

    def forces_of_loop(self, joint: SdfJoint, name: str, kind: str, frames: Sequence[Mapping[str, Any]]) -> None:
        """Add the damper of a joint that closes a loop as a bushing; refuse a spring."""
        if any(axis.stiffness or axis.mimic for axis in joint.axes):
            fault = (
                f"the joint {shown(joint.name)} closes a loop, so it has no coordinate for its spring or mimic [E1942]"
            )
            self.draft.refuse(joint.place, f"joints.{name}", fault, "must_be_loop_joint for another joint of the loop")
        damping = joint.axes[0].damping if len(joint.axes) == 1 else 0.0
        if damping and kind in ("revolute", "prismatic"):
            along = "rotational_damping" if kind == "revolute" else "damping"
            bushing = {"first": dict(frames[0]), "second": dict(frames[1]), along: [0.0, 0.0, damping]}
            self.draft.section("bushings")[self.draft.name("force", "", f"{name}_damper")] = bushing
        elif any(axis.damping for axis in (*joint.axes, *([joint.around] if joint.around else ()))):
            fault = (
                f"the damper of the {joint.type} joint {shown(joint.name)}, which closes a loop, is not"
                f" supported [E1943]"
            )
            self.draft.refuse(joint.place, f"joints.{name}", fault, "must_be_loop_joint for another joint of the loop")
        if joint.around is not None:
            self.leave_dynamics(joint.around, name, "joints that close loops", damped=True)
        if any(axis.friction for axis in joint.axes):
            self.draft.left_out("dry friction", name)
        if any(axis.limited for axis in joint.axes):
            self.draft.left_out("limits of joints that close loops", name)

    def resist_turning(self, axis: SdfAxis, name: str) -> None:
        """Add the damper of a ball joint, equal in all directions; note its spring, friction and limits."""
        if axis.damping:
            efforts = self.draft.section("efforts")
            for index in range(3):
                formula = f"-{number(axis.damping)} * v.{name}[{index}]"
                entry = {"joint": name, "index": index, "effort": formula}
                efforts[self.draft.name("effort", "", f"{name}_damper_{index}")] = entry
        self.leave_dynamics(axis, name, "ball joints", damped=True)

    def leave_dynamics(self, axis: SdfAxis, name: str, kind: str, *, damped: bool = False) -> None:
        """Note the dynamics and limits of an axis that has no coordinate of its own."""
        parts = {
            "dampers": not damped and axis.damping,
            "springs": axis.stiffness,
            "dry friction": axis.friction,
            "limits": axis.limited,
            "mimics": axis.mimic,
        }
        for part, present in parts.items():
            if present:
                self.draft.left_out(f"{part} of {kind}", name)

    def add_shapes(self) -> None:
        """Make shapes of the visuals, named by their links."""
        shapes: dict[str, dict[str, Any]] = {}
        for node, link in self.links.items():
            place = self.places[node]
            for visual in link.visuals:
                inner = self.visual_pose(node, visual.pose)
                if inner is None:
                    continue
                at = _of(place, inner)
                placed = {"body": at.body, "position": at.position.tolist(), "rotation": turns_of(at.orientation)}
                shapes[legal_name(self.legal(node), shapes)] = {**visual.entry, **placed}
        if shapes:
            self.draft.data["shapes"] = shapes

    def visual_pose(self, node: Node, written: WrittenPose) -> Pose | None:
        """Return the pose of a visual in its link; None if it names a frame that is not there, which is noted."""
        if not written.relative_to:
            return pose_of(written)
        path, _ = node
        if not self.frames.known(path, written.relative_to, written.place, ""):
            reason = f"there is no frame {shown(written.relative_to)}"
            self.reader.visuals.left_out.setdefault(reason, []).append(self.called(node))
            return None
        return self.frames.between(node, (path, written.relative_to)) @ pose_of(written)

    def notes(self) -> list[str]:
        """Return notes on the conversion."""
        reader = self.reader
        return [
            *reader.liberties,
            *self._notes(),
            *self.draft.notes,
            *reader.leftovers.notes(),
            *reader.visuals.notes(),
        ]

    def _notes(self) -> Iterator[str]:
        if self.reader.gravity is None:
            yield "the file has no <world>, which would give gravity: the scene has its own, 9.81 m/s^2 [W0166]"
        if self.free:
            names = listed(self.free)
            yield f"no joint holds these links, so they move freely: {names}; weld={self.free[:1]!r} fixes one [W0167]"
        if self.reader.defaulted:
            yield (
                f"links without <inertial> have 1 kg and 1 kg m^2, as SDF says: {listed(self.reader.defaulted)} [W0168]"
            )
        if self.merged:
            yield f"links fixed to another are parts of its body, kept as frames: {listed(self.merged)} [W0169]"
        if self.shifted:
            yield (
                f"links whose joints are not at their origins are frames of bodies NAME_body:"
                f" {listed(self.shifted)} [W0170]"
            )
        if self.locked:
            yield f"joints locked at zero: {listed(self.locked)} [W0171]"
        if any("::" in self.called(node) for node in self.links):
            yield "names of models within one another are joined: arm::hand is arm__hand [W0172]"


def _of(place: LinkPlace, inner: Pose) -> LinkPlace:
    """Return the place of a frame that is given in a link."""
    at = place.of(inner.position)
    return LinkPlace(at.body, snapped_rotation(place.orientation @ inner.orientation), at.position)
