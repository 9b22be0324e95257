"""Runs that start with a joint beyond its limits say so, at the parameters and initial values of the run."""

from __future__ import annotations

from functools import cache

import pytest

import eomgen


@cache
def stopped() -> eomgen.Model:
    builder = eomgen.SceneBuilder("stopped").parameter("highest", -0.07, tunable=True)
    limits = {"lower": -3.0, "upper": "highest", "stiffness": 8670.0, "damping": 87.0}
    builder.body("arm", 1.0, inertia=[1, 1, 1])
    builder.joint("elbow", "revolute", "base", "arm", axis=[0, 0, 1], limits=limits)
    return eomgen.build(builder.build(), profile="quick")


@pytest.mark.slow
def test_a_run_that_starts_beyond_a_limit_says_so() -> None:
    said = "joint elbow starts at 0 rad, beyond its upper limit -0.07 rad: the stop pushes back with up to 607 N m"
    run = stopped().simulate(0.01, 1e-3)
    assert run.success and said in run.message
    assert [note for note in run.metadata["notes"] if "beyond" in note] == [
        f"{said}; try an initial position within the limits"
    ]
    assert said in stopped().notes[0]


def test_a_run_that_starts_elsewhere_or_has_other_limits_is_judged_by_these() -> None:
    for options in ({"initial": {"elbow": -1.0}}, {"parameters": {"highest": 0.5}}):
        run = stopped().simulate(0.01, 1e-3, **options)
        assert "beyond" not in run.message and not any("beyond" in note for note in run.metadata["notes"])
    run = stopped().simulate(0.001, 1e-4, initial={"elbow": -3.1}, parameters={"highest": 0.5})
    assert "joint elbow starts at -3.1 rad, beyond its lower limit -3 rad" in run.message
    assert sum("beyond" in note for note in run.metadata["notes"]) == 1
