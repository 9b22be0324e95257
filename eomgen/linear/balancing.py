"""Balanced matrices: units of the state in which rows and columns are of like size (Parlett and Reinsch 1969)."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from eomgen.base.arrays import Array


def balance(A: Array, *, permute: bool = True) -> tuple[Array, Array]:
    """Return B = T^-1 A T and T, (n, n) both; T is diagonal, and permuted if ``permute`` is true.

    SciPy converts the scales to whole numbers, too, for it looks for permutations among them. Of scales above 2^63 that
    is none and they are not used, so its warning is left out.
    """
    with np.errstate(invalid="ignore"):
        balanced, T = scipy.linalg.matrix_balance(A, permute=permute, separate=False)
    return np.asarray(balanced), np.asarray(T)
