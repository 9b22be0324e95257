"""Taylor and Hermite steps measure errors by the motion and its machine: small machines, far places, rest, spins too
fast."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import eomgen
from eomgen.pipeline.model import Model


@cache
def crossed() -> Model:
    """Return two sliders across each other on springs, all lengths in units of L, standing at a place along the first
    one."""
    return eomgen.build(
        {
            "format": 1,
            "name": "crossed",
            "gravity": [0, 0, 0],
            "parameters": {"L": {"value": 1.0, "tunable": True}, "place": {"value": 0.0, "tunable": True}},
            "bodies": {"a": {"mass": 1.0}, "b": {"mass": 0.5}},
            "joints": {
                "x": {
                    "type": "prismatic",
                    "parent": "base",
                    "child": "a",
                    "axis": [1, 0, 0],
                    "position": ["place", 0, 0],
                },
                "y": {"type": "prismatic", "parent": "a", "child": "b", "axis": [0, 1, 0]},
            },
            "points": {
                "o": {"body": "base", "position": ["place", 0, "0.3 * L"]},
                "r": {"body": "b"},
                "p": {"body": "a"},
            },
            "springs": {
                "s": {"first": "o", "second": "p", "stiffness": 3.0, "length": "L"},
                "u": {"first": "o", "second": "r", "stiffness": 2.0, "length": "0.4 * L"},
            },
        }
    )


@pytest.mark.slow
@pytest.mark.parametrize("method", ["taylor"])
@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-6, 1e-3, 1e3, 1e6])
def test_a_small_machine_moves_as_a_large_one(method: str, size: float) -> None:
    step, own = (0.5, {"tolerance": 1e-12}) if method == "taylor" else (0.02, {})

    def run(length: float) -> np.ndarray:
        start = {"q": [length, 0.5 * length], "v": [0, 0]}
        solution = crossed().simulate(5.0, step, method=method, parameters={"L": length}, initial=start, **own)
        assert solution.success, solution.message
        return solution.q / length

    assert np.abs(run(size) - run(1.0)).max() < 1e-10


@pytest.mark.slow
def test_a_place_far_away_costs_only_the_rounding_of_places() -> None:
    start = {"q": [1.0, 0.5], "v": [0, 0]}
    near, far = (
        crossed().simulate(5.0, 0.5, method="taylor", parameters={"place": place}, initial=start)
        for place in (0.0, 1e6)
    )
    assert near.success and far.success
    assert np.abs(far.q - near.q).max() < 1e6 * 1e-13


@pytest.mark.slow
@pytest.mark.parametrize("method", ["taylor"])
@pytest.mark.parametrize("stiffness", [1e2, 1e5])
def test_forces_that_cancel_at_rest_stop_no_run(method: str, stiffness: float) -> None:
    builder = eomgen.SceneBuilder("rest", gravity=[0, 0, -9.81]).parameter("k", 1e2, tunable=True).body("b", 0.7)
    builder.joint("x", "prismatic", "base", "b", axis=[0, 0, 1], stiffness="k", rest="0.7 * 9.81 / k")
    solution = eomgen.build(builder.build()).simulate(2.0, 1e-3, method=method, parameters={"k": stiffness})
    assert solution.success, solution.message
    assert np.abs(solution.q).max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("spin", [1e6, 1e8, 1e10])
@pytest.mark.parametrize(("method", "own"), [("taylor", {"tolerance": 0, "order": 4})])
def test_spins_that_a_step_cannot_follow_stop_the_run(method: str, own: dict[str, float], spin: float) -> None:
    builder = eomgen.SceneBuilder("spin", gravity=[0, 0, 0]).body("b", 1.0, inertia=[0.01, 0.02, 0.03])
    model = eomgen.build(builder.joint("h", "free", "base", "b").build())
    solution = model.simulate(0.1, 0.01, method=method, initial={"v": [0, 0, spin, 0, 0, 0]}, **own)
    assert not solution.success and len(solution.t) == 1
    assert solution.message.startswith("stopped at t = 0 s, after 0 of 10 steps: "), solution.message
    slow = model.simulate(0.1, 0.01, method=method, initial={"v": [0, 0, 10.0, 0, 0, 0]}, **own)
    assert slow.success and slow.q[-1, 3] == pytest.approx(np.sin(0.5), abs=1e-7)
