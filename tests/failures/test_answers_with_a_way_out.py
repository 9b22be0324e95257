"""Answers to small mistakes name the way out: the right spelling, the whole list, the place that is missing."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.errors import EomgenError
from tests.models.scenes import PENDULUM_TOML


def slide(**changes: Any) -> dict[str, Any]:
    data = {
        "format": 1,
        "name": "slide",
        "bodies": {"block": {"mass": 1.0}},
        "joints": {"x1": {"type": "prismatic", "parent": "base", "child": "block", "axis": [1, 0, 0]}},
    }
    return data | changes


@pytest.mark.parametrize(("called", "meant"), [("q(x1)", "q.x1"), ("v(x1)", "v.x1"), ("position(tip)", "position.tip")])
def test_a_quantity_that_is_called_has_a_dot(called: str, meant: str) -> None:
    with pytest.raises(EomgenError, match=f"unknown function .*try: {meant}$"):
        eomgen.load(slide(outputs={"o": {"formula": called}}))


@pytest.mark.parametrize("verb", [["plot"], ["info"], ["animate", "--out", "page.html"]])
def test_a_path_that_is_missing_is_called_missing(
    verb: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([verb[0], str(tmp_path / "runs"), *verb[1:]]) in (2, 5)
    assert "there is no " in capsys.readouterr().err


def test_a_guess_of_the_configuration_alone_is_at_rest() -> None:
    model = eomgen.build("examples/four_bar/scene.toml", profile="quick")
    state = model.consistent(model.initial_q)
    assert np.array_equal(state.v, np.zeros(model.nv))
    assert repr(model).endswith(f"; {len(model.notes)} notes>")


@pytest.mark.slow
@pytest.mark.parametrize("way", ["load", "build", "SceneBuilder"])
def test_scripts_print_the_notes_of_the_scenes_that_they_read(way: str, tmp_path: Path) -> None:
    """Once, by the standard means of Python, which a program can silence."""
    unused = "[parameters.unused]\nvalue = 1.0\n"
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML + unused, encoding="utf-8")
    call = {
        "load": "scene = eomgen.load('scene.toml')",
        "build": "scene = eomgen.build('scene.toml', profile='instant')",
        "SceneBuilder": "builder = eomgen.SceneBuilder('shaken').parameter('unused', 1).body('arm', 1)\n"
        "scene = builder.joint('rail', 'prismatic', 'base', 'arm', axis=[1, 0, 0]).build()",
    }[way]
    for silence, lines in (
        ("", 1),
        ("import logging; logging.getLogger('eomgen').addHandler(logging.NullHandler())", 0),
    ):
        script = f"import eomgen\n{silence}\n{call}\neomgen.load(scene) if isinstance(scene, eomgen.Scene) else 0"
        done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True)
        told = "shaken: note: the parameter unused changes nothing: no formula mentions it\n"
        assert done.stderr == lines * told


def test_orders_are_of_speeds_of_rotation(capsys: pytest.CaptureFixture[str]) -> None:
    model = eomgen.build("examples/quarter_car/scene.toml", profile="quick")
    with pytest.raises(EomgenError, match="orders are multiples of a speed in rad/s, and damper is in N s/m; try: no"):
        model.campbell("damper", [500.0, 1500.0], orders=(1,))
    assert main(["linearize", "examples/quarter_car/scene.toml", "--campbell", "damper=500:1500:3"]) == 0
    printed = capsys.readouterr()
    assert "crossings" not in printed.out and "no orders: damper is not a speed of rotation (unit N s/m)" in printed.err
