from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from eomgen.symbolic.calculus.jets import jets
from eomgen.symbolic.calculus.loops import compact
from eomgen.symbolic.calculus.partials import forward_partials, gradient, jacobian_vector
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import Map, add_map, splice, unroll
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.tape import ONE, ZERO, Tape
from tests.oracles.fifty_digits import evaluate_mpmath
from tests.symbolic.loops import MODELS, chain, chain_point, harmonics, random_loop, springs
from tests.symbolic.random_tapes import complex_step, points, programs


@pytest.mark.parametrize("model", MODELS)
def test_a_loop_whose_constants_do_not_fold_has_the_bits_of_its_unrolled_form(model):
    tape = Tape()
    make, point = MODELS[model]
    loop = make(tape)
    looped, unrolled = add_map(tape, loop).flat, unroll(tape, loop).flat
    assert len(looped) == loop.size
    assert np.array_equal(evaluate(tape, looped, point()), evaluate(tape, unrolled, point()))
    values = [float(value) for value in evaluate_mpmath(tape, looped, point())]
    assert values == pytest.approx(evaluate(tape, unrolled, point()), rel=1e-13)


@pytest.mark.parametrize("model", MODELS)
def test_derivatives_of_a_loop_are_those_of_its_unrolled_form(model):
    tape = Tape()
    make, make_point = MODELS[model]
    point, loop = make_point(), make(tape)
    blocks = [(name, k) for name, values in point.items() for k in range(len(values))]
    seeds = {InputSymbol(*symbol): {d: ONE} for d, symbol in enumerate(blocks)}
    looped, unrolled = add_map(tape, loop).flat, unroll(tape, loop).flat
    maps = len(tape.maps)
    found, expected = forward_partials(tape, looped, seeds), forward_partials(tape, unrolled, seeds)
    assert len(tape.maps) == maps + 1
    assert all(set(e) <= set(f) for f, e in zip(found, expected, strict=True))

    def matrix(partials):
        return np.array([evaluate(tape, [row.get(d, ZERO) for d in range(len(blocks))], point) for row in partials])

    reference = np.hstack([complex_step(tape, looped, point, name) for name in point])
    scale = np.abs(reference).max()
    assert np.abs(matrix(expected) - reference).max() <= 1e-13 * scale
    assert np.abs(matrix(found) - reference).max() <= 1e-13 * scale


@settings(max_examples=30, deadline=None)
@given(programs, points)
def test_random_loops_in_value_derivative_adjoint_and_jet(program, point):
    tape = Tape()
    loop = random_loop(tape, program)
    inputs, x = {"x": point, "c": [0.3, -0.8, 0.5, 0.1, 0.9, -0.4]}, [tape.input("x", k) for k in range(3)]
    looped, unrolled = add_map(tape, loop).flat, unroll(tape, loop).flat
    values = evaluate(tape, unrolled, inputs)
    assert np.abs(evaluate(tape, looped, inputs) - values).max() <= 1e-13 * (1.0 + np.abs(values).max())
    reference = complex_step(tape, unrolled, inputs, "x")
    partials = forward_partials(tape, looped, {ref: {k: ONE} for k, ref in enumerate(x)})
    forward = [[partial.get(k, ZERO) for k in range(3)] for partial in partials]
    reverse = [gradient(tape, ref, x) for ref in looped]
    for rows in (forward, reverse):
        assert np.abs([evaluate(tape, row, inputs) for row in rows] - reference).max() <= 1e-11 * (
            1.0 + np.abs(reference).max()
        )
    paths = {ref: [ref, tape.input("c", 2 * k), tape.input("c", 2 * k + 1)] for k, ref in enumerate(x)}
    for one, other in zip(jets(tape, looped, paths, 3), jets(tape, unrolled, paths, 3), strict=True):
        expected = evaluate(tape, other, inputs)
        assert np.abs(evaluate(tape, one, inputs) - expected).max() <= 1e-11 * (1.0 + np.abs(expected).max())


def test_a_mesh_keeps_its_sparsity_and_its_loop():
    tape = Tape()
    count = 40
    results = add_map(tape, springs(tape, count))
    before = len(tape.op)
    partials = forward_partials(tape, results.flat, {InputSymbol("q", k): {k: ONE} for k in range(count + 1)})
    assert [sorted(tangent) for tangent in partials[1:]] == [[i, i + 1] for i in range(count) for _ in range(2)]
    assert len(tape.op) - before <= 12 * count
    assert len(tape.maps) == 2


def test_second_derivatives_of_a_chain_by_forward_over_forward_and_forward_over_reverse():
    tape = Tape()
    loop, point = chain(tape, 4), chain_point(4)
    kinetic = add_map(tape, loop).sums[0]
    q = [tape.input("q", k) for k in range(4)]
    gradients = gradient(tape, kinetic, q)
    reference = complex_step(tape, gradients, point, "q")
    mixed = [forward_partials(tape, gradients, {ref: {k: ONE} for k, ref in enumerate(q)})]
    reverse = np.array([evaluate(tape, [row.get(k, ZERO) for k in range(4)], point) for row in mixed[0]])
    forward = np.array(
        [
            evaluate(tape, jacobian_vector(tape, jacobian_vector(tape, [kinetic], {q[1]: ONE}), {ref: ONE}), point)[0]
            for ref in q
        ]
    )
    assert reverse == pytest.approx(reference, rel=1e-12)
    assert forward == pytest.approx(reference[1], rel=1e-12)


def test_substituted_first_coefficients_reach_the_loop():
    tape = Tape()
    s = tape.input("s")
    [profile] = add_map(tape, harmonics(tape, s)).sums
    shifted = tape.add(s, ONE)
    [jet] = jets(tape, [profile], {s: [shifted, tape.constant(2.0)]}, 1)
    assert evaluate(tape, jet[:1], {"s": 0.4})[0] == evaluate(tape, [profile], {"s": 1.4})[0]
    slope = complex_step(tape, [profile], {"s": [1.4]}, "s")[0, 0]
    assert evaluate(tape, jet[1:], {"s": 0.4})[0] == pytest.approx(2.0 * slope, rel=1e-14)


def test_harmonic_sum_with_two_derivatives():
    tape = Tape()
    s = tape.input("s")
    loop = harmonics(tape, s)
    [profile] = add_map(tape, loop).sums
    amplitude, wave_number, phase = (np.array(column) for column in loop.elements)
    angle = wave_number * 0.7 + phase
    sine, cosine = np.sin(angle), np.cos(angle)
    expected = [amplitude @ cosine, -(amplitude * wave_number) @ sine, -(amplitude * wave_number**2) @ cosine]
    [jet] = jets(tape, [profile], {s: [s, ONE]}, 2)
    assert evaluate(tape, jet, {"s": 0.7}) * [1, 1, 2] == pytest.approx(expected, rel=1e-14)
    [second] = jacobian_vector(tape, jacobian_vector(tape, [profile], {s: ONE}), {s: ONE})
    assert evaluate(tape, [second], {"s": 0.7})[0] == pytest.approx(expected[2], rel=1e-14)


def test_results_that_are_constants_of_the_kernel_are_constants():
    tape, kernel = Tape(), Tape()
    inner, outer = kernel.input("shared", 0), tape.input("x")
    loop = Map(
        kernel, 3, shared=(outer,), initial=(outer,), sums=(kernel.constant(2.0),), last=(ZERO,), stacked=(inner, ONE)
    )
    results = add_map(tape, loop)
    assert results.sums == (tape.constant(6.0),)
    assert results.last == (ZERO,)
    assert [row[1] for row in results.rows] == [ONE] * 3
    assert unroll(tape, loop).flat[1] == ZERO


def test_compact_drops_what_is_not_needed():
    tape = Tape()
    loop = chain(tape)
    position = compact(
        Map(loop.kernel, loop.count, loop.elements, loop.shared, loop.gather, loop.initial, last=loop.last), [2]
    )
    assert (len(position.elements), len(position.shared), len(position.gather), len(position.initial)) == (1, 0, 1, 2)
    whole = add_map(tape, loop)
    assert evaluate(tape, [add_map(tape, position).last[0]], chain_point()) == evaluate(
        tape, [whole.last[2]], chain_point()
    )


def test_a_loop_that_does_not_move_has_no_derivative():
    tape = Tape()
    results = add_map(tape, harmonics(tape, tape.input("s")))
    assert forward_partials(tape, results.sums, {InputSymbol("x", 0): {0: ONE}}) == [{}]
    assert gradient(tape, results.sums[0], [tape.input("x")]) == [ZERO]
    assert len(tape.maps) == 1


def test_nested_maps_are_refused():
    kernel = Tape()
    [inner] = add_map(kernel, harmonics(kernel, kernel.input("shared", 0))).sums
    with pytest.raises(ValueError, match="the kernel of a Map holds a Map itself; unroll the inner one"):
        Map(kernel, 2, shared=(ONE,), sums=(inner,))


def test_splice_takes_loops_along_or_unrolls_them():
    tape = Tape()
    results = add_map(tape, chain(tape))
    refs, point = [tape.mul(results.sums[0], tape.input("p")), -results.rows[2][1]], chain_point()
    for unrolled in (False, True):
        target = Tape()
        copied = splice(target, tape, refs, {InputSymbol("p", 0): target.input("g")}, unrolled=unrolled)
        assert len(target.maps) == (0 if unrolled else 1)
        moved = {"q": point["q"], "v": point["v"], "g": point["p"]}
        assert np.array_equal(evaluate(target, copied, moved), evaluate(tape, refs, point))
