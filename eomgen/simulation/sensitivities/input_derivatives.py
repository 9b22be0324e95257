"""Derivatives of a functional of a run in inputs: in the values at all of its rows, by one adjoint."""

from __future__ import annotations

import numpy as np

from eomgen.arrays import Array
from eomgen.simulation.sensitivities.alpha_run import AlphaRun
from eomgen.simulation.sensitivities.functionals import Weights


def input_derivatives(run: AlphaRun, weights: Weights) -> Array:
    """Return derivatives of a functional in the inputs at the rows, (steps + 1, nu).

    A step takes inputs at its end, an output at its row, and the start within the first step, between two rows.
    """
    found = np.zeros((run.motion.steps + 1, run.run.model.nu))
    state = np.zeros((run.linear.state_size, 1))
    of_parameters = np.zeros((len(run.along.dp), 1))
    record = np.zeros((1, run.linear.record_size, 1))
    for part in map(run.of_part, run.motion.backwards()):
        of_outputs = run.row_weights(part, [weights])
        record = run.of_rows(part, of_outputs, of_parameters)
        multipliers, _ = run.linear.adjoints(part.matrices, record[1:], state, of_parameters, part.times)
        by_u, outputs_by_u = run.equations.input_partials(part.blocks)
        first = 0 if part.first == 0 else 1
        rows = slice(part.first + first, part.first + len(by_u))
        found[rows] += np.einsum("no,nou->nu", of_outputs[first:, :, 0], outputs_by_u[first:])
        found[part.first + 1 : part.first + len(by_u)] -= np.einsum("ne,neu->nu", multipliers[..., 0], by_u[1:])
    found[:2] += run.beginning.of_inputs(state[:, 0], record[0, :, 0])
    return found
