"""Reactions: wrenches transmitted by joints and constraints, from inverse dynamics and multipliers, and their
quantities in formulas.

An equation depends on the pose of the second frame in the first one, and on no other part of the machine. Its rate is
g . (omega, v), with the second frame's angular velocity against the first and the velocity of its origin. So the
virtual work of B^T lam is the work of the wrench lam g on the second body and of its opposite, at one place, on the
first. g is differentiated on a separate tape, with this pose independent although it depends on q on the scene's.

A joint of the tree transmits the wrench of its subtree beyond all other loads on it: inertia forces minus
weight, applied forces and forces of constraints, in the inward recursion of inverse dynamics (Newton-Euler; Luh, Walker
and Paul 1980), with the bodies' own inertia and not the grouped one. Springs, dampers, stops, friction, drives and
efforts of a joint itself are part of the wrench. A constraint transmits the unit wrenches of its equations times
minus their multipliers. In absolute coordinates the recursion runs over the bodies in world axes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import cached_property

from eomgen.base.data import dataclass, field
from eomgen.errors import ModelError, Problem
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Symbol
from eomgen.mechanics.constraints.beam_strains import add_section_forces
from eomgen.mechanics.constraints.rows import ConstraintRows, Equation, rows_of_pair
from eomgen.mechanics.dynamics.separated import carried_loads, net_wrenches
from eomgen.mechanics.forces.frame_pairs import FramePair, FramePose, frame_pair
from eomgen.mechanics.forces.loads import Loads, add_wrench
from eomgen.mechanics.forces.symbols import DetachedSymbols, Quantities
from eomgen.mechanics.kinematics.fields import Wrench, total_fields
from eomgen.mechanics.kinematics.points import LinkKinematics
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.links import ROOT, Tree
from eomgen.scene.joints.model import Constraint, Frame, Joint, Reaction
from eomgen.scene.scene import Scene
from eomgen.symbolic.calculus.partials import Seeds, forward_partials
from eomgen.symbolic.map import splice
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import (
    Algebra,
    Scalar,
    Vector,
    apply,
    cross,
    minus,
    multiply,
    negative,
    plus,
    scaled,
    transpose,
)
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from eomgen.system.description import BASE, WORLD

#: Links of the two frames on the separate tape, and the blocks of this tape: axes, origin and twist of the second
#: frame.
_FIRST, _SECOND = range(2)
_PLACE, _TWIST = "place", "twist"


def row_wrenches(quantities: Quantities, item: Constraint, pair: FramePair) -> list[Wrench]:
    """Return the unit wrench of each equation of a constraint, holonomic equations first.

    Returns
    -------
    list of (moment, force)
        On the second body, about the origin of the second frame, in the axes in which the pair is given; N m (of
        equations in m: N m per N) and N per unit of the multiplier.
    """
    kernel = Tape()
    rows = rows_of_pair(DetachedSymbols(quantities, kernel), item, _pair_of_its_own(kernel))
    unit = forward_partials(kernel, [row.value.ref for row in rows.holonomic], _displacements(kernel))
    unit += forward_partials(
        kernel, [row.value.ref for row in rows.velocity], {InputSymbol(_TWIST, k): {k: ONE} for k in range(6)}
    )
    to_first = transpose(pair.first.axes)
    pose = [entry for row in multiply(to_first, pair.second.axes) for entry in row]
    pose += apply(to_first, minus(pair.second.origin, pair.first.origin))
    bound = {InputSymbol(_PLACE, number): value.ref for number, value in enumerate(pose)}
    refs = splice(quantities.algebra.tape, kernel, [row.get(k, ZERO) for row in unit for k in range(6)], bound)
    parts = [Scalar(quantities.algebra.tape, ref) for ref in refs]
    vector = quantities.algebra.vector
    sides = [apply(pair.first.axes, vector(parts[k : k + 3])) for k in range(0, len(parts), 3)]
    return list(zip(sides[::2], sides[1::2], strict=True))


def _pair_of_its_own(tape: Tape) -> FramePair:
    """Return a frame pair on a separate tape, without scales of lengths. The second frame has twelve inputs as pose in
    the first frame (axes row by row, origin), and six as twist."""
    algebra = Algebra(tape)
    zero, pose = algebra.zero_vector, algebra.block(_PLACE, 12)
    axes = algebra.matrix([pose[0:3], pose[3:6], pose[6:9]])
    origin = algebra.vector(pose[9:12])
    twist = algebra.block(_TWIST, 6)
    kinematics = LinkKinematics(
        Tree(algebra, (), {}, {}, (), {}),
        {_FIRST: (algebra.identity, zero), _SECOND: (algebra.identity, origin)},
        {_FIRST: (zero, zero), _SECOND: (algebra.vector(twist[:3]), algebra.vector(twist[3:]))},
    )
    first, second = FramePose(_FIRST, algebra.identity, zero), FramePose(_SECOND, axes, origin)
    return FramePair(kinematics, first, second, algebra.one, algebra.zero, algebra.one)


def _displacements(tape: Tape) -> Seeds:
    """Return the partials of the second frame's pose along six directions: rotations 0 to 2, translations 3 to 5."""
    seeds: dict[Ref | InputSymbol, dict[int, Ref]] = {}
    for k, i, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):  # a turn about k takes axis i to j and axis j to minus i
        for column in range(3):
            at_i, at_j = InputSymbol(_PLACE, 3 * i + column), InputSymbol(_PLACE, 3 * j + column)
            seeds.setdefault(at_j, {})[k] = tape.input(_PLACE, 3 * i + column)
            seeds.setdefault(at_i, {})[k] = -tape.input(_PLACE, 3 * j + column)
    return seeds | {InputSymbol(_PLACE, 9 + k): {3 + k: ONE} for k in range(3)}


@dataclass(frozen=True)
class TransmittedWrench:
    """A wrench on a link (base or world for negative numbers), about the point ``at``, m; moment, N m, and force, N.
    All are in the link's axes."""

    link: int
    at: Vector
    moment: Vector
    force: Vector


@dataclass
class TransmittedWrenches:
    """Wrenches transmitted by joints and constraints of one scene, each recorded at the first use.

    Attributes
    ----------
    tree : with the bodies' own inertia
    base : motion of the frame that carries the tree
    loads : all applied loads
    rows : of all constraints, as the multipliers are numbered; None if there are none
    """

    scene: Scene
    tree: Tree
    quantities: Quantities
    base: BaseMotion
    loads: Loads
    rows: ConstraintRows | None
    _of_constraints: dict[str, tuple[TransmittedWrench, TransmittedWrench]] = field(default_factory=dict)

    def joint(self, name: str) -> TransmittedWrench:
        """Return the wrench of a joint's parent on the child, about the origin of the child's frame, in axes of the
        child's link. Raises ModelError for a fixed joint in absolute coordinates."""
        joint = next(item for item in self.scene.joints if item.name == name)
        mount = self.tree.mounts[joint.child]
        absolute = self.scene.coordinates == "absolute"
        if absolute and not joint.kind.moves:
            fault = (
                f"the reaction of the fixed joint {name} is unknown: absolute coordinates make one body of two [E0506]"
            )
            raise ModelError(Problem(self.scene.name, fault, "joint coordinates"))
        moment, force = self._through_bodies[joint.child] if absolute else self._through_links[mount.link]
        return TransmittedWrench(mount.link, mount.position, minus(moment, cross(mount.position, force)), force)

    def constraint(self, item: Constraint) -> TransmittedWrench:
        """Return the wrench of the first body on the second one, about the origin of the second frame.

        Raises
        ------
        ModelError
            An equation of coordinates and points has no single wrench.
        """
        if not item.framed:
            fault = f"the constraint {item.name} joins no two frames, so it has no single force and moment [E0507]"
            hint = f"drive_effort.{item.name}, its effort along the equation, or the reaction of a joint"
            raise ModelError(Problem(f"constraints.{item.name}", fault, hint))
        return self._pair(item)[1]

    def drive_effort(self, item: Constraint | Joint, index: int = 0) -> Scalar:
        """Return the effort of a drive along an angle, N m, or a travel or distance, N; positive efforts increase the
        coordinate. ``index`` is the coordinate of a joint. A constraint by formula has the effort along its equation,
        or 0 if that equation is left out."""
        multipliers = self._multipliers(item)
        if isinstance(item, Constraint) and item.equation is not None:
            return -multipliers[0] if multipliers else self.tree.algebra.zero
        if isinstance(item, Joint):
            return -multipliers[index]
        effort = multipliers[max(multipliers)]  # the equation of the drive is the last of the constraint
        return effort if item.kind.drive == "travel" else -effort

    def _multipliers(self, item: Constraint | Joint) -> dict[int, Scalar]:
        """Return the multipliers of a constraint or joint by number of its equation; equations left out as dependent
        are absent."""
        rows = [] if self.rows is None else self.rows.all
        return {row.number: self.quantities.input("lam", k) for k, row in enumerate(rows) if row.owner is item}

    def _pair(self, item: Constraint) -> tuple[TransmittedWrench, TransmittedWrench]:
        """Return the wrenches of a constraint between two frames on the first and the second body, both about the
        origin of the second frame, each in axes of the body's link. Recorded at the first call."""
        if item.name not in self._of_constraints:
            with self.tree.algebra.tape.block(f"reaction of constraint {item.name}"):
                self._of_constraints[item.name] = self._record(item)
        return self._of_constraints[item.name]

    def _at_points(self, item: Constraint) -> list[TransmittedWrench]:
        """Return the forces of a constraint by formula on the points in the formula, without moments. Efforts on joint
        coordinates in the formula are parts of the joint wrenches."""
        none, equation = self.tree.algebra.zero_vector, Equation(self.quantities, item)
        loads = (load for multiplier in self._multipliers(item).values() for load in equation.forces(multiplier))
        return [TransmittedWrench(link, at, none, force) for link, at, force in loads]

    def _record(self, item: Constraint) -> tuple[TransmittedWrench, TransmittedWrench]:
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

    def _on(self, frame: Frame, kinematics: LinkKinematics, load: Wrench, beyond: Vector) -> TransmittedWrench:
        """Return a wrench on a frame's link, in the axes of the link. ``load`` and ``beyond`` are in axes of the common
        link; ``beyond`` leads from the frame's origin to the wrench's point, m."""
        link, s = self.quantities.kinematics.local(frame.body, self.quantities.vector(frame.position))
        back = transpose(kinematics.pose(link)[0])
        return TransmittedWrench(link, plus(s, apply(back, beyond)), apply(back, load[0]), apply(back, load[1]))

    @cached_property
    def _net(self) -> list[Wrench]:
        """For each link the inertia wrench less weight, applied loads and constraint forces, about the link's origin in
        link axes."""
        forces = list(self.loads.wrenches)
        add_section_forces(self.quantities, self.rows, forces)
        for item in self.scene.constraints:
            for side in self._pair(item) if item.framed else self._at_points(item):
                if side.link >= 0:
                    add_wrench(forces, side.link, (plus(side.moment, cross(side.at, side.force)), side.force))
        fields = total_fields(self.tree, self.base, accelerations=True, gravity=True)
        return net_wrenches(self.tree, fields, forces)

    @cached_property
    def _through_links(self) -> list[Wrench]:
        return carried_loads(self.tree, self._net, "reaction")

    @cached_property
    def _through_bodies(self) -> dict[str, Wrench]:
        """Wrenches transmitted to moving bodies, by name, each for the body and all bodies outward of it. In absolute
        coordinates; about the body's origin in link axes, moment first."""
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


class Reactions:
    """Values of the symbols ``reaction`` and ``drive_effort`` in formulas of outputs and events.

    Parameters
    ----------
    wrenches : returns wrenches transmitted by joints and constraints, given the names of fixed joints with a requested
        reaction; called at the first reaction that is requested
    """

    def __init__(self, scene: Scene, wrenches: Callable[[Collection[str]], TransmittedWrenches]) -> None:
        self.scene = scene
        self._made = wrenches
        self._found: dict[str, tuple[Scalar, ...]] = {}

    @cached_property
    def wrenches(self) -> TransmittedWrenches:
        return self._made(self._fixed_joints())

    def __call__(self, symbol: Symbol) -> Scalar:
        """Return a component of a reaction, moment first, N m or N, or the effort of a drive.

        Raises
        ------
        ModelError
            No joint or constraint of that name has a drive.
        """
        if symbol.kind == "drive_effort":
            return self._drive_effort(symbol.name, symbol.index)
        if symbol.name not in self._found:
            item = self._find(symbol.name)
            with self.wrenches.tree.algebra.tape.block(f"reaction {symbol.name}"):
                self._found[symbol.name] = self._components(item)
        return self._found[symbol.name][symbol.index]

    def _fixed_joints(self) -> list[str]:
        """Return the fixed joints with reactions in the scene's outputs and events."""
        formulas = [*(value for output in self.scene.outputs for value in output.values)]
        formulas += [formula for event in self.scene.events for formula in (event.when, *event.actions())]
        of = {self._find(item.name).of for formula in formulas for item in symbols(formula) if item.kind == "reaction"}
        return [joint.name for joint in self.scene.joints if joint.name in of and not joint.kind.moves]

    def _find(self, name: str) -> Reaction:
        of_joint = any(joint.name == name for joint in self.scene.joints)
        plain = Reaction(name, "joints" if of_joint else "constraints", name)
        return next((item for item in self.scene.reactions if item.name == name), plain)

    def _drive_effort(self, name: str, index: int) -> Scalar:
        driven: list[Joint | Constraint] = [joint for joint in self.scene.joints if joint.drive]
        driven += [item for item in self.scene.constraints if item.has_effort]
        item = next((item for item in driven if item.name == name), None)
        if item is None:
            raise ModelError(
                f"no joint or constraint {name} has a drive, so there is no drive_effort [E0508]",
                "drive = a formula of time",
            )
        return self.wrenches.drive_effort(item, index)

    def _components(self, item: Reaction) -> tuple[Scalar, ...]:
        if item.section == "joints":
            load = self.wrenches.joint(item.of)
        else:
            load = self.wrenches.constraint(next(entry for entry in self.scene.constraints if entry.name == item.of))
        if item.point is not None:
            load = self._about_point(load, item)
        turn = self._to_axes(load.link, item.axes)
        return (*turn(load.moment), *turn(load.force))

    def _about_point(self, load: TransmittedWrench, item: Reaction) -> TransmittedWrench:
        """Return a wrench about the point of a reaction, on an equal or an inward link. The lever is taken in the axes
        of a link between the body and the base, if such a link holds the point, so that no digits cancel far from the
        origin."""
        quantities, tree = self.wrenches.quantities, self.wrenches.tree
        kinematics, point = quantities.kinematics, item.point
        assert point is not None  # asked for by the caller
        link, s = kinematics.local(*quantities.at(point))
        near = load
        while near.link != link and near.link >= 0:
            near = _on_parent(tree, near)
        if near.link == link:
            lever = minus(s, near.at)
        else:
            near = load
            R, p = kinematics.pose(load.link)
            position = kinematics.position_in_base(*quantities.at(point))
            lever = apply(transpose(R), minus(position, plus(p, apply(R, load.at))))
        return TransmittedWrench(
            near.link, plus(near.at, lever), minus(near.moment, cross(lever, near.force)), near.force
        )

    def _to_axes(self, link: int, axes: str) -> Callable[[Vector], Vector]:
        """Return the function that rotates vectors from a link's axes to the axes of a body, base or world by name."""
        tree, kinematics = self.wrenches.tree, self.wrenches.quantities.kinematics
        mount = None if axes == WORLD else tree.mounts[axes]
        target = ROOT if mount is None else mount.link

        def rotate(x: Vector) -> Vector:
            at = link
            while at != target and at >= 0:
                x, at = tree.links[at].rotation.rotate(x), tree.links[at].parent
            if at != target:
                x = x if at == ROOT else apply(kinematics.pose(at)[0], x)
                x = x if target == ROOT else apply(transpose(kinematics.pose(target)[0]), x)
            if mount is None:
                return apply(kinematics.base.orientation, x)
            return apply(transpose(mount.orientation), x)

        return rotate


def _on_parent(tree: Tree, load: TransmittedWrench) -> TransmittedWrench:
    """Return a wrench in the axes of the parent link, about the unchanged point."""
    link = tree.links[load.link]
    turn = link.rotation.rotate
    return TransmittedWrench(link.parent, plus(link.position, turn(load.at)), turn(load.moment), turn(load.force))
