"""Runs of explicit Runge-Kutta methods in the Lie algebra made linear, with stages that coordinate partitioning brings
onto the constraints, if there are any.

Stages are evaluated once more, in all steps of a part side by side:

    theta_i = h sum_j A_ij Theta_j,  q_i = q o exp(theta_i),  v_i = v + h sum_j A_ij V_j,  z_i = z + h sum_j A_ij F_j,

and so is the end with b in place of A_i. Dependent components D then take q_i o exp(delta), delta_I = 0, to Phi = 0,
and v_i + e, e_I = 0, to B v + Phi_t = 0:

    B (A_delta dq + T_delta ddelta) + Phi_p dp = 0,   B_D de + Z dq + B dv + w_p dp = 0.

Slopes are Theta_i = v_i + [theta_i, v_i]/2 + [theta_i, [theta_i, v_i]]/12, accelerations V_i and rates F_i.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.errors import NumericalError, Problem
from eomgen.integrators.families.family import LinearTransitions
from eomgen.lie import product
from eomgen.products.derivatives.equations import rows_of, solve
from eomgen.products.derivatives.motion import ReplayedRun, RunSegment
from eomgen.products.derivatives.transition_run import StepEnds, TransitionRun
from eomgen.simulation.stepping.states import PrescribedInputs, States

#: Corrections of positions at most, and the part of a step's change above which stages that are evaluated again miss
#: the run.
_CORRECTIONS, _MISSED = 16, 1e-7
#: Differences below this part of the coordinates are rounding.
_ROUNDING = 1e-13


class PartitionedMotion(ReplayedRun):
    """A run by coordinate partitioning, whose segments keep the dependent components of each step, which rows lack."""

    def _take_steps(self, size: int, table: Array | None, record: Array) -> Array:
        part = self.stepper.places["dependent"]
        memory = np.empty((size, len(self.stepper.state[part])))
        of_step = len(self.stepper.input_times) - 1
        for k in range(size):
            memory[k] = self.stepper.state[part]
            of_inputs = None if table is None else table[k * of_step :]
            self.check(self.stepper.run(1, 1, of_inputs, record[k : k + 1])[0])
        return memory


@dataclass(frozen=True)
class Moved:
    """Values (n, size) and their changes (n, size, state + parameters)."""

    value: Array
    along: Array

    def plus(self, terms: Sequence[tuple[float, Moved]]) -> Moved:
        """Return the sum with multiples of others."""
        value, along = self.value, self.along
        for factor, term in terms:
            value, along = value + factor * term.value, along + factor * term.along
        return Moved(value, along)


@dataclass(frozen=True)
class Slopes:
    """Rates of the increment, of velocities and of internal states at a stage."""

    theta: Moved
    v: Moved
    z: Moved


class StageRun(TransitionRun):
    """A run of an explicit Runge-Kutta method in the Lie algebra, with linearised steps from state to state."""

    @cached_property
    def method(self) -> LinearTransitions:
        """Coefficients of the method."""
        step = self.run.method.linear_step
        assert isinstance(step, LinearTransitions)  # for mypy
        return step

    def transitions(self, part: RunSegment, ends: StepEnds) -> Array:
        """Return the derivatives of q, v and z at the ends of the steps, (steps, size, size + parameters), stage by
        stage."""
        equations, h, count, before = self.equations, self.run.grid.step, len(ends.before.t), ends.before
        nv, size = equations.nv, self.size_of_state
        unit = np.eye(size, size + equations.parameters)
        q, v, z = (
            Moved(value, np.broadcast_to(along, (count, *along.shape)))
            for value, along in zip((before.q, before.v, before.z), np.split(unit, [nv, 2 * nv]), strict=True)
        )
        dependent = part.memory.astype(np.intp)
        still = Moved(np.zeros((count, nv)), np.zeros_like(q.along))
        begun = rows_of(ends.blocks, slice(None, -1))
        slopes = [Slopes(v, Moved(before.a, ends.forced[:-1, :nv] @ self._state(q, v, z)), self._rates(begun, q, v, z))]

        def move(weights: Sequence[float], t: Array, prescribed: PrescribedInputs) -> tuple[Moved, Moved, Moved, Moved]:
            """Return the increment, and positions, velocities and internal states on the constraints."""
            used = [(h * float(weight), slope) for weight, slope in zip(weights, slopes, strict=False) if weight]
            theta = still.plus([(weight, slope.theta) for weight, slope in used])
            velocity = v.plus([(weight, slope.v) for weight, slope in used])
            states = z.plus([(weight, slope.z) for weight, slope in used])
            position = self._update(q, theta)
            if equations.nl:
                position, velocity = self._correct(position, velocity, states, t, prescribed, dependent)
            return theta, position, velocity, states

        for row, share in zip(self.method.A[1:], self.method.c[1:], strict=True):
            t = ends.after.t if share == 1.0 else before.t + share * h
            prescribed = ends.at_end if share == 1.0 else self.prescribe(t)
            slopes.append(self._slopes(*move(row, t, prescribed), t, prescribed))
        _, position, velocity, states = move(self.method.b, ends.after.t, ends.at_end)
        if equations.nl:  # without constraints no component depends on others
            self._check(ends, position, velocity)
        return np.concatenate([position.along, velocity.along, states.along], axis=1)

    def _update(self, q: Moved, theta: Moved) -> Moved:
        """Return q o exp(theta)."""
        factors = self.equations.model.factors
        A, T = product.transport(factors, theta.value), product.tangent(factors, theta.value)
        return Moved(product.update(factors, q.value, theta.value), A @ q.along + T @ theta.along)

    def _blocks(self, q: Array, v: Array, z: Array, t: Array, prescribed: PrescribedInputs) -> dict[str, Array]:
        none = np.zeros((len(t), self.equations.nv)), np.zeros((len(t), self.equations.nl))
        return self.blocks(States(t, q, v, *none, z), prescribed)

    def _slopes(
        self, theta: Moved, position: Moved, v: Moved, z: Moved, t: Array, prescribed: PrescribedInputs
    ) -> Slopes:
        equations, factors = self.equations, self.equations.model.factors
        nv = equations.nv
        values = equations.with_accelerations(self._blocks(position.value, v.value, z.value, t, prescribed))
        partials = equations.partials(values)
        forced = self.forced_changes(values, partials)[:, :nv]
        state = self._state(position, v, z)
        ad_theta, ad_v = product.bracket_matrix(factors, theta.value), product.bracket_matrix(factors, v.value)
        first = ad_theta @ v.value[:, :, np.newaxis]
        by_theta = -0.5 * ad_v - (ad_theta @ ad_v + product.bracket_matrix(factors, first[:, :, 0])) / 12.0
        by_v = np.eye(nv) + 0.5 * ad_theta + ad_theta @ ad_theta / 12.0
        rate = Moved((by_v @ v.value[:, :, np.newaxis])[:, :, 0], by_theta @ theta.along + by_v @ v.along)
        return Slopes(rate, Moved(values["a"], forced @ state), self._rates(values, position, v, z))

    def _state(self, q: Moved, v: Moved, z: Moved) -> Array:
        """Return changes of q, v, z and the parameters, one below the other."""
        size = self.size_of_state
        parameters = np.eye(size + self.equations.parameters)[size:]
        directions = np.broadcast_to(parameters, (len(q.along), *parameters.shape))
        return np.concatenate([q.along, v.along, z.along, directions], axis=1)

    def _rates(self, values: Mapping[str, Array], q: Moved, v: Moved, z: Moved) -> Moved:
        """Return the rates of the internal states at n states, with their changes; `values` are the input blocks
        there."""
        equations, nv, nz = self.equations, self.equations.nv, self.equations.nz
        if not nz:
            return z
        e = equations.partials(values)
        by = np.concatenate([e.Jq, e.Jv, e.Jz, e.P], axis=2)[:, nv : nv + nz]
        return Moved(equations.of("internal_rate", values)["zdot"], -by @ self._state(q, v, z))

    def _correct(
        self, position: Moved, v: Moved, z: Moved, t: Array, prescribed: PrescribedInputs, dependent: NDArray[np.intp]
    ) -> tuple[Moved, Moved]:
        """Return positions and velocities moved onto the constraints along the dependent components, with their
        changes. `dependent` (n, nl) are the numbers of these components of v."""
        equations, factors = self.equations, self.equations.model.factors
        nv, nz, nl, nh, count = equations.nv, equations.nz, equations.nl, equations.holonomic, len(t)
        unit = np.zeros((count, nv, nl))
        np.put_along_axis(unit, dependent[:, np.newaxis, :], 1.0, axis=1)
        q, size = position.value, self.size_of_state
        if nh < nl:
            position = self._moved_onto(position, v, z, t, prescribed, unit) if nh else position
            q = position.value
        for _ in range(_CORRECTIONS if nh == nl else 0):
            values = self._blocks(q, v.value, z.value, t, prescribed)
            (Phi,) = equations.of("constraint", values).values()
            (held,) = equations.of("constraint_jacobian", values).values()
            change = np.linalg.solve(held @ unit, -Phi[:, :, np.newaxis])
            q = product.update(factors, q, (unit @ change)[:, :, 0])
            if np.max(np.abs(change), initial=0.0) < 1e-15 * (1.0 + np.max(np.abs(q))):
                break
        values = self._blocks(q, v.value, z.value, t, prescribed)
        rows, rates = slice(nv + nz, nv + nz + nh), slice(nv + nz + nh, None)
        e, dq = equations.partials(values), position.along
        if nh == nl:
            delta = product.difference(factors, position.value, q)
            dq = product.transport(factors, delta) @ dq
            turned = product.tangent(factors, delta) @ unit
            off = e.Jq[:, rows] @ dq
            off[:, :, size:] += e.P[:, rows]
            dq = dq + turned @ solve(e.Jq[:, rows] @ turned, off, t)
        w = equations.of("constraint_velocity", values)["w"]
        B = e.Jv[:, rates]
        corrected = v.value - (unit @ np.linalg.solve(B @ unit, w[:, :, np.newaxis]))[:, :, 0]
        values = {**values, "v": corrected}
        Z = equations.of("velocity_partials", values)["Z"]
        by_parameters = equations.partials(values).P[:, rates]
        off = Z @ dq + B @ v.along
        off[:, :, size:] += by_parameters
        return Moved(q, dq), Moved(corrected, v.along + unit @ solve(B @ unit, off, t))

    def _moved_onto(
        self, position: Moved, v: Moved, z: Moved, t: Array, prescribed: PrescribedInputs, unit: Array
    ) -> Moved:
        """Return positions moved onto the constraints of positions, if there are constraints on velocities besides.

        Newton's steps hold the rates of these, so their directions move with each position. A step is q o exp(x) with B
        x = -(Phi, 0) along the dependent components, whose columns are `unit` (n, nv, nl), B of all constraints, and

            B dx = -(Phi_q dq + Phi_p dp, 0) - d(B x).
        """
        equations, factors, size = self.equations, self.equations.model.factors, self.size_of_state
        nv, nz, nl, nh = equations.nv, equations.nz, equations.nl, equations.holonomic
        rows, rates = slice(nv + nz, nv + nz + nh), slice(nv + nz + nh, None)
        q, dq = position.value, position.along
        for _ in range(_CORRECTIONS):
            values = self._blocks(q, np.zeros_like(v.value), z.value, t, prescribed)
            (Phi,) = equations.of("constraint", values).values()
            still = equations.partials(values)
            B = still.Jv[:, rates] @ unit
            off = np.concatenate([Phi, np.zeros((len(Phi), nl - nh))], axis=1)[:, :, np.newaxis]
            x = (unit @ solve(B, off, t))[:, :, 0]
            moving = equations.partials({**values, "v": x})
            change = (moving.Jq[:, rates] - still.Jq[:, rates]) @ dq
            change[:, :, size:] += moving.P[:, rates] - still.P[:, rates]
            change[:, :nh] += still.Jq[:, rows] @ dq
            change[:, :nh, size:] += still.P[:, rows]
            dx = unit @ solve(B, change, t)
            dq = product.transport(factors, x) @ dq + product.tangent(factors, x) @ dx
            q = product.update(factors, q, x)
            if np.max(np.abs(x), initial=0.0) < 1e-15 * (1.0 + np.max(np.abs(q))):
                break
        return Moved(q, dq)

    def _check(self, ends: StepEnds, position: Moved, v: Moved) -> None:
        """Raise NumericalError if the stages evaluated again miss the ends of the run's steps. Then a step of the run
        changed its dependent components within the step, or passed a singular position."""
        factors, before, after = self.equations.model.factors, ends.before, ends.after
        size = np.max(np.abs(np.concatenate([product.difference(factors, before.q, after.q), after.v], axis=1)), axis=1)
        off = np.concatenate([product.difference(factors, position.value, after.q), v.value - after.v], axis=1)
        rounding = _ROUNDING * np.max(np.abs(after.q), axis=1, initial=0.0)  # all of a motion about an equilibrium
        missed = np.max(np.abs(off), axis=1) > _MISSED * size + rounding
        if missed.any():
            t = float(after.t[int(np.argmax(missed))])
            fault = f"the step to t = {t:.9g} s passes a singular position, or changes its dependent components within"
            fault = f"{fault}: it has no derivatives [E0634]"
            raise NumericalError(Problem("sensitivities", fault, "generalized_alpha"))
