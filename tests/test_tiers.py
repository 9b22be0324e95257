"""Marks of tiers name cases of a parametrisation, and each name is a case."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILE = """
import pytest

@pytest.mark.slow_except("a-1")
@pytest.mark.long_cases("b-2")
@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("letter", ["a", "b"])
def test_pairs(letter, number): ...

@pytest.mark.slow_cases("3")
@pytest.mark.parametrize("number", [3, 4])
def test_few(number): ...

@pytest.mark.long_except("5")
@pytest.mark.parametrize("number", [5, pytest.param(6, marks=pytest.mark.slow)])
def test_many(number): ...

@pytest.mark.slow_except("1")
@pytest.mark.long_except_every(2)
@pytest.mark.parametrize("number", range(1, 6))
def test_some(number): ...

@pytest.mark.long
def test_whole(): ...
"""


def _collected(folder: Path, text: str, expression: str, *more: str) -> tuple[set[str], str]:
    (folder / "test_file.py").write_text(text, encoding="utf-8")
    (folder / "conftest.py").write_text("from tests.conftest import *\n", encoding="utf-8")
    options = [
        "-c",
        str(ROOT / "pyproject.toml"),
        "--rootdir",
        str(folder),
        "--collect-only",
        "-m",
        expression,
        "-pno:cacheprovider",
        *more,
    ]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options, str(folder)], capture_output=True, text=True, cwd=ROOT, check=False
    )
    return {line.partition("::")[2] for line in done.stdout.splitlines() if "::" in line}, done.stdout


@pytest.mark.parametrize(
    ("expression", "names"),
    [
        ("not slow", {"test_pairs[a-1]", "test_few[4]", "test_many[5]", "test_some[1]"}),
        pytest.param(
            "slow and not long",
            {"test_pairs[a-2]", "test_pairs[b-1]", "test_few[3]", "test_some[2]", "test_some[4]"},
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "long",
            {"test_pairs[b-2]", "test_many[6]", "test_whole", "test_some[3]", "test_some[5]"},
            marks=pytest.mark.slow,
        ),
    ],
)
def test_each_case_is_of_one_tier(tmp_path: Path, expression: str, names: set[str]) -> None:
    assert _collected(tmp_path, FILE, expression)[0] == names


def test_a_name_that_is_no_case_is_refused(tmp_path: Path) -> None:
    _, screen = _collected(tmp_path, FILE.replace('"b-2"', '"b-2", "b-3"'), "not slow")
    assert "long_cases of test_pairs names no case: b-3" in screen


@pytest.mark.slow
@pytest.mark.parametrize(("expression", "read"), [("slow and not long", True), ("long", False)])
def test_files_without_a_case_of_the_tier_are_not_imported(expression: str, read: bool, tmp_path: Path) -> None:
    (tmp_path / "test_other.py").write_text("import pytest, nowhere\n\n@pytest.mark.slow\ndef test(): ...\n", "utf-8")
    _, screen = _collected(tmp_path, FILE, expression)
    assert ("No module named 'nowhere'" in screen) is read


@pytest.mark.slow
def test_parts_hold_each_test_once(tmp_path: Path) -> None:
    whole, _ = _collected(tmp_path, FILE, "")
    parts = [_collected(tmp_path, FILE, "", f"--part={number}/3")[0] for number in range(3)]
    assert sum(map(len, parts)) == len(whole) and set.union(*parts) == whole and max(map(len, parts)) < len(whole)
