"""Derivatives of a run in parameters, inputs and the initial state, exact for the discrete steps: tangents and
adjoints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedResults, checked_calls
from eomgen.base.messages import shown
from eomgen.compiled.arguments import numbers
from eomgen.errors import Problem, UsageError
from eomgen.products.derivatives import second_order
from eomgen.products.derivatives.alpha_run import AlphaRun
from eomgen.products.derivatives.equations import rows_of
from eomgen.products.derivatives.functionals import Functional, RowWeights, consecutive, read_functional
from eomgen.products.derivatives.linear_run import LinearRun, RunAdjoint, undefined_derivatives
from eomgen.products.derivatives.start import StateDirections, at_rest, on_constraints
from eomgen.products.derivatives.stationary_run import StationaryRun
from eomgen.products.derivatives.transition_run import TransitionRun


def input_derivatives(run: AlphaRun, weights: RowWeights) -> Array:
    """Return derivatives of a functional in the inputs at the rows, (steps + 1, nu), by one adjoint run.

    A step takes inputs at the end of the step, an output at the row, and the start within the first step, between two
    rows.

    Raises
    ------
    UsageError
        The rest from which the run starts is undetermined.
    """
    result = np.zeros((run.motion.steps + 1, run.run.model.nu))
    adjoint = RunAdjoint.of(run, 1)
    for part in map(run.linearise_part, run.motion.backwards()):
        multipliers, _, of_outputs = second_order.take_back(run, part, [weights], adjoint)
        by_u, outputs_by_u = run.equations.input_partials(part.blocks)
        first = 0 if part.first == 0 else 1
        rows = slice(part.first + first, part.first + len(by_u))
        result[rows] += np.einsum("no,nou->nu", of_outputs[first:, :, 0], outputs_by_u[first:])
        result[part.first + 1 : part.first + len(by_u)] -= np.einsum("ne,neu->nu", multipliers[..., 0], by_u[1:])
    state, record, of_parameters = adjoint.state[:, 0], adjoint.record[:, 0], adjoint.parameters[:, 0]
    result[:2] += run.beginning.input_derivatives(state, record)
    if run.start.at_rest:
        moved = _resting(run)
        along = on_constraints(run.beginning, moved, run.inverse_inertia) if run.run.model.multipliers else moved
        of_equations = run.equation_directions(along)
        begun, row = run.beginning.tangents(of_equations, run.beginning.stages(of_equations))
        result[0] += begun.T @ state + row.T @ record + along.dp.T @ of_parameters
    return result


def _resting(run: AlphaRun) -> StateDirections:
    """Return the changes of the static equilibrium from which a run starts by the inputs at the first row. One
    direction for each input; velocities and parameters do not change."""
    equations, rest = run.equations, run.rest
    if rest is None:
        t = np.array([run.run.grid.start])
        rest = at_rest(equations, run.start.asked, t, run.prescribe(t), run.moved_inputs(t))
    nv, nz, nu = equations.nv, equations.nz, run.run.model.nu
    by_u, _ = equations.input_partials(rest.values)
    slopes = -np.linalg.solve(rest.matrix, by_u[0, : len(rest.matrix)])
    dq, dz, _ = np.split(slopes, np.cumsum([nv, nz]))
    return StateDirections(dq, np.zeros((nv, nu)), dz, np.zeros((equations.parameters, nu)))


@checked_calls("model.sensitivities(...), which makes one", wrt="by")
class Sensitivities:
    """Derivatives of a run's outputs, and of functionals of the outputs.

    Parameters
    ----------
    run : LinearRun
        The run with its linear steps, of ``model.sensitivities``.
    by : sequence of str
        Variables of the derivatives, as of ``model.sensitivities``.
    outputs : mapping
        Places of each output's components among all, by name.

    Attributes
    ----------
    by : variables of derivatives, in the order of the last axis
    """

    def __init__(self, run: LinearRun[Any], by: Sequence[str], outputs: Mapping[str, Sequence[int]]) -> None:
        """Begin; ``outputs``: places of the components of each among the outputs with derivatives."""
        self.by = tuple(by)
        self._components = consecutive({name: len(places) for name, places in outputs.items()})
        self._run = run
        self._known: tuple[tuple[Functional, ...], second_order.Gradients] | None = None

    def __repr__(self) -> str:
        return f"<Sensitivities of {self._run.run.model.name} by {', '.join(self.by)}: {self._run.motion.steps} steps>"

    # -- tangents ------------------------------------------------------------------------------------------------------

    @property
    def t(self) -> Array:
        """Times of the rows, (n,), s."""
        return self._rows[0]

    @property
    def outputs(self) -> dict[str, Array]:
        """Outputs at the rows, (n,), or (n, size) for several components."""
        return self._by_output(self._rows[1])

    @property
    def derivatives(self) -> dict[str, Array]:
        """Derivatives of outputs, (n, directions), or (n, size, directions), in the order of ``by``."""
        return self._by_output(self._tables)

    @cached_property
    def _rows(self) -> tuple[Array, Array]:
        """Times (n,) and chosen outputs (n, outputs) of the recorded rows, which need no tangents."""
        run, times, values = self._run, [], []
        for part in run.motion.forwards():
            t, blocks = run.values(part)
            chosen = self._chosen(part.first, len(t))
            times.append(t[chosen])
            values.append(run.equations.output_values(rows_of(blocks, chosen)))
        return np.concatenate(times), np.concatenate(values)

    def _chosen(self, first: int, count: int) -> NDArray[np.intp]:
        """Return the recorded rows of a part; the first row is the last row of the previous part."""
        chosen = np.flatnonzero((first + np.arange(count)) % self._run.run.every == 0)
        return chosen[chosen > 0] if first else chosen

    @cached_property
    def _tables(self) -> Array:
        """Derivatives (n, outputs, directions) of the chosen outputs at the recorded rows, by tangents."""
        run, equations = self._run, self._run.equations
        state, record = run.state.copy(), run.record[np.newaxis]
        derivatives = []
        for part in map(run.linearise_part, run.motion.forwards()):
            later = run.tangents(part, run.along.dp, state)
            record = np.concatenate([record, later])
            chosen = self._chosen(part.first, len(part.states.t))
            Y, Yp = equations.output_partials(rows_of(part.blocks, chosen))
            derivatives.append(Y @ record[chosen] + np.tensordot(Yp, run.along.dp[: equations.parameters], 1))
            record = later[-1:]
        return self._finite(np.concatenate(derivatives))

    def _by_output(self, table: Array) -> dict[str, Array]:
        of = {name: table[:, k[0]] if len(k) == 1 else table[:, k] for name, k in self._components.items()}
        return NamedResults("output", of)

    # -- adjoints ------------------------------------------------------------------------------------------------------

    def gradient(self, of: Functional) -> dict[str, float]:
        """Return the derivatives of a functional, by name of ``by``, by one adjoint run.

        Parameters
        ----------
        of : str or mapping
            ``final(output)``, ``integral(output)`` over time by the trapezoidal rule on the rows, ``mean(output)``
            over time, ``sum(output)`` over the rows of all steps, of an output or one of its components,
            ``tip[1]``; or weights by output of each recorded row, or of the rows of all steps, {name: (rows,) or
            (rows, size)}.

        Returns
        -------
        dict
            Derivatives by name of ``by``, in the functional's unit per unit of the variable.

        Raises
        ------
        UsageError
            Unknown outputs, weights of another shape.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> result = model.sensitivities(0.1, 1e-3, by=["m2", "q.shoulder"], of=["energy"])
        >>> sorted(result.gradient("final(energy)"))
        ['m2', 'q.shoulder']
        """
        return dict(zip(self.by, self.gradients([of])[0].tolist(), strict=True))

    def gradients(self, of: Sequence[Functional]) -> Array:
        """Return the derivatives of several functionals by one adjoint run of all.

        Parameters
        ----------
        of : sequence of str or mapping
            Functionals, as of ``gradient``: ``final``, ``integral``, ``mean`` or ``sum`` of an output, or weights of
            the rows by output; of the outputs that ``model.sensitivities`` was called for.

        Returns
        -------
        (functionals, directions) ndarray
            In the order of ``of`` and of the attribute ``by`` (parameters, then q, v, z of the start, then inputs), in
            the functional's unit per unit of the variable.

        Raises
        ------
        UsageError
            As of ``gradient``; a single text, or an empty list.
        NumericalError
            Derivatives that are not finite.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> result = model.sensitivities(0.1, 1e-3, by=["m2"], of=["energy"])
        >>> result.gradients(["final(energy)", "mean(energy)"]).shape
        (2, 1)
        """
        known = second_order.gradients(self._run, self._weights(of))
        self._known = (tuple(of), known) if all(isinstance(name, str) for name in of) else None
        return self._finite(known.values)

    # -- second derivatives --------------------------------------------------------------------------------------------

    def hessian(self, of: Functional) -> Array:
        """Return the second derivatives of a functional, (directions, directions), in the order of ``by``.

        Parameters
        ----------
        of : str or mapping
            A functional, as of ``gradient``.

        Returns
        -------
        (directions, directions) ndarray
            Symmetric, in the order of ``by``.

        Raises
        ------
        UsageError
            As of ``gradient``; steps of ``rattlie``, ``rk4`` or ``rk4_partitioned``; sampled states or events; an
            initial state that depends on parameters of ``by``, or that is moved onto constraints.
        NumericalError
            Derivatives that are not finite.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> result = model.sensitivities(0.1, 1e-3, by=["m2"], of=["energy"])
        >>> result.hessian("final(energy)").shape
        (1, 1)
        """
        result: Array = self.hessians([of])[0]
        return result

    def hessians(self, of: Sequence[Functional]) -> Array:
        """Return the second derivatives of several functionals.

        By tangents along all directions and one adjoint of each functional.

        Parameters
        ----------
        of : sequence of str or mapping
            Functionals, as of ``gradient``.

        Returns
        -------
        (functionals, directions, directions) ndarray
            Symmetric in the last two axes.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> result = model.sensitivities(0.1, 1e-3, by=["m2"], of=["energy"])
        >>> result.hessians(["final(energy)", "mean(energy)"]).shape
        (2, 1, 1)
        """
        return self.expansions(of)[1]

    def expansions(self, of: Sequence[Functional]) -> tuple[Array, Array]:
        """Return the gradients and the second derivatives of several functionals.

        Both come from the same adjoints: from the preceding call of ``gradients`` with the same functionals, all texts,
        if the run keeps rows (``keeps_adjoints``), else from one adjoint of each functional.

        Parameters
        ----------
        of : sequence of str or mapping
            Functionals, as of ``gradient``.

        Returns
        -------
        gradients : (functionals, directions) ndarray
            First derivatives, in the order of ``of`` and of the attribute ``by``: parameters, then q, v, z of the
            start, then inputs.
        hessians : (functionals, directions, directions) ndarray
            Second derivatives, symmetric in the last two axes.

        Raises
        ------
        UsageError
            As of ``hessian``; a single text, or an empty list.
        NumericalError
            Derivatives that are not finite.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> result = model.sensitivities(0.1, 1e-3, by=["m2"], of=["energy"])
        >>> gradients, hessians = result.expansions(["final(energy)"])
        >>> gradients.shape, hessians.shape
        ((1, 1), (1, 1, 1))
        """
        run = self._twice("hessian")
        known = self._known[1] if self._known is not None and self._known[0] == tuple(of) else None
        slopes, bends = second_order.hessians(run, self._weights(of), known)
        return self._finite(slopes), self._finite(bends)

    @property
    def keeps_adjoints(self) -> bool:
        """Whether the run is short enough to keep all rows, and the adjoints of functionals."""
        return self._run.motion.kept

    def stationary(self, of: Sequence[str]) -> StationaryRun | None:
        """Return derivatives of outputs at the rows of all steps of a run with a constant state, by one adjoint run per
        output.

        Parameters
        ----------
        of : sequence of str
            Outputs that ``model.sensitivities`` was called for, or components of these, ``tip[1]``.

        Returns
        -------
        StationaryRun or None
            With arrays: times ``t``, ``outputs`` (rows, outputs in the order of ``of``) and ``gradients`` (rows,
            outputs, parameters in the order of ``by``); ``hessian(number, row)`` gives second derivatives (parameters,
            parameters) by the numbers of output and row. None if the state changes in the run, or starts from values
            that depend on parameters of ``by``; if the equations linearised in the state change with time; if ``by``
            has other variables than parameters; for constraints, rotations other than angles, methods and jumps that
            ``hessian`` refuses, and very many rows.

        Raises
        ------
        UsageError
            Unknown outputs, outputs of several components, a single text, or an empty list.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> result = model.sensitivities(0.1, 1e-3, by=["m2"], of=["energy"])
        >>> result.stationary(["energy"]) is None          # the support shakes
        True
        """
        if isinstance(of, str):
            raise UsageError(Problem("of", f"a list of outputs is needed, not the text {of!r} [E0624]", f'["{of}"]'))
        weights = self._weights([f"final({name})" for name in of])
        if not isinstance(self._run, AlphaRun) or self._run.follows or self._run.samples:
            return None
        return StationaryRun.of(self._run, weights)

    def hessian_products(self, of: Functional, directions: ArrayLike) -> Array:
        """Multiply the Hessian of a functional by vectors: one tangent and one second-order adjoint per vector, for any
        number of variables.

        Parameters
        ----------
        of : str or mapping
            A functional, as of ``gradient``.
        directions : array_like
            One vector (len(by),), or vectors (len(by), vectors) as columns, in the order of the attribute ``by``:
            parameters, then q, v, z of the start, then inputs.

        Returns
        -------
        (len(by),) or (len(by), vectors) ndarray
            The Hessian times each vector, in the shape of ``directions``.

        Raises
        ------
        UsageError
            As of ``hessian``; vectors of another length, or not finite.
        NumericalError
            Derivatives that are not finite.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> result = model.sensitivities(0.1, 1e-3, by=["m2", "q.shoulder"], of=["energy"])
        >>> result.hessian_products("final(energy)", [1.0, 0.0]).shape
        (2,)
        """
        (weights,) = self._weights([of])
        vectors = numbers("directions", directions)
        if vectors.ndim not in (1, 2) or len(vectors) != len(self.by) or not np.all(np.isfinite(vectors)):
            fits = vectors.ndim in (1, 2) and len(vectors) == len(self.by)
            fault = "vectors have nan [E0625]" if fits else f"vectors have the shape {vectors.shape} [E0626]"
            raise UsageError(Problem("directions", fault, f"finite numbers, ({len(self.by)},) or ({len(self.by)}, n)"))
        columns = np.ascontiguousarray(vectors.reshape(len(self.by), -1))
        run = self._twice("hessian_products")
        result = second_order.hessian_products(run, weights, columns)
        return self._finite(result.reshape(vectors.shape))

    # -- inputs -------------------------------------------------------------------------------------------------------

    def input_gradient(self, of: Functional) -> dict[str, Array]:
        """Return the derivatives of a functional in the values of inputs at the rows of all steps, by one adjoint run.

        Inputs that follow formulas of the scene are left out, except random processes and inputs given by the caller.
        Between rows inputs are linear, which affects the start. The derivative in a constant input is the sum of the
        derivatives over the rows.

        Parameters
        ----------
        of : str or mapping
            A functional, as of ``gradient``.

        Returns
        -------
        dict
            By name of the input an array (steps + 1,): one entry for the start and for each step, recorded or not; in
            the functional's unit per unit of the input.

        Raises
        ------
        UsageError
            As of ``gradient``; scenes without inputs, or whose inputs all follow formulas; steps of ``rattlie``,
            ``rk4`` or ``rk4_partitioned``; sampled states or events.
        NumericalError
            Derivatives that are not finite.

        Examples
        --------
        >>> cart = eomgen.SceneBuilder("cart").input("push", unit="N").body("cart", 2.0)
        >>> cart = cart.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0]).effort("push", "rail", "push")
        >>> cart = cart.output("place", formula="q.rail", unit="m").simulation(method="trapezoidal")
        >>> result = eomgen.build(cart.build()).sensitivities(1.0, 0.1, by=["v.rail"], inputs={"push": 1.0})
        >>> round(float(result.input_gradient("final(place)")["push"].sum()), 3)     # t^2 / (2 mass)
        0.25
        """
        run, (weights,) = self._run, self._weights([of])
        inputs = run.run.model.description.inputs
        columns = {
            item.name: number
            for number, item in enumerate(inputs)
            if not item.given or item.series is not None or item.name in run.run.signals.given
        }
        if not columns:
            fault = "all inputs follow formulas of the scene [E0627]" if inputs else "the scene has no inputs [E0595]"
            hint = f'inputs={{"{inputs[0].name if inputs else "command"}": ...}}, to give values'
            raise UsageError(Problem("input_gradient", fault, hint))
        if not isinstance(run, AlphaRun):
            jumps = "the state jumps along the run"
            why = f"steps are of {run.run.name}" if isinstance(run, TransitionRun) else jumps
            fault = f"{why}, and derivatives in all rows of inputs together are not known [E0628]"
            hint = f'by=["inputs.{next(iter(columns))}[:]"], whose gradient has a row each'
            raise UsageError(Problem("input_gradient", fault, hint))
        table = self._finite(input_derivatives(run, weights))
        return {name: table[:, column] for name, column in columns.items()}

    def _twice(self, wanted: str) -> AlphaRun:
        """Return the run if second derivatives of it are known; `wanted` is the method's name for the message. Raises
        UsageError for other methods, jumps, and initial states that depend on parameters or were moved."""
        run = self._run
        if not isinstance(run, AlphaRun):
            jumps = "the state jumps along the run, at samples or events"
            why = f"steps are of {run.run.name}" if isinstance(run, TransitionRun) else jumps
            fault = f"{why}, and second derivatives are not known [E0629]"
            raise UsageError(Problem(wanted, fault, "differences of gradient(...)"))
        if run.follows and run.start.slopes is not None:
            fault = "the initial state follows from parameters, and its second derivatives are not known [E0630]"
            raise UsageError(Problem(wanted, fault, 'initial={"q": ..., "v": ...}, for a start that is held'))
        moved = np.any(run.along.dq) or np.any(run.along.dv)
        if run.equations.nl and moved and run.beginning.moved_far:
            fault = "the initial state is moved onto the constraints, without known second derivatives [E0631]"
            hint = 'state = model.consistent(q, v), and initial={"q": state.q, "v": state.v}'
            raise UsageError(Problem(wanted, fault, hint))
        return run

    def _finite(self, derivatives: Array) -> Array:
        """Return derivatives unchanged. Raises NumericalError if any derivative is not finite."""
        if not np.isfinite(derivatives).all():
            raise undefined_derivatives(self._run.run.model, "somewhere in the run")
        return derivatives

    def _weights(self, of: Sequence[Functional]) -> list[RowWeights]:
        if isinstance(of, str) or not isinstance(of, Iterable):
            which = f"the text {of!r}" if isinstance(of, str) else shown(of)
            example = of if isinstance(of, str) else "final(angle)"
            raise UsageError(Problem("of", f"a list is needed, not {which} [E0632]", f'["{example}"]'))
        if not of:
            raise UsageError(Problem("of", "no functional is named to differentiate [E0633]", '["final(angle)"]'))
        size, steps, every = sum(map(len, self._components.values())), self._run.motion.steps, self._run.run.every
        return [read_functional(functional, self._components, size, steps, every) for functional in of]
