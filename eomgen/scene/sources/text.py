"""User text files: bounded in size, UTF-8, and their names in messages."""

from __future__ import annotations

from pathlib import Path

from eomgen.errors import DescriptionError, FileError, Problem

LARGEST_FILE = 10_000_000
_PACKAGE = "package://"


def shown_file(path: Path) -> str:
    """Return a file's name for messages, escaped if it could upset a terminal."""
    return path.name if path.name.isascii() and path.name.isprintable() else ascii(path.name)


def _in_place_of(path: Path) -> str:
    """Return a hint for a file that cannot be read."""
    from eomgen.base.files import nearby  # noqa: PLC0415  # for a mistake only

    if path.parts[:1] == ("package:",):
        return f"a path of the file system: no ROS is asked where {_PACKAGE}{'/'.join(path.parts[1:2])} is"
    return nearby(path)


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file, with or without a byte order mark.

    Raises
    ------
    FileError, DescriptionError
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise FileError(Problem(ascii(str(path)), f"cannot be read: {reason}", _in_place_of(path))) from None
    if len(data) > LARGEST_FILE:
        raise FileError(
            Problem(
                shown_file(path), f"the file is larger than {LARGEST_FILE // 1_000_000} MB", "a smaller description"
            )
        )
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        problem = Problem(f"{shown_file(path)}:{line}", f"byte {error.start} is not UTF-8", "the file saved as UTF-8")
        raise DescriptionError(problem) from None
