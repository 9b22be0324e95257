"""Skyhook, groundhook, and what of them a damper can do that is only ever made harder or softer, as formulas of
velocities.

D. Karnopp, M. J. Crosby and R. A. Harwood, Vibration control using semi-active force generators, Journal of Engineering
for Industry 96, 1974. Forces are tensions between body and wheel: positive ones pull them together.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.errors import UsageError


def skyhook(body: ArrayLike, wheel: ArrayLike, damping: float, groundhook: float = 0.0) -> Array:
    """Return the tension c body' - c_g wheel': a damper from the body to the sky, and one from the wheel to the ground.

    Parameters
    ----------
    body, wheel : velocities, m/s, away from the ground positive.
    damping, groundhook : c and c_g, N s/m.
    """
    return damping * np.asarray(body, dtype=float) - groundhook * np.asarray(wheel, dtype=float)


def clipped(
    wanted: ArrayLike, rate: ArrayLike, minimum: float = 0.0, maximum: float = math.inf, width: float = 0.0
) -> Array:
    """Return the tension of a damper whose coefficient is set to come as near to a wanted one as it can.

    It is the wanted tension held between those of the softest and of the hardest damper. With an infinite maximum and a
    minimum of zero: the wanted tension where it takes power out, else nothing.

    Parameters
    ----------
    wanted : tension, N.
    rate : of the damper's length, m/s.
    minimum, maximum : damping coefficients, N s/m.
    width : float
        Rate, m/s, over which corners are rounded; the coefficient stays between minimum and maximum all the same. With
        corners rounded there has to be a maximum.

    Raises
    ------
    UsageError
        Limits of the wrong sign or order, or a width without a maximum.
    """
    if not 0.0 <= minimum <= maximum:
        raise UsageError(f"the damping cannot lie between {minimum:g} and {maximum:g}", "0 <= minimum <= maximum")
    if not width >= 0.0 or (width and math.isinf(maximum)):
        raise UsageError(f"a width of {width:g} m/s needs a finite maximum and must not be negative", "0, or a maximum")
    F, r = np.asarray(wanted, dtype=float), np.asarray(rate, dtype=float)
    if width:
        return rounded(F, r, minimum, maximum, width)
    soft = minimum * r
    hard = maximum * r if math.isfinite(maximum) else np.copysign(np.where(r == 0.0, 0.0, math.inf), r)
    return np.asarray(np.clip(F, np.minimum(soft, hard), np.maximum(soft, hard)))


def rounded(wanted: Array, rate: Array, minimum: float, maximum: float, width: float) -> Array:
    """Return the clipped tension with round corners.

    With the mean coefficient c and half of their difference d, the clipped tension is
    c r + sign(r) (|F - c r + d r| - |F - c r - d r|)/2. Absolute values |y| are rounded to sqrt(y^2 + (c w)^2) and the
    sign of r to r/sqrt(r^2 + w^2). The coefficient, tension by rate, cannot leave [minimum, maximum], because the
    difference of the two roots is never more than that of their arguments.
    """
    mean, half = (minimum + maximum) / 2.0, (maximum - minimum) / 2.0
    beside = wanted - mean * rate
    least = (mean * width) ** 2
    roots = np.sqrt((beside + half * rate) ** 2 + least) + np.sqrt((beside - half * rate) ** 2 + least)
    share = 2.0 * beside / roots * rate / np.sqrt(rate**2 + width**2)
    return np.asarray(rate * (mean + half * share))
