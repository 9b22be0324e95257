"""Code of the tape engine, carried out in Python, against the statements that it was made of."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.codegen.program import FunctionPart, OutputArray, ProgramFunction, Statement
from eomgen.codegen.targets.c.tape_code import OPERATIONS, _Assembler, _without_negative

BLOCKS = {"q": np.array([0.3, -1.2, 2.0, 0.7, 5.0, -0.1]), "u": np.array([4.0, -2.5, 0.25])}
SLOTS = 10
CALLS: dict[str, Any] = {
    "ADD": lambda x, y: x + y,
    "SUB": lambda x, y: x - y,
    "MUL": lambda x, y: x * y,
    "DIV": lambda x, y: x / y,
    "SIN": math.sin,
    "SQRT": math.sqrt,
    "ATAN2": math.atan2,
    "LT": lambda x, y: float(x < y),
    "NEG": lambda x: -x,
    "MOVE": lambda x: x,
}


def assembled(*statements: Statement, sizes: tuple[int, ...] = (40, 3)) -> _Assembler:
    outputs = tuple(OutputArray(f"y{k}", f"y{k}", (size,), size, "") for k, size in enumerate(sizes))
    part = FunctionPart(statements, tuple(BLOCKS), tuple(range(len(sizes))), True, 0)
    function = ProgramFunction("f", "", tuple(BLOCKS), outputs, (part,), SLOTS, 0, {})
    program: Any = SimpleNamespace(input_size=lambda block: len(BLOCKS[block]))
    return _Assembler(program, function, 100)


def run(*statements: Statement) -> tuple[Any, Any, list[Statement]]:
    """Return workspace and outputs after a run, and the statements of C."""
    made = assembled(*statements)
    done = made.statements()
    registers = np.full(made.registers, np.nan)
    registers[:SLOTS] = 10.0 + np.arange(SLOTS)
    for block, first, size in made.copies:
        registers[first : first + size] = BLOCKS[block]
    registers[made.first_number : made.first_number + len(made.numbers)] = made.numbers
    outputs = [np.full(size, 99.0) for size in (40, 3)]
    rows = np.reshape(made.code, (-1, 4)).tolist()
    output, at = None, 0
    while at < len(rows):
        code, target, first, second = rows[at]
        name, at = OPERATIONS[code], at + 1
        if name == "END":
            output = None
        elif name == "TARGET":
            output = outputs[target]
        elif name == "OUT":
            output[first + (second << 16)] = registers[target]  # type: ignore[index]
        elif name == "ZERO":
            output[: first + (second << 16)] = 0.0  # type: ignore[index]
        elif name == "SINCOS":
            angle = registers[second]
            registers[target], registers[first] = math.sin(angle), math.cos(angle)
        elif name == "SELECT":
            third, at = rows[at][0], at + 1
            registers[target] = registers[second] if registers[first] != 0.0 else registers[third]
        else:
            operands = (first, second)[: 1 if name in ("NEG", "MOVE", "SIN", "SQRT") else 2]
            registers[target] = CALLS[name](*(registers[k] for k in operands))
    return registers[:SLOTS], outputs, done


def test_values_and_outputs() -> None:
    q, u, w = ([("in", "q", k) for k in range(6)], [("in", "u", k) for k in range(3)], [("w", k) for k in range(4)])
    slots, (first, second), done = run(
        Statement("let", (1, ("ADD", q[0], ("MUL", ("K", 2.5), u[1])))),
        Statement("let", (2, ("SUB", 1, ("neg", q[2])))),
        Statement("save", (3, ("DIV", -2, w[0]))),
        Statement("sincos", (3, 4, ("MUL", q[1], q[1]))),
        Statement("angles", (((5, 6, q[4]), (7, 8, w[1])),)),
        Statement("label", ("nothing",)),
        Statement("fill", (0, 40)),
        Statement("out", (0, 5, ("ADD", 3, ("MUL", 4, -1)))),
        Statement("out", (1, 2, ("SELECT", ("LT", q[1], u[0]), 5, ("K", 7.0)))),
        Statement("out", (0, 39, ("SELECT", ("LT", u[0], q[1]), 5, ("ATAN2", 6, 7)))),
        Statement("save", (0, ("SUB", ("SQRT", q[4]), ("SIN", ("SUB", ("MUL", q[0], q[3]), ("MUL", u[0], u[2])))))),
    )
    Q, U = BLOCKS["q"], BLOCKS["u"]
    one = Q[0] + 2.5 * U[1]
    two = one + Q[2]
    assert slots[3] == -two / 10.0
    expected = np.zeros(40)
    expected[5] = math.sin(Q[1] ** 2) - math.cos(Q[1] ** 2) * one
    expected[39] = math.atan2(math.cos(Q[4]), math.sin(11.0))
    np.testing.assert_allclose(first, expected, rtol=1e-15)
    assert second[2] == math.sin(Q[4]) and second[0] == 99.0
    assert slots[0] == math.sqrt(Q[4]) - math.sin(Q[0] * Q[3] - U[0] * U[2])
    assert done == [Statement("run", (100,))]


def test_short_copies_are_instructions() -> None:
    slots, (first, second), done = run(
        Statement("gather", (1, 2, "q", 1, 2, 3)),
        Statement("gather", (8, 1, "w", 0, 9, 2)),
        Statement("circular", (2, 6, "u", 0, 1, 2)),
        Statement("spread", (0, 3, 10, 1, 2, 2, 1)),
        Statement("spread", (1, 0, 1, 8, 1, 2, -1)),
    )
    Q, U = BLOCKS["q"], BLOCKS["u"]
    expected = 10.0 + np.arange(SLOTS)
    expected[[1, 3, 5]] = Q[[1, 3, 5]]
    expected[[8, 9]] = expected[[0, 9]]
    expected[[2, 3]], expected[[6, 7]] = np.sin(U[:2]), np.cos(U[:2])
    np.testing.assert_array_equal(slots, expected)
    np.testing.assert_array_equal(first[[3, 13, 4]], [expected[1], expected[3], 99.0])
    np.testing.assert_array_equal(second, [-expected[8], -expected[9], 99.0])
    assert done == [Statement("run", (100,))]


def test_curves_stay_statements_of_c() -> None:
    made = assembled(Statement("save", (2, ("CURVE", ("MUL", ("in", "q", 0), ("in", "q", 1)), 4, 1))))
    first, curve = made.statements()
    assert (first, curve.kind, curve.data[0], curve.data[2:]) == (Statement("run", (100,)), "curve", 2, (4, 1))
    assert made.first_number <= curve.data[1] < made.registers
    assert assembled().statements() == [Statement("run", (100,))]


@pytest.mark.parametrize(
    ("kind", "operands", "expected"),
    [
        ("ADD", [3, -4], ("SUB", [3, 4])),
        ("SUB", [3, -4], ("ADD", [3, 4])),
        ("ADD", [-3, 4], ("ADD", [-3, 4])),
        ("ADD", [1, ("neg", ("w", 2))], ("SUB", [1, ("w", 2)])),
        ("SUB", [1, ("neg", ("w", 2))], ("ADD", [1, ("w", 2)])),
        ("SUB", [("neg", ("w", 2)), ("w", 1)], ("SUB", [("neg", ("w", 2)), ("w", 1)])),
    ],
)
def test_second_operands_lose_their_sign(kind: str, operands: list[Any], expected: Any) -> None:
    assert _without_negative(kind, operands) == expected
