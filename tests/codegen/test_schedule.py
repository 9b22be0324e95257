"""Order, nesting, fusion and chunks change the text, never the numbers."""

from __future__ import annotations

import dataclasses
import random
from pathlib import Path

import numpy as np
import pytest

from eomgen.codegen import convert
from eomgen.codegen.convert import to_program
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.target import generate_files
from eomgen.errors import ModelError
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import ZERO, Ref, Tape
from eomgen.system.system import BASE_LAYOUT, Block, Function, System
from tests.codegen.hand_made import call, compile_program, make_system, pendulum


def tangled(operations: int = 400, functions: int = 6, seed: int = 3) -> System:
    """Return functions of random operations that share, reuse and negate values, some of them circular."""
    source = random.Random(seed)
    tape = Tape()
    leaves = [tape.input("q", 0), tape.input("q", 1), tape.input("v", 0), tape.input("p", 0), tape.input("p", 1)]
    made = []
    for number in range(functions):
        nodes: list[Ref] = list(leaves)
        for k in range(operations):
            if k % 25 == 0:
                tape.blocks.append((len(tape.op), f"body {k // 25}"))
            x, y = source.choice(nodes[-60:]), source.choice(nodes[-20:])
            kind = source.randrange(12)
            if kind < 5:
                nodes.append(tape.add(tape.mul(tape.constant(0.5), x), y))
            elif kind < 9:
                nodes.append(tape.mul(tape.call(Op.SIN, x), y))
            elif kind == 9:
                nodes.append(tape.sub(tape.call(Op.COS, x), y))
            elif kind == 10:
                nodes.append(tape.div(-x, tape.add(tape.mul(y, y), tape.constant(1.5))))
            else:
                nodes.append(tape.select(tape.call(Op.LT, -x, y), -y, x))
        drawn = [source.choice((1, -1)) * source.choice(nodes) for _ in range(12)]
        refs = (*drawn, ZERO, leaves[0], -leaves[2], -nodes[-1])
        made.append(Function(f"tangle{number}", "random operations", ("p", "q", "v"), (Block("y", (4, 4), refs),)))
    return make_system("tangled", tape, made)


POINT = {"p": [0.7, -0.3], "q": [0.4, 1.9], "v": [-1.1, 0.2]}


@pytest.mark.slow
@pytest.mark.parametrize(("part_limit", "nest_limit", "file_limit"), [(1500, 6, 10**9), (37, 1, 500)])
def test_numbers_are_those_of_the_tape(part_limit: int, nest_limit: int, file_limit: int, cache: Path) -> None:
    system = tangled()
    library = compile_program(
        to_program(system, part_limit=part_limit, nest_limit=nest_limit), cache, file_limit=file_limit
    )
    for name, function in system.functions.items():
        (found,) = call(library, name, POINT)
        wanted = evaluate(system.tape, function.refs, POINT)
        assert np.max(np.abs(found - wanted)) < 1e-12 * max(1.0, np.max(np.abs(wanted)))


def test_large_models_are_cut_into_files_and_parts_that_reuse_the_workspace() -> None:
    program = to_program(tangled(), part_limit=41)
    files = generate_files(program, file_limit=600)
    assert {"tangled.c", "tangled_2.c", "tangled_parts.h"} <= set(files)
    assert "static void tangled_tangle0_part1" not in files["tangled.c"]
    function = program.functions[0]
    assert all(part.operations <= 41 for part in function.parts)
    saved = sum(statement.kind == "save" for part in function.parts for statement in part.statements)
    assert 0 < function.workspace < saved


@pytest.mark.parametrize(("limit", "longest"), [(400, 400), (200, 200), (41, 14)])
def test_parts_of_very_long_functions_are_a_third_as_long(limit: int, longest: int) -> None:
    """Compilers take less time for them; functions of up to four limits keep few parts, and so their speed."""
    for function in to_program(tangled(), part_limit=limit).functions:
        parts = [part.operations for part in function.parts]
        assert sum(parts) == function.operations
        assert max(parts) <= longest + 2  # sine and cosine, or a statement, are not cut
        assert 0 <= len(parts) - function.operations // longest <= 3


def test_values_used_once_are_nested_up_to_the_limit() -> None:
    def operations(expression: object) -> int:
        if not isinstance(expression, tuple) or expression[0] in ("K", "in", "w"):
            return 0
        return (expression[0] != "neg") + sum(map(operations, expression[1:]))

    def longest(program: Program) -> int:
        statements = [
            statement for function in program.functions for part in function.parts for statement in part.statements
        ]
        return max(
            operations(statement.data[-1]) for statement in statements if statement.kind in ("let", "out", "save")
        )

    assert longest(to_program(tangled(), nest_limit=1)) == 1
    assert longest(to_program(tangled(), nest_limit=6)) == 6


def text_of(tape: Tape, inputs: tuple[str, ...], *blocks: Block) -> str:
    return generate_files(to_program(make_system("one", tape, [Function("f", "", inputs, blocks)])))["one.c"]


@pytest.mark.parametrize(
    "name", ["x12", "w", "y_out", "EG_x", "angle", "é_x", "link_" + "a" * 40, "1_a", "taken_twice"]
)
def test_names_that_are_in_the_way_are_left_out(name: str) -> None:
    tape = Tape()
    first, second = (tape.mul(tape.input("q", k), tape.input("v", k)) for k in range(2))
    tape.name(first, "taken_twice")
    tape.name(second, name)
    product = tape.mul(first, second)
    block = Block("y_out", (2,), (tape.mul(product, first), tape.mul(product, second)))
    assert "const real x2 = q[1] * v[1];" in text_of(tape, ("q", "v"), block)


def test_the_base_function_fills_the_struct_and_others_read_it(cache: Path) -> None:
    tape = Tape()
    size = sum(number for _, number, _ in BASE_LAYOUT)
    t = tape.input("t")
    refs = tuple(tape.mul(tape.constant(k + 1.0), t) for k in range(size))
    total = tape.add(tape.input("base", 0), tape.mul(tape.constant(100.0), tape.input("base", size - 1)))
    blocks = tuple(
        Block(name, (number,), refs[start : start + number])
        for (name, number, _), start in zip(BASE_LAYOUT, np.cumsum([0] + [n for _, n, _ in BASE_LAYOUT]), strict=False)
    )
    functions = [Function("base", "", ("p", "t"), blocks), Function("f", "", ("base",), (Block("y", (1,), (total,)),))]
    for real in ("double", "lanes"):
        library = compile_program(to_program(make_system("moving", tape, functions)), cache, real=real)
        (state,) = call(library, "base", {"p": [1.0, 1.0], "t": [[2.0], [3.0]]})
        assert state.tolist() == [[2.0 * (k + 1) for k in range(size)], [3.0 * (k + 1) for k in range(size)]]
        assert call(library, "f", {"base": state})[0][:, 0].tolist() == [2.0 + 200.0 * size, 3.0 + 300.0 * size]


def test_a_function_that_reads_more_than_it_declares_is_refused() -> None:
    tape = Tape()
    bad = Function("f", "", ("q",), (Block("y", (1,), (tape.mul(tape.input("q"), tape.input("v")),)),))
    with pytest.raises(ModelError, match="function f depends on v, which is not among its inputs"):
        to_program(make_system("bad", tape, [bad]))
    with pytest.raises(ModelError, match="output y of function f has shape \\(3,\\) but 1 components"):
        to_program(
            make_system(
                "bad", tape, [dataclasses.replace(bad, inputs=("q", "v"), outputs=(Block("y", (3,), bad.refs),))]
            )
        )
    with pytest.raises(ModelError, match="the model has no function heat; try: one of mass, coupling"):
        to_program(pendulum(), functions=["heat"])


def test_a_function_that_would_overflow_the_stack_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(convert, "WORKSPACE_LIMIT", 20)
    with pytest.raises(
        ModelError, match=r"function tangle0 keeps \d+ values on the stack, more than 20; try: fewer elements"
    ):
        to_program(tangled(), part_limit=41)
