"""Failure catalogue: tables and curves."""

from __future__ import annotations

from tests.failures.failure import Failure


def road(title: str, table: str, keys: str = "", after: str = "") -> Failure:
    """Return the entry of a road by a table with a text, further keys of the table, and lines after it."""
    more = f'[inputs.road]\ntable = {{ file = "road.csv"{keys} }}{after}'
    return Failure(title, 3, more=more, files={"road.csv": table})


FAILURES = [
    road("A cell that is not a number", "time,height\n0,0\n1,high\n2,0\n"),
    road("An empty cell", "time,height\n0,0\n1,\n2,0\n"),
    road("Rows out of order", "time,height\n0,0\n2,0.1\n1,0\n"),
    road("A column that there is not", "time,height\n0,0\n1,0.1\n2,0\n", ', value = "hight"'),
    road("A table of one row", "time,height\n0,0\n"),
    road("An empty table", ""),
    road("A periodic table that does not close", "0,0\n1,0.1\n2,0.3\n", after='\noutside = "periodic"'),
    Failure(
        "A curve of two kinds", 3, more="[curves.pulse]\npoints = [[0, 0], [1, 1]]\nbump = { height = 1, length = 1 }"
    ),
    Failure(
        "A run that begins before the points of a curve",
        2,
        command="simulate scene.toml --out out --t-end 1",
        old='effort = "motor"',
        new='effort = "pulse(t)"',
        more="[curves.pulse]\npoints = [[0.5, 0], [1, 5], [2, 0]]",
    ),
    Failure(
        "A curve without its argument",
        3,
        more='[curves.pulse]\npoints = [[0, 0], [1, 1]]\n\n[outputs.shape]\nformula = "pulse"',
    ),
]
