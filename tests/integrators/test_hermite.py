"""Hermite's corrector: order 4 on every group, energies that do not drift, corners, and what stops it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.errors import EomgenError
from eomgen.integrators.families.register import method_named
from eomgen.integrators.stepper_data import method_data
from eomgen.pipeline.pipeline import derive, load
from tests.integrators.test_taylor import SCENES, error, model, pushed, reference
from tests.models.cache import shared_cache

pytestmark = pytest.mark.slow

__all__ = ["shared_cache"]


@pytest.mark.parametrize("name", SCENES)
def test_order_on_every_group(name: str) -> None:
    made, exact = model(name), reference(name, 0.8)
    errors = [error(made, made.simulate(0.8, 0.8 / count, method="hermite"), exact) for count in (20, 40, 80)]
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(4.0, abs=0.1)


@pytest.mark.parametrize("name", SCENES)
def test_smaller_errors_than_runge_kutta_at_the_same_step(name: str) -> None:
    made, exact = model(name), reference(name, 0.8)
    ours, other = (error(made, made.simulate(0.8, 0.01, method=method), exact) for method in ("hermite", "rk4"))
    assert ours < 0.7 * other


def test_energy_of_an_oscillation_does_not_drift() -> None:
    builder = eomgen.SceneBuilder("swing").body("bob", 1.0, center_of_mass=[0, 0, -1.0], inertia=[0.1, 0.1, 0.1])
    builder.joint("hinge", "revolute", "base", "bob", axis=[0, 1, 0], initial={"position": 2.0})
    made = eomgen.build(builder.build(), method="hermite")
    drifts = {}
    for method in ("hermite", "rk4"):
        total = made.simulate(400.0, 0.02, method=method, record_every=10).energy["total"]
        drifts[method] = abs(np.polyfit(np.linspace(0, 1, len(total)), total - total[0], 1)[0])
    assert drifts["hermite"] < 1e-8
    assert drifts["rk4"] > 1e-5


def test_order_across_a_known_jump() -> None:
    made = eomgen.build(pushed("3 if t > late else 0"), method="hermite")
    exact = made.simulate(1.2, 0.1, method="taylor", tolerance=1e-14)
    errors = [
        abs(made.simulate(1.2, 1.2 / count, method="hermite").q[-1, 0] - exact.q[-1, 0]) for count in (40, 80, 160)
    ]
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(4.0, abs=0.2)


#: Operations of the functions of a step, of which only the first is evaluated in every correction. They may only fall.
BUDGETS = {
    "quarter_car": {"series_rates": 54, "series_of_time": 2013},
    "active_vehicle": {"series_rates": 925, "series_of_time": 6849},
    "pendulum_on_shaking_base": {"series_rates": 9, "series_of_time": 5},
    "robot_arm": {"series_rates": 2526},
}


@pytest.mark.parametrize("name", BUDGETS)
def test_what_is_of_time_alone_is_apart_from_what_corrections_evaluate(name: str) -> None:
    system = derive(load(f"examples/{name}/scene.toml"), ["mass", "residual"])
    program = to_program(system, method_data(method_named("hermite"), system, 1e-3))
    assert {item.name: item.operations for item in program.series if item.name != "extent"} == BUDGETS[name]
    for item in program.series:
        assert item.name != "series_of_time" or not {"q", "v", "z"} & set(item.inputs)


def test_order_on_a_measured_road_whose_speed_is_a_parameter() -> None:
    """A smooth curve has rates between its points and at them, wherever these are passed; a series would end there."""
    made = eomgen.build("examples/half_car_on_measured_road/scene.toml", profile="quick")
    exact = made.simulate(2.0, 2e-4, method="rk4", record_every=10_000, error_estimate=False)
    runs = [made.simulate(2.0, step, method="hermite", error_estimate=False) for step in (4e-3, 2e-3, 1e-3)]
    errors = np.array([np.abs(run.q[-1] - exact.q[-1]).max() for run in runs])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(4.0, abs=0.2)
    assert errors[0] < 1e-7


@pytest.mark.parametrize(
    ("curve", "formula", "kink"),
    [
        ("linear", "told(soft * t)", "the pieces of curve 'told', decided by a tunable parameter or a formula that is"
            " not linear in time"),
        ("linear", "told(q.rail)", "the pieces of curve 'told', decided by the motion"),
        ("quintic", "max(q.rail, 0)", "max(), decided by the motion"),
        ("quintic", "told(q.rail)", ""),
        ("quintic", "derivative.told(soft * t)", ""),
    ],
)  # fmt: skip  # a table
def test_kinks_at_unknown_times_are_refused_and_smooth_curves_are_not(curve: str, formula: str, kink: str) -> None:
    builder = eomgen.SceneBuilder("rough").parameter("soft", 0.2, tunable=True)
    builder.body("mass", 1.0).joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0])
    builder.curve("told", points=[[-1, 0], [0.2, 1], [1, -2]], interpolation=curve)
    made = eomgen.build(builder.effort("push", "rail", formula).build(), profile="quick")
    if not kink:
        assert made.simulate(0.1, 0.01, method="hermite").success
        return
    with pytest.raises(EomgenError) as caught:
        made.simulate(0.1, 0.01, method="hermite")
    assert (
        str(caught.value)
        == "model error: hermite cannot run on this scene: its steps take the rates of accelerations, which jump at"
        f" kinks, and these need known times; here are {kink}; try: generalized_alpha"
    )


def test_corrections_that_do_not_settle_stop_the_run() -> None:
    builder = eomgen.SceneBuilder("stiff").body("mass", 1.0)
    builder.joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], stiffness=1e6, initial={"position": 0.1})
    solution = eomgen.build(builder.build(), method="hermite").simulate(1.0, 0.01, method="hermite")
    assert not solution.success
    assert (
        solution.message
        == "stopped at t = 0 s, after 0 of 100 steps: the corrections of a step do not settle: it is too large for the"
        " highest frequency; try: a step smaller than 0.01 s"
    )


def test_what_it_does_not_take() -> None:
    with pytest.raises(EomgenError, match="usage error: order: hermite takes no order; try: leave it out"):
        model("pendulum").simulate(1.0, 0.1, method="hermite", order=4)
    with pytest.raises(EomgenError, match="input torque: hermite needs the time derivatives of inputs, which a table"):
        model("pendulum").simulate(1.0, 0.1, method="hermite", inputs={"torque": np.zeros(11)})


def test_a_checkpoint_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    made = model("flyer")
    whole = made.simulate(1.0, 0.01, method="hermite")
    made.simulate(0.37, 0.01, method="hermite", checkpoint=tmp_path / "run.ckpt")
    second = made.resume(tmp_path / "run.ckpt", 1.0)
    assert np.array_equal(second.q, whole.q[37:])
    assert np.array_equal(second.a, whole.a[37:])
