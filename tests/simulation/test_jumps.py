"""Steps end at the times at which forces are known to jump: orders are kept, and lost where the times are not told.

An oscillator that is pushed by steps and ramps, against its exact motion (superposition of step responses).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.derive import derive
from tests.codegen.test_stand_alone import compiled, run

STIFFNESS, DAMPING, START = 25.0, 0.4, 0.1
LATE = 0.503
DECAY = DAMPING / 2
RATE = np.sqrt(STIFFNESS - DECAY**2)


def builder(coordinates: str = "joint") -> eomgen.SceneBuilder:
    made = eomgen.SceneBuilder("oscillator", coordinates=coordinates).body("mass", 1.0, inertia=[0.1, 0.1, 0.1])
    spring = {"stiffness": STIFFNESS, "damping": DAMPING, "initial": {"position": START}}
    return made.joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], **spring)


def free(t: np.ndarray | float) -> np.ndarray:
    return START * np.exp(-DECAY * t) * (np.cos(RATE * t) + DECAY / RATE * np.sin(RATE * t))


def after_step(t: np.ndarray | float) -> np.ndarray:
    """Return the motion that a force of 1 from t = 0 on adds."""
    s = np.maximum(t, 0.0)
    return (1 - np.exp(-DECAY * s) * (np.cos(RATE * s) + DECAY / RATE * np.sin(RATE * s))) / STIFFNESS


def after_ramp(t: np.ndarray | float) -> np.ndarray:
    s = np.maximum(t, 0.0)
    a, b = 1 / STIFFNESS, -DAMPING / STIFFNESS**2
    return a * s + b + np.exp(-DECAY * s) * (-b * np.cos(RATE * s) + (-a - DECAY * b) / RATE * np.sin(RATE * s))


def slopes(model: eomgen.Model, method: str, exact: float, counts: tuple[int, ...], **options: Any) -> np.ndarray:
    errors = []
    for count in counts:
        solution = model.simulate(1.0, 1.0 / count, method=method, **options)
        assert solution.success, solution.message
        errors.append(abs(solution.q[-1, -3 if model.multipliers else 0] - exact))
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


PUSHES = {
    "points": {"points": [[0, 0], [LATE, 3]], "interpolation": "steps"},
    "formula": {"formula": "3 if t > late else 0"},
    "curve": {"formula": "told(2 * t - 1)"},
}


@pytest.mark.slow
@pytest.mark.parametrize("said", PUSHES)
def test_order_across_a_jump(said: str) -> None:
    made = builder().parameter("late", LATE).input("push", **PUSHES[said]).effort("push", "rail", "push")
    made.curve("told", points=[[0, 0], [2 * LATE - 1, 3]], interpolation="steps")
    model = eomgen.build(made.build())
    exact = float(free(1.0) + 3 * after_step(1.0 - LATE))
    assert np.allclose(slopes(model, "generalized_alpha", exact, (100, 200, 400, 800)), 2.0, rtol=0, atol=0.1)
    assert np.allclose(slopes(model, "rk4", exact, (100, 200, 400)), 4.0, rtol=0, atol=0.2)


def pushed(pushes: Mapping[str, Any] | str, coordinates: str = "joint", law: str = "push", **more: Any) -> eomgen.Model:
    """Return the oscillator with an effort of an input."""
    made = builder(coordinates)
    made.input("push", pushes) if isinstance(pushes, str) else made.input("push", **pushes)
    for name, formula in more.items():
        made.input(name, formula)
    return eomgen.build(made.effort("push", "rail", law).build())


def steps(*points: tuple[float, float]) -> dict[str, Any]:
    """Return an input that jumps at points."""
    return {"points": [[0, 0], *map(list, points)], "interpolation": "steps"}


@pytest.mark.slow
def test_order_across_a_bend() -> None:
    model = pushed({"points": [[LATE, 0], [9, 9 * (9 - LATE)]], "interpolation": "linear"})
    exact = float(free(1.0) + 9 * after_ramp(1.0 - LATE))
    assert np.allclose(slopes(model, "rk4", exact, (100, 200, 400)), 4.0, rtol=0, atol=0.2)
    assert np.allclose(slopes(model, "generalized_alpha", exact, (100, 200, 400)), 2.0, rtol=0, atol=0.15)
    assert "jumps" not in model.library.layout["method"], "a bend does no harm to a method of order 2"


@pytest.mark.slow
def test_many_jumps_in_every_step_and_none() -> None:
    model = pushed({"wave": {"shape": "square", "period": 0.0217, "low": -1.0, "high": 2.0, "start": 0.003}})
    exact = free(1.0) - after_step(1.0)  # at t = 0 the wave is low: -1 = 2 - 3
    for at in (0.003 + 0.0217 * k for k in range(-1, 46)):
        exact = exact + (3 * after_step(1.0 - at) if at > 0 else 0.0)
        exact = exact - (3 * after_step(1.0 - at - 0.01085) if at + 0.01085 > 0 else 0.0)
    for method, coarse, fine in (("generalized_alpha", 1e-4, 1e-6), ("rk4", 3e-8, 2e-12)):
        for count, bound in ((10, coarse), (1000, fine)):
            solution = model.simulate(1.0, 1.0 / count, method=method)
            assert abs(solution.q[-1, 0] - float(exact)) < bound, (method, count)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha", "generalized_alpha_index3", "rk4_partitioned", "rattlie"])
def test_constraints_and_multipliers_across_a_jump(method: str) -> None:
    made = builder("absolute").input("push", points=[[0, 0], [LATE, 3]], interpolation="steps")
    made.force("push", "mass", force=["push", 0, "2 * push"])
    model = eomgen.build(made.build(), method=method)
    exact = float(free(1.0) + 3 * after_step(1.0 - LATE))
    order = 4.0 if method == "rk4_partitioned" else 2.0
    assert np.allclose(slopes(model, method, exact, (50, 100, 200)), order, rtol=0, atol=0.2)
    solution = model.simulate(1.0, 1.0 / 503, method=method)
    up = int(np.argmax(np.ptp(solution.multipliers, axis=0)))
    weight = solution.multipliers[:, up]
    before = solution.t < LATE
    assert np.allclose(weight[before], -9.81 * np.sign(-weight[0]), rtol=1e-6)
    assert np.allclose(np.abs(weight[~before]), 9.81 - 6.0, rtol=1e-6)


@pytest.mark.slow
def test_which_times_are_known() -> None:
    made = builder().parameter("v", 2).parameter("w", 2, tunable=True)
    made.curve("c", points=[[1, 0], [2, 5], [4, 5]], interpolation="linear")
    made.curve("s", wave={"shape": "sawtooth", "period": 3}).curve("q", points=[[0, 0], [1, 1]])
    made.input("a", "c(v * t) + derivative.c(t) + c(w * t) + c(sin(t))").input("b", "s(v * t - 1) + q(t)")
    scene = made.effort("e", "rail", "a + b + (q.rail if t > 7 else 0) + abs(t - 9)").build()
    found = [(item.time, item.period, item.order) for item in derive(scene, ["mass"]).discontinuities]
    assert found == [(0.5, 0, 1), (1, 0, 0), (2, 0, 0), (7, 0, 0), (9, 0, 1), (0.5, 1.5, 0)]
    model = eomgen.build(scene)
    assert model.discontinuity_times(0.5, 3.6).tolist() == [0.5, 1, 2, 3.5]
    assert model.discontinuity_times(7, 9, order=0).tolist() == [7, 8]


@pytest.mark.slow
def test_the_stand_alone_program_ends_its_steps_there_too(tmp_path: Path) -> None:
    made = builder().input("push", **steps((LATE, 3))).input("other", "sin(t)")
    scene = made.effort("push", "rail", "push + other").build()
    eomgen.generate(scene, tmp_path / "c", method="rk4")
    program = compiled(tmp_path / "c")
    model = eomgen.build(scene, method="rk4", profile="reproducible")
    for words, inputs in (((), None), (("other=0.5",), {"other": 0.5})):
        printed = run(program, "1", "1e-2", *words).stdout
        rows = np.array([[float(value) for value in line.split(",")] for line in printed.splitlines()[1:]])
        solution = model.simulate(1.0, 1e-2, method="rk4", inputs=inputs)
        assert np.array_equal(rows[:, 1:4], np.hstack([solution.q, solution.v, solution.a]))


@pytest.mark.slow_cases("None")
@pytest.mark.parametrize("given", [None, {"other": 0.5}])
def test_a_checkpoint_at_a_jump_goes_on_with_the_same_bits(given: dict[str, float] | None, tmp_path: Path) -> None:
    model = pushed(steps((0.3, 3), (0.35, 0)), law="push + other", other="sin(t)")
    one = model.simulate(0.6, 0.02, inputs=given)
    for end in (0.28, 0.3, 0.34, 0.36):
        first = model.simulate(end, 0.02, inputs=given, checkpoint=tmp_path / "c.npz")
        both = first.followed_by(model.resume(tmp_path / "c.npz", 0.6))
        assert np.array_equal(both.q, one.q) and np.array_equal(both.a, one.a)


@pytest.mark.slow
def test_a_jump_may_be_as_near_to_the_grid_as_it_likes() -> None:
    model = pushed(steps((LATE, 3)))
    for method, bound in (("rk4", 1e-11), ("generalized_alpha", 5e-6)):
        for distance in (0.0, 1e-16, 1e-14, 1e-12, 1e-8, 1e-4):
            for start in (LATE - 0.3 - distance, LATE - 0.3 + distance):
                solution = model.simulate(start + 1.0, 1e-3, t_start=start, method=method)
                exact = float(free(1.0) + 3 * after_step(start + 1.0 - LATE))
                assert abs(solution.q[-1, 0] - exact) < bound, (method, distance)


@pytest.mark.slow
@pytest.mark.parametrize("start", [0.0, -0.3, -1.0])
def test_a_jump_at_zero_has_two_sides(start: float) -> None:
    """Times near zero have no rounding of their own to keep away by, and a grid that starts elsewhere meets zero with
    its own."""
    model = pushed("3 if t > 0 else 0")
    for method, step, bound in (("rk4", 0.01, 1e-7), ("generalized_alpha", 1e-3, 1e-5)):
        solution = model.simulate(1.0, step, t_start=start, method=method)
        exact = float(free(1.0 - start) + 3 * after_step(1.0))
        assert abs(solution.q[-1, 0] - exact) < bound, method
    assert np.signbit(model.discontinuity_times(0.0, 1.0)).tolist() == [False]
