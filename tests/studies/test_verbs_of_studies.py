"""Commands of studies with results made by hand: what is asked, printed, written, and the exit codes."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.products import studies
from eomgen.products.studies import savings as saving
from eomgen.products.studies.identification import result as identified
from eomgen.products.studies.identification.estimation import Combination
from eomgen.products.studies.identification.result import Column, Estimate, Identification, Record
from eomgen.products.studies.ladders import result as mapped
from eomgen.products.studies.ladders.result import Cell, Extremes
from eomgen.products.studies.savings import Savings, VariantCost
from eomgen.products.studies.tuning.judge import VerificationRun
from eomgen.products.studies.tuning.result import RacedMethod, Tuned
from eomgen.products.studies.verification.report import CheckReport, Disagreement, FormReport
from eomgen.products.studies.work_precision import result as compared
from eomgen.products.studies.work_precision.axes import Configuration
from eomgen.products.studies.work_precision.result import Tradeoff
from tests.models import library
from tests.models.library import scene_file

Ask = Callable[..., dict[str, Any]]


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    inputs = {"push": {"unit": "N"}}
    parameters = {"length": {"value": 0.5, "unit": "m", "tunable": True}}
    efforts = {"motor": {"joint": "hinge", "effort": "push * length"}}
    return str(scene_file(tmp_path, "pendulum", inputs=inputs, parameters=parameters, efforts=efforts))


@pytest.fixture
def answered(monkeypatch: pytest.MonkeyPatch) -> Callable[[str, Any], list[tuple[Any, ...]]]:
    """Let a study answer with a result; its arguments are kept."""

    def answer(name: str, result: Any) -> list[tuple[Any, ...]]:
        asked: list[tuple[Any, ...]] = []
        module = saving if name == "savings" else studies

        @wraps(getattr(module, name))
        def study(*given: Any, **options: Any) -> Any:
            asked.append((*given, options))
            return result

        monkeypatch.setattr(module, name, study, raising=False)
        return asked

    return answer


# -- identify ----------------------------------------------------------------------------------------------------------


def identification(**changes: Any) -> Identification:
    t = np.array([0.0, 0.5, 1.0])
    record = Record(
        "run", t, {"x": np.array([1.0, np.nan, 3.0]), "y": np.array([4.0, 5.0, 6.0])},
        {"x": np.array([0.5, 2.0, 3.5]), "y": np.array([4.0, 5.0, 7.0])}, {"q": np.array([0.25])},
    )  # fmt: skip
    estimates = (
        Estimate("length", "m", 0.5, 0.01, 0.48, 0.52, 1e-4, 0.4, "determined"),
        Estimate("mass", "kg", 2.0, math.inf, -math.inf, math.inf, 0.0, 2.0, "undetermined"),
        Estimate("q.hinge", "rad", 0.25, 0.02, 0.21, 0.29, 0.0, 0.0, "determined"),
    )
    combination = Combination("mass / length", ("mass", "length"), "product", 4.0, 0.08, 3.8, 4.2)
    columns = (Column("x", "m", 2, 0.5, 0.5, -0.25), Column("y", "", 3, 0.1, 0.578125, 0.125))
    given = {
        "scene": "pendulum", "estimates": estimates, "correlation": np.eye(3), "combinations": (combination,),
        "columns": columns, "records": (record,), "confidence": 0.9, "noise": "given", "degrees_of_freedom": 3,
        "runs": 7, "failed": 1, "notes": ("only mass / length is determined",),
    } | changes  # fmt: skip  # a table
    return Identification(**given)


def test_identify_asks_for_what_its_options_say(
    scene: str, answered: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = answered("identify", identification())
    builds: list[tuple[Any, ...]] = []
    monkeypatch.setattr(
        "eomgen.pipeline.pipeline.build_for_run", lambda *of, **more: builds.append((*of, more)) or "model"
    )
    words = [
        "identify",
        scene,
        "--data",
        "a.csv",
        "--data",
        "b.csv",
        "--parameters",
        "length,mass",
        "--states",
        "q.hinge",
    ]
    words += ["--set", "length=40 cm", "--bounds", "length=0.1:", "--bounds", "mass=:3", "--deviation", "angle=1 deg"]
    words += ["--step", "10 ms", "--confidence", "0.9", "--t-start", "0", "--missing", "drop", "--method", "hht"]
    assert main(words) == 0
    (model, data, unknown, options), told = asked[0], capsys.readouterr()
    assert (model, data, list(unknown)) == ("model", ["a.csv", "b.csv"], ["length", "mass"])
    assert list(options.pop("states")) == ["q.hinge"]
    assert options == {
        "values": {"length": 0.4}, "bounds": {"length": (0.1, math.inf), "mass": (-math.inf, 3.0)}, "by": "run",
        "deviations": {"angle": pytest.approx(math.pi / 180.0)}, "step": 0.01, "confidence": 0.9, "t_start": 0.0,
        "missing": "drop", "method": "hht",
    }  # fmt: skip  # a table
    assert builds[0][1] == "hht" and "profile" in builds[0][2]
    lines = [line.split() for line in told.out.splitlines()]
    assert ["length", "0.5", "m", "0.48", "0.52", "0.4", "determined"] in lines
    assert ["mass", "/", "length", "4", "3.8", "4.2", "product"] in lines
    assert ["x", "2", "0.5", "0.5", "m", "-0.25"] in lines and ["y", "3", "0.1", "0.5781", "0.125"] in lines
    assert "90 % from" in told.out and "deviation, given" in told.out
    assert "2 of 3 unknowns determined by 5 samples, 7 runs; only mass / length is determined" in told.err


def test_identify_writes_files_and_refuses_bounds(
    scene: str, answered: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    answered("identify", identification(combinations=()))
    monkeypatch.setattr("eomgen.pipeline.pipeline.build_for_run", lambda *of, **more: None)
    monkeypatch.setattr(identified, "save_figure", lambda figure, path: path)
    words = ["identify", scene, "--data", "a.csv", "--parameters", "length", "--out", "out"]
    assert main(words) == 0
    told = capsys.readouterr()
    names = "identification.json, estimates.csv, residuals_run.csv, fit_run.png"
    assert f"written to out: {names}" in told.err and "combination" not in told.out
    assert main([*words, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["files"] == names.split(", ") and data["folder"] == "out" and data["initial"] == {"run": {"q": [0.25]}}
    for bounds in ("length", "=1:2", "length=a:2", "length=1"):
        assert main([*words, "--bounds", bounds]) == 2
        assert f"--bounds {bounds}: a name and two numbers are needed" in capsys.readouterr().err


def test_files_of_an_identification_have_estimates_and_residuals(tmp_path: Path) -> None:
    found = identification()
    assert found["length"].value == 0.5 and found.parameters == {"length": 0.5, "mass": 2.0}
    files = found.save(tmp_path / "new")
    assert [file.name for file in files] == ["identification.json", "estimates.csv", "residuals_run.csv"]
    data = json.loads(files[0].read_text(encoding="utf-8"))
    assert data["estimates"][1]["high"] is None and data["combinations"][0]["members"] == ["mass", "length"]
    assert (data["confidence"], data["noise"], data["degrees_of_freedom"]) == (0.9, "given", 3)
    assert (data["runs"], data["failed"], data["message"]) == (7, 1, found.message)
    rows = list(csv.DictReader(files[1].open(encoding="utf-8")))
    assert [(row["name"], row["value"], row["state"]) for row in rows] == [
        ("length", "0.5", "determined"), ("mass", "2.0", "undetermined"), ("q.hinge", "0.25", "determined"),
        ("mass / length", "4.0", "product"),
    ]  # fmt: skip
    assert (rows[0]["low"], rows[0]["bias"], rows[3]["deviation"], rows[3]["start"]) == ("0.48", "0.0001", "0.08", "")
    rows = list(csv.DictReader(files[2].open(encoding="utf-8")))
    assert list(rows[0]) == ["t", "x", "x.model", "x.residual", "y", "y.model", "y.residual"]
    assert [float(rows[0][name]) for name in rows[0]] == [0.0, 1.0, 0.5, 0.5, 4.0, 4.0, 0.0]


def test_fits_are_drawn_with_residuals_in_standard_deviations(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    figures: list[Any] = []
    monkeypatch.setattr(identified, "save_figure", lambda figure, path: figures.append(figure) or path)
    assert [path.name for path in identification().plot(tmp_path)] == ["fit_run.png"]
    (x, left, y, _) = figures[0].axes
    assert x.get_lines()[0].get_ydata()[[0, 2]].tolist() == [1.0, 3.0]
    assert x.get_lines()[1].get_ydata().tolist() == [0.5, 2.0, 3.5]
    assert left.get_lines()[0].get_ydata()[[0, 2]].tolist() == [1.0, -1.0] and left.get_ylim() == pytest.approx(
        (-3.3, 3.3)
    )
    assert figures[0].axes[3].get_lines()[0].get_ydata().tolist() == pytest.approx([0.0, 0.0, -10.0])
    assert (
        figures[0].axes[3].get_ylim() == pytest.approx((-11.0, 11.0)) and "data - model, by 0.5 m" in left.get_ylabel()
    )
    assert (x.get_ylabel(), y.get_ylabel(), y.get_xlabel()) == ("x, m", "y", "time, s")
    assert x.get_title() == "pendulum: run"


# -- check, savings ----------------------------------------------------------------------------------------------------


def report(*forms: FormReport, **more: Any) -> CheckReport:
    return CheckReport("pendulum", ("a", "b"), 3, forms, **more)


FINE = FormReport("mass.M", "d2 T / dv2", "f", "agrees", 1.5e-9, 1e-4, 2.0, 3e-15, 4e-16, "other", remarks=("kink",))
WRONG = FormReport("tau", "sum", "f", "FAILS", worst=Disagreement("a", "row", 1.0, 2.0, "other", 1e-3))


@pytest.mark.parametrize(
    ("forms", "more", "code", "told"),
    [
        (
            (FINE,),
            {"corners": ("abs in x",)},
            0,
            ["kink: mass.M", "not smooth everywhere: abs in x", "all agree where"],
        ),
        ((FINE, WRONG), {}, 6, ["tau FAILS: row: 1, but 2 by other (known to 0.001), at a", "1 of 2 closed forms not"]),
        ((replace(FINE, verdict="undecided"),), {}, 6, ["mass.M cannot be decided: another derivation, such as"]),
        ((replace(FINE, verdict="no state"),), {}, 6, ["mass.M was not checked: no state where it is finite"]),
        ((FINE,), {"unchecked": ("tau",)}, 130, ["interrupted: 1 closed forms agree, and 1 are not checked"]),
        ((FINE, WRONG), {"unchecked": ("h",)}, 6, ["tau FAILS"]),
        ((FINE,), {"notes": ("left out: b",)}, 0, ["left out: b"]),
    ],
)
def test_check_ends_by_its_verdicts(
    forms: tuple[FormReport, ...], more: dict[str, Any], code: int, told: list[str], scene: str, answered: Any,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    asked = answered("check", report(*forms, **more))
    assert main(["check", scene, "--states", "5", "--seed", "7", "--only", "mass"]) == code
    options = asked[0][1]
    assert (options["states"], options["seed"], list(options["only"])) == (5, 7, ["mass"])
    printed = capsys.readouterr()
    assert all(text in printed.err for text in told)
    row = next(line.split() for line in printed.out.splitlines() if line.strip().startswith("mass.M"))
    assert row[1:9] == ["d2", "T", "/", "dv2", "1.5e-09", "1.0e-04", "2.00", "3.0e-15"] and row[9] == "4.0e-16"
    assert f"pendulum: {len(forms)} closed form{'s' * (len(forms) > 1)} at 2 states" in printed.out
    assert main(["check", scene, "--json", "--out", "out"]) == code
    printed = capsys.readouterr()
    assert json.loads(printed.out)["passed"] is (code == 0) and "written: out/check.json, out/check.csv" in printed.err


def test_savings_prints_costs_and_writes_files(scene: str, answered: Any, capsys: pytest.CaptureFixture[str]) -> None:
    costs = (
        VariantCost("as asked", "", {"residual": 10}, 10, 1000, 2.0, 1e-6, 4e-6),
        VariantCost("more", "", {"residual": 25}, 25, 1500, 3.0, 3e-6, 4e-6, problem="odd"),
    )
    study = Savings("pendulum", "rk4", 0.01, costs, "friction is passed over")
    asked = answered("savings", study)
    assert main(["savings", scene, "--rounds", "3", "--only", "more", "--method", "rk4", "--out", "out"]) == 0
    options, printed = asked[0][1], capsys.readouterr()
    assert (options["rounds"], list(options["only"]), options["method"]) == (3, ["more"], "rk4")
    table = {line.split()[0]: line.split() for line in printed.out.splitlines() if line.strip()}
    assert table["more"][1:7] == ["25", "2.50", "1.5", "1.50", "3", "1.5"] and table["residual"][1:] == ["10", "25"]
    assert "friction is passed over" in printed.out and "more: odd" in printed.out
    assert "pendulum, rk4, step 0.01 s" in printed.out and "written: out/savings.csv, out/savings.json" in printed.err
    answered("savings", replace(study, costs=(replace(costs[1], problem="interrupted before it was built"),)))
    assert main(["savings", scene, "--json"]) == 130
    assert json.loads(capsys.readouterr().out)["doubt"] == "friction is passed over"


# -- tradeoff, tune, extremes ------------------------------------------------------------------------------------------


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compared, "draw", lambda study, path: path)
    monkeypatch.setattr(mapped, "draw", lambda scene, cells, path: path)


@pytest.mark.usefixtures("undrawn")
def test_tradeoff_asks_and_tells(scene: str, answered: Any, capsys: pytest.CaptureFixture[str]) -> None:
    known = {"by": "a", "held against": "b", "uncertainty": {}}
    found = Tradeoff("pendulum", "q", "rms", (0.0, 2.0, 8), (), known, {"processor": "p", "compiler": "c"})
    asked = answered("tradeoff", found)
    words = ["tradeoff", scene, "--out", "out", "--output", "angle", "--output", "q", "--measure", "rms", "--axes"]
    words += ["method,policy", "--methods", "rk4,hht", "--steps", "0.02,,0.01", "--budget", "9", "--repeats", "3"]
    words += ["--set", "length=40 cm", "--input", "push=2 kN", "--t-end", "2 s"]
    assert main(words) == 0
    options = asked[0][1]
    wanted = {"outputs": ["angle", "q"], "measure": "rms", "axes": ["method", "policy"], "methods": ["rk4", "hht"],
              "steps": [0.02, 0.01], "budget": 9.0, "repeats": 3, "parameters": {"length": 0.4},
              "inputs": {"push": 2000.0}, "t_end": 2.0, "folder": "out", "resume": False}  # fmt: skip
    assert {
        name: list(options[name]) if isinstance(options[name], tuple) else options[name] for name in wanted
    } == wanted
    printed = capsys.readouterr()
    assert "pendulum: rms error of q, 2 s" in printed.out and printed.out.count("none meets it") == 4
    assert "reference: a, known to 0.0e+00 by b" in printed.err
    assert "written to out: tradeoff.json, tradeoff.csv, tradeoff.png" in printed.err
    assert main([*words[:4], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["quantity"] == "q" and asked[1][1]["parameters"] is None
    assert main([*words[:4], "--steps", "fast"]) == 2
    assert "--steps fast: these are not numbers of seconds; try: --steps 1e-3,5e-4" in capsys.readouterr().err


def tuned(**changes: Any) -> Tuned:
    given = {
        "scene": "pendulum", "quantity": "angle", "measure": "largest", "demand": 1e-4, "kind": "step", "value": 0.01,
        "configuration": Configuration("joint", "rk4"), "error": 5e-5, "seconds": 2e-3, "span": 2.0, "steps": 200.0,
        "rivals": (RacedMethod("hht, joint", 3e-3, True), RacedMethod("rk45, joint", 4e-3, False)), "next_digit": 1.78,
        "own": ("rk4, step 0.1 s", 1e-3, 1e-3), "said": "", "simulation": {"method": "rk4", "step": 0.01},
        "verified": (VerificationRun("1: moved", 6e-5, 1e-7, "taylor"),), "written": (5e-5, 2e-3), "coordinates": "",
        "group": "", "machine": {"processor": "p", "compiler": "c"}, "spent": (3.0, 9), "built": 4.0,
    } | changes  # fmt: skip  # a table
    return Tuned(**given)


def test_one_line_says_why() -> None:
    assert tuned().why == (
        "rk4, joint, step 0.01 s meets 0.0001 in 2 ms for 2 s of motion; hht, joint takes 1.5 x; one digit more costs"
        " 1.78 x; measured on p, c"
    )
    missed = tuned(verified=(VerificationRun("a", 2e-4, 0.0, ""), VerificationRun("b", 3e-4, 0.0, "")), rivals=())
    assert not missed.met and "; verification runs miss it, by an error of 0.0003; one digit" in missed.why
    alone = tuned(verified=(), rivals=tuned().rivals[1:], next_digit=0.0)
    assert alone.met and alone.why.endswith(
        "; no other run has a reference to verify it; rk45, joint would take 2 x; measured on p, c"
    )
    data = tuned().to_dict()
    assert data["own"] == {"settings": "rk4, step 0.1 s", "error": 1e-3, "seconds": 1e-3}
    assert data["written"] == {"error": 5e-5, "seconds": 2e-3}
    assert data["spent"] == {"seconds": 3.0, "runs": 9, "building": 4.0} and data["method"] == "rk4" and data["met"]
    assert data["rivals"][1] == {"label": "rk45, joint", "seconds": 4e-3, "measured": False}
    assert data["verified"][0]["uncertainty"] == 1e-7 and data["why"] == tuned().why


def test_tune_asks_tells_and_writes(scene: str, answered: Any, capsys: pytest.CaptureFixture[str]) -> None:
    asked = answered("tune", tuned(source=Path(library.__file__).with_name("pendulum.toml")))
    words = f"tune {scene} --error 1e-4 --output angle --methods rk4 --axes method --t-end 2".split()
    code = main([*words, "--set", "length=40 cm", "--out", "made/tuned.toml"])
    assert code == 0, capsys.readouterr()
    options, printed = asked[0][1], capsys.readouterr()
    assert (options["error"], options["output"], list(options["methods"]), options["t_end"]) == (
        1e-4,
        "angle",
        ["rk4"],
        2.0,
    )
    assert (list(options["axes"]), options["parameters"], options["inputs"]) == (["method"], {"length": 0.4}, None)
    assert tuned().why in printed.err and "written: made/tuned.toml" in printed.err and "cheapest" in printed.out
    assert eomgen.load("made/tuned.toml").simulation.method == "rk4"
    answered("tune", tuned(verified=(VerificationRun("a", 2e-4, 0.0, ""),)))
    assert main([*words, "--json"]) == 6
    assert json.loads(capsys.readouterr().out)["met"] is False
    with pytest.raises(eomgen.UsageError, match="the chosen scene has less fidelity, rigid, which is not written"):
        tuned(simplified="rigid").save("tuned.toml")


@pytest.mark.usefixtures("undrawn")
def test_extremes_ends_by_its_fails(scene: str, answered: Any, capsys: pytest.CaptureFixture[str]) -> None:
    fine = Cell("step", 1.0, "rk4", "holds", 1e-5, 1e-6, 0.01, "", "taylor", 0.5)
    wrong = replace(fine, value=2.0, verdict="fails", error=0.25, said="odd")
    left = {"float": "no floats", **{f"step:{k}:hht": "the budget is spent" for k in range(9)}}
    asked = answered("extremes", Extremes("pendulum", scene, (fine, wrong), left, 1.5, 2.5))
    assert (
        main(["extremes", scene, "--ladders", "step,float", "--methods", "rk4", "--budget", "9", "--limit", "2"]) == 6
    )
    options, printed = asked[0][1], capsys.readouterr()
    assert (list(options["ladders"]), list(options["methods"]), options["budget"], options["limit"]) == (
        ["step", "float"], ["rk4"], 9.0, 2.0
    )  # fmt: skip
    assert (
        f"fails: step:2:rk4 is wrong by 25 % of its motion, and says: odd; eomgen extremes {scene} --cell step:2:rk4"
        in " ".join(printed.err.split())
    )
    assert "left out: float: no floats" in printed.err and "left out: 9 cells: the budget is spent" in printed.err
    assert "pendulum: 2 cells in 2 s" in printed.out
    answered("extremes", Extremes("pendulum", scene, (fine, replace(wrong, error=None, said="")), {}, 1.5, 2.5))
    assert main(["extremes", scene, "--cell", "step:1:rk4", "--json"]) == 6
    printed = capsys.readouterr()
    assert "fails: step:2:rk4; eomgen extremes" in " ".join(printed.err.split())
    assert json.loads(printed.out)["shortest_period"] == 1.5
    answered("extremes", Extremes("pendulum", scene, (fine,)))
    assert main(["extremes", scene, "--cell", "step:1:rk4", "--out", "out"]) == 0
    printed = capsys.readouterr()
    assert "step:1:rk4" in printed.out and "written to out: extremes.csv, extremes.json, extremes.png" in printed.err
