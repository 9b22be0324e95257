"""Heights from which on waves break, and slopes of waves that only break together (Miche 1944)."""

from __future__ import annotations

import math

import numpy as np

from eomgen.base.arrays import Array

#: Breaking steepness, height over wave length, in deep water; at finite depth times tanh k h.
_STEEPEST = 0.142
#: Ratio of the amplitudes of the bound second-order wave and its wave, above which a note on first order is due.
_NOTED = 0.15


def breaking_height(k: float, depth: float) -> float:
    """Return the height in m from which on a wave of the wave number k, rad/m, breaks."""
    return _STEEPEST * 2.0 * math.pi / k * math.tanh(min(k * depth, 700.0))


def too_steep_together(k: Array, amplitude: Array, depth: float, *, alone: bool, unit: bool = False) -> str:
    """Return a note if waves break by superposition though no single wave breaks; else an empty text.

    The criterion for listed waves is the sum of their slopes, for a spectrum its significant slope (mean of the highest
    third).

    Parameters
    ----------
    k, amplitude : (n,), rad/m and m
    depth : m
    alone : whether the waves are listed one by one
    unit : whether amplitudes belong to unit random variables, whose squares have the mean 2
    """
    slopes = k * amplitude / np.tanh(np.minimum(k * depth, 700.0))
    slope = float(np.sum(slopes) if alone else 2.0 * math.sqrt((1.0 if unit else 0.5) * np.sum(slopes**2)))
    most = _STEEPEST * math.pi
    if (alone and len(k) < 2) or not slope > most:
        return ""
    message = f"at meeting crests the slope comes to {slope:.3g}" if alone else f"the significant slope is {slope:.3g}"
    message += f", and waves break from {most:.3g} on: forces there are not physical"
    return message if alone else f"{message}. A lower sea, or a band that ends before its shortest waves"


def low_crest_of_first_order(k: float, amplitude: float, depth: float) -> str:
    """Return a note on a wave of first order that is steep; empty if it is not.

    Its bound wave of second order, (k A/4)(3 - s^2)/s^3 of its amplitude with s = tanh k h (Stokes), is missing: by so
    much a crest is higher, and a trough shallower.
    """
    s = math.tanh(min(k * depth, 700.0))
    part = 0.25 * k * amplitude * (3.0 - s * s) / s**3
    if not part > _NOTED:
        return ""
    message = f"a wave of first order with k A = {k * amplitude:.3g} has crests that are {100.0 * part:.0f} % too low"
    return f"{message}, and troughs as much too deep: order = 2 has the bound wave that is missing"
