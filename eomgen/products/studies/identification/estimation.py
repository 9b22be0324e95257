"""Weighted least squares with exact derivatives and bounds, with the covariance of the estimates.

SciPy's trust region reflective method (Branch, Coleman and Li 1999) has the steps; if runs fail, it makes its
trust region smaller. Unknowns with derivatives that are combinations of other columns stay at their start.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError, NumericalError, Problem, UsageError
from eomgen.products.studies.identification.combinations import structure

#: Values and derivatives at unknowns (n,): (rows,) and (rows, n).
Predict = Callable[[Array], tuple[Array, Array]]
#: Relative change of the sum of squares, and of the unknowns, at which the search ends.
_CONVERGED = 1e-10
#: Searches at most, if other unknowns turn out to be independent at the end than at the start.
_STRUCTURES = 3
#: Passes by which deviations of columns are found, their relative change at which they end, and their least part of a
#: column's range: data without noise have none.
_PASSES, _SAME, _LEAST = 12, 3e-3, 1e-9


class Predictions:
    """Predictions at unknowns, counted, and kept for the last ones."""

    def __init__(self, predict: Predict) -> None:
        self._predict = predict
        self._last: tuple[Array, Array, Array] | None = None
        self.runs = 0
        self.failures: list[str] = []

    def __call__(self, x: Array) -> tuple[Array, Array] | None:
        """Return values and derivatives, None if the run fails."""
        if self._last is None or not np.array_equal(self._last[0], x):
            self.runs += 1
            try:
                values, slopes = self._predict(x)
            except EomgenError as error:
                if self.runs == 1 and isinstance(error, UsageError):
                    raise  # a fault of the request, not of the search
                self.failures.append(error.problems[0].what)
                return None
            if not (np.isfinite(values).all() and np.isfinite(slopes).all()):
                self.failures.append("outputs are no finite numbers")
                return None
            self._last = x.copy(), values, slopes
        return self._last[1:]


@dataclass(frozen=True)
class Fit:
    """A least-squares fit.

    Attributes
    ----------
    x : (n,) unknowns
    values, J : (rows,) predictions there, and (rows, n) their derivatives
    deviations : (columns,) of the measured columns
    converged : whether the search came to its end
    text : SciPy's, if it did not
    """

    x: Array
    values: Array
    J: Array
    deviations: Array
    converged: bool
    text: str


def fit(
    predict: Predictions,
    data: Array,
    columns: Array,
    x: Array,
    bounds: tuple[Array, Array],
    deviations: Array | None,
    limit: int,
) -> Fit:
    """Return the unknowns that fit data best.

    Parameters
    ----------
    data : (rows,)
    columns : (rows,) column of each row
    x : (n,) start of the search
    bounds : (n,) each
    deviations : (columns,) standard deviations of the columns; None: they are estimated from the residuals
    limit : predictions at most in one search

    Raises
    ------
    NumericalError
        The run fails at the start.
    """
    first = predict(x)
    if first is None:
        fault = f"the run fails at the initial guess: {predict.failures[0]}"
        raise NumericalError(Problem("identify", fault, "other start values (values=, --set), or a smaller step"))
    count = int(columns.max()) + 1
    ranges = np.array([float(np.ptp(data[columns == k])) or 1.0 for k in range(count)])
    sigma = ranges if deviations is None else deviations
    kept = list(structure(first[1] / sigma[columns][:, np.newaxis]).kept)
    for _ in range(_STRUCTURES):
        result = _weighed(predict, data, columns, x, bounds, sigma, ranges, deviations is not None, kept, limit)
        x, sigma, before = result.x, result.deviations, kept
        kept = list(structure(result.J / sigma[columns][:, np.newaxis]).kept)
        if kept == before:
            break
    return result


def _weighed(
    predict: Predictions,
    data: Array,
    columns: Array,
    x: Array,
    bounds: tuple[Array, Array],
    sigma: Array,
    ranges: Array,
    given: bool,
    kept: Sequence[int],
    limit: int,
) -> Fit:
    """Return the fit of the unknowns that are kept, with deviations that suit its residuals if none are given."""
    count = len(sigma)
    sizes = np.array([np.count_nonzero(columns == k) for k in range(count)])
    share = max(1.0 - len(kept) / len(data), 1.0 / len(data))
    for number in range(1 if given or count == 1 else _PASSES):
        x, converged, text = _searched(predict, data, sigma[columns], x, bounds, kept, limit)
        if given:
            break
        left = _found(predict, x)[0] - data
        squares = np.array([float(left[columns == k] @ left[columns == k]) for k in range(count)])
        estimated = np.maximum(np.sqrt(squares / (sizes * share)), _LEAST * ranges)
        change = float(np.max(np.abs(estimated / sigma - 1.0)))
        sigma = estimated
        if number and change < _SAME:
            break
    values, J = _found(predict, x)
    return Fit(x, values, J, sigma, converged, text)


def _found(predict: Predictions, x: Array) -> tuple[Array, Array]:
    result = predict(x)
    if result is None:
        raise NumericalError(Problem("identify", f"the run fails: {predict.failures[-1]}", "a smaller step"))
    return result


def _searched(
    predict: Predictions,
    data: Array,
    sigma: Array,
    x: Array,
    bounds: tuple[Array, Array],
    kept: Sequence[int],
    limit: int,
) -> tuple[Array, bool, str]:
    """Return the unknowns at the least sum of squares over the kept ones, and the end of the search."""
    nothing, chosen = np.full(len(data), np.inf), list(kept)

    def whole(part: Array) -> Array:
        result = x.copy()
        result[chosen] = part
        return result

    def residuals(part: Array) -> Array:
        result = predict(whole(part))
        return nothing if result is None else (result[0] - data) / sigma

    def jacobian(part: Array) -> Array:
        return _found(predict, whole(part))[1][:, chosen] / sigma[:, np.newaxis]

    low, high = bounds
    result = least_squares(
        residuals,
        x[chosen],
        jac=jacobian,
        bounds=(low[chosen], high[chosen]),
        x_scale="jac",
        ftol=_CONVERGED,
        xtol=_CONVERGED,
        gtol=None,
        max_nfev=limit,
    )
    return whole(np.asarray(result.x)), bool(result.status > 0), str(result.message)


def covariance(J: Array, sigma: Array) -> Array:
    """Return the covariance (n, n) of unknowns by independent columns of derivatives (rows, n) and deviations
    (rows,)."""
    weighted = J / sigma[:, np.newaxis]
    norms = np.linalg.norm(weighted, axis=0)
    R = np.linalg.qr(weighted / norms, mode="r")
    inverse = np.linalg.solve(R, np.eye(len(norms))) / norms[:, np.newaxis]
    result: Array = inverse @ inverse.T
    return result


def correlation(cov: Array, kept: Sequence[int], chosen: Sequence[int], count: int) -> Array:
    """Return the correlation (count, count) of chosen unknowns, nan of others; cov (kept, kept) is of those kept."""
    places = [kept.index(k) for k in chosen]
    inner = cov[np.ix_(places, places)]
    result = np.full((count, count), np.nan)
    result[np.ix_(chosen, chosen)] = inner / np.sqrt(np.outer(np.diag(inner), np.diag(inner)))
    return result


def autocorrelation(left: Sequence[Array]) -> float:
    """Return the correlation of residuals with those one sample later, over several runs."""
    products = sum(float(one[1:] @ one[:-1]) for one in left)
    squares = sum(float(one @ one) for one in left)
    return products / squares if squares > 0.0 else 0.0
