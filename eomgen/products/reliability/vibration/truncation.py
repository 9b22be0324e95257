"""The share of an output's variance that is lost with the modes left out of Karhunen-Loeve expansions.

To first order the output is y = const + sum over rows k of a_k g(x_k). Here a_k is its derivative in the value of the
process at row k, and x_k the place of the process there. So the variance with all modes is sum a_k a_l R(x_k - x_l), R
the covariance of g, and the variance of the modes kept is the square of the gradient in their variables.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import signal

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.system.signals import NormalSeries

#: Tolerated difference between the gradient in the variables and the gradient from derivatives in the values of
#: processes, as a part of the norm.
_EXPLAINED = 0.02
#: Variance, by the sum of its terms' sizes, that rounding leaves.
_ROUNDED = 1e-12


@dataclass(frozen=True)
class _Contribution:
    """A process as far as it has the variables of one expansion: ``weights`` (rows,) times g at ``places`` (rows,)."""

    process: NormalSeries
    weights: Array
    places: Array


def lost_variance(
    processes: Sequence[NormalSeries],
    times: Array,
    derivatives: Mapping[str, Array],
    variables: Sequence[str],
    gradient: Array,
) -> float:
    """Return the share of an output's variance, to first order, that is lost with the modes left out.

    Parameters
    ----------
    processes : sequence of NormalSeries
    times : ndarray, shape (rows,)
        Equally spaced, in s.
    derivatives : mapping from names of processes to ndarrays, shape (rows,)
        Of the output in the value of the process at each row.
    variables : sequence of str
        Names of all standard normal variables.
    gradient : ndarray, shape (variables,)
        Of the output in these.

    Returns
    -------
    float
        From 0 to 1; NaN if a process is not stationary by itself (coherent or repaired covariances), or if the output
        takes processes between rows in ways that derivatives at rows do not tell.
    """
    if not gradient.any() or any(one.covariance is None for one in processes):
        return float("nan")
    place = {name: k for k, name in enumerate(variables)}
    by_process = np.stack([_gradient(one, times, derivatives[one.name], place) for one in processes], axis=1)
    slopes = np.ones(len(processes))
    mapped = [k for k, one in enumerate(processes) if one.translation is not None]
    own = sorted({place[name] for one in processes for name in one.variables})
    if mapped:  # the slope of a translation at the mean, which derivatives do not contain
        plain = [k for k in range(len(processes)) if k not in mapped]
        left = gradient[own] - by_process[np.ix_(own, plain)].sum(axis=1)
        slopes[mapped] = np.linalg.lstsq(by_process[np.ix_(own, mapped)], left, rcond=None)[0]
    missed = float(np.linalg.norm(by_process[own] @ slopes - gradient[own]))
    if missed > _EXPLAINED * float(np.linalg.norm(gradient[own])):
        return float("nan")
    expansions: dict[str, list[_Contribution]] = {}
    for process, slope in zip(processes, slopes.tolist(), strict=True):
        for owner, weight in _owners(process).items():
            weights = slope * weight * derivatives[process.name]
            expansions.setdefault(owner, []).append(_Contribution(process, weights, _places(process, times)))
    variances = [_variance(parts) for parts in expansions.values()]
    variance, size = sum(one for one, _ in variances), sum(size for _, size in variances)
    kept = float(gradient[own] @ gradient[own])
    if not variance > _ROUNDED * size:
        return float("nan")
    return max(0.0, (variance - kept) / (variance - kept + float(gradient @ gradient)))


def _owners(process: NormalSeries) -> dict[str, float]:
    """Return the weights of the expansions that a process is a sum of, by the name of the owner of the variables."""
    return {
        variable.rpartition("_")[0]: weight for variable, weight in zip(process.variables, process.weights, strict=True)
    }


def _places(process: NormalSeries, times: Array) -> Array:
    return np.asarray((process.speed or 1.0) * times - process.lag)


def _gradient(process: NormalSeries, times: Array, derivatives: Array, place: Mapping[str, int]) -> Array:
    """Return the derivatives in all variables by way of a process, (variables,)."""
    result = np.zeros(len(place))
    x = np.clip(_places(process, times), *process.window)
    known: dict[int, float] = {}  # correlated processes repeat the same modes
    for variable, weight, mode in zip(process.variables, process.weights, process.modes, strict=True):
        if id(mode) not in known:
            known[id(mode)] = float(derivatives @ mode(x))
        result[place[variable]] += weight * known[id(mode)]
    return result


def _variance(parts: Sequence[_Contribution]) -> tuple[float, float]:
    """Return the variance of a sum of contributions of one expansion, and the sum of its terms' sizes."""
    variance, size = 0.0, 0.0
    for one in parts:
        covariance = one.process.covariance
        assert covariance is not None  # for mypy: lost_variance has looked
        for other in parts:
            count = len(one.weights)
            products = signal.correlate(one.weights, other.weights, method="fft")
            # places are equally spaced, so distances depend on the difference of row numbers alone
            apart = np.concatenate([one.places[0] - other.places[:0:-1], one.places - other.places[0]])
            terms = products * covariance(apart)
            assert len(terms) == 2 * count - 1
            variance, size = variance + float(terms.sum()), size + float(np.abs(terms).sum())
    return variance, size
