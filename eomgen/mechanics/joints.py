"""Joints: pose of the child in the parent and the columns of the motion subspace, in the child's frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import sympy

from eomgen.symbolic.kernel import Kernel
from eomgen.symbolic.rotation import MatrixFactor, PlanarFactor, Rotation
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, plus, scaled
from eomgen.symbolic.tape import Op

#: Group, number of coordinates and of velocities of each joint type that moves.
GROUPS = {"revolute": ("R", 1, 1), "prismatic": ("R", 1, 1), "spherical": ("SO3", 4, 3), "free": ("SE3", 7, 6)}


@dataclass(frozen=True)
class Column:
    """One column of the motion subspace in the child's frame: angular part, and velocity of the child's origin."""

    angular: Vector
    linear: Vector


@cache
def quaternion_kernel() -> Kernel:
    """Derive the rotation matrix of a unit quaternion (w, x, y, z), from x' = p x p* by SymPy's quaternion product.

    The diagonal is written 1 - 2(..), which is orthogonal to first order in the quaternion's length error.
    """
    w, x, y, z = sympy.symbols("w x y z", real=True)
    p = sympy.Quaternion(w, x, y, z)
    columns = []
    for unit in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        turned = p * sympy.Quaternion(0, *unit) * p.conjugate()
        columns.append([sympy.expand(part) for part in (turned.b, turned.c, turned.d)])  # nine products of two symbols
    results = []
    for row in range(3):
        for column in range(3):
            entry = columns[column][row]
            if row == column:
                entry = sympy.expand(entry - (w**2 + x**2 + y**2 + z**2)) + 1  # |p| = 1; a sum of four squares
            results.append(_halved(entry))
    return Kernel(tuple(results))


def _halved(entry: sympy.Expr) -> sympy.Expr:
    """Write a quadratic entry as [1 +] 2 (..), one multiplication by two instead of one per term."""
    constant = entry.subs(dict.fromkeys(entry.free_symbols, 0))
    half = sympy.Add(*((term / 2) for term in sympy.Add.make_args(entry - constant)))
    return constant + sympy.Mul(2, half, evaluate=False)


def quaternion_matrix(algebra: Algebra, quaternion: list[Scalar]) -> Matrix:
    """Return the rotation matrix of a unit quaternion, body axes to reference axes."""
    r = quaternion_kernel().instantiate(algebra, dict(zip("wxyz", quaternion, strict=True)))
    return ((r[0], r[1], r[2]), (r[3], r[4], r[5]), (r[6], r[7], r[8]))


def columns_of(algebra: Algebra, kind: str, axis: Vector) -> tuple[Column, ...]:
    """Return the motion subspace: revolute about the axis, prismatic along it, spherical and free in body axes."""
    zero, units = algebra.zero_vector, algebra.identity
    match kind:
        case "revolute":
            return (Column(axis, zero),)
        case "prismatic":
            return (Column(zero, axis),)
        case "spherical":
            return tuple(Column(unit, zero) for unit in units)
        case _:
            return tuple(Column(unit, zero) for unit in units) + tuple(Column(zero, unit) for unit in units)


def pose_of(
    algebra: Algebra, kind: str, axis: Vector, orientation: Matrix, position: Vector, q: list[Scalar]
) -> tuple[Rotation, Vector]:
    """Return the child's pose in the parent at joint coordinates q.

    Parameters
    ----------
    axis : a coordinate axis (up to sign) for revolute joints; any unit vector for prismatic ones
    orientation, position : of the child's frame in the parent's at neutral q
    """
    if kind == "revolute":
        index = next(k for k in range(3) if not axis[k].is_zero)
        angle = q[0] if axis[index].constant == 1.0 else -q[0]
        turn = PlanarFactor(index, algebra.call(Op.COS, angle), algebra.call(Op.SIN, angle))
        return Rotation((MatrixFactor(orientation), turn)), position
    constant = Rotation((MatrixFactor(orientation),))
    if kind == "prismatic":
        return constant, plus(position, apply(orientation, scaled(q[0], axis)))
    turned = Rotation((MatrixFactor(orientation), MatrixFactor(quaternion_matrix(algebra, q[:4]))))
    if kind == "spherical":
        return turned, position
    return turned, plus(position, apply(orientation, (q[4], q[5], q[6])))
