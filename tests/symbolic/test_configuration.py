from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from eomgen.symbolic.calculus.configuration import (
    configuration_jets,
    configuration_seeds,
    pose_jet,
    quaternion_jet,
    tangent_seeds,
)
from eomgen.symbolic.calculus.partials import jacobian_vector
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import ONE, ZERO, Tape

UNIT = np.array([0.5, -0.1, 0.7, 0.5])
UNIT /= np.linalg.norm(UNIT)


def quaternion(vector):
    angle = math.sqrt(sum(entry * entry for entry in vector))
    return np.array([math.cos(angle / 2), *(math.sin(angle / 2) / angle * np.asarray(vector))])


def product(p, q):
    p, q = np.asarray(p), np.asarray(q)
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


def test_pose_tangent_moves_the_position_in_body_axes():
    tape = Tape()
    q = [tape.input("q", k) for k in range(7)]
    seeds = tangent_seeds(tape, "SE3", q, first=6)
    point = np.array([*quaternion([0.4, 0.2, -0.9]), 1.0, 2.0, 3.0])
    body = np.array([0.3, -0.5, 0.8])
    moved = (
        evaluate(tape, [seeds[ref].get(9 + d, ZERO) for ref in q[4:] for d in range(3)], {"q": point}).reshape(3, 3)
        @ body
    )
    turned = product(product(point[:4], np.array([0.0, *body])), point[:4] * [1, -1, -1, -1])
    assert moved == pytest.approx(turned[1:], abs=1e-15)
    assert all(set(seeds[ref]) == {6, 7, 8} for ref in q[:4])


def test_second_left_derivatives_differ_by_the_lie_bracket():
    tape = Tape()
    q = [tape.input("q", k) for k in range(4)]
    seeds = tangent_seeds(tape, "SO3", q)

    def along(d):
        return {ref: tangent.get(d, ZERO) for ref, tangent in seeds.items()}

    output = tape.add(tape.mul(q[0], q[1]), tape.call(Op.SIN, tape.mul(q[2], q[3])))
    [xy] = jacobian_vector(tape, jacobian_vector(tape, [output], along(0)), along(1))
    [yx] = jacobian_vector(tape, jacobian_vector(tape, [output], along(1)), along(0))
    [z] = jacobian_vector(tape, [output], along(2))
    a, b, c = evaluate(tape, [xy, yx, z], {"q": quaternion([0.3, 0.8, -0.4])})
    assert b - a == pytest.approx(c, rel=1e-13)  # X_0 X_1 - X_1 X_0 = X_[0,1] = X_2; xy means X_1 applied last
    assert abs(c) > 0.1


def test_configuration_seeds_number_directions_like_velocities():
    tape = Tape()
    seeds = configuration_seeds(tape, [("R", 0, 1, 0), ("SO3", 1, 4, 1), ("R", 5, 2, 4)])
    assert seeds[tape.input("q", 0)] == {0: ONE}
    assert set(seeds[tape.input("q", 2)]) == {1, 2, 3}
    assert seeds[tape.input("q", 6)] == {5: ONE}


def test_an_unknown_group_is_refused():
    tape = Tape()
    message = r"no tangent for group 'SO3' with 3 numbers; known: R \(any\), SO3 \(4\), SE3 \(7\)"
    with pytest.raises(ValueError, match=message):
        tangent_seeds(tape, "SO3", [tape.input("q", k) for k in range(3)])
    with pytest.raises(ValueError, match="group 'SU2' with 1"):
        tangent_seeds(tape, "SU2", [tape.input("q")])


def test_pose_and_quaternion_jets_follow_the_differential_equation():
    tape = Tape()
    pose = [tape.input("q", k) for k in range(7)]
    paths = np.array(
        [[0.8, 0.3, -0.2], [-1.5, 0.1, 0.6], [0.4, -0.9, 0.2], [1.0, 0.5, 0.1], [-0.3, 0.2, 0.7], [0.6, -0.4, 0.3]]
    )
    found = pose_jet(tape, pose, [[tape.constant(entry) for entry in path] for path in paths], 14)
    point = np.array([*UNIT, 1.0, 2.0, 3.0])
    coefficients = np.array([evaluate(tape, component, {"q": point}) for component in found])

    def rate(t, state):
        v = [sum(mpmath.mpf(c) * t**k for k, c in enumerate(path)) for path in paths]
        turn = product(np.array(state[:4]), np.array([0, *v[:3]], dtype=object)) / 2
        conjugate = np.array(state[:4]) * np.array([1, -1, -1, -1])
        return [*turn, *product(product(np.array(state[:4]), np.array([0, *v[3:]], dtype=object)), conjugate)[1:]]

    t = 0.1
    solution = mpmath.odefun(rate, 0, [mpmath.mpf(entry) for entry in point])(t)
    series = coefficients @ t ** np.arange(15)
    assert series == pytest.approx([float(entry) for entry in solution], abs=3e-15)


def test_configuration_jets_of_a_product_of_groups():
    tape = Tape()
    velocity = [[tape.input("v", k), tape.input("a", k)] for k in range(5)]
    found = configuration_jets(tape, [("R", 0, 1, 0), ("SO3", 1, 4, 1), ("R", 5, 1, 4)], velocity, 2)
    half = tape.constant(0.5)
    assert found[tape.input("q", 5)] == [tape.input("q", 5), tape.input("v", 4), tape.mul(half, tape.input("a", 4))]
    assert [found[tape.input("q", k)] for k in range(1, 5)] == quaternion_jet(
        tape, [tape.input("q", k) for k in range(1, 5)], velocity[1:4], 2
    )
    pose = configuration_jets(tape, [("SE3", 0, 7, 0)], [*velocity, [tape.input("v", 5)]], 2)
    assert len(pose) == 7
    with pytest.raises(ValueError, match="no jet for group 'SU2'; known: R, SO3, SE3"):
        configuration_jets(tape, [("SU2", 0, 4, 0)], velocity, 2)
