"""Controllers without their plant: signals, commands and states of the formulas of the scene."""

from __future__ import annotations

import re

import numpy as np
import pytest

from eomgen.errors import ModelError
from eomgen.mechanics.controller import derive_controller
from eomgen.scene.load import from_data
from eomgen.system.system import System
from tests.models.library import scene
from tests.oracles.evaluation import tape_evaluator

K = {"k": {"value": 40.0, "tunable": True, "unit": "N m/rad"}, "lag": 0.5}
CAM = {"cam": {"points": [[-1, -2], [1, 2]], "interpolation": "linear", "outside": "hold"}}
Quantities = list[tuple[str, str]]
ERROR = "target - 3 * q.hinge - cam(v.hinge * lag)"


def check(found: System, inputs: Quantities, parameters: Quantities, commands: Quantities) -> None:
    for quantities, expected in ((found.inputs, inputs), (found.parameters, parameters), (found.outputs, commands)):
        assert [(item.name, item.unit) for item in quantities] == expected


def test_continuous_controllers_have_commands_and_rates() -> None:
    controllers = {
        "asked": {"type": "pi", "signal": ERROR, "proportional": "k", "integral": 20},
        "torque": {"type": "low_pass", "signal": "asked", "time_constant": "lag", "unit": "N m"},
    }
    efforts = {"motor": {"joint": "hinge", "effort": "torque + 0.1 * asked"}}
    inputs = {"target": {"formula": "2 * t", "unit": "rad"}}
    data = scene("pendulum", parameters=K, curves=CAM, inputs=inputs, controllers=controllers, efforts=efforts)
    found = derive_controller(from_data(data))
    check(
        found,
        [("angle", "rad"), ("v.hinge", "rad/s"), ("target", "rad")],
        [("k", "N m/rad")],
        [("asked", ""), ("torque", "N m")],
    )
    blocks = {"z": np.array([0.3, 0.7]), "u": np.array([0.2, 0.8, 1.0]), "p": np.array([5.0])}
    asked = 5.0 * (1.0 - 0.6 - 0.8) + 0.3
    np.testing.assert_allclose(tape_evaluator(found)("commands", blocks)["y"], [asked, 0.7], rtol=1e-14)
    rates = tape_evaluator(found)("rates", blocks)["zdot"]
    np.testing.assert_allclose(rates, [20.0 * -0.4, (asked - 0.7) / 0.5], rtol=1e-14)


def test_digital_controllers_measure_states_of_the_plant() -> None:
    states = {
        "servo": {"sample": 0.1, "formula": "-k * q.hinge + 0.5 * flow + 3 * torque + servo", "unit": "N m"},
        "flow": {"rate": "(gain - flow) / lag", "unit": "N"},
    }
    controllers = {
        "gain": {"type": "state_feedback", "signals": {"s": "servo"}, "signal_gains": {"s": 2}},
        "torque": {"type": "low_pass", "signal": "servo + q.hinge", "time_constant": 0.2, "unit": "N m"},
    }
    efforts = {"motor": {"joint": "hinge", "effort": "torque"}}
    data = scene("pendulum", parameters=K, states=states, controllers=controllers, efforts=efforts)
    found = derive_controller(from_data(data))
    check(
        found,
        [("angle", "rad"), ("flow", "N"), ("torque", "N m")],
        [("k", "N m/rad"), ("gain_gain_s", "")],
        [("gain", ""), ("servo", "N m")],
    )
    assert found.notes == ("torque: continuous in the scene, so a part of the plant",)
    blocks = {"z": np.array([0.3]), "u": np.array([0.2, 0.8, 1.0]), "p": np.array([5.0, 2.0])}
    np.testing.assert_allclose(tape_evaluator(found)("commands", blocks)["y"], [-2.0 * 0.3, 0.3], rtol=1e-14)
    (samples,) = tape_evaluator(found)("samples", blocks).values()
    np.testing.assert_allclose(samples, [-5.0 * 0.2 + 0.5 * 0.8 + 3.0 * 1.0 + 0.3], rtol=1e-14)


def test_sampled_states_that_ask_for_each_other_are_refused() -> None:
    states = {"a": {"sample": 0.1, "formula": "b + q.hinge"}, "b": {"sample": 0.1, "formula": "a"}}
    fault = (
        "scene (states.a.formula): the sampled states a, b ask for each other's value at the same time; try: a delay"
    )
    with pytest.raises(ModelError, match=re.escape(fault)):
        derive_controller(from_data(scene("pendulum", states=states)))
