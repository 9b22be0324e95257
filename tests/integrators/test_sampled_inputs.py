"""Inputs that jump and parameters that change between steps: the next step begins with them, in emitted C and in
Python."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.integrators.families.register import method_named
from eomgen.integrators.stepper_layout import default_settings
from eomgen.pipeline.model import Model
from eomgen.simulation.stepping.settings import stepper_library
from eomgen.simulation.stepping.stepper import Stepper
from tests.codegen.test_stand_alone import compiled, run
from tests.integrators.stepper_models import PROGRAMS
from tests.models.library import scene

pytestmark = pytest.mark.slow


TREE_METHODS = (
    "generalized_alpha", "rk4", "rk45", "taylor", "rosenbrock", "lsrt2", "corrected_predictor", "rattlie", "tdg2",
)  # fmt: skip  # names
OF_ORDER_2 = ("generalized_alpha", "rosenbrock", "lsrt2", "corrected_predictor", "rattlie")
LOOP_METHODS = ("generalized_alpha", "generalized_alpha_f1", "generalized_alpha_index3", "rk4_partitioned", "rattlie")

#: 2000 samples of a random force, the mass ten times as large from the thousandth on; prints the largest errors of q
#: and v.
SAMPLED = (PROGRAMS / "sampled_force.c").read_text(encoding="utf-8")


@pytest.mark.long_except_every(2)
@pytest.mark.parametrize("method", TREE_METHODS)
def test_a_free_mass_moves_exactly_under_a_random_held_force(method: str, tmp_path: Path) -> None:
    free_mass = (
        eomgen.SceneBuilder("free_mass")
        .parameter("m", 1.0, tunable=True)
        .input("f", unit="N")
        .body("b", "m")
        .joint("x", "prismatic", "base", "b", axis=[1, 0, 0])
        .effort("e", "x", "f")
        .build()
    )
    eomgen.generate(free_mass, tmp_path / "c", method=method)
    (tmp_path / "c" / "main.c").write_text(SAMPLED, encoding="utf-8")
    result = run(compiled(tmp_path / "c"))
    assert result.returncode == 0, result.stderr
    wrong_q, wrong_v, *grid = map(float, result.stdout.split())
    # Taylor's step is the difference of two rounded times, times 100 m/s^2
    rounding = 1e-13 if method == "taylor" else 1e-14
    assert (wrong_q, wrong_v) <= (rounding, rounding)
    assert grid == [2000, 2000, 2.0]


@cache
def model_of(name: str) -> Model:
    """Return the arm, the loop, or the arm with forces that jump besides."""
    changes: dict[str, Any] = {}
    if name == "jumps":
        wave = {"wave": {"shape": "square", "period": 0.0371, "low": -2.0, "high": 2.0}}
        changes = {"name": "sampled_arm_with_jumps", "inputs__bump": wave, "efforts__push__effort": "force + bump"}
    file = "sampled_loop" if name == "loop" else "sampled_arm"
    return eomgen.build(scene(f"../tests/integrators/scenes/{file}", **changes))


def stepper_of(model: Model, method: str, step: float) -> Stepper:
    library = stepper_library(model, method, method_named(method))
    settings = default_settings(library.layout["method"]) | {"step": step}
    return Stepper(library, settings, model.parameter_array())


def rows_of(stepper: Stepper, u: np.ndarray, jumps: int = 0) -> np.ndarray:
    """Return the rows of one step with inputs held; ``jumps`` of them are left to the scene."""
    return np.tile(np.concatenate([u, np.full(jumps, np.nan)]), (stepper.sizes["rows_per_step"] + 1, 1))


def sampled(
    stepper: Stepper, start: tuple[np.ndarray, ...], samples: np.ndarray, each: int, jumps: int = 0
) -> np.ndarray:
    """Return q and v after samples of inputs (n, nu), each held over so many steps."""
    q, v, z = start
    assert stepper.initialize(0.0, q, v, rows_of(stepper, samples[0], jumps), z) == 0
    for u in samples:
        for _ in range(each):
            assert stepper.run(1, 1, rows_of(stepper, u, jumps), np.empty((1, stepper.sizes["row"]))) == (0, 1)
    return np.concatenate([stepper.state[stepper.places[name]] for name in ("q", "v", "z") if name in stepper.places])


def exact(model: Model, start: tuple[np.ndarray, ...], samples: np.ndarray, period: float) -> np.ndarray:
    """Return the same by DOP853, started anew at every sample."""
    y = np.concatenate(start)
    for k, u in enumerate(samples):
        solved = solve_ivp(model.rhs, (k * period, (k + 1) * period), y, "DOP853", args=(u,), rtol=1e-12, atol=1e-13)
        y = solved.y[:, -1]
    return y


@pytest.mark.long_except_every(4)
@pytest.mark.parametrize("method", TREE_METHODS)
def test_an_arm_keeps_the_order_of_its_method_under_sampled_torques(method: str, rng: np.random.Generator) -> None:
    model, period = model_of("arm"), 0.01
    samples = rng.normal(size=(30, 2)) * [20.0, 2.0]
    start = (np.array(model.initial_q), np.array(model.initial_v), np.array([0.1]))
    true, errors = exact(model, start, samples, period), []
    for each in (4, 8, 16):
        found = sampled(stepper_of(model, method, period / each), start, samples, each)
        errors.append(float(np.abs(found - true).max()))
    order = 2 if method in OF_ORDER_2 else 5 if method == "tdg2" else 4
    assert errors[-1] < {2: 1e-4, 4: 1e-7, 5: 1e-10}[order], errors
    if method not in ("taylor", "rk45"):  # exact to its tolerance at every step
        assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.25 if order < 5 else 0.4), errors
        assert np.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.25 if order < 5 else 0.4), errors


@pytest.mark.parametrize("method", LOOP_METHODS)
def test_a_parameter_may_move_the_constraints_between_steps(method: str) -> None:
    model = model_of("loop")
    stepper = stepper_of(model, method, 1e-3)
    assert stepper.initialize(0.5, model.initial_q, model.initial_v, rows_of(stepper, np.ones(1))) == 0
    row = np.empty((1, stepper.sizes["row"]))
    for k in range(20):
        stepper.parameters[0] = 1.0 if k < 10 else 1.02
        assert stepper.run(1, 1, rows_of(stepper, np.ones(1)), row) == (0, 1)
    q, v, a = (stepper.state[stepper.places[name]] for name in ("q", "v", "vdot"))
    changed = {"length": 1.02}
    assert np.abs(model.evaluate("constraint", q=q, t=0.52, parameters=changed)["Phi"]).max() < 1e-12
    expected, _ = model.constrained_dynamics(q, v, 0.52, [1.0], parameters=changed)
    assert a == pytest.approx(expected, rel=1e-2 if "alpha" in method else 1e-10)
    assert (stepper.count, stepper.origin, stepper.statistics["steps"]) == (20, 0.5, 20)


@pytest.mark.parametrize("method", ["generalized_alpha", "rk4"])
def test_rows_that_continue_cost_no_evaluation(method: str, rng: np.random.Generator) -> None:
    model = model_of("arm")
    points = rng.normal(size=(41, 2))

    def evaluations(pieces: int) -> tuple[float, bytes]:
        stepper = stepper_of(model, method, 1e-3)
        times = np.arange(0.0, 40.25, 1.0 / stepper.sizes["rows_per_step"])
        fine = np.stack([np.interp(times, np.arange(41), u) for u in points.T], axis=1)
        each = 40 // pieces * stepper.sizes["rows_per_step"]
        assert stepper.initialize(0.0, model.initial_q, model.initial_v, fine, np.array([0.1])) == 0
        for k in range(pieces):
            table = np.ascontiguousarray(fine[k * each : (k + 1) * each + 1])
            assert stepper.run(40 // pieces, 1, table, np.empty((40, stepper.sizes["row"])))[0] == 0
        places = [stepper.places[name] for name in ("q", "v", "vdot", "z")]
        return stepper.statistics["evaluations"], b"".join(stepper.state[place].tobytes() for place in places)

    assert evaluations(1) == evaluations(40)


def test_a_step_that_fails_leaves_what_its_state_was_evaluated_with() -> None:
    model = model_of("arm")
    stepper = stepper_of(model, "rk4", 1e-3)
    assert stepper.initialize(0.0, model.initial_q, model.initial_v, rows_of(stepper, np.ones(2)), np.array([0.1])) == 0
    stepper.run(3, 1, np.ones((7, 2)), np.empty((3, stepper.sizes["row"])))
    before = stepper.row
    bad = rows_of(stepper, np.array([np.inf, 1.0]))
    assert stepper.run(1, 1, bad, np.empty((1, stepper.sizes["row"])))[0] == 3
    assert np.array_equal(stepper.row, before)
    evaluations = stepper.statistics["evaluations"]
    assert stepper.run(1, 1, np.ones((3, 2)), np.empty((1, stepper.sizes["row"])))[0] == 0
    assert stepper.statistics["evaluations"] == evaluations + 4
