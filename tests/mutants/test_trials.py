"""Trials in a small tree: which test kills a mutant, which mutants survive, and which tests run which blocks."""

from __future__ import annotations

import ast
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.mutants.__main__ import table
from tests.mutants.operators import Mutant
from tests.mutants.probe.sitecustomize import blocks
from tests.mutants.selection import ROOT, block_names, nearness

PACKAGE = """
import functools

FACTOR = 2

def twice(a):
    if a is None:
        return 7
    return FACTOR * a

def loop(a):
    while a < 3:
        a += 1
    return a

@functools.cache
def kept(a):
    return a + 4

def at_import():
    return 5

FIVE = at_import()

class Box:
    size: int = 9

    def doubled(self):
        return [2 * part for part in (self.size,)]
"""
TESTS = """
import subprocess, sys
from pathlib import Path
import pytest
from eomgen.numbers import FIVE, Box, kept, loop, twice

@pytest.fixture(scope="module")
def shared():
    return Box().doubled()

def test_of_another_machine():
    assert twice(3) == 6 and Path("no such file").exists()

def test_twice():
    assert twice(3) == 6

def test_loop():
    assert loop(0) == 3

def test_kept():
    assert kept(1) == 5

def test_kept_again():
    assert kept(1) == 5

def test_shared(shared):
    assert shared == [18]

def test_import():
    assert FIVE == 5

def test_child():
    code = "import eomgen.numbers as n; print(n.twice(None))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() in ("7", "8")
"""
STRICT_CHILD = TESTS.replace(' in ("7", "8")', ' == "7"')


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Return a tree with a small package and its tests."""
    top = tmp_path / "top"
    (top / "eomgen").mkdir(parents=True)
    (top / "eomgen" / "__init__.py").touch()
    (top / "eomgen" / "numbers.py").write_text(PACKAGE, encoding="utf-8")
    shutil.copytree(ROOT / "tests" / "mutants", top / "tests" / "mutants")
    shutil.copy(ROOT / "pyproject.toml", top)
    (top / "tests" / "test_numbers.py").write_text(TESTS, encoding="utf-8")
    return top


@pytest.fixture
def tried(tree: Path, tmp_path: Path) -> Callable[..., dict[tuple[int, str], dict[str, Any]]]:
    """Return a function that tries all mutants of the small package, and returns the entries by line and new text."""

    def run(*options: str) -> dict[tuple[int, str], dict[str, Any]]:
        results = tmp_path / "results.json"
        environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache"), "PYTHONPATH": str(tree)}
        command = [sys.executable, "-m", "tests.mutants", "--sample", "99", "--results", str(results), *options]
        done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, check=False)
        assert results.is_file(), done.stdout + done.stderr
        entries = json.loads(results.read_text(encoding="utf-8"))["mutants"]
        return {(entry["line"], entry["new"]): entry for entry in entries}

    return run


@pytest.mark.long
def test_trials_end_at_the_first_test_that_fails_by_the_mutant_alone(
    tried: Callable[..., dict[tuple[int, str], dict[str, Any]]], tree: Path
) -> None:
    entries = tried("--limit", "1")
    killed = {key: entry["test"].partition("::")[2] for key, entry in entries.items() if entry["state"] == "killed"}
    assert killed[9, "/"] == "test_twice"  # not the test that fails anyway
    assert killed[12, ">="] == "test_loop" and entries[13, "-="]["test"] == "no end"
    assert killed[18, "-"] == killed[18, "5"] == "test_kept" and killed[29, "/"] == "test_shared"
    # statements of modules and classes, and functions that imports call, need a process that imports anew
    assert (killed[4, "3"], killed[21, "6"], killed[26, "10"]) == ("test_twice", "test_import", "test_shared")
    assert [key for key, entry in entries.items() if entry["state"] != "killed"] == [(8, "8")]
    assert (tree / "eomgen" / "numbers.py").read_text(encoding="utf-8") == PACKAGE
    # a child process of a test has the mutant, too; the changed file is measured anew
    (tree / "tests" / "test_numbers.py").write_text(STRICT_CHILD, encoding="utf-8")
    assert tried("--limit", "1", "--only", "survived")[8, "8"]["test"].endswith("::test_child")


def test_blocks_are_runs_of_statements_without_a_branch() -> None:
    names = [name.partition("::")[2] for name, _ in block_names(PACKAGE.encode(), "eomgen/numbers.py")]
    assert names == [
        "twice#1", "twice#2", "twice#3", "loop#1", "loop#2", "loop#3", "kept#1", "at_import#1", "Box.doubled#1",
    ]  # fmt: skip
    source = "def f(a):\n    '''Text.'''\n    b = 1\n    try:\n        c()\n    except E:\n        d()\n    return b\n"
    assert [statements[place].lineno for _, statements, place in blocks(ast.parse(source))] == [3, 5, 7, 8]


def test_files_about_the_module_come_before_others() -> None:
    mutant = Mutant("eomgen/solvers/redundancy.py", 1, "redundant", "comparison", 0, 1, "a", "b")
    ranks = [
        nearness(mutant, "tests/solvers/test_sparse_rows.py", "from eomgen.solvers.redundancy import redundant"),
        nearness(mutant, "tests/solvers/test_quadrature.py", "import eomgen"),
        nearness(mutant, "tests/lie/test_groups.py", "import eomgen"),
    ]
    assert ranks == sorted(ranks, reverse=True) and len(set(ranks)) == 3


def test_the_share_of_a_room_leaves_equivalent_mutants_out() -> None:
    entry = {"operator": "constant", "equivalent": "", "line": 1, "old": "1", "new": "2"}
    results = [
        entry | {"file": "eomgen/products/linear/a.py", "state": "killed"},
        entry | {"file": "eomgen/products/linear/b.py", "state": "survived"},
        entry | {"file": "eomgen/errors.py", "state": "survived", "equivalent": "a size"},
        entry | {"file": "eomgen/lie/c.py", "state": "killed"},
    ]
    rows = {line[:24].strip(): line[24:].split() for line in table(results).splitlines()}
    # Wilson's interval of 1 of 2: (1 +- 1 / sqrt(1 + 2 / z^2)) / 2 with z = 1.96
    assert rows["products/linear"] == ["2", "1", "1", "0", "0", "50", "(9", "to", "91)"]
    assert rows["all"][:5] == ["4", "2", "1", "0", "1"] and "errors" not in rows
