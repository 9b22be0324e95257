"""Parser of unit strings such as ``250 mm`` or ``2.5 kN/m``, with a strict grammar; dimensions by exponents, for
units of formulas.

    quantity := number unit                        unit    := ["1/"] product { "/" term }
    product  := term { ("*" | "." | blank) term }  term    := factor | "(" product ")"
    factor   := name [("^" | "**") whole number]
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

from eomgen.base.data import dataclass
from eomgen.base.messages import close_names, shown
from eomgen.errors import DescriptionError, Message, Problem
from eomgen.formula.units.table import NAMED, REFUSED, measure, names
from eomgen.formula.words import RESERVED, WORDS

if TYPE_CHECKING:
    from fractions import Fraction

LENGTH = 100
LARGEST_EXPONENT = 9
_NUMBER = r"[+-]?[ \t]*(?>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)"  # 1e3 is never 1 with a unit e3
_QUANTITY = rf"(?s)[ \t]*({_NUMBER})[ \t]*((?:1[ \t]*/[ \t]*)?[A-Za-z%\u0080-\U0010ffff].*)"
_DECIMAL_COMMA = r"[ \t]*([+-]?[0-9]+),([0-9]+)[ \t]*([A-Za-z]+)"
_WORD = r"[A-Za-z_][A-Za-z_0-9]*"
_FACTOR = r"([A-Za-z_][A-Za-z_0-9]*|%)(?:[ \t]*(?:\^|\*\*)[ \t]*([+-]?[0-9]{1,4}))?"
_TIMES = r"[ \t]*[*.][ \t]*|[ \t]+(?=[A-Za-z_(])"
_OVER = r"[ \t]*/[ \t]*"
_ADVICE = {
    "\u00b0": "deg",
    "\u00b2": "^2",
    "\u00b3": "^3",
    "-": "a blank between units",
    **dict.fromkeys("\u00b5\u03bc", "u for micro"),
    **dict.fromkeys("\u03a9\u2126", "ohm"),
    **dict.fromkeys("\u00b7\u22c5\u00d7", "a blank between units"),
}

#: Signs after a number that make a formula of the text, though not a formula that can be read.
_OF_FORMULAS = "\u2212\u2013\u2014\u00f7\u2264\u2265"

Factors = tuple[tuple[str, int], ...]


class UnitError(DescriptionError):
    """A unit string that cannot be read: ``what`` and ``hint`` are fault and remedy of the string."""

    def __init__(self, fault: str, hint: str = "") -> None:
        self.what = Message(fault)
        self.hint = hint
        super().__init__(Problem("unit", fault, hint))


@dataclass(frozen=True)
class QuantityWithUnit:
    """A number with a unit.

    Attributes
    ----------
    text : the user's text.
    number : exactly as written.
    factors : names of units and their exponents.
    """

    text: str
    number: Fraction
    factors: Factors


def is_quantity(text: str) -> bool:
    """Return whether a text begins as a number with a unit does, and as no formula can."""
    begin = text[:200]
    match = re.match(_QUANTITY, begin)
    if match is None:
        return re.match(_DECIMAL_COMMA, begin) is not None
    if match[2][0] in _OF_FORMULAS:
        return False
    word = re.match(_WORD, match[2])
    return word is None or word[0] not in WORDS


def read_quantity(text: str, known: Collection[str] = ()) -> QuantityWithUnit:
    """Return the number and the unit of a text such as ``250 mm``, without judging the dimension.

    Parameters
    ----------
    known : collection of str
        Names of the scene's parameters and inputs. A unit of such a name could be meant as a factor, and is refused.

    Raises
    ------
    UnitError
        For a text that is not a number with a unit, or whose unit is not known.
    """
    if len(text) > LENGTH:
        raise UnitError(f"a number with a unit has at most {LENGTH} characters, not {len(text)} [E0306]", '"250 mm"')
    comma = re.match(_DECIMAL_COMMA, text)
    if comma:
        raise UnitError(f"{shown(text)} has a comma in its number [E0307]", f'"{comma[1]}.{comma[2]} {comma[3]}"')
    match = re.fullmatch(_QUANTITY, text.rstrip(" \t"))
    if match is None:
        raise UnitError(f"{shown(text)} is not a number with a unit [E0308]", '"250 mm"')
    from fractions import Fraction  # noqa: PLC0415  # brings decimal arithmetic, which scenes without units do not need

    digits = match[1].replace(" ", "").replace("\t", "")
    number, value = Fraction(digits), float(digits)
    if not math.isfinite(value) or (value == 0.0 and number != 0):
        fault = f"the number of {shown(text)} is out of the range of double precision [E0309]"
        raise UnitError(fault, "a number between 1e-300 and 1e300")
    return QuantityWithUnit(text, number, _Unit(match[2], text, known).read())


def read_unit(text: str) -> Factors:
    """Read a unit alone, such as a label; ``1`` of plain numbers has no factors. Raises UnitError."""
    if not text.strip() or len(text) > LENGTH:
        raise UnitError(f"{shown(text)} is not a unit [E0310]", '"mm"')
    return () if text.strip(" \t") == "1" else _Unit(text.strip(" \t"), text, ()).read()


def factors_of(label: str) -> Factors | None:
    """Return the factors of a unit; None for a text that is not a unit, such as an empty one."""
    try:
        return read_unit(label)
    except UnitError:
        return None


class _Unit:
    """Reader of a unit from left to right: ``unit`` is the unit, ``text`` the whole text for messages, ``known`` are
    names that no unit may have, and ``place`` is the index of the next character."""

    def __init__(self, unit: str, text: str, known: Collection[str]) -> None:
        self.unit = unit
        self.text = text
        self.known = known
        self.place = 0

    def read(self) -> Factors:
        """Return a whole unit as pairs (name, exponent), negative after a stroke. Raises UnitError."""
        result: list[tuple[str, int]] = []
        divides = self.unit[0] == "1"
        if divides:
            self.place = 1
            if not self.accept(_OVER):
                raise self.syntax_error()
            result += self.term(-1)
        else:
            result += self.product(1)
        while self.place < len(self.unit):
            if self.accept(_OVER):
                result += self.term(-1)
                divides = True
            elif divides and self.accept(_TIMES):
                fault = f"{shown(self.text)} can be read in two ways [E0312]"
                raise UnitError(fault, "brackets, N/(m s), or the divisor last, N s/m")
            else:
                raise self.syntax_error()
        return tuple(result)

    def accept(self, pattern: str) -> bool:
        match = re.compile(pattern).match(self.unit, self.place)
        if match:
            self.place = match.end()
        return match is not None

    def product(self, sign: int) -> list[tuple[str, int]]:
        result = self.term(sign)
        while self.accept(_TIMES):
            result += self.term(sign)
        return result

    def term(self, sign: int) -> list[tuple[str, int]]:
        """Return a name with an exponent, or a product in brackets, as pairs (name, exponent times ``sign``), and move
        on. Raises UnitError."""
        if self.unit.startswith("(", self.place):
            self.place += 1
            if self.unit.count("(") > 1:
                raise UnitError(f"{shown(self.text)} has more brackets than a unit needs [E0313]", "N/(m s)")
            result = self.product(sign)
            if not self.unit.startswith(")", self.place):
                raise self.syntax_error()
            self.place += 1
            return result
        match = re.compile(_FACTOR).match(self.unit, self.place)
        if match is None:
            raise self.syntax_error()
        self.check(match[1])
        exponent = int(match[2] or 1)
        if not 1 <= abs(exponent) <= LARGEST_EXPONENT:
            fault = f"an exponent in {shown(self.text)} is not a whole number from 1 to {LARGEST_EXPONENT} [E0314]"
            raise UnitError(fault, "m^2, or s^-1")
        self.place = match.end()
        return [(match[1], sign * exponent)]

    def check(self, name: str) -> None:
        """Raise UnitError for a name that is not a unit, is refused, or is a name of the scene too."""
        if name in names():
            if name in self.known:
                fault = f"in {shown(self.text)}, {name} can be the unit or the scene's own {name} [E0315]"
                remedy = f"another name for the scene's own, a number in SI, or in a formula a * before {name}"
                raise UnitError(fault, remedy)
            return
        if name in REFUSED:
            fault, _, hint = REFUSED[name].partition("|")
            raise UnitError(f"{shown(name)} is not accepted as a unit: {fault} [E0316]", hint)
        if name in self.known or name in RESERVED:
            raise UnitError(f"{shown(name)} is not a unit [E0310]", f"a * before {name}")
        close = close_names(name, self.known, 1, 0.7)
        message = f"there is no unit {shown(name)} [E0317]"
        raise UnitError(message, f"a * before {close[0]}" if close else _nearest(name))

    def syntax_error(self) -> UnitError:
        rest = self.unit[self.place :].lstrip(" \t")
        if rest[:1] in _ADVICE:
            return UnitError(f"{shown(rest[0])} is not part of a unit [E0318]", _ADVICE[rest[0]])
        before = self.unit[: self.place].strip()
        unit = before.rstrip("*/ \t")
        of_formula = rest[:1].isdigit() and unit not in (before, "1")  # as 2.5 kg*2
        if of_formula or rest[:1] in ("+", "*", "<", ">", "["):
            number = self.text[: len(self.text.rstrip(" \t")) - len(self.unit)].strip()
            read = unit if of_formula else before
            fault = f"more follows {shown(f'{number} {read}')}, and units are not read within formulas [E0319]"
            return UnitError(fault, _parameter(number, read))
        where = f"at {shown(rest[:20])}" if rest else "at its end"
        fault = f"{shown(self.text)} is not a number with a unit: it is not well formed {where} [E0320]"
        return UnitError(fault, 'a number and its unit, as in "2.5 kN/m"')


def _nearest(name: str) -> str:
    """Return a hint for an unknown name of a unit: with a separate exponent, in other letters, or of similar
    spelling."""
    power = re.fullmatch(r"([A-Za-z_]+)([0-9])", name)
    if power and power[1] in names():
        return f"{power[1]}^{power[2]}"
    folded = [known for known in names() if known.lower() == name.lower()]
    if folded:
        return " or ".join(folded[:3])
    if name.lower() in ("kph", "kmh", "kmph"):
        return "km/h"
    if name.lower() in ("bit", "bits"):
        return "the range divided by the number of steps, as 2**12 of 12 bits"
    close = close_names(name[:24], names(), cutoff=0.7)
    return " or ".join(close) or "one of m, mm, kg, s, rad, deg, N, kN/m, N m, rpm, km/h"


def in_formula(number: str, word: str) -> tuple[str, str]:
    """Return the fault of a number followed by a word within a formula, and a hint."""
    if word in names():
        fault = f"{shown(f'{number} {word}')} is within a formula, where units are not read [E1581]"
        return fault, _parameter(number, word)
    return f"the number {shown(number)} runs into a name [E1580]", f"a * after {number[:20]}"


def product_hint(number: str, unit: str) -> str:
    """Return the remedy of a number times a unit, as ``2*kg``; empty for a name that is not a unit."""
    return f'"{number[:20]} {unit}": a number, a space and its unit, alone' if unit in names() else ""


def _parameter(number: str, unit: str) -> str:
    return f'a parameter, name = "{number[:20]} {unit[:20]}", and its name here'


_BASE = {"[mass]": "kg", "[length]": "m", "[time]": "s", "[current]": "A", "[temperature]": "K"}
_ANGLE = "rad"


class Dimension(NamedTuple):
    """Exponents of a unit.

    Attributes
    ----------
    powers : of kg, m, s, A and K
    angle : of rad; None if unknown, because radians vanish in products: rad times m is a length
    """

    powers: tuple[float, ...]
    angle: float | None = 0.0

    def times(self, other: Dimension, sign: float = 1.0) -> Dimension:
        """Return the dimension of a product, of a quotient with ``sign`` -1."""
        return Dimension(tuple(a + sign * b for a, b in zip(self.powers, other.powers, strict=True)), None)

    def power(self, exponent: float) -> Dimension:
        """Return the dimension of a power."""
        return Dimension(tuple(exponent * each for each in self.powers), None)

    @property
    def is_number(self) -> bool:
        """Whether values are plain numbers or angles."""
        return not any(self.powers)

    def __str__(self) -> str:
        return _text(self)


@cache
def dimension_of(label: str) -> Dimension | None:
    """Return the dimension of a unit; None for a text that is not a unit."""
    factors = factors_of(label)
    return None if factors is None else _dimension(factors)


def _dimension(factors: Factors) -> Dimension:
    powers = measure(factors)[1]
    return Dimension(tuple(float(powers.get(base, 0)) for base in _BASE), float(powers.get("[angle]", 0)))


@cache
def _unit_names() -> dict[Dimension, str]:
    result: dict[Dimension, str] = {}
    for unit in NAMED:
        result.setdefault(_dimension(read_unit(unit)), unit)
    return result


@cache
def _text(dimension: Dimension) -> str:
    """Return the unit of SI with a dimension as text, by a common name if there is one; "1" for a plain number."""
    known = _unit_names().get(dimension if dimension.angle is not None else Dimension(dimension.powers))
    if known and not (known == "Hz" and dimension.angle is None):
        return known
    powers = [*zip(_BASE.values(), dimension.powers, strict=True), (_ANGLE, dimension.angle or 0.0)]
    above = [name if power == 1 else f"{name}^{power:g}" for name, power in powers if power > 0]
    below = [name if power == -1 else f"{name}^{-power:g}" for name, power in powers if power < 0]
    divisor = f"({' '.join(below)})" if len(below) > 1 else "".join(below)
    return f"{' '.join(above) or '1'}/{divisor}" if divisor else " ".join(above) or "1"
