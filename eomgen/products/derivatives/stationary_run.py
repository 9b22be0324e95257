"""Derivatives of a run with a constant state, and inputs and base that change with time in other directions.

If the constant state solves the equations at all rows, with equal partials in the state at all rows, the linearised
steps are equal: the adjoint of an output at row n is the adjoint at the last row, shifted by as many rows. One adjoint
for each output gives the gradients at all rows, sums of multipliers with the partials in the parameters at earlier
rows; gradients of a coordinate are the tangents of the coordinate, so second derivatives take only the coordinates by
which the equations or the outputs bend (Papadimitriou, Mourelatos and Hu 2021).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy import fft

from eomgen.base.arrays import Array
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.products.derivatives.alpha_run import AlphaPart, AlphaRun
from eomgen.products.derivatives.equations import rows_of
from eomgen.products.derivatives.functionals import RowWeights
from eomgen.products.derivatives.motion import KEPT_BYTES, RunSegment
from eomgen.products.derivatives.second_order import StartSecondDerivatives


class StationaryRun:
    """Gradients and Hessians of outputs at all rows of a run with a constant state, by one adjoint run for each output.

    Attributes
    ----------
    solutions : number of adjoints that were solved until now
    """

    def __init__(self, run: AlphaRun, part: AlphaPart, outputs: Sequence[Array]) -> None:
        """``outputs``: weights of the run's outputs, (outputs,) each."""
        self.run, self.part = run, part
        self.weights = np.stack(outputs, axis=1)
        Y, self._by_parameters = run.equations.output_partials(part.blocks)
        self._asked: Array = Y[0].T @ self.weights  # (record, outputs)
        self.solutions = 0

    @classmethod
    def of(cls, run: AlphaRun, weights: Sequence[RowWeights]) -> StationaryRun | None:
        """Return the derivatives of a run with a constant state; None for other runs and for very large tables. Others
        are runs whose state changes, derivatives by other quantities than parameters, constraints, and rotations other
        than angles. `weights` are functionals, whose output weights are taken."""
        size = run.size * (run.motion.steps + 1) * (run.equations.nv + run.equations.nz + len(run.equations.outputs))
        plain = not run.equations.nl and all(factor.group == "R" for factor in run.run.model.factors)
        if not plain or len(run.along.dp) < run.size or size > 4 * KEPT_BYTES // 8:
            return None
        row = run.motion.first_row
        rows = np.repeat(row[np.newaxis], run.motion.steps + 1, axis=0)
        rows[:, 0] = run.run.grid.start + run.run.grid.step * np.arange(len(rows))
        for chosen in (rows[:: -(-len(rows) // 8)], rows):  # a few rows decide for most scenes
            part = run.linearise_part(RunSegment(0, chosen, run.motion.start["a"]))
            if not _is_constant(run, part):
                return None
        return cls(run, part, [weight.outputs for weight in weights])

    @cached_property
    def t(self) -> Array:
        """Times of the rows, (n,), s."""
        return self.part.states.t

    @cached_property
    def outputs(self) -> Array:
        """Outputs at the rows, (n, outputs)."""
        return self.run.equations.output_values(self.part.blocks) @ self.weights

    @cached_property
    def gradients(self) -> Array:
        """Derivatives of the outputs at the rows, (n, outputs, parameters)."""
        of_state = self._tangents(self._asked, self._responses)
        return np.asarray(of_state + np.einsum("nop,of->nfp", self._by_parameters, self.weights))

    def hessian(self, number: int, row: int) -> Array:
        """Return the second derivatives of output `number` at a row, (parameters, parameters). Only components by which
        the equations or the outputs bend take part; rows are taken in groups, because a row of many parameters has a
        large matrix."""
        size, width = self.run.size, self.run.linear.record_size
        multipliers, states = (array[..., number] for array in self._responses)
        of_rows = np.zeros((row + 1, multipliers.shape[1]))
        of_rows[1:] = multipliers[:row][::-1]
        weights = np.zeros((row + 1, len(self.weights)))
        weights[row] = self.weights[:, number]
        result = np.zeros((size, size))
        state_count, bending = len(self._bending[0]), [*self._bending[0], *self._bending[1]]
        parameters = np.array(self._bending[1], dtype=int) - width
        direct = np.eye(width + size)[:, bending]
        together = max(1, 4 * KEPT_BYTES // (8 * direct.size + 1))
        for first in range(0, row + 1 if bending else 0, together):
            part = slice(first, min(first + together, row + 1))
            along = np.broadcast_to(direct, (part.stop - first, *direct.shape))
            blocks = rows_of(self.part.blocks, part)
            bent = self.run.equations.second_partials(blocks, of_rows[part], along, weights[part])[:, bending]
            changes = self._changes[part]  # (rows, components, parameters)
            result += np.einsum("nci,ncd,ndj->ij", changes, bent[:, :state_count, :state_count], changes, optimize=True)
            mixed = np.einsum("nci,ncp->ip", changes, bent[:, :state_count, state_count:], optimize=True)
            result[:, parameters] += mixed
            result[parameters] += mixed.T
            result[np.ix_(parameters, parameters)] += bent[:, state_count:, state_count:].sum(axis=0)
        record = np.zeros(width) if row else self._asked[:, number]
        state = states[row - 1] if row else np.zeros(self.run.linear.state_size)
        result += StartSecondDerivatives(self.run).of(state, record, np.zeros(0))
        return 0.5 * (result + result.T).reshape(size, size)

    @cached_property
    def _responses(self) -> tuple[Array, Array]:
        """Multipliers (steps, rows, outputs) and derivatives in the state that the last of so many steps begins with,
        (steps, state, outputs), of the outputs."""
        return self._adjoint_responses(self._asked)

    def _adjoint_responses(self, of_record: Array) -> tuple[Array, Array]:
        """Return multipliers (steps, rows, columns) and derivatives by the state (steps, state, columns), as
        ``_responses``. For components of the recorded row, weights `of_record` (record, columns), by one adjoint run
        for each column."""
        run, steps, columns = self.run, self.run.motion.steps, of_record.shape[1]
        self.solutions += columns
        step = rows_of(self.part.matrices, slice(1))
        state, direct = np.zeros((run.linear.state_size, columns)), of_record[np.newaxis]
        unused, multipliers, states = np.zeros((run.size, columns)), [], []
        for _ in range(steps):
            solved, _ = run.linear.adjoints(step, direct, state, unused, self.part.times[:1])
            multipliers.append(solved[0])
            states.append(state.copy())
            direct = np.zeros_like(direct)
        return np.stack(multipliers), np.stack(states)

    def _tangents(self, of_record: Array, responses: tuple[Array, Array]) -> Array:
        """Return changes of components of the rows along the parameters, (n, columns, parameters). `of_record` (record,
        columns) are weights of the components, `responses` their adjoints; sums over earlier rows are convolutions by
        fast Fourier transforms."""
        run = self.run
        by_parameters = np.concatenate([self.part.matrices[name] for name in ("Rp", "Fp", "Hp", "Zp")], axis=1)
        multipliers, states = responses
        result = np.empty((len(self.t), of_record.shape[1], run.size))
        result[0] = of_record.T @ run.record
        result[1:] = np.swapaxes(states, 1, 2) @ run.state
        count = len(by_parameters)
        size = fft.next_fast_len(len(multipliers) + count - 1, real=True)
        for row in np.flatnonzero(np.any(by_parameters, axis=(0, 2))):
            pushes = fft.rfft(by_parameters[:, row], size, axis=0)
            for column in range(of_record.shape[1]):
                of_push = fft.rfft(multipliers[:, row, column, np.newaxis], size, axis=0)
                result[1:, column] -= fft.irfft(of_push * pushes, size, axis=0)[:count]
        return result

    @cached_property
    def _changes(self) -> Array:
        """Changes, along the parameters, of the row components by which equations or outputs have second derivatives,
        (n, components, parameters)."""
        basis = np.eye(self.run.linear.record_size)[:, self._bending[0]]
        shares = np.linalg.lstsq(self._asked, basis, rcond=None)[0]
        left = np.linalg.norm(basis - self._asked @ shares, axis=0) > SUMMED
        known = self._tangents(self._asked, self._responses)
        result: Array = np.einsum("nfp,fc->ncp", known, shares)
        if left.any():
            others = basis[:, left]
            result[:, left] = self._tangents(others, self._adjoint_responses(others))
        return result

    @cached_property
    def _bending(self) -> tuple[list[int], list[int]]:
        """Components of the rows, and parameters, by which equations or outputs have second derivatives; parameters are
        numbered after the components of the rows.

        The Hessian of a sum of all of them with random weights is multiplied by a random direction: a row of it that is
        not 0 gives 0 by no chance.
        """
        equations, random = self.run.equations, np.random.default_rng(0)
        rows, size = len(self.t), self.run.linear.record_size + self.run.size
        drawn = (random.uniform(0.5, 1.5, count) for count in (self.run.linear.rows, len(equations.outputs), size))
        of_rows, weights, along = (np.broadcast_to(numbers, (rows, len(numbers))) for numbers in drawn)
        bent = equations.second_partials(self.part.blocks, of_rows, along[:, :, np.newaxis], weights)
        bending = np.flatnonzero(np.any(bent, axis=(0, 2)))
        by_rows, by_parameters = np.split(bending, [np.searchsorted(bending, self.run.linear.record_size)])
        return by_rows.tolist(), by_parameters.tolist()


def _is_constant(run: AlphaRun, part: AlphaPart) -> bool:
    """Return whether the first row solves the equations at all rows, and their partials in the state are the same.
    Accelerations and rates that are left are relative to the largest by a parameter."""
    equations, states, blocks = run.equations, part.states, part.blocks
    if np.any(states.v):
        return False
    partials = equations.partials(blocks)
    by_output, _ = equations.output_partials(blocks)
    for matrices in (partials.Jq, partials.Jv, partials.Ja, partials.Jz, by_output):
        if np.any(np.abs(matrices - matrices[0]) > SUMMED * np.max(np.abs(matrices[0]), initial=0.0)):
            return False
    nv = equations.nv
    residual = equations.of("residual", {**blocks, "a": np.zeros_like(states.a)})["r"][:, :, np.newaxis]
    inverse = np.linalg.inv(partials.Ja[0, :nv, :nv])
    span = float(states.t[-1] - states.t[0])
    pushed = np.abs(partials.P[:, :nv]) + span * np.abs(partials.Jz[:, :nv]) @ np.abs(partials.P[:, nv:])
    left, largest = (
        float(np.max(np.einsum("nri,rs,nsi->ni", vectors, inverse, vectors), initial=0.0))
        for vectors in (residual, pushed)
    )
    if not left <= COMPUTED**2 * largest:
        return False
    if not equations.nz:
        return True
    rate = equations.of("internal_rate", blocks)["zdot"]
    sizes = np.abs(partials.Jz[:, nv:]) @ np.abs(states.z[0])
    return bool(np.all(np.abs(rate) <= COMPUTED * (sizes + np.max(np.abs(partials.P[:, nv:]), axis=(0, 2)))))
