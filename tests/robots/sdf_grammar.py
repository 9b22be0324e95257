"""The page docs/sdf.md: how eomgen takes each element and attribute of the grammar of SDF. ``python -m
tests.robots.sdf_grammar docs/sdf.md`` renews it. The grammar is kept in tests/files/sdf_grammar.json, which ``python -m
tests.robots.sdf_grammar FOLDER`` makes of the format's own descriptions, the folder ``sdf`` of gazebosim/sdformat."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

from eomgen.products.robots.leftovers import IDLE, READ
from eomgen.products.robots.sdf.values import STATUSES, Minor
from tests.robots.tables import MEANINGS

FIRST, NEWEST = Minor.FIRST, Minor.NEWEST
COMMAND = "python -m tests.robots.sdf_grammar docs/sdf.md"
PAGE = Path(__file__).parents[2] / "docs" / "sdf.md"
FILE = Path(__file__).parents[1] / "files" / "sdf_grammar.json"
#: Commit of the repository from which the file was made.
COMMIT = "2ace536244acf0b3f60367b54488381d1224ce30"
#: Type of an element that has elements.
INNER = "elements"


@dataclass(frozen=True)
class Part:
    """An element or an attribute, which has an @: type of its value, and the minor versions that have it."""

    name: str
    type: str
    first: int
    last: int

    @property
    def words(self) -> str:
        """Return the name, with the versions that have it unless all have."""
        if self.last < NEWEST:
            return f"{self.name} (1.{self.first} to 1.{self.last})"
        return self.name if self.first == FIRST else f"{self.name} (from 1.{self.first})"


@cache
def grammar() -> Mapping[str, tuple[Part, ...]]:
    """Return the parts of each element by its key in the table."""
    content = json.loads(FILE.read_text(encoding="utf-8"))
    return {
        key: tuple(Part(name, *values) for name, values in parts.items()) for key, parts in content["elements"].items()
    }


def key_of(tag: str, holder: str) -> str:
    """Return the key of an element from its tag and the tag of the element that holds it."""
    return f"{holder}/{tag}" if f"{holder}/{tag}" in STATUSES else tag


def extracted(folder: Path) -> dict[str, dict[str, tuple[str, int, int]]]:
    """Return the grammar of the descriptions in a folder: the parts of each element that is read, by its key."""
    result: dict[str, dict[str, tuple[str, int, int]]] = {}
    for minor in range(FIRST, NEWEST + 1):
        for key, name, kind in _Description(folder / f"1.{minor}").parts():
            first = result.setdefault(key, {}).get(name, (kind, minor, minor))[1]
            result[key][name] = (kind, first, minor)
    return {key: dict(sorted(result[key].items())) for key in STATUSES if key in result}


class _Description:
    """The description of one version of the format."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.seen: set[tuple[str, ...]] = set()

    def file(self, name: str) -> ElementTree.Element:
        return ElementTree.parse(self.folder / name).getroot()

    def parts(self) -> Iterator[tuple[str, str, str]]:
        """Yield the key of an element, and name and type of a part, for all elements that are read."""
        yield from self.parts_of(self.file("root.sdf"), "sdf", ("sdf",))

    def parts_of(self, element: ElementTree.Element, key: str, path: tuple[str, ...]) -> Iterator[tuple[str, str, str]]:
        if len(set(path)) < len(path):  # a model within a model
            return
        for attribute in element.findall("attribute"):
            yield key, f"@{attribute.get('name')}", attribute.get("type") or ""
        inner = [(child.get("name") or "", child) for child in element.findall("element") if child.get("name")]
        included = [self.file(child.get("filename") or "") for child in element.findall("include")]
        for name, child in [*inner, *((child.get("name") or "", child) for child in included)]:
            kind = INNER if child.get("type") in (None, "") or child.get("ref") else child.get("type")
            yield key, name, kind or ""
            own = key_of(name, path[-1])
            status = STATUSES.get(key, {}).get(name)
            if status == READ or (status != IDLE and own in STATUSES):
                yield from self.parts_of(child, own, (*path, name))


def page() -> str:
    """Return the text of the page."""
    lines = [
        "# SDF: every element and attribute\n",
        f"How eomgen takes each part of the grammar of SDF 1.{FIRST} to 1.{NEWEST}, from the format's own descriptions",
        f"(gazebosim/sdformat, commit {COMMIT[:8]}); [SDF](scene/sdf.md) lists the elements with their counterparts in",
        "scenes.",
        f"The table is made by `{COMMAND}`, and a test tries each part.\n",
        "| | |\n|---|---|",
        *(f"| {status} | {meaning} |" for status, meaning in MEANINGS.items()),
        "\nAn `@` marks attributes. Parts of an element without effect are without effect, too, and parts of a noted",
        "element are noted with it. A part that is not in this table is noted, and refused with `--strict`.\n",
        "| element | parts |\n|---|---|",
    ]
    for key, parts in grammar().items():
        by_status = {
            status: [part.words for part in parts if STATUSES[key].get(part.name) == status] for status in MEANINGS
        }
        texts = [f"**{status}**: {', '.join(names)}" for status, names in by_status.items() if names]
        lines.append(f"| `{key}` | {'; '.join(texts)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    target = Path(sys.argv[1])
    if target.is_dir():
        content = {"source": f"gazebosim/sdformat {COMMIT}", "elements": extracted(target)}
        rows = ",\n".join(
            f"  {json.dumps(key)}: {{\n"
            + ",\n".join(f"    {json.dumps(name)}: {json.dumps(values)}" for name, values in parts.items())
            + "\n  }"
            for key, parts in content["elements"].items()
        )
        FILE.write_text(
            f'{{"source": {json.dumps(content["source"])}, "elements": {{\n{rows}\n}}}}\n', encoding="utf-8"
        )
    else:
        target.write_text(page(), encoding="utf-8")
