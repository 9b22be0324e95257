"""Second derivatives of the start of a run: of accelerations, of states that are moved onto constraints.

Each is an equation whose second derivatives along tangents are contracted with its multipliers, from the last one to
the first. Runs move positions by Newton's steps c = -R Phi, R = M^-1 B^T (B M^-1 B^T)^-1; the first two decide second
derivatives. With dPhi_i = -S sigma_i and c_i = M^-1 B^T sigma_i, S = B M^-1 B^T, the limit q has

    d_j dq_i = (1 - R B) (x_ij + M^-1 (dB_j^T sigma_i - dM_j c_i + dB_i^T sigma_j - dM_i c_j)) - R d2Phi_ij,
    x_ij = -[d_j, d_i] / 2 - [c_j, d_i] - [c_j, c_i] / 2,

d the directions as they are asked for, d2Phi along the ones on the constraints; dM_j and dB_j along d. Velocities solve
M (v' - v) = B^T sigma, w(q, v') = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.lie import product
from eomgen.products.derivatives.beginning import (
    Directions,
    StartDerivatives,
    inertia_partials,
    on_constraints,
)
from eomgen.products.derivatives.turning import turnings

if TYPE_CHECKING:
    from eomgen.products.derivatives.alpha_run import AlphaRun
    from eomgen.products.derivatives.following_start import Rest


class SecondBeginning:
    """Second derivatives of the start along pairs of directions.

    Parameters
    ----------
    run : whose directions are the first ones
    second : as they are asked for; the same without
    """

    def __init__(self, run: AlphaRun, second: Directions | None = None) -> None:
        self.start, self.W, self.equations = run.beginning, run.inverse_inertia, run.equations
        self.rest = run.rest
        self.asked, self.on, self.stages = (run.asked,) * 2, (run.along,) * 2, (run.stages,) * 2
        if second is not None:
            on = on_constraints(self.start, second, self.W) if self.equations.nl else second
            self.asked, self.on = (run.asked, second), (run.along, on)
            self.stages = run.stages, self.start.stages(run.of_equations(on))
        self.found = np.zeros((run.size, self.asked[1].dq.shape[1]))

    def of(self, state: Array, record: Array, of_inertia: Array) -> Array:
        """Return second derivatives, (first, second), of state . the state that steps begin with + record . the row
        that is recorded + of_inertia . W."""
        nv, nz, nh = self.equations.nv, self.equations.nz, self.equations.holonomic
        back = StartDerivatives.of(state, record, nv, nz)
        for number in reversed(range(len(self.stages[0]))):
            self._acceleration(number, back)
        if self.W.size:
            self._inertia(of_inertia, back)
        if self.equations.nl:
            self._velocity(back)
        if nh:
            self._position(back)
        else:
            self.found -= 0.5 * self._brackets(back.q, self.asked[1].dq, self.asked[0].dq)
        if self.rest is not None:
            self._rest(self.rest, back)
        return self.found

    def _acceleration(self, number: int, back: StartDerivatives) -> None:
        """Take accelerations and multipliers of a stage."""
        one, other = (stages[number] for stages in self.stages)
        multipliers, tau, of_q = self.start.taken_back(one, number, back)
        self._pair(one.row, other.row, multipliers, tau, number)
        for turning in turnings(self.equations.model.factors, one.theta[np.newaxis]):
            changed = turning.changed(of_q[np.newaxis], other.dtheta[np.newaxis, turning.v])
            self.found += self.on[0].dq[turning.v].T @ changed[0][0] + one.dtheta[turning.v].T @ changed[1][0]

    def _inertia(self, of_inertia: Array, back: StartDerivatives) -> None:
        """Take W = 1/M_ii."""
        nv, W, size = self.equations.nv, self.W, len(self.asked[0].dp)
        dW = [one.dp[size:] for one in self.on]
        self.found += dW[0].T @ (2.0 * (of_inertia / W)[:, np.newaxis] * dW[1])
        omega = of_inertia * W**2
        values = self.stages[0][0].values
        units = {name: np.repeat(array, nv + 1, axis=0) if name != "p" else array for name, array in values.items()}
        units["v"], units["a"] = np.zeros((nv + 1, nv)), np.eye(nv + 1, nv)
        multipliers = np.zeros((nv + 1, nv + self.equations.nz + self.equations.holonomic + self.equations.nl))
        multipliers[:nv, :nv], multipliers[nv, :nv] = np.diag(omega), -omega  # M e_k, minus its value at rest
        rows = [self._row(one.dq, one.dp[:size]) for one in self.on]
        changes = self.equations.second_partials(units, multipliers, np.repeat(rows[1][np.newaxis], nv + 1, axis=0))
        self.found += rows[0].T @ changes.sum(axis=0)
        back.q = back.q - omega @ inertia_partials(self.start)[0]

    def _velocity(self, back: StartDerivatives) -> None:
        """Take velocities that are moved onto the constraints."""
        equations, stage = self.equations, self.stages[0][0]
        nv, nz, nh, nl, size = equations.nv, equations.nz, equations.holonomic, equations.nl, len(self.asked[0].dp)
        M, B = stage.matrix[:nv, :nv], stage.matrix[nv:, :nv]
        solved = np.linalg.solve(stage.matrix, np.concatenate([back.v, np.zeros(nl)]))
        tau = np.concatenate([np.zeros(nv + nz + nh), solved[nv:]])
        moved = [one.dv - asked.dv for one, asked in zip(self.on, self.asked, strict=True)]
        along = [Directions(one.dq, one.dv, one.dz, one.dp[:size]) for one in self.on]
        self._moved(M, B, solved[:nv], moved, along)
        rows = [self._row(one.dq, one.dp, one.dv) for one in along]
        self._pair(rows[0], rows[1], tau, np.zeros(nl))
        back.q = back.q - tau @ stage.partials.Jq[0]

    def _position(self, back: StartDerivatives) -> None:
        """Take positions that are moved onto the constraints."""
        equations, stage, size = self.equations, self.stages[0][0], len(self.asked[0].dp)
        nv, nz, nh, nl = equations.nv, equations.nz, equations.holonomic, equations.nl
        M, B = stage.matrix[:nv, :nv], stage.matrix[nv : nv + nh, :nv]
        R = np.linalg.solve(M, B.T)
        R = R @ np.linalg.inv(B @ R)
        of_rows = R.T @ back.q
        gamma = back.q - B.T @ of_rows
        moved = [one.dq - asked.dq for one, asked in zip(self.on, self.asked, strict=True)]
        weights = np.asarray(np.linalg.solve(M, gamma), dtype=np.float64)
        self._moved(M, B, weights, moved, self.asked)
        d = [one.dq for one in self.asked]
        self.found -= 0.5 * self._brackets(gamma, d[1], d[0]) + self._brackets(gamma, moved[1], d[0])
        self.found -= 0.5 * self._brackets(gamma, moved[1], moved[0])
        multipliers = np.concatenate([np.zeros(nv + nz), of_rows, np.zeros(nl)])
        rows = [self._row(one.dq, one.dp[:size]) for one in self.on]
        self._pair(rows[0], rows[1], multipliers, np.zeros(nl))
        back.q = gamma

    def _rest(self, rest: Rest, back: StartDerivatives) -> None:
        """Take the static equilibrium that the state is: K d_j dq_i = -e''."""
        equations, nh = self.equations, self.equations.holonomic
        nv, nz = equations.nv, equations.nz
        multipliers = np.zeros(nv + nz + nh + equations.nl)
        multipliers[: nv + nz + nh] = np.linalg.solve(rest.matrix.T, np.concatenate([back.q, back.z, np.zeros(nh)]))
        rows = []
        for one in self.asked:
            dq, dz, dlam = np.split(rest.slopes @ one.dp, np.cumsum([nv, nz]))
            rows.append(np.concatenate([dq, np.zeros((2 * nv, dq.shape[1])), dz, dlam, one.dp]))
        changes = equations.second_partials(rest.values, multipliers[np.newaxis], rows[1][np.newaxis])
        self.found += rows[0].T @ changes[0]
        # the start is q(p) o exp(theta): of two parameters e'' has the bracket, of theta_j and p_i it is whole
        of_rest = [row[:nv] for row in rows]
        beside = [one.dq - dq for one, dq in zip(self.asked, of_rest, strict=True)]
        self.found += 0.5 * self._brackets(back.q, of_rest[1], of_rest[0])
        self.found -= 0.5 * self._brackets(back.q, beside[1], of_rest[0])
        self.found += 0.5 * self._brackets(back.q, of_rest[1], beside[0])

    def _moved(self, M: Array, B: Array, m: Array, moved: list[Array], along: Sequence[Directions]) -> None:
        """Add m . (dB_j^T sigma_i - dM_j c_i) and the same with i and j exchanged; ``moved``: c, in range of M^-1 B^T;
        ``along``: directions of dB and dM."""
        nv, first = self.equations.nv, 3 * self.equations.nv + self.equations.nz
        multipliers = np.zeros((1, nv + self.equations.nz + self.equations.holonomic + self.equations.nl))
        multipliers[0, :nv] = -m
        S = B @ np.linalg.solve(M, B.T)
        sides = []
        for one, c in zip(along, moved, strict=True):
            row = self._row(one.dq, one.dp)[np.newaxis]
            change = self.equations.second_partials(self.stages[0][0].values, multipliers, row)[0]
            of_M, of_B = change[2 * nv : 3 * nv], change[first : first + len(B)]
            sides.append((c, np.linalg.solve(S, B @ c), of_M, of_B))
        (c_i, sigma_i, M_i, B_i), (c_j, sigma_j, M_j, B_j) = sides
        self.found += sigma_i.T @ B_j - c_i.T @ M_j + B_i.T @ sigma_j - M_i.T @ c_j

    def _pair(self, one: Array, other: Array, multipliers: Array, tau: Array, number: int = 0) -> None:
        """Add second derivatives of - multipliers . e - tau . accelerations of constraints at a stage, along rows."""
        changes = self.equations.second_partials(
            self.stages[0][number].values, multipliers[np.newaxis], other[np.newaxis], None, tau[np.newaxis]
        )
        self.found += one.T @ changes[0]

    def _row(self, dq: Array, dp: Array, dv: Array | None = None) -> Array:
        equations = self.equations
        none = np.zeros((equations.nv + equations.nz + equations.nl, dq.shape[1]))
        return np.concatenate([dq, np.zeros_like(dq) if dv is None else dv, none, dp])

    def _brackets(self, weights: Array, one: Array, other: Array) -> Array:
        """Return weights . [one_j, other_i], (i, j)."""
        factors = self.equations.model.factors
        if all(factor.group == "R" for factor in factors):
            return np.zeros((other.shape[1], one.shape[1]))
        contracted = np.einsum("r,krc->kc", weights, product.bracket_matrix(factors, np.eye(len(weights))))
        result: Array = other.T @ contracted.T @ one
        return result
