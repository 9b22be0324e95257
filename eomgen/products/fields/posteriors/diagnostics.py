"""How far chains of samples are from one another, and how many independent ones they are worth."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.errors import Problem, UsageError

#: Lags up to this many autocorrelation times count (Sokal's window).
_WINDOW = 5.0


def split_r_hat(chains: ArrayLike) -> Array:
    """Return the potential scale reduction of the halves of chains (Gelman and Rubin), 1 if they agree.

    Parameters
    ----------
    chains : (chains, samples, ...)
        Four samples at least.

    Returns
    -------
    (...)
    """
    values = _of_chains(chains)
    half = values.shape[1] // 2
    parts = np.concatenate([values[:, :half], values[:, -half:]])
    within = parts.var(axis=1, ddof=1).mean(axis=0)
    between = parts.mean(axis=1).var(axis=0, ddof=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.sqrt((half - 1) / half + between / within))


def largest(values: Array) -> float:
    """Return the largest of numbers, NaN left out; NaN if all are, as of chains that stand still."""
    numbers = values[~np.isnan(values)]
    return float(numbers.max()) if numbers.size else float("nan")


def autocorrelation_time(chains: ArrayLike) -> Array:
    """Return the integrated autocorrelation time 1 + 2 sum of the autocorrelation, in samples, with the smallest window
    of lags that is five times itself (Sokal), at least five; autocorrelations are averaged over chains before.

    Parameters
    ----------
    chains : (chains, samples, ...)

    Returns
    -------
    (...)
    """
    values = _of_chains(chains)
    count = values.shape[1]
    centred = values - values.mean(axis=1, keepdims=True)
    spectra = np.fft.rfft(centred, 2 * count, axis=1)
    covariance = np.fft.irfft(np.abs(spectra) ** 2, 2 * count, axis=1)[:, :count].mean(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        times = 2.0 * np.cumsum(covariance / covariance[0], axis=0) - 1.0
    lags = np.arange(count).reshape(-1, *[1] * (times.ndim - 1))
    enough = lags >= _WINDOW * np.maximum(times, 1.0)  # if samples alternate, more than the first lags count
    last = np.where(enough.any(axis=0), enough.argmax(axis=0), count - 1)
    return np.asarray(np.take_along_axis(times, last[None], axis=0)[0])


def autocorrelation_error(times: ArrayLike, samples: int) -> Array:
    """Return the standard errors of integrated autocorrelation times, in parts of them: sqrt(2(2 window + 1)/samples)
    (Madras and Sokal, J. Stat. Phys. 50 (1988) 109).

    Parameters
    ----------
    times : as of ``autocorrelation_time``
    samples : of all chains
    """
    return np.asarray(np.sqrt(2.0 * (2.0 * _WINDOW * np.maximum(times, 1.0) + 1.0) / samples))


def _of_chains(chains: ArrayLike) -> Array:
    values = np.asarray(chains, dtype=float)
    if values.ndim < 2 or values.shape[1] < 4:
        fault = f"samples of the shape {values.shape} are no chains of four samples or more"
        raise UsageError(Problem("chains", fault, "an array (chains, samples, ...)"))
    return values
