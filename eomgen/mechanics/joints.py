"""Joints as compositions of elementary motions: the pose of each and the columns of its motion subspace, in the moved frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import sympy

from eomgen.scene.joint import SIZES, Joint
from eomgen.symbolic.kernel import Kernel
from eomgen.symbolic.rotation import MatrixFactor, PlanarFactor, Rotation
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, plus, scaled
from eomgen.symbolic.tape import Op

Direction = tuple[float, float, float]
_IDENTITY: tuple[Direction, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

#: Groups of joints whose coordinates are not plain numbers.
GROUPS = {"spherical": "SO3", "free": "SE3"}

#: Elementary motions that turn about one axis.
TURNING = frozenset({"revolute", "helical"})


@dataclass(frozen=True)
class Motion:
    """An elementary motion, whose motion subspace is constant in the frame that it moves.

    Attributes
    ----------
    kind : revolute, prismatic (along one or more axes), helical, spherical or free
    axes : unit vectors in the axes of the links
    components : those of the joint's velocity that drive the columns, in order
    """

    kind: str
    axes: tuple[Direction, ...]
    components: tuple[int, ...]


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


def motions_of(joint: Joint) -> tuple[tuple[Direction, ...], tuple[Motion, ...]]:
    """Return the elementary motions that a joint is composed of, from the parent to the child, and their axes in the child's.

    Between two motions of a joint there is a link without mass. One screw with two columns would do for a cylindrical joint; it
    needs as many operations, and more in partials.

    Returns
    -------
    axes : the axes of the joint's links in the child body's axes, as columns: the body's own, unless a turn is about a skew axis;
        then the axis of turning is the links' z, and where there are two axes, both are coordinate axes
    motions : with axes in link axes; none for a fixed joint
    """
    axis, second, axes = joint.axis, joint.second_axis, _IDENTITY
    if joint.type in ("universal", "planar"):
        turning = (axis, second) if joint.type == "universal" else (axis,)
        if not all(_exact(direction) for direction in turning):
            axes = tuple(zip(second, perpendicular(axis, second), axis, strict=True))
            axis, second = _IDENTITY[2], _IDENTITY[0]
    elif joint.type in ("revolute", "helical", "cylindrical") and not _exact(axis):
        axes, axis = aligning_turn(axis), _IDENTITY[2]
    components = tuple(range(SIZES[joint.type][1]))
    match joint.type:
        case "fixed":
            return axes, ()
        case "universal":
            return axes, (Motion("revolute", (axis,), (0,)), Motion("revolute", (second,), (1,)))
        case "cylindrical":
            return axes, (Motion("prismatic", (axis,), (1,)), Motion("revolute", (axis,), (0,)))
        case "planar":
            in_plane = (second, perpendicular(axis, second))
            return axes, (Motion("prismatic", in_plane, (1, 2)), Motion("revolute", (axis,), (0,)))
        case "spherical" | "free":
            return axes, (Motion(joint.type, (), components),)
        case _:
            return axes, (Motion(joint.type, (axis,), components),)


def _exact(axis: Direction) -> bool:
    return any(abs(component) == 1.0 for component in axis)


def perpendicular(a: Direction, b: Direction) -> Direction:
    """Return the unit vector that completes two perpendicular ones to a right-handed frame."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def aligning_turn(axis: Direction) -> tuple[Direction, ...]:
    """Return a constant rotation whose third column is ``axis``; exact for coordinate axes."""
    smallest = min(range(3), key=lambda k: abs(axis[k]))
    first = [-axis[smallest] * component for component in axis]
    first[smallest] += 1.0
    length = math.sqrt(sum(component * component for component in first))
    x = [component / length for component in first]
    y = [axis[1] * x[2] - axis[2] * x[1], axis[2] * x[0] - axis[0] * x[2], axis[0] * x[1] - axis[1] * x[0]]
    return tuple((x[k], y[k], axis[k]) for k in range(3))


def columns_of(algebra: Algebra, kind: str, axes: Sequence[Vector], pitch: Scalar) -> tuple[Column, ...]:
    """Return the motion subspace: about and along axes, or (spherical and free) in the link's own axes."""
    zero, units = algebra.zero_vector, algebra.identity
    match kind:
        case "revolute":
            return (Column(axes[0], zero),)
        case "prismatic":
            return tuple(Column(zero, axis) for axis in axes)
        case "helical":
            return (Column(axes[0], scaled(pitch, axes[0])),)
        case "spherical":
            return tuple(Column(unit, zero) for unit in units)
        case _:
            return tuple(Column(unit, zero) for unit in units) + tuple(Column(zero, unit) for unit in units)


def pose_of(
    algebra: Algebra, kind: str, axes: Sequence[Vector], pitch: Scalar, orientation: Matrix, position: Vector,
    q: Sequence[Scalar],
) -> tuple[Rotation, Vector]:  # fmt: skip
    """Return the pose of an elementary motion's frame in what carries it, at coordinates q.

    Parameters
    ----------
    axes : the axis of turning, a coordinate axis up to sign; one or more unit vectors of prismatic motions, whose travels add up
    pitch : of helical motions, m/rad
    orientation, position : of the frame at neutral q
    """
    constant = MatrixFactor(orientation)
    if kind == "prismatic":
        for axis, travel in zip(axes, q, strict=True):
            position = plus(position, apply(orientation, scaled(travel, axis)))
        return Rotation((constant,)), position
    if kind in TURNING:
        axis = axes[0]
        index = next(k for k in range(3) if not axis[k].is_zero)
        angle = q[0] if axis[index].constant == 1.0 else -q[0]
        turn = PlanarFactor(index, algebra.call(Op.COS, angle), algebra.call(Op.SIN, angle))
        if kind == "helical":
            position = plus(position, apply(orientation, scaled(q[0] * pitch, axis)))
        return Rotation((constant, turn)), position
    turned = Rotation((constant, MatrixFactor(quaternion_matrix(algebra, list(q[:4])))))
    if kind == "spherical":
        return turned, position
    return turned, plus(position, apply(orientation, (q[4], q[5], q[6])))
