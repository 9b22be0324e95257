"""Runs of RATTLie made linear.

With theta = h w, C(theta) = T(theta)^-T, m = (p(q, w) + p(q', w))/2 and R = dT/dq + Q, a step solves for w, the
impulses mu = h lam/2 at both ends, v' and z' (``integrators.families.rattlie``):

    C(-theta) m - p(q, v) - h/2 R(q, w, z) + B(q)^T mu = 0,        Phi(q') = 0,
    p(q', v') - C(theta) m - h/2 R(q', w, z') + B(q')^T mu' = 0,   B(q') v' + Phi_t = 0,
    z - z' + h/2 (F(q, w, z) + F(q', w, z')) = 0.

Rows have q, v and z; w is the logarithm of the step, and impulses follow from the equations.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.compiled.argument_derivatives import derivatives, sparsity
from eomgen.lie import numeric, product
from eomgen.lie.groups import group_named
from eomgen.products.derivatives.equations import rows_of, solve
from eomgen.products.derivatives.motion import RunSegment
from eomgen.products.derivatives.transition_run import StepEnds, TransitionRun
from eomgen.simulation.stepping.states import PrescribedInputs, States
from eomgen.solvers.regular_inertia import regular_inertia


@dataclass(frozen=True)
class Momenta:
    """Momenta p and rates R at n states, (n, nv) each, with partials in q, v, z and the parameters: p and then R, (n, 2
    nv, ...)."""

    p: Array
    rate: Array
    by_q: Array
    by_v: Array
    by_z: Array
    by_parameters: Array


class VariationalRun(TransitionRun):
    """A run of RATTLie with linearised steps from state to state."""

    def transitions(self, part: RunSegment, ends: StepEnds) -> Array:
        """Return the derivatives of q, v and z at the ends of the steps, (steps, size, size + parameters), by the
        equations of momenta."""
        equations, h = self.equations, self.run.grid.step
        factors, nv, nz, nl = equations.model.factors, equations.nv, equations.nz, equations.nl
        before, after = ends.before, ends.after
        count, size = len(before.t), self.size_of_state
        first, last = np.arange(count), np.arange(1, count + 1)
        theta = product.difference(factors, before.q, after.q)
        w = theta / h
        A, T = product.transport(factors, theta), product.tangent(factors, theta)
        moving = [
            self.momenta(state._replace(v=w), prescribed)
            for state, prescribed in ((before, ends.at_start), (after, ends.at_end))
        ]
        momenta = [
            self.momenta(state, prescribed) for state, prescribed in ((before, ends.at_start), (after, ends.at_end))
        ]
        middle = 0.5 * (moving[0].p + moving[1].p)
        turned = [self._cotangent(sign * theta, middle) for sign in (-1.0, 1.0)]
        # unknowns: w, mu, v', mu', z'; then q, v, z and the parameters
        sizes = np.cumsum([nv, nl, nv, nl, nz, nv, nv, nz, equations.parameters])
        of_w, of_first, of_v1, of_last, of_z1, of_q, of_v, of_z, of_p = (
            slice(start, stop) for start, stop in zip([0, *sizes[:-1]], sizes, strict=True)
        )
        unknowns = int(sizes[4])
        by_end = np.zeros((count, nv, int(sizes[-1])))  # of q'
        by_end[:, :, of_w], by_end[:, :, of_q] = h * T, A
        rows = np.zeros((count, unknowns, int(sizes[-1])))
        starts, ended = rows[:, :nv], rows[:, nv + nl : 2 * nv + nl]
        mean = np.zeros((count, nv, int(sizes[-1])))  # of m
        for number, moving_factor in enumerate(moving):
            mean[:, :, of_w] += 0.5 * moving_factor.by_v[:, :nv]
            mean[:, :, of_p] += 0.5 * moving_factor.by_parameters[:, :nv]
            if number:
                mean += 0.5 * moving_factor.by_q[:, :nv] @ by_end
            else:
                mean[:, :, of_q] += 0.5 * moving_factor.by_q[:, :nv]
        partials = ends.partials
        for number, (target, sign) in enumerate(((starts, -1.0), (ended, 1.0))):
            C, along = turned[number]
            target[:] -= sign * (C @ mean)
            target[:, :, of_w] -= h * along
            rate, moved = moving[number], momenta[number]
            velocity, z = (of_v1, of_z1) if number else (of_v, of_z)
            by_q = sign * moved.by_q[:, :nv] - 0.5 * h * rate.by_q[:, nv:]
            target[:, :, of_w] -= 0.5 * h * rate.by_v[:, nv:]
            target[:, :, velocity] += sign * moved.by_v[:, :nv]
            target[:, :, z] += sign * moved.by_z[:, :nv] - 0.5 * h * rate.by_z[:, nv:]
            target[:, :, of_p] += sign * moved.by_parameters[:, :nv] - 0.5 * h * rate.by_parameters[:, nv:]
            if nl:
                at = last if number else first
                B = partials.Jv[at][:, -nl:]
                pushed = C @ middle[:, :, np.newaxis] * sign - (sign * moved.p - 0.5 * h * rate.rate)[:, :, np.newaxis]
                inertia = regular_inertia(partials.Ja[at][:, :nv], B, np.ones(nv))
                by_inertia = np.linalg.solve(inertia, np.swapaxes(B, 1, 2))
                impulses = -solve(B @ by_inertia, np.swapaxes(by_inertia, 1, 2) @ pushed, after.t)[:, :, 0]
                N, Np = equations.reaction_partials(rows_of(ends.blocks, at), impulses)
                by_q = by_q + N
                target[:, :, of_p] += Np
                target[:, :, of_last if number else of_first] += np.swapaxes(B, 1, 2)
            if number:
                target[:] += by_q @ by_end
            else:
                target[:, :, of_q] += by_q
        if nl:
            states, rates = nv + nz, slice(-nl, None)
            rows[:, nv : nv + nl] = partials.Jq[1:, states : states + nl] @ by_end
            rows[:, nv : nv + nl, of_p] += partials.P[1:, states : states + nl]
            held = rows[:, 2 * nv + nl : 2 * (nv + nl)]
            held[:] = partials.Jq[1:, rates] @ by_end
            held[:, :, of_v1] += partials.Jv[1:, rates]
            held[:, :, of_p] += partials.P[1:, rates]
        if nz:
            self._rates(rows[:, 2 * (nv + nl) :], ends, w, by_end, (of_w, of_q, of_z, of_z1, of_p))
        changes = solve(rows[:, :, :unknowns], rows[:, :, unknowns:], after.t)
        result = np.zeros((count, size, size + equations.parameters))
        result[:, :nv] = by_end[:, :, unknowns:] + by_end[:, :, :unknowns] @ changes
        result[:, nv : 2 * nv], result[:, 2 * nv :] = changes[:, of_v1], changes[:, of_z1]
        return result

    def _rates(self, rows: Array, ends: StepEnds, w: Array, by_end: Array, columns: tuple[slice, ...]) -> None:
        """Fill the rows of the internal states' equations, (steps, nz, columns), in place. `w` (steps, nv) are mean
        velocities, `by_end` the derivatives of q at the ends, ``columns`` the slices of w, q, z, z' and the
        parameters."""
        of_w, of_q, of_z, of_z1, of_p = columns
        nv, nz, half = self.equations.nv, self.equations.nz, 0.5 * self.run.grid.step
        states, unit = slice(nv, nv + nz), np.eye(nz)
        rows[:, :, of_z], rows[:, :, of_z1] = unit, -unit
        for state, prescribed, z in ((ends.before, ends.at_start, of_z), (ends.after, ends.at_end, of_z1)):
            e = self.equations.partials(self.blocks(state._replace(v=w), prescribed))
            rows[:, :, of_w] -= half * e.Jv[:, states]
            rows[:, :, z] -= half * e.Jz[:, states]
            rows[:, :, of_p] -= half * e.P[:, states]
            if z is of_z1:
                rows -= half * e.Jq[:, states] @ by_end
            else:
                rows[:, :, of_q] -= half * e.Jq[:, states]

    def _cotangent(self, theta: Array, momentum: Array) -> tuple[Array, Array]:
        """Return C(theta) = T(theta)^-T, (n, nv, nv), and the partials of C(theta) momentum in theta, (n, nv, nv)."""
        factors, count, nv = self.equations.model.factors, len(theta), self.equations.nv
        C, along = np.broadcast_to(np.eye(nv), (count, nv, nv)).copy(), np.zeros((count, nv, nv))
        for factor in factors:
            if factor.group == "R":
                continue
            group, part = group_named(factor.group, factor.v_size), factor.v
            C[:, part, part] = np.swapaxes(numeric.tangent_inverse(group, theta[:, part]), 1, 2)
            for k, unit in enumerate(np.eye(factor.v_size)):
                change = numeric.tangent_along(group, theta[:, part], unit, inverse=True)
                along[:, part, part.start + k] = np.einsum("nji,nj->ni", change, momentum[:, part])
        return C, along

    def momenta(self, state: States, prescribed: PrescribedInputs) -> Momenta:
        """Return p = dT/dv and R = dT/dq + Q (without reactions) at states, with partials of both."""
        equations, nv = self.equations, self.equations.nv
        model, count = equations.model.having(("momenta", "momenta_derivatives")), len(state.t)
        blocks = self.blocks(state, prescribed)
        momentum, rate = model.functions("momenta", blocks)
        arguments: dict[str, Any] = {"t": state.t, "u": prescribed.u, "z": state.z, "parameters": equations.p}
        columns = sparsity(model, "momenta").arguments
        D = derivatives(model, "momenta", state.q, state.v, **arguments)
        by = {name: D[:, :, columns[name]] for name in ("q", "v", "z", "p", "u") if name in columns}
        by_p = np.zeros((count, 2 * nv, len(equations.chosen)))
        if "p" in by:
            by_p[:] = by["p"][:, :, equations.chosen]
        if "u" in by and self.by_formulas():
            by_p[:, nv:] += self._forces_by_formulas(blocks, arguments)
        driven = np.zeros((count, 2 * nv, equations.driven))
        if "u" in by and equations.driven:
            driven[:] = by["u"] @ blocks["du"]
        shape = count, nv
        return Momenta(
            np.broadcast_to(momentum, shape),
            np.broadcast_to(rate, shape),
            by["q"],
            by["v"],
            by.get("z", np.zeros((count, 2 * nv, equations.nz))),
            np.concatenate([by_p, driven], axis=2),
        )

    def _forces_by_formulas(self, blocks: Mapping[str, Array], arguments: Mapping[str, Any]) -> Array:
        """Return partials of forces in the chosen parameters by way of inputs that follow formulas, (n, nv, chosen):
        partials of the residual hold such inputs or follow their formulas, and momenta hold them."""
        equations, nv = self.equations, self.equations.nv
        still = {**blocks, "a": np.zeros_like(blocks["a"]), "lam": np.zeros_like(blocks["lam"])}
        term = "residual" if equations.nl else "inverse_dynamics"
        q, v, a = still["q"], still["v"], still["a"]
        held = derivatives(equations.model, term, q, v, a, **arguments, of=["p"])[:, :, equations.chosen]
        result: Array = held - equations.partials(still).P[:, :nv, : len(equations.chosen)]
        return result
