"""Figures of matplotlib without a window, and their files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from eomgen.errors import FileError, Problem


def new_figure(size: tuple[float, float]) -> Any:
    """Return an empty figure of a width and a height in inches."""
    # slow to import, and only drawing needs it
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=size, layout="constrained", dpi=110)
    FigureCanvasAgg(figure)
    return figure


def saved(figure: Any, path: Path, hint: str = "another folder") -> Path:
    """Write a figure to a file and return its path. Raises FileError, with what to try."""
    try:
        figure.savefig(path)
    except OSError as error:
        raise FileError(Problem(str(path), f"cannot be written ({error.strerror or error})", hint)) from None
    return path
