"""A journal: rows of finished work in a file, line by line, from which a study resumes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Generic, TypeVar

from eomgen.base.files import make_folder, read_file, write_text
from eomgen.errors import FileError, Problem

Row = TypeVar("Row")


class Journal(Generic[Row]):
    """Rows of work that are done, and the file for further rows.

    The first line identifies the work; a last line without an end, as a killed process leaves, is dropped.

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
        Makes a row of a line; KeyError, TypeError, ValueError or AttributeError mean that the line is not a row.
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
        """Open the journal of a study in a folder, with its rows on ``resume``; without a folder rows stay in
        memory."""
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
            raise FileError(Problem(str(folder), f"holds the {held}, {file} [E0137]", hint))

    def append(self, line: Mapping[str, Any]) -> None:
        """Append a mapping to the file as a line of JSON; without a folder the call has no effect. Raises FileError."""
        if self._path is None:
            return
        try:
            with self._path.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(line) + "\n")
        except OSError as error:
            raise self._fault(f"cannot be written: {error.strerror or error} [E0143]") from None

    def _read(
        self, path: Path, held: str, identity: str, others: str, row_of: Callable[[Mapping[str, Any]], Row]
    ) -> None:
        """Read the rows of an earlier study from the file into ``rows``, and cut a last line without an end from the
        file; arguments as of the class. Raises FileError for a file that cannot be read, or belongs to other work."""
        try:
            text = read_file(path).decode()
        except OSError as error:
            raise self._fault(f"cannot be read: {error.strerror or error} [E0115]") from None
        except ValueError:
            raise self._fault(f"these are not the {held} [E0144]") from None
        whole = text[: text.rfind("\n") + 1]
        try:
            lines = [json.loads(line) for line in whole.splitlines()]
            same = lines[0]["study"] == identity
            if same:
                self.rows = [row_of(line) for line in lines[1:]]
        except (ValueError, KeyError, IndexError, TypeError, AttributeError):
            raise self._fault(f"these are not the {held} [E0144]") from None
        if not same:
            raise FileError(Problem(str(path.parent), f"holds the {held} of {others} [E0139]", "another folder"))
        if whole != text:
            write_text(path, whole)

    def _fault(self, fault: str) -> FileError:
        return FileError(Problem(str(self._path), fault, "another folder"))
