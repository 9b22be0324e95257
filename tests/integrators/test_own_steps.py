"""Methods that choose their steps: error by tolerance, rows within steps, jumps, inputs, ends, rest, refusals."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.integrators.similar_scenes import BOUND
from tests.integrators.test_taylor import SCENES, pushed

pytestmark = pytest.mark.slow


ADAPTIVE, PAIR = "generalized_alpha_adaptive", "rk45_partitioned"
EVERY: dict[str, Any] = {**SCENES, **BOUND, "four_bar": lambda: "examples/four_bar/scene.toml"}
QUIET: dict[str, Any] = {"error_estimate": False}


@cache
def model(name: str) -> eomgen.Model:
    return eomgen.build(EVERY[name](), method="rk4_partitioned" if name not in SCENES else "rk45")


@cache
def exact(name: str, rows: int = 16) -> eomgen.Solution:
    """Return the motion over 1.6 s by series, or of a loop over 0.4 s by small steps of fixed size."""
    if name in SCENES:
        return eomgen.build(EVERY[name](), method="taylor").simulate(1.6, 1.6 / rows, method="taylor", tolerance=1e-14)
    fine = {"method": "rk4_partitioned", "record_every": 128, **QUIET}
    return model(name).simulate(0.4, 0.02 / 128, **fine)


def errors(found: eomgen.Solution, true: eomgen.Solution) -> tuple[float, ...]:
    """Return the largest errors of q, v, a, z and multipliers, where there are any, over all rows, by the largest
    above 1."""
    pairs = ((getattr(found, name), getattr(true, name)) for name in ("q", "v", "a", "z", "multipliers"))
    return tuple(
        float(np.abs(ours - other).max() / max(1.0, np.abs(other).max())) for ours, other in pairs if ours.size
    )


@pytest.mark.long_cases("rods_r3xso3-generalized_alpha_adaptive", "rods_se3-rk45_partitioned")
@pytest.mark.parametrize(
    ("name", "method"),
    [
        *((name, method) for method in ("rk45", ADAPTIVE) for name in SCENES),
        *((name, ADAPTIVE) for name in ("rods_r3xso3", "rolling")),
        *((name, PAIR) for name in ("rods_se3", "rolling", "four_bar")),
    ],
)
def test_errors_follow_the_tolerance(name: str, method: str) -> None:
    """By the power 5/4 for pairs of order 5(4), and by itself for generalized-alpha."""
    tolerances = np.array([1e-5, 1e-6, 1e-7] if method == ADAPTIVE else [1e-5, 1e-6, 1e-7, 1e-8])
    true, power = exact(name), 1.0 if method == ADAPTIVE else 1.25
    options = {"method": method, **QUIET}
    runs = [model(name).simulate(true.t[-1], true.t[1], tolerance=float(x), **options) for x in tolerances]
    assert all(found.success for found in runs)
    for number, all_of_one in enumerate(np.array([errors(found, true) for found in runs]).T):
        slope = np.polyfit(np.log(tolerances), np.log(all_of_one), 1)[0]
        assert slope == pytest.approx(power, abs=0.2)
        assert number > 1 or np.all(all_of_one < 50 * tolerances)  # of positions and velocities
    if model(name).multipliers:
        assert max(found.stats["max_constraint"] for found in runs) < 1e-11
        assert max(found.stats["max_constraint_velocity"] for found in runs) < 1e-10


@pytest.mark.parametrize("name", SCENES)
def test_rows_lie_within_steps_and_meet_the_equations(name: str) -> None:
    few, many = (model(name).simulate(1.6, 1.6 / rows, tolerance=1e-7) for rows in (16, 1600))
    assert many.stats["own_steps"] < 150 and abs(many.stats["own_steps"] - few.stats["own_steps"]) < 20
    assert max(errors(many, exact(name, 1600))) < 2.0 * max(errors(few, exact(name))) + 1e-8
    some = slice(1, None, 173)
    again = model(name).forward_dynamics(many.q[some], many.v[some], many.t[some], z=many.z[some])
    assert np.abs(again - many.a[some]).max() < 1e-12 * (1.0 + np.abs(again).max())


@pytest.mark.parametrize(
    ("method", "spacing", "tolerance", "bound"),
    [("rk45", 0.6, 1e-9, 1e-11), ("rk45", 0.1, 1e-9, 1e-11), (ADAPTIVE, 0.6, 1e-6, 1e-5)],
)
def test_a_jump_ends_a_step_and_the_end_is_exact(method: str, spacing: float, tolerance: float, bound: float) -> None:
    made = eomgen.build(pushed("3 if t > late else 0"), method=method)
    true = made.simulate(1.23, 0.6, method="taylor", tolerance=1e-14)
    found = made.simulate(1.23, spacing, method=method, tolerance=tolerance, **QUIET)
    assert found.t[-1] == 1.23
    assert np.abs(found.q[-1] - true.q[-1]).max() < bound
    assert found.stats["rejections"] < 30


@pytest.mark.long_cases("rods_se3-rk45_partitioned-0.1", "rods_se3-rk45_partitioned-1e-13")
@pytest.mark.parametrize(
    ("name", "method", "tolerance"),
    [
        *(("pendulum", "rk45", tolerance) for tolerance in (0.1, 1e-13, 1e-14)),
        *(("rods_se3", PAIR, tolerance) for tolerance in (0.1, 1e-13)),
        *(("rolling", ADAPTIVE, tolerance) for tolerance in (0.1, 1e-9)),
    ],
)
def test_extreme_tolerances_hold(name: str, method: str, tolerance: float) -> None:
    true = exact(name)
    found = model(name).simulate(true.t[-1], true.t[1], method=method, tolerance=tolerance, **QUIET)
    assert found.success and errors(found, true)[0] < max(4.0 * tolerance, 1e-8 if method == ADAPTIVE else 1e-11)
    assert method == "rk45" or found.stats["rejections"] < 0.2 * found.stats["own_steps"] + 3


def test_states_between_rows_of_a_loop_lie_on_its_constraints() -> None:
    options, true = {"method": PAIR, **QUIET}, exact("four_bar")
    coarse = model("four_bar").simulate(0.4, 0.4, tolerance=1e-8, **options)
    at = coarse.at(true.t)
    assert np.abs(at.q - true.q).max() < 1e-7
    assert np.array_equal(at.q[0], coarse.q[0]) and np.array_equal(at.q[-1], coarse.q[-1])
    between = model("four_bar").simulate(0.4, 0.4, tolerance=1e-3, **options).at([0.07])
    found = model("four_bar").consistent(between.q[0], between.v[0])
    assert np.abs(found.q - between.q[0]).max() < 1e-13


def test_rest_takes_long_steps_and_a_push_is_seen() -> None:
    builder = eomgen.SceneBuilder("pushed_later")
    builder.body("a", 1.0).joint("rail", "prismatic", "base", "a", axis=[1, 0, 0])
    made = eomgen.build(builder.effort("push", "rail", "max(0, t - 5)**2").build(), method="rk45")
    found = made.simulate(6.0, 0.1, tolerance=1e-9)
    assert found.q[-1, 0] == pytest.approx(1.0 / 12.0, rel=1e-7)
    still = made.simulate(4.9, 0.01, tolerance=1e-9)
    assert still.stats["own_steps"] < 15 and np.all(still.q == 0.0)


def test_an_infinity_stops_the_run_and_names_what_grew() -> None:
    builder = eomgen.SceneBuilder("blow_up")
    builder.body("a", 1.0)
    builder.joint("rail", "prismatic", "base", "a", axis=[1, 0, 0], initial={"position": 1.0, "velocity": 1.0})
    made = eomgen.build(builder.effort("push", "rail", "2 * q.rail**3").build(), method="rk45")  # q = 1/(1 - t)
    found = made.simulate(2.0, 0.01, tolerance=1e-8)
    assert not found.success
    assert "the step became too small for the time to move on" in found.message
    assert "taken again; the smallest, " in found.message and "for v.rail)" in found.message


def test_a_step_that_fails_from_just_before_a_row_is_repeated() -> None:
    """Steps of a free fall end within rounding of the row at 0.27 s; the next one overflows at a wall, exp(-2000 q),
    from which the mass bounces without loss."""
    builder = eomgen.SceneBuilder("drop").body("ball", 0.2)
    builder.joint("fall", "prismatic", "base", "ball", axis=[0, 0, 1], initial={"position": 0.46})
    made = eomgen.build(builder.effort("wall", "fall", "exp(-2000 * q.fall)").build(), method="rk45")
    found = made.simulate(0.6, 0.01, tolerance=1e-9, **QUIET)
    assert found.success and found.stats["rejections"]
    energy = 0.1 * found.v[-1, 0] ** 2 + 0.2 * 9.81 * found.q[-1, 0] + np.exp(-2000.0 * found.q[-1, 0]) / 2000.0
    assert energy == pytest.approx(0.2 * 9.81 * 0.46, rel=1e-6) and found.v[-1, 0] > 0.1
