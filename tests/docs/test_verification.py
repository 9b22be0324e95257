"""The page of anchor cases is written from the register and the numbers that its tests compared."""

from __future__ import annotations

import ast
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.anchors import KINDS, RECORD, Anchor, anchors, last_unit, measured, measured_runs, sources
from tests.anchors.page import lines_of, page, printed

ROOT = Path(__file__).parents[2]
MADE = Anchor("case", "S", "C", "a, b, m", "print", "book", ("1.50", "-2.0e-1"), "f.py::t")


@cache
def functions(path: str) -> dict[str, str]:
    """Return the text of the functions of a file by their names."""
    text = (ROOT / path).read_text(encoding="utf-8")
    return {it.name: text for it in ast.parse(text).body if isinstance(it, ast.FunctionDef)}


def test_the_page_is_written_from_the_register_and_the_measured_numbers() -> None:
    text = (ROOT / "docs" / "verification.md").read_text(encoding="utf-8")
    assert page(measured(), measured_runs()) == text, "run: python -m tests.anchors --page docs/verification.md"
    assert len(anchors()) >= 30 and list(measured()) == list(anchors())


@pytest.mark.parametrize("name", anchors())
def test_each_case_has_a_test_a_source_and_a_number_within_its_tolerance(name: str) -> None:
    case = anchors()[name]
    file, _, function = case.test.partition("::")
    assert f'"{name}"' in functions(file)[function]
    assert case.kind in KINDS and case.source in sources()
    assert np.all(np.abs(np.array(measured()[name]) - case.reference) <= case.allowed)


def test_every_source_is_of_a_case() -> None:
    assert {case.source for case in anchors().values()} == sources().keys()


def test_a_check_compares_with_the_digits_and_notes_its_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = tmp_path / "record"
    monkeypatch.setenv(RECORD, str(record))
    MADE.check([1.509, -0.2])
    assert json.loads(record.read_text(encoding="utf-8")) == ["case", [1.509, -0.2]]
    with pytest.raises(AssertionError, match=r"case: \[ 1\.511 -0\.2  \] is off \('1\.50', '-2\.0e-1'\) by"):
        MADE.check([1.511, -0.2])
    with pytest.raises(AssertionError, match="case: 1 numbers for 2"):
        MADE.check(1.5)


def test_a_check_compares_with_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(RECORD, raising=False)
    monkeypatch.setattr("tests.anchors.measured", lambda: {"case": [1.491, -0.2]})
    MADE.check([1.5, -0.2])
    with pytest.raises(
        AssertionError, match=r"case: \[ 1\.509 -0\.2  \] is no more \[ 1\.491 -0\.2  \], as on the page"
    ):
        MADE.check([1.509, -0.2])


def test_digits_are_printed_as_the_source_has_them_and_one_more() -> None:
    assert [last_unit(text) for text in ("4.20", "-7", "1.23e-3")] == pytest.approx([0.01, 1.0, 1e-5])
    assert printed(0.41234, "0.41") == "0.412"
    assert printed(-23.64597160090471, "-23.6459716009047") == "-23.6459716009047"
    assert printed(-0.0005500431812571, "-0.55e-3") == "-5.500e-04"
    assert lines_of(MADE, [1.501, -0.2])[-1] == "  relative difference 6.7e-04"
