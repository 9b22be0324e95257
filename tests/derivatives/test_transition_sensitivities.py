"""Derivatives of runs whose steps are maps of q, v and z: RATTLie, Runge-Kutta, Runge-Kutta with partitioned
coordinates; against differences of runs in fourth order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import NumericalError, UsageError
from eomgen.pipeline.model import Model
from eomgen.products.derivatives.run_sensitivities import Sensitivities
from eomgen.scene.builder import SceneBuilder
from tests.derivatives.checks import hold_adjoints, moved, tunable
from tests.derivatives.test_sensitivities import OF_CONTROL, OF_TURNS, SPUN, absolute, controlled, loop, turning

STEP = 0.01
TIGHT = {"rtol": 1e-15}


def hanging() -> SceneBuilder:
    """Return a plate on two slides and on a rod, by a constraint of distance, with drag."""
    builder = tunable("sensitive_plate", gravity=[0, -9.81, 0], mass=1.3, length=0.8, drag=0.3)
    builder.body("cart", 0.2).body("plate", "mass", inertia=[0.02, 0.02, 0.02])
    builder.joint("x", "prismatic", "base", "cart", axis=[1, 0, 0], initial={"position": 0.8})
    builder.joint("y", "prismatic", "cart", "plate", axis=[0, 1, 0])
    ends = {"body": "plate", "position": [0, 0, 0]}, {"body": "base", "position": [0, 0, 0]}
    builder.constraint("rod", "distance", *ends, length="length")
    builder.effort("air", "y", "-drag*v.y")
    return builder.output("y", formula=["q.x", "v.y", "a.x"])


def driven_loop() -> SceneBuilder:
    """Return a loop on a base that shakes, whose first joint has an input by a formula, an input by the caller, and a
    filter behind."""
    builder = loop().parameter("gain", 0.7, tunable=True).parameter("shake", 0.02, tunable=True)
    builder.base([0, 0, "shake*sin(9*t)"]).state("filtered", "5*(q.a - filtered)")
    builder.input("push", formula="gain*cos(4*t)").input("pull")
    builder.effort("motor", "a", "push*cos(q.a) + pull - filtered")
    return builder.output("z", formula=["filtered*v.b", "a.a"])


def table_of(arrays: Mapping[str, Any], rows: int, directions: int = 1) -> Any:
    """Return outputs, or derivatives of outputs, side by side, (rows, outputs, directions)."""
    return np.concatenate([np.asarray(array).reshape(rows, -1, directions) for array in arrays.values()], axis=1)


def check(
    builder: SceneBuilder,
    method: str,
    by: Sequence[str],
    initial: Mapping[str, Any],
    *,
    steps: int = 12,
    tolerance: float = 2e-9,
    apart: float = 2e-4,
    inputs: Mapping[str, Any] | None = None,
) -> Sensitivities:
    """Hold derivatives of a run to differences of runs, and adjoints to tangents.

    apart: increment of the differences, so small that runs change their dependent components after the same steps.
    """
    model = eomgen.build(builder.build(), profile="instant")
    options: dict[str, Any] = {"method": method, "settings": TIGHT if method == "rattlie" else None}
    end, rows = steps * STEP, steps + 1
    found = model.sensitivities(end, STEP, by=by, initial=initial, inputs=inputs, **options)
    table = table_of(found.derivatives, rows, len(by))
    run = model.simulate(end, STEP, initial=initial, inputs=inputs, error_estimate=False, **options)
    np.testing.assert_allclose(table_of(found.outputs, rows), table_of(run.outputs, rows), rtol=1e-14, atol=1e-14)

    def outputs(column: int, change: float) -> Any:
        given = moved(model, found, change * np.eye(len(by))[column], inputs)
        return table_of(model.simulate(end, STEP, error_estimate=False, **given, **options).outputs, rows)[:, :, 0]

    for column, name in enumerate(found.by):
        slopes = [(outputs(column, h) - outputs(column, -h)) / (2.0 * h) for h in (2.0 * apart, apart)]
        expected = (4.0 * slopes[1] - slopes[0]) / 3.0
        assert np.max(np.abs(expected)) > 1e-3
        assert np.max(np.abs(table[:, :, column] - expected)) <= tolerance * np.max(np.abs(expected)), name
    hold_adjoints(found, table, 1e-12)
    weights = {name: np.ones_like(array) for name, array in found.outputs.items()}
    np.testing.assert_allclose(found.gradients([weights])[0], table.sum(axis=(0, 1)), rtol=1e-12, atol=1e-11)
    return found


@pytest.mark.parametrize("method", ["rattlie", "rk4_partitioned"])
def test_a_plate_on_a_rod_of_tunable_length(method: str) -> None:
    start = {"q": [0.8, 0.0], "v": [0.0, -1.0]}
    check(hanging(), method, ["mass", "length", "drag", "q.y", "v.y"], start)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rattlie", "rk4_partitioned"])
def test_a_loop_driven_by_formulas_and_by_the_caller(method: str) -> None:
    model = eomgen.build(driven_loop().build(), profile="instant")
    start = model.consistent(model.initial_q, np.array([1.0, 2.0, -1.0, 0.5, 2.0]))
    initial = {"q": start.q, "v": start.v, "z": [0.3]}
    by = ["mass", "length", "gain", "shake", "q.a", "v.c[1]", "inputs.pull"]
    near: dict[str, Any] = {} if method == "rattlie" else {"apart": 1e-5, "tolerance": 1e-8}
    check(driven_loop(), method, by, initial, inputs={"pull": np.linspace(-1.0, 2.0, 13)}, **near)


@pytest.mark.slow
def test_absolute_coordinates_with_an_angle_over_turns() -> None:
    model = eomgen.build(absolute().build(), profile="instant")
    start = {"q": model.initial_q, "v": np.zeros(12)}
    check(absolute(), "rk4_partitioned", ["mass", "length", "damping"], start, steps=8)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rk4", "rattlie"])
def test_trees_on_all_groups_and_internal_states(method: str) -> None:
    check(turning(), method, OF_TURNS, SPUN)
    check(controlled(), method, OF_CONTROL[:-1], {"a": 0.6})


def test_the_dependent_components_of_each_step_are_its_own() -> None:
    """A turn of the plate, in which one coordinate and then the other depends."""
    start = {"q": [0.8, 0.0], "v": [0.0, -9.0]}
    found = check(hanging(), "rk4_partitioned", ["length", "drag"], start, steps=60, tolerance=2e-8)
    used = {tuple(row) for part in found._run.motion.forwards() for row in part.memory}
    assert len(used) > 1


def refusal(model: Model, ask: Any) -> str:
    with pytest.raises((UsageError, NumericalError)) as caught:
        ask(model)
    return str(caught.value)


def test_what_these_steps_have_not() -> None:
    model = eomgen.build(hanging().build(), profile="instant")
    options: dict[str, Any] = {"method": "rattlie"}
    text = refusal(model, lambda one: one.sensitivities(0.1, STEP, settings={"multipliers": 1}, **options))
    assert text == (
        "usage error: settings: multipliers before or after each row belong to two steps, and have no derivatives here;"
        ' try: settings={"multipliers": 0}, for the ones of accelerations'
    )
    text = refusal(model, lambda one: one.sensitivities(0.1, STEP, **options).hessian("final(y[0])"))
    assert text == (
        "usage error: hessian: steps are of rattlie, and second derivatives are not known; try: differences of"
        " gradient(...)"
    )


@pytest.mark.slow
def test_constraints_on_positions_and_on_velocities_alone() -> None:
    """Corrections of positions hold rates that change with the position."""
    gear = "v.c[0] - 0.4 * v.b * (1 + 0.3 * length * q.b)"
    mixed = loop().constraint("gear", "formula", velocity_equation=gear, unit="rad/s")
    model = eomgen.build(mixed.build(), profile="instant")
    start = model.consistent(model.initial_q, np.array([1.0, 2.0, -1.0, 0.5, 2.0]))
    by = ["mass", "length", "damping", "q.a", "v.c[1]"]
    near: dict[str, Any] = {"apart": 1e-5, "tolerance": 1e-8}
    check(mixed, "rk4_partitioned", by, {"q": start.q, "v": start.v}, **near)


@pytest.mark.parametrize("method", ["rk4", "rattlie", "trapezoidal"])
def test_events_that_only_record_change_no_derivatives(method: str) -> None:
    """Calls of the stepper end early when half of the log of events is full."""

    def driven() -> SceneBuilder:
        return controlled().input("push").effort("drive", "a", "push")

    watched = driven()
    for number in range(8):
        watched.event(f"wave{number}", when=f"sin(250*t + {number})", action=("record", "count")[number % 2])
    options: dict[str, Any] = {"by": OF_CONTROL, "method": method, "inputs": {"push": np.linspace(-1.0, 2.0, 25)}}
    found, plain = (
        eomgen.build(builder.build(), profile="instant").sensitivities(24 * STEP, STEP, **options)
        for builder in (watched, driven())
    )
    np.testing.assert_allclose(found.outputs["y"], plain.outputs["y"], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(found.derivatives["y"], plain.derivatives["y"], rtol=1e-11, atol=1e-12)
    assert np.max(np.abs(plain.derivatives["y"])) > 0.1
