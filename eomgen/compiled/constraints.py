"""Accelerations and multipliers of constrained models, and consistent states from guesses, on the compiled functions.

    [ M  B^T ] [ vdot ]   [ -r(a = 0, lam = 0) ]
    [ B   0  ] [ lam  ] = [ -g                 ]     g: what the rows' rates change by at vdot = 0
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from eomgen.compiled.functions import Functions
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.solvers.consistency import Assembly, Constrained, assemble, split_sizes

if TYPE_CHECKING:
    from eomgen.compiled.model import Model

Array = NDArray[np.float64]
NEEDED = ("mass", "residual", "constraint_jacobian", "constraint_bias")


def solvable(functions: Functions) -> bool:
    """Return whether a model has what ``accelerations`` needs."""
    return all(name in functions for name in NEEDED)


def blocks_of(functions: Functions) -> set[str]:
    """Return the input blocks that ``accelerations`` needs, a and lam excepted."""
    return {block for name in NEEDED for block in functions.inputs(name)} - {"a", "lam"}


def accelerations(functions: Functions, values: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return vdot (..., nv) and the multipliers (..., rows) at states given as input blocks.

    Raises
    ------
    NumericalError
        In one of the states, rows depend on each other, or nothing resists a motion that they leave.
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
        what = "accelerations and multipliers are not unique: rows depend on each other in this state, or no inertia resists"
        raise NumericalError(Problem("constraints", what, "a state next to it")) from None
    return solution[..., :nv], solution[..., nv:]


def consistent(model: Model, q: Array, v: Array, t: float, parameters: Array) -> Assembly:
    """Return the consistent state of a constrained model nearest to a guess, and how far the guess was off.

    Raises
    ------
    ModelError
        The constraints contradict each other there; names the rows.
    UsageError
        The model was built without the terms that constraints need.
    """
    needed = ("mass", "constraint", "constraint_velocity", "constraint_jacobian", "constraint_size")
    able = model.having(needed)
    missing = [name for name in needed if name not in able.functions]
    if missing:
        raise UsageError(f"the terms {', '.join(missing)} are needed to make an initial state consistent", "build with them")

    def at(name: str, **state: Array | float) -> Array:
        return next(iter(able.evaluate(name, t=t, parameters=parameters, **state).values()))

    holonomic = model.functions.sizes["holonomic"]

    def sizes(q: Array, _: float) -> tuple[Array, Array]:
        found = able.evaluate("constraint_size", q, t=t, parameters=parameters)
        return split_sizes(np.concatenate(list(found.values())))

    equations = Constrained(
        factors=model.factors,
        names=model.multipliers,
        units=model.library.layout["row_units"],
        angular=np.array([unit == "rad/s" for unit in model.v_units]),
        holonomic=holonomic,
        constraint=lambda q, _: at("constraint", q=q) if holonomic else np.zeros(0),
        velocity=lambda q, v, _: at("constraint_velocity", q=q, v=v),
        jacobian=lambda q, _: at("constraint_jacobian", q=q),
        mass=lambda q: able.mass(q, parameters=parameters),
        sizes=sizes,
    )
    found = assemble(equations, q, v, t)
    deviations = (*found.deviations, *model._check_left_out(found.q, found.v, t, parameters))
    return replace(found, q=model._terms.followed(found.q, t, parameters), deviations=deviations)
