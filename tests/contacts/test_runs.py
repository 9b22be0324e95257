"""Contacts in files that others include, and derivatives of runs through contact."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.formula.evaluate import symbols
from eomgen.scene.load import from_data
from tests.contacts.pairs import contact, scene_of

BALL = """format = 1
name = "ball"
gravity = [0, 0, -9.81]
parameters.k = { value = 1e5, tunable = true }
parameters.loss = 0.2
bodies.ball = { mass = 0.1, inertia = [4e-5, 4e-5, 4e-5] }
[joints.ball]
type = "free"
parent = "base"
child = "ball"
initial = { position = [0, 0, 0.405], velocity = [0, 2, 0, 0.5, 0, 0] }
[outputs]
seen = { formula = ["gap.floor", "bristle_x.floor", "contact_x.floor"] }
"""
FLOOR = '{ body = "base", axis = [0, 0, 1] }'


def test_a_contact_in_an_included_file_has_the_names_of_its_file(tmp_path: Path) -> None:
    law = 'type = "formula", force = "k * deflection * max(1 - loss * rate, 0)"'
    part = BALL + contact("floor", FLOOR, 'body = "ball"', law, "bristles")
    (tmp_path / "ball.toml").write_text(part, encoding="utf-8")
    whole = 'format = 1\nname = "two"\ninclude.left = { file = "ball.toml" }\ninclude.right = { file = "ball.toml" }\n'
    (tmp_path / "two.toml").write_text(whole, encoding="utf-8")
    scene = eomgen.load(tmp_path / "two.toml")
    assert [element.name for element in scene.elements] == ["left_floor", "right_floor"]
    assert [state.name for state in scene.states][1:3] == ["left_floor_bristle_y", "right_floor_bristle_x"]
    assert {symbol.name for formula, _ in scene.elements[1].formulas() for symbol in symbols(formula)} == {
        "right_floor",
        "right_k",
        "right_loss",
    }


@pytest.mark.long
def test_derivatives_of_a_run_through_a_bounce_on_bristles() -> None:
    """Against central differences of runs."""
    scene = BALL + contact("floor", FLOOR, 'body = "ball"', 'type = "hunt_crossley", stiffness = "k"', "bristles")
    model = eomgen.build(scene_of(scene))
    options = {"method": "trapezoidal"}
    found = model.sensitivities(0.06, 2e-5, **options)
    runs = [model.simulate(0.06, 2e-5, parameters={"k": 1e5 + change}, **options) for change in (20.0, -20.0)]
    assert runs[0]["seen"][:, 0].min() < -1e-4 and runs[0]["seen"][-1, 0] > 0.0  # it bounces
    differences = (runs[0]["seen"][-1] - runs[1]["seen"][-1]) / 40.0
    np.testing.assert_allclose(found.derivatives["seen"][-1, :, 0], differences, rtol=1e-4, atol=1e-13)


@pytest.mark.parametrize("method", ["rk45", "trapezoidal_adaptive"])
def test_steps_by_a_tolerance_of_a_wheel_that_rolls_without_slip(method: str) -> None:
    """Rates of slips are differences of two speeds that balance: the rest is rounding, and no error of a step."""
    speed, deflection = 20.0, 2 * 9.81 / 2e5
    spin = speed / (0.4 - deflection / 3)  # about the rolling radius, a third of the deflection less
    scene = {
        "format": 1,
        "name": "wheel",
        "gravity": [0, 0, -9.81],
        "bodies": {"slide": {"mass": 1}, "fork": {"mass": 1}, "ball": {"mass": 1, "inertia": [0.1, 0.2, 0.1]}},
        "joints": {
            "x": {"type": "prismatic", "parent": "base", "child": "slide", "axis": [1, 0, 0]},
            "z": {"type": "prismatic", "parent": "slide", "child": "fork", "axis": [0, 0, 1]},
            "spin": {"type": "revolute", "parent": "fork", "child": "ball", "axis": [0, 1, 0]},
        },
    }
    scene["joints"]["x"]["initial"] = {"velocity": speed}
    scene["joints"]["z"]["initial"] = {"position": 0.4 - deflection}
    scene["joints"]["spin"]["initial"] = {"velocity": spin}
    law = 'type = "linear", coefficients = { STIFFNESS_X = 20, STIFFNESS_Y = 15, FRICTION = 1 }'
    tyre = contact("tyre", FLOOR, 'body = "ball"', 'type = "formula", force = "2e5 * deflection"', law, "disc")
    scene |= tomllib.loads(tyre.replace("[0.1, 1, 0]", "[0, 1, 0]"))
    run = eomgen.build(from_data(scene)).simulate(2.0, 0.01, method=method)
    assert run.success and run.stats["own_steps"] < 1000
    np.testing.assert_allclose(run.v[-1], [speed, 0, spin], atol=1e-6)
