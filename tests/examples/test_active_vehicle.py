"""The demonstration: a car at rest on its springs, its linear theory, energy and symmetry."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import simpson

import eomgen
from eomgen import Model
from eomgen.base.random_inputs import road_harmonics

FOLDER = Path(__file__).parents[2] / "examples" / "active_vehicle"
BODY, ROLL, PITCH, WHEEL, FRONT, REAR, HALF_TRACK = 1500.0, 460.0, 2160.0, 59.0, 1.4, 1.7, 0.75
TYRE, SPEED, COHERENCE = 190000.0, 20.0, 0.7
SPRINGS, DAMPERS = np.array([35e3, 35e3, 38e3, 38e3]), np.array([1000.0, 1000.0, 1100.0, 1100.0])
ALONG, ACROSS = np.array([FRONT, FRONT, -REAR, -REAR]), HALF_TRACK * np.array([1.0, -1.0, 1.0, -1.0])
FLAT = np.zeros(4)


@pytest.fixture(scope="module")
def model() -> Model:
    return eomgen.build(FOLDER / "scene.toml", profile="fast")  # for runs of minutes


def _matrices(skyhook: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return M, C, K of (heave, pitch, roll, four wheels), as textbooks assemble them."""
    corners = np.stack([np.ones(4), -ALONG, ACROSS], axis=1)  # rise of each corner per heave, pitch and roll
    stretch = np.hstack([corners, -np.eye(4)])
    mass = np.diag([BODY, PITCH, ROLL, *(4 * [WHEEL])])
    damping = stretch.T @ np.diag(DAMPERS) @ stretch + skyhook * stretch.T @ np.hstack([corners, np.zeros((4, 4))])
    return mass, damping, stretch.T @ np.diag(SPRINGS) @ stretch + np.diag([0.0, 0.0, 0.0, *(4 * [TYRE])])


def _roads() -> list[tuple[np.ndarray, np.ndarray]]:
    """Return for each wheel the complex amplitudes of its road at the common angular frequencies."""
    tracks = []
    for seed, offset in ((11, 0.0), (12, 0.0), (11, FRONT + REAR), (12, FRONT + REAR)):
        amplitude, frequency, phase = np.array(road_harmonics("C", SPEED, seed=seed, offset=offset)).T
        tracks.append((frequency, amplitude * np.exp(1j * phase)))
    (w, left_front), (_, other_front), (_, left_rear), (_, other_rear) = tracks
    rest = math.sqrt(1.0 - COHERENCE**2)
    right_front, right_rear = COHERENCE * left_front + rest * other_front, COHERENCE * left_rear + rest * other_rear
    return [(w, left_front), (w, right_front), (w, left_rear), (w, right_rear)]


@pytest.mark.slow
@pytest.mark.parametrize("skyhook", [0.0, 3000.0])
def test_partials_at_rest_are_the_textbook_matrices(model: Model, skyhook: float) -> None:
    found = model.partials(model.initial_q, model.initial_v, np.zeros(7), 7.0, FLAT, parameters={"skyhook": skyhook})
    for matrix, expected in zip((found[2], found[1], found[0]), _matrices(skyhook), strict=True):
        np.testing.assert_allclose(matrix, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@pytest.mark.slow
@pytest.mark.parametrize("skyhook", [0.0, 3000.0])
def test_motion_is_the_steady_response_of_linear_theory(model: Model, skyhook: float) -> None:
    run = model.simulate(22.0, 5e-4, method="rk4", parameters={"skyhook": skyhook})
    settled = run.t > 19.0  # the slowest mode of the passive car decays with exp(-0.94 t): 2e-8 are left
    M, C, K = _matrices(skyhook)
    roads = _roads()
    frequency = roads[0][0]
    s = 1j * frequency[:, None, None]
    forces = np.stack([np.zeros_like(roads[0][1])] * 3 + [TYRE * road for _, road in roads], axis=1)
    response = np.linalg.solve(s * s * M + s * C + K, forces[..., None])[..., 0]
    waves = np.exp(1j * np.outer(run.t[settled], frequency))
    heave = np.real(waves @ (-(frequency[:, None] ** 2) * response))[:, 0]
    loads = np.real(waves @ (forces[:, 3:] - TYRE * response[:, 3:]))
    for found, expected in (
        (run.outputs["body_acceleration"][settled], heave),
        (run.outputs["tyre_load"][settled], loads),
    ):
        # angles reach 0.03 rad: rises of the corners differ from those of linear theory by up to 0.03^2 / 2 of
        # themselves
        assert np.sqrt(np.mean((found - expected) ** 2)) < 2e-4 * np.sqrt(np.mean(expected**2))


@pytest.mark.slow
@pytest.mark.parametrize("skyhook", [0.0, 3000.0])
def test_energy_changes_by_the_work_of_dampers_actuators_and_road(model: Model, skyhook: float) -> None:
    run = model.simulate(5.0, 5e-4, method="rk4", parameters={"skyhook": skyhook})
    work, exchanged = simpson(run.energy["power"], x=run.t), simpson(np.abs(run.energy["power"]), x=run.t)
    assert exchanged > 500.0
    assert run.energy["total"][-1] - run.energy["total"][0] == pytest.approx(work, abs=1e-5 * exchanged)
    np.testing.assert_array_equal(run.outputs["energy"], run.energy["total"])
