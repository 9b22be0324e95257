"""A compiled model at rest as sparse equations of a load factor: all loads as they are, or one of its parameters."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.analysis.element_strains import ElementStrains
from eomgen.analysis.equilibrium_warnings import Measures
from eomgen.analysis.sparse_partials import sparse_partials
from eomgen.arrays import Array
from eomgen.compiled.terms import Inputs
from eomgen.solvers.bordered_newton import Balance, LoadedStatics, Rest, Tangents

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Step of central differences by the load factor, as a part of what it is measured by.
_STEP = 1e-5


def loaded_statics(
    model: CompiledModel,
    measures: Measures,
    q: Array,
    u: Inputs,
    v: Array,
    parameters: Callable[[float], Array] | None = None,
    reach: float = 1.0,
) -> LoadedStatics:
    """Return the model at rest beside what moves with v, its base held where it is.

    Parameters
    ----------
    q : configuration whose lengths count among those of the scene
    parameters : tunable parameters (np,) at a load factor; those of the measures, whatever the factor, if None
    reach : what the load factor is measured by
    """
    still, holonomic, rows = np.zeros(model.nv), model.functions.sizes["holonomic"], len(model.multipliers)
    held = measures.p
    strains_at: dict[bytes, ElementStrains] = {}

    def given(s: float) -> dict[str, Any]:
        p = held if parameters is None else parameters(s)
        return {"t": measures.t, "parameters": p, "base": measures.base, "u": u}

    def balance(rest: Rest) -> Balance:
        where = given(rest.s)
        state = {"v": v, "a": still, "z": rest.z, **where}
        (residual,) = model.evaluate("residual", rest.q, multipliers=rest.multipliers, **state).values()
        constraint = np.zeros(rows)
        if holonomic:
            constraint[:holonomic] = next(iter(model.evaluate("constraint", rest.q, **where).values()))
        rates = model.internal_rates(rest.q, v, rest.z, **where) if model.nz else np.zeros(0)
        return Balance(residual, constraint, rates)

    def tangents(rest: Rest) -> Tangents:
        found = sparse_partials(model, rest.q, v, still, rest.z, rest.multipliers, given(rest.s))
        return Tangents(found.K, found.B, found.Rz, found.Fq, found.Fz)

    def by_factor(rest: Rest) -> Balance:
        if parameters is None:
            return Balance(np.zeros(model.nv), np.zeros(rows), np.zeros(model.nz))
        step = _STEP * reach
        more, less = (balance(Rest(rest.q, rest.multipliers, rest.z, rest.s + sign * step)) for sign in (1.0, -1.0))
        parts = ("residual", "constraint", "rates")
        return Balance(*((getattr(more, part) - getattr(less, part)) / (2.0 * step) for part in parts))

    def strains(s: float) -> ElementStrains | None:
        if not model.description.element_stiffness:
            return None
        where = given(s)
        where.pop("u")
        key = where["parameters"].tobytes()
        if key not in strains_at:
            strains_at.clear()
            strains_at[key] = ElementStrains(model, where["parameters"], where)
        return strains_at[key]

    turning = np.array([unit == "rad/s" for unit in model.v_units])
    return LoadedStatics(
        factors=model.factors,
        sizes=np.where(turning, 1.0, measures.length(q)),
        reach=reach,
        balance=balance,
        tangents=tangents,
        by_factor=by_factor,
        followed=lambda q, s: model.evaluator.followed(q, measures.t, given(s)["parameters"], measures.base),
        strains=strains,
    )
