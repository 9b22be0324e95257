"""The cache: whole entries or none, whoever fails, lies, races or fills the disk."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import platformdirs
import pytest

from eomgen.base import locks
from eomgen.errors import ToolchainError
from eomgen.toolchain.cache import ABANDONED_AFTER, KEPT, Cache, default_folder
from tests.toolchain.fire import left_in


def fill(text: str = "content"):
    def build(folder: Path) -> None:
        (folder / "data.txt").write_text(text, encoding="utf-8")

    return build


#: Part of an entry, and what is put in its place.
DAMAGES: dict[str, tuple[str, Callable[[Path], object]]] = {
    "changed": ("data.txt", lambda place: place.write_text("c0ntent", encoding="utf-8")),
    "emptied": ("data.txt", Path.touch),
    "removed": ("data.txt", lambda place: None),
    "a folder for a file": ("data.txt", Path.mkdir),
    "a link to nowhere for a file": ("data.txt", lambda place: place.symlink_to(place.parent / "nowhere")),
    "another manifest": ("entry.json", lambda place: place.write_text('{"files": 3}', encoding="utf-8")),
    "an empty manifest": ("entry.json", Path.touch),
    "no manifest": ("entry.json", lambda place: None),
    "a folder for a manifest": ("entry.json", Path.mkdir),
    "a link to nowhere": ("", lambda place: place.symlink_to(place.parent / "nowhere")),
    "a link to itself": ("", lambda place: place.symlink_to(place)),
    "a file": ("", Path.touch),
    "an empty folder": ("", Path.mkdir),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_entry_is_removed_and_can_be_built_again(damage: str, tmp_path: Path) -> None:
    cache, (part, change) = Cache(tmp_path), DAMAGES[damage]
    place = cache.put("key", fill()).folder / part
    shutil.rmtree(place) if place.is_dir() else place.unlink()
    change(place)
    assert cache.get("key") is None
    assert not (tmp_path / "key").exists()
    assert cache.put("key", fill("again")).text("data.txt") == "again"
    assert cache.get("key") is not None


def test_the_least_recently_used_go_first(tmp_path: Path) -> None:
    cache = Cache(tmp_path, limit=3500)
    for number, key in enumerate(("one", "two", "three")):
        entry = cache.put(key, fill("x" * 1000))
        os.utime(entry.file("entry.json"), ns=(number, number))
    assert cache.get("one") is not None  # used: now the youngest
    cache.put("four", fill("x" * 1000))
    assert cache.get("two") is None
    assert all(cache.get(key) is not None for key in ("one", "four"))
    assert cache.size() <= 3500


@pytest.mark.parametrize("text", ["", "12\nmany\n", "\N{DEGREE SIGN}", None])
def test_a_record_of_sizes_that_is_damaged_or_wrong_is_made_anew(tmp_path: Path, text: str | None) -> None:
    cache = Cache(tmp_path, limit=5000)
    for number in range(4):
        cache.put(f"key{number}", fill("x" * 1000))
    record = tmp_path / "sizes.txt"
    record.unlink()
    if text is not None:
        record.write_text(text, encoding="utf-8")
    for number in range(4, 12):
        cache.put(f"key{number}", fill("x" * 1000))
        assert cache.size() <= 5000
    assert cache.size() >= 2000
    assert cache.get("key11") is not None


def test_only_builds_that_nobody_holds_are_cleared_away(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    ages = {"tmp-held": 2 * ABANDONED_AFTER, "tmp-young": 0.0, "tmp-left": 2 * ABANDONED_AFTER}
    for name, age in ages.items():
        (tmp_path / name).mkdir()
        os.utime(tmp_path / name, (time.time() - age,) * 2)
    held = locks.hold(tmp_path / "tmp-held")
    assert held is not None
    try:
        cache.put("key", lambda folder: None)
    finally:
        os.close(held)
    assert left_in(tmp_path)["tmp"] == ["tmp-held", "tmp-young"]


def test_failed_builds_are_kept_for_a_while_only(tmp_path: Path) -> None:
    cache = Cache(tmp_path)

    def fail(folder: Path) -> None:
        raise ToolchainError("no luck")

    for number in range(KEPT + 3):
        with pytest.raises(ToolchainError):
            cache.put(f"bad{number}", fail)
        os.utime(cache.failed_folder(f"bad{number}"), (number, number))
    cache.put("last", lambda folder: None)
    assert sorted(left_in(tmp_path)["failed"]) == sorted(f"bad{number}" for number in range(3, KEPT + 3))


def test_an_entry_larger_than_the_limit_still_serves_its_maker(tmp_path: Path) -> None:
    cache = Cache(tmp_path, limit=10)
    assert cache.put("key", fill("x" * 1000)).text("data.txt") == "x" * 1000


@pytest.mark.slow
def test_processes_that_race_all_get_a_whole_entry(tmp_path: Path) -> None:
    script = (
        "import sys, time\nfrom pathlib import Path\nfrom eomgen.toolchain.cache import Cache\ndef build(folder):\n   "
        " (folder / 'a').write_text('x' * 100000)\n    time.sleep(0.05)\n    (folder / 'b').write_text('y')\ncache ="
        " Cache(sys.argv[1])\nfor key in ('k1', 'k2', 'k3'):\n    entry = cache.put(key, build)\n   "
        " print(len(entry.text('a')), entry.text('b'))\n"
    )
    processes = [
        subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], stdout=subprocess.PIPE, text=True)
        for _ in range(4)
    ]
    assert [process.communicate()[0] for process in processes] == ["100000 y\n" * 3] * 4
    assert sorted(path.name for path in tmp_path.iterdir()) == ["k1", "k2", "k3", "sizes.txt"]
    sizes = [int(line) for line in (tmp_path / "sizes.txt").read_text(encoding="ascii").split()]
    assert sum(sizes) >= Cache(tmp_path).size()


def test_a_folder_that_cannot_be_written_is_replaced_with_a_warning(tmp_path: Path) -> None:
    occupied = tmp_path / "file"
    occupied.write_text("", encoding="utf-8")
    cache = Cache(occupied)  # nothing is said as long as nothing is to be built
    assert cache.get("key") is None
    with pytest.warns(RuntimeWarning, match=r"the cache .*file cannot be written .* Set EOMGEN_CACHE") as warned:
        assert cache.put("key", fill()).text("data.txt") == "content"
        assert cache.put("other", fill()).text("data.txt") == "content"
    assert len(warned) == 1 and cache.get("key") is not None
    cache.clear()


# -- folders that cannot keep entries, and other users -----------------------------------------------------------------


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EIO])
def test_a_cache_that_fails_while_it_is_filled_is_a_note(number: int, tmp_path: Path) -> None:
    def build(folder: Path) -> None:
        if folder.parent == tmp_path:
            raise OSError(number, os.strerror(number))
        fill()(folder)

    with pytest.warns(RuntimeWarning, match=re.escape(f"cannot be written ({os.strerror(number)})")) as warned:
        cache = Cache(tmp_path)
        assert cache.put("key", build).text("data.txt") == "content"
        assert cache.put("other", build).text("data.txt") == "content"
        assert Cache(tmp_path).put("third", build).text("data.txt") == "content"  # of the same process
    assert len(warned) == 1 and Cache(tmp_path).get("key") is not None
    assert not list(tmp_path.iterdir())


def test_an_entry_of_another_user_stays_and_the_model_is_built_in_a_temporary_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its folder has mode 0700: the system refuses reading, renaming onto it, and moving it away. The tests may run as
    root, whom no mode stops."""
    entry = Cache(tmp_path).put("key", fill("of the first user"))
    read_text, read_bytes, is_file, rename = Path.read_text, Path.read_bytes, Path.is_file, Path.rename

    def closed(call):
        def of_another_user(path: Path, *arguments, **keys):
            if entry.folder in (path, *path.parents):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
            if call is rename and arguments[0] == entry.folder:
                raise OSError(errno.ENOTEMPTY, os.strerror(errno.ENOTEMPTY), str(path))
            return call(path, *arguments, **keys)

        return of_another_user

    with monkeypatch.context() as patch:
        for name, call in (
            ("read_text", read_text),
            ("read_bytes", read_bytes),
            ("is_file", is_file),
            ("rename", rename),
        ):
            patch.setattr(Path, name, closed(call))
        cache = Cache(tmp_path)
        assert cache.get("key") is None
        with pytest.warns(RuntimeWarning, match="its entry of this model is another user's") as warned:
            assert cache.put("key", fill("of the second")).text("data.txt") == "of the second"
        assert len(warned) == 1
        again = cache.get("key")
        assert again is not None and again.text("data.txt") == "of the second"
    assert entry.text("data.txt") == "of the first user"


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root takes the part of two users")
@pytest.mark.parametrize(
    ("owner", "mode", "taken"),
    [
        (54321, 0o1777, [54322, 0]),
        (54321, 0o755, [54321, 54322, 0]),
        (54322, 0o755, [54322, 0]),
        (0, 0o1777, [54322, 0]),
        (0, 0o775, [54322, 0]),
    ],
)
def test_libraries_that_another_user_has_put_there_are_not_run(owner: int, mode: int, taken: list[int]) -> None:
    """An entry that anyone may read, with right checksums: the user's own, the system's and those of the folder's owner
    are taken, if nobody else can write there."""
    shared = Path(tempfile.mkdtemp())  # the folders of the tests are for root alone
    for maker in (54321, 54322, 0):
        entry = Cache(shared).put(f"by {maker}", fill(f"of {maker}"))
        for path in (entry.folder, *entry.folder.iterdir()):
            path.chmod(0o755)
            os.chown(path, maker, maker)
    os.chown(shared, owner, owner)
    shared.chmod(mode)
    script = (
        "import encodings.ascii, json, os, sys, tempfile\nfrom eomgen.toolchain.cache import Cache\n"
        "os.setgid(54322); os.setuid(54322)\ncache = Cache(sys.argv[1])\n"
        "print(json.dumps([maker for maker in (54321, 54322, 0) if cache.get(f'by {maker}')]))\n"
    )
    done = subprocess.run([sys.executable, "-c", script, str(shared)], capture_output=True, text=True, check=False)
    assert (done.returncode, json.loads(done.stdout)) == (0, taken), done.stderr
    assert "chmod" not in done.stderr  # which is for the owner
    assert all((shared / f"by {maker}").is_dir() for maker in (54321, 54322, 0))
    shutil.rmtree(shared)


@pytest.mark.skipif(os.name != "posix", reason="modes of POSIX")
@pytest.mark.parametrize("mask", [0, 0o022, 0o277])
def test_folders_of_the_cache_are_for_their_owner_alone(mask: int, tmp_path: Path) -> None:
    before = os.umask(mask)
    try:
        cache = Cache(tmp_path / "above" / "cache")
        with cache.claim("key"):
            cache.put("key", fill())
        with pytest.raises(RuntimeError):
            cache.put("failed", _fail)
    finally:
        os.umask(before)
    folders = [tmp_path / "above", cache.folder, *(path for path in cache.folder.rglob("*") if path.is_dir())]
    assert {"claims", "key", "failed"} <= {folder.name for folder in folders}
    assert {oct(folder.stat().st_mode & 0o777) for folder in folders} == {"0o700"}


def _fail(folder: Path) -> None:
    raise RuntimeError("no luck")


def test_the_environment_chooses_the_folder(tmp_path: Path) -> None:
    assert default_folder({"EOMGEN_CACHE": str(tmp_path)}) == tmp_path
    assert default_folder({}).name == "eomgen"


@pytest.mark.parametrize("given", ["", " ", "/tmp/somewhere", "/tmp/somewhere ", "somewhere", "~/somewhere", None])
def test_the_default_folder_is_the_one_of_platformdirs(given: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    if given is None:
        monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    else:
        monkeypatch.setenv("XDG_CACHE_HOME", given)
    assert default_folder({}) == Path(platformdirs.user_cache_dir("eomgen"))


def test_the_default_folder_needs_no_home(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    for home in ("", "relative"):
        monkeypatch.setenv("HOME", home)
        assert default_folder({}) == Path(platformdirs.user_cache_dir("eomgen"))


def test_clearing_counts_entries(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    cache.put("one", fill())
    cache.put("two", fill())
    assert json.loads((tmp_path / "one" / "entry.json").read_text(encoding="utf-8"))["files"].keys() == {"data.txt"}
    assert cache.clear() == 2
    assert cache.get("one") is None


def test_locks_of_windows_are_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a stand-in for the module of Windows, which gives the lock at the third try."""
    tries: list[int] = []

    def locking(descriptor: int, mode: int, count: int) -> None:
        tries.append(mode)
        if len(tries) < 3:
            raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(locks, "fcntl", None)
    monkeypatch.setattr(locks, "_windows", SimpleNamespace(locking=locking, LK_NBLCK=2))
    with locks.claim(tmp_path / "claim"):
        assert tries == [2, 2, 2] and (tmp_path / "claim").is_file()
    assert not (tmp_path / "claim").exists()
    tries.clear()
    assert locks.hold(tmp_path) is None and tries == [2]  # held by another process
