"""Stability margins of a closed loop, at one input at a time with the others closed.

L is the loop from the input around to itself, 1 + L the return difference. The loop stays stable for gains between
``gain_reduction`` and ``gain_margin`` times its own, and for a delay below ``delay_margin``; ``modulus_margin`` is the
least distance of L from -1; its inverse is the largest sensitivity.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass, field

#: Points about each resonance, at distances in half bandwidths.
_ABOUT = np.concatenate([-np.geomspace(0.02, 20.0, 30)[::-1], [0.0], np.geomspace(0.02, 20.0, 30)])


@dataclass(frozen=True)
class Margins:
    """Margins of one loop.

    Attributes
    ----------
    gain_margin : factor above 1 on the loop's gain at the limit of stability; infinite without a limit
    gain_reduction : factor below 1 at the limit of stability; 0 without a limit
    phase_margin : additional lag or lead at the limit of stability, degrees; infinite if the loop's gain is never 1
    delay_margin : additional delay at the limit of stability, s
    modulus_margin : least distance of the open loop from -1
    crossover : frequencies at which the loop's gain is 1, rad/s, increasing
    frequencies, loop : (n,) rad/s and (n,) complex, the open loop
    """

    gain_margin: float
    gain_reduction: float
    phase_margin: float
    delay_margin: float
    modulus_margin: float
    crossover: tuple[float, ...]
    frequencies: Array = field(repr=False)
    loop: Complex = field(repr=False)


def margins_of(A: Array, B: Array, G: Array, inputs: Sequence[str], sample: float | None) -> dict[str, Margins]:
    """Return the margins of the feedback u = -G s at each input, by name, with the loops of the other inputs closed.

    Parameters
    ----------
    A, B : (n, n) and (n, m) ndarray
        sdot = A s + B u, or s[k+1] = A s[k] + B u[k] if ``sample`` is given.
    G : (m, n) ndarray
        Gains.
    inputs : sequence of str
        Names of the m inputs.
    sample : float or None
        Time between two samples, s.
    """
    result = {}
    for k, name in enumerate(inputs):
        others = [j for j in range(len(inputs)) if j != k]
        opened = A - B[:, others] @ G[others]
        closed = np.linalg.eigvals(A - B @ G).astype(complex)
        result[name] = _margins(opened, B[:, k], G[k], closed, sample)
    return result


def _margins(A: Array, b: Array, g: Array, closed: Complex, sample: float | None) -> Margins:
    """Return the margins of the loop g (s 1 - A)^-1 b; ``closed`` are the eigenvalues of the closed loop. `A` (n, n) is
    the model with the other loops closed, `b` and `g` (n,) are input column and gains; s = z for a `sample` in s."""

    def loop(frequencies: Array) -> Complex:
        w = np.atleast_1d(frequencies)
        points = 1j * w if sample is None else np.exp(1j * w * sample)
        pencils = points[:, np.newaxis, np.newaxis] * np.eye(len(A)) - A
        result: Complex = np.linalg.solve(pencils, np.broadcast_to(b[:, np.newaxis], (len(w), len(b), 1)))[..., 0] @ g
        return result

    def at(frequency: float) -> complex:
        return complex(loop(np.array([frequency]))[0])

    frequencies = _frequencies(np.concatenate([np.linalg.eigvals(A), closed]), sample)
    values = loop(frequencies)
    crossover = _roots(lambda w: abs(at(w)) - 1.0, frequencies, np.abs(values) - 1.0)
    # at real points of the loop: between the points, at standstill, and half way around of a sampled one
    still = 0.0 if sample is None else 1.0
    away = np.abs(np.linalg.eigvals(A) - still)
    ends_of_loop = [0.0] if np.min(away, initial=np.inf) > 1e-9 * np.max(away, initial=1.0) else []
    ends_of_loop += [] if sample is None else [np.pi / sample]
    real = [*_roots(lambda w: at(w).imag, frequencies, values.imag), *ends_of_loop]
    crossings = [x.real for x in map(at, real) if x.real < 0.0 and abs(x.imag) <= 1e-6 * abs(x)]
    lags = [float(np.degrees(np.angle(-at(w))) % 360.0) for w in crossover]
    k = int(np.argmin(np.abs(1.0 + values)))
    ends = (frequencies[max(k - 1, 0)], frequencies[min(k + 1, len(frequencies) - 1)])
    tolerance = 1e-9 * float(ends[1])
    nearest = minimize_scalar(lambda w: abs(1.0 + at(w)), bounds=ends, method="bounded", options={"xatol": tolerance})
    factors = [-1.0 / x for x in crossings]
    return Margins(
        gain_margin=min((f for f in factors if f > 1.0), default=np.inf),
        gain_reduction=max((f for f in factors if f < 1.0), default=0.0),
        phase_margin=min((min(lag, 360.0 - lag) for lag in lags), default=np.inf),
        delay_margin=min((math.radians(lag) / w for lag, w in zip(lags, crossover, strict=True)), default=np.inf),
        modulus_margin=float(min(nearest.fun, np.abs(1.0 + values).min())),
        crossover=tuple(crossover),
        frequencies=frequencies,
        loop=values,
    )


def _frequencies(eigenvalues: Complex, sample: float | None) -> Array:
    """Return frequencies that resolve the resonance of every eigenvalue, rad/s, increasing, up to half the sampling
    rate."""
    values = eigenvalues
    if sample is not None:
        with np.errstate(divide="ignore"):
            values = np.log(eigenvalues[np.abs(eigenvalues) > 1e-12].astype(complex)) / sample
    sizes = np.abs(values)
    sizes = sizes[sizes > 1e-9 * np.max(sizes, initial=0.0)]
    low, high = (sizes.min(), sizes.max()) if len(sizes) else (1.0, 1.0)
    last = np.pi / sample if sample is not None else 1e3 * high
    points = [np.geomspace(min(1e-3 * low, 1e-3 * last), last, 2000)]
    for value in values[np.abs(values.imag) > 1e-9 * high]:
        points.append(abs(value.imag) + _ABOUT * max(abs(value.real), 1e-9 * abs(value)))
    every = np.unique(np.concatenate(points))
    # not at an undamped resonance
    undamped = np.abs(values.imag[np.abs(values.real) <= 1e-9 * np.abs(values)])
    apart = np.all(np.abs(every[:, np.newaxis] - undamped) > 1e-12 * every[:, np.newaxis], axis=1)
    return np.asarray(every[apart & (every >= points[0][0]) & (every <= last)])


def _roots(function: Callable[[float], float], points: Array, values: Array) -> list[float]:
    """Return the roots of a function between points at which the function changes sign."""
    changes = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0.0)
    roots = [float(brentq(function, points[k], points[k + 1], xtol=1e-13 * points[k + 1], rtol=1e-13)) for k in changes]
    return [*roots, *(float(x) for x in points[values == 0.0])]
