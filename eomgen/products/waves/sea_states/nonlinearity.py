"""Seas beyond linear waves: bound waves of second order at fixed places, and heights and slopes from which on waves
break (Miche 1944).

Bound waves of a pair of free waves are at sums and differences of their phases. With eta = eta1 + eta2 and a potential
phi = phi1 + phi2 that is harmonic and has no flow through the bottom, the conditions at the surface, expanded about z =
0, are at second order

    eta2_t - phi2_z = K = -grad eta1 . grad phi1 + eta1 phi1_zz,
    phi2_t + g eta2 = D = -|grad phi1|^2/2 - eta1 phi1_zt

(Longuet-Higgins, Journal of Fluid Mechanics 17 (1963) 459; Dalzell, Applied Ocean Research 21 (1999) 105). A pair has
K = s sin psi and D = d cos psi with psi = th_i +- th_j = K.x - W t + phase, so phi2 = P cosh K(z + h)/cosh Kh sin psi
with P = (d W - g s)/(g K tanh Kh - W^2), and eta2 = (d + W P)/g cos psi.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array

#: Breaking steepness, height over wave length, in deep water; at finite depth times tanh k h.
_STEEPEST = 0.142


def breaking_height(k: float, depth: float) -> float:
    """Return the height in m from which on a wave of the wave number k, rad/m, breaks."""
    return _STEEPEST * 2.0 * math.pi / k * math.tanh(min(k * depth, 700.0))


def too_steep_together(k: Array, amplitude: Array, depth: float, *, alone: bool, unit: bool = False) -> str:
    """Return a note if waves break by superposition though no single wave breaks; else an empty text.

    The criterion for listed waves is the sum of slopes, for a spectrum the significant slope (mean of the highest
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
    doubt = f"and waves break from {most:.3g} on: forces there are not physical"
    if alone:
        return f"at meeting crests the slope comes to {slope:.3g}, {doubt} [W0092]"
    hint = "A lower sea, or a band that ends before its shortest waves"
    return f"the significant slope is {slope:.3g}, {doubt}. {hint} [W0093]"


def low_crest_of_first_order(k: float, amplitude: float, depth: float) -> str:
    """Return a note on a steep wave of first order, of wave number k, rad/m, and an amplitude, m; empty for other
    waves. The bound wave of second order, (k A/4)(3 - s^2)/s^3 of the amplitude with s = tanh k h (Stokes), is missing:
    the true crest is higher, and the true trough shallower, by its amplitude."""
    s = math.tanh(min(k * depth, 700.0))
    part = 0.25 * k * amplitude * (3.0 - s * s) / s**3
    if not part > 0.15:
        return ""
    message = f"a wave of first order with k A = {k * amplitude:.3g} has crests that are {100.0 * part:.0f} % too low"
    return f"{message}, and troughs as much too deep: order = 2 has the bound wave that is missing"


#: A / (k^2 h^3) from which on second order is not enough.
MOST_URSELL = 0.1


def beyond_second_order(vectors: Array, amplitude: Array, depth: float) -> str:
    """Return a warning on waves over water, of a depth in m, that is too shallow for second order; otherwise empty.
    The criterion is A / (k^2 h^3) with the root of the sum of squared amplitudes and the wave number of the largest
    wave."""
    if not math.isfinite(depth) or not np.any(amplitude):
        return ""
    k = float(np.hypot(*vectors[np.argmax(amplitude)]))
    ursell = math.sqrt(float(np.sum(amplitude**2))) / (k**2 * depth**3)
    if not ursell > MOST_URSELL:
        return ""
    message = f"A / (k^2 h^3) = {ursell:.3g} for the largest wave, k = {k:.4g} rad/m; an expansion of second order"
    return f"{message} holds below {MOST_URSELL:g} [E1234]; try: lower waves, deeper water"


def _pairs(n: int) -> list[tuple[float, NDArray[np.int64], NDArray[np.int64]]]:
    i, j = np.triu_indices(n)
    return [(1.0, i, j), (-1.0, i[i != j], j[i != j])]


def members_of_bound_waves(n: int) -> list[tuple[int, int, int]]:
    """Return the indices of both free waves, and the sign of the second phase, for each bound wave of n free waves. The
    order is as in ``bound_waves``."""
    return [(int(i), int(j), int(sign)) for sign, *pairs in _pairs(n) for i, j in zip(*pairs, strict=True)]


def bound_waves(
    vectors: Array, frequency: Array, amplitude: Array, phase: Array, depth: float, gravity: float
) -> list[Array]:
    """Return the bound waves of n free waves: wave vectors (m, 2), angular frequencies, amplitudes of elevation, phases
    and amplitudes of the potential at z = 0 (m^2/s), (m,) each, m = n^2.

    The mean level is left at 0.

    Parameters
    ----------
    vectors : (n, 2) array, rad/m, no two the same
    frequency, amplitude, phase : (n,) arrays
        Of free waves over water of a depth in m.
    """
    rows = []
    for sign, first, second in _pairs(len(frequency)):
        ki, kj, wi, wj = vectors[first], vectors[second], frequency[first], frequency[second]
        product = np.sum(ki * kj, axis=1)
        squares_i, squares_j = np.sum(ki * ki, axis=1), np.sum(kj * kj, axis=1)
        # both orders of a pair; the pair of a wave with itself is counted once
        share = np.where(first == second, 0.5, 1.0) * amplitude[first] * amplitude[second]
        s = 0.5 * gravity * ((product + sign * squares_j) / wj + sign * (product + sign * squares_i) / wi)
        d = -0.5 * gravity**2 * product / (wi * wj) + sign * 0.5 * wi * wj + 0.5 * (wi**2 + wj**2)
        wave, w = ki + sign * kj, wi + sign * wj
        k = np.hypot(*wave.T)
        restoring = gravity * k * np.tanh(np.minimum(k * depth, 700.0))
        potential = share * (d * w - gravity * s) / (restoring - w**2)
        raised = (share * d + w * potential) / gravity
        rows.append((wave, w, raised, phase[first] + sign * phase[second], potential))
    return [np.concatenate(parts) for parts in zip(*rows, strict=True)]
