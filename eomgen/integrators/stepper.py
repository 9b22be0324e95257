"""Both method families in NumPy: slow, clear, and the oracle that the generated C steppers are held against.

Every iteration forms and solves its own linear system, nothing is reused, and a step that does not converge is an error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.errors import NumericalError, Problem
from eomgen.integrators.methods import STABILISED, GeneralizedAlpha, Method, RungeKuttaMuntheKaas
from eomgen.lie import product
from eomgen.lie.product import FactorLike

Array = NDArray[np.float64]
_EPSILON = float(np.finfo(float).eps)
_MAX_ITERATIONS = 30


@dataclass(frozen=True)
class Constraints:
    """Constraint equations as callables; ``holonomic`` rows come first.

    Attributes
    ----------
    position : (t, q) -> Phi
    rate : (t, q, v) -> w = (B v + Phi_t, rows at velocity level)
    bias : (t, q, v) -> g, the rate of w at vdot = 0
    jacobian : (t, q) -> B
    rate_partials : (t, q, v) -> Z, the left-trivialised derivative of w by q
    """

    holonomic: int
    position: Callable[[float, Array], Array]
    rate: Callable[[float, Array, Array], Array]
    bias: Callable[[float, Array, Array], Array]
    jacobian: Callable[[float, Array], Array]
    rate_partials: Callable[[float, Array, Array], Array]


@dataclass(frozen=True)
class Equations:
    """Equations of motion as callables; inputs and base motion are functions of t inside them.

    Attributes
    ----------
    factors : sequence of Factor
    forward_dynamics : (t, q, v) -> vdot; unconstrained systems only
    residual : (t, q, v, vdot) -> r, zero along motions; implicit methods only. With constraints (t, q, v, vdot, lam) -> r
    partials : of the same arguments -> (K, C, M), the left-trivialised derivatives of r by q, v and vdot; implicit methods only
    constraints : Constraints, optional
    """

    factors: Sequence[FactorLike]
    forward_dynamics: Callable[[float, Array, Array], Array] | None
    residual: Callable[..., Array] | None = None
    partials: Callable[..., tuple[Array, Array, Array]] | None = None
    constraints: Constraints | None = None


@dataclass(frozen=True)
class Trajectory:
    """States at the steps, the initial one first: t (n+1,), q (n+1, nq), v, vdot (n+1, nv), lam; Newton iterations in all."""

    t: Array
    q: Array
    v: Array
    vdot: Array
    lam: Array
    iterations: int = 0


def accelerations(equations: Equations, t: float, q: Array, v: Array) -> tuple[Array, Array]:
    """Return vdot and lam that are consistent with q and v."""
    if equations.constraints is None:
        if equations.forward_dynamics is None:
            raise ValueError("the equations have neither forward dynamics nor constraints")
        return equations.forward_dynamics(t, q, v), np.zeros(0)
    if equations.residual is None or equations.partials is None:
        raise ValueError("constrained equations need the residual and its partials")
    g = equations.constraints.bias(t, q, v)
    at_rest = (t, q, v, np.zeros(len(v)), np.zeros(len(g)))
    solution = _saddle(equations, t, q, v, -equations.residual(*at_rest), -g)
    return solution[: len(v)], solution[len(v) :]


def _saddle(equations: Equations, t: float, q: Array, v: Array, force: Array, rate: Array) -> Array:
    """Return (x, y) of M x + B^T y = force, B x = rate."""
    constraints, partials = equations.constraints, equations.partials
    if constraints is None or partials is None:
        raise ValueError("no constraints")
    B = constraints.jacobian(t, q)
    M = partials(t, q, v, np.zeros(len(v)), np.zeros(len(B)))[2]
    A = np.block([[M, B.T], [B, np.zeros((len(B), len(B)))]])
    solution: Array = np.linalg.solve(A, np.concatenate([force, rate]))
    return solution


def integrate(
    equations: Equations, method: Method, q: Array, v: Array, step: float, steps: int, *, t: float = 0.0, rtol: float = 1e-10,
    atol: float = 1e-12, perturb: bool = True,
) -> Trajectory:  # fmt: skip
    """Integrate with a fixed step (s) from q, v at time t (s); with constraints q and v must meet them.

    ``perturb``: whether index 3 starts with the velocities that spare its multipliers an error of first order.
    Raises NumericalError with the time where Newton's iteration fails.
    """
    q, v = product.update(equations.factors, np.asarray(q, float), np.zeros(len(v))), np.asarray(v, float)
    if isinstance(method, RungeKuttaMuntheKaas):
        return _runge_kutta(equations, method, q, v, step, steps, t)
    return _generalized_alpha(equations, method, q, v, step, steps, t, rtol, atol, perturb)


def _slope(equations: Equations, t: float, q: Array, v: Array, step: float) -> Array:
    """Return step vddot by a forward difference of second order over one step: what lies before t may be another regime."""
    vdot = accelerations(equations, t, q, v)[0]

    def ahead(share: float) -> Array:
        s = share * step
        moved = product.update(equations.factors, q, s * v + 0.5 * s * s * vdot)
        return accelerations(equations, t + s, moved, v + s * vdot)[0]

    result: Array = -3.0 * vdot + 4.0 * ahead(0.5) - ahead(1.0)
    return result


def initial_algorithmic_acceleration(
    equations: Equations, method: GeneralizedAlpha, t: float, q: Array, v: Array, step: float
) -> Array:
    """Return a_0 = vdot_0 + (alpha_m - alpha_f) step vddot_0."""
    slope = _slope(equations, t, q, v, step)
    result: Array = accelerations(equations, t, q, v)[0] + float(method.alpha_m - method.alpha_f) * slope
    return result


def _perturbation(equations: Equations, method: GeneralizedAlpha, t: float, q: Array, v: Array, step: float) -> Array:
    """Return the change of v_0 for index 3: B dv = B e, e the local error of the mean velocity (CISM 565, 2016)."""
    constraints = equations.constraints
    if constraints is None:
        raise ValueError("no constraints")
    share = float(1 - 6 * method.beta - 3 * (method.alpha_m - method.alpha_f)) / 6.0
    bracket = 1.0 / 12.0 if method.variant == "F0" else -1.0 / 6.0
    vdot = accelerations(equations, t, q, v)[0]
    error = share * step * _slope(equations, t, q, v, step)
    error = error + bracket * step**2 * product.bracket_matrix(equations.factors, v) @ vdot
    rate = constraints.jacobian(t, q) @ error
    rate[constraints.holonomic :] = 0.0
    change: Array = _saddle(equations, t, q, v, np.zeros(len(v)), rate)[: len(v)]
    return change


def _generalized_alpha(
    equations: Equations, method: GeneralizedAlpha, q: Array, v: Array, step: float, steps: int, t0: float, rtol: float,
    atol: float, perturb: bool,
) -> Trajectory:  # fmt: skip
    """Unknowns (D, step lam, eta) as in Arnold, Bruls and Cardona 2015; the C steppers take E = D + B_n^T eta for D."""
    residual, partials, constraints = equations.residual, equations.partials, equations.constraints
    if residual is None or partials is None:
        raise ValueError("generalized-alpha needs the residual and its partials")
    alpha_m, alpha_f = float(method.alpha_m), float(method.alpha_f)
    g = float(method.gamma / method.beta)
    b = float((1 - method.alpha_m) / (method.beta * (1 - method.alpha_f)))
    nv, nh = len(v), constraints.holonomic if constraints is not None else 0
    stabilised = method.form == STABILISED
    vdot, lam = accelerations(equations, t0, q, v)
    a = initial_algorithmic_acceleration(equations, method, t0, q, v, step)
    if nh and not stabilised and perturb:
        v = v + _perturbation(equations, method, t0, q, v, step)
    nl, ne = len(lam), nh if stabilised else 0
    skipped = 0 if stabilised else nh
    rows = [(t0, q, v, vdot, lam)]
    iterations = 0
    for count in range(1, steps + 1):
        t = t0 + step * count
        B_n = constraints.jacobian(t - step, q)[:ne] if constraints is not None else np.zeros((0, nv))
        x = np.concatenate([v + 0.5 * step * a, step * lam, np.zeros(ne)])
        v_new, vdot_new = v + step * a, (a - alpha_f * vdot) / (1.0 - alpha_f)
        for _ in range(_MAX_ITERATIONS):
            iterations += 1
            start, part = _last_exponential(equations, method, q, v, a, step)
            theta = step * (x[:nv] - part)
            q_new = product.update(equations.factors, start, theta)
            known = (t, q_new, v_new, vdot_new, *((x[nv : nv + nl] / step,) if nl else ()))
            T = product.tangent(equations.factors, theta)
            K, C, M = partials(*known)
            inertia = b * M + step * g * C
            S = np.zeros((nv + nl + ne, nv + nl + ne))
            S[:nv, :nv] = inertia + step**2 * K @ T
            right = [-step * residual(*known)]
            if constraints is not None:
                B, Z = constraints.jacobian(t, q_new), constraints.rate_partials(t, q_new, v_new)
                S[:nv, nv : nv + nl], S[:nv, nv + nl :] = B.T, inertia @ B_n.T
                S[nv : nv + nh, :nv] = (B @ T)[:nh]
                S[nv + nh :, :nv] = (g * B + step * Z @ T)[skipped:]
                S[nv + nh :, nv + nl :] = g * B[skipped:] @ B_n.T
                right += [-constraints.position(t, q_new) / step, -constraints.rate(t, q_new, v_new)[skipped:]]
            change = np.linalg.solve(S, np.concatenate(right))
            x = x + change
            velocity = change[:nv] + B_n.T @ change[nv + nl :]
            v_new, vdot_new = v_new + g * velocity, vdot_new + b / step * velocity
            sizes = np.repeat([np.max(np.abs(x[:nv])), np.max(np.abs(x[nv : nv + nl]), initial=0.0)], [nv, nl])
            floor = 8.0 * _EPSILON * np.concatenate([sizes, np.full(ne, sizes[0])])
            if np.sqrt(np.mean((change / (atol + rtol * np.abs(x) + floor)) ** 2)) <= 1.0:
                break
        else:
            raise NumericalError(Problem(f"t = {t:.9g}", "Newton's iteration did not converge", "a smaller step"))
        q = product.update(equations.factors, start, step * (x[:nv] - part))
        a = ((1.0 - alpha_f) * vdot_new + alpha_f * vdot - alpha_m * a) / (1.0 - alpha_m)
        v, vdot, lam = v_new, vdot_new, x[nv : nv + nl] / step
        rows.append((t, q, v, vdot, lam))
    return _trajectory(rows, iterations)


def _last_exponential(
    equations: Equations, method: GeneralizedAlpha, q: Array, v: Array, a: Array, step: float
) -> tuple[Array, Array]:
    """Return the configuration before the last exponential of a step, and what those before it take of the mean velocity."""
    if method.variant == "F0":
        return q, np.zeros(len(v))
    start = product.update(equations.factors, q, step * v)
    if method.variant == "F1":
        return start, v
    share = step * (0.5 - float(method.beta)) * a
    return product.update(equations.factors, start, step * share), v + share


def _runge_kutta(
    equations: Equations, method: RungeKuttaMuntheKaas, q: Array, v: Array, step: float, steps: int, t0: float
) -> Trajectory:
    A, b, c = np.array(method.A, float), np.array(method.b, float), np.array(method.c, float)
    rows = [(t0, q, v, *accelerations(equations, t0, q, v))]
    for count in range(steps):
        theta_rates, rates = np.zeros((len(b), len(v))), np.zeros((len(b), len(v)))
        for i in range(len(b)):
            theta, v_stage = step * A[i] @ theta_rates, v + step * A[i] @ rates
            theta_rates[i] = _algebra_velocity(equations.factors, theta, v_stage, method.commutators)
            stage_time = t0 + step * (count + c[i])
            rates[i] = accelerations(equations, stage_time, product.update(equations.factors, q, theta), v_stage)[0]
        q, v = product.update(equations.factors, q, step * b @ theta_rates), v + step * b @ rates
        t = t0 + step * (count + 1)
        rows.append((t, q, v, *accelerations(equations, t, q, v)))
    return _trajectory(rows, 0)


def _algebra_velocity(factors: Sequence[FactorLike], theta: Array, v: Array, commutators: int) -> Array:
    """Return T(theta)^-1 v, truncated after the given number of nested brackets."""
    bracket = product.bracket_matrix(factors, theta)
    result, term = v, v
    for factor in (0.5, 1.0 / 12.0)[:commutators]:
        term = bracket @ term
        result = result + factor * term
    return result


def _trajectory(rows: Sequence[tuple[Any, ...]], iterations: int) -> Trajectory:
    t, q, v, vdot, lam = (np.array(column) for column in zip(*rows, strict=True))
    return Trajectory(t, q, v, vdot, lam, iterations)
