"""Corners and jumps of formulas that the motion of a run crosses, at which methods lose their order."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError
from eomgen.formula.evaluate import symbols
from eomgen.formula.features import corners, jumps
from eomgen.formula.nodes import Formula
from eomgen.simulation.accuracy.step_path import StepPath
from eomgen.simulation.stepping.run import Run

#: Maximum number of crossings of a place that are examined, bisections of each, and the least jump of a rate relative
#: to its largest value.
_EXAMINED, _BISECTIONS, _JUMP = 16, 40, 1e-3


def crosses_corners(run: Run, rows: Array, parameters: Array) -> bool:
    """Return whether the motion crosses a step or a corner of a formula between rows (n, width).

    Times at which formulas of time alone have steps or corners are known, and steps end there.
    """
    places = _places(run, "corners", corners)
    if not places or len(rows) < 2:
        return False
    try:
        path = StepPath(run, rows, parameters)
        return any(len(_crossings(path, place)) for place in places if path.knows(place))
    except (EomgenError, np.linalg.LinAlgError):  # states at which the equations give no numbers
        return False


def crosses_jumps(run: Run, rows: Array, parameters: Array) -> bool:
    """Return whether accelerations or rates of internal states jump at a place that the motion crosses between rows
    (n, width).

    A force that begins at zero behind a comparison, as of a contact, has a corner there, and no jump.
    """
    places = _places(run, "jumps", jumps)
    if not places or len(rows) < 2:
        return False
    try:
        path = StepPath(run, rows, parameters)
        known = [(place, _crossings(path, place)) for place in places if path.knows(place)]
        if not any(len(steps) for _, steps in known):
            return False
        size = np.nanmax(np.abs(path.rates(path.at_rows)), axis=0)
        return any(_jumps(path, place, steps[:_EXAMINED], size) for place, steps in known if len(steps))
    except (EomgenError, np.linalg.LinAlgError):
        return False


def _places(run: Run, key: str, places_of: Callable[[Formula], Iterator[Formula]]) -> list[Formula]:
    """Return the expressions at whose zeros the formulas of a model have corners or jumps, times alone left out."""
    kept = run.model.library.kept
    if key not in kept:
        every = [place for formula in run.model.description.formulas for place in places_of(formula)]
        kept[key] = [place for place in every if any(symbol.kind != "time" for symbol in symbols(place))]
    result: list[Formula] = kept[key]
    return result


def _crossings(path: StepPath, place: Formula) -> NDArray[np.intp]:
    """Return the indices of the rows behind which an expression changes its sign."""
    signs = np.sign(path.values(place, path.at_rows))
    return np.flatnonzero(signs[1:] * signs[:-1] < 0.0)


def _jumps(path: StepPath, place: Formula, steps: NDArray[np.intp], size: Array) -> bool:
    """Return whether rates jump at the zeros of an expression within steps."""
    t = path.states.t
    low, high = t[steps], t[steps + 1]
    before = np.sign(path.values(place, path.at_rows))[steps]
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        same = np.sign(path.values(place, path.at(middle, steps))) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    first, last = (path.rates(path.at(times, steps)) for times in (low, high))
    change: Array = last - first
    return bool(np.any(np.abs(change) > _JUMP * size))
