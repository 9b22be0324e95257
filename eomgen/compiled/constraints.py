"""Accelerations and multipliers of constrained models on the compiled functions.

[ M  B^T ] [ vdot ]   [ -r(a = 0, lam = 0) ]
[ B   0  ] [ lam  ] = [ -g                 ]     g: time derivative of the rows' rates at vdot = 0
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.functions import Functions
from eomgen.errors import NumericalError, Problem

Blocks = Mapping[str, Array]
NEEDED = ("mass", "residual", "constraint_jacobian", "constraint_bias")


def solvable(functions: Functions) -> bool:
    """Return whether a model has the functions that ``accelerations`` needs."""
    return all(name in functions for name in NEEDED)


def blocks_of(functions: Functions) -> set[str]:
    """Return the input blocks that ``accelerations`` needs, a and lam excepted."""
    return {block for name in NEEDED for block in functions.inputs(name)} - {"a", "lam"}


def accelerations(functions: Functions, values: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return vdot (..., nv) and the multipliers (..., rows) of a constrained model; ``values`` are the input blocks.

    Raises
    ------
    NumericalError
        In one of the states, rows depend on each other, or a motion allowed by the rows has no inertia.
    """
    nv, rows = functions.sizes["v"], functions.sizes["lam"]
    right = -_defects(functions, values, np.zeros(nv), np.zeros(rows))
    solution = _solution(_matrix(functions, values, right.shape[:-1]), right[..., np.newaxis])[..., 0]
    return solution[..., :nv], solution[..., nv:]


def acceleration_partials(
    functions: Functions, values: Mapping[str, Array], moves: Iterable[tuple[Blocks, Blocks, float]]
) -> Array:
    """Return differences of vdot over moves of the state, divided by distances, (..., nv, moves), by one factorization
    each.

    The equations hold before and after a move, so that the matrix times the change of (vdot, lam) is the change of the
    equations' defects at fixed vdot and lam, with the opposite sign.

    Parameters
    ----------
    values : input blocks at the state itself
    moves : for each, the input blocks q, v and z after and before the move, and the distance of both
    """
    nv = functions.sizes["v"]
    a, multipliers = accelerations(functions, values)
    columns = []
    for *sides, distance in moves:
        ahead, behind = (_defects(functions, {**values, **side}, a, multipliers) for side in sides)
        columns.append((ahead - behind) / distance)
    right = -np.stack(columns, axis=-1)
    return _solution(_matrix(functions, values, right.shape[:-2]), right)[..., :nv, :]


def _defects(functions: Functions, values: Mapping[str, Array], a: Array, multipliers: Array) -> Array:
    """Return the defects of the equations, (..., nv + rows): residual, and B a + g of the rows."""
    (r,) = functions("residual", {**values, "a": a, "lam": multipliers})
    (g,) = functions("constraint_bias", values)
    if np.any(a):
        (B,) = functions("constraint_jacobian", values)
        g = g + (B @ a[..., np.newaxis])[..., 0]
    batch = np.broadcast_shapes(r.shape[:-1], g.shape[:-1], *(np.shape(values[name])[:-1] for name in ("q", "v")))
    return np.concatenate([np.broadcast_to(part, (*batch, part.shape[-1])) for part in (r, g)], axis=-1)


def _matrix(functions: Functions, values: Mapping[str, Array], batch: tuple[int, ...]) -> Array:
    nv, rows = functions.sizes["v"], functions.sizes["lam"]
    (M,) = functions("mass", values)
    (B,) = functions("constraint_jacobian", values)
    system = np.zeros((*np.broadcast_shapes(batch, M.shape[:-2], B.shape[:-2]), nv + rows, nv + rows))
    system[..., :nv, :nv], system[..., nv:, :nv], system[..., :nv, nv:] = M, B, np.swapaxes(B, -1, -2)
    return system


def _solution(system: Array, right: Array) -> Array:
    """Return the solution, (..., n, columns). Raises NumericalError if a matrix is singular."""
    try:
        solution: Array = np.asarray(np.linalg.solve(system, right), dtype=float)
    except np.linalg.LinAlgError:
        fault = (
            "accelerations and multipliers are not unique: rows depend on each other in this state, or no inertia"
            " resists [E0257]"
        )
        raise NumericalError(Problem("constraints", fault, "a state next to it")) from None
    return solution
