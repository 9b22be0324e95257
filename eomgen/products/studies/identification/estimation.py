"""Weighted least squares with exact derivatives and bounds, the covariance of the estimates, and the combinations of
unknowns that data determine.

SciPy's trust region reflective method (Branch, Coleman and Li 1999) has the steps; if runs fail, it makes its
trust region smaller. Unknowns with derivatives that are combinations of other columns stay at the start.

Columns are taken from the left, so unidentifiable parts are counted with the unknown that is named first. A run
does not depend linearly on its parameters: of masses and stiffnesses, it may decide ratios alone. So each combination
is tried both as a sum and as a product, by runs away from the estimates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import least_squares

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED, WRITTEN
from eomgen.errors import EomgenError, NumericalError, Problem, UsageError

#: Distance from the estimates at which forms of combinations are tried.
_AWAY = 0.05


@dataclass(frozen=True)
class Combination:
    """A combination of unknowns that the data determine, although the data determine none of these unknowns alone.

    Attributes
    ----------
    text : in words
    members : names of the unknowns
    form : ``sum``, ``product``, or ``first order``: a sum at the estimates alone
    value, deviation : value at the estimates, and standard deviation
    low, high : confidence interval
    """

    text: str
    members: tuple[str, ...]
    form: str
    value: float
    deviation: float
    low: float
    high: float


@dataclass(frozen=True)
class DependentColumns:
    """A split of the columns of a Jacobian into independent columns, and columns that are combinations of these.

    Attributes
    ----------
    kept, others : columns of the Jacobian
    coefficients : (kept, others): J[:, others] = J[:, kept] @ coefficients
    """

    kept: tuple[int, ...]
    others: tuple[int, ...]
    coefficients: Array

    @property
    def certain(self) -> tuple[int, ...]:
        """Kept columns on which no other column depends."""
        return tuple(k for k in self.kept if k not in self.mixed_columns)

    @property
    def mixed_columns(self) -> tuple[int, ...]:
        """Kept columns on which other columns depend."""
        return tuple(k for k, row in zip(self.kept, self.coefficients, strict=True) if np.any(row))


def structure(J: Array) -> DependentColumns:
    """Return the independent columns of J (rows, n), and the coefficients of the other columns. Columns are taken from
    the left; a column counts as dependent if less than 1e-8 of its norm remains."""
    norms = np.linalg.norm(J, axis=0)
    basis: list[Array] = []
    kept, others = list[int](), list[int]()
    for column in range(J.shape[1]):
        rest = J[:, column] / norms[column] if norms[column] > 0.0 else np.zeros(len(J))
        for _ in range(2):
            for vector in basis:
                rest = rest - (vector @ rest) * vector
        remainder = float(np.linalg.norm(rest))
        if remainder > 1e-8:  # rounding of a run and its derivatives
            kept.append(column)
            basis.append(rest / remainder)
        else:
            others.append(column)
    safe = np.where(norms > 0.0, norms, 1.0)
    unit = J / safe
    solved = np.linalg.lstsq(unit[:, kept], unit[:, others], rcond=None)[0]
    solved[np.abs(solved) < 1e-5] = 0.0
    return DependentColumns(tuple(kept), tuple(others), solved * safe[others] / safe[kept][:, np.newaxis])


def form_of(structure: DependentColumns, dependent: int, x: Array, J: Array, change: Callable[[Array], float]) -> str:
    """Return the form in which inseparable unknowns are determined: ``sum``, ``product`` or ``first order``.

    Parameters
    ----------
    structure, dependent : independent columns, and the number of a dependent one
    x : (n,) estimates
    J : (rows, n) there
    change : norm of the change of outputs from x to other unknowns, in the units of the rows of J
    """
    column, kept = structure.coefficients[:, structure.others.index(dependent)], list(structure.kept)
    alone = _AWAY * (abs(float(x[dependent])) or 1.0) * float(np.linalg.norm(J[:, dependent]))
    left = {"sum": np.inf, "product": np.inf}
    for away in (_AWAY, -_AWAY):  # runs may fail on one side
        moved = x.copy()
        size = away * (abs(float(x[dependent])) or 1.0)
        moved[dependent] += size
        moved[kept] -= column * size
        left["sum"] = min(left["sum"], change(moved))
        if x[dependent] != 0.0 and np.all(x[kept][column != 0.0] != 0.0):
            turned = x.copy()
            turned[dependent] *= 1.0 + away
            exponents = np.divide(column * x[dependent], x[kept], out=np.zeros(len(kept)), where=column != 0.0)
            with np.errstate(over="ignore"):  # exponents that no product has
                turned[kept] *= (1.0 + away) ** -exponents
            left["product"] = min(left["product"], change(turned))
        if np.isfinite(left["sum"]):
            break
    # if only ratios count, zero differences do not change either, and are less informative
    return next((form for form in ("product", "sum") if left[form] <= WRITTEN * alone), "first order")


def words(structure: DependentColumns, kept: int, names: Sequence[str], x: Array, form: str) -> tuple[str, float]:
    """Return a combination of unknowns in words, such as ``k / m`` or ``a + 2 b``, and its value at x (n,). `kept` is
    the number of the independent unknown, `form` is ``product``, ``sum`` or ``first order``."""
    row = structure.coefficients[structure.kept.index(kept)]
    if form == "product":
        exponents = {kept: 1.0} | {
            o: float(c * x[o] / x[kept]) for o, c in zip(structure.others, row, strict=True) if c
        }
        exponents = {column: _short(e) for column, e in exponents.items()}
        above = [_power(names[column], e) for column, e in exponents.items() if e > 0.0]
        below = [_power(names[column], -e) for column, e in exponents.items() if e < 0.0]
        value = float(np.prod([x[column] ** e for column, e in exponents.items()]))
        return " ".join(above) + "".join(f" / {text}" for text in below), value
    text, value = names[kept], float(x[kept])
    for dependent, c in zip(structure.others, row, strict=True):
        if c:
            factor = _short(abs(float(c)))
            text += f" {'-' if c < 0.0 else '+'} {'' if factor == 1.0 else f'{factor:.6g} '}{names[dependent]}"
            value += float(c) * float(x[dependent])
    return text, value


def _power(name: str, exponent: float) -> str:
    return name if exponent == 1.0 else f"{name}^{exponent:.4g}"


def _short(number: float) -> float:
    """Return a multiple of 1/12 that a number is up to the errors of runs, else the number."""
    near = round(12.0 * number) / 12.0
    return near if abs(near - number) < 1e-4 and near else number


#: Values and derivatives at unknowns (n,): (rows,) and (rows, n).
Predict = Callable[[Array], tuple[Array, Array]]


class Predictions:
    """Callable for values and derivatives at unknowns, which counts ``runs``, keeps ``failures``, and repeats the last
    result."""

    def __init__(self, predict: Predict) -> None:
        self._predict = predict
        self._last: tuple[Array, Array, Array] | None = None
        self.runs = 0
        self.failures: list[str] = []

    def __call__(self, x: Array) -> tuple[Array, Array] | None:
        """Return values (rows,) and derivatives (rows, n) at unknowns x (n,); None, with the reason kept, if the run
        fails. A UsageError of the first run is raised."""
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
                self.failures.append("outputs are not finite numbers")
                return None
            self._last = x.copy(), values, slopes
        return self._last[1:]


@dataclass(frozen=True)
class Fit:
    """A least-squares fit.

    Attributes
    ----------
    x : (n,) unknowns
    values, J : (rows,) predictions at x, and (rows, n) derivatives of predictions
    deviations : (columns,) of the measured columns
    converged : whether the search came to the end
    text : message of SciPy without convergence
    """

    x: Array
    values: Array
    J: Array
    deviations: Array
    converged: bool
    text: str


def ranges_of(data: Array, columns: Array) -> Array:
    """Return the range of each column of data, (columns,); 1 in place of 0."""
    return np.array([float(np.ptp(data[columns == k])) or 1.0 for k in range(int(columns.max()) + 1)])


@dataclass(frozen=True)
class LeastSquares:
    """A weighted least-squares search for the unknowns that fit data best, within bounds.

    Attributes
    ----------
    predict : values and derivatives at unknowns
    data : (rows,)
    columns : (rows,) column of each row
    bounds : lower and upper bounds, (n,) each
    deviations : (columns,) standard deviations of the columns; None: deviations are estimated from the residuals
    limit : predictions at most in one search
    linear : whether predictions are linear: one step of Gauss's finds the least sum of squares
    """

    predict: Predictions
    data: Array
    columns: Array
    bounds: tuple[Array, Array]
    deviations: Array | None
    limit: int = 200
    linear: bool = False

    def fit(self, x: Array) -> Fit:
        """Return the fit from start values x (n,); unknowns whose columns depend on others keep their start values.

        Raises
        ------
        UsageError
            There are fewer data than unknowns.
        NumericalError
            The run fails at the start.
        """
        if len(self.data) < len(x):
            fault = f"there are {len(self.data)} samples for {len(x)} unknowns [E1083]"
            raise UsageError(Problem("data", fault, "more samples, or fewer unknowns"))
        first = self.predict(x)
        if first is None:
            fault = f"the run fails at the initial guess: {self.predict.failures[0]} [E1053]"
            raise NumericalError(Problem("identify", fault, "other start values (values=, --set), or a smaller step"))
        sigma = ranges_of(self.data, self.columns) if self.deviations is None else self.deviations
        kept = self._independent(first[1], sigma)
        for _ in range(3):  # other unknowns may turn out to be independent at the end than at the start
            result = self._fit_with_deviations(x, sigma, kept)
            x, sigma, before = result.x, result.deviations, kept
            kept = self._independent(result.J, sigma)
            if kept == before:
                break
        return result

    def _independent(self, J: Array, sigma: Array) -> list[int]:
        return list(structure(J / sigma[self.columns][:, np.newaxis]).kept)

    def _fit_with_deviations(self, x: Array, sigma: Array, kept: Sequence[int]) -> Fit:
        """Return the fit of the unknowns `kept` from x (n,), with standard deviations `sigma` (columns,) to begin with.
        Searches are repeated with deviations estimated from the residuals, unless deviations are given."""
        count, known_deviations = len(sigma), self.deviations is not None
        sizes = np.array([np.count_nonzero(self.columns == k) for k in range(count)])
        share = max(1.0 - len(kept) / len(self.data), 1.0 / len(self.data))
        rounds, enough = (30, WRITTEN) if self.linear else (12, 3e-3)
        for number in range(1 if known_deviations or count == 1 else rounds):
            x, converged, text = self._search(x, sigma[self.columns], kept)
            if known_deviations:
                break
            left = self._values_and_jacobian(x)[0] - self.data
            squares = np.array([float(left[self.columns == k] @ left[self.columns == k]) for k in range(count)])
            estimated = np.maximum(np.sqrt(squares / (sizes * share)), COMPUTED * ranges_of(self.data, self.columns))
            change = float(np.max(np.abs(estimated / sigma - 1.0)))
            sigma = estimated
            if number and change < enough:
                break
        values, J = self._values_and_jacobian(x)
        return Fit(x, values, J, sigma, converged, text)

    def _values_and_jacobian(self, x: Array) -> tuple[Array, Array]:
        result = self.predict(x)
        if result is None:
            fault = f"the run fails: {self.predict.failures[-1]} [E1054]"
            raise NumericalError(Problem("identify", fault, "a smaller step"))
        return result

    def _search(self, x: Array, sigma: Array, kept: Sequence[int]) -> tuple[Array, bool, str]:
        """Return the unknowns (n,) at the least sum of squares over the unknowns `kept`, whether converged, and SciPy's
        message. `sigma` (rows,) are the standard deviations of the data."""
        nothing, chosen = np.full(len(self.data), np.inf), list(kept)

        def whole(part: Array) -> Array:
            result = x.copy()
            result[chosen] = part
            return result

        def residuals(part: Array) -> Array:
            result = self.predict(whole(part))
            return nothing if result is None else (result[0] - self.data) / sigma

        def jacobian(part: Array) -> Array:
            return self._values_and_jacobian(whole(part))[1][:, chosen] / sigma[:, np.newaxis]

        if self.linear:
            steps = np.linalg.lstsq(jacobian(x[chosen]), -residuals(x[chosen]), rcond=None)[0]
            return whole(x[chosen] + steps), True, ""
        low, high = self.bounds
        result = least_squares(
            residuals,
            x[chosen],
            jac=jacobian,
            bounds=(low[chosen], high[chosen]),
            x_scale="jac",
            ftol=1e-10,
            xtol=1e-10,
            gtol=None,
            max_nfev=self.limit,
        )
        return whole(np.asarray(result.x)), bool(result.status > 0), str(result.message)


def covariance(J: Array, sigma: Array) -> Array:
    """Return the covariance (n, n) of unknowns, by derivatives J (rows, n) with independent columns. `sigma` (rows,)
    are the standard deviations of the data."""
    weighted = J / sigma[:, np.newaxis]
    norms = np.linalg.norm(weighted, axis=0)
    R = np.linalg.qr(weighted / norms, mode="r")
    inverse = np.linalg.solve(R, np.eye(len(norms))) / norms[:, np.newaxis]
    return np.asarray(inverse @ inverse.T)


def correlation(cov: Array, kept: Sequence[int], chosen: Sequence[int], count: int) -> Array:
    """Return the correlation (count, count) of chosen unknowns, nan for unknowns that are not kept; cov (kept, kept) is
    the covariance of kept unknowns."""
    places = [kept.index(k) for k in chosen]
    inner = cov[np.ix_(places, places)]
    result = np.full((count, count), np.nan)
    result[np.ix_(chosen, chosen)] = inner / np.sqrt(np.outer(np.diag(inner), np.diag(inner)))
    return result


def autocorrelation(left: Sequence[Array]) -> float:
    """Return the correlation of residuals with those one sample later, over several runs."""
    products = sum(float(residuals[1:] @ residuals[:-1]) for residuals in left)
    squares = sum(float(residuals @ residuals) for residuals in left)
    return products / squares if squares > 0.0 else 0.0
