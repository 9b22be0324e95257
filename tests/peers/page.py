"""The page of other programs: a row for each program and kind of scenes, from the register and kept measurements."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tests.peers import EXACT, ROWS, Row

INTRODUCTION = f"""# Verification: other programs

eomgen and eight other programs on the same random scenes. `make peers` installs the programs (from PyPI below `.bench`,
Siconos from Debian), compares, and writes this page from the register `tests/peers/__init__.py` and its measurements in
`tests/peers/measured.json`. Each scene has a seed, so that another machine has the same scenes.

Differences are relative: of a vector or matrix at one state to its norm, 1e-3 at least; of frequencies and eigenvalues
to the size of each; of times to the duration. A row has the largest over all its scenes and states. Programs that solve
the same equations differ by {EXACT:.0e} at most; a larger limit has its reason in the last column. **deviates** marks
quantities in which a program has another result than eomgen; the last column names a third result that decides.

Digits from papers, books and programs: [verification](verification.md). Every URDF of example-robot-data:
[robots](urdf_robots.md). Times of other programs: [benchmarks](benchmarks.md).

| program | scenes | number | largest differences | limit | date | remark |
|---|---|---:|---|---:|---|---|
"""


def line(row: Row, found: Mapping[str, Any]) -> str:
    """Return the line of a row."""
    if reason := found.get("missing") or found.get("failed"):
        return f"| {row.program} | {row.scenes} | | not measured: {reason} | | {found['date']} | {row.note} |"
    differences = "<br>".join(
        f"{name}: {'**deviates** ' if name in row.deviates else ''}{value:.0e}"
        for name, value in found["differences"].items()
    )
    cells = (
        f"{row.program} {found['version']}", row.scenes, found["scenes"], differences, f"{row.accuracy:.0e}",
        found["date"], row.note,
    )  # fmt: skip  # a table
    return f"| {' | '.join(map(str, cells))} |"


def page(kept: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the page in Markdown."""
    return INTRODUCTION + "".join(f"{line(row, kept[name])}\n" for name, row in ROWS.items())
