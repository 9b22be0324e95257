"""Conversion of a draft to a scene: fixed joints are merged, loops become exact constraints, links that no joint holds
are free."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import legal_name, listed, nearest, shown
from eomgen.base.rounding import SUMMED, WRITTEN
from eomgen.formula.words import RESERVED
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
    displacement,
    forces_of,
    friction_of,
    gap_of,
    loop_frame,
    stops_of,
)
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.products.robots.scene_draft import LinkPlace, SceneDraft, body_entry, number, tunable_body, turns_of
from eomgen.products.robots.tree import Edge, Step, Walks, tree_of
from eomgen.products.robots.visuals import LEFT_OUT
from eomgen.scene.inertia import Inertia, combine_inertias, impossible
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.rotations import quaternion_of_matrix, snapped_rotation
from eomgen.scene.sources.source import ConvertedScene, OptionError
from eomgen.system.description import BASE, WORLD

#: Unit of an effort by the unit of the coordinate.
_EFFORT_UNITS = {"rad": "N m", "m": "N"}
_RESERVED = {BASE: "the frame that carries the tree", WORLD: "the frame at rest while the base moves"}


def joints_to_hold(lock: Sequence[str], joints: Mapping[str, Any], file: str) -> list[str]:
    """Return the names in ``lock`` (one name or several) as a list. `joints` has the names of all joints in the file;
    only the keys are used. Raises OptionError, with the nearest name as a hint, for a name that is not a key of
    `joints`; `file` is named in the message."""
    names = [lock] if isinstance(lock, str) else list(lock)
    for name in names:
        if name not in joints:
            raise OptionError("lock", f"{file} has no joint {shown(name)} to lock [E1938]", nearest(name, joints))
    return names


class Conversion:
    """Converts a draft (models as read from a URDF, SDF or MJCF file) to the sections of a scene file.

    Callers call ``connect``, ``convert`` and ``result`` in this order. Faults of the file go to ``scene.report``.

    Parameters
    ----------
    draft : Draft
        Links, joints, frames and models as read.
    scene : SceneDraft
        The scene to fill, without its sections: ``data``, notes and warnings are changed in place.
    limits, friction : bool
        Take limits of position as stops, and dry friction; otherwise a note lists them as left out.
    """

    def __init__(self, draft: Draft, scene: SceneDraft, *, limits: bool, friction: bool) -> None:
        """Set format, name and gravity of the scene, and reserve the legal names of the file for links, frames and
        joints."""
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
        for path, model in self.world.every():
            self.scene.keep("body", [self.name_of((path, name)) for name in (*model.links, *model.frames)])
            for kind in ("joint", "constraint"):
                self.scene.keep(kind, [self.name_of((path, name)) for name in model.joints])

    def name_of(self, node: Node) -> str:
        """Return the full name of a link, frame or joint: names of the models around it, joined by ``::``, then the
        name of the element. The name of the file's only model, and of models that are merged into others, are left
        out."""
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
        """Resolve all frames, and list the joints as edges between the links that carry their parent and child frames.

        Links of static models count as the world. Faults of frames are collected and raised together at the end.

        Parameters
        ----------
        held : mapping
            Coordinates, rad or m, of the joints that do not move, by path of the model and key of the joint.
        weld : sequence
            Names of links or frames that are fixed to the world at their places.

        Raises
        ------
        DescriptionError
            For frames that are missing or that name one another in a circle.
        OptionError
            For a name in ``weld`` that the file lacks.
        """
        for path, model in self.world.every():
            static = any(self.frames.models[path[:depth]].static for depth in range(1, len(path) + 1))
            for name, link in model.links.items():
                self.links[path, name] = link
                if static:
                    self.static[path, name] = None
        self.frames.resolve()
        for path, model in self.world.every():
            for name, joint in model.joints.items():
                self.add_edge((path, name), joint, held)
        for written in weld:
            self.edges.append(self.weld(written))
        self.scene.report.raise_problems()

    def add_edge(self, key: Node, joint: DraftJoint, held: Mapping[Node, float]) -> None:
        """Append the edge of a joint to ``edges``; `held` has coordinates of joints that do not move. No edge is added
        if the parent or child frame is missing (reported), if both ends rest in the world (counted as without effect),
        or if both are the same link (reported)."""
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
        """Return the edge of a new fixed joint between the world and the link that carries the frame ``written``.
        Raises OptionError for a name that is the world or that the file lacks."""
        path = (self.only,) if self.only else ()
        location = ElementPlace(self.file, 1)
        if not self.frames.check_frame(path, written, location, "") or written == WORLD_FRAME:
            every = [self.name_of((path, name)) for path, model in self.world.every() for name in model.names]
            fault = f"{self.file} has no link or frame {shown(written)} [E1940]"
            raise OptionError("weld", fault, nearest(written, every))
        link = self.frames.link(path, written)
        joint = DraftJoint(f"{written}_weld", location, WrittenPose(location), "fixed", "fixed", WORLD_FRAME, link[1])
        return Edge((path, joint.name), joint, WORLD_NODE, link, None)

    def convert(self, *, actuated: bool) -> None:
        """Fill the sections of the scene: bodies, joints, frames, constraints, efforts, inputs and shapes. With
        ``actuated`` each joint of one coordinate has an effort as input, unless the joint follows another or has an
        effort already. Raises DescriptionError for all problems reported so far, and OptionError for a tunable link on
        the base."""
        moving = [link for link in self.links if link not in self.static]
        roots = {link: self.frames.link(link[0][:1], MODEL_FRAME) if link[0] else link for link in moving}
        gears = [edge for edge in self.edges if edge.joint.gear is not None]
        walks, loops = tree_of(moving, [edge for edge in self.edges if edge.joint.gear is None], roots)
        self.place_links(walks, loops)
        self.add_masses()
        self.scene.report.raise_problems()
        steps = [step for walk in walks.values() for step in walk]
        following = Followers(self.scene, self.frames, self.joint_names, self.places, steps).add(gears)
        for gear in gears:
            self.leave_dynamics(gear.joint.axes, self.name_of(gear.key), " of gearboxes")
        driven = following | {entry["joint"] for entry in self.scene.data.get("efforts", {}).values()}
        for joint, unit in self.units.items() if actuated else ():
            if unit in _EFFORT_UNITS and joint not in driven:
                inputs, efforts = self.scene.section("inputs"), self.scene.section("efforts")
                name = f"{joint}_effort" if joint in RESERVED | inputs.keys() else joint
                inputs[name] = {"unit": _EFFORT_UNITS[unit], "description": f"effort of joint {joint}"}
                efforts[legal_name(joint, efforts)] = {"joint": joint, "effort": name}
        self.add_shapes()
        if not self.scene.data["frames"]:
            del self.scene.data["frames"]

    def result(self, *, strict: bool) -> ConvertedScene:
        """Return the converted scene with all notes, warnings last.

        Raises
        ------
        DescriptionError
            For problems reported so far; of a ``strict`` conversion also for each omission.
        """
        draft, scene = self.draft, self.scene
        omissions = [*scene.all_warnings(), *draft.leftovers.warnings()]
        if strict:
            for location, note in omissions:
                scene.refuse(location, "", note, "no --strict (strict=False), to go on without")
        scene.report.raise_problems()
        undrawn = []
        for (note, reason), links in draft.undrawn.items():
            names = dict.fromkeys(links)
            undrawn.append(f"{note} ({len(names)}: {listed(names)}): {reason}")
        said = [*draft.notes, *scene.notes, *self.notes(), *draft.leftovers.notes(), *undrawn]
        said += [note for _, note in omissions]
        return ConvertedScene(scene.data, scene.lines, said, inertias_checked=True)

    def notes(self) -> list[str]:
        """Return notes, of none to three texts: links that move freely, links merged into the bodies to which they are
        fixed, and links whose joints are not at their origins."""
        notes = []
        if self.free and not self.draft.root:
            names = listed(self.free)
            note = f"no joint holds these links, so they move freely: {names}"
            notes.append(f"{note}; weld={self.free[:1]!r} fixes one [W0167]")
        if self.merged:
            notes.append(f"links merged into the bodies that carry them, as frames: {listed(self.merged)} [W0180]")
        if self.shifted:
            note = "links whose joints are not at their origins are frames of bodies NAME_body"
            notes.append(f"{note}: {listed(self.shifted)} [W0170]")
        return notes

    def place_links(self, walks: Walks, loops: Sequence[Edge]) -> None:
        """Add bodies, joints and frames for all links along the walks of the tree, then constraints for joints that
        close loops."""
        for link in self.static:
            self.rest(link)
        for start, steps in walks.items():
            if start != WORLD_NODE:
                self.free_link(start)
            for step in steps:
                self.step(step)
        self.add_frames()
        for edge in loops:
            self.close(edge)
        for loop in self.draft.loops:
            self.close_by_frames(loop)

    def add_masses(self) -> None:
        """Set mass, centre of mass and inertia of each body to the sum over the links merged into this body. A tunable
        link keeps the body alone, with ten parameters; all other links of this body become a second, fixed body. Masses
        on the base become a body only in an included file."""
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
        """Record the mass properties of a placed link for the body; add a force against gravity for a link that gravity
        does not pull. An impossible inertia is noted. Raises OptionError for a tunable link on the base."""
        link, pose = self.links[node], self.places[node]
        self.parts.setdefault(pose.body, {})[node] = link.inertia.transform(pose.orientation, pose.position)
        if pose.body == BASE and node[1] in self.draft.tunable:
            fault = f"the link {link.name} is fixed to the base, so its mass and inertia have no effect [E1975]"
            raise OptionError("tunable", fault, "a link that a joint moves")
        fault = impossible(float(link.inertia.mass), link.inertia.about_center)
        if fault:
            self.scene.leave_out(link.place, f"link {self.name_of(node)}: {fault}")
        gravity = np.array(self.scene.data.get("gravity", (0.0, 0.0, -9.81)))
        if not link.pulled and link.inertia.mass and gravity.any() and pose.body != BASE:
            at = pose.of(np.array(link.inertia.center))
            force = {"body": at.body, "point": at.position.tolist(), "force": (-link.inertia.mass * gravity).tolist()}
            self.scene.add("forces", "force", f"no_gravity_{self.legal(node)}", force)

    def legal(self, node: Node) -> str:
        """Return the name in the scene that a link, frame or joint would like to have, which may be taken. `::` becomes
        `__`, and links named like the base or the world get the ending `_link`; names of a draft that is legal stay."""
        name = self.name_of(node)
        if self.draft.legal:
            return name
        name = name.replace("::", "__")
        return f"{name}_link" if name in (BASE, WORLD) else name

    def new_name(self, kind: str, node: Node, ending: str = "") -> str:
        """Return a unique legal name for a link, frame or joint, and take it; `kind` is the kind of element in the
        scene. `ending` is appended to the name. Names of a draft that is legal are returned unchanged and not taken."""
        if self.draft.legal:
            return self.name_of(node)
        return self.scene.name(kind, self.legal(node) + ending, "", joined=bool(ending) or "::" in self.name_of(node))

    def body(self, node: Node, ending: str = "") -> str:
        """Add a body without mass for a link, and return the name of the body; `ending` is appended to the link's
        name."""
        link = self.links[node]
        name = self.new_name("body", node, ending)
        if name in _RESERVED:
            name = legal_name(f"{link.name}_link", [robot_link.name for robot_link in self.links.values()])
            note = f"the link {link.name} is the body {name}, because {link.name} is the name of"
            self.scene.notes.append(f"{note} {_RESERVED[link.name]} [W0179]")
        self.scene.put("bodies", name, {"mass": 0.0}, link.place)
        return name

    def frame(self, node: Node, placement: LinkPlace, line: ElementPlace) -> None:
        """Add a frame to the scene, named by a link or frame `node` of the file, at a place in a body; `line` is its
        place in the file."""
        self.scene.put("frames", self.new_name("body", node), {"body": placement.body, **placement.pose}, line)

    def rest(self, link: Node) -> None:
        """Place a link of a static model on the base, as a frame of the scene without a body or mass."""
        pose = self.frames.pose(link)
        self.places[link] = LinkPlace(BASE, pose.orientation, pose.position)
        self.frame(link, self.places[link], self.links[link].place)

    def free_link(self, link: Node) -> None:
        """Add a body for a link that no joint holds, on a joint to the base that starts at the link's pose in the file.
        The joint is free, or has the draft's type and name for the root link."""
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
        """Place the link at the end of a step of the tree: as a new body on a moving joint, else merged into the
        previous body. A link on a fixed or held joint becomes a frame of that body, but a kept or tunable one a body on
        a fixed joint."""
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
        """Add a joint that moves, with forces, and the body that it carries. ``start`` is the place of the link from
        which the step starts, ``rest`` the place of the carried link at the zero coordinate, in the body of ``start``.
        A link whose origin is not at the joint gets a body NAME_body with the origin at the joint, in which the link is
        a frame. A universal joint with axes that are not perpendicular becomes two revolute joints."""
        edge, end = step.edge, step.end
        joint, key = edge.joint, edge.key
        offset = self.frames.between(end, key).position
        lengths = [float(np.linalg.norm(self.frames.pose(node).position)) for node in (end, key)]
        at_origin = not offset.any() or float(np.linalg.norm(offset)) <= SUMMED * max(lengths)
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
        entry: dict[str, Any] = {"type": kind, "parent": placed.body, "child": body, **joint.entry, **placed.pose}
        if kind == "universal" and not are_perpendicular(axes):
            self.carry_by_two(name, entry, axes, written)
            return
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

    def carry_by_two(self, name: str, entry: dict[str, Any], axes: Sequence[Array], written: Sequence[Any]) -> None:
        """Add two revolute joints with a massless body between them, for a universal joint whose axes are not
        perpendicular. `entry` has both bodies and the pose of the joint in the parent body, `axes` two vectors (3,) in
        the child, and `written` the axes of the file with springs and dampers."""
        middle = self.scene.name("body", "", f"{name}_between")
        self.scene.data["bodies"][middle] = {"mass": 0.0}
        names, ends = (name, self.scene.name("joint", "", f"{name}_second")), (entry["parent"], middle, entry["child"])
        for joint, parent, child, axis, dynamics in zip(names, ends, ends[1:], axes, written, strict=False):
            part = {"type": "revolute", "parent": parent, "child": child, "axis": axis.tolist()}
            part |= {key: entry[key] for key in ("position", "orientation")} if joint == name else {}
            self.add_forces(joint, None, part, [dynamics])
            self.scene.data["joints"][joint] = part
        note = f"axes of {name} are not perpendicular: revolute joints {name} and {name}_second take its place [W0165]"
        self.scene.notes.append(note)

    def add_forces(self, name: str, joint: DraftJoint | None, entry: dict[str, Any], axes: Sequence[Any]) -> None:
        """Add springs and dampers to a joint's entry, and dry friction and stops if the conversion takes them.

        Changes `entry` in place, and notes friction and limits that are left out. Faulty limits are reported. `joint`
        is None for one of the two revolute joints that replace a universal joint; `axes` are in the order of the scene.
        """
        row = JOINTS["revolute" if joint is None else joint.type]
        unit, whole = row.units[0] if row.units else "", len(axes) == row.v_size
        if whole and len(axes) == 1:
            self.units[name] = unit
        entry |= forces_of(axes)
        friction = friction_of(axes, unit) if self.friction and whole else None
        if friction is not None:
            entry["friction"] = friction
        stops, turns_on = None, joint is not None and joint.written == "continuous"
        for axis in axes if self.limits and whole and not turns_on else ():
            if axis.lower > axis.upper:
                fault = f"the lower limit, {axis.lower:.9g}, is above the upper one, {axis.upper:.9g} {unit} [E1696]"
                self.scene.refuse(axis.place, f"joints.{name}.limit", fault, "the smaller number as lower")
            stops = stops_of(axes, unit)
        if stops is not None:
            entry["limits"] = stops
        taken = {"dampers": True, "springs": True, "mimics": True, "dry friction": friction, "position": stops}
        self.leave_dynamics(axes, name, taken=[part for part, there in taken.items() if there])

    def leave_dynamics(self, axes: Sequence[Axis], name: str, ending: str = "", taken: Collection[str] = ()) -> None:
        """Note as left out the dampers, springs, dry friction, mimics and limited quantities of the axes of a joint,
        but for the ones in ``taken``. ``name`` is the joint in the scene; ``ending`` is appended to the parts in the
        note, as " of gearboxes"."""
        parts = {
            "dampers": any(axis.damping for axis in axes),
            "springs": any(axis.stiffness for axis in axes),
            "dry friction": any(axis.friction for axis in axes),
            "mimics": any(axis.mimic is not None for axis in axes),
        }
        left = [part for part, present in parts.items() if present and part not in taken]
        limited = dict.fromkeys(word for axis in axes for word in axis.limited if word not in taken)
        if limited:
            *most, last = limited
            left.append(f"limits of {', '.join(most)} and {last}" if most else f"limits of {last}")
        for part in left:
            self.scene.left_out(f"{part}{ending}", name)

    def add_frames(self) -> None:
        """Add the frames of all models of the file to the scene, each in the body of the link that carries the
        frame."""
        for path, model in self.world.every():
            for name, frame in model.frames.items():
                carrier = self.frames.link(path, name)
                within = self.frames.pose((path, name)).seen_from(self.frames.pose(carrier))
                self.frame((path, name), _of(self.places[carrier], within), frame.place)

    def close(self, edge: Edge) -> None:
        """Make a constraint, with the forces of the joint, of a joint that closes a loop. A joint within one body is
        counted as without effect; a universal joint whose axes are not perpendicular is refused."""
        joint, key = edge.joint, edge.key
        name = self.joint_names[key] = self.new_name("constraint", key)
        sides = [self.places[edge.parent], self.places[edge.child]]
        self.scene.lines[f"constraints.{name}"] = str(joint.place)
        if sides[0].body == sides[1].body:
            self.draft.leftovers.count("joints within one body")
            return
        kind = "fixed" if edge.is_fixed else joint.type
        axes = [] if edge.is_fixed else axes_in_link(self.frames, edge, WORLD_NODE, unit=True)
        if kind == "universal" and not are_perpendicular(axes):
            fault = f"the axes of {shown(joint.name)}, which closes a loop, are not perpendicular [E1941]"
            self.scene.refuse(joint.place, f"joints.{name}", fault, "another joint of the loop with must_be_loop_joint")
            return
        turned = loop_frame(kind, axes)
        ends = []
        for link, placement in zip((edge.parent, edge.child), sides, strict=True):
            within = Pose(turned, self.frames.pose(key).position).seen_from(self.frames.pose(link))
            ends.append(_of(placement, Pose(within.orientation, self.frames.between(link, key).position)))
        entry = self.scene.constrain(name, kind, ends)
        if kind == "helical":
            entry["pitch"] = joint.pitch
        self.forces_of_loop(joint, name, kind, [entry["first"], entry["second"]])

    def close_by_frames(self, loop: DraftLoop) -> None:
        """Make a constraint of a loop that is given by a frame in each of two links. If both links are in one body: a
        note if the two frames meet to 1e-6 (relative, and in rad), else a reported fault."""
        ends = [_of(self.places[(), link], pose_of(pose)) for link, pose in zip(loop.links, loop.poses, strict=True)]
        if ends[0].body != ends[1].body:
            self.scene.constrain(loop.name, loop.type, ends)
            self.scene.lines[f"constraints.{loop.name}"] = str(loop.place)
            return
        apart, angle = gap_of(loop.type, ends)
        if apart <= WRITTEN * max(float(np.linalg.norm(end.position)) for end in ends) and angle <= WRITTEN:
            note = f"the loop {loop.name} is left out: held joints make one body of its ends, which meet [W0272]"
            self.scene.notes.append(note)
            return
        degrees = float(np.degrees(np.arcsin(min(1.0, angle))))
        turn = f" and turned by {degrees:.3g} degrees" if degrees > np.degrees(WRITTEN) else ""
        fault = f"held joints make one body of the ends of {loop.name}, with a gap of {apart:.3g} m{turn} [E2207]"
        self.scene.refuse(loop.place, f"constraints.{loop.name}", fault, "a joint of the loop that is not locked")

    def forces_of_loop(self, joint: DraftJoint, name: str, kind: str, frames: Sequence[Mapping[str, Any]]) -> None:
        """Add the damper of a joint that closes a loop, as a bushing between the frames of the constraint. Springs,
        mimics and dampers of joints other than revolute and prismatic ones are refused; friction and limits are noted
        as left out. `name` and `kind` are of the constraint, `frames` two ends as entries."""
        title = shown(joint.name)
        if any(axis.stiffness or axis.mimic for axis in joint.axes):
            fault = f"the joint {title} closes a loop, so it has no coordinate for its spring or mimic [E1942]"
            self.scene.refuse(joint.place, f"joints.{name}", fault, "must_be_loop_joint for another joint of the loop")
        axes = [*joint.axes, *([joint.around] if joint.around else ())]
        damping = joint.axes[0].damping if len(joint.axes) == 1 else 0.0
        if damping and kind in ("revolute", "prismatic"):
            along = "rotational_damping" if kind == "revolute" else "damping"
            bushing = {"first": dict(frames[0]), "second": dict(frames[1]), along: [0.0, 0.0, damping]}
            self.scene.add("bushings", "force", f"{name}_damper", bushing)
        elif any(axis.damping for axis in axes):
            fault = f"the damper of the {joint.written} joint {title}, which closes a loop, is not supported [E1943]"
            self.scene.refuse(joint.place, f"joints.{name}", fault, "must_be_loop_joint for another joint of the loop")
        self.leave_dynamics(axes, name, " of joints that close loops", taken=("dampers",))

    def resist_turning(self, joint: DraftJoint, axis: Axis, name: str) -> None:
        """Add a damper to each velocity component of a joint without axes, such as a ball joint; note spring, friction
        and limits, which are left out. `axis` has the dynamics, `name` is the joint in the scene."""
        if axis.damping:
            for index in range(joint.components):
                effort = f"-{number(axis.damping)} * v.{name}[{index}]"
                entry = {"joint": name, "index": index, "effort": effort}
                self.scene.add("efforts", "effort", f"{name}_damper_{index}", entry)
        self.leave_dynamics([axis], name, f" of {joint.written} joints", taken=("dampers",))

    def add_shapes(self) -> None:
        """Add the section ``shapes`` with the visuals of all links, posed in bodies and named by the links; none
        without visuals."""
        shapes: dict[str, dict[str, Any]] = {}
        for node, link in self.links.items():
            placement = self.places[node]
            for visual in link.visuals:
                inner = self.visual_pose(node, visual.pose)
                if inner is None:
                    continue
                at = _of(placement, inner)
                placed = {"body": at.body, "position": at.position.tolist(), "rotation": turns_of(at.orientation)}
                shapes[legal_name(self.legal(node), shapes)] = {**visual.entry, **placed}
        if shapes:
            self.scene.data["shapes"] = shapes

    def visual_pose(self, node: Node, written: WrittenPose) -> Pose | None:
        """Return the pose of a visual in the link ``node``, given in the link or in the frame ``relative_to``. Returns
        None if this frame is not there, and then lists the link among the visuals that are not drawn."""
        if not written.relative_to:
            return pose_of(written)
        path, _ = node
        if not self.frames.check_frame(path, written.relative_to, written.place, ""):
            reason = f"there is no frame {shown(written.relative_to)}"
            self.draft.undrawn.setdefault((LEFT_OUT, reason), []).append(self.name_of(node))
            return None
        return self.frames.between(node, (path, written.relative_to)) @ pose_of(written)


def _of(placement: LinkPlace, inner: Pose) -> LinkPlace:
    """Return the place of a frame with pose ``inner`` in the frame at ``placement``; rotations near right angles become
    exact."""
    at = placement.of(inner.position)
    return LinkPlace(at.body, snapped_rotation(placement.orientation @ inner.orientation), at.position)
