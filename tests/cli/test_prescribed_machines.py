"""Commands on machines whose whole motion is prescribed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from eomgen.cli import main

SCENE = """
format = 1
name = "turntable"
gravity = [0, 0, -9.81]
[bodies.plate]
mass = 2.0
inertia = [0.1, 0.1, 0.2]
[joints.spindle]
type = "revolute"
parent = "base"
child = "plate"
axis = [0, 0, 1]
drive = "0.3 * t"
"""


@pytest.fixture
def scene(tmp_path: Path) -> str:
    file = tmp_path / "turntable.toml"
    file.write_text(SCENE, encoding="utf-8")
    return str(file)


def test_a_linear_model_without_free_motion_is_a_result(scene: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["linearize", scene]) == 0
    printed = capsys.readouterr()
    assert "internal error" not in printed.err and printed.out
    assert main(["linearize", scene, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)
