"""The elastic half car: frequencies and matrices from first principles, and random runs against covariances."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.models.library import scene
from tests.oracles.elastic_half_car import half_car
from tests.oracles.test_elastic_half_car import FREQUENCIES

FOLDER = Path(__file__).parents[2] / "examples" / "elastic_vehicle"


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    return eomgen.build(FOLDER / "scene.toml", profile="fast")  # for runs of minutes


@pytest.fixture(scope="module")
def script() -> dict[str, Any]:
    return runpy.run_path(str(FOLDER / "compare.py"))


@pytest.mark.long
def test_passive_car_has_the_published_frequencies_and_its_matrices(
    model: eomgen.Model, script: dict[str, Any]
) -> None:
    linear = model.linearize(parameters=script["suspensions"](model, script["HALF_CAR"])["passive"])
    np.testing.assert_allclose(linear.undamped_frequencies / (2 * np.pi), FREQUENCIES[2], rtol=1e-9)
    car = half_car(2)
    nose_down = np.diag([1.0, -1.0, 1.0, 1.0, 1.0, 1.0])  # turning about y lowers the front
    for ours, theirs in ((linear.M0, car.mass), (linear.C0, car.damping), (linear.K0, car.stiffness)):
        np.testing.assert_allclose(ours, nose_down @ theirs @ nose_down, atol=1e-11 * np.abs(theirs).max())
    assert np.abs(linear.modes().eigenvalues - (-1.3026745981 + 86.1256718623j)).min() < 1e-8


@pytest.mark.long
def test_three_elastic_modes_have_the_published_frequencies() -> None:
    forces = {f"springs__{side}__force": f"sky_{side}" for side in ("front", "rear")}
    changes = {"beams__body__bending_z__modes": 3, "controllers__ride": None, "outputs__actuator_force": None}
    data = scene("elastic_vehicle/scene", **changes, **forces)  # the regulator's signals tell of two modes only
    frequencies = eomgen.build(data).linearize().undamped_frequencies / (2 * np.pi)
    np.testing.assert_allclose(frequencies, FREQUENCIES[3], rtol=1e-9)
