"""Steppers of several trajectories side by side: the bits of the stepper of one, whatever the neighbours do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.integrators.stepper_layout import default_settings
from eomgen.pipeline.pipeline import build_in
from eomgen.products.ensembles.lane_code import stepper_in_lanes
from eomgen.simulation.stepping.stepper import LaneStepper, Stepper
from eomgen.toolchain import builder
from eomgen.toolchain.library import LaneLibrary

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
    ("pendulum_on_shaking_base", "omf4"),
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
#: Scenes whose events lanes meet at times of their own, and the step.
WITH_EVENTS = [
    ("bouncing_ball", "rk4", 0.05),
    ("bouncing_ball", "rk45", 0.05),
    ("bouncing_ball", "taylor", 0.05),
    ("bouncing_ball", "tdg3", 0.05),
    ("latch", "generalized_alpha", 0.03),
    ("latch", "lsrt2", 0.03),
    ("latch", "rk4_partitioned", 0.03),
    ("driven", "rk4", 0.01),
    ("driven", "rk45", 0.01),
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
#: A rod that drags a slider by a link, against a wall: an impact under constraints, a reset, a mode, a count.
LATCH = {
    "format": 1,
    "name": "latch",
    "gravity": [0, 0, -9.81],
    "parameters": {"mass": {"value": 0.5, "tunable": True}},
    "modes": {"caught": {"value": 0}},
    "bodies": {
        "rod": {"mass": 1.0, "center_of_mass": [0, 0, -0.5], "inertia": [0.1, 0.1, 0.01]},
        "bob": {"mass": "mass", "inertia": [0.01, 0.01, 0.01]},
    },
    "points": {"tip": {"body": "rod", "position": [0, 0, -1]}},
    "joints": {
        "hinge": {
            "type": "revolute",
            "parent": "base",
            "child": "rod",
            "axis": [0, 1, 0],
            "initial": {"position": 0.4},
        },
        "slide": {
            "type": "prismatic",
            "parent": "base",
            "child": "bob",
            "axis": [1, 0, 0],
            "position": [0, 0, -1.6],
            "initial": {"position": -1.0},
        },
    },
    "constraints": {"tie": {"type": "distance", "length": 1.0, "first": "tip", "second": {"body": "bob"}}},
    "efforts": {"brake": {"joint": "slide", "effort": "-3 * mode.caught * v.slide"}},
    "events": {
        "wall": {"when": "q.hinge + 0.2", "direction": "falling", "action": "impact", "restitution": 0.6},
        "swing": {"when": "q.hinge + 0.15", "direction": "rising", "action": "switch", "mode": "caught", "to": 1},
        "turn": {"when": "v.hinge", "direction": "falling", "action": "count"},
        "kick": {"when": "t - 0.31", "action": "reset", "reset": {"v.hinge": "0.9 * v.hinge"}},
    },
}
#: A cart that its input pushes to and fro between a stop and a clock.
DRIVEN = {
    "format": 1,
    "name": "driven",
    "parameters": {"gain": {"value": 4.0, "tunable": True}},
    "bodies": {"cart": {"mass": 1.0}},
    "joints": {"rail": {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0]}},
    "inputs": {"push": {"unit": "N"}},
    "states": {"held": {"sample": "23 ms", "formula": "q.rail"}},
    "efforts": {"motor": {"joint": "rail", "effort": "gain * push - 30 * held"}},
    "events": {"stop": {"when": "0.02 - q.rail", "direction": "falling", "action": "impact", "restitution": 0.5}},
}
OWN = {"digital": DIGITAL, "latch": LATCH, "driven": DRIVEN}


def model_of(name: str, method: str) -> eomgen.Model:
    """Return a model without fused multiplications and additions, which compilers choose differently."""
    scene = eomgen.load(OWN[name] if name in OWN else EXAMPLES / name / "scene.toml")
    return eomgen.build(scene, method=method, profile="reproducible")


class Trajectories:
    """As many trajectories as there are lanes, from states and parameters of their own."""

    def __init__(self, model: eomgen.Model, **settings: float) -> None:
        library = stepper_in_lanes(model, model.library)
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
        done = 0
        while not status and stepper.count < EVERY * ROWS:  # a log of events that is half full ends a call
            status, rows = stepper.run(EVERY * ROWS - stepper.count, EVERY, table, record[done:])
            done += rows
        return record, stepper.state, status


@pytest.mark.slow
@pytest.mark.long_except("pendulum_on_shaking_base-omf4")
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


def test_a_changed_translator_translates_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = eomgen.build(EXAMPLES / "pendulum_on_shaking_base" / "scene.toml", method="rk4").library
    lane_builder = builder.Builder(cache=builder.Cache(tmp_path))

    def refusal(text: str) -> str:
        lanes = lane_builder.build_lanes(library, "", lambda texts, preprocess: {builder.REFUSED: text})
        assert isinstance(lanes, str)
        return lanes

    assert [refusal("a loop"), refusal("a call")] == ["a loop", "a loop"]
    monkeypatch.setattr("eomgen.toolchain.builder.checkout_stamp", lambda: "changed")
    assert refusal("a call") == "a call"


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.long_cases("rk45")
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


@pytest.mark.long
def test_held_inputs_are_those_of_each_lane() -> None:
    trajectories = Trajectories(model_of("quarter_car", "generalized_alpha"))
    trajectories.inputs = np.linspace(0.0, 0.02, trajectories.lanes.lanes)[:, np.newaxis]
    rows, _, statuses = trajectories.together()
    assert not statuses.any()
    for lane in range(len(rows)):
        np.testing.assert_array_equal(rows[lane], trajectories.alone(lane)[0])


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(("name", "method", "step"), WITH_EVENTS, ids=str)
def test_each_lane_meets_its_own_events(name: str, method: str, step: float) -> None:
    """Impacts, also of loops, resets, modes, counts, records and samples; one that comes again and again fails."""
    trajectories = Trajectories(model_of(name, method), step=step)
    rows, states, statuses = trajectories.together()
    places = trajectories.lanes.places
    for lane in range(trajectories.lanes.lanes):
        record, state, status = trajectories.alone(lane)
        np.testing.assert_array_equal(rows[lane], record)
        np.testing.assert_array_equal(states[lane], state)
        assert statuses[lane] == status
        assert state[places["event_count"]].sum() > 0
    assert statuses.any() == (name == "driven") and not statuses.all()
    assert len(np.unique(states[:, places["event_time"]][:, 0])) > 1


@pytest.mark.long
@pytest.mark.slow
def test_lanes_of_models_with_other_numbers_are_one_compilation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []
    for spring in (300.0, 310.0):
        bodies = {"cart": {"mass": "mass"}}
        rail = {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0]}
        joints = {"rail": {**rail, "stiffness": spring, "initial": {"position": 0.1}}}
        parameters = {"mass": {"value": 1.5, "tunable": True}}
        data = {"format": 1, "name": "cart", "parameters": parameters, "bodies": bodies, "joints": joints}
        model = build_in(tmp_path, eomgen.load(data), method="rk4", profile="reproducible")
        assert isinstance(stepper_in_lanes(model, model.library), LaneLibrary)
        made.append(model)
        monkeypatch.setattr(builder, "compile_library", None)  # for the second stiffness
    masses = np.linspace(1.0, 2.0, 16)
    for model in made:
        many = model.simulate_many(0.5, 1e-3, method="rk4", table={"mass": masses}, error_estimate=False)
        each = [model.simulate(0.5, 1e-3, method="rk4", parameters={"mass": mass}).q[-1, 0] for mass in masses]
        assert many.results["q.rail.final"].tolist() == each
