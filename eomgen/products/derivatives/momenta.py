"""Momenta of steps of RATTLie at n states, with partials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.argument_derivatives import derivatives, sparsity
from eomgen.formula.evaluate import symbols
from eomgen.products.derivatives.equations import StepEquations


def momenta(equations: StepEquations, blocks: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return p = dT/dv and R = dT/dq + Q (without reactions) at states, (n, 2 nv), and the partials of both in q, v, z
    and the parameters, (n, 2 nv, ...)."""
    model, nv, count = equations.model.having(("momenta", "momenta_derivatives")), equations.nv, len(blocks["t"])
    momentum, rate = model.functions("momenta", blocks)
    arguments: dict[str, Any] = {"t": blocks["t"], "u": blocks.get("u"), "z": blocks["z"], "parameters": equations.p}
    columns = sparsity(model, "momenta").arguments
    D = derivatives(model, "momenta", blocks["q"], blocks["v"], **arguments)
    by = {name: D[:, :, columns[name]] for name in ("q", "v", "z", "p", "u") if name in columns}
    by_p = np.zeros((count, 2 * nv, len(equations.chosen)))
    if "p" in by:
        by_p[:] = by["p"][:, :, equations.chosen]
    if "u" in by and _by_formulas(equations):
        by_p[:, nv:] += _forces_by_formulas(equations, blocks, arguments)
    driven = np.zeros((count, 2 * nv, equations.driven))
    if "u" in by and equations.driven:
        driven[:] = by["u"] @ blocks["du"]
    value = np.concatenate([np.broadcast_to(part, (count, nv)) for part in (momentum, rate)], axis=1)
    none = np.zeros((count, 2 * nv, equations.nz))
    return value, np.concatenate([by["q"], by["v"], by.get("z", none), by_p, driven], axis=2)


def _forces_by_formulas(equations: StepEquations, blocks: Mapping[str, Array], arguments: Mapping[str, Any]) -> Array:
    """Return partials of forces in the chosen parameters by way of inputs that follow formulas, (n, nv, chosen):
    partials of the residual hold such inputs or follow their formulas, and momenta hold them."""
    still = {**blocks, "a": np.zeros_like(blocks["a"]), "lam": np.zeros_like(blocks["lam"])}
    term = "residual" if equations.nl else "inverse_dynamics"
    q, v, a = still["q"], still["v"], still["a"]
    held = derivatives(equations.model, term, q, v, a, **arguments, of=["p"])[:, :, equations.chosen]
    result: Array = held - equations.partials(still).P[:, : equations.nv, : len(equations.chosen)]
    return result


def _by_formulas(equations: StepEquations) -> bool:
    """Return whether inputs follow formulas with parameters among the directions."""
    model = equations.model
    chosen = {list(model.parameters)[column] for column in equations.chosen}
    formulas = [item.formula for item in model.description.inputs if item.formula is not None]
    return any(
        symbol.kind == "parameter" and symbol.name in chosen for formula in formulas for symbol in symbols(formula)
    )
