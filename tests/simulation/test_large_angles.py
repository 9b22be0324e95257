"""Sines of huge arguments, which compiled code does not compute: refused before a run, or they stop it and are
named."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from eomgen.simulation.stepping.settings import large_angles
from eomgen.system.description import Description
from tests.models.library import scene
from tests.simulation.rails import built, on_rail


def slider(effort: str = "u", formula: str | None = None) -> eomgen.Model:
    return built(on_rail(effort, "h").input("u", formula) if formula else on_rail(effort, "h").input("u"))


@pytest.mark.parametrize(("t", "angles"), [(1e6, []), (2e7, [2e10]), (-2e7, [-2e10]), (2e10, [2e13, 2e11])])
def test_waves_of_roads_are_refused_by_the_angle_that_they_have_reached(t: float, angles: list[float]) -> None:
    """The limit is 1e10 rad; of each input the first wave beyond counts."""
    waves = {"front": [(0.1, 1e-3, 0.0), (0.1, 1e3, 0.0), (0.1, 1e4, 0.0)][:2], "rear": [(0.1, 10.0, 0.0)]}
    inputs = [SimpleNamespace(name=name, harmonics=rows, formula=None) for name, rows in waves.items()]
    description = cast(Description, SimpleNamespace(inputs=inputs, formulas=(), outputs=()))
    found = large_angles(description, {("time", "", 0): t})
    expected = [f"cos({angle:.6g}) in the input {name}" for angle, name in zip(angles, waves, strict=False)]
    assert found == " and ".join(expected)
    assert "front" not in large_angles(description, {("time", "", 0): t}, inputs=["front"])


@pytest.mark.slow
def test_an_input_of_time_is_right_up_to_the_limit_and_refused_beyond() -> None:
    model = slider(formula="sin(7 * t)**2")
    start = 1.42e9
    solution = model.simulate(start + 10.0, 1e-2, t_start=start, method="rk4")
    t = solution.t - start
    exact = 0.5 * t - (np.sin(14 * solution.t) - np.sin(14 * start)) / 28
    assert solution.success and solution.v[:, 0] == pytest.approx(exact, abs=1e-6)
    with pytest.raises(UsageError) as refused:
        model.simulate(1e13 + 10.0, 0.1, t_start=1e13)
    assert str(refused.value) == (
        "usage error: t_start: sin(7e+13) in the input u would be taken at t = 1e+13 s; sines and cosines are"
        " computed up to 1e+10 rad: beyond, numbers differ by 2e-06 rad and more; try: an origin of time near"
        " the run, with the phase there in the formula"
    )
    with pytest.raises(UsageError, match=r"t_end: sin\(1.05e\+10\) in the input u would be taken at t = 1.5e\+09 s"):
        model.simulate(1.5e9, 1e3, t_start=1.4e9)
    assert model.simulate(1e13 + 10.0, 0.1, t_start=1e13, inputs={"u": 1.0}).v[-1] == pytest.approx(10.0, rel=1e-9)


@pytest.mark.slow_except("sine-generalized_alpha")
@pytest.mark.parametrize("method", ["generalized_alpha", "rk4"])
@pytest.mark.parametrize(
    "effort", ["1e-14 * sin(1e11 * q.h)", "1e-3 if cos(1e11 * q.h) < 2 else 2"], ids=["sine", "choice"]
)
def test_an_argument_that_grows_with_the_motion_stops_the_run_and_is_named(method: str, effort: str) -> None:
    model = slider(effort)
    solution = model.simulate(1.0, 1e-2, method=method, initial={"h": {"position": 0.0, "velocity": 1.0}})
    assert not solution.success and 0.08 < solution.t[-1] <= 0.1
    assert "where formulas take" in solution.message and "1e+10 rad" in solution.message, solution.message
    assert solution.message.endswith("try: an origin of time near the run, with the phase there in the formula")


@pytest.mark.slow
def test_a_joint_that_has_turned_too_far_is_named() -> None:
    start = {"hinge": {"position": 1.0, "velocity": 4e10}}
    solution = eomgen.build(scene("pendulum")).simulate(1.0, 0.1, method="rk4", initial=start)
    assert not solution.success
    assert ", where q.hinge is " in solution.message, solution.message
    assert solution.message.endswith("try: smaller initial angles and velocities, or a shorter run")
