"""Formulas: what is read has the value that ordinary arithmetic gives; everything else is one clear message."""

from __future__ import annotations

import math
import operator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eomgen.errors import DescriptionError
from eomgen.formula.evaluate import evaluate, symbols
from eomgen.formula.nodes import Formula, Number, Operation, Symbol
from eomgen.scene.forces import springs
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import (
    EVERYTHING,
    FIXED_PARAMETERS,
    PARAMETERS,
    SPRING_FORCE,
    STATE,
    TIME,
    ElementQuantity,
    SceneNames,
)
from eomgen.scene.formula.tokens import FormulaError

NAMES = SceneNames(
    parameters={"length": False, "lambda": True, "double": False, "q": False},
    inputs=("torque",),
    joints={"hinge": "revolute", "ball": "spherical", "float": "free", "weld": "fixed", "not": "prismatic"},
    points=("tip",),
    offered={kind: ElementQuantity("springs", scope, ("strut",)) for kind, scope in springs.SECTION.offers.items()},
)
VALUES = {"length": 0.5, "lambda": 3.0, "double": -2.0, "q": 7.0}


def value_of(symbol: Symbol) -> float:
    return 0.25 if symbol.kind == "time" else VALUES[symbol.name]


def value(text: str) -> float:
    return evaluate(read_formula(text, NAMES, EVERYTHING), value_of)


def refusal(text: str) -> str:
    with pytest.raises(FormulaError) as caught:
        read_formula(text, NAMES, EVERYTHING)
    assert isinstance(caught.value, DescriptionError)
    message = str(caught.value)
    assert "\n" not in message
    assert message.isascii()
    assert len(message) < 400
    return message


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("012", 12.0),
        (".5e1", 5.0),
        ("-2**2", -4.0),
        ("2**3**2", 512.0),
        ("2*lambda - 1", 5.0),
        ("double + q", 5.0),
        ("  7 - 2 - 1\n", 4.0),
        ("1 +\n\t2", 3.0),
        ("sin(pi/6) + t", math.sin(math.pi / 6) + 0.25),
        ("1 if t < 0.25 else 2", 2.0),
        ("1 if 0 < t < 1 and not t > 0.5 else 2", 1.0),
        ("1 if t > 1 or t >= 0.25 else 2", 1.0),
        ("10 * (t < 1)", 10.0),
        ("sqrt(t - 1) if t > 1 else 5", 5.0),
        ("sign(-3) + sign(0) + abs(-2)", 1.0),
        ("atan2(1, -1)", 3 * math.pi / 4),
    ],
)
def test_value(text: str, expected: float) -> None:
    assert value(text) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("t", Symbol("time")),
        ("q.hinge", Symbol("q", "hinge")),
        ("q.ball[3]", Symbol("q", "ball", 3)),
        ("a.float[5]", Symbol("a", "float", 5)),
        ("q.not", Symbol("q", "not")),
        ("position.tip[2]", Symbol("position", "tip", 2)),
        ("tension.strut", Symbol("tension", "strut")),
        ("energy.base_power", Symbol("energy", "base_power")),
        ("-1.5", Number(-1.5)),
        ("t > 2", Operation("lt", (Number(2.0), Symbol("time")))),
    ],
)
def test_nodes(text: str, expected: Formula) -> None:
    assert read_formula(text, NAMES, EVERYTHING) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the formula is empty (column 1)"),
        ("lengt", "unknown name 'lengt' (column 1); try: length"),
        ("hinge", "'hinge' is a joint, not a number (column 1); try: q.hinge or v.hinge"),
        ("q.hing", "q.hing: there is no joint 'hing' (column 1); try: hinge"),
        ("q.weld", "q.weld: a fixed joint has no coordinates (column 1)"),
        ("sin", "the function sin needs arguments (column 1); try: sin(x)"),
        ("2x", "the number '2' runs into a name (column 1); try: a * after 2"),
        ("t / 0", "the divisor is zero (column 5); try: another divisor"),
        ("1e999", "the number '1e999' is too large"),
        ("t*log(-1)", "the constant log(-1) has no finite value (column 3)"),
        ("q.hinge[-1]", "an index must be a whole number"),
        ("1 < 2 if t else 3", "a condition is needed here"),
    ],
)
def test_refusal(text: str, message: str) -> None:
    assert message in refusal(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("__import__('os').system('true')", "a text in quotes is not part of formulas (column 12)"),
        ("t.__class__", "unknown quantity 't' (column 1)"),
        ("q.__class__.__bases__", "only quantities such as q.joint"),
        ("q.hinge()", "q.hinge is a quantity, not a function (column 1); try: q.hinge without brackets"),
        ("sin(*t)", "sin() takes 1 argument, not 0"),
        ("atan2(t)", "atan2() takes 2 arguments, not 1 (column 1); try: atan2(y, x)"),
        ("sin(x=t)", "the operator '=' is not part of formulas (column 6)"),
        ("(x := 3)", "the character ':=' is not part of formulas (column 4)"),
        ("[t for t in q]", "the formula is not well formed at 't for t in q]' (column 2)"),
        ("[t]", "this is not a number, a name, an operation or a function (column 1)"),
        ("True", "unknown name 'True'"),
        ("'t'", "a text in quotes is not part of formulas (column 1)"),
        ("t\x00", "the character '\\x00'"),
        ("+".join(["t"] * 60), "nested more than 50 deep (each term of a long sum counts)"),
        ("10**10**10", "the exponent 1e+10 is beyond 64 (column 5)"),
        ("9" * 400, "is too large (column 1)"),
        ("(" * 200 + "t" + ")" * 200, "nested more than 50 deep (column 51)"),
        ("-" * 1990 + "t", "nested more than 50 deep"),
        ("t " * 1001, "the formula has 2002 characters, more than 2000"),
    ],
)
def test_hostile(text: str, message: str) -> None:
    assert message in refusal(text)


def test_operators_write_what_the_reader_makes() -> None:
    x, y = Symbol("time"), Symbol("parameter", "k")
    made = -(2.0 * x + y) / (1 + x * 3.0 - y)
    assert made == read_formula("-(2*t + k) / (1 + t*3 - k)", SceneNames(parameters={"k": False}), EVERYTHING)


def test_sum_of_many_arguments_stays_flat() -> None:
    formula = read_formula(f"max({','.join(['t'] * 900)})", NAMES, EVERYTHING)

    def depth(node: Formula) -> int:
        return 1 + max(depth(argument) for argument in node.arguments) if isinstance(node, Operation) else 1

    assert depth(formula) == 11
    assert symbols(formula) == {Symbol("time")}


@pytest.mark.parametrize(
    ("text", "allowed"),
    [
        ("length", "fixed parameter time spring state everything"),
        ("lambda", "parameter time spring state everything"),
        ("t", "time spring state everything"),
        ("torque", "spring state everything"),
        ("q.hinge", "spring state everything"),
        ("tension.strut", "state everything"),
        ("a.hinge", "everything"),
        ("energy.base_power", "everything"),
    ],
)
def test_scope(text: str, allowed: str) -> None:
    names = ["fixed", "parameter", "time", "spring", "state", "everything"]
    scopes = dict(zip(names, (FIXED_PARAMETERS, PARAMETERS, TIME, SPRING_FORCE, STATE, EVERYTHING), strict=True))
    for name, scope in scopes.items():
        if name in allowed.split():
            read_formula(text, NAMES, scope)
        else:
            with pytest.raises(FormulaError, match="cannot be used here"):
                read_formula(text, NAMES, scope)


# A tree of plain tuples, its text with the brackets it needs, and its value by Python's own arithmetic.
Tree = tuple
INFIX = {"+": 5, "-": 5, "*": 6, "/": 6, "**": 8}
CALLS: dict[str, Any] = {"abs": abs, "min": min, "max": max, "atan2": math.atan2}
UNARY = ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt"]
CALLS |= {name: getattr(math, name) for name in UNARY}
UNARY = sorted([*UNARY, "abs"])
COMPARISONS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
ARITHMETIC = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "**": operator.pow}
OTHERS: dict[str, Any] = {
    "negative": operator.neg,
    "not": operator.not_,
    "and": lambda a, b: a and b,
    "or": lambda a, b: a or b,
    "if": lambda condition, a, b: a if condition else b,
}


class NoValueError(Exception):
    """The reference has no finite value."""


def rendered(tree: Tree) -> tuple[str, int]:
    """Return the text of a tree with the brackets it needs, and how tightly it binds."""
    head, *rest = tree
    if head in ("number", "name"):
        return str(rest[0]), 9

    def part(branch: Tree, level: int) -> str:
        text, tightness = rendered(branch)
        return text if tightness >= level else f"({text})"

    if head in INFIX:
        level = INFIX[head]
        left, right = (level + 1, 7) if head == "**" else (level, level + 1)
        return f"{part(rest[0], left)}{head}{part(rest[1], right)}", level
    if head == "negative":
        return f"-{part(rest[0], 7)}", 7
    if head in COMPARISONS:
        return f"{part(rest[0], 5)} {head} {part(rest[1], 5)}", 4
    if head == "not":
        return f"not {part(rest[0], 3)}", 3
    if head in ("and", "or"):
        level = 2 if head == "and" else 1
        return f"{part(rest[0], level)} {head} {part(rest[1], level + 1)}", level
    if head == "if":
        return f"{part(rest[1], 1)} if {part(rest[0], 1)} else {part(rest[2], 0)}", 0
    return f"{head}({', '.join(part(branch, 0) for branch in rest)})", 9


def reference(tree: Tree, lazy: bool = True) -> float:
    """Return the value; with ``lazy`` off, both branches of a choice must have one."""
    head, *rest = tree
    if head == "number":
        return float(rest[0])
    if head == "name":
        return {"t": 0.25, **VALUES}[rest[0]]
    if head == "if" and lazy:
        return reference(rest[1] if reference(rest[0]) else rest[2])
    values = [reference(branch, lazy) for branch in rest]
    try:
        result = (COMPARISONS | CALLS | ARITHMETIC | OTHERS)[head](*values)
    except (ArithmeticError, ValueError) as error:
        raise NoValueError from error
    if isinstance(result, complex) or not math.isfinite(result):
        raise NoValueError
    return float(result)


def constant(tree: Tree) -> bool:
    return tree[0] == "number" or (tree[0] != "name" and all(constant(branch) for branch in tree[1:]))


def faulty(tree: Tree) -> bool:
    """Tell whether a constant part has no finite value, an exponent is too large, or a divisor is a constant zero."""
    if tree[0] in ("number", "name"):
        return False
    if any(faulty(branch) for branch in tree[1:]):
        return True
    try:
        if tree[0] == "**" and constant(tree[2]) and abs(reference(tree[2], lazy=False)) > 64:
            return True
        if tree[0] == "/" and constant(tree[2]) and reference(tree[2], lazy=False) == 0.0:
            return True
        if constant(tree):
            reference(tree, lazy=False)
    except NoValueError:
        return True
    return False


# Short texts and shallow trees: a tree must never meet the limits of the language, whose refusals are tested above.
numbers = st.one_of(
    st.integers(0, 100).map(str),
    st.integers(0, 10**6).map(lambda thousandths: repr(thousandths / 1000)),
    st.sampled_from(["1e-300", "1e300", "2.5e-8", "709.0"]),
)
leaves = st.one_of(st.tuples(st.just("number"), numbers), st.tuples(st.just("name"), st.sampled_from(["t", *VALUES])))


@st.composite
def conditions(draw: st.DrawFn, depth: int = 1) -> Tree:
    kind = draw(st.sampled_from(["compare", "not", "and", "or"])) if depth else "compare"
    if kind == "compare":
        return draw(st.sampled_from(sorted(COMPARISONS))), draw(leaves), draw(leaves)
    return (kind, *(draw(conditions(depth - 1)) for _ in range(1 if kind == "not" else 2)))


@st.composite
def trees(draw: st.DrawFn, depth: int = 3) -> Tree:
    kind = draw(st.sampled_from(["leaf", "infix", "infix", "negative", "unary", "binary", "if"])) if depth else "leaf"
    match kind:
        case "leaf":
            return draw(leaves)
        case "infix":
            return draw(st.sampled_from(sorted(INFIX))), draw(trees(depth - 1)), draw(trees(depth - 1))
        case "negative":
            return "negative", draw(trees(depth - 1))
        case "unary":
            return draw(st.sampled_from(UNARY)), draw(trees(depth - 1))
        case "binary":
            return draw(st.sampled_from(["atan2", "min", "max"])), draw(trees(depth - 1)), draw(trees(depth - 1))
    return "if", draw(conditions()), draw(trees(depth - 1)), draw(trees(depth - 1))


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(trees())
def test_reader_refuses_or_agrees_with_arithmetic(tree: Tree) -> None:
    text, _ = rendered(tree)
    if faulty(tree):
        with pytest.raises(FormulaError, match=r"has no finite value|is beyond 64|the divisor is zero"):
            read_formula(text, NAMES, EVERYTHING)
        return
    formula = read_formula(text, NAMES, EVERYTHING)
    try:
        expected = reference(tree)
    except NoValueError:
        with pytest.raises(ArithmeticError, match="has no finite value"):
            evaluate(formula, value_of)
    else:
        assert evaluate(formula, value_of) == expected


@pytest.mark.slow
@settings(max_examples=400, deadline=None)
@given(st.text(alphabet=st.one_of(st.sampled_from("qvat.[]()0123 +-*/<>=,'\"_{}:\\\n"), st.characters()), max_size=60))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        formula = read_formula(text, NAMES, EVERYTHING)
    except FormulaError as error:
        assert str(error).isascii()
        assert 1 <= error.column <= len(text) + 1
    else:
        assert isinstance(formula, Number | Symbol | Operation)
