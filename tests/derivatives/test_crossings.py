"""Jumps of forces that a run passes: their moments move with parameters and starts as in closed form."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.describe import describe
from eomgen.products.derivatives import crossings, linearise
from eomgen.scene.builder import SceneBuilder

STEP = 0.01


def sled(effort: str) -> SceneBuilder:
    builder = SceneBuilder("crossing_sled", gravity=[0, 0, 0])
    for name, value in {"far": 0.105, "rate": 0.3}.items():
        builder.parameter(name, value, tunable=True)
    builder.body("mass", 1.0).joint("slide", "prismatic", "base", "mass", axis=[1, 0, 0], initial={"velocity": 1.0})
    levels = {"points": [[-1.0, 0.0], [0.1, 3.0], [2.0, 3.0]], "outside": "hold"}
    builder.curve("steps", interpolation="steps", **levels).curve("ramp", interpolation="linear", **levels)
    return builder.effort("push", "slide", effort).output("x", formula="q.slide")


@cache
def passing() -> Any:
    """Return a sled that runs at 1 m/s, whose force bends at 0.05 m and jumps beyond ``far``."""
    effort = "1e-3 - rate*(3 if q.slide > far else 0) + (1e-6*(q.slide - 0.055) if q.slide > 0.055 else 0)"
    return eomgen.build(sled(effort).build(), profile="instant")


def test_moments_of_jumps_move_as_far_over_speed(monkeypatch: pytest.MonkeyPatch) -> None:
    """t = far/v: by 1/v with far, which counts by its value, -far/v^2 with the speed and -1/v with the place."""
    monkeypatch.setattr(linearise, "check_crossings", lambda *_: None)
    by = ["far", "rate", "q.slide", "v.slide"]
    found, branches = passing().sensitivities(0.15, STEP, by=by, of=["x"]), passing().branches()
    passed = crossings._crossings(found._run, branches)
    assert sorted(item.row for item in passed) == [5, 10]
    (jump,) = (item for item in passed if crossings._jumps(branches, item))
    assert jump.row == 10 and abs(jump.change) == pytest.approx(STEP, rel=1e-2)
    (shifts,) = crossings._shifts(found._run, branches, [jump])
    np.testing.assert_allclose(shifts[[0, 2, 3]], [10.5, 100.0, 11.0], rtol=1e-2)  # v: over the row after it
    assert shifts[1] < 0.01  # within the step


def test_runs_that_pass_a_jump_are_refused() -> None:
    told = (
        "forces jump near t = 0.11 s by a comparison in effort push, at a moment that far moves, which is in no deriv"
    )
    with pytest.raises(crossings.CrossedJump, match=told):
        passing().sensitivities(0.15, STEP, by=["far"])
    assert passing().sensitivities(0.1, STEP, by=["v.slide"]).gradient("final(x)")["v.slide"] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("effort", "decided"),
    [
        ("sign(v.slide)", True), ("3 if q.slide > far else 0", True), ("3 if t > 0.5 else far", False),
        ("steps(q.slide)", True), ("ramp(q.slide)", False), ("steps(t)", False), ("max(q.slide, 0)*far", False),
    ],
)  # fmt: skip
def test_formulas_whose_value_jumps_with_the_motion(effort: str, decided: bool) -> None:
    formulas = describe(sled(effort).build()).formulas
    assert any(map(crossings._decided_by_motion, formulas)) is decided
