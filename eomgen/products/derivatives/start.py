"""The start of a run made linear: static equilibrium and corrections onto constraints, then accelerations, multipliers
and rates.

Rest solves r(q, v = 0, a = 0, z, lam, p) = 0, F(q, z, p) = 0 and Phi(q, p) = 0, so by the implicit function theorem

    [ K   R_z  B^T ] [ dq   ]     [ R_p   ]
    [ F_q F_z  0   ] [ dz   ] = - [ F_p   ] dp
    [ B   0    0   ] [ dlam ]     [ Phi_p ]

A state that does not meet the constraints is moved onto them by Newton's steps q o exp(-c), M c = B^T sigma, B c = Phi,
and velocities by one, M c = B^T sigma, B c = w: M and B change with the start of a step, so if c is finite,

    M dc - B^T dsigma = dB^T sigma - dM c,   B dc = dPhi - dB c.

Generalized-alpha starts with a = vdot + (alpha_m - alpha_f) h vddot, and h vddot = -3 f(0) + 4 f(1/2) - f(1), f(s)
being the accelerations at q o exp(s h (v + s h/2 vdot)), v + s h vdot, t + s h. Internal states
begin with their rates alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED
from eomgen.compiled.initial_state import InitialState
from eomgen.errors import Problem, UsageError
from eomgen.lie import product
from eomgen.products.derivatives.equations import EquationPartials, StepEquations, bordered_matrix, rows_of
from eomgen.products.derivatives.steps import STAGES, WEIGHTS
from eomgen.simulation.stepping.states import PrescribedInputs, States
from eomgen.solvers.regular_inertia import regular_inertia


@dataclass(frozen=True)
class LinearizedRest:
    """Static equilibrium made linear.

    Attributes
    ----------
    values : input blocks there
    matrix : partials of forces, rates of z and constraints in q, z and multipliers
    slopes : (nv + nz + holonomic, parameters), of q (left-trivialised), z and multipliers
    """

    values: dict[str, Array]
    matrix: Array
    slopes: Array


def at_rest(
    equations: StepEquations, state: InitialState, t: Array, prescribed: PrescribedInputs, du: Array | None
) -> LinearizedRest:
    """Return the static equilibrium at the start of a run made linear, with derivatives in the parameters.

    Parameters
    ----------
    equations, state : equations of a step, and the equilibrium
    t : (1,) s; ``prescribed``: inputs at this time change by ``du`` along the directions of inputs

    Raises
    ------
    UsageError
        Rest is undetermined along some component, or relative to moving drives.
    """
    nv, nz, nh, nl = equations.nv, equations.nz, equations.holonomic, equations.nl
    still = InitialState(state.q, np.zeros(nv), state.z)
    values = _values(equations, still, t, prescribed, du)
    moves = nl and np.any(equations.of("constraint_velocity", values)["w"])
    if moves or equations.model.evaluator.moving_base:
        fault = "the scene starts at equilibrium relative to moving drives, which has no derivatives here [E0635]"
        raise UsageError(Problem("start", fault, "initial = model.equilibrium().initial, for a start that is held"))
    if nl:
        (r,) = equations.of("residual", values).values()
        B = equations.of("constraint_jacobian", values)["B"][0]
        values["lam"] = -np.linalg.lstsq(B.T, r[0], rcond=None)[0][np.newaxis]
    result = equations.partials(values)
    # without rates of constraints, whose multipliers would leave rest to the way there
    matrix = np.concatenate([result.Jq[0], result.Jz[0], result.Jlam[0, :, :nh]], axis=1)[: nv + nz + nh]
    M = result.Ja[0, :nv]
    scale = np.concatenate([1.0 / np.sqrt(np.diagonal(M)), np.ones(nz + nh)])
    scaled = scale[:, np.newaxis] * matrix * scale
    scaled /= np.max(np.abs(scaled), axis=1, keepdims=True).clip(np.finfo(float).tiny)
    sizes, directions = np.linalg.svd(scaled)[1:]
    if nl > nh or sizes[-1] <= 1e-10 * sizes[0]:
        name = equations.model.v_names[int(np.argmax(np.abs(directions[-1, :nv])))].removeprefix("v.")
        fault = f"the scene starts at static equilibrium, which no force determines along {name} [E0636]"
        hint = f"a spring at {name}; or initial = model.equilibrium().initial, for a start that is held"
        raise UsageError(Problem("start", fault, hint))
    return LinearizedRest(values, matrix, -np.linalg.solve(matrix, result.P[0, : len(matrix)]))


def moved_positions(
    equations: StepEquations, asked: InitialState, t: Array, prescribed: PrescribedInputs, dq: Array, dp: Array
) -> Array:
    """Return the changes of positions after Newton's steps onto the constraints, (nv, n), by changes dq (nv, n) of
    requested positions and dp (parameters, n) of parameters."""
    nh, factors = equations.holonomic, equations.model.factors
    q, largest = asked.q, 0.0
    for _ in range(50):
        state = InitialState(q, np.zeros(equations.nv), asked.z)
        values = _values(equations, state, t, prescribed)
        partials = equations.partials(values)
        rows = slice(equations.nv + equations.nz, equations.nv + equations.nz + nh)
        B = partials.Jq[0, rows]
        step = _Correction.of(partials, B, equations.of("constraint", values)["Phi"][0, :nh])
        c, size = step.c, float(np.max(np.abs(step.c), initial=0.0))
        largest = max(largest, size)
        if size <= 1e-13 * max(largest, 1.0):  # later steps change no derivative
            break
        dc = step.changes(equations, values, B @ dq + partials.P[0, rows] @ dp, dq, dp)
        turns = c * [unit == "rad/s" for unit in equations.model.v_units]
        k = int(np.argmax(np.abs(turns)))
        if (turn := abs(turns[k])) > 1.0:  # steps turn by 1 rad at most
            dc, c = (dc - np.outer(c, dc[k] * np.sign(turns[k])) / turn) / turn, c / turn
        dq = product.transport(factors, -c) @ dq - product.tangent(factors, -c) @ dc
        q = product.update(factors, q, -c)
    return dq


def moved_velocities(equations: StepEquations, values: dict[str, Array], dq: Array, dv: Array, dp: Array) -> Array:
    """Return the changes (nv, n) of velocities after the step onto the constraints. dq, dv (nv, n) and dp (parameters,
    n) are changes of positions, of requested velocities and of parameters; `values` are input blocks at positions on
    the constraints, with velocities as requested."""
    nv, nl = equations.nv, equations.nl
    partials = equations.partials(values)
    rows = slice(nv + equations.nz + equations.holonomic, None)
    B = partials.Jv[0, rows]
    w = equations.of("constraint_velocity", values)["w"][0, :nl]
    change = partials.Jq[0, rows] @ dq + B @ dv + partials.P[0, rows] @ dp
    moved: Array = dv - _Correction.of(partials, B, w).changes(equations, values, change, dq, dp)
    return moved


@dataclass(frozen=True)
class _Correction:
    """A step c (nv,) onto constraints, with M c = B^T sigma and B c = off; ``matrix`` is the matrix of these
    equations, ``partials`` are of e before the step."""

    c: Array
    sigma: Array
    matrix: Array
    partials: EquationPartials

    @classmethod
    def of(cls, partials: EquationPartials, B: Array, off: Array) -> _Correction:
        """Return the step by which the rows B change by ``off``."""
        nv = B.shape[1]
        matrix = bordered_matrix(partials.Ja[0, :nv], B, -B.T)
        solution = np.linalg.solve(matrix, np.concatenate([np.zeros(nv), off]))
        return cls(solution[:nv], solution[nv:], matrix, partials)

    def changes(self, equations: StepEquations, values: dict[str, Array], of_off: Array, dq: Array, dp: Array) -> Array:
        """Return the changes (nv, n) of c by changes dq and dp of positions and parameters, and `of_off` of B c.
        ``values`` belong to accelerations and multipliers of 0. The residual is affine in accelerations and
        multipliers, and rates of constraints in velocities."""
        nv, count, partials = len(self.c), len(self.sigma), self.partials
        lam = np.zeros((1, equations.nl))
        lam[0, :count] = -self.sigma
        pushed = {**values, "a": self.c[np.newaxis], "lam": lam}
        moving = {**values, "v": values["v"] + self.c}
        first = nv + equations.nz + equations.holonomic
        rates = slice(first, first + count)
        forces = (equations.of("partials", pushed)["K"][0] - partials.Jq[0, :nv]) @ dq
        moved = (equations.of("velocity_partials", moving)["Z"][0, :count] - partials.Jq[0, rates]) @ dq
        if chosen := len(equations.chosen):  # inputs push alike with and without the step
            by_p = equations.parameter_rows(pushed, "Rp", nv)[0] - partials.P[0, :nv, :chosen]
            forces = forces + by_p @ dp[:chosen]
            by_p = equations.parameter_rows(moving, "Zp", equations.nl)[0, :count] - partials.P[0, rates, :chosen]
            moved = moved + by_p @ dp[:chosen]
        solution: Array = np.linalg.solve(self.matrix, np.concatenate([-forces, of_off - moved]))
        return solution[:nv]


def _values(
    equations: StepEquations, state: InitialState, t: Array, prescribed: PrescribedInputs, du: Array | None = None
) -> dict[str, Array]:
    a, lam = np.zeros((1, equations.nv)), np.zeros((1, equations.nl))
    return equations.values(
        States(t, state.q[np.newaxis], state.v[np.newaxis], a, lam, state.z[np.newaxis]), prescribed, du
    )


@dataclass(frozen=True)
class StateDirections:
    """Changes of a state, one column for each direction: dq (nv, n) left-trivialised, dv (nv, n), dz (nz, n), and of
    parameters, dp (np, n)."""

    dq: Array
    dv: Array
    dz: Array
    dp: Array


@dataclass(frozen=True)
class Stage:
    """A state at which the start evaluates accelerations: input blocks, partials of e, and changes. ``theta`` (nv,) is
    the increment from the start, which changes by ``dtheta``; ``forced`` has changes of accelerations, multipliers and
    rates with q, v, z and the parameters."""

    values: dict[str, Array]
    partials: EquationPartials
    along: StateDirections
    dvdot: Array
    dlam: Array
    dzdot: Array
    theta: Array
    dtheta: Array
    forced: Array

    @property
    def matrix(self) -> Array:
        """Matrix of the equations for accelerations and multipliers."""
        e, nv = self.partials, len(self.theta)
        return bordered_matrix(e.Ja[0, :nv], e.Jv[0, len(e.Jv[0]) - len(self.dlam) :])

    @property
    def row(self) -> Array:
        """Changes of q, v, vdot, z, multipliers and parameters, one column for each direction."""
        along = self.along
        return np.concatenate([along.dq, along.dv, self.dvdot, along.dz, self.dlam, along.dp])


@dataclass
class StartDerivatives:
    """Derivatives of a functional by quantities of the start, changed while the equations of the start are reversed.

    Attributes
    ----------
    q, v, vdot, a, z, zdot, lam : a is the algorithmic acceleration; of zdot and of the rates that steps carry together
    """

    q: Array
    v: Array
    vdot: Array
    a: Array
    z: Array
    zdot: Array
    lam: Array

    @classmethod
    def of(cls, state: Array, record: Array, nv: int, nz: int) -> StartDerivatives:
        """Return the derivatives by the state with which steps begin, plus the derivatives by the recorded row.

        Parameters
        ----------
        state : (4 nv + 3 nz, n) ndarray
            Derivatives by q, v, vdot, the algorithmic acceleration, z, zdot and the carried rates.
        record : (3 nv + nz + nl, n) ndarray
            Derivatives by q, v, vdot, z and the multipliers of the recorded row.
        nv, nz : int
            Numbers of velocities and of internal states.
        """
        q, v, vdot, a, z, zdot, r = np.split(state, np.cumsum([nv, nv, nv, nv, nz, nz]))
        of_q, of_v, of_vdot, of_z, of_lam = np.split(record, np.cumsum([nv, nv, nv, nz]))
        return cls(q + of_q, v + of_v, vdot + a + of_vdot, a, z + of_z, zdot + r, of_lam)


class LinearizedStart:
    """The start of a run, made linear.

    Parameters
    ----------
    run : ``LinearRun``, made linear but for the start
    share : see below

    Attributes
    ----------
    equations : of the run
    t, step : s
    q, v, z : the initial state
    share : alpha_m - alpha_f; 0 if vddot is left out
    asked : the requested initial state, before a correction onto the constraints
    """

    def __init__(self, run: Any, share: float) -> None:
        begun, grid = run.motion.start, run.run.grid
        self.equations, self.asked, self.share = run.equations, run.start.asked, share
        self.t, self.step, self._moved_inputs = grid.start, grid.step, run.moved_inputs
        self.q, self.v, self.z = begun["q"], begun["v"], begun.get("z", np.zeros(0))
        self._prescribe: Callable[..., PrescribedInputs] = run.prescribe

    def prescribed_at(self, share: float) -> PrescribedInputs:
        """Return inputs and base at a share of the first step."""
        return self._prescribe(np.array([self.t + share * self.step]), np.array([self.t + 0.5 * self.step]))

    @property
    def moved_far(self) -> bool:
        """Whether steps onto the constraints changed the requested state by more than rounding: second derivatives
        would have to follow them."""
        q = product.difference(self.equations.model.factors, self.asked.q, self.q)
        off = [np.max(np.abs(x), initial=0.0) for x in (q, self.asked.v - self.v, self.q, self.v)]
        return bool(off[0] > COMPUTED * (1.0 + off[2]) or off[1] > COMPUTED * (1.0 + off[3]))

    def tangents(self, along: StateDirections, stages: Sequence[Stage]) -> tuple[Array, Array]:
        """Return the changes, along directions, of the state of ``LinearSteps`` and of the first recorded row. The
        state has dq, dv, dvdot, da, dz, dzdot twice, the row dq, dv, dvdot, dz, dlam; `stages` as of ``stages``."""
        dvdot, dlam, dzdot = stages[0].dvdot, stages[0].dlam, stages[0].dzdot
        slope = np.zeros_like(dvdot)
        for weight, stage in zip(WEIGHTS, stages, strict=False):
            slope = slope + weight * stage.dvdot
        da = dvdot + self.share * slope
        state = np.concatenate([along.dq, along.dv, dvdot, da, along.dz, dzdot, dzdot])
        return np.ascontiguousarray(state), np.concatenate([along.dq, along.dv, dvdot, along.dz, dlam])

    def taken_back(self, stage: Stage, number: int, back: StartDerivatives) -> tuple[Array, Array, Array]:
        """Take adjoints of a stage's accelerations back to the state of the start; `back` is changed in place.

        Returns
        -------
        multipliers : (rows,) of e
        tau : (nl,) of the constraints' accelerations
        of_q : (nv,) derivatives in q of the stage
        """
        equations = self.equations
        nv, nz, nl, factors = equations.nv, equations.nz, equations.nl, equations.model.factors
        of_this, of_lam, of_zdot = self.share * WEIGHTS[number] * back.a, np.zeros(nl), np.zeros(nz)
        if number == 0:
            of_this, of_lam, of_zdot = of_this + back.vdot, back.lam, back.zdot
        solved = np.linalg.solve(stage.matrix.T, np.concatenate([of_this, of_lam]))
        multipliers = np.concatenate([solved[:nv], of_zdot, np.zeros(equations.holonomic + nl)])
        by_variables = np.concatenate([of_this, of_lam, of_zdot]) @ stage.forced
        of_q, of_v, of_z, _ = np.split(by_variables, np.cumsum([nv, nv, nz]))
        s, half = STAGES[number] * self.step, 0.5 * STAGES[number] * self.step
        of_theta = product.tangent(factors, stage.theta).T @ of_q
        back.q = back.q + product.transport(factors, stage.theta).T @ of_q
        back.v = back.v + of_v + s * of_theta
        back.z = back.z + of_z
        back.vdot = back.vdot + s * of_v + s * half * of_theta
        return multipliers, solved[nv:], of_q

    def input_derivatives(self, state: Array, record: Array) -> Array:
        """Return the derivatives, (2, nu), of state . s + record . r by the inputs at the first two rows. s is the
        state from which steps begin and r the recorded row; inputs are linear between the two rows."""
        equations = self.equations
        nv, nz = equations.nv, equations.nz
        none = StateDirections(*(np.zeros((size, 0)) for size in (nv, nv, nz, equations.parameters)))
        back = StartDerivatives.of(state, record, nv, nz)
        stages = self.stages(none)
        result = np.zeros((2, equations.model.nu))
        for number in reversed(range(len(stages))):
            multipliers, _, _ = self.taken_back(stages[number], number, back)
            by_u = -(multipliers @ equations.input_partials(stages[number].values)[0][0])
            result += np.outer([1.0 - STAGES[number], STAGES[number]], by_u)
        return result

    def stages(self, along: StateDirections) -> list[Stage]:
        """Return the states at which the start evaluates accelerations, with changes along directions. The first is the
        start itself; two more, half a step and a step ahead, if ``share`` is not 0."""
        nothing = np.zeros_like(self.v), np.zeros_like(along.dv)
        stages = [self._stage(0.0, self.q, self.v, along, *nothing)]
        vdot, dvdot = stages[0].values["a"][0], stages[0].dvdot
        for stage in STAGES[1:] if self.share else ():
            s, half = stage * self.step, 0.5 * stage * self.step
            factors = self.equations.model.factors
            theta, dtheta = s * (self.v + half * vdot), s * (along.dv + half * dvdot)
            dq = product.transport(factors, theta) @ along.dq + product.tangent(factors, theta) @ dtheta
            moved = StateDirections(dq, along.dv + s * dvdot, along.dz, along.dp)
            q, v = product.update(factors, self.q, theta), self.v + s * vdot
            stages.append(self._stage(stage, q, v, moved, theta, dtheta))
        return stages

    def _stage(self, share: float, q: Array, v: Array, along: StateDirections, theta: Array, dtheta: Array) -> Stage:
        """Return the accelerations, with changes along directions, at a state q, v that is `share` of a step ahead."""
        nv, nl = self.equations.nv, self.equations.nl
        values, partials = self._accelerate(share, q, v) if share else self.first
        forced = self.equations.forced_changes(values, partials)[0]
        moved = forced @ np.concatenate([along.dq, along.dv, along.dz, along.dp])
        dvdot, dlam, dzdot = np.split(moved, [nv, nv + nl])
        return Stage(values, partials, along, dvdot, dlam, dzdot, theta, dtheta, forced)

    @cached_property
    def first(self) -> tuple[dict[str, Array], EquationPartials]:
        """Input blocks at the start, with accelerations and multipliers, and the partials of e there."""
        return self._accelerate(0.0, self.q, self.v)

    def _accelerate(self, share: float, q: Array, v: Array) -> tuple[dict[str, Array], EquationPartials]:
        times = np.array([self.t + share * self.step])
        prescribed_and_moved = self.prescribed_at(share), self._moved_inputs(times)
        values = _values(self.equations, InitialState(q, v, self.z), times, *prescribed_and_moved)
        values = self.equations.with_accelerations(values)
        return values, self.equations.partials(values)


def on_constraints(start: LinearizedStart, along: StateDirections, inverse_inertia: Array) -> StateDirections:
    """Return directions at the start projected onto the constraints, as runs project initial states.

    The projection is the nearest change in the metric of M. With W, ``dp`` of the result has nv more rows: the changes
    of W = 1/M_ii, which follow from dq and dp.

    Parameters
    ----------
    start : the start, made linear
    along : directions before the projection
    inverse_inertia : (nv,) W; empty if there is none
    """
    equations, (values, partials) = start.equations, start.first
    dq, dv, dp = along.dq, along.dv, along.dp
    if start.moved_far:
        time_and_prescribed = np.array([start.t]), start.prescribed_at(0.0)
        dq = moved_positions(equations, start.asked, *time_and_prescribed, dq, dp)
        dq = nearest_changes(equations, partials, dq[np.newaxis], dv, dp)[0][0]
        asked = _values(equations, InitialState(start.q, start.asked.v, start.z), *time_and_prescribed)
        dv = moved_velocities(equations, asked, dq, dv, dp)
    (dq,), (dv,) = nearest_changes(equations, partials, dq[np.newaxis], dv, dp)
    if inverse_inertia.size:
        dp = np.concatenate([dp, changes_of_weights(equations, values, inverse_inertia[np.newaxis], dq, dp)[0]])
    return StateDirections(dq, dv, along.dz, dp)


def nearest_changes(
    equations: StepEquations, partials: EquationPartials, dq: Array, dv: Array, dp: Array
) -> tuple[Array, Array]:
    """Return changes of positions and velocities, (n, nv, directions) each, moved onto the constraints: the nearest in
    the metric of M. `partials` are of e at n states, `dp` changes of parameters."""
    nv, nh = equations.nv, equations.holonomic
    rows, M = slice(nv + equations.nz, None), partials.Ja[:, :nv]
    by_q, by_v, by_p = partials.Jq[:, rows], partials.Jv[:, rows], partials.P[:, rows]
    if nh:
        dq = dq - _nearest(M, by_q[:, :nh], by_q[:, :nh] @ dq + by_p[:, :nh] @ dp)
    rates = by_q[:, nh:] @ dq + by_v[:, nh:] @ dv + by_p[:, nh:] @ dp
    return dq, dv - _nearest(M, by_v[:, nh:], rates)


def _nearest(M: Array, B: Array, off: Array) -> Array:
    """Return the least x (n, nv, columns) in the metric of M with B x = off."""
    by_row = np.linalg.solve(regular_inertia(M, B, np.ones(M.shape[-1])), np.swapaxes(B, -1, -2))
    result: Array = by_row @ np.linalg.solve(B @ by_row, off)
    return result


def changes_of_weights(equations: StepEquations, values: Mapping[str, Array], W: Array, dq: Array, dp: Array) -> Array:
    """Return changes of W = 1/M_ii (n, nv) along dq and dp, (n, nv, directions), at n states with input blocks."""
    M, by_q, by_p = inertia_partials(equations, values)
    result: Array = -(W**2 * follows_inertia(W, M))[..., np.newaxis] * (by_q @ dq + by_p @ dp)
    return result


def position_weights(M: Array, angular: NDArray[np.bool_]) -> Array:
    """Return W = 1/M_ii (n, nv) for matrices M (n, nv, nv), bounded as runs bound W: inertias count at least sqrt(eps)
    times the largest one, rotations by the radius of gyration of all parts."""
    diagonal = np.diagonal(M, axis1=-2, axis2=-1)
    moments, masses = (diagonal[:, of].sum(axis=1, keepdims=True) for of in (angular, ~angular))
    both = (masses > 0.0) & (moments > 0.0)
    sizes = np.where(angular & both, np.divide(moments, masses, out=np.ones_like(masses), where=both), 1.0)
    least = np.sqrt(np.finfo(float).eps) * np.max(diagonal / sizes, axis=1, keepdims=True) * sizes
    return np.asarray(1.0 / np.maximum(diagonal, least), dtype=np.float64)


def follows_inertia(W: Array, M: Array) -> NDArray[np.bool_]:
    """Return whether each W (..., nv) is 1/M_ii of M (..., nv, nv), to single precision; else it is limited by the
    heaviest part, whose change moves positions less than half of the digits."""
    near = 1.0 - np.sqrt(np.finfo(np.float32).eps)
    result: NDArray[np.bool_] = W * np.diagonal(M, axis1=-2, axis2=-1) > near
    return result


def inertia_partials(equations: StepEquations, values: Mapping[str, Array]) -> tuple[Array, Array, Array]:
    """Return M at n states (n, nv, nv), and partials of the diagonal in q, (n, nv, nv), and in the parameters, (n, nv,
    parameters)."""
    nv, count, unit = equations.nv, len(values["t"]), np.arange(equations.nv)
    many = rows_of(values, np.repeat(np.arange(count), nv + 1))
    many["v"], many["lam"] = np.zeros_like(many["v"]), np.zeros_like(many["lam"])
    many["a"] = np.tile(np.concatenate([np.zeros((1, nv)), np.eye(nv)]), (count, 1))
    of_residual = equations.of("partials", many)
    blocks = (of_residual["M"], of_residual["K"], equations.parameter_rows(many, "Rp", nv))
    each = [block.reshape(count, nv + 1, nv, -1) for block in blocks]
    by_q, by_p = ((block[:, 1:] - block[:, :1])[:, unit, unit] for block in each[1:])
    return each[0][:, 0], by_q, np.concatenate([by_p, np.zeros((count, nv, equations.driven))], axis=2)
