"""How results show themselves: figures of matplotlib without a window, and small pieces of HTML for notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from itertools import islice
from pathlib import Path
from typing import Any

from eomgen.errors import FileError, Problem, UsageError


def new_figure(size: tuple[float, float]) -> Any:
    """Return an empty figure of a width and a height in inches."""
    # slow to import, and only drawing needs it
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
    axes : matplotlib's Axes, or a sequence or an array of them
    panels : sequence of str
        Titles of the panels, for messages.

    Raises
    ------
    UsageError
        Something that is no axes, or another number of them than there are panels.
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
    """Write a figure to a file and return its path. Raises FileError, with a remedy."""
    try:
        figure.savefig(path)
    except OSError as error:
        raise FileError(Problem(str(path), f"cannot be written ({error.strerror or error})", hint)) from None
    return path


#: Rows of one table; the rest is counted.
_ROWS = 40
_CELL = "text-align:left;vertical-align:top;padding:0.15em 0.8em 0.15em 0"


def page(heading: str, *parts: str) -> str:
    """Return parts of HTML under a heading in plain text; empty parts are left out."""
    return f"<div><strong>{escape(heading)}</strong>{''.join(parts)}</div>"


def paragraph(text: str) -> str:
    """Return plain text as a paragraph; an empty text for an empty one."""
    return f'<p style="margin:0.3em 0">{escape(text)}</p>' if text else ""


def formula(latex: str) -> str:
    """Return a formula on a separate line, which notebooks set by MathJax."""
    return f"<div>$$\\displaystyle {escape(latex, quote=False)}$$</div>"


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table of text, of at most 40 rows and the number of further ones; an empty text if there is no row.

    Columns that are empty in all rows are left out.
    """
    waiting = iter(rows)
    shown = [[str(cell) for cell in row] for row in islice(waiting, _ROWS)]
    if not shown:
        return ""
    left = sum(1 for _ in waiting)
    kept = [k for k in range(len(headings)) if any(row[k] for row in shown)]
    head = "".join(f'<th style="{_CELL}">{escape(headings[k])}</th>' for k in kept)
    body = "".join(
        f"<tr>{''.join(f'<td style={chr(34)}{_CELL}{chr(34)}>{escape(row[k])}</td>' for k in kept)}</tr>"
        for row in shown
    )
    more = paragraph(f"and {left} more") if left else ""
    parts = f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"
    return f'<table style="margin:0.4em 0;border-collapse:collapse">{parts}</table>{more}'
