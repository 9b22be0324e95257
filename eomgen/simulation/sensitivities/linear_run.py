"""A run made linear part by part: states, matrices of the steps, what functionals take of rows, and the start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from eomgen.arrays import Array
from eomgen.compiled.initial_state import InitialState
from eomgen.simulation.sensitivities.beginning import Beginning, Directions, on_constraints
from eomgen.simulation.sensitivities.equations import Equations
from eomgen.simulation.sensitivities.functionals import Weights
from eomgen.simulation.sensitivities.linear_steps import LinearSteps, StepMatrices
from eomgen.simulation.sensitivities.motion import Motion, Part
from eomgen.simulation.sensitivities.step_matrices import step_matrices
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import Prescribed, States, states_of
from eomgen.simulation.stepping.stepper import Stepper


@dataclass(frozen=True)
class LinearPart:
    """A part of a run made linear.

    Attributes
    ----------
    first : number of its first row in the run
    states : (rows, ...) each
    matrices : of the steps between rows
    eta : (rows - 1, holonomic), multipliers of velocities in the steps
    blocks : input blocks at all rows
    """

    first: int
    states: States
    matrices: StepMatrices
    eta: Array
    blocks: dict[str, Array]

    @property
    def times(self) -> Array:
        """Times of the ends of the steps, (rows - 1,), s."""
        return self.states.t[1:]


class LinearRun:
    """A run with its linear steps.

    Attributes
    ----------
    columns : of p, q, v and z that derivatives are taken by, in this order
    asked : the directions
    along : what they change at the start, on the constraints
    stages : the states whose accelerations the start takes, with their changes
    inverse_inertia : W = 1/M_ii of the start, by which multipliers move positions; empty where there is none
    state, record : what the steps begin with along them
    """

    def __init__(
        self,
        run: Run,
        stepper: Stepper,
        state: InitialState,
        coefficients: Sequence[float],
        columns: Mapping[str, Sequence[int]],
        rows: Sequence[int],
    ) -> None:
        model = run.model
        self.run, self.columns = run, columns
        holonomic = int(model.library.layout["sizes"]["holonomic"])
        self.equations = Equations(model, run.parameters, columns["p"], rows, holonomic)
        self.coefficients = tuple(coefficients)
        self.linear = LinearSteps(model.functions.sizes, model.factors, self.coefficients, holonomic)
        self.motion = Motion(run, stepper, state)
        start = self.motion.start
        self.inverse_inertia = start.get("inverse_inertia", np.zeros(0)) if holonomic else np.zeros(0)
        self.asked = self._directions()
        self.along = (
            on_constraints(self.beginning, self.asked, self.inverse_inertia) if model.multipliers else self.asked
        )
        self.stages = self.beginning.stages(self.of_equations(self.along))
        self.state, self.record = self.beginning.tangents(self.of_equations(self.along), self.stages)

    @property
    def size(self) -> int:
        """Number of directions."""
        return sum(map(len, self.columns.values()))

    @cached_property
    def beginning(self) -> Beginning:
        """The start of the run."""
        start, run = self.motion.start, self.run
        _, alpha_m, alpha_f, *_ = self.coefficients
        share = alpha_m - alpha_f if np.any(start["a"] != start["vdot"]) else 0.0
        z = start.get("z", np.zeros(0))
        return Beginning(
            self.equations, run.grid.start, run.grid.step, start["q"], start["v"], z, self._prescribed_at, share
        )

    def of_equations(self, along: Directions) -> Directions:
        """Return directions without what moves multipliers of velocities, which the equations do not know."""
        return Directions(along.dq, along.dv, along.dz, along.dp[: len(self.columns["p"])])

    def values(self, part: Part) -> tuple[Array, dict[str, Array]]:
        """Return times and input blocks of the rows of a part."""
        states, given = self._states(part)
        return states.t, self.equations.values(states, given)

    def of_part(self, part: Part) -> LinearPart:
        """Make a part of the run linear."""
        states, given = self._states(part)
        blocks = self.equations.values(states, given)
        behind = {name: array if name == "p" else array[1:] for name, array in blocks.items()}
        partials = self.equations.partials(behind)
        matrices, eta = step_matrices(
            self.equations, partials, states, given, part.a, self.coefficients, self.inverse_inertia
        )
        return LinearPart(part.first, states, matrices, eta, blocks)

    def row_weights(self, part: LinearPart, weights: Sequence[Weights]) -> Array:
        """Return the weights of outputs at the rows of a part, (rows, outputs, functionals)."""
        count, steps, step = len(part.states.t), self.motion.steps, self.run.grid.step
        return np.stack([one.of_rows(part.first, count, steps, step) for one in weights], axis=2)

    def of_rows(self, part: LinearPart, of_outputs: Array, by: Array) -> Array:
        """Return what functionals take of each row, (rows, record, functionals), and add to the derivatives in
        parameters; rows that parts share count in the first part alone."""
        Y, Yp = self.equations.output_partials(part.blocks)
        own = of_outputs[0 if part.first == 0 else 1 :]
        by[: Yp.shape[2]] += np.einsum("nop,nof->pf", Yp[-len(own) :], own)
        found: Array = np.swapaxes(Y, 1, 2) @ of_outputs
        return found

    def _directions(self) -> Directions:
        """Return the directions at the start."""
        equations, columns = self.equations, self.columns
        sizes = {"q": equations.nv, "v": equations.nv, "z": equations.nz}
        offsets = np.cumsum([0, *(len(columns[name]) for name in "pqvz")])
        changes = {}
        for offset, name in zip(offsets[1:], sizes, strict=False):
            changes[name] = np.zeros((sizes[name], self.size))
            changes[name][list(columns[name]), offset + np.arange(len(columns[name]))] = 1.0
        return Directions(changes["q"], changes["v"], changes["z"], np.eye(len(columns["p"]), self.size))

    def _prescribed_at(self, share: float) -> Prescribed:
        """Return inputs and base at a share of the first step: rows of inputs are linear in between."""
        run, equations = self.run, self.equations
        ends = run.grid.start + run.grid.step * np.array([0.0, 1.0])
        now = np.array([run.grid.start + share * run.grid.step])
        base = self._base(now)
        if not run.model.nu:
            return Prescribed(None, base)
        if not run.takes_rows:
            return Prescribed(run.model.input_values(now, parameters=equations.p), base)
        first, last = run.signals.rows(ends)
        return Prescribed(((1.0 - share) * first + share * last)[np.newaxis], base)

    def _base(self, t: Array) -> Array | None:
        model = self.run.model
        return model.base(t, parameters=self.equations.p) if model.evaluator.moving_base else None

    def _states(self, part: Part) -> tuple[States, Prescribed]:
        model = self.run.model
        states = states_of(part.rows, model)
        u = None
        if model.nu and self.run.takes_rows:
            u = self.run.signals.rows(states.t)
        elif model.nu:
            u = model.input_values(states.t, parameters=self.equations.p)
        return states, Prescribed(u, self._base(states.t))
