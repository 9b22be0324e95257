"""What a steady motion has to meet, as values and partials of the compiled functions, scaled so that all are accelerations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.errors import Problem, UsageError
from eomgen.lie.product import update
from eomgen.runtime.arguments import check_finite, check_name, components, numbers
from eomgen.runtime.coordinates import elastic_amplitudes
from eomgen.runtime.terms import Inputs

if TYPE_CHECKING:
    from eomgen.runtime.model import Model

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: A column of partials below this part of the largest is zero.
_NOTHING = 1e-12
_SAMPLES = 4


@dataclass(frozen=True)
class Unknowns:
    """Numbers of the components of v that are unknown in q (``eta``) and in v (``dv``), then internal states and multipliers."""

    eta: NDArray[np.intp]
    dv: NDArray[np.intp]
    states: int
    multipliers: int

    def split(self, change: Array, nv: int) -> tuple[Array, Array, Array, Array]:
        """Return changes of q (increment), v, z and multipliers."""
        ends = np.cumsum([len(self.eta), len(self.dv), self.states])
        by_eta, by_v, dz, dlam = np.split(change, ends)
        eta, dv = np.zeros(nv), np.zeros(nv)
        eta[self.eta], dv[self.dv] = by_eta, by_v
        return eta, dv, dz, dlam

    def turns(self, change: Array, turning: Mask) -> Array:
        """Return the changes of angles among those of q."""
        result: Array = change[: len(self.eta)][turning[self.eta]]
        return result


@dataclass(frozen=True)
class Conditions:
    """The conditions of a model at parameters, a time and inputs."""

    model: Model
    parameters: Array
    t: float
    u: Inputs

    @property
    def turning(self) -> Mask:
        return np.array([unit == "rad/s" for unit in self.model.v_units], dtype=bool)

    def around(self, change: Array) -> Array:
        """Return a random change of q, (nv,), with elastic coordinates as small as beams are meant to deform."""
        amplitudes = np.array(elastic_amplitudes(self.model.factors, self.model.scene.bodies))
        elastic = np.isfinite(amplitudes)
        small: Array = np.where(elastic, np.where(elastic, amplitudes, 0.0) * np.clip(change, -1.0, 1.0), change)
        return small

    def after(self, seconds: float) -> Conditions:
        """Return the conditions at a later time."""
        return replace(self, t=self.t + seconds)

    def _given(self, **more: Any) -> dict[str, Any]:
        return {"t": self.t, "u": self.u, "parameters": self.parameters, **more}

    def _term(self, name: str, q: Array, v: Array, **more: Any) -> dict[str, Array]:
        return self.model.evaluate(name, q, v, np.zeros(self.model.nv), **self._given(**more))

    def _one(self, name: str, q: Array, v: Array, **more: Any) -> Array:
        return next(iter(self._term(name, q, v, **more).values()))

    def root_of_mass(self, q: Array) -> Array:
        """Return L of M = L L^T, by which forces become comparable. Raises numpy.linalg.LinAlgError."""
        return np.asarray(np.linalg.cholesky(self.model.mass(q, parameters=self.parameters)), dtype=float)

    def accelerations(self, q: Array, v: Array, z: Array, lam: Array) -> Array:
        """Return M^-1 r, (nv,): minus the accelerations that nothing balances."""
        r = self._one("residual", q, v, z=z, multipliers=lam)
        return np.asarray(np.linalg.solve(self.model.mass(q, parameters=self.parameters), r), dtype=float)

    def values(self, q: Array, v: Array, z: Array, lam: Array, L: Array) -> Array:
        """Return all that has to be zero, forces divided by a root of the inertia matrix."""
        model = self.model
        parts = [np.linalg.solve(L, self._one("residual", q, v, z=z, multipliers=lam))]
        if model.multipliers:
            if model.functions.sizes["holonomic"]:
                parts.append(self._one("constraint", q, v))
            parts += [self._one("constraint_velocity", q, v), self._one("constraint_bias", q, v)]
        if model.nz:
            parts.append(self._one("internal_rate", q, v, z=z))
        return np.concatenate(parts)

    def multipliers(self, q: Array, v: Array, z: Array, L: Array) -> Array:
        """Return the multipliers that leave least of the forces unbalanced."""
        rest = np.zeros(len(self.model.multipliers))
        if not len(rest):
            return rest
        r = np.linalg.solve(L, self._one("residual", q, v, z=z, multipliers=rest))
        B = np.linalg.solve(L, self._one("constraint_jacobian", q, v).T)
        if not (np.all(np.isfinite(r)) and np.all(np.isfinite(B))):
            return rest
        return np.asarray(np.linalg.lstsq(B, -r, rcond=None)[0], dtype=float)

    def size(self, q: Array, v: Array, z: Array, lam: Array, L: Array) -> float:
        """Return how large the terms are whose differences have to vanish."""
        K, C, _ = self._term("partials", q, v, z=z, multipliers=lam).values()
        terms = np.sum(np.abs(K), axis=1) + np.abs(C) @ np.abs(v)
        return float(np.max(np.abs(np.linalg.inv(L)) @ terms, initial=0.0))

    def jacobian(self, q: Array, v: Array, z: Array, lam: Array, unknowns: Unknowns) -> Array:
        """Return the partials of ``values`` in the unknowns, with the root of the inertia matrix held as it is at q."""
        model = self.model
        L = self.root_of_mass(q)
        K, C, _ = self._term("partials", q, v, z=z, multipliers=lam).values()
        nv, nz, rows = model.nv, model.nz, len(model.multipliers)
        blocks = [[K, C, np.zeros((nv, nz)), np.zeros((nv, rows))]]
        if rows:
            B = self._one("constraint_jacobian", q, v)
            Z = self._one("velocity_partials", q, v)
            Aq, Av = self._term("acceleration_partials", q, v).values()
            blocks[0][3] = B.T
            holonomic = B[: model.functions.sizes["holonomic"]]
            for by_q, by_v in ((holonomic, 0.0 * holonomic), (Z, B), (Aq, Av)):
                blocks.append([by_q, by_v, np.zeros((len(by_q), nz)), np.zeros((len(by_q), rows))])
        if nz:
            Rz, Fq, Fv, Fz = self._term("internal_partials", q, v, z=z).values()
            blocks[0][2] = Rz
            blocks.append([Fq, Fv, Fz, np.zeros((nz, rows))])
        blocks[0] = [np.linalg.solve(L, part) for part in blocks[0]]
        by_q, by_v, by_z, by_lam = (np.concatenate(column) for column in zip(*blocks, strict=True))
        return np.concatenate([by_q[:, unknowns.eta], by_v[:, unknowns.dv], by_z, by_lam], axis=1)

    def ignorable(self, q: Array, z: Array) -> tuple[Mask, float]:
        """Return on which coordinates nothing depends, (nv,), by partials at arbitrary states, and a typical acceleration."""
        model = self.model
        rng = np.random.default_rng(1)
        every = Unknowns(np.arange(model.nv), np.arange(0), 0, 0)
        nothing, typical = np.ones(model.nv, dtype=bool), 0.0
        for _ in range(_SAMPLES):
            at = update(model.factors, q, self.around(rng.normal(0.0, 0.5, model.nv)))
            v, lam = rng.normal(0.0, 1.0, model.nv), rng.normal(0.0, 1.0, len(model.multipliers))
            J = self.jacobian(at, v, z, lam, every)[:, : model.nv]
            finite = np.all(np.isfinite(J), axis=0)
            sizes = np.max(np.abs(np.where(np.isfinite(J), J, 0.0)), axis=0, initial=0.0)
            nothing &= finite & (sizes <= _NOTHING * max(float(np.max(sizes, initial=0.0)), 1e-300))
            unbalanced = self.accelerations(at, v, z, lam)
            typical = max(typical, float(np.max(np.abs(unbalanced[np.isfinite(unbalanced)]), initial=0.0)))
        return nothing, typical


def named_values(
    model: Model, q: Array, velocities: Mapping[str, float] | None, coordinates: Mapping[str, ArrayLike] | None
) -> tuple[Array, Mask, Array, Mask]:
    """Return q with the coordinates given put in, which components are held there, v, and which of its components are given.

    Raises
    ------
    UsageError
        Unknown names, components of a rotation, values that are not finite numbers or not as many as are needed.
    """
    q, v = q.copy(), np.zeros(model.nv)
    held_q, held_v = np.zeros(model.nv, dtype=bool), np.zeros(model.nv, dtype=bool)
    names = [name.removeprefix("v.") for name in model.v_names]
    for what, given in (("velocities", velocities), ("coordinates", coordinates)):
        if given is not None and not isinstance(given, Mapping):
            raise UsageError(Problem(what, f"a mapping is needed, not {type(given).__name__}", f'{what}={{"{names[0]}": 2.0}}'))
    for name, value in (velocities or {}).items():
        check_name("component", str(name).removeprefix("v."), names)
        k = names.index(name.removeprefix("v."))
        v[k], held_v[k] = _number(f"velocity {name}", value), True
    joints = {factor.name: factor for factor in model.factors}
    single = {
        label: (factor.q_start + k, factor.v_start + k)
        for factor in model.factors
        if factor.group == "R"
        for k, label in enumerate(names[factor.v])
    }
    for name, numbers_of in (coordinates or {}).items():
        if name in single:
            place, component = single[name]
            q[place], held_q[component] = _number(f"coordinate {name}", numbers_of), True
            continue
        check_name("coordinate or joint", name, [*single, *(joint for joint in joints if joint not in single)])
        factor = joints[name]
        q[factor.q] = components(f"coordinates {name}", numbers_of, factor.q_size)
        held_q[factor.v] = True
    check_finite("coordinates", q, model.q_names)
    q = model._terms.configuration(q)
    return q, held_q, v, held_v


def _number(name: str, value: ArrayLike) -> float:
    array = numbers(name, value)
    if array.ndim:
        raise UsageError(Problem(name, f"one number is needed, not an array of shape {array.shape}"))
    check_finite(name, array)
    return float(array)
