"""The log of events in a stepper's workspace, as a NumPy type."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Log = NDArray[Any]


def entry_type(layout: Mapping[str, Any], real: str) -> np.dtype[Any]:
    """Return the NumPy type of an entry of the log, a struct of C."""
    number = "f4" if real == "float" else "f8"
    sizes, modes = layout["sizes"], len(layout["method"]["events"]["modes"])
    blocks = [(letter, int(sizes[letter])) for letter in "qvz"]
    state = [*((f"{name}_before", size) for name, size in blocks), *blocks, ("modes", modes)]
    members = [("event", np.dtype("l"), ()), ("t", number, ())]
    return np.dtype([*members, *((name, number, (size,)) for name, size in state if size)], align=True)
