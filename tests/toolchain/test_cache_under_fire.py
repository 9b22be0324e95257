"""The cache on hostile days: crowds, kills, full and read-only disks, broken entries, two compilers."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from eomgen.base import locks
from eomgen.errors import ToolchainError
from eomgen.toolchain import cache as cache_module
from eomgen.toolchain.builder import Builder
from eomgen.toolchain.cache import ABANDONED_AFTER, Cache
from eomgen.toolchain.compiler import Compiler, compile_object, find_compiler
from tests.toolchain.fire import (
    NOTHING_LEFT,
    building,
    command,
    left_in,
    mounted,
    remounted,
    scene_in,
    script,
)
from tests.toolchain.test_builder import CDEF, FILES, LAYOUT, build
from tests.toolchain.test_cache import fill

pytestmark = pytest.mark.slow


def value(library) -> float:
    y = np.zeros(1)
    library.call("f", [np.ones(1), np.ones(2)], [y])
    return float(y[0])


def end(process: subprocess.Popen[str]) -> str:
    """Return what a process printed, which must be all that it said."""
    printed, complaint = process.communicate(timeout=120)
    assert (process.returncode, complaint) == (0, "")
    return printed


def wait_for(file: Path) -> None:
    deadline = time.monotonic() + 60
    while not file.exists():
        assert time.monotonic() < deadline, f"{file} did not come"
        time.sleep(0.01)


# -- crowds and kills --------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_eight_processes_build_one_scene_and_one_of_them_compiles(tmp_path: Path) -> None:
    scene, cache, log = scene_in(tmp_path), tmp_path / "cache", tmp_path / "log"
    counting = script(tmp_path / "counting", f'echo "$*" >> {log}\nexec cc "$@"')
    processes = [building(scene, cache, CC=str(counting)) for _ in range(8)]
    printed = {end(process) for process in processes}
    assert len(printed) == 1 and len(printed.pop()) > 100
    objects = [line.split()[-1].rpartition("/")[2] for line in log.read_text().splitlines() if " -c " in line]
    assert {"shaken.o", "wrapper.o"} < set(objects)
    assert len(objects) == len(set(objects)), objects
    assert left_in(cache) == NOTHING_LEFT
    # each object, the library, and the structure by which its texts are found
    assert len([path for path in cache.iterdir() if (path / "entry.json").exists()]) == len(objects) + 2


@pytest.mark.long
def test_kills_at_any_moment_leave_nothing_in_the_way(tmp_path: Path) -> None:
    scene, cache = scene_in(tmp_path), tmp_path / "cache"
    lengths = random.Random(4)
    for _ in range(6):
        process = building(scene, cache)
        time.sleep(lengths.uniform(0.1, 1.6))
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
    first = end(building(scene, cache))
    assert first == end(building(scene, cache))
    left = left_in(cache)
    assert left["claims"] == [] and left["failed"] == []
    long_ago = time.time() - 2 * ABANDONED_AFTER
    for name in left["tmp"]:  # what was being built when the kill came: cleared away by a later build, after a while
        os.utime(cache / name, (long_ago, long_ago))
    Cache(cache).put("another", lambda folder: None)
    assert left_in(cache) == NOTHING_LEFT


def test_who_waits_for_a_process_that_is_killed_builds_himself(tmp_path: Path) -> None:
    scene, cache = scene_in(tmp_path), tmp_path / "cache"
    dawdle, started = tmp_path / "dawdle", tmp_path / "started"
    dawdle.touch()
    slow = script(tmp_path / "slow", f'if [ -e {dawdle} ]; then touch {started}; exec sleep 100; fi\nexec cc "$@"')
    first = building(scene, cache, CC=str(slow))
    wait_for(started)
    second = building(scene, cache, CC=str(slow))
    time.sleep(1.0)
    assert second.poll() is None
    dawdle.unlink()
    os.killpg(first.pid, signal.SIGKILL)
    first.communicate()
    assert len(end(second)) > 100
    assert left_in(cache)["claims"] == []


def test_without_locks_everybody_builds_for_himself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(locks, "fcntl", None)
    cache = Cache(tmp_path)
    with cache.claim("key"), cache.claim("key"):
        assert cache.put("key", lambda folder: None).files == ()
    assert left_in(tmp_path) == NOTHING_LEFT


# -- what killed and failed builds leave -------------------------------------------------------------------------------


def test_interrupted_builds_leave_nothing(tmp_path: Path) -> None:
    def interrupted(folder: Path) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Cache(tmp_path).put("key", interrupted)
    assert left_in(tmp_path) == NOTHING_LEFT


# -- disks -------------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_run_on_a_full_disk_ends_with_a_note_and_leaves_the_disk_as_it_was(tmp_path: Path) -> None:
    """In memory where that can be mounted; else a limit on the size of files, also of temporary ones, comes nearest."""
    size = 90_000
    scene, cache = scene_in(tmp_path), tmp_path / "small"
    words = ["simulate", str(scene), "--out", str(tmp_path / "out"), "--t-end", "0.01", "--no-plots"]
    with mounted(cache, f"size={size}") as full:
        done = command(words, cache, None if full else size // 10)
        said = done.stderr.splitlines()
        assert done.returncode == (0 if full else 7), done.stderr
        assert (
            f"warning: the cache {cache} cannot be written (" in said[0] and "Set EOMGEN_CACHE to a folder" in said[0]
        )
        assert any(w in said[0] for w in ("No space left on device", "File too large", "File size limit exceeded"))
        if not full:
            assert said[-1].startswith("input/output error: ") and "try: space there, or EOMGEN_CACHE=" in said[-1]
        assert sum("cannot be written" in line for line in said) == 1
        assert left_in(cache) == NOTHING_LEFT
    assert command(words, tmp_path / "large").returncode == 0


@pytest.mark.long
def test_a_read_only_cache_still_serves_what_is_in_it(tmp_path: Path) -> None:
    scene, cache = scene_in(tmp_path), tmp_path / "cache"
    with mounted(cache, "size=20m") as disk:
        printed = end(building(scene, cache))
        if disk:
            remounted(cache, "ro")
        else:
            cache.chmod(0o555)
        try:
            assert end(building(scene, cache)) == printed  # and not a word
            scene.write_text(
                scene.read_text(encoding="utf-8").replace('name = "shaken"', 'name = "stirred"'), encoding="utf-8"
            )
            process = building(scene, cache)
            other, complaint = process.communicate(timeout=120)
            assert other == printed and complaint.count("RuntimeWarning") == 1
            assert f"the cache {cache} cannot be written (" in complaint and "Set EOMGEN_CACHE to a folder" in complaint
            substitute = Path(complaint.partition("building in ")[2].partition(" instead")[0])
            assert substitute.name.startswith("eomgen-cache-") and not substitute.exists()
        finally:
            if not disk:
                cache.chmod(0o755)


def test_a_disk_from_which_nothing_may_run_is_named(tmp_path: Path) -> None:
    with mounted(tmp_path / "noexec", "size=20m", "noexec") as disk:
        if disk:
            with pytest.raises(
                ToolchainError, match=r"cannot be loaded: .*try: EOMGEN_CACHE=<a folder on a file system from"
            ):
                build(tmp_path / "noexec")
        else:  # only root can make such a disk; what the loader says there is known
            from eomgen.toolchain.cffi_build import unloadable

            error = unloadable(Path("x.so"), OSError("x.so: failed to map segment from shared object"))
            assert error.problems[0].hint.startswith("EOMGEN_CACHE=<a folder on a file system from")


# -- broken entries ----------------------------------------------------------------------------------------------------


def test_entries_may_be_links_to_whole_ones(tmp_path: Path) -> None:
    entry = build(tmp_path / "far").folder
    near = tmp_path / "near"
    near.mkdir()
    (near / entry.name).symlink_to(entry)
    library = Builder("quick", cache=Cache(near)).find(b"content")
    assert library is not None and value(library) == 11.0 and left_in(near) == NOTHING_LEFT


def test_a_rename_that_never_succeeds_is_a_note(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Path, target: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(cache_module.Path, "rename", refuse)
    with pytest.warns(RuntimeWarning, match=r"cannot be written \(Permission denied\); building in"):
        entry = Cache(tmp_path).put("key", fill())
    assert entry.text("data.txt") == "content"
    assert left_in(tmp_path) == NOTHING_LEFT


# -- compilers ---------------------------------------------------------------------------------------------------------


def test_two_compilers_have_entries_of_their_own(tmp_path: Path) -> None:
    cache = Cache(tmp_path / "cache")
    other = script(tmp_path / "cc2", 'exec cc "$@"')
    commands = [("cc",), ("cc", "-O1"), (str(other),), *((name,) for name in ("gcc", "clang") if shutil.which(name))]
    folders = set()
    for words in commands:
        compiler = find_compiler({"PATH": os.environ["PATH"], "CC": " ".join(words)})
        for _ in range(2):
            library = Builder("quick", cache=cache, compiler=compiler).build(b"content", FILES, CDEF, LAYOUT)
            assert value(library) == 11.0
            folders.add(library.folder)
    assert len(folders) == len(commands) >= 4
    script(other, 'exec cc  "$@"')  # a new version of a compiler
    compiler = find_compiler({"PATH": os.environ["PATH"], "CC": str(other)})
    assert Builder("quick", cache=cache, compiler=compiler).find(b"content") is None


def test_what_a_compiler_says_cannot_steer_the_terminal(tmp_path: Path) -> None:
    source = tmp_path / "probe.c"
    source.write_text("int probe;\n", encoding="utf-8")
    words = (
        r"printf '\033[31merror\033[0m: \033]0;title\007 bell\007 \b\r \342\200\256right to left\n\ttab \377\n' >&2;"
        r" exit 1"
    )
    loud = script(tmp_path / "loud", words)
    with pytest.raises(ToolchainError) as caught:
        compile_object(Compiler((str(loud),), loud), source, ())
    said = caught.value.problems[0].what.partition("said:\n")[2]
    assert said == "error: \\x1b]0;title\\x07 bell\\x07 \\x08\n \\u202eright to left\n\ttab \ufffd\n"
    quiet = script(tmp_path / "quiet", r"printf 'cc \033[1m9.9\033[0m\007\n'")
    assert Compiler((str(quiet),), quiet).version == "cc 9.9\\x07"


def test_endless_lines_of_a_compiler_are_cut(tmp_path: Path) -> None:
    source = tmp_path / "probe.c"
    source.write_text("int probe;\n", encoding="utf-8")
    loud = script(tmp_path / "loud", "head -c 100000 /dev/zero | tr '\\0' x >&2; exit 1")
    with pytest.raises(ToolchainError) as caught:
        compile_object(Compiler((str(loud),), loud), source, ())
    assert "x" * 400 + " ...\n" in str(caught.value) and len(str(caught.value)) < 2000
