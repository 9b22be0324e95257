"""Curves against SciPy's splines and mpmath; tables that are wrong in many ways, each with one message, file and
line."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from eomgen.errors import DescriptionError
from eomgen.formula.curves import Curve, Interpolation, Outside
from eomgen.formula.discontinuities import affine
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import TIME, SceneNames
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from eomgen.symbolic.calculus.jets import jets
from eomgen.symbolic.calculus.partials import jacobian_vector
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.tape import ONE, Tape
from tests.oracles.fifty_digits import evaluate_mpmath

NATURAL = ([(3, 0.0), (4, 0.0)], [(3, 0.0), (4, 0.0)])
AT_REST = ([(1, 0.0), (2, 0.0)], [(1, 0.0), (2, 0.0)])


def points(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(0.05, 1.0, count)), rng.normal(size=count)


@pytest.mark.parametrize("count", [3, 5, 6, 40])
@pytest.mark.parametrize(("outside", "ends"), [("error", NATURAL), ("hold", AT_REST), ("periodic", "periodic")])
def test_splines_against_scipy(count: int, outside: Outside, ends: Any) -> None:
    x, y = points(count)
    y[-1] = y[0] if outside == "periodic" else y[-1]
    curve, spline = Curve("c", x, y, "quintic", outside), make_interp_spline(x, y, k=5, bc_type=ends)
    at = np.linspace(x[0], x[-1], 997)[1:-1]
    assert np.max(np.abs(curve(x[:-1]) - y[:-1])) <= 1e-13
    for derivative in range(5):
        expected = spline(at, nu=derivative)
        assert np.max(np.abs(curve(at, derivative) - expected)) <= 1e-9 * (1.0 + np.max(np.abs(expected))), derivative
        jump = np.abs(curve(x[1:-1] * (1 + 1e-15), derivative) - curve(x[1:-1] * (1 - 1e-14), derivative))
        assert np.max(jump) <= 1e-8 * (1.0 + np.max(np.abs(expected))), derivative


def test_two_points_are_a_straight_line() -> None:
    curve = Curve("c", np.array([1.0, 3.0]), np.array([5.0, 6.0]))
    assert curve(2.0) == 5.5 and curve(2.0, 1) == 0.5 and curve(2.0, 2) == 0.0


def test_outside() -> None:
    x, y = np.array([1.0, 2.0, 4.0]), np.array([3.0, 5.0, 3.0])
    assert np.all(np.isnan(Curve("c", x, y, "linear", "error")([0.9, 4.1])))
    assert Curve("c", x, y, "linear", "error")(4.0) == 3.0
    held = Curve("c", x, y, "linear", "hold")
    assert held([0.0, 9.0]).tolist() == [3.0, 3.0] and held([0.0, 9.0], 1).tolist() == [0.0, 0.0]
    again = Curve("c", x, y, "linear", "periodic")
    assert np.allclose(again([1.5 + 300, 1.5 - 300, 4.0]), [4.0, 4.0, 3.0], rtol=0, atol=1e-12)


def test_steps_hold_each_value_until_the_next() -> None:
    steps = Curve("c", np.array([1.0, 2.0, 3.0]), np.array([10.0, 20.0, 30.0]), "steps", "hold")
    assert steps([0.0, 1.0, 1.99, 2.0, 2.5, 3.0, 9.0]).tolist() == [10.0, 10.0, 10.0, 20.0, 20.0, 30.0, 30.0]
    assert steps(math.nextafter(2.0, 0.0)) == 20.0, "an argument that is a break but for rounding is the break"


@pytest.mark.parametrize(
    ("x", "y", "interpolation", "outside", "kinks"),
    [
        ([0, 1, 2], [0, 1, 0], "linear", "hold", [(0, 1), (1, 1), (2, 1)]),
        ([0, 1, 1, 2], [0, 0, 5, 5], "linear", "hold", [(1, 0)]),
        ([0, 1, 2], [0, 1, 0], "linear", "periodic", [(0, 1), (1, 1)]),
        ([0, 1], [0, 1], "linear", "periodic", [(0, 0)]),
        ([0, 1, 2], [7, 8, 7], "steps", "periodic", [(0, 0), (1, 0)]),
    ],
)
def test_kinks(
    x: list[float], y: list[float], interpolation: Interpolation, outside: Outside, kinks: list[Any]
) -> None:
    curve = Curve("c", np.array(x, float), np.array(y, float), interpolation, outside)
    assert curve.kinks() == kinks


# -- curves on the tape ------------------------------------------------------------------------------------------------


def on_tape() -> tuple[Tape, Curve, int]:
    x, y = points(12, seed=3)
    tape, curve = Tape(), Curve("c", x, y)
    t = tape.input("t")
    argument = tape.add(tape.constant(x[2]), tape.mul(tape.constant(1.7), tape.call(Op.SIN, t)))
    return tape, curve, tape.curve(curve, 0, argument)


def test_derivatives_and_jets_against_mpmath() -> None:
    tape, curve, ref = on_tape()
    time = InputSymbol("t", 0)
    first = jacobian_vector(tape, [ref], {time: ONE})
    second = jacobian_vector(tape, first, {time: ONE})
    third = jacobian_vector(tape, second, {time: ONE})
    (jet,) = jets(tape, [ref], {time: [tape.input("t"), ONE]}, 4)
    at = 0.4
    values = evaluate(tape, [ref, *first, *second, *third, *jet], {"t": at})
    with mpmath.workdps(50):
        piece = int(np.searchsorted(curve.breaks, curve.x[2] + 1.7 * math.sin(at), side="right")) - 1
        polynomial = [mpmath.mpf(c) for c in curve.coefficients[piece]]
        argument = lambda t: mpmath.mpf(curve.x[2]) + mpmath.mpf(1.7) * mpmath.sin(t) - mpmath.mpf(curve.breaks[piece])  # noqa: E731
        expected = mpmath.taylor(lambda t: mpmath.polyval(polynomial[::-1], argument(t)), mpmath.mpf(at), 4)
        rates = [float(expected[k] * mpmath.factorial(k)) for k in range(4)]
        assert np.allclose(values[:4], rates, rtol=1e-12, atol=0)
        assert np.allclose(values[4:], [float(c) for c in expected], rtol=1e-12, atol=0)
        (exact,) = evaluate_mpmath(tape, [ref], {"t": at})
        assert abs(exact - expected[0]) <= mpmath.mpf(10) ** -45


def test_complex_steps() -> None:
    tape, _, ref = on_tape()
    (rate,) = jacobian_vector(tape, [ref], {InputSymbol("t", 0): ONE})
    step = evaluate(tape, [ref], {"t": 0.4 + 1e-30j}).imag / 1e-30
    assert np.allclose(step, evaluate(tape, [rate], {"t": 0.4}), rtol=1e-14, atol=0)


def test_a_curve_at_a_constant_is_a_constant() -> None:
    tape, curve, _ = on_tape()
    ref = tape.curve(curve, 1, tape.constant(2.5))
    assert tape.value(ref) == float(curve(2.5, 1))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("20 * t - 2.8", (20, -2.8)),
        ("(3 - t) / 2", (-0.5, 1.5)),
        ("-(t + t) * 2", (-4, 0)),
        ("sin(t)", None),
        ("speed * t", (20, 0)),
    ],
)
def test_arguments_that_are_linear_in_time(text: str, expected: tuple[float, float] | None) -> None:
    formula = read_formula(text, SceneNames(parameters={"speed": False}), TIME)
    assert affine(formula, lambda symbol: 20.0) == expected


# -- files -------------------------------------------------------------------------------------------------------------

SCENE = """
format = 1
name = "cart"
bodies.cart = { mass = 1.0 }
joints.rail = { type = "prismatic", parent = "base", child = "cart", axis = [1, 0, 0] }
"""
TABLE = '[inputs.push]\ntable = { file = "push.csv", argument = "t", value = "F" }\n'
GOOD = "t,F\n0,1\n1,3\n2,2\n"


def loaded(folder: Path, table: str | bytes | None, entry: str = TABLE) -> Scene:
    (folder / "scene.toml").write_text(SCENE + entry)
    if table is not None:
        (folder / "push.csv").write_bytes(table.encode() if isinstance(table, str) else table)
    return load(folder / "scene.toml")


SCALED = 'table = { file = "push.csv", argument = "t", value = 1 }'


def curve_of(scene: Scene) -> Curve:
    (curve,) = scene.curves
    assert isinstance(curve, Curve)
    return curve


@pytest.mark.parametrize(
    "table",
    [
        GOOD,
        GOOD.replace("\n", "\r\n"),
        "\ufeff" + GOOD,
        GOOD.replace(",", ";"),
        GOOD.replace(",", "  "),
        "# by hand\n\n" + GOOD + "\n  \n# end\n",
        'note,"F","t"\na,1,0\nb,3,1\n"c, d",2,2\n',
        "t, F\n 0 , 1e0\n+1,+3.0\n2.,.2e1\n",
    ],
)
def test_tables_that_are_right(table: str, tmp_path: Path) -> None:
    curve = curve_of(loaded(tmp_path, table))
    assert curve.x.tolist() == [0, 1, 2] and curve.y.tolist() == [1, 3, 2] and curve.outside == "error"


@pytest.mark.parametrize(
    ("table", "entry"),
    [
        ("0 1\n1 3\n2 2", 'table = { file = "push.csv" }'),
        (
            "x;F;t\n9;1000,0;0\n9;3000,0;1000,0\n9;2000;2e3",
            SCALED.replace('"t"', '"t", decimal = ",", argument_scale = 1e-3, value_scale = 1e-3'),
        ),
        ("t,F\n0,1\n1000,3\n2000,2", SCALED.replace('"t"', '"t", argument_unit = "ms"')),
        ("t,F\n0,1000\n1,3000\n2,2000", SCALED.replace('"t"', '"t", value_unit = "N mm"')),
        ("", 'points = [["0 s", "1 N"], ["1000 ms", "3 N"], [2, 2]]'),
        ("a,t,F\n1,0,1\n1,1,3\n1,2,2", 'table = { file = "push.csv", argument = 1, value = 2, delimiter = "comma" }'),
    ],
)
def test_other_ways_to_name_columns(table: str, entry: str, tmp_path: Path) -> None:
    curve = curve_of(loaded(tmp_path, table, f"[inputs.push]\n{entry}\n"))
    assert np.allclose(curve.x, [0, 1, 2]) and np.allclose(curve.y, [1, 3, 2])


def test_a_path_starts_at_the_scene_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert len(curve_of(loaded(tmp_path, GOOD)).x) == 3


def test_what_a_table_holds_is_part_of_the_scene(tmp_path: Path) -> None:
    first = loaded(tmp_path, GOOD)
    assert loaded(tmp_path, GOOD + "\n").digest == first.digest
    assert loaded(tmp_path, GOOD.replace("3", "3.0000000000001")).digest != first.digest


@pytest.mark.slow_cases("table22-100002|the table has 100001 rows")
@pytest.mark.parametrize(
    ("table", "message"),
    [
        (None, "'{folder}/push.csv' (inputs.push.table): cannot be read: No such file or directory; try: "),
        ("", "|the table is empty; try: a row of titles, and rows of numbers"),
        ("# nothing\n\n", "|the table is empty"),
        ("t,F\n", "|there are titles and no rows of numbers; try: two rows or more"),
        ("t,F\n0,1\n", "2|a curve needs two points or more, not 1; try: more points"),
        ("t,G\n0,1\n1,1\n", "1|there is no column 'F'; there are t, G; try: one of t, G"),
        ("t,F,F\n0,1,2\n", "1|2 columns are called 'F'; try: the number of the column, 1 or 2"),
        ("0,1\n1,2\n", "1|there is no column 't': the first row holds numbers, not titles; try: the number"),
        ("t,F\n0,1\n1,\n2,3\n", "3|column 'F' is empty; try: a number, or the row left out"),
        ("t,F\n0,1\n1\n2,3\n", "3|column 'F' is missing: the row has 1; try: a number, or the row left out"),
        ("t,F\n0,1\n1,nan\n2,3\n", "3|column 'F': 'nan' is not a finite number; try: the row left out"),
        ("t,F\n0,1\n1,x\n", "3|column 'F': 'x' is not a number; try: a number such as 0.25"),
        ("t,F\n0,1\n1,1_000\n", "3|column 'F': '1_000' is not a finite number"),
        ("t;F\n0;1,5\n1;2\n", "2|column 'F': '1,5' is not a number; try: decimal = \",\""),
        ("t,F\n0,1\n2,1\n1,1\n", "4|the points are not in order: 1 comes after 2; try: rows sorted"),
        ("t,F\n0,1\n1,1\n1,2\n2,1\n", '4|1 occurs again; try: one value for each, or interpolation = "linear"'),
        ("t,F\n0,1\n1,1\n1.0000001,2\n2,1\n", "4|distances of points: 1e-07 here, 1 elsewhere, too uneven"),
        (b"\xd0\xcf\x11\xe0\xa1", "|the file is a spreadsheet (xlsx, ods or xls), and tables are read from CSV"),
        ("t,F\n0,1\n1,\0\n", "3|there is a zero byte: this is not a text; try: the file saved as CSV in UTF-8"),
        ("t,F\n0,1\n1,\N{DEGREE SIGN}\n".encode("latin-1"), "3|byte 10 is not UTF-8; try: the file saved"),
        (GOOD.encode("utf-16"), "1|the file is UTF-16; try: the file saved as CSV in UTF-8"),
        ('t,F\n0,"1\n1,2\n', "2|this is not CSV: unexpected end of data; try: plain numbers"),
        (b"t,F\n" + b"".join(b"%d,1\n" % k for k in range(100_001)), "100002|the table has 100001 rows"),
        (b"x" * 20_000_001, "|the file is larger than 20 MB; try: a smaller file"),
    ],
)
def test_tables_that_are_wrong(table: str | bytes | None, message: str, tmp_path: Path) -> None:
    line, mark, text = message.format(folder=tmp_path).partition("|")
    with pytest.raises(DescriptionError) as raised:
        loaded(tmp_path, table)
    (problem,) = raised.value.problems
    place = f"push.csv{':' * bool(line)}{line} (inputs.push.table): "
    assert str(problem).startswith(place + text if mark else line)


LINE = "[curves.c]\npoints = [[0, 0], [1, 1]]\n"


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (TABLE.replace('"t"', "7"), "push.csv:1 (inputs.push.table): there is no column 7: the row has 2"),
        (TABLE.replace("value =", 'value_unit = "mmm", value ='), "table.value_unit): there is no unit 'mmm'; try: mm"),
        (LINE + 'outside = "periodic"', "(curves.c.points[1]): the last value 1 is not the first one 0"),
        ('[inputs.u]\nwave = { shape = "square", period = 0 }', "(inputs.u.wave.period): the period 0 is not positive"),
        ('[inputs.u]\noutside = "hold"', "(inputs.u.outside): outside is for points and tables"),
        (LINE + '[inputs.u]\nformula = "c"', "'c' is a curve, which needs an argument (column 1); try: c(t)"),
        (LINE + '[inputs.u]\nformula = "derivative.d(t)"', "there is no curve 'd' (column 1); try: "),
        (LINE + '[base]\nposition = ["c(q.rail)", 0, 0]', "q.rail cannot be used here"),
        (LINE + '[points.p]\nbody = "cart"\nposition = ["c(1)", 0, 0]', "the curve 'c' cannot be used here"),
    ],
)
def test_entries_that_are_wrong(entry: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(DescriptionError) as raised:
        loaded(tmp_path, GOOD, entry)
    (problem,) = raised.value.problems
    assert message.format(folder=tmp_path) in str(problem)


def test_a_curve_from_python_is_refused_at_its_line() -> None:
    with pytest.raises(DescriptionError, match=r"test_curves.py:\d+ \(curves.c\): a curve needs one of"):
        SceneBuilder("cart").curve("c").build()


@pytest.mark.parametrize(
    ("table", "units", "noted"),
    [
        ("x,F\n0,1\n1,2\n", 'value_unit = "kN"', "argument"),
        ("x,F\n0,1\n1,2\n", 'argument_unit = "mm"', "value"),
        ("x,F\n0,1\n1,2\n", 'argument_unit = "mm", value_unit = "1"', ""),
        ("x [m],F\n0,1\n1,2\n", 'value_unit = "kN"', ""),
    ],
)
def test_a_column_without_a_unit_next_to_one_with_a_unit(table: str, units: str, noted: str, tmp_path: Path) -> None:
    entry = f'[curves.pull]\ninterpolation = "linear"\ntable = {{ file = "push.csv"{units and ", " + units} }}\n'
    notes = [note for note in loaded(tmp_path, table, entry).notes if note.startswith("curves.pull.table")]
    fault = "its numbers are taken as they are, without a unit, unlike the numbers of"
    assert [note.partition(";")[0] for note in notes] == [
        f"curves.pull.table.{noted}: {fault} {'value' if noted == 'argument' else 'argument'}"
    ][: bool(noted)]
