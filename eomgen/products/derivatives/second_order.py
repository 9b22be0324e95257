"""Second derivatives of functionals of a run, exact for its discrete steps.

Steps have e(x) = 0, x a row with parameters; a functional is a sum of w . y(x) over rows. Along directions i and j with
tangents dx_i, dx_j and the multipliers mu of its adjoint, its second derivative is

    sum over rows of  dx_i . K dx_j,  K: second derivatives of w . y - mu . e,

and of increments of rotations and of the start: so one sweep of tangents and one of adjoints give a whole Hessian
(Griewank and Walther, Evaluating Derivatives (2008), section 5.4; Papadimitriou, Mourelatos and Hu 2021). A product
with directions d is an adjoint of second order: with K dx_d in place of the functional's derivatives by rows. Steps
are factored once for all of their directions.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.lie.product import difference
from eomgen.products.derivatives.alpha_run import AlphaPart, AlphaRun
from eomgen.products.derivatives.beginning import Directions
from eomgen.products.derivatives.functionals import Weights
from eomgen.products.derivatives.second_beginning import SecondBeginning
from eomgen.products.derivatives.turning import Turning, turnings


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
    def of(cls, run: AlphaRun, count: int) -> _Adjoint:
        sizes = run.linear.state_size, len(run.along.dp), run.linear.record_size
        return cls(*(np.zeros((size, count)) for size in sizes))


class Swept(NamedTuple):
    """Remainders of adjoints of functionals in a part.

    Attributes
    ----------
    multipliers, ends : of its steps, as of ``LinearSteps.adjoints``
    of_outputs : weights of outputs at its rows, (rows, outputs, functionals)
    """

    multipliers: Array
    ends: Array
    of_outputs: Array


@dataclass
class Gradients:
    """Gradients of functionals, and remainders of their adjoints.

    Attributes
    ----------
    values : (functionals, directions)
    parts : from the last to the first; none of runs whose rows are not kept
    """

    values: Array
    parts: list[Swept]
    adjoint: _Adjoint


@dataclass(frozen=True)
class _Tangents:
    """A part of a run with its changes along directions.

    Attributes
    ----------
    rows : (rows, record_size + parameters, directions)
    steps : (rows - 1, 2 nv + nh, directions), of q at the start of steps, of increments of rotations, of eta
    parameters : (parameters, directions), W after the equations'
    turnings : of the steps
    """

    part: AlphaPart
    rows: Array
    steps: Array
    parameters: Array
    turnings: list[Turning]

    @property
    def own(self) -> slice:
        """Rows that are not the last one of another part."""
        return slice(0 if self.part.first == 0 else 1, None)

    def changes(self, run: AlphaRun, multipliers: Array, ends: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Return second derivatives by rows and by steps, shaped as these, and by parameters through steps.

        Parameters
        ----------
        multipliers, ends : (rows - 1, ...) of the adjoint of one functional
        weights : (rows, outputs)
        """
        of_first = np.concatenate([np.zeros((1, multipliers.shape[1])), multipliers])
        of_rows = run.equations.second_partials(self.part.blocks, of_first, self.rows, weights)
        of_steps, nv = np.zeros_like(self.steps), run.equations.nv
        for turning in self.turnings:
            behind = slice(nv + turning.v.start, nv + turning.v.stop)
            of_steps[:, turning.v], of_steps[:, behind] = turning.changed(ends[:, :nv], self.steps[:, behind])
        of_parameters = np.zeros_like(self.parameters)
        if run.inverse_inertia.size:
            self._add_reactions(run, ends[:, nv:], of_steps, of_parameters)
        return of_rows[self.own], of_steps, of_parameters

    def _add_reactions(self, run: AlphaRun, of_D: Array, of_steps: Array, of_parameters: Array) -> None:
        """Add the derivatives by steps and parameters of W B^T eta, which D has with a minus; ``of_D``: by D."""
        equations, W, matrices = run.equations, run.inverse_inertia, self.part.matrices
        nv, chosen = equations.nv, equations.parameters
        before = {name: array if name == "p" else array[:-1] for name, array in self.part.blocks.items()}
        dq, deta, dW = self.steps[:, :nv], self.steps[:, 2 * nv :], self.parameters[chosen:]
        dp = np.broadcast_to(self.parameters[:chosen], (len(dq), *self.parameters[:chosen].shape))
        along = np.concatenate([dq, deta, dp], axis=1)
        by_q, by_eta, by_p = equations.second_reactions(before, self.part.eta, -W * of_D, along)
        by_W = (of_D / W)[:, :, np.newaxis] * dW  # W enters as a factor
        G, N, Np = matrices.G, matrices.N, matrices.Np[:, :, :chosen]
        of_steps[:, :nv] += by_q - np.swapaxes(N, 1, 2) @ by_W
        of_steps[:, 2 * nv :] += by_eta - G @ by_W
        of_parameters[:chosen] += (by_p - np.swapaxes(Np, 1, 2) @ by_W).sum(axis=0)
        reaction = (N @ dq + Np @ dp + np.swapaxes(G, 1, 2) @ deta) / W[:, np.newaxis]
        of_parameters[chosen:] -= np.einsum("nk,nkd->kd", of_D, reaction)


def gradients(run: AlphaRun, weights: Sequence[Weights]) -> Gradients:
    """Return the gradients of functionals by one adjoint run of all."""
    adjoint, parts = _Adjoint.of(run, len(weights)), []
    for part in map(run.of_part, run.motion.backwards()):
        swept = _back(run, part, weights, adjoint)
        if run.motion.kept:
            parts.append(swept)
    result: Array = adjoint.state.T @ run.state + adjoint.record.T @ run.record
    result += adjoint.parameters.T @ run.along.dp
    return Gradients(result, parts, adjoint)


def hessians(run: AlphaRun, weights: Sequence[Weights], known: Gradients | None = None) -> tuple[Array, Array]:
    """Return gradients of functionals, (functionals, directions), and second derivatives, (functionals, directions,
    directions); adjoints that are known are not solved again.

    They are symmetric but for rounding, which is taken out: half the sum with the transpose.
    """
    swept = list(known.parts) if known is not None else []
    adjoint = known.adjoint if known is not None and swept else _Adjoint.of(run, len(weights))
    result = np.zeros((len(weights), run.size, run.size))
    for number_of_part, tangents in enumerate(_parts(run, run.along, run.state, run.record)):
        of_part = swept[number_of_part] if swept else _back(run, tangents.part, weights, adjoint)
        multipliers, ends, of_outputs = of_part
        for number in range(len(weights)):
            of_rows, of_steps, of_parameters = tangents.changes(
                run, multipliers[..., number], ends[..., number], of_outputs[..., number]
            )
            result[number] += _paired(tangents.rows[tangents.own], of_rows)
            result[number] += _paired(tangents.steps, of_steps) + tangents.parameters.T @ of_parameters
    for number in range(len(weights)):
        of_start = adjoint.state[:, number], adjoint.record[:, number], adjoint.parameters[len(run.asked.dp) :, number]
        result[number] += SecondBeginning(run).of(*of_start)
    first: Array = adjoint.state.T @ run.state + adjoint.record.T @ run.record + adjoint.parameters.T @ run.along.dp
    return first, 0.5 * (result + np.swapaxes(result, 1, 2))


def hessian_products(run: AlphaRun, weights: Weights, directions: Array) -> Array:
    """Return the Hessian of a functional times ``directions`` (directions, columns), by adjoints of second order."""
    first, second = _Adjoint.of(run, 1), _Adjoint.of(run, directions.shape[1])
    asked, chosen = (Directions(*(part @ directions for part in vars(of).values())) for of in (run.asked, run.along))
    width = run.linear.record_size
    for tangents in _parts(run, chosen, run.state @ directions, run.record @ directions):
        part = tangents.part
        multipliers, ends, of_outputs = _back(run, part, [weights], first)
        of_rows, of_steps, of_parameters = tangents.changes(run, multipliers[..., 0], ends[..., 0], of_outputs[..., 0])
        second.parameters += of_parameters
        second.parameters[: len(run.asked.dp)] += of_rows[:, width:].sum(axis=0)
        direct = of_rows[len(of_rows) - len(ends) :, :width]
        run.linear.adjoints(part.matrices, direct, second.state, second.parameters, part.times, of_steps)
        second.record = of_rows[0, :width]
    result: Array = run.state.T @ second.state + run.record.T @ second.record + run.along.dp.T @ second.parameters
    of_start = first.state[:, 0], first.record[:, 0], first.parameters[len(run.asked.dp) :, 0]
    return result + SecondBeginning(run, asked).of(*of_start)


def _paired(one: Array, other: Array) -> Array:
    """Return the sum of one^T other over all axes before directions."""
    rows = one.shape[0] * one.shape[1]
    result: Array = one.reshape(rows, -1).T @ other.reshape(rows, -1)
    return result


def _parts(run: AlphaRun, along: Directions, state: Array, record: Array) -> Iterator[_Tangents]:
    """Yield the parts from the last to the first with their changes along directions."""
    begins = [(state.copy(), record)]
    parts = run.motion.parts
    if parts > 1:
        for number, stepped in enumerate(run.motion.forwards()):
            if number == parts - 1:  # its tangents are taken on the way back
                continue
            made, state = run.of_part(stepped), begins[-1][0].copy()
            found, _ = run.linear.tangents(made.matrices, along.dp, state, made.times)
            begins.append((state, found[-1]))
    dp = run.of_equations(along).dp
    nv, factors = run.equations.nv, run.equations.model.factors
    for part in map(run.of_part, run.motion.backwards()):
        state, record = begins.pop()
        found, eta = run.linear.tangents(part.matrices, along.dp, state.copy(), part.times)
        rows = np.concatenate([record[np.newaxis], found])
        turning = turnings(factors, difference(factors, part.states.q[:-1], part.states.q[1:]))
        steps = np.concatenate([rows[:-1, :nv], np.zeros_like(rows[1:, :nv]), eta], axis=1)
        for one in turning:
            steps[:, nv + one.v.start : nv + one.v.stop] = one.increments(rows[:-1, :nv], rows[1:, :nv])
        of_parameters = np.broadcast_to(dp, (len(rows), *dp.shape))
        yield _Tangents(part, np.concatenate([rows, of_parameters], axis=1), steps, along.dp, turning)


def _back(run: AlphaRun, part: AlphaPart, weights: Sequence[Weights], adjoint: _Adjoint) -> Swept:
    """Take adjoints through a part."""
    of_outputs = run.row_weights(part, weights)
    direct = run.of_rows(part, of_outputs, adjoint.parameters)
    multipliers, ends = run.take_back(part, direct[1:], adjoint.state, adjoint.parameters)
    adjoint.record = direct[0]
    return Swept(multipliers, ends, of_outputs)
