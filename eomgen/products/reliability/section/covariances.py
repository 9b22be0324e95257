"""Read the covariance of a random process, coherences between processes, and translations by formulas of g or by
quantiles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import key_of
from eomgen.base.rounding import COMPUTED
from eomgen.errors import Problem, UsageError
from eomgen.formula.curves import Curve
from eomgen.formula.evaluate import curves, evaluate_batch, symbols
from eomgen.formula.nodes import Application, Formula, Symbol
from eomgen.products.reliability.random_processes.coherence import (
    Coherence,
    CoherenceTable,
    CrossCovariance,
    ExponentialCoherence,
    least_eigenvalue,
)
from eomgen.products.reliability.random_processes.covariance import (
    MAPPED,
    Constant,
    Covariance,
    CovarianceTable,
    DampedCosine,
    DensityTable,
    RoadProfile,
    SquaredExponential,
    band,
    exponential,
    kanai_tajimi,
    oscillator,
    quantile_map,
    underlying,
)
from eomgen.scene.formula.scope import TRANSLATION
from eomgen.scene.reading.key_metadata import label_of
from eomgen.scene.reading.values import Values
from eomgen.scene.signals.curve_schema import ShapeEntry
from eomgen.scene.signals.curves import Curves
from eomgen.system.signals import NormalSeries

if TYPE_CHECKING:
    from eomgen.products.reliability.section import schema as written


@dataclass(frozen=True)
class _Type:
    """Keys of a type of process.

    Attributes
    ----------
    over_time, over_distance : keys of the type over time, over distance; None if the type is not defined over time or
        over distance
    made : returns the covariance, given the values of the keys and the standard deviation
    deviation : whether the standard deviation is given
    """

    over_time: tuple[str, ...] | None
    over_distance: tuple[str, ...] | None
    made: Callable[..., Covariance]
    deviation: bool = True


_TABLE = ("points",)
TYPES: dict[str, _Type] = {
    "constant": _Type((), (), Constant),
    "squared_exponential": _Type(("correlation_time",), ("correlation_length",), SquaredExponential),
    "exponential": _Type(("correlation_time",), ("correlation_length",), exponential),
    "damped_cosine": _Type(("decay", "frequency"), None, DampedCosine),
    "oscillator": _Type(("frequency", "damping"), None, oscillator),
    "kanai_tajimi": _Type(("frequency", "damping"), None, kanai_tajimi),
    "band": _Type(("band",), None, lambda s, ends: band(s, *ends)),
    "road": _Type(None, ("road_class",), RoadProfile, deviation=False),
    "covariance": _Type(_TABLE, _TABLE, CovarianceTable, deviation=False),
    "spectrum": _Type(_TABLE, _TABLE, lambda curve: DensityTable(curve.x, curve.y), deviation=False),
}
#: Keys that some types take, as written.
_KEYS = {
    **dict.fromkeys(("correlation_time", "correlation_length", "decay", "frequency", "damping", "band")),
    "road_class": "class",
    "points": "points or table",
}


def _deviation(key: str, entry: written.RandomProcess, values: Values) -> float:
    """Return the standard deviation of g."""
    deviation = 1.0 if entry.standard_deviation is None else entry.standard_deviation
    return values.constant(f"{key}.standard_deviation", deviation)


class Covariances:
    """Reader of covariances of random processes, which reports faults and does not raise them.

    Parameters
    ----------
    values : Values
        Evaluates numbers of the scene, and has the report of faults.
    curves : Curves
        Reads points and tables.
    """

    def __init__(self, values: Values, curves: Curves) -> None:
        self.values, self.report, self.curves = values, values.report, curves

    def read(self, key: str, name: str, entry: written.RandomProcess, kind: str) -> Covariance | None:
        """Read the covariance of a process; None for a fault, which is reported.

        Parameters
        ----------
        key, name : str
            Key of the entry in the file, and name of the process.
        entry : RandomProcess
            The entry as written.
        kind : str
            Type of the covariance, a name in ``TYPES``.
        """
        row = TYPES[kind]
        over, not_over = ("time", "distance") if entry.speed is None else ("distance", "time")
        wanted = row.over_time if entry.speed is None else row.over_distance
        if wanted is None:
            hint = "speed = 20" if over == "time" else "no speed"
            self.report.add(f"{key}.type", f"{kind} is a process over {not_over} [E0974]", hint)
            return None
        complete = self._check_keys(key, entry, f"{kind} over {over}", wanted)
        deviation = self._deviations(key, entry, kind)
        if not complete:
            return None
        before = len(self.report.noted)
        arguments = [self._argument(key, name, entry, word) for word in wanted]
        unknown = len(self.report.noted) > before or any(argument is None for argument in arguments)
        return None if unknown else row.made(*deviation, *arguments)

    def _check_keys(self, key: str, entry: written.RandomProcess, title: str, wanted: Sequence[str]) -> bool:
        """Return whether an entry has all keys ``wanted`` by the type of its covariance; report missing ones. If none
        is missing, keys of other types are reported. ``title`` names the type in messages."""
        values = {word: getattr(entry, word) for word in _KEYS}
        if entry.table is not None:
            values["points"] = entry.points or ()
        missing = [_KEYS[word] or word for word in wanted if values[word] is None]
        if missing:
            fault = f"{title} needs {' and '.join(missing)} [E0975]"
            self.report.add(key, fault, f"{missing[0].partition(' ')[0]} = ...")
        for word, value in values.items():
            if value is not None and word not in wanted and not missing:
                written_as = _KEYS[word] or word
                fault = f"{title} takes no {written_as} [E0981]"
                self.report.add(f"{key}.{written_as.partition(' ')[0]}", fault, " and ".join(wanted))
        return not missing

    def _deviations(self, key: str, entry: written.RandomProcess, kind: str) -> list[float]:
        """Return the standard deviation as a list of one number; an empty list for types that define the variance
        themselves. A value that is not positive, or given with such a type, is reported."""
        if TYPES[kind].deviation:
            value = _deviation(key, entry, self.values)
            if not value > 0.0:
                fault = f"the standard deviation {value:.6g} is not positive [E0987]"
                self.report.add(f"{key}.standard_deviation", fault, "standard_deviation = 1")
            return [value]
        if entry.standard_deviation is not None:
            fault = f"{kind} says the variance itself, and takes no standard deviation [E0988]"
            self.report.add(f"{key}.standard_deviation", fault, "without it")
        return []

    def _argument(self, key: str, name: str, entry: written.RandomProcess, word: str) -> object:
        """Return the value of key ``word`` as the covariance's class takes it; None if unknown, which is reported. The
        value is a class of roads, a Curve for "points", two frequencies in Hz for "band", else a number. Values out of
        range are reported, and returned all the same."""
        if word == "road_class":
            return entry.road_class
        if word == "points":
            return self._points(key, name, entry)
        path, value = f"{key}.{word}", getattr(entry, word)
        if word == "band":
            low, high = self.values.constants(path, value)
            if not 0.0 <= low < high:
                fault = f"{low:.6g} to {high:.6g} Hz is not a band of frequencies [E0989]"
                self.report.add(path, fault, 'band = ["0.5 Hz", "20 Hz"]')
            return low, high
        number = self.values.constant(path, value)
        if np.isnan(number):  # reported on reading
            return None
        if not number > 0.0:
            self.report.add(path, f"{word.replace('_', ' ')} {number:.6g} is not positive [E0990]", f"{word} = 1")
        elif word == "damping" and not number < 1.0:
            self.report.add(path, f"the damping ratio {number:.6g} is not below 1 [E0991]", "damping = 0.6")
        return number

    def _points(self, key: str, name: str, entry: written.RandomProcess) -> Curve | None:
        """Return the points of a covariance over lags, or of a one-sided spectrum over frequencies, as a curve. None if
        they cannot be read; improper lags or values are reported, and the curve is returned all the same."""
        spectrum = entry.type == "spectrum"
        rule: Any = {"interpolation": "linear", "outside": "hold"}
        rule = rule if spectrum else {"interpolation": "quintic", "outside": "error"}
        shape = ShapeEntry(points=entry.points, table=entry.table, **rule)
        before = len(self.report.noted)
        curve = self.curves.through_points(key, name, shape)
        if len(self.report.noted) > before or self.report.concerns(key):  # refused units are reported before
            return None
        path = f"{key}.{'points' if entry.points is not None else 'table'}"
        if curve.start < 0.0:
            fault = f"the first {'frequency' if spectrum else 'lag'} {curve.start:.6g} is negative [E0992]"
            self.report.add(path, fault, "the half from 0 on: the other is the same")
        elif curve.start > 0.0 and not spectrum:
            fault = f"the first lag is {curve.start:.6g}, so the variance is not known [E0994]"
            self.report.add(path, fault, "a first point at lag 0")
        elif not spectrum and not curve.y[0] > 0.0:
            self.report.add(path, f"the variance {curve.y[0]:.6g}, at lag 0, is not positive [E0995]", "a larger one")
        if spectrum and np.any(curve.y < 0.0):
            worst = int(np.argmin(curve.y))
            fault = f"the density {curve.y[worst]:.6g} at {curve.x[worst]:.6g} is negative [E0993]"
            self.report.add(path, fault, "a one-sided power spectral density")
        elif spectrum and not np.any(curve.y > 0.0):
            self.report.add(path, "the spectrum is zero everywhere [E0996]", "a positive density somewhere")
        return curve


def read_coherences(
    values: Values, names: Sequence[str], entries: Mapping[str, written.RandomProcess]
) -> list[list[Coherence | None]] | None:
    """Return the coherences of the processes ``names`` of a group as a symmetric matrix in this order: lists of lists,
    None for a pair without coherence and on the diagonal. Instead None if there is a fault, which is reported:
    contradicting or improper entries."""
    report = values.report
    before = len(report.noted)
    result: list[list[Coherence | None]] = [[None] * len(names) for _ in names]
    said: dict[tuple[int, int], object] = {}
    for i, name in enumerate(names):
        for neighbour, coherence in (entries[name].coherence or {}).items():
            key, j = f"{key_of('random', name)}.coherence", names.index(neighbour) if neighbour in names else i
            pair = min(i, j), max(i, j)
            if i == j or said.setdefault(pair, coherence) != coherence:
                fault = f"its coherence with {neighbour} is one thing here and another there [E0998]"
                report.add(key, fault, "one of them")
                continue
            result[i][j] = result[j][i] = _coherence(values, key, neighbour, coherence)
    if len(report.noted) > before:
        return None
    least, frequency = least_eigenvalue(result)
    if least < -COMPUTED:
        fault = (
            f"no processes have the coherences of {', '.join(names)}: an eigenvalue of their matrix at the"
            f" frequency {frequency:.3g} is {least:.3g}, negative [E0997]"
        )
        hint = "coherences of all pairs: a pair that is not named has 0"
        report.add(f"{key_of('random', names[-1])}.coherence", fault, hint)
        return None
    return result


def _coherence(
    values: Values, key: str, neighbour: str, written_as: float | Sequence[Sequence[float | str]]
) -> Coherence | None:
    """Return the coherence with process ``neighbour``: exponential for a number, its decay; a table for pairs of
    frequency and coherence. None for a fault, which is reported under ``key``."""
    if isinstance(written_as, int | float):
        if not written_as > 0.0:
            fault = f"the decay {written_as:.6g} of the coherence with {neighbour} is not positive [E1000]"
            values.report.add(key, fault, "a decay such as 0.5, or a correlation of the same at all frequencies")
            return None
        return ExponentialCoherence(float(written_as))
    before = len(values.report.noted)
    pairs = [values.constants(f"{key}.{neighbour}[{k}]", pair) for k, pair in enumerate(written_as)]
    if len(values.report.noted) > before:
        return None
    f, c = np.array(pairs, dtype=float).reshape(-1, 2).T
    if len(f) < 2 or f[0] < 0.0 or np.any(np.diff(f) <= 0.0) or np.any(np.abs(c) > 1.0):
        fault = "two points or more, of rising frequencies from 0 on, between -1 and 1 [E0999]"
        values.report.add(key, f"the coherence with {neighbour} is {fault}", "[[0, 1], [2.0, 0.4], [10.0, 0]]")
        return None
    return CoherenceTable(f, c)


def cross_covariances(
    covariance: Covariance, coherences: Sequence[Sequence[Coherence | None]], window: float
) -> list[list[Covariance]]:
    """Return the square matrix of covariances and cross covariances of processes with the same covariance, as lists.
    The diagonal has the covariance itself; other elements follow from the coherence of the pair, and are zero for None.
    ``window`` is the largest lag, s or m."""
    none = CoherenceTable(np.array([0.0, 1.0 / window]), np.zeros(2))
    return [
        [
            covariance if i == j else CrossCovariance(covariance, coherence or none, window)
            for j, coherence in enumerate(row)
        ]
        for i, row in enumerate(coherences)
    ]


class Translations:
    """Reader of translations X = T(g) of a Gaussian process g, given by a formula or by quantiles, which reports
    faults."""

    def __init__(self, values: Values) -> None:
        self.values, self.report = values, values.report

    def read(self, name: str, entry: written.RandomProcess) -> Formula | None:
        """Return the translation of an entry as a formula of g, from a formula, quantiles or a distribution; None if
        the process is g itself, and for a fault, which is reported."""
        key = key_of("random", name)
        words = [word for word in ("translation", "quantiles", "distribution") if getattr(entry, word) is not None]
        if len(words) > 1:
            self.report.add(f"{key}.{words[1]}", f"both {words[0]} and {words[1]} define the process [E2204]", "one")
            return None
        if entry.translation is not None:
            return self.values.formula(f"{key}.translation", entry.translation, TRANSLATION)
        if not words:
            return None
        curve_of = self._distribution if entry.quantiles is None else self._quantiles
        if (curve := curve_of(f"{key}.{words[0]}", name, entry)) is None:
            return None
        mean, deviation = self.values.constant(f"{key}.mean", entry.mean), _deviation(key, entry, self.values)
        g: Formula = Symbol("gaussian") if mean == 0.0 else Symbol("gaussian") - mean
        return Application(curve, g if deviation == 1.0 else g / deviation)

    def _quantiles(self, key: str, name: str, entry: written.RandomProcess) -> Curve | None:
        """Return the monotone map from a standard normal variable to one with the entry's quantiles; None for a fault,
        which is reported. The map is straight before the first and after the last quantile."""
        points = [self.values.constants(f"{key}[{k}]", pair) for k, pair in enumerate(entry.quantiles or ())]
        share, value = np.array(points, dtype=float).reshape(-1, 2).T
        rising = len(share) >= 3 and np.all(np.diff(share) > 0.0) and np.all(np.diff(value) > 0.0)
        if not rising or share[0] <= 0.0 or share[-1] >= 1.0:
            fault = (
                "quantiles are three points or more, probabilities between 0 and 1 and values that both rise [E1002]"
            )
            self.report.add(key, fault, "quantiles = [[0.1, 2.0], [0.5, 3.0], [0.9, 5.0]]")
            return None
        return Curve(f"{name} quantiles", MAPPED, quantile_map(share, value))

    def _distribution(self, key: str, name: str, entry: written.RandomProcess) -> Curve | None:
        """Return the map from a standard normal variable to one of the entry's distribution, a spline through its
        quantile function. None for a fault, which is reported, as a distribution with single values."""
        # few processes have one
        from eomgen.products.ensembles import from_normal, read_distribution  # noqa: PLC0415

        try:
            distribution = read_distribution(key, entry.distribution or "", label_of(entry.unit))
        except UsageError as error:
            for problem in error.problems:
                self.report.add(key, problem.what, problem.hint)
            return None
        if distribution.levels or distribution.whole:
            fault = f"{entry.distribution} has single values, and a process takes all between them [E2205]"
            self.report.add(key, fault, 'distribution = "uniform(0, 1)"')
            return None
        return Curve(f"{name} distribution", MAPPED, from_normal(distribution, MAPPED), smooth_ends=True)

    def underlying(
        self, key: str, entry: written.RandomProcess, covariance: Covariance, translation: Formula | None, window: float
    ) -> Covariance:
        """Return the covariance of g for which the translated process has the requested covariance.

        If the translation mentions a refused parameter, the requested covariance is returned. Raises UsageError if no g
        has such a covariance, if there is no translation, g is not standard normal, or the formula has a curve.

        Parameters
        ----------
        key, entry : str and RandomProcess
            Key in the file, and the entry as written.
        covariance : Covariance
            Requested covariance of the translated process.
        translation : Formula or None
            Formula of g.
        window : float
            Length of the window, s or m.
        """
        if translation is None or entry.mean not in (0, 0.0) or entry.standard_deviation not in (None, 1, 1.0):
            fault = "covariance_of translated needs a translation or quantiles of a standard normal g [E1003]"
            raise UsageError(Problem(key, fault, "translation = ..., without mean and standard_deviation"))
        formula = translation
        if self._mentions_refused(formula):
            return covariance
        if entry.quantiles is None and entry.distribution is None and curves(formula):
            fault = "covariance_of translated knows formulas and quantiles, and the translation has a curve [E1004]"
            raise UsageError(Problem(key, fault, "quantiles"))

        def map_of(g: Array) -> Array:
            if isinstance(formula, Application) and isinstance(formula.curve, Curve):
                return np.asarray(formula.curve(np.clip(g, MAPPED[0], MAPPED[-1])))
            return self._values_at(formula, g)

        return underlying(covariance, map_of, window)

    def _values_at(self, formula: Formula, g: Array) -> Array:
        """Return the values of a translation at values of g."""

        def value_of(symbol: Symbol) -> ArrayLike:
            return g if symbol.kind == "gaussian" else self.values.parameters[symbol.name]

        return np.asarray(np.broadcast_to(evaluate_batch(formula, value_of), np.shape(g)))

    def _mentions_refused(self, formula: Formula) -> bool:
        """Return whether a formula mentions a refused parameter, so that values of the formula are unknown."""
        return any(item.kind == "parameter" and item.name not in self.values.parameters for item in symbols(formula))

    def check(self, process: NormalSeries) -> None:
        """Report a process whose translation is not finite or is constant within six standard deviations of g; note one
        that is not monotonic there. Formulas with curves or refused parameters are not checked."""
        formula = process.translation
        if formula is None or curves(formula) or self._mentions_refused(formula):
            return
        away = np.linspace(-6.0, 6.0, 1201)
        g = process.mean + process.standard_deviation * away
        value = self._values_at(formula, g)
        key = f"{key_of('random', process.name)}.translation"
        if not np.all(np.isfinite(value)):
            worst = int(np.argmin(np.isfinite(value)))
            fault = (
                f"it has no value at g = {g[worst]:.3g}, {abs(away[worst]):.2g} standard deviations from the"
                f" mean [E1005]"
            )
            self.report.add(key, fault, "a formula that has one wherever a normal variable may be")
            return
        if not np.ptp(value) > 0.0:
            self.report.add(key, f"it is {value[0] + 0.0:.6g} for any g, so it is not random [E1007]", "a formula of g")
            return
        rises = np.diff(value) > 0.0
        turns = np.flatnonzero(rises[1:] != rises[:-1])
        if len(turns):
            nearest_one = int(turns[np.argmin(np.abs(away[turns + 1]))]) + 1
            fault = (
                f"it turns round at g = {g[nearest_one]:.3g}, {abs(away[nearest_one]):.2g} standard deviations from the"
                " mean, so it is not a map onto a marginal distribution [E1006]"
            )
            self.values.note([f"{key}: {fault}"])
