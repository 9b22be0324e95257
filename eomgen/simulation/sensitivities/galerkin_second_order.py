"""Second derivatives of functionals of runs in passes: adjoints along imaginary increments.

The gradient g of a functional is an analytic function of parameters, start and inputs: the steps made linear, their
transposes, and nothing besides. So the imaginary part of g at directions moved by i h d is h H d, exact but for
rounding, since no difference is taken (Squire and Trapp 1998; Martins, Sturdza and Alonso 2003). The run itself needs
no complex numbers: its states move by i h times their tangents along d, which the steps made linear have. Adjoints l of
steps J change by dl = J^T dl' + dJ^T l', where l' is known from the gradient: dJ itself is not needed, only its product
with l', which recorded steps give for all steps at once.

Derivatives in rotations are left-trivialised, and those along x and y do not commute: D_x D_y g - D_y D_x g is
D_[x, y] g. Hessians are the mean of both orders, the second derivatives along q o exp(theta).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.compiled.coordinates import configuration_rate
from eomgen.lie import product
from eomgen.lie.product import Array, Factor
from eomgen.simulation.sensitivities.beginning import Directions
from eomgen.simulation.sensitivities.equations import MovedEquations
from eomgen.simulation.sensitivities.following_start import rest_slopes
from eomgen.simulation.sensitivities.functionals import Weights
from eomgen.simulation.sensitivities.galerkin_run import GalerkinPart, GalerkinRun
from eomgen.simulation.sensitivities.linear_run import LinearPart
from eomgen.simulation.sensitivities.motion import Part
from eomgen.simulation.stepping.states import Prescribed, States

#: An imaginary increment whose square is nothing beside anything, and far from the least numbers.
_TINY = 1e-100


@dataclass(frozen=True)
class _Tangents:
    """A part of a run with its changes along directions.

    Attributes
    ----------
    rows : (rows, size, directions) of q, v, the accelerations there, and z; the first row of all but the first part has
        no functional, and accelerations of the memory
    memory : (steps, nv, directions), of the accelerations that steps begin with
    """

    stepped: Part
    rows: Array
    memory: Array


class _MovedRun(GalerkinRun):
    """The run along one direction, moved by an imaginary increment.

    Parameters
    ----------
    direction : (directions,)
    """

    def __init__(self, run: GalerkinRun, direction: Array) -> None:
        vars(self).update(vars(run))
        self._du = self._increment(run.along.dp[len(run.equations.chosen) :] @ direction)
        p = run.equations.p.astype(complex)
        p[run.equations.chosen] += self._increment(run.along.dp[: len(run.equations.chosen)] @ direction)
        self.equations = MovedEquations(run.equations, p)
        start = _moved(run.equations.model.factors, run.start_states, self._increment(run.state @ direction))
        if run.rest is not None:
            self.along = self._along_rest(start)
        self.state = self.record = self.begun(start, self.along)
        self._tangents: Array | None = None

    equations: MovedEquations

    @staticmethod
    def _increment(change: Array) -> Array:
        return 1j * _TINY * change

    def _along_rest(self, start: States) -> Directions:
        """Return the directions at the start, of which static equilibrium follows parameters."""
        along, equations = self.along, self.equations
        still = start._replace(v=np.zeros_like(start.v), a=np.zeros_like(start.a))
        blocks = self.blocks(still, self.prescribed(still.t))
        slopes = rest_slopes(equations, equations.partials(blocks))
        dq, dz = along.dq.astype(complex), along.dz.astype(complex)
        followed = np.flatnonzero(np.any(along.dp, axis=0))
        dq[:, followed], dz[:, followed] = np.split(slopes, [equations.nv])
        return Directions(dq, along.dv, dz, along.dp)

    def changed(
        self, tangents: _Tangents, column: int, weights: Sequence[Weights], adjoints: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Return how what functionals take of a part changes: of the first row, of the ends and the starts of steps, of
        parameters; with the adjoints at the ends of its steps held.

        Parameters
        ----------
        column : of the tangents
        adjoints : (steps, size, functionals)
        """
        rows, memory = (self._increment(of[..., column]) for of in (tangents.rows, tangents.memory))
        self._tangents, stepped = rows, tangents.stepped
        part = Part(stepped.first, stepped.rows, stepped.memory + memory)
        (states, given), steps = self.steps_of(part, recorded=True)
        linear = LinearPart(part.first, states, self.blocks(states, given))
        of_parameters = np.zeros((len(self.along.dp), len(weights)), complex)
        direct = self.of_rows(linear, self.row_weights(linear, weights), of_parameters)
        own = self.own(self.accelerations(linear.blocks), direct[1:], of_parameters)
        of_starts, by_steps = steps.pulled(adjoints.astype(complex))
        of_parameters += by_steps.sum(axis=0)
        first, ends, starts, parameters = (of.imag / _TINY for of in (direct[0], own, of_starts, of_parameters))
        return first, ends, starts, parameters

    def states(self, part: Part) -> tuple[States, Prescribed]:
        real, _ = super().states(part)
        assert self._tangents is not None  # for mypy: whoever takes states has set them
        moved = _moved(self.equations.model.factors, real, self._tangents)
        return moved, self.prescribed(moved.t)

    def prescribed(self, times: Array) -> Prescribed:
        """Return inputs and base at times (n,): the scene's own follow the parameters."""
        functions, signals = self.equations.functions, self.run.signals
        blocks, u = {"t": times, "p": self.equations.p}, None
        if self.run.model.nu:
            given = super().prescribed(times).u
            u = given.astype(complex) if given is not None else None
        if u is not None and "inputs" in functions:
            own = [k for k, name in enumerate(signals.names) if name not in signals.given]
            u[:, own] = functions("inputs", blocks)[0][:, own]
        if u is not None and (by_samples := self.moved_inputs(times)) is not None:
            u += by_samples @ self._du
        return Prescribed(u, self.base(times))

    def base(self, t: Array) -> Array | None:
        if not self.run.model.evaluator.moving_base:
            return None
        (found,) = self.equations.functions("base", {"t": t, "p": self.equations.p})
        return np.broadcast_to(found, (len(t), found.shape[-1]))


def _moved(factors: Sequence[Factor], states: States, change: Array) -> States:
    """Return states moved by imaginary changes (n, size), or (size,), of q, v, a and z."""
    nv = states.v.shape[1]
    q, v, a, z = np.split(np.broadcast_to(change, (len(states.t), change.shape[-1])), [nv, 2 * nv, 3 * nv], axis=1)
    of_q = 1j * configuration_rate(factors, states.q, q.imag)
    return States(states.t, states.q + of_q, states.v + v, states.a + a, states.multipliers, states.z + z)


def hessian_products(run: GalerkinRun, weights: Sequence[Weights], directions: Array) -> tuple[Array, Array]:
    """Return gradients of functionals, (functionals, directions), and their Hessians times vectors, (functionals,
    directions, vectors).

    Parameters
    ----------
    directions : (directions, vectors)
    """
    moved = [_MovedRun(run, direction) for direction in directions.T]
    count, size, parameters = len(weights), len(run.state), len(run.along.dp)
    first = np.zeros((size, count)), np.zeros((parameters, count)), np.zeros((size, count))
    second = [tuple(np.zeros_like(of) for of in first) for _ in moved]
    for tangents, part in _parts(run, directions):
        direct = run.of_rows(part, run.row_weights(part, weights), first[1])
        adjoints = run.own(part.accelerations, direct[1:], first[1])
        run.backwards(part, adjoints, first[0])
        first[1][:] += np.einsum("nsp,nsf->pf", part.by_parameters, adjoints)
        first[2][:] = direct[0]
        for column, (one, (state, of_parameters, record)) in enumerate(zip(moved, second, strict=True)):
            record[:], ends, starts, by_parameters = one.changed(tangents, column, weights, adjoints)
            run.backwards(part, ends, state, starts)
            of_parameters[:] += by_parameters + np.einsum("nsp,nsf->pf", part.by_parameters, ends)
    gradients: Array = first[0].T @ run.state + first[1].T @ run.along.dp + first[2].T @ run.record
    columns = []
    for one, (state, of_parameters, record) in zip(moved, second, strict=True):
        found = state.T @ run.state + of_parameters.T @ run.along.dp + record.T @ run.record
        columns.append(found + (first[0] + first[2]).T @ one.state.imag / _TINY)
    brackets = _brackets(run, (first[0], first[2]), directions)
    return gradients, np.stack(columns, axis=2) - 0.5 * brackets


def _brackets(run: GalerkinRun, adjoint: tuple[Array, Array], directions: Array) -> Array:
    """Return derivatives of functionals along [x, y], (functionals, directions, vectors), x of the directions of the
    start and y of vectors.

    Parameters
    ----------
    adjoint : of what steps begin with and of the first row, (size, functionals)
    """
    factors, nv, along = run.equations.model.factors, run.equations.nv, run.asked
    none = np.zeros((run.equations.nz, nv)), np.zeros((len(along.dp), nv))
    by_q = run.begun(run.start_states, Directions(np.eye(nv), np.zeros((nv, nv)), *none))
    of_q = (adjoint[0] + adjoint[1]).T @ by_q
    brackets = product.bracket_matrix(factors, (along.dq @ directions).T) @ along.dq  # (vectors, nv, directions)
    found: Array = np.einsum("fk,vkd->fdv", of_q, brackets)
    return found


def hessians(run: GalerkinRun, weights: Sequence[Weights]) -> tuple[Array, Array]:
    """Return gradients of functionals, (functionals, directions), and second derivatives, (functionals, directions,
    directions).

    They are symmetric but for rounding, which is taken out: half the sum with the transpose.
    """
    first, second = hessian_products(run, weights, np.eye(run.size))
    return first, 0.5 * (second + np.swapaxes(second, 1, 2))


def _parts(run: GalerkinRun, directions: Array) -> Iterator[tuple[_Tangents, GalerkinPart]]:
    """Yield the parts from the last to the first with their changes along directions, and made linear."""
    dp, nv = run.along.dp @ directions, run.equations.nv
    begins = [run.state @ directions]
    if run.motion.parts > 1:
        for number, part in enumerate(map(run.of_part, run.motion.forwards())):
            if number == run.motion.parts - 1:  # its tangents are taken on the way back
                continue
            begins.append(run.ends(part, dp, begins[-1].copy())[-1])
    for stepped in run.motion.backwards():
        part, state = run.of_part(stepped), begins.pop()
        ends = run.ends(part, dp, state.copy())
        rows = np.concatenate([state[np.newaxis], run.rows_of(part, dp, ends)])
        memory = np.concatenate([state[np.newaxis], ends[:-1]])[:, 2 * nv : 3 * nv]
        yield _Tangents(stepped, rows, memory), part
