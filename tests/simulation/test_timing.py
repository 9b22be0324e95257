"""A run that is repeated for its time takes all of its steps."""

from __future__ import annotations

from functools import cache
from typing import Literal

import numpy as np
import pytest

import eomgen
from eomgen.integrators.families.register import method_named
from eomgen.simulation.timing import RepeatedRun, step_times
from tests.simulation.rails import built, on_rail


@cache
def oscillator(real: Literal["double", "float"]) -> eomgen.Model:
    """Return a mass on a spring that passes its middle 63 times in 10 s, more often than a library keeps events."""
    builder = on_rail("push - 400 * q.x", position=1.0).input("push", unit="N").event("middle", "q.x")
    return built(builder, real=real)


@pytest.mark.slow_cases("float")
@pytest.mark.parametrize("real", ["double", "float"])
def test_a_repeated_run_goes_on_after_events(real: Literal["double", "float"], monkeypatch: pytest.MonkeyPatch) -> None:
    model, push = oscillator(real), {"push": np.linspace(0.0, 40.0, 2001)}
    run = model.simulate(10.0, 5e-3, method="rk4", inputs=push)
    assert run.success and len(run.events) == pytest.approx(63, abs=1)
    repeated = RepeatedRun(model, run, method_named("rk4"), push)
    for _ in range(2):
        assert repeated.seconds() > 0.0
        assert repeated.state[0] == pytest.approx(10.0, rel=1e-6)
        assert repeated.state[1:] == pytest.approx(np.append(run.q[-1], run.v[-1]), rel=1e-6)
    taken, most = repeated.seconds_of_steps()
    assert len(taken) == repeated.steps == 2000 and 0.0 < taken.mean() < 1e-3 and most == 0
    ends = repeated.state
    assert ends[1:] == pytest.approx(np.append(run.q[-1], run.v[-1]), rel=1e-6)
    calls = repeated.seconds_of_calls()
    assert len(calls) == 2000 and 0.0 < calls.mean() < 1e-3 and np.array_equal(repeated.state, ends)
    monkeypatch.setattr(repeated._stepper, "status_text", "status {}".format)
    with pytest.raises(eomgen.NumericalError, match="the run cannot be repeated: status 7"):
        repeated._check(7)
    times = step_times(model, run, push, count=3000)
    assert len(times.seconds) == len(times.calls) == 4000 and 0.0 < times.median <= times.late <= times.longest
    stopped = model.simulate(1e4, 5.0, method="rk4", inputs={"push": 0.0}, error_estimate=False)
    with pytest.raises(eomgen.EomgenError, match="a run that stops early has no times of all its steps"):
        step_times(model, stopped)
