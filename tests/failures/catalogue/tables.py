"""Failure catalogue: tables and curves."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure(
        "A cell that is not a number",
        3,
        more='[inputs.road]\ntable = { file = "road.csv" }',
        files={"road.csv": "time,height\n0,0\n1,high\n2,0\n"},
    ),
    Failure(
        "An empty cell",
        3,
        more='[inputs.road]\ntable = { file = "road.csv" }',
        files={"road.csv": "time,height\n0,0\n1,\n2,0\n"},
    ),
    Failure(
        "Rows out of order",
        3,
        more='[inputs.road]\ntable = { file = "road.csv" }',
        files={"road.csv": "time,height\n0,0\n2,0.1\n1,0\n"},
    ),
    Failure(
        "A column that there is not",
        3,
        more='[inputs.road]\ntable = { file = "road.csv", value = "hight" }',
        files={"road.csv": "time,height\n0,0\n1,0.1\n2,0\n"},
    ),
    Failure(
        "A table of one row",
        3,
        more='[inputs.road]\ntable = { file = "road.csv" }',
        files={"road.csv": "time,height\n0,0\n"},
    ),
    Failure("An empty table", 3, more='[inputs.road]\ntable = { file = "road.csv" }', files={"road.csv": ""}),
    Failure(
        "A periodic table that does not close",
        3,
        more='[inputs.road]\ntable = { file = "road.csv" }\noutside = "periodic"',
        files={"road.csv": "0,0\n1,0.1\n2,0.3\n"},
    ),
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
