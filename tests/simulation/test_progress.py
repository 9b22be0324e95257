"""Bars of progress: in notebooks and on terminals, by ``progress=True``."""

import re
import sys
import time
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

import eomgen
from eomgen.base import progress
from eomgen.base.progress import counted_units, terminal_bar, told_by, waiting


@pytest.fixture
def model() -> eomgen.Model:
    return eomgen.build("examples/spherical_pendulum/scene.toml", profile="quick")


def _notebook(monkeypatch: pytest.MonkeyPatch, kernel: object) -> list[str]:
    """Let this process be a notebook's, and return the pages that its browser gets."""
    pages: list[str] = []
    handle = SimpleNamespace(update=pages.append)

    def display(page: str, *, display_id: bool) -> Any:
        assert display_id
        pages.append(page)
        return handle

    shell, shows = ModuleType("IPython"), ModuleType("IPython.display")
    shell.get_ipython = lambda: SimpleNamespace(kernel=kernel)  # type: ignore[attr-defined]
    shows.HTML, shows.display = str, display  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", shell)
    monkeypatch.setitem(sys.modules, "IPython.display", shows)
    return pages


def _be_terminal(monkeypatch: pytest.MonkeyPatch, patience: float) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setitem(progress._DELAYS, "bar", patience)
    monkeypatch.setitem(progress._DELAYS, "compilers", patience)


def test_a_terminal_gets_a_bar_for_a_run_that_lasts(
    model: eomgen.Model, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    _be_terminal(monkeypatch, 0.02)
    with terminal_bar("arm") as bar:
        assert bar is not None
        assert model.simulate(2e-3, 1e-3, progress=bar).success
        time.sleep(0.2)
    text = capsys.readouterr().err
    assert "arm" in text and "100.0 %" in text


def test_a_pipe_gets_a_line_after_ten_seconds_and_then_one_a_minute(
    monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    clock = iter([0.0, 5.0, 12.0, 65.0, 75.0, 150.0])
    monkeypatch.setattr("eomgen.base.progress.time.monotonic", lambda: next(clock))
    with terminal_bar("arm") as bar:
        assert bar is not None
        for done in (100, 200, 210, 400):
            bar(done, 1000)
        bar.stage("verifying")
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "arm: 20 % after 12 s, about 96 s left",
        "arm: 40 % after 75 s, about 2 min left",
        "arm: verifying, after 2 min",
    ]


@pytest.mark.parametrize("wrong", [3, "yes"])
def test_what_is_no_function_is_refused(model: eomgen.Model, wrong: Any) -> None:
    text = rf"progress: {wrong!r} is neither a function nor True; try: True for a bar, or a function of \(steps done"
    with pytest.raises(eomgen.UsageError, match=text):
        model.simulate(0.1, 1e-3, progress=wrong)


@pytest.mark.slow
def test_compilers_count_their_files_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path))
    _be_terminal(monkeypatch, 0.0)
    eomgen.build("examples/spherical_pendulum/scene.toml", profile="quick")
    text = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", capsys.readouterr().err)
    assert re.search(r"compiling spherical_pendulum .*([2-9])/\1 0:00:", text)


@pytest.mark.parametrize(
    ("patience", "shown"),
    [(60.0, []), (0.0, ["compiling arm: 2 of 3 files, 0 s", "compiling arm: 3 of 3 files, 0 s", ""])],
)
def test_compilers_count_their_files_in_a_notebook(
    monkeypatch: pytest.MonkeyPatch, patience: float, shown: list[str]
) -> None:
    pages = _notebook(monkeypatch, kernel=object())
    monkeypatch.setitem(progress._DELAYS, "compilers", patience)
    with counted_units("compiling arm") as report:
        assert report is not None
        report(2, 3)
        report(3, 3)
    assert pages == shown


def test_compilers_tell_a_display_that_is_there(monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    _be_terminal(monkeypatch, 0.0)
    told: list[str] = []
    with told_by(told.append), counted_units("compiling arm") as report:
        assert report is not None
        report(1, 2)
    assert told == ["compiling arm: 1 of 2 files, 0 s"]
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("display", [terminal_bar, waiting, counted_units])
def test_a_terminal_shows_what_lasts_and_ctrl_c_erases_it(
    display: Any, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    _be_terminal(monkeypatch, 1.0)
    with display("arm"):
        pass
    assert capsys.readouterr().err == ""
    _be_terminal(monkeypatch, 0.02)
    with pytest.raises(KeyboardInterrupt), display("arm"):
        time.sleep(0.2)
        raise KeyboardInterrupt
    text = capsys.readouterr().err
    assert "arm" in text and text.endswith("\x1b[2K")
