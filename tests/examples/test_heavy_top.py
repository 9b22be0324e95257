"""The fast heavy top in five formulations: errors and orders as published analyses find them, and the published
positions."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import eomgen
from eomgen import Model, Solution
from tests.anchors import anchor

FOLDER = Path(__file__).parents[2] / "examples" / "heavy_top"
FORMULATIONS = ("joint_coordinates", "se3", "se3_index3", "r3xso3", "r3xso3_index3")
AT_1, AT_2 = anchor("heavy_top_places").reference.reshape(2, 3)
#: lam of Phi = X - R^T x at t = 0 and 1 s
LAMBDA_0 = anchor("heavy_top_multipliers").reference
LAMBDA_1 = np.array([-58.274563745, -646.558311914, -409.441408863])
MASS, ARM, GRAVITY = 15.0, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -9.81])
INERTIA = np.array([15.234375, 0.46875, 15.234375])  # about the pivot

Array = NDArray[np.float64]


def _model(name: str) -> Model:
    return eomgen.build(FOLDER / f"{name}.toml")


def _rotations(quaternions: Array) -> Rotation:
    return Rotation.from_quat(np.asarray(quaternions)[:, [1, 2, 3, 0]])


def _angular_acceleration(quaternion: Array, omega: Array) -> Array:
    weight = MASS * _rotations(quaternion[np.newaxis]).inv().apply(GRAVITY)[0]
    return (np.cross(ARM, weight) - np.cross(omega, INERTIA * omega)) / INERTIA


def _rates(_: float, y: Array) -> Array:
    (w, x, y_, z), (a, b, c) = y[:4], y[4:]
    turn = 0.5 * np.array(
        [-x * a - y_ * b - z * c, w * a + y_ * c - z * b, w * b + z * a - x * c, w * c + x * b - y_ * a]
    )
    return np.concatenate([turn, _angular_acceleration(y[:4], y[4:])])


@cache
def reference() -> tuple[Rotation, Array, Array]:
    """Return rotations, angular velocities and multipliers at t = j/16 s, by Euler's equations about the pivot."""
    times = np.arange(17) / 16.0
    start = [1.0, 0.0, 0.0, 0.0, 0.0, 150.0, -4.61538]
    solution = solve_ivp(_rates, (0.0, 1.0), start, method="DOP853", rtol=1e-13, atol=1e-13, t_eval=times)
    assert solution.success
    R, omega = _rotations(solution.y[:4].T), solution.y[4:].T
    change = np.array([_angular_acceleration(y[:4], y[4:]) for y in solution.y.T])
    acceleration = R.apply(np.cross(change, ARM) + np.cross(omega, np.cross(omega, ARM)))
    return R, omega, R.inv().apply(MASS * (acceleration - GRAVITY))


def errors(run: Solution) -> Array:
    """Return the largest errors of rotation angle, position, angular velocity and multipliers over t = j/16 s."""
    R, omega, multipliers = reference()
    every = (len(run.t) - 1) // 16
    found = _rotations(run.q[::every, :4])
    place, spin = run.outputs["centre_of_mass"][::every], run.v[::every, :3]
    lam = run.multipliers[::every] if run.multipliers.size else multipliers
    return np.array(
        [
            (R.inv() * found).magnitude().max(),
            np.linalg.norm(place - R.apply(ARM), axis=1).max(),
            np.linalg.norm(spin - omega, axis=1).max(),
            np.linalg.norm(lam - multipliers, axis=1).max(),
        ]
    )


@pytest.mark.long
@pytest.mark.slow
def test_reference_meets_the_published_digits() -> None:
    R, _, multipliers = reference()
    np.testing.assert_allclose(R[16].apply(ARM), AT_1, atol=1e-10)
    np.testing.assert_allclose(multipliers[[0, 16]], [LAMBDA_0, LAMBDA_1], atol=1e-6)


#: formulation -> errors of rotation angle, position, angular velocity, multipliers at steps of 2^-11 and 2^-13 s. Those
#: of r3xso3 are ours: published ones (1.59e-3, 1.11e-3, 3.26e-3, 0.468) move positions by B^T eta, ours by W B^T eta.
ERRORS = {
    "joint_coordinates": ([3.21e-2, 1.97e-2, 3.00e-1, 0.0], [2.01e-3, 1.23e-3, 1.87e-2, 0.0]),
    "se3": ([3.21e-2, 1.97e-2, 3.00e-1, 2.14e1], [2.01e-3, 1.23e-3, 1.87e-2, 1.34]),
    "se3_index3": ([3.21e-2, 1.97e-2, 3.00e-1, 2.14e1], [2.01e-3, 1.23e-3, 1.87e-2, 1.34]),
    "r3xso3": ([4.27e-4, 2.94e-4, 4.08e-3, 3.11e-1], [2.67e-5, 1.84e-5, 2.55e-4, 1.95e-2]),
    "r3xso3_index3": ([2.50e-3, 1.73e-3, 2.42e-2, 1.76], [1.56e-4, 1.08e-4, 1.51e-3, 1.10e-1]),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMULATIONS)
def test_errors_and_orders_of_each_formulation(name: str) -> None:
    model = _model(name)
    runs = {exponent: model.simulate(1.0, 2.0**-exponent) for exponent in (10, 11, 12, 13)}
    assert all(run.success and not run.stats["halvings"] for run in runs.values())
    found = {exponent: errors(run) for exponent, run in runs.items()}
    for exponent, expected in zip((11, 13), ERRORS[name], strict=True):
        np.testing.assert_allclose(found[exponent], expected, rtol=0.05)
    measured = found[10] > 0.0  # no multipliers in joint coordinates
    for exponent in (11, 12, 13):
        slopes = np.log2(found[exponent - 1][measured] / found[exponent][measured])
        np.testing.assert_allclose(slopes, 2.0, atol=0.1)


@pytest.mark.slow_except("r3xso3")
@pytest.mark.parametrize("name", [name for name in FORMULATIONS if name != "joint_coordinates"])
def test_start_has_the_published_multipliers_and_constraints_stay_closed(name: str) -> None:
    run = _model(name).simulate(0.2, 2.0**-13)
    if name == "r3xso3":
        anchor("heavy_top_multipliers").check(run.multipliers[0])
    np.testing.assert_allclose(run.multipliers[0], LAMBDA_0, atol=1e-8)
    assert run.stats["max_constraint"] < 1e-13
    velocity = run.stats["max_constraint_velocity"]
    if name == "r3xso3_index3":
        assert 1e-5 < velocity < 1e-3  # index 3 does not look at velocities; SE(3) keeps this joint all the same
    else:
        assert velocity < 1e-8


@pytest.mark.slow
def test_joint_coordinates_reach_the_published_digits_with_runge_kutta_munthe_kaas() -> None:
    model = _model("joint_coordinates")
    runs = [model.simulate(2.0, step, method="rk4") for step in (1e-4, 5e-5)]
    coarse, fine = (float(np.linalg.norm(run.outputs["centre_of_mass"][-1] - AT_2)) for run in runs)
    assert fine < 5e-9
    assert coarse / fine == pytest.approx(16.0, rel=0.1)  # fourth order
    assert np.linalg.norm(runs[1].outputs["centre_of_mass"][20000] - AT_1) < 5e-9
    anchor("heavy_top_places").check(runs[1].outputs["centre_of_mass"][[20000, 40000]])
    np.testing.assert_allclose(runs[1].v[-1], [0.12223321948, 150.0, -5.85562458920], atol=5e-8)
    assert runs[1].outputs["energy"] == pytest.approx(np.full(40001, 5435.696790866), rel=1e-11)
