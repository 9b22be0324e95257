"""Formulas of scene files on Taylor series, by Python's own parser: docs/scene.md, "Values and formulas"."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

from tests.oracles.interpreter import jets
from tests.oracles.interpreter.jets import jet

FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sin": jets.sin,
    "cos": jets.cos,
    "tan": lambda x: jets.sin(x) / jets.cos(x),
    "asin": jets.asin,
    "acos": lambda x: 0.5 * math.pi - jets.asin(x),
    "atan": jets.atan,
    "sinh": lambda x: 0.5 * (jets.exp(x) - jets.exp(-jet(x))),
    "cosh": lambda x: 0.5 * (jets.exp(x) + jets.exp(-jet(x))),
    "tanh": jets.tanh,
    "exp": jets.exp,
    "log": jets.log,
    "sqrt": jets.sqrt,
    "abs": jets.absolute,
    "sign": jets.sign,
    "atan2": jets.atan2,
    "min": jets.minimum,
    "max": jets.maximum,
}

_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


class Names:
    """Names of formulas: plain ones, and quantities ``kind.name`` looked up when a formula asks for them."""

    def __init__(self, plain: Mapping[str, Any], quantity: Callable[[str, str], Any]) -> None:
        self.plain, self.quantity = {"pi": math.pi, **plain}, quantity


def evaluated(text: Any, names: Names) -> Any:
    """Evaluate a number or the text of a formula."""
    if not isinstance(text, str):
        return float(text)
    return _value(ast.parse(text.strip(), mode="eval").body, names)


def _value(node: ast.expr, names: Names) -> Any:
    match node:
        case ast.Constant(value=number):
            return float(number)
        case ast.Name(id=name):
            return names.plain[name]
        case ast.Attribute(value=ast.Name(id=kind), attr=name):
            return names.quantity(kind, name)
        case ast.Attribute(value=ast.Attribute(value=ast.Name(id=kind), attr=name), attr=part):
            return names.quantity(f"{kind}.{part}", name)
        case ast.Subscript(value=inner, slice=ast.Constant(value=index)):
            return _value(inner, names)[..., int(index)]
        case ast.BinOp(left=left, op=operation, right=right):
            return _BINARY[type(operation)](_value(left, names), _value(right, names))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand, names)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _value(operand, names)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return float(not _value(operand, names))
        case ast.BoolOp(op=operation, values=values):
            truths = [bool(_value(value, names)) for value in values]
            return float(all(truths) if isinstance(operation, ast.And) else any(truths))
        case ast.Compare(left=left, ops=operations, comparators=others):
            sides = [_value(side, names) for side in (left, *others)]
            pairs = zip(operations, sides, sides[1:], strict=False)
            return float(all(bool(_COMPARISONS[type(operation)](a, b)) for operation, a, b in pairs))
        case ast.IfExp(test=test, body=body, orelse=other):
            return _value(body if _value(test, names) else other, names)
        case ast.Call(func=ast.Name(id=name), args=arguments):
            function = FUNCTIONS.get(name) or names.plain[name]
            return function(*(_value(argument, names) for argument in arguments))
        case ast.Call(func=ast.Attribute(value=ast.Name(id=kind), attr=name), args=arguments):
            return names.quantity(kind, name)(*(_value(argument, names) for argument in arguments))
    raise ValueError(f"no formula of a scene: {ast.unparse(node)}")
