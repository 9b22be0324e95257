"""Figures that a copy of the process draws: the same files, in the same order, and none if one of them fails."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from eomgen.base.drawing_process import Drawing, Drawings, compute_in_copy, drawing_process, in_copy, own_process


@pytest.fixture
def forking(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the process have one thread and two cores, so that it is copied."""
    monkeypatch.setattr(threading, "active_count", lambda: 1)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})


ONLY_LINUX = pytest.mark.skipif(sys.platform != "linux", reason="the process is copied by fork on Linux alone")
EXAMPLE = Path(__file__).parents[2] / "examples" / "quarter_car" / "scene.toml"


def writer(folder: Path, name: str) -> Drawing:
    def draw() -> list[Path]:
        if name == "impossible":
            raise ValueError(name)
        (folder / name).write_text(f"{os.getpid()}", encoding="utf-8")
        return [folder / name]

    return draw


def prepared(folder: Path) -> Callable[[], Drawings]:
    def drawings(order: Mapping[str, Any]) -> list[Drawing]:
        return [writer(folder, name) for name in order["names"]]

    return lambda: drawings


@pytest.mark.slow_except("0", "1")
@ONLY_LINUX
@pytest.mark.parametrize("count", [0, 1, 2, 9])
def test_copies_draw_every_figure_once_and_in_order(tmp_path: Path, forking: None, count: int) -> None:
    names = [f"{number}.png" for number in range(count)]
    with drawing_process(prepared(tmp_path)) as copy:
        assert copy is not None
        copy.order({"names": names})
        drawn = copy.files()
    # Without a figure there is nobody to share with, and the files of none are drawn by the caller.
    assert drawn == (names if count else None)
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    assert str(os.getpid()) not in {path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}


@ONLY_LINUX
def test_a_figure_that_fails_leaves_all_to_the_caller(
    tmp_path: Path, forking: None, capfd: pytest.CaptureFixture[str]
) -> None:
    with drawing_process(prepared(tmp_path)) as copy:
        assert copy is not None
        copy.order({"names": ["first.png", "impossible"]})
        assert copy.files() is None
    assert capfd.readouterr() == ("", "")


def test_a_process_with_threads_is_not_copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threading, "active_count", lambda: 2)
    with drawing_process(prepared(tmp_path)) as copy, in_copy(writer(tmp_path, "table")) as done:
        assert copy is None
        assert not done()
    assert not list(tmp_path.iterdir())


@ONLY_LINUX
def test_work_is_done_by_a_copy_unless_it_fails(
    tmp_path: Path, forking: None, capfd: pytest.CaptureFixture[str]
) -> None:
    for name, success in (("table", True), ("impossible", False)):
        with in_copy(writer(tmp_path, name)) as done:
            assert [done(), done()] == [success, success]
    (written,) = tmp_path.iterdir()
    assert written.read_text(encoding="utf-8") != f"{os.getpid()}"
    assert capfd.readouterr() == ("", "")


@ONLY_LINUX
def test_a_value_comes_from_a_copy_of_an_own_process(forking: None) -> None:
    with compute_in_copy(os.getpid) as value:
        assert value() is None
    with own_process(), compute_in_copy(lambda: (os.getpid(), "x" * 100_000)) as value:  # more than a pipe holds
        number, text = value() or (os.getpid(), "")
        assert number != os.getpid() and len(text) == 100_000
    with own_process(), compute_in_copy([].pop) as nothing:
        assert nothing() is None


@ONLY_LINUX
def test_work_of_a_copy_ends_with_an_interrupted_caller(tmp_path: Path, forking: None) -> None:
    began, begins = os.pipe()

    def work() -> None:
        try:
            os.write(begins, b"1")
            for _ in range(6000):  # a signal just before one long sleep would be heard after it
                time.sleep(0.01)
        finally:
            (tmp_path / "cleaned").touch()

    with pytest.raises(KeyError), in_copy(work):
        os.read(began, 1)
        raise KeyError
    assert [path.name for path in tmp_path.iterdir()] == ["cleaned"]


@pytest.mark.long
@pytest.mark.slow
def test_pictures_of_a_run_are_the_same_from_a_copy(tmp_path: Path) -> None:
    import eomgen.cli

    words = ["simulate", str(EXAMPLE), "--t-end", "0.2", "--out"]
    subprocess.run([sys.executable, "-m", "eomgen", *words, str(tmp_path / "copy")], check=True, capture_output=True)
    started = threading.Event()
    other = threading.Thread(target=started.wait)  # with a thread the figures are drawn here
    other.start()
    try:
        assert eomgen.cli.main([*words, str(tmp_path / "here")]) == 0
    finally:
        started.set()
        other.join()
    pictures = {path.name: path.read_bytes() for path in (tmp_path / "copy").glob("*.png")}
    assert len(pictures) >= 3
    assert pictures == {path.name: path.read_bytes() for path in (tmp_path / "here").glob("*.png")}
