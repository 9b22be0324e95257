"""Arguments of a study of random vibration, checked: its processes, its output, its time, its thresholds, and the
variance that is lost with modes left out.

The share of an output's variance that is lost with the modes left out of Karhunen-Loeve expansions.

To first order the output is y = const + sum over rows k of a_k g(x_k). Here a_k is its derivative in the value of the
process at row k, and x_k the place of the process there. So the variance with all modes is sum a_k a_l R(x_k - x_l), R
the covariance of g, and the variance of the modes kept is the square of the gradient in their variables.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import signal, special

from eomgen.base.arrays import Array
from eomgen.base.calls import check_options
from eomgen.base.messages import nearest, shown
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.compiled.arguments import check_finite, number_of, numbers
from eomgen.errors import Problem, UsageError
from eomgen.products.reliability.vibration.result import Process
from eomgen.simulation.option_types import SensitivityOptions
from eomgen.system.description import component_names
from eomgen.system.signals import NormalSeries

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model


#: Samples at least, if any are requested.
FEWEST = 20
#: Share of the output's variance in modes that are left out, or in the last tenth of modes, that gives a note.
_TRUNCATED = 0.01
#: Options of ``simulate`` excluded in runs with derivatives, and substitutes.
_OF_OTHER_RUNS = {
    **dict.fromkeys(("tolerance", "order"), "step=..., for fixed steps"),
    "start": "initial=..., or start in the scene",
    "controllers": "simulate(...), one run",
    **dict.fromkeys(("t_end", "duration"), "at"),
    **dict.fromkeys(("n_samples", "monte_carlo"), "samples"),
}
#: Arguments of this study, which come first among suggestions for an unknown name.
OWN = (
    *("output", "at", "step", "thresholds", "points", "projected", "whole", "samples", "tail_samples", "pairs"),
    *("times", "levels", "seed"),
)
#: Probabilities of a distribution requested without thresholds: of a normal distribution of the same mean and spread.
SHARES = (1e-4, 1e-3, 0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 0.99, 0.999, 0.9999)


def processes_of(model: Model) -> tuple[tuple[Process, ...], list[str]]:
    """Return the random processes of a scene, irregular waves included, and the names of their variables. The variables
    are parameters; processes may share them, and each is listed once. Raises UsageError for a scene without random
    variables."""
    result, variables = [], []
    for item in model.description.inputs:
        process = item.series
        if process is None:
            continue
        captured = process.captured[-1]
        result.append(Process(process.name, process.kind, len(process.variables), captured, tuple(process.eigenvalues)))
        variables += [name for name in process.variables if name not in variables]
    for waves in model.description.parts.get("waves", ()):
        names = list(waves.variables)
        if names:
            energies = [wave.amplitude**2 for wave in waves.components[: waves.free]]
            twice = tuple(sorted([*energies, *energies], reverse=True))
            result.append(Process(waves.name, "waves", len(names), 1.0, twice))
            variables += names
    if not variables:
        hint = '[random.force] type = "squared_exponential", correlation_time = "1 s", and force in a formula'
        if seas := [waves.name for waves in model.description.parts.get("waves", ())]:
            hint = f"variables = true in [waves.{seas[0]}], if it has a spectrum"
        raise UsageError(Problem(model.name, "the scene has no random process [E1033]", hint))
    return tuple(result), variables


def cut_processes(model: Model) -> list[NormalSeries]:
    """Return the random processes of a scene that share an expansion of which modes are left out, or follow one."""
    processes = [item.series for item in model.description.inputs if item.series is not None]
    return processes if any(process.captured[-1] <= 1.0 - COMPUTED for process in processes) else []


def doubts_of_truncation(lost: float, processes: Sequence[NormalSeries], *, linear: bool) -> list[str]:
    """Return a list with a note on the share ``lost`` of the output's variance that is lost with the modes left out of
    processes; empty if the share is 1 % or less. ``linear`` says whether the share is exact, or of first order."""
    if lost <= _TRUNCATED:
        return []
    least = min(process.captured[-1] for process in processes)
    percent, low = f"{100.0 * lost:.2g}", f"{100.0 * (1.0 - math.sqrt(1.0 - lost)):.2g}"
    about = "" if linear else ", to first order about the mean motion"
    return [
        f"the modes left out, with {100.0 * (1.0 - least):.2g} % of a process's variance, have {percent} % of the"
        f" output's{about}: its standard deviation is {low} % low; try: share = {1.0 - 0.1 * (1.0 - least):.6g} or more"
    ]


def truncated_processes(model: Model, variables: Sequence[str], gradient: Array) -> list[str]:
    """Return notes on processes whose last tenth of modes has much of the output's variance, so that modes left out may
    have much, too; an empty list if there are none.

    Parameters
    ----------
    variables : names of the n standard normal variables
    gradient : (n,), of the output by these, about the mean
    """
    slopes, whole = dict(zip(variables, (gradient**2).tolist(), strict=True)), float(gradient @ gradient)
    notes = []
    for item in model.description.inputs:
        process = item.series
        own_variables = () if process is None else process.own_variables
        if process is None or process.captured[-1] > 1.0 - COMPUTED or not own_variables:
            continue
        last = own_variables[-max(1, len(own_variables) // 10) :]
        share = sum(slopes.get(name, 0.0) for name in last) / whole if whole > 0.0 else 0.0
        if share > _TRUNCATED:
            count = f"{len(last)} of {len(own_variables)} modes" if len(last) > 1 else f"mode of {len(own_variables)}"
            left = 1.0 - process.captured[-1]
            notes.append(
                f"the last {count} of {process.name} have {100.0 * share:.2g} % of the output's variance, to first"
                f" order: the modes that are left out, with {100.0 * left:.2g} % of the process's, may have as much;"
                f" try: share = {1.0 - 0.1 * left:.6g} [W0064]"
            )
    return notes


def check_samples(**counts: int) -> None:
    """Raise UsageError for too few samples for an error estimate."""
    for name, count in counts.items():
        if 0 < count < FEWEST:
            fault = f"of {count} samples no error is known: {FEWEST} are the least [E1034]"
            raise UsageError(Problem(name, fault, f"{name}=1000, or 0 for none"))


def checked_options(
    options: Mapping[str, Any], variables: Collection[str], processes: Collection[str]
) -> dict[str, Any]:
    """Return the options of ``random_vibration`` for runs, with every step recorded. Crossings, largest values and
    directions are looked for in recorded rows. Raises UsageError for options excluded in runs with derivatives, for
    rows with larger intervals, and for values of ``variables`` or inputs of ``processes``, which the study varies."""
    check_options("random_vibration", options, SensitivityOptions.__annotations__, _OF_OTHER_RUNS, OWN)
    if options.get("record_every") not in (None, 1):
        fault = "crossings, largest values and gradients are looked for at every step [E1035]"
        raise UsageError(Problem("record_every", fault, "without it"))
    parameters = options.get("parameters")
    if not (parameters is None or isinstance(parameters, Mapping)):
        fault = f"values by name are needed, not {shown(parameters)} [E1036]"
        raise UsageError(Problem("parameters", fault, 'parameters={"mass": 1.5}'))
    held = [name for name in parameters or () if name in variables]
    if held:
        fault = f"{held[0]} is a variable of a random process, and the study goes over all its values [E1037]"
        hint = f'simulate(parameters={{"{held[0]}": ...}}) (eomgen simulate --set {held[0]}=...), one run'
        raise UsageError(Problem("parameters", fault, hint))
    inputs = options.get("inputs")
    replaced = [name for name in inputs if name in processes] if isinstance(inputs, Mapping) else []
    if replaced:
        fault = f"{replaced[0]} is a random process, and the study goes over all its values [E1038]"
        raise UsageError(Problem("inputs", fault, f'without it; simulate(inputs={{"{replaced[0]}": ...}}), one run'))
    return {**options, "record_every": 1}


def numbers_of(name: str, value: Any, hint: str, *, least: int = 1) -> Array:
    """Return a list of finite numbers, (n,). Raises UsageError.

    Parameters
    ----------
    name : str
        Name of the argument, for messages.
    value : object
        The list.
    hint : str
        Remedy in messages.
    least : int, optional
        Smallest length.
    """
    result = numbers(name, value)
    if result.ndim != 1 or len(result) < least:
        raise UsageError(Problem(name, f"a list of numbers is needed, not {shown(value)} [E1039]", hint))
    check_finite(name, result)
    return result


def span_of(model: Model, at: float | None, step: float | None, t_start: float = 0.0) -> tuple[float, float]:
    """Return the end and the step of a run, s.

    Parameters
    ----------
    model : Model
        The scene of the model gives the default values.
    at, step : float or None
        End and step, s; by default as in the scene.
    t_start : float, optional
        Time of the start, s.
    """
    simulation = model.description.simulation
    end = t_start + simulation.duration if at is None else number_of("at", at)
    return end, simulation.step if step is None else number_of("step", step)


def check_output(model: Model, output: str) -> None:
    """Raise UsageError if the model has no such component of an output."""
    outputs = model.library.layout["outputs"]
    names = [name for item in outputs for name in component_names("", str(item["name"]), int(item["size"]))]
    if not isinstance(output, str) or output not in names:
        hint = nearest(str(output), names) or "[outputs.x] in the scene"
        raise UsageError(Problem("output", f"there is no output {shown(output)} [E0204]", hint))


def thresholds_of(
    mean: float, deviation: float, bounds: Sequence[float] | None, *, needs_spread: bool, varies: bool
) -> Array:
    """Return the thresholds of an output (n,): the given ones, or eleven quantiles of a normal distribution.

    Raises UsageError if the output has no spread and `needs_spread` is true or no thresholds are given.

    Parameters
    ----------
    mean, deviation : of the output
    bounds : the given thresholds, or None
    needs_spread : whether an output without spread is refused
    varies : whether samples differ, for the message
    """
    if (needs_spread or bounds is None) and not deviation > 0.0:
        hint = "another output, a later time; samples alone: thresholds=[...], points=False (--threshold, --no-points)"
        raise UsageError(Problem("output", _without_spread(varies=varies), hint))
    if bounds is None:
        return mean + deviation * special.ndtri(np.array(SHARES))
    return np.array(bounds)


def _without_spread(*, varies: bool) -> str:
    if varies:
        return (
            "about the mean the output has neither slope nor bend, though samples differ: a kink, as of abs at"
            " 0 [E1048]"
        )
    return "to second order about the mean the output does not depend on the random processes at this time [E1047]"


def doubts_of_spread(mean: float, deviation: float, *, varies: bool) -> list[str]:
    """Return a list with a note on an output whose standard deviation is zero, or less than 1e-9 of its mean; else
    empty. ``varies`` says whether samples differ."""
    if not deviation > 0.0:
        return [_without_spread(varies=varies)]
    if deviation < COMPUTED * abs(mean):
        part = deviation / abs(mean)
        return [f"the output's standard deviation is {part:.1g} of its mean: rounding of runs leaves few of its digits"]
    return []


#: Tolerated difference between the gradient in the variables and the gradient from derivatives in the values of
#: processes, as a part of the norm.
_EXPLAINED = 0.02


#: The part of a process in the variables of one expansion: weights (rows,) times g at places (rows,).
_Contribution = tuple[NormalSeries, Array, Array]


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
        takes processes between rows in ways that derivatives at rows do not show.
    """
    if not gradient.any() or any(process.covariance is None for process in processes):
        return float("nan")
    column_of = {name: k for k, name in enumerate(variables)}
    by_process = np.stack(
        [_gradient(process, times, derivatives[process.name], column_of) for process in processes], axis=1
    )
    slopes = np.ones(len(processes))
    mapped = [k for k, process in enumerate(processes) if process.translation is not None]
    columns = sorted({column_of[name] for process in processes for name in process.variables})
    if mapped:  # the slope of a translation at the mean, which derivatives do not contain
        plain = [k for k in range(len(processes)) if k not in mapped]
        left = gradient[columns] - by_process[np.ix_(columns, plain)].sum(axis=1)
        slopes[mapped] = np.linalg.lstsq(by_process[np.ix_(columns, mapped)], left, rcond=None)[0]
    missed = float(np.linalg.norm(by_process[columns] @ slopes - gradient[columns]))
    if missed > _EXPLAINED * float(np.linalg.norm(gradient[columns])):
        return float("nan")
    expansions: dict[str, list[_Contribution]] = {}
    for process, slope in zip(processes, slopes.tolist(), strict=True):
        for owner, weight in _owners(process).items():
            weights = slope * weight * derivatives[process.name]
            expansions.setdefault(owner, []).append((process, weights, _places(process, times)))
    variances = [_variance(parts) for parts in expansions.values()]
    variance, size = sum(variance for variance, _ in variances), sum(size for _, size in variances)
    kept = float(gradient[columns] @ gradient[columns])
    if not variance > SUMMED * size:
        return float("nan")
    return max(0.0, (variance - kept) / (variance - kept + float(gradient @ gradient)))


def _owners(process: NormalSeries) -> dict[str, float]:
    """Return the weight of each expansion that a process sums, by the name of the process that owns the variables."""
    return {
        variable.rpartition("_")[0]: weight for variable, weight in zip(process.variables, process.weights, strict=True)
    }


def _places(process: NormalSeries, times: Array) -> Array:
    return np.asarray((process.speed or 1.0) * times - process.lag)


def _gradient(process: NormalSeries, times: Array, derivatives: Array, column_of: Mapping[str, int]) -> Array:
    """Return the derivatives (variables,) of an output by all standard normal variables that act through one process.
    `derivatives` (rows,) are by the process's value at each of ``times``, and `column_of` has the index of each
    variable by name. Variables of other processes have 0."""
    result = np.zeros(len(column_of))
    x = np.clip(_places(process, times), *process.window)
    known: dict[int, float] = {}  # correlated processes repeat the same modes
    for variable, weight, mode in zip(process.variables, process.weights, process.modes, strict=True):
        if id(mode) not in known:
            known[id(mode)] = float(derivatives @ mode(x))
        result[column_of[variable]] += weight * known[id(mode)]
    return result


def _variance(parts: Sequence[_Contribution]) -> tuple[float, float]:
    """Return the variance, with all modes, for a sum of contributions from one expansion, and the sum of the terms'
    magnitudes, a measure of rounding."""
    variance, size = 0.0, 0.0
    for process, weights, places in parts:
        assert process.covariance is not None  # for mypy: lost_variance has looked
        for _, other_weights, other_places in parts:
            products = signal.correlate(weights, other_weights, method="fft")
            # places are equally spaced, so distances depend on the difference of row numbers alone
            apart = np.concatenate([places[0] - other_places[:0:-1], places - other_places[0]])
            terms = products * process.covariance(apart)
            variance, size = variance + float(terms.sum()), size + float(np.abs(terms).sum())
    return variance, size
