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
    *(("four_bar", method) for method in ("generalized_alpha", "rosenbrock", "rattlie", "rk45_partitioned")),
    *(("double_pendulum_on_shaking_base", method) for method in ("taylor", "tdg3", "corrected_predictor", "lsrt2")),
    ("free_spinning_body", "rk45"),
    ("pendulum_on_shaking_base", "omf4"),
    ("active_vehicle", "generalized_alpha"),
    ("digital", "rk4"),
    ("digital", "generalized_alpha"),
    ("quarter_car", "generalized_alpha"),  # held inputs
    ("hanging_chain", "rk4"),  # blocks in loops
]
#: Scenes whose events lanes meet at times of their own, and the step.
WITH_EVENTS = [
    ("bouncing_ball", "rk45", 0.05),
    ("bouncing_ball", "tdg3", 0.05),
    ("latch", "generalized_alpha", 0.03),
    ("latch", "rk4_partitioned", 0.03),
    ("driven", "rk4", 0.01),
]
OWN = Path(__file__).parent / "scenes"


def model_of(name: str, method: str) -> eomgen.Model:
    """Return a model without fused multiplications and additions, which compilers choose differently."""
    own = OWN / f"{name}.toml"
    scene = eomgen.load(own if own.exists() else EXAMPLES / name / "scene.toml")
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
        rows, _, states, statuses = self.lanes.runs(self.starts, self.parameters, self.inputs, EVERY, ROWS, 0)
        return rows[:, 1:], states, statuses

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
        stepper.run(0, 1, table, np.empty((1, self.lanes.width)))  # the row of the start, which lanes write as well
        done = 0
        while not status and stepper.count < EVERY * ROWS:  # a log of events that is half full ends a call
            status, rows = stepper.run(EVERY * ROWS - stepper.count, EVERY, table, record[done:])
            done += rows
        return record, stepper.state, status

    def compared(self) -> tuple[np.ndarray, np.ndarray]:
        """Hold rows, states and statuses of lanes to those of runs alone, and return states and statuses."""
        rows, states, statuses = self.together()
        for lane, status in enumerate(statuses):
            record, state, alone = self.alone(lane)
            np.testing.assert_array_equal(rows[lane], record)
            np.testing.assert_array_equal(states[lane], state)
            assert status == alone
        return states, statuses


@pytest.mark.slow_except("pendulum_on_shaking_base-omf4", "digital-rk4")
@pytest.mark.long_except("pendulum_on_shaking_base-omf4", "four_bar-rosenbrock", "digital-rk4")
@pytest.mark.parametrize(("name", "method"), CASES, ids=lambda value: value)
def test_each_lane_has_the_bits_of_a_run_alone(name: str, method: str) -> None:
    states, statuses = Trajectories(model_of(name, method)).compared()
    assert not statuses.any() and not np.array_equal(states[0], states[1])


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
def test_a_lane_that_fails_leaves_the_others_alone() -> None:
    trajectories = Trajectories(model_of("double_pendulum_on_shaking_base", "rk45"))
    well, _, _ = trajectories.together()
    trajectories.starts[1, -1] = 1e200
    rows, _, statuses = trajectories.together()
    others = np.arange(len(rows)) != 1
    assert statuses[1] != 0 and not statuses[others].any()
    np.testing.assert_array_equal(rows[others], well[others])
    assert np.isnan(rows[1]).any()
    assert trajectories.alone(1)[2] == statuses[1]


@pytest.mark.slow
@pytest.mark.long_except("latch-generalized_alpha-0.03")
@pytest.mark.parametrize(("name", "method", "step"), WITH_EVENTS, ids=str)
def test_each_lane_meets_its_own_events(name: str, method: str, step: float) -> None:
    """Impacts, also of loops, resets, modes, counts, records and samples; one that comes again and again fails."""
    trajectories = Trajectories(model_of(name, method), step=step)
    states, statuses = trajectories.compared()
    places = trajectories.lanes.places
    assert np.all(states[:, places["event_count"]].sum(axis=1) > 0)
    assert statuses.any() == (name == "driven") and not statuses.all()
    assert len(np.unique(states[:, places["event_time"]][:, 0])) > 1


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
