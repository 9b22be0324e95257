"""Figures of frequency responses and spectra, as PNG or on the axes of a caller; places of labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array, Complex
from eomgen.base.figures import axes_of_caller, axis_label, draw_grid, new_figure, pyplot_figure, save_figure
from eomgen.products.linear.spectra import PowerSpectrum


def draw_responses(
    frequencies: Array, responses: Mapping[tuple[str, str], Complex], units: Mapping[str, str], title: str, path: Path
) -> Path:
    """Draw magnitude and phase of frequency responses, one column for each, and return the path.

    Parameters
    ----------
    frequencies : (n,) Hz
    responses : (n,) complex, by (input, output)
    units : by name of an input or output
    title : name of the model
    path : of the PNG
    """
    figure = new_figure((6.2 * len(responses) + 0.4, 6.4))
    axes = _columns_of_two(figure, len(responses))
    for column, ((of_input, output), values) in zip(axes.T, responses.items(), strict=True):
        over = _ratio(units.get(output, ""), units.get(of_input, ""))
        _response(column[0], column[1], frequencies, values, f"{output} for {of_input}", over)
    figure.align_ylabels(list(axes.ravel()))
    figure.suptitle(f"{title}: frequency responses", fontsize=11)
    return save_figure(figure, path)


def plot_response(frequencies: Array, values: Complex, pair: tuple[str, str], axes: object = None) -> list[Any]:
    """Draw magnitude and phase of the response of an output to an input; see ``Linearization.plot_response``.

    Parameters
    ----------
    frequencies : (nf,) ndarray
        Hz.
    values : (nf,) complex ndarray
        Response at each frequency.
    pair : (str, str)
        Names of the input and the output.
    axes : two matplotlib Axes, optional
        Axes of magnitude and phase; a new figure of pyplot by default.
    """
    panels = _columns_of_two(pyplot_figure((6.6, 6.4)), 1) if axes is None else axes
    drawn = axes_of_caller("plot_response", panels, ["magnitude", "phase"])
    _response(drawn[0], drawn[1], frequencies, values, f"{pair[1]} for {pair[0]}", "")
    return drawn


def _columns_of_two(figure: Any, count: int) -> NDArray[np.object_]:
    axes: NDArray[np.object_] = figure.subplots(
        2, count, squeeze=False, sharex=True, gridspec_kw={"height_ratios": [3, 2]}
    )
    return axes


def _response(magnitude: Any, phase: Any, frequencies: Array, values: Complex, title: str, over: str) -> None:
    """Draw magnitude and phase of a complex response (n,) over frequency in Hz (n,) on two axes; `over` is the unit."""
    from matplotlib.ticker import MultipleLocator  # noqa: PLC0415  # slow to import, and only drawing needs it

    magnitude.loglog(frequencies, np.where(values, np.abs(values), np.nan), color="#0B62C4", linewidth=1.4)
    angles = np.degrees(np.unwrap(np.angle(values)))
    phase.semilogx(frequencies, angles, color="#0B62C4", linewidth=1.4)
    middle, half = 0.5 * (angles.max() + angles.min()), max(0.55 * np.ptp(angles), 100.0)
    phase.set_ylim(middle - half, middle + half)
    magnitude.set_ylabel(axis_label("magnitude", over))
    magnitude.set_title(title, fontsize=10, loc="left")
    phase.set_ylabel("phase, °")
    phase.yaxis.set_major_locator(MultipleLocator(90.0 if np.ptp(phase.get_ylim()) <= 540.0 else 180.0))
    phase.set_xlabel("frequency, Hz")
    phase.set_xlim(frequencies[0], frequencies[-1])
    for axis in (magnitude, phase):
        draw_grid(axis, which="both")


def draw_spectra(spectra: Sequence[PowerSpectrum], title: str, path: Path) -> Path:
    """Draw power spectral densities on a random road, in one panel each, stacked vertically."""
    figure = new_figure((7.4, 0.6 + 3.6 * len(spectra)))
    for axis, item in zip(figure.subplots(len(spectra), 1, squeeze=False)[:, 0], spectra, strict=True):
        item.plot(axis)
    figure.suptitle(f"{title}: spectra on a random road", fontsize=11)
    return save_figure(figure, path)


def _ratio(over: str, under: str) -> str:
    """Return the unit of a response; empty if a unit is not known or both are the same."""
    return f"{over} per {under}" if over and under and over != under else ""


#: Width and height of a letter in points, with the space to the next line.
LETTER = (5.6, 12.0)
#: Candidates for the label of a dot: which corner or side is at the dot, and points upwards from the dot.
AROUND = (
    (-1, 7.0), (1, -7.0), (-1, -7.0), (1, 7.0), (0, 11.0), (0, -11.0), (1, 0.0), (-1, 0.0),
    (-1, 15.0), (1, -15.0), (-1, -15.0), (1, 15.0),
)  # fmt: skip  # nearest first


class LabelBox(NamedTuple):
    """A rectangle by centre and half sides, in points; ``meets`` is whether two rectangles overlap."""

    x: float
    y: float
    half_width: float
    half_height: float

    @classmethod
    def dot(cls, x: float, y: float) -> LabelBox:
        """Return the rectangle of a dot."""
        return cls(x, y, 3.5, 3.5)

    def meets(self, box: LabelBox) -> bool:
        """Return whether two rectangles overlap."""
        clear_in_x = abs(self.x - box.x) >= self.half_width + box.half_width
        return not clear_in_x and abs(self.y - box.y) < self.half_height + box.half_height


def free_box(
    point: Sequence[float] | Array,
    text: str,
    candidates: Sequence[tuple[int, float]],
    taken: Sequence[LabelBox],
    size: Sequence[float] | Array = (np.inf, np.inf),
) -> LabelBox | None:
    """Return the first place of a label next to a dot that overlaps no other box; None without such a place.

    Parameters
    ----------
    point : (2,) points, the dot
    text : of the label
    candidates : in this order: -1, 0 or 1 for a label to the left, above or to the right of the dot, and points upwards
    taken : boxes of dots and labels
    size : (2,) points, the extent of axes that begin at 0 and hold the label; no such bound by default
    """
    half = 0.5 * LETTER[0] * len(text), 0.5 * LETTER[1]
    for side, up in candidates:
        box = LabelBox(float(point[0]) + side * (half[0] + 4.0), float(point[1]) + up, *half)
        bounded = np.isfinite(size[0])
        inside = half[0] <= box.x <= size[0] - half[0] and half[1] <= box.y <= size[1] - half[1]
        if (inside or not bounded) and not any(box.meets(taken_box) for taken_box in taken):
            return box
    return None
