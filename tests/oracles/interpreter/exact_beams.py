"""Equations of a geometrically exact beam's nodes in absolute coordinates: docs/scene.md, "Geometrically exact beams".

Strains are logarithms of relative poses, forces follow from the potential by series along unit twists.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.oracles.interpreter import jets
from tests.oracles.interpreter.jets import Jet, cross, dot, jet, rotated, rotation_vector
from tests.oracles.interpreter.machine import skew

Array = NDArray[Any]


def pose_logarithm(R: Jet, x: Jet) -> tuple[Jet, Jet]:
    """Rotation and translation parts of the logarithm of a pose."""
    phi = rotation_vector(R)
    angle = jets.sqrt(dot(phi, phi))
    half = 0.5 * angle
    factor = (1.0 - half * jets.cos(half) / jets.sin(half)) / (angle * angle)
    bent = cross(phi, x)
    return phi, x - 0.5 * bent + factor[..., None] * cross(phi, bent)


class ExactBeam:
    """Nodes of a straight uniform beam of the model ``cosserat`` with a diagonal stiffness."""

    def __init__(self, beam: Mapping[str, Any], gravity: Array, translated: bool) -> None:
        self.n, self.translated = beam["elements"], translated
        self.h = beam["length"] / self.n
        k, h = beam["stiffness"], self.h
        shear_y = 1.0 / (1.0 / k["shear_y"] + h**2 / (12.0 * k["bending_y"]))
        shear_z = 1.0 / (1.0 / k["shear_z"] + h**2 / (12.0 * k["bending_z"]))
        # Components: twist, curvature about y (deflection along z), about z, stretch, shear along y, along z.
        self.K = np.array([k["torsion"], k["bending_z"], k["bending_y"], k["stretch"], shear_y, shear_z])
        self.D = beam.get("stiffness_damping", 0.0) * self.K
        share = np.ones(self.n + 1) * h
        share[[0, -1]] = 0.5 * h
        self.masses, self.inertia = beam["mass_per_length"] * share, np.outer(share, beam["rotary_inertia"])
        self.gravity = gravity

    def _series(self, q: Array, v: Array) -> tuple[Jet, Jet]:
        """Poses of all nodes along velocities (..., nodes, 6), to first order."""
        quaternion, x = q[:, :4], q[:, 4:]
        R = Rotation.from_quat(np.roll(quaternion, -1, axis=1)).as_matrix()
        u = v[..., 3:] if self.translated else np.einsum("nij,...nj->...ni", R, v[..., 3:])
        return Jet(R, R @ skew(v[..., :3]), 0.0), Jet(x, u, 0.0)

    def strain_rates(self, q: Array, v: Array) -> Jet:
        R, x = self._series(q, v)
        T = R[..., :-1, :, :].transposed()
        phi, d = pose_logarithm(T @ R[..., 1:, :, :], rotated(T, x[..., 1:, :] - x[..., :-1, :]))
        strain = Jet(*(np.concatenate([a, b], axis=-1) for a, b in zip(phi.c, d.c, strict=True)))
        return strain / self.h - jet(np.array([0.0, 0, 0, 1, 0, 0]))

    def inverse_dynamics(self, q: Array, v: Array, a: Array) -> Array:
        """M a + h - Q, (nodes, 6)."""
        nodes = self.n + 1
        w, omega_rate = v[:, :3], a[:, :3]
        J = self.inertia
        moment = J * omega_rate + np.cross(w, J * w)
        linear = a[:, 3:] if self.translated else a[:, 3:] + np.cross(w, v[:, 3:])
        weight = self.masses[:, None] * self.gravity
        if not self.translated:
            weight = np.einsum("nji,nj->ni", Rotation.from_quat(np.roll(q[:, :4], -1, axis=1)).as_matrix(), weight)
        inertial = np.concatenate([moment, self.masses[:, None] * linear - weight], axis=1)
        now = self.strain_rates(q, v)
        load = self.h * (self.K * now.value + self.D * now.rate)
        units = np.eye(6 * nodes).reshape(-1, nodes, 6)
        elastic = np.einsum("mek,ek->m", self.strain_rates(q, units).rate, load).reshape(nodes, 6)
        return inertial + elastic

    @property
    def mass(self) -> Array:
        return np.diag(np.concatenate([self.inertia, np.repeat(self.masses[:, None], 3, axis=1)], axis=1).ravel())
