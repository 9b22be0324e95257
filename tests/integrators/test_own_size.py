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
    builder = eomgen.SceneBuilder("crossed", gravity=[0, 0, 0])
    builder.parameter("L", 1.0, tunable=True).parameter("place", 0.0, tunable=True).body("a", 1.0).body("b", 0.5)
    builder.joint("x", "prismatic", "base", "a", axis=[1, 0, 0], position=["place", 0, 0])
    builder.joint("y", "prismatic", "a", "b", axis=[0, 1, 0])
    builder.point("o", "base", ["place", 0, "0.3 * L"]).point("r", "b", [0, 0, 0]).point("p", "a", [0, 0, 0])
    builder.spring("s", "o", "p", stiffness=3.0, length="L").spring("u", "o", "r", stiffness=2.0, length="0.4 * L")
    return eomgen.build(builder.build())


@pytest.mark.slow
@pytest.mark.parametrize("size", [1e-12, 1e-6, 1e6])
def test_a_small_machine_moves_as_a_large_one(size: float) -> None:
    def run(length: float) -> np.ndarray:
        start = {"q": [length, 0.5 * length], "v": [0, 0]}
        options = {"method": "taylor", "tolerance": 1e-12, "initial": start}
        solution = crossed().simulate(5.0, 0.5, parameters={"L": length}, **options)
        assert solution.success, solution.message
        return solution.q / length

    assert np.abs(run(size) - run(1.0)).max() < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("spin", [1e6, 1e8, 1e10])
def test_spins_that_a_step_cannot_follow_stop_the_run(spin: float) -> None:
    own = {"method": "taylor", "tolerance": 0, "order": 4}
    builder = eomgen.SceneBuilder("spin", gravity=[0, 0, 0]).body("b", 1.0, inertia=[0.01, 0.02, 0.03])
    model = eomgen.build(builder.joint("h", "free", "base", "b").build())
    solution = model.simulate(0.1, 0.01, initial={"v": [0, 0, spin, 0, 0, 0]}, **own)
    assert not solution.success and len(solution.t) == 1
    assert solution.message.startswith("stopped at t = 0 s, after 0 of 10 steps: "), solution.message
    slow = model.simulate(0.1, 0.01, initial={"v": [0, 0, 10.0, 0, 0, 0]}, **own)
    assert slow.success and slow.q[-1, 3] == pytest.approx(np.sin(0.5), abs=1e-7)
