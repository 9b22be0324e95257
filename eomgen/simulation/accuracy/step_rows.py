"""Rows at the ends of all steps of a run, for runs with sparse records and for adaptive methods, too."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.simulation.accuracy.comparison_runs import Span, comparison_run
from eomgen.simulation.stepping.run import Run
from eomgen.toolchain.library import Library

#: Maximum number of repeated steps, and number of pieces of a longer run.
_MOST, _PIECES = 20_000, 8


class StepRows(NamedTuple):
    """Rows (n, width), parameters, (np,) or (n, np), and indices of the last rows of pieces, except the last piece."""

    rows: Array
    parameters: Array
    breaks: NDArray[np.intp]


class _Pieces(NamedTuple):
    """Pieces of a run that are repeated.

    Attributes
    ----------
    parts : number of intervals within a step of the time grid
    number : of pieces
    width : number of rows of a piece
    duration : s, of a piece that is shorter than its rows; infinite otherwise
    """

    parts: int
    number: int
    width: int
    duration: float


def _pieces(run: Run, rows: Array, statistics: Mapping[str, int | float], finer: float = 1.0) -> _Pieces:
    step, duration = run.settings["step"], float(rows[-1, 0] - rows[0, 0])
    own = 0.0
    if run.method.chooses_steps:
        own = float(statistics.get("own_steps") or statistics.get("expansions") or 0.0)
    parts = max(1, math.ceil(finer * own * step / duration - 1e-9))
    steps = duration / step * parts
    count = 1 if steps <= _MOST else _PIECES
    width = max(1, int((len(rows) - 1) * min(1.0, _MOST / steps) / count))
    most, interval = _MOST // count, duration / (len(rows) - 1)
    return _Pieces(parts, count, width, most * step / parts if width * interval * parts > most * step else math.inf)


def repeated_share(run: Run, rows: Array, statistics: Mapping[str, int | float]) -> float:
    """Return the share of a run that ``step_rows`` repeats, if pieces are shorter than its rows; 1 otherwise."""
    pieces = _pieces(run, rows, statistics)
    return min(1.0, pieces.number * pieces.duration / float(rows[-1, 0] - rows[0, 0]))


def step_rows(
    run: Run,
    library: Library,
    rows: Array,
    parameters: Array,
    statistics: Mapping[str, int | float],
    *,
    finer: float = 1.0,
) -> StepRows | None:
    """Return rows at the ends of steps; None if the run cannot be repeated.

    Adaptive methods end their steps between rows of the time grid. Their rows come from the dense output, at the
    average spacing of the steps divided by ``finer``. Long runs are sampled in pieces, which end before the next row
    if the method takes thousands of steps between two rows.

    Parameters
    ----------
    rows, parameters : as recorded
    statistics : counts of the stepper
    """
    step = run.settings["step"]
    parts, count, width, most = _pieces(run, rows, statistics, finer)
    if parts == 1 and run.every == 1:
        return StepRows(rows, parameters, np.empty(0, dtype=np.intp))
    if run.controllers is not None:
        return None
    begins = np.unique(np.linspace(0, len(rows) - 1 - width, count).astype(int)) if count > 1 else [0]
    result, present, breaks = [], [], []
    for begin in begins:
        last = min(begin + width, len(rows) - 1) if count > 1 else len(rows) - 1
        held = parameters if parameters.ndim == 1 else parameters[[begin, last]]
        ends = rows[[begin, last]]
        ends[1, 0] = min(ends[1, 0], ends[0, 0] + most)
        length = float(ends[1, 0] - ends[0, 0])
        span = Span(ends, held, 1, max(1, round(length / step)))
        piece = comparison_run(run, library, span, multiple=step / parts / min(step, length), every=1)
        if piece.interrupted or len(piece.rows) < 2:
            return None
        result.append(piece.rows)
        present.append(np.broadcast_to(piece.parameters, (len(piece.rows), piece.parameters.shape[-1])))
        breaks.append(len(piece.rows))
    joined = present[0][0] if parameters.ndim == 1 else np.concatenate(present)
    return StepRows(np.concatenate(result), joined, np.cumsum(breaks)[:-1] - 1)
