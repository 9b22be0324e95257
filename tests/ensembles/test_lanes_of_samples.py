"""Samples side by side: the results of samples one after the other, and which of them are left to runs alone."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.ensembles.samples import SampleRunner, neighbours
from tests.models.cosserat import beam_scene
from tests.models.library import scene

SCENE = scene(
    "pendulum",
    name="swing",
    gravity=[0, 0, -9.81],
    parameters__mass={"value": 1.0, "unit": "kg", "tunable": True},
    bodies__rod__mass="mass",
    joints__hinge__initial__velocity=0.1,
    points__tip={"body": "rod", "position": [0, 0, -1]},
    outputs={"height": {"position": "tip"}},
    simulation=None,
)
LAW = Path(__file__).parent / "scenes" / "law.c"
VARY = {"mass": "normal(1 kg, 10 %)", "q.hinge": "uniform(-1, 1)"}


@pytest.fixture(scope="module")
def swing() -> eomgen.Model:
    return eomgen.build(SCENE, method="rk4", profile="reproducible")


@pytest.fixture
def lanes(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[object]]:
    """Collect what blocks have for lanes, or why they have none."""
    seen: list[object] = []
    block = SampleRunner.block

    def watched(self: SampleRunner, first: int, count: int) -> object:
        seen.append(self.lanes)
        return block(self, first, count)

    monkeypatch.setattr(SampleRunner, "block", watched)
    yield seen


def found(model: eomgen.Model, **options: object) -> eomgen.Ensemble:
    columns = ["q.hinge", "a.hinge", "output.height[2]"]
    given = {"t_end": 0.5, "step": 0.01, "vary": VARY, "samples": 23, "columns": columns}
    return model.simulate_many(**(given | options))


def same(one: eomgen.Ensemble, other: eomgen.Ensemble) -> None:
    assert one.columns == other.columns and one.done == other.done
    for name in one.results:
        np.testing.assert_array_equal(one.results[name], other.results[name])
    for column in one.columns:
        np.testing.assert_array_equal(one.mean(column), other.mean(column))


def beside_and_alone(model: eomgen.Model, lanes: list[object], **options: Any) -> tuple[eomgen.Ensemble, ...]:
    """Return an ensemble that ran side by side, and the same with runs one after the other."""
    beside = found(model, **options)
    assert lanes and not any(isinstance(item, str) for item in lanes)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EOMGEN_LANES", "off")
        return beside, found(model, **options)


@pytest.mark.parametrize("count", [1, 8, 9, 23, 777, 1000])
def test_lanes_hold_samples_of_similar_values(count: int) -> None:
    values = np.random.default_rng(1).uniform(size=(count, 2))
    order = neighbours(values, 8)
    assert np.array_equal(np.sort(order), np.arange(count))
    groups = np.split(values[order], range(8, count, 8))
    widths = np.array([np.ptp(group, axis=0) for group in groups if len(group) == 8])
    if count >= 777:  # uniform, 7 halvings
        assert np.median(widths) < 0.2


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"record_every": 3},
        {"record_every": 25, "points": 2},
        {"t_end": 0.37, "points": 5},
        {"t_end": 0.505, "record_every": 7},
        {"t_end": 0.003},
    ],
    ids=str,
)
def test_results_are_those_of_runs_one_after_the_other(
    swing: eomgen.Model,
    lanes: list[object],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    options: dict[str, object],
) -> None:
    with caplog.at_level(logging.INFO, "eomgen.products.ensembles"):
        beside = found(swing, **options)
    assert lanes and not any(isinstance(item, str) for item in lanes)
    assert re.fullmatch(r"side by side: \d+ lanes", beside.how)
    assert caplog.messages == [f"swing: samples run {beside.how}"]
    lanes.clear()
    monkeypatch.setenv("EOMGEN_LANES", "off")
    alone = found(swing, **options)
    same(beside, alone)
    assert alone.how == "one after the other: EOMGEN_LANES is off"
    assert alone.to_dict()["how"] in alone.message
    assert set(lanes) == {"EOMGEN_LANES is off"}


@pytest.mark.slow
def test_a_sample_that_explodes_is_judged_alone_and_the_others_stay(swing: eomgen.Model, lanes: list[object]) -> None:
    """RK4 is stable up to 2.83 by the step: a heavy rod on its spring has 2.1, a light one 3.5."""
    springs = {**SCENE, "efforts": {"coil": {"joint": "hinge", "effort": "-20 * q.hinge"}}}
    model = eomgen.build(springs, method="rk4", profile="reproducible")
    table = {"mass": np.array([1.0, 1.0, 0.01, 1.0, 1.0, 1.0]), "q.hinge": np.full(6, 1e-3)}
    ensemble = found(model, vary=None, table=table, samples=6, t_end=60.0, step=0.25)
    assert lanes and not any(isinstance(item, str) for item in lanes)
    alone = model.simulate(60.0, 0.25, parameters={"mass": 0.01}, initial={"hinge": {"position": 1e-3}})
    assert not alone.success
    assert [(item.number, item.reason) for item in ensemble.failed] == [(2, alone.message)]
    well = model.simulate(60.0, 0.25, parameters={"mass": 1.0}, initial={"hinge": {"position": 1e-3}})
    assert ensemble.results["q.hinge.final"][0] == well.q[-1, 0]


def test_a_refused_parameter_fails_alone(swing: eomgen.Model) -> None:
    ensemble = found(swing, vary=None, table={"mass": [1.0, -1.0, 2.0]}, samples=3)
    assert [item.number for item in ensemble.failed] == [1]
    assert "mass" in ensemble.failed[0].reason
    assert np.isfinite(ensemble.results["q.hinge.final"][[0, 2]]).all()


def test_what_cannot_run_side_by_side_says_why(swing: eomgen.Model, lanes: list[object]) -> None:
    found(swing, controllers={})
    assert set(lanes) == {"controllers is given"}


@pytest.mark.slow
def test_a_beam_that_bends_beyond_what_beams_are_for_fails_in_lanes_too(lanes: list[object]) -> None:
    """A rod of 2 m that hangs from one end in its own weight, sideways."""
    builder = eomgen.SceneBuilder("limp", gravity=[0, -9.81, 0]).parameter("stiffness", 50.0, tunable=True)
    bent = {"modes": 1, "stiffness": "stiffness", "normalisation": "unit"}
    builder.beam("rod", 2.0, mass_per_length=1.0, bending_y=bent).joint("h", "fixed", "base", "rod")
    model = eomgen.build(builder.build(), method="rk4", profile="quick")
    table = {"stiffness": [50.0, 0.5, 100.0]}
    ensemble = model.simulate_many(1.0, 0.002, table=table)
    assert lanes and not any(isinstance(item, str) for item in lanes)
    assert [item.number for item in ensemble.failed] == [1]
    assert re.search(r"but the beam rod bends by slopes of \S+ \(root mean square\)", ensemble.failed[0].reason)
    assert np.isfinite(ensemble.results["q.rod.final"][[0, 2]]).all()


@pytest.mark.long
def test_elements_of_beams_that_turn_too_far_fail_in_lanes_too(lanes: list[object]) -> None:
    scene = beam_scene(2, {"torque": [0.0, 0.0, "2000 * load"]}, {"stiffness_damping": 0.02})
    model = eomgen.build(scene, profile="quick")
    ensemble = model.simulate_many(1.5, 2e-3, table={"load": [0.01, 0.2, 0.02]}, columns=["q.rope.2[4]"])
    assert lanes and not any(isinstance(item, str) for item in lanes)
    assert [item.number for item in ensemble.failed] == [1]
    assert re.search(r"element \d of the beam rope turns by more than half a turn", ensemble.failed[0].reason)


@pytest.mark.slow
@pytest.mark.long_cases("absolute", "joint")
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_samples_begin_on_their_constraints(coordinates: str, lanes: list[object]) -> None:
    """A link whose length varies: in a loop that it is too short for once, and where its joint puts it."""
    scene: dict[str, Any] = {**SCENE, "coordinates": coordinates}
    table = {"mass": [1.0, 1.1, 0.9], "reach": [0.5, 0.4, 0.6]}
    scene["parameters"] = {**SCENE["parameters"], "reach": {"value": 0.5, "unit": "m", "tunable": True}}
    scene["bodies"] = {"rod": {**SCENE["bodies"]["rod"], "center_of_mass": [0, 0, "-reach"]}}
    scene["points"] = {"tip": {"body": "rod", "position": [0, 0, "-2 * reach"]}}
    if coordinates == "joint":
        scene["bodies"]["bob"] = {"mass": 0.5, "inertia": [0.01, 0.01, 0.01]}
        slide = {"type": "prismatic", "parent": "base", "child": "bob", "axis": [1, 0, 0], "position": [0, 0, -1.6]}
        scene["joints"] = {**SCENE["joints"], "slide": {**slide, "initial": {"position": -0.6}}}
        tie = {"type": "distance", "length": 1.0, "first": "tip", "second": {"body": "bob"}}
        scene["constraints"] = {"tie": tie}
        table["reach"][1] = 0.2
    model = eomgen.build(scene, method="generalized_alpha", profile="reproducible")
    given = {"vary": None, "table": table, "samples": 3, "columns": ["output.height[0]", "output.height[2]"]}
    beside, alone = beside_and_alone(model, lanes, **given)
    assert beside.failed == alone.failed and len(alone.failed) == (coordinates == "joint")
    for name in alone.results:
        np.testing.assert_allclose(beside.results[name], alone.results[name], rtol=1e-9, atol=1e-12)


@pytest.fixture(scope="module")
def pushed() -> eomgen.Model:
    inputs = {"push": {"formula": "2 * sin(5 * t)"}, "pull": {"formula": "mass * cos(3 * t)"}, "hold": {}}
    inputs = {name: {"unit": "N m", **keys} for name, keys in inputs.items()}
    driven = {**SCENE, "inputs": inputs, "efforts": {"motor": {"joint": "hinge", "effort": "push - pull + hold"}}}
    return eomgen.build(driven, method="lsrt2", profile="reproducible")


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        {"inputs": {"push": lambda t: np.exp(-t)}},
        {"inputs": {"hold": np.linspace(0.0, 1.0, 51) ** 2}, "record_every": 4},
        {"vary": VARY | {"scale.push": "uniform(0.5, 2)", "hold": "uniform(-1, 1)"}, "t_end": 0.37},
        {"vary": VARY | {"hold": "uniform(-1, 1)"}},
        {"vary": {"q.hinge": "uniform(-1, 1)", "hold": "uniform(-1, 1)"}},
        {"inputs": {"push": lambda t: np.exp(-t)}, "t_end": 0.504, "record_every": 3},
    ],
    ids=["function", "table", "laws", "held", "formulas in common", "shorter"],
)
def test_inputs_may_change_with_time(pushed: eomgen.Model, lanes: list[object], options: dict[str, Any]) -> None:
    columns = ["q.hinge", "a.hinge", "input.push", "input.pull", "input.hold"]
    beside, alone = beside_and_alone(pushed, lanes, columns=columns, **options)
    same(beside, alone)
    assert beside.deviation("q.hinge")[-1] > 1e-3


@pytest.mark.long
def test_bases_and_drives_are_laws_of_each_sample(lanes: list[object]) -> None:
    """What jumps at the parameters of a sample alone is refused as a run alone refuses it."""
    scene: dict[str, Any] = {**SCENE, "parameters": {**SCENE["parameters"], "shake": {"value": 0.05, "tunable": True}}}
    scene["base"] = {"position": ["shake * sin(5 * t)", 0, "0.01 * cos(9 * t)"]}
    scene["bodies"] = {"arm": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}, **SCENE["bodies"]}
    drive = "shake * t**2 if shake < 0.08 or t < 0.2 else 1"
    turn = {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 0, 1], "drive": drive}
    scene["joints"] = {"turn": turn, "hinge": {**SCENE["joints"]["hinge"], "parent": "arm"}}
    model = eomgen.build(scene, method="generalized_alpha", profile="reproducible")
    table = {"shake": [0.05, 0.02, 0.09, 0.07, 0.05], "mass": [1.0, 1.0, 1.0, 1.0, 1.2]}
    columns = ["q.hinge", "output.height[0]", "output.height[2]"]
    given = {"vary": None, "table": table, "samples": 5, "columns": columns}
    of_masses = {**given, "table": {"mass": table["mass"]}, "columns": ["output.height[0]", "energy.base_power"]}
    same(*beside_and_alone(model, lanes, **of_masses))
    lanes.clear()
    beside, alone = beside_and_alone(model, lanes, **given)
    same(beside, alone)
    assert [item.number for item in alone.failed] == [2] and beside.failed == alone.failed
    assert "jump" in beside.failed[0].reason
    assert beside.deviation("output.height[2]")[-1] > 1e-4


#: A run ends at the bottom, or is thrown back there; a mode makes it swing in oil once it has turned.
EVENTS: dict[str, dict[str, Any]] = {
    "stop": {"when": "q.hinge + 0.3", "direction": "falling", "action": "stop"},
    "impact": {"when": "q.hinge + 0.3", "direction": "falling", "action": "impact", "restitution": 0.7},
    "switch": {"when": "v.hinge", "direction": "rising", "action": "switch", "mode": "oil", "to": 1},
}


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("action", "method", "every"), [("stop", "rk4", 7), ("impact", "generalized_alpha", 1), ("switch", "rk45", 3)]
)
def test_samples_meet_events_of_their_own(action: str, method: str, every: int, lanes: list[object]) -> None:
    scene = {
        **SCENE,
        "modes": {"oil": {"value": 0}},
        "efforts": {"oil": {"joint": "hinge", "effort": "-mode.oil * v.hinge"}},
        "outputs": {**SCENE["outputs"], "drag": {"formula": "mode.oil * v.hinge"}},
        "events": {action: EVENTS[action]},
    }
    model = eomgen.build(scene, method=method, profile="reproducible")
    given = {
        "columns": ["q.hinge", "a.hinge", "output.drag"],
        "t_end": 0.905 if every == 3 else 0.9,
        "record_every": every,
    }
    beside, alone = beside_and_alone(model, lanes, **given)
    same(beside, alone)
    assert not alone.failed
    ends = np.isfinite(beside.mean("q.hinge"))
    stopped = np.abs(beside.results["q.hinge.final"] + 0.3) < 1e-9
    assert ends.all() and (stopped.any() and not stopped.all()) == (action == "stop")
    assert np.any(beside.results["output.drag.final"] != 0.0) == (action == "switch")


@pytest.mark.long
def test_controllers_in_c_are_called_for_each_sample(lanes: list[object]) -> None:
    servo = {"type": "sampled", "sample": "20 ms", "signals": {"angle": "q.hinge"}, "memory": 1}
    scene = {**SCENE, "controllers": {"servo": {**servo, "source": str(LAW), "function": "law"}}}
    scene["efforts"] = {"motor": {"joint": "hinge", "effort": "servo"}}
    model = eomgen.build(scene, method="rk4", profile="reproducible")
    table = {"q.hinge": [0.1, 0.95, -0.3, 0.5, 0.7], "mass": [1.0, 1.1, 0.9, 1.0, 1.2]}
    given = {"vary": None, "table": table, "samples": 5, "step": 0.007, "t_end": 0.49}
    beside, alone = beside_and_alone(model, lanes, **given)
    same(beside, alone)
    assert beside.failed == alone.failed and [item.number for item in alone.failed] == [1]
    assert "servo" in alone.failed[0].reason and "7" in alone.failed[0].reason
