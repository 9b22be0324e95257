"""The method of a build is the method of its runs, and steppers of other methods are looked up once for each model."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.pipeline import content, requests
from tests.models.scenes import pendulum_scene


@pytest.mark.slow
def test_a_run_takes_the_method_that_the_model_was_built_with() -> None:
    built = eomgen.build(pendulum_scene(), method="runge_kutta", profile="quick")
    run = built.simulate(0.2, 1e-2)
    assert run.metadata["method"] == "rk4" and not run.stats["newton_iterations"]
    asked = built.simulate(0.2, 1e-2, method="generalized_alpha")
    assert asked.metadata["method"] == "generalized_alpha" and not np.array_equal(asked.q, run.q)
    plain = eomgen.build(pendulum_scene(), profile="quick")
    assert plain.simulate(0.2, 1e-2).metadata["method"] == "generalized_alpha"
    assert np.array_equal(plain.simulate(0.2, 1e-2, method="rk4").q, run.q)


def test_another_method_is_looked_up_once(monkeypatch: pytest.MonkeyPatch) -> None:
    model = eomgen.build(pendulum_scene(), profile="quick")
    model.simulate(0.05, 1e-2, method="rk4")  # looked up, compiled where it is not in the cache
    looked: list[str] = []
    monkeypatch.setattr(content, "checkout_stamp", lambda: looked.append("stamp") or "")
    monkeypatch.setattr(requests.LibraryRequest, "find", lambda request: looked.append("library"))
    again = [model.simulate(0.05, 1e-2, method=name) for name in ("rk4", "runge_kutta", "rk4")]
    assert all(run.metadata["method"] == "rk4" for run in again)
    assert looked == []
