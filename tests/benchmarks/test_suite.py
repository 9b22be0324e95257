"""The suite of benchmarks: who is timed, what is said of who is not, and the page; nothing here asserts a time."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.suite import __main__ as suite
from benchmarks.suite import contest, environments, figures, history, page
from benchmarks.suite.contest import Context, Entry
from benchmarks.suite.outcomes import Finding, Outcome, read
from benchmarks.suite.register import Comparison, Goal, Row

CONTEXT = Context(quick=False, here=True, shelf=Path(), rounds=3, core=0)
SCRIPT = Path(__file__).with_name("contestant.txt").read_text(encoding="utf-8")


def entry(folder: Path, name: str, before: str = "pass", results: str = "[1.0, 2.0]", **how: object) -> Entry:
    script = folder / f"{name}.py"
    words = {"work": 20_000, "packages": ["numpy"], **how}
    script.write_text(
        SCRIPT.format(folder=str(contest.CONTESTANTS), before=before, results=results, **words), encoding="utf-8"
    )
    return Entry(name, str(script), patience=60.0 if "sleep" not in before else 1.5)


@pytest.mark.long
def test_only_contestants_with_the_right_numbers_are_timed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(environments, "FOLDER", tmp_path)
    (tmp_path / "eomgen").mkdir()
    (tmp_path / "eomgen" / "installed.json").write_text(json.dumps({"no_such_peer>=2": "no wheel for this Python"}))
    entries = [
        entry(tmp_path, "right"),
        entry(tmp_path, "slower", work=200_000),
        entry(tmp_path, "wrong", results="[1.0, 2.1]"),
        entry(tmp_path, "not finite", results="[1.0, float('nan')]"),
        entry(tmp_path, "fewer", results="[1.0]"),
        entry(tmp_path, "missing", before="import no_such_peer"),
        entry(tmp_path, "raises", before="raise RuntimeError('singular matrix')"),
        entry(tmp_path, "ends", before="import os; os._exit(3)"),
        entry(tmp_path, "sleeps", before="import time; time.sleep(60)"),
    ]
    found = {one.name: one for one in contest.contest(CONTEXT, entries, 1e-9, reference=np.array([1.0, 2.0]))}
    assert {name: one.state for name, one in found.items()} == {
        "right": "measured",
        "slower": "measured",
        "wrong": "wrong",
        "not finite": "wrong",
        "fewer": "wrong",
        "missing": "missing",
        "raises": "failed",
        "ends": "failed",
        "sleeps": "failed",
    }
    assert found["right"].error == 0.0 and found["wrong"].error == pytest.approx(0.1)
    assert found["right"].versions == {"numpy": np.__version__} and found["right"].note == "told"
    assert found["missing"].note == "No module named 'no_such_peer'; no wheel for this Python"
    assert found["raises"].note == "RuntimeError: singular matrix"
    assert found["ends"].note == "the process ended with 3: it said nothing"
    assert found["sleeps"].note == "no answer within 1.5 s"
    assert all(one.value is None for one in found.values() if one.state != "measured")
    assert (found["slower"].value or 0.0) > 2.0 * (found["right"].value or 1.0)


@pytest.mark.slow
def test_a_reference_that_is_missing_gives_way_to_the_next(tmp_path: Path) -> None:
    references = [entry(tmp_path, "absent", before="import no_such_peer"), entry(tmp_path, "next", results="[3.0]")]
    told = entry(
        tmp_path, "reads", results="__import__('numpy').load(FILE)", before="global FILE; FILE = task['reference']"
    )
    other = entry(tmp_path, "other")
    found = contest.contest(dataclasses.replace(CONTEXT, quick=True), [told, other], 1e-9, reference=references)
    assert [(one.state, one.error) for one in found] == [("measured", 0.0), ("wrong", None)]


MACHINE = {
    "processor": "a processor", "family": "family 25, model 1", "vectors": "AVX2", "cores": 2, "load": 0.5,
    "system": "Linux 6", "compiler": "12.2.0", "python": "3.11.7", "date": "2026-11-22", "commit": "abcdef12",
    "time": 1,
}  # fmt: skip  # a table


def row(name: str, *comparisons: Comparison) -> Row:
    return Row(name, "Section", f"work of {name}", "step", "a closed form", lambda context: [], comparisons)


def finding(name: str, **seconds: float | Outcome) -> Finding:
    outcomes = [
        value if isinstance(value, Outcome) else Outcome(who, "measured", value, 0.1, 1e-12, "settings", {"pip": "1"})
        for who, value in seconds.items()
    ]
    return Finding(name, tuple(outcomes), MACHINE)


def test_the_page_names_what_is_lost_and_what_has_no_number(tmp_path: Path) -> None:
    rows = [
        row("won", Comparison("peer", 0.5, "never said", readme=True)),
        row("missed", Comparison("peer", 0.5, "its loads wait for memory")),
        row("slower", Comparison("peer")),
        row("absent", Comparison("peer", 0.9)),
        row("not_run", Comparison("peer", 0.9)),
        dataclasses.replace(row("alone"), goals=(Goal(1e-6, "its inputs"),)),
    ]
    absent = Outcome("peer", "missing", note="No module named 'peer'")
    found = {
        "won": finding("won", eomgen=2e-7, peer=1e-6),
        "missed": finding("missed", eomgen=6e-7, peer=1e-6, other=Outcome("other", "wrong", error=0.25)),
        "slower": finding("slower", eomgen=3.0, peer=1.5),
        "absent": finding("absent", eomgen=3.0, peer=absent),
        "alone": finding("alone", eomgen=1.5e-6),
    }
    text = page.page(found, rows)
    _, goals, lost, _, without = text.split("\n## ")
    assert "| work of won | peer | 200 ns | 1 us | 0.2 | 0.5 | met |" in goals
    assert "| work of missed | peer | 600 ns | 1 us | 0.6 | 0.5 | **lost** |" in goals
    assert "| work of absent | peer | 3 s | - | - | 0.9 | not measured |" in goals
    assert "| work of alone |  | 1.5 us | - | - | 1 us | **lost** |" in goals
    assert lost.splitlines()[2:5] == [
        "- work of missed, against peer: 0.6, goal 0.5. Its loads wait for memory.",
        "- work of slower, against peer: 2. What limits it has not been looked into.",
        "- work of alone: 1.5 us, goal 1 us. Its inputs.",
    ]
    assert without.splitlines()[2:] == [
        "- work of missed, other: wrong, off by 2e-01.",
        "- work of absent, peer: missing. No module named 'peer'.",
        "- work of not_run: not run.",
    ]
    assert page.readme_rows(found, rows).splitlines()[2:] == ["| work of won | 200 ns | peer: 1 us | 0.2 |"]
    assert (
        "AVX2), 2 cores, Linux 6, gcc 12.2.0, Python 3.11.7; date and commit: 2026-11-22 abcdef12 (load 0.5 to 0.5)"
        in text
    )
    for name, one in found.items():
        one.write(tmp_path)
        assert read(tmp_path)[name] == one
    [file] = figures.draw(found, rows, tmp_path)
    drawn = file.read_text(encoding="utf-8")
    assert all(label in drawn for label in (">work of won<", ">peer<", ">0.5<", ">1.67<", ">5<"))


def test_the_history_keeps_measurements_of_other_commits_and_replaces_equal_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results, file = tmp_path / "results", tmp_path / "history.csv"
    arguments = ["--folder", str(results), "--history", str(file)]
    assert history.main(arguments) == 1
    assert capsys.readouterr().err == f"{results} has no results; try: python -m benchmarks.suite\n"

    name = "mass_panda"
    first = finding(name, eomgen=2e-7, **{"Pinocchio > CasADi > C": 1e-6}, other=Outcome("other", "wrong", error=0.25))
    later = dataclasses.replace(
        finding(name, eomgen=1e-7), machine={**first.machine, "commit": "later", "time": first.machine["time"] + 60}
    )
    quick = dataclasses.replace(finding("chain_call", eomgen=1.0), quick=True)
    for measured in (first, quick, finding(name, eomgen=3e-7, **{"Pinocchio > CasADi > C": 1e-6}), later):
        measured.write(results)
        assert history.main(arguments) == 0
    kept = history.read_history(file)
    assert [(one.row, one.contestant, one.commit, one.seconds) for one in kept] == [
        (name, "Pinocchio > CasADi > C", first.machine["commit"], 1e-6),
        (name, "eomgen", first.machine["commit"], 3e-7),
        (name, "eomgen", "later", 1e-7),
    ]
    assert history.series(kept, name, "eomgen")[kept[0].machine][1][1] == 1e-7
    assert figures.main([*arguments, "--out", str(tmp_path)]) == 0
    drawn = (tmp_path / "benchmarks_history.svg").read_text(encoding="utf-8")
    assert ">Panda, 7 joints: mass matrix, scalar C<" in drawn and ">Pinocchio &gt; CasADi &gt; C<" in drawn


def test_the_stored_history_has_the_stored_results() -> None:
    kept = {one.key: one for one in history.read_history(history.HISTORY)}
    assert all(kept.get(one.key) == one for one in history.measurements(read(history.RESULTS).values()))


def test_the_readme_has_ten_rows() -> None:
    assert sum(comparison.readme for _, comparison in page.compared(suite.ROWS)) == 10


def test_page_and_readme_are_those_of_the_stored_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    assert page.main(["--check"]) == 0, capsys.readouterr().out


#: One row of a step, a call, an accuracy and lanes each; the others are left to `make bench`.
SMALL = ("ten_hinges_rk4", "inverse_dynamics_panda", "duffing_1e-9", "four_bar_lanes")


@pytest.mark.slow
@pytest.mark.long_except("inverse_dynamics_panda")
@pytest.mark.parametrize("name", SMALL)
def test_rows_are_right_in_small(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = suite.main(["--quick", "--here", "--rows", name, "--folder", str(tmp_path), "--work", str(tmp_path)])
    found = read(tmp_path)[name]
    assert status == 0, capsys.readouterr().out
    assert {one.state for one in found.outcomes} <= {"measured", "checked", "missing"}
    assert found.outcomes[0].name.startswith("eomgen") and found.outcomes[0].state in ("measured", "checked")
