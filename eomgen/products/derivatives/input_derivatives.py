"""Derivatives of a functional of a run in inputs: in the values at all of its rows, by one adjoint."""

from __future__ import annotations

import numpy as np

from eomgen.base.arrays import Array
from eomgen.products.derivatives.alpha_run import AlphaRun
from eomgen.products.derivatives.beginning import Directions, on_constraints
from eomgen.products.derivatives.following_start import Rest, at_rest
from eomgen.products.derivatives.functionals import Weights
from eomgen.products.derivatives.galerkin_run import GalerkinPart, GalerkinRun


def input_derivatives(run: AlphaRun | GalerkinRun, weights: Weights) -> Array:
    """Return derivatives of a functional in the inputs at the rows, (steps + 1, nu).

    Raises
    ------
    UsageError
        The rest from which the run starts is undetermined.
    """
    return _of_alpha(run, weights) if isinstance(run, AlphaRun) else _of_passes(run, weights)


def _of_alpha(run: AlphaRun, weights: Weights) -> Array:
    """Return them of generalized-alpha: a step takes inputs at its end, an output at its row, and the start within the
    first step, between two rows."""
    result = np.zeros((run.motion.steps + 1, run.run.model.nu))
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
        result[rows] += np.einsum("no,nou->nu", of_outputs[first:, :, 0], outputs_by_u[first:])
        result[part.first + 1 : part.first + len(by_u)] -= np.einsum("ne,neu->nu", multipliers[..., 0], by_u[1:])
    result[:2] += run.beginning.of_inputs(state[:, 0], record[0, :, 0])
    if run.start.at_rest:
        moved = _resting(run)
        along = on_constraints(run.beginning, moved, run.inverse_inertia) if run.run.model.multipliers else moved
        of_equations = run.of_equations(along)
        begun, row = run.beginning.tangents(of_equations, run.beginning.stages(of_equations))
        result[0] += begun.T @ state[:, 0] + row.T @ record[0, :, 0] + along.dp.T @ of_parameters[:, 0]
    return result


def _of_passes(run: GalerkinRun, weights: Weights) -> Array:
    """Return them of methods in passes: a step takes inputs at its start and at its nodes, which are linear between
    rows."""
    equations, nv, nu = run.equations, run.equations.nv, run.run.model.nu
    result = np.zeros((run.motion.steps + 1, nu))
    state, of_parameters = np.zeros((len(run.state), 1)), np.zeros((len(run.along.dp), 1))
    record = np.zeros((1, len(run.record), 1))
    for stepped in run.motion.backwards():
        part = run.of_part(stepped, apart=True)
        of_outputs = run.row_weights(part, [weights])
        record = run.of_rows(part, of_outputs, of_parameters)
        own = run.of_ends(part, record[1:], of_parameters)
        multipliers, rest = part.steps.adjoints(own, state)
        by_u, outputs_by_u = equations.input_partials(part.blocks)
        first = 0 if part.first == 0 else 1
        rows = slice(part.first, part.first + len(by_u))
        taken = np.einsum("no,nou->nu", of_outputs[:, :, 0], outputs_by_u)
        taken[1:] += _of_accelerations(part, record[1:, 2 * nv : 3 * nv, 0], by_u[1:])
        result[rows][first:] += taken[first:]
        result[part.first : rows.stop - 1] += equations.of_inputs(rest)[..., 0]
        of_points, _ = equations.input_partials(part.steps.points)
        for share, of_node in zip(part.steps.shares, multipliers[..., 0], strict=True):
            by_node, of_points = np.split(of_points, [len(of_node)])
            of_u = np.einsum("ne,neu->nu", of_node, by_node)
            result[part.first : rows.stop - 1] += (1.0 - share) * of_u
            result[part.first + 1 : rows.stop] += share * of_u
    blocks = run.blocks(run.start_states, run.prescribed(run.start_states.t))
    by_u, _ = equations.input_partials(blocks)
    of_start = state + record[0]
    solved = np.linalg.solve(equations.partials(blocks, parameters=False).Ja[0, :nv].T, of_start[2 * nv : 3 * nv, 0])
    result[0] -= solved @ by_u[0, :nv]
    if run.start.at_rest:
        result[0] += run.begun(run.start_states, _resting(run)).T @ of_start[:, 0]
    return result


def _of_accelerations(part: GalerkinPart, direct: Array, by_u: Array) -> Array:
    """Return the derivatives by inputs through accelerations of rows with derivatives ``direct`` (n, nv), (n, nu)."""
    if not np.any(direct):
        return np.zeros((len(direct), by_u.shape[2]))
    nv = direct.shape[1]
    Ja = part.steps.equations.partials(part.blocks, parameters=False).Ja[1:, :nv]
    solved = np.linalg.solve(np.swapaxes(Ja, 1, 2), direct[..., np.newaxis])[..., 0]
    result: Array = -np.einsum("ne,neu->nu", solved, by_u[:, :nv])
    return result


def _resting(run: AlphaRun | GalerkinRun) -> Directions:
    """Return the changes, by the inputs at the first row, of the rest from which a run starts, one direction each."""
    equations, rest = run.equations, _rest(run)
    nv, nz, nu = equations.nv, equations.nz, run.run.model.nu
    by_u, _ = equations.input_partials(rest.values)
    slopes = -np.linalg.solve(rest.matrix, by_u[0, : len(rest.matrix)])
    dq, dz, _ = np.split(slopes, np.cumsum([nv, nz]))
    return Directions(dq, np.zeros((nv, nu)), dz, np.zeros((equations.parameters, nu)))


def _rest(run: AlphaRun | GalerkinRun) -> Rest:
    if run.rest is not None:
        return run.rest
    t = np.array([run.run.grid.start])
    return at_rest(run.equations, run.start.asked, t, run.prescribed(t), run.moved_inputs(t))
