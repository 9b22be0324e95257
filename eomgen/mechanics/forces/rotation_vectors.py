"""Rotation vectors of relative orientations."""

from __future__ import annotations

from eomgen.lie import rotations
from eomgen.lie.algebra import TapeAlgebra
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Matrix, Vector


def rotation_vector(algebra: Algebra, R: Matrix) -> Vector:
    """Record the logarithm, (3,), rad, of a rotation matrix with an angle below pi."""
    trace = R[0][0] + R[1][1] + R[2][2]
    w = 0.5 * algebra.call(Op.SQRT, algebra.call(Op.MAX, trace + 1.0, algebra.scalar(1e-24)))
    share = algebra.one / (w * 4.0)
    skewed = (R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1])
    quaternion = [w, *(entry * share for entry in skewed)]
    x, y, z = rotations.logarithm(TapeAlgebra(algebra.tape), quaternion)
    return x, y, z
