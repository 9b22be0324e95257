"""Reading of the translation of a random process: formulas of g, quantiles, and the covariance of g behind them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.text import key_of
from eomgen.errors import Problem, UsageError
from eomgen.formula.curves import Curve
from eomgen.formula.evaluate import curves, evaluate_batch, symbols
from eomgen.formula.nodes import Application, Formula, Symbol
from eomgen.products.reliability.random_processes import BEYOND, Covariance, quantile_map, underlying
from eomgen.products.reliability.section import schema as written
from eomgen.scene.formula.scope import TRANSLATION
from eomgen.scene.reading.values import Values
from eomgen.system.signals import NormalSeries

#: How many standard deviations from its mean a process is looked at, and at how many places.
_FARTHEST, _PLACES = 6.0, 1201
#: Quantiles at least.
_FEWEST_QUANTILES = 3


class Translations:
    """Reads translations and reports their faults."""

    def __init__(self, values: Values) -> None:
        self.values = values
        self.report = values.report

    def read(self, name: str, entry: written.RandomProcess) -> Formula | None:
        """Return the translation of an entry; None for g itself."""
        key = key_of("random", name)
        if entry.quantiles is not None:
            if entry.translation is not None:
                self.report.add(f"{key}.quantiles", "both translation and quantiles define the process", "one")
                return None
            return self._quantiles(f"{key}.quantiles", name, entry)
        if entry.translation is None:
            return None
        return self.values.formula(f"{key}.translation", entry.translation, TRANSLATION)

    def _quantiles(self, key: str, name: str, entry: written.RandomProcess) -> Formula | None:
        """Return the monotone map of a normal variable of this mean and deviation to one with these quantiles: straight
        beyond the first and the last of them."""
        points = [self.values.constants(f"{key}[{k}]", pair) for k, pair in enumerate(entry.quantiles or ())]
        share, value = np.array(points, dtype=float).reshape(-1, 2).T
        rising = len(share) >= _FEWEST_QUANTILES and np.all(np.diff(share) > 0.0) and np.all(np.diff(value) > 0.0)
        if not rising or share[0] <= 0.0 or share[-1] >= 1.0:
            fault = "quantiles are three points or more, probabilities between 0 and 1 and values that both rise"
            self.report.add(key, fault, "quantiles = [[0.1, 2.0], [0.5, 3.0], [0.9, 5.0]]")
            return None
        x, y = quantile_map(share, value)
        mean = self.values.constant(f"{key_of('random', name)}.mean", entry.mean)
        written_value = 1.0 if entry.standard_deviation is None else entry.standard_deviation
        deviation = self.values.constant(f"{key_of('random', name)}.standard_deviation", written_value)
        g: Formula = Symbol("gaussian") if mean == 0.0 else Symbol("gaussian") - mean
        return Application(Curve(f"{name} quantiles", x, y), g if deviation == 1.0 else g / deviation)

    def underlying(
        self,
        key: str,
        entry: written.RandomProcess,
        covariance: Covariance,
        translation: Formula | None,
        window: float,
    ) -> Covariance:
        """Return the covariance of g whose translation has the one that is asked for. Raises UsageError."""
        if translation is None or entry.mean not in (0, 0.0) or entry.standard_deviation not in (None, 1, 1.0):
            fault = "covariance_of translated needs a translation or quantiles of a standard normal g"
            raise UsageError(Problem(key, fault, "translation = ..., without mean and standard_deviation"))
        formula = translation
        if self._mentions_refused(formula):
            return covariance
        if entry.quantiles is None and curves(formula):
            fault = "covariance_of translated knows formulas and quantiles, and the translation has a curve"
            raise UsageError(Problem(key, fault, "quantiles"))

        def map_of(g: Array) -> Array:
            if isinstance(formula, Application) and isinstance(formula.curve, Curve):
                return np.asarray(formula.curve(np.clip(g, -BEYOND, BEYOND)))
            value = evaluate_batch(
                formula, lambda symbol: g if symbol.kind == "gaussian" else self.values.parameters[symbol.name]
            )
            return np.asarray(np.broadcast_to(value, np.shape(g)))

        return underlying(covariance, map_of, window)

    def _mentions_refused(self, formula: Formula) -> bool:
        """Return whether a formula mentions a parameter that was refused, so that its values are unknown."""
        return any(item.kind == "parameter" and item.name not in self.values.parameters for item in symbols(formula))

    def check(self, process: NormalSeries) -> None:
        """Report a translation that has no value for a possible g; note one that is not monotonic there."""
        formula = process.translation
        if formula is None or curves(formula) or self._mentions_refused(formula):
            return
        away = np.linspace(-_FARTHEST, _FARTHEST, _PLACES)
        g = process.mean + process.standard_deviation * away

        def value_of(symbol: Symbol) -> ArrayLike:
            return g if symbol.kind == "gaussian" else self.values.parameters[symbol.name]

        value = np.broadcast_to(evaluate_batch(formula, value_of), np.shape(g))
        key = f"{key_of('random', process.name)}.translation"
        if not np.all(np.isfinite(value)):
            worst = int(np.argmin(np.isfinite(value)))
            fault = f"it has no value at g = {g[worst]:.3g}, {abs(away[worst]):.2g} standard deviations from the mean"
            self.report.add(key, fault, "a formula that has one wherever a normal variable may be")
            return
        if not np.ptp(value) > 0.0:
            self.report.add(key, f"it is {value[0] + 0.0:.6g} for any g, so it is not random", "a formula of g")
            return
        rises = np.diff(value) > 0.0
        turns = np.flatnonzero(rises[1:] != rises[:-1])
        if len(turns):
            nearest_one = int(turns[np.argmin(np.abs(away[turns + 1]))]) + 1
            fault = f"it turns round at g = {g[nearest_one]:.3g}, {abs(away[nearest_one]):.2g} standard deviations"
            self.values.note([f"{key}: {fault} from the mean, so it is no map onto a marginal distribution"])
