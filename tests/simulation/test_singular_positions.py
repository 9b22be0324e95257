"""Positions where constraints are singular: passed along the velocity, or the run says that it is they."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.simulation.judgement.singular_positions import (
    NEARLY,
    SingularPosition,
    examined_rows,
    nearest,
    singular_ahead,
)
from tests.models.scenes import jointed_chain, zigzag
from tests.oracles.placed_loops import parallelogram, windows

SINGULAR = ", where branches of configurations cross"
WAY = (
    "try: rk4_partitioned, which passes such positions along the velocity; steps smaller than 0.01 s may come nearer"
    " to it"
)


def nearest_of(model: eomgen.Model, t: np.ndarray, q: np.ndarray, p: np.ndarray) -> SingularPosition | None:
    chosen = examined_rows(model, len(t))
    return nearest(model, t[chosen], q[chosen], p, 0)


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    return eomgen.build(windows(2) | {"outputs": {"energy": {"energy": "total"}}}, profile="quick")


def tops(t: np.ndarray) -> np.ndarray:
    """Return the angle of two windows that stay parallel to each other, (n,): theta'' = -(3 g / 2) (7 / 9)
    cos(theta)."""
    found = solve_ivp(
        lambda _, y: [y[1], -1.5 * 9.81 * 7 / 9 * np.cos(y[0])],
        (0.0, t[-1]),
        [np.pi / 2, -1.0],
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
        t_eval=t,
    )
    return np.asarray(found.y[0])


def error(run: eomgen.Solution) -> float:
    """Return the largest distance, in m, of a top of a post from where it has to be."""
    return float(np.abs(2.0 * np.sin((run.q[:, :3] - tops(run.t)[:, np.newaxis]) / 2.0)).max())


@pytest.mark.slow
@pytest.mark.parametrize("step", [1e-2, 5e-3, 1e-3])
def test_rk4_partitioned_passes_and_says_how_often(model: eomgen.Model, step: float) -> None:
    """The figures of docs/scene.md; as often as the posts lie down in the motion of the closed form."""
    run = model.simulate(10.0, step, method="rk4_partitioned")
    count = int(run.stats["singular_passages"])
    lying = int(np.count_nonzero(np.diff(np.floor(tops(np.linspace(0.0, 10.0, 20001)) / np.pi))))
    assert run.success and count == lying == 10
    assert run.message.endswith(
        f"; it passed {count} positions where the constraints are singular, or nearly, and branches cross, each time"
        " along its velocity"
    )
    assert error(run) < 3e-6 and np.ptp(run.energy["total"]) < 3e-6


@pytest.mark.slow
def test_rk45_partitioned_says_where_its_error_does_not_follow_the_tolerance(model: eomgen.Model) -> None:
    told = "; near them errors do not follow tolerances: the estimated one is "
    run = model.simulate(10.0, 1e-2, method="rk45_partitioned", tolerance=1e-10)
    assert run.success and error(run) > 1e-6  # 1e-10 of 30 m would be 3e-9
    assert f"{told}{run.error.relative:.2g} of the motion at a tolerance of 1e-10; try: a tolerance of" in run.message
    assert error(run) / 5.0 < run.error.increment.max() < 5.0 * error(run)
    run = model.simulate(10.0, 1e-2, method="rk45_partitioned", tolerance=1e-6)
    assert run.success and told not in run.message and error(run) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("step", [1e-2, 5e-3, 2e-3, 1e-3])
@pytest.mark.parametrize("method", ["generalized_alpha", "generalized_alpha_index3", "trapezoidal"])
def test_generalized_alpha_passes_with_its_order_or_says_why_it_stops(
    model: eomgen.Model, method: str, step: float
) -> None:
    run = model.simulate(10.0, step, method=method)
    assert error(run) < 50.0 * step**2
    assert np.ptp(run.energy["total"]) < 200.0 * step**2
    if not run.success:
        assert "the constraints are nearly singular at t = " in run.message and SINGULAR in run.message
        assert "try: rk4_partitioned, which passes such positions along the velocity; steps smaller than" in run.message


@pytest.mark.slow
def test_a_stop_names_the_position_and_what_passes_it(model: eomgen.Model) -> None:
    run = model.simulate(10.0, 1e-2, method="generalized_alpha", settings={"max_iterations": 2, "max_halvings": 0})
    assert not run.success and run.message.endswith(f"{SINGULAR}; {WAY}")
    named = float(run.message.partition("singular at t = ")[2].partition(" s")[0])
    assert run.t[-1] <= named <= run.t[-1] + 2e-2
    flat = np.abs(np.sin(tops(np.array([0.0, named]))[-1]))
    assert flat < 0.05
    passed = model.simulate(10.0, 2e-3, method="rk4_partitioned")
    assert passed.success and passed.t[-1] > named


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha", "generalized_alpha_index3", "rk4_partitioned"])
@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_a_start_at_one_is_refused_with_the_cause(model: eomgen.Model, method: str, speed: float) -> None:
    flat = {"q": np.zeros(5), "v": speed * np.array([1.0, 1.0, 1.0, -1.0, -1.0])}
    run = model.simulate(0.1, 1e-3, method=method, initial=flat)
    assert not run.success and "the constraints are nearly singular at t = 0 s" in run.message
    hint = "a start elsewhere: the constraints do not say there in which branch the motion goes on"
    assert run.message.endswith(f"{SINGULAR}; try: {hint}")


def test_rows_of_a_run_are_judged_by_its_others(model: eomgen.Model) -> None:
    angle = np.linspace(np.pi / 2, 0.01, 300)
    q, t, p = (
        np.stack([angle, angle, angle, -angle, -angle], axis=1),
        np.linspace(0.0, 1.0, 300),
        model.parameter_array(),
    )
    v = np.array([-1.0, -1.0, -1.0, 1.0, 1.0])
    found = nearest_of(model, t, q, p)
    assert found is not None and found.time == 1.0 and found.part < NEARLY
    assert nearest_of(model, t[:200], q[:200], p) is None
    ahead = singular_ahead(model, t[:290], q[:290], v, p, angle[289] / 1.5)
    assert ahead is not None and ahead.time == pytest.approx(t[289] + angle[289], rel=1e-9)
    assert singular_ahead(model, t[:290], q[:290], -v, p, 1e-3) is None
    assert singular_ahead(model, t[:1], q[:1], v, p, 1e-3) is None
    start = singular_ahead(model, t[:1], np.zeros((1, 5)), 0.0 * v, p, 1e-3)
    assert start is not None and start.time == 0.0 and start.part < 1e-8


@pytest.mark.slow
def test_a_driven_loop_at_crossing_branches_is_not_beyond_its_reach() -> None:
    scene = parallelogram("revolute")
    scene["joints"]["drive"] = {**scene["joints"]["drive"], "drive": "0.8 + 1.1 * t + 0.3 * sin(3 * t)"}
    del scene["joints"]["drive"]["initial"]
    model = eomgen.build(scene, profile="instant")
    few = {"max_iterations": 2, "max_halvings": 0}
    run = model.simulate(3.0, 5e-3, method="generalized_alpha", settings=few)
    assert not run.success and SINGULAR in run.message and "reach" not in run.message


@pytest.mark.slow_except("4-terms0")
@pytest.mark.parametrize(
    ("count", "terms"), [(4, ("mass", "constraint_jacobian")), (60, ("mass_values", "jacobian_values"))]
)
def test_a_tied_chain_of_any_length_is_singular_where_it_is_straight(count: int, terms: tuple[str, ...]) -> None:
    """By whole matrices of few bodies, by nonzeros of many: the tie follows from the hinges where all rods are in
    line."""
    model = eomgen.build(jointed_chain(count, tied=True), terms=terms, profile="instant")
    p, angles = model.parameter_array(), np.geomspace(0.3, 1e-6, 30)
    np.testing.assert_allclose(model.initial_q, zigzag(count, 0.1), atol=1e-12)
    q, t = np.stack([zigzag(count, angle) for angle in angles]), np.linspace(0.0, 1.0, 30)
    found = nearest_of(model, t, q, p)
    assert found is not None and found.time == 1.0 and found.part < 0.01
    assert nearest_of(model, t[:8], q[:8], p) is None
    assert nearest_of(model, t[:1], q[:1], p) is None
    alone = nearest_of(model, t[:1], zigzag(count, 0.0)[np.newaxis], p)
    assert alone is not None and alone.part < 1e-7
