"""The heavy top of the Lie group literature, fast and slow, in every formulation, with what its motion is held against.

Bruls and Cardona, J. Comput. Nonlinear Dyn. 5 (2010) 031002; Bruls, Arnold and Cardona, IDETC 2011.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

import eomgen
from eomgen.pipeline.model import Model
from eomgen.results.solution import Solution

Array = NDArray[np.float64]
MASS, GRAVITY = 15.0, 9.81
INERTIA = np.array([0.234375, 0.46875, 0.234375])
ARM = np.array([0.0, 1.0, 0.0])
FAST, SLOW = (0.0, 150.0, -4.61538), (0.0, 1.5, -0.0461538)
#: Of the fast top at t = 1 s, from a Taylor series with 40 digits.
CENTER_AT_1 = np.array([0.17334396409838605, 0.6400885920705688, -0.7484907911335813])
REFERENCE_STEPS_PER_SECOND = 2**17


@dataclass(frozen=True)
class Formulation:
    """Coordinates and method under a name for tables; ``group`` is empty in joint coordinates."""

    name: str
    group: str
    method: str

    def model(self, spin: Sequence[float] = FAST) -> Model:
        return _built(self.group, tuple(spin), self.method)


JOINT_RK4 = Formulation("SO(3) joint, RK4", "", "rk4")
JOINT = Formulation("SO(3) joint", "", "generalized_alpha")
SE3 = Formulation("SE(3) stabilised", "SE3", "generalized_alpha")
SE3_INDEX3 = Formulation("SE(3) index 3", "SE3", "generalized_alpha_index3")
R3XSO3 = Formulation("R3xSO(3) stabilised", "R3xSO3", "generalized_alpha")
R3XSO3_INDEX3 = Formulation("R3xSO(3) index 3", "R3xSO3", "generalized_alpha_index3")
FORMULATIONS = (JOINT_RK4, JOINT, SE3, SE3_INDEX3, R3XSO3, R3XSO3_INDEX3)
VARIANTS = tuple(
    Formulation(f"{one.name} {name}".replace("stabilised ", ""), one.group, f"{one.method}_{name.lower()}")
    for one in (JOINT, SE3, R3XSO3, R3XSO3_INDEX3)
    for name in ("F1", "F2", "spatial")
)


def scene(group: str = "", spin: Sequence[float] = FAST) -> eomgen.Scene:
    """Return the top on its ball joint; with a ``group``, its body is free and the joint a constraint."""
    builder = eomgen.SceneBuilder("top", gravity=[0, 0, -GRAVITY], coordinates="absolute" if group else "joint")
    options = {"group": group} if group else {}
    builder.body("top", MASS, center_of_mass=ARM.tolist(), inertia=INERTIA.tolist(), **options)
    builder.joint("pivot", "spherical", "base", "top", initial={"velocity": list(spin)})
    return builder.simulation(rho_inf=0.9).build()


@cache
def _built(group: str, spin: tuple[float, ...], method: str) -> Model:
    return eomgen.build(scene(group, spin), method=method)


def rotations(quaternions: Array) -> Array:
    """Return matrices (..., 3, 3) from body to world axes."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


@dataclass(frozen=True)
class Motion:
    """What is compared.

    Attributes
    ----------
    center : (..., 3), of mass, in world axes, m
    quaternion : (..., 4)
    multipliers : (..., 3), in body axes, N
    """

    center: Array
    quaternion: Array
    multipliers: Array


def motion(model: Model, q: Array, v: Array, vdot: Array, multipliers: Array | None = None) -> Motion:
    """Return the top's motion from the states of any formulation; multipliers that there are none of follow from the
    motion."""
    pose = model.pose("top", q)
    R = rotations(pose[..., :4])
    if multipliers is None or not multipliers.shape[-1]:
        spin = v[..., :3]
        acceleration = np.cross(vdot[..., :3], ARM) + np.cross(spin, np.cross(spin, ARM))
        multipliers = MASS * (acceleration + GRAVITY * R[..., 2, :])
    return Motion(pose[..., 4:] + R @ ARM, pose[..., :4], multipliers)


@cache
def reference(marks: int, spin: tuple[float, ...] = FAST, duration: float = 1.0) -> Motion:
    """Return the motion at the ends of ``marks`` equal intervals, by RK4 with steps so small that round-off is left."""
    model = JOINT_RK4.model(spin)
    steps = int(REFERENCE_STEPS_PER_SECOND * duration)
    solution = model.simulate(
        duration, duration / steps, method="rk4", record_every=steps // marks, error_estimate=False
    )
    return of_solution(model, solution)


def of_solution(model: Model, solution: Solution) -> Motion:
    """Return the motion at the recorded times. Raises RuntimeError when the run stopped."""
    if not solution.success:
        raise RuntimeError(solution.message)
    return motion(model, solution.q, solution.v, solution.a, solution.multipliers)


def errors(found: Motion, expected: Motion) -> tuple[float, float, float]:
    """Return the largest distance of the centers, rad of the rotations between, and distance of the multipliers."""
    cosine = np.abs(np.sum(found.quaternion * expected.quaternion, axis=-1))
    difference = np.minimum(
        np.linalg.norm(found.quaternion - expected.quaternion, axis=-1),
        np.linalg.norm(found.quaternion + expected.quaternion, axis=-1),
    )
    angle = np.where(
        cosine > 0.9, 4.0 * np.arcsin(np.minimum(1.0, 0.5 * difference)), 2.0 * np.arccos(np.minimum(1.0, cosine))
    )
    position = np.linalg.norm(found.center - expected.center, axis=-1)
    multiplier = np.linalg.norm(found.multipliers - expected.multipliers, axis=-1)
    return float(np.max(position)), float(np.max(angle)), float(np.max(multiplier))


def vertical_momentum(model: Model, q: Array, v: Array) -> Array:
    """Return the angular momentum about the world's vertical through the pivot, which the motion keeps."""
    pose, twist = model.pose("top", q), model.twist("top", q, v)
    R, spin = rotations(pose[..., :4]), twist[..., :3]
    arm = np.einsum("...ji,...j->...i", R, pose[..., 4:]) + ARM
    momentum = INERTIA * spin + MASS * np.cross(arm, twist[..., 3:] + np.cross(spin, ARM))
    vertical: Array = np.sum(R[..., 2, :] * momentum, axis=-1)
    return vertical
