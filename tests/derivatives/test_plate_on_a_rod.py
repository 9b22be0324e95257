"""First and second derivatives of runs of generalized-alpha with a loop, whose start is on the constraint, off it,
or at rest: against differences of runs and of gradients."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.pipeline.model import Model
from eomgen.products.derivatives.alpha_run import AlphaRun
from eomgen.products.derivatives.run_sensitivities import Sensitivities
from eomgen.products.derivatives.start import position_weights
from tests.derivatives.checks import hold_adjoints, moved, sixth_order, tunable
from tests.derivatives.test_sensitivities import STEP, TO_ROUNDING
from tests.derivatives.test_transition_sensitivities import hanging

STEPS = 5


@cache
def plate() -> Model:
    return eomgen.build(hanging().build(), profile="instant")


@cache
def resting() -> Model:
    """Return the plate with a spring and an input, which starts at rest and is then shaken."""
    builder = hanging().parameter("stiffness", 9.0, tunable=True).input("push")
    builder.effort("spring", "x", "-stiffness*(q.x - 0.5) + push*(1 + q.y) + 2*sin(7*t)")
    return eomgen.build(builder.simulation(start="equilibrium").build(), profile="instant")


def run_of(model: Model, **given: Any) -> Sensitivities:
    return model.sensitivities(STEPS * STEP, STEP, settings=TO_ROUNDING, method="generalized_alpha", **given)


def hold(found: Sensitivities, again: Callable[[Array], Sensitivities], sizes: Array, error: float) -> None:
    """Hold tangents, gradients and products with the Hessian along a direction to differences of runs along it, and
    adjoints to tangents; `again` makes a run that is changed along the directions."""
    d, of, run = sizes * np.random.default_rng(1).uniform(0.5, 1.5, len(sizes)), "sum(y[1])", cache(again)
    expected = sixth_order(lambda h: run(tuple(h * d)).outputs["y"], 1.0)
    assert np.max(np.abs(found.derivatives["y"] @ d - expected)) < error * np.max(np.abs(expected))
    hold_adjoints(found, found.derivatives["y"], 1e-11)
    if isinstance(found._run, AlphaRun) and not found._run.beginning.moved_far:
        bent = sixth_order(lambda h: run(tuple(h * d)).gradients([of])[0], 1.0)
        hessian = found.hessian(of)
        assert np.max(np.abs(hessian @ d - bent)) < error * np.max(np.abs(bent))
        np.testing.assert_array_equal(hessian, hessian.T)
        assert np.max(np.abs(found.hessian_products(of, d) - hessian @ d)) < 1e-10 * np.max(np.abs(bent))


def test_a_start_on_the_rod_has_first_and_second_derivatives() -> None:
    """A change of the length or of a coordinate moves the start onto the rod again."""
    model, by = plate(), ["mass", "length", "drag", "q.y", "v.x"]
    found = run_of(model, by=by, initial={"q": np.array([0.48, -0.64]), "v": np.array([0.8, 0.6])})
    hold(found, lambda change: run_of(model, by=by, **moved(model, found, np.array(change))), np.full(5, 1e-2), 1e-8)


def test_a_start_off_the_rod_moves_as_it_is_moved_onto_it() -> None:
    model, q, v = plate(), np.array([0.6, -0.7]), np.array([1.0, 0.2])
    by = ["mass", "length", "q.x", "q.y", "v.y"]
    found = run_of(model, by=by, initial={"q": q, "v": v})

    def again(change: Array) -> Sensitivities:
        mass, length, dx, dy, dv = change
        parameters = {"mass": 1.3 + mass, "length": 0.8 + length}
        return run_of(model, by=by, parameters=parameters, initial={"q": np.add(q, [dx, dy]), "v": np.add(v, [0, dv])})

    hold(found, again, np.full(5, 1e-2), 1e-8)
    with pytest.raises(
        eomgen.UsageError, match="the initial state is moved onto the constraints, without known second"
    ):
        found.hessian("final(y[0])")


def test_rest_moves_with_parameters_and_the_first_value_of_an_input() -> None:
    model, push = resting(), 0.3 + 0.1 * np.arange(STEPS + 1.0)
    by = ["mass", "length", "stiffness", "inputs.push[0]", "inputs.push[2]"]
    found = run_of(model, by=by, inputs={"push": push})

    def again(change: Array) -> Sensitivities:
        parameters = {"mass": 1.3 + change[0], "length": 0.8 + change[1], "stiffness": 9.0 + change[2]}
        inputs = push + np.array([change[3], 0.0, change[4], 0.0, 0.0, 0.0])
        return run_of(model, by=by, parameters=parameters, inputs={"push": inputs})

    hold(found, again, np.array([1e-2, 1e-2, 0.1, 1e-2, 1e-2]), 1e-6)
    assert np.max(np.abs(found._run.asked.dq[:, :4])) > 1e-2 and not np.any(found._run.asked.dq[:, 4])
    by_rows, of = found.input_gradient("sum(y[1])")["push"], found.gradients(["sum(y[1])"])[0]
    np.testing.assert_allclose(by_rows[[0, 2]], of[3:], rtol=1e-10)


@pytest.mark.slow
def test_rest_of_a_turned_body_has_first_and_second_derivatives() -> None:
    """A ball joint, held by a spring from aside; increments of rotations do not commute."""
    builder = tunable("resting_ball", mass=1.3, reach=0.3)
    builder.body("bob", "mass", center_of_mass=[0.1, "reach/5", -0.4], inertia=[0.1, 0.12, 0.05])
    builder.joint("ball", "spherical", "base", "bob").point("hook", "base", [0.9, "reach", -0.1])
    builder.point("eye", "bob", [0.2, 0.1, -0.5]).spring("rope", "hook", "eye", stiffness=20, length="reach")
    builder.effort("push", "ball", "3*sin(9*t)", index=1).output("y", formula=["v.ball[0]", "v.ball[1]", "v.ball[2]"])
    model = eomgen.build(builder.simulation(start="equilibrium").build(), profile="instant")
    found = run_of(model, by=["mass", "reach"])
    assert np.max(np.abs(found._run.asked.dq[:, 1])) > 0.1  # rest turns with the parameters

    def again(change: Array) -> Sensitivities:
        return run_of(model, by=found.by, parameters={"mass": 1.3 + change[0], "reach": 0.3 + change[1]})

    hold(found, again, np.full(2, 1e-2), 1e-6)


def test_weights_of_positions_are_bounded_by_the_heaviest_part() -> None:
    """Rotations count by the radius of gyration of all parts."""
    least, angular = np.sqrt(np.finfo(float).eps), np.array([True, False, False])
    M = np.array([np.diag([4.0, 1.0, 3.0]), np.diag([0.0, 1e-30, 2.0]), np.diag([1e-30, 9.0, 0.0])])
    expected = [[1 / 4.0, 1.0, 1 / 3.0], [1 / (2.0 * least), 1 / (2.0 * least), 0.5], [0.0, 1 / 9.0, 1 / (9.0 * least)]]
    found = position_weights(M, angular)
    np.testing.assert_allclose(found[:2], expected[:2], rtol=1e-12)
    gyration = 1e-30 / 9.0  # squared
    np.testing.assert_allclose(found[2], [1 / max(1e-30, 9.0 * least * gyration), *expected[2][1:]], rtol=1e-12)
