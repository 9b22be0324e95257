"""A content-addressed store of built libraries: written beside, renamed into place, checked when read, bounded in size.

Any process may be killed at any moment, and any number may build the same thing: an entry is there as a whole or not at all.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import tempfile
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from eomgen.errors import FileError, Problem

#: Bytes that the cache may hold; the least recently used entries go first.
DEFAULT_LIMIT = 2_000_000_000
_META = "entry.json"


@dataclass(frozen=True)
class Entry:
    """A folder of the cache and the files it promises."""

    folder: Path
    files: tuple[str, ...]

    def file(self, name: str) -> Path:
        return self.folder / name

    def text(self, name: str) -> str:
        return (self.folder / name).read_text(encoding="utf-8")


def default_folder(environ: Mapping[str, str] | None = None) -> Path:
    """Return ``EOMGEN_CACHE``, else the user's cache folder. Raises FileError for a ``~user`` that there is not."""
    chosen = (os.environ if environ is None else environ).get("EOMGEN_CACHE")
    if chosen:
        try:
            return Path(chosen).expanduser()
        except RuntimeError as error:
            what = f"the folder {chosen!r} cannot be found: {error}"
            raise FileError(Problem("environment variable EOMGEN_CACHE", what, "a full path")) from None
    import platformdirs  # noqa: PLC0415  # not needed where the folder is given

    return Path(platformdirs.user_cache_dir("eomgen"))


class Cache:
    """The store in one folder; a folder that cannot be written is replaced by a temporary one, with a warning.

    Parameters
    ----------
    folder : path, optional
        ``EOMGEN_CACHE`` or the user's cache folder by default.
    limit : int
        Bytes kept at most.
    """

    def __init__(self, folder: Path | str | None = None, limit: int = DEFAULT_LIMIT) -> None:
        self.limit = limit
        self.folder = (default_folder() if folder is None else Path(folder)).absolute()  # compilers run in other folders
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=self.folder):
                pass
        except OSError as error:
            substitute = Path(tempfile.mkdtemp(prefix="eomgen-cache-"))
            warnings.warn(
                f"the cache {self.folder} cannot be written ({error.strerror or error}); building in {substitute} instead. "
                "Set EOMGEN_CACHE to a folder that can be written to keep compiled models",
                RuntimeWarning,
                stacklevel=2,
            )
            self.folder = substitute

    def get(self, key: str) -> Entry | None:
        """Return the entry of a key, or None; an entry whose files are not what was written is put aside."""
        folder = self.folder / key
        try:
            promised = json.loads((folder / _META).read_text(encoding="utf-8"))
            sums = {str(name): str(digest) for name, digest in promised["files"].items()}
        except FileNotFoundError:
            if folder.exists():
                self.quarantine(key)
            return None
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            self.quarantine(key)
            return None
        for name, digest in sums.items():
            file = folder / name
            if not file.is_file() or _digest(file) != digest:
                self.quarantine(key)
                return None
        with contextlib.suppress(OSError):
            os.utime(folder / _META)
        return Entry(folder, tuple(sums))

    def put(self, key: str, build: Callable[[Path], None]) -> Entry:
        """Let ``build`` fill a private folder, keep it as the entry of the key, and return it.

        The folder survives a failure of ``build`` as ``failed/<key>``, and the exception passes through; an OSError, of a
        full disk for one, becomes FileError.
        """
        try:
            private = Path(tempfile.mkdtemp(prefix="tmp-", dir=self.folder))
            try:
                build(private)
                sums = {file.name: _digest(file) for file in sorted(private.iterdir()) if file.is_file()}
                (private / _META).write_text(json.dumps({"files": sums}, indent=1), encoding="utf-8")
            except BaseException:
                self._keep_failed(private, key)
                raise
        except OSError as error:
            what = f"a compiled model cannot be kept: {error.strerror or error}"
            raise FileError(Problem(f"cache {self.folder}", what, "space there, or EOMGEN_CACHE=<another folder>")) from error
        target = self.folder / key
        try:
            private.rename(target)
        except OSError:  # somebody else was faster; theirs is as good unless it is broken
            present = self.get(key)
            if present is not None:
                shutil.rmtree(private, ignore_errors=True)
                return present
            private.rename(target)
        self._evict(keep=key)
        return Entry(target, tuple(sums))

    def quarantine(self, key: str) -> None:
        """Move an entry out of the way, into ``quarantine``."""
        shelf = self.folder / "quarantine"
        with contextlib.suppress(OSError):
            shelf.mkdir(exist_ok=True)
            (self.folder / key).rename(Path(tempfile.mkdtemp(prefix=f"{key[:16]}-", dir=shelf)) / "entry")

    def failed_folder(self, key: str) -> Path:
        """Return where the sources of a failed build are kept."""
        return self.folder / "failed" / key

    def clear(self) -> int:
        """Remove everything and return the number of entries that were there."""
        entries = self._entries()
        for folder in [*entries, self.folder / "quarantine", self.folder / "failed"]:
            shutil.rmtree(folder, ignore_errors=True)
        return len(entries)

    def size(self) -> int:
        """Return the bytes that all entries take."""
        return sum(_size(folder) for folder in self._entries())

    def _entries(self) -> list[Path]:
        """Return the folders of entries, least recently used first."""
        stamped = []
        for folder in self.folder.iterdir():
            with contextlib.suppress(OSError):
                stamped.append(((folder / _META).stat().st_mtime_ns, folder))
        return [folder for _, folder in sorted(stamped)]

    def _evict(self, keep: str) -> None:
        entries = self._entries()
        sizes = {folder: _size(folder) for folder in entries}
        total = sum(sizes.values())
        for folder in entries:
            if total <= self.limit:
                break
            if folder.name != keep:
                total -= sizes[folder]
                shutil.rmtree(folder, ignore_errors=True)

    def _keep_failed(self, private: Path, key: str) -> None:
        with contextlib.suppress(OSError):
            target = self.failed_folder(key)
            target.parent.mkdir(exist_ok=True)
            shutil.rmtree(target, ignore_errors=True)
            private.rename(target)


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _size(folder: Path) -> int:
    total = 0
    with contextlib.suppress(OSError):
        total = sum(file.stat().st_size for file in folder.iterdir())
    return total
