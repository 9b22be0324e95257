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
from eomgen.compiled.terms import EvaluatedModel, Inputs, Parameters, States


def rates(
    model: EvaluatedModel,
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
    """Return tau = M a + h + b - Q and the time derivatives of tau up to an order; internal states follow their law.

    Parameters
    ----------
    q, v, a, j, s : array_like
        Configuration (..., nq), velocity (..., nv), acceleration (..., nv), first time derivative of a (..., nv) and
        second time derivative of a (..., nv), left-trivialised; j is needed at each order, s from order 2 on.
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    u_dot, u_ddot : mapping or array_like, optional
        Time derivatives of u (..., nu): by default the scene's own, zero for inputs that ``u`` gives.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.
    base_rates : array_like, optional
        Derivatives of the base's twist from the second on (..., n, 6), in base axes, with n the highest order of the
        terms that the model was built with; needed with ``base``.
    order : int, optional
        2 needs the term ``rates``, others ``rates_1``, ``rates_3``, ...; by default 2, or the lowest built order if
        that term is missing.
    a_higher, u_higher : (..., order - 2, nv or nu)
        Time derivatives of a and u from the third on, for orders above 2; derivatives of u are zero by default, or the
        scene's.

    Returns
    -------
    tuple of (..., nv) ndarray
        The order + 1 arrays tau, dtau/dt, ...; N m/s^k along angles, N/s^k along lengths.

    Raises
    ------
    UsageError
        A model that was built without the term; missing j, s, a_higher or base_rates; wrong shapes.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml", terms=["rates", "inverse_dynamics"])
    >>> q, v, a, j = [0.8, -0.3], [1.0, 0.5], [0.2, 0.1], [0.0, 0.0]
    >>> tau, first, second = model.rates(q, v, a, j, [0.0, 0.0])
    >>> np.allclose(tau, model.inverse_dynamics(q, v, a))
    True
    """
    term = _term_of(model, order)
    arguments: dict[str, Any] = {"q": q, "v": v, "a": a, "j": j, "s": s, "t": t, "u": u, "u_dot": u_dot}
    arguments |= {"u_ddot": u_ddot, "a_higher": a_higher, "u_higher": u_higher, "z": z}
    return model.evaluator.call(term, **arguments, base=base, base_rates=base_rates, parameters=parameters)


def _term_of(model: EvaluatedModel, order: int | None) -> str:
    if order is None:
        built = [name for name in model.evaluator.functions.names if name.startswith("rates_")]
        return built[0] if built and "rates" not in model.evaluator.functions.names else "rates"
    return "rates" if order == 2 else f"rates_{order}"


def forward_rates(
    model: EvaluatedModel,
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
    """Return vdot, the jerk and the time derivative of the jerk, along the motion that the forces cause.

    Internal states follow their own law. The term is ``forward_rates``, which scenes with constraints do not have; a
    model that was built without the term raises UsageError.

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    u_dot, u_ddot : mapping or array_like, optional
        Time derivatives of u (..., nu): by default the scene's own, zero for inputs that ``u`` gives.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.
    base_rates : array_like, optional
        Derivatives of the base's twist from the second on (..., n, 6), in base axes, with n the highest order of the
        terms that the model was built with; needed with ``base``.

    Returns
    -------
    a, j, s : (..., nv) ndarray
        Acceleration, and the first and second time derivative of a, left-trivialised.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml", terms=["forward_rates"])
    >>> a, j, s = model.forward_rates([0.8, -0.3], [1.0, 0.5])
    >>> j.round(3)
    array([  0.668, -27.263])
    """
    arguments: dict[str, Any] = {"q": q, "v": v, "t": t, "u": u, "u_dot": u_dot, "u_ddot": u_ddot}
    arguments |= {"z": z, "base": base, "base_rates": base_rates, "parameters": parameters}
    a, j, s = model.evaluator.call("forward_rates", **arguments)
    return a, j, s


def coriolis(
    model: EvaluatedModel, q: ArrayLike, v: ArrayLike, *, skew: bool = False, parameters: Parameters = None
) -> Array:
    """Return a matrix C with C v = h(q, v), base at rest.

    A model that was built without the term raises UsageError; scenes with bodies that deform do not have the terms.

    Parameters
    ----------
    q, v : array_like
        Configuration (..., nq) and left-trivialised velocity (..., nv).
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    skew : bool
        Take the factorisation for which dM/dt - 2 C is skew, C + J^T M b J (term ``coriolis_skew``), in place of
        J^T (M J' - b^T M J) of Mueller and Kumar, Multibody Syst. Dyn. 53 (2021) 257 (term ``coriolis``).

    Returns
    -------
    C : (..., nv, nv) ndarray
        C v is h in N m along angles, N along lengths.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml", terms=["coriolis_skew", "coupling"])
    >>> q, v = [0.8, -0.3], [1.0, 0.5]
    >>> C = model.coriolis(q, v, skew=True)
    >>> np.allclose(C @ v, model.coupling(q, v))
    True
    """
    return model.evaluator.call("coriolis_skew" if skew else "coriolis", q=q, v=v, parameters=parameters)[0]


def mass_rates(
    model: EvaluatedModel, q: ArrayLike, v: ArrayLike, a: ArrayLike, *, parameters: Parameters = None
) -> tuple[Array, Array]:
    """Return the first and second time derivative of M.

    The term is ``mass_rates``; a model that was built without the term raises UsageError.

    Parameters
    ----------
    q, v, a : array_like
        Configuration (..., nq), left-trivialised velocity and acceleration (..., nv).
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.

    Returns
    -------
    first, second : (..., nv, nv) ndarray
        Along the motion, dM/dt and d2M/dt2; the first does not depend on a.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml", terms=["mass_rates"])
    >>> first, second = model.mass_rates([0.8, -0.3], [1.0, 0.5], [0.2, 0.1])
    >>> first.round(4)
    array([[0.0355, 0.0177],
           [0.0177, 0.    ]])
    """
    first, second = model.evaluator.call("mass_rates", q=q, v=v, a=a, parameters=parameters)
    return first, second


def coupling_rates(
    model: EvaluatedModel, q: ArrayLike, v: ArrayLike, a: ArrayLike, j: ArrayLike, *, parameters: Parameters = None
) -> tuple[Array, Array]:
    """Return the first and second time derivative of h.

    The term is ``coupling_rates``; a model that was built without the term raises UsageError.

    Parameters
    ----------
    q, v, a, j : array_like
        Configuration (..., nq), velocity (..., nv), acceleration (..., nv) and first time derivative of a (..., nv),
        left-trivialised.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.

    Returns
    -------
    first, second : (..., nv) ndarray
        Along the motion, dh/dt and d2h/dt2; N m/s^k along angles, N/s^k along lengths.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml", terms=["coupling_rates"])
    >>> q, v, a, j = [0.8, -0.3], [1.0, 0.5], [0.2, 0.1], [0.0, 0.0]
    >>> model.coupling_rates(q, v, a, j)[0].round(4)
    array([-0.0539,  0.0431])
    """
    first, second = model.evaluator.call("coupling_rates", q=q, v=v, a=a, j=j, parameters=parameters)
    return first, second


def force_rates(
    model: EvaluatedModel,
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
    """Return the first and second time derivative of Q.

    Internal states follow their own law. The term is ``force_rates``; a model that was built without the term raises
    UsageError.

    Parameters
    ----------
    q, v, a, j : array_like
        Configuration (..., nq), velocity (..., nv), acceleration (..., nv) and first time derivative of a (..., nv),
        left-trivialised.
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    u_dot, u_ddot : mapping or array_like, optional
        Time derivatives of u (..., nu): by default the scene's own, zero for inputs that ``u`` gives.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.
    base_rates : array_like, optional
        Derivatives of the base's twist from the second on (..., n, 6), in base axes, with n the highest order of the
        terms that the model was built with; needed with ``base``.

    Returns
    -------
    first, second : (..., nv) ndarray
        Along the motion, dQ/dt and d2Q/dt2; N m/s^k along angles, N/s^k along lengths.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml", terms=["force_rates"])
    >>> q, v, a, j = [0.8, -0.3], [1.0, 0.5], [0.2, 0.1], [0.0, 0.0]
    >>> model.force_rates(q, v, a, j)[0].round(4)
    array([-8.567 , -3.0993])
    """
    arguments: dict[str, Any] = {"q": q, "v": v, "a": a, "j": j, "t": t, "u": u, "u_dot": u_dot, "u_ddot": u_ddot}
    arguments |= {"z": z, "base": base, "base_rates": base_rates}
    first, second = model.evaluator.call("force_rates", **arguments, parameters=parameters)
    return first, second


def base_motion_rates(
    model: EvaluatedModel,
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
    """Return the first and second time derivative of b.

    Both are zero as b is: if the scene's base is at rest, and in absolute coordinates. Else the term is
    ``base_motion_rates``; a model that was built without the term raises UsageError.

    Parameters
    ----------
    q, v, a, j : array_like
        Configuration (..., nq), velocity (..., nv), acceleration (..., nv) and first time derivative of a (..., nv),
        left-trivialised.
    t : array_like, optional
        Time (...), s.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.
    base_rates : array_like, optional
        Derivatives of the base's twist from the second on (..., n, 6), in base axes, with n the highest order of the
        terms that the model was built with; needed with ``base``.

    Returns
    -------
    first, second : (..., nv) ndarray
        Along the motion, db/dt and d2b/dt2; N m/s^k along angles, N/s^k along lengths.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml", terms=["base_motion_rates"])
    >>> q, v, a, j = [0.8, -0.3], [1.0, 0.5], [0.2, 0.1], [0.0, 0.0]
    >>> model.base_motion_rates(q, v, a, j, t=0.2)[0].round(4)
    array([5.6379, 0.7658])
    """
    terms, motion = model.evaluator, {"q": q, "v": v, "a": a, "j": j}
    if not terms.carried:
        return terms.zeros("v", t, base, parameters, **motion), terms.zeros("v", t, base, parameters, **motion)
    more = {"t": t, "base": base, "base_rates": base_rates}
    first, second = terms.call("base_motion_rates", **motion, **more, parameters=parameters)
    return first, second
