"""What a study of random vibration is asked, checked: its processes, its output, its time, its thresholds."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import special

from eomgen.arrays import Array
from eomgen.errors import Problem, UsageError
from eomgen.reliability import QuadraticForm
from eomgen.studies.vibration.findings import Process

if TYPE_CHECKING:
    from eomgen.model import Model

#: Samples at least, where any are asked for.
FEWEST = 20
#: Standard deviations of an output, by its mean, of which the rounding of runs leaves few digits.
_FAINT = 1e-9
#: Where the distribution is asked for by itself: probabilities of a normal distribution of the same mean and spread.
SHARES = (1e-4, 1e-3, 0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 0.99, 0.999, 0.9999)


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


def check_counts(**counts: int) -> None:
    for name, count in counts.items():
        if isinstance(count, bool) or not isinstance(count, int) or count < 0:
            raise UsageError(Problem(name, f"a whole number from 0 on is needed, not {count!r}", f"{name}=1000"))


def check_samples(**counts: int) -> None:
    """Raise UsageError for so few samples that nothing is known of their errors."""
    for name, count in counts.items():
        if 0 < count < FEWEST:
            what = f"of {count} samples no error is known: {FEWEST} are the least"
            raise UsageError(Problem(name, what, f"{name}=1000, or 0 for none"))


def checked_options(given: Mapping[str, Any], variables: Collection[str]) -> dict[str, Any]:
    """Return options of runs, which record every step: crossings, largest values and directions are looked for in rows.

    Raises UsageError for rows that are farther apart, and for values of what the study goes over.
    """
    if given.get("record_every") not in (None, 1):
        what = "crossings, largest values and gradients are looked for at every step"
        raise UsageError(Problem("record_every", what, "without it"))
    parameters = given.get("parameters")
    held = [name for name in parameters if name in variables] if isinstance(parameters, Mapping) else []
    if held:
        what = f"{held[0]} is a variable of a random process, and the study goes over all its values"
        raise UsageError(Problem("parameters", what, f'simulate(parameters={{"{held[0]}": ...}}), one run'))
    return {**given, "record_every": 1}


def check_levels(levels: Sequence[float]) -> None:
    for level in levels:
        if not np.isfinite(level):
            raise UsageError(Problem("levels", f"the level {level} is not a finite number", "levels=[1.5]"))


def span_of(model: Model, at: float | None, step: float | None) -> tuple[float, float]:
    """Return the time and the step, of the scene where they are not given, so that it is a whole number of steps."""
    simulation = model.description.simulation
    end = simulation.duration if at is None else at
    size = simulation.step if step is None else step
    if not (np.isfinite(end) and np.isfinite(size) and 0.0 < size <= end):
        what = f"t = {end:.6g} s by steps of {size:.6g} s has no step"
        raise UsageError(Problem("at", what, "a time behind the start, and a positive step"))
    return float(end), float(size)


def check_output(model: Model, output: str) -> None:
    sizes = {str(item["name"]): int(item["size"]) for item in model.library.layout["outputs"]}
    known = f"one of {', '.join(sizes)}" if sizes else "[outputs.x] in the scene"
    if not isinstance(output, str):
        raise UsageError(Problem("output", f"a name is needed, not {type(output).__name__}", known))
    name, bracket, rest = output.partition("[")
    if name not in sizes:
        raise UsageError(Problem("output", f"there is no output {name!r}", known))
    size = sizes[name]
    place = rest.rstrip("]")
    if bool(bracket) != (size > 1) or (bracket and not (place.isdigit() and int(place) < size)):
        hint = name if size == 1 else f"{name}[0] to {name}[{size - 1}]"
        raise UsageError(Problem("output", f"{output!r} is no single component of {name}", hint))


def thresholds_of(form: QuadraticForm, given: Sequence[float] | None, *, needs_spread: bool) -> Array:
    """Return the thresholds, checked; ``needs_spread``: whether an output without spread is refused, in any case where
    none are given."""
    if (needs_spread or given is None) and not form.standard_deviation > 0.0:
        what = "to second order about the mean the output does not depend on the random processes at this time"
        raise UsageError(Problem("output", what, "another output, a later time; samples alone: points=False"))
    if given is not None:
        wanted = np.asarray(given, dtype=float)
        if wanted.ndim != 1 or not wanted.size or not np.isfinite(wanted).all():
            raise UsageError(Problem("thresholds", "finite numbers are needed", "thresholds=[0.5, 1.0]"))
        return wanted
    return form.mean + form.standard_deviation * special.ndtri(np.array(SHARES))


def doubts_of_spread(form: QuadraticForm) -> list[str]:
    """Return a note on an output that is constant, or nearly so."""
    if not form.standard_deviation > 0.0:
        return ["to second order about the mean the output does not depend on the random processes at this time"]
    if form.standard_deviation < _FAINT * abs(form.mean):
        part = form.standard_deviation / abs(form.mean)
        return [f"the output's standard deviation is {part:.1g} of its mean: rounding of runs leaves few of its digits"]
    return []
