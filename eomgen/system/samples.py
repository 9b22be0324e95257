"""Sampled states as a back end needs them: which internal states take new values at which times."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SampleRow:
    """One sampled state of a System, in the order of the term ``samples``, which gives the values.

    Attributes
    ----------
    state : its number in z
    period, offset : s; samples are at offset + k period, k = 0, 1, ...
    quantum : values are rounded to whole multiples of it; 0: they are not
    level : of states sampled at the same time, those of a lower level are set first
    """

    state: int
    period: float
    offset: float = 0.0
    quantum: float = 0.0
    level: int = 0
