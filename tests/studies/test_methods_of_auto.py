"""Studies of scenes whose method is auto."""

from __future__ import annotations

import tomllib

import pytest

import eomgen
from eomgen.products.studies.work_precision.formulations import Formulations
from eomgen.products.studies.work_precision.running import Grid, Runner
from tests.models.scenes import PENDULUM_TOML


def test_studies_take_for_auto_the_method_of_a_run() -> None:
    """A pendulum is smooth and slow beside its step: its run takes the explicit method of order 4."""
    scene = eomgen.load({**tomllib.loads(PENDULUM_TOML), "simulation": {"method": "auto", "duration": 1, "step": 1e-3}})
    taken = Runner(Formulations({"joint": scene}, {}), Grid(row=1e-3, rows=10)).own_method()
    assert taken == eomgen.build(scene).simulate(0.01, error_estimate=False).metadata["method"] == "rk4"


@pytest.mark.slow
def test_studies_leave_out_parameters_that_the_method_of_auto_does_not_take() -> None:
    simulation = {"method": "auto", "duration": 1, "step": 1e-3, "alpha": 0.1, "settings": {"max_iterations": 9}}
    scene = eomgen.load({**tomllib.loads(PENDULUM_TOML), "simulation": simulation})
    runner = Runner(Formulations({"joint": scene}, {}), Grid(row=1e-3, rows=10))
    configuration = runner.own_configuration()
    assert (configuration.method, configuration.parameters, configuration.settings) == ("rk4", {}, {})
    assert runner.method(configuration).family == "runge_kutta"
