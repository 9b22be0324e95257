"""Bound waves of second order at fixed places: contributions of pairs of free waves at sums and differences of their
phases.

With eta = eta1 + eta2 and a potential phi = phi1 + phi2 that is harmonic and has no flow through the bottom, the
conditions at the surface, expanded about z = 0, are at second order

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

#: A / (k^2 h^3) from which on second order is not enough.
MOST_URSELL = 0.1


def beyond_second_order(vectors: Array, amplitude: Array, depth: float) -> str:
    """Return a warning on waves over water of a depth in m that is too shallow for second order; empty if it
    is: A / (k^2 h^3) of all amplitudes together and of the wave number of the largest wave."""
    if not math.isfinite(depth) or not np.any(amplitude):
        return ""
    k = float(np.hypot(*vectors[np.argmax(amplitude)]))
    ursell = math.sqrt(float(np.sum(amplitude**2))) / (k**2 * depth**3)
    if not ursell > MOST_URSELL:
        return ""
    message = f"A / (k^2 h^3) = {ursell:.3g} for the largest wave, k = {k:.4g} rad/m; an expansion of second order"
    return f"{message} holds below {MOST_URSELL:g}. Lower waves or deeper water"


def _pairs(n: int) -> list[tuple[float, NDArray[np.int64], NDArray[np.int64]]]:
    i, j = np.triu_indices(n)
    return [(1.0, i, j), (-1.0, i[i != j], j[i != j])]


def members_of_bound_waves(n: int) -> list[tuple[int, int, int]]:
    """Return of each bound wave of n free ones which two it is made of, and the sign of the second's phase."""
    result = []
    for sign, first, second in _pairs(n):
        result += [(int(i), int(j), int(sign)) for i, j in zip(first, second, strict=True)]
    return result


def bound_waves(
    vectors: Array, frequency: Array, amplitude: Array, phase: Array, depth: float, gravity: float
) -> tuple[Array, Array, Array, Array, Array]:
    """Return the bound waves of n free ones: wave vectors (m, 2), angular frequencies, amplitudes of elevation, phases
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
        # both orders of a pair; a wave with itself is counted once
        share = np.where(first == second, 0.5, 1.0) * amplitude[first] * amplitude[second]
        s = 0.5 * gravity * ((product + sign * squares_j) / wj + sign * (product + sign * squares_i) / wi)
        d = -0.5 * gravity**2 * product / (wi * wj) + sign * 0.5 * wi * wj + 0.5 * (wi**2 + wj**2)
        wave, w = ki + sign * kj, wi + sign * wj
        k = np.hypot(*wave.T)
        restoring = gravity * k * np.tanh(np.minimum(k * depth, 700.0))
        potential = share * (d * w - gravity * s) / (restoring - w**2)
        raised = (share * d + w * potential) / gravity
        rows.append((wave, w, raised, phase[first] + sign * phase[second], potential))
    columns = [np.concatenate(parts) for parts in zip(*rows, strict=True)]
    return columns[0], columns[1], columns[2], columns[3], columns[4]
