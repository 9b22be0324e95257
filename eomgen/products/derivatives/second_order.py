"""Second derivatives of functionals of a run, exact for the discrete steps, the start, and increments of rotations.

Steps have e(x) = 0, x a row with parameters; a functional is a sum of w . y(x) over rows. Along directions i and j with
tangents dx_i, dx_j and the multipliers mu of its adjoint, its second derivative is

    sum over rows of  dx_i . K dx_j,  K: second derivatives of w . y - mu . e,

and of increments of rotations and of the start: so one sweep of tangents and one of adjoints give a whole Hessian
(Griewank and Walther, Evaluating Derivatives (2008), section 5.4; Papadimitriou, Mourelatos and Hu 2021). A product
with directions d is an adjoint of second order: with K dx_d in place of the functional's derivatives by rows. Steps
are factored once for all of their directions.

Increments of rotations change the linear steps of rotating factors. A step q' = q o exp(theta) has dq' = A dq + T
dtheta, A = Ad(exp(-theta)), both left-trivialised. Along j the matrices change themselves, so that the second
derivatives of steps are dA[dtheta_j] dq_i + dT[dtheta_j] dtheta_i, with dA[x] = -ad(T x) A (Bruls and Cardona 2010;
Iserles, Munthe-Kaas, Norsett and Zanna 2000, section 4).

At the start, accelerations and states that are moved onto constraints have second derivatives. Each step is an
equation; its second derivatives along tangents are contracted with the multipliers of the step, from the last step to
the first. Runs move positions by Newton's steps c = -R Phi, R = M^-1 B^T (B M^-1 B^T)^-1; the first two decide second
derivatives. With dPhi_i = -S sigma_i and c_i = M^-1 B^T sigma_i, S = B M^-1 B^T, the limit q has

    d_j dq_i = (1 - R B) (x_ij + M^-1 (dB_j^T sigma_i - dM_j c_i + dB_i^T sigma_j - dM_i c_j)) - R d2Phi_ij,
    x_ij = -[d_j, d_i] / 2 - [c_j, d_i] - [c_j, c_i] / 2,

d the directions as they are asked for, d2Phi along the ones on the constraints; dM_j and dB_j along d. Velocities solve
M (v' - v) = B^T sigma, w(q, v') = 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.lie import numeric, product
from eomgen.lie.groups import group_named
from eomgen.lie.kernels import tangent_along
from eomgen.lie.product import Factor, difference
from eomgen.products.derivatives.alpha_run import AlphaPart, AlphaRun
from eomgen.products.derivatives.equations import rows_of
from eomgen.products.derivatives.functionals import RowWeights
from eomgen.products.derivatives.linear_run import LinearPart, LinearRun, RunAdjoint
from eomgen.products.derivatives.start import (
    LinearizedRest,
    StartDerivatives,
    StateDirections,
    follows_inertia,
    inertia_partials,
    on_constraints,
)


@dataclass(frozen=True)
class RotatingFactorChange:
    """Changes of A = Ad(exp(-theta)) and T = T(theta) of a rotating factor with the increment theta, at n steps.

    Attributes
    ----------
    v : slice of the factor's velocities
    A, T_inverse : (n, size, size)
    by_first, by_increment : (n, size, size, size), changes of A and of T: row, column, component of theta
    """

    v: slice
    A: Array
    T_inverse: Array
    by_first: Array
    by_increment: Array

    @classmethod
    def of(cls, factor: Factor, theta: Array) -> RotatingFactorChange:
        """Return the matrices of a factor and their changes at increments theta (n, nv)."""
        group, part = group_named(factor.group, factor.v_size), theta[:, factor.v]
        A = numeric.adjoint(group, numeric.exp(group, -part))
        T = numeric.tangent(group, part)
        by_first = np.stack([-numeric.bracket_matrix(group, column) @ A for column in np.moveaxis(T, 2, 0)], axis=3)
        by_increment = np.stack([tangent_along(group, part, unit) for unit in np.eye(part.shape[1])], axis=3)
        return cls(factor.v, A, numeric.tangent_inverse(group, part), by_first, by_increment)

    def increments(self, before: Array, behind: Array) -> Array:
        """Return dtheta (n, size, directions) from dq before and after steps, (n, nv, directions) each."""
        result: Array = self.T_inverse @ (behind[:, self.v] - self.A @ before[:, self.v])
        return result

    def second_derivatives(self, of_end: Array, increments: Array) -> tuple[Array, Array]:
        """Return second derivatives along ``increments`` by dq and by dtheta, (n, size, directions) each;
        ``of_end``: derivatives in q' (n, nv)."""
        weights = of_end[:, self.v]
        of_first = np.einsum("nr,nrck,nkd->ncd", weights, self.by_first, increments, optimize=True)
        return of_first, np.einsum("nr,nrck,nkd->ncd", weights, self.by_increment, increments, optimize=True)


def turnings(factors: Sequence[Factor], theta: Array) -> list[RotatingFactorChange]:
    """Return the derivatives of all rotating factors."""
    return [RotatingFactorChange.of(factor, theta) for factor in factors if factor.group != "R"]


class StartSecondDerivatives:
    """Second derivatives of the start of a run along pairs of directions, summed in ``hessian``.

    Parameters
    ----------
    run : source of the first directions
    second : second directions, changes of the requested start; the run's own by default
    """

    def __init__(self, run: AlphaRun, second: StateDirections | None = None) -> None:
        self.start, self.W, self.equations = run.beginning, run.inverse_inertia, run.equations
        self.rest = run.rest
        self.asked, self.stages, along = (run.asked,) * 2, (run.stages,) * 2, (run.along,) * 2
        if second is not None:
            on = on_constraints(self.start, second, self.W) if self.equations.nl else second
            self.asked, along = (run.asked, second), (run.along, on)
            self.stages = run.stages, self.start.stages(run.equation_directions(on))
        self.on = [run.equation_directions(directions) for directions in along]
        self.changes_of_W = [directions.dp[len(run.asked.dp) :] for directions in along]
        self.hessian = np.zeros((run.size, self.asked[1].dq.shape[1]))

    def of(self, state: Array, record: Array, of_inertia: Array) -> Array:
        """Return the second derivatives, (first directions, second directions), of state . s + record . r + of_inertia
        . W. s is the state from which steps begin, r the recorded row, W = 1/M_ii; the arguments are their multipliers,
        vectors."""
        nv, nz, nh = self.equations.nv, self.equations.nz, self.equations.holonomic
        back = StartDerivatives.of(state, record, nv, nz)
        for number in reversed(range(len(self.stages[0]))):
            self._acceleration(number, back)
        if self.W.size:
            self._inertia(of_inertia, back)
        if self.equations.nl:
            self._velocity(back)
        if nh:
            self._position(back)
        else:
            self.hessian -= 0.5 * self._brackets(back.q, self.asked[1].dq, self.asked[0].dq)
        if self.rest is not None:
            self._rest(self.rest, back)
        return self.hessian

    def _acceleration(self, number: int, back: StartDerivatives) -> None:
        """Add the second derivatives of a stage's accelerations and multipliers to the Hessian, and take `back` to its
        state."""
        first, second = (stages[number] for stages in self.stages)
        multipliers, tau, of_q = self.start.taken_back(first, number, back)
        self._pair(first.row, second.row, multipliers, tau, number)
        for turning in turnings(self.equations.model.factors, first.theta[np.newaxis]):
            changed = turning.second_derivatives(of_q[np.newaxis], second.dtheta[np.newaxis, turning.v])
            self.hessian += self.on[0].dq[turning.v].T @ changed[0][0] + first.dtheta[turning.v].T @ changed[1][0]

    def _inertia(self, of_inertia: Array, back: StartDerivatives) -> None:
        """Add the second derivatives of W = 1/M_ii to the Hessian, and its derivatives in q to `back`. ``of_inertia``
        (nv,) are multipliers of W."""
        nv, W, dW = self.equations.nv, self.W, self.changes_of_W
        self.hessian += dW[0].T @ (2.0 * (of_inertia / W)[:, np.newaxis] * dW[1])
        omega = of_inertia * W**2 * follows_inertia(W, self.stages[0][0].matrix[:nv, :nv])
        values = self.stages[0][0].values
        units = {name: np.repeat(array, nv + 1, axis=0) if name != "p" else array for name, array in values.items()}
        units["v"], units["a"] = np.zeros((nv + 1, nv)), np.eye(nv + 1, nv)
        multipliers = np.zeros((nv + 1, self.equations.rows))
        multipliers[:nv, :nv], multipliers[nv, :nv] = np.diag(omega), -omega  # M e_k, minus the value at rest
        rows = [self._row(directions.dq, directions.dp) for directions in self.on]
        changes = self.equations.second_partials(units, multipliers, np.repeat(rows[1][np.newaxis], nv + 1, axis=0))
        self.hessian += rows[0].T @ changes.sum(axis=0)
        back.q = back.q - omega @ inertia_partials(self.equations, self.start.first[0])[1][0]

    def _velocity(self, back: StartDerivatives) -> None:
        """Add the second derivatives of moving velocities onto the constraints to the Hessian, and take `back` through
        the move."""
        equations, stage = self.equations, self.stages[0][0]
        nv, nz, nh, nl = equations.nv, equations.nz, equations.holonomic, equations.nl
        M, B = stage.matrix[:nv, :nv], stage.matrix[nv:, :nv]
        solved = np.linalg.solve(stage.matrix, np.concatenate([back.v, np.zeros(nl)]))
        tau = np.concatenate([np.zeros(nv + nz + nh), solved[nv:]])
        moved = [directions.dv - asked.dv for directions, asked in zip(self.on, self.asked, strict=True)]
        self._add_moving_projection(M, B, solved[:nv], moved, self.on)
        rows = [self._row(directions.dq, directions.dp, directions.dv) for directions in self.on]
        self._pair(rows[0], rows[1], tau, np.zeros(nl))
        back.q = back.q - tau @ stage.partials.Jq[0]

    def _position(self, back: StartDerivatives) -> None:
        """Add the second derivatives of moving positions onto the constraints to the Hessian, and take `back` through
        the move."""
        equations, stage = self.equations, self.stages[0][0]
        nv, nz, nh, nl = equations.nv, equations.nz, equations.holonomic, equations.nl
        M, B = stage.matrix[:nv, :nv], stage.matrix[nv : nv + nh, :nv]
        R = np.linalg.solve(M, B.T)
        R = R @ np.linalg.inv(B @ R)
        of_rows = R.T @ back.q
        gamma = back.q - B.T @ of_rows
        moved = [directions.dq - asked.dq for directions, asked in zip(self.on, self.asked, strict=True)]
        weights = np.asarray(np.linalg.solve(M, gamma), dtype=np.float64)
        self._add_moving_projection(M, B, weights, moved, self.asked)
        d = [directions.dq for directions in self.asked]
        self.hessian -= 0.5 * self._brackets(gamma, d[1], d[0]) + self._brackets(gamma, moved[1], d[0])
        self.hessian -= 0.5 * self._brackets(gamma, moved[1], moved[0])
        multipliers = np.concatenate([np.zeros(nv + nz), of_rows, np.zeros(nl)])
        rows = [self._row(directions.dq, directions.dp) for directions in self.on]
        self._pair(rows[0], rows[1], multipliers, np.zeros(nl))
        back.q = gamma

    def _rest(self, rest: LinearizedRest, back: StartDerivatives) -> None:
        """Add the second derivatives of the static equilibrium at the start, K d_j dq_i = -e'', to the Hessian."""
        equations, nh = self.equations, self.equations.holonomic
        nv, nz = equations.nv, equations.nz
        multipliers = np.zeros(equations.rows)
        multipliers[: nv + nz + nh] = np.linalg.solve(rest.matrix.T, np.concatenate([back.q, back.z, np.zeros(nh)]))
        rows = []
        for directions in self.asked:
            dq, dz, dlam = np.split(rest.slopes @ directions.dp, np.cumsum([nv, nz]))
            rows.append(np.concatenate([dq, np.zeros((2 * nv, dq.shape[1])), dz, dlam, directions.dp]))
        changes = equations.second_partials(rest.values, multipliers[np.newaxis], rows[1][np.newaxis])
        self.hessian += rows[0].T @ changes[0]
        # the start is q(p) o exp(theta): of two parameters e'' has the bracket, of theta_j and p_i it is whole
        of_rest = [row[:nv] for row in rows]
        beside = [directions.dq - dq for directions, dq in zip(self.asked, of_rest, strict=True)]
        self.hessian += 0.5 * self._brackets(back.q, of_rest[1], of_rest[0])
        self.hessian -= 0.5 * self._brackets(back.q, beside[1], of_rest[0])
        self.hessian += 0.5 * self._brackets(back.q, of_rest[1], beside[0])

    def _add_moving_projection(
        self, M: Array, B: Array, m: Array, moved: list[Array], along: Sequence[StateDirections]
    ) -> None:
        """Add m . (dB_j^T sigma_i - dM_j c_i), and the same with i and j exchanged, to the Hessian. `m` (nv,) are
        weights, ``moved`` the corrections c, in range of M^-1 B^T, ``along`` the directions of dB and dM, for first and
        second directions each."""
        nv, first = self.equations.nv, 3 * self.equations.nv + self.equations.nz
        multipliers = np.zeros((1, self.equations.rows))
        multipliers[0, :nv] = -m
        S = B @ np.linalg.solve(M, B.T)
        sides = []
        for directions, c in zip(along, moved, strict=True):
            row = self._row(directions.dq, directions.dp)[np.newaxis]
            change = self.equations.second_partials(self.stages[0][0].values, multipliers, row)[0]
            of_M, of_B = change[2 * nv : 3 * nv], change[first : first + len(B)]
            sides.append((c, np.linalg.solve(S, B @ c), of_M, of_B))
        (c_i, sigma_i, M_i, B_i), (c_j, sigma_j, M_j, B_j) = sides
        self.hessian += sigma_i.T @ B_j - c_i.T @ M_j + B_i.T @ sigma_j - M_i.T @ c_j

    def _pair(self, first: Array, second: Array, multipliers: Array, tau: Array, number: int = 0) -> None:
        """Add second derivatives of - multipliers . e - tau . accelerations of constraints at a stage, along rows."""
        changes = self.equations.second_partials(
            self.stages[0][number].values, multipliers[np.newaxis], second[np.newaxis], None, tau[np.newaxis]
        )
        self.hessian += first.T @ changes[0]

    def _row(self, dq: Array, dp: Array, dv: Array | None = None) -> Array:
        equations = self.equations
        none = np.zeros((equations.nv + equations.nz + equations.nl, dq.shape[1]))
        return np.concatenate([dq, np.zeros_like(dq) if dv is None else dv, none, dp])

    def _brackets(self, weights: Array, first: Array, second: Array) -> Array:
        """Return weights . [first_j, second_i] for columns of `first` and `second` (nv, directions), as (i, j)."""
        factors = self.equations.model.factors
        if all(factor.group == "R" for factor in factors):
            return np.zeros((second.shape[1], first.shape[1]))
        contracted = np.einsum("r,krc->kc", weights, product.bracket_matrix(factors, np.eye(len(weights))))
        result: Array = second.T @ contracted.T @ first
        return result


class SweepRemainders(NamedTuple):
    """Remainders of adjoints of functionals in a part.

    Attributes
    ----------
    multipliers, ends : of the steps, as of ``LinearSteps.adjoints``
    of_outputs : weights of outputs at the rows, (rows, outputs, functionals)
    """

    multipliers: Array
    ends: Array
    of_outputs: Array


@dataclass
class Gradients:
    """Gradients of functionals, and remainders of the adjoints.

    Attributes
    ----------
    values : (functionals, directions)
    parts : from the last to the first; none of runs whose rows are not kept
    """

    values: Array
    parts: list[SweepRemainders]
    adjoint: RunAdjoint


@dataclass(frozen=True)
class _AlphaTangents:
    """A part of a run made linear, with tangents at the rows and of the steps along directions.

    Attributes
    ----------
    rows : (rows, record_size + parameters, directions)
    steps : (rows - 1, 2 nv + nh, directions), of q at the start of steps, of increments of rotations, of eta
    parameters : (parameters, directions), W after the equations'
    turnings : changes of the rotating factors in the steps
    """

    part: AlphaPart
    rows: Array
    steps: Array
    parameters: Array
    turnings: list[RotatingFactorChange]

    @property
    def own(self) -> slice:
        """Rows of this part, without a last row that belongs to another part."""
        return slice(0 if self.part.first == 0 else 1, None)

    def changes(self, run: AlphaRun, multipliers: Array, ends: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Return changes of a functional's derivatives along the tangents: by rows, by steps and by parameters through
        steps.

        The first two are shaped as ``rows`` (rows of this part) and ``steps``.

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
            of_steps[:, turning.v], of_steps[:, behind] = turning.second_derivatives(
                ends[:, :nv], self.steps[:, behind]
            )
        of_parameters = np.zeros_like(self.parameters)
        if run.inverse_inertia.size:
            self._add_reactions(run, ends[:, nv:], of_steps, of_parameters)
        return of_rows[self.own], of_steps, of_parameters

    def _add_reactions(self, run: AlphaRun, of_D: Array, of_steps: Array, of_parameters: Array) -> None:
        """Add changes of the derivatives of W B^T eta, which D has with a minus, to `of_steps` and `of_parameters`, in
        place. ``of_D`` (rows - 1, nv) are derivatives of the functional by D, the rate of the increment of a step."""
        equations, W, matrices = run.equations, run.inverse_inertia, self.part.matrices
        nv, chosen = equations.nv, equations.parameters
        before = rows_of(self.part.blocks, slice(-1))
        dq, deta, dW = self.steps[:, :nv], self.steps[:, 2 * nv :], self.parameters[chosen:]
        dp = np.broadcast_to(self.parameters[:chosen], (len(dq), *self.parameters[:chosen].shape))
        along = np.concatenate([dq, deta, dp], axis=1)
        by_q, by_eta, by_p = equations.second_reactions(before, self.part.eta, -W * of_D, along)
        by_W = (of_D / W)[:, :, np.newaxis] * dW  # W enters as a factor
        G, N, Np = matrices["G"], matrices["N"], matrices["Np"]
        of_steps[:, :nv] += by_q - np.swapaxes(N, 1, 2) @ by_W
        of_steps[:, 2 * nv :] += by_eta - G @ by_W
        of_parameters[:chosen] += (by_p - np.swapaxes(Np, 1, 2) @ by_W).sum(axis=0)
        reaction = (N @ dq + Np @ dp + np.swapaxes(G, 1, 2) @ deta) / W[:, np.newaxis]
        of_parameters[chosen:] -= np.einsum("nk,nkd->kd", of_D, reaction)


def gradients(run: LinearRun[Any], weights: Sequence[RowWeights]) -> Gradients:
    """Return the gradients of functionals, (functionals, directions), by one adjoint run of all, with the adjoints."""
    adjoint, parts = RunAdjoint.of(run, len(weights)), []
    for part in map(run.linearise_part, run.motion.backwards()):
        swept = take_back(run, part, weights, adjoint)
        if run.motion.kept and swept.multipliers.size:
            parts.append(swept)
    return Gradients(adjoint.gradients(run), parts, adjoint)


def hessians(run: AlphaRun, weights: Sequence[RowWeights], known: Gradients | None = None) -> tuple[Array, Array]:
    """Return gradients of functionals, (functionals, directions), and second derivatives, (functionals, directions,
    directions); adjoints that are known are not solved again.

    Rounding of the second derivatives is symmetrised: the result is half the sum with the transpose.
    """
    swept = list(known.parts) if known is not None else []
    adjoint = known.adjoint if known is not None and swept else RunAdjoint.of(run, len(weights))
    result = np.zeros((len(weights), run.size, run.size))
    for number_of_part, tangents in enumerate(_parts(run, run.along, run.state, run.record)):
        of = swept[number_of_part] if swept else take_back(run, tangents.part, weights, adjoint)
        for number in range(len(weights)):
            of_rows, of_steps, of_parameters = tangents.changes(run, *(each[..., number] for each in of))
            result[number] += _inner_product(tangents.rows[tangents.own], of_rows)
            result[number] += _inner_product(tangents.steps, of_steps) + tangents.parameters.T @ of_parameters
    for number in range(len(weights)):
        of_start = adjoint.state[:, number], adjoint.record[:, number], adjoint.parameters[len(run.asked.dp) :, number]
        result[number] += StartSecondDerivatives(run).of(*of_start)
    return adjoint.gradients(run), 0.5 * (result + np.swapaxes(result, 1, 2))


def hessian_products(run: AlphaRun, weights: RowWeights, directions: Array) -> Array:
    """Return the Hessian of a functional times ``directions`` (directions, columns), by adjoints of second order."""
    first, second = RunAdjoint.of(run, 1), RunAdjoint.of(run, directions.shape[1])
    asked, chosen = (
        StateDirections(*(part @ directions for part in vars(of).values())) for of in (run.asked, run.along)
    )
    width = run.linear.record_size
    for tangents in _parts(run, chosen, run.state @ directions, run.record @ directions):
        part = tangents.part
        multipliers, ends, of_outputs = take_back(run, part, [weights], first)
        of_rows, of_steps, of_parameters = tangents.changes(run, multipliers[..., 0], ends[..., 0], of_outputs[..., 0])
        second.parameters += of_parameters
        second.parameters[: len(run.asked.dp)] += of_rows[:, width:].sum(axis=0)
        direct = of_rows[len(of_rows) - len(ends) :, :width]
        run.linear.adjoints(part.matrices, direct, second.state, second.parameters, part.times, of_steps)
        second.record = of_rows[0, :width]
    result: Array = run.state.T @ second.state + run.record.T @ second.record + run.along.dp.T @ second.parameters
    of_start = first.state[:, 0], first.record[:, 0], first.parameters[len(run.asked.dp) :, 0]
    return result + StartSecondDerivatives(run, asked).of(*of_start)


def _inner_product(first: Array, second: Array) -> Array:
    """Return the sum of first^T second over all axes before directions."""
    rows = first.shape[0] * first.shape[1]
    result: Array = first.reshape(rows, -1).T @ second.reshape(rows, -1)
    return result


def _parts(run: AlphaRun, along: StateDirections, state: Array, record: Array) -> Iterator[_AlphaTangents]:
    """Yield the parts of a run from the last to the first, made linear, with tangents along directions. `along` are
    changes of the start, `state` and `record` the same for the state of steps and for the first row."""
    begins = [(state.copy(), record)]
    parts = run.motion.parts
    if parts > 1:
        for number, stepped in enumerate(run.motion.forwards()):
            if number == parts - 1:  # tangents of the last part are taken in the backward sweep
                continue
            made, state = run.linearise_part(stepped), begins[-1][0].copy()
            records, _ = run.linear.tangents(made.matrices, along.dp, state, made.times)
            begins.append((state, records[-1]))
    dp = run.equation_directions(along).dp
    nv, factors = run.equations.nv, run.equations.model.factors
    for part in map(run.linearise_part, run.motion.backwards()):
        state, record = begins.pop()
        records, eta = run.linear.tangents(part.matrices, along.dp, state.copy(), part.times)
        rows = np.concatenate([record[np.newaxis], records])
        turning = turnings(factors, difference(factors, part.states.q[:-1], part.states.q[1:]))
        steps = np.concatenate([rows[:-1, :nv], np.zeros_like(rows[1:, :nv]), eta], axis=1)
        for factor in turning:
            steps[:, nv + factor.v.start : nv + factor.v.stop] = factor.increments(rows[:-1, :nv], rows[1:, :nv])
        of_parameters = np.broadcast_to(dp, (len(rows), *dp.shape))
        yield _AlphaTangents(part, np.concatenate([rows, of_parameters], axis=1), steps, along.dp, turning)


def take_back(
    run: LinearRun[Any], part: LinearPart, weights: Sequence[RowWeights], adjoint: RunAdjoint
) -> SweepRemainders:
    """Take the adjoints of functionals back through a part of a run, and return their remainders.

    Parameters
    ----------
    run, part : LinearRun, LinearPart
        The run made linear, and the part to reverse.
    weights : sequence of RowWeights
        One for each functional.
    adjoint : RunAdjoint
        Adjoint at the end of the part; becomes the adjoint at the start.
    """
    of_outputs = run.row_weights(part, weights)
    direct = run.row_derivatives(part, of_outputs, adjoint.parameters)
    adjoint.record = direct[0]
    return SweepRemainders(*run.take_back(part, direct[1:], adjoint.state, adjoint.parameters), of_outputs)
