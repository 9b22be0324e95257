"""Reading and writing of solution files; written under a temporary name and renamed, so never incomplete."""

from __future__ import annotations

import csv
import errno
import json
import os
import tempfile
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from eomgen.arrays import Array
from eomgen.errors import FileError, Problem

_METADATA = "metadata"
_CSV_ROWS = 4096


def write_arrays(path: Path, arrays: Mapping[str, Array], metadata: Mapping[str, Any]) -> None:
    """Write arrays and JSON metadata to an ``.npz`` file. Raises FileError."""
    text = np.array(json.dumps(metadata, sort_keys=True))
    needed = sum(array.nbytes for array in arrays.values()) + text.nbytes
    _write(path, needed, lambda stream: np.savez(stream, allow_pickle=False, **{**arrays, _METADATA: text}))


def read_arrays(
    path: Path, kind: str = "solution", hint: str = "a .npz file of Solution.save"
) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return arrays and metadata of an archive of ours; ``kind``, ``hint`` for messages. Raises FileError."""
    try:
        with path.open("rb") as stream:
            if not zipfile.is_zipfile(stream):
                raise ValueError("it is no .npz archive, or not all of one")
            stream.seek(0)
            with np.load(stream, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
        metadata = json.loads(str(arrays.pop(_METADATA)[()]))
        if not isinstance(metadata, dict):
            raise ValueError("its metadata are no mapping")
    except OSError as error:
        raise FileError(Problem(str(path), f"cannot be read: {error.strerror or error}", "another path")) from None
    except KeyError as error:
        raise FileError(
            Problem(str(path), f"this is not a {kind} written by eomgen: {error.args[0]} is missing")
        ) from None
    # zipfile raises NotImplementedError for a compression or encryption that it does not know, and NumPy reads headers
    # as Python's text: such a file is not ours
    except (
        ValueError, EOFError, NotImplementedError, SyntaxError, tokenize.TokenError, zlib.error, zipfile.BadZipFile
    ) as error:  # fmt: skip  # a list of kinds
        raise FileError(Problem(str(path), f"this is not a {kind} written by eomgen: {error}", hint)) from None
    return arrays, metadata


def write_table(path: Path, names: Sequence[str], columns: Array) -> None:
    """Write a table as ``.csv``: one row of names, numbers that read back to the same bits. Raises FileError."""

    def fill(stream: IO[bytes]) -> None:
        import io  # noqa: PLC0415  # one use

        text = io.TextIOWrapper(stream, encoding="utf-8", newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(names)
        for start in range(0, len(columns), _CSV_ROWS):
            writer.writerows([map(repr, row) for row in columns[start : start + _CSV_ROWS].tolist()])
        text.flush()
        text.detach()

    _write(path, 24 * columns.size, fill)


def write_text(path: Path, text: str) -> None:
    """Write a text file. Raises FileError."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file. Raises FileError."""

    def fill(stream: IO[bytes]) -> None:
        stream.write(data)

    _write(path, len(data), fill)


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
    """Raise FileError where a file could not be written, before the work that it is for."""
    try:
        with tempfile.NamedTemporaryFile("wb", dir=path.parent, prefix=f".{path.name}."):
            pass
    except OSError as error:
        what = f"cannot be written ({error.strerror or error})"
        raise FileError(Problem(str(path), what, "another folder, or permission to write there")) from None


def _write(path: Path, needed: int, fill: Callable[[IO[bytes]], object]) -> None:
    temporary: Path | None = None
    try:
        with tempfile.NamedTemporaryFile("wb", dir=path.parent, prefix=f".{path.name}.", delete=False) as stream:
            temporary = Path(stream.name)
            fill(stream)
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
    except BaseException as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        if not isinstance(error, OSError):
            raise
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        hint = "another disk, or a larger record_every" if full else "another folder, or permission to write there"
        what = f"cannot be written ({error.strerror or error}); about {needed} bytes are needed"
        raise FileError(Problem(str(path), what, hint)) from None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
