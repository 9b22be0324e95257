"""Tables of many numbers as texts of bytes: what a compiler makes of them are the numbers."""

from __future__ import annotations

import re

import numpy as np
import pytest

from eomgen.codegen.targets.c.tables import CurveTable


def bytes_of(text: str) -> bytes:
    """Return the bytes that C makes of the characters between quotes."""
    pieces = re.findall(r"\\([0-7]{3})|([^\\])", text)
    return bytes(int(octal, 8) if octal else ord(plain) for octal, plain in pieces)


@pytest.mark.parametrize("width", [1, 3, 4, 7, 8])
def test_texts_of_tables_are_the_bytes_of_their_numbers(width: int) -> None:
    rows = np.frombuffer(np.random.default_rng(width).bytes(8 * 40 * width), dtype="<f8").reshape(40, width).copy()
    rows[0] = 0.0
    rows[~np.isfinite(rows)] = np.frombuffer(b'"\\?~ \x7f1?')[0]
    text = CurveTable(1, tuple(map(tuple, rows.tolist())), (1,)).text
    lines = text.split("\n")
    assert all(re.fullmatch(r'    "[ -~]+",?', line) for line in lines)
    assert "?" not in text  # no trigraph
    found = ["".join(line[5:] for line in part.split('"\n')) for part in text.removesuffix('",').split('",\n')]
    assert [bytes_of(part) for part in found] == [row.tobytes() for row in rows]
    assert max(len(bytes_of(line.removesuffix(",")[5:-1])) for line in lines) <= 28
