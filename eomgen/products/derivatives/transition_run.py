"""Runs whose state is q, v and z alone, made linear: a step is a map of this state with one matrix of derivatives, and
accelerations and multipliers of rows follow from the state.

At a row, M and B being the inertia and the partials of the constraints' rates, r the residual and w' accelerations of
the constraints:

    [ M  B^T ] [ dvdot ]     [ r_q dq + r_v dv + r_z dz + r_p dp ]
    [ B   0  ] [ dlam  ] = - [ w'_q dq + w'_v dv + w'_p dp       ]
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.integrators.families.family import LinearTransitions
from eomgen.lie.product import difference
from eomgen.products.derivatives.linear_operations import LinearOperations, StepEnds
from eomgen.products.derivatives.linear_run import (
    DerivativeVariables,
    LinearPart,
    LinearRun,
    Start,
    undefined_derivatives,
)
from eomgen.products.derivatives.motion import ReplayedRun, RunSegment
from eomgen.products.derivatives.partitioned_steps import PartitionedOperations
from eomgen.products.derivatives.start import LinearizedStart, on_constraints
from eomgen.products.derivatives.steps import runge_kutta, variational
from eomgen.simulation.stepping.states import PrescribedInputs, States, states_of


@dataclass(frozen=True)
class TransitionPart(LinearPart):
    """A part of a run made linear.

    Attributes
    ----------
    transitions : (steps, size, size + parameters), changes of q, v and z at the ends of the steps with these at the
        starts, and with the parameters
    forced : (rows, nv + nl, size + parameters), changes of vdot and multipliers at the rows
    """

    transitions: Array
    forced: Array


class TransitionRun(LinearRun[TransitionPart]):
    """A run whose steps map q, v and z, made linear as matrices from state to state."""

    def __init__(self, motion: ReplayedRun, start: Start, by: DerivativeVariables, rows: Sequence[int]) -> None:
        super().__init__(motion, start, by, rows)
        self.size_of_state = 2 * self.equations.nv + self.equations.nz
        self.beginning = LinearizedStart(self, 0.0)
        self.along = on_constraints(self.beginning, self.asked, np.zeros(0)) if self.equations.nl else self.asked
        _, self.record = self.beginning.tangents(self.along, self.beginning.stages(self.along))
        self.state = np.concatenate([self.along.dq, self.along.dv, self.along.dz])

    def transitions(self, part: RunSegment, ends: StepEnds) -> Array:
        """Return the derivatives of q, v and z at the ends of the steps, (steps, size, size + parameters)."""
        method, equations, unknowns = self.run.method.linear_step, self.equations, dict[str, Array]()
        assert isinstance(method, LinearTransitions)  # for mypy
        if not method.b:
            theta = difference(equations.model.factors, ends.before.q, ends.after.q)
            unknowns = {"mean": theta / self.run.grid.step, "v_next": ends.after.v, "z_next": ends.after.z}
            unknowns |= {name: np.zeros((len(theta), equations.nl)) for name in ("first", "last")}
        kind = PartitionedOperations if method.b and equations.nl else LinearOperations
        step = kind(self, part, ends, unknowns)
        if method.b:
            runge_kutta(step, method)
        else:
            variational(step)
        return step.transitions()

    def linearise_part(self, part: RunSegment) -> TransitionPart:
        """Return a part of the run made linear. Raises NumericalError if derivatives of a step are not finite."""
        states = states_of(part.rows, self.run.model)
        prescribed = self.prescribe(states.t)
        blocks = self.blocks(states, prescribed)
        partials = self.equations.partials(blocks)
        forced = self.equations.forced_changes(blocks, partials)[:, : self.equations.nv + self.equations.nl]
        before, after = States(*(array[:-1] for array in states)), States(*(array[1:] for array in states))
        first, last = (
            PrescribedInputs(*(None if array is None else array[rows] for array in prescribed))
            for rows in (slice(None, -1), slice(1, None))
        )
        transitions = self.transitions(part, StepEnds(before, after, first, last, blocks, partials, forced))
        finite = np.isfinite(transitions).all(axis=(1, 2))
        if not finite.all():
            t = float(states.t[1:][int(np.argmin(finite))])
            raise undefined_derivatives(self.run.model, f"at t = {t:.6g} s")
        return TransitionPart(part.first, states, blocks, transitions, forced)

    def tangents(self, part: TransitionPart, dp: Array, state: Array) -> Array:
        size, equations = self.size_of_state, self.equations
        of_parameters = part.transitions[:, :, size:] @ dp
        ends = np.empty((len(part.transitions), size, state.shape[1]))
        now = state
        for step, (matrix, driven) in enumerate(zip(part.transitions[:, :, :size], of_parameters, strict=True)):
            now = ends[step] = matrix @ now + driven
        state[:] = now
        forced = part.forced[1:, :, :size] @ ends + part.forced[1:, :, size:] @ dp
        parts = np.split(ends, [2 * equations.nv], axis=1), np.split(forced, [equations.nv], axis=1)
        return np.concatenate([parts[0][0], parts[1][0], parts[0][1], parts[1][1]], axis=1)

    def take_back(self, part: TransitionPart, direct: Array, state: Array, gradient: Array) -> tuple[Array, Array]:
        """Take adjoints back through the transitions of a part, in place; see ``LinearRun``."""
        size, equations = self.size_of_state, self.equations
        nv, nz = equations.nv, equations.nz
        of_q_v, of_a, of_z, of_lam = np.split(direct, np.cumsum([2 * nv, nv, nz]), axis=1)
        state_gradient = np.concatenate([of_q_v, of_z], axis=1)
        forced = np.concatenate([of_a, of_lam], axis=1)
        if forced.any():
            taken = np.swapaxes(part.forced[1:], 1, 2) @ forced
            state_gradient = state_gradient + taken[:, :size]
            gradient += taken[:, size:].sum(axis=0)
        ends, now = np.empty_like(state_gradient), state
        for step in reversed(range(len(state_gradient))):
            ends[step] = now + state_gradient[step]
            now = part.transitions[step, :, :size].T @ ends[step]
        state[:] = now
        gradient += np.einsum("nsp,nsf->pf", part.transitions[:, :, size:], ends)
        return np.empty(0), np.empty(0)
