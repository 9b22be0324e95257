"""Partials of a compiled model's equations and outputs in the tunable parameters.

t, q, v, a, z and the multipliers are held, and so are inputs that a controller or a caller drives; inputs that the
scene gives and the motion of the base follow their laws. Terms are compiled at the first call if the model was built
without them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.calls import ByName
from eomgen.compiled.arguments import check_name
from eomgen.compiled.terms import Extensible, Inputs, Parameters, States, Terms
from eomgen.errors import Problem, UsageError


class ParameterPartials(NamedTuple):
    """Partials in parameters, one column each; without rows if the scene has no internal states or constraints.

    Attributes
    ----------
    residual : (..., nv, parameters), of M a + h + b - Q + B^T lam
    rate : (..., nz, parameters), of zdot
    constraint : (..., holonomic, parameters), of Phi
    constraint_velocity : (..., rows, parameters), of B v + Phi_t, then of the rows at velocity level
    constraint_acceleration : (..., rows, parameters), of B a + g
    """

    residual: Array
    rate: Array
    constraint: Array
    constraint_velocity: Array
    constraint_acceleration: Array


#: Blocks of the term, in the order of ``ParameterPartials``.
_BLOCKS = ("Rp", "Fp", "Phip", "Zp", "Ap")


def parameter_partials(
    model: Extensible,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
    of: Sequence[str] | None = None,
) -> ParameterPartials:
    """Return exact partials of the equations in tunable parameters, ``of`` them by name, or all in their order.

    Without constraints ``residual`` is the partial of inverse dynamics, d tau / dp.

    Raises
    ------
    UsageError
        A parameter that is fixed in the code or unknown; a scene without tunable parameters.
    """
    chosen = _columns(model.evaluator, of)
    given: dict[str, Any] = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "base": base}
    made = model.having(("parameter_partials",)).evaluator
    values = made.call("parameter_partials", **given, multipliers=multipliers, parameters=parameters)
    result = dict(zip(made.functions.output_names("parameter_partials"), values, strict=True))
    none = np.zeros((*values[0].shape[:-2], 0, values[0].shape[-1]))
    return ParameterPartials(*(result.get(name, none)[..., chosen] for name in _BLOCKS))


def output_parameter_partials(
    model: Extensible,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike | None = None,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
    of: Sequence[str] | None = None,
) -> dict[str, Array]:
    """Return exact partials of the scene's outputs in tunable parameters, with q, v, a, z and multipliers held.

    Returns
    -------
    dict
        By output, (..., parameters), or (..., size, parameters) for outputs of several components; ``of`` as of
        ``parameter_partials``.

    Raises
    ------
    UsageError
        As of ``parameter_partials``; accelerations that outputs need and that are not given.
    """
    chosen = _columns(model.evaluator, of)
    outputs = model.evaluator.library.layout["outputs"]
    if not outputs:
        return ByName("output", {})
    given: dict[str, Any] = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "base": base}
    term = "output_parameter_partials"
    (values,) = model.having((term,)).evaluator.call(term, **given, multipliers=multipliers, parameters=parameters)
    result, start = ByName[Array]("output", {}), 0
    for item in outputs:
        rows = values[..., start : start + int(item["size"]), :][..., chosen]
        result[str(item["name"])] = rows[..., 0, :] if int(item["size"]) == 1 else rows
        start += int(item["size"])
    return result


def _columns(terms: Terms, of: Sequence[str] | None) -> list[int]:
    """Return the indices of parameters by name, of all of them if no names are given."""
    if not terms.parameter_names:
        fault = "the scene has no tunable parameters, so there is nothing to differentiate in"
        hint = "mass = { value = ..., tunable = true } in the scene's [parameters]"
        raise UsageError(Problem("parameter_partials", fault, hint))
    if of is None:
        return list(range(len(terms.parameter_names)))
    if isinstance(of, str):
        raise UsageError(Problem("of", f"parameters are a list of names, not the text {of!r}", f'of=["{of}"]'))
    for name in of:
        check_name("parameter", name, terms.parameter_names, terms.fixed_parameters)
    return [terms.parameter_names.index(name) for name in of]
