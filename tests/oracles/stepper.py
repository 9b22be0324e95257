"""Both method families in NumPy: slow, clear, and the oracle that the generated C steppers are held against.

Every iteration forms and solves its own linear system, nothing is reused, and a step that does not converge is an
error.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from eomgen.errors import NumericalError, Problem
from eomgen.integrators.families.generalized_alpha import SPATIAL, STABILISED, GeneralizedAlpha
from eomgen.integrators.families.runge_kutta import RungeKuttaMuntheKaas
from eomgen.lie import product
from eomgen.lie.product import Factor
from tests.oracles.equations import Array, Constraints, Equations, InternalStates, Trajectory

__all__ = [
    "Array", "Constraints", "Equations", "InternalStates", "Trajectory", "accelerations", "initial_algorithmic_rates",
    "integrate",
]  # fmt: skip  # a table

_EPSILON = float(np.finfo(float).eps)
_MAX_ITERATIONS = 30


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
    equations: Equations,
    method: GeneralizedAlpha | RungeKuttaMuntheKaas,
    q: Array,
    v: Array,
    step: float,
    steps: int,
    *,
    t: float = 0.0,
    rtol: float = 1e-10,
    atol: float = 1e-12,
    perturb: bool = True,
    z: Array | None = None,
) -> Trajectory:
    """Integrate with a fixed step (s) from q, v at time t (s); with constraints q and v must meet them.

    ``perturb``: whether index 3 starts with the velocities that spare its multipliers an error of first order.
    Raises NumericalError with the time where Newton's iteration fails.
    """
    q, v = product.update(equations.factors, np.asarray(q, float), np.zeros(len(v))), np.asarray(v, float)
    z = np.zeros(0) if z is None else np.asarray(z, float)
    if isinstance(method, RungeKuttaMuntheKaas):
        return _runge_kutta(equations, method, (q, v, z), step, steps, t)
    return _generalized_alpha(equations, method, (q, v, z), step, steps, t, rtol, atol, perturb)


def _slopes(equations: Equations, t: float, q: Array, v: Array, z: Array, step: float) -> tuple[Array, Array]:
    """Return step vddot and step zddot by a forward difference of second order over one step.

    What lies before t may be another regime. Internal states go ahead by a linearly implicit step, which fast ones bear
    too.
    """
    vdot, zdot = accelerations(equations.at(z), t, q, v)[0], equations.rate(t, q, v, z)
    by_state = np.zeros((0, 0)) if equations.internal is None else equations.internal.partials(t, q, v, z)[3]

    def ahead(share: float) -> Array:
        s = share * step
        moved = product.update(equations.factors, q, s * v + 0.5 * s * s * vdot)
        there = z + np.linalg.solve(np.eye(len(z)) - s * by_state, s * zdot)
        rates = accelerations(equations.at(there), t + s, moved, v + s * vdot)[0]
        return np.concatenate([rates, equations.rate(t + s, moved, v + s * vdot, there)])

    result = -3.0 * np.concatenate([vdot, zdot]) + 4.0 * ahead(0.5) - ahead(1.0)
    return result[: len(v)], result[len(v) :]


def initial_algorithmic_rates(
    equations: Equations, method: GeneralizedAlpha, t: float, q: Array, v: Array, step: float, z: Array | None = None
) -> tuple[Array, Array]:
    """Return a_0 = vdot_0 + (alpha_m - alpha_f) step vddot_0, and the same for zdot with its own alpha_m."""
    z = np.zeros(0) if z is None else z
    slope, z_slope = _slopes(equations, t, q, v, z, step)
    if method.variant == SPATIAL:
        slope = slope + step * product.bracket_matrix(equations.factors, v) @ accelerations(equations.at(z), t, q, v)[0]
    a: Array = accelerations(equations.at(z), t, q, v)[0] + float(method.alpha_m - method.alpha_f) * slope
    return a, equations.rate(t, q, v, z) + float(method.rate_alpha_m - method.alpha_f) * z_slope


def _perturbation(
    equations: Equations, method: GeneralizedAlpha, t: float, q: Array, v: Array, z: Array, step: float
) -> Array:
    """Return the change of v_0 for index 3: B dv = B e, e the local error of the mean velocity (CISM 565, 2016)."""
    constraints = equations.constraints
    if constraints is None:
        raise ValueError("no constraints")
    share = float(1 - 6 * method.beta - 3 * (method.alpha_m - method.alpha_f)) / 6.0
    bracket = {"F0": 1.0 / 12.0, SPATIAL: share}.get(method.variant, -1.0 / 6.0)
    vdot = accelerations(equations.at(z), t, q, v)[0]
    error = share * step * _slopes(equations, t, q, v, z, step)[0]
    error = error + bracket * step**2 * product.bracket_matrix(equations.factors, v) @ vdot
    rate = constraints.jacobian(t, q) @ error
    rate[constraints.holonomic :] = 0.0
    change: Array = _saddle(equations.at(z), t, q, v, np.zeros(len(v)), rate)[: len(v)]
    return change


def _generalized_alpha(
    equations: Equations,
    method: GeneralizedAlpha,
    state: tuple[Array, Array, Array],
    step: float,
    steps: int,
    t0: float,
    rtol: float,
    atol: float,
    perturb: bool,
) -> Trajectory:
    """Unknowns (D, step lam, eta) as in Arnold, Bruls and Cardona 2015, and (z - z_n)/step; eta moves positions by W
    B_n^T.

    W = diag(1/M_ii) at the start, so that no unit of length makes a difference. The C steppers take E = D + W B_n^T eta
    for D. Increments are measured as theirs are (``_tolerances``).
    """
    constraints, internal = equations.constraints, equations.internal
    q, v, z = state
    alpha_m, alpha_f = float(method.alpha_m), float(method.alpha_f)
    g = float(method.gamma / method.beta)
    b = float((1 - method.alpha_m) / (method.beta * (1 - method.alpha_f)))
    rate_alpha_m, rate_gain = float(method.rate_alpha_m), float(method.rate_gain)
    nv, nz, nh = len(v), len(z), constraints.holonomic if constraints is not None else 0
    stabilised = method.form == STABILISED
    (vdot, lam), zdot = accelerations(equations.at(z), t0, q, v), equations.rate(t0, q, v, z)
    a, z_rate = initial_algorithmic_rates(equations, method, t0, q, v, step, z)
    if nh and not stabilised and perturb:
        v = v + _perturbation(equations, method, t0, q, v, z, step)
    nl, ne = len(lam), nh if stabilised else 0
    if equations.partials is None:
        raise ValueError("generalized-alpha needs the residual and its partials")
    at_rest = (np.zeros(nv), *((np.zeros(nl),) if nl else ()))
    inertia_of = np.diag(equations.at(z).partials(t0, q, v, *at_rest)[2])  # type: ignore[misc]
    lightness = np.divide(1.0, inertia_of, out=np.ones(nv), where=inertia_of > 0.0)
    skipped = 0 if stabilised else nh
    first_z = nv + nl + ne
    rows = [(t0, q, v, vdot, lam, z)]
    iterations = 0
    means: list[Array] = []  # of the velocity over the last three steps, newest first
    for count in range(1, steps + 1):
        t = t0 + step * count
        B_n = constraints.jacobian(t - step, q)[:ne] * lightness if constraints is not None else np.zeros((0, nv))
        if method.variant == SPATIAL:
            start, (part, v, a, vdot, *means) = q, _carried(equations, v, a, vdot, means, step)
        else:
            start, part = _last_exponential(equations, method, q, v, a, step)
        x = np.concatenate([v + 0.5 * step * a, step * lam, np.zeros(ne), z_rate])
        zdot_new = (z_rate - alpha_f * zdot) / (1.0 - alpha_f)
        v_new, vdot_new = v + step * a, (a - alpha_f * vdot) / (1.0 - alpha_f)
        previous = np.inf
        for iteration in range(_MAX_ITERATIONS):
            iterations += 1
            theta = step * (x[:nv] - part)
            q_new = product.update(equations.factors, start, theta)
            z_new = z + step * x[first_z:]
            here = equations.at(z_new)
            if here.residual is None or here.partials is None:
                raise ValueError("generalized-alpha needs the residual and its partials")
            known = (t, q_new, v_new, vdot_new, *((x[nv : nv + nl] / step,) if nl else ()))
            T = product.tangent(equations.factors, theta)
            K, C, M = here.partials(*known)
            inertia = b * M + step * g * C
            S = np.zeros((first_z + nz, first_z + nz))
            S[:nv, :nv] = inertia + step**2 * K @ T
            right = [-step * here.residual(*known)]
            if constraints is not None:
                B, Z = constraints.jacobian(t, q_new), constraints.rate_partials(t, q_new, v_new)
                S[:nv, nv : nv + nl], S[:nv, nv + nl : first_z] = B.T, inertia @ B_n.T
                S[nv : nv + nh, :nv] = (B @ T)[:nh]
                S[nv + nh : first_z, :nv] = (g * B + step * Z @ T)[skipped:]
                S[nv + nh : first_z, nv + nl : first_z] = g * B[skipped:] @ B_n.T
                right += [-constraints.position(t, q_new) / step, -constraints.rate(t, q_new, v_new)[skipped:]]
            if internal is not None:
                Rz, Fq, Fv, Fz = internal.partials(t, q_new, v_new, z_new)
                S[:nv, first_z:], S[first_z:, first_z:] = step**2 * Rz, step**2 * Fz - step * rate_gain * np.eye(nz)
                S[first_z:, :nv] = step**2 * Fq @ T + step * g * Fv
                right += [-step * (internal.rate(t, q_new, v_new, z_new) - zdot_new)]
            change = np.linalg.solve(S, np.concatenate(right))
            x = x + change
            velocity = change[:nv] + B_n.T @ change[nv + nl : first_z]
            zdot_new = zdot_new + rate_gain * change[first_z:]
            v_new, vdot_new = v_new + g * velocity, vdot_new + b / step * velocity
            full = x.copy()
            full[:nv] = full[:nv] + B_n.T @ x[nv + nl : first_z]
            rows_of = constraints.jacobian(t, q_new) if constraints is not None else np.zeros((0, nv))
            allowed = _tolerances(full, v, z_rate, 1.0 / np.sqrt(lightness), rows_of, (nl, ne), rtol, atol)
            size = float(np.sqrt(np.mean((change / allowed) ** 2)))
            rounding = 64.0 * _EPSILON * (np.max(np.abs(full[:nv])) + np.max(np.abs(q_new)) / step)
            if size <= 1.0 or (iteration >= 2 and size > 0.5 * previous and np.max(np.abs(change[:nv])) <= rounding):
                break
            previous = size
        else:
            raise NumericalError(Problem(f"t = {t:.9g}", "Newton's iteration did not converge", "a smaller step"))
        q = product.update(equations.factors, start, step * (x[:nv] - part))
        q = q if equations.followed is None else equations.followed(t, q)
        a = ((1.0 - alpha_f) * vdot_new + alpha_f * vdot - alpha_m * a) / (1.0 - alpha_m)
        means = [x[:nv], *means[:2]]
        z_rate = ((1.0 - alpha_f) * zdot_new + alpha_f * zdot - rate_alpha_m * z_rate) / (1.0 - rate_alpha_m)
        v, vdot, lam, z, zdot = v_new, vdot_new, x[nv : nv + nl] / step, z + step * x[first_z:], zdot_new
        rows.append((t, q, v, vdot, lam, z))
    return _trajectory(rows, iterations)


def _tolerances(
    x: Array, v: Array, z_rate: Array, roots: Array, B: Array, counts: tuple[int, int], rtol: float, atol: float
) -> Array:
    """Return what increments of E, step lam, eta and (z - z_n)/step may be: relative to their sizes and to the
    motion's.

    Parameters
    ----------
    roots : (nv,) array
        Roots of the diagonal of M: velocities times these are comparable, whatever their units.
    counts : of lam and of eta
    """
    nv, (nl, ne) = len(v), counts
    change = roots * (x[:nv] - v)
    speed = np.sqrt((np.sum((roots * x[:nv]) ** 2) + np.sum(change**2)) / nv)
    lengths = np.linalg.norm(B / roots, axis=1)
    impulse = np.sqrt(np.sum((lengths * x[nv : nv + nl]) ** 2) + np.sum(change**2))
    y = x[nv + nl + ne :]
    parts = (speed / roots, impulse / lengths, speed / lengths[:ne], np.abs(y) + np.abs(y - z_rate))
    result: Array = (atol + 4.0 * _EPSILON) * np.concatenate(parts) + rtol * np.abs(x) + np.finfo(float).tiny
    return result


def _carried(equations: Equations, v: Array, a: Array, vdot: Array, means: Sequence[Array], step: float) -> list[Array]:
    """Return what a spatial step starts from, told where it is predicted to end: the bracket of its exponent, v, a,
    vdot, means.

    Seen from a frame that does not turn, the body's log is step D - step^3/12 [v, vdot]; D from means, which
    constraints have corrected, because a and vdot carry parasitic parts that would be fed back.
    """
    D = 3.0 * (means[0] - means[1]) + means[2] if len(means) == 3 else v + 0.5 * step * a
    first, second = (means[0], step * D) if means else (v, step**2 * a)
    part = product.bracket_matrix(equations.factors, first) @ second / 12.0
    carry = product.transport(equations.factors, step * (D - part))
    return [carry @ x for x in (part, v, a, vdot, *means)]


def _last_exponential(
    equations: Equations, method: GeneralizedAlpha, q: Array, v: Array, a: Array, step: float
) -> tuple[Array, Array]:
    """Return the configuration before the last exponential of a step, and what those before it take of the mean
    velocity."""
    if method.variant == "F0":
        return q, np.zeros(len(v))
    start = product.update(equations.factors, q, step * v)
    if method.variant == "F1":
        return start, v
    share = step * (0.5 - float(method.beta)) * a
    return product.update(equations.factors, start, step * share), v + share


def _runge_kutta(
    equations: Equations,
    method: RungeKuttaMuntheKaas,
    state: tuple[Array, Array, Array],
    step: float,
    steps: int,
    t0: float,
) -> Trajectory:
    q, v, z = state
    A, b, c = np.array(method.A, float), np.array(method.b, float), np.array(method.c, float)
    rows = [(t0, q, v, *accelerations(equations.at(z), t0, q, v), z)]
    for count in range(steps):
        theta_rates, rates, z_rates = (np.zeros((len(b), size)) for size in (len(v), len(v), len(z)))
        for i in range(len(b)):
            theta, v_stage, z_stage = step * A[i] @ theta_rates, v + step * A[i] @ rates, z + step * A[i] @ z_rates
            theta_rates[i] = _algebra_velocity(equations.factors, theta, v_stage, method.commutators)
            stage_time = t0 + step * (count + c[i])
            q_stage = product.update(equations.factors, q, theta)
            rates[i] = accelerations(equations.at(z_stage), stage_time, q_stage, v_stage)[0]
            z_rates[i] = equations.rate(stage_time, q_stage, v_stage, z_stage)
        q, v = product.update(equations.factors, q, step * b @ theta_rates), v + step * b @ rates
        z = z + step * b @ z_rates
        t = t0 + step * (count + 1)
        rows.append((t, q, v, *accelerations(equations.at(z), t, q, v), z))
    return _trajectory(rows, 0)


def _algebra_velocity(factors: Sequence[Factor], theta: Array, v: Array, commutators: int) -> Array:
    """Return T(theta)^-1 v, truncated after the given number of nested brackets."""
    bracket = product.bracket_matrix(factors, theta)
    result, term = v, v
    for factor in (0.5, 1.0 / 12.0)[:commutators]:
        term = bracket @ term
        result = result + factor * term
    return result


def _trajectory(rows: Sequence[tuple[Any, ...]], iterations: int) -> Trajectory:
    t, q, v, vdot, lam, z = (np.array(column) for column in zip(*rows, strict=True))
    return Trajectory(t, q, v, vdot, lam, z, iterations)
