"""Live values of a part of a function: a prediction of the registers that a card needs."""

from __future__ import annotations

from eomgen.codegen.program import Expression, FunctionPart, Statement
from eomgen.codegen.scheduling.few_live import most_live

#: Expressions that read no local value.
_LEAVES = frozenset({"K", "in", "w", "row", "numbers", "choice", "cell", "cells"})


def live_values(part: FunctionPart) -> int:
    """Return the largest number of local values that a statement of a part makes or later statements read."""
    return most_live([_step(statement) for statement in part.statements])


def _step(statement: Statement) -> tuple[list[int], list[int]]:
    """Return the local values that a statement reads, and the values that it makes."""
    match statement.kind, statement.data:
        case "let", (made, expression):
            return _locals(expression), [made]
        case "sincos", (sine, cosine, angle):
            return _locals(angle), [sine, cosine]
        case "angles", (triples,):
            made = [value for *pair, _ in triples for value in pair]
            return [value for *_, angle in triples for value in _locals(angle)], made
        case "out" | "save", (*_, expression):
            return _locals(expression), []
        case "repeat", (_, _, read, *_):
            return [value for expression in read for value in _locals(expression)], []
    return [], []


def _locals(expression: Expression) -> list[int]:
    if isinstance(expression, int):
        return [abs(expression)]
    kind, *operands = expression
    if kind in _LEAVES:
        return []
    return [value for operand in operands[: 1 if kind == "CURVE" else None] for value in _locals(operand)]
