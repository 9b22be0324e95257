"""What the C steppers do when a step cannot be taken: refresh, halve, stop with the last good state, and say why."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from eomgen.errors import ModelError, UsageError
from eomgen.integrators.families.generalized_alpha import GeneralizedAlpha
from eomgen.integrators.families.runge_kutta import RUNGE_KUTTA_MUNTHE_KAAS_4
from eomgen.integrators.stepper_data import method_data
from eomgen.integrators.stepper_layout import default_settings
from tests.integrators.stepper_models import BAD_ARGUMENT, EDGE_PARAMETERS, build, edge, free_motion, tied_body

ALPHA, RKMK = GeneralizedAlpha(0.9), RUNGE_KUTTA_MUNTHE_KAAS_4
METHODS = pytest.mark.parametrize("method", [ALPHA, RKMK], ids=["alpha", "rkmk"])
LAST_GOOD = ("t", "q", "v", "vdot", "count")


@pytest.fixture(scope="module")
def steppers(tmp_path_factory):
    def made(method):
        return build(tmp_path_factory.mktemp(method.family), edge(), method, EDGE_PARAMETERS)

    return {method.family: made(method) for method in (ALPHA, RKMK)}


@pytest.fixture
def stepper(steppers, request):
    method = request.getfixturevalue("method")
    result = steppers[method.family]
    result.settings = default_settings(result.program.method)
    result.parameters[:3] = list(EDGE_PARAMETERS.values())
    result.workspace[:] = 0.0
    return result


def set_parameter(stepper, name, value):
    stepper.parameters[list(EDGE_PARAMETERS).index(name)] = value


def pendulum_at(t):
    """Return angle and velocity by SciPy."""
    rates = solve_ivp(
        lambda _, y: [y[1], -400.0 * np.sin(y[0])], (0, t), [1.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-13
    )
    return rates.y[:, -1]


@pytest.mark.slow_cases("alpha")
@METHODS
def test_not_a_number_stops_with_the_last_good_state(stepper, method):
    set_parameter(stepper, "p_last_time", 0.0505)
    stepper.initialize([1.0], [0.0], step=1e-3)
    outcome = stepper.run(100)
    assert (outcome.status, outcome.text) == (3, "a value became infinite or not a number")
    assert outcome.state["t"] == 50 * 1e-3
    assert len(outcome.rows) == 50
    assert np.array_equal(
        outcome.rows[-1], [outcome.state["t"][0], *(outcome.state[name][0] for name in ("q", "v", "vdot"))]
    )
    assert outcome.rows[-1, 1:3] == pytest.approx(pendulum_at(0.05), rel=1e-2 if method is ALPHA else 1e-6)


@METHODS
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_initial_values_that_are_not_finite_are_refused(stepper, method, bad):
    assert stepper.initialize([bad], [0.0]).status == 3
    assert stepper.initialize([1.0], [bad]).status == 3
    assert stepper.initialize([1.0], [0.0], t=bad).status == 3


@METHODS
def test_a_singular_mass_is_named(stepper, method):
    set_parameter(stepper, "p_mass", 0.0)
    outcome = stepper.initialize([1.0], [0.0])
    assert (outcome.status, outcome.text) == (
        2,
        f"the {'mass or iteration' if method.implicit else 'mass'} matrix is singular",
    )


@pytest.mark.parametrize("method", [ALPHA])
def test_a_matrix_that_becomes_singular_stops_the_run(stepper, method):
    stepper.settings["reuse"] = 0.0
    stepper.initialize([1.0], [0.0])
    before = stepper.run(5).state
    set_parameter(stepper, "p_mass", 0.0)
    set_parameter(stepper, "p_stiffness", 0.0)
    outcome = stepper.run(5)
    assert outcome.status == 2
    assert len(outcome.rows) == 0
    assert all(np.array_equal(outcome.state[name], before[name]) for name in LAST_GOOD)


@pytest.mark.parametrize("method", [ALPHA])
def test_steps_that_do_not_converge_are_halved(stepper, method):
    # with two iterations at most, steps of 0.02 fail somewhere on the swing and shorter ones do not
    errors = []
    for limit in (16, 2):
        stepper.settings["max_iterations"] = limit
        stepper.initialize([1.0], [0.0], step=0.02)
        outcome = stepper.run(25)
        assert outcome.status == 0
        assert outcome.rows[:, 0] == pytest.approx(0.02 * np.arange(1, 26), rel=1e-15)
        errors.append(np.linalg.norm((outcome.rows[-1, 1:3] - pendulum_at(0.5)) / [1.0, 20.0]))
    assert outcome.state["halvings"] > 5
    assert outcome.state["steps"] == 25
    assert errors[1] < 0.5 * errors[0]  # sub-steps are steps of the method: nothing is lost by halving


@pytest.mark.parametrize("method", [ALPHA])
def test_no_convergence_at_all_keeps_the_last_good_state(stepper, method):
    stepper.initialize([1.0], [0.0], step=0.02)
    before = stepper.run(3).state
    set_parameter(stepper, "p_stiffness", -1e9)  # a Jacobian so wrong that Newton cannot converge
    stepper.settings["reuse"] = 0.0  # else the good old factors would do
    outcome = stepper.run(5)
    assert outcome.status == 1
    assert outcome.text == "the Newton iteration did not converge, also with a fresh matrix and the smallest sub-steps"
    assert all(np.array_equal(outcome.state[name], before[name]) for name in LAST_GOOD)
    assert outcome.state["halvings"] == 6
    set_parameter(stepper, "p_stiffness", 400.0)
    assert stepper.run(5).status == 0
    assert stepper.state[stepper.layout["count"]] == 8


@pytest.mark.parametrize("method", [ALPHA])
def test_without_halvings_an_attempt_with_a_fresh_matrix_is_the_last(stepper, method):
    stepper.settings |= {"max_halvings": 0.0, "max_iterations": 1.0}
    stepper.initialize([1.0], [0.0], step=0.02)
    outcome = stepper.run(1)
    assert (outcome.status, outcome.state["factorizations"], outcome.state["halvings"]) == (1, 2, 0)


OUT_OF_RANGE = {
    "step": (0.0, -1e-3, np.nan, np.inf),
    "rho_inf": (1.1, -0.1, np.nan),
    "rtol": (-1.0,),
    "atol": (np.nan,),
    "max_iterations": (0.0,),
    "max_halvings": (31.0,),
}
CHANGES = [{name: value} for name, values in OUT_OF_RANGE.items() for value in values]


@pytest.mark.parametrize("method", [ALPHA])
@pytest.mark.parametrize("change", [*CHANGES, {"rtol": 0.0, "atol": 0.0}], ids=str)
def test_settings_out_of_range_are_refused(stepper, method, change):
    stepper.settings |= change
    outcome = stepper.initialize([1.0], [0.0])
    assert (outcome.status, outcome.text) == (4, BAD_ARGUMENT)


@pytest.mark.parametrize("method", [RKMK])
def test_explicit_steps_must_be_positive(stepper, method):
    assert [stepper.initialize([1.0], [0.0], step=step).status for step in (0.0, -1.0, np.nan, 1e-3)] == [4, 4, 4, 0]


def test_what_a_model_lacks_is_named_before_any_code_exists():
    model = tied_body()
    model.functions.pop("partials")
    with pytest.raises(ModelError, match=r"generalized_alpha calls partials, which the model was built without"):
        method_data(ALPHA, model)
    with pytest.raises(ModelError, match=r"runge_kutta calls partials"):
        method_data(RKMK, model)
    with pytest.raises(ModelError, match=r"nothing to integrate: every joint is fixed"):
        method_data(ALPHA, replace(free_motion(["R"]), factors=()))
    with pytest.raises(
        UsageError, match=r"method\.step: the step must be a positive number of seconds, not 0; try: 1e-3"
    ):
        method_data(ALPHA, tied_body(), 0)
