"""``eomgen check`` on the command line: its table, its JSON, its files and what it says of formulas that are not
smooth."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from eomgen.cli import main
from tests.models.scenes import PENDULUM_TOML


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML, encoding="utf-8")
    return path


@pytest.mark.slow
def test_check_prints_a_table_and_writes_files(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(scene_file), "--states", "3", "--only", "partials", "--out", str(tmp_path / "out")]) == 0
    output = capsys.readouterr()
    lines = output.out.splitlines()
    assert lines[0].strip() == "shaken: 3 closed forms at 3 states"
    heads = "closed form is differences at step slope complex step second derivation verdict"
    assert " ".join(lines[1].split()) == heads
    row = next(line.split() for line in lines if line.startswith("partials.K"))
    assert row[1:5] == ["d", "residual", "/", "dq"] and float(row[5]) < 1e-8 and float(row[6]) < 1e-3
    assert 1.9 < float(row[7]) < 2.1 and float(row[8]) < 1e-13 and row[-1] == "agrees"
    assert output.err.splitlines()[0] == "all agree" and "check.png" in output.err
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"check.json", "check.csv", "check.png"}


def test_check_prints_json(scene_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(scene_file), "--states", "2", "--seed", "5", "--only", "partials.C", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["scene"] == "shaken" and data["passed"] is True and data["seed"] == 5 and len(data["states"]) == 2
    (form,) = data["forms"]
    assert form["name"] == "partials.C" and form["verdict"] == "agrees" and len(form["errors"]) == len(data["ladder"])


@pytest.mark.slow
def test_check_says_where_formulas_are_not_smooth(scene_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = PENDULUM_TOML.replace('effort = "torque"', 'effort = "torque - 0.1 * abs(q.hinge - 0.4)"')
    assert text != PENDULUM_TOML
    scene_file.write_text(text, encoding="utf-8")
    assert main(["check", str(scene_file), "--states", "1", "--only", "partials"]) == 0
    assert "not smooth at initial state (abs in effort motor): partials.K" in capsys.readouterr().err


SLIDERS = """
format = 1
name = "sliders"
[bodies]
cart = { mass = 1.0 }
lift = { mass = 0.5 }
[joints]
along = { type = "prismatic", parent = "base", child = "cart", axis = [1, 0, 0], initial = { position = 0.3 } }
up = { type = "prismatic", parent = "base", child = "lift", axis = [0, 0, 1], initial = { position = 0.4 } }
[constraints]
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("row", "absent"),
    [
        ('ramp = { type = "point_on_line", first = { body = "cart", axis = [1, 0, 1] }, second.body = "lift" }', "KCZ"),
        ('rod = { type = "distance", first = { body = "cart" }, second = { body = "lift" }, length = 0.5 }', "C"),
    ],
    ids=["straight rail", "rod"],
)
def test_scenes_whose_equations_lack_coordinates_or_velocities(
    row: str, absent: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Blocks of the iteration matrix that are empty are checked to be zero."""
    path = tmp_path / "scene.toml"
    path.write_text(SLIDERS + row, encoding="utf-8")
    assert main(["check", str(path), "--states", "2", "--only", "iteration", "--json"]) == 0
    verdicts = {form["name"]: form["verdict"] for form in json.loads(capsys.readouterr().out)["forms"]}
    assert {f"iteration.{name}" for name in absent} <= set(verdicts)
    assert set(verdicts.values()) == {"agrees"}
