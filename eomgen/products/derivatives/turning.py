"""How linear steps of rotating factors change with the increments of their rotations.

A step q' = q o exp(theta) has dq' = A dq + T dtheta, A = Ad(exp(-theta)), both left-trivialised. Along j the matrices
change themselves, so that the second derivatives of steps are dA[dtheta_j] dq_i + dT[dtheta_j] dtheta_i, with
dA[x] = -ad(T x) A (Bruls and Cardona 2010; Iserles, Munthe-Kaas, Norsett and Zanna 2000, section 4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.base.arrays import Array
from eomgen.lie import numeric
from eomgen.lie.groups import Group, group_named
from eomgen.lie.product import Factor

#: An imaginary increment with a square below rounding: exact derivatives (Squire and Trapp 1998).
_TINY = 1e-100


@dataclass(frozen=True)
class Turning:
    """Changes of A and T of a rotating factor, at (n,) steps.

    Attributes
    ----------
    v : place of the factor's velocities
    A, T_inverse : (n, size, size)
    by_first, by_increment : (n, size, size, size), changes of A and of T: row, column, component of theta
    """

    v: slice
    A: Array
    T_inverse: Array
    by_first: Array
    by_increment: Array

    @classmethod
    def of(cls, factor: Factor, theta: Array) -> Turning:
        """Return them at increments theta (n, nv)."""
        group, part = group_named(factor.group, factor.v_size), theta[:, factor.v]
        A = numeric.adjoint(group, numeric.exp(group, -part))
        T = numeric.tangent(group, part)
        size = part.shape[1]
        by_first = np.stack([-numeric.bracket_matrix(group, T[:, :, k]) @ A for k in range(size)], axis=3)
        by_increment = np.stack([_along(group, part, k) for k in range(size)], axis=3)
        return cls(factor.v, A, numeric.tangent_inverse(group, part), by_first, by_increment)

    def increments(self, before: Array, behind: Array) -> Array:
        """Return dtheta (n, size, directions) from dq before and behind steps, (n, nv, directions) each."""
        result: Array = self.T_inverse @ (behind[:, self.v] - self.A @ before[:, self.v])
        return result

    def changed(self, of_end: Array, increments: Array) -> tuple[Array, Array]:
        """Return second derivatives along ``increments`` by dq and by dtheta, (n, size, directions) each;
        ``of_end``: derivatives in q' (n, nv)."""
        weights = of_end[:, self.v]
        of_first = np.einsum("nr,nrck,nkd->ncd", weights, self.by_first, increments, optimize=True)
        return of_first, np.einsum("nr,nrck,nkd->ncd", weights, self.by_increment, increments, optimize=True)


def turnings(factors: Sequence[Factor], theta: Array) -> list[Turning]:
    """Return the derivatives of all rotating factors."""
    return [Turning.of(factor, theta) for factor in factors if factor.group != "R"]


def _along(group: Group, theta: Array, component: int) -> Array:
    moved = theta.astype(complex)
    moved[:, component] += 1j * _TINY
    result: Array = numeric.tangent(group, moved).imag / _TINY
    return result
