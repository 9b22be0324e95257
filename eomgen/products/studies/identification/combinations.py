"""Identifiable parts of unknowns by a Jacobian: columns that are combinations of others, in words.

Columns are taken from the left, so unidentifiable parts are counted with the unknown that is named first. A run
does not depend linearly on its parameters: of masses and stiffnesses, it may decide ratios alone. So each combination
is tried both as a sum and as a product, by runs away from the estimates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.base.arrays import Array

#: Part of a column, by its norm, that is rounding of a run and its derivatives.
ROUNDING = 1e-8
#: Coefficients that are rounding; distance from the estimates at which forms are tried, tolerated share of a change.
_SMALL, _AWAY, _LEFT = 1e-5, 0.05, 1e-6


@dataclass(frozen=True)
class Combination:
    """A combination of unknowns that the data determine, if they determine none of these alone.

    Attributes
    ----------
    text : in words
    members : names of the unknowns
    form : ``sum``, ``product``, or ``first order``: a sum at the estimates alone
    value, deviation : at the estimates, and its standard deviation
    low, high : its confidence interval
    """

    text: str
    members: tuple[str, ...]
    form: str
    value: float
    deviation: float
    low: float
    high: float


@dataclass(frozen=True)
class Structure:
    """Which columns are independent, and the others by these.

    Attributes
    ----------
    kept, others : columns of the Jacobian
    coefficients : (kept, others): J[:, others] = J[:, kept] @ coefficients
    """

    kept: tuple[int, ...]
    others: tuple[int, ...]
    coefficients: Array

    @property
    def mixed(self) -> tuple[int, ...]:
        """Kept columns that others depend on."""
        return tuple(k for k, row in zip(self.kept, self.coefficients, strict=True) if np.any(row))


def structure(J: Array, order: Sequence[int] | None = None) -> Structure:
    """Return the independent columns of J (rows, n), from the left or in another order."""
    places = range(J.shape[1]) if order is None else order
    norms = np.linalg.norm(J, axis=0)
    basis: list[Array] = []
    kept, others = list[int](), list[int]()
    for place in places:
        rest = J[:, place] / norms[place] if norms[place] > 0.0 else np.zeros(len(J))
        for _ in range(2):
            for one in basis:
                rest = rest - (one @ rest) * one
        own = float(np.linalg.norm(rest))
        if own > ROUNDING:
            kept.append(place)
            basis.append(rest / own)
        else:
            others.append(place)
    safe = np.where(norms > 0.0, norms, 1.0)
    unit = J / safe
    solved = np.linalg.lstsq(unit[:, kept], unit[:, others], rcond=None)[0]
    solved[np.abs(solved) < _SMALL] = 0.0
    return Structure(tuple(kept), tuple(others), solved * safe[others] / safe[kept][:, np.newaxis])


def form_of(found: Structure, other: int, x: Array, J: Array, change: Callable[[Array], float]) -> str:
    """Return the form in which inseparable unknowns are determined: sum, product or first order.

    Parameters
    ----------
    x : (n,) estimates
    J : (rows, n) there
    change : norm of the change of outputs from x to other unknowns, in the units of the rows of J
    """
    column, kept = found.coefficients[:, found.others.index(other)], list(found.kept)
    alone = _AWAY * (abs(float(x[other])) or 1.0) * float(np.linalg.norm(J[:, other]))
    left = {"sum": np.inf, "product": np.inf}
    for away in (_AWAY, -_AWAY):  # runs may fail on one side
        moved = x.copy()
        size = away * (abs(float(x[other])) or 1.0)
        moved[other] += size
        moved[kept] -= column * size
        left["sum"] = min(left["sum"], change(moved))
        if x[other] != 0.0 and np.all(x[kept][column != 0.0] != 0.0):
            turned = x.copy()
            turned[other] *= 1.0 + away
            exponents = np.divide(column * x[other], x[kept], out=np.zeros(len(kept)), where=column != 0.0)
            with np.errstate(over="ignore"):  # exponents that no product has
                turned[kept] *= (1.0 + away) ** -exponents
            left["product"] = min(left["product"], change(turned))
        if np.isfinite(left["sum"]):
            break
    # if only ratios count, zero differences do not change either, and are less informative
    return next((form for form in ("product", "sum") if left[form] <= _LEFT * alone), "first order")


def words(found: Structure, kept: int, names: Sequence[str], x: Array, form: str) -> tuple[str, float]:
    """Return a combination in words, and its value."""
    row = found.coefficients[found.kept.index(kept)]
    if form == "product":
        exponents = {kept: 1.0} | {o: float(c * x[o] / x[kept]) for o, c in zip(found.others, row, strict=True) if c}
        exponents = {place: _short(e) for place, e in exponents.items()}
        above = [_power(names[place], e) for place, e in exponents.items() if e > 0.0]
        below = [_power(names[place], -e) for place, e in exponents.items() if e < 0.0]
        value = float(np.prod([x[place] ** e for place, e in exponents.items()]))
        return " ".join(above) + "".join(f" / {text}" for text in below), value
    text, value = names[kept], float(x[kept])
    for other, c in zip(found.others, row, strict=True):
        if c:
            factor = _short(abs(float(c)))
            text += f" {'-' if c < 0.0 else '+'} {'' if factor == 1.0 else f'{factor:.6g} '}{names[other]}"
            value += float(c) * float(x[other])
    return text, value


def _power(name: str, exponent: float) -> str:
    return name if exponent == 1.0 else f"{name}^{exponent:.4g}"


def _short(number: float) -> float:
    """Return a multiple of 1/12 that a number is up to the errors of runs, else the number."""
    near = round(12.0 * number) / 12.0
    return near if abs(near - number) < 10.0 * _SMALL and near else number
