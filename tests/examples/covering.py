"""The fewest examples that have between them every feature of all: suites that hold each scene to one property run on
these, and ``test_small_examples`` builds and runs every example."""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Keys whose words choose code: types of joints, elements, constraints and controllers, groups, shapes, methods.
CHOICES = ("coordinates", "group", "method", "shape", "type")
#: Keys of texts, of which no function of a model depends.
TEXTS = ("format", "name", "description", "unit")


@cache
def features(name: str) -> frozenset[str]:
    """Return the sections of an example, the keys of their entries, and the words of choices at any depth.

    Entries of ``repeat`` and of included files count as entries of the scene. ``name`` is a file below ``examples``, or
    a folder with a ``scene.toml``.
    """
    file = EXAMPLES / name
    return frozenset(_of_file(file / "scene.toml" if file.is_dir() else file))


def _of_file(file: Path) -> Iterator[str]:
    data = tomllib.loads(file.read_text(encoding="utf-8"))
    for row in data.get("include", {}).values():
        yield from _of_file(file.parent / row["file"])
    for part in (data, *data.get("repeat", {}).values()):
        for section in part.keys() - {*TEXTS, "indices"}:
            yield section
            if section not in ("include", "repeat"):
                words = (*_choices({section: part[section]}), *_keys(part[section]))
                yield from (f"{section}.{word}" for word in words)


def _keys(content: Any) -> Iterator[str]:
    """Yield the keys of the entries of a section, or of a section without entries."""
    if isinstance(content, Mapping):
        of_entries = content and all(isinstance(entry, Mapping) for entry in content.values())
        for entry in content.values() if of_entries else (content,):
            yield from (key for key in entry if key not in TEXTS)


def _choices(content: Any) -> Iterator[str]:
    if isinstance(content, Mapping):
        yield from (f"{key}={word}" for key, word in content.items() if key in CHOICES and isinstance(word, str))
        content = list(content.values())
    for value in content if isinstance(content, list) else ():
        yield from _choices(value)


def covering(names: Iterable[str], also: Collection[str] = ()) -> list[str]:
    """Return some of the examples, in their order, which have every feature that any of them has.

    Each next example has the most features that the earlier ones lack; examples without a feature of their own are left
    out again, large ones first. Those of ``also`` are taken in any case.
    """
    names = list(names)
    of = {name: features(name) for name in names}
    every = frozenset().union(*of.values())
    taken = [name for name in names if name in also]
    missing = every.difference(*(of[name] for name in taken))
    while missing:
        taken.append(max(names, key=lambda name: len(of[name] & missing)))
        missing -= of[taken[-1]]
    for name in sorted(set(taken).difference(also), key=lambda name: (-len(of[name]), name)):
        rest = [other for other in taken if other != name]
        if frozenset().union(*(of[other] for other in rest)) == every:
            taken = rest
    return [name for name in names if name in taken]
