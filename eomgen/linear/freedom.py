"""What constraints leave free of small motions about a moving state, in independent coordinates x and velocities y.

    dq = R x,   dv = S y + T x,   da = S ydot + U y + V x,   xdot = N y + W x

x are components of dq and y are components of dv, chosen by pivots among the columns of the constraint Jacobian (Wehage and Haug
1982). Neighbouring motions meet the constraints at all levels, which gives T, U and V without differentiating R in time; with
W = 0 they are R', 2 R' and R''. On groups dq' = dv - ad(v) dq. Constraints at velocity level leave fewer y than x.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from eomgen.errors import ModelError, Problem
from eomgen.lie.product import FactorLike, bracket_matrix
from eomgen.linear.partials import Partials

Array = NDArray[np.float64]
#: A pivot below this part of the largest says that rows depend on each other.
DEPENDENT = 1e-9


@dataclass(frozen=True)
class Freedom:
    """Independent coordinates and velocities about a state.

    Attributes
    ----------
    coordinates, velocities : numbers of the components of v that are independent in dq and in dv, increasing
    R : (nv, nx); S : (nv, ny); T : (nv, nx); U : (nv, ny); V : (nv, nx); N : (nx, ny); W : (nx, nx)
    W_rate : (nx, nx), time derivative of W along the reference; only meant where nx = ny
    """

    coordinates: tuple[int, ...]
    velocities: tuple[int, ...]
    R: Array
    S: Array
    T: Array
    U: Array
    V: Array
    N: Array
    W: Array
    W_rate: Array

    @property
    def holonomic(self) -> bool:
        """Whether there are as many independent velocities as coordinates."""
        return len(self.coordinates) == len(self.velocities)


def freedom(
    factors: Sequence[FactorLike], v: Array, a: Array, partials: Partials, preferred: Sequence[int] = ()
) -> Freedom:
    """Return the independent coordinates and velocities about a state.

    Parameters
    ----------
    v, a : (nv,) of the reference
    preferred : components that are to be independent, as far as the constraints let them

    Raises
    ------
    ModelError
        Constraint rows depend on each other in this state.
    """
    J, nv = partials.J, len(v)
    weight = np.sqrt(np.abs(np.diag(partials.M)))
    weight[weight == 0.0] = 1.0
    scale = 1.0 / weight  # columns of unit kinetic energy, so that metres and radians compare
    favour = np.ones(nv)
    favour[list(preferred)] = 1e-3
    dependent = _pivots(J[: partials.holonomic] * scale, favour)
    x = _others(range(nv), dependent)
    R = _null_basis(J[: partials.holonomic], x)
    at_velocity = J[partials.holonomic :] @ R
    y = _others(x, [x[k] for k in _pivots(at_velocity * scale[x], favour[x])])
    S = _null_basis(J, y)
    held = _others(range(nv), y)

    def carried(right: Array) -> Array:
        """Return the solution of J X + right = 0 whose rows of y are zero."""
        result = np.zeros((nv, right.shape[1]))
        result[held] = np.linalg.solve(J[:, held], -right) if held else 0.0
        return result

    T = carried(partials.Z @ R)
    U, V = carried(partials.Av @ S), carried(partials.Av @ T + partials.Aq @ R)
    turning = bracket_matrix(factors, v)
    of_R = turning @ R
    N, W = S[x], T[x] - of_R[x]
    W_rate = np.zeros_like(W)
    if len(x) == len(y):
        R_rate = T - of_R - R @ W
        W_rate = -(bracket_matrix(factors, a) @ R + turning @ R_rate)[x]
    return Freedom(tuple(x), tuple(y), R, S, T, U, V, N, W, W_rate)


def singular_mechanism() -> ModelError:
    """Return what is to be said where constraint rows lose rank."""
    what = "constraints depend on each other in this state, so it cannot be said what they leave free"
    return ModelError(Problem("linearization", what, "a state near by in which the mechanism is not singular"))


def _pivots(matrix: Array, favour: Array) -> list[int]:
    """Return as many columns as there are rows, each the largest of what is left. Raises ModelError where rows are dependent."""
    rows = len(matrix)
    if not rows:
        return []
    sizes = np.linalg.norm(matrix, axis=1, keepdims=True)
    scaled = matrix / np.where(sizes > 0.0, sizes, 1.0)
    if rows > matrix.shape[1] or np.linalg.svd(scaled, compute_uv=False)[-1] <= DEPENDENT:
        raise singular_mechanism()
    order = scipy.linalg.qr(scaled * favour, mode="r", pivoting=True)[1]
    return [int(k) for k in order[:rows]]


def _others(every: Sequence[int] | range, without: Sequence[int]) -> list[int]:
    left_out = set(without)
    return [k for k in every if k not in left_out]


def _null_basis(J: Array, free: Sequence[int]) -> Array:
    """Return the basis of the null space of J in which the free components are the coordinates."""
    held = _others(range(J.shape[1]), free)
    basis = np.zeros((J.shape[1], len(free)))
    basis[list(free), range(len(free))] = 1.0
    if held:
        basis[held] = -np.linalg.solve(J[:, held], J[:, list(free)])
    return basis
