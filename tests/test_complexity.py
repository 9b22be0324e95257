"""Cyclomatic complexity of functions: none above 30.

The rules are those of radon: a function starts at one; each branch, loop, ``else`` of a loop or ``try``, handler,
comprehension with its conditions, operand of ``and`` or ``or`` after the first, assertion and case adds one. Functions
within functions count on their own.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "eomgen"
HIGHEST = 30

WORDS = re.compile(r"\b(?:if|for|while|else|except|and|or|assert|case)\b")  # each decision is written with one
Function = ast.FunctionDef | ast.AsyncFunctionDef


def _decisions(node: ast.AST) -> int:
    """Return the number of decisions that a node adds by itself, without its parts."""
    match node:
        case ast.If() | ast.IfExp() | ast.Assert():
            return 1
        case ast.For() | ast.AsyncFor() | ast.While():
            return 1 + bool(node.orelse)
        case ast.Try():
            return len(node.handlers) + bool(node.orelse)
        case ast.BoolOp():
            return len(node.values) - 1
        case ast.comprehension():
            return 1 + len(node.ifs)
        case ast.Match():
            rest = any(isinstance(case.pattern, ast.MatchAs) and case.pattern.pattern is None for case in node.cases)
            return len(node.cases) - rest
    return 0


def complexity(function: Function) -> int:
    """Return the complexity of a function, without functions and classes within it."""
    pending: list[ast.AST] = list(function.body)
    decisions = 0
    while pending:
        node = pending.pop()
        if isinstance(node, Function | ast.ClassDef):
            continue
        decisions += _decisions(node)
        if not isinstance(node, ast.Assert):  # radon counts no operands in it
            pending.extend(ast.iter_child_nodes(node))
    return 1 + decisions


def functions(node: ast.AST, scope: str = "") -> Iterator[tuple[str, Function]]:
    """Yield the functions below a node, at any depth of statements, with their qualified names."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, Function | ast.ClassDef):
            name = f"{scope}.{child.name}" if scope else child.name
            if isinstance(child, Function):
                yield name, child
            yield from functions(child, name)
        elif isinstance(child, ast.stmt | ast.ExceptHandler | ast.match_case):
            yield from functions(child, scope)


def complex_functions(source: str, above: int) -> Iterator[tuple[str, int]]:
    """Yield the qualified name and the complexity of each function that is more complex than a number."""
    if len(WORDS.findall(source)) < above:
        return
    lines = source.splitlines()
    for name, function in functions(ast.parse(source)):
        text = "\n".join(lines[function.lineno - 1 : function.end_lineno])
        if len(WORDS.findall(text)) >= above and (number := complexity(function)) > above:
            yield name, number


def measured(above: int) -> dict[str, int]:
    """Return the complexity of each function of the package that is more complex than a number."""
    return {
        f"{file.relative_to(PACKAGE).as_posix()}::{name}": number
        for file in PACKAGE.rglob("*.py")
        for name, number in complex_functions(file.read_text(encoding="utf-8"), above)
    }


def test_no_function_is_too_complex() -> None:
    assert not measured(HIGHEST), "decompose into functions with one job each, or replace branches by a table"


EXAMPLE = """
class Reader:
    async def read(self, rows=[a for a in b if c]):
        def inner():
            return x if y else z
        for row in rows:
            pass
        else:
            pass
        while True:
            break
        try:
            with a or b and c: pass
        except ValueError:
            pass
        else:
            assert a and b
        match row:
            case 1: pass
            case [2, *_]: pass
            case _: pass
        return lambda: [b for a in b if c if d]
"""


def test_decisions_are_counted_by_the_rules() -> None:
    # loop 2, while 1, try 2, operators 2, assertion 1, cases 2, comprehension 3; defaults are not of the body
    assert dict(complex_functions(EXAMPLE, 0)) == {"Reader.read": 14, "Reader.read.inner": 2}
    assert dict(complex_functions(EXAMPLE, 13)) == {"Reader.read": 14}
    assert not dict(complex_functions(EXAMPLE, 14))
