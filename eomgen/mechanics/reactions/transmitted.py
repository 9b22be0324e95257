"""Wrenches that joints and constraints transmit.

A joint of the tree transmits the wrench of its subtree beyond all other loads on it: inertia forces minus
weight, applied forces and forces of constraints, in the inward recursion of inverse dynamics (Newton-Euler; Luh, Walker
and Paul 1980), with the bodies' own inertia and not the grouped one. Springs, dampers, stops, friction, drives and
efforts of a joint itself are part of the wrench. A constraint transmits the unit wrenches of its equations times
minus their multipliers. In absolute coordinates the recursion runs over the bodies in world axes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from eomgen.errors import ModelError, Problem
from eomgen.mechanics.constraints.beam_strains import add_section_forces
from eomgen.mechanics.constraints.rows import Rows
from eomgen.mechanics.dynamics.separated import carried_loads, net_wrenches
from eomgen.mechanics.forces.frame_pairs import frame_pair
from eomgen.mechanics.forces.loads import Loads, add_wrench
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.fields import total_fields
from eomgen.mechanics.kinematics.points import LinkKinematics
from eomgen.mechanics.kinematics.wrenches import Wrench
from eomgen.mechanics.reactions.row_wrenches import row_wrenches
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.joints.constraint_model import Constraint, Frame
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Scalar, Vector, apply, cross, minus, negative, plus, scaled, transpose
from eomgen.system.description import BASE


@dataclass(frozen=True)
class Transmitted:
    """A wrench on a link (base or world for negative numbers), about the place ``at``, all in the link's axes."""

    link: int
    at: Vector
    moment: Vector
    force: Vector


class TransmittedWrenches:
    """Wrenches transmitted by joints and constraints of one scene, each recorded at its first use.

    Parameters
    ----------
    tree : with the bodies' own inertia
    base : motion of the frame that carries the tree
    rows : of all constraints, as the multipliers are numbered; None if there are none
    """

    def __init__(
        self, scene: Scene, tree: Tree, quantities: Quantities, base: BaseMotion, loads: Loads, rows: Rows | None
    ) -> None:
        self.scene = scene
        self.tree = tree
        self.quantities = quantities
        self.base = base
        self.loads = loads
        self.rows = rows
        self.joints: Mapping[str, Joint] = {joint.name: joint for joint in scene.joints}
        self._of_constraints: dict[str, tuple[Transmitted, Transmitted]] = {}

    def joint(self, name: str) -> Transmitted:
        """Return the wrench of a joint's parent on its child, about the origin of the child's frame."""
        joint = self.joints[name]
        mount = self.tree.mounts[joint.child]
        absolute = self.scene.coordinates == "absolute"
        if absolute and not joint.kind.moves:
            fault = f"the reaction of the fixed joint {name} cannot be told: absolute coordinates make one body of two"
            raise ModelError(Problem(self.scene.name, fault, "joint coordinates"))
        moment, force = self._through_bodies[joint.child] if absolute else self._through_links[mount.link]
        return Transmitted(mount.link, mount.position, minus(moment, cross(mount.position, force)), force)

    def constraint(self, item: Constraint) -> Transmitted:
        """Return the wrench of the first body on the second one, about the origin of the second frame."""
        return self._pair(item)[1]

    def drive_effort(self, item: Constraint | Joint, index: int = 0) -> Scalar:
        """Return the effort of a drive along an angle, N m, or a travel or distance, N; positive drives it up."""
        multipliers = self._multipliers(item)
        if isinstance(item, Joint):
            return -multipliers[index]
        effort = multipliers[max(multipliers)]  # its equation is the last of the constraint
        return effort if item.kind.drive == "travel" else -effort

    def _multipliers(self, item: Constraint | Joint) -> dict[int, Scalar]:
        """Return the multiplier of each equation, without dependent equations."""
        rows = [] if self.rows is None else self.rows.all
        return {row.number: self.quantities.input("lam", k) for k, row in enumerate(rows) if row.owner is item}

    def _pair(self, item: Constraint) -> tuple[Transmitted, Transmitted]:
        """Return the wrenches of a constraint on its first and its second body, both at the second frame's origin."""
        if item.name not in self._of_constraints:
            with self.tree.algebra.tape.block(f"reaction of constraint {item.name}"):
                self._of_constraints[item.name] = self._recorded(item)
        return self._of_constraints[item.name]

    def _recorded(self, item: Constraint) -> tuple[Transmitted, Transmitted]:
        algebra = self.tree.algebra
        pair = frame_pair(self.quantities, item.first, item.second)
        units = row_wrenches(self.quantities, item, pair)
        moment, force = algebra.zero_vector, algebra.zero_vector
        for number, multiplier in self._multipliers(item).items():
            moment = minus(moment, scaled(multiplier, units[number][0]))
            force = minus(force, scaled(multiplier, units[number][1]))
        apart = minus(pair.second.origin, pair.first.origin)
        first = self._on(item.first, pair.kinematics, (negative(moment), negative(force)), apart)
        return first, self._on(item.second, pair.kinematics, (moment, force), algebra.zero_vector)

    def _on(self, frame: Frame, kinematics: LinkKinematics, load: Wrench, beyond: Vector) -> Transmitted:
        """Return a wrench at ``beyond`` from a frame's origin in the axes of its link; given in the common link's."""
        link, s = self.quantities.kinematics.local(frame.body, self.quantities.vector(frame.position))
        back = transpose(kinematics.pose(link)[0])
        return Transmitted(link, plus(s, apply(back, beyond)), apply(back, load[0]), apply(back, load[1]))

    @cached_property
    def _net(self) -> list[Wrench]:
        """Wrench that each link needs from its joints beyond other loads, about its origin in its axes."""
        forces = list(self.loads.wrenches)
        add_section_forces(self.quantities, self.rows, forces)
        for item in self.scene.constraints:
            for side in self._pair(item):
                if side.link >= 0:
                    add_wrench(forces, side.link, (plus(side.moment, cross(side.at, side.force)), side.force))
        fields = total_fields(self.tree, self.base, accelerations=True, gravity=True)
        return net_wrenches(self.tree, fields, forces)

    @cached_property
    def _through_links(self) -> list[Wrench]:
        return carried_loads(self.tree, self._net, "reaction")

    @cached_property
    def _through_bodies(self) -> dict[str, Wrench]:
        """Wrench transmitted to each moving body with its subtree, in its link's axes about its origin."""
        hosts: dict[str, str] = {}
        for joint in self.scene.joints:
            hosts[joint.child] = joint.child if joint.kind.moves else hosts.get(joint.parent, BASE)
        total: dict[str, Wrench] = {}
        kinematics, links = self.quantities.kinematics, {}
        for body, host in hosts.items():
            if body == host:
                links[body] = self.tree.mounts[body].link
                R = kinematics.pose(links[body])[0]
                moment, force = self._net[links[body]]
                total[body] = (apply(R, moment), apply(R, force))
        for joint in reversed(self.scene.joints):
            parent = hosts.get(joint.parent, BASE)
            if joint.child not in total or parent == BASE:
                continue
            with self.tree.algebra.tape.block(f"reaction at joint {joint.name}"):
                moment, force = total[joint.child]
                arm = minus(kinematics.pose(links[joint.child])[1], kinematics.pose(links[parent])[1])
                above = total[parent]
                total[parent] = (plus(above[0], plus(moment, cross(arm, force))), plus(above[1], force))
        back = {body: transpose(kinematics.pose(link)[0]) for body, link in links.items()}
        return {body: (apply(back[body], load[0]), apply(back[body], load[1])) for body, load in total.items()}
