"""Second derivatives of runs of time-discontinuous Galerkin methods: against differenced adjoints, Taylor series."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.derivatives import motion
from eomgen.products.derivatives.motion import ReplayedRun
from tests.derivatives.test_following_starts import resting_controller, resting_tree
from tests.derivatives.test_galerkin_sensitivities import driven
from tests.derivatives.test_second_order_sensitivities import OF_TREE, SWUNG, check, moved
from tests.derivatives.test_sensitivities import STEP, bending, built, controlled, tree, turning
from tests.models.cache import shared_cache

__all__ = ["shared_cache"]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["tdg1", "tdg1_star", "tdg2", "tdg2s", "tdg3"])
def test_a_tree_by_its_parameters_and_its_initial_state(method: str) -> None:
    check(tree(), method, OF_TREE, SWUNG, ["final(angle)", "integral(two[1])", "mean(two[0])", "sum(angle)"])


@pytest.mark.slow
def test_bodies_that_turn_in_space_on_a_base_that_moves_by_a_parameter() -> None:
    by = ["length", "shake", "q.a[0]", "q.a[1]", "q.f[1]", "q.f[4]", "v.a[2]"]
    check(turning(), "tdg2", by, {"v": [1, 2, -1, 0.5, 2, 0.1, 0.3, 0.2, 0.1]}, ["final(y[0])", "mean(y[2])"])


@pytest.mark.slow
def test_a_controller_with_internal_states() -> None:
    by = ["mass", "length", "lag", "gain", "q.a", "v.a", "z.filtered"]
    check(controlled(), "tdg2", by, {"a": 0.6}, ["final(y[0])", "mean(y[1])"])


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.001, 0.01])
def test_a_beam_at_steps_that_resolve_it_and_that_do_not(step: float) -> None:
    by, initial = ["bend", "tip", "speed", "q.axle"], {"axle": {"velocity": 1.0}}
    check(bending(), "tdg1", by, initial, ["final(y[0])", "mean(y[1])"], step)


@pytest.mark.slow
@pytest.mark.parametrize("builder", [resting_tree, resting_controller])
def test_a_start_at_rest_moves_with_parameters(builder: Any) -> None:
    """Against differences of gradients, each of which finds rest again."""
    _, model = built(builder())
    by = ["mass", "stiffness", "length"] if builder is resting_tree else ["mass", "lag", "gain", "wanted"]
    of = "final(angle)" if builder is resting_tree else "mean(y[1])"
    found = model.sensitivities(20 * STEP, STEP, by=by, method="tdg2")
    values, columns = dict(model.parameters), []
    for name in by:

        def slope(size: float, name: str = name) -> Any:
            ends = [
                model.sensitivities(
                    20 * STEP, STEP, by=by, method="tdg2", parameters={name: values[name] + sign * size}
                ).gradients([of])[0]
                for sign in (1.0, -1.0)
            ]
            return (ends[0] - ends[1]) / (2.0 * size)

        columns.append((4.0 * slope(1e-3) - slope(2e-3)) / 3.0)
    H = found.hessian(of)
    assert np.max(np.abs(H)) > 0.0
    np.testing.assert_allclose(H, np.stack(columns, axis=1), atol=5e-9 * np.max(np.abs(H)))
    raw = found.hessian_products(of, np.eye(len(by)))
    assert np.max(np.abs(raw - raw.T)) <= 1e-9 * np.max(np.abs(H))  # rest is found to 1e-11 of the forces


@pytest.mark.slow
def test_samples_of_inputs_are_directions() -> None:
    """An input of a formula with a parameter beside one by rows, against differences of gradients."""
    scene = driven(None).parameter("push", 0.8, tunable=True).input("other", formula="push**2*sin(3*t)")
    model = eomgen.build(scene.effort("pushed", "a", "other*v.a*stiffness").build(), profile="quick")
    rows, by = 2.0 + 30.0 * STEP * np.arange(13), ["mass", "push", "q.a", "inputs.stiffness[4]", "inputs.stiffness"]
    options: dict[str, Any] = {"by": by, "method": "tdg2"}
    found = model.sensitivities(12 * STEP, STEP, inputs={"stiffness": rows}, **options)
    H = found.hessian("integral(y)")
    assert np.all(np.any(H != 0.0, axis=0))

    def slope(size: float, row: Any) -> Any:
        given = {"stiffness": rows + size * row}
        return model.sensitivities(12 * STEP, STEP, inputs=given, **options).gradients(["integral(y)"])[0]

    one = np.zeros(13)
    one[4] = 1.0
    for column, row in ((3, one), (4, np.ones(13))):
        four, two = ((slope(size, row) - slope(-size, row)) / (2.0 * size) for size in (0.02, 0.01))
        np.testing.assert_allclose(H[:, column], (4.0 * two - four) / 3.0, atol=5e-9 * np.max(np.abs(H[:, column])))

    def by_push(size: float) -> Any:
        given = {"parameters": {"push": 0.8 + size}, "inputs": {"stiffness": rows}}
        return model.sensitivities(12 * STEP, STEP, **given, **options).gradients(["integral(y)"])[0]

    four, two = ((by_push(size) - by_push(-size)) / (2.0 * size) for size in (0.02, 0.01))
    np.testing.assert_allclose(H[:, 1], (4.0 * two - four) / 3.0, atol=5e-9 * np.max(np.abs(H[:, 1])))


@pytest.mark.slow
def test_what_is_left_of_a_taylor_series_is_of_third_order() -> None:
    _, model = built(tree())
    found = model.sensitivities(1.0, STEP, by=OF_TREE, initial=SWUNG, method="tdg2")
    d = np.array([0.5, -0.8, 0.3, 0.2, 0.4, -0.6])
    value, slope = found.outputs["angle"][-1], found.gradients(["final(angle)"])[0] @ d
    curvature = d @ found.hessian_products("final(angle)", d)
    sizes = 2.0 ** -np.arange(4, 9)
    left = []
    for size in sizes:
        run = model.simulate(1.0, STEP, method="tdg2", error_estimate=False, **moved(model, found, size * d))
        left.append(abs(run.outputs["angle"][-1] - value - size * slope - 0.5 * size**2 * curvature))
    assert np.polyfit(np.log(sizes), np.log(left), 1)[0] == pytest.approx(3.0, abs=0.1)


@pytest.mark.slow
def test_long_runs_are_stepped_again_from_checkpoints(monkeypatch: pytest.MonkeyPatch) -> None:
    _, model = built(tree())
    options: dict[str, Any] = {"by": ["mass", "q.a"], "initial": {"a": 0.5}, "method": "tdg1"}
    of = ["integral(two[1])", "final(angle)"]
    kept = model.sensitivities(2.0, STEP, **options)
    monkeypatch.setattr(ReplayedRun.__init__, "__defaults__", (0,))
    monkeypatch.setattr(motion, "LONGEST", 64)
    again = model.sensitivities(2.0, STEP, **options)
    gradients, hessians = again.expansions(of)
    assert again._run.motion.parts == 4
    np.testing.assert_allclose(hessians, kept.hessians(of), rtol=1e-12)
    np.testing.assert_allclose(gradients, kept.gradients(of), rtol=1e-12)
