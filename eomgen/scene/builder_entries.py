"""What a builder of scenes keeps: the entries by section, and the line of the call that made each."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from eomgen.errors import Problem
from eomgen.text import key_of

Value = float | str
_PACKAGE = __name__.partition(".")[0]
Rotations = Sequence[tuple[Sequence[Value], Value]]


class Entries:
    """The data of a scene file as they grow call by call, the line of each entry, and what was given twice."""

    def __init__(self, **settings: Any) -> None:
        self._data: dict[str, Any] = {"format": 1, **{key: _plain(value) for key, value in settings.items()}}
        self._lines: dict[str, str] = dict.fromkeys(("name", "gravity", "terms", "coordinates"), _caller())
        self._problems: list[Problem] = []

    def _enter(self, section: str, name: str, /, **values: Any) -> Self:
        """Store an entry of a section (or the section itself, where it has no named entries), and the caller's line."""
        place = _caller()
        key = key_of(section, str(name)) if name != "" or section not in ("base", "simulation") else section
        entry = {field: _plain(value) for field, value in values.items() if value is not None}
        entries = self._data if key == section else self._data.setdefault(section, {})
        entry_name = section if key == section else str(name)
        if entry_name in entries:
            hint = "another name" if key != section else "one call"
            self._problems.append(Problem(f"{place} ({key})", f"this was given before, at {self._lines[key]}", hint))
        else:
            entries[entry_name] = entry
            self._lines[key] = place
        return self


def _caller() -> str:
    """Return ``file:line`` of the call that came from outside the package."""
    frame = sys._getframe(1)
    while frame.f_back is not None and str(frame.f_globals.get("__package__")).partition(".")[0] == _PACKAGE:
        frame = frame.f_back
    return f"{Path(frame.f_code.co_filename).name}:{frame.f_lineno}"


def _plain(value: Any) -> Any:
    """Return plain numbers, lists and tables for arrays, tuples and (axis, angle) pairs."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], Sequence) and not isinstance(value[0], str):
        return {"axis": _plain(value[0]), "angle": _plain(value[1])}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value
