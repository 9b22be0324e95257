"""Time-discontinuous Galerkin steps made linear: what a step makes of changes of its start, statement by statement.

A step is not the limit of an iteration but a fixed number of passes (``integrators.families.discontinuous_galerkin``),
so its derivatives are those of the passes themselves. Each correction solves, with the partials at the start,

    M d_v + gain (K T s + C d_v + R_z d_z) = b,   d_z - gain dF/d(q, v, z) . d = b_z,   s = b_theta + gain d_v,

whose left side is e' x for x = (gain T s, gain d_v, d_v, gain d_z) in (q, v, a, z). It changes by e''[x, .] with the
start, which ``second_partials`` gives. All steps of a part are taken at once, and each along the unit changes
of (q, v, a, z) at its start and of the parameters; a are the accelerations that it begins with, the slope of the step
before at its end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from eomgen.arrays import Array
from eomgen.integrators.families.family import LinearPasses
from eomgen.lie import numeric, product
from eomgen.lie.first_order import tangent_along
from eomgen.lie.groups import group_named
from eomgen.lie.product import Factor
from eomgen.simulation.sensitivities.equations import Equations
from eomgen.simulation.sensitivities.recorded_changes import Record, solved, stacked
from eomgen.simulation.stepping.states import Prescribed, States

Driven = tuple[Prescribed, Array | None]


@dataclass
class _Along:
    """A vector at (n,) steps with its changes: value (n, size), by (n, size, directions) or recorded."""

    value: Array
    by: Any

    def __add__(self, other: _Along) -> _Along:
        return _Along(self.value + other.value, self.by + other.by)

    def __sub__(self, other: _Along) -> _Along:
        return _Along(self.value - other.value, self.by - other.by)

    def __rmul__(self, factor: float) -> _Along:
        return _Along(factor * self.value, factor * self.by)

    def __getitem__(self, part: slice) -> _Along:
        return _Along(self.value[:, part], self.by[:, part])

    def times(self, matrix: Array) -> _Along:
        """Return the product of matrices (n, rows, size) that do not change."""
        return _Along((matrix @ self.value[..., np.newaxis])[..., 0], matrix @ self.by)

    def below(self, other: _Along) -> _Along:
        return _Along(np.concatenate([self.value, other.value], 1), stacked([self.by, other.by]))


def _weighed(weights: Sequence[float], vectors: Sequence[_Along]) -> _Along:
    """Return a sum of vectors."""
    found = weights[0] * vectors[0]
    for weight, vector in zip(weights[1:], vectors[1:], strict=True):
        found = found + weight * vector
    return found


class GalerkinSteps:
    """Steps from states at (n,) rows.

    Parameters
    ----------
    states : at the starts; their accelerations are those that the steps begin with
    given : inputs and base there, and what directions of inputs change these by
    step : s
    at_nodes : times (n, nodes), and the same at each
    recorded : whether changes are recorded, for adjoints that are known, and not taken along directions
    """

    def __init__(
        self,
        equations: Equations,
        method: LinearPasses,
        states: States,
        given: Driven,
        step: float,
        at_nodes: tuple[Array, Sequence[Driven]],
        *,
        recorded: bool = False,
    ) -> None:
        self.equations, self.method, self.step, self.start = equations, method, step, states
        self.times, self.given = at_nodes
        self.factors = equations.model.factors
        self.nv, self.nz = equations.nv, equations.nz
        self.size, self.rows = 3 * self.nv + self.nz, self.nv + self.nz
        self.directions, self.gain = self.size + equations.parameters, method.gamma * step
        self.values = equations.values(states, *given)
        found = equations.partials(self.values)
        self.M, self.Jq, self.K = found.Ja, found.Jq, self.gain * found.Jq
        self.T = product.tangent(self.factors, self.gain * states.v)
        matrix = np.concatenate([found.Ja + self.gain * (found.Jv + self.K @ self.T), self.gain * found.Jz], axis=2)
        matrix[:, self.nv :, self.nv :] += np.eye(self.nz)
        self.matrix = matrix
        self.record = Record() if recorded else None
        unit = np.broadcast_to(np.eye(self.directions), (len(states.t), self.directions, self.directions))
        self.by: Any = unit if self.record is None else self.record.change(self.directions)
        ends = [0, *np.cumsum([self.nv, self.nv, self.nv, self.nz]).tolist(), self.directions]
        parts = [self.by[:, slice(*pair)] for pair in pairwise(ends)]
        self.q_by, self.v_by, _, self.z_by, self.p_by = parts

    def taken(self) -> tuple[Array, Array]:
        """Take the steps; return changes of (q, v, a, z) at their ends by those at their starts, (n, size, size), and
        by the parameters, (n, size, parameters)."""
        whole = self._passed()
        return whole[:, :, : self.size], whole[:, :, self.size :]

    def pulled(self, adjoints: Array) -> tuple[Array, Array]:
        """Return what adjoints (n, size, functionals) of the ends of recorded steps make of their starts, and of the
        parameters, (n, parameters, functionals)."""
        assert self.record is not None  # for mypy: steps that are pulled back are made with a record
        found = self.record.pulled(self._passed(), adjoints)
        return found[:, : self.size], found[:, self.size :]

    def _passed(self) -> Any:
        """Take the steps, and return changes of (q, v, a, z) at their ends."""
        nv, nz, nodes = self.nv, self.nz, range(len(self.method.nodes))
        theta, v, z = ([self._zero(size) for _ in nodes] for size in (nv, nv, nz))
        for number in range(self.method.passes):
            forces, rates = [], []
            for node in nodes:
                found = self._at_node(number, node, theta[node], v, z[node])
                forces.append(found[0])
                rates.append(found[1])
            integral = self.method.later if number else self.method.first
            right, theta_right = [], []
            for mode in nodes:
                of_forces = _weighed([self.step * x for x in integral[mode]], forces)
                of_theta = _weighed([self.step * x for x in integral[mode]], rates)
                if number:
                    gone = _weighed(self.method.modes[mode], z)
                    of_forces = of_forces - self._zero(nv).below(gone)
                    of_theta = of_theta - _weighed(self.method.modes[mode], theta)
                right.append(of_forces)
                theta_right.append(of_theta)
            changes = self._corrected(right, theta_right)
            for node in nodes:
                of_node = self.method.values[node]
                theta[node] = theta[node] + _weighed(of_node, [change[0] for change in changes])
                v[node] = v[node] + _weighed(of_node, [change[1][:nv] for change in changes])
                z[node] = z[node] + _weighed(of_node, [change[1][nv:] for change in changes])
        dq = self._turned(theta[-1])
        slope = _weighed([x / self.step for x in self.method.derivative[-1]], v)
        return stacked([dq, self.v_by + v[-1].by, slope.by, self.z_by + z[-1].by])

    def _zero(self, size: int) -> _Along:
        """Return a vector that is 0 and stays so."""
        count = len(self.start.t)
        no_change: Any = np.zeros((count, size, self.directions)) if self.record is None else self.record.change(size)
        return _Along(np.zeros((count, size)), no_change)

    def _turned(self, theta: _Along) -> Any:
        """Return changes of q o exp(theta), (n, nv, directions)."""
        moved = product.transport(self.factors, theta.value) @ self.q_by
        return moved + product.tangent(self.factors, theta.value) @ theta.by

    def _at_node(self, number: int, node: int, theta: _Along, v: list[_Along], z: _Along) -> tuple[_Along, _Along]:
        """Return what forces and rates of z are missing, and the rates of theta, at a node before a pass."""
        start, nv = self.start, self.nv
        a = self._zero(nv)
        v_now = _Along(start.v, self.v_by) + v[node]
        rate, q, dq = v_now, start.q, self.q_by
        if number:
            a = _weighed([x / self.step for x in self.method.derivative[node]], v)
            q, dq = product.update(self.factors, start.q, theta.value), self._turned(theta)
            rate = self._rate(theta, v_now)
        z_now = _Along(start.z, self.z_by) + z
        moved = (q, dq), v_now, z_now
        if not (number and self.method.refined):
            return -1.0 * self._equations(node, *moved, a), rate
        missing = self._equations(node, *moved, a)
        none = self._zero(self.nz)
        x = self._solved(missing[:nv].below(none), self._zero(nv))[1]
        forces = -1.0 * self._equations(node, *moved, a - x[:nv])
        inertial = self._of_inertia(x)
        return (forces[:nv] - inertial).below(forces[nv:]), rate

    def _equations(self, node: int, q: tuple[Array, Any], v: _Along, z: _Along, a: _Along) -> _Along:
        """Return e, with the inputs and the base of a node."""
        equations, start = self.equations, self.start
        states = States(self.times[:, node], q[0], v.value, a.value, start.multipliers, z.value)
        values = equations.values(states, *self.given[node])
        (r,) = equations.of("residual", values).values()
        if self.nz:
            r = np.concatenate([r, -equations.of("internal_rate", values)["zdot"]], axis=1)
        partials = equations.partials(values)
        by = partials.Jq @ q[1] + partials.Jv @ v.by + partials.Ja @ a.by + partials.Jz @ z.by
        if self.record is None:
            by[:, :, self.size :] += partials.P
        else:
            by = by + partials.P @ self.p_by
        return _Along(r, by)

    def _corrected(self, right: list[_Along], theta_right: list[_Along]) -> list[tuple[_Along, _Along]]:
        """Return the corrections of theta and of (v, z), polynomial by polynomial."""
        found: list[tuple[_Along, _Along]] = []
        carried = self._zero(self.rows)
        theta_carried = self._zero(self.nv)
        carried_along = np.zeros((len(self.start.t), self.size), self.equations.dtype)
        for of_forces, of_theta in zip(right, theta_right, strict=True):
            b, b_theta = of_forces - carried, of_theta - theta_carried
            d_theta, d = self._solved(b, b_theta, carried_along)
            found.append((d_theta, d))
            if len(found) < len(right):
                theta_carried = d_theta - b_theta
                carried = d[: self.nv].times(self.M[:, : self.nv]).below(d[self.nv :]) - b
                carried_along = carried_along + self._accelerating(d)
        return found

    def _solved(self, right: _Along, theta_right: _Along, less: Array | None = None) -> tuple[_Along, _Along]:
        """Return d_theta and (d_v, d_z) of the linear equations of a correction; ``less``: e'' along it is still to be
        taken from the right side's changes."""
        nv, gain = self.nv, self.gain
        b = right.value - (self.K @ (self.T @ theta_right.value[..., np.newaxis]))[..., 0]
        x = np.linalg.solve(self.matrix, b[..., np.newaxis])[..., 0]
        s = theta_right.value + gain * x[:, :nv]
        d_theta = (self.T @ s[..., np.newaxis])[..., 0]
        along = np.concatenate([gain * d_theta, gain * x[:, :nv], x[:, :nv], gain * x[:, nv:]], axis=1)
        if less is not None:
            along += less
        of_T = gain * self._along_group(gain * self.start.v, s) @ self.v_by
        turned = of_T + self.T @ theta_right.by
        by = solved(self.matrix, right.by - self._second(along) - self.K @ turned)
        return _Along(d_theta, turned + gain * self.T @ by[:, :nv]), _Along(x, by)

    def _of_inertia(self, x: _Along) -> _Along:
        """Return M of the start times the part of v of a vector."""
        nv = self.nv
        moved = x[:nv].times(self.M[:, :nv])
        return _Along(moved.value, moved.by + self._second(self._accelerating(x))[:, :nv])

    def _accelerating(self, x: _Along) -> Array:
        """Return the part of v of a vector as one of accelerations in (q, v, a, z)."""
        along = np.zeros((len(x.value), self.size), self.equations.dtype)
        along[:, 2 * self.nv : 3 * self.nv] = x.value[:, : self.nv]
        return along

    def _second(self, along: Array) -> Any:
        """Return how e' along changes with the start, (n, rows, directions), along (n, size).

        ``second_partials`` has how gradients change along it; on groups the two are apart by a bracket of increments.
        """
        equations, count, rows = self.equations, len(along), self.rows
        if self.record is not None:
            return self.record.change(rows, (self.by, lambda adjoint: self._second_of(along, adjoint)))
        values, multipliers = self._unit_multipliers
        changes = np.zeros((count * rows, self.directions, 1), equations.dtype)
        changes[:, : self.size, 0] = np.repeat(along, rows, axis=0)
        found = equations.second_partials(values, multipliers, changes)
        found = found.reshape(count, rows, self.directions)
        if self._rotating:
            nv = self.nv
            found[:, :, :nv] -= self.Jq @ product.bracket_matrix(self.factors, along[:, :nv])
        return found

    def _second_of(self, along: Array, adjoints: Array) -> Array:
        """Return adjoints (n, rows, functionals) times how e' along changes with the start, (n, directions,
        functionals)."""
        changes = np.zeros((len(along), self.directions, 1), self.equations.dtype)
        changes[:, : self.size, 0] = along
        of_each = [
            self.equations.second_partials(self.values, -adjoints[..., number], changes)
            for number in range(adjoints.shape[2])
        ]
        found = np.concatenate(of_each, axis=2)
        if self._rotating:
            bracket = self.Jq @ product.bracket_matrix(self.factors, along[:, : self.nv])
            found[:, : self.nv] -= np.swapaxes(bracket, 1, 2) @ adjoints
        return found

    def _rate(self, theta: _Along, x: _Along) -> _Along:
        """Return T^-1 of theta times x; x where nothing rotates."""
        if not self._rotating:
            return x
        matrix = np.zeros((*theta.value.shape, self.nv), theta.value.dtype)
        matrix[:] = np.eye(self.nv)
        for factor in self._rotating:
            group, part = group_named(factor.group, factor.v_size), factor.v
            matrix[:, part, part] = numeric.tangent_inverse(group, theta.value[:, part])
        found = x.times(matrix)
        return _Along(found.value, found.by + self._along_group(theta.value, x.value, inverse=True) @ theta.by)

    def _along_group(self, theta: Array, x: Array, *, inverse: bool = False) -> Array:
        """Return partials in theta of T, or of its inverse, times x, (n, nv, nv); 0 where nothing rotates."""
        found = np.zeros((len(theta), self.nv, self.nv), self.equations.dtype)
        for factor in self._rotating:
            group, part = group_named(factor.group, factor.v_size), factor.v
            for k, unit in enumerate(np.eye(factor.v_size)):
                change = tangent_along(group, theta[:, part], unit, inverse=inverse)
                found[:, part, part.start + k] = (change @ x[:, part, np.newaxis])[..., 0]
        return found

    @cached_property
    def _unit_multipliers(self) -> tuple[dict[str, Array], Array]:
        """Input blocks at the starts, once for each equation, and what picks it."""
        rows = self.rows
        values = {name: array if name == "p" else np.repeat(array, rows, axis=0) for name, array in self.values.items()}
        return values, np.tile(-np.eye(rows), (len(self.start.t), 1))

    @property
    def _rotating(self) -> list[Factor]:
        return [factor for factor in self.factors if factor.group != "R"]
