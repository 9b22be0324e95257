"""The table of compositions: tabulated coefficients, and recursions of leapfrogs for any even order."""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Mapping, Sequence
from decimal import Decimal, localcontext

from eomgen.base.messages import nearest, shown
from eomgen.base.products import fault_of_removed
from eomgen.errors import Problem, UsageError
from eomgen.integrators.compositions.composition import Composition, Part

#: Digits of the computation of coefficients before rounding.
_DIGITS = 40
#: Largest order and largest number of leapfrogs of a recursion.
HIGHEST_ORDER, MOST_LEAPFROGS = 12, 100_000
_RECURSION = "Creutz and Gocksch 1989; Suzuki 1990; Yoshida 1990"
#: Recursions by name: leapfrogs on either side of the backward one.
_FORWARD: Mapping[str, int] = {"yoshida": 1, "suzuki": 2}


def leapfrog_recursion(order: int, forward: int, first: Part = "drift", name: str = "") -> Composition:
    """Return the composition of an even order by recursion of leapfrogs, each level with ``forward`` steps on either
    side of a backward one:

        S_{m+2}(h) = S_m(e)^i S_m(-s e) S_m(e)^i,   s = (2 i)^(1/(m + 1)),   e = h/(2 i - s)

    Parameters
    ----------
    order : 2 to ``HIGHEST_ORDER``
    forward : i, at least 1; 1 is Yoshida's (Forest and Ruth's at order 4), 2 Suzuki's
    first : first and last part of a step

    Raises
    ------
    UsageError
        An odd or too high order, or fewer than one step.
    """
    if order not in range(2, HIGHEST_ORDER + 1, 2) or forward < 1:
        fault = f"there is no recursion of leapfrogs of order {order} with {forward} on either side [E0327]"
        raise UsageError(Problem("composition", fault, f"an even order of 2 to {HIGHEST_ORDER}, and at least 1"))
    count = (2 * forward + 1) ** (order // 2 - 1)
    if count > MOST_LEAPFROGS:
        fault = f"a step of order {order} with {forward} leapfrogs on either side has {count} of them [E0328]"
        fewer = int((MOST_LEAPFROGS ** (1.0 / (order // 2 - 1)) - 1.0) / 2.0)
        hint = f"at most {fewer} on either side at this order, or a lower order"
        raise UsageError(Problem("composition", fault, hint))
    label = name or (f"creutz_gocksch{order}_{forward}" if order > 2 else "leapfrog")
    fractions, levels = _recursion(order, forward)
    return Composition(label, order, first, fractions, _RECURSION, levels)


@functools.lru_cache(maxsize=16)
def _recursion(order: int, forward: int) -> tuple[tuple[float, ...], tuple[tuple[float, ...], ...]]:
    """Return the fractions of drifts and kicks of a leapfrog recursion, and the step sizes of its levels. Half
    steps of adjacent leapfrogs are merged. `order` is even; `forward` leapfrogs stand on either side of a backward
    one."""
    levels = []
    with localcontext() as context:
        context.prec = _DIGITS
        leapfrogs = [Decimal(1)]
        for level in range(2, order, 2):
            back = Decimal(2 * forward) ** (Decimal(1) / Decimal(level + 1))
            ahead = 1 / (2 * forward - back)
            sides = [ahead] * forward
            sizes = (*sides, -back * ahead, *sides)
            levels.append(tuple(map(float, sizes)))
            leapfrogs = [outer * inner for outer in sizes for inner in leapfrogs]
        return _merge_leapfrogs(leapfrogs), tuple(levels)


def _merge_leapfrogs(sizes: Sequence[Decimal]) -> tuple[float, ...]:
    """Return the fractions of drifts and kicks of a product of leapfrogs, adjacent drifts merged."""
    halves = [Decimal(0), *(size / 2 for size in sizes), Decimal(0)]
    drifts = [before + after for before, after in itertools.pairwise(halves)]
    turns = [value for pair in zip(drifts, sizes, strict=False) for value in pair]
    return (*map(float, turns), float(drifts[-1]))


def _symmetric(half: str) -> tuple[Decimal, ...]:
    """Return a symmetric list of odd length from its first numbers, up to the middle one."""
    numbers = tuple(map(Decimal, half.split()))
    return *numbers, *numbers[-2::-1]


def _complete(half: Sequence[Decimal | str]) -> tuple[float, ...]:
    """Return the symmetric fractions of drifts and kicks in turn from the first, independent ones: the last two of the
    first half follow from the sums, which are 1."""
    numbers, last = list(map(Decimal, half)), len(half) % 2
    beside, middle = (sum(numbers[first::2], Decimal(0)) for first in (last, 1 - last))
    numbers += [Decimal("0.5") - beside, 1 - 2 * middle]
    return tuple(float(value) for value in (*numbers, *numbers[-2::-1]))


def _minimum_norm() -> tuple[float, ...]:
    """Return the two kicks whose commutators of third order have the smallest norm."""
    with localcontext() as context:
        context.prec = _DIGITS
        root = (2 * Decimal(326).sqrt() + 36) ** (Decimal(1) / 3)
        return _complete([Decimal("0.5") - root / 12 + 1 / (6 * root)])


_OMELYAN = "Omelyan, Mryglod and Folk 2003"
_BLANES = "Blanes, Casas and Sanz-Serna 2014"
_BLANES_MOAN = "Blanes and Moan 2002"
_KAHAN_LI = "Kahan and Li 1997"
#: Tabulated compositions by name: order, source, and fractions by the first part of a step; a single list is for both
#: first parts. The parameters of Omelyan, Mryglod and Folk's order 4 are the position version's for steps that begin
#: with a drift and the velocity version's for steps that begin with a kick; with parameters of the wrong version the
#: order is 2 or less.
_TABULATED: Mapping[str, tuple[int, str, Mapping[Part, tuple[float, ...]]]] = {
    "leapfrog": (2, "Verlet 1967", {"drift": (0.5, 1.0, 0.5)}),
    "minimum_norm2": (2, _OMELYAN, {"drift": _minimum_norm()}),
    "bcss3": (2, _BLANES, {"drift": _complete(("0.11888010966548", "0.29619504261126"))}),
    "omf4": (
        4,
        _OMELYAN,
        {
            "drift": _complete(
                ("0.2750081212332419", "-0.08442961950707149", "-0.1347950099106792", "0.3549000571574260")
            ),
            "kick": _complete(
                ("0.08398315262876693", "0.2539785108410595", "0.6822365335719091", "-0.03230286765269967")
            ),
        },
    ),
    "blanes_moan4": (
        4,
        _BLANES_MOAN,
        {
            "drift": _complete(
                ("0.0792036964311957", "0.209515106613362", "0.353172906049774", "-0.143851773179818",
                 "-0.0420650803577195")
            )
        },
    ),
    "blanes_moan6": (
        6,
        _BLANES_MOAN,
        {
            "drift": _complete(
                ("0.0502627644003922", "0.148816447901042", "0.413514300428344", "-0.132385865767784",
                 "0.0450798897943977", "0.067307604692185", "-0.188054853819569", "0.432666402578175",
                 "0.541960678450780")
            )
        },
    ),
    "kahan_li6": (
        6,
        _KAHAN_LI,
        {
            "drift": _merge_leapfrogs(
                _symmetric("0.39216144400731413928 0.33259913678935943860 -0.70624617255763935981"
                           " 0.08221359629355080023 0.79854399093482996340")
            )
        },
    ),
    "kahan_li8": (
        8,
        _KAHAN_LI,
        {
            "drift": _merge_leapfrogs(
                _symmetric("0.13020248308889008088 0.56116298177510838456 -0.38947496264484728641"
                           " 0.15884190655515560090 -0.39590389413323757734 0.18453964097831570709"
                           " 0.25837438768632204729 0.29501172360931029887 -0.60550853383003451170")
            )
        },
    ),
}  # fmt: skip  # a table
#: Names that contain the order, and the numbers of leapfrogs on either side of the backward leapfrog.
_BY_RULE = r"(yoshida|suzuki|creutz_gocksch)(\d+)(?:_(\d+))?"
#: Names of compositions in other programs.
_ALIASES: Mapping[str, str] = {
    "verlet": "leapfrog",
    "stoermer_verlet": "leapfrog",
    "forest_ruth": "yoshida4",
    "forest_ruth4": "yoshida4",
    "mn2": "minimum_norm2",
}


def composition_named(name: str, first: Part = "drift") -> Composition:
    """Return a composition by name: ``leapfrog``, ``minimum_norm2``, ``bcss3``, ``omf4``,
    ``blanes_moan4``, ``blanes_moan6``, ``kahan_li6``, ``kahan_li8``, or by rule ``yoshida<order>``,
    ``suzuki<order>``, ``creutz_gocksch<order>_<leapfrogs on either side>``.

    Parameters
    ----------
    first : first and last part of a step, ``drift`` or ``kick``

    Raises
    ------
    UsageError
        An unknown name, with the nearest known names, or an order that the rule does not have.
    """
    return _make_composition(_key(name), first)


def names_composition(name: str) -> bool:
    """Return whether a name is in the table, or follows a rule of the table, for any order."""
    rule = re.fullmatch(_BY_RULE, _key(name))
    return _key(name) in _TABULATED or (rule is not None and (rule[1] in _FORWARD) != bool(rule[3]))


def _key(name: str) -> str:
    key = str(name).lower().replace("-", "_")
    return _ALIASES.get(key, key)


@functools.lru_cache(maxsize=256)
def _make_composition(name: str, first: Part) -> Composition:
    if first not in ("drift", "kick"):
        fault = f"a step begins with a drift or a kick, not with {shown(first)} [E0329]"
        raise UsageError(Problem("first", fault, "drift"))
    if name in _TABULATED:
        order, source, lists = _TABULATED[name]
        return Composition(name, order, first, lists.get(first, lists["drift"]), source)
    rule = re.fullmatch(_BY_RULE, name)
    if rule is None or not names_composition(name):
        known = dict.fromkeys((*_TABULATED, "yoshida4", "yoshida6", "suzuki4", "suzuki6"))
        hint = nearest(name, known) or "yoshida<order>, suzuki<order> or one of " + ", ".join(_TABULATED)
        unknown = f"there is no composition {shown(name)} [E0330]", hint
        raise UsageError(Problem("composition", *(fault_of_removed("method", name) or unknown)))
    return leapfrog_recursion(int(rule[2]), _FORWARD.get(rule[1]) or int(rule[3]), first, name)


@functools.cache
def compositions(first: Part = "drift") -> tuple[Composition, ...]:
    """Return the compositions of the table, and the compositions of orders 4 to 8 by the rules of the table."""
    rules = [f"{rule}{order}" for order in (4, 6, 8) for rule in _FORWARD]
    names = (*_TABULATED, *rules, "creutz_gocksch4_3", "creutz_gocksch4_4")
    return tuple(_make_composition(name, first) for name in names)
