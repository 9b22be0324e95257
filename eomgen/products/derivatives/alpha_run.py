"""Runs of generalized-alpha and its kin made linear: matrices of the linearised steps between rows of a run, and the
start."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.integrators.families.family import LinearStep
from eomgen.lie import numeric
from eomgen.lie.groups import group_named
from eomgen.lie.product import Factor, difference
from eomgen.products.derivatives.equations import EquationPartials, Equations
from eomgen.products.derivatives.linear_run import (
    DerivativeVariables,
    LinearPart,
    LinearRun,
    Start,
    undefined_derivatives,
)
from eomgen.products.derivatives.linear_steps import LinearSteps, StepMatrices
from eomgen.products.derivatives.motion import ReplayedRun, RunSegment
from eomgen.products.derivatives.start import LinearizedStart, StateDirections, on_constraints
from eomgen.simulation.stepping.states import PrescribedInputs, States


def step_matrices(
    equations: Equations,
    partials: EquationPartials,
    states: States,
    given: PrescribedInputs,
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
    values = equations.values(before, PrescribedInputs(*(None if array is None else array[:-1] for array in given)))
    B = equations.of("constraint_jacobian", values)["B"][:, : equations.holonomic]
    G = B * inverse_inertia
    exponent = difference(factors, states.q[:-1], states.q[1:]) / step
    moved = _predicted(states, a, coefficients) - exponent  # W B^T eta
    multipliers = np.linalg.solve(B @ np.swapaxes(G, 1, 2), B @ moved[:, :, np.newaxis])
    eta = np.asarray(multipliers[:, :, 0], dtype=np.float64)
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


@dataclass(frozen=True)
class AlphaPart(LinearPart):
    """A part of a run made linear.

    Attributes
    ----------
    matrices : of the steps between rows
    eta : (rows - 1, holonomic), multipliers of velocities in the steps
    """

    matrices: StepMatrices
    eta: Array


class AlphaRun(LinearRun[AlphaPart]):
    """A run of generalized-alpha with linearised steps.

    Attributes
    ----------
    along : changes of the start along the directions, on the constraints
    stages : the states with accelerations evaluated at the start, with the changes of these states
    inverse_inertia : W = 1/M_ii of the start, by which multipliers move positions; empty if there is none
    """

    def __init__(
        self, motion: ReplayedRun, method: LinearStep, start: Start, by: DerivativeVariables, rows: Sequence[int]
    ) -> None:
        super().__init__(motion, start, by, rows)
        model, begun = self.run.model, motion.start
        self.coefficients = (self.run.grid.step, *method)
        holonomic = self.equations.holonomic
        self.linear = LinearSteps(model.functions.sizes, model.factors, self.coefficients, holonomic)
        self.inverse_inertia = begun.get("inverse_inertia", np.zeros(0)) if holonomic else np.zeros(0)
        self.along = (
            on_constraints(self.beginning, self.asked, self.inverse_inertia) if model.multipliers else self.asked
        )
        self.stages = self.beginning.stages(self.of_equations(self.along))
        self.state, self.record = self.beginning.tangents(self.of_equations(self.along), self.stages)

    @cached_property
    def beginning(self) -> LinearizedStart:
        """The start of the run."""
        start, run = self.motion.start, self.run
        _, alpha_m, alpha_f, *_ = self.coefficients
        share = alpha_m - alpha_f if np.any(start["a"] != start["vdot"]) else 0.0
        z = start.get("z", np.zeros(0))
        state = start["q"], start["v"], z
        times = run.grid.start, run.grid.step
        return LinearizedStart(
            self.equations, *times, *state, self._prescribed_at, self.moved_inputs, share, self.start.asked
        )

    def of_equations(self, along: StateDirections) -> StateDirections:
        """Return directions without motions of multipliers of velocities, which are not in the equations."""
        return StateDirections(along.dq, along.dv, along.dz, along.dp[: self.equations.parameters])

    def of_part(self, part: RunSegment) -> AlphaPart:
        """Make a part of the run linear."""
        states, given = self.states(part)
        blocks = self.blocks(states, given)
        behind = {name: array if name == "p" else array[1:] for name, array in blocks.items()}
        partials = self.equations.partials(behind)
        rows = np.isfinite(partials.Jq).all(axis=(1, 2)) & np.isfinite(partials.Jv).all(axis=(1, 2))
        if not rows.all():
            t = float(states.t[1:][int(np.argmin(rows))])
            raise undefined_derivatives(self.run.model, f"at t = {t:.6g} s")
        matrices, eta = step_matrices(
            self.equations, partials, states, given, part.memory, self.coefficients, self.inverse_inertia
        )
        return AlphaPart(part.first, states, blocks, matrices, eta)

    def tangents(self, part: AlphaPart, dp: Array, state: Array) -> Array:
        return self.linear.tangents(part.matrices, dp, state, part.times)[0]

    def take_back(self, part: AlphaPart, direct: Array, state: Array, gradient: Array) -> tuple[Array, Array]:
        return self.linear.adjoints(part.matrices, direct, state, gradient, part.times)

    def products(self, matrices: Array, columns: Array) -> Array:
        return self.linear.products(matrices, columns)

    def _prescribed_at(self, share: float) -> PrescribedInputs:
        """Return inputs and base at a share of the first step: rows of inputs are linear in between."""
        run, equations = self.run, self.equations
        ends = run.grid.start + run.grid.step * np.array([0.0, 1.0])
        now = np.array([run.grid.start + share * run.grid.step])
        base = self.base(now)
        if not run.model.nu:
            return PrescribedInputs(None, base)
        if not run.takes_rows:
            return PrescribedInputs(run.model.input_values(now, parameters=equations.p), base)
        first, last = run.signals.rows(ends)
        return PrescribedInputs(((1.0 - share) * first + share * last)[np.newaxis], base)
