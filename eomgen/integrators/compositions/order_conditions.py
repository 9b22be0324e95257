"""Order of a composition of two flows, from its coefficients alone.

A step is a product of exponentials exp(c h A) and exp(c h B) of two operators that do not commute. It has order p if
its series agrees with the series of exp(h (A + B)) in all words of up to p letters A and B; in the latter a word of n
letters has the coefficient 1/n!.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from eomgen.base.arrays import Array

#: Words up to this length are looked at.
MOST_LETTERS = 12
#: Defects of words that are rounding, relative to the word's value by absolute coefficients.
ROUNDING = 1e-13


def word_defects(alternating: Sequence[float], letters: int) -> list[Array]:
    """Return for every number of letters up to ``letters`` the defects of words of a step's series against
    exp(h (A + B)); array n has 2^n words, as binary numbers.

    Parameters
    ----------
    alternating : fractions of a step, of A, B, A, ... in turn
    """
    words = [np.ones(1), *(np.zeros(2**length) for length in range(1, letters + 1))]
    for place, fraction in enumerate(alternating):
        second = place % 2
        after = [array.copy() for array in words]
        for length in range(1, letters + 1):
            for appended in range(1, length + 1):
                heads = np.arange(2 ** (length - appended)) << appended
                tails = heads | (2**appended - 1 if second else 0)
                after[length][tails] += fraction**appended / math.factorial(appended) * words[length - appended]
        words = after
    return [array - 1 / math.factorial(length) for length, array in enumerate(words)]


def order_of(alternating: Sequence[float], most: int = MOST_LETTERS) -> int:
    """Return the order of a step of any two flows by its coefficients; 0 if these do not sum up to 1.

    Parameters
    ----------
    alternating : fractions of a step, of A, B, A, ... in turn
    most : orders beyond this are not looked for
    """
    total = max(1.0, math.fsum(abs(fraction) for fraction in alternating))
    defects = word_defects(alternating, most)
    for length in range(1, most + 1):
        allowed = ROUNDING * total**length / math.factorial(length)
        if np.abs(defects[length]).max() > max(allowed, ROUNDING):
            return length - 1
    return most
