"""Runs that pass jumps of forces at moments that move have no derivatives of steps, and say which and where."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from eomgen.pipeline.model import Model
from eomgen.scene.builder import SceneBuilder
from tests.simulation.rails import built, on_rail

STEP = 0.01


def sled(effort: str, position: float = 0.5) -> eomgen.SceneBuilder:
    """Return a sled on a rail with an effort of ``rate`` and ``far``."""
    builder = on_rail(effort, "slide", position=position).parameter("rate", 0.3, tunable=True)
    return builder.parameter("far", 0.1, tunable=True).output("x", formula="q.slide")


def refused(model: Model, t_end: float, by: Sequence[str] = ("rate",), **options: str) -> str:
    with pytest.raises(UsageError) as caught:
        model.sensitivities(t_end, STEP, by=by, **options)
    return str(caught.value)


def differenced(model: Model, name: str) -> float:
    """Return the derivative of x at 1 s by a parameter, of 0.3, by a central difference."""
    runs = [
        model.simulate(1.0, STEP, parameters={name: 0.3 + sign * 1e-4}, error_estimate=False) for sign in (1.0, -1.0)
    ]
    return float(runs[0]["x"][-1] - runs[1]["x"][-1]) / 2e-4


@pytest.mark.slow
def test_friction_by_sign_is_refused_where_the_velocity_turns() -> None:
    """x = 0.03 + 0.47 cos(w t) until v = 0 at t = pi/w, w = sqrt(10): 0.993 s."""
    model = built(sled("-rate*sign(v.slide) - 10*q.slide"))
    assert refused(model, 2.0, ["far", "rate"]) == (
        "usage error: sensitivities: forces jump near t = 1 s by a sign in effort push, at a moment that rate moves,"
        " which is in no derivative of the steps; try: a smooth law in its place, tanh(x/0.01) for sign(x), or a run"
        " that does not come there"
    )
    before = model.sensitivities(0.9, STEP, by=["rate"])
    exact = (1.0 - np.cos(np.sqrt(10.0) * before.t[-1])) / 10.0  # of a force of one sign
    assert before.derivatives["x"][-1, 0] == pytest.approx(exact, rel=5e-3)


@pytest.mark.slow
def test_a_switch_that_a_coordinate_passes_is_refused_and_a_kink_is_not() -> None:
    """A force that only bends leaves derivatives whole: those of differences."""
    jumping = built(sled("-rate*v.slide - 10*q.slide - (3 if q.slide > far else 0)"))
    assert "by a comparison in effort push, at a moment that far moves, " in refused(jumping, 1.0, ["far"])
    assert jumping.sensitivities(0.3, STEP, by=["rate"]).derivatives["x"][-1, 0] != 0.0  # it does not come there
    kink = "-rate*v.slide - 10*q.slide - (3*(q.slide - 0.1) if q.slide > 0.1 else 0) - max(q.slide, 0)"
    bent = built(sled(kink))
    found = bent.sensitivities(1.0, STEP, by=["rate"]).derivatives["x"][-1, 0]
    assert found == pytest.approx(differenced(bent, "rate"), abs=1e-6)


@pytest.mark.slow
def test_a_curve_of_steps_over_a_coordinate_is_refused() -> None:
    levels = {"points": [[-1.0, 0.0], [0.1, 3.0], [2.0, 3.0]], "interpolation": "steps", "outside": "hold"}
    model = built(sled("-rate*v.slide - 10*levels(q.slide)").curve("levels", **levels))
    assert "by the curve levels in effort push, at a moment that rate moves" in refused(model, 2.0)


@pytest.mark.slow
def test_a_run_that_rests_on_a_jump_is_refused() -> None:
    told = refused(built(sled("-rate*sign(v.slide) - 10*q.slide", position=0.0)), 0.1, ["v.slide"])
    said = "the run stays at a jump of the forces by a sign in effort push, near t = 0.01 s, and v.slide moves it off"
    assert said in told


@pytest.mark.slow
def test_moments_that_nothing_moves_are_no_reason() -> None:
    """A crank that goes round by a law passes its angle at a time that a mass does not move, and its speed does."""
    builder = SceneBuilder("crank", gravity=[0, 0, 0]).parameter("mass", 0.3, tunable=True)
    builder.parameter("speed", 2.0, tunable=True)
    builder.body("arm", 1.0, inertia=[1e-3, 1e-3, 1e-3]).body("bead", "mass")
    builder.joint("crank", "revolute", "base", "arm", axis=[0, 1, 0], drive="speed*t")
    builder.joint("slide", "prismatic", "arm", "bead", axis=[1, 0, 0], stiffness=20, damping=1)
    builder.effort("load", "slide", "0.3 if q.crank > 1 else 0").output("x", formula="q.slide")
    model = eomgen.build(builder.build(), profile="quick")
    told = refused(model, 1.0, ["speed"])
    assert "near t = 0.51 s by a comparison in effort load, at a moment that speed moves" in told
    found = model.sensitivities(1.0, STEP, by=["mass"]).derivatives["x"][-1, 0]
    assert found == pytest.approx(differenced(model, "mass"), abs=1e-6)
