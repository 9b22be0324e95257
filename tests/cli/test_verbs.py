"""Every verb through the same door as the user's: what it prints where, what it writes, and its exit code."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.cli import VERBS, main
from tests.models.library import scene_file as written_scene
from tests.models.scenes import INERTIA, LENGTH, MASS, PENDULUM_TOML
from tests.models.toml_text import toml_text


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML, encoding="utf-8")
    return path


def test_help_lists_every_verb_and_each_has_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    assert all(f"  {verb} " in text for verb in VERBS)
    for verb in VERBS:
        assert main([verb, "--help"]) == 0
        assert f"Usage: eomgen {verb}" in capsys.readouterr().out
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"eomgen {eomgen.__version__}\n"


@pytest.mark.slow
def test_simulate_says_what_the_constraints_made_of_the_start(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A link of 1 m from the end of another one to the floor: 0.6 rad up means 0.6 rad down, so -1.2 rad, at twice the
    rate."""
    ends = {"first": {"body": "base", "axis": [1, 0, 0]}, "second": {"body": "lower", "position": [1, 0, 0]}}
    floor = {"constraints__floor": {"type": "point_on_line", **ends}, "joints__elbow__initial": None}
    start = {"joints__shoulder__initial": {"position": 0.6, "velocity": 1}, "joints__elbow__position": [1, 0, 0]}
    path = written_scene(tmp_path, "double_pendulum", events=None, points=None, simulation=None, **floor, **start)
    run = ["simulate", str(path), "--step", "1e-3", "--t-end", "0.01", "--out", str(tmp_path / "out"), "--no-plots"]
    assert main([*run, "--json"]) == 0
    (told,) = json.loads(capsys.readouterr().out)["corrections"]
    assert told.startswith("corrected onto the constraints: ") and "q.shoulder 0.6 -> " in told
    assert re.search(r"; try: hold = true to keep (q\.shoulder, v\.shoulder|v\.shoulder, q\.shoulder)$", told), told
    assert main(run) == 0
    assert " ".join(capsys.readouterr().out.split()).count(told) == 1
    assert main([*run, "--initial", "shoulder=0.7"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "initial values given corrected onto the constraints: " in said and "q.shoulder 0.7 -> " in said
    for kind in "qv":
        end = dict(re.findall(rf"{kind}\.(\w+) \S+ -> (\S+) rad", told))
        assert float(end["elbow"]) == pytest.approx(-2.0 * float(end["shoulder"]), rel=1e-3)


def test_info_prints_a_table_or_json(scene_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(scene_file)]) == 0
    table = capsys.readouterr().out
    assert "shaken: 1 degree of freedom, 1 body, 1 input\n" in table
    assert "Exact operation counts, and cycles of the critical path" in table
    assert "forward_dynamics" in table and "rotation of the base" in table
    assert main(["info", str(scene_file), "--json", "--terms", "mass"]) == 0
    data = json.loads(capsys.readouterr().out)
    system = eomgen.derive(scene_file, terms=["mass"])
    assert data["sizes"] == {"nq": 1, "nv": 1, "nu": 1, "nz": 0, "bodies": 1}
    assert data["groups"] == [{"joint": "hinge", "group": "R", "nq": 1, "nv": 1}]
    assert data["functions"]["mass"]["counts"]["flops"] == system.counts["mass"].flops
    assert data["functions"]["mass"]["critical_path"] == system.critical_paths["mass"] > 0
    assert "forward_dynamics" not in data["functions"]


def test_info_lists_curves_and_known_jumps(scene_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wave = '[inputs.push]\nwave = { shape = "square", period = 2, start = 0.5 }\n'
    bump = '[curves.hump]\nbump = { length = 0.5, height = 0.1 }\n[inputs.road]\nformula = "hump(2 * t - 3)"\n'
    scene_file.write_text(PENDULUM_TOML + "\n" + wave + bump, encoding="utf-8")
    assert main(["info", str(scene_file)]) == 0
    table = capsys.readouterr().out
    assert "Curves, arguments and values in SI units" in table
    assert re.search(r"^name +value +unit *$", table, re.MULTILINE) and re.search(
        r"^length +0\.\d+ +m *$", table, re.MULTILINE
    )
    assert "inputs.push: 3 points from 0.5 to 2.5, steps, outside periodic" in table
    assert "t = 0.5 s and every 2 s: forces jump" in table and "t = 1.75 s: derivatives of order 2 jump" in table
    assert main(["info", str(scene_file), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["parameter_units"]["length"] == "m"
    assert data["curves"][0] == "hump: a bump 0.1 high over 0.5 from 0" and len(data["jumps"]) == 4


def test_info_lists_base_parameters(scene_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(scene_file), "--base-parameters", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["base_parameters"]
    names = [f"link.{name}" for name in ("first_moment_x", "first_moment_z", "inertia_yy")]
    assert [row["combination"] for row in found["combinations"]] == [*names, "hinge.damping"]
    assert [row["unit"] for row in found["combinations"]] == ["kg m", "kg m", "kg m^2", "N m s/rad"]
    assert found["combinations"][2]["value"] == pytest.approx(MASS * LENGTH**2 + INERTIA, rel=1e-12)
    assert found["of"] == 11 and "link.mass" in found["without_effect"]
    assert main(["info", str(scene_file), "--base-parameters"]) == 0
    printed = capsys.readouterr().out
    assert "Base parameters: 4 combinations of 11" in printed and "Without effect: link.mass, " in printed


def test_info_of_constrained_scenes_counts_rows(scene_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(scene_file), "--coordinates", "absolute"]) == 0
    table = capsys.readouterr().out
    head = "shaken: 6 velocities, 5 constraint rows, 1 degree of freedom if the rows are independent; 1 body, 1 input\n"
    assert head in table
    names = eomgen.derive(eomgen.load(scene_file, coordinates="absolute"), terms=["constraint_jacobian"]).multipliers
    assert len(names) == 5 and names[0] == "hinge: origins meet along x"
    assert re.search(r"\nhinge +5 +origins meet along x, .*stays perpendicular to x", table)
    assert main(["info", str(scene_file), "--coordinates", "absolute", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["degrees_of_freedom"] == 1 and data["constraints"] == list(names)


@pytest.mark.slow
def test_simulate_writes_everything_and_says_where(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    words = ["simulate", str(scene_file), "--out", str(out), "--t-end", "0.5", "--step", "0.002", "--rho-inf", "0.9"]
    assert main([*words, "--set", "length=0.7", "--input", "torque=0.1", "--record-every", "5"]) == 0
    captured = capsys.readouterr()
    assert (
        re.search(r"parameter length +0\.7 m, in the scene 0\.5 *\n", captured.out)
        and "parameter shake" not in captured.out
    )
    assert re.search(r"input torque +0\.1 N m, constant *\n", captured.out)
    error = r"\d\S* rad of q\.hinge at t = 0\.\d+ s, \S+ % of its motion"
    how = r"order \d\.\d\d of 2, by runs at 2 and 4 times the step, in \S+ s"
    assert re.search(rf"estimated error +{error} *\n +{how}", captured.out)
    assert "q.hinge at the end" in captured.out and "reached t = 0.5 s in 250 steps" in captured.err
    assert str(out) in captured.err and str(out) not in captured.out
    plots = {"coordinates.png", "velocities.png", "outputs.png", "energy.png"}
    names = {"solution.npz", "solution.csv", "summary.json", *plots}
    assert {file.name for file in out.iterdir()} == names
    solution = eomgen.Solution.load(out / "solution.npz")
    direct = eomgen.build(scene_file).simulate(
        0.5, 0.002, rho_inf=0.9, parameters={"length": 0.7}, inputs={"torque": 0.1}, record_every=5
    )
    np.testing.assert_array_equal(solution.q, direct.q)
    with (out / "solution.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 51 and float(rows[-1]["q.hinge"]) == solution.q[-1, 0]
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["success"] and summary["scene"] == "shaken" and summary["parameters"]["length"] == 0.7
    assert set(summary["files"]) == names
    assert summary["error"]["available"] and summary["error"]["q"] == pytest.approx(
        solution.error.q.tolist(), rel=1e-12
    )
    assert all((out / file).read_bytes().startswith(b"\x89PNG") for file in plots)


@pytest.mark.slow
def test_the_table_has_steps_of_its_own_apart_from_rows_and_errors_of_outputs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fast = {"joints__fast__child": "fast", "joints__fast__initial": {"position": 1e-7}, "bodies__fast": {"mass": 1.0}}
    more = {"outputs": {"pull": {"formula": "1e7 * q.fast", "unit": "N"}}, "simulation": None}
    more |= {"events": {"half": {"when": "t - 0.5", "action": "stop"}}, "joints__slide__initial": {"position": 1.0}}
    of_fast = {"type": "prismatic", "parent": "base", "axis": [1, 0, 0], "stiffness": 1e7}
    scene = written_scene(tmp_path, "oscillator", joints__slide__stiffness=1.0, joints__fast=of_fast, **fast, **more)
    words = ["simulate", str(scene), "--no-plots", "--t-end", "1", "--step", "0.01"]
    assert main([*words, "--out", str(tmp_path / "own"), "--tolerance", "1e-3", "--json"]) == 0
    stats = json.loads(capsys.readouterr().out)["stats"]
    assert main([*words, "--out", str(tmp_path / "own"), "--tolerance", "1e-3"]) == 0
    shown = capsys.readouterr()
    assert re.search(rf"^steps +{stats['own_steps']} of its own", shown.out, re.MULTILINE) and "51 rows" in shown.out
    assert f"({stats['own_steps']} of its own, {stats['rejections']} taken again)" in shown.err
    assert main([*words, "--out", str(tmp_path / "fixed")]) == 0
    shown = capsys.readouterr()
    assert re.search(r"^ +[\d.e+]+ N of output pull at t = [\d.]+ s, \d+ % of its range", shown.out, re.MULTILINE)
    assert re.search(r"^not in it +the start excites a motion of v\.fast at 503 Hz", shown.out, re.MULTILINE)
    summary = json.loads((tmp_path / "fixed" / "summary.json").read_text(encoding="utf-8"))
    assert summary["error"]["unresolved"] in shown.err and summary["error"]["largest_output"]["name"] == "output pull"


@pytest.mark.slow
def test_a_linear_model_without_free_motion_is_a_result(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    driven = written_scene(tmp_path, "pendulum", joints__hinge__initial=None, joints__hinge__drive="0.3 * t")
    assert main(["linearize", str(driven), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["v"], told["coordinates"], told["modes"]) == ([0.3], [], [])


@pytest.mark.slow
def test_long_tables_end_with_what_is_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """42 masses of 1 kg on springs of 981 N/m: they hang at -10 mm, and swing from 0 to -20 mm."""
    names = [f"m{k}" for k in range(42)]
    hung = {"type": "prismatic", "parent": "base", "axis": [0, 0, 1], "stiffness": 981.0}
    events = {"turn": {"when": "v.m0"}, "once": {"when": "t - 0.15"}, "never": {"when": "q.m0 - 1"}}
    data = {
        "format": 1, "name": "weights", "joints": {name: {**hung, "child": name} for name in names}, "events": events,
        "bodies": {name: {"mass": 1.0} for name in names}, "simulation": {"method": "rk4", "step": 0.002},
    }  # fmt: skip  # a scene
    (tmp_path / "weights.toml").write_text(toml_text(data), encoding="utf-8")
    words = [str(tmp_path / "weights.toml"), "--profile", "instant", "--out"]
    assert main(["equilibrium", *words, str(tmp_path / "new" / "rest.json")]) == 0
    told = capsys.readouterr()
    assert len(re.findall(r"^q\.m\d+ +-0\.01 +m *$", told.out, re.MULTILINE)) == 40 and "2 more with --all" in told.err
    rest = json.loads((tmp_path / "new" / "rest.json").read_text())["q"]
    assert rest == pytest.approx({f"q.{name}": -0.01 for name in names})
    assert main(["simulate", *words, str(tmp_path / "run"), "--no-plots", "--t-end", "0.35", "--timing"]) == 0
    told_rows = " ".join(capsys.readouterr().out.split())
    turns = re.search(r"event turn 3 times, the first at t = (\S+) s, the last at t = (\S+) s", told_rows)
    assert turns and [*map(float, turns.groups())] == pytest.approx(np.array([1, 3]) * np.pi / np.sqrt(981.0), rel=1e-6)
    assert "event never 0 times" in told_rows and "event once 1 time, t = 0.15 s" in told_rows
    assert "... 30 more in solution.csv" in told_rows
    rows = (tmp_path / "run" / "events.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 5 and len((tmp_path / "run" / "step_times.csv").read_text().splitlines()) >= 20_000
    assert main(["simulate", *words, str(tmp_path / "run"), "--over", "travel"]) == 2
    assert "--over travel: there is no output 'travel'" in capsys.readouterr().err
    assert main(["equilibrium", *words, "rest.csv"]) == 2
    assert "an equilibrium is written as a .json file" in capsys.readouterr().err


@pytest.mark.slow
def test_timing_repeats_the_run_step_by_step(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["simulate", str(scene_file), "--out", str(tmp_path / "out"), "--t-end", "0.5", "--no-plots", "--timing"]
    assert main([*words, "--json"]) == 0
    timing = json.loads(capsys.readouterr().out)["timing"]
    lines = (tmp_path / "out" / "step_times.csv").read_text(encoding="utf-8").splitlines()
    seconds = sorted(float(line) for line in lines[1:])
    assert (lines[0], len(seconds), timing["steps"]) == ("seconds", timing["steps"], len(seconds))
    assert len(seconds) >= 20_000
    assert timing["median"] == pytest.approx(np.median(seconds), rel=1e-6)
    assert timing["late"] == pytest.approx(seconds[int(np.ceil(0.9999 * (len(seconds) - 1)))], rel=1e-6)
    assert 0.0 < timing["median"] <= timing["late"] <= timing["longest"] == pytest.approx(seconds[-1], rel=1e-6)
    assert 0.0 < timing["call_median"] < timing["median"]
    assert timing["call_median"] <= timing["call_late"]


def test_doctor_reports_the_compiler(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["doctor", "--json"]) == 0
    checks = {check["name"]: check for check in json.loads(capsys.readouterr().out)}
    assert checks["compiler"]["ok"] and checks["numpy"]["ok"]
    assert main(["doctor", "--quiet"]) == 0
    assert "numpy" not in capsys.readouterr().out
    monkeypatch.setenv("CC", "no-such-compiler")
    assert main(["doctor"]) == 5
    captured = capsys.readouterr()
    assert "BROKEN" in captured.out and "models cannot be built: compiler" in captured.err
