"""What the templates and the runtime are told about a method."""

from __future__ import annotations

import json

import pytest

from eomgen.integrators.families.generalized_alpha import GeneralizedAlpha
from eomgen.integrators.families.runge_kutta import RUNGE_KUTTA_MUNTHE_KAAS_4
from eomgen.integrators.stepper_data import method_data
from tests.integrators.stepper_models import free_motion, heavy_top, tied_body

ALPHA, RKMK = GeneralizedAlpha(0.8), RUNGE_KUTTA_MUNTHE_KAAS_4


def data_of(method, model, step=1e-3):
    return method_data(method, model, step, model.samples())


@pytest.mark.parametrize("method", [ALPHA, RKMK], ids=["alpha", "rkmk"])
def test_method_data_are_json(method):
    data = data_of(method, tied_body())
    assert json.loads(json.dumps(data, allow_nan=False)) == data


def test_neighbouring_real_coordinates_become_one_loop():
    lie = data_of(ALPHA, free_motion(["R", "R", "SO3", "R", "R", "R"]))["lie"]
    assert lie["runs"] == [
        {"group": "R", "q": 0, "v": 0, "size": 2},
        {"group": "SO3", "q": 2, "v": 2, "size": 3},
        {"group": "R", "q": 6, "v": 5, "size": 3},
    ]
    assert [kernel["name"] for kernel in lie["kernels"]] == ["update_so3", "tangent_so3"]


def test_no_group_function_is_made_that_is_not_called():
    assert data_of(ALPHA, free_motion(["R", "R"]))["lie"]["kernels"] == []
    lie = data_of(RKMK, free_motion(["SE3", "SO3", "SE3"]))["lie"]
    assert [kernel["name"] for kernel in lie["kernels"]] == ["update_se3", "bracket_se3", "update_so3", "bracket_so3"]


def test_rows_of_the_table_of_inputs():
    alpha, rkmk = data_of(ALPHA, heavy_top()), data_of(RKMK, heavy_top())
    assert (alpha["rows_per_step"], alpha["input_times"]) == (1, [0.0, 1.0])
    assert (rkmk["rows_per_step"], rkmk["input_times"], rkmk["input_rows"]) == (2, [0.0, 0.5, 1.0], [0, 1, 1, 2])


def test_factors_are_worth_more_where_they_cost_more():
    costs = [data_of(ALPHA, free_motion(["R"] * n))["factorization_cost"] for n in (2, 60)]
    small, large = (forming / iteration for forming, iteration in costs)
    assert small < 3.0
    assert large > 10.0
