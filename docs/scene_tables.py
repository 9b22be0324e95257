"""Tables of the pages in ``docs/scene``, made from the schema: ``python -m docs.scene_tables docs/scene.md`` renews
them.

A table stands between ``<!-- keys of Joint -->`` and ``<!-- end -->``, Joint being a class of the schema; the table of
units stands between ``<!-- units -->`` and ``<!-- end -->``. All else on the pages is written by hand. The type of a
key whose table stands on another page is a link to this page.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic.fields import FieldInfo

from eomgen.formula.units.table import UNITS
from eomgen.scene.document.schema import every_document
from eomgen.scene.formula.scope import (
    EVERYTHING,
    FIXED_PARAMETERS,
    LOAD,
    LOCAL_LOAD,
    PARAMETERS,
    SPRING_FORCE,
    STATE,
    TIME,
    TRANSLATION,
    Scope,
)
from eomgen.scene.reading.key_metadata import Table, every_unit, inner_table, meaning_of, tables_of
from eomgen.scene.reading.kinds import Description, Finite, Matrix, Rotations, Triple, Unit, Value, Values

COMMAND = "python -m docs.scene_tables docs/scene.md"
#: Titles of scopes on the page.
SCOPES: dict[Scope, str] = {
    FIXED_PARAMETERS: "of fixed parameters",
    PARAMETERS: "of parameters",
    TIME: "of time",
    TRANSLATION: "of `g`",
    STATE: "of the state",
    LOAD: "of the state and inverse dynamics",
    LOCAL_LOAD: "of the state and inverse dynamics, and of `here`",
    SPRING_FORCE: "of scope *spring force*",
    EVERYTHING: "of everything",
}
_MARKED = re.compile(r"(<!-- keys of (\w+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)
_UNITS = re.compile(r"(<!-- units -->\n).*?(<!-- end -->)", re.DOTALL)
_KINDS: tuple[tuple[Any, str], ...] = (
    (Finite, "number"),
    (Value, "value"),
    (Triple, "3 values"),
    (Values, "value or list of values"),
    (Matrix, "3x3 numbers"),
    (Rotations, "list of `axis`, `angle`"),
    (bool, "true or false"),
    (int, "whole number"),
    (str, "text"),
    (Unit, "text"),
    (Description, "text"),
)


def tables() -> dict[str, type[Table]]:
    """Return every class of the schema by name, for entries without the word ``Entry``."""
    models = tables_of(every_document()).values()
    parts = (part for table in models for part in table.__mro__ if issubclass(part, Table) and part is not Table)
    return {part.__name__.removesuffix("Entry"): part for part in parts}


def table(model: type[Table], pages: Mapping[str, str]) -> str:
    """Return the Markdown table of a class of the schema, one row of key, type, default and meaning for each key that
    the class declares with a description. Tables in ``pages``, by class, are links."""
    rows = ["| key | type | default | meaning |", "|---|---|---|---|"]
    hints = get_type_hints(model, include_extras=True)
    for name, field in model.model_fields.items():
        if field.description is not None and name in model.__annotations__:
            key = field.alias or name
            rows.append(f"| `{key}` | {_type(hints[name], field, pages)} | {_default(field)} | {field.description} |")
    return "\n".join(rows) + "\n"


def renew(page: str, pages: Mapping[str, str]) -> str:
    """Return the text of a page with the tables of the present schema; ``pages`` as of ``pages_of_tables``."""
    known, described = tables(), described_classes(page)
    elsewhere = {name: file for name, file in pages.items() if name not in described}
    page = _UNITS.sub(lambda match: match[1] + units() + match[2], page)
    return _MARKED.sub(lambda match: match[1] + table(known[match[2]], elsewhere) + match[4], page)


def units() -> str:
    """Return the Markdown table of units that scenes may have, grouped by the SI unit that they become; prefixed units
    have *."""
    by_kind: dict[str, list[str]] = {}
    for unit in UNITS:
        shown = f"`{unit.symbol}`{'*' if unit.prefixed else ''}"
        words = [word for word in unit.words.split() if word != unit.symbol and "_" not in word]
        by_kind.setdefault(unit.coherent, []).append(f"{shown} {' or '.join(words)}".strip())
    rows = [f"| {unit.replace('^2', '²').replace('^3', '³')} | {', '.join(names)} |" for unit, names in by_kind.items()]
    return "\n".join(["| becomes | from |", "|---|---|", *rows]) + "\n"


def described_classes(page: str) -> list[str]:
    """Return NAME of all marks ``<!-- keys of NAME -->`` in the text of a page, in order."""
    return [match[2] for match in _MARKED.finditer(page)]


def pages_of_tables(files: Iterable[Path]) -> dict[str, str]:
    """Return the names of the files that have the tables, by class."""
    return {name: file.name for file in files for name in described_classes(file.read_text(encoding="utf-8"))}


def _type(annotation: Any, field: FieldInfo, elsewhere: Mapping[str, str]) -> str:
    meaning, inner = meaning_of(field), inner_table(annotation)
    kind = meaning.kind or (_entry(meaning.refers) if meaning.refers else _kind(annotation, field))
    if inner is not None and (page := elsewhere.get(inner.model.__name__.removesuffix("Entry"))):
        kind = f"[{kind}]({page})"
    if meaning.kind:
        return kind
    names = meaning.names  # of scopes of products: the names that they describe themselves
    scope = f" {SCOPES.get(names, f'of {names.description}')}" if names is not None else ""
    units = " or ".join(every_unit(meaning)).replace("^2", "²")
    return f"{kind}{scope}{', ' if units else ''}{units}"


def _kind(annotation: Any, field: FieldInfo) -> str:
    """Return the words for the values of a key in the table of keys, from annotation and limits of the field. Raises
    TypeError for an annotation without words."""
    limits = {name: getattr(entry, name) for entry in field.metadata for name in ("ge", "le") if hasattr(entry, name)}
    if len(limits) == 2:
        return f"{limits['ge']} to {limits['le']}"
    if get_origin(annotation) in (Union, UnionType):
        members = [part for part in get_args(annotation) if part is not type(None)]
        if len(members) < len(get_args(annotation)):
            annotation = Union[tuple(members)]  # noqa: UP007 - made of a list
    for kind, words in _KINDS:
        if annotation == kind:
            return words
    if get_origin(annotation) is Literal:
        *most, last = (f"`{word}`" for word in get_args(annotation))
        return f"{', '.join(most)} or {last}" if most else last
    if get_origin(annotation) is Annotated:  # a kind with limits that no row of kinds names
        return _kind(get_args(annotation)[0], field)
    if (inner := inner_table(annotation)) is None:
        raise TypeError(f"the table of keys has no words for {annotation}")
    return {"table": "table", "list": "list of tables", "entries": "tables by name"}[inner.shape]


def _entry(section: str) -> str:
    return next((row.title for row in every_document().rows if row.key == section), section.removesuffix("s"))


def _default(field: FieldInfo) -> str:
    shown = meaning_of(field).shown_default
    if shown or field.is_required():
        return shown or "required"
    if field.default is None:
        return "none"
    if isinstance(field.default, str):
        return f"`{field.default}`" if field.default else '`""`'
    if isinstance(field.default, tuple):
        return f"`[{', '.join(f'{entry:g}' for entry in field.default)}]`"
    return f"`{str(field.default).lower()}`" if isinstance(field.default, bool) else f"`{field.default:g}`"


def main(arguments: Sequence[str]) -> int:
    """Renew the tables in the pages with the given paths, and in all pages in folders of the same names; return the
    exit code, 2 with a usage line if no page is given."""
    if not arguments:
        sys.stderr.write(f"usage: {COMMAND}\n")
        return 2
    for page in map(Path, arguments):
        files = [page, *sorted(page.with_suffix("").glob("*.md"))]
        pages = pages_of_tables(files)
        for path in files:
            path.write_text(renew(path.read_text(encoding="utf-8"), pages), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
