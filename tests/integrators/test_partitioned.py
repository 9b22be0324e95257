"""Coordinate partitioning: against multipliers, closed forms and published tops; order, constraints, switches and
failures."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.integrators.families.partitioned import PARTITIONED_RUNGE_KUTTA_4
from tests.integrators.constrained_models import (
    compile_scene,
    heavy_top,
    top_errors,
)
from tests.oracles.placed_loops import windows
from tests.simulation.test_singular_positions import error

pytestmark = pytest.mark.slow

NAME = "rk4_partitioned"


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    known = {}

    def get(name, scene, method=PARTITIONED_RUNGE_KUTTA_4):
        key = (name, method.family)
        if key not in known:
            known[key] = compile_scene(tmp_path_factory.mktemp(name), scene, method)
        return known[key]

    return get


def linkage(crank, coupler, rocker, ground, angles, speed, drive=""):
    """Return three uniform rods in a plane that a hinge closes to a loop; guesses of the angles need not close it."""

    def rod(length):
        inertia = [1e-4, length**3 / 6, length**3 / 6]
        return {"mass": 2 * length, "center_of_mass": [length / 2, 0, 0], "inertia": inertia}

    def hinge(parent, child, place, **initial):
        ends = {"type": "revolute", "parent": parent, "child": child}
        return {**ends, "axis": [0, -1, 0], "position": [place, 0, 0], "initial": initial}

    def closed(first, second, **more):
        ends = [
            {"body": body, "position": [place, 0, 0], "axis": [0, side, 0], "x_axis": [1, 0, 0]}
            for body, place, side in (first, second)
        ]
        return {"type": "revolute", "first": ends[0], "second": ends[1], **more}

    loop = closed(("coupler", coupler, 1), ("rocker", rocker, 1))
    motor = closed(("base", 0, -1), ("crank", 0, -1), drive=drive)
    return {
        "format": 1,
        "name": "linkage",
        "gravity": [0, 0, -9.81],
        "bodies": {"crank": rod(crank), "coupler": rod(coupler), "rocker": rod(rocker)},
        "joints": {
            "drive": hinge("base", "crank", 0, position=angles[0], velocity=speed),
            "pin": hinge("crank", "coupler", crank, position=angles[1]),
            "support": hinge("base", "rocker", ground, position=angles[2]),
        },
        "constraints": {"loop": loop} | ({"motor": motor} if drive else {}),
        "outputs": {"energy": {"energy": "total"}},
    }


def double_rocker():
    return linkage(0.3, 0.15, 0.35, 0.4, (1.2, -1.0, 1.8), 3.0)


@cache
def rocker_model():
    return eomgen.build(double_rocker(), method=NAME)


def by_multipliers(model, times):
    """Return q and v at times from M vdot + B^T lam = ..., B vdot = -g in an integrator of its own; all coordinates are
    R."""

    def rate(t, y):
        return np.concatenate([y[model.nv :], model.constrained_dynamics(y[: model.nv], y[model.nv :], t)[0]])

    start = np.concatenate([model.initial_q, model.initial_v])
    found = solve_ivp(rate, (times[0], times[-1]), start, method="DOP853", rtol=1e-13, atol=1e-13, t_eval=times)
    return found.y.T


def slopes(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


# -- motion ------------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_double_rocker_switches_and_moves_as_by_multipliers():
    model, steps, errors = rocker_model(), (4e-4, 2e-4, 1e-4), []
    for step in steps:
        run = model.simulate(1.0, step, method=NAME, record_every=round(1e-2 / step))
        assert run.success, run.message
        expected = by_multipliers(model, run.t)
        errors.append(np.abs(np.hstack([run.q, run.v]) - expected).max(axis=0))
        assert run.stats["max_constraint"] <= 1e-12 and run.stats["max_constraint_velocity"] <= 1e-12
    assert run.stats["partitions"] >= 5
    assert errors[-1].max() < 1e-8
    assert slopes(steps, [error[: model.nv].max() for error in errors]) == pytest.approx(4.0, abs=0.2)
    assert slopes(steps, [error[model.nv :].max() for error in errors]) == pytest.approx(4.0, abs=0.2)
    for joint in (0, 2):  # both rockers turn back, and the coupler goes round
        assert run.v[:, joint].min() < 0.0 < run.v[:, joint].max()
    assert np.ptp(run.q[:, 1]) > 2.0 * np.pi


def test_order_4_on_the_fast_heavy_top(compiled):
    stepper, exponents, errors = compiled("R3xSO3", heavy_top("R3xSO3")), (10, 11, 12), []
    for k in exponents:
        assert stepper.start(step=2.0**-k).status == 0
        outcome = stepper.run(2**k, every=2**k // 16)
        assert (outcome.status, len(outcome.rows)) == (0, 16)
        errors.append(top_errors(outcome.rows)[[2, 3]])
        assert outcome.state["max_constraint"] <= 1e-12 and outcome.state["max_constraint_velocity"] <= 1e-12
    for column in range(2):
        assert slopes([2.0**-k for k in exponents], [error[column] for error in errors]) == pytest.approx(4.0, abs=0.2)
    assert errors[-1][0] < 1e-5 and errors[-1][1] < 1e-3
    assert np.abs(np.linalg.norm(outcome.rows[:, 1:5], axis=1) - 1.0).max() < 1e-14


# -- drivers, moving base, rows at velocity level ----------------------------------------------------------------------


def test_a_driven_linkage_has_nothing_left_to_integrate():
    model = eomgen.build(linkage(0.1, 0.35, 0.3, 0.4, (0.5, 0.3, 1.5), 20.0, "0.5 + 20*t + 0.1*sin(3*t)"), method=NAME)
    assert len(model.multipliers) == model.nv == 3
    run = model.simulate(1.0, 1e-3, method=NAME)
    assert run.success, run.message
    crank, rocker = run.q[:, 0], run.q[:, 2]
    np.testing.assert_allclose(crank, 0.5 + 20.0 * run.t + 0.1 * np.sin(3.0 * run.t), atol=1e-12)
    np.testing.assert_allclose(run.v[:, 0], 20.0 + 0.3 * np.cos(3.0 * run.t), atol=1e-11)
    np.testing.assert_allclose(run.a[:, 0], -0.9 * np.sin(3.0 * run.t), atol=1e-9)
    pins = np.array([0.4 + 0.3 * np.cos(rocker) - 0.1 * np.cos(crank), 0.3 * np.sin(rocker) - 0.1 * np.sin(crank)])
    np.testing.assert_allclose(np.linalg.norm(pins, axis=0), 0.35, atol=1e-12)
    slow = model.simulate(1.0, 0.25e-3, method=NAME, record_every=4)  # no truncation error: the step does not matter
    np.testing.assert_allclose(slow.multipliers, run.multipliers, rtol=1e-8, atol=1e-8)


# -- states, steps, failures -------------------------------------------------------------------------------------------


def test_a_start_off_the_constraints_is_corrected_along_the_dependent_components(compiled):
    stepper = compiled("R3xSO3", heavy_top("R3xSO3"))
    q, v = np.array(stepper.system.initial_q), np.array(stepper.system.initial_v)
    q[4:] += [0.01, -0.02, 0.03]
    v[3:] += [1.0, 2.0, 3.0]
    outcome = stepper.initialize(q, v, step=1e-3)
    dependent = [int(i) for i in outcome.state["dependent"]]
    assert (outcome.status, len(dependent), outcome.state["partitions"]) == (0, 3, 1)
    assert outcome.state["max_constraint"] <= 1e-13 and outcome.state["newton_iterations"] >= 3
    independent = [i for i in range(6) if i not in dependent]
    assert np.array_equal(outcome.state["v"][independent], v[independent])
    assert np.abs(outcome.state["v"][dependent] - v[dependent]).max() > 0.5


# -- anywhere, in any plane --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["rk4_partitioned", "rk45_partitioned"])
@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_a_driven_travel_from_zero_is_regular_however_far_it_goes(method: str, unit: float) -> None:
    """A cart on a law, x = 7.5 t^2, nothing in the machine with a lever: (m r^2 + I) phi'' = m r (x'' cos - g sin)."""
    law, m, r, inertia, g = 15.0 * unit, 0.5, 0.3 * unit, 0.1 * unit**2, 9.81 * unit
    builder = eomgen.SceneBuilder("cart", gravity=[0, 0, -g]).body("cart", 2.0)
    builder.body("bob", m, center_of_mass=[0, 0, -r], inertia=[inertia, inertia, inertia / 2])
    builder.joint("x", "prismatic", "base", "cart", axis=[1, 0, 0], drive=f"{law / 2} * t**2")
    builder.joint("swing", "revolute", "cart", "bob", axis=[0, 1, 0], initial={"position": 0.3})
    scene = builder.build()
    run = eomgen.build(scene, method=method, profile="quick").simulate(2.0, 1e-3)

    def swinging(_: float, y: np.ndarray) -> list[float]:
        # turning about +y takes the bob from -z towards -x
        return [y[1], m * r * (law * np.cos(y[0]) - g * np.sin(y[0])) / (m * r * r + inertia)]

    exact = solve_ivp(swinging, (0.0, 2.0), [0.3, 0.0], rtol=1e-12, atol=1e-12).y[0, -1]
    assert run.success, run.message
    assert run.stats["singular_passages"] == 0
    assert run.q[-1] == pytest.approx([2.0 * law, exact], rel=1e-6)


@pytest.mark.parametrize(("tolerance", "bound", "counted"), [(1e-4, 1e-2, 0), (1e-8, 1e-6, 2)])
def test_steps_by_a_tolerance_pass_singular_positions_along_the_velocity(
    tolerance: float, bound: float, counted: int
) -> None:
    """Two windows of rods (IFToMM A02), against the motion of one angle; long steps lead across."""
    made = eomgen.build(windows(2), profile="quick")
    found = made.simulate(3.0, 0.01, method="rk45_partitioned", tolerance=tolerance, error_estimate=False)
    assert found.success and found.stats["singular_passages"] >= counted
    assert error(found) < bound
