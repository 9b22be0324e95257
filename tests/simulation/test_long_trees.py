"""Trees too long for a dense iteration matrix: generalized-alpha by the extended system, against Runge-Kutta."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import eomgen
from tests.oracles.robots import planar_chain

LINKS = 42


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    scene = planar_chain(LINKS)
    joints = tuple(
        replace(joint, initial_position=(0.02 * k,), initial_velocity=(0.1 * (-1) ** k,))
        for k, joint in enumerate(scene.joints)
    )
    chain = replace(scene, name="long_chain", content=b"planar chain of 42 rods", joints=joints)
    return eomgen.build(chain, terms=TERMS, profile="quick")


TERMS = ["residual", "iteration", "forward_dynamics"]


def slopes(model: eomgen.Model, coarsest: float, fine: float) -> np.ndarray:
    """Return the orders of generalized-alpha against Runge-Kutta over 0.04 s."""
    exact = model.simulate(0.04, fine, method="rk4")
    steps = (coarsest, coarsest / 2, coarsest / 4)
    errors = [np.abs(model.simulate(0.04, step).q[-1] - exact.q[-1]).max() for step in steps]
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.mark.slow
def test_a_long_chain_is_stepped_without_its_dense_matrix(model: eomgen.Model) -> None:
    assert not {"mass", "partials"} & set(model.terms)
    sizes = model.library.layout["method"]
    assert sizes["solver"]["elimination"]["size"] > 3 * LINKS
    # linear in the links; whole it would be 42^3 / 3 = 24 696
    assert sizes["solver"]["elimination"]["operations"] < 300 * LINKS
    solution = model.simulate(0.02, 1e-3)
    assert solution.success, solution.message
    assert solution.stats["newton_iterations"] <= 4 * solution.stats["steps"]


@pytest.mark.slow
def test_it_converges_to_runge_kutta_with_order_two(model: eomgen.Model) -> None:
    assert np.all(np.abs(slopes(model, 2e-3, 1e-4) - 2.0) <= 0.1)
