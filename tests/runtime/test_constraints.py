"""Constrained models: terms with multipliers, and methods that cannot run them."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.lie import product
from tests.runtime.scenes import absolute, flyer


def test_sizes_and_names_of_rows() -> None:
    model = absolute()
    assert (model.nq, model.nv, len(model.multipliers)) == (21, 18, 8)
    assert model.multipliers[0].startswith("ball") and model.multipliers[-1].startswith("slide")


def test_the_jacobian_is_the_left_trivialised_derivative_of_the_constraints(rng: np.random.Generator) -> None:
    model = absolute()
    q = product.update(model.factors, model.initial_q, rng.normal(scale=0.3, size=model.nv))
    w = rng.normal(size=model.nv)
    small = 1e-6
    ahead, behind = (model.evaluate("constraint", product.update(model.factors, q, s * small * w))["Phi"] for s in (1.0, -1.0))
    (B,) = model.evaluate("constraint_jacobian", q).values()
    assert B.shape == (8, 18)
    np.testing.assert_allclose(B @ w, (ahead - behind) / (2.0 * small), atol=1e-8)
    batch = model.evaluate("constraint", np.stack([q, model.initial_q]))["Phi"]
    assert batch.shape == (2, 8)
    np.testing.assert_allclose(batch[1], 0.0, atol=1e-15)


def test_multipliers_enter_the_residual_by_the_transposed_jacobian(rng: np.random.Generator) -> None:
    model = absolute()
    q, v, a, lam = model.initial_q, *rng.normal(size=(2, model.nv)), rng.normal(size=8)
    (B,) = model.evaluate("constraint_jacobian", q).values()
    free = model.evaluate("residual", q, v, a)["r"]
    held = model.evaluate("residual", q, v, a, multipliers=lam)["r"]
    np.testing.assert_allclose(held - free, B.T @ lam, atol=1e-12)
    np.testing.assert_allclose(free, model.inverse_dynamics(q, v, a), atol=1e-12)
    small = 1e-6
    K, _, _ = model.partials(q, v, a, multipliers=lam)
    w = rng.normal(size=model.nv)
    ahead, behind = (
        model.evaluate("residual", product.update(model.factors, q, s * small * w), v, a, multipliers=lam)["r"]
        for s in (1.0, -1.0)
    )
    np.testing.assert_allclose(K @ w, (ahead - behind) / (2.0 * small), atol=1e-6)


def test_wrong_multipliers_and_missing_velocities_are_named() -> None:
    model = absolute()
    rest = np.zeros(model.nv)
    with pytest.raises(eomgen.UsageError, match=r"multipliers: the shape is \(3,\), \(\.\.\., 8\) is needed"):
        model.partials(model.initial_q, rest, rest, multipliers=[1.0, 2.0, 3.0])
    with pytest.raises(eomgen.UsageError, match="v: the term residual needs velocities"):
        model.evaluate("residual", model.initial_q)
    with pytest.raises(
        eomgen.UsageError, match="a: the term residual needs accelerations, and the model has no forward_dynamics"
    ):
        model.evaluate("residual", model.initial_q, rest)
    np.testing.assert_allclose(flyer().evaluate("residual", flyer().initial_q, flyer().initial_v)["r"], 0.0, atol=1e-12)
