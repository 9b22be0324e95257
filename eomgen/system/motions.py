"""Motions that a caller prescribes while a model runs: their tunable parameters, and quintic pieces between two ends.

A piece of the motion s is c_0 + c_1 (t - begin) + ... + c_5 (t - begin)^5, which meets position, rate and acceleration
at both of its ends: Hermite's quintic. So all driven coordinates have rates and accelerations, as of any law of time.
"""

from __future__ import annotations

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass

#: Of the polynomials: three conditions at both ends.
DEGREE = 5


def motion_parameters(name: str) -> tuple[str, ...]:
    """Return the names of the tunable parameters of a motion: the start of a piece, s, then the coefficients."""
    return (f"{name}_begin", *(f"{name}_{k}" for k in range(DEGREE + 1)))


@dataclass(frozen=True)
class Motion:
    """A named motion; ``initial``: value at rest until a caller moves the motion."""

    name: str
    initial: float = 0.0
    unit: str = ""
    description: str = ""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the tunable parameters."""
        return motion_parameters(self.name)


def piece(start: Array, end: Array, duration: float | Array) -> Array:
    """Return the coefficients c_0, ..., c_5, (6, ...), of the quintics between two ends.

    Parameters
    ----------
    start, end : (3, ...) position, rate and acceleration
    duration : (...) s, positive
    """
    T = duration
    (x, v, a), (X, V, A) = start, end
    gap, lag, gain = X - x - T * (v + 0.5 * T * a), (V - v - T * a) * T, (A - a) * T**2
    return np.array(
        [
            x,
            v,
            0.5 * a,
            (10.0 * gap - 4.0 * lag + 0.5 * gain) / T**3,
            (-15.0 * gap + 7.0 * lag - gain) / T**4,
            (6.0 * gap - 3.0 * lag + 0.5 * gain) / T**5,
        ]
    )


def at_time(coefficients: Array, since: float | Array) -> Array:
    """Return position, rate and acceleration, (3, ...), of pieces with coefficients (6, ...), at times (...) in s after
    the beginnings of the pieces."""
    value, rate, acceleration = np.zeros((3, *np.shape(since)))
    for coefficient in coefficients[::-1]:
        acceleration = acceleration * since + 2.0 * rate
        rate = rate * since + value
        value = value * since + coefficient
    return np.array([value, rate, acceleration])
