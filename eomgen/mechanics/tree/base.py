"""Prescribed motion of the base: struct of pose, twist and twist derivative, filled by ``base(t)`` or by the caller.

Rotations are intrinsic, in order. Everything else sees the base through this struct only, so M and h never change with
its law.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.base.data import dataclass
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import record
from eomgen.mechanics.tree.joints import quaternion_matrix
from eomgen.mechanics.tree.links import parameter_scalars
from eomgen.scene.bodies.model import Base
from eomgen.scene.rotations import coordinate_axis
from eomgen.scene.scene import Scene
from eomgen.symbolic.calculus.partials import jacobian_vector
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.rotation import PlanarFactor
from eomgen.symbolic.scalar import (
    Algebra,
    Matrix,
    Scalar,
    Vector,
    apply,
    cross,
    minus,
    multiply,
    plus,
    scaled,
    transpose,
)
from eomgen.symbolic.tape import ONE, Tape
from eomgen.system.system import BASE_LAYOUT, BASE_SIZE, base_place


@dataclass(frozen=True)
class BaseMotion:
    """Motion of the base in base axes, (3,) each: omega, alpha, acceleration of the origin, gravity."""

    omega: Vector
    alpha: Vector
    acceleration: Vector
    gravity: Vector


@dataclass(frozen=True)
class BaseState:
    """Pose and twist of the base on the tape; without rotations the orientation is the identity by structure.

    ``struct`` holds the components in the order of BASE_LAYOUT; components that the law keeps at zero are zero by
    structure, ``zeros`` has the indices of these. Velocities are in base axes, the position and gravity in world axes.
    """

    moving: bool
    turning: bool
    struct: tuple[Scalar, ...]
    zeros: tuple[int, ...]
    orientation: Matrix
    position: Vector
    omega: Vector
    velocity: Vector
    omega_dot: Vector
    velocity_dot: Vector
    gravity_world: Vector

    def motion(self) -> BaseMotion:
        """Return the motion for acceleration fields: classical acceleration of the origin, and gravity in base axes."""
        acceleration = plus(self.velocity_dot, cross(self.omega, self.velocity))
        gravity = apply(transpose(self.orientation), self.gravity_world)
        return BaseMotion(self.omega, self.omega_dot, acceleration, gravity)


def resting_base(algebra: Algebra, gravity: Vector) -> BaseState:
    """Return a base at rest in the world."""
    zero = algebra.zero_vector
    return BaseState(False, False, (), (), algebra.identity, zero, zero, zero, zero, zero, gravity)


def base_state(algebra: Algebra, scene: Scene, gravity: Vector, *, disturbed: bool = False) -> BaseState:
    """Return the base as components of the input block ``base``, or at rest for a scene without base motion.

    Parameters
    ----------
    gravity : (3,), m/s^2, in world axes
    disturbed : whether accelerations of the base are disturbances, which differ from the law of the base
    """
    if scene.base is None:
        return resting_base(algebra, gravity)
    turning = bool(scene.base.rotations)
    zeros = _zeros(scene, scene.base)
    if disturbed:
        zeros = tuple(k for k in zeros if k not in _accelerations(turning=turning))
    struct = tuple(
        algebra.zero if k in zeros else Scalar(algebra.tape, algebra.tape.input("base", k)) for k in range(BASE_SIZE)
    )
    fields = {name: list(struct[base_place(name) : base_place(name) + size]) for name, size, _ in BASE_LAYOUT}
    return BaseState(
        moving=True,
        turning=turning,
        struct=struct,
        zeros=zeros,
        orientation=quaternion_matrix(algebra, fields["quaternion"]) if turning else algebra.identity,
        position=algebra.vector(fields["position"]),
        omega=algebra.vector(fields["omega"]) if turning else algebra.zero_vector,
        velocity=algebra.vector(fields["velocity"]),
        omega_dot=algebra.vector(fields["omega_dot"]) if turning else algebra.zero_vector,
        velocity_dot=algebra.vector(fields["velocity_dot"]),
        gravity_world=gravity,
    )


def _zeros(scene: Scene, base: Base) -> tuple[int, ...]:
    """Return the components of the base struct that are zero by the law of the base for all times and tunable
    parameters."""
    algebra = Algebra(Tape())
    law = base_law(algebra, base, parameter_scalars(algebra, scene))
    return tuple(k for k, value in enumerate(law) if value.is_zero)


def _accelerations(*, turning: bool) -> range:
    """Return the indices of the accelerations in the base struct, including angular accelerations for a base that may
    rotate."""
    return range(base_place("omega_dot" if turning else "velocity_dot"), BASE_SIZE)


def base_law(algebra: Algebra, base: Base, parameters: dict[str, Scalar]) -> list[Scalar]:
    """Return the base struct as functions of time, in the order of BASE_LAYOUT, from formulas of position and rotation.
    ``parameters`` are scalars by name."""

    def resolve(symbol: Symbol) -> Scalar:
        return Scalar(algebra.tape, algebra.tape.input("t")) if symbol.kind == "time" else parameters[symbol.name]

    x, x_dot, x_ddot = (
        algebra.vector(part) for part in zip(*(_rates(algebra, f, resolve) for f in base.position), strict=True)
    )
    quaternion = [algebra.one, algebra.zero, algebra.zero, algebra.zero]
    R, omega, alpha = algebra.identity, algebra.zero_vector, algebra.zero_vector
    for rotation in base.rotations:
        axis = algebra.vector(rotation.axis)
        angle, rate, acceleration = _rates(algebra, rotation.angle, resolve)
        turn = _about(algebra, rotation.axis, angle)
        carried = apply(transpose(turn), omega)
        alpha = plus(
            apply(transpose(turn), alpha), plus(cross(carried, scaled(rate, axis)), scaled(acceleration, axis))
        )
        omega = plus(carried, scaled(rate, axis))
        half = angle * 0.5
        sine = algebra.call(Op.SIN, half)
        quaternion = quaternion_product(quaternion, [algebra.call(Op.COS, half), *scaled(sine, axis)])
        R = multiply(R, turn)
    velocity = apply(transpose(R), x_dot)
    velocity_dot = minus(apply(transpose(R), x_ddot), cross(omega, velocity))
    return [*quaternion, *x, *omega, *velocity, *alpha, *velocity_dot]


def _rates(algebra: Algebra, formula: Formula, resolve: object) -> tuple[Scalar, Scalar, Scalar]:
    """Return value, first and second time derivative of a formula of time."""
    value = record(algebra, formula, resolve)  # type: ignore[arg-type]  # a Resolver
    time = InputSymbol("t", 0)
    first = jacobian_vector(algebra.tape, [value.ref], {time: ONE})
    second = jacobian_vector(algebra.tape, first, {time: ONE})
    return value, Scalar(algebra.tape, first[0]), Scalar(algebra.tape, second[0])


def _about(algebra: Algebra, axis: Sequence[float], angle: Scalar) -> Matrix:
    """Return the rotation matrix, (3, 3), about a constant unit axis (Rodrigues); planar for a coordinate axis."""
    cosine, sine = algebra.call(Op.COS, angle), algebra.call(Op.SIN, angle)
    coordinate = coordinate_axis(axis)
    if coordinate is not None:
        return PlanarFactor(coordinate.place, cosine, sine * coordinate.sense).matrix
    versine = 1.0 - cosine
    skewed = ((0, -1, 1), (1, 0, -1), (-1, 1, 0))
    rows = []
    for i in range(3):
        row = []
        for j in range(3):
            entry = versine * (axis[i] * axis[j])
            row.append(entry + cosine if i == j else entry + sine * (axis[3 - i - j] * skewed[i][j]))
        rows.append(row)
    return algebra.matrix(rows)


def quaternion_product(p: Sequence[Scalar], r: Sequence[Scalar]) -> list[Scalar]:
    """Return the Hamilton product p r of two quaternions (w, x, y, z)."""
    w, x, y, z = p
    a, b, c, d = r
    return [
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    ]
