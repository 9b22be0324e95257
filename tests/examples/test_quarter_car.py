"""The quarter car of the examples against linear theory: eigenvalues, steady motion on harmonics, root mean squares."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import simpson

import eomgen
from eomgen import Model, Solution
from eomgen.base.random_inputs import road_harmonics

SCENE = Path(__file__).parents[2] / "examples" / "quarter_car" / "scene.toml"
SPRUNG, UNSPRUNG, SPRING, DAMPER, TYRE = 240.0, 36.0, 16000.0, 980.0, 160000.0


@pytest.fixture(scope="module")
def model() -> Model:
    return eomgen.build(SCENE)


def _matrices(damper: float = DAMPER, skyhook: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return M, C, K of (wheel, body), written down by hand."""
    mass = np.diag([UNSPRUNG, SPRUNG])
    damping = np.array([[damper, -damper - skyhook], [-damper, damper + skyhook]])
    return mass, damping, np.array([[SPRING + TYRE, -SPRING], [-SPRING, SPRING]])


def _responses(frequency: np.ndarray, skyhook: float) -> dict[str, np.ndarray]:
    """Return complex amplitudes of the outputs per metre of road, at angular frequencies."""
    M, C, K = _matrices(skyhook=skyhook)
    s = 1j * frequency[:, None, None]
    wheel, body = np.linalg.solve(s * s * M + s * C + K, np.broadcast_to([[TYRE], [0.0]], (len(frequency), 2, 1)))[
        ..., 0
    ].T
    return {
        "body_acceleration": -(frequency**2) * body,
        "suspension_travel": body - wheel,
        "tyre_load": TYRE * (1.0 - wheel),
    }


def _eigenvalues(model: Model, **parameters: float) -> np.ndarray:
    q, v = model.initial_q, model.initial_v
    K, C, M = model.partials(q, v, np.zeros(2), parameters=parameters)
    companion = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    return np.linalg.eigvals(companion)


def test_undamped_frequencies(model: Model) -> None:
    frequencies = np.unique(np.round(np.abs(_eigenvalues(model, damper=0.0).imag) / (2 * math.pi), 9))
    np.testing.assert_allclose(frequencies, [1.2382426677, 11.1351894335], atol=1e-9)


def test_damped_eigenvalues(model: Model) -> None:
    found = sorted((value for value in _eigenvalues(model) if value.imag > 0), key=abs)
    np.testing.assert_allclose(found, [-1.7116733175 + 7.6694018453j, -13.9411044603 + 67.8527902572j], atol=1e-9)


@pytest.mark.parametrize("skyhook", [0.0, 2000.0])
def test_partials_are_the_textbook_matrices(model: Model, skyhook: float) -> None:
    K, C, M = model.partials(model.initial_q, model.initial_v, np.zeros(2), parameters={"skyhook": skyhook})
    for found, expected in zip((M, C, K), _matrices(skyhook=skyhook), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-9)


def test_rests_on_a_flat_road(model: Model) -> None:
    assert np.abs(model.forward_dynamics(model.initial_q, model.initial_v, 5.0, {"road": 0.0})).max() < 1e-12


@pytest.mark.slow
@pytest.mark.long_cases("0.0", "2000.0")
@pytest.mark.parametrize("skyhook", [0.0, 2000.0])
def test_steady_motion_is_the_sum_of_harmonic_responses(model: Model, skyhook: float) -> None:
    run = model.simulate(16.0, 5e-4, method="rk4", parameters={"skyhook": skyhook})
    # the slower mode has decayed by exp(-1.71 * 14) = 4e-11, the road has faded in by 1 - exp(-784)
    settled = run.t > 14.0
    amplitude, frequency, phase = np.array(road_harmonics("C", 20.0, seed=1, harmonics=200)).T
    waves = np.exp(1j * (np.outer(run.t[settled], frequency) + phase))
    for name, response in _responses(frequency, skyhook).items():
        expected = np.real(waves @ (amplitude * response))
        error = np.sqrt(np.mean((run.outputs[name][settled] - expected) ** 2)) / np.sqrt(np.mean(expected**2))
        # Runge and Kutta's method: (frequency step)^4 / 120 is 1e-5 at the highest frequency, 355 rad/s, which carries
        # little
        assert error < 1e-5, name


def _long_run(model: Model, skyhook: float) -> Solution:
    return model.simulate(800.0, parameters={"skyhook": skyhook}, record_every=5)


@pytest.mark.long
@pytest.mark.parametrize("skyhook", [0.0, 2000.0])
def test_root_mean_squares_of_a_long_run(model: Model, skyhook: float) -> None:
    run = _long_run(model, skyhook)
    assert run.success, run.message
    amplitude, frequency, _ = np.array(road_harmonics("C", 20.0, seed=1, harmonics=200)).T
    slow = sorted((v for v in _eigenvalues(model, skyhook=skyhook) if v.imag > 0), key=abs)[0]
    # The mean square of a process of noise bandwidth B = -Re(eigenvalue) / 2 (in Hz) over a time T has the relative
    # standard deviation 1 / sqrt(B T), its root half of that; three of them, and 0.5 % for the stepper at 1 ms.
    tolerance = 3.0 * 0.5 / math.sqrt(-slow.real / 2.0 * 790.0) + 0.005
    assert tolerance < 0.065
    for name, response in _responses(frequency, skyhook).items():
        expected = math.sqrt(np.sum(np.abs(amplitude * response) ** 2) / 2.0)
        found = math.sqrt(np.mean(run.outputs[name][run.t > 10.0] ** 2))
        assert found == pytest.approx(expected, rel=tolerance), name


@pytest.mark.parametrize(
    ("skyhook", "white"), [(0.0, (1.41708, 11.9296e-3, 720.33)), (2000.0, (1.22191, 9.9534e-3, 730.56))]
)
def test_sum_over_harmonics_and_what_lies_outside_the_band_make_the_integral_over_white_noise(
    skyhook: float, white: tuple[float, float, float]
) -> None:
    # the road has no waves longer than 91 m or shorter than 0.35 m (0.2 to 57 Hz), white road velocity has
    amplitude, frequency, _ = np.array(road_harmonics("C", 20.0, harmonics=2000)).T
    inside = _responses(frequency, skyhook)
    grids = [2.0 * math.pi * 20.0 * np.geomspace(*limits, 20001) for limits in ((1e-7, 0.011), (2.83, 1e5))]
    outside = [_responses(grid, skyhook) for grid in grids]
    for name, integral in zip(inside, white, strict=True):
        variance = np.sum(np.abs(amplitude * inside[name]) ** 2) / 2.0
        for grid, response in zip(grids, outside, strict=True):
            elevation = 2.0 * math.pi * 20.0 * 256e-6 * 0.1**2 / grid**2  # m^2 per rad/s
            variance += simpson(np.abs(response[name]) ** 2 * elevation, x=grid)
        assert math.sqrt(variance) == pytest.approx(integral, rel=1e-5), name


def test_body_at_the_invariant_frequency_ignores_the_suspension(model: Model) -> None:
    frequency = math.sqrt(TYRE / UNSPRUNG)
    for skyhook in (0.0, 2000.0, 8000.0):
        K, C, M = model.partials(model.initial_q, model.initial_v, np.zeros(2), parameters={"skyhook": skyhook})
        s = 1j * frequency
        body = np.linalg.solve(s * s * M + s * C + K, [TYRE, 0.0])[1]
        assert body == pytest.approx(-UNSPRUNG / SPRUNG, abs=1e-12)
