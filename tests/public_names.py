"""Text of all public names: Python's with their parameters, verbs with their options, keys of scenes;
``python -m tests.public_names`` writes it to ``tests/public_names.txt``, a line for each function, verb or table. The
catalogue of messages holds their codes.

The text only grows: a line that goes needs a row in ``REMOVED``, which names the message that a user gets.
"""

from __future__ import annotations

import enum
import inspect
from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import groupby
from pathlib import Path

import click

from eomgen.base import products
from eomgen.cli import VERBS, commands
from eomgen.scene.document.reference import schema as scene_schema
from tests.docstrings import names

COMMAND = "python -m tests.public_names"
TEXT = Path(__file__).with_suffix(".txt")
#: Beginning of the removed lines -> code of the message that names the replacement.
REMOVED: Mapping[str, str] = {
    **dict.fromkeys(
        (
            "eomgen.RealTime",
            "eomgen.tune(*, real_time",
            "eomgen.tune(*, iterations",
            "eomgen tune --real-time",
            "eomgen tune --iterations",
        ),
        "E2236",
    ),
    "eomgen.extending.Connection(urdf": "E0124",  # names of URDF were never taken from other distributions
}


#: Made by `build` alone: parameters of the constructor are no public names.
BUILT = ("eomgen.Model",)


def python_names() -> Iterator[str]:
    """Yield public names, and each parameter of a function with its default."""
    for name, value in names():
        yield name
        if name in BUILT:
            continue
        if inspect.isclass(value) and (issubclass(value, BaseException) or issubclass(value, enum.Enum)):
            continue
        if callable(value):
            try:
                parameters = inspect.signature(value).parameters.values()
            except (TypeError, ValueError):
                continue
            yield from (f"{name}({_text(one)})" for one in parameters if one.name not in ("self", "cls"))


def _text(parameter: inspect.Parameter) -> str:
    stars = {inspect.Parameter.VAR_POSITIONAL: "*", inspect.Parameter.VAR_KEYWORD: "**"}.get(parameter.kind, "")
    position = "*, " if parameter.kind is inspect.Parameter.KEYWORD_ONLY else ""
    if parameter.default is inspect.Parameter.empty:
        return f"{position}{stars}{parameter.name}"
    plain = isinstance(parameter.default, bool | int | float | None)
    return f"{position}{parameter.name}={parameter.default!r}" if plain else f"{position}{parameter.name}=..."


def verbs() -> Iterator[str]:
    """Yield the verbs with their arguments and options."""
    context = click.Context(commands)
    for name in VERBS:
        command = commands.get_command(context, name)
        assert command is not None
        yield f"eomgen {name}"
        for parameter in command.params:
            words = [parameter.name.upper()] if isinstance(parameter, click.Argument) and parameter.name else []
            yield from (f"eomgen {name} {word}" for word in words or (*parameter.opts, *parameter.secondary_opts))


def keys() -> Iterator[str]:
    """Yield the keys of tables of a scene."""
    schema = scene_schema()
    for table, entry in (("scene", schema), *schema["$defs"].items()):
        yield from (f"[{table.removesuffix('Entry')}] {key}" for key in entry.get("properties", {}))


def earlier_names(names: Iterable[str]) -> Iterator[str]:
    """Yield names, and the names that those of a module that moved had before, which are still imported."""
    moved = {module: f"eomgen.{before}" for before, module in products.earlier_names().items()}
    for name in names:
        yield name
        yield from (before + name[len(module) :] for module, before in moved.items() if name.startswith(f"{module}."))


def lines() -> list[str]:
    """Return all lines, sorted within Python, verbs and keys."""
    return [line for part in (earlier_names(python_names()), verbs(), keys()) for line in sorted(set(part))]


def _head(line: str) -> str:
    """Return the function, verb or table of a line."""
    return line.partition("(")[0] if line.startswith("eomgen.") else line.rpartition(" ")[0] or line


def joined(lines: Iterable[str]) -> str:
    """Return lines as a text with one line for each function, verb or table, parts apart by tabulators."""
    groups = ((head, list(group)) for head, group in groupby(lines, _head))
    return "".join("\t".join([head, *(line.removeprefix(head) for line in group)]) + "\n" for head, group in groups)


def read_lines() -> list[str]:
    """Return the lines that the text holds."""
    rows = (line.split("\t") for line in TEXT.read_text(encoding="utf-8").splitlines())
    return [head + part for head, *parts in rows for part in parts]


def gone(before: Iterable[str], now: Collection[str]) -> list[str]:
    """Return the lines that are no longer there, without removed names."""
    return [line for line in before if line not in now and not line.startswith(tuple(REMOVED))]


if __name__ == "__main__":
    TEXT.write_text(joined(lines()), encoding="utf-8")
