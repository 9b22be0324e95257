"""Formulas: what is read has the value that ordinary arithmetic gives; everything else is one clear message."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable
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


# Texts of formulas are expressions of Python too, whose grammar and arithmetic give their value.
UNARY = ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs"]


class Real(float):
    """A number whose operations raise an error where they have no finite value."""


def _checked(operation: Callable[..., Any]) -> Callable[..., Real]:
    def finite(*arguments: float) -> Real:
        value = operation(*map(float, arguments))
        if isinstance(value, complex) or not math.isfinite(value):
            raise ArithmeticError
        return Real(value)

    return finite


for _name in ("add", "sub", "mul", "truediv", "pow", "neg"):
    setattr(Real, f"__{_name}__", _checked(getattr(operator, _name)))
WORDS: dict[str, Any] = {name: Real(value) for name, value in {**VALUES, "t": 0.25}.items()} | {"R": Real}
WORDS |= {name: _checked(getattr(math, name, math.fabs)) for name in [*UNARY, "atan2"]}
WORDS |= {"lambda_": WORDS["lambda"], "min": min, "max": max}


def by_python(text: str) -> float | None:
    """Return the value by Python, or None if there is none."""
    numbers = re.sub(r"\d+\.\d*(e-?\d+)?", r"R(\g<0>)", text.replace("lambda", "lambda_"))
    try:
        return float(eval(numbers, {}, WORDS))
    except (ArithmeticError, ValueError):
        return None


_NUMBERS = st.integers(0, 10**5).map(lambda thousandths: repr(thousandths / 1000))
_LEAVES = st.one_of(_NUMBERS, st.sampled_from(["1.0e300", "2.5e-8", "709.0", "t", *VALUES]))
_COMPARED = st.tuples(_LEAVES, st.sampled_from(["<", "<=", ">", ">="]), _LEAVES).map(" ".join)
_CONDITIONS = st.tuples(_COMPARED, st.sampled_from([" and ", " or ", " and not ", " or not "]), _COMPARED).map("".join)


def _longer(texts: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return st.one_of(
        st.tuples(texts, st.sampled_from(["+", "-", "*", "/", "**"]), texts).map("".join),
        st.tuples(st.sampled_from([*UNARY, "-", ""]), texts).map(lambda parts: "{}({})".format(*parts)),
        st.tuples(st.sampled_from(["atan2", "min", "max"]), texts, texts).map(lambda of: "{}({}, {})".format(*of)),
        st.tuples(texts, _COMPARED | _CONDITIONS, texts).map(lambda parts: "{} if {} else {}".format(*parts)),
    )


@settings(max_examples=150, deadline=None)
@given(st.recursive(_LEAVES, _longer, max_leaves=9))
def test_reader_refuses_or_agrees_with_python(text: str) -> None:
    expected = by_python(text)
    try:
        formula = read_formula(text, NAMES, EVERYTHING)
    except FormulaError as error:
        assert re.search(r"has no finite value|is beyond 64|the divisor is zero", str(error)), error
        assert expected is None or "if" in text or "**" in text
        return
    if expected is None:
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
