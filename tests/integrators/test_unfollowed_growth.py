"""Growth beyond the pole of a step is reported, mode by mode, by the inertia of the matrix of the step."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen

pytestmark = pytest.mark.slow


#: gamma of each method: what grows with a rate above 1/(gamma h) is lost.
GAMMA = {
    "rosenbrock": 0.5, "lsrt2": 1.0 - np.sqrt(0.5), "corrected_predictor": 0.5, "tdg1": 1.0 - np.sqrt(0.5),
    "tdg1_star": 1.0 / np.sqrt(6.0), "tdg2": 0.25, "tdg2s": 0.43586652150845900, "tdg3": 0.165,
}  # fmt: skip  # a table
COUNTED: dict[str, Any] = {"settings": {"stop_at_growth": 0}, "error_estimate": False}


@cache
def row_of_masses(rates: tuple[float, ...]) -> eomgen.Model:
    """Return coupled masses with q'' = A q, of which the squares of ``rates`` are the eigenvalues, signs kept."""
    values = np.sign(rates) * np.square(rates)
    basis, _ = np.linalg.qr(np.random.default_rng(len(rates)).normal(size=(len(rates), len(rates))))
    A = basis @ np.diag(values) @ basis.T
    builder = eomgen.SceneBuilder("row", gravity=[0, 0, 0])
    for k in range(len(rates)):
        builder.body(f"m{k}", 1.0)
        builder.joint(f"x{k}", "prismatic", "base", f"m{k}", axis=[1, 0, 0], initial={"position": 0.1})
        force = " + ".join(f"({float(a)!r}) * q.x{j}" for j, a in enumerate(A[k]))
        builder.effort(f"f{k}", f"x{k}", force)
    return eomgen.build(builder.build(), profile="quick")


@pytest.mark.long_except_every(7)
@pytest.mark.parametrize("method", GAMMA)
@pytest.mark.parametrize("rates", [(-3.0, -2.0, -1.0), (10.0, 11.0, -3.0, 1.0), (9.0, 10.0, 11.0, -30.0)])
def test_any_number_of_growing_modes_is_noticed_from_the_pole_on(rates: tuple[float, ...], method: str) -> None:
    made = row_of_masses(rates)
    growing = [rate for rate in rates if rate > 5.0]
    for part in (0.95, 1.05):
        for rate in growing[:1] or [10.0]:
            step = part / (GAMMA[method] * max(growing or [rate]))
            run = made.simulate(4 * step, step, method=method, **COUNTED)
            assert run.stats["unfollowed_growth"] == (4 if growing and part > 1.0 else 0)


@pytest.mark.parametrize("method", GAMMA)
def test_a_run_ends_where_growth_is_lost_and_says_what_to_do(method: str) -> None:
    run = row_of_masses((10.0, -3.0, -2.0)).simulate(2.8, 0.7, method=method, error_estimate=False)
    assert not run.success and len(run.t) == 1
    assert "something grows by itself so fast that a step would damp it" in run.message
    assert "try: a step smaller than 0.7 s, or stop_at_growth = 0" in run.message


@pytest.mark.parametrize(("rate", "noticed"), [(-300.0, 0), (7.0, 0), (9.0, 20)])
def test_internal_states_that_grow_are_noticed_and_those_that_decay_are_not(rate: float, noticed: int) -> None:
    builder = eomgen.SceneBuilder("slow", gravity=[0, 0, 0]).body("mass", 1.0)
    builder.joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], stiffness=4.0)
    scene = builder.state("w", f"({rate!r}) * w", initial=1e-9).effort("push", "rail", "0.1 * w").build()
    run = eomgen.build(scene, profile="quick").simulate(5.0, 0.25, method="rosenbrock", **COUNTED)
    assert run.stats["unfollowed_growth"] == noticed


@pytest.mark.long
def test_what_elastic_coordinates_do_far_from_the_motion_is_no_growth() -> None:
    """Random states at which pivots are chosen have an inertia matrix that is not definite, states of the motion do."""
    run = eomgen.build("examples/elastic_pendulum/scene.toml", profile="quick").simulate(0.1, 1e-3, method="rosenbrock")
    assert run.success and run.stats["unfollowed_growth"] == 0
