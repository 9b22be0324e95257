"""Frames of drafts: poses in the frames that they name, and links that carry frames.

Poses are of the file's configuration, in which all coordinates are zero. A name may lead into a model: ``arm::hand``.
Semantics of frames and poses: http://sdformat.org/tutorials?tut=pose_frame_semantics.
"""

from __future__ import annotations

from collections.abc import Sequence

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
        return Pose(
            snapped_rotation(turned @ self.orientation), np.where(np.abs(position) <= size, 0.0, position) + 0.0
        )


IDENTITY = Pose(np.eye(3), np.zeros(3))


class Frames:
    """Poses of all frames of a file, and the links that carry them. A node is the path of a model (keys of models from
    the world) and the key of a link, joint, frame or model in it. Faults of frames go to ``report``, each once."""

    def __init__(self, world: DraftModel, report: Report) -> None:
        self.world, self.report = world, report
        self.models = dict(world.every())
        self._bases: dict[Node, tuple[Node, Pose]] = {}
        self._resolved_to_world: set[Node] = set()
        self._links: dict[Node, Node] = {}
        self._waiting: list[tuple[str, Node]] = []
        self._refused: set[tuple[ElementPlace, str]] = set()

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
        common = 0
        while common < min(len(lower), len(upper)) and lower[-1 - common][0] == upper[-1 - common][0]:
            common += 1
        first, second = (self._along(way[: len(way) - common]) for way in (lower, upper))
        return second.seen_from(first) if first is not IDENTITY else second

    def _along(self, way: Sequence[tuple[Node, Pose]]) -> Pose:
        result = IDENTITY
        for _, pose in way:
            result = pose @ result if result is not IDENTITY else pose
        return result

    def _way(self, node: Node) -> list[tuple[Node, Pose]]:
        """Return the frames from one to the world, each with its pose in the next one."""
        result = []
        node = self.node(*node)
        self.resolve(node)
        while node != WORLD_NODE:
            base, pose = self._bases[node]
            result.append((node, pose))
            node = base
        return result

    def resolve(self, node: Node) -> None:
        """Find and store the frame in which a frame is given, and so on to the world; report frames that are missing,
        and circles, whose last frame is then taken as the world."""
        node = self.node(*node)
        if node == WORLD_NODE or node in self._resolved_to_world:
            return
        if not self._enter("relative_to", node):
            self._bases[node] = WORLD_NODE, IDENTITY  # the circle ends here, for the search for further faults
            return
        self._bases[node] = self._resolve(*node)
        self.resolve(self._bases[node][0])
        self._waiting.pop()
        self._resolved_to_world.add(node)

    def _resolve(self, path: tuple[str, ...], name: str) -> tuple[Node, Pose]:
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
                result @= IDENTITY.seen_from(self._within(inside, self.node(inside, inner.placement)))
        if not self.check_frame(path, named, written.place, "relative_to" if written.relative_to else ""):
            return WORLD_NODE, result
        return self.node(path, named), result

    def _within(self, path: tuple[str, ...], node: Node) -> Pose:
        """Return the pose of a node in the frame of the model at ``path``, which contains it, and whose own pose may
        not be known yet. A circle of frames ends the way early; ``resolve`` reports circles."""
        poses: list[tuple[Node, Pose]] = []
        origin = (path[:-1], path[-1])
        passed: set[Node] = set()
        while node not in (origin, WORLD_NODE, *passed):  # circles are reported by ``resolve``
            passed.add(node)
            if node not in self._bases:
                if not self._enter("relative_to", node):
                    break
                self._bases[node] = self._resolve(*node)
                self._waiting.pop()
            node, pose = self._bases[node]
            poses.append((node, pose))
        return self._along(poses)

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
            hint = nearest(name, self.models[path].names)
            if last == WORLD_FRAME and not outer:
                fault = f"{attribute}: a model cannot name the frame 'world', which is the world's [E1722]"
                hint = "a frame of the model, or a fixed joint with the parent world"
            self._refuse(location, name, fault, hint)
        return False

    def _label(self, path: Sequence[str]) -> str:
        return f"the model {shown('::'.join(path))}" if path else "the world"

    def link(self, path: tuple[str, ...], name: str) -> Node:
        """Return the node of the link that carries a frame, by name in the model at ``path``; the world if no link
        does, or if the frames are attached in a circle, which is reported. The name must exist."""
        node = path, last = self.node(path, name)
        if node == WORLD_NODE:
            return node
        if node in self._links:
            return self._links[node]
        if not self._enter("attached_to", node):
            return WORLD_NODE
        self._links[node] = self._carrier(path, last)
        self._waiting.pop()
        return self._links[node]

    def _carrier(self, path: tuple[str, ...], name: str) -> Node:
        """Return the node of the link that carries a link, joint, frame or model ``name``. For a joint this is the
        child, for a frame the carrier of the frame to which it is attached, for a model the canonical link; the world
        for a fault, which is reported."""
        model = self.models[path]
        if name in model.links:
            return path, name
        if name in model.joints:
            joint = model.joints[name]
            return (
                self.link(path, joint.child)
                if self.check_frame(path, joint.child, joint.place, "child")
                else WORLD_NODE
            )
        if name in model.frames:
            frame = model.frames[name]
            if not frame.attached_to:
                return self.link(path, MODEL_FRAME) if path else WORLD_NODE
            known = self.check_frame(path, frame.attached_to, frame.place, "attached_to")
            return self.link(path, frame.attached_to) if known else WORLD_NODE
        return self._canonical((*path, name))

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

    def _enter(self, attribute: str, node: Node) -> bool:
        """Mark a node as being resolved by ``attribute``, and return True; return False, and report the circle, if the
        node is already being resolved. The caller removes the mark."""
        step = (attribute, node)
        if step not in self._waiting:
            self._waiting.append(step)
            return True
        circle = [frame for _, frame in self._waiting[self._waiting.index(step) :]]
        path, first = node
        owner = self.models[path]
        location = next(
            part[first].place for part in (owner.frames, owner.joints, owner.links, owner.models) if first in part
        )
        names = listed([name for _, name in [*circle, node]])
        fault = f"{attribute}: the frames name one another in a circle: {names} [E1724]"
        self._refuse(location, attribute, fault, "another one")
        return False

    def _refuse(self, location: ElementPlace, about: str, fault: str, hint: str) -> None:
        if (location, about) not in self._refused:
            self._refused.add((location, about))
            self.report.add_place(location.file, location.line, "", fault, hint)


def pose_of(written: WrittenPose) -> Pose:
    """Return the numbers of a pose."""
    return Pose(written.orientation, written.position)
