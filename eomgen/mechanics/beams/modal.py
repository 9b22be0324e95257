"""Modes of uniform beams, bars and shafts as shape functions of s = 0 .. 1, in double precision for any number of modes.

Bending (R. D. Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-1): f = cosh x -+ cos x - sigma (sinh x -+
sin x) with x = lambda s. Growing and decaying part are brought together by A = (1 - sigma) e^lambda, found with as many digits as
that takes, so that large numbers are never subtracted from one another.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import mpmath
import numpy as np

from eomgen.mechanics.beams.families import Array
from eomgen.scene.beam import Ends

_DIGITS = 40
_DIGITS_PER_MODE = 3  # cosh(lambda) grows by 1.36 digits a mode, and is squared on the way


class Root(NamedTuple):
    """A mode: its wave number lambda, sigma, and A = (1 - sigma) e^lambda."""

    wave_number: float
    sigma: float
    growing: float


@functools.cache
def root(sign: int, number: int) -> Root:
    """Return the mode ``number`` = 1, 2, ... of cos x cosh x = -sign: 1 for clamped-free, -1 for free-free bending."""
    with mpmath.workdps(_DIGITS + _DIGITS_PER_MODE * number):
        guess = (number - sign * mpmath.mpf(1) / 2) * mpmath.pi
        wave = mpmath.findroot(lambda x: mpmath.cos(x) + sign * mpmath.sech(x), guess)
        sigma = (mpmath.cosh(wave) + sign * mpmath.cos(wave)) / (mpmath.sinh(wave) + sign * mpmath.sin(wave))
        return Root(float(wave), float(sigma), float((1 - sigma) * mpmath.exp(wave)))


class BendingModes:
    """Bending modes of a clamped-free or a free-free uniform beam; int f^2 = 1, and f = 2 (-1)^(k+1) or 2 at a free end.

    Parameters
    ----------
    ends : str
        ``clamped_free`` or ``free_free``; the latter without rigid motions.
    size : int
        Number of modes.
    """

    breaks: tuple[float, ...] = ()

    def __init__(self, ends: Ends, size: int) -> None:
        self.sign = 1 if ends == "clamped_free" else -1
        self.size = size
        modes = [root(self.sign, number) for number in range(1, size + 1)]
        self.waves, self.sigmas, self.growing = np.array(modes).T[:, :, None]

    @property
    def wave_number(self) -> float:
        """Of the highest mode, rad."""
        return float(self.waves[-1, 0])

    def values(self, s: Array, derivative: int = 0) -> Array:
        """Return (n, m) values of a derivative by s."""
        x = self.waves * s
        cos, sin = np.cos(x), np.sin(x)
        for _ in range(derivative):
            cos, sin = -sin, cos
        decaying = (-1) ** derivative * (1.0 + self.sigmas) * np.exp(-x)
        smooth = 0.5 * (self.growing * np.exp(x - self.waves) + decaying)
        result = self.waves**derivative * (smooth - self.sign * (cos - self.sigmas * sin))
        if self.sign > 0 and derivative < 2:
            result[:, s == 0.0] = 0.0  # clamped, to the last bit
        return np.asarray(result)


@dataclass(frozen=True)
class Waves:
    """cos(c_k s) or sin(c_k s): bending of a pinned beam, stretch and torsion of uniform ones; the greatest value is 1."""

    wave_numbers: tuple[float, ...]
    sine: bool
    breaks: tuple[float, ...] = ()

    @property
    def size(self) -> int:
        """Number of functions."""
        return len(self.wave_numbers)

    @property
    def wave_number(self) -> float:
        """Of the highest one, rad."""
        return self.wave_numbers[-1]

    def values(self, s: Array, derivative: int = 0) -> Array:
        """Return (n, m) values of a derivative by s."""
        waves = np.array(self.wave_numbers)[:, None]
        cos, sin = np.cos(waves * s), np.sin(waves * s)
        for _ in range(derivative):
            cos, sin = -sin, cos
        return np.asarray(waves**derivative * (sin if self.sine else cos))


def waves(ends: Ends, size: int) -> Waves:
    """Return modes of stretch or torsion, or of bending between pins: sin((k - 1/2) pi s), cos(k pi s) or sin(k pi s)."""
    shift = 0.5 if ends == "clamped_free" else 0.0
    numbers = tuple(np.pi * (number - shift) for number in range(1, size + 1))
    return Waves(numbers, sine=ends != "free_free")
