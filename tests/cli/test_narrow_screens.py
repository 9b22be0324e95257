"""On 80 columns and through a pipe, names of tables fold and numbers do not."""

import re
from pathlib import Path
from typing import Any

import pytest

from eomgen.cli import main, printing

CAR = "examples/quarter_car/scene.toml"
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.])")
VERBS = {
    "info": ["info", CAR],
    "equilibrium": ["equilibrium", CAR],
    "linearize": ["linearize", CAR],
    "simulate": ["simulate", CAR, "--t-end", "0.2", "--out", "OUT"],
    "examples": ["examples"],
    "cite": ["cite", "rk4"],
}


@pytest.mark.parametrize("verb", VERBS)
def test_numbers_of_tables_stay_whole(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cells: list[str] = []

    class Recorded(printing.Table):
        def add_row(self, *row: Any, **options: Any) -> None:
            cells.extend(str(cell) for cell in row)
            super().add_row(*row, **options)

    monkeypatch.setattr(printing, "Table", Recorded)
    monkeypatch.setenv("COLUMNS", "80")
    (tmp_path / "out").mkdir()
    words = [word.replace("OUT", str(tmp_path / "out")) for word in VERBS[verb]]
    assert main(words) in (0, 1)
    printed = set(NUMBER.findall(capsys.readouterr().out))
    numbers = {number for cell in cells for number in NUMBER.findall(cell)}
    assert numbers or verb in ("cite", "examples"), "the verb prints a table"
    assert numbers <= printed, numbers - printed
