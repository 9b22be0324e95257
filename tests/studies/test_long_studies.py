"""Studies that take long: lines on stderr without a terminal, and results that Ctrl-C leaves."""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from eomgen.base import progress
from eomgen.base.progress import Reporter
from eomgen.cli import main
from tests.models.scenes import PENDULUM_TOML

_RUNS, _MODELS = "eomgen.products.studies.run_commands", "eomgen.products.studies.model_commands"
_SHORT = ("--t-end", "0.2")
#: Module, and options, of the command of each verb.
VERBS: dict[str, tuple[str, tuple[str, ...]]] = {
    "check": (_MODELS, ("--states", "2", "--only", "mass", "--only", "force", "--out", "out")),
    "savings": (_MODELS, ("--only", "all terms", "--only", "moving base", "--rounds", "2", "--out", "out")),
    "tradeoff": (
        _RUNS,
        (*_SHORT, "--methods", "rk4,rk45", "--axes", "method,resolution", "--budget", "2", "--out", "out"),
    ),
    "tune": (_RUNS, (*_SHORT, "--methods", "rk4", "--axes", "method", "--error", "1e-3", "--budget", "5")),
    "extremes": (_RUNS, ("--ladders", "step", "--methods", "rk4", "--out", "out")),
    "ensemble": (
        "eomgen.products.ensembles.command",
        (*_SHORT, "--vary", "q.hinge=normal(0, 0.1)", "--samples", "300", "--no-plots", "--out", "out"),
    ),
}


@pytest.fixture(autouse=True)
def pendulum(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["check", "tune", "ensemble"])
def test_lines_on_stderr_tell_the_progress_without_a_terminal(
    verb: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(progress._DELAYS, "first line", 0.0)
    monkeypatch.setitem(progress._DELAYS, "lines", 0.0)
    assert main([verb, "scene.toml", *VERBS[verb][1]]) == 0
    told = capsys.readouterr().err
    assert re.search(r"^[\w ]+: .* after \d+ s", told, re.MULTILINE), told


@contextmanager
def _interrupted(title: str) -> Iterator[Reporter]:
    """Give a display in which Ctrl-C comes after two parts of the work, or while a winner is verified."""

    def report(done: int, total: int) -> None:
        if done >= 2:
            raise KeyboardInterrupt

    def stage(text: str) -> None:
        if text.startswith("verifying"):
            raise KeyboardInterrupt

    yield Reporter(report, lambda _: None, stage)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("verb", "told"),
    [
        ("check", r"^interrupted: 2 closed forms agree, and \d+ are not checked$"),
        ("savings", r"^written: "),
        ("tradeoff", r"^interrupted: \d+ runs are kept in out: --resume goes on with them$"),
        ("tune", r"^interrupted: the cheapest so far, which is not verified, has method = 'rk4', step = "),
        ("extremes", r"^interrupted: finished cells are kept in out: --resume goes on with them$"),
    ],
)
def test_ctrl_c_keeps_what_is_done(
    verb: str, told: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    module, options = VERBS[verb]
    with monkeypatch.context() as patch:
        patch.setattr(importlib.import_module(module), "terminal_bar", _interrupted)
        assert main([verb, "scene.toml", *options]) == 130
    assert re.search(told, capsys.readouterr().err, re.MULTILINE)
    if verb in ("tradeoff", "extremes"):
        assert main([verb, "scene.toml", *options, "--resume"]) == 0
    elif verb == "check":
        report = json.loads(Path("out/check.json").read_text(encoding="utf-8"))
        assert len(report["forms"]) == 2 and report["unchecked"] and not report["passed"]
    elif verb == "savings":
        costs = json.loads(Path("out/savings.json").read_text(encoding="utf-8"))["variants"]
        assert costs[0]["step_seconds"] > 0.0 and costs[-1]["problem"] == "interrupted before it was built"
