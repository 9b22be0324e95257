"""The page of other programs is written from the register and the differences that were measured last."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.peers import EXACT, PROGRAMS, ROWS, Row, measured
from tests.peers.page import line, page

ROOT = Path(__file__).parents[2]
MADE = Row("Drake", "trees", "made.terms", 3, deviates=("forces",), note="It is so.")
FOUND = {"date": "2026-11-30", "version": "1.5", "scenes": 3, "differences": {"mass": 2e-9, "forces": 0.4}}


def test_the_page_is_written_from_the_register_and_the_measurements() -> None:
    text = (ROOT / "docs" / "peers.md").read_text(encoding="utf-8")
    assert page(measured()) == text, "run: python -m tests.peers docs/peers.md --page"
    assert list(measured()) == list(ROWS) and {row.program for row in ROWS.values()} == PROGRAMS.keys()


@pytest.mark.parametrize("name", ROWS)
def test_each_row_has_a_function_and_is_within_its_limit_or_explained(name: str) -> None:
    row, found = ROWS[name], measured()[name]
    module, _, function = row.function.partition(".")
    text = (ROOT / "tests" / "peers" / f"{module}.py").read_text(encoding="utf-8")
    assert function in {it.name for it in ast.parse(text).body if isinstance(it, ast.FunctionDef)}
    assert "missing" in found or found["scenes"] == row.count
    assert not row.above_limit(found)
    assert row.note or (row.accuracy == EXACT and not row.deviates)
    assert all(found["differences"][quantity] > row.accuracy for quantity in row.deviates), "it deviates no more"


def test_a_row_shows_its_limit_deviations_and_programs_that_are_missing() -> None:
    assert MADE.above_limit(FOUND) == ["mass"]
    differences = "mass: 2e-09<br>forces: **deviates** 4e-01"
    assert line(MADE, FOUND) == f"| Drake 1.5 | trees | 3 | {differences} | 1e-09 | 2026-11-30 | It is so. |"
    missing = {"date": "2026-11-30", "missing": "No matching distribution found for drake"}
    assert "| not measured: No matching distribution found for drake |" in line(MADE, missing)
    assert MADE.above_limit({**FOUND, "differences": {"mass": float("nan")}}) == ["mass"]
    assert not MADE.above_limit(missing)
