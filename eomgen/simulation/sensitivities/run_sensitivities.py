"""Derivatives of a run in parameters and the initial state, exact for its discrete steps: tangents and adjoints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from eomgen.arrays import Array
from eomgen.calls import checked_calls
from eomgen.compiled.initial_state import InitialState
from eomgen.simulation.sensitivities.beginning import Beginning, Directions, on_constraints
from eomgen.simulation.sensitivities.equations import Equations
from eomgen.simulation.sensitivities.functionals import Functional, Weights, read_functional
from eomgen.simulation.sensitivities.linear_steps import LinearSteps, StepMatrices
from eomgen.simulation.sensitivities.motion import Motion, Part
from eomgen.simulation.sensitivities.step_matrices import step_matrices
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import Prescribed, States, states_of
from eomgen.simulation.stepping.stepper import Stepper


@checked_calls("model.sensitivities(...), which makes one", wrt="by")
class Sensitivities:
    """Derivatives of a run's outputs, and of functionals of it.

    Attributes
    ----------
    by : what derivatives are taken by, in the order of their last axis
    """

    def __init__(
        self,
        run: Run,
        stepper: Stepper,
        state: InitialState,
        coefficients: Sequence[float],
        by: Sequence[str],
        columns: Mapping[str, Sequence[int]],
        outputs: Mapping[str, Sequence[int]],
    ) -> None:
        """Begin the run; ``coefficients``: h and those of ``LinearStep``; ``columns``: of p, q, v and z that are among
        ``by``, in this order."""
        model = run.model
        self.by = tuple(by)
        self._run, self._components = run, _counted(outputs)
        rows = [place for places in outputs.values() for place in places]
        holonomic = int(model.library.layout["sizes"]["holonomic"])
        self._equations = Equations(model, run.parameters, columns["p"], rows, holonomic)
        self._coefficients = tuple(coefficients)
        sizes = model.functions.sizes
        self._linear = LinearSteps(sizes, model.factors, self._coefficients, holonomic)
        self._motion = Motion(run, stepper, state)
        start = self._motion.start
        self._inverse_inertia = start.get("inverse_inertia", np.zeros(0)) if holonomic else np.zeros(0)
        self._along, self._state, self._record = self._begun(columns)

    def __repr__(self) -> str:
        return f"<Sensitivities of {self._run.model.name} by {', '.join(self.by)}: {self._motion.steps} steps>"

    # -- tangents ------------------------------------------------------------------------------------------------------

    @property
    def t(self) -> Array:
        """Times of the rows, (n,), s."""
        return self._tables[0]

    @property
    def outputs(self) -> dict[str, Array]:
        """Outputs at the rows, (n,), or (n, size) of those with several components."""
        return self._by_output(self._tables[1])

    @property
    def derivatives(self) -> dict[str, Array]:
        """Their derivatives, (n, directions), or (n, size, directions), in the order of ``by``."""
        return self._by_output(self._tables[2])

    @cached_property
    def _tables(self) -> tuple[Array, Array, Array]:
        """Times, outputs (n, outputs) and derivatives (n, outputs, directions), by tangents."""
        state, every = self._state.copy(), self._run.every
        times, values, derivatives = [], [], []
        record = self._record[np.newaxis]
        for part in self._motion.forwards():
            states, given = self._states(part)
            matrices, blocks = self._matrices(part, states, given)
            found = self._linear.tangents(matrices, self._along.dp, state, states.t[1:])
            record = np.concatenate([record, found])
            chosen = np.flatnonzero((part.first + np.arange(len(states.t))) % every == 0)
            chosen = chosen[chosen > 0] if part.first else chosen
            at_rows = {name: array if name == "p" else array[chosen] for name, array in blocks.items()}
            Y, Yp = self._equations.output_partials(at_rows)
            times.append(states.t[chosen])
            values.append(self._equations.output_values(at_rows))
            dp = self._along.dp[: len(self._equations.chosen)]
            derivatives.append(Y @ record[chosen] + Yp @ dp)
            record = found[-1:]
        return np.concatenate(times), np.concatenate(values), np.concatenate(derivatives)

    def _by_output(self, table: Array) -> dict[str, Array]:
        return {
            name: table[:, places[0]] if len(places) == 1 else table[:, places]
            for name, places in self._components.items()
        }

    # -- adjoints ------------------------------------------------------------------------------------------------------

    def gradient(self, of: Functional) -> dict[str, float]:
        """Return the derivatives of a functional, by name of ``by``, by one adjoint run.

        Parameters
        ----------
        of : str or mapping
            ``final(output)``, ``integral(output)`` over time by the trapezoidal rule on the rows, ``mean(output)``
            over time, ``sum(output)`` over the rows of all steps, of an output or one of its components,
            ``tip[1]``; or weights of each row by output, {name: (steps + 1,) or (steps + 1, size)}.

        Raises
        ------
        UsageError
            Unknown outputs, weights of another shape.
        """
        return dict(zip(self.by, self.gradients([of])[0].tolist(), strict=True))

    def gradients(self, of: Sequence[Functional]) -> Array:
        """Return the derivatives of several functionals, (functionals, directions), by one adjoint run of all."""
        size = sum(map(len, self._components.values()))
        steps = self._motion.steps
        weights = [read_functional(one, self._components, size, steps + 1) for one in of]
        state = np.zeros((self._linear.state_size, len(weights)))
        of_parameters = np.zeros((len(self._along.dp), len(weights)))
        direct = np.zeros((1, len(self._record), len(weights)))
        for part in self._motion.backwards():
            states, given = self._states(part)
            matrices, blocks = self._matrices(part, states, given)
            direct = self._of_rows(part, blocks, weights, of_parameters)
            self._linear.adjoints(matrices, direct[1:], state, of_parameters, states.t[1:])
        first = direct[0]
        found: Array = state.T @ self._state + first.T @ self._record + of_parameters.T @ self._along.dp
        return found

    def _of_rows(self, part: Part, blocks: Mapping[str, Array], weights: Sequence[Weights], by: Array) -> Array:
        """Return what functionals take of each row, (rows, record, functionals), and add to the derivatives in
        parameters; rows that parts share count in the first part alone."""
        count, steps, step = len(part.rows), self._motion.steps, self._run.grid.step
        Y, Yp = self._equations.output_partials(blocks)
        of_outputs = np.stack([one.of_rows(part.first, count, steps, step) for one in weights], axis=2)
        own = of_outputs[0 if part.first == 0 else 1 :]
        by[: Yp.shape[2]] += np.einsum("nop,nof->pf", Yp[-len(own) :], own)
        found: Array = np.swapaxes(Y, 1, 2) @ of_outputs
        return found

    # -- parts of the run ----------------------------------------------------------------------------------------------

    def _begun(self, columns: Mapping[str, Sequence[int]]) -> tuple[Directions, Array, Array]:
        """Return the directions at the start, and what the steps begin with along them."""
        equations, start, run = self._equations, self._motion.start, self._run
        count, sizes = len(self.by), {"q": equations.nv, "v": equations.nv, "z": equations.nz}
        offsets = np.cumsum([0, *(len(columns[name]) for name in "pqvz")])
        changes = {}
        for offset, name in zip(offsets[1:], sizes, strict=False):
            changes[name] = np.zeros((sizes[name], count))
            changes[name][list(columns[name]), offset + np.arange(len(columns[name]))] = 1.0
        dp = np.eye(len(columns["p"]), count)
        along = Directions(changes["q"], changes["v"], changes["z"], dp)
        z = start.get("z", np.zeros(0))
        _, alpha_m, alpha_f, *_ = self._coefficients
        share = alpha_m - alpha_f if np.any(start["a"] != start["vdot"]) else 0.0
        beginning = Beginning(
            equations, run.grid.start, run.grid.step, start["q"], start["v"], z, self._prescribed_at, share
        )
        if equations.nl:
            along = on_constraints(beginning, along, self._inverse_inertia)
        of_equations = Directions(along.dq, along.dv, along.dz, along.dp[: len(columns["p"])])
        return (along, *beginning.tangents(of_equations))

    def _prescribed_at(self, share: float) -> Prescribed:
        """Return inputs and base at a share of the first step: rows of inputs are linear in between."""
        run, equations = self._run, self._equations
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
        model = self._run.model
        return model.base(t, parameters=self._equations.p) if model.evaluator.moving_base else None

    def _states(self, part: Part) -> tuple[States, Prescribed]:
        model = self._run.model
        states = states_of(part.rows, model)
        u = None
        if model.nu and self._run.takes_rows:
            u = self._run.signals.rows(states.t)
        elif model.nu:
            u = model.input_values(states.t, parameters=self._equations.p)
        return states, Prescribed(u, self._base(states.t))

    def _matrices(self, part: Part, states: States, given: Prescribed) -> tuple[StepMatrices, dict[str, Array]]:
        """Return the matrices of the steps of a part, and input blocks at all its rows."""
        blocks = self._equations.values(states, given)
        behind = {name: array if name == "p" else array[1:] for name, array in blocks.items()}
        partials = self._equations.partials(behind)
        return (
            step_matrices(self._equations, partials, states, given, part.a, self._coefficients, self._inverse_inertia),
            blocks,
        )


def _counted(outputs: Mapping[str, Sequence[int]]) -> dict[str, list[int]]:
    """Return the places of outputs' components among those that are chosen."""
    found: dict[str, list[int]] = {}
    count = 0
    for name, places in outputs.items():
        found[name] = list(range(count, count + len(places)))
        count += len(places)
    return found
