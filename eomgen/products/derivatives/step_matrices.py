"""Matrices of the linearised steps between rows of a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.lie import numeric
from eomgen.lie.groups import group_named
from eomgen.lie.product import Factor, difference
from eomgen.products.derivatives.equations import Equations, Partials
from eomgen.products.derivatives.linear_steps import StepMatrices
from eomgen.simulation.stepping.states import Prescribed, States


def step_matrices(
    equations: Equations,
    partials: Partials,
    states: States,
    given: Prescribed,
    a: Array,
    coefficients: Sequence[float],
    inverse_inertia: Array,
) -> tuple[StepMatrices, Array]:
    """Return the matrices of the steps between states (n + 1), (n, ...) each, and eta, (n, holonomic).

    Parameters
    ----------
    partials : of the equations at the ends of the steps
    a : (nv,) algorithmic acceleration at the first state
    inverse_inertia : (nv,) W, by which multipliers of velocities move positions; empty if there are none
    """
    factors, step, count, nv = equations.model.factors, coefficients[0], len(states.t) - 1, equations.nv
    A, T = _turning(factors, states.q)
    e = partials
    if not equations.holonomic or not inverse_inertia.size:
        none = tuple(np.zeros((count, 0, 0)) for _ in range(3))
        return StepMatrices(e.Jq, e.Jv, e.Ja, e.Jz, e.Jlam, e.P, A, T, *none), np.zeros((count, 0))
    before = States(*(array[:-1] for array in states))
    values = equations.values(before, Prescribed(*(None if array is None else array[:-1] for array in given)))
    B = equations.of("constraint_jacobian", values)["B"][:, : equations.holonomic]
    G = B * inverse_inertia
    exponent = difference(factors, states.q[:-1], states.q[1:]) / step
    moved = _predicted(states, a, coefficients) - exponent  # W B^T eta
    found = np.linalg.solve(B @ np.swapaxes(G, 1, 2), B @ moved[:, :, np.newaxis])
    eta = np.asarray(found[:, :, 0], dtype=np.float64)
    N, of_parameters = equations.reaction_partials(values, eta)
    reaction = np.swapaxes(B, 1, 2) @ eta[:, :, np.newaxis]
    Np = np.concatenate([inverse_inertia[:, np.newaxis] * of_parameters, reaction * np.eye(nv)], axis=2)
    P = np.concatenate([e.P, np.zeros((*e.P.shape[:2], nv))], axis=2)
    weighed = inverse_inertia[:, np.newaxis] * N
    return StepMatrices(e.Jq, e.Jv, e.Ja, e.Jz, e.Jlam, P, A, T, G, weighed, Np), eta


def _predicted(states: States, a: Array, coefficients: Sequence[float]) -> Array:
    """Return v + h ((1/2 - beta) a + beta a') of each step, (n, nv)."""
    h, alpha_m, alpha_f, beta = coefficients[:4]
    result = np.empty_like(states.v[1:])
    for k, (v, vdot, vdot_next) in enumerate(zip(states.v[:-1], states.a[:-1], states.a[1:], strict=True)):
        a_next = ((1.0 - alpha_f) * vdot_next + alpha_f * vdot - alpha_m * a) / (1.0 - alpha_m)
        result[k] = v + h * ((0.5 - beta) * a + beta * a_next)
        a = a_next
    return result


def _turning(factors: Sequence[Factor], q: Array) -> tuple[Array, Array]:
    """Return Ad(exp(-theta)) and T(theta) of the rotating factors between configurations, (n, numbers) each."""
    count = len(q) - 1
    blocks: tuple[list[Array], list[Array]] = [], []
    for factor in factors:
        if factor.group == "R":
            continue
        group = group_named(factor.group, factor.v_size)
        first, last = q[:-1, factor.q], q[1:, factor.q]
        theta = numeric.log(group, numeric.compose(group, numeric.inverse(group, first), last))
        blocks[0].append(numeric.adjoint(group, numeric.exp(group, -theta)).reshape(count, -1))
        blocks[1].append(numeric.tangent(group, theta).reshape(count, -1))
    A, T = (np.concatenate([np.zeros((count, 0)), *parts], axis=1) for parts in blocks)
    return A, T
