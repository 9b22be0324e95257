"""Frames of drafts: poses in named frames, and links that carry frames.

Poses are of the file's configuration, in which all coordinates are zero. A name may lead into a model: ``arm::hand``.
Semantics of frames and poses: http://sdformat.org/tutorials?tut=pose_frame_semantics.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import listed, nearest, shown
from eomgen.products.robots.draft import MODEL_FRAME, WORLD_FRAME, DraftModel, WrittenPose
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.scene.reading.report import Report
from eomgen.scene.rotations import snapped_rotation

#: Path of a model from the world, and a name in it.
Node = tuple[tuple[str, ...], str]
#: Carrier of frames that no link carries.
WORLD_NODE: Node = ((), WORLD_FRAME)
#: A coordinate below this part of the lengths that it is the difference of is zero.
_ROUNDING = 8.0 * float(np.finfo(float).eps)


@dataclass(frozen=True)
class Pose:
    """Orientation (3, 3) and position (3,) of a frame in another."""

    orientation: Array
    position: Array

    def __matmul__(self, inner: Pose) -> Pose:
        """Return the pose of a frame that is given in this one."""
        return Pose(self.orientation @ inner.orientation, self.orientation @ inner.position + self.position)

    def seen_from(self, frame: Pose) -> Pose:
        """Return the pose in another frame; both poses are given in the same third frame. Rounding errors of position
        become zero, and rotations near right angles exact."""
        turned = frame.orientation.T
        size = _ROUNDING * float(np.max(np.abs(self.position) + np.abs(frame.position)))
        position = turned @ (self.position - frame.position)
        position[np.abs(position) <= size] = 0.0
        return Pose(snapped_rotation(turned @ self.orientation), position + 0.0)


IDENTITY = Pose(np.eye(3), np.zeros(3))


class Frames:
    """Poses of all frames of a file, and the links that carry them. A node is the path of a model (keys of models from
    the world) and the key of a link, joint, frame or model in it. Faults of frames go to ``report``, each once."""

    def __init__(self, world: DraftModel, report: Report) -> None:
        self.world, self.report = world, report
        self.models = dict(world.every())
        self._bases: dict[Node, tuple[Node, Pose]] = {}
        self._refused: set[tuple[ElementPlace, str]] = set()

    def resolve(self) -> None:
        """Find the frame in which each frame is given, and the links that carry frames; report frames that are missing,
        and circles."""
        for path, model in reversed(self.models.items()):  # of inner models first, whose frames place them
            for name in model.names:
                if name not in model.merged:
                    self._bases[path, name] = self._base(path, name)
        for node in self._bases:
            self._way(node)
        for path, model in self.models.items():
            for name in [*model.frames, *([MODEL_FRAME] if path else [])]:
                self.link(path, name)

    def node(self, path: tuple[str, ...], name: str) -> Node:
        """Return the node that a name means in the model at ``path``; ``arm::hand`` leads into the model ``arm``. The
        own frame of a model is its node in the model around it."""
        *outer, last = name.split("::")
        path = (*path, *outer)
        while last in self.models[path].merged:
            path = (*path, self.models[path].merged[last])
        if last == WORLD_FRAME:
            return WORLD_NODE
        if last == MODEL_FRAME and path:  # of a model its place in the model around it
            return path[:-1], path[-1]
        return path, last

    def pose(self, node: Node) -> Pose:
        """Return the pose of a frame in the world."""
        return self.between(WORLD_NODE, node)

    def between(self, start: Node, end: Node) -> Pose:
        """Return the pose of the frame ``end`` in the frame ``start``, along the frames in which both are given; the
        common part of both ways to the world is left out, so that rounding cancels."""
        lower, upper = self._way(start), self._way(end)
        while lower and upper and lower[-1] == upper[-1]:
            del lower[-1], upper[-1]
        first, second = self._along(lower), self._along(upper)
        return second.seen_from(first) if lower else second

    def _along(self, way: Sequence[Node]) -> Pose:
        result = IDENTITY
        for _, pose in map(self._bases.__getitem__, way):
            result = pose @ result if result is not IDENTITY else pose
        return result

    def _way(self, node: Node, end: Node = WORLD_NODE) -> list[Node]:
        """Return the frames from one to another around it, without this other one, each given in the next one."""
        ends = end, WORLD_NODE
        *way, _ = self._follow("relative_to", self.node(*node), lambda x: None if x in ends else self._bases[x][0])
        return way

    def _follow(self, attribute: str, node: Node, successor: Callable[[Node], Node | None]) -> list[Node]:
        """Return a node and all that follow, to one without a successor. A circle, of names in ``attribute``, is
        reported and leads to the world."""
        passed: dict[Node, None] = {}
        while node not in passed:
            passed[node] = None
            after = successor(node)
            if after is None:
                return list(passed)
            node = after
        path, first = node
        owner, way = self.models[path], list(passed)
        parts = (owner.frames, owner.joints, owner.links, owner.models)
        location = next(part[first].place for part in parts if first in part)
        names = listed([name for _, name in (*way[way.index(node) :], node)])
        fault = f"{attribute}: the frames name one another in a circle: {names} [E1724]"
        self._refuse(location, attribute, fault, "another one")
        return [*way, WORLD_NODE]

    def _base(self, path: tuple[str, ...], name: str) -> tuple[Node, Pose]:
        """Return the node in which a frame is given, and the frame's pose there; the world for a missing frame, which
        is reported. For a model with a placement frame the pose is the model's, such that this frame is at the given
        place."""
        model = self.models[path]
        origin = MODEL_FRAME if path else WORLD_FRAME
        if name in model.frames:
            frame = model.frames[name]
            base, written = frame.attached_to or origin, frame.pose
        elif name in model.joints:
            base, written = model.joints[name].child, model.joints[name].pose
        else:
            base = origin
            written = model.links[name].pose if name in model.links else model.models[name].pose
        named = written.relative_to or base
        result = Pose(written.orientation, written.position)
        inner = model.models.get(name)
        if inner is not None and inner.placement:
            inside = (*path, name)
            if self.check_frame(inside, inner.placement, inner.place, "placement_frame"):
                way = self._way(self.node(inside, inner.placement), (path, name))
                result @= IDENTITY.seen_from(self._along(way))
        if not self.check_frame(path, named, written.place, "relative_to" if written.relative_to else ""):
            return WORLD_NODE, result
        return self.node(path, named), result

    def check_frame(self, path: tuple[str, ...], name: str, location: ElementPlace, attribute: str) -> bool:
        """Return whether a name means a frame, seen from the model at ``path``; report a missing one. `attribute` is
        the attribute with the name, for the message; without one no fault is reported. `location` is the place in the
        file. The world counts outside of models, and as ``parent`` of a joint."""
        *outer, last = name.split("::")
        here = (*path, *outer)
        model = self.models.get(here)
        world_here = last == WORLD_FRAME and not outer and (not path or attribute == "parent")
        if model is not None and (model.has(last) or (last == MODEL_FRAME and here) or world_here):
            return True
        if attribute and (location, name) not in self._refused:
            fault = f"{attribute}: there is no frame {shown(name)} in {self._label(path)} [E1721]"
            self._refuse(location, name, fault, nearest(name, self.models[path].names))
        return False

    def _label(self, path: Sequence[str]) -> str:
        return f"the model {shown('::'.join(path))}" if path else "the world"

    def link(self, path: tuple[str, ...], name: str) -> Node:
        """Return the node of the link that carries a frame, by name in the model at ``path``; the world if no link
        does, or if the frames are attached in a circle, which is reported. The name must exist."""
        return self._follow("attached_to", self.node(path, name), self._carrier)[-1]

    def _carrier(self, node: Node) -> Node | None:
        """Return the node to which a joint, frame or model is attached; None for a link or the world. For a joint this
        is the child, for a model the canonical link; the world for a fault, which is reported."""
        path, name = node
        model = self.models[path]
        if node == WORLD_NODE or name in model.links:
            return None
        if name in model.models:
            return self._canonical((*path, name))
        if name in model.joints:
            attribute, carrier, location = "child", model.joints[name].child, model.joints[name].place
        else:
            attribute, carrier, location = "attached_to", model.frames[name].attached_to, model.frames[name].place
            carrier = carrier or (MODEL_FRAME if path else WORLD_FRAME)
        return self.node(path, carrier) if self.check_frame(path, carrier, location, attribute) else WORLD_NODE

    def _canonical(self, path: tuple[str, ...]) -> Node:
        """Return the link to which the frame of a model is attached: the named canonical link, or the first link, also
        of inner models. The world without a link, or for a missing canonical link, which is reported."""
        model = self.models[path]
        if model.canonical:
            *outer, last = model.canonical.split("::")
            there = self.models.get((*path, *outer))
            if there is not None and last in there.merged:
                outer, there = [*outer, there.merged[last]], there.models[there.merged[last]]
            if there is not None and last in there.links:
                return (*path, *outer), last
            fault = f"canonical_link: there is no link {shown(model.canonical)} in {self._label(path)} [E1723]"
            self._refuse(model.place, model.canonical, fault, nearest(model.canonical, model.links))
            return WORLD_NODE
        if model.links:
            return path, next(iter(model.links))
        for name in model.models:
            carrier = self._canonical((*path, name))
            if carrier != WORLD_NODE:
                return carrier
        return WORLD_NODE

    def _refuse(self, location: ElementPlace, about: str, fault: str, hint: str) -> None:
        if (location, about) not in self._refused:
            self._refused.add((location, about))
            self.report.add_place(location.file, location.line, "", fault, hint)


def pose_of(written: WrittenPose) -> Pose:
    """Return the numbers of a pose."""
    return Pose(written.orientation, written.position)
