"""Second order of a pair of waves by its textbook formulas, in arithmetic of 60 digits, which bears cancellation."""

from __future__ import annotations

from typing import Any

import mpmath
from mpmath import mp, mpf

GRAVITY = "9.81"


def pair(first: tuple[Any, Any], second: tuple[Any, Any], depth: Any = None, c: Any = 0) -> dict[str, Any]:
    """Return potentials of one ordered pair and displacements of both orders together, for amplitudes 1.

    ``first`` has the higher frequency where displacements of the difference are looked at; ``depth`` None is infinite.
    """
    with mp.workdps(60):
        g = mpf(GRAVITY)
        c = mpf(c)
        ki, kj = ([mpf(x) for x in vector] for vector in (first, second))
        h = None if depth is None else mpf(depth)
        wave = []
        for vector in (ki, kj):
            k = mpmath.hypot(*vector)
            if h is None:
                w, C = mpmath.sqrt(g * k), mpf(1)
                Ch = Sh = mpmath.exp(k * c)
            else:
                w, C = mpmath.sqrt(g * k * mpmath.tanh(k * h)), mpmath.coth(k * h)
                Ch, Sh = (f(k * (c + h)) / mpmath.sinh(k * h) for f in (mpmath.cosh, mpmath.sinh))
            wave.append((k, w, C, Ch, Sh))
        (k1, w1, C1, Ch1, Sh1), (k2, w2, C2, Ch2, Sh2) = wave
        gamma = (ki[0] * kj[0] + ki[1] * kj[1]) / (k1 * k2)
        found: dict[str, Any] = {}
        for name, sign in (("p", 1), ("m", -1)):
            vector = [ki[0] + sign * kj[0], ki[1] + sign * kj[1]]
            k, w = mpmath.hypot(*vector), w1 + sign * w2
            numerator = w1 * w2 * w * (gamma * C1 * C2 - sign) + (w1**3 * (C1**2 - 1) + sign * w2**3 * (C2**2 - 1)) / 2
            kT = k if h is None else k * mpmath.tanh(k * h)
            B = -numerator / (2 * (g * kT - w**2))
            if h is None:
                P, Pc = mpmath.exp(k * c), k * mpmath.exp(k * c)
            else:
                P = mpmath.cosh(k * (c + h)) / mpmath.cosh(k * h)
                Pc = k * mpmath.sinh(k * (c + h)) / mpmath.cosh(k * h)
            found[f"B{name}"] = B
            if w == 0:
                continue
            D = Sh1 * Sh2 - sign * gamma * Ch1 * Ch2
            for axis, number in (("X", 0), ("Y", 1)):
                east = (w1 * ki[number] + w2 * kj[number]) / 2
                found[f"{axis}{name}"] = -(east * D + 2 * B * P * vector[number]) / w
            one = w2 * k2 * (Sh1 * Ch2 - sign * gamma * Ch1 * Sh2)
            other = w1 * k1 * (Sh2 * Ch1 - sign * gamma * Ch2 * Sh1)
            if sign < 0:
                one = -w2 * k2 * (gamma * Ch1 * Sh2 + Sh1 * Ch2)
                other = w1 * k1 * (gamma * Ch2 * Sh1 + Sh2 * Ch1)
            found[f"Z{name}"] = ((one + other) / 2 + 2 * B * Pc) / w
        found["w"] = w1 - w2
        return found
