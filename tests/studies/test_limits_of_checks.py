"""Checks of closed forms next to features of functions: limits of differences and of complex steps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.studies.verification.differences import _as_finer
from eomgen.studies import check


def slide(**parts: Any) -> dict[str, Any]:
    return {
        "format": 1,
        "name": "slide",
        "gravity": [0, 0, 0],
        "bodies": {"b": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}},
        "joints": {"x": {"type": "prismatic", "parent": "base", "child": "b", "axis": [1, 0, 0], **parts.pop("joint")}},
        **parts,
    }


@pytest.mark.slow
def test_differences_do_not_step_across_a_regularisation() -> None:
    """At a velocity of 1e-4 m/s in friction that turns over within 1e-4 m/s, steps of 1 m/s see a constant."""
    friction = {"coulomb": 5.0, "velocity": 1e-4}
    scene = slide(joint={"friction": friction, "initial": {"velocity": 1e-4}})
    report = check(scene, states=2, only=["force_rates", "forward_rates"], profile="quick")
    assert report.passed, report.failures


@pytest.mark.slow
def test_choices_with_equal_operands_take_a_side_each() -> None:
    """A clipped damper at rest: both limits and the wanted force are 0, and the slope is 0 on both sides."""
    limits = "soft*v.x", "hard*v.x"
    text = f"max(min({limits[0]}, {limits[1]}), min(max({limits[0]}, {limits[1]}), semi*v.x))"
    parameters = {
        name: {"value": value, "tunable": True} for name, value in (("soft", 0.0), ("hard", 3e3), ("semi", 0.0))
    }
    scene = slide(joint={}, parameters=parameters, efforts={"damper": {"joint": "x", "effort": text}})
    report = check(scene, states=2, only=["forward_dynamics"], profile="quick")
    assert report.passed, report.failures


def test_a_coarse_plateau_is_no_agreement() -> None:
    value = np.array([0.0, 0.0, 0.0, 0.9, 1.0, 1.001])
    bars = np.array([1e-9, 1e-9, 1e-3, 0.05, 1e-3, 1e-2])
    assert _as_finer(value, bars).tolist() == [False, False, False, True, True, True]


def test_noise_at_small_steps_is_no_disagreement() -> None:
    value = np.array([1.2, 1.0001, 1.0, 1.01, 1.4])
    bars = np.array([0.2, 1e-4, 1e-4, 0.05, 0.5])
    assert _as_finer(value, bars).all()


@pytest.mark.slow
def test_terms_of_a_complex_step_cancel_to_zero() -> None:
    """The rate of a driven turn is w less the drive's rate times cos^2 + sin^2, whose change in time is exactly 0."""
    builder = eomgen.SceneBuilder("driven").body("crank", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("main", "revolute", "base", "crank", axis=[0, 0, 1], initial={"velocity": 150.0})
    base, crank = ({"body": body, "axis": [0, 0, 1], "x_axis": [1, 0, 0]} for body in ("base", "crank"))
    builder.constraint("drive", "revolute", base, crank, drive="150 * t")
    scene = builder.simulation(duration=0.1, step=1e-5).build()
    report = check(scene, states=4, only=["constraint_velocity_derivatives"], profile="quick")
    assert "constraint_velocity_derivatives" in [form.name.partition(".")[0] for form in report.forms]
    assert report.passed, report.failures


@pytest.mark.slow
def test_laws_by_differences_are_known_to_their_steps() -> None:
    report = check(
        "examples/car_in_side_wind/system/car.toml", states=2, only=["output_parameter_partials"], profile="quick"
    )
    assert report.passed, report.failures


@pytest.mark.slow
def test_inputs_of_a_scene_without_parameters_are_differentiated_in_time() -> None:
    inputs = {"push": {"unit": "N", "formula": "sin(3 * t)"}}
    scene = slide(joint={}, inputs=inputs, efforts={"motor": {"joint": "x", "effort": "push"}})
    report = check(scene, states=2, only=["input_derivatives"], profile="quick")
    assert report.passed, report.failures
    assert "input_derivatives.input_derivatives" in [form.name for form in report.forms]
