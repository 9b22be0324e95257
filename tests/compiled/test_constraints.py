"""Constrained models: terms with multipliers, and methods that cannot run them."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from tests.models.scenes import absolute, flyer


@pytest.mark.slow
def test_sizes_and_names_of_rows() -> None:
    model = absolute()
    assert (model.nq, model.nv, len(model.multipliers)) == (21, 18, 8)
    assert model.multipliers[0].startswith("ball") and model.multipliers[-1].startswith("slide")


def test_wrong_multipliers_and_missing_velocities_are_named() -> None:
    model = absolute()
    rest = np.zeros(model.nv)
    with pytest.raises(eomgen.UsageError, match=r"multipliers: the shape is \(3,\), \(\.\.\., 8\) is needed"):
        model.partials(model.initial_q, rest, rest, multipliers=[1.0, 2.0, 3.0])
    with pytest.raises(eomgen.UsageError, match="v: the term residual needs velocities"):
        model.evaluate("residual", model.initial_q)
    np.testing.assert_allclose(flyer().evaluate("residual", flyer().initial_q, flyer().initial_v)["r"], 0.0, atol=1e-12)


def test_accelerations_meet_the_constraints_and_the_equations(rng: np.random.Generator) -> None:
    model = absolute()
    v = model.consistent(model.initial_q, rng.normal(size=model.nv)).v
    vdot, multipliers = model.constrained_dynamics(model.initial_q, v)
    residual = model.evaluate("residual", model.initial_q, v, vdot, multipliers=multipliers)["r"]
    np.testing.assert_allclose(residual, 0.0, atol=1e-10)
    (B,) = model.evaluate("constraint_jacobian", model.initial_q).values()
    (g,) = model.evaluate("constraint_bias", model.initial_q, v).values()
    np.testing.assert_allclose(B @ vdot + g, 0.0, atol=1e-9)
    np.testing.assert_array_equal(model.forward_dynamics(model.initial_q, v), vdot)
    batch = model.constrained_dynamics(model.initial_q, np.stack([v, 0.5 * v]))[0]
    np.testing.assert_allclose(batch[0], vdot, rtol=1e-12, atol=1e-12)


@pytest.mark.slow
def test_a_run_in_absolute_coordinates_is_the_run_in_joint_coordinates() -> None:
    free, held = flyer(), absolute()
    expected, found = (model.simulate(0.2, 1e-3, method="generalized_alpha") for model in (free, held))
    assert found.success, found.message
    for body in (body.name for body in free.scene.bodies):
        ends = [
            model.pose(body, solution.q[-1], solution.t[-1]) for model, solution in ((free, expected), (held, found))
        ]
        np.testing.assert_allclose(ends[1][4:], ends[0][4:], atol=2e-5)  # both have errors of order step^2
    assert found.multipliers.shape == (len(found.t), 8)
    assert found.stats["max_constraint"] <= 1e-12 and found.stats["max_constraint_velocity"] <= 1e-9


@pytest.mark.slow
def test_a_model_of_few_terms_runs_by_its_own_method_and_by_others() -> None:
    model = eomgen.build(absolute().scene, ["poses"], profile="quick")
    for method in ("generalized_alpha", "rk4_partitioned"):
        run = model.simulate(0.01, 1e-3, method=method)
        assert run.success, run.message
