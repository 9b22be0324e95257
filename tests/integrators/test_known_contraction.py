"""Steps of generalized-alpha that end with their first iteration, because the contraction of their factors is known:
against runs whose steps iterate until nothing is left."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import eomgen
from eomgen import Solution
from eomgen.pipeline.model import Model

pytestmark = pytest.mark.slow


STEPS = 4000


@cache
def slider(damper: float, stop: bool = False) -> Model:
    """Return a mass on a hardening spring that is driven, with a stop before it or without."""
    builder = eomgen.SceneBuilder("slider", gravity=[0, 0, 0])
    limits = {"upper": 0.06, "stiffness": 1e6, "damping": 40.0, "onset": 1e-4}
    builder.body("mass", 2.0)
    builder.joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], damping=damper, limits=limits if stop else None)
    effort = "30 * sin(7 * t) + 12 * cos(19 * t) - 300 * q.rail - 2000 * q.rail**3"
    builder.effort("force", "rail", effort=effort)
    return eomgen.build(builder.build())


def run(model: Model, **settings: float) -> Solution:
    return model.simulate(4.0, 4.0 / STEPS, method="generalized_alpha", settings=settings, error_estimate=False)


def difference(one: Solution, other: Solution) -> float:
    """Return the largest difference of q and v, relative to the largest of each."""
    return max(float(np.abs(a - b).max() / np.abs(b).max()) for a, b in ((one.q, other.q), (one.v, other.v)))


def test_most_steps_need_one_iteration_and_stay_within_the_tolerance() -> None:
    model = slider(3.0)
    found, tight = run(model), run(model, rtol=1e-14, atol=1e-16)
    assert found.stats["newton_iterations"] <= 1.4 * STEPS < 1.9 * STEPS <= tight.stats["newton_iterations"]
    assert 0.0 < difference(found, tight) <= 2e-10


def test_without_damping_every_step_is_seen_to_converge() -> None:
    found = run(slider(0.0))
    assert found.stats["newton_iterations"] >= 1.9 * STEPS


def test_a_stop_is_met_as_by_steps_with_factors_of_their_own() -> None:
    model = slider(3.0, stop=True)
    found, own = run(model), run(model, reuse=0)
    assert found.q.max() > 0.06 and np.sum(np.diff(found.q[:, 0] > 0.06)) >= 10
    coarse = model.simulate(4.0, 8.0 / STEPS, method="generalized_alpha", error_estimate=False)
    of_method = float(np.abs(coarse.q - own.q[::2]).max() / np.abs(own.q).max())
    assert difference(found, own) <= 1e-5 < of_method


def test_fresh_factors_tell_nothing_of_later_steps() -> None:
    """A pendulum with a damper turns so far in a few steps that old factors contract by a tenth, fresh ones by 1e-9."""
    builder = eomgen.SceneBuilder("pendulums")
    builder.body("upper", 1.0, inertia=[0.01] * 3, center_of_mass=[0, 0, -0.5])
    builder.body("lower", 1.0, inertia=[0.01] * 3, center_of_mass=[0, 0, -0.5])
    builder.joint("first", "revolute", "base", "upper", axis=[0, 1, 0], damping=1e-3, initial={"position": 2.0})
    builder.joint("second", "revolute", "upper", "lower", axis=[0, 1, 0], position=[0, 0, -1], damping=1e-3)
    model = eomgen.build(builder.build())
    found, own = (
        model.simulate(2.0, 2e-3, method="generalized_alpha", settings=settings, error_estimate=False)
        for settings in ({}, {"reuse": 0})
    )
    assert found.stats["factorizations"] < own.stats["factorizations"]
    assert difference(found, own) <= 1e-8


@pytest.mark.long
def test_an_increment_of_nothing_is_no_contraction() -> None:
    """Where Newton's last increment is 0 by chance, at tolerances of rounding, the next step needs its iterations."""
    builder = eomgen.SceneBuilder("shaken_links").input("push")
    builder.body("one", 1.3, center_of_mass=[0, 0, -0.4], inertia=[0.1, 0.12, 0.05])
    builder.body("two", 0.7, center_of_mass=[0.1, 0, -0.3], inertia=[0.05, 0.06, 0.02])
    builder.joint("a", "revolute", "base", "one", axis=[0, 1, 0])
    builder.joint("b", "revolute", "one", "two", axis=[0.3, 1, 0], position=[0, 0, -0.8])
    builder.effort("pushed", "b", "push*(1 + q.a) + 0.3*push**2 - 2.1*q.b - 0.3*v.b")
    model = eomgen.build(builder.build(), profile="reproducible")
    rng, apart = np.random.default_rng(2), []
    for _ in range(150):
        options = {"inputs": {"push": rng.normal(size=13)}, "method": "generalized_alpha", "error_estimate": False}
        near, nearest = (
            model.simulate(0.12, 0.01, settings={"rtol": rtol, "atol": 0.01 * rtol}, **options)
            for rtol in (1e-12, 1e-15)
        )
        apart.append(float(np.abs(near.q - nearest.q).max()))
    assert max(apart) < 1e-12
