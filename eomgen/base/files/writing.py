"""Files are written under a temporary name and renamed, so they are never incomplete; folders are made."""

from __future__ import annotations

import errno
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
