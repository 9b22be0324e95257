"""The table of units of scene files: names, sizes and dimensions.

Angles are a dimension of their own here, so that a torque is not a stiffness, and a frequency is not an angular speed.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from fractions import Fraction


class Unit(NamedTuple):
    """A unit.

    Attributes
    ----------
    symbol : the short name, which takes the short prefixes if ``prefixed``.
    words : long names, separated by blanks, which take the long prefixes and a plural s; definitions use the first.
    definition : by units above; in brackets a dimension, for the unit of SI.
    coherent : the unit of SI of the same kind, in the form of a unit string.
    """

    symbol: str
    words: str
    definition: str
    coherent: str
    prefixed: bool = False


_TURN = "6.28318530717958647692528676655900576839433879875021"  # 2 pi, to more digits than a double has
UNITS = (
    Unit("m", "meter metre", "[length]", "m", True),
    Unit("g", "gram", "0.001 * [mass]", "kg", True),
    Unit("s", "second sec", "[time]", "s", True),
    Unit("rad", "radian", "[angle]", "rad", True),
    Unit("A", "ampere", "[current]", "A", True),
    Unit("K", "kelvin", "[temperature]", "K"),
    Unit("N", "newton", "kilogram * meter / second**2", "N", True),
    Unit("Nm", "newton_meter", "newton * meter", "N m", True),
    Unit("J", "joule", "newton * meter", "J", True),
    Unit("W", "watt", "joule / second", "W", True),
    Unit("Pa", "pascal", "newton / meter**2", "Pa", True),
    Unit("Hz", "hertz", "1 / second", "Hz", True),
    Unit("V", "volt", "watt / ampere", "V", True),
    Unit("C", "coulomb", "ampere * second", "C", True),
    Unit("F", "farad", "coulomb / volt", "F", True),
    Unit("ohm", "ohm", "volt / ampere", "ohm", True),
    Unit("H", "henry", "volt * second / ampere", "H", True),
    Unit("T", "tesla", "volt * second / meter**2", "T", True),
    Unit("Wb", "weber", "volt * second", "Wb", True),
    Unit("deg", "degree", f"{_TURN} / 360 * radian", "rad"),
    Unit("arcmin", "arcminute", "degree / 60", "rad"),
    Unit("arcsec", "arcsecond", "degree / 3600", "rad"),
    Unit("rev", "revolution turn", f"{_TURN} * radian", "rad"),
    Unit("min", "minute", "60 * second", "s"),
    Unit("h", "hour", "3600 * second", "s"),
    Unit("rpm", "revolution_per_minute", "revolution / minute", "rad/s"),
    Unit("L", "liter litre", "0.001 * meter**3", "m^3", True),
    Unit("tonne", "tonne", "1000 * kilogram", "kg"),
    Unit("bar", "bar", "1e5 * pascal", "Pa", True),
    Unit("g0", "standard_gravity", "9.80665 * meter / second**2", "m/s^2"),
    Unit("kgf", "kilogram_force kilopond", "kilogram * standard_gravity", "N"),
    Unit("PS", "metric_horsepower", "75 * kilogram_force * meter / second", "W"),
    Unit("in", "inch inches", "0.0254 * meter", "m"),
    Unit("ft", "foot feet", "12 * inch", "m"),
    Unit("yd", "yard", "3 * foot", "m"),
    Unit("mi", "mile", "1760 * yard", "m"),
    Unit("mph", "mile_per_hour", "mile / hour", "m/s"),
    Unit("lb", "pound", "0.45359237 * kilogram", "kg"),
    Unit("lbf", "pound_force", "pound * standard_gravity", "N"),
    Unit("slug", "slug", "pound_force * second**2 / foot", "kg"),
    Unit("psi", "pound_force_per_square_inch", "pound_force / inch**2", "Pa"),
    Unit("hp", "horsepower", "550 * foot * pound_force / second", "W"),
)
PREFIXES = (
    ("G", "giga", "1e9"),
    ("M", "mega", "1e6"),
    ("k", "kilo", "1000"),
    ("h", "hecto", "100"),
    ("da", "deca", "10"),
    ("d", "deci", "0.1"),
    ("c", "centi", "0.01"),
    ("m", "milli", "0.001"),
    ("u", "micro", "1e-6"),
    ("n", "nano", "1e-9"),
)
#: Names that are not units here, with the reason; a hint after the stroke.
REFUSED = {
    **dict.fromkeys(
        ("degC", "celsius", "degreeC", "degF", "fahrenheit"),
        "a temperature with its own zero cannot be multiplied|a number of K",
    ),
    **dict.fromkeys(("percent", "%"), "a part of a hundred is a number|the number, 0.05 for five percent"),
    "cycle": "a cycle is an angle for some and a number for others|rev for a turn, or Hz for a frequency",
    "t": "t is the time in formulas|tonne",
    "d": "a day is not needed by machines|24 h for each",
}
#: Dimensions that have a name, by a unit of the dimension.
NAMED = {
    "m": "a length",
    "m^2": "an area",
    "m^3": "a volume",
    "kg": "a mass",
    "s": "a time",
    "rad": "an angle",
    "A": "a current",
    "K": "a temperature",
    "V": "a voltage",
    "m/s": "a speed",
    "m/s^2": "an acceleration",
    "rad/s": "an angular speed",
    "rad/s^2": "an angular acceleration",
    "N": "a force",
    "N m": "a torque",
    "J": "an energy",
    "N m/rad": "a torsional stiffness",
    "N m s/rad": "a torsional damping",
    "N/m": "a stiffness",
    "N s/m": "a damping",
    "kg m^2": "a moment of inertia",
    "kg/m^3": "a density",
    "Hz": "a frequency",
    "W": "a power",
    "Pa": "a pressure",
}


class UnitName(NamedTuple):
    """A known name of a unit: the long name, the SI unit of the same kind, and whether the name is that SI unit."""

    word: str
    coherent: str
    is_coherent: bool


@cache
def names() -> dict[str, UnitName]:
    """Return every name of a unit, with and without prefixes."""
    return dict(_every())


def _every() -> Iterator[tuple[str, UnitName]]:
    for unit in UNITS:
        words = unit.words.split()
        first = words[0]
        plain = UnitName(first, unit.coherent, unit.coherent.replace(" ", "") == unit.symbol)
        yield unit.symbol, plain
        for word in words:
            yield from ((name, plain) for name in _numbers(word))
        for short, long, _ in PREFIXES if unit.prefixed else ():
            named = UnitName(long + first, unit.coherent, short + unit.symbol == unit.coherent)
            yield short + unit.symbol, named
            for word in words:
                yield from ((name, named) for name in _numbers(long + word))


def _numbers(word: str) -> tuple[str, ...]:
    """Return a word in the singular and, if it ends with s, the plural."""
    return (word,) if word.endswith(("foot", "feet", "inch", "inches", "hertz", "henry")) else (word, f"{word}s")


#: Size of a unit, the coherent unit of SI being 1, as an exact fraction, and the exponents of its dimensions.
Measure = tuple["Fraction", dict[str, int]]
_TERM = re.compile(r"([*/]?) *([a-z_]+|\[[a-z]+\]|[0-9.e]+)(?:\*\*([0-9]))?")


@cache
def _measures() -> dict[str, Measure]:
    """Return the measure of each unit by its long name, with and without prefixes."""
    from fractions import Fraction  # noqa: PLC0415  # a compiled model knows its units

    result: dict[str, Measure] = {}
    for unit in UNITS:
        terms = []
        for sign, word, power in _TERM.findall(unit.definition):
            plain = (Fraction(1), {word: 1}) if word[0] == "[" else (Fraction(word), {}) if word[0].isdigit() else None
            terms.append((plain or result[word], int(power or 1) * (-1 if sign == "/" else 1)))
        first = unit.words.split()[0]
        size, dimension = result[first] = _product(terms)
        for _, long, factor in PREFIXES if unit.prefixed else ():
            result[long + first] = Fraction(factor) * size, dimension
    return result


def _product(terms: Iterable[tuple[Measure, int]]) -> Measure:
    """Return the measure of the product of units with exponents."""
    size: Any = 1
    dimension: dict[str, int] = {}
    for (factor, unit_powers), exponent in terms:
        size = factor**exponent * size
        for name, power in unit_powers.items():
            dimension[name] = dimension.get(name, 0) + exponent * power
    return size, {name: power for name, power in dimension.items() if power}


@cache
def measure(factors: tuple[tuple[str, int], ...]) -> Measure:
    """Return the measure of a product of named units with exponents."""
    return _product((_measures()[names()[name].word], exponent) for name, exponent in factors)
