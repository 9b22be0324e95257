"""``method = "auto"``: chosen before the run by eigenvalues, constraints and smoothness, and said."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.compiled.initial_state import initial_state
from eomgen.simulation.automatic_method import largest_eigenvalue


def oscillator(stiffness: float = 400.0, **joint: Any) -> dict[str, Any]:
    """A mass of 4 kg on a spring: 10 rad/s by default."""
    slide = {"type": "prismatic", "parent": "base", "child": "block", "axis": [1, 0, 0], "stiffness": stiffness}
    return {
        "format": 1,
        "name": "oscillator",
        "bodies": {"block": {"mass": 4.0}},
        "joints": {"slide": {**slide, "initial": {"position": 0.1}, **joint}},
        "simulation": {"step": 0.01, "duration": 0.2},
    }


LOOP: dict[str, Any] = {
    "format": 1,
    "name": "held",
    "bodies": {"rod": {"mass": 2.0, "center_of_mass": [0, 0, -0.5], "inertia": [0.1, 0.1, 0.01]}},
    "joints": {"pin": {"type": "revolute", "parent": "base", "child": "rod", "axis": [0, 1, 0]}},
    "coordinates": "absolute",
    "simulation": {"step": 0.01, "duration": 0.2},
}


@pytest.mark.slow
def test_the_eigenvalue_is_exact() -> None:
    model = eomgen.build(oscillator())
    found = largest_eigenvalue(model, initial_state(model, None), 0.0, model.parameter_array())
    assert found == pytest.approx(10.0, rel=1e-12)
    damped = eomgen.build(oscillator(damping=400.0))  # overdamped: -c/2m +- sqrt((c/2m)^2 - k/m)
    found = largest_eigenvalue(damped, initial_state(damped, None), 0.0, damped.parameter_array())
    assert found == pytest.approx(50.0 + np.sqrt(2400.0), rel=1e-12)


@pytest.mark.slow
def test_the_eigenvalue_is_that_of_the_motion_that_constraints_leave() -> None:
    model = eomgen.build(LOOP)
    found = largest_eigenvalue(model, initial_state(model, None), 0.0, model.parameter_array())
    assert found == pytest.approx(np.sqrt(2.0 * 9.81 * 0.5 / (0.1 + 2.0 * 0.25)), rel=1e-9)


@pytest.mark.slow_except("scene0-0.01-rk4-the largest eigenvalue at the start, 10 1/s, is 0.1, so an explicit method")
@pytest.mark.parametrize(
    ("scene", "step", "chosen", "why"),
    [
        (oscillator(), 0.01, "rk4", "the largest eigenvalue at the start, 10 1/s, is 0.1, so an explicit method"),
        (oscillator(4e6), 0.01, "generalized_alpha", "1e+03 1/s, is 10, above 0.5, which asks for an implicit method"),
        (LOOP, 0.01, "rk4_partitioned", "so an explicit method resolves the motion"),
        (LOOP, 0.2, "generalized_alpha", "above 0.5, which asks for an implicit method"),
        (
            oscillator(limits={"upper": 0.3, "stiffness": 100.0, "damping": 1.0}),
            0.01,
            "generalized_alpha",
            "forces have corners at places met by the motion",
        ),
        (
            {**oscillator(), "efforts": {"push": {"joint": "slide", "effort": "5 if t > 0.1 else 0"}}},
            0.01,
            "rk4",
            "so an explicit method resolves the motion",  # steps end at known times
        ),
    ],
)
def test_the_choice_is_made_once_and_said(scene: dict[str, Any], step: float, chosen: str, why: str) -> None:
    model = eomgen.build(scene)
    found = model.simulate(0.4, step, method="auto")
    assert found.metadata["method"] == chosen
    assert f"method chosen before the run: {chosen}, because" in found.message
    assert why in found.message
    assert any(why in note for note in found.metadata["notes"])
    named = model.simulate(0.4, step, method=chosen)
    assert np.array_equal(found.q, named.q)
    assert "chosen" not in named.message


@pytest.mark.parametrize(
    ("key", "method"), [("alpha", "hht"), ("beta", "newmark"), ("gamma", "newmark"), ("order", "taylor")]
)
@pytest.mark.parametrize("stiffness", [400.0, 4e6])  # which of the methods would be chosen is not asked
def test_parameters_that_no_method_of_the_choice_takes_are_refused(key: str, method: str, stiffness: float) -> None:
    model = eomgen.build(oscillator(stiffness))
    given: Any = {key: 1}
    for call in (model.simulate, model.start):
        with pytest.raises(eomgen.UsageError) as caught:
            call(method="auto", **given)
        assert str(caught.value) == (
            f"usage error: {key}: auto chooses between an explicit method and generalized_alpha, which take no {key};"
            f' try: method = "{method}", or without {key}'
        )


def test_parameters_of_the_scene_wait_for_the_method_that_takes_them() -> None:
    scene = oscillator()
    scene["simulation"] |= {"method": "auto", "alpha": 0.1}
    model = eomgen.build(scene)
    assert np.array_equal(model.simulate(0.1).q, model.simulate(0.1, method="rk4").q)


@pytest.mark.slow
def test_scenes_and_models_may_leave_the_choice_to_runs() -> None:
    scene = oscillator()
    scene["simulation"]["method"] = "auto"
    for model in (eomgen.build(scene), eomgen.build(oscillator(), method="auto")):
        assert model.simulate().metadata["method"] == "rk4"
        assert model.simulate(step=0.1).metadata["method"] == "generalized_alpha"
        assert model.simulate(method="generalized_alpha").metadata["method"] == "generalized_alpha"
    assert eomgen.build(scene, method="generalized_alpha").simulate().metadata["method"] == "generalized_alpha"
