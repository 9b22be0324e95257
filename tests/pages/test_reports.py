"""Reports: their sections hold what the runs, the model and the checks give."""

from __future__ import annotations

import base64
import html
import json
import re
import tomllib
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import eomgen
from eomgen.products.pages.commands import report as command
from eomgen.products.pages.report import _columns_of, _difference
from tests.models.scenes import PENDULUM_TOML


@cache
def model() -> Any:
    return eomgen.build(tomllib.loads(PENDULUM_TOML), profile="quick")


def text_of(page: Path) -> str:
    return html.unescape(re.sub(r"<[^>]+>", " ", page.read_text(encoding="utf-8").partition('<script id="data"')[0]))


def data_of(page: Path) -> Any:
    found = re.search(
        r'<script id="data" type="application/json">(.*?)</script>', page.read_text(encoding="utf-8"), re.S
    )
    assert found
    return json.loads(found[1])


def test_a_report_has_counts_runs_findings_modes_and_the_animation(tmp_path: Path) -> None:
    solution = model().simulate(0.2, 1e-2)
    page = model().report(tmp_path / "report.html", solution)
    text = text_of(page)
    assert page.name == "report.html"
    for words in (
        "Scene",
        "Counts",
        "degrees of freedom",
        solution.message,
        str(solution.error.largest),
        "Findings",
        "Modes",
        f"time of computation  {solution.stats['wall_time']:.3g} s",
    ):
        assert words in text, words
    frequency = model().linearize().modes().frequency[0]
    assert f"{frequency:.6g}" in text
    assert page.read_text(encoding="utf-8").count("<iframe") == 1
    curves = {curve["name"]: curve for chart in data_of(page)["charts"] for curve in chart["curves"]}
    name = model().q_names[0]
    stored = np.frombuffer(base64.b64decode(curves[name]["y"]), "<f4")
    np.testing.assert_array_equal(stored, solution.q[:, 0].astype("<f4"))
    assert np.frombuffer(base64.b64decode(curves[name]["x"]), "<f4")[-1] == np.float32(0.2)


def test_multipliers_are_no_outputs() -> None:
    """Multipliers have the names of their constraints and no unit, and reports draw neither them nor accelerations."""
    columns = {"t": np.zeros(2), "q.a": np.ones(2), "a.a": np.ones(2), "pin: origins meet along x": np.ones(2)}
    run = SimpleNamespace(
        columns=lambda: columns,
        units=lambda: {"q.a": "rad"},
        metadata={"names": {"multipliers": ["pin: origins meet along x"]}},
    )
    assert list(_columns_of(run)) == ["q.a"]


def test_runs_are_compared_by_settings_and_columns(tmp_path: Path) -> None:
    first, second = model().simulate(0.2, 1e-2), model().simulate(0.2, 1e-2, method="rk4")
    page = model().report(tmp_path / "report.html", [first, second])
    text = text_of(page)
    gap = np.abs(second.q[:, 0] - first.q[:, 0])
    assert "Settings that differ" in text and "rk4" in text and f"{np.max(gap):.3g}" in text
    together = [chart for chart in data_of(page)["charts"] if len(chart["curves"]) == 2]
    assert {curve["name"] for chart in together for curve in chart["curves"]} >= {"run 1", "run 2"}


def test_differences_are_taken_over_common_times() -> None:
    t = np.array([0.0, 1.0, 2.0])
    assert _difference(t, np.array([0.0, 1.0, 5.0]), t[:2], np.array([0.0, 3.0])) == ("2", "1", "2")
    assert _difference(t, np.zeros(3), t + 5.0, np.zeros(3)) == ("no common time", "", "")


def test_the_command_takes_scenes_and_folders_of_runs(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    for name, step in (("fine", 5e-3), ("coarse", 1e-2)):
        folder = tmp_path / "runs" / name
        folder.mkdir(parents=True)
        model().simulate(0.1, step).save(folder / "solution.npz")
    runner = CliRunner()
    done = runner.invoke(command, [str(tmp_path / "runs"), "--out", str(tmp_path / "runs.html")], standalone_mode=False)
    assert done.return_value == 0, done.exception
    text = text_of(tmp_path / "runs.html")
    assert "Plots of coarse" in text and "Plots of fine" in text and "Counts" not in text
    (tmp_path / "empty").mkdir()
    done = runner.invoke(command, [str(tmp_path / "empty"), "--out", str(tmp_path / "x.html")], standalone_mode=False)
    assert isinstance(done.exception, eomgen.UsageError)
    assert f"{tmp_path / 'empty'}: the folder holds no solution.npz, nor do folders in this folder" in str(
        done.exception
    )


@pytest.mark.long
@pytest.mark.slow
def test_the_command_runs_and_checks_a_scene_whose_text_is_in_the_page(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    words = [str(tmp_path / "scene.toml"), "--check", "--no-animation", "--out", str(tmp_path / "scene.html")]
    done = CliRunner().invoke(command, words, standalone_mode=False)
    assert done.return_value == 0, done.exception
    text = text_of(tmp_path / "scene.html")
    assert "all agree" in text and PENDULUM_TOML.strip() in text
    assert "<iframe" not in (tmp_path / "scene.html").read_text(encoding="utf-8")
