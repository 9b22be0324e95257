"""Rows in the registers of sources and of other file kinds; user text files in UTF-8, bounded in size, and their names
in messages."""

from __future__ import annotations

import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.base.files import nearby, read_bytes
from eomgen.base.messages import shown
from eomgen.base.products import fault_of_absent, rows_of
from eomgen.errors import DescriptionError, Problem, UsageError


@dataclass(frozen=True)
class ConvertedScene:
    """A description in the form of a scene file.

    Attributes
    ----------
    data : dict
        As ``tomllib`` reads a scene file.
    lines : mapping
        The line of each dotted key, or ``file:line``, for messages.
    notes : sequence of str
        On changed and left out elements.
    inertias_checked : bool
        Whether the source has judged the inertias already.
    metadata : mapping
        Facts of the file that the scene hands on and does not use.
    """

    data: dict[str, Any]
    lines: Mapping[str, int | str]
    notes: Sequence[str] = ()
    inertias_checked: bool = False
    metadata: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Option:
    """An option of a source: an argument of ``load``, a command-line option, or a key of an included file.

    Attributes
    ----------
    default : str, bool or tuple of str
        ``()`` for a list of names.
    description : str
        Effect of the option; ``of_key`` describes the option as a key.
    elsewhere : str
        Key with the same effect in a scene file.
    """

    name: str
    default: str | bool | tuple[str, ...]
    description: str
    choices: tuple[str, ...] = ()
    metavar: str = ""
    of_key: str = ""
    elsewhere: str = ""


#: Options of several sources.
LOCK = Option("lock", (), "hold this joint at zero; may be repeated", metavar="JOINT", of_key="joints held at zero")
LIMITS = Option("limits", False, "turn limits of position into compliant stops")
FRICTION = Option("friction", False, "take dry friction of joints, regularised")
ACTUATED = Option(
    "actuated",
    False,
    "give every moving joint of one coordinate an effort input of its own name",
    elsewhere="[inputs] and [efforts] in the scene file",
)


class OptionError(UsageError):
    """An option that does not fit the file, such as the name of an element missing in the file."""

    def __init__(self, option: str, fault: str, hint: str) -> None:
        super().__init__(fault, hint)
        self.option = option


@dataclass(frozen=True)
class Source:
    """One kind of file.

    Attributes
    ----------
    name : str
        Of the format, for messages.
    endings : tuple of str
        Endings of file names, in lower case, with the dot.
    article : str
        How hints call such a file: ``a .urdf file``.
    read : callable
        ``read(text, file=, strict=, included=, **options) -> ConvertedScene``; ``strict`` refuses elements that would
        be left out with a note, ``included`` is set if the file is a part of a scene, which may not be fixed to the
        base. Raises DescriptionError.
    options : tuple of Option
    elsewhere : mapping
        Endings of files that another program converts to this kind, and a hint.
    words : mapping
        Names of options in other tools, and a hint.
    scenes : bool
        Whether the files of the source are scene files: with units, and with further includes.
    root : str
        Of XML formats that share an ending: the beginning of the name of the outermost element, which decides.
    recorded : bool
        Whether the files that were read decide a reading, so that later processes may use a record of the reading.
    located : bool
        Whether ``read`` takes the ``path`` of the file as well, for the files that it names.
    """

    name: str
    endings: tuple[str, ...]
    article: str
    read: Callable[..., ConvertedScene]
    options: tuple[Option, ...] = ()
    elsewhere: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)
    scenes: bool = False
    root: str = ""
    recorded: bool = False
    located: bool = False

    def convert(self, text: str, path: Path, **options: Any) -> ConvertedScene:
        """Return a file of this source in the form of a scene file; the options as of ``read``.

        Parameters
        ----------
        text : str
            Content of the file.
        path : Path
            Path of the file: its name for messages, and the folder of files that it names if the source is ``located``.
        **options : object
            Options as of ``read``: ``strict``, ``included`` and the options of the source.

        Returns
        -------
        ConvertedScene
            Data in the form of a scene file, not checked as a scene, with notes.

        Raises
        ------
        DescriptionError, UsageError
            As of ``read``: a faulty file; an option that does not fit the file.
        """
        located = {"path": path} if self.located else {}
        return self.read(text, file=shown_file(path), **located, **options)


LARGEST_FILE = 10_000_000
_ENCODING = re.compile(rb"""<\?xml\s[^>]*encoding\s*=\s*["']([A-Za-z][\w.-]*)["']""")
_PACKAGE = "package://"


def shown_file(path: Path, *, whole: bool = False) -> str:
    """Return a file's name for messages, or the ``whole`` path, with control characters escaped."""
    text = path.as_posix() if whole else path.name
    return text if text.isascii() and text.isprintable() else ascii(text)


def _in_place_of(path: Path, endings: Collection[str]) -> str:
    """Return a hint for a file that cannot be read."""
    if path.parts[:1] == ("package:",):
        return f"a path of the file system: no ROS is asked where {_PACKAGE}{'/'.join(path.parts[1:2])} is"
    return nearby(path, endings=endings)


def read_text(path: Path, endings: Collection[str] = ()) -> str:
    """Return the text of a UTF-8 file, with or without a byte order mark, or of an XML file in the encoding that it
    declares.

    Parameters
    ----------
    endings : collection of str
        Of files that the remedy of a missing file may name; all by default.

    Raises
    ------
    FileError
        The file cannot be read or is larger than 10 MB.
    DescriptionError
        The bytes are not UTF-8.
    """
    data = read_bytes(path, LARGEST_FILE, partial(_in_place_of, endings=endings))
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if (text := _decode(data)) is not None:
            return text
        line = data.count(b"\n", 0, error.start) + 1
        fault = f"byte {error.start} is not UTF-8 [E1894]"
        raise DescriptionError(Problem(f"{shown_file(path)}:{line}", fault, "the file saved as UTF-8")) from None


def _decode(data: bytes) -> str | None:
    """Return the text of an XML file in the encoding of its byte order mark (UTF-16) or its declaration; None without
    one, and for bytes that do not fit the encoding."""
    declaration = _ENCODING.match(data)
    encoding = "utf-16" if data[:2] in (BOM_UTF16_LE, BOM_UTF16_BE) else declaration and declaration[1].decode("ascii")
    try:
        return data.decode(encoding) if encoding else None
    except (LookupError, ValueError):
        return None


#: The register of other kinds of files, which products read.
KINDS = "eomgen.file_kinds"


@dataclass(frozen=True)
class OtherFileKind:
    """A kind of file other than mechanical scenes.

    Attributes
    ----------
    kind : value of the key
    noun : for messages, "a Hamiltonian system"
    remedy : uses of such a file, for messages
    """

    kind: str
    noun: str
    remedy: str


def kind_of(data: Mapping[str, Any]) -> str:
    """Return the noun of the kind of a file, from its data."""
    rows = rows_of(KINDS, OtherFileKind)
    return next((row.noun for row in rows if row.kind == data.get("kind")), "a mechanical scene")


def fault_of_kind(kind: object) -> tuple[str, str] | None:
    """Return the fault of a key ``kind`` in a mechanical scene, and a remedy; None if the value means no other kind."""
    for row in rows_of(KINDS, OtherFileKind):
        if row.kind == kind:
            return f"this is {row.noun}, and this command or function is for mechanical scenes [E1684]", row.remedy
    absent = fault_of_absent(str(kind))
    return absent and (f"there is no kind of file {shown(str(kind))}: {absent[0]} [E1683]", absent[1])
