"""Runs with events on a device, by the stand-in: the bits of the processor for impacts, modes, and runs that stop."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.gpu.ensembles import DeviceSamples
from tests.gpu.test_device_ensembles import EXAMPLES, SWING, both, built, compare
from tests.models.cosserat import beam_scene

#: A run ends at the bottom, or is thrown back there; a mode makes it swing in oil once it has turned.
ACTIONS: dict[str, dict[str, Any]] = {
    "stop": {"when": "q.hinge + 0.3", "direction": "falling", "action": "stop"},
    "impact": {"when": "q.hinge + 0.3", "direction": "falling", "action": "impact", "restitution": 0.7},
    "switch": {"when": "v.hinge", "direction": "rising", "action": "switch", "mode": "oil", "to": 1},
}
VARY = {"mass": "uniform(0.8 kg, 1.2 kg)", "q.hinge": "uniform(-0.25, 1)"}
COLUMNS = ["q.hinge", "a.hinge", "energy.kinetic", "input.push", "drag", "t"]


def scene_with(action: str) -> dict[str, Any]:
    return {
        **SWING,
        "modes": {"oil": {"value": 0}},
        "efforts": {**SWING["efforts"], "oil": {"joint": "hinge", "effort": "-mode.oil * v.hinge"}},
        "outputs": {**SWING["outputs"], "drag": {"formula": "mode.oil * v.hinge"}},
        "events": {action: ACTIONS[action]},
    }


@pytest.fixture
def alone(stand_in: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that collects the samples of the device that run alone on the processor."""
    run, seen = DeviceSamples.run_alone, list[int]()

    def watched(self: DeviceSamples, first: int, values: Any, samples: Any) -> Any:
        return run(self, first, values, (seen.append(item[0]) or item for item in samples))

    monkeypatch.setattr(DeviceSamples, "run_alone", watched)
    return seen


@pytest.mark.parametrize(
    ("action", "method", "end", "options"),
    [
        ("stop", "rk4", 0.9, {"record_every": 7}),
        ("stop", "rk4", 0.505, {"points": 5, "inputs": {"push": 0.1}}),
        ("stop", "rk4", 0.5, {"inputs": {"push": np.cos}}),
        ("stop", "rk45", 0.9, {"record_every": 45}),
        ("impact", "generalized_alpha", 0.9, {}),
        ("switch", "rk45", 0.905, {"record_every": 3}),
    ],
    ids=["stop", "stop with few rows", "stop with tables", "stop with own steps", "impact", "switch"],
)
def test_samples_meet_events_of_their_own(
    action: str, method: str, end: float, options: dict[str, Any], alone: list[int]
) -> None:
    """With inputs that change with time, stopped samples run alone, as on the processor."""
    model = built(scene_with(action), method)
    cpu, gpu = both(model, end, 0.01, vary=VARY, samples=23, seed=1, columns=[*COLUMNS, f"event.{action}"], **options)
    compare(cpu, gpu)
    assert not gpu.failed
    stopped = np.abs(gpu.results["q.hinge.final"] + 0.3) < 1e-9
    assert (stopped.any() and not stopped.all()) == (action == "stop")
    assert alone == (np.flatnonzero(stopped).tolist() if callable(options.get("inputs", {}).get("push")) else [])
    assert (gpu.count("q.hinge")[-1] < 23) == (action == "stop")
    assert (gpu.results[f"event.{action}.final"] > 0).any()
    assert ((gpu.results["t.final"] < end) == stopped).all()
    assert np.any(gpu.results["output.drag.final"] != 0.0) == (action == "switch")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "method", "real", "vary", "end"),
    [
        ("bouncing_ball/scene.toml", "taylor", "double", {"restitution": "uniform(0.7, 0.9)"}, (2.0, 0.01)),
        ("bouncing_ball/scene.toml", "rk4", "float", {"restitution": "uniform(0.7, 0.9)"}, (1.0, 0.01)),
        ("spin_up_beam/exact.toml", "", "double", {}, (0.3, 0.0)),
    ],
    ids=["impacts", "floats", "exact beam"],
)
def test_events_floats_and_exact_beams(
    name: str, method: str, real: str, vary: dict[str, str], end: tuple[float, float], alone: list[int]
) -> None:
    scene = EXAMPLES / name
    model = eomgen.build(scene, method=method or None, profile="reproducible", real=real)
    vary = vary or {model.v_names[0]: "uniform(0.01, 0.02)"}
    cpu, gpu = both(model, end[0], end[1] or None, vary=vary, samples=8, seed=1)
    compare(cpu, gpu)
    assert alone == [sample.number for sample in gpu.failed]


@pytest.mark.long
def test_elements_of_beams_that_turn_too_far_are_judged_alone(alone: list[int]) -> None:
    scene = beam_scene(2, {"torque": [0.0, 0.0, "2000 * load"]}, {"stiffness_damping": 0.02})
    model = eomgen.build(scene, profile="reproducible")
    cpu, gpu = both(model, 1.5, 2e-3, table={"load": [0.01, 0.2, 0.02]}, columns=["q.rope.2[4]"])
    compare(cpu, gpu)
    assert alone == [sample.number for sample in gpu.failed] == [1]
    assert "turns by more than half a turn" in gpu.failed[0].reason
