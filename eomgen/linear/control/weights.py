"""The quadratic cost J = int x^T Q x + 2 x^T S u + u^T R u dt with x = [q, v], assembled from weighted outputs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.errors import UsageError
from eomgen.linear.control.plant import Plant, real_matrix

_ASYMMETRY = 1e-9


@dataclass(frozen=True)
class Weights:
    """Weights of a quadratic cost.

    Attributes
    ----------
    state : (2n, 2n) Q, positive semi-definite.
    effort : (m, m) R, positive definite if a gain is wanted.
    cross : (2n, m) S.
    """

    state: Array
    effort: Array
    cross: Array

    @classmethod
    def of(cls, plant: Plant, position: ArrayLike = 0.0, velocity: ArrayLike = 0.0, effort: ArrayLike = 0.0) -> Weights:
        """Return J = int q^T Q1 q + v^T Q2 v + u^T R u dt.

        Parameters
        ----------
        position, velocity, effort : (n, n), (n, n) and (m, m) matrices; or their diagonals; or one number for all.

        Raises
        ------
        UsageError
            A matrix of another size, not symmetric, or negative in some direction.
        """
        n, m = plant.n, plant.m
        state = np.zeros((2 * n, 2 * n))
        state[:n, :n] = weight("the weight of the coordinates", position, n)
        state[n:, n:] = weight("the weight of the velocities", velocity, n)
        return cls(state, weight("the weight of the efforts", effort, m), np.zeros((2 * n, m)))

    def plus_output(self, of_state: ArrayLike, of_effort: ArrayLike, cost: ArrayLike) -> Weights:
        """Return the cost plus the cost of an output y = F [q, v] + D u, int y^T W y dt.

        Accelerations are such outputs: v' = -M^-1 K q - M^-1 C v + M^-1 B u.
        """
        rows = len(np.atleast_2d(np.asarray(of_state, dtype=float)))
        F = real_matrix("the output's part of the state", np.atleast_2d(np.asarray(of_state)), rows, len(self.state))
        D = real_matrix(
            "the output's part of the efforts", np.atleast_2d(np.asarray(of_effort)), rows, len(self.effort)
        )
        W = weight("the weight of an output", cost, rows)
        return replace(
            self,
            state=self.state + F.T @ W @ F,
            effort=self.effort + D.T @ W @ D,
            cross=self.cross + F.T @ W @ D,
        )


def weight(name: str, value: ArrayLike, size: int) -> Array:
    """Return a weight as a symmetric matrix. Raises UsageError if it is none, or negative in some direction."""
    given = np.asarray(value, dtype=float)
    if given.ndim < 2 and given.shape in ((), (size,)):
        given = np.diag(np.broadcast_to(given, (size,)))
    matrix = real_matrix(name, given, size, size)
    largest = float(np.abs(matrix).max(initial=0.0))
    if not np.allclose(matrix, matrix.T, rtol=0.0, atol=_ASYMMETRY * largest):
        raise UsageError(f"{name} is not symmetric", "W and its transpose, halved")
    matrix = (matrix + matrix.T) / 2.0
    least = float(np.linalg.eigvalsh(matrix)[0]) if size else 0.0
    if least < -_ASYMMETRY * largest:
        raise UsageError(f"{name} is negative in some direction (eigenvalue {least:.4g})", "weights of zero and above")
    return matrix
