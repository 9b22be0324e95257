"""Source: one row of the register of sources."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Read:
    """A description in the form of a scene file.

    Attributes
    ----------
    data : dict
        As ``tomllib`` reads a scene file.
    lines : mapping
        The line of each dotted key, or ``file:line``, for messages.
    notes : sequence of str
        What was changed and left out.
    inertias_checked : bool
        Whether the source has judged the inertias already.
    """

    data: dict[str, Any]
    lines: Mapping[str, int | str]
    notes: Sequence[str] = ()
    inertias_checked: bool = False


@dataclass(frozen=True)
class Option:
    """An option of a source; a default of ``()`` stands for a list of names."""

    name: str
    default: str | bool | tuple[str, ...]
    description: str
    choices: tuple[str, ...] = ()
    metavar: str = ""


@dataclass(frozen=True)
class Source:
    """One kind of file.

    Attributes
    ----------
    name : str
        Of the format, for messages.
    endings : tuple of str
        Endings of its files, in lower case, with the dot.
    article : str
        How hints call such a file: ``a .urdf file``.
    read : callable
        ``read(text, file=, strict=, included=, **options) -> Read``; ``strict`` refuses what would be left out with a
        note, ``included`` is set where the file is a part of a scene, which may not be fixed to the base. Raises
        DescriptionError.
    options : tuple of Option
    elsewhere : mapping
        Endings of files that become this kind by another program, and what to try.
    """

    name: str
    endings: tuple[str, ...]
    article: str
    read: Callable[..., Read]
    options: tuple[Option, ...] = ()
    elsewhere: Mapping[str, str] = field(default_factory=dict)
