"""Time derivatives of a compiled model's equations along a motion that is given by q, v, a and the derivatives of a.

Each needs a term that only its name brings in. j and s are the first and second time derivatives of a. u_dot and u_ddot
default to the scene's own derivatives for inputs that the scene gives, and to zero for inputs that the caller gives.
Internal states follow their own law. A caller who gives ``base`` gives ``base_rates`` as well, (..., order, 6):
derivatives of the base's twist from the second on, in base axes.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.compiled.terms import Evaluated, Inputs, Parameters, States


def rates(
    model: Evaluated,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    j: ArrayLike | None = None,
    s: ArrayLike | None = None,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    u_dot: Inputs = None,
    u_ddot: Inputs = None,
    *,
    order: int | None = None,
    a_higher: ArrayLike | None = None,
    u_higher: ArrayLike | None = None,
    z: States = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
    base_rates: ArrayLike | None = None,
) -> tuple[Array, ...]:
    """Return tau = M a + h + b - Q and its time derivatives up to an order, each (..., nv).

    Parameters
    ----------
    order : int, optional
        2 needs the term ``rates``, others ``rates_1``, ``rates_3``, ...; by default 2, or the lowest one built if that
        is missing.
    a_higher, u_higher : (..., order - 2, nv or nu)
        Time derivatives of a and u from the third on, for orders above 2; derivatives of u are zero by default, or the
        scene's.
    """
    term = _term_of(model, order)
    given: dict[str, Any] = {
        "q": q,
        "v": v,
        "a": a,
        "j": j,
        "s": s,
        "t": t,
        "u": u,
        "u_dot": u_dot,
        "u_ddot": u_ddot,
    }
    given |= {"a_higher": a_higher, "u_higher": u_higher, "z": z, "base": base, "base_rates": base_rates}
    return model.evaluator.call(term, **given, parameters=parameters)


def _term_of(model: Evaluated, order: int | None) -> str:
    if order is None:
        built = [name for name in model.evaluator.functions.names if name.startswith("rates_")]
        return built[0] if built and "rates" not in model.evaluator.functions.names else "rates"
    return "rates" if order == 2 else f"rates_{order}"


def forward_rates(
    model: Evaluated,
    q: ArrayLike,
    v: ArrayLike,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    u_dot: Inputs = None,
    u_ddot: Inputs = None,
    *,
    z: States = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
    base_rates: ArrayLike | None = None,
) -> tuple[Array, Array, Array]:
    """Return vdot, the jerk and its rate, each (..., nv), along the motion that the forces cause.

    The term is ``forward_rates``; scenes with constraints have none.
    """
    given: dict[str, Any] = {"q": q, "v": v, "t": t, "u": u, "u_dot": u_dot, "u_ddot": u_ddot}
    given |= {"z": z, "base": base, "base_rates": base_rates}
    a, j, s = model.evaluator.call("forward_rates", **given, parameters=parameters)
    return a, j, s


def coriolis(
    model: Evaluated, q: ArrayLike, v: ArrayLike, *, skew: bool = False, parameters: Parameters = None
) -> Array:
    """Return a matrix C with C v = h, (..., nv, nv), base at rest.

    Parameters
    ----------
    skew : bool
        Take the factorisation for which dM/dt - 2 C is skew, C + J^T M b J (term ``coriolis_skew``), in place of
        J^T (M J' - b^T M J) of Mueller and Kumar, Multibody Syst. Dyn. 53 (2021) 257 (term ``coriolis``).
    """
    return model.evaluator.call("coriolis_skew" if skew else "coriolis", q=q, v=v, parameters=parameters)[0]


def mass_rates(
    model: Evaluated, q: ArrayLike, v: ArrayLike, a: ArrayLike, *, parameters: Parameters = None
) -> tuple[Array, Array]:
    """Return the first and second time derivative of M, each (..., nv, nv). The term is ``mass_rates``."""
    first, second = model.evaluator.call("mass_rates", q=q, v=v, a=a, parameters=parameters)
    return first, second


def coupling_rates(
    model: Evaluated, q: ArrayLike, v: ArrayLike, a: ArrayLike, j: ArrayLike, *, parameters: Parameters = None
) -> tuple[Array, Array]:
    """Return the first and second time derivative of h, each (..., nv). The term is ``coupling_rates``."""
    first, second = model.evaluator.call("coupling_rates", q=q, v=v, a=a, j=j, parameters=parameters)
    return first, second


def force_rates(
    model: Evaluated,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    j: ArrayLike,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    u_dot: Inputs = None,
    u_ddot: Inputs = None,
    *,
    z: States = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
    base_rates: ArrayLike | None = None,
) -> tuple[Array, Array]:
    """Return the first and second time derivative of Q, each (..., nv). The term is ``force_rates``."""
    given: dict[str, Any] = {"q": q, "v": v, "a": a, "j": j, "t": t, "u": u, "u_dot": u_dot, "u_ddot": u_ddot}
    given |= {"z": z, "base": base, "base_rates": base_rates}
    first, second = model.evaluator.call("force_rates", **given, parameters=parameters)
    return first, second


def base_motion_rates(
    model: Evaluated,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    j: ArrayLike,
    t: ArrayLike = 0.0,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
    base_rates: ArrayLike | None = None,
) -> tuple[Array, Array]:
    """Return the first and second time derivative of b, each (..., nv). The term is ``base_motion_rates``."""
    given: dict[str, Any] = {"q": q, "v": v, "a": a, "j": j, "t": t, "base": base, "base_rates": base_rates}
    first, second = model.evaluator.call("base_motion_rates", **given, parameters=parameters)
    return first, second
