"""The code of docs/fields.md runs, and the page names what there is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import eomgen.fields

PAGE = Path(__file__).parents[2] / "docs" / "fields.md"


def test_the_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    text = PAGE.read_text(encoding="utf-8")
    names: dict[str, object] = {}
    for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(code, str(PAGE), "exec"), names)
    samples = names["samples"]
    assert isinstance(samples, eomgen.fields.Samples)
    assert samples.acceptance > 0.5 and samples.r_hat < 1.5
    assert "(16, 16, 16)" in capsys.readouterr().out


def test_the_page_names_every_public_name() -> None:
    text = PAGE.read_text(encoding="utf-8")
    missing = {name for name in eomgen.fields.__all__ if not re.search(rf"\b{name}\b", text)}
    assert missing <= {"OPERATORS", "LinearOperator", "Samples", "autocorrelation_time", "split_r_hat", "follow"}
