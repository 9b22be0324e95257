"""Coordinates without inertia: scenes refuse them by name, and the C of methods of one factorization steps
them (index 1)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from tests.integrators.stepper_models import PROGRAMS
from tests.models.c_programs import printed, program

Array = NDArray[np.float64]
STIFFNESS = 100.0


def scene(light: float | str) -> eomgen.Scene:
    """Return two masses in a row on springs, the second pulled by sin t."""
    builder = eomgen.SceneBuilder("pair", gravity=[0, 0, 0]).parameter("light", 1.0, tunable=True)
    builder.body("first", 1.0).body("second", light)
    builder.joint("x1", "prismatic", "base", "first", axis=[1, 0, 0], stiffness=STIFFNESS)
    builder.joint("x2", "prismatic", "base", "second", axis=[1, 0, 0])
    builder.effort("pull", "x2", f"sin(t) - {STIFFNESS} * (q.x2 - q.x1)")
    return builder.effort("back", "x1", f"{STIFFNESS} * (q.x2 - q.x1)").build()


def exact(t: Array) -> Array:
    """Return x1 for a second mass of nothing: x1'' + 100 x1 = sin t."""
    return np.asarray((np.sin(t) - np.sin(10.0 * t) / 10.0) / 99.0)


def missed(rows: Array) -> float:
    """Return the largest force that the massless coordinate is left with."""
    return float(np.abs(STIFFNESS * (rows[:, 2] - rows[:, 1]) - np.sin(rows[:, 0])).max())


MAIN = (PROGRAMS / "massless.c").read_text(encoding="utf-8")


#: Orders, and numbers of steps.
ORDERS = {"rosenbrock": (2, (200, 400, 800)), "lsrt2": (2, (200, 400, 800)), "tdg1": (3, (120, 240, 480))}
ORDERS |= {"tdg1_star": (3, (120, 240, 480)), "tdg2": (5, (48, 96, 192)), "tdg2s": (4, (120, 240, 480))}
ORDERS |= {"tdg3": (7, (24, 36, 54))}


@pytest.fixture(scope="module", params=ORDERS)
def stepper(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    damped = "settings.damped_start = atoi(argv[3]);" if request.param == "rosenbrock" else ""
    main = MAIN.replace("DAMPED", damped)
    return request.param, program(tmp_path_factory.mktemp("pair"), scene("light"), request.param, main)


@pytest.mark.slow_except("rosenbrock", "tdg2")
def test_order_and_the_algebraic_equation_where_mass_is_nothing(stepper: tuple[str, Path]) -> None:
    method, made = stepper
    (order, counts), errors = ORDERS[method], []
    for count in counts:
        rows = printed(made, float(count), 0.0, 0)
        errors.append(float(np.abs(rows[:, 1] - exact(rows[:, 0])).max()))
        assert method == "lsrt2" or missed(rows) < 1e-13
    found = np.log(np.array(errors[:-1]) / errors[1:]) / np.log(np.array(counts[1:]) / counts[:-1])
    assert found[-1] > order - (0.05 if order == 2 else 0.2)  # tdg2 begins with a slope of 5.8 here
    assert found[-1] < order + 1.0


@pytest.mark.slow_except("rosenbrock", "lsrt2")
def test_a_start_that_meets_no_equation_is_forgotten_by_a_damped_one_only(stepper: tuple[str, Path]) -> None:
    method, made = stepper
    kept, damped = (missed(printed(made, 400.0, 0.5, on)[-1:]) for on in (0, 1))
    if method == "rosenbrock":
        assert kept == pytest.approx(50.0, rel=0.02) and damped < 1e-13
    else:
        assert kept < (0.05 if method == "lsrt2" else 1e-13)


@pytest.mark.slow_except("lsrt2")
@pytest.mark.parametrize("method", ["rosenbrock", "lsrt2", "corrected_predictor"])
def test_scenes_refuse_massless_coordinates_by_name(method: str) -> None:
    said = "the joint x2 cannot be moved by a force: it carries neither mass nor inertia"
    with pytest.raises(eomgen.DescriptionError) as caught:
        scene(0.0)
    assert said in str(caught.value) and "try: mass or inertia for the body second" in str(caught.value)
    made = eomgen.build(scene("light"), method=method, profile="quick")
    with pytest.raises(eomgen.UsageError) as refused:
        made.simulate(1.0, 0.01, method=method, parameters={"light": 0.0})
    assert said in str(refused.value) and "at light = 0; try: mass or inertia for the body second" in str(refused.value)
