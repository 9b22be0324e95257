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
from eomgen.integrators.methods import GeneralizedAlpha, Method, RungeKuttaMuntheKaas
from eomgen.lie import product
from eomgen.lie.product import FactorLike

Array = NDArray[np.float64]
_EPSILON = float(np.finfo(float).eps)
_MAX_ITERATIONS = 30


@dataclass(frozen=True)
class Equations:
    """Equations of motion as callables; inputs and base motion are functions of t inside them.

    Attributes
    ----------
    factors : sequence of Factor
    forward_dynamics : (t, q, v) -> vdot
    residual : (t, q, v, vdot) -> r, zero along motions; implicit methods only
    partials : (t, q, v, vdot) -> (K, C, M), the left-trivialised derivatives of r by q, v and vdot; implicit methods only
    """

    factors: Sequence[FactorLike]
    forward_dynamics: Callable[[float, Array, Array], Array]
    residual: Callable[[float, Array, Array, Array], Array] | None = None
    partials: Callable[[float, Array, Array, Array], tuple[Array, Array, Array]] | None = None


@dataclass(frozen=True)
class Trajectory:
    """States at the steps, the initial one first: t (n+1,), q (n+1, nq), v and vdot (n+1, nv); Newton iterations in all."""

    t: Array
    q: Array
    v: Array
    vdot: Array
    iterations: int = 0


def integrate(
    equations: Equations, method: Method, q: Array, v: Array, step: float, steps: int, *, t: float = 0.0, rtol: float = 1e-10,
    atol: float = 1e-12,
) -> Trajectory:  # fmt: skip
    """Integrate with a fixed step (s) from q, v at time t (s).

    Raises NumericalError with the time where Newton's iteration fails.
    """
    q, v = product.update(equations.factors, np.asarray(q, float), np.zeros(len(v))), np.asarray(v, float)
    if isinstance(method, RungeKuttaMuntheKaas):
        return _runge_kutta(equations, method, q, v, step, steps, t)
    return _generalized_alpha(equations, method, q, v, step, steps, t, rtol, atol)


def initial_algorithmic_acceleration(
    equations: Equations, method: GeneralizedAlpha, t: float, q: Array, v: Array, step: float
) -> Array:
    """Return a_0 = vdot_0 + (alpha_m - alpha_f) step vddot_0.

    vddot_0 is a forward difference of second order over one step: what lies before t may be another regime.
    """
    vdot = equations.forward_dynamics(t, q, v)

    def ahead(share: float) -> Array:
        s = share * step
        moved = product.update(equations.factors, q, s * v + 0.5 * s * s * vdot)
        return equations.forward_dynamics(t + s, moved, v + s * vdot)

    slope = -3.0 * vdot + 4.0 * ahead(0.5) - ahead(1.0)
    result: Array = vdot + float(method.alpha_m - method.alpha_f) * slope
    return result


def _generalized_alpha(
    equations: Equations,
    method: GeneralizedAlpha,
    q: Array,
    v: Array,
    step: float,
    steps: int,
    t0: float,
    rtol: float,
    atol: float,
) -> Trajectory:
    residual, partials = equations.residual, equations.partials
    if residual is None or partials is None:
        raise ValueError("generalized-alpha needs the residual and its partials")
    alpha_m, alpha_f = float(method.alpha_m), float(method.alpha_f)
    g = float(method.gamma / method.beta)
    b = float((1 - method.alpha_m) / (method.beta * (1 - method.alpha_f)))
    vdot = equations.forward_dynamics(t0, q, v)
    a = initial_algorithmic_acceleration(equations, method, t0, q, v, step)
    rows = [(t0, q, v, vdot)]
    iterations = 0
    for count in range(1, steps + 1):
        t = t0 + step * count
        mean = v + 0.5 * step * a
        v_new, vdot_new = v + step * a, (a - alpha_f * vdot) / (1.0 - alpha_f)
        for _ in range(_MAX_ITERATIONS):
            iterations += 1
            q_new = product.update(equations.factors, q, step * mean)
            K, C, M = partials(t, q_new, v_new, vdot_new)
            S = b * M + step * g * C + step**2 * K @ product.tangent(equations.factors, step * mean)
            change = np.linalg.solve(S, -step * residual(t, q_new, v_new, vdot_new))
            mean, v_new, vdot_new = mean + change, v_new + g * change, vdot_new + b / step * change
            weights = atol + rtol * np.abs(mean) + 8.0 * _EPSILON * np.max(np.abs(mean))
            if np.sqrt(np.mean((change / weights) ** 2)) <= 1.0:
                break
        else:
            raise NumericalError(Problem(f"t = {t:.9g}", "Newton's iteration did not converge", "a smaller step"))
        a = ((1.0 - alpha_f) * vdot_new + alpha_f * vdot - alpha_m * a) / (1.0 - alpha_m)
        q, v, vdot = product.update(equations.factors, q, step * mean), v_new, vdot_new
        rows.append((t, q, v, vdot))
    return _trajectory(rows, iterations)


def _runge_kutta(
    equations: Equations, method: RungeKuttaMuntheKaas, q: Array, v: Array, step: float, steps: int, t0: float
) -> Trajectory:
    A, b, c = np.array(method.A, float), np.array(method.b, float), np.array(method.c, float)
    rows = [(t0, q, v, equations.forward_dynamics(t0, q, v))]
    for count in range(steps):
        theta_rates, accelerations = np.zeros((len(b), len(v))), np.zeros((len(b), len(v)))
        for i in range(len(b)):
            theta, v_stage = step * A[i] @ theta_rates, v + step * A[i] @ accelerations
            theta_rates[i] = _algebra_velocity(equations.factors, theta, v_stage, method.commutators)
            stage_time = t0 + step * (count + c[i])
            accelerations[i] = equations.forward_dynamics(stage_time, product.update(equations.factors, q, theta), v_stage)
        q, v = product.update(equations.factors, q, step * b @ theta_rates), v + step * b @ accelerations
        t = t0 + step * (count + 1)
        rows.append((t, q, v, equations.forward_dynamics(t, q, v)))
    return _trajectory(rows, 0)


def _algebra_velocity(factors: Sequence[FactorLike], theta: Array, v: Array, commutators: int) -> Array:
    """Return T(theta)^-1 v, truncated after the given number of nested brackets."""
    bracket = product.bracket_matrix(factors, theta)
    result, term = v, v
    for factor in (0.5, 1.0 / 12.0)[:commutators]:
        term = bracket @ term
        result = result + factor * term
    return result


def _trajectory(rows: list[tuple[float, Any, Any, Any]], iterations: int) -> Trajectory:
    t, q, v, vdot = (np.array(column) for column in zip(*rows, strict=True))
    return Trajectory(t, q, v, vdot, iterations)
