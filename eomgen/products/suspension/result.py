"""Curves of an axle as tables, a figure and a page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.csv_tables import write_rows, write_table
from eomgen.base.data import dataclass
from eomgen.base.figures import axis_label, draw_grid, new_figure, pyplot_figure, save_figure
from eomgen.base.files import make_folder, write_text
from eomgen.base.html import page, table
from eomgen.products.pictures.animation import base64_text, page_of
from eomgen.products.suspension.curves import Curves

#: Panels: range, and the end of names of columns.
_PANELS = (
    *(("travel", name) for name in ("toe", "camber", "contact y", "roll centre height", "load", "motion ratio")),
    *(("travel", name) for name in ("braking angle", "driving angle")),
    *(("roll", name) for name in ("steer", "camber")),
    *(("steering", name) for name in ("steer", "camber", "Ackermann")),
    *(("side force", name) for name in ("steer", "camber", "contact y")),
    *(("braking force", name) for name in ("toe", "centre x")),
    *(("driving force", name) for name in ("toe", "centre x")),
    ("aligning moment", "steer"),
)
#: Characteristics at the design position: range, end of names of columns, and whether slopes or values.
_VALUES = {
    "travel": "roll centre height,rate,motion ratio,braking angle,braking support,driving angle,driving support",
    "roll": "rate",
    "steering": "caster,kingpin inclination,scrub radius,trail",
}
_SLOPES = {
    "travel": "toe,camber,contact y",
    "roll": "steer,camber",
    "steering": "steer",
    "side force": "steer,camber,contact y",
    "braking force": "toe,centre x",
    "driving force": "toe,centre x",
    "aligning moment": "steer",
}


@dataclass(frozen=True, repr=False)
class SuspensionCurves:
    """Result of ``suspension``.

    Attributes
    ----------
    name : str
        Of the axle.
    curves : mapping
        By range: ``travel``, ``roll``, ``steering``, ``side force``, ``braking force``, ``driving force``, ``aligning
        moment``.
    """

    name: str
    curves: Mapping[str, Curves]

    def __repr__(self) -> str:
        return f"<SuspensionCurves of {self.name}: {', '.join(self.curves)}>"

    @property
    def characteristics(self) -> list[tuple[str, str, float, str]]:
        """Range, column, value and unit of each characteristic at the design position; slopes are by the range, and 0
        if the column changes by rounding alone."""
        rows = []
        for name, curves in self.curves.items():
            for column, values in curves.columns.items():
                unit = curves.units[column]
                if column.endswith(tuple(_SLOPES.get(name, "").split(","))):
                    by = f"({curves.unit})" if " " in curves.unit else curves.unit
                    slope = curves.slope(column) if np.ptp(values) > 1e-9 else 0.0
                    rows.append((name, f"{column} by {curves.label}", slope, f"{unit}/{by}"))
                elif name in _VALUES and column.endswith(tuple(_VALUES[name].split(","))):
                    rows.append((name, column, float(values[len(values) // 2]), unit))
        return rows

    def to_dict(self) -> dict[str, Any]:
        """Return name, characteristics and curves as a dict for JSON.

        Returns
        -------
        dict
            ``axle``, ``characteristics``, a list each, and ``curves`` by range; NaN stays.
        """
        curves = {
            name: {**vars(item), "x": item.x.tolist(), "columns": {key: y.tolist() for key, y in item.columns.items()}}
            for name, item in self.curves.items()
        }
        return {"axle": self.name, "characteristics": [list(row) for row in self.characteristics], "curves": curves}

    def _panels(self) -> list[tuple[Curves, str, dict[str, Any]]]:
        """Return range, quantity and columns of the panels of figures; quantities that do not change are left out."""
        result = []
        for name, end in _PANELS:
            curves = self.curves.get(name)
            drawn = {column: y for column, y in curves.columns.items() if column.endswith(end)} if curves else {}
            if curves and any(np.nanmax(y) - np.nanmin(y) > 1e-6 for y in drawn.values()):
                result.append((curves, end, drawn))
        return result

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw all curves that change, and return the figure of matplotlib.

        Parameters
        ----------
        path : str or Path, optional
            File of the figure, .png, .svg or .pdf.

        Returns
        -------
        Figure
            A figure of pyplot without ``path``.

        Raises
        ------
        FileError
            The file cannot be written.
        """
        panels = self._panels()
        count = -(-len(panels) // 3)
        figure = (pyplot_figure if path is None else new_figure)((12.0, 2.9 * count))
        for number, (curves, end, columns) in enumerate(panels, 1):
            axes = figure.add_subplot(count, 3, number)
            for style, (name, y) in zip(("-", "--") * len(columns), columns.items(), strict=False):
                axes.plot(curves.x, y, style, linewidth=1.6, label=name.removesuffix(end).strip())
            axes.set_xlabel(axis_label(curves.label, curves.unit))
            axes.set_ylabel(axis_label(end, curves.units[name]))
            draw_grid(axes)
            if len(columns) > 1:
                axes.legend(frameon=False, fontsize=8)
        figure.suptitle(f"{self.name}: kinematics and compliance", fontsize=11)
        if path is not None:
            save_figure(figure, Path(path))
        return figure

    def save(self, folder: str | Path) -> list[Path]:
        """Write characteristics and curves as ``.csv``, a figure ``.png`` and a page ``.html`` to a folder.

        Parameters
        ----------
        folder : str or Path
            Made if it is not there.

        Returns
        -------
        list of Path
            The written files.

        Raises
        ------
        FileError
            A file cannot be written.
        """
        target = Path(folder)
        make_folder(target)
        rows = self.characteristics
        files = [target / "characteristics.csv", target / "suspension.html", target / "suspension.png"]
        write_rows(files[0], [("range", "quantity", "value", "unit"), *rows])
        for name, curves in self.curves.items():
            files.append(target / f"{name.replace(' ', '_')}.csv")
            heads = [axis_label(column, curves.units[column]) for column in curves.columns]
            columns = np.column_stack([curves.x, *curves.columns.values()])
            write_table(files[-1], [axis_label(curves.label, curves.unit), *heads], columns)
        write_text(files[1], self._page())
        self.plot(files[2])
        return files

    def _page(self) -> str:
        """Return the text of a page with the characteristics and charts of all curves that change."""
        charts = [
            {
                "id": f"chart{number}",
                "title": end,
                "unit": curves.units[next(iter(columns))],
                "across": axis_label(curves.label, curves.unit),
                "curves": [
                    {"name": name, "x": base64_text(curves.x.astype("<f4")), "y": base64_text(y.astype("<f4"))}
                    for name, y in columns.items()
                ],
            }
            for number, (curves, end, columns) in enumerate(self._panels())
        ]
        title, rows = f"{self.name}: kinematics and compliance", self.characteristics
        canvases = "".join(f'<canvas id="{chart["id"]}"></canvas>' for chart in charts)
        cells = {name: [(row[1], f"{row[2]:.5g}", row[3]) for row in rows if row[0] == name] for name in self.curves}
        tables = (table((name, "value", "unit"), listed) for name, listed in cells.items())
        parts = {"style": "pages/report.css", "curves": "pages/curves.js", "report": "pages/report.js"}
        data = {"name": title, "charts": charts}
        content = page(title, f'<div class="charts">{canvases}</div>', *tables)
        return page_of("pages/report.html", parts, data, "", content=content)
