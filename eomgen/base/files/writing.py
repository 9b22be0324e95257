"""Files are written under a temporary name and renamed, so they are never incomplete; folders are made. Hints for a
file that is missing: files in its folder with similar names.
"""

from __future__ import annotations

import difflib
import errno
import itertools
import os
import secrets
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import IO

from eomgen.errors import FileError, Problem


def write_file(path: Path, needed: int, fill: Callable[[IO[bytes]], object]) -> None:
    """Write a file of about ``needed`` bytes by a function of its stream. Raises FileError."""
    temporary: Path | None = None
    try:
        with temporary_file(path) as stream:
            temporary = Path(stream.name)
            fill(stream)
        temporary.replace(path)
    except BaseException as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        if not isinstance(error, OSError):
            raise
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        hint = "another disk, or a larger record_every" if full else "another folder, or permission to write there"
        fault = f"cannot be written ({error.strerror or error}); about {needed} bytes are needed"
        raise FileError(Problem(str(path), fault, hint)) from None


def write_text(path: Path, text: str) -> None:
    """Write a text file. Raises FileError."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file. Raises FileError."""

    def fill(stream: IO[bytes]) -> None:
        stream.write(data)

    write_file(path, len(data), fill)


def make_folder(path: Path) -> Path:
    """Return a folder that exists. Raises FileError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        if path.is_file():
            raise FileError(Problem(str(path), "this is a file, and a folder is needed", "another folder")) from None
        raise FileError(
            Problem(str(path), f"the folder cannot be made: {error.strerror or error}", "another folder")
        ) from None
    return path


def check_writable(path: Path) -> None:
    """Raise FileError if a file could not be written, before the work whose result it takes."""
    try:
        with tempfile.NamedTemporaryFile("wb", dir=path.parent, prefix=f".{path.name}."):
            pass
    except OSError as error:
        fault = f"cannot be written ({error.strerror or error})"
        raise FileError(Problem(str(path), fault, "another folder, or permission to write there")) from None


def temporary_file(path: Path) -> IO[bytes]:
    """Open a new file in the folder of a path, under a unique name.

    The system sets the permissions of new files. Reading the process's mask would change the mask for a moment, for
    files of other threads as well.

    Raises
    ------
    OSError
    """
    flags = os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_BINARY", 0)
    place = path.parent / f".{path.name}.{secrets.token_hex(8)}"
    return open(place, "wb", opener=lambda name, _: os.open(name, flags, 0o666))  # Path takes none


_COMPARED = 2000  # of a folder


def nearby(path: Path, otherwise: str = "another path") -> str:
    """Return a hint: the files in the same folder with the nearest names, or the folder, if it is missing itself.

    Parameters
    ----------
    otherwise : str
        The hint if the file exists, or if no name is near.
    """
    folder = path.parent
    try:
        if path.exists():
            return otherwise
        if not folder.is_dir():
            return f"another path: there is no folder {str(folder)!a}"
        every: dict[str, list[str]] = {}
        for file in itertools.islice(folder.iterdir(), _COMPARED):
            every.setdefault(file.stem.lower(), []).append(file.name)
    except (OSError, ValueError):
        return otherwise
    close = difflib.get_close_matches(path.stem.lower(), every, n=3, cutoff=0.6)
    # of the same ending if there are any
    names = [name for stem in close for name in every[stem]]
    alike = [name for name in names if name.endswith(path.suffix)] or names
    named = [str(folder / name) for name in alike[:3]]
    return " or ".join(name if name.isascii() and name.isprintable() else ascii(name) for name in named) or otherwise
