"""Runs in which the law of a distance reaches 0: the message names the length."""

from __future__ import annotations

import tomllib

import pytest

import eomgen

HOIST = """
format = 1
name = "hoist"
bodies.load = { mass = 50 }
bodies.sled = { mass = 0 }
joints.x = { type = "prismatic", parent = "base", child = "sled", axis = [1, 0, 0], initial = { position = 0.1 } }
joints.z = { type = "prismatic", parent = "sled", child = "load", axis = [0, 0, 1], initial = { position = -2 } }
constraints.rope = { type = "distance", first = { body = "base" }, second = { body = "load" }, length = "2 - t" }
"""


@pytest.mark.slow_cases("rk4_partitioned-0.002")
@pytest.mark.parametrize(("method", "step"), [("rk4_partitioned", 2e-3), ("generalized_alpha", 0.05)])
def test_a_rope_that_is_wound_up_is_named(method: str, step: float) -> None:
    run = eomgen.build(tomllib.loads(HOIST), profile="quick", method=method).simulate(3.0, step)
    assert not run.success
    assert "the length of hoist (constraints.rope.length) is" in run.message
    assert "a step smaller" not in run.message
