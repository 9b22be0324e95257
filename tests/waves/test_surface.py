"""The surface: at labels, and above fixed points, where it is that of the classical theories."""

from __future__ import annotations

import math

import numpy as np
import pytest

from eomgen.errors import NumericalError
from eomgen.waves import Components, Sea
from tests.waves.residuals import three_waves

SPREAD = ((0.05, 0.01), (0.055, -0.035), (-0.02, 0.075))


EQUAL_LENGTHS = ((0.05, 0.0), (0.03, 0.04), (0.06, 0.02))


@pytest.fixture(scope="module", params=[SPREAD, EQUAL_LENGTHS], ids=["spread", "equal lengths"])
def sea(request: pytest.FixtureRequest) -> Sea:
    """Three waves; two of equal lengths drift against one another."""
    return Sea(three_waves(0.06, request.param), 20.0)


LABELS = np.random.default_rng(4).uniform(-100.0, 100.0, (9, 2))


def test_derivatives_by_labels_are_those_of_positions(sea: Sea) -> None:
    first, second = sea.derivatives(LABELS, 3.0)
    d = 1e-3
    for axis, move in enumerate(d * np.eye(2)):
        there, here = sea.motion(LABELS + move, 3.0), sea.motion(LABELS - move, 3.0)
        assert first[:, :, axis] == pytest.approx((there.position - here.position) / (2.0 * d), abs=1e-9)
        change = (sea.derivatives(LABELS + move, 3.0)[0] - sea.derivatives(LABELS - move, 3.0)[0]) / (2.0 * d)
        assert second[:, :, axis : axis + 2] == pytest.approx(change, abs=1e-9)


def test_fixed_points_have_the_motion_of_the_particles_there(sea: Sea) -> None:
    """In the shape of the points; the surface rises by w less the slope along the motion."""
    x, y, t, d = *np.meshgrid([-20.0, 5.0, 9.0], [1.0, 30.0]), 3.0, 1e-4
    there = sea.at(np.column_stack((x.ravel(), y.ravel())), t)
    assert np.array_equal(sea.velocity(x, y, t), there.velocity.reshape(2, 3, 3))
    assert np.array_equal(sea.acceleration(x, y, t), there.acceleration.reshape(2, 3, 3))
    slope = sea.surface(sea.labels_at(np.column_stack((x.ravel(), y.ravel())), t), t).slope.reshape(2, 3, 2)
    u, v, w = np.moveaxis(sea.velocity(x, y, t), -1, 0)
    rising = (sea.elevation(x, y, t + d) - sea.elevation(x, y, t - d)) / (2.0 * d)
    assert rising == pytest.approx(w - u * slope[..., 0] - v * slope[..., 1], abs=1e-7)


def test_slopes_and_curvature_are_those_of_elevations(sea: Sea) -> None:
    points, t, d = LABELS[:5], 3.0, 1e-2
    labels = sea.labels_at(points, t)
    assert sea.motion(labels, t).position[:, :2] == pytest.approx(points, abs=1e-8)
    grid = np.array([[sea.elevation(*(points + np.array([i, j]) * d).T, t) for j in (-1, 0, 1)] for i in (-1, 0, 1)])
    zx, zy = (grid[2, 1] - grid[0, 1]) / (2.0 * d), (grid[1, 2] - grid[1, 0]) / (2.0 * d)
    zxx, zyy = (
        (grid[2, 1] + grid[0, 1] - 2.0 * grid[1, 1]) / d**2,
        (grid[1, 2] + grid[1, 0] - 2.0 * grid[1, 1]) / d**2,
    )
    zxy = (grid[2, 2] + grid[0, 0] - grid[0, 2] - grid[2, 0]) / (4.0 * d**2)
    steep = 1.0 + zx**2 + zy**2
    mean = ((1.0 + zy**2) * zxx - 2.0 * zx * zy * zxy + (1.0 + zx**2) * zyy) / (2.0 * steep**1.5)
    found = sea.surface(labels, t)
    assert found.slope == pytest.approx(np.column_stack((zx, zy)), abs=1e-6)
    assert found.curvature == pytest.approx(mean, abs=1e-5)
    assert np.all(found.jacobian > 0.0)


def _eulerian(x: np.ndarray, k: np.ndarray, a: np.ndarray, phase: np.ndarray, t: float, order: int) -> np.ndarray:
    """Elevation of deep water by Stokes's expansion at fixed points."""
    theta = k[:, None] * x - np.sqrt(9.81 * k)[:, None] * t + phase[:, None]
    total = (a[:, None] * np.cos(theta)).sum(axis=0)
    for i in range(len(k) if order == 2 else 0):
        for j in range(len(k)):
            pair = 0.25 * a[i] * a[j]
            total = total + pair * (k[i] + k[j]) * np.cos(theta[i] + theta[j])
            total = total - pair * abs(k[i] - k[j]) * np.cos(theta[i] - theta[j])
    return np.asarray(total)


def test_fixed_points_see_stokes_waves_to_third_order() -> None:
    k, x, t = np.array([0.05, 0.055, 0.08]), np.linspace(-100.0, 100.0, 200), 5.0
    vectors = np.column_stack((k, np.zeros(3)))
    errors = {1: [], 2: []}  # type: dict[int, list[float]]
    for small in (0.02, 0.01, 0.005):
        waves = three_waves(small, tuple(map(tuple, vectors)))
        for order in (1, 2):
            there = Sea(waves, order=order).elevation(x, 0.0, t)
            errors[order].append(np.abs(there - _eulerian(x, k, waves.amplitude, waves.phase, t, 2)).max())
    assert np.log2(errors[2][1] / errors[2][2]) == pytest.approx(3.0, abs=0.05)
    assert np.log2(errors[1][1] / errors[1][2]) == pytest.approx(2.0, abs=0.1)


def test_fixed_points_are_found_after_the_water_has_drifted_by_many_waves() -> None:
    sea = Sea.of_one_wave(0.05, 4.0)
    k, w, drift = 0.05, float(sea.frequency[0]), 16.0 * 0.05 * float(sea.frequency[0])
    time = 40.0 * 2.0 * math.pi / (k * drift)  # in which particles drift by 40 waves
    x = np.linspace(0.0, 100.0, 11)
    # a wave that keeps its form runs at its phase velocity against labels, and drifts with them
    still = sea.elevation(x - (w / k + drift) * time, 0.0, 0.0)
    assert sea.elevation(x, 0.0, time) == pytest.approx(still, abs=1e-8)


def test_particles_drift_as_stokes_says() -> None:
    k, amplitude = 0.05, 2.0
    for depth, surface in ((math.inf, 1.0), (20.0, math.cosh(2.0) / (2.0 * math.sinh(1.0) ** 2))):
        sea = Sea.of_one_wave(k, amplitude, depth)
        period = 2.0 * math.pi / sea.frequency[0]
        start, end = (sea.motion([[7.0, 0.0]], t).position[0] for t in (0.0, 100.0 * period))
        drift = amplitude**2 * k * sea.frequency[0] * surface
        assert (end[0] - start[0]) / (100.0 * period) == pytest.approx(drift, rel=1e-9)
        assert end[2] == pytest.approx(start[2], abs=1e-9)


def test_a_cusp_has_no_tangent_but_a_height() -> None:
    sea = Sea.of_one_wave(0.05, (1.0 - 1e-15) / 0.05, order=1)
    found = sea.surface([[0.0, 0.0]], 0.0)
    assert np.all(np.isfinite(found.position))
    assert not np.any(np.isnan(found.slope))


def test_water_that_folds_over_is_said_to() -> None:
    k = np.array([0.05, 0.11, 0.23])
    steep = Components(np.column_stack((k, 0.0 * k)), 0.7 / k, np.zeros(3))
    with pytest.raises(NumericalError, match=r"no single particle of the surface is above x = .* t = 0 s; try: waves"):
        Sea(steep, order=1).labels_at([[x, 0.0] for x in np.linspace(-10.0, 10.0, 41)], 0.0)
    vectors, amplitude = np.array([[1.0, 0.0], [-1.0, 0.0], [2.0, 0.0]]), np.array([0.5, 0.5, 0.1])
    edge = Sea(Components(vectors, amplitude, np.array([0.0, 0.0, 0.5 * math.pi])), order=1)
    assert edge.surface([[0.0, 0.0]], 0.0).jacobian == 0.0
    with pytest.raises(NumericalError, match="no single particle of the surface is above x = 0 m, y = 0 m at t = 0 s"):
        edge.labels_at([[0.0, 0.0]], 0.0)
