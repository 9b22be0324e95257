"""Modes of uniform beams, bars and shafts as shape functions of s = 0 .. 1.

Bending (R. D. Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-1): f = cosh x -+ cos x - sigma
(sinh x -+ sin x) with x = lambda s. Growing and decaying part are brought together by A = (1 - sigma) e^lambda, found
with as many digits as that takes, so that large numbers are never subtracted from one another and any mode is as exact
as the first.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import mpmath
import numpy as np

from eomgen.mechanics.shape_functions.fixed_point import WORKING, Fixed, fixed, unfixed
from eomgen.scene.bodies.beam import Ends

_BITS_PER_MODE = 10  # cosh(lambda) grows by 4.5 bits a mode, and is squared on the way


class Root(NamedTuple):
    """One mode: wave number lambda, sigma, A = (1 - sigma) e^lambda, and e^-lambda, in mpmath numbers."""

    wave_number: Any
    sigma: Any
    growing: Any
    decay: Any


@functools.cache
def root(sign: int, number: int) -> Root:
    """Return the mode ``number`` = 1, 2, ... of cos x cosh x = -sign: 1 for clamped-free, -1 for free-free bending."""
    with mpmath.workprec(WORKING + _BITS_PER_MODE * number):
        guess = (number - sign * mpmath.mpf(1) / 2) * mpmath.pi
        wave = mpmath.findroot(lambda x: mpmath.cos(x) + sign * mpmath.sech(x), guess)
        sigma = (mpmath.cosh(wave) + sign * mpmath.cos(wave)) / (mpmath.sinh(wave) + sign * mpmath.sin(wave))
        return Root(wave, sigma, (1 - sigma) * mpmath.exp(wave), mpmath.exp(-wave))


@dataclass(frozen=True)
class BendingModes:
    """Bending modes of a clamped-free or a free-free uniform beam, of int f^2 = 1.

    At a free end f = 2 (-1)^(k+1), or 2.

    Attributes
    ----------
    sign : 1 for a clamped-free, -1 for a free-free beam, without its rigid motions
    size : number of modes
    """

    sign: int
    size: int
    breaks: tuple[Fraction, ...] = ()

    @property
    def wave_number(self) -> float:
        """Wave number of the highest mode, rad."""
        return float(root(self.sign, self.size).wave_number)

    def values(self, s: Fixed) -> tuple[Fixed, Fixed, Fixed]:
        """Return (n, m) values, first and second derivatives by s."""
        return _table([root(self.sign, number) for number in range(1, self.size + 1)], self.bending, s)

    def bending(self, mode: Root, s: Any) -> tuple[Any, Any, Any]:
        """Return value and derivatives of one mode at one position."""
        wave, sigma, growing, decay = mode
        x = wave * s
        cos, sin = mpmath.cos_sin(x)
        grown = mpmath.exp(x - wave)
        rising, falling = growing * grown / 2, (1 + sigma) * decay / (2 * grown)
        even = self.sign * (cos - sigma * sin)
        odd = self.sign * (sin + sigma * cos)
        return rising + falling - even, wave * (rising - falling + odd), wave * wave * (rising + falling + even)


@dataclass(frozen=True)
class Waves:
    """Modes of uniform bars and shafts, or of a beam between pins; the greatest value is 1.

    Attributes
    ----------
    ends : sin((k - 1/2) pi s) of ``clamped_free``, cos(k pi s) of ``free_free``, sin(k pi s) of ``pinned_pinned``
    size : number of modes
    """

    ends: Ends
    size: int
    breaks: tuple[Fraction, ...] = ()

    @property
    def wave_number(self) -> float:
        """Wave number of the highest mode, rad."""
        return np.pi * self.size

    def values(self, s: Fixed) -> tuple[Fixed, Fixed, Fixed]:
        """Return (n, m) values, first and second derivatives by s."""
        with mpmath.workprec(WORKING):
            half = mpmath.mpf(1) / 2 if self.ends == "clamped_free" else 0
            return _table([number - half for number in range(1, self.size + 1)], self.wave, s)

    def wave(self, turns: Any, s: Any) -> tuple[Any, Any, Any]:
        """Return value and derivatives of one function, with the given number of half waves, at one position."""
        wave = turns * mpmath.pi
        cos, sin = mpmath.cospi(turns * s), mpmath.sinpi(turns * s)
        if self.ends == "free_free":
            return cos, -wave * sin, -wave * wave * cos
        return sin, wave * cos, -wave * wave * sin


def _table(modes: list[Any], function: Any, s: Fixed) -> tuple[Fixed, Fixed, Fixed]:
    """Return (n, m) values and derivatives of a function of a mode and of s."""
    result = np.zeros((3, len(modes), len(s)), dtype=object)
    with mpmath.workprec(WORKING):
        positions = [unfixed(position) for position in s]
        for row, mode in enumerate(modes):
            for column, position in enumerate(positions):
                result[:, row, column] = [fixed(part) for part in function(mode, position)]
    f, slope, curvature = result
    return f, slope, curvature


def modes(bends: bool, ends: Ends, size: int) -> BendingModes | Waves:
    """Return the modes of bending, or of stretch and torsion."""
    return (
        BendingModes(1 if ends == "clamped_free" else -1, size)
        if bends and ends != "pinned_pinned"
        else Waves(ends, size)
    )
