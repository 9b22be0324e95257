"""Steppers of several trajectories side by side: the bits of the stepper of one, whatever the neighbours do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.integrators.stepper_layout import default_settings
from eomgen.simulation.stepping.lane_stepper import LaneStepper
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.toolchain.lane_library import LaneLibrary

EXAMPLES = Path(__file__).parents[2] / "examples"
EVERY, ROWS = 4, 12

#: Scenes by what their states are made of, and methods of each family.
CASES = [
    ("four_bar", "generalized_alpha"),
    ("four_bar", "rosenbrock"),
    ("four_bar", "rattlie"),
    ("four_bar", "rk4_partitioned"),
    ("four_bar", "rk45_partitioned"),
    ("double_pendulum_on_shaking_base", "taylor"),
    ("double_pendulum_on_shaking_base", "rk4"),
    ("double_pendulum_on_shaking_base", "rk45"),
    ("double_pendulum_on_shaking_base", "tdg3"),
    ("double_pendulum_on_shaking_base", "corrected_predictor"),
    ("double_pendulum_on_shaking_base", "lsrt2"),
    ("symmetric_top", "generalized_alpha"),
    ("free_spinning_body", "rk45"),
    ("free_spinning_body", "taylor"),
    ("elastic_pendulum", "generalized_alpha"),
    ("robot_arm", "rk4"),
    ("quarter_car", "generalized_alpha"),
    ("active_vehicle", "generalized_alpha"),
    ("robot_arm", "taylor"),
    ("quarter_car", "taylor"),
    ("digital", "rk4"),
    ("digital", "rk45"),
    ("digital", "generalized_alpha"),
]
#: A controller whose samples lie beside the grid, with an encoder and a delay.
DIGITAL = {
    "format": 1,
    "name": "digital",
    "parameters": {"gain": {"value": 20.0, "tunable": True}},
    "bodies": {"rod": {"mass": 1.0, "center_of_mass": [0, 0, -0.5], "inertia": [0.1, 0.1, 0.01]}},
    "joints": {
        "hinge": {"type": "revolute", "parent": "base", "child": "rod", "axis": [0, 1, 0], "initial": {"position": 0.5}}
    },
    "states": {
        "measured": {"sample": "23 ms", "formula": "q.hinge", "quantum": 0.01},
        "speed": {"sample": "23 ms", "formula": "v.hinge", "delay": "23 ms"},
    },
    "efforts": {"motor": {"joint": "hinge", "effort": "-gain * measured - 2 * speed"}},
    "simulation": {"step": 0.01, "duration": 1.0},
}


def model_of(name: str, method: str) -> eomgen.Model:
    """Return a model without fused multiplications and additions, which compilers choose differently."""
    scene = eomgen.load(DIGITAL if name == "digital" else EXAMPLES / name / "scene.toml")
    return eomgen.build(scene, method=method, profile="reproducible")


class Trajectories:
    """As many trajectories as there are lanes, from states and parameters of their own."""

    def __init__(self, model: eomgen.Model, **settings: float) -> None:
        library = model.stepper_in_lanes(model.library)
        assert isinstance(library, LaneLibrary), library
        self.model, layout = model, model.library.layout
        self.settings = default_settings(layout["method"]) | settings
        self.lanes = LaneStepper(library, self.settings)
        count, rng = self.lanes.lanes, np.random.default_rng(5)
        given = np.array(list(model.parameters.values()))
        self.parameters = given * (1.0 + 0.1 * rng.random((count, len(given))))
        still = np.concatenate([[0.0], model.initial_q, model.initial_v, model.initial_z])
        self.starts = np.repeat(still[np.newaxis], count, axis=0)
        speeds = slice(1 + model.nq, 1 + model.nq + model.nv)
        self.starts[:, speeds] *= 1.0 + 0.2 * rng.random((count, 1))
        if not model.multipliers:
            self.starts[:, speeds] += 0.1 * rng.random((count, model.nv))
        self.inputs = None
        if model.nu and "inputs" not in model.functions:
            self.inputs = rng.random((count, model.nu))

    def together(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return rows, flat states and statuses of all."""
        self.lanes.start(self.starts, self.parameters, self.inputs)
        rows = self.lanes.run(EVERY, ROWS)
        return rows, self.lanes.states, self.lanes.statuses

    def alone(self, lane: int) -> tuple[np.ndarray, np.ndarray, int]:
        """Return rows, flat state and status of one, by the stepper of one trajectory."""
        model = self.model
        stepper = Stepper(model.library, self.settings, self.parameters[lane])
        start = self.starts[lane]
        q, v, z = np.split(start[1:], [model.nq, model.nq + model.nv])
        table = None
        if self.inputs is not None:
            table = np.repeat(self.inputs[lane][np.newaxis], EVERY * ROWS * stepper.sizes["rows_per_step"] + 1, axis=0)
        record = np.full((ROWS, self.lanes.width), np.nan)
        status = stepper.initialize(0.0, q, v, table, z)
        if not status:
            status, _ = stepper.run(EVERY * ROWS, EVERY, table, record)
        return record, stepper.state, status


@pytest.mark.parametrize(("name", "method"), CASES, ids=lambda value: value)
def test_each_lane_has_the_bits_of_a_run_alone(name: str, method: str) -> None:
    trajectories = Trajectories(model_of(name, method))
    rows, states, statuses = trajectories.together()
    assert not statuses.any()
    for lane in range(trajectories.lanes.lanes):
        record, state, status = trajectories.alone(lane)
        np.testing.assert_array_equal(rows[lane], record)
        np.testing.assert_array_equal(states[lane], state)
        assert statuses[lane] == status
    assert not np.array_equal(rows[0], rows[1])


@pytest.mark.parametrize("method", ["generalized_alpha", "rk45"])
def test_a_lane_that_fails_leaves_the_others_alone(method: str) -> None:
    trajectories = Trajectories(model_of("double_pendulum_on_shaking_base", method))
    well, _, _ = trajectories.together()
    trajectories.starts[1, -1] = 1e200
    rows, _, statuses = trajectories.together()
    others = np.arange(len(rows)) != 1
    assert statuses[1] != 0 and not statuses[others].any()
    np.testing.assert_array_equal(rows[others], well[others])
    assert np.isnan(rows[1]).any()
    assert trajectories.alone(1)[2] == statuses[1]


def test_held_inputs_are_those_of_each_lane() -> None:
    trajectories = Trajectories(model_of("quarter_car", "generalized_alpha"))
    trajectories.inputs = np.linspace(0.0, 0.02, trajectories.lanes.lanes)[:, np.newaxis]
    rows, _, statuses = trajectories.together()
    assert not statuses.any()
    for lane in range(len(rows)):
        np.testing.assert_array_equal(rows[lane], trajectories.alone(lane)[0])


def test_steppers_with_events_say_why_they_have_no_lanes() -> None:
    model = model_of("bouncing_ball", "rk45")
    assert "stepper:" in str(model.stepper_in_lanes(model.library))
