"""Rotations on a tape as products of factors, each applied with the fewest operations.

A constant right-angle factor is free, a rotation about a coordinate axis costs 4 multiplications and 2 additions per
vector, and a symmetric matrix turns with 8 multiplications and 8 additions instead of two full products (one
auxiliary w serves all four entries).
"""

from __future__ import annotations

from eomgen.base.data import dataclass
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, multiply, transpose


@dataclass(frozen=True)
class MatrixFactor:
    """A rotation given by a matrix R, (3, 3)."""

    matrix: Matrix

    def rotate(self, x: Vector) -> Vector:
        """Return R x."""
        return apply(self.matrix, x)

    def rotate_back(self, x: Vector) -> Vector:
        """Return R^T x."""
        return apply(transpose(self.matrix), x)

    def congruence(self, A: Matrix) -> Matrix:
        """Return R A R^T, (3, 3); symmetric by structure for a symmetric A."""
        planar = self._planar()
        if planar is not None:
            return planar.congruence(A)
        B = multiply(multiply(self.matrix, A), transpose(self.matrix))
        if any(A[r][c].ref != A[c][r].ref for r, c in ((0, 1), (0, 2), (1, 2))):
            return B
        return (B[0], (B[0][1], B[1][1], B[1][2]), (B[0][2], B[1][2], B[2][2]))

    def _planar(self) -> PlanarFactor | None:
        """Return this rotation as a rotation about a coordinate axis. None if there is no such axis, or if the angle is
        a right angle, which costs no operation here."""
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            cosine, sine = self.matrix[i][i], self.matrix[j][i]
            across = (self.matrix[k][i], self.matrix[k][j], self.matrix[i][k], self.matrix[j][k])
            # a turn by 1e-9 about another axis leaves a 1 on the diagonal in double precision, and is none about this
            # axis
            if not all(entry.is_zero for entry in across):
                continue
            if self.matrix[k][k].constant == 1.0 and not (cosine.is_zero or sine.is_zero):
                return PlanarFactor(k, cosine, sine)
        return None


@dataclass(frozen=True)
class PlanarFactor:
    """A rotation about coordinate axis ``axis`` by an angle with the given cosine and sine."""

    axis: int
    cosine: Scalar
    sine: Scalar

    @property
    def matrix(self) -> Matrix:
        """Return the matrix R."""
        algebra = Algebra(self.cosine.tape)
        i, j = (self.axis + 1) % 3, (self.axis + 2) % 3
        rows = [[algebra.one if r == c else algebra.zero for c in range(3)] for r in range(3)]
        rows[i][i] = rows[j][j] = self.cosine
        rows[i][j], rows[j][i] = -self.sine, self.sine
        return algebra.matrix(rows)

    def rotate(self, x: Vector) -> Vector:
        """Return R x."""
        i, j = (self.axis + 1) % 3, (self.axis + 2) % 3
        y = list(x)
        y[i] = self.cosine * x[i] - self.sine * x[j]
        y[j] = self.sine * x[i] + self.cosine * x[j]
        return (y[0], y[1], y[2])

    def rotate_back(self, x: Vector) -> Vector:
        """Return R^T x."""
        return PlanarFactor(self.axis, self.cosine, -self.sine).rotate(x)

    def congruence(self, A: Matrix) -> Matrix:
        """Return R A R^T, by 8 multiplications for a symmetric A."""
        k, i, j = self.axis, (self.axis + 1) % 3, (self.axis + 2) % 3
        B = [list(row) for row in A]
        symmetric = A[i][j].ref == A[j][i].ref
        difference, total = A[i][i] - A[j][j], A[i][j] + A[j][i]
        w = self.sine * difference + self.cosine * total
        shift, turn = self.sine * w, self.cosine * w
        B[i][i], B[j][j] = A[i][i] - shift, A[j][j] + shift
        if symmetric:
            B[i][j] = B[j][i] = turn - A[i][j]
        else:
            B[i][j], B[j][i] = turn - A[j][i], turn - A[i][j]
        B[i][k], B[j][k] = self.cosine * A[i][k] - self.sine * A[j][k], self.sine * A[i][k] + self.cosine * A[j][k]
        B[k][i], B[k][j] = self.cosine * A[k][i] - self.sine * A[k][j], self.sine * A[k][i] + self.cosine * A[k][j]
        return tuple((row[0], row[1], row[2]) for row in B)  # type: ignore[return-value]  # three rows


@dataclass(frozen=True)
class FactoredRotation:
    """A product of factors, first factor outermost: child axes to parent axes."""

    factors: tuple[MatrixFactor | PlanarFactor, ...]

    def rotate(self, x: Vector) -> Vector:
        """Take components in the child to components in the parent."""
        for factor in reversed(self.factors):
            x = factor.rotate(x)
        return x

    def rotate_back(self, x: Vector) -> Vector:
        """Take components in the parent to components in the child."""
        for factor in self.factors:
            x = factor.rotate_back(x)
        return x

    def congruence(self, A: Matrix) -> Matrix:
        """Return R A R^T."""
        for factor in reversed(self.factors):
            A = factor.congruence(A)
        return A

    def matrix(self, algebra: Algebra) -> Matrix:
        """Return the matrix R, child axes to parent axes."""
        product = algebra.identity
        for factor in self.factors:
            product = multiply(product, factor.matrix)
        return product
