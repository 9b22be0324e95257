"""A long elimination is several functions, which do what one does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.codegen.targets.c import stepper
from eomgen.codegen.targets.c.stepper import in_parts

TOP = Path(__file__).parents[2] / "examples" / "heavy_top" / "r3xso3.toml"


def row(number: int, loads: int, updates: int = 0) -> dict[str, Any]:
    """Return a row of an elimination of ``loads + 1 + updates`` statements, ``loads`` of them where there are none."""
    taken = [{"updates": list(range(updates))}] if updates else []
    return {"row": number, "loads": list(range(loads)), "upper": [], "taken": taken}


def test_a_short_elimination_is_one_function() -> None:
    rows = [row(number, 40, 59) for number in range(10)]
    assert in_parts(rows) == [rows]


def test_a_long_elimination_is_cut_between_rows() -> None:
    rows = [row(number, 40, 59) for number in range(11)]
    assert in_parts(rows) == [rows[0:2], rows[2:4], rows[4:6], rows[6:8], rows[8:10], rows[10:]]


def test_a_row_that_is_too_long_is_a_function_of_its_own() -> None:
    rows = [row(0, 10), row(1, 1500), row(2, 10), row(3, 10)]
    assert in_parts(rows) == [rows[:1], rows[1:2], rows[2:]]


@pytest.mark.slow
def test_parts_give_the_bits_of_the_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def run(cache: str) -> tuple[eomgen.Solution, str]:
        monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / cache))
        model = eomgen.build(TOP, profile="quick")
        [text] = [file.read_text(encoding="utf-8") for file in model.library.folder.glob("*_step.c")]
        return model.simulate(0.02, 2e-3, error_estimate=False), text

    whole, text = run("whole")
    assert "_eliminate_rows_" not in text
    monkeypatch.setattr(stepper, "_WHOLE", 50)
    monkeypatch.setattr(stepper, "_PART", 50)
    parts, text = run("parts")
    assert text.count("static int heavy_top_r3xso3_eliminate_rows_") > 3
    assert np.array_equal(parts.q, whole.q) and np.array_equal(parts.a, whole.a)
