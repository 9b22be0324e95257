"""Settings put into the text of a scene file; all else stays, except for comments beside values that are replaced."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from eomgen.errors import FileError, Problem, UsageError

_SECTION = re.compile(r"^\s*\[([^\[\]]+)\]\s*(#.*)?$")
_BODY = re.compile(r"^bodies\.([A-Za-z0-9_-]+)$")
#: Keys that say how a run is made, which leave the file if they are not among the new ones.
_OF_METHODS = (
    "method",
    "step",
    "rho_inf",
    "alpha",
    "beta",
    "gamma",
    "tolerance",
    "order",
    "record_every",
    "settings",
    "real",
)


def with_settings(path: Path | None, simulation: Mapping[str, Any], coordinates: str, group: str) -> str:
    """Return the text of a scene file with other settings of ``[simulation]``, coordinates and groups of bodies.

    Raises
    ------
    UsageError
        There is no such file, or it is written in a way that is not understood here: the settings are in the message.
    """
    keys = ", ".join(f"{name} = {_value(value)}" for name, value in simulation.items())
    hint = f"[simulation] {keys}" + (f", and coordinates = {_value(coordinates)}" if coordinates else "")
    if path is None or path.suffix.lower() != ".toml":
        raise UsageError(Problem(str(path or "scene"), "settings can be written into .toml scene files only", hint))
    try:
        lines = path.read_text(encoding="utf-8").split("\n")
    except OSError as error:
        raise FileError(Problem(str(path), f"cannot be read: {error.strerror or error}", "another path")) from None
    lines = _with_section(lines, "simulation", simulation, _OF_METHODS)
    if coordinates:
        lines = _with_key(lines, "", "coordinates", coordinates)
    if group:
        for section in [match[1].strip() for line in lines if (match := _SECTION.match(line))]:
            if _BODY.match(section):
                lines = _with_key(lines, section, "group", group)
    text = "\n".join(lines)
    if not _holds(text, simulation, coordinates):
        raise UsageError(Problem(str(path), "its [simulation] is written in a way that cannot be changed here", hint))
    return text


def _span(lines: list[str], section: str) -> tuple[int, int] | None:
    """Return the lines of a section, without its header; the empty name is for the lines before the first header."""
    headers = [number for number, line in enumerate(lines) if re.match(r"^\s*\[", line)]
    if not section:
        return 0, headers[0] if headers else len(lines)
    for number in headers:
        match = _SECTION.match(lines[number])
        if match and match[1].strip() == section:
            return number + 1, next((other for other in headers if other > number), len(lines))
    return None


def _with_section(lines: list[str], section: str, values: Mapping[str, Any], known: tuple[str, ...]) -> list[str]:
    span = _span(lines, section)
    if span is None:
        own = [f"[{section}]", *(f"{name} = {_value(value)}" for name, value in values.items())]
        return [*lines, *([""] if lines and lines[-1] else []), *own, ""]
    for name in known:
        if name not in values:
            begin, end = _span(lines, section) or span
            lines = [line for n, line in enumerate(lines) if not (begin <= n < end and _is_key(line, name))]
    for name, value in values.items():
        lines = _with_key(lines, section, name, value)
    return lines


def _with_key(lines: list[str], section: str, name: str, value: Any) -> list[str]:
    begin, end = _span(lines, section) or (0, 0)
    for number in range(begin, end):
        if _is_key(lines[number], name):
            written = f"{name} = {_value(value)}"
            comment = re.search(r"\s+#[^\"']*$", lines[number])
            if comment and lines[number][: comment.start()].strip() == written:  # of another value it may be false
                written += comment[0]
            return [*lines[:number], written, *lines[number + 1 :]]
    last = max((n for n in range(begin, end) if lines[n].strip()), default=begin - 1)
    return [*lines[: last + 1], f"{name} = {_value(value)}", *lines[last + 1 :]]


def _is_key(line: str, name: str) -> bool:
    return re.match(rf"^\s*{re.escape(name)}\s*=", line) is not None


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{name} = {_value(one)}' for name, one in value.items())} }}"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _holds(text: str, simulation: Mapping[str, Any], coordinates: str) -> bool:
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return False
    section = data.get("simulation", {})
    set_ = all(section.get(name) == value for name, value in simulation.items())
    return set_ and (not coordinates or data.get("coordinates") == coordinates)
