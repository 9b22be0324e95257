"""Files that are no solutions: each is refused as one, whatever NumPy or the archive would have said."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.models.scenes import PENDULUM_TOML

OUTCOME = {"stats": {}, "message": "", "success": True, "interrupted": False}
ARCHIVE = "it is not an .npz archive, or not all of one; try: a .npz file of Solution.save"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "solution.npz"


def refusal(file: Path) -> str:
    with pytest.raises(eomgen.FileError) as caught:
        eomgen.Solution.load(file)
    start = f"input/output error: {file}: this is not a solution written by eomgen: "
    assert str(caught.value).startswith(start)
    return str(caught.value).removeprefix(start)


@pytest.mark.parametrize("data", [b"", b"hello", b"PK\x03\x04 cut short"])
def test_other_bytes_are_no_solution(file: Path, data: bytes) -> None:
    file.write_bytes(data)
    assert refusal(file) == ARCHIVE


@pytest.mark.parametrize(
    ("arrays", "text"),
    [
        ({"a": 1}, "metadata is missing; try: a .npz file of Solution.save"),
        ({"metadata": "[1]"}, "its metadata are not a mapping; try: a .npz file of Solution.save"),
        ({"metadata": json.dumps(OUTCOME)}, "t is missing"),
        (
            {
                "metadata": json.dumps(OUTCOME),
                "t": [0.0, 1.0],
                **{name: [[0.0]] for name in ("q", "v", "a", "z", "multipliers")},
            },
            "its arrays do not fit together",
        ),
    ],
)
def test_other_archives_are_no_solution(file: Path, arrays: dict[str, object], text: str) -> None:
    np.savez(file, **arrays)
    assert refusal(file) == text


@pytest.mark.slow
def test_no_flipped_byte_raises_anything_else(tmp_path: Path, file: Path) -> None:
    scene = tmp_path / "shaken.toml"
    scene.write_text(PENDULUM_TOML)
    eomgen.build(scene, profile="quick").simulate(0.02, 0.01).save(file)
    whole = file.read_bytes()
    refused = 0
    for position in range(0, len(whole), 31):
        broken = bytearray(whole)
        broken[position] ^= 0xFF
        file.write_bytes(broken)
        try:
            eomgen.Solution.load(file)
        except eomgen.FileError:
            refused += 1
    assert refused > len(whole) // 62
