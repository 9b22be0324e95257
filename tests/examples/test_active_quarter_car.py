"""The active quarter car: published stationary values from the model's own matrices, and an invariant frequency."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen

FOLDER = Path(__file__).parents[2] / "examples" / "active_quarter_car"


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    return eomgen.build(FOLDER / "scene.toml", profile="fast")  # for runs of minutes


@pytest.fixture(scope="module")
def script() -> dict[str, Any]:
    return runpy.run_path(str(FOLDER / "compare.py"))


@pytest.mark.long_cases("skyhook-printed1")
@pytest.mark.long_cases("passive-printed0")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("suspension", "printed"),
    [
        ("passive", ("1.41708", "11.9296", "720.33")),
        ("skyhook", ("1.22191", "9.9534", "730.56")),
        ("LQR", ("0.763414", "13.7329", "1097.04")),
    ],
)
def test_stationary_values_are_the_published_ones(
    model: eomgen.Model, script: dict[str, Any], suspension: str, printed: tuple[str, ...]
) -> None:
    """From M0, C0, K0 and E0 of the compiled scene with this suspension at work; the last digit may be cut."""
    values = script["expected"](model, script["suspensions"](model)[suspension])
    for value, digits in zip(values, printed, strict=True):
        assert abs(value - float(digits)) <= 10.0 ** -len(digits.partition(".")[2]), (value, digits)


@pytest.mark.slow
def test_the_wheel_carries_the_body_at_one_frequency(model: eomgen.Model, script: dict[str, Any]) -> None:
    """z_s/z_r = -m_u/m_s at w^2 = k_t/m_u, whatever the suspension does: in the linear models of the compiled scene."""
    s = 1j * np.sqrt(160000.0 / 36.0)
    for name, parameters in script["suspensions"](model).items():
        if name == "clipped":
            continue
        linear = model.linearize(t=100.0, parameters=parameters)
        z = np.linalg.solve(s**2 * linear.M0 + s * linear.C0 + linear.K0, linear.E0[:, 0])
        assert abs(z[linear.coordinates.index("body")] + 0.15) <= 1e-12


@pytest.mark.slow
def test_the_clipped_suspension_is_a_damper(model: eomgen.Model, script: dict[str, Any]) -> None:
    run = model.simulate(10.0, 1e-3, parameters=script["suspensions"](model)["clipped"])
    rate = run.v[:, model.v_names.index("v.body")] - run.v[:, model.v_names.index("v.wheel")]
    tension, moving = run.outputs["actuator_force"], np.abs(rate) > 1e-6
    coefficient = tension[moving] / rate[moving]
    assert coefficient.min() == pytest.approx(300.0, rel=1e-6) and coefficient.max() == pytest.approx(3000.0, rel=1e-6)
