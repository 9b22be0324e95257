"""The tree of a draft: links that are fixed to one another, joints that carry links, joints that close loops, and
links that move freely.

A draft has no tree: joints connect links in any way, and a link that no joint holds is free. Here joints are taken
one after another, fixed ones first, then joints with forces of their own, and each that would close a loop becomes a
constraint. A joint whose child carries its parent is turned around.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.base.data import dataclass
from eomgen.products.robots.draft import DraftJoint
from eomgen.products.robots.frames import WORLD_NODE, Node


@dataclass(frozen=True)
class Edge:
    """A joint of a model at a path between two links; ``key`` has the path and the name, ``held`` is the coordinate of
    a joint that does not move."""

    key: Node
    joint: DraftJoint
    parent: Node
    child: Node
    held: float | None

    @property
    def is_fixed(self) -> bool:
        """Whether its links do not move against each other."""
        return self.held is not None or self.joint.type == "fixed"

    @property
    def rank(self) -> int:
        """Order in which joints are chosen for the tree: 0 fixed, 1 with a damper, spring, friction or mimic, 2 others,
        3 joints that the file declares to close a loop."""
        if self.joint.cut:
            return 3
        if self.is_fixed:
            return 0
        forces = any(axis.damping or axis.stiffness or axis.friction or axis.mimic for axis in self.joint.axes)
        return 1 if forces else 2


@dataclass(frozen=True)
class Step:
    """A step from a link to one that the joint carries; ``is_reversed`` if this is the parent of the joint."""

    edge: Edge
    start: Node
    end: Node

    @property
    def is_reversed(self) -> bool:
        return self.end == self.edge.parent


#: Steps in order, parents first, by start.
Walks = dict[Node, list[Step]]


def tree_of(links: Sequence[Node], edges: Sequence[Edge], roots: Mapping[Node, Node]) -> tuple[Walks, list[Edge]]:
    """Return the tree that joints make of links: joints are taken by their ``rank``, and each that would close a loop
    is a loop.

    Parameters
    ----------
    links : sequence
        All links other than the world, in the order of the file.
    edges : sequence
        All joints, in the order of the file.
    roots : mapping
        For each link the link to which the frame of the model is attached; the walk of a free part starts there if no
        joint has this link as child.

    Returns
    -------
    walks : dict
        Steps in order, parents first, by start: the world (first), then each link on a free joint.
    loops : list
        Joints that close loops, in the order of the file.
    """
    leaders: dict[Node, Node] = {}  # within each set of connected links

    def leader(link: Node) -> Node:
        while link in leaders:
            link = leaders[link]
        return link

    chosen = set[Node]()
    for edge in sorted(edges, key=lambda edge: edge.rank):
        first, second = leader(edge.parent), leader(edge.child)
        if first != second:
            leaders[second] = first
            chosen.add(edge.key)
    beside: dict[Node, list[Edge]] = {}
    carrying = [edge for edge in edges if edge.key in chosen]
    for edge in carrying:
        beside.setdefault(edge.parent, []).append(edge)
        beside.setdefault(edge.child, []).append(edge)
    children, reached = {edge.child for edge in carrying}, set[Node]()
    # a free link: the one that carries the frame of its model, if no joint has it as child, else the first such link
    starts = [link for link in links if roots[link] == link and link not in children]
    starts += [*(link for link in links if link not in children), *links]
    walks = {link: _walk(link, beside, reached) for link in (WORLD_NODE, *starts) if link not in reached}
    return walks, [edge for edge in edges if edge.key not in chosen]


def _walk(start: Node, beside: Mapping[Node, Sequence[Edge]], reached: set[Node]) -> list[Step]:
    """Return the steps from a start, parents first, and add the start and their ends to ``reached``."""
    steps: list[Step] = []
    reached.add(start)
    waiting = [Step(edge, start, _far_end(edge, start)) for edge in beside.get(start, ())][::-1]
    while waiting:
        step = waiting.pop()
        if step.end in reached:
            continue
        reached.add(step.end)
        steps.append(step)
        waiting += [Step(edge, step.end, _far_end(edge, step.end)) for edge in beside.get(step.end, ())][::-1]
    return steps


def _far_end(edge: Edge, link: Node) -> Node:
    return edge.child if edge.parent == link else edge.parent
