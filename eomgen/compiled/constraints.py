"""Accelerations and multipliers of constrained models, and consistent states from guesses, on the compiled functions.

[ M  B^T ] [ vdot ]   [ -r(a = 0, lam = 0) ]
[ B   0  ] [ lam  ] = [ -g                 ]     g: time derivative of the rows' rates at vdot = 0
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.functions import Functions
from eomgen.errors import NumericalError, Problem

NEEDED = ("mass", "residual", "constraint_jacobian", "constraint_bias")


def solvable(functions: Functions) -> bool:
    """Return whether a model has the functions that ``accelerations`` needs."""
    return all(name in functions for name in NEEDED)


def blocks_of(functions: Functions) -> set[str]:
    """Return the input blocks that ``accelerations`` needs, a and lam excepted."""
    return {block for name in NEEDED for block in functions.inputs(name)} - {"a", "lam"}


def accelerations(functions: Functions, values: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return vdot (..., nv) and the multipliers (..., rows) at states given as input blocks.

    Raises
    ------
    NumericalError
        In one of the states, rows depend on each other, or a motion allowed by the rows has no inertia.
    """
    nv, rows = functions.sizes["v"], functions.sizes["lam"]
    (r,) = functions("residual", {**values, "a": np.zeros(nv), "lam": np.zeros(rows)})
    (M,) = functions("mass", values)
    (B,) = functions("constraint_jacobian", values)
    (g,) = functions("constraint_bias", values)
    batch = np.broadcast_shapes(r.shape[:-1], M.shape[:-2], B.shape[:-2], g.shape[:-1])
    system = np.zeros((*batch, nv + rows, nv + rows))
    system[..., :nv, :nv], system[..., nv:, :nv], system[..., :nv, nv:] = M, B, np.swapaxes(B, -1, -2)
    right = -np.concatenate([np.broadcast_to(r, (*batch, nv)), np.broadcast_to(g, (*batch, rows))], axis=-1)
    try:
        solution = np.linalg.solve(system, right[..., np.newaxis])[..., 0]
    except np.linalg.LinAlgError:
        fault = (
            "accelerations and multipliers are not unique: rows depend on each other in this state, or no inertia"
            " resists"
        )
        raise NumericalError(Problem("constraints", fault, "a state next to it")) from None
    return solution[..., :nv], solution[..., nv:]
