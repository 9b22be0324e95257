"""Steps of explicit Runge-Kutta methods whose stages coordinate partitioning brings onto the constraints, with
derivatives.

Dependent components D take q_i o exp(delta), delta_I = 0, to Phi = 0, and v_i + e, e_I = 0, to B v + Phi_t = 0:

    B (A_delta dq + T_delta ddelta) + Phi_p dp = 0,   B_D de + Z dq + B dv + w_p dp = 0.
"""

from __future__ import annotations

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import NumericalError, Problem
from eomgen.lie import product
from eomgen.products.derivatives.equations import solve
from eomgen.products.derivatives.linear_operations import Block, Instant, LinearOperations, Moved, add
from eomgen.products.derivatives.motion import ReplayedRun


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


class PartitionedOperations(LinearOperations):
    """An explicit step with derivatives, whose stages coordinate partitioning brings onto the constraints, if there are
    any."""

    def project(self, q: Moved, v: Moved, z: Moved, share: float) -> tuple[Moved, Moved]:
        """Return positions and velocities moved onto the constraints along the dependent components."""
        if not self.nl:  # no component depends on others
            return q, v
        equations, factors, t = self.of, self.factors, self.time(share)
        nv, nz, nl, nh = self.nv, self.nz, self.nl, equations.holonomic
        unit = np.zeros((self.count, nv, nl))
        np.put_along_axis(unit, self.memory.astype(np.intp)[:, np.newaxis, :], 1.0, axis=1)
        if 0 < nh < nl:
            q = self._moved_onto(q, z, t, unit)
        position = q.value
        for _ in range(16 if nh == nl else 0):
            values = self.blocks(position, v.value, z.value, t)
            (Phi,) = equations.of("constraint", values).values()
            (B,) = equations.of("constraint_jacobian", values).values()
            change = np.linalg.solve(B @ unit, -Phi[:, :, np.newaxis])
            position = product.update(factors, position, (unit @ change)[:, :, 0])
            if np.max(np.abs(change), initial=0.0) < 1e-15 * (1.0 + np.max(np.abs(position))):
                break
        values = self.blocks(position, v.value, z.value, t)
        rows, rates = slice(nv + nz, nv + nz + nh), slice(nv + nz + nh, None)
        e = equations.partials(values)
        if nh == nl:
            delta = product.difference(factors, q.value, position)
            turned = product.tangent(factors, delta) @ unit
            B, q = e.Jq[:, rows], Moved(position, add((product.transport(factors, delta), q)))
            held = self._solve(B @ turned, delta, t, (B, q), (e.P[:, rows], self.p))
            q = Moved(position, add((1.0, q), (turned, held)))
        w = equations.of("constraint_velocity", values)["w"]
        B = e.Jv[:, rates]
        corrected = v.value - (unit @ np.linalg.solve(B @ unit, w[:, :, np.newaxis]))[:, :, 0]
        values = {**values, "v": corrected}
        Z = equations.of("velocity_partials", values)["Z"]
        by_p = equations.partials(values).P[:, rates]
        return q, Moved(corrected, add((1.0, v), (unit, self._solve(B @ unit, w, t, (Z, q), (B, v), (by_p, self.p)))))

    def _moved_onto(self, q: Moved, z: Moved, t: Instant, unit: Array) -> Moved:
        """Return positions moved onto the constraints of positions, if there are constraints on velocities besides.

        Newton's steps hold the rates of these, so their directions move with each position. A step is q o exp(x) with B
        x = -(Phi, 0) along the dependent components, whose columns are `unit` (n, nv, nl), B of all constraints, and

            B dx = -(Phi_q dq + Phi_p dp, 0) - d(B x).
        """
        equations, nv, nl, nh = self.of, self.nv, self.nl, self.of.holonomic
        rows, rates = slice(-nl - nh, -nl), slice(-nl, None)
        for _ in range(16):
            values = self.blocks(q.value, np.zeros((self.count, nv)), z.value, t)
            (Phi,) = equations.of("constraint", values).values()
            still = equations.partials(values)
            B = still.Jv[:, rates] @ unit
            off = np.concatenate([Phi, np.zeros((len(Phi), nl - nh))], axis=1)[:, :, np.newaxis]
            x = (unit @ solve(B, off, t.value))[:, :, 0]
            moving = equations.partials({**values, "v": x})
            by_q, by_p = (getattr(moving, name)[:, rates] - getattr(still, name)[:, rates] for name in ("Jq", "P"))
            by_q[:, :nh] += still.Jq[:, rows]
            by_p[:, :nh] += still.P[:, rows]
            q = self.update(q, Moved(x, add((unit, self._solve(B, x, t, (by_q, q), (by_p, self.p))))))
            if np.max(np.abs(x), initial=0.0) < 1e-15 * (1.0 + np.max(np.abs(q.value))):
                break
        return q

    def _solve(self, matrix: Array, value: Array, t: Instant, *off: tuple[Block, Moved]) -> Moved:
        """Return values with the derivatives -matrix^-1 of a sum."""
        return Moved(value, {name: solve(matrix, np.asarray(block), t.value) for name, block in add(*off).items()})

    def ends_with(self, q: Moved, v: Moved, z: Moved) -> None:
        super().ends_with(q, v, z)
        if self.nl:
            self._check(q, v)

    def _check(self, position: Moved, v: Moved) -> None:
        """Raise NumericalError if the stages evaluated again miss the ends of the run's steps. Then a step of the run
        changed its dependent components within the step, or passed a singular position."""
        factors, before, after = self.factors, self.ends.before, self.ends.after
        size = np.max(np.abs(np.concatenate([product.difference(factors, before.q, after.q), after.v], axis=1)), axis=1)
        off = np.concatenate([product.difference(factors, position.value, after.q), v.value - after.v], axis=1)
        rounding = 1e-13 * np.max(np.abs(after.q), axis=1, initial=0.0)  # all of a motion about an equilibrium
        missed = np.max(np.abs(off), axis=1) > 1e-7 * size + rounding
        if missed.any():
            t = float(after.t[int(np.argmax(missed))])
            fault = f"the step to t = {t:.9g} s passes a singular position, or changes dependent components [E0634]"
            raise NumericalError(Problem("sensitivities", fault, "generalized_alpha"))
