"""Drawn paths of equilibria: their lines, critical points and names."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex

from eomgen.errors import UsageError
from eomgen.products.statics.equilibrium_path import Critical, EquilibriumPath

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
