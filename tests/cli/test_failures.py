"""Each kind of failure: one message on stderr that says where and what, no traceback, its own exit code."""

from __future__ import annotations

import gc
import json
import os
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
from tests.models.library import scene_file as written_scene
from tests.models.scenes import PENDULUM_TOML

ROOT = Path(eomgen.__file__).parents[1]


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
    free, out = {"joints__slide__stiffness": None, "joints__slide__initial": None, "simulation": None}, tmp_path / "out"
    root = {"root": {"joint": "slide", "effort": "sqrt(0.5 - t)"}}
    path = written_scene(tmp_path, "oscillator", efforts=root, outputs=None, **free)
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


@pytest.mark.parametrize(
    ("error", "cause", "code", "text"),
    [
        (KeyError("lost"), None, 1, "internal error: KeyError: 'lost'; this is a fault of eomgen; try: the same with"),
        (RuntimeError("Error calling __set_name__"), KeyboardInterrupt(), 130, "interrupted"),
        (
            OSError(28, "No space left on device", "run.csv"), None, 7,
            "input/output error: run.csv: No space left on device; try: free space on the disk, or another",
        ),
    ],
    ids=["fault of ours", "ctrl-c while a class is made", "full disk"],
)  # fmt: skip  # a table
def test_errors_from_within_are_told_by_their_kind(
    error: Exception, cause: BaseException | None, code: int, text: str,
    scene_file: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    from eomgen.pipeline import documents

    def broken(*_: object, **__: object) -> None:
        raise error from cause

    monkeypatch.setattr(documents, "load_scene", broken)
    found, _, message = _run(["info", str(scene_file)], capsys)
    assert found == code and plain(message).startswith(text) and message.count("\n") == 1


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
