"""Bounds and deviations as arrays, and unknowns without effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from eomgen.arrays import Array
from eomgen.compiled.arguments import check_name
from eomgen.errors import Problem, UsageError
from eomgen.studies.identification.unknowns import Unknowns

#: What of a standard deviation an unknown changes outputs by, at least, where it changes by its own size.
_EFFECT = 1e-9


def bounds_of(unknowns: Unknowns, bounds: Mapping[str, tuple[float, float]] | None) -> tuple[Array, Array]:
    names, x = unknowns.names, unknowns.start
    low, high = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    for name, given in (bounds or {}).items():
        places = [k for k, known in enumerate(names) if name == known or known.startswith(f"{name} of ")]
        if not places:
            check_name("unknown", name, names)
        try:
            first, last = (float(one) for one in given)
        except (TypeError, ValueError):
            raise UsageError(Problem(f"bounds of {name}", f"{given!r} are no two numbers", "(0.1, 10.0)")) from None
        if not first < last:
            what = f"{first:.6g} is not below {last:.6g}"
            raise UsageError(Problem(f"bounds of {name}", what, f"({last:.6g}, {first:.6g})"))
        for k in places:
            if not first <= x[k] <= last:
                what = f"the search starts at {x[k]:.6g}, outside {first:.6g} to {last:.6g}"
                hint = (
                    f"values={{{name!r}: {0.5 * (first + last):.6g}}}" if k < len(unknowns.parameters) else "initial="
                )
                raise UsageError(Problem(f"bounds of {name}", what, hint))
            low[k], high[k] = first, last
    return low, high


def deviations_of(labels: Sequence[str], given: Mapping[str, float] | float | None) -> Array | None:
    if given is None:
        return None
    if not isinstance(given, Mapping):
        given = dict.fromkeys(labels, given)
    every = {label: given.get(label, given.get(label.partition("[")[0])) for label in labels}
    for name in given:
        if name not in labels and not any(label.partition("[")[0] == name for label in labels):
            check_name("measured column", name, labels)
    absent = [label for label, value in every.items() if value is None]
    if absent:
        what = f"that of {', '.join(absent)} is missing"
        raise UsageError(Problem("deviations", what, "those of all columns, or of none: then they are estimated"))
    found = np.array([float(value) for value in every.values() if value is not None])
    if not (np.isfinite(found).all() and (found > 0.0).all()):
        raise UsageError(Problem("deviations", "standard deviations are positive numbers", f"{labels[0]}=0.01"))
    return found


def check_effect(
    unknowns: Unknowns, predict: Callable[[Array], tuple[Array, Array] | None], x: Array, sigma: Array | None
) -> None:
    """Raise UsageError for an unknown that nothing measured depends on where the search starts."""
    first = predict(x)
    if first is None:
        return  # the search says why
    columns = unknowns.columns
    ranges = np.array([float(np.ptp(unknowns.data[columns == k])) or 1.0 for k in range(len(unknowns.labels))])
    weights = (ranges if sigma is None else sigma)[columns]
    effect = np.linalg.norm(first[1] / weights[:, np.newaxis], axis=0) * np.where(x != 0.0, np.abs(x), 1.0)
    lost = [name for name, size in zip(unknowns.names, effect, strict=True) if size < _EFFECT * np.sqrt(len(columns))]
    if lost:
        what = f"nothing that was measured depends on {', '.join(lost)} where the search starts"
        raise UsageError(Problem("parameters", what, "other outputs, other start values, or without them"))
