"""On 80 columns, names of tables fold and numbers do not; columns of names stay in tables that are wider still."""

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


@pytest.mark.slow_cases("simulate", "equilibrium", "linearize")
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
    monkeypatch.setattr(printing, "_PLAIN_WIDTH", 80)
    (tmp_path / "out").mkdir()
    words = [word.replace("OUT", str(tmp_path / "out")) for word in VERBS[verb]]
    assert main(words) in (0, 1)
    printed = set(NUMBER.findall(capsys.readouterr().out))
    numbers = {number for cell in cells for number in NUMBER.findall(cell)}
    assert numbers or verb in ("cite", "examples"), "the verb prints a table"
    assert numbers <= printed, numbers - printed


@pytest.mark.parametrize("width", [30, 60, 80])
def test_names_stay_in_tables_wider_than_the_screen(
    width: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(printing, "_PLAIN_WIDTH", width)
    header = ("column", "unit", *(f"number {k}" for k in range(12)))
    rows = [(f"output.{name}", "rad", *["-0.12345"] * 12) for name in ("first", "second")]
    printing.print_table("numbers", header, rows, numeric=tuple(range(2, 14)))
    lines = capsys.readouterr().out.splitlines()
    assert [len(re.findall("-0.12345", line)) for line in lines if "rad" in line] == [12, 12]
    assert "output.first" in lines[3] and "output.secon" in lines[4]
