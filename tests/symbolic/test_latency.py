"""Critical paths of hand-made tapes, counted by hand."""

from __future__ import annotations

from functools import reduce

from eomgen.symbolic.latency import FUNCTION, SHARE, critical_path, fastest, waits
from eomgen.symbolic.map import add_map
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Ref, Tape
from tests.symbolic.loops import chain, harmonics


def inputs(tape: Tape, count: int) -> list[Ref]:
    return [tape.input("q", k) for k in range(count)]


def test_independent_operations_do_not_wait_and_chains_add_up() -> None:
    tape = Tape()
    a, b, c, d = inputs(tape, 4)
    side_by_side = [tape.mul(a, b), tape.mul(c, d)]
    assert critical_path(tape, side_by_side) == 4
    chain = tape.div(tape.call(Op.SIN, tape.mul(a, b)), c)
    assert critical_path(tape, [chain]) == 4 + FUNCTION + 14
    assert critical_path(tape, [a, tape.constant(3.0)]) == 0
    assert critical_path(tape, []) == 0


def test_a_product_is_fused_with_the_only_sum_that_takes_it() -> None:
    tape = Tape()
    a, b, c, d = inputs(tape, 4)
    product = tape.mul(a, b)
    total = tape.sub(c, product)
    assert critical_path(tape, [total]) == 4
    assert critical_path(tape, [total, tape.mul(product, d)]) == 8  # also another operation takes the product
    late = tape.add(tape.div(c, d), tape.mul(a, tape.mul(b, c)))  # the other summand is ready at 14
    assert critical_path(tape, [late]) == 18


def test_the_fastest_algorithm_has_the_fewest_operations_or_a_much_shorter_path() -> None:
    tape = Tape()
    factors = inputs(tape, 8)
    chain, pairs = reduce(tape.mul, factors), factors
    while len(pairs) > 1:
        pairs = [tape.mul(x, y) for x, y in zip(pairs[::2], pairs[1::2], strict=True)]
    more = [*pairs, tape.div(factors[0], factors[1])]  # 28 and 14 cycles, and 7 and 8 operations
    ratio = (14.0 + SHARE * tape.counts(more).weight) / (28.0 + SHARE * tape.counts([chain]).weight)
    assert [critical_path(tape, way) for way in ([chain], pairs, more)] == [28, 12, 14]
    assert fastest(tape, [[chain], more], ratio * 1.001) == 1
    assert fastest(tape, [[chain], more], ratio * 0.999) == 0
    assert fastest(tape, [more, [chain]], ratio * 0.999) == 1
    assert fastest(tape, [[chain], more], 0.01) == 0  # the operations alone take longer
    assert fastest(tape, [[chain]], 0.5) == 0


def test_short_functions_with_long_paths_wait() -> None:
    tape = Tape()
    factors = inputs(tape, 26)
    many = [tape.mul(x, y) for place, x in enumerate(factors) for y in factors[:place]]
    chain = reduce(tape.mul, factors)
    assert waits(tape, [chain])
    assert not waits(tape, many)  # side by side
    assert waits(tape, [reduce(tape.mul, many[:40]), *many])
    assert not waits(tape, [reduce(tape.div, many[:300])])  # more operations than are worth a second order


def test_elements_of_a_loop_run_side_by_side_unless_they_carry() -> None:
    tape = Tape()
    start = tape.div(tape.input("q"), tape.input("q", 1))
    sums = add_map(tape, harmonics(tape, start)).sums
    assert critical_path(tape, sums) == 14 + (4 + FUNCTION + 4) + 5 * 4  # phase, cosine, product; five additions
    paths = []
    for count in (4, 8):
        tape = Tape()
        paths.append(critical_path(tape, add_map(tape, chain(tape, count)).last))
    assert paths[1] == 2 * paths[0] > 4 * FUNCTION
