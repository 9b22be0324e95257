"""Units of the two columns of curves: every unit at every place where a column takes one, against pint's own table;
titles, indices and surplus cells of tables."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.curves import Curve
from eomgen.formula.units.table import UNITS
from eomgen.scene.document.units import in_si
from eomgen.scene.load import load, load_toml
from eomgen.scene.reading.report import Report
from eomgen.scene.scene import Scene
from tests.scene.test_units import _PINT, registry

_TURNING = {"rad", "mrad", "deg", "arcmin", "arcsec", "rev", "rpm"}


def dimension(unit: str) -> tuple[dict[str, int], int]:
    """Return pint's dimension of a unit of the table, and its power of angles, which pint counts as numbers."""
    words = {each.symbol: each.words.split()[0] for each in UNITS}
    made = registry().Quantity(1.0, "dimensionless")
    angle = 0
    for place, part in enumerate(unit.split("/")):
        for name in part.split():
            base, _, power = name.partition("^")
            exponent = int(power or 1) * (1 if place == 0 else -1)
            word = words.get(base, base)
            made *= registry()(_PINT.get(word, word)) ** exponent
            angle += exponent * (base in _TURNING)
    return {str(key): int(value) for key, value in made.dimensionality.items()}, angle


def factor(unit: str, coherent: str) -> float:
    """Return the size of a unit in a coherent one by pint's own definitions."""
    words = {each.symbol: each.words.split()[0] for each in UNITS}
    word = words.get(unit, unit)
    return float((registry()(f"1 {_PINT.get(word, word)}") / registry()(coherent.replace(" ", "*"))).to("").magnitude)


def _input(**entry: Any) -> dict[str, Any]:
    return {"inputs": {"u": entry}}


def _random(kind: str) -> dict[str, Any]:
    return {"random": {"g": {"type": kind, "points": [["2 @", 1]]}}}


#: Where a column of a curve takes a number with a unit, or the unit of its numbers, at @; and the unit that is wanted.
PLACES: dict[str, tuple[str, dict[str, Any]]] = {
    "input.points.argument": ("s", _input(points=[["2 @", 0], [9, 1]])),
    "input.wave.period": ("s", _input(wave={"shape": "square", "period": "2 @"})),
    "input.wave.start": ("s", _input(wave={"period": 1, "start": "2 @"})),
    "input.table.argument": ("s", _input(table={"file": "t.csv", "argument_unit": "@"})),
    "road.points.argument": ("m", _input(road={"points": [["2 @", 0]]})),
    "road.points.value": ("m", _input(road={"points": [[0, "2 @"]]})),
    "road.table.argument": ("m", _input(road={"table": {"file": "t.csv", "argument_unit": "@"}})),
    "road.table.value": ("m", _input(road={"table": {"file": "t.csv", "value_unit": "@"}})),
    "spectrum.argument": ("Hz", _random("spectrum")),
    "covariance.argument": ("s", _random("covariance")),
}
for _label in ("m", "m/s^2", "N", "N m", "rad", "rad/s", "kg", "Pa"):
    PLACES |= {
        f"input.points of {_label}": (_label, _input(unit=_label, points=[[0, "2 @"]])),
        f"input.high of {_label}": (_label, _input(unit=_label, wave={"period": 1, "high": "2 @"})),
        f"input.table of {_label}": (_label, _input(unit=_label, table={"file": "t.csv", "value_unit": "@"})),
    }
for _axis in ("m", "rad", "m/s"):
    _curve = {"argument_unit": _axis, "points": [["2 @", 0]]}
    PLACES[f"curve.points.argument of {_axis}"] = (_axis, {"curves": {"c": _curve}})


def marked(data: Any, place: tuple[str | int, ...] = ()) -> tuple[str | int, ...]:
    """Return the place of @ within data."""
    if isinstance(data, str):
        return place if "@" in data else ()
    entries = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    return next((found for key, entry in entries if (found := marked(entry, (*place, key)))), ())


@pytest.mark.slow_cases("input.points.argument")
@pytest.mark.parametrize("place", PLACES)
def test_a_column_takes_every_unit_of_its_dimension_and_no_other(place: str) -> None:
    wanted, written = PLACES[place]
    path, taken = marked(written), 0
    for unit in [each.symbol for each in UNITS] + ["ms", "km", "kN", "mrad", "MPa", "km/h", "N m", "m/s^2", "rad/s"]:
        report = Report("scene.toml", {})
        found: Any = in_si(json.loads(json.dumps(written).replace("@", unit)), report)[0]
        for key in path:
            found = found[key]
        fits = dimension(unit) == dimension(wanted)
        assert bool(report.noted) != fits, (place, unit, report.noted)
        if fits and isinstance(path[-1], str) and path[-1].endswith("_unit"):
            assert found == unit
        elif fits and " " not in unit and "/" not in unit:
            assert found == pytest.approx(2.0 * factor(unit, wanted), rel=1e-15)
        taken += fits
    assert taken > 0


# -- whole scenes ------------------------------------------------------------------------------------------------------

SLIDER = """\
format = 1
name = "slider"
bodies.m = { mass = 1 }
joints.x = { type = "prismatic", parent = "base", child = "m", axis = [1, 0, 0] }
efforts.e = { joint = "x", effort = "u" }
"""


def loaded(folder: Path, more: str, table: str = "0,0\n1,2\n2,4\n", text: str = SLIDER) -> Scene:
    (folder / "t.csv").write_text(table)
    return load_toml(text + more, folder=folder)


def curve_of(scene: Scene) -> Curve:
    (curve,) = scene.curves
    assert isinstance(curve, Curve)
    return curve


def refused(folder: Path, more: str, table: str = "0,0\n1,2\n2,4\n", text: str = SLIDER) -> str:
    with pytest.raises(DescriptionError) as error:
        loaded(folder, more, table, text)
    return str(error.value)


def test_accelerations_in_g_are_no_grams(tmp_path: Path) -> None:
    table = '[inputs.u]\nunit = "m/s^2"\ntable = {{ file = "t.csv", value_unit = "{}" }}\n'
    message = refused(tmp_path, table.format("g"))
    assert "(inputs.u.table.value_unit): the unit 'g' is of a mass, an acceleration in m/s^2 is expected" in message
    assert 'try: "g0", 9.80665 m/s^2: g is the gram' in message
    curve = curve_of(loaded(tmp_path, table.format("g0")))
    assert np.array_equal(curve.y, np.array([0, 2, 4]) * 9.80665)


def test_a_curve_that_says_its_unit_gives_its_label(tmp_path: Path) -> None:
    entry = '[inputs.u]\ntable = { file = "t.csv", value_unit = "kN", argument_unit = "ms" }\n'
    (given,) = loaded(tmp_path, entry).inputs
    assert given.unit == "N"
    message = refused(tmp_path, '[inputs.u]\nunit = "mm"\ntable = { file = "t.csv", value_unit = "mm" }\n')
    assert "(inputs.u.unit): its values are in m, and the label 'mm' says otherwise; try: unit = \"m\"" in message


@pytest.mark.parametrize(
    ("argument", "fits"),
    [("t", False), ("q.x", True), ("q.x - 0.1", True), ("-abs(q.x)", True), ("v.x", False), ("v.x * 0.1", True)],
)
def test_a_curve_is_taken_at_arguments_of_its_own_unit(argument: str, *, fits: bool, tmp_path: Path) -> None:
    text = SLIDER.replace('"u"', f'"c({argument})"')
    curve = '[curves.c]\npoints = [["-900 mm", 0], ["900 mm", "5 N"]]\n'
    if fits:
        loaded(tmp_path, curve, text=text)
        return
    given = "s" if argument == "t" else "m/s"
    message = refused(tmp_path, curve, text=text)
    assert f"(efforts.e.effort): the argument of c is in m by its own entry, and is given here in {given}" in message


def test_points_without_a_unit_beside_others_are_noted_once_for_a_column(tmp_path: Path) -> None:
    scene = loaded(tmp_path, '[inputs.u]\npoints = [["0 s", 1], ["1 s", "2 N"], [2, 3], [3, 4]]\n')
    assert "inputs.u.points: the argument 2 has no unit, as others have, so it is 2 s (2 such arguments)" in scene.notes
    assert "inputs.u.points: the value 1 has no unit, as others have, so it is 1 N (3 such values)" in scene.notes


# -- tables ------------------------------------------------------------------------------------------------------------

TABLE = '[inputs.u]\ntable = { file = "t.csv" }\n'


def test_an_index_of_pandas_is_no_time(tmp_path: Path) -> None:
    table = ",t,a\n0,0,1\n1,0.1,2\n2,0.2,3\n"
    message = refused(tmp_path, TABLE, table)
    assert "t.csv:1 (inputs.u.table): the first column counts the rows, as an index that pandas" in message
    assert 'try: argument = "t", value = "a"; or the file written with index=False' in message
    chosen = TABLE.replace('csv"', 'csv", argument = "t", value = "a"')
    curve = curve_of(loaded(tmp_path, chosen, table))
    assert np.array_equal(curve.x, [0, 0.1, 0.2])


@pytest.mark.parametrize(
    ("table", "hint"),
    [
        ("index,x,f\n0,0,10\n1,0.1,20\n", 'argument = "x", value = "f"'),
        ("row,time_ms\n0,0\n1,5\n", "argument = 0 to take the count"),
    ],
)
def test_a_column_that_counts_rows_beside_times_is_no_time(table: str, hint: str, tmp_path: Path) -> None:
    message = refused(tmp_path, TABLE, table)
    assert "t.csv:1 (inputs.u.table): the first column counts the rows, as" in message
    assert hint in message
    loaded(tmp_path, TABLE.replace('csv"', 'csv", argument = 0, value = 1'), table)


@pytest.mark.parametrize("titles", ["t,f", "time,f", "s,f", "n,f", "t [s],f", "time,t_ref"])
def test_whole_seconds_are_times(titles: str, tmp_path: Path) -> None:
    curve = curve_of(loaded(tmp_path, TABLE, f"{titles}\n0,1\n1,3\n2,5\n"))
    assert np.array_equal(curve.x, [0, 1, 2])


@pytest.mark.parametrize("titles", ["", "t,f,\n"])
def test_a_delimiter_at_the_end_of_each_row_adds_no_column(titles: str, tmp_path: Path) -> None:
    scene = loaded(tmp_path, TABLE, f"{titles}0,1,\n0.1,3, \n0.3,5,\n")
    assert not scene.notes
    curve = curve_of(scene)
    assert np.array_equal(curve.y, [1, 3, 5])


@pytest.mark.parametrize("column", ["argument", "value"])
def test_a_column_times_zero_is_refused(column: str, tmp_path: Path) -> None:
    message = refused(tmp_path, TABLE.replace('csv"', f'csv", {column}_scale = 0'), "t,f\n0,1\n1,3\n")
    assert f"(inputs.u.table.{column}_scale): a factor of zero makes all values of the column zero" in message


def test_a_column_that_nobody_chose_among_three_is_noted(tmp_path: Path) -> None:
    table = "t,b,a\n0,0,1\n1,0.1,2\n"
    note = "inputs.u.table.value: the table has 3 columns, and column 1, 'b', is taken; value = 1 says that it is meant"
    assert note in loaded(tmp_path, TABLE, table).notes
    assert loaded(tmp_path, TABLE.replace('csv"', 'csv", value = 1'), table).notes == ()


@pytest.mark.parametrize("surplus", ["5", "x", "5,6", " 5"])
def test_rows_with_more_cells_than_the_first_row_are_refused(surplus: str, tmp_path: Path) -> None:
    for titles in ("t,f\n", ""):
        message = refused(tmp_path, TABLE, f"{titles}0,0\n1,10,{surplus}\n2,1\n")
        assert f"t.csv:{3 if titles else 2} (inputs.u.table): the row has {3 + surplus.count(',')} cells" in message
        assert 'decimal commas needs ; between columns and decimal = ","' in message


@pytest.mark.parametrize("surplus", ["", " ", "# checked", ",", " , "])
def test_empty_cells_and_comments_behind_a_row_are_none(surplus: str, tmp_path: Path) -> None:
    curve = curve_of(loaded(tmp_path, TABLE, f"t,f\n0,0\n1,10,{surplus}\n2,1\n"))
    assert np.array_equal(curve.y, [0, 10, 1])


@pytest.mark.parametrize(
    ("table", "more", "answer"),
    [
        ("t;f\n0;1.000,5\n1;2\n", "", "try: numbers without separators of thousands"),
        ("t;f\n0;1.000\n1;2,5\n", ', decimal = ","', "'1.000' has a point, and the decimal mark is a comma"),
        ("t;f\n0;0,25\n1;2\n", "", "'0,25' is not a number; try: decimal = \",\""),
    ],
)
def test_separators_of_thousands_are_no_decimal_marks(table: str, more: str, answer: str, tmp_path: Path) -> None:
    assert answer in refused(tmp_path, TABLE.replace('csv"', f'csv"{more}'), table)


@pytest.mark.parametrize(
    ("titles", "key", "note"),
    [
        ("x [m],f", "", "inputs.u.table.argument: the title of the column 'x [m]' says m, and its numbers are"),
        ("t,f [kN]", 'unit = "m"\n', "inputs.u.table.value: the title of the column 'f [kN]' says kN, and its numbers"),
        ("t [s],f [N]", 'unit = "N"\n', ""),
        ("t [s],f [N]", 'unit = "share"\n', ""),
        ("t [s],f [mean]", 'unit = "N"\n', ""),
    ],
)
def test_titles_of_another_dimension_are_noted(titles: str, key: str, note: str, tmp_path: Path) -> None:
    scene = loaded(tmp_path, TABLE.replace("table", f"{key}table"), f"{titles}\n0,0\n1,2\n")
    found = [each for each in scene.notes if "title of the column" in each]
    assert bool(found) == bool(note) and all(each.startswith(note) for each in found)


def test_records_of_accelerations_in_g_are_multiples_of_standard_gravity(tmp_path: Path) -> None:
    record = "t,acceleration [g]\n0,0\n1,2\n"
    (note,) = loaded(tmp_path, TABLE, record).notes
    assert note.endswith("'acceleration [g]' are taken in SI, as they are; try: value_unit = \"g0\"")
    curve = curve_of(loaded(tmp_path, TABLE.replace('csv"', 'csv", value_unit = "g0"'), record))
    assert curve.y[1] == pytest.approx(2 * 9.80665, rel=1e-15)


@pytest.mark.slow
def test_messages_quote_nothing_of_a_table_outside_the_folder_of_the_scene(tmp_path: Path) -> None:
    inside = tmp_path / "scene"
    inside.mkdir()
    secret = tmp_path / "secret.conf"
    (inside / "link.csv").symlink_to(secret)
    for text, chosen in itertools.product(
        ("hunter2:x\nsecret:y\n", "hunter2,secret\nsecret,hunter2\n", "1,hunter2\nsecret,2\n", "hunter2\tsecret\t1\n"),
        ("", ", value = 0", ', value = "a"', ', argument = "b"', ", argument = 9"),
    ):
        secret.write_text(text)
        for file in ("../secret.conf", str(secret), "link.csv"):
            message = refused(inside, f'[inputs.u]\ntable = {{ file = "{file}"{chosen} }}\n')
            assert "hunter2" not in message
            assert message.count("secret") == message.count("secret.conf")
    (inside / "own.csv").write_text("time,force\n0,high\n")
    assert "column 'force': 'high'" in refused(inside, '[inputs.u]\ntable = { file = "own.csv" }\n')


# ---- labels of random processes, whose columns are squares -----------------------------------------------------------

_LABELS = ("m", "N", "rad", "1/s", "N/m", "m/s^2")


def _process(folder: Path, lines: str) -> Scene:
    path = folder / "process.toml"
    path.write_text(SLIDER.replace('"u"', '"g"') + f"[random.g]\nduration = 2.0\nmodes = 2\n{lines}\n")
    return load(path)


def _square(label: str) -> str:
    above, _, below = label.partition("/")
    over, _, power = below.partition("^")
    root = "" if above == "1" else f"{above}^2"
    return f"{root or '1'}/{over}^{2 * int(power or 1)}" if below else root


@pytest.mark.parametrize("label", _LABELS)
@pytest.mark.parametrize("kind", ["covariance", "spectrum", "spectrum over distance"])
def test_values_of_a_random_process_are_squares_of_its_label(label: str, kind: str, tmp_path: Path) -> None:
    square = _square(label)
    if kind == "covariance":
        unit, x = square, ["0 s", "1 s", "2 s"]
    elif kind == "spectrum":
        unit, x = f"{square}/Hz", ["0.1 Hz", "1 Hz", "2 Hz"]
    else:
        unit, x = (square.replace("1/", "m/") if square.startswith("1/") else f"m {square}"), ["0.1 1/m", "1 1/m"]
    points = ", ".join(f'["{place}", "{2.0 - k} {unit}"]' for k, place in enumerate(x))
    speed = "speed = 1.0\n" if kind == "spectrum over distance" else ""
    scene = _process(tmp_path, f'type = "{kind.split(maxsplit=1)[0]}"\n{speed}unit = "{label}"\npoints = [{points}]')
    process = scene.inputs[0]
    assert process.unit == label
    assert process.series is not None
    if kind == "covariance":
        assert process.series.total == pytest.approx(2.0 * 2.0, rel=1e-12)  # R(0) times the window


@pytest.mark.parametrize(
    ("lines", "fault"),
    [
        (
            'type = "spectrum"\nunit = "m"\npoints = [[0.1, "1 N^2/Hz"], [1, 1]]',
            "(random.g.points[0][1]): '1 N^2/Hz' is in N^2/Hz, a quantity in m^2/Hz is expected",
        ),
        (
            'type = "covariance"\nunit = "mm"\npoints = [[0, "1 mm^2"], [1, 0]]',
            "its values become m^2, of a quantity in m, and the label 'mm' says otherwise; try: unit = \"m\"",
        ),
    ],
)
def test_labels_of_random_processes_against_their_values(lines: str, fault: str, tmp_path: Path) -> None:
    with pytest.raises(DescriptionError) as caught:
        _process(tmp_path, lines)
    assert fault in str(caught.value)


def test_a_table_of_a_spectrum_in_square_millimetres_is_of_a_process_in_m(tmp_path: Path) -> None:
    (tmp_path / "spectrum.csv").write_text("f,G\n0.1,1e6\n1.0,2e6\n2.0,0\n")
    table = 'type = "spectrum"\ntable = {file = "spectrum.csv", value_unit = "mm^2/Hz"}'
    labelled, plain = (_process(tmp_path, f"{lines}{table}").inputs[0] for lines in ('unit = "m"\n', ""))
    assert (labelled.unit, plain.unit) == ("m", "")  # g is not in m^2/Hz
    assert labelled.series is not None and plain.series is not None
    # int G df of the line through (0.1, 1), (1, 2), (2, 0) m^2/Hz
    assert labelled.series.total / 2.0 == pytest.approx(0.9 * 1.5 + 1.0, rel=1e-12)
    assert plain.series.total == labelled.series.total


@pytest.mark.slow
def test_a_translated_process_has_a_unit_apart_from_its_covariance(tmp_path: Path) -> None:
    lines = 'type = "covariance"\nunit = "N"\ntranslation = "3*g"\npoints = [[0, "4 m^2"], [1, 0]]'
    process = _process(tmp_path, lines).inputs[0]
    assert process.unit == "N"
    assert process.series is not None
    assert process.series.total == pytest.approx(8.0, rel=1e-12)


@pytest.mark.parametrize("unit", ["m", "kg", "Hz", "N s"])
def test_lags_of_the_wrong_kind_are_refused_for_the_unit(unit: str, tmp_path: Path) -> None:
    lines = f'type = "covariance"\npoints = [["0 {unit}", 1], ["1 {unit}", 0.5], ["2 {unit}", 0]]'
    with pytest.raises(DescriptionError, match="a time in s is expected") as caught:
        _process(tmp_path, lines)
    assert all("(random.g.points[" in str(problem) for problem in caught.value.problems)


def test_a_number_too_large_beside_a_unit_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "far.toml"
    center = f'center_of_mass = ["50 mm", 0, 1{400 * "0"}], '
    file.write_text(SLIDER.replace("bodies.m = { ", f"bodies.m = {{ {center}"), encoding="utf-8")
    with pytest.raises(DescriptionError, match=r"bodies\.m\.center_of_mass"):
        load(file)
