"""Files of strangers: they cost little time and memory before they are refused, and folders of others are named."""

from __future__ import annotations

import io
import os
import threading
import time
import tracemalloc
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

from eomgen.base.csv_tables import read_cells
from eomgen.base.files import read_arrays, write_arrays, write_text
from eomgen.errors import DescriptionError, EomgenError, FileError
from eomgen.results.solution import Solution
from eomgen.scene.document import units
from eomgen.scene.load import load, load_toml
from eomgen.scene.signals import curves
from eomgen.scene.sources.toml import line_index
from eomgen.toolchain.cache import Cache, writable_by_others
from tests.failures.failure import tables_of_products

# -- TOML --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("parts", [33, 10_000, 500_000])
@pytest.mark.parametrize("form", ["[{}]\n", "[[{}]]\n", "{} = 1\n", "x = {{ {} = 1 }}\n"])
@pytest.mark.parametrize("part", ["a", '"a"', "'a.b' "])
def test_dotted_keys_of_many_parts_are_refused_early(parts: int, form: str, part: str) -> None:
    text = "format = 1\n" + form.format(".".join([part] * parts))
    begun = time.process_time()
    with pytest.raises(DescriptionError) as error:
        load_toml(text)
    assert time.process_time() - begun < 2.0
    message = "description error: scene.toml:2: there is a dotted key of more than 32 parts; try: a key such as"
    assert str(error.value).startswith(message)


@pytest.mark.parametrize("count", [1, 5, 15, 16, 17, 18, 40])
@pytest.mark.parametrize("entry", ["1", "[1, 2]", '"a]#"', "{x = 1}", "[[1], [2]]", "1 # c\n", "1\n", "[1,\n2]"])
def test_lines_of_keys_behind_long_arrays_are_right(count: int, entry: str) -> None:
    array = "[\n" + ", ".join([entry] * count) + " , \n]"
    text = f"a = {array}\nb = 1\n[c]\nd = {array}\ne = 2\n"
    lines, found = text.splitlines(), line_index(text)
    assert lines[found["b"] - 1] == "b = 1"
    assert lines[found["c.e"] - 1] == "e = 2"


def test_points_beyond_the_limit_of_tables_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (curves, units):
        monkeypatch.setattr(module, "MOST_ROWS", 100)
    points = ",".join(f"[{place},1]" for place in range(101))
    with pytest.raises(DescriptionError) as error:
        load_toml(f'format = 1\nname = "s"\n[curves.c]\npoints = [{points}]\n')
    assert "(curves.c.points): there are 101 points, more than 100; try: every tenth point" in str(error.value)


# -- archives ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [11, 10**6, 10**11, 10**18])
@pytest.mark.parametrize("compression", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_headers_that_promise_more_than_there_is_ask_for_no_memory(
    count: int, compression: int, tmp_path: Path
) -> None:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": (count,)})
    path = tmp_path / "run.npz"
    with zipfile.ZipFile(path, "w", compression) as archive:
        archive.writestr("q.npy", stream.getvalue() + bytes(80))
    tracemalloc.start()
    try:
        with pytest.raises(FileError) as error:
            read_arrays(path)
        assert tracemalloc.get_traced_memory()[1] < 4_000_000
    finally:
        tracemalloc.stop()
    assert f"this is not a solution written by eomgen: the array 'q' should have {8 * count} bytes" in str(error.value)
    assert error.value.exit_code == 7


def test_archives_of_ours_are_read(tmp_path: Path) -> None:
    arrays = {"q": np.arange(12.0).reshape(3, 4), "empty": np.zeros((0, 5)), "flag": np.array(True)}
    write_arrays(tmp_path / "run.npz", arrays, {"a": 1})
    found, metadata = read_arrays(tmp_path / "run.npz")
    assert metadata == {"a": 1}
    assert all(np.array_equal(found[name], array) for name, array in arrays.items())


# -- no regular files --------------------------------------------------------------------------------------------------

TABLE = 'format = 1\nname = "s"\n[inputs.u]\ntable = {{ file = "{}" }}\n'
ASSET = (
    '<mujoco><asset><mesh name="m" file="{}"/></asset>'
    '<worldbody><body><geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
)


def _written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


#: Readers of files by path: ending of the file, function, exit code.
READERS = {
    "scene": (".toml", load, 7),
    "URDF": (".urdf", load, 7),
    "MJCF": (".xml", load, 7),
    "SDF": (".sdf", load, 7),
    "mesh of MJCF": (".stl", lambda path: load(_written(path.with_name("m.xml"), ASSET.format(path.name))), 7),
    "table": (".csv", lambda path: load(_written(path.with_name("s.toml"), TABLE.format(path.name))), 3),
    "columns": (".csv", read_cells, 7),
    "solution": (".npz", Solution.load, 7),
}
for table in tables_of_products("READERS"):
    READERS |= table


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes of POSIX")
@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("kind", ["named pipe", "device", "directory"])
def test_a_file_that_is_no_regular_one_is_refused_at_once(reader: str, kind: str, tmp_path: Path) -> None:
    ending, read, code = READERS[reader]
    path = tmp_path / f"given{ending}"
    if kind == "named pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
    if kind == "directory" and reader in ("report", "page"):
        pytest.skip("of runs, or with an answer of its own")
    with pytest.raises(EomgenError) as caught:
        read(path)
    assert caught.value.exit_code == code, caught.value
    assert {"directory": "directory"}.get(kind, f"this is a {kind}") in str(caught.value)


# -- folders -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("mode", "words"), [(0o700, ""), (0o755, ""), (0o777, "can be written by everyone")])
def test_a_cache_that_others_can_write_is_named(mode: int, words: str, tmp_path: Path) -> None:
    folder = tmp_path / "cache"
    folder.mkdir()
    folder.chmod(mode)
    assert writable_by_others(folder) == words
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        Cache(folder)
    said = [str(each.message) for each in caught]
    assert bool(said) == bool(words)
    if words:
        assert f"the cache {folder} can be written by everyone, and its libraries are run" in said[0]
        assert f"chmod go-w {folder}" in said[0]


@pytest.mark.parametrize("mask", [0o022, 0o027, 0o077])
def test_files_have_the_permissions_of_new_files_and_nobody_sets_the_mask(
    mask: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = os.umask(mask)
    try:
        monkeypatch.setattr(os, "umask", lambda _: pytest.fail("the mask of the process was set"))
        write_text(tmp_path / "a.txt", "a")
    finally:
        monkeypatch.undo()
        os.umask(before)
    assert (tmp_path / "a.txt").stat().st_mode & 0o777 == 0o666 & ~mask


def test_files_of_other_threads_are_never_open_to_all(tmp_path: Path) -> None:
    stop, open_to_all = threading.Event(), []

    def others() -> None:
        for number in range(10_000):
            path = tmp_path / f"other{number % 50}"
            path.unlink(missing_ok=True)
            path.touch()
            open_to_all.extend([path] if path.stat().st_mode & 0o002 else [])
            if stop.is_set():
                return

    before = os.umask(0o022)
    thread = threading.Thread(target=others)
    try:
        thread.start()
        for _ in range(200):
            write_text(tmp_path / "a.txt", "a")
    finally:
        stop.set()
        thread.join()
        os.umask(before)
    assert open_to_all == []
