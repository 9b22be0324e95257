"""Forward dynamics: M = L^T D L along the tree with three substitutions, or the articulated-body algorithm
(Featherstone 1983), and the choice between both.

Featherstone, Rigid Body Dynamics Algorithms (2008), section 6.5 and chapter 7. The algorithm that is expected to be
faster is kept, and articulated bodies if the elimination of M loses digits.

Articulated bodies are linear in the number of links, column by column. Accelerations are classical ones of link
origins. The subtree of a link with free joints responds to an acceleration (alpha, a) by the moment A alpha + B a + n
and the force B^T alpha + C a + f. For long trees this takes fewer operations than factoring M.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.base.data import dataclass
from eomgen.mechanics.dynamics import separated
from eomgen.mechanics.dynamics.elimination import solve_tree
from eomgen.mechanics.kinematics.fields import (
    Wrench,
    angular_velocities,
    carry,
    centripetal,
    pair_minus,
    relative,
    total_fields,
)
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.inertia import RecordedInertia, wrench
from eomgen.mechanics.tree.links import ROOT, Link, Tree
from eomgen.symbolic.latency import fastest, waits
from eomgen.symbolic.scalar import (
    Algebra,
    Matrix,
    Scalar,
    Vector,
    all_zero,
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
from eomgen.symbolic.summation import sums_by_readiness
from eomgen.symbolic.tape import ZERO
from eomgen.system.system import Block


@dataclass(frozen=True)
class ArticulatedInertia:
    """Articulated inertia [[A, B], [B^T, C]] of a subtree and the bias wrench, in link axes about the link's origin."""

    A: Matrix
    B: Matrix
    C: Matrix
    moment: Vector
    force: Vector

    def load(self, alpha: Vector, a: Vector) -> Wrench:
        """Return the inertial wrench A alpha + B a, B^T alpha + C a."""
        return plus(apply(self.A, alpha), apply(self.B, a)), plus(apply(transpose(self.B), alpha), apply(self.C, a))

    def __add__(self, other: ArticulatedInertia) -> ArticulatedInertia:
        return ArticulatedInertia(
            matrix_plus(self.A, other.A),
            matrix_plus(self.B, other.B),
            matrix_plus(self.C, other.C),
            plus(self.moment, other.moment),
            plus(self.force, other.force),
        )

    def to_parent(self, link: Link) -> ArticulatedInertia:
        """Return the articulated inertia and bias wrench in the parent's axes about the parent's origin."""
        A, B, C = (link.rotation.congruence(part) for part in (self.A, self.B, self.C))
        arm = skew(link.position)
        moved = matrix_plus(B, multiply(arm, C))
        turned = matrix_plus(multiply(arm, transpose(moved)), multiply(B, transpose(arm)))
        moment, force = carry(link, (self.moment, self.force))
        return ArticulatedInertia(_symmetric(matrix_plus(A, turned)), moved, C, moment, force)


def _symmetric(A: Matrix) -> Matrix:
    """Return a symmetric matrix with its lower triangle replaced by references to the upper triangle."""
    return (A[0], (A[0][1], A[1][1], A[1][2]), (A[0][2], A[1][2], A[2][2]))


def _rigid(algebra: Algebra, inertia: RecordedInertia, bias: Wrench) -> ArticulatedInertia:
    """Return the articulated body of one rigid link; ``bias`` is the wrench at zero acceleration."""
    second = inertia.second
    trace = second[0][0] + second[1][1] + second[2][2]
    A = tuple(tuple((trace - second[i][j]) if i == j else -second[i][j] for j in range(3)) for i in range(3))
    C = algebra.matrix([[inertia.mass if i == j else algebra.zero for j in range(3)] for i in range(3)])
    return ArticulatedInertia(A, skew(inertia.first), C, *bias)  # type: ignore[arg-type]  # three rows of three


@dataclass(frozen=True)
class _Elimination:
    """One eliminated velocity component: vdot = (drive - moment . alpha - force . a) / pivot."""

    moment: Vector
    force: Vector
    inverse: Scalar
    drive: Scalar


def articulated_forward(
    tree: Tree, base: BaseMotion, loads: Sequence[Wrench | None], efforts: Sequence[Scalar]
) -> list[Scalar]:
    """Return vdot, (nv,), under gravity, applied wrenches and efforts, by the articulated-body algorithm.

    Parameters
    ----------
    tree : without dependent (mimic) joints, since columns are eliminated one by one
    base : motion in base axes
    loads : applied wrench per link about the link's origin in link axes, or None
    efforts : (nv,) generalized forces
    """
    algebra = tree.algebra
    omegas = angular_velocities(tree, base.omega)
    biases = [_bias(algebra, link, base.omega if link.parent == ROOT else omegas[link.parent]) for link in tree.links]
    bodies = []
    for link, omega, applied in zip(tree.links, omegas, loads, strict=True):
        with algebra.tape.block(f"inertia forces of link {link.name} at rest of its joints"):
            bias = wrench(algebra, link.inertia, algebra.zero_vector, algebra.zero_vector, centripetal(omega))
            bodies.append(_rigid(algebra, link.inertia, bias if applied is None else pair_minus(bias, applied)))
    kept: list[list[_Elimination]] = [[] for _ in tree.links]
    for index in reversed(range(len(tree.links))):
        link = tree.links[index]
        with algebra.tape.block(f"articulated body of link {link.name}"):
            body, kept[index] = _eliminate(link, bodies[index], biases[index], efforts)
            if link.parent != ROOT:
                bodies[link.parent] = bodies[link.parent] + body.to_parent(link)
    return _outward(tree, base, biases, kept)


def _bias(algebra: Algebra, link: Link, omega_up: Vector) -> tuple[Vector, Vector]:
    """Return the angular acceleration and origin acceleration that a link has from velocities alone, relative to the
    carried acceleration of its parent, in link axes. ``omega_up`` is the parent's angular velocity in parent axes."""
    turn, slide = relative(algebra, link, link.velocities)
    carried = link.rotation.rotate_back(omega_up)
    inward = link.rotation.rotate_back(cross(omega_up, cross(omega_up, link.position)))
    linear = plus(inward, plus(scaled(2.0, cross(carried, slide)), cross(turn, slide)))
    return cross(carried, turn), linear


def _eliminate(
    link: Link, body: ArticulatedInertia, bias: tuple[Vector, Vector], efforts: Sequence[Scalar]
) -> tuple[ArticulatedInertia, list[_Elimination]]:
    """Eliminate the joint's columns from a link's articulated body, last first. ``bias`` are the link's accelerations
    from velocities alone. Returns the remaining articulated body, as the parent's acceleration sees it, and the
    eliminated rows by column."""
    A, B, C, moment, force = body.A, body.B, body.C, body.moment, body.force
    eliminations: list[_Elimination] = []
    for k in reversed(range(len(link.columns))):
        w, u = link.columns[k].angular, link.columns[k].linear
        n, f = ArticulatedInertia(A, B, C, moment, force).load(w, u)
        pivot = dot(w, n) + dot(u, f) + link.rotor_inertias[k]
        inverse = Scalar(pivot.tape, pivot.tape.constant(1.0)) / pivot
        drive = efforts[link.dofs[k]] - (dot(w, moment) + dot(u, force))
        eliminations.insert(0, _Elimination(n, f, inverse, drive))
        n_scaled, f_scaled = scaled(inverse, n), scaled(inverse, f)
        A = _less(A, outer(n_scaled, n))
        B = _less(B, outer(n_scaled, f))
        C = _less(C, outer(f_scaled, f))
        moment, force = plus(moment, scaled(drive, n_scaled)), plus(force, scaled(drive, f_scaled))
        if link.rotor_inertias[k].is_zero:
            # Along a freed axis the body has no inertia left and transmits the effort: differences of equal numbers.
            zero, effort = Scalar(pivot.tape, ZERO), efforts[link.dofs[k]]
            if all_zero(u) and (axis := _coordinate_axis(w)) is not None:
                A = _with_row(transpose(_with_row(A, axis, zero)), axis, zero)
                B = _with_row(B, axis, zero)
                moment = _with(moment, axis, w[axis] * effort)
            elif all_zero(w) and (axis := _coordinate_axis(u)) is not None:
                C = _with_row(transpose(_with_row(C, axis, zero)), axis, zero)
                B = transpose(_with_row(transpose(B), axis, zero))
                force = _with(force, axis, u[axis] * effort)
    A, C = _symmetric(A), _symmetric(C)
    added = ArticulatedInertia(A, B, C, moment, force).load(*bias)
    return ArticulatedInertia(A, B, C, plus(moment, added[0]), plus(force, added[1])), eliminations


def _coordinate_axis(x: Vector) -> int | None:
    """Return the index of the only component of a unit vector along a coordinate axis, None for other vectors."""
    held = [index for index, component in enumerate(x) if not component.is_zero]
    return held[0] if len(held) == 1 and x[held[0]].constant in (1.0, -1.0) else None


def _with(x: Vector, index: int, value: Scalar) -> Vector:
    return (*x[:index], value, *x[index + 1 :])  # type: ignore[return-value]  # three components, as before


def _with_row(A: Matrix, index: int, value: Scalar) -> Matrix:
    return (*A[:index], (value, value, value), *A[index + 1 :])  # type: ignore[return-value]  # three rows, as before


def _less(A: Matrix, B: Matrix) -> Matrix:
    return (minus(A[0], B[0]), minus(A[1], B[1]), minus(A[2], B[2]))


def _outward(
    tree: Tree, base: BaseMotion, biases: Sequence[tuple[Vector, Vector]], kept: Sequence[Sequence[_Elimination]]
) -> list[Scalar]:
    """Return vdot, (nv,), by the outward recursion of the articulated-body algorithm. ``biases`` are accelerations from
    velocities alone, ``kept`` the eliminated rows, both by link."""
    algebra = tree.algebra
    start = (base.alpha, minus(base.acceleration, base.gravity))
    accelerations: list[tuple[Vector, Vector]] = []
    vdot: dict[int, list[Scalar]] = {}
    for index, link in enumerate(tree.links):
        with algebra.tape.block(f"acceleration of joint {link.joint.name}"):
            vdot[index] = []
            alpha_up, a_up = start if link.parent == ROOT else accelerations[link.parent]
            alpha = plus(link.rotation.rotate_back(alpha_up), biases[index][0])
            a = plus(link.rotation.rotate_back(plus(a_up, cross(alpha_up, link.position))), biases[index][1])
            for column, item in zip(link.columns, kept[index], strict=True):
                value = (item.drive - (dot(item.moment, alpha) + dot(item.force, a))) * item.inverse
                alpha, a = plus(alpha, scaled(value, column.angular)), plus(a, scaled(value, column.linear))
                vdot[index].append(value)
            accelerations.append((alpha, a))
    return tree.by_dof(vdot)


def forward_blocks(derivation: Derivation, *, ordered: bool = False) -> list[Block]:
    """Return vdot, (nv,), as the block of the term ``forward_dynamics``.

    Parameters
    ----------
    ordered : whether sums take first the terms that are ready first, if operations wait for one another; derivatives
        are recorded of the other sums, which they share with the mass matrix
    """
    tape, values = derivation.tape, _fastest(derivation)
    refs = [value.ref for value in values]
    alike = derivation.absolute or derivation.tree.deep  # bodies of long scenes have equal operations
    if ordered and not alike and not derivation.ill_scaled and waits(tape, refs):
        values = [Scalar(tape, ref) for ref in sums_by_readiness(tape, refs)]
    return [derivation.block("vdot", (len(values),), values, "time derivative of v")]


def _fastest(derivation: Derivation) -> list[Scalar]:
    """Return vdot, (nv,), by the algorithm that is expected to be the fastest and loses no digits. For deep or
    ill-scaled trees only articulated bodies are considered; elastic trees, joints that follow other joints and many
    absolute bodies, whose M has a block for each body, have M only."""
    loads = derivation.loads
    if not derivation.free_columns or (derivation.absolute and derivation.tree.large):
        return _by_mass_matrix(derivation)
    tree = derivation.tree if derivation.ill_scaled else derivation.grouped  # moved masses cost digits, too
    articulated = articulated_forward(tree, derivation.motion, loads.wrenches, loads.efforts)
    if derivation.tree.deep or derivation.ill_scaled:
        return articulated
    ways = [articulated, _by_mass_matrix(derivation)]
    # a way with more operations, hence more compile time and memory, has to gain 15 %
    return ways[fastest(derivation.tape, [[value.ref for value in values] for values in ways], 0.85)]


def _by_mass_matrix(derivation: Derivation) -> list[Scalar]:
    grouped, loads = derivation.grouped, derivation.loads
    fields = total_fields(grouped, derivation.motion, accelerations=False, gravity=True)
    net = separated.net_wrenches(grouped, fields, loads.wrenches)
    bias = separated.generalized_force(grouped, net, "bias force", separated.elastic_rows(grouped, fields))
    right = [effort - load for effort, load in zip(loads.efforts, bias, strict=True)]
    M = derivation.mass_rows
    with derivation.tape.block("elimination of the mass matrix from the tips to the root"):
        return solve_tree(M, right, derivation.tree.dof_parents())
