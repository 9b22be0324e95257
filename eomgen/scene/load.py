"""Scenes from files: one door for TOML and URDF."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from eomgen.errors import DescriptionError, FileError, Problem, UsageError
from eomgen.scene.scene import Scene
from eomgen.text import shown

LARGEST_FILE = 10_000_000
_TOML_PLACE = re.compile(r" \(at line (\d+), column (\d+)\)$")


def load(
    path: str | Path,
    *,
    strict: bool = False,
    root: str = "fixed",
    lock: Sequence[str] = (),
    limits: bool = False,
    friction: bool = False,
    coordinates: Literal["joint", "absolute"] | None = None,
) -> Scene:
    """Read a scene from a ``.toml`` or ``.urdf`` file.

    Parameters
    ----------
    path : str or Path
        The file.
    strict : bool
        Refuse what an importer would leave out with a note.
    root : str
        For URDF: whether the root link is ``fixed`` to the base or ``free``.
    lock : sequence of str
        For URDF: moving joints to be fixed at zero.
    limits : bool
        For URDF: turn limits of position into compliant stops, as hard as the joints' largest efforts ask for.
    friction : bool
        For URDF: take the dry friction of joints, regularised at 0.01 rad/s and 1 mm/s.
    coordinates : str, optional
        ``joint`` or ``absolute``, in place of what the file says (a URDF says joint).

    Raises
    ------
    FileError
        If the file cannot be read or is larger than 10 MB.
    DescriptionError
        With everything that is wrong with its content.
    UsageError
        If the kind of file is not known, or an option does not fit it.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (".toml", ".urdf", ".xml"):
        hint = "xacro first, to make a .urdf of it" if kind == ".xacro" else "a .toml scene or a .urdf file"
        raise UsageError(f"{str(path)!a} is not a kind of file that can be read", hint)
    if kind == ".toml" and (root != "fixed" or lock or limits or friction):
        raise UsageError("root, lock, limits and friction are for URDF only", "keys of the joint in the scene file")
    if coordinates not in (None, "joint", "absolute"):
        raise UsageError(f"coordinates are {shown(coordinates)}", "joint or absolute")
    text, file = read_text(path), shown_file(path)
    if kind == ".toml":
        return load_toml(text, file=file, coordinates=coordinates, folder=path.parent)
    from eomgen.scene.sources.urdf.conversion import load_urdf  # noqa: PLC0415 - imported only where it is needed

    asked: dict[str, Any] = {"lock": lock, "limits": limits, "friction": friction}
    return load_urdf(text, file=file, strict=strict, root=root, coordinates=coordinates, **asked)


def shown_file(path: Path) -> str:
    """Return a file's name for messages, escaped where it could upset a terminal."""
    return path.name if path.name.isascii() and path.name.isprintable() else ascii(path.name)


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
        raise FileError(Problem(ascii(str(path)), f"cannot be read: {reason}", "another path")) from None
    if len(data) > LARGEST_FILE:
        raise FileError(
            Problem(shown_file(path), f"the file is larger than {LARGEST_FILE // 1_000_000} MB", "a smaller description")
        )
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        problem = Problem(f"{shown_file(path)}:{line}", f"byte {error.start} is not UTF-8", "the file saved as UTF-8")
        raise DescriptionError(problem) from None


def load_toml(
    text: str,
    *,
    file: str = "scene.toml",
    coordinates: Literal["joint", "absolute"] | None = None,
    folder: Path | None = None,
) -> Scene:
    """Read a scene from the text of a TOML file.

    ``file`` is the name for messages, ``coordinates`` as in ``load``, ``folder`` where the paths of tables start.

    Raises
    ------
    DescriptionError
    """
    from eomgen.scene.document.assemble import from_data  # noqa: PLC0415 - pydantic is slow to import

    data, lines = toml_data(text, file)
    return from_data(data, file=file, lines=lines, coordinates=coordinates, folder=folder)


def toml_data(text: str, file: str) -> tuple[dict[str, Any], dict[str, int]]:
    """Return what a TOML text holds, and the line of each dotted key.

    Raises
    ------
    DescriptionError
    """
    from eomgen.scene.sources.toml import line_index  # noqa: PLC0415 - for TOML only

    try:
        return tomllib.loads(text), line_index(text)
    except ValueError as error:
        message = str(error)
        place = _TOML_PLACE.search(message)
        where, column = (f"{file}:{place[1]}", f" (column {place[2]})") if place else (file, "")
        what = _TOML_PLACE.sub("", message).encode("ascii", "backslashreplace").decode()
        problem = Problem(where, f"this is not TOML: {what[:200]}{column}", "TOML syntax: key = value, texts in quotes")
        raise DescriptionError(problem) from None
    except RecursionError:
        raise DescriptionError(Problem(file, "lists or tables are nested too deep", "fewer brackets")) from None
