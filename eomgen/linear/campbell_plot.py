"""Figure of a Campbell diagram, as PNG or on the axes of a caller."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.arrays import Array
from eomgen.figures import axes_of_caller, new_figure, pyplot_figure, saved

_GRID: dict[str, Any] = {"color": "#dddddd", "linewidth": 0.6}
#: Colour, line style and word of each sense of whirl.
_WHIRL = {1: ("#0B62C4", "-", "forward"), -1: ("#F08C00", "--", "backward"), 0: ("#444444", "-", "")}


class DrawnCrossing(Protocol):
    """What is drawn of a ``Crossing``: see there."""

    @property
    def speed(self) -> float: ...
    @property
    def frequency(self) -> float: ...


class DrawnCampbell(Protocol):
    """What is drawn of a ``Campbell``: see there."""

    @property
    def parameter(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def values(self) -> Array: ...
    @property
    def frequencies(self) -> Array: ...
    @property
    def whirl(self) -> NDArray[np.int_]: ...
    @property
    def orders(self) -> tuple[float, ...]: ...
    @property
    def crossings(self) -> Sequence[DrawnCrossing]: ...


def draw_campbell(diagram: DrawnCampbell, title: str, path: Path) -> Path:
    """Draw the diagram into a file. Raises FileError where it cannot be written."""
    figure = new_figure((8.0, 5.4))
    _draw(figure.subplots(), diagram)
    figure.suptitle(f"{title}: Campbell diagram", fontsize=11)
    return saved(figure, path)


def plot_campbell(diagram: DrawnCampbell, axes: object = None) -> list[Any]:
    """Draw the diagram; see ``Campbell.plot``."""
    given = pyplot_figure((8.0, 5.4)).subplots() if axes is None else axes
    drawn = axes_of_caller("plot", given, [f"frequencies over {diagram.parameter}"])
    _draw(drawn[0], diagram)
    return drawn


def _draw(axis: Any, diagram: DrawnCampbell) -> None:
    values, frequencies = diagram.values, diagram.frequencies
    named: set[str] = set()
    for mode in range(frequencies.shape[1]):
        for sense in np.unique(diagram.whirl[:, mode]):
            colour, style, word = _WHIRL[int(sense)]
            own = diagram.whirl[:, mode] == sense
            # at rest there is no sense, and a curve begins there with that beside it
            beside = np.concatenate([own[1:], [False]]) | np.concatenate([[False], own[:-1]])
            shown = own | (beside & (diagram.whirl[:, mode] == 0))
            label = word if word and word not in named else None
            named.add(word)
            axis.plot(values, np.where(shown, frequencies[:, mode], np.nan), style, color=colour, label=label, lw=1.5)
    top = float(np.nanmax(frequencies, initial=0.0)) * 1.08 or 1.0
    ends = np.array([float(np.min(values)), float(np.max(values))])
    for order in diagram.orders:
        ray = order * np.abs(ends) / (2.0 * np.pi)
        line = np.array([ends[0], *([0.0] if ends[0] < 0.0 < ends[1] else []), ends[1]])
        axis.plot(line, order * np.abs(line) / (2.0 * np.pi), ":", color="#888888", linewidth=1.2)
        at = min(ends[1], top * 2.0 * np.pi / order) if order > 0.0 else ends[1]
        height = min(ray[1], top)
        axis.annotate(
            f"{order:g}x", (at, height), (-4, -4), textcoords="offset points", ha="right", va="top", fontsize=9
        )
    axis.plot(
        [item.speed for item in diagram.crossings],
        [item.frequency / (2.0 * np.pi) for item in diagram.crossings],
        "o",
        color="#C8102E",
        markersize=5.0,
        zorder=3,
    )
    axis.set_xlim(*ends)
    axis.set_ylim(0.0, top)
    axis.set_xlabel(diagram.parameter + (f", {diagram.unit}" if diagram.unit not in ("", "1") else ""))
    axis.set_ylabel("frequency, Hz")
    axis.grid(True, **_GRID)
    axis.set_axisbelow(True)
    if named - {""}:
        axis.legend(fontsize=9, frameon=False, loc="upper left")
