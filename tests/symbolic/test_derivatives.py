from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from random_tapes import build, complex_step, points, programs

from eomgen.symbolic.derivatives import (
    configuration_seeds,
    forward_partials,
    gradient,
    jacobian_vector,
    second_directional,
    tangent_seeds,
    weighted_gradient,
)
from eomgen.symbolic.evaluate import evaluate, evaluate_mpmath
from eomgen.symbolic.tape import ONE, UNARY, ZERO, InputSymbol, Op, Tape

BINARY = (Op.ADD, Op.SUB, Op.MUL, Op.DIV, Op.POW, Op.ATAN2, Op.MIN, Op.MAX, Op.LT, Op.LE)


def record(tape, op, x, y):
    if op in UNARY:
        return tape.call(op, x)
    special = {Op.ADD: tape.add, Op.SUB: tape.sub, Op.MUL: tape.mul, Op.DIV: tape.div}
    return special[op](x, y) if op in special else tape.call(op, x, y)


def jacobian(tape, outputs, symbols):
    seeds = {ref: {k: ONE} for k, ref in enumerate(symbols)}
    return [[partial.get(k, ZERO) for k in range(len(symbols))] for partial in forward_partials(tape, outputs, seeds)]


@pytest.mark.parametrize("op", [*sorted(UNARY), *BINARY])
@pytest.mark.parametrize("point", [(0.37, 0.81), (0.91, 0.22)])
def test_every_operation_against_complex_step_and_mpmath(op, point):
    tape = Tape()
    symbols = [tape.input("x", 0), tape.input("x", 1)]
    output = record(tape, op, *symbols)
    partials = jacobian(tape, [output], symbols)[0]
    value = evaluate(tape, partials, {"x": point})
    assert value == pytest.approx(complex_step(tape, [output], {"x": point}, "x")[0], rel=1e-14, abs=1e-300)
    with mpmath.workdps(50):
        for k, derivative in enumerate(evaluate_mpmath(tape, partials, {"x": point})):
            order = (1, 0) if k == 0 else (0, 1)
            reference = mpmath.diff(lambda x, y: evaluate_mpmath(tape, [output], {"x": [x, y]})[0], point, order)
            assert abs(derivative - reference) < mpmath.mpf(10) ** -30
    assert gradient(tape, output, symbols) == partials or evaluate(
        tape, gradient(tape, output, symbols), {"x": point}
    ) == pytest.approx(value, rel=1e-14)


@settings(max_examples=120, deadline=None)
@given(programs, points)
def test_forward_reverse_and_complex_step_agree_on_random_tapes(program, point):
    tape, symbols, outputs = build(program)
    forward = jacobian(tape, outputs, symbols)
    reverse = [gradient(tape, output, symbols) for output in outputs]
    expected = complex_step(tape, outputs, {"x": point}, "x")
    scale = 1e-11 * (1.0 + np.abs(expected).max())
    for rows in (forward, reverse):
        assert np.abs([evaluate(tape, row, {"x": point}) for row in rows] - expected).max() <= scale


@settings(max_examples=60, deadline=None)
@given(programs, points)
def test_forward_over_forward_is_the_complex_step_of_the_first_derivative_and_symmetric(program, point):
    tape, symbols, outputs = build(program)
    gradients = gradient(tape, outputs[-1], symbols)
    expected = complex_step(tape, gradients, {"x": point}, "x")
    hessian = [[second_directional(tape, outputs[-1:], {x: ONE}, {y: ONE})[0] for y in symbols] for x in symbols]
    value = np.array([evaluate(tape, row, {"x": point}) for row in hessian])
    tolerance = 1e-9 * (1.0 + np.abs(expected).max())
    assert np.abs(value - expected).max() <= tolerance
    assert np.abs(value - value.T).max() <= tolerance


def test_partials_are_sparse():
    tape = Tape()
    x = [tape.input("x", k) for k in range(4)]
    outputs = [tape.mul(x[0], x[1]), tape.call(Op.SIN, x[3]), x[2], tape.constant(3.0)]
    partials = forward_partials(tape, outputs, {InputSymbol("x", k): {10 + k: ONE} for k in range(3)})
    assert partials == [{10: x[1], 11: x[0]}, {}, {12: ONE}, {}]


def test_a_seeded_node_inside_is_independent_and_its_sign_counts():
    tape = Tape()
    x = tape.input("x")
    inner = tape.call(Op.SIN, x)
    output = tape.mul(inner, x)
    assert jacobian_vector(tape, [output], {inner: ONE}) == [x]
    assert jacobian_vector(tape, [output], {-inner: ONE}) == [-x]
    assert gradient(tape, -output, [inner, -inner]) == [-x, x]


def test_choices_where_functions_are_not_smooth():
    tape = Tape()
    x, y = tape.input("x", 0), tape.input("x", 1)
    symbols = [x, y]
    outputs = [tape.call(Op.ABS, x), tape.call(Op.SIGN, x), tape.call(Op.MIN, x, y), tape.call(Op.MAX, x, y),
               tape.select(tape.call(Op.LT, x, y), tape.mul(x, x), y)]  # fmt: skip
    rows = jacobian(tape, outputs, symbols)

    def at(*point):
        return [evaluate(tape, row, {"x": point}).tolist() for row in rows]

    assert at(0.0, 0.0) == [[0, 0], [0, 0], [1, 0], [1, 0], [0, 1]]
    assert at(-3.0, 2.0) == [[-1, 0], [0, 0], [1, 0], [0, 1], [-6, 0]]
    assert at(3.0, 2.0) == [[1, 0], [0, 0], [0, 1], [1, 0], [0, 1]]


def test_a_constant_exponent_asks_for_no_logarithm_so_negative_bases_stay_legal():
    tape = Tape()
    x, n = tape.input("x"), tape.input("p")
    output = tape.call(Op.POW, x, n)
    [derivative] = jacobian_vector(tape, [output], {x: ONE})
    assert evaluate(tape, [derivative], {"x": -2.0, "p": 3.0})[0] == 12.0
    assert evaluate(tape, [derivative], {"x": 0.0, "p": 2.0})[0] == 0.0


def quaternion(vector):
    angle = math.sqrt(sum(entry * entry for entry in vector))
    return np.array([math.cos(angle / 2), *(math.sin(angle / 2) / angle * np.asarray(vector))])


def product(p, q):
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


def test_quaternion_tangent_is_the_derivative_along_the_right_exponential():
    tape = Tape()
    q = [tape.input("q", k) for k in range(4)]
    seeds = tangent_seeds(tape, "SO3", q)
    point = quaternion([0.3, -1.1, 0.7])
    rows = np.array([evaluate(tape, [seeds[ref][d] for d in range(3)], {"q": point}) for ref in q])
    step = 1e-5
    for d in range(3):
        ahead, behind = (product(point, quaternion(sign * step * np.eye(3)[d])) for sign in (1, -1))
        assert rows[:, d] == pytest.approx((ahead - behind) / (2 * step), abs=1e-10)
    norm = [tape.add(tape.add(*(tape.mul(r, r) for r in q[:2])), tape.add(*(tape.mul(r, r) for r in q[2:])))]
    partials = forward_partials(tape, norm, seeds)[0]
    assert evaluate(tape, list(partials.values()), {"q": point}) == pytest.approx([0, 0, 0], abs=1e-15)


def test_pose_tangent_moves_the_position_in_body_axes():
    tape = Tape()
    q = [tape.input("q", k) for k in range(7)]
    seeds = tangent_seeds(tape, "SE3", q, first=6)
    point = np.array([*quaternion([0.4, 0.2, -0.9]), 1.0, 2.0, 3.0])
    body = np.array([0.3, -0.5, 0.8])
    moved = evaluate(tape, [seeds[ref].get(9 + d, ZERO) for ref in q[4:] for d in range(3)], {"q": point}).reshape(3, 3) @ body
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
    [xy] = second_directional(tape, [output], along(0), along(1))
    [yx] = second_directional(tape, [output], along(1), along(0))
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


def test_weighted_gradient_is_the_transposed_jacobian_times_weights():
    tape, symbols, outputs = build([(Op.MUL, 0, 1, False), (Op.EXP, 3, 2, True), (Op.DIV, 4, 2, False), (Op.ADD, 5, 3, True)])
    weights = [tape.input("w", k) for k in range(3)]
    point = {"x": [0.3, -0.8, 1.2], "w": [2.0, -1.0, 0.5]}
    expected = np.array(point["w"]) @ complex_step(tape, outputs, {"x": point["x"]}, "x")
    assert evaluate(tape, weighted_gradient(tape, outputs, weights, symbols), point) == pytest.approx(expected, rel=1e-13)


def test_the_work_is_linear_in_nodes_times_directions():
    tape = Tape()
    directions = 14
    x = [tape.input("x", k) for k in range(directions)]
    refs = list(x)
    rng = np.random.default_rng(1)
    while len(tape.live(refs)) < 800:
        i, j = rng.integers(max(0, len(refs) - 40), len(refs), 2)
        refs.append(tape.mul(refs[i], refs[j]) if rng.random() < 0.5 else tape.add(refs[i], tape.call(Op.SIN, refs[j])))
    before = len(tape.op)
    forward_partials(tape, refs[-30:], {ref: {k: ONE} for k, ref in enumerate(x)})
    assert len(tape.op) - before <= 3 * directions * 800
    before = len(tape.op)
    gradient(tape, refs[-1], x)
    assert len(tape.op) - before <= 3 * 800
