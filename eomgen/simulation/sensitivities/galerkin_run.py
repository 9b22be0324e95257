"""Runs of time-discontinuous Galerkin methods made linear: products of each step's own derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.arrays import Array
from eomgen.integrators.families.family import LinearPasses
from eomgen.simulation.sensitivities.beginning import Directions
from eomgen.simulation.sensitivities.galerkin_steps import GalerkinSteps
from eomgen.simulation.sensitivities.linear_run import By, LinearPart, LinearRun, Start
from eomgen.simulation.sensitivities.motion import Motion, Part
from eomgen.simulation.stepping.states import Prescribed, States


class GalerkinMotion(Motion):
    """A run whose accelerations at the starts of steps are no rows: slopes of the steps before."""

    def _taken(self, size: int, table: Array | None, record: Array) -> Array:
        stepper, rows = self.stepper, len(self.stepper.input_times) - 1
        memory = np.empty((size, self.run.model.nv))
        for number in range(size):
            memory[number] = stepper.state[stepper.places["vdot"]]
            inputs = None if table is None else table[number * rows : (number + 1) * rows + 1]
            self.check(stepper.run(1, 1, inputs, record[number : number + 1])[0])
        return memory


@dataclass(frozen=True)
class GalerkinPart(LinearPart):
    """A part of a run made linear.

    Attributes
    ----------
    by_start, by_parameters : (steps, size, size) and (steps, size, parameters), changes of (q, v, a, z) over a step
    accelerations : (rows, nv, size + parameters), of those of the rows, which a of the steps does not enter
    """

    by_start: Array
    by_parameters: Array
    accelerations: Array


class GalerkinRun(LinearRun[GalerkinPart]):
    """A run of a time-discontinuous Galerkin method with its linear steps."""

    def __init__(
        self,
        motion: Motion,
        method: LinearPasses,
        start: Start,
        by: By,
        rows: Sequence[int],
    ) -> None:
        super().__init__(motion, start, by, rows)
        self.method = method
        self.along = self.asked
        self.state = self.record = self.begun(self.start_states, self.along)

    @property
    def start_states(self) -> States:
        """The state that the run starts from, (1, ...) each."""
        begun, none = {name: array[np.newaxis] for name, array in self.motion.start.items()}, np.zeros((1, 0))
        t = np.array([self.run.grid.start])
        return States(t, begun["q"], begun["v"], begun["vdot"], none, begun.get("z", none))

    def begun(self, states: States, along: Directions) -> Array:
        """Return what directions change of q, v, the accelerations and z of the start, (size, directions)."""
        blocks = self.blocks(states, self.prescribed(states.t))
        moved = np.concatenate([along.dq, along.dv, np.zeros_like(along.dv), along.dz, along.dp])
        da = self.accelerations(blocks)[0] @ moved
        return np.concatenate([along.dq, along.dv, da, along.dz])

    def of_part(self, part: Part) -> GalerkinPart:
        (states, given), steps = self.steps_of(part)
        by_start, by_parameters = steps.taken()
        blocks = self.blocks(states, given)
        return GalerkinPart(part.first, states, blocks, by_start, by_parameters, self.accelerations(blocks))

    def steps_of(self, part: Part, *, recorded: bool = False) -> tuple[tuple[States, Prescribed], GalerkinSteps]:
        """Return what rows of a part have, and its steps."""
        states, given = self.states(part)
        t, step, nodes = states.t[:-1], self.run.grid.step, self.method.nodes
        before = States(*(array[:-1] for array in states))._replace(a=part.memory)
        at_start = Prescribed(*(None if array is None else array[:-1] for array in given))
        times = np.stack([states.t[1:] if node == nodes[-1] else t + node * step for node in nodes], axis=1)
        at_nodes = [(self.prescribed(column), self.moved_inputs(column)) for column in times.T]
        moved = at_start, self.moved_inputs(t)
        of_nodes = times, at_nodes
        steps = GalerkinSteps(self.equations, self.method, before, moved, step, of_nodes, recorded=recorded)
        return (states, given), steps

    def tangents(self, part: GalerkinPart, dp: Array, state: Array) -> Array:
        return self.rows_of(part, dp, self.ends(part, dp, state))

    def ends(self, part: GalerkinPart, dp: Array, state: Array) -> Array:
        """Take tangents through the steps, and return those of (q, v, a, z) at their ends, (steps, size, directions);
        a: what the next step begins with."""
        found = np.empty((len(part.by_start), *state.shape))
        of_parameters = part.by_parameters @ dp
        for number in range(len(found)):
            state[:] = part.by_start[number] @ state + of_parameters[number]
            found[number] = state
        return found

    def rows_of(self, part: GalerkinPart, dp: Array, ends: Array) -> Array:
        """Return tangents of rows at the ends of steps, whose accelerations are those of their states."""
        found, nv = ends.copy(), self.equations.nv
        moved = np.concatenate([found, np.broadcast_to(dp, (len(found), *dp.shape))], axis=1)
        found[:, 2 * nv : 3 * nv] = part.accelerations[1:] @ moved
        return found

    def take_back(self, part: GalerkinPart, direct: Array, state: Array, gradient: Array) -> None:
        adjoints = self.own(part.accelerations, direct, gradient)
        self.backwards(part, adjoints, state)
        gradient += np.einsum("nsp,nsf->pf", part.by_parameters, adjoints)

    def own(self, accelerations: Array, direct: Array, gradient: Array) -> Array:
        """Return what functionals take of (q, v, a, z) at the ends of steps, a: what the next step begins with, and add
        to the derivatives in the parameters what accelerations of rows take of these."""
        nv, size = self.equations.nv, direct.shape[1]
        taken = np.swapaxes(accelerations[1:], 1, 2) @ direct[:, 2 * nv : 3 * nv]
        gradient += taken[:, size:].sum(axis=0)
        own: Array = direct + taken[:, :size]
        own[:, 2 * nv : 3 * nv] = 0.0
        return own

    def backwards(self, part: GalerkinPart, adjoints: Array, state: Array, of_starts: Array | None = None) -> None:
        """Take adjoints back through the steps of a part: what functionals take of the ends of steps becomes the whole
        adjoints there, and ``state`` that of the start; ``of_starts``: what they take of the starts of steps."""
        for number in reversed(range(len(adjoints))):
            adjoints[number] += state
            state[:] = part.by_start[number].T @ adjoints[number]
            if of_starts is not None:
                state += of_starts[number]

    def accelerations(self, blocks: dict[str, Array]) -> Array:
        """Return the partials of the accelerations of rows in q, v, a (0), z and the parameters."""
        found, nv = self.equations.partials(blocks), self.equations.nv
        J = np.concatenate([found.Jq, found.Jv, np.zeros_like(found.Ja), found.Jz, found.P], axis=2)[:, :nv]
        solved: Array = -np.linalg.solve(found.Ja[:, :nv], J)
        return solved
