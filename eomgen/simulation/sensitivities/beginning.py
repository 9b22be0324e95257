"""What a run begins with beside q, v and z, made linear: accelerations, multipliers, rates.

Generalized-alpha starts with a = vdot + (alpha_m - alpha_f) h vddot, and h vddot = -3 f(0) + 4 f(1/2) - f(1), f(s)
being the accelerations at q o exp(s h (v + s h/2 vdot)), v + s h vdot, t + s h. Internal states
begin with their rates alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from eomgen.arrays import Array
from eomgen.compiled.constraints import accelerations
from eomgen.lie import product
from eomgen.simulation.sensitivities.equations import Equations, Partials
from eomgen.simulation.stepping.states import Prescribed, States

_STAGES, _WEIGHTS = (0.0, 0.5, 1.0), (-3.0, 4.0, -1.0)


@dataclass(frozen=True)
class Directions:
    """Changes of a state, one column for each direction: dq (nv, n) left-trivialised, dv (nv, n), dz (nz, n), and of
    parameters, dp (np, n)."""

    dq: Array
    dv: Array
    dz: Array
    dp: Array


@dataclass(frozen=True)
class Stage:
    """A state whose accelerations the start takes: values of input blocks, partials of e there, vdot, and changes."""

    values: dict[str, Array]
    partials: Partials
    along: Directions
    vdot: Array
    dvdot: Array
    dlam: Array
    dzdot: Array

    @property
    def row(self) -> Array:
        """Changes of q, v, vdot, z, multipliers and parameters, one column for each direction."""
        along = self.along
        return np.concatenate([along.dq, along.dv, self.dvdot, along.dz, self.dlam, along.dp])


@dataclass(frozen=True)
class Beginning:
    """The start of a run, made linear.

    Attributes
    ----------
    equations : of the run
    t, step : s
    q, v, z : the initial state
    prescribed_at : inputs and base at a share of the first step
    share : alpha_m - alpha_f; 0 where vddot is left out
    """

    equations: Equations
    t: float
    step: float
    q: Array
    v: Array
    z: Array
    prescribed_at: Callable[[float], Prescribed]
    share: float

    def tangents(self, along: Directions) -> tuple[Array, Array]:
        """Return the state of ``LinearSteps``, and the row that is recorded, along directions."""
        stages = self._stages(along)
        dvdot, dlam, dzdot = stages[0].dvdot, stages[0].dlam, stages[0].dzdot
        slope = np.zeros_like(dvdot)
        for weight, stage in zip(_WEIGHTS, stages, strict=False):
            slope = slope + weight * stage.dvdot
        da = dvdot + self.share * slope
        state = np.concatenate([along.dq, along.dv, dvdot, da, along.dz, dzdot, dzdot])
        return np.ascontiguousarray(state), np.concatenate([along.dq, along.dv, dvdot, along.dz, dlam])

    def second_derivatives(self, first: Directions, second: Directions, state: Array, record: Array) -> Array:
        """Return second derivatives along pairs of directions, (first, second), of state . the state that steps begin
        with + record . the row that is recorded; of vector coordinates without constraints."""
        nv, nz = self.equations.nv, self.equations.nz
        _, _, of_vdot, of_a, _, of_zdot, of_r = np.split(state, np.cumsum([nv, nv, nv, nv, nz, nz]))
        of_vdot = of_vdot + of_a + record[2 * nv : 3 * nv]
        of_zdot = of_zdot + of_r
        found = np.zeros((first.dq.shape[1], second.dq.shape[1]))
        pairs = list(zip(_STAGES, _WEIGHTS, self._stages(first), self._stages(second), strict=False))
        for stage, weight, one, other in reversed(pairs):
            of_this = self.share * weight * of_a + (of_vdot if stage == 0.0 else 0.0)
            mu = np.linalg.solve(one.partials.Ja[0][:nv].T, of_this)
            multipliers = np.concatenate([mu, of_zdot if stage == 0.0 else np.zeros(nz)])[np.newaxis]
            no_outputs = np.zeros((1, len(self.equations.outputs)))
            changes = self.equations.second_partials(one.values, multipliers, no_outputs, other.row[np.newaxis])
            found += one.row.T @ changes[0]
            s = stage * self.step
            by_q, by_v = (-(multipliers @ J[0])[0] for J in (one.partials.Jq, one.partials.Jv))
            of_vdot = of_vdot + s * by_v + 0.5 * s * s * by_q  # of what moved the stage
        return found

    def _stages(self, along: Directions) -> list[Stage]:
        """Return the states whose accelerations the start takes, with their changes."""
        stages = [self._stage(0.0, self.q, self.v, along)]
        vdot, dvdot = stages[0].vdot, stages[0].dvdot
        for stage in _STAGES[1:] if self.share else ():
            s, half = stage * self.step, 0.5 * stage * self.step
            factors = self.equations.model.factors
            theta = s * (self.v + half * vdot)
            dq = product.transport(factors, theta) @ along.dq
            dq = dq + product.tangent(factors, theta) @ (s * (along.dv + half * dvdot))
            moved = Directions(dq, along.dv + s * dvdot, along.dz, along.dp)
            stages.append(self._stage(stage, product.update(factors, self.q, theta), self.v + s * vdot, moved))
        return stages

    def _stage(self, share: float, q: Array, v: Array, along: Directions) -> Stage:
        """Return the accelerations at a state some share of the step ahead, with their changes."""
        equations = self.equations
        nv, nz, nl = equations.nv, equations.nz, equations.nl
        zeros = np.zeros((1, nv)), np.zeros((1, nl))
        times = np.array([self.t + share * self.step])
        given = self.prescribed_at(share)
        values = equations.values(States(times, q[None], v[None], zeros[0], zeros[1], self.z[None]), given)
        vdot, lam = self._solved(values)
        values["a"], values["lam"] = vdot[None], lam[None]
        partials = equations.partials(values)
        right = partials.Jq[0] @ along.dq + partials.Jv[0] @ along.dv + partials.Jz[0] @ along.dz
        right = right + partials.P[0] @ along.dp
        dzdot = -right[nv : nv + nz]
        M = partials.Ja[0][:nv]
        if not nl:
            dvdot = np.linalg.solve(M, -right[:nv])
            return Stage(values, partials, along, vdot, dvdot, np.zeros((0, right.shape[1])), dzdot)
        B = equations.of("constraint_jacobian", values)["B"][0]
        by_state = equations.of("acceleration_partials", values)
        below = by_state["Aq"][0] @ along.dq + by_state["Av"][0] @ along.dv
        below = below + equations.acceleration_parameters(values)[0] @ along.dp
        matrix = np.block([[M, B.T], [B, np.zeros((nl, nl))]])
        solution = np.linalg.solve(matrix, -np.concatenate([right[:nv], below]))
        return Stage(values, partials, along, vdot, solution[:nv], solution[nv:], dzdot)

    def _solved(self, values: dict[str, Array]) -> tuple[Array, Array]:
        """Return vdot and the multipliers at one state."""
        if self.equations.nl:
            vdot, lam = accelerations(self.equations.model.functions, values)
            return vdot[0], lam[0]
        (residual,) = self.equations.of("residual", values).values()
        (M,) = self.equations.of("mass", values).values()
        return np.linalg.solve(M[0], -residual[0]), np.zeros(0)


def on_constraints(start: Beginning, along: Directions, inverse_inertia: Array) -> Directions:
    """Return directions whose states stay on the constraints, moved there by the nearest change in the metric of M, as
    runs move their initial states; behind dp the changes of W = 1/M_ii, by which multipliers move positions.

    Parameters
    ----------
    inverse_inertia : (nv,) W; empty where there is none
    """
    equations = start.equations
    nv, nz, nh = equations.nv, equations.nz, equations.holonomic
    states = States(
        np.array([start.t]),
        start.q[None],
        start.v[None],
        np.zeros((1, nv)),
        np.zeros((1, equations.nl)),
        start.z[None],
    )
    values = equations.values(states, start.prescribed_at(0.0))
    partials = equations.partials(values)
    M = partials.Ja[0][:nv]
    by_q, by_v, by_p = partials.Jq[0][nv + nz :], partials.Jv[0][nv + nz :], partials.P[0][nv + nz :]
    dq = along.dq
    if nh:
        dq = dq - _nearest(M, by_q[:nh], by_q[:nh] @ dq + by_p[:nh] @ along.dp)
    rates = by_q[nh:] @ dq + by_v[nh:] @ along.dv + by_p[nh:] @ along.dp
    dv = along.dv - _nearest(M, by_v[nh:], rates)
    if not inverse_inertia.size:
        return Directions(dq, dv, along.dz, along.dp)
    still = {name: np.repeat(array, nv + 1, axis=0) if name != "p" else array for name, array in values.items()}
    still["v"] = np.zeros((nv + 1, nv))
    still["a"] = np.concatenate([np.zeros((1, nv)), np.eye(nv)])
    moving = equations.partials(still)
    unit = np.arange(nv)
    of_inertia = [(array[1:] - array[:1])[unit, unit] for array in (moving.Jq, moving.P)]
    diagonal = of_inertia[0] @ dq + of_inertia[1] @ along.dp  # change of M_ii
    dW = -(inverse_inertia**2)[:, np.newaxis] * diagonal
    return Directions(dq, dv, along.dz, np.concatenate([along.dp, dW]))


def _nearest(M: Array, B: Array, off: Array) -> Array:
    """Return the least x in the metric of M with B x = off."""
    by_row = np.linalg.solve(M, B.T)
    found: Array = by_row @ np.linalg.solve(B @ by_row, off)
    return found
