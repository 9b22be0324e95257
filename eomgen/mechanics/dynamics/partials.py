"""Exact partials of inverse dynamics by composite bodies: left-trivialised in q, and in v and a; and second ones of
its work along a virtual motion.

Moving joint j by a screw s moves its subtree rigidly. In the frame that moves along, every body there gains the twist
V x s and the spatial acceleration A x s + V x (V x s) of the joint's parent, plus a Coriolis field 2 w x (velocity)
of each point (after Echeandia & Wensing 2021 and Singh, Russell & Wensing 2022, restated for acceleration fields).
The last needs two more composites of each subtree only: linear momentum P = int V dm and H = int V s^T dm. Applied
forces are differentiated on the tape.

Second partials: weights . tau is the power of the inertia forces along the virtual velocities y that the weights give
the tree, int y . A dm. Its partial in q_i is linear in three changes of the subtree: of y by the parent's virtual twist
x s, of V by the twist, of A as above. The composites of that are the momentum of y, the force, and B = 2 int V x y dm,
since y . (2 w x V) = w . (2 V x y). Moving a joint j towards the root changes the subtree of i in the same three ways,
so each entry is a product of a change of j with three vectors of i; the vector for the change of V is a pure moment
(after Singh, Russell & Wensing 2023, contracted before the recursion).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.base.data import dataclass
from eomgen.mechanics.dynamics.separated import composites, field_wrenches, inverse_dynamics
from eomgen.mechanics.kinematics.directions import motion_directions
from eomgen.mechanics.kinematics.fields import (
    AccelerationField,
    Pair,
    Wrench,
    bracket,
    carry,
    centripetal,
    moved_load,
    pair_dot,
    pair_plus,
    project,
    relative,
    total_fields,
)
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.inertia import RecordedInertia, wrench
from eomgen.mechanics.tree.links import ROOT, Link, Tree
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.scalar import (
    Algebra,
    Matrix,
    Scalar,
    Vector,
    apply,
    cross,
    dot,
    matrix_plus,
    minus,
    multiply,
    outer,
    plus,
    scaled,
    skew,
    transpose,
)
from eomgen.symbolic.tape import ZERO

Square = list[list[Scalar]]


@dataclass(frozen=True)
class Screws:
    """Effect of one joint column s = (w, u) on its subtree, in link axes about the link's origin.

    Attributes
    ----------
    screw : (w, u)
    turned : s' = V_parent x s
    accelerated : s'' = A_parent x s + V_parent x s'
    rated : s' + V x s, the derivative in the joint's velocity
    """

    screw: Pair
    turned: Pair
    accelerated: Pair
    rated: Pair


def _motions(tree: Tree, base: BaseMotion) -> tuple[list[list[Screws]], list[Pair]]:
    """Return for each link the screws of its columns, and its inertial twist (angular velocity, velocity of the origin)
    in link axes. The base's linear velocity is zero: forces are the same in a frame that moves uniformly with the
    base."""
    algebra = tree.algebra
    fields = total_fields(tree, base, accelerations=True, gravity=True)
    start = plus(base.acceleration, scaled(-1.0, base.gravity))
    root = AccelerationField(start, base.alpha, centripetal(base.omega))
    twists: list[Pair] = []
    alphas: list[Vector] = []
    screws: list[list[Screws]] = []
    for link in tree.links:
        up = link.parent
        omega_up, velocity_up = (base.omega, algebra.zero_vector) if up == ROOT else twists[up]
        alpha_up = base.alpha if up == ROOT else alphas[up]
        origin_up = (root if up == ROOT else fields[up]).at(link.position)
        with algebra.tape.block(f"screws of joint {link.joint.name}"):
            turn, slide = relative(algebra, link, link.velocities)
            turn_rate, _ = relative(algebra, link, link.accelerations)
            omega = link.rotation.rotate_back(omega_up)
            velocity = link.rotation.rotate_back(plus(velocity_up, cross(omega_up, link.position)))
            alpha = link.rotation.rotate_back(alpha_up)
            origin = link.rotation.rotate_back(origin_up)
            spatial = minus(origin, cross(omega, velocity))
            twists.append((plus(omega, turn), plus(velocity, slide)))
            alphas.append(plus(plus(alpha, cross(omega, turn)), turn_rate))
            screws_of_link = []
            for column in link.columns:
                screw = column.angular, column.linear
                turned = bracket((omega, velocity), screw)
                left, right = bracket((alpha, spatial), screw), bracket((omega, velocity), turned)
                screw_rate = bracket(twists[-1], screw)
                screws_of_link.append(Screws(screw, turned, pair_plus(left, right), pair_plus(turned, screw_rate)))
            screws.append(screws_of_link)
    return screws, twists


@dataclass(frozen=True)
class CompositeMomentum:
    """Composite momentum of a subtree: P = int V dm and H = int V s^T dm about the link's origin, in link axes."""

    momentum: Vector
    moment: Matrix

    def coriolis(self, w: Vector) -> Wrench:
        """Return moment and force of the acceleration field 2 w x (velocity of each point) on the subtree."""
        trace = self.moment[0][0] + self.moment[1][1] + self.moment[2][2]
        moment = minus(scaled(trace, w), apply(self.moment, w))
        return scaled(2.0, moment), scaled(2.0, cross(w, self.momentum))

    @property
    def spin(self) -> Vector:
        """Angular momentum int s x V dm about the link's origin."""
        H = self.moment
        return H[2][1] - H[1][2], H[0][2] - H[2][0], H[1][0] - H[0][1]

    def adjoint(self, screw: Pair) -> Vector:
        """Return y with y . w' = virtual work of ``coriolis(w')`` along a screw."""
        w, u = screw
        trace = self.moment[0][0] + self.moment[1][1] + self.moment[2][2]
        turned = minus(scaled(trace, w), apply(transpose(self.moment), w))
        return scaled(2.0, plus(cross(self.momentum, u), turned))


def _flows(tree: Tree, twists: Sequence[Pair]) -> list[CompositeMomentum]:
    """Return the momentum P and the first moments of momentum H of each link together with all outward links.
    ``twists`` are angular velocity and velocity of the origin of each link, in link axes."""
    total: list[CompositeMomentum] = []
    for link, (omega, velocity) in zip(tree.links, twists, strict=True):
        body = link.inertia
        momentum = plus(scaled(body.mass, velocity), cross(omega, body.first))
        total.append(
            CompositeMomentum(momentum, matrix_plus(outer(velocity, body.first), multiply(skew(omega), body.second)))
        )
    for index, link in tree.inward():
        with tree.algebra.tape.block(f"composite momentum of link {tree.links[link.parent].name}"):
            momentum = link.rotation.rotate(total[index].momentum)
            moment = matrix_plus(link.rotation.congruence(total[index].moment), outer(momentum, link.position))
            above = total[link.parent]
            total[link.parent] = CompositeMomentum(plus(above.momentum, momentum), matrix_plus(above.moment, moment))
    return total


def _products(tree: Tree, twists: Sequence[Pair], virtual: Sequence[Pair]) -> list[Vector]:
    """Return B = 2 int V x y dm of the subtree of each link, in link axes about the link's origin. V are velocities by
    ``twists`` and y virtual velocities by ``virtual``, an angular and a linear vector for each link."""
    total: list[Vector] = []
    for link, (omega, velocity), (turn, slide) in zip(tree.links, twists, virtual, strict=True):
        body = link.inertia
        momentum = plus(scaled(body.mass, slide), cross(turn, body.first))
        turned = plus(cross(cross(omega, body.first), slide), apply(body.second, cross(omega, turn)))
        total.append(scaled(2.0, plus(cross(velocity, momentum), turned)))
    for index, link in tree.inward():
        total[link.parent] = plus(total[link.parent], link.rotation.rotate(total[index]))
    return total


def _loads(tree: Tree, base: BaseMotion) -> list[Wrench]:
    """Return for each link the wrench that its joint transmits for inertia and weight of the subtree, moment first, in
    link axes about the link's origin."""
    total = field_wrenches(tree, total_fields(tree, base, accelerations=True, gravity=True))
    for index, link in tree.inward():
        total[link.parent] = pair_plus(total[link.parent], carry(link, total[index]))
    return total


def inertial_partials(tree: Tree, base: BaseMotion) -> tuple[Square, Square, Square]:
    """Return K, C, M: partials of the inertia forces less weight in q (left-trivialised), v and a, each dense (nv, nv).
    ``base`` is the motion of the base with gravity. For trees of rigid links."""
    algebra, links, nv = tree.algebra, tree.links, tree.nv
    K, C, M = blocks = tuple([[algebra.zero] * nv for _ in range(nv)] for _ in range(3))
    screws, twists = _motions(tree, base)
    bodies, flows, loads = composites(tree), _flows(tree, twists), _loads(tree, base)

    def add_column(index: int, k: int) -> None:
        """Add the entries that couple column ``k`` of a joint with columns of this joint and of all joints towards the
        root."""
        link, screw = links[index], screws[index][k]
        dof, ratio = link.dofs[k], link.coordinates.ratio
        by_q, by_v, by_a = _wrenches(algebra, screw, bodies[index], flows[index])
        rows = zip(project(link, by_q), project(link, by_v), project(link, by_a), strict=True)
        for row, values in zip(link.dofs, rows, strict=True):
            _add(blocks, row, dof, ratio * ratio, values)
        by_q = pair_plus(by_q, moved_load(screw.screw, loads[index]))
        work = flows[index].adjoint(screw.screw)
        while links[index].parent != ROOT:
            below = links[index]
            by_q, by_v, by_a = carry(below, by_q), carry(below, by_v), carry(below, by_a)
            work = below.rotation.rotate(work)
            index = below.parent
            above = links[index]
            both = above.coordinates.ratio * ratio
            projected = zip(project(above, by_q), project(above, by_v), project(above, by_a), strict=True)
            for row, there, values in zip(above.dofs, screws[index], projected, strict=True):
                _add(blocks, row, dof, both, values)
                turned = pair_dot(there.accelerated, by_a) + dot(there.turned[0], work)
                rated = pair_dot(there.rated, by_a) + dot(there.screw[0], work)
                _add(blocks, dof, row, both, (turned, rated, values[2]))

    for index, link in enumerate(links):
        with algebra.tape.block(f"partials, joint {link.joint.name}"):
            for k in range(len(link.columns)):
                add_column(index, k)
    for dof, rotor in tree.rotors():
        M[dof][dof] = M[dof][dof] + rotor
    return K, C, M


def _wrenches(
    algebra: Algebra, screw: Screws, body: RecordedInertia, flow: CompositeMomentum
) -> tuple[Wrench, Wrench, Wrench]:
    """Return the three changes of the inertia wrench of a subtree by q, v and a of a joint column, in moving axes."""

    def by(change: Pair) -> Wrench:
        return wrench(algebra, body, change[1], change[0])

    by_q = pair_plus(by(screw.accelerated), flow.coriolis(screw.turned[0]))
    by_v = pair_plus(by(screw.rated), flow.coriolis(screw.screw[0]))
    return by_q, by_v, by(screw.screw)


def _add(blocks: Sequence[Square], row: int, column: int, ratio: Scalar, values: Sequence[Scalar]) -> None:
    for block, value in zip(blocks, values, strict=True):
        block[row][column] = block[row][column] + ratio * value


@dataclass(frozen=True)
class Change:
    """Change of a subtree by q, v or a of a joint's column, in the axes of the joint's link.

    Attributes
    ----------
    virtual, acceleration : screws by which the virtual twist and the acceleration of all its bodies change
    turn : angular velocity by which its twist changes
    """

    virtual: Wrench
    turn: Vector
    acceleration: Wrench


@dataclass(frozen=True)
class Effect:
    """Linear function from a ``Change`` to the change of a column's partial of the work in q, v or a."""

    of_virtual: Wrench
    of_turn: Vector
    of_acceleration: Wrench

    def to_parent(self, link: Link) -> Effect:
        """Return the function for changes in the axes of the parent of a link."""
        turned = link.rotation.rotate(self.of_turn)
        return Effect(carry(link, self.of_virtual), turned, carry(link, self.of_acceleration))

    def __call__(self, change: Change) -> Scalar:
        of_virtual = pair_dot(change.virtual, self.of_virtual)
        return of_virtual + dot(change.turn, self.of_turn) + pair_dot(change.acceleration, self.of_acceleration)


def _virtual_motions(tree: Tree, weights: Sequence[Scalar]) -> tuple[list[Pair], list[list[Pair]]]:
    """Return the virtual twists of all links for the velocity components ``weights``, (nv,), and their changes by q.
    For each column the change is the parent's virtual twist x screw. All are in link axes, angular part first."""
    algebra, zero = tree.algebra, tree.algebra.zero_vector
    twists: list[Pair] = []
    changes: list[list[Pair]] = []
    for link in tree.links:
        turn_up, slide_up = (zero, zero) if link.parent == ROOT else twists[link.parent]
        with algebra.tape.block(f"virtual motion of link {link.name}"):
            values = [link.coordinates.ratio * weights[dof] for dof in link.dofs]
            turn, slide = relative(algebra, link, values)
            carried = link.rotation.rotate_back(turn_up)
            moved = link.rotation.rotate_back(plus(slide_up, cross(turn_up, link.position)))
            changes.append([bracket((carried, moved), (column.angular, column.linear)) for column in link.columns])
            twists.append((plus(carried, turn), plus(moved, slide)))
    return twists, changes


def base_change(base: BaseMotion, omega: Vector, alpha: Vector, acceleration: Vector) -> Change:
    """Return the change of a tree by changes of the base's angular velocity, rad/s, angular acceleration, and
    acceleration minus gravity, m/s^2, (3,) each, in base axes."""
    zero = Scalar(omega[0].tape, ZERO)
    none = (zero, zero, zero)
    return Change((none, none), omega, (plus(alpha, cross(base.omega, omega)), acceleration))


class WorkHessian:
    """Second partials of weights . tau, with tau the inertia forces less weight of inverse dynamics, by composite
    bodies.

    Parameters
    ----------
    weights : (nv,) virtual velocities
    base_changes : changes of the motion of the base by further arguments, by number of the argument, from 3 nv on

    Attributes
    ----------
    entries : lower triangle by (row, column), for the arguments q, v and a, of ``nv`` numbers each, and further
        arguments
    """

    def __init__(
        self, tree: Tree, base: BaseMotion, weights: Sequence[Scalar], base_changes: Mapping[int, Change]
    ) -> None:
        """Record all entries of the Hessian, by changes by q, v and a of each joint column and sums over outward
        links."""
        self.base_changes = base_changes
        self.tree, self.entries = tree, dict[tuple[int, int], Scalar]()
        algebra, zero = tree.algebra, tree.algebra.zero_vector
        screws, twists = _motions(tree, base)
        virtual, moved = _virtual_motions(tree, weights)
        bodies, loads, flows = composites(tree), _loads(tree, base), _flows(tree, twists)
        momenta, products = _flows(tree, virtual), _products(tree, twists, virtual)
        none = (zero, zero)
        self.changes = [
            [
                (
                    Change(turned, screw.turned[0], screw.accelerated),
                    Change(none, screw.screw[0], screw.rated),
                    Change(none, zero, screw.screw),
                )
                for screw, turned in zip(*of_link, strict=True)
            ]
            for of_link in zip(screws, moved, strict=True)
        ]
        for index, link in enumerate(tree.links):
            body, flow, momentum = bodies[index], flows[index], momenta[index]
            with algebra.tape.block(f"second partials, joint {link.joint.name}"):
                spin = momentum.spin
                for k, (screw, turned) in enumerate(zip(screws[index], moved[index], strict=True)):
                    by_q, by_v, by_a = _wrenches(algebra, screw, body, flow)
                    by_q = pair_plus(by_q, moved_load(screw.screw, loads[index]))
                    turning = minus(flow.adjoint(turned), momentum.adjoint(screw.turned))
                    turning = plus(turning, cross(screw.screw[0], products[index]))
                    moved_momentum = moved_load(screw.screw, (spin, momentum.momentum))
                    pushed = pair_plus(wrench(algebra, body, turned[1], turned[0]), moved_momentum)
                    twisting = scaled(-1.0, momentum.adjoint(screw.screw))
                    effects = Effect(by_q, turning, pushed), Effect(by_v, twisting, none), Effect(by_a, zero, none)
                    self._fill(index, k, effects)

    def _fill(self, index: int, k: int, effects: tuple[Effect, ...]) -> None:
        """Add to ``entries`` the derivatives in column ``k`` of joint ``index`` and in all columns of this joint,
        joints towards the root, and the base. ``effects`` are linear functions for q, v and a of the column."""
        links, link = self.tree.links, self.tree.links[index]
        for dof, changes in zip(link.dofs, self.changes[index], strict=True):
            both = link.coordinates.ratio * link.coordinates.ratio
            for block in range(3):
                self._add((block, link.dofs[k]), (0, dof), both * effects[block](changes[0]), half=block == 0)
            self._add((1, link.dofs[k]), (1, dof), both * effects[1](changes[1]), half=True)
        below = index
        while links[below].parent != ROOT:
            effects = tuple(effect.to_parent(links[below]) for effect in effects)
            below = links[below].parent
            both = links[below].coordinates.ratio * link.coordinates.ratio
            for dof, changes in zip(links[below].dofs, self.changes[below], strict=True):
                for block, effect in enumerate(effects):
                    for position, change in enumerate(changes):
                        self._add((block, link.dofs[k]), (position, dof), both * effect(change))
        if self.base_changes:
            effects = tuple(effect.to_parent(links[below]) for effect in effects)
        for argument, change in self.base_changes.items():
            for block, effect in enumerate(effects):
                entry = argument, block * self.tree.nv + link.dofs[k]
                value = link.coordinates.ratio * effect(change)
                self.entries[entry] = self.entries.get(entry, self.tree.algebra.zero) + value

    def _add(self, row: tuple[int, int], column: tuple[int, int], value: Scalar, *, half: bool = False) -> None:
        """Add to ``entries`` the derivative in two coordinates, (block, component) each, with 0, 1, 2 for q, v, a.
        ``half``: the other order of the two columns of one joint follows, and the entry is their mean."""
        i, j = (block * self.tree.nv + dof for block, dof in (row, column))
        if half and i != j:
            value = 0.5 * value
        elif not half and i == j:  # two links that move by one coordinate
            value = 2.0 * value
        entry = max(i, j), min(i, j)
        self.entries[entry] = self.entries.get(entry, self.tree.algebra.zero) + value


def differentiated_partials(tree: Tree, base: BaseMotion) -> tuple[Square, Square, Square]:
    """Return K, C, M, (nv, nv) each, as ``inertial_partials`` does, for trees with elastic bodies. The recorded
    recursion of inverse dynamics is differentiated on the tape."""
    algebra, nv = tree.algebra, tree.nv
    tau = inverse_dynamics(tree, base, [None] * len(tree.links))
    seeds = motion_directions(tree)
    blocks = tuple([[algebra.zero] * nv for _ in range(nv)] for _ in range(3))
    with algebra.tape.block("partials of inertia forces"):
        tangents = forward_partials(algebra.tape, [value.ref for value in tau], seeds)
    for row, tangent in enumerate(tangents):
        for direction, ref in tangent.items():
            block, column = divmod(direction, nv)
            blocks[block][row][column] = Scalar(algebra.tape, ref)
    K, C, M = blocks
    return K, C, M
