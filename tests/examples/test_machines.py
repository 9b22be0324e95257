"""The examples with loops against closed forms of position, the energy integral of motion, and absolute coordinates."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen import Model
from tests.examples.machines import Machine, Part, angles_at, energy_of, turned

EXAMPLES = Path(__file__).parents[2] / "examples"


def _model(name: str, coordinates: str = "joint") -> Model:
    return eomgen.build(eomgen.load(EXAMPLES / name / "scene.toml", coordinates=coordinates))


def engine(angle: complex) -> list[Part]:
    """Crank and rod in the xy plane, piston along x."""
    crank, rod = 0.04, 0.13
    pin = crank * np.array([np.cos(angle), np.sin(angle), 0.0])
    swing = -np.arcsin(pin[1] / rod)
    along = np.array([np.cos(swing), np.sin(swing), 0.0])
    level = np.eye(3, dtype=complex)
    return [
        (1.2, np.array([0.002, 0.002, 0.003]), -0.2 * pin, turned(2, angle)),
        (0.4, np.array([0.00002, 0.0008, 0.0008]), pin + 0.35 * rod * along, turned(2, swing)),
        (0.5, np.full(3, 0.0002), (pin + rod * along) * np.array([1.0, 0.0, 1.0]), level),
    ]


def haug(angle: complex) -> list[Part]:
    """Crank in the plane x = 0 about (0.1, 0.12), slider on the x axis, rod with its y axis across the slider's z."""
    crank, rod = 0.08, 0.3
    pin = np.array([0.0 * angle, 0.1 - crank * np.sin(angle), 0.12 + crank * np.cos(angle)])
    slider = np.array([np.sqrt(rod**2 - pin[1] ** 2 - pin[2] ** 2), 0.0, 0.0])
    x = (slider - pin) / rod
    y = np.cross(np.array([0.0, 0.0, 1.0]), x)
    y = y / np.sqrt(np.sum(y * y))
    axes = np.stack([x, y, np.cross(x, y)], axis=1)
    return [
        (0.12, np.array([0.0001, 0.00001, 0.0001]), np.array([0.0 * angle, 0.1, 0.12]), turned(0, angle)),
        (0.5, np.array([0.0004, 0.004, 0.004]), (pin + slider) / 2.0, axes),
        (2.0, np.full(3, 0.0001), slider, np.eye(3, dtype=complex)),
    ]


def rocker_angle(angle: np.ndarray | complex) -> np.ndarray:
    """Freudenstein's equation, the open branch: k1 cos(rocker) - k2 cos(crank) + k3 = cos(crank - rocker)."""
    ground, crank, coupler, rocker = 0.4, 0.1, 0.35, 0.3
    k1, k2 = ground / crank, ground / rocker
    k3 = (crank**2 - coupler**2 + rocker**2 + ground**2) / (2.0 * crank * rocker)
    # k1 c - k2 cos + k3 = cos c + sin s, so that (cos - k1) c + sin s = k3 - k2 cos
    a, b, c = np.cos(angle) - k1, np.sin(angle), k3 - k2 * np.cos(angle)
    half = (b - np.sqrt(a * a + b * b - c * c)) / (a + c)
    return 2.0 * np.arctan(half)


def four_bar(angle: complex) -> list[Part]:
    """Links in the xz plane; a positive angle lifts x towards z."""
    pin = 0.1 * np.array([np.cos(angle), 0.0, np.sin(angle)])
    swing = rocker_angle(angle)
    along = np.array([np.cos(swing), 0.0, np.sin(swing)])
    end = np.array([0.4, 0.0, 0.0]) + 0.3 * along
    lie = np.arcsin((end - pin)[2] / 0.35)
    return [
        (2.0, np.array([0.001, 0.02, 0.02]), pin / 2.0, turned(1, -angle)),
        (0.7, np.array([0.0002, 0.007, 0.007]), (pin + end) / 2.0, turned(1, -lie)),
        (0.6, np.array([0.0002, 0.0045, 0.0045]), np.array([0.4, 0.0, 0.0]) + 0.15 * along, turned(1, -swing)),
    ]


#: of Newton's iteration: far below the errors of the method
SETTINGS = {"rtol": 1e-9, "atol": 1e-10}
#: machine, axis against gravity, end of the run s, two steps s, largest error of the angle at the first of them rad
CASES = [
    ("slider_crank_planar", engine, 2, 0.02, (1e-4, 5e-5), 3e-3),
    ("slider_crank_spatial", haug, 2, 0.2, (4e-4, 2e-4), 1e-2),
    ("four_bar", four_bar, 2, 1.0, (5e-4, 2.5e-4), 3e-4),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "machine", "up", "end", "steps", "limit"), CASES, ids=[case[0] for case in CASES])
def test_loop_moves_as_its_energy_integral_says(
    name: str, machine: Machine, up: int, end: float, steps: tuple[float, float], limit: float
) -> None:
    model, errors = _model(name), []
    for step in steps:
        run = model.simulate(end, step, settings=SETTINGS)
        assert run.success and not run.stats["halvings"], run.message
        angle, rate = run.q[:, 0], float(run.v[0, 0])
        assert run.outputs["energy"][0] == pytest.approx(energy_of(machine, up, float(angle[0]), rate), rel=1e-12)
        expected, rates = angles_at(machine, up, float(angle[0]), rate, run.t)
        errors.append(float(np.abs(angle - expected).max()))
        assert np.abs(run.v[:, 0] - rates).max() < 1e-2 * rates.max()
        assert run.stats["max_constraint"] < 5e-13  # of some 0.3 m, at relative tolerances of 1e-9
    assert errors[0] < limit
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)  # second order


def _piston(pin: np.ndarray) -> np.ndarray:
    zero = 0.0 * pin[:, 0]
    return np.stack([pin[:, 0] + np.sqrt(0.13**2 - pin[:, 1] ** 2), zero, zero], axis=1)


def _slider(pin: np.ndarray) -> np.ndarray:
    zero = 0.0 * pin[:, 0]
    return np.stack([np.sqrt(0.3**2 - pin[:, 1] ** 2 - pin[:, 2] ** 2), zero, zero], axis=1)


def _rocker_end(pin: np.ndarray) -> np.ndarray:
    swing = rocker_angle(np.arctan2(pin[:, 2], pin[:, 0]))
    return np.stack([0.4 + 0.3 * np.cos(swing), 0.0 * swing, 0.3 * np.sin(swing)], axis=1)


PLACES = [
    ("slider_crank_planar", "piston", _piston, 0.005, 5e-5),
    ("slider_crank_spatial", "slider", _slider, 0.05, 2e-4),
    ("four_bar", "rocker_end", _rocker_end, 0.25, 2.5e-4),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "point", "place", "end", "step"), PLACES, ids=[case[0] for case in PLACES])
def test_both_coordinates_place_the_last_body_as_the_closed_form_does(
    name: str, point: str, place: Callable[[np.ndarray], np.ndarray], end: float, step: float
) -> None:
    for coordinates in ("joint", "absolute"):
        run = _model(name, coordinates).simulate(end, step, settings=SETTINGS)
        assert run.success, run.message
        np.testing.assert_allclose(run.outputs[point], place(run.outputs["crank_pin"]), atol=1e-12)
        assert np.ptp(run.outputs["energy"]) < 3e-3 * run.outputs["energy"][0]
