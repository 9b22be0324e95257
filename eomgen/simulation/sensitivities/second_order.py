"""Second derivatives of functionals of a run, exact for its discrete steps.

Steps have e(x) = 0, x a row with parameters, else they are linear; a functional is a sum of w . y(x) over rows. Along
directions i and j with tangents dx_i, dx_j and the multipliers mu of its adjoint, its second derivative is

    sum over rows of  dx_i . K dx_j,  K: second derivatives of w . y - mu . e,

and that of the start: so one sweep of tangents and one of adjoints give a whole Hessian (Griewank and Walther,
Evaluating Derivatives (2008), section 5.4; Papadimitriou, Mourelatos and Hu 2021). A product with directions d is an
adjoint of second order: that with K dx_d in place of what the functional takes of rows. Steps are factored once for all
of their directions.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.arrays import Array
from eomgen.simulation.sensitivities.beginning import Directions
from eomgen.simulation.sensitivities.functionals import Weights
from eomgen.simulation.sensitivities.linear_run import LinearPart, LinearRun


@dataclass
class _Adjoint:
    """Adjoints of functionals on their way back.

    Attributes
    ----------
    state : (state_size, functionals)
    parameters : (parameters, functionals)
    record : of the row at the start of the part, (record_size, functionals)
    """

    state: Array
    parameters: Array
    record: Array

    @classmethod
    def of(cls, run: LinearRun, count: int) -> _Adjoint:
        sizes = run.linear.state_size, len(run.along.dp), run.linear.record_size
        return cls(*(np.zeros((size, count)) for size in sizes))


def hessians(run: LinearRun, weights: Sequence[Weights]) -> Array:
    """Return second derivatives of functionals, (functionals, directions, directions).

    They are symmetric but for rounding, which is taken out: half the sum with the transpose.
    """
    adjoint = _Adjoint.of(run, len(weights))
    found = np.zeros((len(weights), run.size, run.size))
    for part, along in _parts(run, run.along, run.state, run.record):
        multipliers, of_outputs = _back(run, part, weights, adjoint)
        for number in range(len(weights)):
            changes = run.equations.second_partials(
                part.blocks, multipliers[:, :, number], of_outputs[:, :, number], along
            )
            kept = slice(0 if part.first == 0 else 1, None)
            rows = along.shape[1] * len(changes[kept])
            found[number] += along[kept].reshape(rows, -1).T @ changes[kept].reshape(rows, -1)
    for number in range(len(weights)):
        found[number] += run.beginning.second_derivatives(
            run.of_equations(run.along),
            run.of_equations(run.along),
            adjoint.state[:, number],
            adjoint.record[:, number],
        )
    return 0.5 * (found + np.swapaxes(found, 1, 2))


def hessian_products(run: LinearRun, weights: Weights, directions: Array) -> Array:
    """Return the Hessian of a functional times ``directions`` (directions, columns), by adjoints of second order."""
    first, second = _Adjoint.of(run, 1), _Adjoint.of(run, directions.shape[1])
    chosen = Directions(*(part @ directions for part in vars(run.along).values()))
    width = run.linear.record_size
    for part, along in _parts(run, chosen, run.state @ directions, run.record @ directions):
        multipliers, of_outputs = _back(run, part, [weights], first)
        changes = run.equations.second_partials(part.blocks, multipliers[:, :, 0], of_outputs[:, :, 0], along)
        own = changes[0 if part.first == 0 else 1 :, width:]
        second.parameters[: own.shape[1]] += own.sum(axis=0)
        second.record = changes[0, :width]
        run.linear.adjoints(part.matrices, changes[1:, :width], second.state, second.parameters, part.times)
    found: Array = run.state.T @ second.state + run.record.T @ second.record + run.along.dp.T @ second.parameters
    of_start = run.beginning.second_derivatives(
        run.of_equations(run.along), run.of_equations(chosen), first.state[:, 0], first.record[:, 0]
    )
    return found + of_start


def _parts(run: LinearRun, along: Directions, state: Array, record: Array) -> Iterator[tuple[LinearPart, Array]]:
    """Yield the parts from the last to the first, and changes of rows with parameters along directions, (rows,
    record_size + parameters, directions)."""
    begins = [(state.copy(), record)]
    parts = run.motion.parts
    if parts > 1:
        for number, stepped in enumerate(run.motion.forwards()):
            if number == parts - 1:  # its tangents are taken on the way back
                continue
            made, state = run.of_part(stepped), begins[-1][0].copy()
            found = run.linear.tangents(made.matrices, along.dp, state, made.times)
            begins.append((state, found[-1]))
    dp = run.of_equations(along).dp
    for part in map(run.of_part, run.motion.backwards()):
        state, record = begins.pop()
        found = run.linear.tangents(part.matrices, along.dp, state.copy(), part.times)
        rows = np.concatenate([record[np.newaxis], found])
        yield part, np.concatenate([rows, np.broadcast_to(dp, (len(rows), *dp.shape))], axis=1)


def _back(run: LinearRun, part: LinearPart, weights: Sequence[Weights], adjoint: _Adjoint) -> tuple[Array, Array]:
    """Take adjoints through a part; return the multipliers of the equations of its rows, (rows, equations,
    functionals), and the weights of outputs, (rows, outputs, functionals), zero where they belong to another part."""
    of_outputs = run.row_weights(part, weights)
    direct = run.of_rows(part, of_outputs, adjoint.parameters)
    found = run.linear.adjoints(part.matrices, direct[1:], adjoint.state, adjoint.parameters, part.times)
    adjoint.record = direct[0]
    return np.concatenate([np.zeros((1, *found.shape[1:])), found]), of_outputs
