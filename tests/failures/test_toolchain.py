"""Broken compilers, caches and disks: which of them, and what to try."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import eomgen
from eomgen.codegen.folder import write_folder
from eomgen.toolchain.cache import Cache
from eomgen.toolchain.compiler import Compiler, compile_object
from tests.models.scenes import PENDULUM_TOML

ROOT = Path(eomgen.__file__).parents[1]


def script(file: Path, text: str) -> Path:
    file.write_text(f"#!/bin/sh\n{text}\n")
    file.chmod(0o755)
    return file


def test_a_compiler_that_only_says_it_worked_is_caught(tmp_path: Path) -> None:
    source = tmp_path / "probe.c"
    source.write_text("int probe;\n")
    idle = script(tmp_path / "idle", "echo nothing to do")
    with pytest.raises(eomgen.ToolchainError, match=r"reported success but wrote no probe\.o, and said:\nnothing to"):
        compile_object(Compiler((str(idle),), idle), source, ())


@pytest.mark.slow
def test_a_relative_cache_is_a_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("EOMGEN_CACHE", "here")
    scene = tmp_path / "shaken.toml"
    scene.write_text(PENDULUM_TOML)
    assert eomgen.build(scene, terms=["mass"], profile="quick").mass([0.0]).shape == (1, 1)
    assert list((tmp_path / "here").glob("*/model*"))


def test_full_disks_under_cache_and_temporary_folder_are_named(tmp_path: Path) -> None:
    def fill(folder: Path) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.warns(RuntimeWarning, match="No space left"), pytest.raises(eomgen.FileError) as caught:
        Cache(tmp_path).put("key", fill)
    assert (
        str(caught.value)
        == f"input/output error: cache {tmp_path}: a compiled model cannot be kept: No space left on device; "
        "try: space there, or EOMGEN_CACHE=<another folder>"
    )


def test_a_folder_that_was_cut_short_can_be_written_again(tmp_path: Path) -> None:
    half = {"a.c": "int a;\n", "manifest.json": '{"generator": "eomgen", "files": []}', "z.c": "\ud800"}
    with pytest.raises(UnicodeEncodeError):
        write_folder(half, tmp_path / "out")
    write_folder({"a.c": "int b;\n"}, tmp_path / "out")
    assert (tmp_path / "out" / "a.c").read_text() == "int b;\n"


#: Runs Python anew with interrupts heard: a shell lets the children of jobs in the background ignore them.
_HEARING = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.SIG_DFL)
os.execv(sys.executable, [sys.executable, *sys.argv[1:]])
"""


def _interrupted(process: subprocess.Popen[str]) -> str:
    """Send Ctrl-C to Python alone (a terminal would tell the compiler too) and return what it says, long before the
    compiler would end.

    Python loses an interrupt that arrives inside a finalizer, as any user's Ctrl-C may be lost; then comes another.
    """
    for _ in range(4):
        process.send_signal(signal.SIGINT)
        try:
            return process.communicate(timeout=10)[1]
        except subprocess.TimeoutExpired:
            continue
    process.send_signal(signal.SIGABRT)  # says where every thread is, see PYTHONFAULTHANDLER
    raise AssertionError(f"four interrupts were not heard: {process.communicate(timeout=10)[1]}")


@pytest.mark.slow
def test_an_interrupt_does_not_wait_for_the_compiler(tmp_path: Path) -> None:
    started = tmp_path / "started"
    slow = script(
        tmp_path / "slow", f'case "$*" in *--version*|*wrapper*) exec cc "$@";; esac\ntouch {started}\nexec sleep 60'
    )
    scene = tmp_path / "shaken.toml"
    scene.write_text(PENDULUM_TOML)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "CC": str(slow), "EOMGEN_CACHE": str(tmp_path / "cache")}
    environment["PYTHONFAULTHANDLER"] = "1"
    command = [sys.executable, "-c", _HEARING, "-m", "eomgen", "simulate", str(scene), "--out", str(tmp_path / "out")]
    with subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True, cwd=tmp_path) as process:
        deadline = time.monotonic() + 60
        while not started.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        assert started.exists()
        said = _interrupted(process)
    assert (process.returncode, said.strip()) == (130, "interrupted")
