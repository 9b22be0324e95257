"""Events whose roots lie on ends of steps, or several within one: each is found once, by every family of methods."""

from __future__ import annotations

import functools
import random

import numpy as np
import pytest

import eomgen
from eomgen.integrators.families.register import BUILT_IN
from tests.simulation.rails import built, on_rail

#: Number of roots of the guard; those that a run does not use lie far away.
_ROOTS, _FAR = 7, 1e4
#: A method of each family, and those that need constraints.
_METHODS = {family.family: family.names()[0].name for family in BUILT_IN}
_TIED = ("rk4_partitioned", "rk45_partitioned", "rattlie")


@functools.cache
def sliding(method: str, via: str, direction: str) -> eomgen.Model:
    """Return a body that slides freely, with an event at each root of a product, in its place or in time."""
    builder = on_rail().event("passes", "*".join(f"({via} - root_{k})" for k in range(_ROOTS)), direction=direction)
    for k in range(_ROOTS):
        builder.parameter(f"root_{k}", _FAR, tunable=True)
    if method in _TIED:
        builder.body("c", 1.0).joint("y", "prismatic", "base", "c", axis=[1, 0, 0])
        builder.constraint("tie", "formula", equation="q.x - q.y")
    return built(builder, method=method)


def found_and_true(
    method: str, via: str, direction: str, step: float, start: float, speed: float, roots: list[float]
) -> tuple[list[float], list[float]]:
    """Return the times of events of a run of 1 s, and the roots of their guard whose direction counts."""
    model = sliding(method, via, direction)
    places = [start + speed * root if via == "q.x" else root for root in roots]
    initial = {name: {"position": start, "velocity": speed} for name in ("x", "y") if f"q.{name}" in model.q_names}
    values = places + [_FAR] * (_ROOTS - len(places))
    given = {f"root_{k}": value for k, value in enumerate(values)}
    run = model.simulate(1.0, step, initial=initial, parameters=given, error_estimate=False)
    assert run.success and run.events is not None
    forward = np.sign(speed) if via == "q.x" else 1.0
    counted = []
    for place, root in zip(places, roots, strict=True):
        slope = forward * np.prod(np.sign([place - value for value in values if value != place]))
        if direction == "both" or (direction == "rising") == (slope > 0.0):
            counted.append(root)
    return sorted(run.events.t.tolist()), sorted(counted)


@pytest.mark.slow
@pytest.mark.parametrize("method", _METHODS.values())
def test_each_root_on_an_end_of_a_step_is_found_once(method: str) -> None:
    """Rounding decides on which side of zero the guard is at the ends, in each run at other numbers."""
    draw = random.Random(method)
    for _ in range(12):
        via, direction = draw.choice(["q.x", "t"]), draw.choice(["both", "both", "falling"])
        step = draw.choice([0.05, 0.1, 1.0 / 3.0, 0.2])
        start, speed = draw.choice([0.0, 0.7, -3.3, 1000.0]), draw.choice([1.0, -1.0, 0.3, 7.0])
        count = round(1.0 / step)
        ends = [k * step for k in range(1, count)]
        within = draw.choice([[], [draw.choice([0.3, 0.5, 0.8]) * step]])
        roots = draw.sample(ends, min(len(ends), draw.randint(1, 5))) + within
        found, true = found_and_true(method, via, direction, step, start, speed, roots)
        assert found == pytest.approx(true, abs=1e-6), (via, direction, step, start, speed, roots)


@pytest.mark.slow_cases("rk45")
@pytest.mark.parametrize("method", ["rk4", "rk45"])
def test_three_roots_within_a_step_are_found_where_rates_tell(method: str) -> None:
    found, true = found_and_true(method, "t", "both", 0.5, 0.0, 1.0, [0.1, 0.25, 0.4])
    assert found == pytest.approx(true, abs=1e-6)


@pytest.mark.slow
def test_a_function_that_returns_while_another_event_comes_has_both_roots() -> None:
    """The second event counts falls alone; it rises before the first event in a step and falls after it."""
    builder = on_rail().event("middle", "t - 0.53")
    builder.event("hill", "0.03**2 - (t - 0.53)**2", direction="falling")
    run = built(builder, method="rk4").simulate(1.0, 0.1)
    assert run.events is not None
    assert run.events.counts == {"middle": 1, "hill": 1}
    assert run.events["hill"].t[0] == pytest.approx(0.56, abs=1e-12)


def cradle(balls: int, restitution: float, width: float, start: float) -> eomgen.Model:
    """Return touching balls in a row, and one that comes at 1 m/s."""
    builder = eomgen.SceneBuilder("cradle", gravity=[0, 0, 0])
    for k in range(balls):
        initial = {"position": start + width * k - (0.1 if k == 0 else 0.0), "velocity": float(k == 0)}
        builder.body(f"b{k}", 1.0).joint(f"x{k}", "prismatic", "base", f"b{k}", axis=[1, 0, 0], initial=initial)
    impact = {"direction": "falling", "action": "impact", "restitution": restitution}
    for k in range(balls - 1):
        builder.event(f"hit{k}", f"q.x{k + 1} - q.x{k} - {width}", **impact)
    return built(builder)


def speeds_after_impacts(balls: int, restitution: float) -> tuple[list[float], int]:
    """Return the speeds after all impacts of pairs, the first that approach one another first, and their number."""
    v, count = [1.0] + [0.0] * (balls - 1), 0
    while close := [k for k in range(balls - 1) if v[k] - v[k + 1] > 1e-14]:
        k, count = close[0], count + 1
        middle, half = 0.5 * (v[k] + v[k + 1]), 0.5 * restitution * (v[k] - v[k + 1])
        v[k], v[k + 1] = middle - half, middle + half
    return v, count


@pytest.mark.slow
@pytest.mark.parametrize(
    ("balls", "restitution", "width", "start", "method"),
    [
        (3, 0.9, 1.0, 0.0, "rk4"),
        (5, 1.0, 0.1, 0.0, "rk45"),
        (8, 0.9, 1.0, 0.0, "generalized_alpha"),
        (4, 0.5, 0.7, -3.3, "rk4"),
    ],
)
def test_touching_balls_have_a_finite_sequence_of_impacts(
    balls: int, restitution: float, width: float, start: float, method: str
) -> None:
    """No impact is lost to rounding of the gaps, and none is taken for the bouncing of a body that comes to rest."""
    run = cradle(balls, restitution, width, start).simulate(0.5, 0.01, method=method)
    v, count = speeds_after_impacts(balls, restitution)
    assert run.success and run.events is not None and len(run.events) == count
    assert run.v[-1] == pytest.approx(v, abs=1e-12)
