"""Bounds and deviations as arrays, and unknowns without effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.text import shown
from eomgen.compiled.arguments import check_name, number_of
from eomgen.errors import Problem, UsageError
from eomgen.products.studies.identification.unknowns import Unknowns

#: Least change of outputs, in standard deviations, by a change of an unknown by its own size.
_EFFECT = 1e-9


def bounds_of(unknowns: Unknowns, bounds: Mapping[str, tuple[float, float]] | None) -> tuple[Array, Array]:
    names, x = unknowns.names, unknowns.start
    low, high = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    if bounds is not None and not isinstance(bounds, Mapping):
        fault = f"bounds by name are needed, not {shown(bounds)}"
        raise UsageError(Problem("bounds", fault, f'bounds={{"{names[0]}": (0.1, 10.0)}}'))
    for name, given in (bounds or {}).items():
        places = [k for k, known in enumerate(names) if name == known or known.startswith(f"{name} of ")]
        if not places:
            check_name("unknown", name, names)
        try:
            first, last = (float(one) for one in given)
        except (TypeError, ValueError):
            raise UsageError(Problem(f"bounds of {name}", f"{given!r} are no two numbers", "(0.1, 10.0)")) from None
        if np.isnan([first, last]).any():
            fault = f"({first:.6g}, {last:.6g}) has a bound that is no number"
            raise UsageError(Problem(f"bounds of {name}", fault, "-inf or inf for none"))
        if not first < last:
            fault = f"{first:.6g} is not below {last:.6g}"
            hint = (
                f"({last:.6g}, {first:.6g})"
                if last < first
                else "without it among the unknowns, for a value that is held"
            )
            raise UsageError(Problem(f"bounds of {name}", fault, hint))
        for k in places:
            if not first <= x[k] <= last:
                fault = f"the search starts at {x[k]:.6g}, outside {first:.6g} to {last:.6g}"
                raise UsageError(Problem(f"bounds of {name}", fault, _within(unknowns, name, k, first, last)))
            low[k], high[k] = first, last
    return low, high


def _within(unknowns: Unknowns, name: str, place: int, first: float, last: float) -> str:
    """Return the start of a search within bounds."""
    inside = 0.5 * (first + last) if np.isfinite(first + last) else first + 1.0 if np.isfinite(first) else last - 1.0
    if place < len(unknowns.parameters):
        return f"values={{{name!r}: {inside:.6g}}} (--set {name}={inside:.6g})"
    state = unknowns.states[(place - len(unknowns.parameters)) % len(unknowns.states)]
    joint = state.partition(".")[2].partition("[")[0]
    part = {"q": f'"{joint}": {{"position": ...}}', "v": f'"{joint}": {{"velocity": ...}}'}.get(
        state[0], f'"{joint}": ...'
    )
    return f"initial={{{part}}} (--initial {state}={inside:.6g}), its initial guess"


def deviations_of(labels: Sequence[str], given: Mapping[str, float] | float | None) -> Array | None:
    if given is None:
        return None
    if not isinstance(given, Mapping):
        given = dict.fromkeys(labels, number_of("deviations", given, "number, or one for each column by name,"))
    every = {label: given.get(label, given.get(label.partition("[")[0])) for label in labels}
    for name in given:
        if name not in labels and not any(label.partition("[")[0] == name for label in labels):
            check_name("measured column", name, labels)
    absent = [label for label, value in every.items() if value is None]
    if absent:
        fault = f"the deviation of {', '.join(absent)} is missing"
        raise UsageError(Problem("deviations", fault, "deviations of all columns, or of none: then they are estimated"))
    kind = "number"
    result = np.array([number_of(f"deviations of {label}", value, kind) for label, value in every.items()])
    if not (np.isfinite(result).all() and (result > 0.0).all()):
        fault = "standard deviations are positive numbers"
        raise UsageError(Problem("deviations", fault, f'deviations={{"{labels[0]}": 0.01}}'))
    return result


def check_effect(
    unknowns: Unknowns, predict: Callable[[Array], tuple[Array, Array] | None], x: Array, sigma: Array | None
) -> None:
    """Raise UsageError for an unknown without effect on the measurements at the start of the search."""
    first = predict(x)
    if first is None:
        return  # the search says why
    columns = unknowns.columns
    ranges = np.array([float(np.ptp(unknowns.data[columns == k])) or 1.0 for k in range(len(unknowns.labels))])
    weights = (ranges if sigma is None else sigma)[columns]
    effect = np.linalg.norm(first[1] / weights[:, np.newaxis], axis=0) * np.where(x != 0.0, np.abs(x), 1.0)
    lost = [name for name, size in zip(unknowns.names, effect, strict=True) if size < _EFFECT * np.sqrt(len(columns))]
    if lost:
        fault = f"no measurement depends on {', '.join(lost)} at the initial guess"
        raise UsageError(Problem("parameters", fault, "other outputs, other start values, or without them"))
