"""Positions where constraints are singular: passed along the velocity, or the run says that it is they."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from tests.oracles.placed_loops import parallelogram


def falling_parallelogram() -> dict:
    """Return a parallelogram that turns through its flat positions, where it could cross over."""
    scene = parallelogram("point_on_line") | {"name": "flat"}
    scene["joints"]["drive"]["initial"]["velocity"] = 4.0
    return scene | {"outputs": {"energy": {"energy": "total"}}}


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    return eomgen.build(falling_parallelogram(), profile="quick")


WAY = "try: rk4_partitioned, which passes such positions along the velocity; steps smaller than 0.001 s only come nearer to it"


@pytest.mark.parametrize("method", ["generalized_alpha", "generalized_alpha_index3"])
def test_a_run_that_stops_there_says_so_and_what_helps(model: eomgen.Model, method: str) -> None:
    run = model.simulate(4.0, 1e-3, method=method)
    if run.success:  # it has stepped past them
        assert np.abs(np.sin(run.q[:, 0] - run.q[:, 2])).max() < 1e-3
        return
    assert "the constraints are nearly singular at t = " in run.message
    assert "where branches of configurations cross" in run.message and run.message.endswith(WAY)


def test_the_default_method_stops_at_the_first_with_the_cause(model: eomgen.Model) -> None:
    run = model.simulate(4.0, 1e-3)
    assert not run.success and run.message.endswith(WAY) and "highest" not in run.message


def test_rk4_partitioned_passes_and_says_how_often(model: eomgen.Model) -> None:
    run = model.simulate(4.0, 1e-3, method="rk4_partitioned")
    count = int(run.stats["singular_passages"])
    assert run.success and count >= 2
    assert run.message.endswith(
        f"; it passed {count} positions where the constraints are singular, or nearly, and branches cross, each time along its "
        "velocity"
    )
    assert np.abs(np.sin(run.q[:, 0] - run.q[:, 2])).max() < 1e-4
    assert np.ptp(run.energy["total"]) < 1e-4 * np.ptp(run.energy["potential"])


def test_a_run_that_meets_none_says_nothing(model: eomgen.Model) -> None:
    run = model.simulate(0.05, 1e-3, method="rk4_partitioned")
    assert run.message == "reached t = 0.05 s in 50 steps" and run.stats["singular_passages"] == 0
