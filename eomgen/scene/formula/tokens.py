"""Tokens of a formula for Python's parser: whitelisted tokens only, every name prefixed, columns recorded."""

from __future__ import annotations

import ast
import bisect
import math
import re
import unicodedata
from collections.abc import Mapping

from eomgen.base.messages import shown
from eomgen.errors import DescriptionError, Problem
from eomgen.formula.units.parser import in_formula
from eomgen.formula.words import WORDS

TEXT_LENGTH = 2000
DEPTH = 50
PREFIX = "n_"
_TOKEN = re.compile(
    r"(?P<space>["
    r" \t\r\n]+)|(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)|(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
    r"|(?P<operator>\*\*|<=|>=|//|==|!=|:=|&&|\|\||.)",
    re.DOTALL,
)
_OPERATORS = frozenset({"+", "-", "*", "/", "**", "(", ")", "[", "]", ",", ".", "<", "<=", ">", ">="})
_ADVICE = {
    "^": "** for powers",
    "//": "/",
    "==": "<= and >= together",
    "!=": "< or > together",
    "=": "the right side alone, or <= or >=",
}
_ADVICE |= {"&&": "and", "||": "or", "!": "not"}
#: Characters that stand for an operator elsewhere.
_SIGNS: Mapping[str, str] = {
    **dict.fromkeys("\u2212\u2013\u2014", "-"),
    **dict.fromkeys("\u00d7\u00b7\u22c5", "*"),
    "\u00f7": "/",
    "\u00b2": "**2",
    "\u00b3": "**3",
    "\u2264": "<=",
    "\u2265": ">=",
    "\u221a": "sqrt(x)",
    "%": 'a curve with outside = "periodic" for t % T',
    "?": "2 if t > 1 else 0, for t > 1 ? 2 : 0",
}
#: Words for angles in degrees or radians, which have special hints.
DEGREES = frozenset({"deg", "degs", "degree", "degrees", "radians", "rad", "deg2rad", "rad2deg", "\N{DEGREE SIGN}"})
#: Quantities of a geometrically exact beam in formulas.
ON_A_POINT = "position.NAME[0], with NAME in [points] at one of its nodes"
IN_RADIANS = 'angles are in radians: 45 * pi / 180, or "45 deg" alone'
TOO_DEEP = f"the formula is nested more than {DEPTH} deep [E1522]"
_ALPHABET = "ASCII letters, digits and + - * / ** ( ) [ ] , . < >"


class FormulaError(DescriptionError):
    """A formula that cannot be read: ``fault``, ``column`` (from 1) and ``hint``; ``what`` is fault with column,
    ``name`` the unknown name, if that is the fault."""

    def __init__(self, fault: str, column: int, hint: str = "", name: str = "") -> None:
        self.fault = fault
        self.what = f"{fault} (column {column})"
        self.column = column
        self.hint = hint
        self.name = name
        super().__init__(Problem("formula", self.what, hint))


class FormulaText:
    """The text of a formula, and ``aliased``, its form for the parser of Python.

    Parameters
    ----------
    text : str
        The formula as the user wrote it.

    Raises
    ------
    FormulaError
        For text that is not a token of the language, and for texts too long or nested too deep.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        self.aliased_starts: list[int] = []
        self.columns: list[int] = []
        if len(text) > TEXT_LENGTH:
            fault = f"the formula has {len(text)} characters, more than {TEXT_LENGTH} [E1577]"
            raise FormulaError(fault, TEXT_LENGTH + 1, "[definitions] for its parts")
        if not text.strip():
            raise FormulaError("the formula is empty [E1578]", 1, "a number")
        self.aliased = self.alias()

    def tree(self) -> ast.expr:
        """Return Python's tree of the formula, with names as in the text."""
        body = ast.parse(self.aliased, mode="eval").body
        for node in ast.walk(body):
            if isinstance(node, ast.Name):
                node.id = node.id.removeprefix(PREFIX)
            elif isinstance(node, ast.Attribute):
                node.attr = node.attr.removeprefix(PREFIX)
        return body

    def alias(self) -> str:
        """Return the text for the parser: whitelisted tokens only, names prefixed, numbers normalised; note columns for
        messages. Raises FormulaError for any other token."""
        pieces: list[str] = []
        length = brackets = 0
        before = ("", "")
        for match in _TOKEN.finditer(self.text):
            kind, token, column = str(match.lastgroup), match.group(), match.start() + 1
            if kind == "space":
                piece = " " if pieces else ""  # Python takes a blank at the start for an indentation
            elif kind == "number":
                piece = self.number_text(token, column, match.end())
            elif kind == "name":
                if before[0] == "number" and token not in WORDS:
                    raise self.beside(before[1], token, self.columns[-1] if pieces[-1] != " " else self.columns[-2])
                piece = token if token in WORDS and before != ("operator", ".") else PREFIX + token
            elif token in _OPERATORS:
                brackets += (token in "([") - (token in ")]")
                if brackets > DEPTH:
                    raise FormulaError(TOO_DEEP, column, "a shorter formula")
                piece = token
            else:
                raise self.refusal(token, column)
            self.aliased_starts.append(length)
            self.columns.append(column)
            pieces.append(piece)
            length += len(piece)
            if kind != "space":
                before = (kind, token)
        return "".join(pieces)

    def number_text(self, token: str, column: int, end: int) -> str:
        if end < len(self.text) and (self.text[end].isalnum() or self.text[end] == "_"):
            word = re.match(r"[A-Za-z_0-9]*", self.text[end:])
            raise self.beside(token, word[0] if word else "", column)
        if token.isdigit() and len(token) <= 15:
            return str(int(token))
        value = float(token)
        if not math.isfinite(value):
            raise FormulaError(f"the number {shown(token)} is too large [E1579]", column, "a number below 1e308")
        return repr(value)

    def beside(self, number: str, word: str, column: int) -> FormulaError:
        """Return, without raising, the error for a number with a word directly after, as ``2x`` or ``5 mm``."""
        if word in DEGREES:
            return FormulaError(f"the number {shown(number)} runs into a name [E1580]", column, IN_RADIANS)
        fault, hint = in_formula(number, word)
        return FormulaError(fault, column, hint)

    def refusal(self, token: str, column: int) -> FormulaError:
        if token == "=" and column == 1:
            return FormulaError("a formula does not begin with '=' [E1582]", column, "the formula without it")
        if token in _ADVICE:
            return FormulaError(f"the operator {shown(token)} is not part of formulas [E1583]", column, _ADVICE[token])
        if token in "'\"`":
            return FormulaError("a text in quotes is not part of formulas [E1584]", column, "names without quotes")
        title = "" if token.isascii() else f" (U+{ord(token):04X} {unicodedata.name(token, 'unnamed')})"
        hint = IN_RADIANS if token in DEGREES else _SIGNS.get(token, _ALPHABET)
        return FormulaError(f"the character {shown(token)}{title} is not part of formulas [E1585]", column, hint)

    def column(self, offset: int) -> int:
        """Return the user's column (from 1) for an offset in the parser's text."""
        if offset >= len(self.aliased):
            return len(self.text) + 1
        return self.columns[bisect.bisect_right(self.aliased_starts, offset) - 1]
