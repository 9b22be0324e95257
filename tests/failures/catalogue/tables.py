"""Failure catalogue: tables and curves."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure("A table that is not there", 3, more='[inputs.road]\ntable = { file = "road.csv" }'),
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
        "A row with too few columns",
        3,
        "description error: road.csv:3 (inputs.road.table): column 'height' is missing: the row has 1; try: a number,"
        " or the row left out [E1902]",
        more='[inputs.road]\ntable = { file = "road.csv" }',
        files={"road.csv": "time,height\n0,0\n1\n2,0\n"},
    ),
    Failure(
        "A table of one row",
        3,
        more='[inputs.road]\ntable = { file = "road.csv" }',
        files={"road.csv": "time,height\n0,0\n"},
    ),
    Failure("An empty table", 3, more='[inputs.road]\ntable = { file = "road.csv" }', files={"road.csv": ""}),
    Failure(
        "A table that is no text",
        3,
        "description error: road.csv:1 (inputs.road.table): byte 0 is not UTF-8; try: the file saved as CSV in"
        " UTF-8 [E1894]",
        more='[inputs.road]\ntable = { file = "road.csv" }',
        files={"road.csv": b"\x89PNG\r\n\x1a\n\x00\x00"},
    ),
    Failure(
        "Decimal commas that are not announced",
        3,
        "description error: road.csv:2 (inputs.road.table): column 'time': '0,0' is not a number; try: decimal ="
        ' "," [E1905]',
        more='[inputs.road]\ntable = { file = "road.csv" }',
        files={"road.csv": "time;height\n0,0;0,0\n0,5;0,1\n1,0;0,0\n"},
    ),
    Failure(
        "A periodic table that does not close",
        3,
        more='[inputs.road]\ntable = { file = "road.csv" }\noutside = "periodic"',
        files={"road.csv": "0,0\n1,0.1\n2,0.3\n"},
    ),
    Failure(
        "Points out of order",
        3,
        "description error: scene.toml:34 (curves.pulse.points[2]): the points are not in order: 1 comes after 2; try: "
        "rows sorted by the first of the two columns [E0912]",
        more="[curves.pulse]\npoints = [[0, 0], [2, 1], [1, 0]]",
    ),
    Failure(
        "A curve of two kinds", 3, more="[curves.pulse]\npoints = [[0, 0], [1, 1]]\nbump = { height = 1, length = 1 }"
    ),
    Failure(
        "A table in a unit that there is not",
        3,
        "description error: scene.toml:34 (inputs.road.table.value_unit): there is no unit 'mmm'; try: mm [E0317]",
        more='[inputs.road]\ntable = { file = "road.csv", value_unit = "mmm" }',
        files={"road.csv": "time,height\n0,0\n1,5\n2,0\n"},
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
        "A run beyond the points of a table",
        2,
        "note: the input road changes nothing: no formula mentions it [W0101]\n"
        "usage error: t_end: the points of inputs.road end at t = 2 s, the run ends at t = 3 s; try: t_end = 2, or "
        'outside = "hold" or "periodic" [E2063]',
        command="simulate scene.toml --out out --t-end 3",
        more='[inputs.road]\ntable = { file = "road.csv" }',
        files={"road.csv": "time,height\n0,0\n1,0.1\n2,0\n"},
    ),
    Failure(
        "A curve without its argument",
        3,
        more='[curves.pulse]\npoints = [[0, 0], [1, 1]]\n\n[outputs.shape]\nformula = "pulse"',
    ),
    Failure(
        "A curve of two arguments",
        3,
        "description error: scene.toml:37 (outputs.shape.formula[0]): pulse() takes 1 argument, not 2 (column 1); try: "
        "pulse(t) [E1532]",
        more='[curves.pulse]\npoints = [[0, 0], [1, 1]]\n\n[outputs.shape]\nformula = "pulse(t, 1)"',
    ),
]
