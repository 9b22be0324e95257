"""Coordinates of joints on the tape: components of q, v and a; a dependent (mimic) joint uses its leader's.

A coordinate that follows, q = ratio q_leader + offset, is no unknown. Efforts of its joint enter the leader's equation
by virtual work, times the ratio, so motion subspaces, inertia and forces need only the ratio of each joint.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from eomgen.formula.nodes import Formula
from eomgen.lie.product import Factor
from eomgen.mechanics.tree.joints import Motion
from eomgen.scene.joint_types import GROUPS
from eomgen.scene.joints.model import Joint, Mimic
from eomgen.symbolic.scalar import Algebra, Scalar


@dataclass(frozen=True)
class Coordinates:
    """Coordinates of one joint, recorded on the tape as they are read.

    Attributes
    ----------
    components : components of q behind each coordinate
    dofs : component of v behind each velocity component
    ratio, offset : q of the joint = ratio (component of q) + offset; 1 and 0 unless it follows another
    given : values in place of components of q, v and a, by block and number
    """

    algebra: Algebra
    components: tuple[int, ...]
    dofs: tuple[int, ...]
    ratio: Scalar
    offset: Scalar
    given: Mapping[tuple[str, int], Scalar] = field(default_factory=dict)

    @property
    def q(self) -> tuple[Scalar, ...]:
        return tuple(self.ratio * self._input("q", component) + self.offset for component in self.components)

    @property
    def v(self) -> tuple[Scalar, ...]:
        return tuple(self.ratio * self._input("v", dof) for dof in self.dofs)

    @property
    def a(self) -> tuple[Scalar, ...]:
        return tuple(self.ratio * self._input("a", dof) for dof in self.dofs)

    def _input(self, block: str, index: int) -> Scalar:
        if (block, index) in self.given:
            return self.given[block, index]
        return Scalar(self.algebra.tape, self.algebra.tape.input(block, index))

    def of(self, motion: Motion) -> Coordinates:
        """Return the coordinates of one elementary motion of the joint."""
        if motion.kind in GROUPS:
            return self
        components, dofs = (tuple(values[k] for k in motion.components) for values in (self.components, self.dofs))
        return replace(self, components=components, dofs=dofs)

    def following(self, multiplier: Scalar, offset: Scalar) -> Coordinates:
        """Return the coordinates of a dependent joint that follows this one."""
        return replace(self, ratio=multiplier * self.ratio, offset=multiplier * self.offset + offset)


def own_coordinates(algebra: Algebra, factor: Factor, given: Mapping[tuple[str, int], Scalar]) -> Coordinates:
    """Return the coordinates of an independent joint."""
    components, dofs = (
        range(factor.q_start, factor.q_start + factor.q_size),
        range(factor.v_start, factor.v_start + factor.v_size),
    )
    return Coordinates(algebra, tuple(components), tuple(dofs), algebra.one, algebra.zero, given)


def joint_coordinates(
    algebra: Algebra,
    joints: Sequence[Joint],
    number: Callable[[Formula], Scalar],
    elastic: Mapping[str, int],
    given: Mapping[tuple[str, int], Scalar],
) -> tuple[tuple[Factor, ...], dict[str, Coordinates]]:
    """Return the factors of the configuration in joint order, and the coordinates of moving joints and beams by name.

    ``elastic`` gives the number of elastic coordinates of a body; they follow its joint's. ``given`` holds values in
    place of components of q, v and a.
    """
    moving = {joint.name: joint for joint in joints if joint.kind.moves}
    factors: list[Factor] = []
    q_start = v_start = 0
    for joint in joints:
        sizes = {}
        if joint.kind.moves and joint.mimic is None:
            sizes[joint.name] = (joint.kind.group, *joint.kind.sizes)
        if joint.child in elastic:
            sizes[joint.child] = ("R", elastic[joint.child], elastic[joint.child])
        for name, (group, q_size, v_size) in sizes.items():
            factors.append(Factor(group, name, q_start, q_size, v_start, v_size))
            q_start, v_start = q_start + q_size, v_start + v_size
    coordinates = {factor.name: own_coordinates(algebra, factor, given) for factor in factors}
    for joint in moving.values():
        followers: list[tuple[str, Mimic]] = []
        leader = joint
        while leader.name not in coordinates and leader.mimic is not None:
            followers.append((leader.name, leader.mimic))
            leader = moving[leader.mimic.joint]
        for follower, mimic in reversed(followers):
            coordinates[follower] = coordinates[mimic.joint].following(number(mimic.multiplier), number(mimic.offset))
    return tuple(factors), coordinates
