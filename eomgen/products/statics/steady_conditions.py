"""Conditions of a steady motion as residuals with partials, evaluated by the compiled functions, and their scales."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import SUMMED
from eomgen.compiled.coordinates import reaches
from eomgen.compiled.terms import Inputs, TermsAt
from eomgen.errors import ModelError
from eomgen.lie.product import update
from eomgen.solvers.regular_inertia import regular_inertia

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class ConditionValues:
    """Values and partials of all conditions of a steady motion, at q, v, a = vdot, z and multipliers.

    Attributes
    ----------
    residual, position, velocity, acceleration, rates : r (nv,), rows Phi, B v + Phi_t and its rate, and zdot
    K, C, M, Rz : partials of r in q (left-trivialised), v, a and z; the partial in the multipliers is B^T
    B, Z : partials of the rows' velocities in v and q; the first rows of B are the partials of Phi in q
    Aq, Av : partials of the rows' accelerations in q and v; the partial in a is B
    Fq, Fv, Fz : partials of zdot
    """

    residual: Array
    position: Array
    velocity: Array
    acceleration: Array
    rates: Array
    K: Array
    C: Array
    M: Array
    Rz: Array
    B: Array
    Z: Array
    Aq: Array
    Av: Array
    Fq: Array
    Fv: Array
    Fz: Array

    @property
    def values(self) -> Array:
        """All values, concatenated."""
        return np.concatenate([self.residual, self.position, self.velocity, self.acceleration, self.rates])


@dataclass(frozen=True)
class Conditions:
    """The conditions of a steady motion of a model at parameters, a time and inputs.

    Attributes
    ----------
    extents : (nv,) scales of displacements: 1 rad, or the largest length of the scene
    pace : 1/s, scale of velocities: of the velocities given, or of a pendulum as long as the scene
    """

    model: CompiledModel
    parameters: Array
    t: float
    u: Inputs
    extents: Array
    pace: float

    @property
    def turning(self) -> Mask:
        return np.array([unit == "rad/s" for unit in self.model.v_units], dtype=bool)

    def around(self, change: Array) -> Array:
        """Return an increment of q, (nv,), from random numbers ``change`` (nv,), scaled by ``extents``; elastic
        coordinates stay as small as beams are meant to deform."""
        amplitudes = np.array(reaches(self.model.factors, self.model.description.coordinates))
        elastic = np.isfinite(amplitudes)
        small = np.where(elastic, amplitudes, 0.0) * np.clip(change, -1.0, 1.0)
        return np.asarray(np.where(elastic, small, change * self.extents))

    def after(self, seconds: float) -> Conditions:
        """Return the conditions at a later time."""
        return replace(self, t=self.t + seconds)

    def followed(self, q: Array) -> Array:
        """Return q with counted turns adapted to the poses."""
        return self.model.evaluator.follow_angles(q, self.t, self.parameters)

    @cached_property
    def _terms(self) -> TermsAt:
        return self.model.evaluator.at(self.t, self.parameters, self.u)

    @cached_property
    def _rest(self) -> dict[str, Array]:
        return {"z": self.model.evaluator.internal(None), "lam": np.zeros(len(self.model.multipliers))}

    def _term(self, name: str, q: Array, v: Array, a: Array, **more: Array) -> list[Array]:
        return list(self._terms(name, **{**self._rest, **more}, q=q, v=v, a=a))

    def root_of_mass(self, q: Array) -> Array:
        """Return L of M = L L^T. Raises numpy.linalg.LinAlgError."""
        return np.asarray(np.linalg.cholesky(self._mass(q)), dtype=float)

    def _mass(self, q: Array) -> Array:
        """Return M, with rows of constraints for parts without inertia."""
        M: Array = self._terms("mass", q=q)[0]
        return regular_inertia(M, self.jacobian(q), self.extents) if self.model.multipliers else M

    def accelerations(self, q: Array, v: Array, a: Array, z: Array, lam: Array) -> Array:
        """Return M^-1 r, (nv,): the accelerations by which a state misses balance, with the sign of the residual.
        Arguments as for ``at``."""
        (r,) = self._term("residual", q, v, a, z=z, lam=lam)
        return np.asarray(np.linalg.solve(self._mass(q), r), dtype=float)

    def values(self, q: Array, v: Array, a: Array, z: Array, lam: Array) -> Array:
        """Return the values of all conditions, concatenated as in ``ConditionValues.values``, without partials.
        Arguments as for ``at``."""
        model = self.model
        parts = self._term("residual", q, v, a, z=z, lam=lam)
        if model.multipliers:
            if model.functions.sizes["holonomic"]:
                parts += self._term("constraint", q, v, a)
            parts += self._term("constraint_velocity", q, v, a)
            parts.append(self._term("constraint_bias", q, v, a)[0] + self._term("constraint_jacobian", q, v, a)[0] @ a)
        if model.nz:
            parts += self._term("internal_rate", q, v, a, z=z)
        return np.concatenate(parts)

    def at(self, q: Array, v: Array, a: Array, z: Array, lam: Array) -> ConditionValues:
        """Return the values and partials of all conditions at a state.

        Parameters
        ----------
        q, v, a : (nq,), (nv,) and (nv,) ndarray
            Configuration, velocities, and a = vdot, left-trivialised.
        z, lam : (nz,) and (nl,) ndarray
            Internal states and multipliers.
        """
        model = self.model
        nv, nz, rows = model.nv, model.nz, len(model.multipliers)
        holonomic = model.functions.sizes["holonomic"] if rows else 0
        residual, position, velocity, acceleration, rates = np.split(
            self.values(q, v, a, z, lam), np.cumsum([nv, holonomic, rows, rows])
        )
        K, C, M = self._term("partials", q, v, a, z=z, lam=lam)
        B = Z = Aq = Av = np.zeros((0, nv))
        if rows:
            (B,), (Z,) = self._term("constraint_jacobian", q, v, a), self._term("velocity_partials", q, v, a)
            Aq, Av = self._term("acceleration_partials", q, v, a)
        Rz, Fq, Fv, Fz = np.zeros((nv, 0)), np.zeros((0, nv)), np.zeros((0, nv)), np.zeros((0, 0))
        if nz:
            Rz, Fq, Fv, Fz = self._term("internal_partials", q, v, a, z=z)
        return ConditionValues(residual, position, velocity, acceleration, rates, K, C, M, Rz, B, Z, Aq, Av, Fq, Fv, Fz)

    def multipliers(self, q: Array, v: Array, a: Array, z: Array) -> Array:
        """Return the multipliers (nl,) with the least unbalanced forces, measured by kinetic energy; zeros if forces or
        the Jacobian of the constraints are not finite. Arguments as for ``at``."""
        rest = np.zeros(len(self.model.multipliers))
        if not len(rest):
            return rest
        L = self.root_of_mass(q)
        r = np.linalg.solve(L, self._term("residual", q, v, a, z=z, lam=rest)[0])
        B = np.linalg.solve(L, self._term("constraint_jacobian", q, v, a)[0].T)
        if not (np.all(np.isfinite(r)) and np.all(np.isfinite(B))):
            return rest
        return np.asarray(np.linalg.lstsq(B, -r, rcond=None)[0], dtype=float)

    def jacobian(self, q: Array) -> Array:
        """Return B, (rows, nv)."""
        rest = np.zeros(self.model.nv)
        return self._term("constraint_jacobian", q, rest, rest)[0]

    def sample(self, q: Array, rng: np.random.Generator) -> tuple[Array, Array, Array, Array] | None:
        """Draw q near the given one, and v, a and multipliers, at random, with q and v on the constraints, and return
        all four; None if no draw satisfies the constraints."""
        model = self.model
        v, a, pushed = (rng.normal(0.0, self.pace**power, model.nv) * self.extents for power in (1, 2, 2))
        eta = rng.normal(0.0, 0.5, model.nv)
        for share in (1.0, 0.3, 0.1, 0.03):
            there = self.followed(update(model.factors, q, self.around(share * eta)))
            if not model.multipliers:
                return there, v, a, np.zeros(0)
            try:
                met = model.consistent(there, v, self.t, parameters=self.parameters)
            except (ModelError, np.linalg.LinAlgError):
                continue
            B, force = self.jacobian(met.q), model.mass(met.q, parameters=self.parameters) @ pushed
            if np.all(np.isfinite(B)) and np.all(np.isfinite(force)):
                return met.q, met.v, a, np.asarray(np.linalg.lstsq(B.T, force, rcond=None)[0])
        return None

    def measured(self, at: ConditionValues, parts: Array) -> tuple[Array, Array]:
        """Return values or columns of partials (``parts``, rows as in ``ConditionValues.values``) divided by their
        scales, and the rounding error of each value, (rows,). Forces count as the accelerations that result;
        accelerations are measured by pace^2 times the extent."""
        extents, pace = self.extents, self.pace
        speed = pace * extents
        inverse = np.linalg.inv(regular_inertia(at.M, at.B, extents))
        nv, holonomic = len(extents), len(at.position)
        rows = np.abs(at.B) @ extents
        rows = np.where(rows > 0.0, rows, np.max(extents))
        terms = np.abs(at.Fq) @ extents + np.abs(at.Fv) @ speed
        terms = np.where(terms > 0.0, terms, np.max(np.abs(at.Fz), axis=1, initial=0.0))
        sizes = np.concatenate([rows[:holonomic], pace * rows, pace * pace * rows, np.where(terms > 0.0, terms, 1.0)])
        left = [
            rows[:holonomic],
            np.abs(at.Z) @ extents + np.abs(at.B) @ speed,
            np.abs(at.Aq) @ extents + np.abs(at.Av) @ speed,
            terms,
        ]
        forces = np.abs(inverse) @ (np.abs(at.K) @ extents + np.abs(at.C) @ speed)
        rounding = np.concatenate([forces / (pace * speed), np.concatenate(left) / sizes])
        scale = np.concatenate([pace * speed, sizes])
        every = np.concatenate([inverse @ parts[:nv], parts[nv:]])
        shape = (-1,) + (1,) * (every.ndim - 1)
        return every / scale.reshape(shape), 64.0 * float(np.finfo(float).eps) * rounding

    def ignorable(self, q: Array, z: Array) -> Mask:
        """Return the mask (nv,) of cyclic coordinates, on which no condition depends, by partials at random states near
        q."""
        model = self.model
        rng = np.random.default_rng(1)
        nothing = np.ones(model.nv, dtype=bool)
        for sample in filter(None, (self.sample(q, rng) for _ in range(4))):
            there, v, _, lam = sample
            at = self.at(there, v, np.zeros(model.nv), z, lam)
            by_q = np.concatenate([at.K, at.B[: len(at.position)], at.Z, at.Aq, at.Fq])
            J, _ = self.measured(at, by_q * self.extents)
            finite = np.all(np.isfinite(J), axis=0)
            sizes = np.max(np.abs(np.where(np.isfinite(J), J, 0.0)), axis=0)
            nothing &= finite & (sizes <= SUMMED * np.max(sizes))
        return nothing
