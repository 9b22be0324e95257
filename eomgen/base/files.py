"""Files that eomgen writes: text, tables as CSV, archives of arrays, journals; whole or not at all. Tables that it
reads, and its own files that are not Python."""

from __future__ import annotations

import errno
import hashlib
import io
import itertools
import json
import math
import os
import tokenize
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.text import counted, shown
from eomgen.errors import FileError, Problem

if TYPE_CHECKING:
    from zipfile import ZipFile


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
    import tempfile  # noqa: PLC0415  # before long work only

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
    place = path.parent / f".{path.name}.{os.urandom(8).hex()}"
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
    import difflib  # noqa: PLC0415  # for a mistake only

    close = difflib.get_close_matches(path.stem.lower(), every, n=3, cutoff=0.6)
    # of the same ending if there are any
    names = [name for stem in close for name in every[stem]]
    alike = [name for name in names if name.endswith(path.suffix)] or names
    named = [str(folder / name) for name in alike[:3]]
    return " or ".join(name if name.isascii() and name.isprintable() else ascii(name) for name in named) or otherwise


_METADATA = "metadata"


def write_arrays(path: Path, arrays: Mapping[str, Array], metadata: Mapping[str, Any]) -> None:
    """Write arrays and JSON metadata to an ``.npz`` file. Raises FileError."""
    text = np.array(json.dumps(metadata, sort_keys=True))
    needed = sum(array.nbytes for array in arrays.values()) + text.nbytes
    write_file(path, needed, lambda stream: np.savez(stream, allow_pickle=False, **{**arrays, _METADATA: text}))


def read_arrays(
    path: Path, kind: str = "solution", hint: str = "a .npz file of Solution.save"
) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return arrays and metadata of an archive of ours; ``kind``, ``hint`` for messages. Raises FileError."""
    import zipfile  # noqa: PLC0415  # with its decompressors; a run reads no archive

    try:
        with path.open("rb") as stream:
            if not zipfile.is_zipfile(stream):
                raise ValueError("it is no .npz archive, or not all of one")
            with zipfile.ZipFile(stream) as archive:
                _check_sizes(archive)
            stream.seek(0)
            with np.load(stream, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
        metadata = json.loads(str(arrays.pop(_METADATA)[()]))
        if not isinstance(metadata, dict):
            raise ValueError("its metadata are no mapping")
    except OSError as error:
        raise FileError(Problem(str(path), f"cannot be read: {error.strerror or error}", nearby(path))) from None
    except KeyError as error:
        raise FileError(
            Problem(str(path), f"this is not a {kind} written by eomgen: {error.args[0]} is missing", hint)
        ) from None
    # zipfile raises NotImplementedError for a compression or encryption that it does not know, and NumPy reads headers
    # as Python's text: such a file is not ours
    except (
        ValueError, EOFError, NotImplementedError, SyntaxError, tokenize.TokenError, zlib.error, zipfile.BadZipFile
    ) as error:  # fmt: skip  # a list of kinds
        raise FileError(Problem(str(path), f"this is not a {kind} written by eomgen: {error}", hint)) from None
    except MemoryError:
        raise FileError(Problem(str(path), "its arrays are larger than the memory", hint)) from None
    return arrays, metadata


def _check_sizes(archive: ZipFile) -> None:
    """Refuse arrays whose headers promise more bytes than are stored, before memory is asked for.

    Raises
    ------
    ValueError
    """
    for item in archive.infolist():
        with archive.open(item) as member:
            if (version := np.lib.format.read_magic(member)) not in _HEADERS:
                continue
            shape, _, kind = _HEADERS[version](member)
            stored = item.file_size - member.tell()
        if (promised := math.prod(shape) * kind.itemsize) > stored:
            name = item.filename.removesuffix(".npy")
            raise ValueError(f"the array {shown(name)} should have {promised} bytes, and has {stored}")


_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


#: Rows that are written at once.
_ROWS = 4096


def write_table(path: Path, names: Sequence[str], columns: Array, *, numbered: str = "") -> None:
    """Write a table as ``.csv``: one row of names, numbers that read back to the same bits. Raises FileError.

    ``numbered``: name of a first column with the number of each row, from 0 on; none if it is empty.
    """

    def fill(stream: IO[bytes]) -> None:
        text = io.TextIOWrapper(stream, encoding="utf-8", newline="")
        import csv  # noqa: PLC0415  # a run reads and writes no table

        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([numbered, *names] if numbered else names)
        for start in range(0, len(columns), _ROWS):
            for number, row in enumerate(columns[start : start + _ROWS].tolist(), start):
                cells = ",".join(map(repr, row))  # a writer looks for characters to quote, which takes as long again
                text.write(f"{number},{cells}\n" if numbered else f"{cells}\n")
        text.flush()
        text.detach()

    write_file(path, 24 * columns.size, fill)


def write_rows(path: Path, rows: Iterable[Sequence[object]]) -> None:
    """Write texts and numbers as ``.csv``, the names of columns first. Raises FileError."""
    text = io.StringIO()
    import csv  # noqa: PLC0415  # a run reads and writes no table

    csv.writer(text, lineterminator="\n").writerows(rows)
    write_text(path, text.getvalue())


_DELIMITERS = (",", ";", "\t")
_MISSING = ("", "nan", "na", "null", "none")
_HINT = "a first line of names, t,angle, and below it rows of numbers, 0.01,0.2"


def read_cells(path: Path) -> tuple[list[str], list[tuple[str, list[str]]]]:
    """Return the names of the columns, and for each row its place (file and line) and its cells without blanks.

    Columns are separated by commas, semicolons or tabs; lines that are empty or begin with # do not count.

    Raises
    ------
    FileError
        No such file, no text, no names, a name twice, no rows, rows of another length, a quotation mark that is open.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise FileError(Problem(str(path), f"cannot be read: {error.strerror or error}", nearby(path))) from None
    except UnicodeDecodeError:
        raise FileError(Problem(str(path), "this is no text in UTF-8, and a CSV file is needed", _HINT)) from None
    numbered = [(f"{path}, line {k}", line) for k, line in enumerate(lines, 1) if line.strip() and line[0] != "#"]
    if not numbered:
        raise FileError(Problem(str(path), "the file is empty", _HINT))
    delimiter = max(_DELIMITERS, key=numbered[0][1].count)
    (_, names), *rows = [(where, _cells(where, line, delimiter)) for where, line in numbered]
    _check_names(path, names)
    if not rows:
        raise FileError(Problem(str(path), "the table has no rows below its names", _HINT))
    for where, cells in rows:
        if len(cells) != len(names):
            fault = f"the row has {counted(len(cells), 'cell')}, and there are {counted(len(names), 'name')}"
            raise FileError(Problem(where, fault, "a cell for each name"))
    return names, rows


def read_table(path: Path) -> tuple[list[str], Array]:
    """Return the names of the columns and the numbers (rows, columns); missing ones are nan.

    Raises
    ------
    FileError
        As of ``read_cells``, and cells that are no numbers.
    """
    names, rows = read_cells(path)
    result = [[_number(where, name, cell) for name, cell in zip(names, cells, strict=True)] for where, cells in rows]
    return names, np.array(result)


def _cells(where: str, line: str, delimiter: str) -> list[str]:
    import csv  # noqa: PLC0415  # a run reads and writes no table

    try:  # line by line, so that an open quotation mark cannot swallow the lines below it
        (row,) = csv.reader([line], delimiter=delimiter, strict=True)
    except csv.Error as error:
        raise FileError(Problem(where, f"this is no CSV: {error}", "plain cells between delimiters")) from None
    return [cell.strip() for cell in row]


def _check_names(path: Path, names: Sequence[str]) -> None:
    if all(_is_number(name) for name in names):
        raise FileError(Problem(str(path), "the first line has numbers in place of names", _HINT))
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        raise FileError(Problem(str(path), f"the column {shown(twice)} is there twice", "one column for each name"))


def _number(where: str, name: str, cell: str) -> float:
    if cell.lower() in _MISSING:
        return math.nan
    try:
        return float(cell)
    except ValueError:
        hint = "a decimal point in place of the comma" if "," in cell else "numbers alone, without units"
        raise FileError(Problem(f"{where}, column {name}", f"{shown(cell)} is no number", hint)) from None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


Row = TypeVar("Row")


class Journal(Generic[Row]):
    """Rows of work that are done, and the file for further rows.

    The first line identifies the work; a last line without its end, as a killed process leaves it, is dropped.

    Parameters
    ----------
    folder : Path or None
        None: rows are not written.
    file : str
        Name of the file.
    held : str
        Noun of the rows in messages, for instance ``points of a study``.
    identity : str
        Text that is equal for equal work.
    others : str
        Description of other work in messages, for instance ``another scene``.
    row_of : callable
        Makes a row of a line; KeyError, TypeError or ValueError tell that it is none.
    resume : bool
        Whether the rows of an existing file are taken.

    Attributes
    ----------
    rows : list
        Rows of the file at the start.

    Raises
    ------
    FileError
        The file exists and ``resume`` is False, belongs to other work, or cannot be read or written.
    """

    def __init__(
        self,
        folder: Path | None,
        file: str,
        held: str,
        *,
        identity: str,
        others: str,
        row_of: Callable[[Mapping[str, Any]], Row],
        resume: bool,
    ) -> None:
        self.rows: list[Row] = []
        self._path = None if folder is None else make_folder(folder) / file
        if self._path is None:
            return
        if not self._path.exists():
            self.append({"study": identity})
        elif resume:
            self._read(self._path, held, identity, others, row_of)
        else:
            hint = "--resume, which goes on with it, or another folder"
            raise FileError(Problem(str(folder), f"holds the {held}, {file}", hint))

    def append(self, line: Mapping[str, Any]) -> None:
        """Write a line. Raises FileError."""
        if self._path is None:
            return
        try:
            with self._path.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(line) + "\n")
        except OSError as error:
            raise self._fault(f"cannot be written: {error.strerror or error}") from None

    def _read(
        self, path: Path, held: str, identity: str, others: str, row_of: Callable[[Mapping[str, Any]], Row]
    ) -> None:
        try:
            text = path.read_text(encoding="utf-8")
        except OSError as error:
            raise self._fault(f"cannot be read: {error.strerror or error}") from None
        except ValueError:
            raise self._fault(f"these are not the {held}") from None
        whole = text[: text.rfind("\n") + 1]
        try:
            lines = [json.loads(line) for line in whole.splitlines()]
            same = lines[0]["study"] == identity
            if same:
                self.rows = [row_of(line) for line in lines[1:]]
        except (ValueError, KeyError, IndexError, TypeError):
            raise self._fault(f"these are not the {held}") from None
        if not same:
            raise FileError(Problem(str(path.parent), f"holds the {held} of {others}", "another folder"))
        if whole != text:
            write_text(path, whole)

    def _fault(self, fault: str) -> FileError:
        return FileError(Problem(str(self._path), fault, "another folder"))


_DIGESTS: ContextVar[dict[str, str] | None] = ContextVar("digests", default=None)


def read_bytes(path: Path, most: int) -> bytes:
    """Return the first bytes of a file, at most ``most`` of them and one more. Raises OSError or ValueError."""
    with path.open("rb") as stream:
        data = stream.read(most + 1)
    digests = _DIGESTS.get()
    if digests is not None:
        file, digest = os.path.abspath(path), digest_of_file(data)  # noqa: PTH100  # links are followed again
        digests[file] = digest if digests.get(file, digest) == digest else ""  # it changed in between
    return data


def digest_of_file(data: bytes) -> str:
    """Return the digest of the bytes of a file."""
    return hashlib.sha256(data).hexdigest()


@contextmanager
def digests_of_files() -> Iterator[dict[str, str]]:
    """Collect the digests of the files that ``read_bytes`` reads meanwhile, by absolute path; empty for a file that
    changed meanwhile."""
    digests: dict[str, str] = {}
    before = _DIGESTS.set(digests)
    try:
        yield digests
    finally:
        _DIGESTS.reset(before)


def template_folder() -> Path:
    """Return the folder of the templates, one folder in it for each kind of text that is made."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "_templates", package.parent / "templates"):
        if (folder / "c").is_dir():
            return folder
    raise FileError(
        f"the templates are neither in {package / '_templates'} nor in {package.parent / 'templates'}",
        "reinstall eomgen",
    )
