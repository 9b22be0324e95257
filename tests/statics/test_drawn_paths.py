"""Drawn paths of equilibria: their lines, critical points and names."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex

from eomgen.errors import NumericalError, UsageError
from eomgen.products.statics.command import LoadPaths
from eomgen.products.statics.equilibrium_path import Critical, EquilibriumPath
from eomgen.products.statics.path_following import BucklingLoads
from tests.statics.refused_calls import rest_options

matplotlib.use("Agg")
from matplotlib import pyplot

BLUE, ORANGE = "#0b62c4", "#f08c00"


@pytest.fixture(autouse=True)
def closed_figures() -> Iterator[None]:
    yield
    pyplot.close("all")


def path_of(**changes: Any) -> EquilibriumPath:
    mode = np.array([0.0, 1.0])
    turn = Critical("limit point", 3.5, np.ones(2), mode, {"tip": 0.25}, 2, ("v.arm",), mode[:, None])
    fork = Critical("bifurcation", 2.0, np.ones(2), mode, {"tip": 0.4}, 3, ("v.leg",), np.eye(2))
    given = {
        "parameter": "load", "unit": "N", "values": np.array([1.0, 3.0, 3.0, 1.5]),
        "q": np.arange(8.0).reshape(4, 2), "z": np.zeros((4, 0)), "multipliers": np.zeros((4, 0)),
        "columns": {"tip": np.array([0.0, 0.2, 0.3, 0.5]), "arm.x": np.array([9.0, 7.0, 7.0, 8.0])},
        "units": {"tip": "m", "arm.x": ""}, "outputs": ("tip",), "negative": np.array([0, 0, 1, 2]),
        "lowest": np.array([4.0, 1.0, -1.0, -2.0]), "critical": (turn, fork), "success": True, "message": "arrived",
        "_branch": lambda number, size, to: (number, size, to),
    }  # fmt: skip
    return EquilibriumPath(**{**given, **changes})


def test_a_path_is_drawn_through_its_critical_points_with_its_stability() -> None:
    (axis,) = path_of().plot()
    lines = [
        (line.get_xdata(), line.get_ydata(), to_hex(line.get_color()), line.get_linestyle()) for line in axis.lines
    ]
    assert [(list(x), list(y), colour, style) for x, y, colour, style in lines[:5]] == [
        ([0.0, 0.2], [1.0, 3.0], BLUE, "-"),
        ([0.2, 0.25], [3.0, 3.5], BLUE, "-"),
        ([0.25, 0.3], [3.5, 3.0], ORANGE, "--"),
        ([0.3, 0.4], [3.0, 2.0], ORANGE, "--"),
        ([0.4, 0.5], [2.0, 1.5], ORANGE, "--"),
    ]
    marks = [(line.get_xydata().tolist(), to_hex(line.get_color()), line.get_marker()) for line in axis.lines[5:]]
    assert marks == [([[0.25, 3.5]], "#b00020", "o"), ([[0.4, 2.0]], "#1b7f3b", "D")]
    labels = [text.get_text() for text in axis.get_legend().get_texts()]
    assert labels == ["stable", "unstable", "limit point", "bifurcation"]
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("tip, m", "load, N")
    tip, arm = path_of(unit="1").plot(["tip", "arm.x"])
    assert (arm.get_xlabel(), arm.get_ylabel(), tip.get_xlabel()) == ("arm.x", "load", "tip, m")
    assert [list(line.get_xdata()) for line in arm.lines[1:3]] == [[7.0, 3.5], [3.5, 7.0]]
    (plain,) = path_of(critical=(), negative=np.full(4, -1)).plot("tip")
    assert plain.get_legend() is None and {to_hex(line.get_color()) for line in plain.lines} == {BLUE}


def test_a_path_is_drawn_into_a_file_also_on_axes_of_the_caller(tmp_path: Path) -> None:
    path_of().plot(axes=pyplot.figure().subplots(), path=tmp_path / "path.svg")
    assert (tmp_path / "path.svg").stat().st_size > 0
    with pytest.raises(UsageError, match=r"path\.foo: a figure is a \.png, \.svg or \.pdf file; try: figure\.png"):
        path_of().plot(path=tmp_path / "path.foo")


def test_a_path_names_columns_and_branches() -> None:
    path = path_of()
    assert path.largest_column == "tip"
    assert path_of(outputs=()).largest_column == "arm.x"
    assert path_of(outputs=(), columns={}).largest_column == "load"
    assert path.column("load") is path.values and path.column("tip") is path.columns["tip"]
    with pytest.raises(UsageError, match="the path has no column 'tup'; try: tip"):
        path.column("tup")
    with pytest.raises(UsageError, match=r"written as \.csv or \.json"):
        path.save("path.txt")
    assert [path.branch(number, 5.0, -2.0) for number in (0, 1, -1, -2)] == [
        (0, -2.0, 5.0), (1, -2.0, 5.0), (1, -2.0, 5.0), (0, -2.0, 5.0),
    ]  # fmt: skip
    for number in (2, -3):
        with pytest.raises(UsageError, match=f"there is no critical point {number}: the path has 2"):
            path.branch(number, 5.0)
    assert [item.multiplicity for item in path.critical] == [1, 2]
    assert list(path.initial) == ["q"] and path.initial["q"].tolist() == [6.0, 7.0]
    driven = path_of(z=np.arange(4.0)[:, None]).initial
    assert list(driven) == ["q", "z"] and driven["z"].tolist() == [3.0]


# -- the command -------------------------------------------------------------------------------------------------------


def model_of(**methods: Any) -> Any:
    """Return a model whose methods note what they are called with."""
    return SimpleNamespace(name="rig", v_names=("v.arm", "v.leg"), **methods)


def load_paths(**given: Any) -> LoadPaths:
    return LoadPaths(rest_options(**given))


def test_a_path_is_answered_by_its_critical_points_and_both_ends(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    calls: list[Any] = []
    model = model_of(equilibrium_path=lambda *given, **more: calls.append((given, more)) or path_of())
    table, figure = tmp_path / "path.csv", tmp_path / "path.svg"
    part = load_paths(along="load=1:1.5", path=str(table), figure=str(figure))
    assert part.answers and part.answer(model, {"initial": {}, "t": 2.0}, as_json=False) == 0
    assert calls == [(("load", 1.5, 1.0), {"initial": None, "t": 2.0, "progress": True})]
    shown = capsys.readouterr()
    lines = [line.split() for line in shown.out.splitlines()]
    assert ["limit", "point", "3.5", "0.25", "v.arm"] in lines and ["bifurcation", "2", "0.4", "v.leg"] in lines
    assert ["first", "1", "0"] in lines and ["last", "1.5", "0.5"] in lines
    assert shown.err == f"4 equilibria; arrived\nwritten to {table}, {figure}\n" and figure.is_file()
    rows = np.loadtxt(table, delimiter=",", skiprows=1)
    np.testing.assert_allclose(rows[:, :3], np.column_stack([path_of().values, path_of().negative, path_of().lowest]))
    assert table.read_text().splitlines()[0] == "load,negative_stiffnesses,lowest_stiffness,tip,arm.x"
    plain = load_paths(along="load=1:1.5", over=("load", "tip"))
    assert plain.answer(model, {"initial": {"arm": 0.1}}, as_json=False) == 0
    assert calls[-1][1]["initial"] == {"arm": 0.1}
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["bifurcation", "2", "2", "0.4", "v.leg"] in lines and ["last", "1.5", "1.5", "0.5"] in lines
    with pytest.raises(UsageError, match="the path has no column 'foot'"):
        load_paths(along="load=1:1.5", over=("foot",)).answer(model, {"initial": None}, as_json=False)


def test_a_path_is_written_as_the_json_that_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, file = path_of(lowest=np.array([4.0, np.nan, -1.0, -2.0])), tmp_path / "path.json"
    model = model_of(equilibrium_path=lambda *_, **__: path)
    assert load_paths(along="load=1:1.5", path=str(file)).answer(model, {"initial": None}, as_json=True) == 0
    data = json.loads(capsys.readouterr().out)
    assert data.pop("scene") == "rig" and data == json.loads(file.read_text())
    assert set(data) == {
        "parameter", "unit", "values", "columns", "units", "negative_stiffnesses", "lowest_stiffness", "q", "critical",
        "success", "message",
    }  # fmt: skip  # names
    assert data["lowest_stiffness"] == [4.0, None, -1.0, -2.0] and data["q"][1] == [2.0, 3.0]
    first, last = data["critical"]
    assert last.pop("multiplicity") == 2 and first == {
        "kind": "limit point", "value": 3.5, "q": [1.0, 1.0], "mode": [0.0, 1.0], "columns": {"tip": 0.25}, "after": 2,
        "components": ["v.arm"], "multiplicity": 1,
    }  # fmt: skip  # a table
    assert json.loads(json.dumps(path.to_dict()))["units"] == {"tip": "m", "arm.x": ""}


@pytest.mark.parametrize("interrupted", [True, False])
def test_a_path_that_does_not_arrive_is_written_first(interrupted: bool, tmp_path: Path) -> None:
    path = path_of(success=False, interrupted=interrupted, message="the path ends at load = 1.5 N")
    model = model_of(equilibrium_path=lambda *_, **__: path)
    part = load_paths(along="load=1:9", path=str(tmp_path / "path.csv"))
    if interrupted:
        assert part.answer(model, {"initial": None}, as_json=False) == 130
    else:
        with pytest.raises(NumericalError, match=r"--path: the path ends at load = 1\.5 N; try: the part of the path"):
            part.answer(model, {"initial": None}, as_json=False)
    assert len((tmp_path / "path.csv").read_text().splitlines()) == 5


def test_buckling_loads_are_answered_with_their_largest_displacements(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    loads = BucklingLoads(
        "load", "N", 0.0, np.array([2.5, -4.0]), np.array([[1.0, 0.5], [0.25, -1.0]]), (("arm",), ("leg", "arm"))
    )
    calls: list[Any] = []
    model = model_of(buckling_loads=lambda *given, **more: calls.append((given, more)) or loads)
    file = tmp_path / "loads.json"
    part = load_paths(buckling="load=2", path=str(file))
    assert part.answer(model, {"initial": {}}, as_json=False) == 0
    assert calls == [(("load", 2.0), {"initial": None})]
    shown = capsys.readouterr()
    lines = [line.split() for line in shown.out.splitlines()]
    assert lines[0] == ["rig:", "linear", "buckling", "about", "load", "=", "0"] and lines[1][:2] == ["load,", "N"]
    assert lines[2:] == [["2.5", "arm"], ["-4", "reversed", "leg,", "arm"]]
    assert shown.err == f"2 buckling loads\nwritten to {file}\n"
    assert load_paths(buckling="load").answer(model, {"initial": {}}, as_json=True) == 0
    data = json.loads(capsys.readouterr().out)
    assert data == json.loads(file.read_text()) and (data["values"], data["reversed"]) == ([2.5, -4.0], [False, True])
    assert data["modes"] == [{"v.arm": 1.0, "v.leg": 0.25}, {"v.arm": 0.5, "v.leg": -1.0}]
    assert calls[1][0] == ("load", 0.0) and load_paths().answer(model, {"initial": {}}, as_json=False) == 0
    assert len(calls) == 2
    with pytest.raises(UsageError, match=r"--out loads.csv: buckling loads are written as \.json; try: --out"):
        load_paths(buckling="load", path="loads.csv")
