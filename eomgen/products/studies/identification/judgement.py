"""Identifiability, confidence intervals and diagnostics of a least-squares fit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from scipy import special

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import WRITTEN
from eomgen.errors import EomgenError, Message
from eomgen.products.studies.defaults import NAMED
from eomgen.products.studies.identification.estimation import (
    Combination,
    DependentColumns,
    Fit,
    Predictions,
    autocorrelation,
    correlation,
    covariance,
    form_of,
    structure,
    words,
)
from eomgen.products.studies.identification.experiment import ExperimentUnknowns
from eomgen.products.studies.identification.result import Column, Estimate, Identification, Record

#: Standard deviations by which steps may move an estimate.
_BIASED = 0.25


@dataclass(frozen=True)
class Judgement:
    """A least-squares fit with the data for its diagnostics: identifiability, intervals, errors of steps, residuals.

    Attributes
    ----------
    unknowns, finer : of the fit, and the same at half the step; none of efforts, which are linear in the unknowns
    fit, predict : the fit and its predictions
    limits : lower and upper bounds, (n,) each
    given : whether the deviations of the columns are given
    confidence : level of the intervals
    """

    unknowns: Any
    finer: ExperimentUnknowns | None
    fit: Fit
    predict: Predictions
    limits: tuple[Array, Array]
    given: bool
    confidence: float

    def result(self) -> Identification:
        """Return estimates with intervals and states, determined combinations, columns and notes."""
        unknowns, fit = self.unknowns, self.fit
        names, count = unknowns.names, len(unknowns.names)
        sigma = fit.deviations[unknowns.columns]
        weighted = fit.J / sigma[:, np.newaxis]
        x, (low, high) = fit.x, self.limits
        near = WRITTEN * np.maximum(np.abs(x), np.finfo(float).tiny)
        on_bound = ((x - low <= near) | (high - x <= near)).tolist()
        free = [k for k in range(count) if not on_bound[k]]
        parts = structure(weighted[:, free])
        parts = DependentColumns(
            tuple(free[k] for k in parts.kept), tuple(free[k] for k in parts.others), parts.coefficients
        )
        kept = list(parts.kept)
        freedom = len(unknowns.data) - len(kept)
        cov = covariance(fit.J[:, kept], sigma) if kept else np.zeros((0, 0))
        left = (unknowns.data - fit.values) / sigma
        spread = np.full(count, np.inf)
        spread[kept] = np.sqrt(np.diag(cov))
        bias = np.zeros(count)
        if self.finer is not None:
            bias[kept] = self._bias(self.finer, weighted[:, kept], sigma)
        times = interval(self.confidence, freedom, known_deviations=self.given)
        estimates = []
        for k, (name, unit) in enumerate(zip(names, unknowns.units, strict=True)):
            state = "determined" if k in parts.certain else "on its bound" if on_bound[k] else "undetermined"
            value, deviation = float(fit.x[k]), {"determined": float(spread[k]), "on its bound": 0.0}.get(state, np.inf)
            ends = value - times * deviation, value + times * deviation
            begin = float(unknowns.start[k])
            estimates.append(Estimate(name, unit, value, deviation, *ends, float(bias[k]), begin, state))

        def change(at: Array) -> float:
            moved = self.predict(at)
            return np.inf if moved is None else float(np.linalg.norm((moved[0] - fit.values) / sigma))

        def form(k: int) -> str:
            return "sum" if self.finer is None else form_of(parts, k, fit.x, weighted, change)

        combinations = combinations_of(parts, names, fit.x, spread, times, form)
        records = unknowns.records(fit.x, fit.values)
        columns = self._columns(records)
        if self.finer is None:
            notes, runs = unknowns.notes(weighted[:, kept], parts, combinations), (0, 0)
        else:
            notes = self._notes(estimates, combinations, columns, float(left @ left), freedom)
            runs = self.predict.runs, len(self.predict.failures)
        return Identification(
            unknowns.model.name,
            tuple(estimates),
            correlation(cov, kept, parts.certain, count),
            combinations,
            columns,
            records,
            self.confidence,
            "given" if self.given else "estimated",
            freedom,
            *runs,
            tuple(map(Message, notes)),
        )

    def _bias(self, finer: ExperimentUnknowns, weighted: Array, sigma: Array) -> Array:
        """Return the changes (kept,) of the kept unknowns by errors of steps, estimated from a run at half the step.
        `weighted` (rows, kept) are derivatives by standard deviations `sigma` (rows,). Not a number if that run
        fails."""
        try:
            values, _ = finer.predict(self.fit.x)
        except EomgenError:
            return np.full(weighted.shape[1], np.nan)
        errors = (self.fit.values - values) * 4.0 / 3.0 / sigma
        return np.asarray(-np.linalg.lstsq(weighted, errors, rcond=None)[0])

    def _columns(self, records: Sequence[Record]) -> tuple[Column, ...]:
        columns = []
        for k, (label, unit) in enumerate(self.unknowns.column_units.items()):
            parts = [record.residuals[label] for record in records if label in record.data]
            parts = [part[np.isfinite(part)] for part in parts]
            every = np.concatenate(parts)
            rms, deviation = float(np.sqrt(np.mean(every**2))), float(self.fit.deviations[k])
            columns.append(Column(label, unit, len(every), deviation, rms, autocorrelation(parts)))
        return tuple(columns)

    def _notes(
        self,
        estimates: Sequence[Estimate],
        combinations: Sequence[Combination],
        columns: Sequence[Column],
        squares: float,
        freedom: int,
    ) -> list[str]:
        """Return sentences on the search, estimates, steps, deviations and correlation of residuals. `squares` is the
        weighted sum of squared residuals with `freedom` degrees of freedom."""
        spread = [float(np.std(self.unknowns.data[self.unknowns.columns == k])) for k in range(len(columns))]
        # data without noise would ask for any step
        noisy = [column for column, size in zip(columns, spread, strict=True) if column.rms > 1e-5 * size]
        return [
            *([] if self.fit.converged else [f"the search did not converge ({self.fit.text})"]),
            *notes_of_combinations(combinations),
            *self._notes_of_estimates(estimates, combinations),
            *(self._notes_of_steps(estimates) if noisy else ()),
            *(_notes_of_deviations(squares, freedom) if self.given and freedom > 0 else ()),
            *_notes_of_correlation(noisy),
        ]

    def _notes_of_estimates(self, estimates: Sequence[Estimate], combinations: Sequence[Combination]) -> Iterator[str]:
        """Yield notes on unknowns without effect, on bounds, and on wide intervals."""
        named = {name for combination in combinations for name in combination.members}
        lost = [
            estimate.name for estimate in estimates if estimate.state == "undetermined" and estimate.name not in named
        ]
        if lost:
            yield f"without effect on the measurements: {', '.join(lost)} [W0078]"
        bound = [estimate.name for estimate in estimates if estimate.state == "on its bound"]
        if bound:
            yield f"on a bound: {', '.join(bound)}; the other intervals hold at this bound [W0079]"
        parameters = [
            estimate
            for estimate in estimates
            if estimate.state == "determined" and estimate.name in self.unknowns.parameters
        ]
        wide = [
            parameter.name for parameter in parameters if parameter.high - parameter.low > 2.0 * abs(parameter.value)
        ]
        if wide:
            yield f"intervals wider than the value: {', '.join(wide)}{self._least_determined(estimates)} [W0080]"

    def _notes_of_steps(self, estimates: Sequence[Estimate]) -> Iterator[str]:
        """Yield a note if the errors of steps move an estimate by a considerable part of the standard deviation."""
        moved = [
            estimate
            for estimate in estimates
            if estimate.state == "determined" and abs(estimate.bias) > _BIASED * estimate.deviation
        ]
        if moved:
            worst = max(moved, key=lambda estimate: abs(estimate.bias) / estimate.deviation)
            times = abs(worst.bias) / worst.deviation
            step = self.unknowns.experiments[0].step
            yield (
                f"the step of {step:.3g} s moves estimates, {worst.name} by {times:.2g} standard deviations: a step of"
                f" {step * (_BIASED / times) ** 0.5:.2g} s would leave a quarter of one [W0081]"
            )

    def _least_determined(self, estimates: Sequence[Estimate]) -> str:
        """Return in words the combination of relative changes of unknowns that the data determine least; empty if it is
        one. It is the last right singular vector of the weighted derivatives."""
        x = self.fit.x
        chosen = [k for k, estimate in enumerate(estimates) if estimate.state == "determined" and x[k] != 0.0]
        sigma = self.fit.deviations[self.unknowns.columns]
        _, _, rows = np.linalg.svd(
            self.fit.J[:, chosen] * np.abs(x[chosen]) / sigma[:, np.newaxis], full_matrices=False
        )
        shares = rows[-1] * np.sign(rows[-1][np.argmax(np.abs(rows[-1]))])
        parts = [(float(c), estimates[k].name) for k, c in zip(chosen, shares, strict=True) if abs(c) > 0.2]
        if len(parts) < 2:
            return ""
        text = "".join(f" {'-' if c < 0.0 else '+'} {abs(c):.2f} {name}" for c, name in parts).removeprefix(" + ")
        return f"; least determined, in shares of their values: {text.strip()}"


def combinations_of(
    parts: DependentColumns, names: Sequence[str], x: Array, spread: Array, times: float, form: Callable[[int], str]
) -> tuple[Combination, ...]:
    """Return the combinations that the data determine although single unknowns are not determined; ``form`` gives the
    form in which a dependent column is determined, ``times`` is the half width of intervals in standard
    deviations ``spread`` (n,) of the unknowns x (n,)."""
    forms = {dependent: form(dependent) for dependent in parts.others} if parts.mixed_columns else {}
    combinations = []
    for k in parts.mixed_columns:
        row = parts.coefficients[parts.kept.index(k)]
        others = [dependent for dependent, c in zip(parts.others, row, strict=True) if c]
        kinds = {forms[dependent] for dependent in others}
        kind = kinds.pop() if len(kinds) == 1 else "first order"
        text, value = words(parts, k, names, x, kind)
        deviation = float(spread[k]) * (abs(value / float(x[k])) if kind == "product" else 1.0)
        members = (names[k], *(names[dependent] for dependent in others))
        low, high = value - times * deviation, value + times * deviation
        combinations.append(Combination(text, members, kind, value, deviation, low, high))
    return tuple(combinations)


def notes_of_combinations(combinations: Sequence[Combination]) -> Iterator[str]:
    for combination in combinations[:NAMED]:
        if len(combination.members) <= NAMED:
            to_first = ", to first order" if combination.form == "first order" else ""
            yield f"only {combination.text} is determined{to_first} [W0076]"
        else:
            yield f"{combination.members[0]} cannot be distinguished from {len(combination.members) - 1} others [W0077]"
    if len(combinations) > NAMED:
        yield f"{len(combinations) - NAMED} more combinations"


def _notes_of_deviations(squares: float, freedom: int) -> Iterator[str]:
    """Yield a note if the weighted sum of squared residuals contradicts the given deviations, by the chi-squared
    test."""
    ratio = float(np.sqrt(squares / freedom))
    if special.chdtrc(freedom, squares) < 1e-3:
        yield (
            f"residuals are {ratio:.3g} times the deviations given: the model misses something, or these are"
            " too small; intervals are too narrow [W0082]"
        )
    elif special.chdtr(freedom, squares) < 1e-3:
        yield f"residuals are {ratio:.3g} times the deviations given, which are too large [W0083]"


def _notes_of_correlation(columns: Sequence[Column]) -> Iterator[str]:
    """Yield a note if residuals of the given columns are correlated with the next residuals, and so not white noise."""
    coloured = [column for column in columns if column.autocorrelation > max(0.3, 4.0 / np.sqrt(column.samples))]
    if coloured:
        listed = ", ".join(f"{column.name} {column.autocorrelation:.2f}" for column in coloured)
        yield (
            f"residuals are not white noise (correlation at lag 1: {listed}): the model misses something, or"
            " the noise is filtered; intervals are too narrow [W0084]"
        )


def interval(confidence: float, freedom: int, *, known_deviations: bool) -> float:
    """Return the half width of an interval in standard deviations: of the normal distribution if noise is given, of
    Student's distribution if noise is estimated."""
    level = 0.5 + 0.5 * confidence
    if known_deviations:
        return float(special.ndtri(level))
    return float(special.stdtrit(freedom, level)) if freedom > 0 else np.inf
