"""Stations: frames on a beam to which something is attached, moved by deflection and slope.

A station at x sits at (x + u - shortening, v, w) and is turned by exp of (twist, -w', v'). Both are kept whole: the
load from an attached body then stiffens the beam without further terms (Kane, Ryan and Banerjee 1987, shortening).
"""

from __future__ import annotations

from dataclasses import dataclass

from eomgen.lie import rotations
from eomgen.lie.algebra import TapeAlgebra
from eomgen.mechanics.shape_functions.shape_integrals import Station
from eomgen.mechanics.tree.beam_fields import Amplitudes
from eomgen.mechanics.tree.coordinates import Coordinates
from eomgen.mechanics.tree.joints import Column, quaternion_matrix
from eomgen.scene.bodies.beam import DeformationKind
from eomgen.symbolic.calculus.partials import jacobian_vector
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.rotation import MatrixFactor, PlanarFactor, Rotation
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, dot, plus, scaled
from eomgen.symbolic.tape import Ref

#: Axis of deflection, axis of rotation and its sign, of each kind.
DEFLECTS: dict[DeformationKind, int] = {"stretch": 0, "bending_y": 1, "bending_z": 2}
ROTATIONS: dict[DeformationKind, tuple[int, float]] = {
    "torsion": (0, 1.0),
    "bending_z": (1, -1.0),
    "bending_y": (2, 1.0),
}


@dataclass(frozen=True)
class StationMotion:
    """Pose of a station in the beam's frame, and its motion subspace.

    Attributes
    ----------
    angle : rotation vector (twist, -w', v')
    columns : (n,) motion subspace in the station's axes; it depends on the coordinates
    bias : angular and linear acceleration in the station's axes that rates alone give
    shortening : (n, n) H(x), zero without stiffening
    """

    rotation: Rotation
    angle: Vector
    position: Vector
    columns: tuple[Column, ...]
    bias: tuple[Vector, Vector]
    shortening: tuple[Amplitudes, ...]


def moves(station: Station) -> bool:
    """Return whether any elastic coordinate translates or rotates a station."""
    return bool(station.value.any() or station.slope.any())


def station_motion(
    algebra: Algebra,
    kinds: tuple[DeformationKind, ...],
    station: Station,
    x: float,
    coordinates: Coordinates,
    *,
    shortens: bool,
) -> StationMotion:
    """Return pose and motion of the station at x on a beam's axis, in the beam's frame."""
    q, v = coordinates.q, coordinates.v
    zero = algebra.zero
    shortening = [
        tuple(algebra.scalar(float(entry) if shortens else 0.0) for entry in row) for row in station.shortening
    ]
    shortened = [_product(row, q, zero) for row in shortening]
    moving, turning = [], []
    for k, kind in enumerate(kinds):
        value, slope = float(station.value[k]), float(station.slope[k])
        deflects, turns = [zero, zero, zero], [zero, zero, zero]
        if kind in DEFLECTS:
            deflects[DEFLECTS[kind]] = algebra.scalar(value)
        if kind in ROTATIONS:
            axis, sign = ROTATIONS[kind]
            turns[axis] = algebra.scalar(sign * (value if kind == "torsion" else slope))
        moving.append((deflects[0] - shortened[k], deflects[1], deflects[2]))
        turning.append((turns[0], turns[1], turns[2]))
    linear = [algebra.vector([m[0] + 0.5 * s, m[1], m[2]]) for m, s in zip(moving, shortened, strict=True)]
    position = _combined((algebra.scalar(x), zero, zero), linear, q)
    angle = _combined(algebra.zero_vector, turning, q)
    rotation, tangent = _turned(algebra, angle)
    columns = tuple(
        Column(apply(tangent, turns) if tangent is not None else turns, rotation.rotate_back(moved))
        for turns, moved in zip(turning, moving, strict=True)
    )
    drawn_in = zero
    for rate, row in zip(v, shortening, strict=True):
        drawn_in = drawn_in - rate * _product(row, v, zero)
    twisting = algebra.zero_vector
    if tangent is not None:
        rate_of_turn = apply(tangent, _combined(algebra.zero_vector, turning, v))
        rates: dict[Ref | InputSymbol, Ref] = {
            InputSymbol("q", number): rate.ref for number, rate in zip(coordinates.components, v, strict=True)
        }
        accelerations = jacobian_vector(algebra.tape, [component.ref for component in rate_of_turn], rates)
        twisting = algebra.vector([Scalar(algebra.tape, ref) for ref in accelerations])
    bias = twisting, rotation.rotate_back((drawn_in, zero, zero))
    return StationMotion(rotation, angle, position, columns, bias, tuple(shortening))


def _turned(algebra: Algebra, angle: Vector) -> tuple[Rotation, Matrix | None]:
    """Return exp(angle) and its tangent; no tangent if the axis of turning is fixed."""
    axes = [k for k in range(3) if not angle[k].is_zero]
    if not axes:
        return Rotation(()), None
    if len(axes) == 1:
        (axis,) = axes
        return (
            Rotation((PlanarFactor(axis, algebra.call(Op.COS, angle[axis]), algebra.call(Op.SIN, angle[axis])),)),
            None,
        )
    on_tape = TapeAlgebra(algebra.tape)
    quaternion = [on_tape.scalar(part) for part in rotations.exponential(on_tape, angle)]
    tangent = algebra.matrix(rotations.tangent(on_tape, angle))
    return Rotation((MatrixFactor(quaternion_matrix(algebra, quaternion)),)), tangent


def _combined(start: Vector, columns: list[Vector], amplitudes: Amplitudes) -> Vector:
    total = start
    for column, amplitude in zip(columns, amplitudes, strict=True):
        total = plus(total, scaled(amplitude, column))
    return total


def _product(row: Amplitudes, amplitudes: Amplitudes, zero: Scalar) -> Scalar:
    return dot(row, amplitudes) if row else zero
