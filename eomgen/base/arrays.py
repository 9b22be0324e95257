"""Types of arrays and numbers that all rooms share, and the check of a whole number."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from eomgen.errors import Problem, UsageError

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Numbers = float | Array
Flags = bool | np.bool_ | NDArray[np.bool_]


def count_of(name: str, value: object, least: int = 1) -> int:
    """Return a whole number from ``least`` on. Raises UsageError."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise UsageError(Problem(name, f"a whole number from {least} on is needed, not {value!r} [E0246]", f"{least}"))
    return int(value)
