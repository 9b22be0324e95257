"""A run made linear part by part: states and inputs at its rows, and what functionals take of rows.

What is linear of a step is that of its method: ``alpha_run``, ``galerkin_run``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from eomgen.arrays import Array
from eomgen.compiled.initial_state import InitialState
from eomgen.simulation.sensitivities.beginning import Directions
from eomgen.simulation.sensitivities.equations import Equations
from eomgen.simulation.sensitivities.following_start import at_rest
from eomgen.simulation.sensitivities.functionals import Weights
from eomgen.simulation.sensitivities.motion import Motion, Part
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import Prescribed, States, states_of


@dataclass(frozen=True)
class LinearPart:
    """A part of a run made linear.

    Attributes
    ----------
    first : number of its first row in the run
    states : (rows, ...) each
    blocks : input blocks at all rows
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
    """What the state that a run starts from follows from.

    Attributes
    ----------
    asked : the state before it was moved onto the constraints
    at_rest : whether it is static equilibrium
    slopes : changes of q (left-trivialised) and v by the parameters, (nv, parameters) each, of what is asked for; at
        rest of v alone; None where parameters do not move it
    """

    asked: InitialState
    at_rest: bool = False
    slopes: tuple[Array, Array] | None = None


Made = TypeVar("Made", bound=LinearPart)


class LinearRun(ABC, Generic[Made]):
    """A run with its linear steps.

    Attributes
    ----------
    columns : of p, q, v and z that derivatives are taken by, in this order
    asked : the directions, with what parameters move of the state that is asked for
    follows : whether they move any of it
    along : what they change at the start
    state, record : what the steps begin with along them, and the first row: dq, dv, dvdot, dz, dlam
    """

    along: Directions
    state: Array
    record: Array
    follows: bool

    def __init__(self, motion: Motion, start: Start, columns: Mapping[str, Sequence[int]], rows: Sequence[int]) -> None:
        self.motion, self.columns, self.start = motion, columns, start
        self.run: Run = motion.run
        model = self.run.model
        holonomic = int(model.library.layout["sizes"]["holonomic"])
        self.equations = Equations(model, self.run.parameters, columns["p"], rows, holonomic)
        self.asked = self._directions()

    @property
    def size(self) -> int:
        """Number of directions."""
        return sum(map(len, self.columns.values()))

    @abstractmethod
    def of_part(self, part: Part) -> Made:
        """Make a part of the run linear."""

    @abstractmethod
    def tangents(self, part: Made, dp: Array, state: Array) -> Array:
        """Take tangents through the steps of a part: ``state`` (size, directions) becomes that of their end.

        Parameters
        ----------
        dp : (parameters, directions)

        Returns
        -------
        (steps, record, directions) : rows at the ends of the steps
        """

    @abstractmethod
    def take_back(self, part: Made, direct: Array, state: Array, gradient: Array) -> tuple[Array, Array] | None:
        """Take adjoints back through the steps of a part: ``state`` becomes that of their start, and ``gradient``
        (parameters, functionals) is added to.

        Parameters
        ----------
        direct : (steps, record, functionals), what functionals take of the ends of the steps

        Returns
        -------
        multipliers and ends of the steps, of methods with second derivatives
        """

    def products(self, matrices: Array, columns: Array) -> Array:
        """Return products of (n, rows, size) and (n, size, directions)."""
        found: Array = matrices @ columns
        return found

    def values(self, part: Part) -> tuple[Array, dict[str, Array]]:
        """Return times and input blocks of the rows of a part."""
        states, given = self.states(part)
        return states.t, self.equations.values(states, given)

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
        equations, columns, run, start = self.equations, self.columns, self.run, self.start
        sizes = {"q": equations.nv, "v": equations.nv, "z": equations.nz}
        count = len(columns["p"])
        offsets = np.cumsum([0, *(len(columns[name]) for name in "pqvz")])
        changes = {}
        for offset, name in zip(offsets[1:], sizes, strict=False):
            changes[name] = np.zeros((sizes[name], self.size))
            changes[name][list(columns[name]), offset + np.arange(len(columns[name]))] = 1.0
        if count and start.slopes is not None:
            changes["q"][:, :count], changes["v"][:, :count] = start.slopes
        if count and start.at_rest:
            given = self.prescribed(np.array([run.grid.start]))
            changes["q"][:, :count], changes["z"][:, :count] = at_rest(equations, start.asked, run.grid.start, given)
        self.follows = any(np.any(change[:, :count]) for change in changes.values())
        return Directions(changes["q"], changes["v"], changes["z"], np.eye(count, self.size))

    def prescribed(self, times: Array) -> Prescribed:
        """Return inputs and base at times (n,)."""
        model, u = self.run.model, None
        if model.nu and self.run.takes_rows:
            u = self.run.signals.rows(times)
        elif model.nu:
            u = model.input_values(times, parameters=self.equations.p)
        return Prescribed(u, self.base(times))

    def states(self, part: Part) -> tuple[States, Prescribed]:
        """Return the states at the rows of a part, and what is prescribed there."""
        states = states_of(part.rows, self.run.model)
        return states, self.prescribed(states.t)

    def base(self, t: Array) -> Array | None:
        """Return the state of the base at times (n,); None where it stands still."""
        model = self.run.model
        return model.base(t, parameters=self.equations.p) if model.evaluator.moving_base else None
