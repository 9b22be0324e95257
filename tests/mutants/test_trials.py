"""Trials in a small tree: which test kills a mutant, what stays, and which functions a process calls."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.mutants import __main__ as command
from tests.mutants.operators import Mutant, mutants_of
from tests.mutants.selection import ROOT, Calls, called_by, chosen, nearness
from tests.mutants.trial import Scratch

PACKAGE = "def twice(a):\n    return 2 * a\n\ndef loop(a):\n    while a < 3:\n        a += 1\n    return a\n"
TESTS = """
from pathlib import Path
from eomgen.numbers import loop, twice

def test_of_the_copy():
    assert (Path(__file__).parents[1] / "not_copied").exists()

def test_twice():
    assert twice(3) == 6

def test_loop():
    assert loop(0) == 3
"""


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Return a tree with a package of two functions and its tests."""
    top = tmp_path / "top"
    (top / "eomgen").mkdir(parents=True)
    (top / "eomgen" / "__init__.py").touch()
    (top / "eomgen" / "numbers.py").write_text(PACKAGE, encoding="utf-8")
    shutil.copytree(ROOT / "tests" / "mutants", top / "tests" / "mutants")
    shutil.copy(ROOT / "pyproject.toml", top)
    (top / "tests" / "test_numbers.py").write_text(TESTS, encoding="utf-8")
    return top


def _mutant(line: int, new: str) -> Mutant:
    (found,) = (
        mutant
        for mutant in mutants_of(PACKAGE.encode(), "eomgen/numbers.py")
        if (mutant.line, mutant.new) == (line, new)
    )
    return found


def test_a_test_that_fails_in_the_copy_anyway_kills_nothing(tree: Path, tmp_path: Path) -> None:
    scratch = Scratch(tmp_path / "scratch", tree)
    outcome = scratch.judge(_mutant(2, "/"), "first", ["tests/test_numbers.py"], 30.0)
    assert outcome.failed == "tests/test_numbers.py::test_twice" and not outcome.whole
    assert scratch.unsound == {"tests/test_numbers.py::test_of_the_copy"}
    assert (scratch.folder / "eomgen" / "numbers.py").read_text(encoding="utf-8") == PACKAGE
    assert (tree / "eomgen" / "numbers.py").read_text(encoding="utf-8") == PACKAGE


@pytest.mark.slow
def test_a_mutant_survives_tests_that_do_not_see_it_and_one_without_end_is_killed(tree: Path, tmp_path: Path) -> None:
    scratch = Scratch(tmp_path / "scratch", tree)
    scratch.unsound.add("tests/test_numbers.py::test_of_the_copy")
    unseen = scratch.judge(_mutant(5, "4"), "first", ["tests/test_numbers.py::test_twice"], 30.0)
    assert (unseen.failed, unseen.whole, unseen.tests) == ("", True, 1)
    for line, new in ((5, ">="), (5, "4")):
        assert scratch.judge(_mutant(line, new), "first", ["tests/test_numbers.py"], 30.0).failed.endswith("test_loop")
    endless = scratch.judge(_mutant(6, "-="), "first", ["tests/test_numbers.py"], 1.0)
    assert endless.failed == "no end"


def test_probes_name_the_functions_that_a_process_and_its_children_call(tree: Path) -> None:
    child = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'import eomgen.numbers as n; n.loop(1)'])"
    assert called_by(["-c", "import eomgen.numbers as n; n.twice(1)"], tree) == {
        "eomgen/__init__.py::",
        "eomgen/numbers.py::",
        "eomgen/numbers.py::twice",
    }
    assert "eomgen/numbers.py::loop" in called_by(["-c", child], tree)


def test_files_about_the_module_come_before_others() -> None:
    mutant = Mutant("eomgen/linear/modes.py", 1, "Modes.stability", "comparison", 0, 1, "a", "b")
    ranks = [
        nearness(mutant, "tests/linear/test_stability_of_modes.py", "from eomgen.linear.modes import modes"),
        nearness(mutant, "tests/linear/test_campbell.py", "import eomgen"),
        nearness(mutant, "tests/waves/test_radar.py", "import eomgen"),
    ]
    assert ranks == sorted(ranks, reverse=True) and len(set(ranks)) == 3


def test_measured_files_that_do_not_call_a_function_are_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = Calls(tmp_path / "calls.json")
    monkeypatch.setattr(
        "tests.mutants.selection._called", lambda test, expression: {"eomgen/linear/modes.py::Modes.stability"}
    )
    tests = ["tests/linear/test_campbell.py", "tests/waves/test_radar.py"]
    assert calls.measure("first", tests, 60.0) == 2 and calls.measure("first", tests, 60.0) == 0
    again = Calls(tmp_path / "calls.json")
    inside = Mutant("eomgen/linear/modes.py", 1, "Modes.stability", "comparison", 0, 1, "a", "b")
    outside = Mutant("eomgen/linear/modes.py", 1, "Modes.band", "comparison", 0, 1, "a", "b")
    assert set(tests) <= set(chosen(inside, "first", again))
    assert not set(tests) & set(chosen(outside, "first", again))
    assert set(tests) <= set(chosen(outside, "second", again))


def test_a_run_goes_on_behind_its_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    seen: list[Mutant] = []

    def tried(mutant: Mutant, tiers: list[str], scratch: Scratch, calls: Calls, limit: float) -> dict[str, Any]:
        seen.append(mutant)
        state = ("killed", "survived", "undecided")[len(seen) % 3]
        return {**vars(mutant), "state": state, "test": "", "equivalent": "", "seconds": 1.0, "limit": limit}

    monkeypatch.setattr(command, "tried", tried)
    monkeypatch.setattr(command, "Scratch", lambda folder: folder)
    results = tmp_path / "new" / "mutants.json"
    options = ["--under", "eomgen/linear/modes.py", "--results", str(results)]
    assert command.main(["--sample", "4", *options]) == 0  # survived, undecided, killed, survived
    entries = json.loads(results.read_text(encoding="utf-8"))
    entries["mutants"][0]["equivalent"] = "rounding"
    results.write_text(json.dumps(entries), encoding="utf-8")
    capsys.readouterr()
    assert command.main(["--sample", "6", *options]) == 0  # undecided, killed
    assert len(seen) == 6 == len({(mutant.start, mutant.new) for mutant in seen})
    screen = capsys.readouterr().out
    assert "\nall                       6       2         1          2           1\n" in screen
    assert "(equivalent: rounding)" in screen
    assert command.main(["--sample", "6", "--limit", "600", *options]) == 0  # those undecided: survived, undecided
    assert seen[6:] == [seen[1], seen[4]]
    assert "\nall                       6       2         2          1           1\n" in capsys.readouterr().out
