"""Figures of matplotlib without a window: new ones, the axes of a caller, and files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from eomgen.base.messages import shown
from eomgen.errors import FileError, Problem, UsageError

#: Width and height, inches.
Size = tuple[float, float]


def new_figure(size: Size, *, placed: bool = False) -> Any:
    """Return an empty figure of matplotlib without a window; ``size`` is width and height in inches. ``placed`` leaves
    the layout of matplotlib out, for ``place_panels``."""
    _check_backend()
    # slow to import, and only drawing needs this class
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    return FigureCanvasAgg(Figure(figsize=size, layout=None if placed else "constrained", dpi=110)).figure


def _check_backend() -> None:
    """Import matplotlib, which reads the variable ``MPLBACKEND``. Raises UsageError if the variable names no backend of
    matplotlib."""
    try:
        import matplotlib  # noqa: F401, PLC0415  # slow to import, and only drawing needs it
    except ValueError:
        name = os.environ.get("MPLBACKEND", "")
        fault = f"matplotlib has no backend {shown(name)} [E2129]"
        raise UsageError(Problem("MPLBACKEND", fault, "MPLBACKEND=agg, or the variable unset")) from None


def pyplot_figure(size: Size) -> Any:
    """Return an empty figure of pyplot, which notebooks show and ``matplotlib.pyplot.show`` opens; inches."""
    _check_backend()
    from matplotlib import pyplot  # noqa: PLC0415  # slow to import, and only drawing needs it

    return pyplot.figure(figsize=size, layout="constrained")


def axis_label(name: str, unit: str) -> str:
    """Return the label of an axis, ``speed, m/s``; without a unit the name alone."""
    return name if unit in ("", "1") else f"{name}, {unit}"


def place_panels(figure: Any, panels: Sequence[Any], columns: int, height: float, heading: str) -> None:
    """Place panels with legends to their right, so that no text covers another.

    The layout of matplotlib, which serves any figure, measures all texts several times: it takes more time than the
    drawing, most of a run of a small scene.

    Parameters
    ----------
    figure : Figure of matplotlib
        A new one with ``placed``. It keeps its width and becomes as high as its panels and legends need.
    panels : sequence of Axes
        Row by row, with labels and legends; labels of y-axes get one place in each column.
    columns : int
        Of panels.
    height : float
        Of each panel, inches.
    heading : str
    """
    # inches: an edge or a gap; a heading, a title, an exponent and a label of axes, and the numbers below axes
    gap, heading_line, title_line, exponent_line, label_line, number_line = 0.1, 0.3, 0.24, 0.2, 0.22, 0.26
    renderer, width = figure.canvas.get_renderer(), figure.get_size_inches()[0]
    places = [(axis, *divmod(number, columns)) for number, axis in enumerate(panels)]
    rows, inner = places[-1][1] + 1, width / columns - 4.0
    for axis, _, column in places:  # numbers of an axis depend on its length
        axis.set_position((0.1 + column / columns, 0.1, inner / width, height / figure.get_size_inches()[1]))
    above, heights, left, right, aside = [0.0] * rows, [0.0] * rows, [0.0] * columns, [0.0] * columns, []
    for axis, row, column in places:
        numbers = max(axis.get_yticklabels(), key=lambda label: len(label.get_text()), default=axis.yaxis.label)
        left[column] = max(left[column], numbers.get_window_extent(renderer).width / figure.dpi + gap)
        exponent = bool(axis.yaxis.get_major_formatter().get_offset())
        title = bool(axis.get_title(loc="left"))
        above[row] = max(above[row], gap + title * title_line + exponent * exponent_line)
        below = bool(axis.xaxis.get_tick_params()["labelbottom"]) * number_line + bool(axis.get_xlabel()) * label_line
        legend = axis.get_legend().get_window_extent(renderer)
        apart = gap if legend.height / figure.dpi < height else number_line  # from the last number below the panel
        right[column] = max(right[column], legend.width / figure.dpi + apart + gap)
        aside.append(apart)
        heights[row] = max(heights[row], height + below, legend.height / figure.dpi)
    total = heading_line + sum(above) + sum(heights) + gap
    figure.set_size_inches(width, total)
    figure.suptitle(heading, fontsize=11, y=1.0 - gap / total)
    margin = label_line + 2.0 * gap  # of a label
    inner = (width - sum(left) - sum(right)) / columns - margin
    for (axis, row, column), apart in zip(places, aside, strict=True):
        x = sum(left[: column + 1]) + sum(right[:column]) + column * inner + (column + 1) * margin
        top = heading_line + sum(above[: row + 1]) + sum(heights[:row])
        axis.set_position((x / width, 1.0 - (top + height) / total, inner / width, height / total))
        axis.yaxis.set_label_coords(-(left[column] + gap) / inner, 0.5)
        axis.xaxis.set_label_coords(0.5, -number_line / height)
        axis.get_legend().set_bbox_to_anchor((1.0 + apart / inner, 1.0), axis.transAxes)


def draw_grid(axis: Any, which: Literal["major", "both"] = "major", along: Literal["x", "both"] = "both") -> None:
    """Draw a light grid below all curves, for major ticks or for all, across the x-axis or across both."""
    axis.grid(True, which=which, axis=along, color="#dddddd", linewidth=0.6)
    axis.set_axisbelow(True)


def axes_of_caller(call: str, axes: object, panels: Sequence[str], size: Size | None = None) -> list[Any]:
    """Return the axes that a caller gives for panels, one for each.

    Parameters
    ----------
    call : str
        The call, for messages.
    axes : Axes of matplotlib, or a sequence or an array of Axes
    panels : sequence of str
        Titles of the panels, for messages.
    size : pair of float, optional
        Of a new figure of pyplot, with the panels side by side, if ``axes`` is None.

    Raises
    ------
    UsageError
        An object that is not axes, or another number of axes than of panels.
    """
    if axes is None and size is not None:
        axes = pyplot_figure(size).subplots(1, len(panels), squeeze=False)
    from matplotlib.axes import Axes  # noqa: PLC0415  # slow to import, and only drawing needs it

    flat = getattr(axes, "flat", axes)
    axes_list = [axes] if isinstance(axes, Axes) else list(flat) if hasattr(flat, "__iter__") else [axes]
    wrong = next((item for item in axes_list if not isinstance(item, Axes)), None)
    if wrong is not None:
        fault = f"axes of matplotlib are needed, not {type(wrong).__name__} [E0125]"
        raise UsageError(Problem(f"{call}: axes", fault, "figure, axes = matplotlib.pyplot.subplots()"))
    if len(axes_list) != len(panels):
        fault = f"{len(axes_list)} axes are given for {len(panels)} panels: {', '.join(panels)} [E0126]"
        hint = f"axes for {len(panels)} panels, fewer names, or no axes: then a figure is made"
        raise UsageError(Problem(f"{call}: axes", fault, hint))
    return axes_list


def save_figure(figure: Any, path: Path, hint: str = "another folder") -> Path:
    """Write a figure to a file and return the path of the file. Raises FileError, with a remedy; UsageError
    for an unknown ending."""
    if path.suffix[1:].lower() not in ("", *figure.canvas.get_supported_filetypes()):
        raise UsageError(Problem(str(path), "a figure is a .png, .svg or .pdf file [E0154]", "figure.png"))
    try:
        # level 6, the default of matplotlib, takes 1.5 times as long, for files that are smaller by a twelfth
        figure.savefig(path, **({"pil_kwargs": {"compress_level": 3}} if path.suffix == ".png" else {}))
    except OSError as error:
        raise FileError(Problem(str(path), f"cannot be written ({error.strerror or error}) [E0127]", hint)) from None
    return path
