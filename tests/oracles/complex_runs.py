"""Generalized-alpha in complex numbers on the tape: complex steps of whole runs (Squire and Trapp 1998).

The discrete equations are written down once more and solved by Newton's iteration with differenced Jacobians, so that
nothing is shared with the stepper's C, the partials of the tape or the linearised steps.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from eomgen.integrators.families.generalized_alpha import GeneralizedAlpha
from eomgen.lie import product
from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from tests.oracles.evaluation import Array, tape_evaluator

TERMS = (
    *("mass", "residual", "internal_rate", "internal_partials", "constraint", "constraint_velocity"),
    *("constraint_jacobian", "constraint_bias", "outputs"),
)
STEP = 1e-30


@dataclass
class ComplexRun:
    """A run of a scene by a method with steps of h, in complex numbers.

    ``slope``: whether the start takes the rate of the accelerations, as it does unless the motion is too fast for it.
    """

    scene: Scene
    method: GeneralizedAlpha
    h: float
    slope: bool = True

    def __post_init__(self) -> None:
        self.system = derive(self.scene, TERMS)
        self._evaluate = tape_evaluator(self.system)
        self.nv, self.nz, self.nl = self.system.nv, self.system.nz, len(self.system.multipliers)
        self.nh = self.system.holonomic

    def outputs(self, steps: int, q: Array, v: Array, z: Array, p: Array) -> Array:
        """Return outputs (runs, steps + 1, size) of runs from complex states (runs, ...) with parameters (runs, np)."""
        self.p = np.asarray(p, dtype=complex)
        q, v, z = (np.asarray(part, dtype=complex) for part in (q, v, z))
        q, v = self._on_constraints(q, v, z)
        m = self.method
        am, af, zam = float(m.alpha_m), float(m.alpha_f), float(m.rate_alpha_m)
        vdot, lam, zdot = self._accelerations(0.0, q, v, z)
        a, r = vdot, zdot
        if self.slope:
            slope, z_slope = -3.0 * vdot, -3.0 * zdot
            for share, weight in ((0.5, 4.0), (1.0, -1.0)):
                s = share * self.h
                moved = product.update(self.system.factors, q, s * (v + 0.5 * s * vdot))
                z_moved = z
                if self.nz:
                    by_z = self._of("internal_partials", 0.0, q, v, z)["Fz"]
                    z_moved = z + solved(np.eye(self.nz) - s * by_z, s * zdot)
                other = self._accelerations(s, moved, v + s * vdot, z_moved)
                slope, z_slope = slope + weight * other[0], z_slope + weight * other[2]
            a, r = vdot + (am - af) * slope, zdot + (zam - af) * z_slope
        self._W = 1.0 / np.diagonal(self._of("mass", 0.0, q, v, z)["M"], axis1=-2, axis2=-1)
        rows = [self._outputs(0.0, q, v, z, vdot, lam)]
        for k in range(1, steps + 1):
            q, v, z, vdot, zdot, lam, a, r = self._step(k * self.h, (q, v, z, vdot, zdot, lam, a, r))
            rows.append(self._outputs(k * self.h, q, v, z, vdot, lam))
        return np.stack(rows, axis=1)

    def rest(self, q: Array, z: Array, p: Array) -> tuple[Array, Array]:
        """Return q and z (runs, ...) where forces balance and internal states stay, next to real q and z, with complex
        parameters (runs, np)."""
        self.p = np.asarray(p, dtype=complex)
        still, nv, held = np.zeros((len(p), self.nv)), self.nv, self.nl - self.nh
        q0, z0 = (np.repeat(np.array([part], complex), len(p), axis=0) for part in (q, z))

        def moved(x: Array) -> tuple[Array, Array, Array]:
            theta, lam, dz = np.split(x, [nv, nv + self.nl], axis=1)
            return product.update(self.system.factors, q0, theta), lam, z0 + dz

        def equations(x: Array) -> Array:
            at, lam, at_z = moved(x)
            parts = [self._of("residual", 0.0, at, still, at_z, a=still, lam=lam)["r"]]
            if self.nl:
                parts.append(self._of("constraint", 0.0, at, still, at_z)["Phi"])
                parts.append(np.zeros((len(p), held)))
            if self.nz:
                parts.append(self._of("internal_rate", 0.0, at, still, at_z)["zdot"])
            return np.concatenate(parts, axis=1)

        x = np.zeros((len(p), nv + self.nl + self.nz), complex)
        for _ in range(12):
            x = x - solved(_differenced(equations, x), equations(x))
        at, _, at_z = moved(x)
        return at, at_z

    def _blocks(self, t: float, q: Array, v: Array, z: Array) -> dict[str, Any]:
        blocks: dict[str, Any] = {"p": self.p, "t": np.full((len(q), 1), t), "q": q, "v": v, "z": z}
        for name, function in (("base", "base"), ("u", "inputs")):
            if function in self.system.functions:
                blocks[name] = self._evaluate(function, {"p": self.p, "t": blocks["t"]})[name]
        return blocks

    def _of(self, term: str, t: float, q: Array, v: Array, z: Array, **more: Array) -> dict[str, Array]:
        return self._evaluate(term, {**self._blocks(t, q, v, z), **more})

    def _outputs(self, t: float, q: Array, v: Array, z: Array, vdot: Array, lam: Array) -> Array:
        return self._of("outputs", t, q, v, z, a=vdot, lam=lam)["y"]

    def _accelerations(self, t: float, q: Array, v: Array, z: Array) -> tuple[Array, Array, Array]:
        none = {"a": np.zeros((len(q), self.nv)), "lam": np.zeros((len(q), self.nl))}
        r = self._of("residual", t, q, v, z, **none)["r"]
        M = self._of("mass", t, q, v, z)["M"]
        zdot = self._of("internal_rate", t, q, v, z)["zdot"] if self.nz else np.zeros((len(q), 0), complex)
        if not self.nl:
            return solved(M, -r), np.zeros((len(q), 0), complex), zdot
        B, g = self._of("constraint_jacobian", t, q, v, z)["B"], self._of("constraint_bias", t, q, v, z)["g"]
        whole = np.zeros((len(q), self.nv + self.nl, self.nv + self.nl), complex)
        whole[:, : self.nv, : self.nv], whole[:, self.nv :, : self.nv] = M, B
        whole[:, : self.nv, self.nv :] = np.swapaxes(B, 1, 2)
        x = solved(whole, -np.concatenate([r, g], axis=1))
        return x[:, : self.nv], x[:, self.nv :], zdot

    def _on_constraints(self, q: Array, v: Array, z: Array) -> tuple[Array, Array]:
        if not self.nl:
            return q, v
        for _ in range(8):
            M, B = self._of("mass", 0.0, q, v, z)["M"], self._of("constraint_jacobian", 0.0, q, v, z)["B"]
            by_row = np.linalg.solve(M, np.swapaxes(B, 1, 2))
            if self.nh:
                held, rows = B[:, : self.nh], by_row[:, :, : self.nh]
                off = self._of("constraint", 0.0, q, v, z)["Phi"]
                q = product.update(self.system.factors, q, -times(rows, solved(held @ rows, off)))
        w = self._of("constraint_velocity", 0.0, q, v, z)["w"]
        return q, v - times(by_row, solved(B @ by_row, w))

    def _step(self, t: float, state: tuple[Array, ...]) -> tuple[Array, ...]:
        q, v, z, vdot, zdot, lam, a, r = state
        m, h, nv, nl, nh = self.method, self.h, self.nv, self.nl, self.nh
        am, af, beta, gamma = (float(x) for x in (m.alpha_m, m.alpha_f, m.beta, m.gamma))
        zam, zgamma = float(m.rate_alpha_m), float(m.rate_gamma)
        held = np.zeros((len(q), 0, nv))
        if nh:
            held = self._of("constraint_jacobian", t - h, q, v, z)["B"][:, :nh]

        def end(x: Array) -> tuple[Array, ...]:
            a1, lam1, eta, r1 = np.split(x, [nv, nv + nl, nv + nl + nh], axis=1)
            D = v + h * ((0.5 - beta) * a + beta * a1) - self._W * times(np.swapaxes(held, 1, 2), eta)
            return (
                product.update(self.system.factors, q, h * D),
                v + h * ((1 - gamma) * a + gamma * a1),
                z + h * ((1 - zgamma) * r + zgamma * r1),
                ((1 - am) * a1 + am * a - af * vdot) / (1 - af),
                ((1 - zam) * r1 + zam * r - af * zdot) / (1 - af),
                lam1,
                a1,
                r1,
            )

        def equations(x: Array) -> Array:
            q1, v1, z1, vdot1, zdot1, lam1, *_ = end(x)
            parts = [self._of("residual", t, q1, v1, z1, a=vdot1, lam=lam1)["r"]]
            if self.nz:
                parts.append(zdot1 - self._of("internal_rate", t, q1, v1, z1)["zdot"])
            if nl:
                parts.append(self._of("constraint", t, q1, v1, z1)["Phi"] / h**2)
                parts.append(self._of("constraint_velocity", t, q1, v1, z1)["w"] / h)
            return np.concatenate(parts, axis=1)

        x = np.concatenate([a, lam, np.zeros((len(q), nh)), r], axis=1).astype(complex)
        jacobian = _differenced(equations, x)
        for _ in range(30):
            change = solved(jacobian, equations(x))
            x = x - change
            largest = np.max(np.abs(change.imag) / (np.max(np.abs(x.imag), axis=1, keepdims=True) + 1e-300))
            if largest < 2e-15 and np.max(np.abs(change.real)) < 2e-15 * (np.max(np.abs(x)) + 1.0):
                break
        return end(x)


def solved(A: Array, b: Array) -> Array:
    """Return A^-1 b, (runs, n)."""
    found: Array = np.linalg.solve(A, b[..., np.newaxis])[..., 0]
    return found


def times(A: Array, x: Array) -> Array:
    """Return A x, (runs, n)."""
    found: Array = (A @ x[..., np.newaxis])[..., 0]
    return found


def _differenced(function: Callable[[Array], Array], x: Array) -> Array:
    """Return the Jacobian at the real part, (runs, n, n)."""
    real, columns = x.real.astype(complex), []
    for k in range(x.shape[1]):
        e = np.zeros_like(x)
        e[:, k] = 1e-4 * (1.0 + np.abs(real[:, k]))
        columns.append(((function(real + e) - function(real - e)) / (2.0 * e[:, k : k + 1])).real)
    return np.stack(columns, axis=-1)


def derivatives(
    run: ComplexRun, steps: int, start: Mapping[str, Array], p: Array, by: Sequence[tuple[str, int]]
) -> tuple[Array, Array]:
    """Return outputs (steps + 1, size), and their derivatives (steps + 1, size, directions) by components of p, q
    (left-trivialised), v or z."""
    blocks = {name: np.repeat(np.array([value], complex), len(by), axis=0) for name, value in start.items()}
    blocks["p"] = np.repeat(np.array([p], complex), len(by), axis=0)
    theta = np.zeros((len(by), run.nv), complex)
    for number, (block, index) in enumerate(by):
        (theta if block == "q" else blocks[block])[number, index] += 1j * STEP
    blocks["q"] = product.update(run.system.factors, blocks["q"], theta)
    found = run.outputs(steps, blocks["q"], blocks["v"], blocks["z"], blocks["p"])
    return found[0].real, np.moveaxis(found.imag / STEP, 0, -1)
