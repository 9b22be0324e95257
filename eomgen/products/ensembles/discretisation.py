"""Errors by the steps of an ensemble's runs: estimates for a few samples, and random processes that the steps do not
resolve, by the share of their variance above the steps' frequency.

A sine above half the frequency of the steps is aliased to a slower sine, also in runs at other steps, so comparison
runs cannot show the error. The share is computed from the spectra of the process's own modes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Sequence
from functools import cached_property
from typing import Any, cast

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.products import LateRow, import_target, rows_of
from eomgen.compiled.model import CompiledModel
from eomgen.errors import EomgenError, Message
from eomgen.products.ensembles.samples import SampleRunner
from eomgen.results.error_estimate import NOTICED, ErrorEstimate, SampleErrors
from eomgen.results.finding import WARNING
from eomgen.results.solution import Solution
from eomgen.simulation.simulate import simulate
from eomgen.system.signals import NormalSeries

#: Name of the finding on estimated errors, reported by ``SampleErrors``.
_OF_ERROR = "discretisation_error"
#: Attributes of a solution that an estimate has under the same name.
_STATES = ("q", "v", "z", "multipliers")


class EnsembleJudgement:
    """Estimated errors and notes of an ensemble, evaluated when they are read for the first time, since samples with
    estimates cost more than thousands of short runs in lanes."""

    def __init__(
        self,
        work: SampleRunner,
        nominal: Solution,
        *,
        estimates: bool,
        interrupted: bool,
        notes: Sequence[str] = (),
        last: Sequence[str] = (),
    ) -> None:
        """Keep the samples and the run without variations for later; `notes` come before all others, `last` after.
        `estimates` and `interrupted`: whether errors are to be estimated, and whether Ctrl-C ended the ensemble."""
        self._asked = work, nominal, estimates, interrupted
        self._other_notes = notes, last

    @cached_property
    def _errors_and_notes(self) -> tuple[SampleErrors, tuple[str, ...]]:
        work, nominal, estimates, interrupted = self._asked
        errors, of_samples = sample_errors(work, nominal, examined=estimates and not interrupted)
        inputs = work.options.common.get("inputs") or {}
        unresolved = unresolved_processes(work.model, nominal, inputs) if estimates else []
        return errors, tuple(filter(None, (*unresolved, _doubts(nominal), *of_samples)))

    @property
    def error(self) -> SampleErrors:
        """Estimated errors of the run without variations and of a few samples over the design."""
        return self._errors_and_notes[0]

    @property
    def of_steps(self) -> tuple[str, ...]:
        """Notes on processes that steps do not resolve, and on doubtful samples."""
        return self._errors_and_notes[1]

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Notes on the design, the starts, the steps, and on outputs that lose variance of processes."""
        work, nominal, estimates, interrupted = self._asked
        before, after = self._other_notes
        further = _further_doubts(work, nominal) if estimates and not interrupted else []
        return tuple(map(Message, filter(None, (*before, *self.of_steps, *further, *after))))

    def __getstate__(self) -> dict[str, Any]:
        """Return the results alone, since another process has no compiled model."""
        return {"_errors_and_notes": self._errors_and_notes, "notes": self.notes}


def _further_doubts(work: SampleRunner, nominal: Solution) -> list[str]:
    """Return notes of products on outputs of the ensemble, on one output for every eight samples, since notes cost
    runs."""
    outputs = [name.removeprefix("output.") for name in work.columns if name.startswith("output.")]
    chosen = outputs[: work.design.samples // 8]
    varied = [item.name.partition(".")[2] if item.block == "process" else item.name for item in work.options.items]
    span = float(nominal.metadata["t_end"]), float(nominal.metadata["settings"]["step"])
    rows = rows_of("eomgen.ensemble_notes", LateRow) if chosen else ()
    options = {**work.options.common, **work.options.rest}
    doubts = [cast("Callable[..., list[str]]", import_target(row.target)) for row in rows]
    return [note for doubt in doubts for note in doubt(work.model, chosen, varied, span, options)]


def _doubts(nominal: Solution) -> str:
    """Return the warnings of the run without variations; empty without warnings."""
    if not nominal.success:
        return f"the run without variations fails: {nominal.message}"
    warnings = "; ".join(str(finding) for finding in nominal.findings if finding.severity == WARNING)
    return f"the run without variations: {warnings}" if warnings else ""


def sample_errors(work: SampleRunner, nominal: Solution, *, examined: bool) -> tuple[SampleErrors, list[str]]:
    """Return the estimated errors of the run without variations and, if ``examined``, of a few samples of ``work``. The
    second result has the warnings of these samples that the run without variations has not, one of each kind."""
    began = time.perf_counter()
    solutions = _with_estimates(work) if examined else {}
    estimates = {number: solution.error for number, solution in solutions.items()}
    every = [nominal.error, *estimates.values()]
    places = work.alike.places
    columns = {name: _column_error(every, *places[name]) for name in work.columns if name in places}
    step = float(nominal.metadata["settings"]["step"])
    known, told = {finding.name for finding in nominal.findings}, []
    for number, solution in solutions.items():
        for finding in solution.findings:
            if finding.name == _OF_ERROR and solution.error.worst is not None and solution.error.worst.share > NOTICED:
                continue  # the worst one is the result
            if finding.severity == WARNING and finding.name not in known:
                known.add(finding.name)
                told.append(f"sample {number}: {finding}")
    return SampleErrors(nominal.error, estimates, columns, step, time.perf_counter() - began), told


def _with_estimates(work: SampleRunner) -> dict[int, Solution]:
    """Run up to four samples, spread over the first samples of the design, and one in eight at most, with error
    estimates; return the solutions of successful ones by number."""
    total = work.design.samples
    result: dict[int, Solution] = {}
    values = work.design.values(0, min(4096, total))
    for number in spread_samples(values, min(4, total // 8)):
        try:
            solution = simulate(work.model, *work.span, **work.options.of(values[number]))
        except EomgenError:  # a failed sample, reported by the ensemble with the reason
            continue
        if solution.interrupted:
            break
        if solution.success:
            result[number] = solution
    return result


def _column_error(estimates: Sequence[ErrorEstimate], attribute: str, component: int) -> float:
    """Return the largest error of a column over runs with estimates; NaN if none is known. `attribute` is q, v, z,
    multipliers or ``output.`` with a name, and `component` the index there."""
    kind, _, name = attribute.partition(".")
    errors = []
    for estimate in estimates:
        if not estimate.available:
            continue
        if kind == "output" and name in estimate.outputs_at:
            errors.append(np.atleast_1d(estimate.outputs[name])[component])
        elif attribute in _STATES:
            errors.append(getattr(estimate, attribute)[component])
    known = [float(error) for error in errors if np.isfinite(error)]
    return max(known, default=float("nan"))


def spread_samples(values: Array, count: int) -> list[int]:
    """Return the numbers of samples that are spread over a design.

    The first sample is the farthest from the middle; each further sample is the farthest from all previous samples, in
    ranks. Of samples that are as far in ranks, as the least and the greatest value are, the farthest in values is the
    first.

    Parameters
    ----------
    values : (samples, varied)
    count : int
    """
    ranks = np.argsort(np.argsort(values, axis=0, kind="stable"), axis=0, kind="stable") / max(len(values) - 1, 1)
    fixed = np.ptp(values, axis=0) == 0.0
    ranks[:, fixed] = 0.5
    spans = np.where(fixed, 1.0, np.ptp(values, axis=0))
    away = np.linalg.norm((values - np.median(values, axis=0)) / spans, axis=1)
    distance = np.linalg.norm(ranks - 0.5, axis=1) + 1e-6 * away
    chosen: list[int] = []
    for _ in range(min(count, len(values))):
        distance[chosen] = -1.0
        chosen.append(int(np.argmax(distance)))
        apart = np.linalg.norm(ranks - ranks[chosen[-1]], axis=1)
        distance = apart if len(chosen) == 1 else np.minimum(distance, apart)
    return chosen


def unresolved_processes(model: CompiledModel, run: Solution, inputs: Collection[str]) -> list[str]:
    """Return one sentence for each random process of a scene that the steps of a run do not resolve: 1 % or more of
    its variance has higher frequencies.

    Parameters
    ----------
    model : CompiledModel
    run : Solution
        Of the scene, with the steps in question.
    inputs : names of inputs that the caller gives, in place of the scene's
    """
    if run.stats.get("own_steps") or run.stats.get("expansions"):  # steps chosen by errors follow the laws of time
        return []
    start, end = float(run.metadata["t_start"]), float(run.metadata["t_end"])
    step = float(run.metadata["settings"]["step"])
    highest = 0.5 / step
    result = []
    for process in (item.series for item in model.description.inputs if item.series and item.name not in inputs):
        if process.follows and process.translation is None:
            continue
        frequencies, power = _spectrum(model, process, start, end)
        if not np.any(power > 0.0):
            continue
        above = np.clip((frequencies - highest) / frequencies[1] + 0.5, 0.0, 1.0)  # of each interval
        share = float(power @ above / power.sum())
        if share > 0.01:
            shortest = 1.0 / float(frequencies[np.searchsorted(np.cumsum(power) / power.sum(), 0.99)])
            percent = f"{100.0 * share:.2g}" if share < 0.995 else "100"
            result.append(
                f"{percent} % of the variance of the process {process.name} lies above {highest:.3g} Hz, the"
                f" highest frequency that steps of {step:.3g} s resolve, and acts as another process; try: a step of"
                f" {0.1 * shortest:.2g} s, 10 to the shortest period of 99 % of the variance"
            )
    return result


def _spectrum(model: CompiledModel, process: NormalSeries, start: float, end: float) -> tuple[Array, Array]:
    """Return frequencies (n,) in Hz and the variance at each, (n,), of a random process from start to end in s. Modes
    are tapered, and exact for the sum of modes; a translated process has harmonics of these, and is realised."""
    low, high = process.window
    speed = process.speed or 1.0
    points = max(len(mode.x) for mode in process.modes) * (end - start) * speed / (high - low)
    count = int(np.clip(max(4.0 * len(process.modes), 2.0 * points), 64, 2**14))  # 8 times for the shortest wave
    times = start + (end - start) * (np.arange(count) + 0.5) / count
    if process.translation is None:
        distance = np.clip(speed * times - process.lag, low, high)
        rows = np.array([weight * mode(distance) for weight, mode in zip(process.weights, process.modes, strict=True)])
    else:
        rows = _realisations(model, process, times)
    # changes slower than the run are at the frequency 0, not at the window's
    line = np.stack([np.ones(count), times - times.mean()])
    slow = (rows @ line.T / np.sum(line**2, axis=1)) @ line
    taper = np.hanning(count)
    power: Array = np.sum(np.abs(np.fft.rfft(taper * (rows - slow), axis=1)) ** 2, axis=0)
    power[0] += 0.5 * count * float(np.sum((taper * slow) ** 2))  # by Parseval, of half of a spectrum
    frequencies: Array = np.asarray(np.fft.rfftfreq(count, (end - start) / count), dtype=float)
    return frequencies, power


def _realisations(model: CompiledModel, process: NormalSeries, times: Array) -> Array:
    """Return 16 realisations of a random process at times (n,) in s, (16, n), less their common mean."""
    names, column = list(model.parameters), list(model.inputs).index(process.name)
    places = [names.index(name) for name in process.variables]
    random, parameters = np.random.default_rng(0), np.array(model.parameter_array(None))
    rows = []
    for _ in range(16):
        parameters[places] = random.standard_normal(len(places))
        rows.append(model.input_values(times, parameters=parameters)[:, column])
    result = np.array(rows)
    return np.asarray(result - result.mean())
