"""Long steps of the cantilever, by the table of acceptance tests."""

from __future__ import annotations

import pytest

from benchmarks.beam_acceptance import main

pytestmark = pytest.mark.slow


@pytest.mark.long
def test_the_cantilever_takes_long_steps(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--parts", "long_steps"]) == 0
    _, _, *rows = capsys.readouterr().out.splitlines()
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
    assert [row[0] for row in cells[:2]] == ["cantilever, h = 0.2 s, tolerances 1e-5, 1e-3"] * 2
    mean, most = map(float, cells[0][3].split(","))
    assert mean <= 8.0 and most <= 20
    assert all(float(number) < 0.03 for row in (cells[1], cells[3]) for number in row[3].split(","))
