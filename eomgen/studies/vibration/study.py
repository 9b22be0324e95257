"""The distribution of an output of a scene under random processes: by expansions at the mean, at most probable points,
and by samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import special, stats

from eomgen.arrays import Array
from eomgen.errors import Problem, UsageError
from eomgen.reliability import (
    INVERSIONS,
    MostProbablePoint,
    QuadraticForm,
    breitung,
    first_order,
    hermite_projection,
    hohenbichler_rackwitz,
    importance_sampling,
    most_probable_points,
    rivals,
)
from eomgen.studies.vibration.findings import Cost, Distribution, Process
from eomgen.studies.vibration.result import RandomVibration
from eomgen.studies.vibration.run_response import RunResponse

if TYPE_CHECKING:
    from eomgen.model import Model

#: Where the distribution is asked for by itself: probabilities of a normal distribution of the same mean and spread.
SHARES = (1e-4, 1e-3, 0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 0.99, 0.999, 0.9999)
#: Directions in which a second most probable point is looked for.
_DIRECTIONS = 2
_NONE: Array = np.zeros(0)


def random_vibration(
    model: Model,
    output: str,
    at: float | None = None,
    step: float | None = None,
    *,
    thresholds: Sequence[float] | None = None,
    points: bool = True,
    samples: int = 0,
    tail_samples: int = 0,
    pairs: int = 0,
    times: Sequence[float] = (),
    levels: Sequence[float] = (),
    seed: int = 0,
    **options: Any,
) -> RandomVibration:
    """Return the distribution of an output at a time, and what each method has cost.

    Parameters
    ----------
    output : name, or a component, ``tip[0]``
    at, step : s; the end of the run and the step of the scene's simulation where they are not given
    thresholds : values at which the distribution is wanted; eleven from 1e-4 to 0.9999 by themselves
    points : whether the most probable point of each threshold is looked for: FORM, SORM, quadratic forms there
    samples : of Monte Carlo, 0 for none
    tail_samples : of importance sampling about the most probable point of each threshold
    pairs : of points of the Hermite projection
    times : s, at which the covariance with the output at ``at`` is wanted
    levels : whose first passage within the run is wanted, from below
    options : of ``simulate``; the method is the scene's where none is given

    Raises
    ------
    UsageError
        Counts below 0, no random process, no such output, a method without derivatives of runs.
    NumericalError
        A threshold that is not reached, a run that fails.
    """
    _check_counts(samples=samples, tail_samples=tail_samples, pairs=pairs, seed=seed)
    end, size = _span(model, at, step)
    processes, variables = processes_of(model)
    _check_output(model, output)
    response = RunResponse(model, variables, output, (end, size), options)
    costs: dict[str, Cost] = {}
    notes: list[str] = []
    origin = np.zeros(len(variables))
    with _counted(response, costs, "second_order"):
        form = response.expansion(origin).form
    plane = QuadraticForm(form.value, form.gradient, 0.0 * form.hessian)
    forms = {"first_order": plane, "second_order": form}
    if pairs:
        with _counted(response, costs, "hermite"):
            forms["hermite"] = hermite_projection(response, pairs, seed)
    wanted = _thresholds(forms.get("hermite", form), thresholds)
    moments = {name: _moments(one) for name, one in forms.items()}
    found = {name: _exact(one, wanted) for name, one in forms.items()}
    indices = np.full(len(wanted), np.nan)
    if points:
        with _counted(response, costs, "most_probable_points"):
            reached = most_probable_points(response, wanted.tolist())
            notes += _doubts(response, reached, seed)
        indices = np.array([one.index for one in reached])
        found |= _at_points(reached)
        if tail_samples:
            with _counted(response, costs, "importance_sampling"):
                found["importance_sampling"] = _tails(response, reached, tail_samples, seed)
    passage: dict[float, dict[str, float]] = {float(level): {} for level in levels}
    if samples:
        with _counted(response, costs, "monte_carlo"):
            normal = np.random.default_rng(seed).standard_normal((samples, len(variables)))
            y, highest = response.samples(normal)
        found["monte_carlo"], moments["monte_carlo"] = _counts(y[np.isfinite(y)], wanted)
        for level, values in passage.items():
            values["monte_carlo"] = float(np.mean(highest[np.isfinite(highest)] > level))
        if response.failed:
            notes.append(f"{response.failed} of {samples} samples failed, and are in no statistics")
    autocovariance: dict[str, Array] = {}
    if len(times) or levels:
        with _counted(response, costs, "along_the_run"):
            t, y, slopes = response.along(origin)
        for level, values in passage.items():
            values["crossing_rate"] = _first_passage(t, y, slopes, level)
    if len(times):
        rows = _rows(t, times)
        autocovariance["first_order"] = slopes[rows] @ form.gradient
        with _counted(response, costs, "autocovariance"):
            autocovariance["second_order"] = np.array(
                [form.covariance(_form_at(model, response, float(t[row]), size)) for row in rows]
            )
    units = {item.name: item.unit for item in model.description.outputs}
    return RandomVibration(
        model.name,
        output,
        units.get(output.partition("[")[0], ""),
        end,
        processes,
        wanted,
        moments,
        found,
        indices,
        np.asarray(times, dtype=float),
        autocovariance,
        passage,
        costs,
        notes,
    )


def processes_of(model: Model) -> tuple[tuple[Process, ...], list[str]]:
    """Return the random processes of a scene, and the parameters that are their variables. Raises UsageError."""
    found, variables = [], []
    for item in model.description.inputs:
        process = item.random
        if process is None:
            continue
        captured = process.captured[-1]
        found.append(Process(process.name, process.kind, len(process.variables), captured, tuple(process.eigenvalues)))
        variables += [name for name in process.variables if name not in variables]
    if not variables:
        hint = '[random.force] type = "squared_exponential", correlation_time = "1 s", and force in a formula'
        raise UsageError(Problem(model.name, "the scene has no random process", hint))
    return tuple(found), variables


def _check_counts(**counts: int) -> None:
    for name, count in counts.items():
        if isinstance(count, bool) or not isinstance(count, int) or count < 0:
            raise UsageError(Problem(name, f"a whole number from 0 on is needed, not {count!r}", f"{name}=1000"))


def _span(model: Model, at: float | None, step: float | None) -> tuple[float, float]:
    """Return the time and the step, of the scene where they are not given, so that it is a whole number of steps."""
    simulation = model.description.simulation
    end = simulation.duration if at is None else at
    size = simulation.step if step is None else step
    if not (np.isfinite(end) and np.isfinite(size) and 0.0 < size <= end):
        what = f"t = {end:.6g} s by steps of {size:.6g} s has no step"
        raise UsageError(Problem("at", what, "a time behind the start, and a positive step"))
    return float(end), float(size)


def _check_output(model: Model, output: str) -> None:
    sizes = {str(item["name"]): int(item["size"]) for item in model.library.layout["outputs"]}
    name, bracket, rest = output.partition("[")
    if name not in sizes:
        what = f"there is no output {name!r}"
        raise UsageError(Problem("output", what, f"one of {', '.join(sizes)}" if sizes else "[outputs.x] in the scene"))
    size = sizes[name]
    place = rest.rstrip("]")
    if bool(bracket) != (size > 1) or (bracket and not (place.isdigit() and int(place) < size)):
        hint = name if size == 1 else f"{name}[0] to {name}[{size - 1}]"
        raise UsageError(Problem("output", f"{output!r} is no single component of {name}", hint))


@contextmanager
def _counted(response: RunResponse, costs: dict[str, Cost], name: str) -> Iterator[None]:
    runs, adjoints = response.runs, response.adjoints
    yield
    costs[name] = Cost(response.runs - runs, response.adjoints - adjoints)


def _thresholds(form: QuadraticForm, given: Sequence[float] | None) -> Array:
    if given is not None:
        wanted = np.asarray(given, dtype=float)
        if wanted.ndim != 1 or not wanted.size or not np.isfinite(wanted).all():
            raise UsageError(Problem("thresholds", "finite numbers are needed", "thresholds=[0.5, 1.0]"))
        return wanted
    if not form.standard_deviation > 0.0:
        what = "the output does not depend on the random processes at this time"
        raise UsageError(Problem("output", what, "a later time, or thresholds"))
    return form.mean + form.standard_deviation * special.ndtri(np.array(SHARES))


def _moments(form: QuadraticForm) -> tuple[float, float, float, float]:
    return form.mean, form.standard_deviation, form.skewness, form.excess_kurtosis


def _exact(form: QuadraticForm, thresholds: Array) -> Distribution:
    tails = INVERSIONS["steepest_descent"](form, thresholds)
    return Distribution(tails.below, tails.above, _NONE, _NONE)


def _at_points(reached: Sequence[MostProbablePoint]) -> dict[str, Distribution]:
    quadratic = [INVERSIONS["steepest_descent"](one.form, one.threshold) for one in reached]
    saddle = [INVERSIONS["lugannani_rice"](one.form, one.threshold) for one in reached]
    found = {
        "form": _of_upper([first_order(one) for one in reached]),
        "breitung": _of_upper([breitung(one) for one in reached]),
        "hohenbichler_rackwitz": _of_upper([hohenbichler_rackwitz(one) for one in reached]),
    }
    for name, tails in (("lugannani_rice", saddle), ("quadratic", quadratic)):
        below, above = (np.array([float(getattr(one, side)) for one in tails]) for side in ("below", "above"))
        found[name] = Distribution(below, above, _NONE, _NONE)
    return found


def _of_upper(above: Sequence[float]) -> Distribution:
    upper = np.array(above)
    return Distribution(1.0 - upper, upper, _NONE, _NONE)


def _doubts(response: RunResponse, reached: Sequence[MostProbablePoint], seed: int) -> list[str]:
    """Return notes on most probable points that are not the nearest ones, or not the only ones."""
    notes = []
    for one in reached:
        if not one.nearest:
            notes.append(f"the most probable point of {one.threshold:.6g} is no nearest one: trust samples there")
    for one in {id(one): one for one in (reached[0], reached[-1])}.values():
        others = rivals(response, one, _DIRECTIONS, seed)
        if others:
            far = float(np.linalg.norm(others[0].point))
            notes.append(
                f"{one.threshold:.6g} has another most probable point, {far:.3g} standard deviations out beside"
                f" {abs(one.index):.3g}: probabilities of one point are too small there, samples count both"
            )
    return notes


def _tails(response: RunResponse, reached: Sequence[MostProbablePoint], samples: int, seed: int) -> Distribution:
    below, above, low, high = (np.empty(len(reached)) for _ in range(4))
    for k, one in enumerate(reached):
        upper = one.index >= 0.0
        estimate = importance_sampling(response, one.point, one.threshold, above=upper, samples=samples, seed=seed + k)
        tail, spread = estimate.probability, 1.96 * estimate.standard_error
        above[k] = tail if upper else 1.0 - tail
        below[k] = 1.0 - tail if upper else tail
        low[k], high[k] = below[k] - spread, below[k] + spread
    return Distribution(below, above, low, high)


def _counts(y: Array, thresholds: Array) -> tuple[Distribution, tuple[float, float, float, float]]:
    """Return the empirical distribution with bounds of Clopper and Pearson, and moments."""
    count = len(y)
    under = np.array([np.count_nonzero(y <= threshold) for threshold in thresholds])
    with np.errstate(invalid="ignore"):
        low = np.where(under > 0, special.betaincinv(under, count - under + 1.0, 0.025), 0.0)
        high = np.where(under < count, special.betaincinv(under + 1.0, count - under, 0.975), 1.0)
    below = under / count
    moments = float(y.mean()), float(y.std()), float(stats.skew(y)), float(stats.kurtosis(y))
    return Distribution(below, 1.0 - below, low, high), moments


def _rows(t: Array, times: Sequence[float]) -> list[int]:
    rows = [int(np.argmin(np.abs(t - time))) for time in times]
    for row, time in zip(rows, times, strict=True):
        if abs(t[row] - time) > 1e-6 * max(1.0, abs(t[-1])):
            what = f"t = {time:.6g} s is no row of the run; the nearest one is at {t[row]:.9g} s"
            raise UsageError(Problem("times", what, "whole steps within the run"))
    return rows


def _form_at(model: Model, response: RunResponse, time: float, step: float) -> QuadraticForm:
    """Return the second-order form of the output at another time."""
    if time <= 0.0:
        return QuadraticForm(0.0, np.zeros(response.size), np.zeros((response.size, response.size)))
    other = RunResponse(model, response.variables, response.output, (time, step), response.options)
    form = other.expansion(np.zeros(response.size)).form
    response.runs, response.adjoints = response.runs + other.runs, response.adjoints + other.adjoints
    return form


def _first_passage(t: Array, y: Array, slopes: Array, level: float) -> float:
    """Return the probability that the output passes a level from below within the run, by its mean rate of crossings.

    To first order y and its rate are Gaussian at every time; crossings are taken as a Poisson process, so what begins
    above counts as well.

    References
    ----------
    Rice: Mathematical analysis of random noise, Bell Syst. Tech. J. 24 (1945); Ditlevsen, Madsen: Structural
    Reliability Methods (1996), 14.2.
    """
    rates = np.gradient(y, t, edge_order=2)
    slope_rates = np.gradient(slopes, t, axis=0, edge_order=2)
    spread = np.sqrt(np.sum(slopes**2, axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (level - y) / spread
        coupling = np.sum(slopes * slope_rates, axis=1) / spread
        mean = rates + coupling * distance
        own = np.sqrt(np.maximum(np.sum(slope_rates**2, axis=1) - coupling**2, 0.0))
        ratio = mean / own
        density = np.exp(-0.5 * distance**2) / (np.sqrt(2.0 * np.pi) * spread)
        crossings = density * (own * np.exp(-0.5 * ratio**2) / np.sqrt(2.0 * np.pi) + mean * special.ndtr(ratio))
    crossings = np.where(spread > 0.0, crossings, 0.0)
    begun = float(special.ndtr(-distance[0])) if spread[0] > 0.0 else float(y[0] > level)
    integral = float(np.sum(0.5 * (crossings[1:] + crossings[:-1]) * np.diff(t)))
    return begun + (1.0 - begun) * -float(np.expm1(-integral))
