"""Time-discontinuous Galerkin steps in complex numbers on the tape: complex steps of whole runs.

Squire and Trapp 1998. The passes are written down with the whole linear map of a correction as one matrix for (theta,
v, z), from published coefficients and NumPy's own polynomials; K, C, M are terms of the tape in complex numbers, so
that nothing is shared with the stepper's C, second derivatives of the tape or the linearised steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from eomgen.lie import product
from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from tests.integrators.galerkin_in_numpy import ORDERS, SCHEMES
from tests.oracles.complex_runs import solved, times
from tests.oracles.evaluation import Array, tape_evaluator

TERMS = ("mass", "residual", "partials", "internal_rate", "internal_partials", "outputs")


@dataclass
class ComplexGalerkinRun:
    """A run of a scene by a method with steps of h, in complex numbers."""

    scene: Scene
    method: str
    h: float

    def __post_init__(self) -> None:
        self.system = derive(self.scene, TERMS)
        self._evaluate = tape_evaluator(self.system)
        self.nv, self.nz = self.system.nv, self.system.nz
        self.scheme = SCHEMES[self.method]
        powers = self.scheme.passes + min(self.scheme.degree, 2) - 1
        self.refined = ORDERS[self.method] > powers

    def outputs(self, steps: int, q: Array, v: Array, z: Array, p: Array) -> Array:
        """Return outputs (runs, steps + 1, size) of runs from complex states (runs, ...) with parameters (runs, np)."""
        self.p = np.asarray(p, dtype=complex)
        q, v, z = (np.asarray(part, dtype=complex) for part in (q, v, z))
        slope = self._accelerations(0.0, q, v, z)
        rows = [self._outputs(0.0, q, v, z)]
        for k in range(steps):
            q, v, z, slope = self._step(k * self.h, q, v, z, slope)
            rows.append(self._outputs((k + 1) * self.h, q, v, z))
        return np.stack(rows, axis=1)

    def _of(self, term: str, t: float, q: Array, v: Array, z: Array, a: Array) -> dict[str, Array]:
        blocks: dict[str, Any] = {"p": self.p, "t": np.full((len(q), 1), t), "q": q, "v": v, "z": z, "a": a}
        for name, function in (("base", "base"), ("u", "inputs")):
            if function in self.system.functions:
                blocks[name] = self._evaluate(function, {"p": self.p, "t": blocks["t"]})[name]
        return self._evaluate(term, blocks)

    def _rates(self, t: float, q: Array, v: Array, z: Array) -> Array:
        return self._of("internal_rate", t, q, v, z, 0.0 * v)["zdot"] if self.nz else np.zeros((len(q), 0), complex)

    def _accelerations(self, t: float, q: Array, v: Array, z: Array) -> Array:
        r = self._of("residual", t, q, v, z, 0.0 * v)["r"]
        return solved(self._of("mass", t, q, v, z, 0.0 * v)["M"], -r)

    def _outputs(self, t: float, q: Array, v: Array, z: Array) -> Array:
        return self._of("outputs", t, q, v, z, self._accelerations(t, q, v, z))["y"]

    def _step(self, t: float, q: Array, v: Array, z: Array, slope: Array) -> tuple[Array, Array, Array, Array]:
        s, h, nv, nz = self.scheme, self.h, self.nv, self.nz
        gain, m, factors = s.gamma * h, s.degree + 1, self.system.factors
        partials = self._of("partials", t, q, v, z, slope)
        M, C, K = (np.broadcast_to(partials[name], (len(q), nv, nv)) for name in "MCK")
        T = product.tangent(factors, gain * v)
        size = 2 * nv + nz
        whole = np.zeros((len(q), size, size), complex)  # of (d_theta, d_v, d_z) = right sides
        of_theta, of_v, of_z = slice(0, nv), slice(nv, 2 * nv), slice(2 * nv, size)
        whole[:, of_theta, of_theta], whole[:, of_theta, of_v] = np.eye(nv), -gain * T
        whole[:, of_v, of_theta], whole[:, of_v, of_v] = gain * K, M + gain * C
        whole[:, of_z, of_z] = np.eye(nz)
        if nz:
            rates = self._of("internal_partials", t, q, v, z, slope)
            whole[:, of_v, of_z] = gain * rates.get("Rz", 0.0)
            for name, part in (("Fq", of_theta), ("Fv", of_v), ("Fz", of_z)):
                whole[:, of_z, part] -= gain * rates.get(name, 0.0)

        def correction(right: Array) -> Array:
            of = np.concatenate([times(T, right[:, of_theta]), times(M, right[:, of_v]), right[:, of_z]], axis=1)
            return solved(whole, of)

        Y = np.zeros((m, len(q), size), complex)
        for number in range(s.passes):
            F = np.zeros_like(Y)
            for i, c in enumerate(s.nodes):
                theta, dv, dz = np.split(Y[i], [nv, 2 * nv], axis=1)
                at = (t + c * h, product.update(factors, q, theta) if number else q, v + dv, z + dz)
                a = np.einsum("j,jrk->rk", np.linalg.inv(s.integration)[i] / h, Y[:, :, of_v]) if number else 0.0 * v
                r = self._of("residual", *at, a)["r"]
                extra = np.zeros_like(a)
                if number and self.refined:
                    right = np.concatenate([0.0 * v, -solved(M, r), np.zeros((len(q), nz))], axis=1)
                    extra = correction(right)[:, of_v]
                    r = self._of("residual", *at, a + extra)["r"]
                rate = solved(product.tangent(factors, theta), v + dv) if number else v
                of_forces = a + extra - solved(M, r)
                F[i] = np.concatenate([rate, of_forces, self._rates(*at)], axis=1)
            matrix = s.integration if number else s.first
            right = np.einsum("ij,jrk->irk", np.linalg.inv(s.values), h * np.einsum("ij,jrk->irk", matrix, F) - Y)
            change = np.zeros_like(Y)
            carried = right[0]
            change[0] = correction(carried)
            for j in range(1, m):
                carried = right[j] - (change[j - 1] - carried)
                change[j] = correction(carried)
            Y = Y + np.einsum("ij,jrk->irk", s.values, change)
        theta, dv, dz = np.split(Y[-1], [nv, 2 * nv], axis=1)
        slope = np.einsum("j,jrk->rk", np.linalg.inv(s.integration)[-1] / h, Y[:, :, of_v])
        return product.update(factors, q, theta), v + dv, z + dz, slope
