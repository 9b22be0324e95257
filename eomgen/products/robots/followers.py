"""Joints that follow others: mimics, and gearboxes between two joints."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.base.arrays import Array
from eomgen.base.messages import nearest, shown
from eomgen.base.rounding import COMPUTED
from eomgen.products.robots.draft import DraftMimic
from eomgen.products.robots.frames import WORLD_NODE, Frames, Node
from eomgen.products.robots.joints import axes_in_link
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.products.robots.scene_draft import LinkPlace, SceneDraft, number
from eomgen.products.robots.tree import Edge, Step


class Followers:
    """Joints whose coordinates follow others: adds the key ``mimic`` and constraints to a scene.

    Parameters
    ----------
    draft : SceneDraft
        The scene, changed in place, with all joints.
    names, places : mappings
        Names of joints in the scene, and bodies of links, by path and key in the file.
    steps : list
        The joints of the tree; the ones that move can follow and lead.
    """

    def __init__(
        self,
        draft: SceneDraft,
        frames: Frames,
        names: dict[Node, str],
        places: dict[Node, LinkPlace],
        steps: list[Step],
    ) -> None:
        self.draft, self.frames, self.names, self.places = draft, frames, names, places
        self.moving = {step.edge.key: step for step in steps if not step.edge.is_fixed}
        self.following: set[str] = set()

    def add(self, gears: Sequence[Edge]) -> set[str]:
        """Let joints mimic others, and add gearboxes as constraints; return the names, in the scene, of joints that
        have a key ``mimic`` and so no coordinate of their own."""
        for step in self.moving.values():
            for index, axis in enumerate(step.edge.joint.axes):
                if axis.mimic is not None:
                    self.mimic(step, index, axis.mimic)
        for gear in gears:
            self.gear(gear)
        return self.following

    def coordinate(self, step: Step, index: int) -> str:
        """Return the formula of the coordinate of axis ``index`` of a joint, as ``q.elbow`` or ``q.wrist[1]``. A
        reversed joint has the axes in the opposite order."""
        name = self.names[step.edge.key]
        count = len(step.edge.joint.axes)
        if count == 1:
            return f"q.{name}"
        if self.draft.data["joints"][name]["type"] != "universal":  # two revolute joints in its place
            index = count - 1 - index if step.is_reversed else index
            return f"q.{name}" if index == 0 else f"q.{name}_second"
        return f"q.{name}[{count - 1 - index if step.is_reversed else index}]"

    def mimic(self, step: Step, index: int, mimic: DraftMimic) -> None:
        """Couple axis ``index`` of a joint with the axis of the leading joint that ``mimic`` names. Joints of one
        coordinate get the key ``mimic``, others an equation as constraint. A leader that is missing, does not move, or
        has no such axis is reported."""
        path, joint = step.edge.key
        there = self.frames.check_frame(path, mimic.joint, mimic.place, "")
        model, last = key = self.frames.node(path, mimic.joint) if there else (path, "")
        place_of_axis = {"axis": 0, "axis2": 1}.get(mimic.axis, -1)
        leader, fault, hint = self.moving.get(key), "", ""
        if last not in self.frames.models[model].joints:
            fault = f"there is no joint {shown(mimic.joint)} to mimic [E1688]"
            hint = nearest(mimic.joint, self.frames.models[path].joints)
        elif leader is None:
            fault = f"the joint {shown(mimic.joint)}, which {shown(joint)} mimics, has no coordinate of its own [E1944]"
            hint = "a joint that moves and closes no loop"
        elif not 0 <= place_of_axis < len(leader.edge.joint.axes):
            fault = f"the joint {shown(mimic.joint)} has no {shown(mimic.axis)} to mimic [E1945]"
            hint = "axis, or axis2 of a joint with two"
        if fault or leader is None:
            self.draft.refuse(mimic.place, f"joints.{self.names[step.edge.key]}", fault, hint)
            return
        offset = mimic.offset - mimic.multiplier * mimic.reference
        follower, leading = self.coordinate(step, index), self.coordinate(leader, place_of_axis)
        name, leader_name = follower.removeprefix("q."), leading.removeprefix("q.")
        if "[" not in follower + leading:
            entry = self.draft.data["joints"][name]
            entry["mimic"] = {"joint": leader_name, "multiplier": mimic.multiplier, "offset": offset}
            self.following.add(name)
            return
        equation = f"{follower} - ({number(mimic.multiplier)} * {leading} + {number(offset)})"
        self.constrain(f"{self.names[step.edge.key]}_mimic", equation, mimic.place)

    def constrain(self, name: str, equation: str, location: ElementPlace) -> None:
        """Add a constraint ``equation = 0`` between angles, with a name like ``name``; ``location`` is the line in the
        file."""
        entry = {"type": "formula", "equation": equation, "unit": "rad"}
        self.draft.put("constraints", self.draft.name("constraint", "", name), entry, location)

    def gear(self, edge: Edge) -> None:
        """Add the constraint of a gearbox: theta_2 = - ratio theta_1, of revolute joints along the axes between parent
        and child and its reference body. A missing body, or a missing joint, is reported."""
        joint, gear = edge.joint, edge.joint.gear
        path, name = edge.key
        assert gear is not None  # of edges of gearboxes alone
        reference = gear.reference or joint.parent
        if not self.frames.check_frame(path, reference, joint.place, "gearbox_reference_body"):
            return
        body = self.places[self.frames.link(path, reference)].body
        axes = axes_in_link(self.frames, edge, WORLD_NODE, unit=True)
        angles = []
        for link, axis in ((edge.parent, axes[0]), (edge.child, axes[1])):
            angle = self.angle(body, self.places[link].body, axis)
            if angle is None:
                end = "the world" if link == WORLD_NODE else shown(link[1])
                fault = (
                    f"no revolute joint along the axis of the gearbox {shown(name)} connects {end} with"
                    f" {shown(gear.reference)} [E1946]"
                )
                self.draft.refuse(joint.place, f"joints.{name}", fault, "a revolute joint with a parallel axis")
                return
            angles.append(angle)
        self.constrain(name, f"{angles[1]} + {number(gear.ratio)} * ({angles[0]})", joint.place)

    def angle(self, reference: str, body: str, axis: Array) -> str | None:
        """Return the formula, with sign, of the angle of a body against the body ``reference`` about an axis (3,) in
        the world; None without a revolute joint between both bodies along the axis."""
        for step in self.moving.values():
            joint = step.edge.joint
            ends = self.places[step.edge.parent].body, self.places[step.edge.child].body
            if joint.type != "revolute" or ends not in ((reference, body), (body, reference)):
                continue
            along = float(axes_in_link(self.frames, step.edge, WORLD_NODE, unit=True)[0] @ axis)
            if abs(along) < 1.0 - COMPUTED:
                continue
            negative = (along < 0.0) != (ends == (body, reference))
            return f"{'-' if negative else ''}{self.coordinate(step, 0)}"
        return None
