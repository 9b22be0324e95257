"""Runs of time-discontinuous Galerkin methods made linear: products of each step's own derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.base.arrays import Array
from eomgen.integrators.families.family import LinearPasses
from eomgen.products.derivatives.beginning import Directions
from eomgen.products.derivatives.galerkin_steps import Driven, GalerkinSteps
from eomgen.products.derivatives.galerkin_sweeps import steps_with_memory
from eomgen.products.derivatives.linear_run import By, LinearPart, LinearRun, Start
from eomgen.products.derivatives.motion import Motion, Part
from eomgen.simulation.stepping.states import Prescribed, States


class GalerkinMotion(Motion):
    """A run whose accelerations at the starts of steps are no rows: slopes of the steps before."""

    def _taken(self, size: int, table: Array | None, record: Array) -> Array:
        status, memory = steps_with_memory(self.stepper, size, table, "vdot", record)
        self.check(status)
        return memory


@dataclass(frozen=True)
class GalerkinPart(LinearPart):
    """A part of a run made linear.

    Attributes
    ----------
    steps : between its rows
    accelerations : (rows, nv, size + parameters), of the rows, which a of the steps does not enter; None if
        no output depends on them
    """

    steps: GalerkinSteps
    accelerations: Array | None


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
        """Return changes of q, v, the accelerations and z of the start along directions, (size, directions)."""
        blocks = self.blocks(states, self.prescribed(states.t))
        moved = np.concatenate([along.dq, along.dv, np.zeros_like(along.dv), along.dz, along.dp])
        da = self.accelerations(blocks)[0] @ moved
        return np.concatenate([along.dq, along.dv, da, along.dz])

    def of_part(self, part: Part, *, apart: bool = False) -> GalerkinPart:
        """Make a part of the run linear; ``apart``: with multipliers for each node, also if nodes are the same."""
        states, given = self.states(part)
        blocks = self.blocks(states, given)
        before = States(*(array[:-1] for array in states))._replace(a=part.memory)
        at_start = Prescribed(*(None if array is None else array[:-1] for array in given))
        t, step = states.t[:-1], self.run.grid.step
        shares = self.method.nodes
        times = np.concatenate([states.t[1:] if share == shares[-1] else t + share * step for share in shares])
        steps = GalerkinSteps(
            self.equations,
            self.method,
            before,
            Driven(t, at_start, self.moved_inputs(t)),
            Driven(times, self.prescribed(times), self.moved_inputs(times)),
            step,
            apart=apart,
        )
        accelerations = self.accelerations(blocks) if self.equations.outputs_accelerate else None
        return GalerkinPart(part.first, states, blocks, steps, accelerations)

    def tangents(self, part: GalerkinPart, dp: Array, state: Array) -> Array:
        return self.rows_of(part, dp, part.steps.tangents(dp, state))

    def rows_of(self, part: GalerkinPart, dp: Array, ends: Array) -> Array:
        """Return tangents of rows, given tangents of (q, v, a, z) at the ends of steps, (steps, size, directions), a of
        the next step; accelerations of rows belong to their states."""
        result, nv = ends.copy(), self.equations.nv
        if part.accelerations is not None:
            moved = np.concatenate([result, np.broadcast_to(dp, (len(result), *dp.shape))], axis=1)
            result[:, 2 * nv : 3 * nv] = part.accelerations[1:] @ moved
        return result

    def take_back(self, part: GalerkinPart, direct: Array, state: Array, gradient: Array) -> None:
        adjoints = part.steps.adjoints(self.of_ends(part, direct, gradient), state)
        gradient += part.steps.of_parameters(*adjoints)

    def of_ends(self, part: GalerkinPart, direct: Array, gradient: Array) -> Array:
        """Return the derivatives of functionals by (q, v, a, z) at the ends of steps, with a of the next step, and add
        to the derivatives in the parameters the part through accelerations of rows."""
        if part.accelerations is None:
            return direct
        nv, size = self.equations.nv, direct.shape[1]
        taken = np.swapaxes(part.accelerations[1:], 1, 2) @ direct[:, 2 * nv : 3 * nv]
        gradient += taken[:, size:].sum(axis=0)
        own: Array = direct + taken[:, :size]
        own[:, 2 * nv : 3 * nv] = 0.0
        return own

    def accelerations(self, blocks: dict[str, Array]) -> Array:
        """Return the partials of the accelerations of rows in q, v, a (0), z and the parameters."""
        found, nv = self.equations.partials(blocks), self.equations.nv
        J = np.concatenate([found.Jq, found.Jv, np.zeros_like(found.Ja), found.Jz, found.P], axis=2)[:, :nv]
        solved: Array = -np.linalg.solve(found.Ja[:, :nv], J)
        return solved
