from __future__ import annotations

import numpy as np
import pytest
import sympy

from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import add_map
from eomgen.symbolic.operations import UNARY, InputSymbol, Op
from eomgen.symbolic.reading import block_to_sympy, input_symbol, to_latex
from eomgen.symbolic.tape import Tape
from tests.symbolic.loops import LINKS, chain, chain_point
from tests.symbolic.random_tapes import SMOOTH, apply_tamed

POINT = {"x": [0.37, -1.4, 0.9]}


def numbers(block, inputs):
    """Substitute numbers, through named intermediates where there are any."""
    names, matrix = block if isinstance(block, tuple) else ([], block)
    given = [(InputSymbol(name, k), value) for name, values in inputs.items() for k, value in enumerate(values)]
    known = {input_symbol(symbol): sympy.Float(value) for symbol, value in given}
    for symbol, expression in names:
        assert expression.free_symbols <= set(known)
        known[symbol] = expression.subs(known).evalf()
    return np.array([[float(matrix[i, j].subs(known)) for j in range(matrix.cols)] for i in range(matrix.rows)])


@pytest.mark.parametrize("op", [*SMOOTH, Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE, Op.SELECT])
def test_every_operation_reads_as_what_it_computes(op):
    assert set(SMOOTH) | {Op.ABS, Op.SIGN} >= UNARY
    tape = Tape()
    x = [tape.input("x", k) for k in range(3)]
    for first, second in ((0, 1), (2, 0), (1, 2)):
        refs = [apply_tamed(tape, op, x[first], x[second])]
        assert numbers(block_to_sympy(tape, refs, ()), POINT)[0] == pytest.approx(
            evaluate(tape, refs, POINT), rel=1e-13
        )


def test_shapes_and_names():
    tape = Tape()
    refs = [
        *(tape.input(name, k) for name, k in (("q", 0), ("v", 1), ("p", 2), ("t", 0), ("lam", 3))),
        -tape.input("q", 0),
    ]
    matrix = block_to_sympy(tape, refs, (2, 3))
    assert matrix.shape == (2, 3)
    assert str(matrix) == "Matrix([[q0, v1, p_2], [t, lam_3, -q0]])"
    assert all(symbol.is_real for symbol in matrix.free_symbols)
    assert block_to_sympy(tape, refs, (6,)).shape == (6, 1)
    with pytest.raises(ValueError, match=r"6 references do not fill a block of shape \(2, 2\); it has to be"):
        block_to_sympy(tape, refs, (2, 2))
    with pytest.raises(ValueError, match=r"shape \(1, 2, 3\)"):
        block_to_sympy(tape, refs, (1, 2, 3))


def test_numbers_are_exact_where_a_reader_writes_them_so():
    tape = Tape()
    assert block_to_sympy(tape, [tape.constant(v) for v in (3.0, -0.5, 2.125, 0.1)], (4,)) == sympy.Matrix(
        [3, -sympy.Rational(1, 2), sympy.Rational(17, 8), sympy.Float(0.1)]
    )


def test_a_select_on_a_comparison_reads_as_its_condition():
    tape = Tape()
    x, y = tape.input("x", 0), tape.input("x", 1)
    [expression] = block_to_sympy(tape, [tape.select(tape.call(Op.LT, x, y), x, y)], ())
    symbols = sympy.symbols("x0 x1", real=True)
    assert expression == sympy.Piecewise((symbols[0], symbols[0] < symbols[1]), (symbols[1], True))
    [expression] = block_to_sympy(tape, [tape.select(tape.sub(x, y), x, y)], ())
    assert expression.args[0][1] == sympy.Ne(symbols[0] - symbols[1], 0)


@pytest.mark.slow
def test_large_blocks_get_names_and_need_no_recursion():
    tape = Tape()
    x = [tape.input("x", k) for k in range(3)]
    ref = x[0]
    for k in range(300):
        ref = tape.mul(tape.call(Op.SIN, ref), x[k % 3]) if k % 2 else tape.add(ref, x[k % 3])
    names, matrix = block_to_sympy(tape, [ref], ())
    assert [str(symbol) for symbol, _ in names] == [f"w_{k}" for k in range(len(names))]
    assert max(sympy.count_ops(expression) for _, expression in names) <= 60
    assert numbers((names, matrix), POINT)[0] == pytest.approx(evaluate(tape, [ref], POINT), rel=1e-9)


@pytest.mark.parametrize("leaves", [1, 300])
@pytest.mark.parametrize("operations", [200, 201])
def test_blocks_are_whole_up_to_200_operations_on_any_number_of_inputs(operations: int, leaves: int) -> None:
    tape = Tape()
    refs = [tape.call(Op.SIN, tape.input("x", k % leaves)) if k == 0 else tape.input("x", k) for k in range(leaves)]
    for _ in range(operations - 1):
        refs[0] = tape.call(Op.SIN, refs[0])
    named = isinstance(block_to_sympy(tape, refs, (leaves,)), tuple)
    assert named == (operations > 200)


def test_shared_parts_are_named_once():
    tape = Tape()
    x, y = tape.input("x", 0), tape.input("x", 1)
    shared = tape.call(Op.SIN, tape.add(x, y))
    names, matrix = block_to_sympy(tape, [tape.mul(shared, x), tape.mul(shared, y)], (2,), named=True)
    x0, x1, w = (sympy.Symbol(name, real=True) for name in ("x0", "x1", "w_0"))
    assert names == [(w, sympy.sin(x0 + x1))]
    assert matrix == sympy.Matrix([w * x0, w * x1])


def test_a_loop_reads_as_its_elements():
    tape = Tape()
    results = add_map(tape, chain(tape))
    refs, point = [*results.sums, *results.last, -results.rows[1][0]], chain_point()
    maps, nodes = len(tape.maps), len(tape.op)
    values = numbers(block_to_sympy(tape, refs, (len(refs),)), point)[:, 0]
    assert values == pytest.approx(evaluate(tape, refs, point), rel=1e-12)
    assert (len(tape.maps), len(tape.op)) == (maps, nodes)
    tip = block_to_sympy(tape, results.last[:1], (), named=False)[0, 0]
    assert tip == sum(sympy.symbols(f"q:{LINKS}", real=True))


def test_latex():
    tape = Tape()
    q, p = tape.input("q", 1), tape.input("p", 0)
    ref = tape.mul(p, tape.call(Op.SIN, q))
    assert to_latex(tape, [ref], ()) == r"p_{0} \sin{\left(q_{1} \right)}"
    assert to_latex(tape, [ref], (), name="h") == r"h = p_{0} \sin{\left(q_{1} \right)}"
    square = tape.add(tape.mul(ref, ref), ref)
    assert (
        to_latex(tape, [square, q], (2,), name="Q", named=True) == "\\begin{aligned}\n"
        "w_{0} &= p_{0} \\sin{\\left(q_{1} \\right)} \\\\\n"
        "Q &= \\left[\\begin{matrix}w_{0}^{2} + w_{0}\\\\q_{1}\\end{matrix}\\right]\n"
        "\\end{aligned}"
    )
    assert to_latex(tape, [square], (), named=True).splitlines()[-2] == "& w_{0}^{2} + w_{0}"


def test_the_shortest_latex_has_what_cancels_left_out():
    tape = Tape()
    x, y, z = (tape.input("q", k) for k in range(3))
    cancelling = tape.sub(tape.mul(x, tape.add(y, z)), tape.mul(x, y))
    factored = tape.mul(tape.add(x, y), tape.add(y, z))
    as_computed = to_latex(tape, [cancelling, factored], (2,))
    assert as_computed.count("q_{1}") == 4
    shortest = to_latex(tape, [cancelling, factored], (2,), shortest=True)
    assert shortest == (
        r"\left[\begin{matrix}q_{0} q_{2}\\\left(q_{0} + q_{1}\right) \left(q_{1} + q_{2}\right)\end{matrix}\right]"
    )


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("q_theta2", r"q_{\theta_{2}}"),
        ("v_phi_1", r"v_{\phi 1}"),
        ("q_link12_2", "q_{link_{12} 2}"),
        ("rho_1a", r"\rho_{1a}"),
        ("q_hinge", "q_{hinge}"),
        ("theta2", r"\theta_{2}"),
    ],
)
def test_latex_has_numbers_of_names_below_them(name: str, text: str) -> None:
    tape = Tape()
    x = tape.input("q", 0)
    names = dict.fromkeys(tape.inputs, name)
    assert to_latex(tape, [x], (), names=names) == text
    lines = to_latex(tape, [tape.mul(tape.mul(x, x), tape.mul(x, x)), tape.mul(x, x)], (2,), named=True, names=names)
    assert f"{text}^{{2}}" in lines
