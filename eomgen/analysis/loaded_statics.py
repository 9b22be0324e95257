"""A compiled model at rest as sparse equations of a load factor: all loads as they are, or one of its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csc_array

from eomgen.analysis.driven_rest import held_base
from eomgen.analysis.element_strains import ElementStrains
from eomgen.analysis.equilibrium_warnings import Measures
from eomgen.analysis.sparse_partials import sparse_partials, whole_partials
from eomgen.base.arrays import Array
from eomgen.base.text import nearest, shown
from eomgen.compiled.terms import Inputs, Parameters
from eomgen.errors import Problem, UsageError
from eomgen.solvers.bordered_newton import WHOLE, Balance, LoadedStatics, Rest, Tangents

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Step of central differences by the load factor, as a part of its scale.
_STEP = 1e-5


@dataclass(frozen=True)
class Varied:
    """A number that is varied: a tunable parameter, an input, or the time of formulas.

    Attributes
    ----------
    name, unit : str
    parameters, u, t : of all that is not varied
    """

    model: CompiledModel
    name: str
    unit: str
    parameters: Array
    u: Inputs
    t: float

    @classmethod
    def of(cls, model: CompiledModel, call: str, name: str, parameters: Parameters, t: float, u: Inputs) -> Varied:
        """Return the varied quantity of a name. Raises UsageError for an unknown name."""
        p = model.evaluator.one_set(parameters)
        units = {**model.evaluator.parameter_units, **model.input_units, "t": "s"}
        if name not in (*model.parameters, *model.inputs, "t"):
            known = [*model.parameters, *model.inputs, "t"]
            fault = f"there is no tunable parameter or input {shown(name)} to be varied"
            fixed = name in model.evaluator.fixed_parameters
            hint = "tunable = true, where the scene gives it" if fixed else nearest(name, known)
            raise UsageError(Problem(call, fault, hint or f"one of {', '.join(known[:12])}"))
        if name in model.inputs and not (u is None or isinstance(u, Mapping)):
            raise UsageError(Problem("u", f"{name} is varied, so the other inputs are given by name", "u={...}"))
        return cls(model, name, units.get(name, ""), p, u, t)

    @property
    def shown_unit(self) -> str:
        return f" {self.unit}" if self.unit not in ("", "1") else ""

    def at(self, s: float) -> tuple[Array, float, Inputs]:
        """Return parameters, time and inputs with the number set to s."""
        if self.name in self.model.parameters:
            p = self.parameters.copy()
            p[list(self.model.parameters).index(self.name)] = s
            return p, self.t, self.u
        if self.name in self.model.inputs:
            given = dict(self.u) if isinstance(self.u, Mapping) else {}
            return self.parameters, self.t, {**given, self.name: s}
        return self.parameters, s, self.u


def loaded_statics(
    model: CompiledModel,
    measures: Measures,
    q: Array,
    u: Inputs,
    v: Array,
    varied: Varied | None = None,
    reach: float = 1.0,
) -> LoadedStatics:
    """Return the model at rest beside coordinates moving with v, its base held.

    Parameters
    ----------
    q : configuration with lengths that count among the scene's
    varied : meaning of the load factor; if None, all is as the measures and ``u`` have it for any factor
    reach : scale of the load factor
    """
    still, holonomic, rows = np.zeros(model.nv), model.functions.sizes["holonomic"], len(model.multipliers)
    strains_at: dict[bytes, ElementStrains] = {}
    whole = model.nv + rows + model.nz <= WHOLE

    def given(s: float) -> dict[str, Any]:
        if varied is None:
            return {"t": measures.t, "parameters": measures.p, "base": measures.base, "u": u}
        p, t, inputs = varied.at(s)
        return {"t": t, "parameters": p, "base": held_base(model, p, t), "u": inputs}

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
        if whole:
            state = {"q": rest.q, "v": v, "a": still, "z": rest.z, "multipliers": rest.multipliers, **given(rest.s)}
            return Tangents(**whole_partials(model, state))
        result = sparse_partials(model, rest.q, v, still, rest.z, rest.multipliers, given(rest.s))
        return Tangents(result.K, result.B, result.Rz, result.Fq, result.Fz)

    def mass(rest: Rest) -> csc_array:
        where = given(rest.s)
        if "mass" in model.functions:
            return csc_array(model.mass(rest.q, parameters=where["parameters"]))
        return sparse_partials(model, rest.q, v, still, rest.z, rest.multipliers, where).M

    def by_factor(rest: Rest) -> Balance:
        if varied is None:
            return Balance(np.zeros(model.nv), np.zeros(rows), np.zeros(model.nz))
        step = _STEP * reach
        more, less = (balance(Rest(rest.q, rest.multipliers, rest.z, rest.s + sign * step)) for sign in (1.0, -1.0))
        parts = ("residual", "constraint", "rates")
        return Balance(*((getattr(more, part) - getattr(less, part)) / (2.0 * step) for part in parts))

    def strains(s: float) -> ElementStrains | None:
        if not model.description.element_stiffness or "poses" not in model.functions:
            return None
        where = given(s)
        where.pop("u")
        key = where["parameters"].tobytes() + np.float64(where["t"]).tobytes()
        if key not in strains_at:
            strains_at.clear()
            strains_at[key] = ElementStrains(model, where["parameters"], where)
        return strains_at[key]

    def followed(q: Array, s: float) -> Array:
        where = given(s)
        return model.evaluator.followed(q, where["t"], where["parameters"], where["base"])

    turning = np.array([unit == "rad/s" for unit in model.v_units])
    return LoadedStatics(
        factors=model.factors,
        sizes=np.where(turning, 1.0, measures.length(q)),
        reach=reach,
        balance=balance,
        tangents=tangents,
        by_factor=by_factor,
        followed=followed,
        mass=mass,
        strains=strains,
    )


def check_partials(model: CompiledModel, call: str) -> None:
    """Raise UsageError if a model was built without the terms that equilibria need."""
    needed = {"residual"} | ({"constraint_jacobian"} if model.multipliers else set())
    if "iteration" in model.functions:  # has the others' nonzeros
        needed |= {"internal_rate"} if model.nz else set()
    else:
        needed |= {"mass", "partials"} | ({"internal_rate", "internal_partials"} if model.nz else set())
    if missing := sorted(name for name in needed if name not in model.functions):
        fault = f"the terms {', '.join(missing)} are needed, and the model was built without them"
        raise UsageError(Problem(call, fault, f"eomgen.build(scene, terms=[..., {', '.join(map(repr, missing))}])"))
