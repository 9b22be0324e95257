"""Methods that choose their steps: error by tolerance, rows within steps, jumps, inputs, ends, rest, refusals."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import eomgen
from tests.integrators.test_taylor import SCENES, pushed
from tests.models.cache import shared_cache

pytestmark = pytest.mark.slow

__all__ = ["shared_cache"]


@cache
def model(name: str) -> eomgen.Model:
    return eomgen.build(SCENES[name](), method="rk45")


@cache
def exact(name: str, rows: int = 16) -> eomgen.Solution:
    return eomgen.build(SCENES[name](), method="taylor").simulate(1.6, 1.6 / rows, method="taylor", tolerance=1e-14)


def errors(found: eomgen.Solution, true: eomgen.Solution) -> tuple[float, ...]:
    """Return the largest errors of q, v, a, and of z where there is any, over all rows, by the largest above 1."""
    pairs = zip((found.q, found.v, found.a, found.z), (true.q, true.v, true.a, true.z), strict=True)
    return tuple(
        float(np.abs(ours - other).max() / max(1.0, np.abs(other).max())) for ours, other in pairs if ours.size
    )


@pytest.mark.parametrize("name", SCENES)
def test_the_error_falls_with_the_tolerance_by_five_quarters(name: str) -> None:
    tolerances = np.array([1e-4, 1e-6, 1e-8, 1e-10])
    runs = [model(name).simulate(1.6, 0.1, tolerance=float(tolerance)) for tolerance in tolerances]
    for all_of_one in np.array([errors(found, exact(name)) for found in runs]).T:
        slope = np.polyfit(np.log(tolerances), np.log(all_of_one), 1)[0]
        assert slope == pytest.approx(1.25, abs=0.08)
        assert np.all(all_of_one < 50 * tolerances)


@pytest.mark.parametrize("name", SCENES)
def test_rows_lie_within_steps_and_meet_the_equations(name: str) -> None:
    few, many = (model(name).simulate(1.6, 1.6 / rows, tolerance=1e-7) for rows in (16, 1600))
    assert many.stats["own_steps"] < 150 and abs(many.stats["own_steps"] - few.stats["own_steps"]) < 20
    assert max(errors(many, exact(name, 1600))) < 2.0 * max(errors(few, exact(name))) + 1e-8
    some = slice(1, None, 173)
    again = model(name).forward_dynamics(many.q[some], many.v[some], many.t[some], z=many.z[some])
    assert np.abs(again - many.a[some]).max() < 1e-12 * (1.0 + np.abs(again).max())


@pytest.mark.parametrize("spacing", [0.6, 0.1])
def test_a_jump_ends_a_step(spacing: float) -> None:
    made = eomgen.build(pushed("3 if t > late else 0"), method="rk45")
    true = eomgen.build(pushed("3 if t > late else 0"), method="taylor").simulate(
        1.2, 0.6, method="taylor", tolerance=1e-14
    )
    found = made.simulate(1.2, spacing, tolerance=1e-9)
    assert np.abs(found.q[-1] - true.q[-1]).max() < 1e-11
    assert found.stats["rejections"] < 10


def test_inputs_from_outside_end_steps_at_rows() -> None:
    made = model("controlled")
    true = made.simulate(1.05, 0.01, tolerance=1e-11)
    for signal in (lambda t: np.sin(2 * t) + 0.3 * t, np.sin(2 * true.t) + 0.3 * true.t):
        found = made.simulate(1.05, 0.01, tolerance=1e-9, inputs={"wish": signal})
        assert found.stats["own_steps"] >= 105
        assert np.abs(found.q - true.q).max() < (2e-7 if callable(signal) else 3e-6)
    held = made.simulate(1.05, 0.5, tolerance=1e-10, inputs={"wish": 0.7})
    again = made.simulate(1.05, 0.05, tolerance=1e-10, inputs={"wish": lambda t: 0.7})
    assert np.abs(held.q[-1] - again.q[-1]).max() < 1e-10


def test_a_run_ends_where_it_is_asked_to_and_gives_states_between_rows() -> None:
    found, true = (
        made.simulate(1.05, 0.1) for made in (model("flyer"), eomgen.build(SCENES["flyer"](), method="taylor"))
    )
    assert found.t[-1] == 1.05
    assert found.message.startswith("reached t = 1.05 s in 11 steps (")
    at = np.array([0.0, 0.033, np.nextafter(0.1, 1.0), 0.51, 1.049])
    assert np.abs(found.at(at).q - true.at(at).q).max() < 1e-8


@pytest.mark.parametrize("tolerance", [1e-1, 1e-2, 1e-13, 1e-14])
def test_extreme_tolerances_hold(tolerance: float) -> None:
    found = model("pendulum").simulate(1.6, 0.1, tolerance=tolerance)
    assert found.success
    assert errors(found, exact("pendulum"))[0] < max(4.0 * tolerance, 1e-13)


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


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1e-20, 0.5])
def test_tolerances_out_of_range_are_refused(tolerance: float) -> None:
    with pytest.raises(eomgen.UsageError, match=r"tolerance: the tolerance must lie in 1e-14..0.1, not .*try: 1e-6"):
        model("pendulum").simulate(1.0, 0.1, tolerance=tolerance)
