"""The map as a picture: a row for each ladder and method, a square for each cell, coloured by its verdict."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from eomgen.errors import FileError, Problem
from eomgen.products.studies.ladders.register import BY_NAME
from eomgen.products.studies.ladders.verdicts import UNKNOWN, VERDICTS, Cell, counts

#: Colour and sign of each verdict: green to yellow is right or nearly, blue is reported, red is a silent fault.
_COLOURS = {
    "holds": ("#3E9B5F", ""),
    "coarse": ("#E3C53A", "~"),
    "warned": ("#F0953F", "!"),
    "stopped": ("#7FB0D8", "s"),
    "refused": ("#4E79A7", "r"),
    "unfinished": ("#B7A6CE", "u"),
    "unknown": ("#C9C9C9", "?"),
    "fails": ("#C8102E", "F"),
}
_GAP = 0.45


def draw(scene: str, cells: Sequence[Cell], path: Path) -> Path:
    """Draw the map of a scene. Raises FileError."""
    # slow to import, and only drawing needs it
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415
    from matplotlib.patches import Patch, Rectangle  # noqa: PLC0415

    rows = _rows(cells)
    widest = max((len(_values(row)) for _, _, row in rows), default=1)
    places, top = [], 0.0
    for number, (ladder, _, _) in enumerate(rows):
        if number and rows[number - 1][0] != ladder:
            top += 1.0 + _GAP
        places.append(top)
        top += 1.0
    figure = Figure(figsize=(4.6 + 0.62 * widest, 1.5 + 0.27 * max(top, 4.0)), layout="constrained", dpi=110)
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    last = ""
    for (ladder, method, row), y in zip(rows, places, strict=True):
        values = _values([cell for cell in cells if cell.ladder == ladder])
        if ladder != last:
            axis.text(-0.1, y - 0.5, BY_NAME[ladder].scales, ha="right", va="center", fontsize=7.5, weight="bold")
            for x, value in enumerate(values):
                axis.text(x + 0.5, y - 0.1, f"{value:.6g}", ha="center", va="bottom", fontsize=6.5, color="#444444")
            last = ladder
        axis.text(-0.1, y + 0.5, method, ha="right", va="center", fontsize=7.5)
        for cell in row:
            colour, sign = _COLOURS[cell.verdict]
            x = values.index(cell.value)
            axis.add_patch(Rectangle((x, y), 0.95, 0.92, color=colour, linewidth=0.0))
            axis.text(x + 0.475, y + 0.47, _text(cell) or sign, ha="center", va="center", fontsize=6.0, color="white")
    axis.set(xlim=(0.0, widest), ylim=(top + 0.2, -1.2))
    axis.axis("off")
    count = counts(cells)
    handles = [Patch(color=_COLOURS[name][0], label=f"{name} {count[name]}") for name in count]
    figure.legend(handles=handles, loc="outside lower left", ncols=4, frameon=False, fontsize=8)
    unknown = f"\nunknown: {VERDICTS[UNKNOWN]}" if UNKNOWN in count else ""
    figure.suptitle(f"{scene}: extremes; numbers are errors by the motion{unknown}", fontsize=9, x=0.02, ha="left")
    try:
        figure.savefig(path)
    except OSError as error:
        fault = f"cannot be written: {error.strerror or error}"
        raise FileError(Problem(str(path), fault, "a folder that may be written to")) from None
    return path


def _rows(cells: Sequence[Cell]) -> list[tuple[str, str, list[Cell]]]:
    result: dict[tuple[str, str], list[Cell]] = {}
    for cell in cells:
        result.setdefault((cell.ladder, cell.method), []).append(cell)
    order = list(dict.fromkeys(cell.ladder for cell in cells))
    return [(ladder, method, row) for name in order for (ladder, method), row in result.items() if ladder == name]


def _values(cells: Sequence[Cell]) -> list[float]:
    return sorted({cell.value for cell in cells})


def _text(cell: Cell) -> str:
    return f"{cell.error:.0e}" if cell.error is not None else ""
