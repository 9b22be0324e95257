"""Rows of a Map that are summands of outputs: C adds them as they come, and gives what the tape gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.target import generate_files
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from eomgen.system.system import Block, Function, System
from tests.codegen.hand_made import call, compile_program, make_system
from tests.codegen.test_loops import factors


def springs(
    count: int, *, clamped: bool = False, read: bool = False, order: list[int] | None = None, alike: bool = False
) -> System:
    """Return springs between neighbours: forces on all points, with loads on the first two, and tangents, packed.

    Parameters
    ----------
    clamped : whether the first point is not an unknown
    read : whether something else reads a force
    order : of the points in the outputs
    alike : whether no summand has a sign that is unlike those of other elements
    """
    tape, kernel = Tape(), Tape()
    left, right = kernel.input("gather", 0), kernel.input("gather", 1)
    stretch = kernel.sub(right, left)
    force = kernel.mul(kernel.input("element", 0), kernel.call(Op.SIN, stretch))
    tangent = kernel.mul(kernel.input("element", 0), kernel.call(Op.COS, stretch))
    q = [tape.input("q", k) for k in range(count + 1)]
    stiffness = tuple(1.0 + 0.1 * k for k in range(count))
    columns = (force, -force, tangent, tangent, -tangent)
    loop = Map(kernel, count, (stiffness,), (), (tuple(q[:-1]), tuple(q[1:])), stacked=columns, label="springs")
    rows = add_map(tape, loop).rows
    forces = list(q)
    forces[0] = tape.add(tape.call(Op.COS, q[3]), tape.add(forces[0], tape.input("p")))
    diagonal = [ONE] + [ZERO] * count
    for element, (on_left, on_right, to_left, to_right, _) in enumerate(rows):
        forces[element] = tape.add(on_left, forces[element])
        forces[element + 1] = tape.add(forces[element + 1], on_right)
        diagonal[element] = (
            tape.sub(to_left, diagonal[element]) if element == 2 and not alike else tape.add(diagonal[element], to_left)
        )
        diagonal[element + 1] = tape.add(diagonal[element + 1], to_right)
    beside = [tape.mul(rows[0][4], q[0]) if read else rows[0][4], *(row[4] for row in rows[1:])]
    free = range(1 if clamped else 0, count + 1)
    wanted = list(free) if order is None else order
    blocks = (
        Block("f", (len(wanted),), tuple(forces[k] for k in wanted)),
        Block("K", (len(wanted),), tuple(diagonal[k] for k in wanted)),
        Block("off", (count,), tuple(beside)),
    )
    functions = [Function("springs", "forces and tangents", ("p", "q"), blocks)]
    return make_system("springs", tape, functions, initial_q=(0.0,) * (count + 1), factors=tuple(factors(count + 1)))


@pytest.mark.slow_except("how1")
@pytest.mark.parametrize("how", [{}, {"clamped": True}, {"read": True, "order": [3, 1, 4, 8, 5, 9, 2, 6, 7, 0]}])
def test_outputs_are_those_of_the_tape(how: dict[str, object], cache: Path, rng: np.random.Generator) -> None:
    system = springs(9, **how)  # type: ignore[arg-type]  # of four kinds
    point = {"p": [1.3, 0.0], "q": rng.uniform(-1, 1, (3, 10))}
    found = call(compile_program(to_program(system), cache, profile="reproducible"), "springs", point)
    for block, values in zip(system.functions["springs"].outputs, found, strict=True):
        assert values == pytest.approx(evaluate(system.tape, block.refs, point), abs=1e-14)


def workspace(system: System) -> int:
    return to_program(system).function("springs").workspace


def test_no_row_waits() -> None:
    assert [workspace(springs(count)) for count in (9, 40)] == [10, 41]  # the points that the springs gather
    assert workspace(springs(9, clamped=True)) == 10


def test_rows_wait_where_something_else_reads_them() -> None:
    assert workspace(springs(9, read=True)) == 10 + 5 * 9


def test_places_of_no_rule_with_other_signs_keep_the_rows_in_the_workspace(rng: np.random.Generator) -> None:
    order: list[Ref] = rng.permutation(41).tolist()
    assert workspace(springs(40, order=order)) == 41 + 5 * 40


def test_the_c_of_more_elements_is_as_long() -> None:
    texts = [generate_files(to_program(springs(count)))["springs.c"] for count in (100, 400)]
    few, many = (text[text.index("_springs(") :].count("\n") for text in texts)
    assert few == many


def test_places_that_follow_no_rule_are_tabulated(cache: Path, rng: np.random.Generator) -> None:
    count = 40
    system = springs(count, order=rng.permutation(count + 1).tolist(), alike=True)
    program = to_program(system)
    (loop,) = program.loops
    assert loop.additions
    assert all(len(item.starts) == count for item in loop.additions if item.output < 2)
    point = {"p": [1.3, 0.0], "q": rng.uniform(-1, 1, (3, count + 1))}
    found = call(compile_program(program, cache, profile="reproducible"), "springs", point)
    for block, values in zip(system.functions["springs"].outputs, found, strict=True):
        assert values == pytest.approx(evaluate(system.tape, block.refs, point), abs=1e-14)
