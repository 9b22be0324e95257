"""The laws of the groups, and T against its power series, the matrix exponential and the complex step."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from eomgen.lie import numeric
from eomgen.lie.groups import SE3, SO3, R3xSO3, group_named, real_space

GROUPS = [real_space(3), SO3, SE3, R3xSO3]
ANGLES = [0.0, 1e-12, 1e-6, 1e-3, 0.1, 0.45, 0.999, 1.001, 2.5, np.pi - 1e-9, np.pi, 3.3]


@pytest.fixture(params=GROUPS, ids=lambda group: group.name)
def group(request):
    return request.param


def increment(group, rng, angle, shift=1.0):
    """A random increment with a rotation of the given angle."""
    theta = rng.normal(size=group.v_size)
    if group.quaternion:
        theta[:3] *= angle / np.linalg.norm(theta[:3])
        theta[3:] *= shift
    return theta


def element(group, rng):
    return numeric.exp(group, increment(group, rng, rng.uniform(0.3, 3.0)))


def skew(x):
    return np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])


def homogeneous(group, theta):
    """The Lie algebra element as a matrix, from which the group follows by the matrix exponential."""
    A = np.zeros((4, 4))
    A[:3, :3] = skew(theta[:3])
    if group is SE3:
        A[:3, 3] = theta[3:]
    return A


def test_group_laws(group, rng):
    a, b, c = (element(group, rng) for _ in range(3))
    neutral = np.array(group.identity)
    left = numeric.compose(group, numeric.compose(group, a, b), c)
    assert left == pytest.approx(numeric.compose(group, a, numeric.compose(group, b, c)), abs=2e-15)
    assert numeric.compose(group, a, neutral) == pytest.approx(a, abs=0)
    assert numeric.compose(group, neutral, a) == pytest.approx(a, abs=0)
    assert numeric.compose(group, a, numeric.inverse(group, a)) == pytest.approx(neutral, abs=1e-15)


@pytest.mark.parametrize("angle", ANGLES)
def test_exp_is_the_matrix_exponential(angle, rng):
    for group in (SO3, SE3):
        theta = increment(group, rng, angle)
        q, matrix = numeric.exp(group, theta), expm(homogeneous(group, theta))
        assert numeric.adjoint(SO3, q[:4]) == pytest.approx(matrix[:3, :3], abs=1e-14)  # expm itself loses a few digits
        if group is SE3:
            assert q[4:] == pytest.approx(matrix[:3, 3], abs=2e-14)


@pytest.mark.parametrize("angle", [angle for angle in ANGLES if angle < np.pi])
def test_log_undoes_exp(group, angle, rng):
    theta = increment(group, rng, angle)
    q = numeric.exp(group, theta)
    assert numeric.log(group, q) == pytest.approx(theta, abs=2e-15 * (1 + angle))
    if group.quaternion:
        flipped = np.concatenate([-q[:4], q[4:]])
        assert numeric.log(group, flipped) == pytest.approx(theta, abs=2e-15 * (1 + angle))


def test_log_of_a_half_turn_has_angle_pi(rng):
    theta = increment(SO3, rng, np.pi)
    assert np.linalg.norm(numeric.log(SO3, numeric.exp(SO3, theta))) == pytest.approx(np.pi, abs=1e-15)


def test_small_rotations_keep_their_relative_accuracy(rng):
    for angle in (1e-300, 1e-150, 1e-12, 1e-5):
        theta = increment(SO3, rng, angle)
        q = numeric.exp(SO3, theta)
        assert q[1:] == pytest.approx(theta / 2, rel=1e-10)
        assert numeric.log(SO3, q) == pytest.approx(theta, rel=1e-15)


def test_quaternions_are_not_flipped():
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for _ in range(4):
        q = numeric.update(SO3, q, np.array([0.0, 0.0, np.pi / 2]))
    assert q == pytest.approx([-1.0, 0, 0, 0], abs=1e-15)
    assert numeric.exp(SO3, np.array([0.0, 4.0, 0.0]))[0] == pytest.approx(np.cos(2.0), abs=1e-16)


def test_conjugation_is_adjoint(group, rng):
    q, theta = element(group, rng), increment(group, rng, 0.7)
    conjugated = numeric.compose(group, numeric.compose(group, q, numeric.exp(group, theta)), numeric.inverse(group, q))
    assert numeric.exp(group, numeric.adjoint(group, q) @ theta) == pytest.approx(conjugated, abs=1e-14)


def test_adjoint_of_exp_is_exp_of_bracket(group, rng):
    theta = increment(group, rng, 1.3)
    expected = expm(numeric.bracket_matrix(group, theta))
    assert numeric.adjoint(group, numeric.exp(group, theta)) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("angle", ANGLES)
def test_tangent_is_its_power_series(group, angle, rng):
    theta = increment(group, rng, angle)
    bracket = numeric.bracket_matrix(group, theta)
    term = total = np.eye(group.v_size)
    for i in range(1, 60):
        term = -term @ bracket / (i + 1)
        total = total + term
    assert numeric.tangent(group, theta) == pytest.approx(total, abs=4e-15)


@pytest.mark.parametrize("angle", ANGLES)
def test_tangent_and_its_inverse(group, angle, rng):
    theta = increment(group, rng, angle)
    product = numeric.tangent(group, theta) @ numeric.tangent_inverse(group, theta)
    assert product == pytest.approx(np.eye(group.v_size), abs=1e-14)


def test_a_batch_gives_what_its_members_give(group, rng):
    theta = np.array([[increment(group, rng, angle) for angle in ANGLES[k : k + 3]] for k in range(4)])
    for function in (numeric.exp, numeric.tangent, numeric.tangent_inverse, numeric.bracket_matrix):
        batch = function(group, theta)
        for index in np.ndindex(4, 3):
            assert np.array_equal(batch[index], function(group, theta[index]))


def test_groups_by_name():
    assert group_named("SE3") is SE3
    assert group_named("R", 4).q_size == 4
    with pytest.raises(KeyError, match="E2"):
        group_named("E2")


@pytest.mark.slow
def test_running_needs_no_sympy():
    # the road from a cached build to a running model
    modules = "eomgen.lie.product, tests.oracles.lie_on_tape, tests.oracles.stepper, eomgen.integrators.stepper_data"
    script = f"import sys, {modules}; sys.exit('sympy' in sys.modules)"
    finished = subprocess.run([sys.executable, "-c", script], check=False, cwd=Path(__file__).parents[2])
    assert finished.returncode == 0
