"""Inverse dynamics with time derivatives in one recursion: motion outwards, wrenches inwards, as paths in link axes.

Mueller and Kumar, Multibody Syst. Dyn. 53 (2021) 257, section 4, for any order, any joint and a moving base. Angular
acceleration is the derivative of the components of angular velocity, so its derivatives cost only one more of
those; the mass enters through products with constants only. That is 2284 operations for tau and two derivatives of a
7-joint arm, against 2755 when the operations of tau are differentiated one by one.

A path holds the components of a vector in moving axes with their time derivatives. For y = R^T x with R' = R w~, the
k-th derivative of x seen in the child is (d/dt + w~)^k y. So only R itself and cross products with w and its
derivatives are needed. With Y[k][m] = d^m/dt^m (d/dt + w~)^k y,

    Y[k+1][m] = Y[k][m+1] + sum_i binomial(m, i) w^(i) x Y[k][m-i]

leads from Y[k][0], the parent's derivatives, to Y[0][m], the child's, and back. Summed along k + m = constant, each
w^(i) is crossed with one sum only, which saves operations against the product rule for R^T x: a second
derivative of a planar rotation costs 16 instead of 22.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from eomgen.base.data import dataclass
from eomgen.mechanics.kinematics.fields import AccelerationField, Wrench, pair_minus, pair_plus, project
from eomgen.mechanics.tree.inertia import wrench
from eomgen.mechanics.tree.links import ROOT, Link, Tree
from eomgen.symbolic.rotation import FactoredRotation
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, cross, matrix_plus, minus, plus, scaled, skew

#: Derivatives from order 0 on.
Numbers = Sequence[Scalar]
Path = list[Vector]
Entry = Callable[[int, int], Vector]


def to_child(rotation: FactoredRotation, turn: Sequence[Vector], x: Sequence[Vector]) -> Path:
    """Return the path (components with their time derivatives) of R^T x in child axes; ``turn`` is the path of the
    child's angular velocity, in child axes."""
    return in_rotating_axes([rotation.rotate_back(value) for value in x], turn)


def in_rotating_axes(rotated: Sequence[Vector], turn: Sequence[Vector]) -> Path:
    """Return components and time derivatives of y in axes that rotate with w, from the derivatives (d/dt + w~)^k y.
    ``rotated`` holds these for k = 0, 1, ..., in the rotating axes; ``turn`` holds w and the time derivatives."""
    table = {(k, 0): value for k, value in enumerate(rotated)}

    def entry(k: int, m: int) -> Vector:
        if (k, m) not in table:
            last = k + m - 1
            table[k, m] = minus(rotated[k + m], _sum_of_cross_products(turn, entry, range(k, last + 1), last))
        return table[k, m]

    return [entry(0, m) for m in range(len(rotated))]


def to_parent(rotation: FactoredRotation, turn: Sequence[Vector], y: Sequence[Vector]) -> Path:
    """Return R y with time derivatives, components in parent axes, as many as ``y`` has entries. ``turn`` is the
    child's angular velocity relative to the parent with derivatives, ``y`` the vector, both in child axes."""
    table = {(0, m): value for m, value in enumerate(y)}

    def entry(k: int, m: int) -> Vector:
        if (k, m) not in table:
            table[k, m] = plus(y[k + m], _sum_of_cross_products(turn, entry, range(k), k + m - 1))
        return table[k, m]

    return [rotation.rotate(entry(k, 0)) for k in range(len(y))]


def _sum_of_cross_products(turn: Sequence[Vector], entry: Entry, rows: range, last: int) -> Vector:
    """Return the sum over rows k and orders i of binomial(last - k, i) w^(i) x Y[k][last - k - i]. ``turn`` holds w and
    derivatives, ``entry(k, m)`` returns Y[k][m]."""

    def product(i: int) -> Vector:
        sources = [(math.comb(last - k, i), entry(k, last - k - i)) for k in rows if last - k >= i]
        return cross(turn[i], _weighted_sum(sources))

    total = product(0)
    for i in range(1, last - rows.start + 1):
        total = plus(total, product(i))
    return total


def _weighted_sum(sources: Sequence[tuple[int, Vector]]) -> Vector:
    """Return the sum of weight * vector over ``sources``, which has pairs (integer weight, vector). The plain sum is
    recorded first, as it also occurs at the order below."""
    total = sources[0][1]
    for _, vector in sources[1:]:
        total = plus(total, vector)
    for weight, vector in sources:
        if weight == 2:
            total = plus(total, vector)
        elif weight > 2:
            total = plus(total, scaled(weight - 1, vector))
    return total


def product(x: Numbers, y: Numbers, order: int) -> Scalar:
    """Return the ``order``-th time derivative of x y by Leibniz' rule; ``x`` and ``y`` hold values and derivatives.
    Equal weights are multiplied once."""
    total = x[0] * y[order]
    if order:
        total = x[order] * y[0] + total
    for k in range(1, (order + 1) // 2):
        total = total + math.comb(order, k) * (x[k] * y[order - k] + x[order - k] * y[k])
    if order and order % 2 == 0:
        half = order // 2
        total = total + (math.comb(order, half) * x[half]) * y[half]
    return total


def square(x: Numbers, order: int) -> Scalar:
    """Return the ``order``-th time derivative of x^2; ``x`` holds the value and derivatives."""
    if order == 0:
        return x[0] * x[0]
    if order % 2:
        total = (2.0 * x[order]) * x[0]
        for k in range(1, (order + 1) // 2):
            total = total + (2.0 * math.comb(order, k)) * (x[k] * x[order - k])
        return total
    half = order // 2
    total = 2.0 * (x[0] * x[order])
    for k in range(1, half):
        total = total + (2.0 * math.comb(order, k)) * (x[k] * x[order - k])
    return total + (math.comb(order, half) * x[half]) * x[half]


def cross_path(x: Sequence[Vector], y: Sequence[Vector], order: int) -> Vector:
    """Return the ``order``-th time derivative of x cross y; ``x`` and ``y`` hold vectors and derivatives."""
    total = cross(x[0], y[order])
    for k in range(1, order + 1):
        total = plus(total, scaled(math.comb(order, k), cross(x[k], y[order - k])))
    return total


def centripetal_path(omega: Sequence[Vector], order: int) -> Matrix:
    """Return the ``order``-th time derivative of omega~ omega~, (3, 3), symmetric by structure. ``omega`` holds the
    angular velocity and derivatives."""
    x, y, z = ([value[k] for value in omega] for k in range(3))
    xx, yy, zz = (square(component, order) for component in (x, y, z))
    xy, xz, yz = product(x, y, order), product(x, z, order), product(y, z, order)
    return ((-(yy + zz), xy, xz), (xy, -(xx + zz), yz), (xz, yz, -(xx + yy)))


def at_path(fields: Sequence[AccelerationField], position: Sequence[Vector], order: int) -> Vector:
    """Return the ``order``-th time derivative of the acceleration at a position that moves in the field's axes,
    components. ``fields`` and ``position`` hold values and derivatives."""
    total = fields[order].at(position[0])
    for k in range(1, order + 1):
        if any(not value.is_zero for value in position[k]):
            gradient = matrix_plus(fields[order - k].symmetric, skew(fields[order - k].alpha))
            total = plus(total, scaled(math.comb(order, k), apply(gradient, position[k])))
    return total


@dataclass(frozen=True)
class TreeDrive:
    """Motion that drives a tree.

    Attributes
    ----------
    velocities : for each velocity component v, a, j, ... up to the wanted order + 1
    omega : path of the base's angular velocity in base axes, up to order + 1
    acceleration : path of the acceleration of the base's origin minus gravity, in base axes, up to the order
    """

    velocities: Sequence[Sequence[Scalar]]
    omega: Path
    acceleration: Path


def inverse_dynamics_path(
    tree: Tree, drive: TreeDrive, loads: Sequence[Sequence[Wrench] | None], order: int
) -> list[list[Scalar]]:
    """Return inverse dynamics tau, (nv,), and the time derivatives up to ``order``, without joint efforts.

    Parameters
    ----------
    drive : motion of joints and base with derivatives
    loads : by link, the applied wrench in link axes and the time derivatives; None for no load
    """
    algebra = tree.algebra
    turns, fields = _fields(tree, drive, order)
    total: list[list[Wrench]] = []
    for index, link in enumerate(tree.links):
        with algebra.tape.block(f"derivatives of the inertia forces of link {link.name}"):
            net = [wrench(algebra, link.inertia, field.origin, field.alpha, field.symmetric) for field in fields[index]]
            applied = loads[index]
            total.append(net if applied is None else [pair_minus(x, y) for x, y in zip(net, applied, strict=True)])
    for index, link in tree.inward():
        with algebra.tape.block(f"derivatives of the wrench at joint {link.joint.name}"):
            carried = _wrench_on_parent(link, turns[index], drive, total[index])
            total[link.parent] = list(map(pair_plus, total[link.parent], carried))
    return [
        tree.by_dof({index: _efforts(link, drive, total[index][k], k) for index, link in enumerate(tree.links)})
        for k in range(order + 1)
    ]


def _efforts(link: Link, drive: TreeDrive, load: Wrench, order: int) -> list[Scalar]:
    ratio = link.coordinates.ratio
    rates = [ratio * drive.velocities[dof][order + 1] for dof in link.dofs]
    works = project(link, load)
    return [work + rotor * rate for work, rotor, rate in zip(works, link.rotor_inertias, rates, strict=True)]


def joint_path(link: Link, drive: TreeDrive, order: int) -> tuple[Path, Path]:
    """Return angular and linear velocity across a joint, each with time derivatives up to ``order``, in child axes."""
    algebra = Algebra(link.rotor_inertias[0].tape)
    turn, slide = [algebra.zero_vector] * (order + 1), [algebra.zero_vector] * (order + 1)
    for column, dof in zip(link.columns, link.dofs, strict=True):
        for k in range(order + 1):
            rate = link.coordinates.ratio * drive.velocities[dof][k]
            turn[k] = plus(turn[k], scaled(rate, column.angular))
            slide[k] = plus(slide[k], scaled(rate, column.linear))
    return turn, slide


def position_path(link: Link, turn: Path, slide: Path, order: int) -> Path:
    """Return the path of a link's position in parent axes, up to ``order``."""
    return [link.position, *to_parent(link.rotation, turn, slide[:order])]


def _fields(tree: Tree, drive: TreeDrive, order: int) -> tuple[list[Path], list[list[AccelerationField]]]:
    """Return for each link the joint's angular velocity, and the link's acceleration field, both with time derivatives.
    Angular velocities go to ``order`` + 1, fields to ``order``; components are in link axes."""
    algebra = tree.algebra
    turns: list[Path] = []
    omegas: list[Path] = []
    fields: list[list[AccelerationField]] = []
    root = [
        AccelerationField(drive.acceleration[k], drive.omega[k + 1], centripetal_path(drive.omega, k))
        for k in range(order + 1)
    ]
    for link in tree.links:
        with algebra.tape.block(f"derivatives of the acceleration of link {link.name}"):
            turn, slide = joint_path(link, drive, order + 1)
            omega_up, field_up = (
                (drive.omega, root) if link.parent == ROOT else (omegas[link.parent], fields[link.parent])
            )
            carried = to_child(link.rotation, turn, omega_up)
            omega = [plus(x, y) for x, y in zip(carried, turn, strict=True)]
            position = position_path(link, turn, slide, order)
            origin = to_child(link.rotation, turn, [at_path(field_up, position, k) for k in range(order + 1)])
            for k in range(order + 1):
                travelling = plus(scaled(2.0, cross_path(carried, slide, k)), cross_path(turn, slide, k))
                origin[k] = plus(plus(origin[k], travelling), slide[k + 1])
            turns.append(turn)
            omegas.append(omega)
            fields.append(
                [AccelerationField(origin[k], omega[k + 1], centripetal_path(omega, k)) for k in range(order + 1)]
            )
    return turns, fields


def _wrench_on_parent(link: Link, turn: Path, drive: TreeDrive, loads: Sequence[Wrench]) -> list[Wrench]:
    """Return the wrench (moment, force) that a link passes on to its parent, with its time derivatives, in the parent's
    axes about the parent's origin.

    Parameters
    ----------
    turn : path of the joint's angular velocity, in child axes
    drive : velocities of the tree, from which the linear velocity across the joint follows
    loads : wrench on the link and its time derivatives, in link axes
    """
    order = len(loads) - 1
    moments = to_parent(link.rotation, turn, [load[0] for load in loads])
    forces = to_parent(link.rotation, turn, [load[1] for load in loads])
    _, slide = joint_path(link, drive, order)
    position = position_path(link, turn, slide, order)
    return [(plus(moments[k], cross_path(position, forces, k)), forces[k]) for k in range(order + 1)]
