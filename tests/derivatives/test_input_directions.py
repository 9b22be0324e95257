"""Derivatives of runs by samples of inputs, as directions among others: tangents, adjoints and Hessians."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.pipeline.model import Model
from eomgen.products.derivatives.run_sensitivities import Sensitivities
from tests.derivatives.checks import moved, sixth_order
from tests.derivatives.test_following_starts import resting_controller, resting_loop
from tests.derivatives.test_input_gradients import driven
from tests.derivatives.test_sensitivities import STEP, TO_ROUNDING, built, loop, tree

STEPS = 12
#: Of inputs that jump from row to row, where rounding is not told from what is left at less.
_BELOW = {"rtol": 1e-13, "atol": 1e-15}


def samples(*names: str) -> dict[str, Array]:
    rng = np.random.default_rng(2)
    return {name: rng.normal(size=STEPS + 1) for name in names}


def options_of(method: str, inputs: dict[str, Array]) -> dict[str, Any]:
    return {"method": method, "settings": TO_ROUNDING, "initial": {"a": 0.4}, "inputs": inputs}


@pytest.mark.slow
def test_tangents_and_adjoints_against_differences_of_runs() -> None:
    """Of order 6; inputs enter the matrix of a step, internal states and outputs."""
    _, model = built(driven())
    options = options_of("trapezoidal", samples("torque", "road", "command"))
    found = model.sensitivities(
        STEPS * STEP, STEP, by=["q.a", "inputs.torque[:]", "inputs.command[3]", "inputs.command"], **options
    )
    torques = tuple(f"inputs.torque[{row}]" for row in range(STEPS + 1))
    assert found.by == ("q.a", *torques, "inputs.command[3]", "inputs.command")

    def run(direction: str, size: float) -> Array:
        given = moved(model, found, size * np.array([name == direction for name in found.by]), options["inputs"])
        return model.simulate(STEPS * STEP, STEP, error_estimate=False, **(options | given)).outputs["y"]

    for direction in ("inputs.torque[0]", "inputs.torque[1]", "inputs.torque[7]", *found.by[-2:]):
        expected = sixth_order(lambda size, direction=direction: run(direction, size), 0.01)
        column = found.derivatives["y"][..., found.by.index(direction)]
        assert np.max(np.abs(column - expected)) <= 1e-10 * np.max(np.abs(expected))
    gradients = found.gradients(["final(y[0])", "sum(y[1])", "final(y[2])"])
    table = found.derivatives["y"]
    expected = np.stack([table[-1, 0], table[:, 1].sum(axis=0), table[-1, 2]])
    np.testing.assert_allclose(gradients, expected, rtol=1e-11, atol=1e-13 * np.max(np.abs(expected)))
    for row, of in enumerate(("final(y[0])", "sum(y[1])", "final(y[2])")):
        by_rows = found.input_gradient(of)["torque"]
        np.testing.assert_allclose(
            gradients[row, 1 : STEPS + 2], by_rows, rtol=1e-11, atol=1e-13 * np.max(np.abs(by_rows))
        )


def hold_hessian(model: Model, found: Sensitivities, of: str, options: dict[str, Any]) -> None:
    """Hold a Hessian to differences of exact gradients, of order 6, and products to it."""
    H = found.hessian(of)
    columns = []
    for direction in found.by:

        def gradient(size: float, direction: str = direction) -> Array:
            given = moved(model, found, size * np.array([name == direction for name in found.by]), options["inputs"])
            return model.sensitivities(STEPS * STEP, STEP, by=found.by, **(options | given)).gradients([of])[0]

        columns.append(sixth_order(gradient, 5e-4))
    expected = np.stack(columns, axis=-1)
    size = np.max(np.abs(expected))
    assert np.all(np.max(np.abs(expected), axis=0) > 1e-6 * size)
    assert np.max(np.abs(H - expected)) <= 1e-9 * size
    vectors = np.random.default_rng(1).normal(size=(len(found.by), 2))
    np.testing.assert_allclose(found.hessian_products(of, vectors), H @ vectors, rtol=1e-11, atol=1e-13 * size)


@pytest.mark.slow
def test_hessians_of_a_controlled_arm() -> None:
    _, model = built(driven())
    options = options_of("trapezoidal", samples("torque", "road", "command"))
    by = ["mass", "q.a", "inputs.torque", "inputs.torque[4]", "inputs.command[0]", "inputs.command[9]"]
    found = model.sensitivities(STEPS * STEP, STEP, by=by, **options)
    hold_hessian(model, found, "sum(y[0])", options)


@pytest.mark.slow
@pytest.mark.parametrize(
    "builder",
    [lambda: tree().input("push").effort("pushed", "b", "push*(1 + q.a) + 0.3*push**2"),
     lambda: loop().input("push").effort("pushed", "b", "push*(1 + q.a)*v.a")],
)  # fmt: skip
def test_hessians_take_the_start_within_the_first_step_and_constraints(builder: Any) -> None:
    _, model = built(builder())
    held = {"q": model.initial_q, "v": model.initial_v}  # where the loop is closed
    options = {**options_of("generalized_alpha", samples("push")), "initial": held, "settings": _BELOW}
    output = "angle" if "angle" in model.outputs(model.initial_q, model.initial_v) else "y[0]"
    by = ["mass", "inputs.push[0]", "inputs.push[1]", "inputs.push[6]", "inputs.push"]
    found = model.sensitivities(STEPS * STEP, STEP, by=by, **options)
    hold_hessian(model, found, f"sum({output})", options)


def pushed(builder: Any) -> Any:
    return builder().input("push").effort("pushed", "a", "push*(1 + 0.1*push)")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("builder", "method", "output"),
    [(resting_controller, "trapezoidal", "y[1]"), (resting_loop, "generalized_alpha", "y[0]")],
)
def test_gradients_by_rows_of_runs_from_rest_are_those_along_each_sample(
    builder: Any, method: str, output: str
) -> None:
    _, model = built(pushed(builder))
    options = {**options_of(method, {"push": 0.3 + 0.1 * np.arange(STEPS + 1.0)}), "initial": None}
    for by in (["inputs.push[:]"], [f"v{name[1:]}" for name in model.v_names[:1]]):  # with directions that move rest
        found = model.sensitivities(STEPS * STEP, STEP, by=by, **options)
        by_rows = found.input_gradient(f"sum({output})")["push"]
        if by == ["inputs.push[:]"]:
            expected = found.gradients([f"sum({output})"])[0]
            assert np.all(expected != 0.0)
        np.testing.assert_allclose(by_rows, expected, rtol=1e-11, atol=1e-12 * np.max(np.abs(expected)))
