"""Each kind of failure: one message on stderr that says where and what, no traceback, its own exit code."""

from __future__ import annotations

import gc
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import eomgen
from eomgen.cli import main
from tests.messages.answers import plain
from tests.models.scenes import PENDULUM_TOML

ROOT = Path(eomgen.__file__).parents[1]


BREAKING = """
format = 1
name = "breaking"
gravity = [0, 0, 0]

[bodies.slug]
mass = 1.0

[joints.slide]
type = "prismatic"
parent = "base"
child = "slug"
axis = [1, 0, 0]

[efforts.root]
joint = "slide"
effort = "sqrt(0.5 - t)"
"""


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML, encoding="utf-8")
    return path


def _run(words: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    code = main(words)
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err + captured.out
    return code, captured.out, captured.err


@pytest.mark.slow
def test_a_backend_that_matplotlib_does_not_have_is_one_message() -> None:
    script = "import eomgen.base.figures as f; f.new_figure((1, 1))"
    environment = {**os.environ, "MPLBACKEND": "nonsense"}
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False)
    assert "usage error: MPLBACKEND: matplotlib has no backend 'nonsense'; try: MPLBACKEND=agg, or" in done.stderr


@pytest.mark.slow
def test_numerical(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = tmp_path / "breaking.toml", tmp_path / "out"
    path.write_text(BREAKING, encoding="utf-8")
    code, _, message = _run(["simulate", str(path), "--out", str(out), "--t-end", "1", "--no-plots"], capsys)
    assert code == 6
    assert (
        "stopped at t = 0." in message
        and "Q (the generalized force)" in message
        and "where in a formula sqrt(-0.001) has no value at t = 0.501; try: another start, or a formula that"
        in message
    )
    partial = eomgen.Solution.load(out / "solution.npz")
    assert not partial.success and 400 < len(partial.t) <= 501
    assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["success"] is False


LEAVING = """
format = 1
name = "leaving"
curves.force.points = [[-0.1, -10], [0, 0], [0.1, 10]]
curves.hump.bump = { length = 50, height = 1, position = -20 }

[bodies.slug]
mass = 1.0

[joints.slide]
type = "prismatic"
parent = "base"
child = "slug"
axis = [0, 0, 1]
initial = { velocity = 3 }
"""
SPRING = """
[efforts.spring]
joint = "slide"
effort = "%s"
"""
TYRE = """
[parameters]
speed = { value = 1, tunable = true }

[points.hub]
body = "slug"
position = [0, 0, 0.299]

[tyres.tyre]
center = "hub"
radius = 0.3
stiffness = 2e5
damping = 300
road = "0.001 * force(speed * t)"
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "law",
    [
        TYRE,
        *(
            SPRING % law
            for law in ("max(-20, min(20, -force(q.slide)))", "sign(-force(q.slide))", "hump(force(q.slide))")
        ),
    ],
    ids=["tyre", "limits", "sign", "bump"],
)
def test_a_curve_that_is_left_stops_the_run(law: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Beyond its points a curve is not a number: a tyre, a limit, a sign or another curve does not hide that."""
    path = tmp_path / "leaving.toml"
    path.write_text(LEAVING + law, encoding="utf-8")
    code, _, message = _run(
        ["simulate", str(path), "--out", str(tmp_path / "out"), "--t-end", "1", "--no-plots"], capsys
    )
    assert code == 6 and "a value became infinite or not a number; " in message
    told = [line for line in message.splitlines() if not line.startswith("note: the curve hump changes nothing")]
    assert told[0].endswith('; try: points that reach further, or outside = "hold" or "periodic"')
    said = (
        r"Q \(the generalized force\), component v.slide at t = \S+ s, where the curve force has points from -0.1 to"
        r" 0.1 "
    )
    found = re.search(said + "and is asked at (.*);", message)
    assert found and 0.1 < float(found[1]) < 0.11


def test_interrupted(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import importlib

    @contextmanager
    def interrupting(title: str) -> Iterator[Callable[[int, int], None]]:
        yield lambda done, total: os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(importlib.import_module("eomgen.cli.running"), "terminal_bar", interrupting)
    out = tmp_path / "out"
    words = ["simulate", str(scene_file), "--out", str(out), "--t-end", "1e4", "--record-every", "10", "--no-plots"]
    code, _, message = _run(words, capsys)
    assert code == 130
    assert message.startswith("interrupted at t = ")
    partial = eomgen.Solution.load(out / "solution.npz")
    assert partial.interrupted and partial.message in message and 0 < partial.t[-1] < 1e4


@pytest.mark.slow
def test_a_mistake_in_a_process_of_its_own_shows_no_traceback_but_on_request(scene_file: Path) -> None:
    scene_file.write_text("format = 1\nname = \n", encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    words = [sys.executable, "-m", "eomgen", "info", str(scene_file)]
    plain = subprocess.run(words, capture_output=True, text=True, env=environment, check=False)
    assert (plain.returncode, plain.stdout) == (3, "")
    assert (
        plain.stderr.startswith("description error: scene.toml:2: this is not TOML") and "Traceback" not in plain.stderr
    )
    loud = subprocess.run([*words, "--debug"], capture_output=True, text=True, env=environment, check=False)
    assert loud.returncode == 3 and "Traceback" in loud.stderr


def test_a_fault_of_ours_is_called_one(
    scene_file: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from eomgen.pipeline import documents

    def broken(*_: object, **__: object) -> None:
        raise KeyError("lost")

    monkeypatch.setattr(documents, "load_scene", broken)
    code, _, message = _run(["info", str(scene_file)], capsys)
    assert code == 1
    assert plain(message) == "internal error: KeyError: 'lost'; this is a fault of eomgen; try: the same with --debug\n"


def test_ctrl_c_while_a_class_is_made_is_an_interruption(
    scene_file: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from eomgen.pipeline import documents

    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("Error calling __set_name__") from KeyboardInterrupt()

    monkeypatch.setattr(documents, "load_scene", broken)
    code, _, message = _run(["info", str(scene_file)], capsys)
    assert (code, message) == (130, "interrupted\n")


def test_ctrl_c_while_parts_are_imported_leaves_no_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Importing:
        def __getattr__(self, name: str) -> object:
            raise KeyboardInterrupt

    from eomgen.__main__ import COLLECTOR_THRESHOLDS, run

    monkeypatch.setitem(sys.modules, "eomgen.cli", Importing())
    of_tests = gc.get_threshold()
    try:
        assert run() == 130
        assert gc.get_threshold() == COLLECTOR_THRESHOLDS
    finally:
        gc.set_threshold(*of_tests)
    assert capsys.readouterr().err == "interrupted\n"
