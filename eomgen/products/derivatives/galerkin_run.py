"""Runs of time-discontinuous Galerkin methods made linear: derivatives of each step, and their products along a run.

Time-discontinuous Galerkin steps made linear: the change of a step with its start, and adjoints of its end.

A step is not the limit of an iteration but a fixed number of passes (``integrators.families.discontinuous_galerkin``),
so the derivatives of a step are the derivatives of the passes. Each correction solves, with the partials at the start,

    M d_v + gain (K T s + C d_v + R_z d_z) = b,   d_z - gain dF/d(q, v, z) . d = b_z,   s = b_theta + gain d_v,

whose left side is e' x for x = (gain T s, gain d_v, d_v, gain d_z) in (q, v, a, z). It changes by e''[x, .] with the
start, which ``second_partials`` gives: for tangents row by row, for adjoints contracted with multipliers.
The equations are evaluated at the nodes of all steps side by side, one pass after the other; operations in between and
the sweeps are C (``galerkin_sweeps``). Increments may be imaginary: all of it is analytic.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.integrators.families.family import LinearPasses
from eomgen.lie import numeric, product
from eomgen.lie.groups import Group, group_named
from eomgen.lie.numeric import tangent_along
from eomgen.lie.product import Factor
from eomgen.products.derivatives.equations import Equations
from eomgen.products.derivatives.galerkin_sweeps import Curvature, GalerkinSweeps, steps_with_memory
from eomgen.products.derivatives.linear_run import DerivativeVariables, LinearPart, LinearRun, Start
from eomgen.products.derivatives.motion import ReplayedRun, RunSegment
from eomgen.products.derivatives.start import StateDirections
from eomgen.simulation.stepping.states import PrescribedInputs, States


class DrivingInputs(NamedTuple):
    """Times (n,), inputs and base there, and changes of inputs along directions."""

    t: Array
    given: PrescribedInputs
    du: Array | None


class GalerkinSteps:
    """Steps from states at (n,) rows.

    Parameters
    ----------
    states : at the starts; with the accelerations at the start of the steps
    at_start : (n,)
    at_nodes : (nodes n,), node by node
    step : s
    apart : whether all nodes of the first pass are evaluated, even if equal
    """

    def __init__(
        self,
        equations: Equations,
        method: LinearPasses,
        states: States,
        at_start: DrivingInputs,
        at_nodes: DrivingInputs,
        step: float,
        *,
        apart: bool = False,
    ) -> None:
        self.equations, self.method, self.step, self.start, self.nodes = equations, method, step, states, at_nodes
        self.factors, self.nv, self.nz = equations.model.factors, equations.nv, equations.nz
        self.gain, self.steps = method.gamma * step, len(states.t)
        self.turning = [factor for factor in self.factors if factor.group != "R"]
        count = len(method.nodes)
        first = count if apart or self._nodes_differ() else 1
        sizes = self.nv, self.nz, equations.parameters
        self.sweeps = GalerkinSweeps(method, self.factors, sizes, self.steps, step, first, equations.dtype)
        self.values = equations.values(states, at_start.given, at_start.du)
        partials = equations.partials(self.values, parameters=False)
        self.Jq = partials.Jq
        T0 = self._blocks(numeric.tangent, self.gain * states.v)
        self.sweeps.begin(states.t, Jq0=partials.Jq, Jv0=partials.Jv, Ja0=partials.Ja, Jz0=partials.Jz, T0=T0)
        self.before = np.zeros((self.sweeps.pairs, self.steps, self.nv), equations.dtype)
        self._at: list[tuple[int, States]] = []  # points of the passes: how many nodes, and the states there
        self._places: list[tuple[Array, Array | None]] = []  # theta and v of the nodes of later passes, then of the end
        self._take_passes(first)
        self._hand_over_rotations()

    def _nodes_differ(self) -> bool:
        """Return whether the equations of the nodes of a step differ at one state: by time, or by inputs and base."""
        driven_by, nodes = self.equations.driven_by, self.nodes
        if driven_by & {"t", "base"}:
            return True
        arrays = [array for array in (nodes.given.u, nodes.du) if array is not None and "u" in driven_by]
        return any(np.any(array.reshape(-1, self.steps, *array.shape[1:]) != array[: self.steps]) for array in arrays)

    # -- the passes ----------------------------------------------------------------------------------------------------

    def _take_passes(self, first: int) -> None:
        start, nv, nz, n = self.start, self.nv, self.nz, self.steps
        count, dtype, sweeps = len(self.method.nodes), self.equations.dtype, self.sweeps
        theta, w, y = (np.zeros((count, n, size), dtype) for size in (nv, nv, nz))
        changes = theta, w, y
        derivative = np.array(self.method.derivative) / self.step
        for number in range(self.method.passes):
            if number == 0:
                still = np.broadcast_to(start.q, (first, *start.q.shape)), start.v[np.newaxis], start.z[np.newaxis]
                e = self._equations(first, *still, np.zeros((first, n, nv), dtype))
                sweeps.correct(0, -e, np.ascontiguousarray(start.v, dtype), changes, self.before)
                continue
            v, z, a = start.v + w, start.z + y, np.einsum("ij,jnk->ink", derivative, w)
            q = self._moved(theta)
            self._places.append((theta.copy(), v))
            rates = self._rates(theta, v)
            e = self._equations(count, q, v, z, a)
            if self.method.refined:
                missing = np.ascontiguousarray(e[:, :, :nv])
                sweeps.refine(number, missing, a, self.before)
                e = self._equations(count, q, v, z, a)
                e[:, :, :nv] += missing
            sweeps.correct(number, -e, rates, changes, self.before)
        self._places.append((theta[-1:], None))

    def _equations(self, count: int, q: Array, v: Array, z: Array, a: Array) -> Array:
        """Return e at ``count`` nodes of all steps, (count, n, rows), and record the states."""
        shape, rows = (count, self.steps), count * self.steps

        def flat(x: Array) -> Array:
            many = np.array(np.broadcast_to(x, (*shape, x.shape[-1])), self.equations.dtype)
            return many.reshape(rows, x.shape[-1])

        none = np.zeros((rows, 0))
        states = States(self.nodes.t[:rows], flat(q), flat(v), flat(a), none, flat(z))
        self._at.append((count, states))
        return self.equations.residuals(self._values(count, states)).reshape(*shape, -1)

    def _values(self, count: int, states: States) -> dict[str, Array]:
        rows = count * self.steps
        given = PrescribedInputs(*(None if array is None else array[:rows] for array in self.nodes.given))
        return self.equations.values(states, given, None if self.nodes.du is None else self.nodes.du[:rows])

    def _moved(self, theta: Array) -> Array:
        q = self.start.q
        if not self.turning:
            return np.asarray(q + theta)
        return product.update(self.factors, np.broadcast_to(q, (*theta.shape[:-1], q.shape[-1])), theta)

    def _rates(self, theta: Array, v: Array) -> Array:
        """Return T^-1 of theta times v."""
        result = np.array(v, self.equations.dtype)
        for factor in self.turning:
            matrix = numeric.tangent_inverse(_group(factor), theta[..., factor.v])
            result[..., factor.v] = np.einsum("...ij,...j->...i", matrix, v[..., factor.v])
        return result

    # -- linear part -------------------------------------------------------------------------------------------------

    @property
    def shares(self) -> list[float]:
        """Places of the nodes in a step."""
        return [share for count, _ in self._at for share in self.method.nodes[:count]]

    @cached_property
    def points(self) -> dict[str, Array]:
        """Input blocks of the equations at all points, (points n, ...)."""
        states = States(*(np.concatenate(parts) for parts in zip(*(states for _, states in self._at), strict=True)))
        counts = [count for count, _ in self._at]

        def repeated(array: Array | None) -> Array | None:
            return None if array is None else np.concatenate([array[: count * self.steps] for count in counts])

        given = PrescribedInputs(*map(repeated, self.nodes.given))
        return self.equations.values(states, given, repeated(self.nodes.du))

    @cached_property
    def P(self) -> Array:
        """Partials in the parameters at the points, (points, n, rows, parameters); all partials are handed over."""
        result = self.equations.partials(self.points)
        self.sweeps.linear(Jq=result.Jq, Jv=result.Jv, Ja=result.Ja, Jz=result.Jz, P=result.P)
        return result.P.reshape(self.sweeps.points, self.steps, self.nv + self.nz, -1)

    def tangents(self, dp: Array, state: Array) -> Array:
        """Take tangents through the steps: ``state`` (size, directions) of (q, v, a, z) becomes the tangent at the end
        of the steps, with a of the next step.

        Parameters
        ----------
        dp : (parameters, directions)

        Returns
        -------
        (steps, size, directions)
        """
        _ = self.P  # hands the partials over to the sweeps, once
        return self.sweeps.tangents(dp, self.equations.along_directions(dp, self.values), state, self._curvature)

    def adjoints(self, direct: Array, state: Array) -> tuple[Array, Array]:
        """Take adjoints back through the steps: ``state`` (size, functionals) becomes the adjoint at the start of the
        steps.

        Parameters
        ----------
        direct : (steps, size, functionals), derivatives of functionals by the ends of steps

        Returns
        -------
        multipliers : (points, steps, rows, functionals)
            Of the equations at the points.
        rest : (steps, size, functionals)
            Parts of parameters and inputs in second derivatives at the starts, in the order of ``second_partials``.
        """
        _ = self.P  # hands the partials over to the sweeps, once
        return self.sweeps.adjoints(direct, state, self._curvature)

    def of_parameters(self, multipliers: Array, rest: Array) -> Array:
        """Return the derivatives in the parameters from the result of ``adjoints``, (parameters, functionals)."""
        count = multipliers.shape[-1]
        P = self.P.reshape(-1, self.P.shape[-1])
        result: Array = self.equations.of_directions(rest, self.values).sum(axis=0) + P.T @ multipliers.reshape(
            -1, count
        )
        return result

    @property
    def _curvature(self) -> Curvature:
        return Curvature(self.equations.second_functions, self.values)

    # -- rotations -----------------------------------------------------------------------------------------------------

    def _hand_over_rotations(self) -> None:
        """Hand over A, T, T^-1 and the partials of T^-1 at the nodes of later passes and at the end, and of T_0."""
        theta = np.concatenate([theta for theta, _ in self._places])
        v = np.concatenate([np.zeros((0, self.steps, self.nv)), *(v for _, v in self._places if v is not None)])
        nodes = theta[: len(v)]
        T0 = self._along(self.gain * self.start.v, self.before, inverse=False)
        self.sweeps.linear(
            A=self._blocks(lambda group, x: numeric.adjoint(group, numeric.exp(group, -x)), theta),
            T=self._blocks(numeric.tangent, theta),
            rate=self._blocks(numeric.tangent_inverse, nodes),
            rate_along=self._along(nodes, v, inverse=True),
            T0_along=self.gain * T0,
        )

    def _blocks(self, of_group: object, x: Array) -> Array:
        """Return matrices of the rotating factors at x (..., nv), concatenated, (..., numbers)."""
        result = [np.zeros((*x.shape[:-1], 0), self.equations.dtype)]
        for factor in self.turning:
            matrix = of_group(_group(factor), x[..., factor.v])  # type: ignore[operator]
            result.append(matrix.reshape(*x.shape[:-1], -1))
        return np.concatenate(result, axis=-1)

    def _along(self, theta: Array, x: Array, *, inverse: bool) -> Array:
        """Return partials in theta of T, or of T^-1, times x of the rotating factors, in the form of ``_blocks``."""
        result = [np.zeros((*x.shape[:-1], 0), self.equations.dtype)]
        for factor in self.turning:
            size = factor.v_size
            matrix = np.empty((*x.shape[:-1], size, size), self.equations.dtype)
            for k, unit in enumerate(np.eye(size)):
                change = tangent_along(_group(factor), theta[..., factor.v], unit, inverse=inverse)
                matrix[..., k] = np.einsum("...ij,...j->...i", change, x[..., factor.v])
            result.append(matrix.reshape(*x.shape[:-1], -1))
        return np.concatenate(result, axis=-1)


def _group(factor: Factor) -> Group:
    return group_named(factor.group, factor.v_size)


class GalerkinMotion(ReplayedRun):
    """A run whose accelerations at the starts of steps are not rows: slopes of the steps before."""

    def _taken(self, size: int, table: Array | None, record: Array) -> Array:
        status, memory = steps_with_memory(self.stepper, size, table, "vdot", record)
        self.check(status)
        return memory


@dataclass(frozen=True)
class GalerkinPart(LinearPart):
    """A part of a run made linear.

    Attributes
    ----------
    steps : between the rows of the part
    accelerations : (rows, nv, size + parameters), of the rows, which a of the steps does not enter; None if
        no output depends on them
    """

    steps: GalerkinSteps
    accelerations: Array | None


class GalerkinRun(LinearRun[GalerkinPart]):
    """A run of a time-discontinuous Galerkin method with linearised steps."""

    def __init__(
        self, motion: ReplayedRun, method: LinearPasses, start: Start, by: DerivativeVariables, rows: Sequence[int]
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

    def begun(self, states: States, along: StateDirections) -> Array:
        """Return changes of q, v, the accelerations and z of the start along directions, (size, directions)."""
        blocks = self.blocks(states, self.prescribed(states.t))
        moved = np.concatenate([along.dq, along.dv, np.zeros_like(along.dv), along.dz, along.dp])
        da = self.accelerations(blocks)[0] @ moved
        return np.concatenate([along.dq, along.dv, da, along.dz])

    def of_part(self, part: RunSegment, *, apart: bool = False) -> GalerkinPart:
        """Make a part of the run linear; ``apart``: with multipliers for each node, also if nodes are the same."""
        states, given = self.states(part)
        blocks = self.blocks(states, given)
        before = States(*(array[:-1] for array in states))._replace(a=part.memory)
        at_start = PrescribedInputs(*(None if array is None else array[:-1] for array in given))
        t, step = states.t[:-1], self.run.grid.step
        shares = self.method.nodes
        times = np.concatenate([states.t[1:] if share == shares[-1] else t + share * step for share in shares])
        steps = GalerkinSteps(
            self.equations,
            self.method,
            before,
            DrivingInputs(t, at_start, self.moved_inputs(t)),
            DrivingInputs(times, self.prescribed(times), self.moved_inputs(times)),
            step,
            apart=apart,
        )
        accelerations = self.accelerations(blocks) if self.equations.outputs_accelerate else None
        return GalerkinPart(part.first, states, blocks, steps, accelerations)

    def tangents(self, part: GalerkinPart, dp: Array, state: Array) -> Array:
        return self.rows_of(part, dp, part.steps.tangents(dp, state))

    def rows_of(self, part: GalerkinPart, dp: Array, ends: Array) -> Array:
        """Return tangents of the rows at the ends of steps.

        Parameters
        ----------
        dp : (parameters, directions)
        ends : (steps, size, directions), tangents of (q, v, a, z), in which a starts the next step

        Returns
        -------
        (steps, size, directions), with a replaced by the acceleration that follows from q, v, z and dp, if outputs
        read accelerations
        """
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
        partials, nv = self.equations.partials(blocks), self.equations.nv
        J = np.concatenate([partials.Jq, partials.Jv, np.zeros_like(partials.Ja), partials.Jz, partials.P], axis=2)
        solved: Array = -np.linalg.solve(partials.Ja[:, :nv], J[:, :nv])
        return solved
