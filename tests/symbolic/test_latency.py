"""Critical paths of hand-made tapes, counted by hand."""

from __future__ import annotations

from eomgen.symbolic.latency import FUNCTION, critical_path
from eomgen.symbolic.map import add_map
from eomgen.symbolic.tape import Ref, Tape
from tests.symbolic.loops import chain, harmonics


def inputs(tape: Tape, count: int) -> list[Ref]:
    return [tape.input("q", k) for k in range(count)]


def test_a_product_is_fused_with_the_only_sum_that_takes_it() -> None:
    tape = Tape()
    a, b, c, d = inputs(tape, 4)
    product = tape.mul(a, b)
    total = tape.sub(c, product)
    assert critical_path(tape, [total]) == 4
    assert critical_path(tape, [total, tape.mul(product, d)]) == 8  # also another operation takes the product
    late = tape.add(tape.div(c, d), tape.mul(a, tape.mul(b, c)))  # the other summand is ready at 14
    assert critical_path(tape, [late]) == 18


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
