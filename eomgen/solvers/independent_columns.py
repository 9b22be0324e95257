"""Which columns of a matrix are independent, taken from the left, and the others as combinations of these.

Orthogonalisation with a second pass (Giraud, Langou and Rozloznik 2005) gives the part of a column outside the span of
earlier ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from eomgen.base.arrays import Array

#: Part of a column that is rounding, and how much more of a column must be its own than of any that is left out.
ROUNDING, GAP = 1e-10, 1e3
#: Coefficients are decimal numbers of so many digits, or fractions, if they differ from these by rounding alone.
_DIGITS, _DENOMINATOR = 10, 360
_SAME = 1e-11


class NoGap(ArithmeticError):
    """Columns are so nearly dependent that rounding does not let it be told whether they are."""


@dataclass(frozen=True)
class IndependentColumns:
    """Columns of A: those ``kept``, and ``others``, which are A[:, kept] @ coefficients; columns of zeros are neither.

    Attributes
    ----------
    coefficients : (kept, others)
    own : smallest part of a kept column that none before it has
    left : largest part of any other column that the kept ones do not have: rounding
    """

    kept: tuple[int, ...]
    others: tuple[int, ...]
    coefficients: Array
    own: float
    left: float


def independent_columns(A: Array) -> IndependentColumns:
    """Return the independent columns of A, (rows, columns), with rows enough.

    Raises
    ------
    NoGap
        The difference of some columns is near rounding.
    """
    size = np.linalg.norm(A, axis=0)
    present = np.flatnonzero(size > ROUNDING * np.max(size, initial=0.0))
    unit = A[:, present] / size[present]
    basis = np.empty((len(A), min(A.shape)))
    kept, others, parts = list[int](), list[int](), list[float]()
    for place in range(len(present)):
        rest = unit[:, place]
        for _ in range(2):
            rest = rest - basis[:, : len(kept)] @ (basis[:, : len(kept)].T @ rest)
        part = float(np.linalg.norm(rest))
        parts.append(part)
        if part > ROUNDING and len(kept) < basis.shape[1]:
            basis[:, len(kept)] = rest / part
            kept.append(place)
        else:
            others.append(place)
    own, left = min((parts[k] for k in kept), default=1.0), max((parts[k] for k in others), default=0.0)
    if own < GAP * left:
        raise NoGap(f"a column differs from those before it by {own:.1e} of its norm, and rounding is {left:.1e}")
    solved = np.linalg.lstsq(unit[:, kept], unit[:, others], rcond=None)[0]
    solved[np.abs(solved) < 1e2 * ROUNDING] = 0.0
    scale = size[present]
    result = solved * scale[others] / scale[kept][:, np.newaxis]
    columns = present[kept], present[others]
    return IndependentColumns(
        tuple(map(int, columns[0])), tuple(map(int, columns[1])), np.vectorize(short, otypes=[float])(result), own, left
    )


def short(number: float) -> float:
    """Return a decimal number or a fraction that a number is up to rounding, else the number."""
    for candidate in (float(f"{number:.{_DIGITS}g}"), float(Fraction(number).limit_denominator(_DENOMINATOR))):
        if abs(candidate - number) <= _SAME * abs(number):
            return candidate
    return number
