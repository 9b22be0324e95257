"""Conversion of a draft to a scene: fixed joints are merged, loops become exact constraints, links that no joint holds
are free."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import legal_name, listed, nearest, shown
from eomgen.products.robots.draft import (
    MODEL_FRAME,
    WORLD_FRAME,
    Axis,
    Draft,
    DraftJoint,
    DraftLink,
    DraftLoop,
    WrittenPose,
)
from eomgen.products.robots.followers import Followers
from eomgen.products.robots.frames import WORLD_NODE, Frames, Node, Pose, pose_of
from eomgen.products.robots.joints import (
    are_perpendicular,
    axes_in_link,
    axes_in_world,
    displacement,
    forces_of,
    friction_of,
    gap_of,
    loop_frame,
    stops_of,
)
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.products.robots.scene_draft import (
    NO_ACTUATION,
    Actuation,
    LinkPlace,
    SceneDraft,
    body_entry,
    effort_inputs,
    number,
    tunable_body,
    turns_of,
)
from eomgen.products.robots.tree import DraftTree, Edge, Step, tree_of
from eomgen.scene.inertia import Inertia, combine_inertias, impossible
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.rotations import quaternion_of_matrix, snapped_rotation
from eomgen.scene.sources.source import ConvertedScene, OptionError
from eomgen.system.description import BASE, WORLD

#: A joint is at the origin of a link below this part of the lengths of their poses: rounding of several turns.
_AT_ORIGIN = 1e-12
#: Ends of a loop meet within this part of their distance from the origin of their body, as digits of files allow.
_MET = 1e-6
_RESERVED = {BASE: "the frame that carries the tree", WORLD: "the frame at rest while the base moves"}


def joints_to_hold(lock: Sequence[str], joints: Mapping[str, Any], file: str) -> list[str]:
    """Return the joints to lock. Raises OptionError for a name that the file lacks."""
    names = [lock] if isinstance(lock, str) else list(lock)
    for name in names:
        if name not in joints:
            several = [part.strip() for part in name.split(",")]
            hint = nearest(name, joints)
            if len(several) > 1 and all(part in joints for part in several):
                hint = f"one name for each: lock={several!r}, or --lock {' --lock '.join(several)}"
            raise OptionError("lock", f"{file} has no joint {shown(name)} to lock [E1938]", hint)
    return names


class Conversion:
    """Makes the sections of a scene of a draft.

    Parameters
    ----------
    limits, friction : bool
        Take limits of position as stops, and dry friction.
    scene : SceneDraft
        Without its sections.
    """

    def __init__(self, draft: Draft, scene: SceneDraft, *, limits: bool, friction: bool) -> None:
        """Begin a scene from a draft, with legal names for bodies, joints and constraints."""
        self.draft, self.world, self.scene, report = draft, draft.world, scene, scene.report
        self.file = report.file
        self.limits, self.friction = limits, friction
        self.frames = Frames(self.world, report)
        self.only = next(iter(self.world.models)) if len(self.world.models) == 1 else ""
        scene.data |= {"format": 1, "name": legal_name(draft.name, ()), "bodies": {}, "joints": {}, "frames": {}}
        if draft.gravity is not None:
            scene.data["gravity"] = list(draft.gravity)
        self.links: dict[Node, DraftLink] = {}
        self.static: dict[Node, None] = {}
        self.edges: list[Edge] = []
        self.places: dict[Node, LinkPlace] = {WORLD_NODE: LinkPlace(BASE, np.eye(3), np.zeros(3))}
        self.parts: dict[str, dict[Node, Inertia]] = {}
        self.joint_names: dict[Node, str] = {}
        self.units: dict[str, str] = {}
        self.merged: list[str] = []
        self.shifted: list[str] = []
        self.free: list[str] = []
        for kind, sections in (("body", ("links", "frames")), ("joint", ("joints",)), ("constraint", ("joints",))):
            nodes = [
                (path, name) for path, model in self.world.every() for part in sections for name in getattr(model, part)
            ]
            self.scene.keep(kind, map(self.name_of, nodes))

    def name_of(self, node: Node) -> str:
        """Return the name of a link, frame or joint in the file, from its only model."""
        path, key = node
        model = self.frames.models[path]
        item = model.links.get(key) or model.joints.get(key) or model.frames.get(key)
        parts = [part for part in path if not part.startswith("_merged__")]
        return "::".join([*(parts[1:] if parts[:1] == [self.only] else parts), item.name if item else key])

    @property
    def joints(self) -> dict[str, Node]:
        """Joints by their names in the file."""
        return {self.name_of((path, key)): (path, key) for path, model in self.world.every() for key in model.joints}

    def connect(self, held: Mapping[Node, float], weld: Sequence[str] = ()) -> None:
        """Find the links that all joints connect; check all frames.

        Parameters
        ----------
        held : mapping
            Coordinates of joints that do not move.
        weld : sequence
            Names of frames that are fixed to the world.

        Raises
        ------
        DescriptionError, OptionError
        """
        for path, model in self.world.every():
            static = any(self.frames.models[path[:depth]].static for depth in range(1, len(path) + 1))
            for name, link in model.links.items():
                self.links[path, name] = link
                if static:
                    self.static[path, name] = None
            for name in model.names:
                if name not in model.merged:
                    self.frames.resolve((path, name))
            for name in model.frames:
                self.frames.link(path, name)
            if path:
                self.frames.link(path, MODEL_FRAME)
        for path, model in self.world.every():
            for name, joint in model.joints.items():
                self.add_edge((path, name), joint, held)
        for written in weld:
            self.edges.append(self.weld(written))
        self.scene.report.raise_problems()

    def add_edge(self, key: Node, joint: DraftJoint, held: Mapping[Node, float]) -> None:
        """Add the edge of a joint."""
        path, _ = key
        ends = []
        for attribute, name in (("parent", joint.parent), ("child", joint.child)):
            if not self.frames.check_frame(path, name, joint.place, attribute):
                return
            link = self.frames.link(path, name)
            ends.append(WORLD_NODE if link in self.static else link)
        if ends[0] == ends[1]:
            if ends[0] == WORLD_NODE:
                self.draft.leftovers.count("joints of links that rest")
                return
            fault = f"the joint {shown(joint.name)} connects the link {shown(ends[0][1])} with itself [E1939]"
            self.scene.refuse(joint.place, "", fault, "two links")
            return
        edge = Edge(key, joint, ends[0], ends[1], held.get(key))
        for axis in joint.axes:
            self.frames.check_frame(path, axis.expressed_in or key[1], axis.place, "expressed_in")
        self.edges.append(edge)

    def weld(self, written: str) -> Edge:
        """Return the joint that fixes a frame to the world."""
        path = (self.only,) if self.only else ()
        place = ElementPlace(self.file, 1)
        if not self.frames.check_frame(path, written, place, "") or written == WORLD_FRAME:
            every = [self.name_of((path, name)) for path, model in self.world.every() for name in model.names]
            fault = f"{self.file} has no link or frame {shown(written)} [E1940]"
            raise OptionError("weld", fault, nearest(written, every))
        link = self.frames.link(path, written)
        joint = DraftJoint(f"{written}_weld", place, WrittenPose(place), "fixed", "fixed", WORLD_FRAME, link[1])
        return Edge((path, joint.name), joint, WORLD_NODE, link, None)

    def convert(self, *, actuated: bool, actuators: Actuation = NO_ACTUATION) -> None:
        """Fill the sections; ``actuated`` if joints have inputs."""
        moving = [link for link in self.links if link not in self.static]
        roots = {link: self.frames.link(link[0][:1], MODEL_FRAME) if link[0] else link for link in moving}
        gears = [edge for edge in self.edges if edge.joint.gear is not None]
        tree = tree_of(moving, [edge for edge in self.edges if edge.joint.gear is None], roots)
        self.place_links(tree)
        self.add_masses()
        self.scene.report.raise_problems()
        steps = [step for walk in tree.walks.values() for step in walk]
        following = Followers(self.scene, self.frames, steps, self.joint_names, self.places).add(gears)
        for gear in gears:
            for axis in gear.joint.axes:
                self.leave_dynamics(axis, self.name_of(gear.key), "gearboxes")
        driven = {*following, *actuators.efforts}
        units = {name: unit for name, unit in self.units.items() if name not in driven} if actuated else {}
        for section, entries in effort_inputs(units, actuators).items():
            self.scene.data[section] = {**entries, **self.scene.data.get(section, {})}
        self.add_shapes()
        if not self.scene.data["frames"]:
            del self.scene.data["frames"]

    def result(
        self, notes: Sequence[str], warnings: Sequence[tuple[ElementPlace, str]], *, strict: bool
    ) -> ConvertedScene:
        """Return the scene with all notes; ``warnings`` are of the reader, with their places.

        Raises
        ------
        DescriptionError
            Of a ``strict`` conversion with parts that are left out.
        """
        draft, scene = self.draft, self.scene
        omissions = [*warnings, *scene.all_warnings(), *draft.leftovers.warnings()]
        if strict:
            for place, note in omissions:
                scene.refuse(place, "", note, "no --strict (strict=False), to go on without")
        scene.report.raise_problems()
        undrawn = [
            f"visuals that pictures leave out ({len(names)}: {listed(list(dict.fromkeys(names)))}): {reason} [W0175]"
            for reason, names in draft.undrawn.items()
        ]
        said = [*draft.notes, *scene.notes, *self.notes(), *notes, *draft.leftovers.notes(), *undrawn]
        said += [note for _, note in omissions]
        return ConvertedScene(scene.data, scene.lines, said, inertias_checked=True)

    def notes(self) -> list[str]:
        """Return notes on links that are not bodies of their own, and on links that move freely."""
        notes = []
        if self.free and not self.draft.root:
            names = listed(self.free)
            note = f"no joint holds these links, so they move freely: {names}"
            notes.append(f"{note}; weld={self.free[:1]!r} fixes one [W0167]")
        if self.merged:
            only = len(self.merged) == 1
            many = (
                "1 link is merged into the body it is"
                if only
                else f"{len(self.merged)} links are merged into the bodies they are"
            )
            notes.append(
                f"{many} fixed to and kept as {'a frame' if only else 'frames'}: {listed(self.merged)} [W0180]"
            )
        if self.shifted:
            note = "links whose joints are not at their origins are frames of bodies NAME_body"
            notes.append(f"{note}: {listed(self.shifted)} [W0170]")
        return notes

    def place_links(self, tree: DraftTree) -> None:
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
        for loop in self.draft.loops:
            self.close_by_frames(loop)

    def add_masses(self) -> None:
        """Add the mass properties of all bodies."""
        data = self.scene.data
        for body, parts in self.parts.items():
            tunable = next((link for link in parts if link[1] in self.draft.tunable), None)
            if body == BASE:
                self.scene.carry_mass(body_entry(combine_inertias([*parts.values()])))
            elif tunable is None:
                data["bodies"][body] |= body_entry(combine_inertias([*parts.values()]))
            else:
                name = self.name_of(tunable)
                parameters, data["bodies"][body] = tunable_body(name, self.links[tunable].inertia)
                self.scene.section("parameters").update(parameters)
                others = combine_inertias([part for link, part in parts.items() if link != tunable])
                if others.mass or np.any(others.about_center):
                    rest = f"{body}_others"
                    data["bodies"][rest] = body_entry(others)
                    data["joints"][rest] = {"type": "fixed", "parent": body, "child": rest}
                    self.scene.notes.append(f"links fixed to the tunable link {name} become the body {rest} [W0181]")

    def add_part(self, node: Node) -> None:
        """Add mass properties, and the force by which gravity does not pull a link."""
        link, place = self.links[node], self.places[node]
        self.parts.setdefault(place.body, {})[node] = link.inertia.transform(place.orientation, place.position)
        if place.body == BASE and node[1] in self.draft.tunable:
            fault = f"the link {link.name} is fixed to the base, so its mass and inertia have no effect [E1975]"
            raise OptionError("tunable", fault, "a link that a joint moves")
        fault = impossible(float(link.inertia.mass), link.inertia.about_center)
        if fault:
            self.scene.leave_out(link.place, f"link {self.name_of(node)}: {fault}")
        gravity = np.array(self.scene.data.get("gravity", (0.0, 0.0, -9.81)))
        if not link.pulled and link.inertia.mass and gravity.any() and place.body != BASE:
            at = place.of(np.array(link.inertia.center))
            force = {"body": at.body, "point": at.position.tolist(), "force": (-link.inertia.mass * gravity).tolist()}
            self.scene.add("forces", "force", f"no_gravity_{self.legal(node)}", force)

    def legal(self, node: Node) -> str:
        """Return the name of a link, frame or joint in the scene, unless it is taken."""
        name = self.name_of(node)
        if self.draft.legal:
            return name
        name = name.replace("::", "__")
        return f"{name}_link" if name in (BASE, WORLD) else name

    def new_name(self, kind: str, node: Node, ending: str = "") -> str:
        """Return a new name for a link, frame or joint of the file."""
        if self.draft.legal:
            return self.name_of(node)
        return self.scene.name(kind, self.legal(node) + ending, "", joined=bool(ending) or "::" in self.name_of(node))

    def body(self, node: Node, ending: str = "") -> str:
        """Return a new body for a link."""
        link = self.links[node]
        name = link.body or self.new_name("body", node, ending)
        if link.body:
            note = f"the link {link.name} is the body {name}, because {link.name} is the name of"
            self.scene.notes.append(f"{note} {_RESERVED[link.name]} [W0179]")
        self.scene.put("bodies", name, {"mass": 0.0}, link.place)
        return name

    def frame(self, node: Node, place: LinkPlace, line: ElementPlace) -> None:
        """Add a frame."""
        self.scene.put("frames", self.new_name("body", node), {"body": place.body, **place.pose}, line)

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
        name = self.draft.root_joint or self.scene.name("joint", "", f"{body}_free")
        entry: dict[str, Any] = {"type": self.draft.root or "free", "parent": BASE, "child": body}
        if pose.position.any() or not np.array_equal(pose.orientation, np.eye(3)):
            turned = quaternion_of_matrix(pose.orientation.tolist())
            entry["initial"] = {"position": pose.position.tolist(), "orientation": list(turned)}
        self.scene.put("joints", name, entry, self.links[link].place)
        self.free.append(self.name_of(link))
        self.add_part(link)

    def step(self, step: Step) -> None:
        """Place the link that a joint carries: on the body of the other link for a fixed joint, else as a body."""
        start, end, joint = self.places[step.start], step.end, step.edge.joint
        rest = _of(start, self.frames.between(step.start, end))
        if step.edge.held is not None or joint.reference:
            turn, shift = displacement(joint, (step.edge.held or 0.0) - joint.reference)
            position = rest.position + rest.orientation @ shift
            rest = LinkPlace(rest.body, snapped_rotation(rest.orientation @ turn), position)
        if not step.edge.is_fixed:
            self.carry(step, start, rest)
        elif self.links[end].kept or (end[1] in self.draft.tunable and rest.body != BASE):
            body, name = self.body(end), self.new_name("joint", step.edge.key)
            self.places[end] = LinkPlace(body, np.eye(3), np.zeros(3))
            fixed = {"type": "fixed", "parent": rest.body, "child": body, **rest.pose}
            self.scene.put("joints", name, fixed, joint.place)
        else:
            self.places[end] = rest
            self.frame(end, rest, self.links[end].place)
            self.merged.append(self.name_of(end))
        self.add_part(end)

    def carry(self, step: Step, start: LinkPlace, rest: LinkPlace) -> None:
        """Add a joint that moves, and the body that it carries: of a link whose origin is not at the joint a body with
        its origin there, in which the link is a frame."""
        edge, end = step.edge, step.end
        joint, key = edge.joint, edge.key
        offset = self.frames.between(end, key).position
        at_origin = not offset.any() or float(np.linalg.norm(offset)) <= _AT_ORIGIN * max(
            float(np.linalg.norm(self.frames.pose(node).position)) for node in (end, key)
        )
        body = self.body(end, "" if at_origin else "_body")
        self.places[end] = LinkPlace(body, np.eye(3), np.zeros(3) if at_origin else -offset)
        if not at_origin:
            self.frame(end, self.places[end], self.links[end].place)
            self.shifted.append(self.name_of(end))
        anchor = self.frames.between(step.start, key).position
        placed = rest if at_origin else LinkPlace(rest.body, rest.orientation, start.of(anchor).position)
        axes = axes_in_link(self.frames, edge, end)
        written = list(joint.axes)
        if step.is_reversed:
            axes, written = [-axis for axis in axes[::-1]], written[::-1]
        name = self.joint_names[key] = self.new_name("joint", key)
        self.scene.lines[f"joints.{name}"] = str(joint.place)
        kind = joint.type
        entry: dict[str, Any] = {"type": kind, "parent": placed.body, "child": body, **joint.entry}
        if kind == "universal" and not are_perpendicular(axes):
            self.carry_by_two(name, entry, placed, axes, written)
            return
        entry |= placed.pose
        if axes and JOINTS[kind].coordinates:
            entry["axis"] = axes[0].tolist()
        if kind == "universal":
            entry["second_axis"] = axes[1].tolist()
        if kind == "helical":
            entry["pitch"] = joint.pitch
        self.add_forces(name, joint, entry, written)
        self.scene.data["joints"][name] = entry
        if joint.around is not None:
            self.resist_turning(joint, joint.around, name)

    def carry_by_two(
        self, name: str, entry: dict[str, Any], placed: LinkPlace, axes: Sequence[Array], written: Sequence[Any]
    ) -> None:
        """Add two revolute joints with a massless body between them, for axes that are not perpendicular."""
        middle = self.scene.name("body", "", f"{name}_between")
        self.scene.data["bodies"][middle] = {"mass": 0.0}
        names, ends = (name, self.scene.name("joint", "", f"{name}_second")), (placed.body, middle, entry["child"])
        for joint, parent, child, axis, dynamics in zip(names, ends, ends[1:], axes, written, strict=False):
            part = {"type": "revolute", "parent": parent, "child": child, "axis": axis.tolist()}
            part |= placed.pose if joint == name else {}
            self.add_forces(joint, None, part, [dynamics])
            self.scene.data["joints"][joint] = part
        note = f"axes of {name} are not perpendicular: revolute joints {name} and {name}_second take its place [W0165]"
        self.scene.notes.append(note)

    def add_forces(self, name: str, joint: DraftJoint | None, entry: dict[str, Any], axes: Sequence[Any]) -> None:
        """Add springs and dampers, and friction and stops if asked for; note the omissions."""
        row = JOINTS["revolute" if joint is None else joint.type]
        unit, whole = row.units[0] if row.units else "", len(axes) == row.v_size
        if whole and len(axes) == 1:
            self.units[name] = unit
        entry |= forces_of(axes)
        friction = friction_of(axes, unit) if self.friction and whole else None
        if friction is not None:
            entry["friction"] = friction
        elif any(axis.friction for axis in axes):
            self.scene.left_out("dry friction", name)
        stops, turns_on = None, joint is not None and joint.written == "continuous"
        for axis in axes if self.limits and whole and not turns_on else ():
            if axis.lower > axis.upper:
                fault = f"the lower limit, {axis.lower:.9g}, is above the upper one, {axis.upper:.9g} {unit} [E1696]"
                self.scene.refuse(axis.place, f"joints.{name}.limit", fault, "the smaller number as lower")
            stops = stops_of(axes, unit)
        if stops is not None:
            entry["limits"] = stops
        self.leave_limits(axes, name, without=() if stops is None else ("position",))

    def leave_limits(self, axes: Sequence[Axis], name: str, ending: str = "", without: Collection[str] = ()) -> None:
        """Note limits that are left out."""
        limited = dict.fromkeys(word for axis in axes for word in axis.limited if word not in without)
        if limited:
            *most, last = limited
            words = f"{', '.join(most)} and {last}" if most else last
            self.scene.left_out(f"limits of {words}{ending}", name)

    def add_frames(self) -> None:
        """Add the frames of the file."""
        for path, model in self.world.every():
            for name, frame in model.frames.items():
                carrier = self.frames.link(path, name)
                within = self.frames.pose((path, name)).seen_from(self.frames.pose(carrier))
                place = self.places[carrier]
                self.frame((path, name), _of(place, within), frame.place)

    def close(self, edge: Edge) -> None:
        """Make a constraint of a joint that closes a loop."""
        joint, key = edge.joint, edge.key
        name = self.joint_names[key] = self.new_name("constraint", key)
        sides = [self.places[edge.parent], self.places[edge.child]]
        self.scene.lines[f"constraints.{name}"] = str(joint.place)
        if sides[0].body == sides[1].body:
            self.draft.leftovers.count("joints within one body")
            return
        kind = "fixed" if edge.is_fixed else joint.type
        axes = [] if edge.is_fixed else axes_in_world(self.frames, edge)
        if kind == "universal" and not are_perpendicular(axes):
            fault = f"the axes of {shown(joint.name)}, which closes a loop, are not perpendicular [E1941]"
            self.scene.refuse(joint.place, f"joints.{name}", fault, "another joint of the loop with must_be_loop_joint")
            return
        turned = loop_frame(kind, axes)
        ends = []
        for link, place in zip((edge.parent, edge.child), sides, strict=True):
            within = Pose(turned, self.frames.pose(key).position).seen_from(self.frames.pose(link))
            ends.append(_of(place, Pose(within.orientation, self.frames.between(link, key).position)))
        entry = self.scene.constrain(name, kind, ends)
        if kind == "helical":
            entry["pitch"] = joint.pitch
        self.forces_of_loop(joint, name, kind, [entry["first"], entry["second"]])

    def close_by_frames(self, loop: DraftLoop) -> None:
        """Make a constraint of a loop; of one whose ends are in one body a note if they meet, else a fault."""
        ends = [_of(self.places[(), link], pose_of(pose)) for link, pose in zip(loop.links, loop.poses, strict=True)]
        if ends[0].body != ends[1].body:
            self.scene.constrain(loop.name, loop.type, ends)
            self.scene.lines[f"constraints.{loop.name}"] = str(loop.place)
            return
        apart, angle = gap_of(loop.type, ends)
        if apart <= _MET * max(float(np.linalg.norm(end.position)) for end in ends) and angle <= _MET:
            note = f"the loop {loop.name} is left out: held joints make one body of its ends, which meet [W0272]"
            self.scene.notes.append(note)
            return
        fault = f"held joints make one body of the ends of {loop.name}, with a gap of {apart:.3g} m [E2207]"
        degrees = float(np.degrees(np.arcsin(min(1.0, angle))))
        fault += f" and turned by {degrees:.3g} degrees" if degrees > np.degrees(_MET) else ""
        self.scene.refuse(loop.place, f"constraints.{loop.name}", fault, "a joint of the loop that is not locked")

    def forces_of_loop(self, joint: DraftJoint, name: str, kind: str, frames: Sequence[Mapping[str, Any]]) -> None:
        """Add the damper of a joint that closes a loop as a bushing; refuse a spring."""
        title = shown(joint.name)
        if any(axis.stiffness or axis.mimic for axis in joint.axes):
            fault = f"the joint {title} closes a loop, so it has no coordinate for its spring or mimic [E1942]"
            self.scene.refuse(joint.place, f"joints.{name}", fault, "must_be_loop_joint for another joint of the loop")
        damping = joint.axes[0].damping if len(joint.axes) == 1 else 0.0
        if damping and kind in ("revolute", "prismatic"):
            along = "rotational_damping" if kind == "revolute" else "damping"
            bushing = {"first": dict(frames[0]), "second": dict(frames[1]), along: [0.0, 0.0, damping]}
            self.scene.add("bushings", "force", f"{name}_damper", bushing)
        elif any(axis.damping for axis in (*joint.axes, *([joint.around] if joint.around else ()))):
            fault = f"the damper of the {joint.written} joint {title}, which closes a loop, is not supported [E1943]"
            self.scene.refuse(joint.place, f"joints.{name}", fault, "must_be_loop_joint for another joint of the loop")
        if joint.around is not None:
            self.leave_dynamics(joint.around, name, "joints that close loops", damped=True)
        if any(axis.friction for axis in joint.axes):
            self.scene.left_out("dry friction", name)
        self.leave_limits(joint.axes, name, " of joints that close loops")

    def resist_turning(self, joint: DraftJoint, axis: Axis, name: str) -> None:
        """Add the damper of a joint without axes, equal in all directions; note its spring, friction and limits."""
        if axis.damping:
            for index in range(joint.components):
                effort = f"-{number(axis.damping)} * v.{name}[{index}]"
                entry = {"joint": name, "index": index, "effort": effort}
                self.scene.add("efforts", "effort", f"{name}_damper_{index}", entry)
        self.leave_dynamics(axis, name, f"{joint.written} joints", damped=True)

    def leave_dynamics(self, axis: Axis, name: str, kind: str, *, damped: bool = False) -> None:
        """Note the dynamics and limits of an axis that has no coordinate of its own."""
        parts = {"dampers": axis.damping and not damped, "springs": axis.stiffness}
        parts |= {"dry friction": axis.friction, "mimics": axis.mimic is not None}
        for part, present in parts.items():
            if present:
                self.scene.left_out(f"{part} of {kind}", name)
        self.leave_limits([axis], name, f" of {kind}")

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
            self.scene.data["shapes"] = shapes

    def visual_pose(self, node: Node, written: WrittenPose) -> Pose | None:
        """Return the pose of a visual in its link; None if it names a frame that is not there, which is noted."""
        if not written.relative_to:
            return pose_of(written)
        path, _ = node
        if not self.frames.check_frame(path, written.relative_to, written.place, ""):
            reason = f"there is no frame {shown(written.relative_to)}"
            self.draft.undrawn.setdefault(reason, []).append(self.name_of(node))
            return None
        return self.frames.between(node, (path, written.relative_to)) @ pose_of(written)


def _of(place: LinkPlace, inner: Pose) -> LinkPlace:
    """Return the place of a frame that is given in a link."""
    at = place.of(inner.position)
    return LinkPlace(at.body, snapped_rotation(place.orientation @ inner.orientation), at.position)
