"""Distributions of varied quantities, each by its quantile function, and their texts: ``normal(1, 0.1)``.

Every design draws points of the unit cube; a quantile function carries each coordinate to the quantity that it stands
for, so that one text serves random numbers, Latin hypercubes and sequences of low discrepancy.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence

import numpy as np
from scipy import special

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import nearest, shown
from eomgen.errors import Problem, UsageError
from eomgen.formula.units.labels import in_label
from eomgen.formula.units.parser import is_quantity

#: From probabilities in (0, 1), of any shape, to values.
Quantiles = Callable[[Array], Array]
_CALL = re.compile(r"^\s*([A-Za-z_]\w*)\s*\((.*)\)\s*$", re.DOTALL)


@dataclass(frozen=True)
class Distribution:
    """A distribution of one number.

    Attributes
    ----------
    text : as given
    quantiles : from probabilities to values
    upper : from probabilities of larger values to values: exact also if 1 minus the probability is rounding
    levels : (n,) the values of a list, equally likely, which a grid goes through; empty otherwise
    whole : whether all values are whole numbers
    """

    text: str
    quantiles: Quantiles
    levels: tuple[float, ...] = ()
    whole: bool = False
    upper: Quantiles | None = None


@dataclass(frozen=True)
class Kind:
    """A kind of distribution: names of arguments, conditions on arguments, and quantile function.

    ``pure`` are arguments without the unit of the quantity; ``upper`` is as of ``Distribution``.
    """

    arguments: tuple[str, ...]
    demand: str
    holds: Callable[..., bool]
    quantiles: Callable[..., Quantiles]
    pure: tuple[str, ...] = ()
    upper: Callable[..., Quantiles] | None = None


def _normal(mean: float, deviation: float) -> Quantiles:
    return lambda p: mean + deviation * special.ndtri(p)


def _truncated_normal(mean: float, deviation: float, low: float, high: float) -> Quantiles:
    first, last = special.ndtr((low - mean) / deviation), special.ndtr((high - mean) / deviation)
    return lambda p: np.clip(mean + deviation * special.ndtri(first + p * (last - first)), low, high)


def _lognormal(mean: float, deviation: float) -> Quantiles:
    variance = math.log1p((deviation / mean) ** 2)
    slope = math.copysign(math.sqrt(variance), deviation)
    return lambda p: mean * np.exp(slope * special.ndtri(p) - 0.5 * variance)


def _triangular(low: float, mode: float, high: float) -> Quantiles:
    split = (mode - low) / (high - low)

    def quantile(p: Array) -> Array:
        rising = low + np.sqrt(p * (high - low) * (mode - low))
        falling = high - np.sqrt((1.0 - p) * (high - low) * (high - mode))
        return np.where(p < split, rising, falling)

    return quantile


#: All kinds by name. Mean and standard deviation belong to the quantity, also if the logarithm of the quantity is
#: normal.
DISTRIBUTIONS: dict[str, Kind] = {
    "normal": Kind(
        ("mean", "deviation"), "deviation > 0", lambda m, s: s > 0.0, _normal, upper=lambda m, s: _normal(m, -s),
    ),
    "truncated_normal": Kind(
        ("mean", "deviation", "low", "high"),
        "deviation > 0, low < high, and some of it between them",
        lambda m, s, a, b: s > 0.0 and a < b and special.ndtr((b - m) / s) - special.ndtr((a - m) / s) > 1e-12,
        _truncated_normal,
    ),
    "lognormal": Kind(
        ("mean", "deviation"), "mean > 0, deviation > 0", lambda m, s: m > 0.0 and s > 0.0, _lognormal,
        upper=lambda m, s: _lognormal(m, -s),
    ),
    "uniform": Kind(("low", "high"), "low < high", lambda a, b: a < b, lambda a, b: lambda p: a + (b - a) * p),
    "loguniform": Kind(
        ("low", "high"), "0 < low < high", lambda a, b: 0.0 < a < b, lambda a, b: lambda p: a * (b / a) ** p
    ),
    "triangular": Kind(
        ("low", "mode", "high"), "low <= mode <= high, low < high", lambda a, c, b: a <= c <= b and a < b, _triangular
    ),
    "exponential": Kind(
        ("mean",), "mean > 0", lambda m: m > 0.0, lambda m: lambda p: -m * np.log1p(-p),
        upper=lambda m: lambda q: -m * np.log(q),
    ),
    "weibull": Kind(
        ("scale", "shape"), "scale > 0, shape > 0", lambda a, k: a > 0.0 and k > 0.0,
        lambda a, k: lambda p: a * (-np.log1p(-p)) ** (1.0 / k), ("shape",),
        lambda a, k: lambda q: a * (-np.log(q)) ** (1.0 / k),
    ),
    "integers": Kind(
        ("low", "high"), "whole numbers, low < high",
        lambda a, b: a.is_integer() and b.is_integer() and a < b and max(abs(a), abs(b)) < 2.0**52,
        lambda a, b: lambda p: np.minimum(a + np.floor(p * (b - a + 1.0)), b),
    ),
    "gumbel": Kind(
        ("location", "scale"), "scale > 0", lambda m, b: b > 0.0, lambda m, b: lambda p: m - b * np.log(-np.log(p)),
        upper=lambda m, b: lambda q: m - b * np.log(-np.log1p(-q)),
    ),
}  # fmt: skip  # a table
#: Lists of values: all of ``values``, and ``count`` between ends, evenly by difference or by ratio.
LISTS = ("values", "linspace", "logspace")


def read_distribution(where: str, text: str, unit: str = "") -> Distribution:
    """Return the distribution that a text says.

    Parameters
    ----------
    where : for messages
    text : ``normal(80 kN/m, 5 %)``, ``values(1, 2, 4)``, ``linspace(0, 1, 11)``: a name of ``DISTRIBUTIONS`` or
        ``LISTS`` with its arguments, numbers or numbers with units; a deviation may be a percentage of the mean
    unit : of the quantity, to which arguments with a unit are brought

    Raises
    ------
    UsageError
        For any other text, and for arguments of which the distribution makes no sense.
    """
    match = _CALL.match(text)
    example = f"{where.rpartition(' ')[2].partition('=')[0]}=normal(1, 0.1)"
    if match is None:
        raise UsageError(Problem(where, f"{shown(text)} is not a distribution [E0659]", example))
    name, words = match[1], [word.strip() for word in match[2].split(",")]
    if name in LISTS:
        levels = _levels(where, name, words, unit)
        values, last = np.array(levels), len(levels) - 1
        whole = all(level.is_integer() for level in levels)
        return Distribution(text, lambda p: values[np.minimum((p * len(levels)).astype(int), last)], levels, whole)
    if name not in DISTRIBUTIONS:
        hint = nearest(name, [*DISTRIBUTIONS, *LISTS])
        raise UsageError(Problem(where, f"there is no distribution {shown(name)} [E0660]", hint))
    kind = DISTRIBUTIONS[name]
    signature = f"{name}({', '.join(kind.arguments)})"
    if len(words) != len(kind.arguments):
        fault = f"{name} takes {len(kind.arguments)} numbers, not {len(words)} [E0661]"
        raise UsageError(Problem(where, fault, signature))
    numbers: list[float] = []
    for argument, word in zip(kind.arguments, words, strict=True):
        label = f"{where}: {argument}"
        if argument == "deviation" and word.endswith("%"):
            numbers.append(0.01 * read_number(label, word[:-1], "", signature) * abs(numbers[0]))
        else:
            numbers.append(read_number(label, word, "" if argument in kind.pure else unit, signature))
    if not kind.holds(*numbers):
        said = ", ".join(f"{argument} = {number:.9g}" for argument, number in zip(kind.arguments, numbers, strict=True))
        raise UsageError(Problem(where, f"{signature} needs {kind.demand}; here {said} [E0662]", example))
    upper = None if kind.upper is None else kind.upper(*numbers)
    return Distribution(text, kind.quantiles(*numbers), whole=name == "integers", upper=upper)


def from_normal(distribution: Distribution, z: Array) -> Array:
    """Return the values at which a quantity has the probabilities of a standard normal variable at z, of any shape."""
    below = distribution.quantiles(special.ndtr(np.minimum(z, 0.0)))
    share = special.ndtr(-np.maximum(z, 0.0))
    above = distribution.quantiles(1.0 - share) if distribution.upper is None else distribution.upper(share)
    return np.where(z < 0.0, below, above)


def _levels(where: str, name: str, words: Sequence[str], unit: str) -> tuple[float, ...]:
    """Return the levels of the list `name` (``values``, ``linspace`` or ``logspace``) from its arguments as words.
    Numbers are in `unit`, or converted to that unit. Raises UsageError for words that are not numbers, or a wrong
    count."""
    if name == "values":
        return tuple(read_number(where, word, unit, "values(1, 2, 4)") for word in words)
    signature = f"{name}(low, high, count)"
    if len(words) != 3:
        raise UsageError(Problem(where, f"{name} takes 3 numbers, not {len(words)} [E0663]", signature))
    low, high = (read_number(where, word, unit, signature) for word in words[:2])
    count = read_number(f"{where}: count", words[2], "", signature)
    if not (count.is_integer() and 2 <= count <= 100_000):  # more belong into a table
        fault = f"count must be a whole number from 2 to 100000, not {count:.9g} [E0664]"
        raise UsageError(Problem(where, fault, signature))
    if name == "logspace":
        if not (low > 0.0 and high > 0.0):
            fault = f"{name} needs ends above 0; here {low:.9g} and {high:.9g} [E0665]"
            raise UsageError(Problem(where, fault, "linspace"))
        return tuple(np.geomspace(low, high, int(count)).tolist())
    return tuple(np.linspace(low, high, int(count)).tolist())


def read_number(where: str, word: str, unit: str, signature: str) -> float:
    """Return the finite number of a word, converted to the unit if the word has a unit.

    Parameters
    ----------
    where, word : str
        Place in messages, and the word to read.
    unit : str
        Unit of the result.
    signature : str
        Remedy in messages.

    Raises
    ------
    UsageError
        For any other word; ``signature`` is the remedy.
    """
    try:
        number = float(word)
    except ValueError:
        if not is_quantity(word):
            raise UsageError(Problem(where, f"{shown(word)} is not a number [E0123]", signature)) from None
        number = in_label(where, word, unit)
    if not math.isfinite(number):
        raise UsageError(Problem(where, f"{shown(word)} is not finite [E0537]", signature))
    return number
