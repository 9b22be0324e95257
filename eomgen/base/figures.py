"""Figures of matplotlib without a window: new ones, the axes of a caller, and files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from eomgen.errors import FileError, Problem, UsageError


def new_figure(size: tuple[float, float]) -> Any:
    """Return an empty figure of a width and a height in inches."""
    # slow to import, and only drawing needs this class
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=size, layout="constrained", dpi=110)
    FigureCanvasAgg(figure)
    return figure


def pyplot_figure(size: tuple[float, float]) -> Any:
    """Return an empty figure of pyplot, which notebooks show and ``matplotlib.pyplot.show`` opens; inches."""
    from matplotlib import pyplot  # noqa: PLC0415  # slow to import, and only drawing needs it

    return pyplot.figure(figsize=size, layout="constrained")


def axes_of_caller(call: str, axes: object, panels: Sequence[str]) -> list[Any]:
    """Return the axes that a caller gives for panels, one for each.

    Parameters
    ----------
    call : str
        The call, for messages.
    axes : Axes of matplotlib, or a sequence or an array of Axes
    panels : sequence of str
        Titles of the panels, for messages.

    Raises
    ------
    UsageError
        An object that is not axes, or another number of axes than of panels.
    """
    from matplotlib.axes import Axes  # noqa: PLC0415  # slow to import, and only drawing needs it

    flat = getattr(axes, "flat", axes)
    given = [axes] if isinstance(axes, Axes) else list(flat) if hasattr(flat, "__iter__") else [axes]
    wrong = next((item for item in given if not isinstance(item, Axes)), None)
    if wrong is not None:
        fault = f"axes of matplotlib are needed, not {type(wrong).__name__}"
        raise UsageError(Problem(f"{call}: axes", fault, "figure, axes = matplotlib.pyplot.subplots()"))
    if len(given) != len(panels):
        fault = f"{len(given)} axes are given for {len(panels)} panels: {', '.join(panels)}"
        hint = f"axes for {len(panels)} panels, fewer names, or no axes: then a figure is made"
        raise UsageError(Problem(f"{call}: axes", fault, hint))
    return given


def saved(figure: Any, path: Path, hint: str = "another folder") -> Path:
    """Write a figure to a file and return the path of the file. Raises FileError, with a remedy."""
    try:
        figure.savefig(path)
    except OSError as error:
        raise FileError(Problem(str(path), f"cannot be written ({error.strerror or error})", hint)) from None
    return path
