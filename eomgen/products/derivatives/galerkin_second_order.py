"""Second derivatives of functionals of runs in passes: adjoints along imaginary increments.

The gradient g of a functional is an analytic function of parameters, start and inputs: the steps made linear, their
transposes, and no other operation. So the imaginary part of g at directions moved by i h d is h H d, exact but for
rounding, since no difference is taken (Squire and Trapp 1998; Martins, Sturdza and Alonso 2003). The run needs no
complex numbers: states move by i h times the tangents along d, which the linearised steps have. The adjoint there is
the run's, by the same text in complex numbers.

Derivatives in rotations are left-trivialised, and those along x and y do not commute: D_x D_y g - D_y D_x g is
D_[x, y] g. Hessians are the mean of both orders, the second derivatives along q o exp(theta).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from eomgen.base.data import dataclass
from eomgen.compiled.coordinates import configuration_rate
from eomgen.lie import product
from eomgen.lie.product import Array, Factor
from eomgen.products.derivatives.equations import MovedEquations
from eomgen.products.derivatives.functionals import RowWeights
from eomgen.products.derivatives.galerkin_run import GalerkinRun
from eomgen.products.derivatives.motion import RunSegment
from eomgen.products.derivatives.start import StateDirections, rest_slopes
from eomgen.simulation.stepping.states import PrescribedInputs, States

#: An imaginary increment with a square far below rounding, and far from the least numbers.
_TINY = 1e-100


@dataclass(frozen=True)
class _Tangents:
    """A part of a run with tangents along directions.

    Attributes
    ----------
    rows : (rows, size, directions) of q, v, the accelerations there, and z; the first row of all but the first part has
        no functional, and accelerations of the memory
    memory : (steps, nv, directions), of the accelerations that steps begin with
    """

    stepped: RunSegment
    rows: Array
    memory: Array


@dataclass
class _Adjoint:
    """Complex adjoints of functionals during the backward sweep: state (size, functionals), parameters (parameters,
    functionals), and of the row at the start of the part (size, functionals)."""

    state: Array
    parameters: Array
    record: Array

    @classmethod
    def of(cls, run: GalerkinRun, count: int) -> _Adjoint:
        sizes = len(run.state), len(run.along.dp), len(run.record)
        return cls(*(np.zeros((size, count), complex) for size in sizes))


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

    def _along_rest(self, start: States) -> StateDirections:
        """Return the directions at the start, of which static equilibrium follows parameters."""
        along, equations = self.along, self.equations
        still = start._replace(v=np.zeros_like(start.v), a=np.zeros_like(start.a))
        blocks = self.blocks(still, self.prescribed(still.t))
        slopes = rest_slopes(equations, equations.partials(blocks))
        dq, dz = along.dq.astype(complex), along.dz.astype(complex)
        followed = np.flatnonzero(np.any(along.dp, axis=0))
        dq[:, followed], dz[:, followed] = np.split(slopes, [equations.nv])
        return StateDirections(dq, along.dv, dz, along.dp)

    def back(self, tangents: _Tangents, column: int, weights: Sequence[RowWeights], adjoint: _Adjoint) -> None:
        """Propagate adjoints of functionals backwards through a part, perturbed along the tangents of a column."""
        rows, memory = (self._increment(of[..., column]) for of in (tangents.rows, tangents.memory))
        self._tangents, stepped = rows, tangents.stepped
        part = self.of_part(RunSegment(stepped.first, stepped.rows, stepped.memory + memory))
        direct = self.of_rows(part, self.row_weights(part, weights), adjoint.parameters)
        self.take_back(part, direct[1:], adjoint.state, adjoint.parameters)
        adjoint.record = direct[0]

    def gradients(self, adjoint: _Adjoint) -> Array:
        """Return gradients of functionals, (functionals, directions)."""
        result: Array = adjoint.state.T @ self.state + adjoint.record.T @ self.record
        result += adjoint.parameters.T @ self.along.dp
        return result

    def states(self, part: RunSegment) -> tuple[States, PrescribedInputs]:
        real, _ = super().states(part)
        assert self._tangents is not None  # for mypy: set by the forward sweep
        moved = _moved(self.equations.model.factors, real, self._tangents)
        return moved, self.prescribed(moved.t)

    def prescribed(self, times: Array) -> PrescribedInputs:
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
        return PrescribedInputs(u, self.base(times))

    def base(self, t: Array) -> Array | None:
        if not self.run.model.evaluator.moving_base:
            return None
        (result,) = self.equations.functions("base", {"t": t, "p": self.equations.p})
        return np.broadcast_to(result, (len(t), result.shape[-1]))


def _moved(factors: Sequence[Factor], states: States, change: Array) -> States:
    """Return states moved by imaginary changes (n, size), or (size,), of q, v, a and z."""
    nv = states.v.shape[1]
    q, v, a, z = np.split(np.broadcast_to(change, (len(states.t), change.shape[-1])), [nv, 2 * nv, 3 * nv], axis=1)
    of_q = 1j * configuration_rate(factors, states.q, q.imag)
    return States(states.t, states.q + of_q, states.v + v, states.a + a, states.multipliers, states.z + z)


def hessian_products(run: GalerkinRun, weights: Sequence[RowWeights], directions: Array) -> tuple[Array, Array]:
    """Return gradients of functionals, (functionals, directions), and their Hessians times vectors, (functionals,
    directions, vectors).

    Parameters
    ----------
    directions : (directions, vectors)
    """
    moved = [_MovedRun(run, direction) for direction in directions.T]
    adjoints = [_Adjoint.of(run, len(weights)) for _ in moved]
    for tangents in _parts(run, directions):
        for column, (one, adjoint) in enumerate(zip(moved, adjoints, strict=True)):
            one.back(tangents, column, weights, adjoint)
    result = np.stack([one.gradients(adjoint) for one, adjoint in zip(moved, adjoints, strict=True)], axis=2)
    real = adjoints[0].state.real, adjoints[0].record.real
    return result[..., 0].real, result.imag / _TINY - 0.5 * _brackets(run, real, directions)


def _brackets(run: GalerkinRun, adjoint: tuple[Array, Array], directions: Array) -> Array:
    """Return derivatives of functionals along [x, y], (functionals, directions, vectors), x of the directions of the
    start and y of vectors.

    Parameters
    ----------
    adjoint : of the start of steps and of the first row, (size, functionals)
    """
    factors, nv, along = run.equations.model.factors, run.equations.nv, run.asked
    none = np.zeros((run.equations.nz, nv)), np.zeros((len(along.dp), nv))
    by_q = run.begun(run.start_states, StateDirections(np.eye(nv), np.zeros((nv, nv)), *none))
    of_q = (adjoint[0] + adjoint[1]).T @ by_q
    brackets = product.bracket_matrix(factors, (along.dq @ directions).T) @ along.dq  # (vectors, nv, directions)
    result: Array = np.einsum("fk,vkd->fdv", of_q, brackets)
    return result


def hessians(run: GalerkinRun, weights: Sequence[RowWeights]) -> tuple[Array, Array]:
    """Return gradients of functionals, (functionals, directions), and second derivatives, (functionals, directions,
    directions).

    Rounding of the second derivatives is symmetrised: the result is half the sum with the transpose.
    """
    first, second = hessian_products(run, weights, np.eye(run.size))
    return first, 0.5 * (second + np.swapaxes(second, 1, 2))


def _parts(run: GalerkinRun, directions: Array) -> Iterator[_Tangents]:
    """Yield the parts from the last to the first with tangents along directions."""
    dp, nv = run.along.dp @ directions, run.equations.nv
    begins = [run.state @ directions]
    if run.motion.parts > 1:
        for number, part in enumerate(map(run.of_part, run.motion.forwards())):
            if number == run.motion.parts - 1:  # tangents of the last part are taken in the backward sweep
                continue
            begins.append(part.steps.tangents(dp, begins[-1].copy())[-1])
    for stepped in run.motion.backwards():
        part, state = run.of_part(stepped), begins.pop()
        ends = part.steps.tangents(dp, state.copy())
        rows = np.concatenate([state[np.newaxis], run.rows_of(part, dp, ends)])
        memory = np.concatenate([state[np.newaxis], ends[:-1]])[:, 2 * nv : 3 * nv]
        yield _Tangents(stepped, rows, memory)
