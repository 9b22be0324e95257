"""Points that no curve can go through are refused, with the line of the table where they are from one."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from eomgen.scene.formula.discontinuities import applications
from eomgen.scene.formula.nodes import Formula
from eomgen.scene.formula.piecewise import Interpolation, Outside
from eomgen.scene.reading.report import Report

Array = NDArray[np.float64]

#: Points of a spline that lie closer than this, measured by the largest distance, leave its equations without digits.
CLOSEST = 1e-5
LARGEST = 1e100


def fault(x: Array, y: Array, interpolation: Interpolation, outside: Outside) -> tuple[int, str, str] | None:
    """Return the index of the first point that is wrong, what is wrong with it, and what to try; None when all is well."""
    if len(x) < 2:
        return 0, f"a curve needs two points or more, not {len(x)}", "more points"
    huge = np.flatnonzero(np.maximum(np.abs(x), np.abs(y)) > LARGEST)
    if len(huge):
        return int(huge[0]), f"a number is beyond {LARGEST:.0e}", "other units"
    steps = np.diff(x)
    if np.any(steps < 0.0):
        index = int(np.argmax(steps < 0.0)) + 1
        what = f"the points are not in order: {x[index]:.9g} comes after {x[index - 1]:.9g}"
        return index, what, "rows sorted by the first of the two columns"
    equal = steps == 0.0
    hint = "one value for each, or interpolation = \"linear\", which jumps there"
    if interpolation == "linear":
        single = np.zeros(len(steps), bool)
        single[[0, -1]] = True
        equal = equal & (single | np.append(False, equal[:-1]))
        hint = "at most two points at one place, and one at the ends"
    if np.any(equal):
        index = int(np.argmax(equal)) + 1
        return index, f"{x[index]:.9g} occurs again", hint
    if interpolation == "quintic" and np.min(steps) < CLOSEST * np.max(steps):
        index = int(np.argmin(steps)) + 1
        what = f"points are {np.min(steps):.3g} apart here and {np.max(steps):.3g} elsewhere, too uneven for a spline"
        return index, what, "points more evenly spread, or interpolation = \"linear\""
    if outside == "periodic" and interpolation == "quintic":
        gap, scale = abs(float(y[-1] - y[0])), float(np.max(np.abs(y)))
        if gap > 1e-9 * scale:
            what = f"the last value {y[-1]:.9g} is not the first one {y[0]:.9g}, so the curve cannot be periodic"
            return len(x) - 1, what, "a last point that repeats the first value, one period later"
    return None


def check_twice_differentiable(key: str, formulas: Iterable[Formula], report: Report) -> None:
    """Report a curve in a prescribed motion that jumps or bends: it would take an infinite force to follow it."""
    for used in (application for formula in formulas for application in applications(formula)):
        rough = [(place, order - used.derivative) for place, order in used.curve.kinks() if order - used.derivative < 2]
        if rough:
            place, order = rough[0]
            does = "jumps" if order <= 0 else "bends"
            name = used.curve.name if not used.derivative else f"a derivative of {used.curve.name}"
            report.add(key, f"a motion cannot follow {name}, which {does} at {place:.6g}", 'interpolation = "quintic"')
