"""Frequency weightings of whole-body vibration: ISO 2631-1:1997, annex A (the same in ISO 8041-1:2017, table 3).

H(s) = band limitation (high pass f1, low pass f2, both Butterworth) times transition (f3, f4, Q4) times upward step
(f5, Q5, f6, Q6). Magnitudes agree with table 3 of ISO 2631-1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.errors import Problem, UsageError

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class WeightingFilter:
    """Corner frequencies in Hz and resonance quality factors; ``step`` is (f5, Q5, f6, Q6) or None."""

    description: str
    f1: float
    f2: float
    f3: float
    f4: float
    Q4: float
    step: tuple[float, float, float, float] | None = None


WEIGHTINGS = {
    "Wk": WeightingFilter("vertical, of a seat or the floor", 0.4, 100.0, 12.5, 12.5, 0.63, (2.37, 0.91, 3.35, 0.91)),
    "Wd": WeightingFilter("horizontal, of a seat or the floor", 0.4, 100.0, 2.0, 2.0, 0.63),
}


def weighting_response(name: str, frequencies: ArrayLike) -> Complex:
    """Return the complex response (...) of a weighting filter at frequencies (...) in Hz.

    Raises
    ------
    UsageError
        There is no weighting of that name.
    """
    if name not in WEIGHTINGS:
        fault = f"there is no weighting {ascii(name)[:32]}"
        known = "; ".join(f"{key}: {item.description}" for key, item in WEIGHTINGS.items())
        raise UsageError(Problem("weighting", fault, known))
    item = WEIGHTINGS[name]
    f = 1j * np.asarray(frequencies, dtype=float)
    butterworth = 1.0 / math.sqrt(2.0)
    high_pass = (f / item.f1) ** 2 * _second_order(f, item.f1, butterworth)
    low_pass = _second_order(f, item.f2, butterworth)
    response: Complex = high_pass * low_pass * (1.0 + f / item.f3) * _second_order(f, item.f4, item.Q4)
    if item.step is not None:
        f5, Q5, f6, Q6 = item.step
        response = response * (f5 / f6) ** 2 * _second_order(f, f6, Q6) / _second_order(f, f5, Q5)
    return response


def _second_order(f: Complex, corner: float, quality: float) -> Complex:
    """Return 1 / (1 + s / (Q w) + (s / w)^2) at s = 2 pi f."""
    result: Complex = 1.0 / (1.0 + f / (quality * corner) + (f / corner) ** 2)
    return result
