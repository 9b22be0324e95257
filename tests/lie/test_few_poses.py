"""Few poses by products with constant matrices, against the formulas of the groups, and these along complex steps."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.lie import numeric
from eomgen.lie.few_poses import differences, slopes, update_one, updated
from eomgen.lie.groups import SE3, group_named
from eomgen.lie.product import Factor, update
from tests.oracles.evaluation import Array

_TINY = 1e-30


@pytest.fixture(params=[0.0, 1e-9, 1e-3, 0.3, 1.0])
def increments(request: pytest.FixtureRequest, rng: np.random.Generator) -> Array:
    result: Array = request.param * rng.normal(size=(9, 6))
    return result


@pytest.fixture
def poses(rng: np.random.Generator) -> Array:
    return numeric.exp(SE3, rng.normal(size=(9, 6)))


@pytest.mark.parametrize("longer", [1.0, 4.0])  # beyond the angle to which the series goes, too
def test_updates_are_those_of_the_group(poses: Array, increments: Array, longer: float) -> None:
    found = updated(poses, longer * increments)
    np.testing.assert_allclose(found, numeric.update(SE3, poses, longer * increments), rtol=0.0, atol=2e-14)


def test_one_configuration_of_several_groups_moves_as_configurations_do(rng: np.random.Generator) -> None:
    sizes = {"SE3": (7, 6), "R": (1, 1), "SO3": (4, 3)}
    factors, q_start, v_start = [], 0, 0
    for name in ("SE3", "R", "SO3", "SE3", "R"):
        factors.append(Factor(name, f"{name}_{q_start}", q_start, sizes[name][0], v_start, sizes[name][1]))
        q_start, v_start = q_start + sizes[name][0], v_start + sizes[name][1]
    theta = rng.normal(size=v_start)
    q = np.concatenate([group_named(factor.group).identity for factor in factors])
    first = update(factors, q, rng.normal(size=v_start))
    np.testing.assert_allclose(update_one(factors, first, theta), update(factors, first, theta), rtol=0.0, atol=1e-14)


def test_differences_are_logarithms_whatever_the_sign_of_the_quaternion(poses: Array, increments: Array) -> None:
    moved = numeric.update(SE3, poses, increments)
    expected = numeric.log(SE3, numeric.compose(SE3, numeric.inverse(SE3, poses), moved))
    moved[::2, :4] *= -1.0
    np.testing.assert_allclose(differences(poses, moved), expected, rtol=0.0, atol=1e-14)


def test_slopes_are_those_of_the_inverse_tangent(increments: Array) -> None:
    d = numeric.log(SE3, numeric.exp(SE3, increments))
    complex_d = d.astype(complex) + 1j * _TINY * np.eye(6)[:, np.newaxis]
    after = numeric.tangent_inverse(SE3, complex_d)
    expected = np.concatenate([numeric.bracket_matrix(SE3, complex_d) - after, after], axis=-1)
    first, second = slopes(d)
    np.testing.assert_allclose(first, expected[0].real, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(second, expected.imag / _TINY, rtol=0.0, atol=1e-14)
