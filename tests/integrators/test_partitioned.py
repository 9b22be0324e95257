"""Coordinate partitioning: order on a published top, constraints, singular positions and failures."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.integrators.families.partitioned import PARTITIONED_RUNGE_KUTTA_4
from tests.integrators.constrained_models import compile_scene, heavy_top, top_errors
from tests.oracles.placed_loops import windows
from tests.simulation.test_singular_positions import error

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    known = {}

    def get(name, scene, method=PARTITIONED_RUNGE_KUTTA_4):
        key = (name, method.family)
        if key not in known:
            known[key] = compile_scene(tmp_path_factory.mktemp(name), scene, method)
        return known[key]

    return get


def slopes(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


# -- motion ------------------------------------------------------------------------------------------------------------


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


@pytest.mark.parametrize(("tolerance", "bound", "counted"), [(1e-4, 1e-2, 0), (1e-8, 1e-6, 2)])
def test_steps_by_a_tolerance_pass_singular_positions_along_the_velocity(
    tolerance: float, bound: float, counted: int
) -> None:
    """Two windows of rods (IFToMM A02), against the motion of one angle; long steps lead across."""
    made = eomgen.build(windows(2), profile="quick")
    found = made.simulate(3.0, 0.01, method="rk45_partitioned", tolerance=tolerance, error_estimate=False)
    assert found.success and found.stats["singular_passages"] >= counted
    assert error(found) < bound
