"""Scene files in TOML, and keys with former names: a register of dated changes, by which old files are read and their
texts renewed, name by name, so that comments, order and layout stay."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from typing import NamedTuple

from eomgen.errors import DescriptionError, Problem
from eomgen.scene.sources.source import ConvertedScene
from eomgen.scene.sources.toml import Key, TomlScanner, toml_data


class RenamedKey(NamedTuple):
    """A key with a new name.

    Attributes
    ----------
    version, date : version of eomgen with the new name, and its day, ``2027-03-01``
    path : place of the old name, ``joints.*.damper``; a star is any name, and lists are passed through
    name : the new name, ``damping``
    """

    version: str
    date: str
    path: str
    name: str

    @property
    def parts(self) -> tuple[str, ...]:
        """Names on the way to the key, and the old name."""
        return tuple(self.path.split("."))


class Renaming(NamedTuple):
    """A key of a file that is renamed.

    Attributes
    ----------
    line : from 1
    key : dotted key with the old name
    change : row of the register
    """

    line: int
    key: str
    change: RenamedKey


#: Renamed keys, in the order of time. There is none: no key of format 1 has changed since its first version, to which
#: ``tests/scene/test_renamed_keys.py`` holds the schemas.
CHANGES: tuple[RenamedKey, ...] = ()


def read_toml(text: str, *, file: str, strict: bool = False, included: bool = False) -> ConvertedScene:
    """Return the data of a scene file with lines; former names of keys are replaced by the present ones, with a note
    each. ``strict`` and ``included`` have no effect. Raises DescriptionError."""
    del strict, included
    result = ConvertedScene(*toml_data(text, file))
    present, changes = renamed_text(text, file)
    if not changes:
        return result
    notes = [
        f"{file}:{line} ({key}): since eomgen {change.version} the name of this key is {change.name}; write this name"
        " by eomgen migrate"
        for line, key, change in changes
    ]
    return ConvertedScene(*toml_data(present, file), notes)


def renamed_text(text: str, file: str) -> tuple[str, list[Renaming]]:
    """Return the text of a file, which is valid TOML, with the present names of the keys, and the changes in the order
    of lines; ``file`` is the name for messages. Raises DescriptionError if a table has both names of a key."""
    made: list[Renaming] = []
    for change in CHANGES:
        parts = change.parts
        pieces, end = [], 0
        scanner = _KeyPlaces(text)
        scanner.scan()
        for key, places in scanner.keys:
            depth = len(parts) - 1 - (len(key) - len(places))
            if 0 <= depth < len(places) and _fits(key, parts):
                start, stop = places[depth]
                pieces += [text[end:start], change.name]
                end = stop
                made.append(Renaming(text.count("\n", 0, start) + 1, ".".join(key[: len(parts)]), change))
        text = "".join([*pieces, text[end:]])
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        where = f"{file}:{made[0].line} ({made[0].key})"
        fault = f"this is a former name of {made[0].change.name}, and the table has both [E2174]"
        raise DescriptionError(Problem(where, fault, "one of them")) from None
    return text, sorted(made)


def _fits(key: Sequence[str], parts: Sequence[str]) -> bool:
    return len(key) >= len(parts) and all(part in ("*", name) for name, part in zip(key, parts, strict=False))


class _KeyPlaces(TomlScanner):
    """Scanner that records the names of all keys, of tables, pairs and inline tables, with start and end of each name
    in the text."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.keys: list[tuple[tuple[str, ...], list[tuple[int, int]]]] = []
        self.places: list[tuple[int, int]] = []

    def part(self) -> str:
        start = self.place
        name = super().part()
        self.places.append((start, self.place))
        return name

    def key(self) -> Key:
        self.places = []
        return super().key()

    def note(self, key: Key) -> None:
        super().note(key)
        if not isinstance(key[-1], int):
            self.keys.append((tuple(part for part in key if isinstance(part, str)), self.places))
