"""Waves of second order in the equations of motion themselves: what is left is of third order."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.symbolic.scalar import Scalar
from eomgen.waves import Sea, WaveNumber, gravity_waves
from tests.waves.residuals import Residuals, residuals, three_waves, vorticity

SPREAD = ((0.05, 0.01), (0.055, -0.035), (-0.02, 0.075))
CASES = {
    "spread": SPREAD,
    "equal lengths": ((0.05, 0.0), (0.03, 0.04), (0.06, 0.02)),
    "standing": ((0.05, 0.0), (-0.05, 0.0), (0.03, 0.05)),
    "nearly standing": ((0.05, 0.0), (-0.0501, 0.0), (0.07, 0.0)),
    "one direction": ((0.05, 0.0), (0.055, 0.0), (0.08, 0.0)),
    "one oblique direction": ((0.03, 0.04), (0.06, 0.08), (0.033, 0.044)),
}


def at_two_steepnesses(
    vectors: tuple[tuple[float, float], ...],
    depth: float,
    order: int = 2,
    dispersion: Callable[[WaveNumber], Scalar] = gravity_waves,
) -> tuple[Residuals, Residuals]:
    depths = (0.0, -1.0, -6.0, -15.0)
    one, other = (
        residuals(Sea(three_waves(small, vectors), depth, order=order, dispersion=dispersion), depths)
        for small in (0.01, 0.005)
    )
    return one, other


@pytest.mark.parametrize("depth", [math.inf, 20.0])
@pytest.mark.parametrize("vectors", CASES.values(), ids=CASES)
def test_residuals_are_of_third_order(vectors: tuple[tuple[float, float], ...], depth: float) -> None:
    one, other = at_two_steepnesses(vectors, depth)
    orders = np.log2(one.of_equations / other.of_equations)
    assert orders == pytest.approx([3.0, 3.0, 3.0], abs=0.03)
    assert other.pressure < 1e-12
    assert other.bottom < 1e-11


@pytest.mark.parametrize("steepness", [0.1, 0.5, 0.9, 0.999])
def test_gerstner_waves_are_exact(steepness: float) -> None:
    """Of one wave of first order in deep water, with J = 1 - (k A)^2 exp(2 k c): momentum and continuity hold."""
    k, g, t = 0.05, 9.81, 3.7
    sea = Sea.of_one_wave(k, steepness / k, order=1)
    assert sea.frequency[0] ** 2 == pytest.approx(g * k, rel=1e-15)
    labels = np.column_stack((np.linspace(-70.0, 70.0, 41), np.zeros(41)))
    for c in (0.0, -3.0, -25.0):
        motion, (first, _) = sea.motion(labels, t, c), sea.derivatives(labels, t, c)
        xa, za = first[:, 0, 0], first[:, 2, 0]
        # the displacement is the gradient of a harmonic function
        xc, zc = za, 2.0 - xa
        ax, az = motion.acceleration[:, 0], motion.acceleration[:, 2]
        tangential = ax * xa + (az + g) * za
        square = (sea.frequency[0] * steepness / k) ** 2
        downwards = ax * xc + (az + g) * zc - g + k * square * math.exp(2.0 * k * c)
        exact = -g * c - 0.5 * square * (1.0 - math.exp(2.0 * k * c))
        assert np.abs(motion.pressure - exact).max() < 1e-13 * g / k
        assert np.abs(tangential).max() < 1e-14 * g
        assert np.abs(downwards).max() < 1e-14 * g
        assert xa * zc - xc * za == pytest.approx(1.0 - steepness**2 * math.exp(2.0 * k * c), abs=1e-14)


@pytest.mark.parametrize("depth", [math.inf, 20.0])
@pytest.mark.parametrize("vectors", [SPREAD, CASES["equal lengths"], CASES["one direction"]])
def test_vorticity_of_gerstner_holds_the_equations_without_drift(
    vectors: tuple[tuple[float, float], ...], depth: float
) -> None:
    """Continuity and momentum to third order; vorticity is of second, and that of a particle stays what it is."""
    found, changes, sizes = [], [], []
    places = np.random.default_rng(5).uniform(-100.0, 100.0, (40, 2))
    for small in (0.01, 0.005):
        sea = Sea(three_waves(small, vectors), depth, vorticity="gerstner")
        found.append(residuals(sea, (0.0, -1.0, -6.0, -15.0)))
        now, later = (vorticity(sea, places, time, -1.0) for time in (2.0, 9.0))
        changes.append(np.abs(later - now).max())
        sizes.append(np.abs(now).max())
    orders = np.log2(found[0].of_equations / found[1].of_equations)
    assert orders[[0, 2]] == pytest.approx(3.0, abs=0.05)
    assert found[1].pressure < 1e-12
    assert np.log2(changes[0] / changes[1]) == pytest.approx(3.0, abs=0.05)
    assert np.log2(sizes[0] / sizes[1]) == pytest.approx(2.0, abs=0.2)
    far = sea.motion(places, 1e7).position[:, :2] - places
    assert np.abs(far).max() < 3.0 * sea.amplitude.sum()
    drifting = Sea(three_waves(0.005, vectors), depth).motion(places, 1e7).position[:, :2] - places
    assert np.abs(drifting).min(axis=0).max() > 100.0


def test_a_reduced_gravity_is_one_line() -> None:
    """Waves of a layer below a lighter one, which takes a part of the weight."""
    sea = Sea(three_waves(0.005, SPREAD), 20.0, dispersion=lambda w: w.sqrt(w.g * 0.02 * w.k * w.tanh(w.k * w.h)))
    assert sea.restoring == pytest.approx(0.02 * 9.81, rel=1e-12)
    assert residuals(sea, (0.0, -6.0)).pressure < 1e-12


def test_relations_under_which_the_surface_bears_pressure_are_refused() -> None:
    with pytest.raises(UsageError, match=r"w\^2 coth\(k h\) / k is .* the pressure at the surface is the") as refused:
        Sea(three_waves(0.005, SPREAD), 20.0, dispersion=lambda w: w.sqrt((w.g + w.k * w.k * 7.3e-5) * w.k))
    assert "try: w.gravity_waves, with terms that are linear in kx and ky" in str(refused.value)
    with pytest.raises(UsageError, match="is not linear in it, so no uniform current gives it; try"):
        Sea(three_waves(0.005, SPREAD), 20.0, dispersion=lambda w: w.gravity_waves + w.kx * w.k * 0.1)
