"""A cache of libraries and their parts, each a folder: atomic renames into place, checksums on reading, bounded size.

Entries are keyed by digests of their content: libraries (``model*.so``), objects of sources (``object.o``) and of the
extension module (``wrapper.o``), structures (``structure.json``), lanes and routines. Two folders hold other things:
``readings``, records of scenes keyed by path and options, and ``templates``, bytecode.

Any process may be killed at any moment, and any number may build the same thing: an entry is there as a whole or not at
all. In addition to the entries there are ``claims`` (builds under way), ``failed`` (sources of failed builds),
and ``tmp-*`` (builds under way, or left by processes that were killed), all of which are cleared away in time, and
``sizes.txt``, by which is known when entries have to go. A damaged entry is removed.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import json
import math
import os
import shlex
import shutil
import sys
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

from eomgen.base.data import dataclass
from eomgen.base.files import belongs_to_others, make_private_folder, temporary_file
from eomgen.base.locks import claim, hold, is_abandoned
from eomgen.errors import FileError, Problem, ToolchainError

#: Failed builds, of which the newest are kept for diagnosis.
KEPT = 8
#: Age in s after which an unlocked build folder is removed: between making and locking it a process needs a moment.
ABANDONED_AFTER = 60.0
_META, _TEMPORARY = "entry.json", "tmp-"
#: Bytes of all entries at the last measurement, then a line per build with the bytes that the build added: measuring
#: thousands of folders takes as long as a build.
_SIZES = "sizes.txt"
#: Folders of the bytecode of templates and of records of scenes, which are not entries.
TEMPLATES, READINGS = "templates", "readings"


#: Temporary folders of this process by the folder of the cache that cannot keep its entries.
_SUBSTITUTES: dict[Path, Path] = {}
_SUBSTITUTION = threading.Lock()
_POSTPONED: deque[Callable[[], None]] = deque()


def postpone(write: Callable[[], None]) -> None:
    """Write to the cache while the process waits for compilers, or at its end."""
    if not _POSTPONED:
        atexit.register(write_postponed)
    _POSTPONED.append(write)


def write_postponed() -> None:
    """Write all that was postponed."""
    while _POSTPONED:
        with contextlib.suppress(IndexError):  # another thread was faster
            _POSTPONED.popleft()()


class StoppedError(ToolchainError):
    """A build that was ended together with its process, whose folder is not kept."""


@dataclass(frozen=True)
class Entry:
    """A folder of the cache and the files promised by the folder's record."""

    folder: Path
    files: tuple[str, ...]

    def file(self, name: str) -> Path:
        return self.folder / name

    def text(self, name: str) -> str:
        return (self.folder / name).read_text(encoding="utf-8")


def default_folder(environ: Mapping[str, str] | None = None) -> Path:
    """Return the folder of the cache: ``EOMGEN_CACHE``, else the folder of eomgen in the user's cache folder.
    ``environ`` replaces the process's variables for ``EOMGEN_CACHE`` only. Raises FileError for unknown ``~user``."""
    chosen = (os.environ if environ is None else environ).get("EOMGEN_CACHE")
    if chosen:
        try:
            return Path(chosen).expanduser()
        except RuntimeError as error:
            fault = f"the folder {chosen!r} cannot be found: {str(error).rstrip('.')} [E2102]"
            raise FileError(Problem("environment variable EOMGEN_CACHE", fault, "a full path")) from None
    base = os.environ.get("XDG_CACHE_HOME") or (os.environ.get("HOME", "") and f"{os.environ['HOME']}/.cache")
    if sys.platform == "linux" and base.startswith("/") and not base[-1].isspace():
        return Path(base, "eomgen")
    import platformdirs  # noqa: PLC0415  # takes a tenth of the time from a cached model to its first step

    return Path(platformdirs.user_cache_dir("eomgen"))


class Cache:
    """The store in one folder; if the folder cannot keep an entry (read-only, full, an entry of another user in the
    place), its entries are read, and new entries go to a temporary folder of this process.

    Parameters
    ----------
    folder : path, optional
        ``EOMGEN_CACHE`` or the user's cache folder by default.
    limit : int
        Bytes kept at most.
    """

    def __init__(self, folder: Path | str | None = None, limit: int = 2_000_000_000) -> None:
        """Open the cache in a folder; warn if other users can write there. A folder that cannot be written is noted as
        read-only."""
        self.limit = limit
        # compilers run in other folders
        self.folder = (default_folder() if folder is None else Path(folder)).absolute()
        self.read_only: Path | None = None
        chosen = self.folder
        self.folder = _SUBSTITUTES.get(chosen, chosen)
        self._refusal = refusal(self.folder)
        if self._refusal or self.folder != chosen:
            self.read_only = chosen
        if others := writable_by_others(self.folder):
            mode = closing(self.folder)
            warnings.warn(
                f"the cache {self.folder} {others}, and its libraries are run: set EOMGEN_CACHE to a folder of your own"
                f"{mode and f' (try: {mode})'} [W0207]",
                RuntimeWarning,
                stacklevel=3,
            )

    def get(self, key: str) -> Entry | None:
        """Return the entry of a key with all files as recorded, or None. An entry with changed files is removed; one of
        another user is left."""
        if self.read_only is not None:
            cached = _valid_entry(self.read_only / key)
            if cached is not None or self.folder == self.read_only:
                return cached
        folder = self.folder / key
        entry = _valid_entry(folder)
        if entry is None:
            if os.path.lexists(folder) and not _is_closed(folder):
                self.remove(key)
            return None
        with contextlib.suppress(OSError):
            os.utime(folder / _META)
        return entry

    def holding(self, name: str, text: str) -> Iterator[Entry]:
        """Yield the entries with a file of this name and text, the last used first."""
        if not self.folder.is_dir():
            return
        for folder in reversed(self._entries()):
            with contextlib.suppress(OSError):
                if (folder / name).read_text(encoding="utf-8") == text and (entry := self.get(folder.name)) is not None:
                    yield entry

    @contextlib.contextmanager
    def claim(self, key: str) -> Iterator[None]:
        """Hold an exclusive lock for building the entry of a key in a context; other processes wait until its end, or
        the holder's death."""
        self._substitute_folder()
        claims = self.folder / "claims"
        with contextlib.suppress(OSError):
            make_private_folder(claims)
        with claim(claims / key):
            yield

    def take(self, key: str, build: Callable[[Path], None]) -> Entry:
        """Return the entry of a key; if there is none, one process fills it with ``build`` and others wait."""
        with self.claim(key):
            return self.get(key) or self.put(key, build)

    def put(self, key: str, build: Callable[[Path], None]) -> Entry:
        """Let ``build`` fill a private folder, keep the folder as the entry of the key, and return the entry.

        The folder survives a failure of ``build`` as ``failed/<key>``, and the exception passes through; an OSError, of
        a full disk for one, becomes FileError, and the folder is removed.
        """
        self._substitute_folder()
        while True:
            folder = self.folder
            try:
                return self._put(folder, key, build)
            except (OSError, FileError) as error:
                reason = _reason(error)
                if folder in _SUBSTITUTES.values():
                    named = f"cache {self.read_only or folder}"
                    fault = f"a compiled model cannot be kept: {reason} [E2103]"
                    raise FileError(Problem(named, fault, "space there, or EOMGEN_CACHE=<another folder>")) from error
            self._substitute(folder, reason)

    def _put(self, folder: Path, key: str, build: Callable[[Path], None]) -> Entry:
        """Build an entry in a private folder, move the folder to the entry's place and return the entry; remove old
        entries beyond the limit. After a failure of ``build`` other than OSError or FileError the private folder is
        kept among the failed builds."""
        private, held = None, None
        try:
            private = _new_folder(_TEMPORARY, folder)
            held = hold(private)
            build(private)
            sums = {file.name: _digest(file) for file in sorted(private.iterdir()) if file.is_file()}
            (private / _META).write_text(json.dumps({"files": sums}, indent=1), encoding="utf-8")
            added = _size(private)
            entry = self._place(private, key, sums)
        except BaseException as error:
            if private is not None:
                if isinstance(error, Exception) and not isinstance(error, OSError | FileError | StoppedError):
                    self._keep_failed(private, key)
                shutil.rmtree(private, ignore_errors=True)
            raise
        finally:
            if held is not None:
                os.close(held)
        with contextlib.suppress(OSError):
            self._evict(key, added)
        return entry

    def _place(self, private: Path, key: str, sums: Mapping[str, str]) -> Entry:
        """Move a filled folder to the place of the key and return the entry; ``sums`` are the digests of the files. If
        another process was faster, its entry is returned if complete. A folder that cannot be moved there is copied to
        the temporary folder of this process."""
        target = private.parent / key
        for attempt in range(3):
            try:
                private.rename(target)
                return Entry(target, tuple(sums))
            except OSError as error:
                present = self.get(key)  # removes a broken entry
                if present is not None:
                    shutil.rmtree(private, ignore_errors=True)
                    return present
                if attempt < 2 and not _is_closed(target):
                    continue
                if private.parent in _SUBSTITUTES.values():
                    raise
                reason = "its entry of this model is another user's" if _is_closed(target) else _reason(error)
        self._substitute(private.parent, reason)
        target = self.folder / key
        shutil.copytree(private, target, dirs_exist_ok=True)
        shutil.rmtree(private, ignore_errors=True)
        return Entry(target, tuple(sums))

    def remove(self, key: str) -> None:
        """Remove the entry of a key, or a file in its place."""
        entry = self.folder / key
        with contextlib.suppress(OSError):
            if entry.is_dir() and not entry.is_symlink():
                shutil.rmtree(entry)
            else:
                entry.unlink()

    def failed_folder(self, key: str) -> Path:
        """Return the folder of the sources of a failed build."""
        return self.folder / "failed" / key

    def clear(self) -> int:
        """Remove everything and return the number of entries that were there."""
        entries = self._entries()
        for folder in [
            *entries,
            *(self.folder / name for name in ("failed", "claims", TEMPLATES, READINGS)),
        ]:
            shutil.rmtree(folder, ignore_errors=True)
        (self.folder / _SIZES).unlink(missing_ok=True)
        return len(entries)

    def size(self) -> int:
        """Return the bytes that all entries take."""
        return sum(_size(folder) for folder in self._entries())

    def _substitute_folder(self) -> None:
        """Use the temporary folder of this process if the chosen one cannot be written."""
        if self.read_only is not None and self.folder == self.read_only:
            self._substitute(self.folder, self._refusal)

    def _substitute(self, folder: Path, reason: str) -> None:
        """Let the cache use a temporary folder of this process in place of ``folder``, which cannot keep entries, with
        one warning.

        ``reason`` is for the warning.

        Raises
        ------
        FileError
            There is no temporary folder.
        """
        with _SUBSTITUTION:
            substitute = _SUBSTITUTES.get(folder)
            if substitute is None or not substitute.is_dir():
                try:
                    substitute = _SUBSTITUTES[folder] = _new_folder("eomgen-cache-")
                except OSError as error:
                    fault = (
                        f"a compiled model cannot be kept: {reason}, nor in a temporary folder:"
                        f" {_reason(error)} [E2206]"
                    )
                    hint = "EOMGEN_CACHE=<a folder that can be written>"
                    raise FileError(Problem(f"cache {folder}", fault, hint)) from None
                atexit.register(shutil.rmtree, substitute, ignore_errors=True)
                warnings.warn(
                    f"the cache {folder} cannot be written ({reason}); building in {substitute} instead. "
                    "Set EOMGEN_CACHE to a folder that can be written to keep compiled models [W0208]",
                    RuntimeWarning,
                    stacklevel=4,
                )
        if self.folder == folder:
            self.folder, self.read_only = substitute, folder

    def _entries(self) -> list[Path]:
        """Return the folders of entries, least recently used first."""
        return _oldest_first(folder for folder in self.folder.iterdir() if os.path.isfile(folder / _META))  # noqa: PTH113  # Path raises PermissionError

    def _evict(self, keep: str, added: int) -> None:
        """Remove leftovers of builds, and if all entries exceed the limit, the least recently used ones, but not the
        key ``keep``. ``added`` are the bytes of the entry just made."""
        with contextlib.suppress(OSError):
            self._sweep()
        if self._record_size(added) <= self.limit:
            return
        entries = self._entries()
        sizes = {folder: _size(folder) for folder in entries}
        total = sum(sizes.values())
        # not every build after a removal measures all entries
        most = self.limit if total <= self.limit else 7 / 8 * self.limit
        for folder in entries:
            if total <= most:
                break
            if folder.name != keep:
                total -= sizes[folder]
                shutil.rmtree(folder, ignore_errors=True)
        self._record(total)

    def _record_size(self, added: int) -> float:
        """Return the bytes of all entries by the record of sizes, with the bytes added by this build; infinite without
        a record that can be read. Entries that other processes remove, or add while sizes are recorded anew, leave the
        record wrong until the next measurement."""
        record = self.folder / _SIZES
        try:
            sizes = [int(line) for line in record.read_text(encoding="ascii").split()]
            with record.open("a", encoding="ascii") as file:
                file.write(f"{added}\n")
        except (OSError, ValueError):
            return math.inf
        return sum(sizes) + added if sizes else math.inf

    def _record(self, total: int) -> None:
        """Write the record of sizes anew."""
        with contextlib.suppress(OSError):
            private = _new_folder(_TEMPORARY, self.folder)
            (private / _SIZES).write_text(f"{total}\n", encoding="ascii")
            (private / _SIZES).chmod(0o600)
            (private / _SIZES).replace(self.folder / _SIZES)
            private.rmdir()

    def _sweep(self) -> None:
        for folder in self.folder.glob(f"{_TEMPORARY}*"):
            with contextlib.suppress(OSError):
                if time.time() - folder.stat().st_mtime > ABANDONED_AFTER and is_abandoned(folder):
                    shutil.rmtree(folder, ignore_errors=True)
        for folder in _oldest_first(self.folder.glob("failed/*"))[:-KEPT]:
            shutil.rmtree(folder, ignore_errors=True)

    def _keep_failed(self, private: Path, key: str) -> None:
        with contextlib.suppress(OSError):
            target = self.failed_folder(key)
            make_private_folder(target.parent)
            shutil.rmtree(target, ignore_errors=True)
            private.rename(target)
            self._sweep()


def _new_folder(prefix: str, parent: Path | None = None) -> Path:
    """Return a new folder of this process, in the system's folder for temporary files by default."""
    import tempfile  # noqa: PLC0415  # for builds only

    folder = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
    folder.chmod(0o700)  # for any mask of the process
    return folder


def refusal(folder: Path) -> str:
    """Return the reason for which a folder, made if missing, is not writable; empty for a writable folder."""
    try:
        make_private_folder(folder)
        with temporary_file(folder / "written") as file:
            pass
        Path(file.name).unlink(missing_ok=True)
    except OSError as error:
        return str(error.strerror or error)
    return ""


def writable_by_others(folder: Path) -> str:
    """Return words on other users who can write to a folder, as the end of a sentence; empty if none, or on Windows. A
    group of the user's own does not count: on most systems such a group has no further members."""
    if not hasattr(os, "geteuid"):
        return ""
    try:
        status = folder.stat()
    except OSError:
        return ""
    if status.st_mode & 0o002:
        return "can be written by everyone"
    if status.st_mode & 0o020 and status.st_gid != os.getegid():
        return "can be written by a group"
    return "belongs to another user" if status.st_uid not in (os.geteuid(), 0) and os.geteuid() != 0 else ""


def closing(folder: Path) -> str:
    """Return the command that leaves a folder to its owner; empty for users who must not change its mode."""
    return f"chmod go-w {shlex.quote(str(folder))}" if os.geteuid() in (0, folder.stat().st_uid) else ""


def _valid_entry(folder: Path) -> Entry | None:
    """Return the entry in a folder of this user's if all files have their recorded digests, else None."""
    try:
        if belongs_to_others(folder):
            return None
        promised = json.loads((folder / _META).read_text(encoding="utf-8"))
        sums = {str(name): str(digest) for name, digest in promised["files"].items()}
        if all((folder / name).is_file() and _digest(folder / name) == digest for name, digest in sums.items()):
            return Entry(folder, tuple(sums))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        pass
    return None


def _is_closed(folder: Path) -> bool:
    """Return whether a folder belongs to another user or may not be read: its entry is neither damaged nor usable."""
    try:
        if belongs_to_others(folder):
            return True
        (folder / _META).read_bytes()
    except PermissionError:
        return True
    except OSError:
        pass
    return False


def _reason(error: OSError | FileError) -> str:
    return error.problems[0].what if isinstance(error, FileError) else str(error.strerror or error)


def _oldest_first(folders: Iterable[Path]) -> list[Path]:
    """Return folders by the time of last use, oldest first: of the entry's record, else of the folder."""
    stamped = []
    for folder in folders:
        with contextlib.suppress(OSError):
            record = folder / _META
            stamped.append(((record if record.is_file() else folder).stat().st_mtime_ns, folder))
    return [folder for _, folder in sorted(stamped)]


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _size(folder: Path) -> int:
    total = 0
    with contextlib.suppress(OSError):
        total = sum(file.stat().st_size for file in folder.iterdir())
    return total
