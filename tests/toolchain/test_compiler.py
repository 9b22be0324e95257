"""The compiler: found or named as missing, run in parallel, and quoted when it fails."""

from __future__ import annotations

import os
import shutil
import signal
import stat
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.programs import FLAGS
from eomgen.errors import ToolchainError
from eomgen.toolchain.compiler import (
    Compilation,
    Compiler,
    RunningCompilers,
    compile_library,
    compilers_at_once,
    find_compiler,
    library_suffix,
    processor_digest,
)
from eomgen.toolchain.profiles import PROFILES, profile

CODE = "int answer(void) { return 42; }\n"


def fake(folder: Path, name: str, script: str) -> Path:
    """Write an executable that stands for a compiler."""
    file = folder / name
    file.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    file.chmod(file.stat().st_mode | stat.S_IXUSR)
    return file


def source(folder: Path, text: str = CODE, name: str = "answer.c") -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def test_cc_is_obeyed_with_its_options_and_missed_by_name(tmp_path: Path) -> None:
    fake(tmp_path, "mycc", "exit 0")
    compiler = find_compiler({"PATH": str(tmp_path), "CC": "mycc -m64"})
    assert compiler.command == ("mycc", "-m64")
    assert compiler.path == tmp_path / "mycc"
    with pytest.raises(ToolchainError, match="environment variable CC: no C compiler 'icc' on the path; try: unset CC"):
        find_compiler({"PATH": str(tmp_path), "CC": "icc -fast"})


def test_the_identity_changes_with_the_compiler(tmp_path: Path) -> None:
    file = fake(tmp_path, "cc", "exit 0")
    before = Compiler((str(file),), file).identity
    fake(tmp_path, "cc", "exit 1; # another one")
    assert Compiler((str(file),), file).identity != before


def test_of_the_sources_that_wait_the_longest_is_compiled_first(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    file = fake(
        tmp_path, "cc", f'for w; do case "$w" in *.c) basename "$w" >> {log}; sleep 0.3;; esac; done; exec cc "$@"'
    )
    texts = {"first": "int f1;\n", "short": "int f2;\n", "long": "/* " + 500 * "x" + " */ int f3;\n"}
    sources = [source(tmp_path, text, f"{name}.c") for name, text in texts.items()]
    with Compilation(Compiler((str(file),), file), ("-O0",), jobs=1) as compilation:
        compilation.add(sources[0])
        while not log.exists():
            time.sleep(0.01)
        for later in sources[1:]:
            compilation.add(later)
        commands = compilation.link(sources, tmp_path / f"m{library_suffix()}", list)
    assert log.read_text(encoding="utf-8").split() == ["first.c", "long.c", "short.c"]
    assert [command.rpartition("/")[2] for command in commands[:3]] == ["first.o", "short.o", "long.o"]


def test_a_compiler_that_only_fails_is_quoted_too(tmp_path: Path) -> None:
    file = fake(tmp_path, "cc", "echo licence expired >&2; exit 3")
    with pytest.raises(ToolchainError, match=r"ended with status 3 and said:\nlicence expired"):
        compile_library(Compiler((str(file),), file), [source(tmp_path)], tmp_path / "x.so", ())
    silent = fake(tmp_path, "cc2", "exit 9")
    with pytest.raises(ToolchainError, match=r"status 9 and said:\n\(it said nothing\)"):
        compile_library(Compiler((str(silent),), silent), [source(tmp_path)], tmp_path / "x.so", ())


def test_a_compiler_that_hangs_is_ended(tmp_path: Path) -> None:
    file = fake(tmp_path, "cc", "exec sleep 60")
    start = time.monotonic()
    with pytest.raises(ToolchainError, match="did not finish in time; try: a longer timeout"):
        compile_library(Compiler((str(file),), file), [source(tmp_path)], tmp_path / "x.so", (), timeout=0.3)
    assert time.monotonic() - start < 20


@pytest.mark.skipif(sys.platform != "linux", reason="the ends of processes are read from /proc")
@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL])
def test_compilers_end_with_their_process(tmp_path: Path, end: signal.Signals) -> None:
    """The parts of a compiler, of which a shell and its child here, too: the signal is not passed on by Python."""
    parts = tmp_path / "parts"
    file = fake(tmp_path, "cc", f"sleep 100 & echo $$ $! > {parts}.new; mv {parts}.new {parts}; wait")
    (tmp_path / "answer.c").write_text("int answer;", encoding="utf-8")
    words = f"Compiler(({str(file)!r},), Path({str(file)!r})), Path({str(tmp_path / 'answer.c')!r}), ()"
    script = f"from pathlib import Path\nfrom eomgen.toolchain.compiler import *\ncompile_object({words})"
    with subprocess.Popen([sys.executable, "-c", script]) as process:
        wait_for(parts.is_file)
        process.send_signal(end)
    left = [Path("/proc", number) for number in parts.read_text(encoding="utf-8").split()]
    wait_for(lambda: not any(running(path) for path in left))


def running(path: Path) -> bool:
    """Return whether a process, a folder of /proc, is there and no zombie."""
    try:
        return ") Z " not in (path / "stat").read_text(encoding="utf-8")
    except OSError:
        return False


def wait_for(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_compiler_that_cannot_be_executed_is_reported(tmp_path: Path) -> None:
    file = tmp_path / "cc"
    file.write_text("not a program", encoding="utf-8")
    with pytest.raises(ToolchainError, match="does not run: Permission denied"):
        compile_library(Compiler((str(file),), file), [source(tmp_path)], tmp_path / "x.so", ())


def test_versions_profiles_and_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    compiler = find_compiler()
    assert any(character.isdigit() for character in compiler.version)
    assert "-ffp-contract=off" in profile("reproducible").flags
    assert not profile("reproducible").native
    assert not any("fast-math" in flag for name in ("fast", "reproducible", "quick") for flag in profile(name).flags)
    with pytest.raises(ToolchainError, match="no build profile 'turbo'; try: one of fast, reproducible, quick"):
        profile("turbo")
    monkeypatch.setenv("EOMGEN_PROFILE", "turbo")
    with pytest.raises(ToolchainError, match="environment variable EOMGEN_PROFILE: no build profile 'turbo'; try: one"):
        profile("turbo")
    assert processor_digest() == processor_digest()
    assert len(processor_digest()) == 16
    assert shutil.which(compiler.command[0]) is not None


@pytest.mark.parametrize(("named", "standard"), [(None, "fast"), ("", "fast"), ("reproducible", "reproducible")])
def test_a_variable_names_the_profile_where_a_caller_says_none(named: str | None, standard: str) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "EOMGEN_PROFILE"}
    environment |= {} if named is None else {"EOMGEN_PROFILE": named}
    said = [sys.executable, "-c", "from eomgen.toolchain.builder import Builder; print(Builder().profile.name)"]
    ran = subprocess.run(said, env=environment, check=True, capture_output=True, text=True)
    assert ran.stdout.split() == [standard]


def test_what_is_made_for_this_processor_has_no_vectors_of_neighbouring_statements() -> None:
    """gcc 12.2.0 (Debian 12.2.0-14), -O2 -march=native, on a processor with AVX-512: a row of ``equations`` of a chain
    of twenty hinges was wrong by 65 N while neighbouring sums were put into 512 bits (commit c98a19e);
    -fno-tree-slp-vectorize, vectors of 256 bits and -O1 mended it. It could not be had again on another processor, nor
    by 15 500 random functions, so there is no small case: the flag stays where 512 bits may be used, and
    ``tests/simulation/test_chains.py`` holds that chain's functions against each other.
    """
    flag = "-fno-tree-slp-vectorize"
    assert profile("fast").native
    for one in PROFILES.values():
        assert one.native == ("-march=native" in one.flags)
        assert flag in one.flags or not one.native
    assert flag in FLAGS["fast"]
    assert set(profile("fast").flags) < set(FLAGS["fast"])  # what benchmarks call by its name


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="this system does not say what a process may use")
@pytest.mark.parametrize(("own", "compilers"), [(1, 2), (2, 2), (6, 6), (64, 8)])
def test_files_are_compiled_side_by_side(own: int, compilers: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(own)))
    assert compilers_at_once() == compilers


def test_a_compiler_in_a_thread_of_the_background_can_be_stopped_and_does_not_keep_the_process(tmp_path: Path) -> None:
    """At the end of a process Python waits for the threads of pools before it says so to anyone."""
    began = tmp_path / "began"
    file = fake(tmp_path, "cc", f"touch {began}; exec sleep 60")
    running, failures = RunningCompilers(), []

    def work() -> None:
        try:
            with Compilation(Compiler((str(file),), file), (), jobs=1, running=running) as compilation:
                compilation.add(file_of_c := source(tmp_path))
                compilation.link([file_of_c], tmp_path / "x.so", list)
        except ToolchainError as error:
            failures.append(str(error))

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    while not began.exists():
        time.sleep(0.01)
    running.stop()
    thread.join(20)
    assert not thread.is_alive()
    assert len(failures) == 1 and "was ended with its process" in failures[0]
