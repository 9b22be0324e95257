"""A run made linear part by part: states and inputs at its rows, and derivatives of functionals by rows.

The linear form of a step belongs to the method: ``alpha_run``, ``transition_run``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED, WRITTEN
from eomgen.compiled.initial_state import InitialState
from eomgen.compiled.model import CompiledModel
from eomgen.errors import NumericalError, Problem
from eomgen.formula.features import rough_operations
from eomgen.products.derivatives.equations import StepEquations, rows_of
from eomgen.products.derivatives.functionals import RowWeights
from eomgen.products.derivatives.motion import ReplayedRun, RunSegment
from eomgen.products.derivatives.start import LinearizedRest, StateDirections, at_rest
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import PrescribedInputs, States, states_of


def undefined_derivatives(model: CompiledModel, where: str) -> NumericalError:
    """Return the NumericalError for derivatives that are not finite; the second argument is the place in words, such as
    a time."""
    operations = rough_operations(model.description.formulas)
    why = f", of the forces perhaps {operations}" if operations else " (a root, a logarithm or a power at zero)"
    fault = f"derivatives are not finite numbers {where}: a formula has none there{why} [E0584]"
    hint = "a formula of finite slope there, x / sqrt(x + width) for sqrt(x); eomgen check names formulas without"
    return NumericalError(Problem("sensitivities", fault, hint))


@dataclass(frozen=True)
class LinearPart:
    """A part of a run made linear: consecutive steps, and the rows at both ends of each.

    The first row of a part is the last row of the part before, so a sum over rows counts it once.

    Attributes
    ----------
    first : number of the first row of the part in the run
    states : (rows, ...) each, rows = steps + 1
    blocks : arguments of the compiled functions at these rows by name, (rows, size) each; parameters ``p`` may be one
        set (np,) for all rows
    """

    first: int
    states: States
    blocks: dict[str, Array]

    @property
    def times(self) -> Array:
        """Times of the ends of the steps, (rows - 1,), s."""
        return self.states.t[1:]


@dataclass(frozen=True)
class Start:
    """How the initial state of a run depends on parameters.

    Attributes
    ----------
    asked : the requested state, before a correction onto the constraints
    at_rest : whether the initial state is static equilibrium
    slopes : changes of q (left-trivialised) and v by the parameters, (nv, parameters) each, of the requested state; at
        rest of v alone; None if parameters do not change the requested state
    """

    asked: InitialState
    at_rest: bool = False
    slopes: tuple[Array, Array] | None = None


@dataclass(frozen=True)
class DerivativeVariables:
    """Variables of derivatives: columns of p, q, v and z, and samples of inputs, (column, row) each; row -1: the
    values at all rows together."""

    columns: Mapping[str, Sequence[int]]
    samples: Sequence[tuple[int, int]] = ()


PartType = TypeVar("PartType", bound=LinearPart)


@dataclass
class RunAdjoint:
    """Adjoints of functionals during a backward sweep through a run, changed in place.

    Attributes
    ----------
    state : derivatives by the state at the start of steps, (state, functionals)
    parameters : derivatives by parameters, (parameters, functionals)
    record : derivatives by the row at the start of the part, (record, functionals)
    """

    state: Array
    parameters: Array
    record: Array

    @classmethod
    def of(cls, run: LinearRun[Any], count: int) -> RunAdjoint:
        """Return the adjoints of ``count`` functionals at the end of a run."""
        return cls(*(np.zeros((len(along), count)) for along in (run.state, run.along.dp, run.record)))

    def gradients(self, run: LinearRun[Any]) -> Array:
        """Return the derivatives of the functionals, (functionals, directions), at the start of a run."""
        result: Array = self.state.T @ run.state + self.record.T @ run.record + self.parameters.T @ run.along.dp
        return result


class LinearRun(ABC, Generic[PartType]):
    """A run whose steps and start are made linear, part by part, along directions of derivatives.

    Attributes
    ----------
    columns : variables among p, q, v and z, in this order
    samples : variables after these: inputs (column, row), row -1: a common change of the values at all rows
    asked : the directions, with the change of the requested state by parameters
    follows : whether there is such a change
    rest : static equilibrium, if the directions change it
    along : changes of the start along the directions
    state, record : changes along the directions, of the start of steps and of the first row: dq, dv, dvdot, dz, dlam
    """

    along: StateDirections
    state: Array
    record: Array
    follows: bool

    def __init__(self, motion: ReplayedRun, start: Start, by: DerivativeVariables, rows: Sequence[int]) -> None:
        self.motion, self.columns, self.samples, self.start = motion, by.columns, by.samples, start
        self.run: Run = motion.run
        model = self.run.model
        self.equations = StepEquations(model, self.run.parameters, by.columns["p"], rows, len(by.samples))
        self.rest: LinearizedRest | None = None
        self.asked = self._directions()

    @property
    def size(self) -> int:
        """Number of directions."""
        return sum(map(len, self.columns.values())) + len(self.samples)

    @abstractmethod
    def linearise_part(self, part: RunSegment) -> PartType:
        """Make a part of the run linear."""

    @abstractmethod
    def tangents(self, part: PartType, dp: Array, state: Array) -> Array:
        """Take tangents through the steps of a part: ``state`` (size, directions) becomes the tangent at the end of the
        steps.

        Parameters
        ----------
        dp : (parameters, directions)

        Returns
        -------
        (steps, record, directions) : rows at the ends of the steps
        """

    @abstractmethod
    def take_back(self, part: PartType, direct: Array, state: Array, gradient: Array) -> tuple[Array, Array]:
        """Take adjoints back through the steps of a part: ``state`` becomes the adjoint at the start of the steps, and
        the gradient of the steps is added to ``gradient`` (parameters, functionals).

        Parameters
        ----------
        direct : (steps, record, functionals), derivatives of functionals by the ends of the steps

        Returns
        -------
        multipliers and ends of the steps; empty for methods without second derivatives
        """

    def values(self, part: RunSegment) -> tuple[Array, dict[str, Array]]:
        """Return times (rows,), s, and input blocks (see ``LinearPart``) of the rows of a part."""
        states = states_of(part.rows, self.run.model)
        return states.t, self.blocks(states, self.prescribe(states.t))

    def without_jumps(self, part: RunSegment) -> tuple[NDArray[np.intp], dict[str, Array], dict[str, Array]]:
        """Return the stretches of a part within which the state does not jump: steps, and input blocks at both ends."""
        _, blocks = self.values(part)
        first, last = rows_of(blocks, slice(None, -1)), rows_of(blocks, slice(1, None))
        return np.arange(len(first["t"])), first, last

    def blocks(self, states: States, prescribed: PrescribedInputs) -> dict[str, Array]:
        """Return input blocks at states, with the changes there along directions of inputs."""
        return self.equations.values(states, prescribed, self.moved_inputs(states.t))

    def moved_inputs(self, times: Array) -> Array | None:
        """Return the changes of inputs along the directions of inputs at times (n,), (n, nu, samples), linear between
        rows. None without directions of inputs."""
        if not self.samples:
            return None
        position = (times - self.run.grid.start) / self.run.grid.step
        near = np.rint(position)
        position = np.where(np.abs(position - near) < WRITTEN, near, position)
        result = np.zeros((len(times), self.run.model.nu, len(self.samples)))
        for number, (column, row) in enumerate(self.samples):
            result[:, column, number] = 1.0 if row < 0 else np.maximum(0.0, 1.0 - np.abs(position - row))
        return result

    def row_weights(self, part: LinearPart, weights: Sequence[RowWeights]) -> Array:
        """Return the weights of outputs at the rows of a part, (rows, outputs, functionals)."""
        count, steps, step = len(part.states.t), self.motion.steps, self.run.grid.step
        return np.stack([weight.row_weights(part.first, count, steps, step) for weight in weights], axis=2)

    def row_derivatives(self, part: LinearPart, of_outputs: Array, by: Array) -> Array:
        """Return the derivatives of functionals by each row of a part, (rows, record, functionals). `of_outputs` (rows,
        outputs, functionals) are weights; derivatives by parameters are added to `by`. Rows that parts share count in
        the first part alone."""
        result = np.zeros((len(of_outputs), self.equations.record_size, of_outputs.shape[2]))
        weighed = np.flatnonzero(of_outputs.any(axis=(1, 2)))
        if len(weighed):
            Y, Yp = self.equations.output_partials(rows_of(part.blocks, weighed))
            result[weighed] = np.swapaxes(Y, 1, 2) @ of_outputs[weighed]
            new_rows = weighed >= (part.first > 0)
            by[: self.equations.parameters] += np.einsum("nop,nof->pf", Yp[new_rows], of_outputs[weighed[new_rows]])
        return result

    def _directions(self) -> StateDirections:
        """Return the changes of the requested start along the directions, one column each, with changes of parameters.
        Sets ``rest`` for a start at static equilibrium, and ``follows``."""
        equations, columns, run, start = self.equations, self.columns, self.run, self.start
        sizes = {"q": equations.nv, "v": equations.nv, "z": equations.nz}
        count, driven = len(columns["p"]), self.size - len(self.samples)
        offsets = np.cumsum([0, *(len(columns[name]) for name in "pqvz")])
        changes = {}
        for offset, name in zip(offsets[1:], sizes, strict=False):
            changes[name] = np.zeros((sizes[name], self.size))
            changes[name][list(columns[name]), offset + np.arange(len(columns[name]))] = 1.0
        if count and start.slopes is not None:
            changes["q"][:, :count], changes["v"][:, :count] = start.slopes
        followed = [*range(count), *range(driven, self.size)]
        if followed and start.at_rest:
            t = np.array([run.grid.start])
            self.rest = at_rest(equations, start.asked, t, self.prescribe(t), self.moved_inputs(t))
            dq, dz, _ = np.split(self.rest.slopes, np.cumsum([equations.nv, equations.nz]))
            changes["q"][:, followed], changes["z"][:, followed] = dq, dz
        self.follows = any(np.any(change[:, followed]) for change in changes.values())
        dp = np.zeros((equations.parameters, self.size))
        dp[np.arange(equations.parameters), followed] = 1.0
        return StateDirections(changes["q"], changes["v"], changes["z"], dp)

    def prescribe(self, times: Array, within: Array | None = None, p: Array | None = None) -> PrescribedInputs:
        """Return the inputs (n, nu) and the state of the base at times (n,), each None if the model has none.

        Parameters
        ----------
        within : (n,) times of steps within which inputs by rows are linear; None: `times` are of rows
        p : (np,) or (n, np) parameters, by default of the run
        """
        model, signals, u = self.run.model, self.run.signals, None
        p = self.equations.p if p is None else p
        base = model.base(times, parameters=p) if model.evaluator.moving_base else None
        if model.nu and not self.run.takes_rows:
            u = model.input_values(times, parameters=p)
        elif model.nu and within is None:
            u = signals.rows(times)
        elif model.nu and within is not None:
            start, ends = self.ends_of_steps(within)
            share = ((times - start) / self.run.grid.step)[:, np.newaxis]
            u = (1.0 - share) * ends[0] + share * ends[1]
            if signals.left_to_stepper:
                followed = [name not in signals.given for name in signals.names]
                u[:, followed] = model.input_values(times, parameters=p)[:, followed]
        return PrescribedInputs(u, base)

    def ends_of_steps(self, within: Array) -> tuple[Array, tuple[Array, Array]]:
        """Return the starts (n,), s, of the steps that contain the times `within` (n,), and inputs by rows at their
        starts and ends, (n, nu) each."""
        grid, rows = self.run.grid, self.run.signals.rows
        number = np.clip(np.floor((within - grid.start) / grid.step + COMPUTED), 0, self.motion.steps - 1)
        start = grid.start + grid.step * number
        return start, (rows(start), rows(start + grid.step))
