"""Documents made from the schema: the tables of the pages in ``docs/scene``, renewed by ``python -m
eomgen.scene.document.reference docs/scene.md``, and the JSON Schema of scene files, for editors.

A table stands between ``<!-- keys of Joint -->`` and ``<!-- end -->``, Joint being a class of the schema; the table of
units stands between ``<!-- units -->`` and ``<!-- end -->``. All else on the pages is written by hand.
"""

from __future__ import annotations

import inspect
import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from eomgen.formula.units.table import UNITS
from eomgen.scene.document.schema import every_document
from eomgen.scene.formula.scope import (
    EVERYTHING,
    FIXED_PARAMETERS,
    LOAD,
    LOCAL_LOAD,
    PARAMETERS,
    ROAD,
    SPRING_FORCE,
    STATE,
    TIME,
    TRANSLATION,
    Scope,
)
from eomgen.scene.reading.key_metadata import Key, KeyMetadata, Table, every_unit, fields_of, inner_table, tables_of
from eomgen.scene.reading.kinds import (
    NUMBER_SCHEMA,
    QUANTITY_SCHEMA,
    Description,
    Finite,
    Matrix,
    Rotations,
    Triple,
    Unit,
    Value,
    Values,
)
from eomgen.scene.reading.table_checks import JsonSchema, Within, marks_of

COMMAND = "python -m eomgen.scene.document.reference docs/scene.md"
#: Titles of scopes on the page.
SCOPES: dict[Scope, str] = {
    FIXED_PARAMETERS: "of fixed parameters",
    PARAMETERS: "of parameters",
    TIME: "of time",
    TRANSLATION: "of `g`",
    STATE: "of the state",
    LOAD: "of the state and inverse dynamics",
    LOCAL_LOAD: "of the state and inverse dynamics, and of `here`",
    ROAD: "of scope *road*",
    SPRING_FORCE: "of scope *spring force*",
    EVERYTHING: "of everything",
}
_MARKED = re.compile(r"(<!-- keys of (\w+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)
_UNITS = re.compile(r"(<!-- units -->\n).*?(<!-- end -->)", re.DOTALL)
#: JSON Schemas of plain types.
_JSON: dict[Any, dict[str, Any]] = {
    Any: {},
    NoneType: {"type": "null"},
    str: {"type": "string"},
    bool: {"type": "boolean"},
    int: {"type": "integer"},
    float: {"type": "number"},
}
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
    """Return every class of the schema by name, for entries of force elements by the name of the element."""
    models = tables_of(every_document()).values()
    parts = (part for table in models for part in table.__mro__ if issubclass(part, Table) and part is not Table)
    return {part.__name__.removesuffix("Entry"): part for part in parts}


def table(model: type[Table]) -> str:
    """Return the Markdown table of a class of the schema: a row for each key of the class with a description."""
    rows = ["| key | type | default | meaning |", "|---|---|---|---|"]
    hints = get_type_hints(model, include_extras=True)
    for name, field in model.model_fields.items():
        if field.description is not None and name in model.__annotations__:
            key = field.alias or name
            rows.append(f"| `{key}` | {_type(hints[name], field)} | {_default(field)} | {field.description} |")
    return "\n".join(rows) + "\n"


def renewed(page: str) -> str:
    """Return the text of a page with the tables of the present schema."""
    known = tables()
    page = _UNITS.sub(lambda match: match[1] + units() + match[2], page)
    return _MARKED.sub(lambda match: match[1] + table(known[match[2]]) + match[4], page)


def units() -> str:
    """Return the Markdown table of units."""
    by_kind: dict[str, list[str]] = {}
    for unit in UNITS:
        shown = f"`{unit.symbol}`{'*' if unit.prefixed else ''}"
        words = [word for word in unit.words.split() if word != unit.symbol and "_" not in word]
        by_kind.setdefault(unit.coherent, []).append(f"{shown} {' or '.join(words)}".strip())
    rows = [f"| {unit.replace('^2', '²').replace('^3', '³')} | {', '.join(names)} |" for unit, names in by_kind.items()]
    return "\n".join(["| becomes | from |", "|---|---|", *rows]) + "\n"


def described(page: str) -> list[str]:
    """Return the names of the classes whose tables are on a page."""
    return [match[2] for match in _MARKED.finditer(page)]


def _type(annotation: Any, field: Key) -> str:
    meaning = field.meaning
    kind = meaning.kind or (_entry(meaning.refers) if meaning.refers else _kind(annotation, field))
    if meaning.kind:
        return kind
    scope = f" {SCOPES[meaning.names]}" if meaning.names is not None else ""
    units = " or ".join(every_unit(meaning)).replace("^2", "²")
    return f"{kind}{scope}{', ' if units else ''}{units}"


def _kind(annotation: Any, field: Key) -> str:
    for mark in marks_of(field.type)[1]:
        if isinstance(mark, Within) and mark.ge is not None and mark.le is not None:
            return f"{mark.ge} to {mark.le}"
    if get_origin(annotation) in (Union, UnionType):
        given = [part for part in get_args(annotation) if part is not type(None)]
        if len(given) < len(get_args(annotation)):
            annotation = Union[tuple(given)]  # noqa: UP007 - made of a list
    for known, words in _KINDS:
        if annotation == known:
            return words
    if get_origin(annotation := marks_of(annotation)[0]) is Literal:
        *most, last = (f"`{word}`" for word in get_args(annotation))
        return f"{', '.join(most)} or {last}" if most else last
    return "table, below"


def _entry(section: str) -> str:
    return next((row.title for row in every_document().rows if row.key == section), section.removesuffix("s"))


def _default(field: Key) -> str:
    shown = field.meaning.shown_default
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
    """Renew the given pages with their parts, the pages in the folder of the same name."""
    if not arguments:
        sys.stderr.write(f"usage: {COMMAND}\n")
        return 2
    for page in map(Path, arguments):
        for path in (page, *sorted(page.with_suffix("").glob("*.md"))):
            text = path.read_text(encoding="utf-8")
            path.write_text(renewed(text), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))


def schema() -> dict[str, Any]:
    """Return the JSON Schema of scene files; ``x-unit`` and ``x-names`` are the unit of a key and the scope of the
    formulas of a key.

    The schema has only keywords with equal meaning in draft 4 and later drafts, since editors of TOML know draft 4.
    """
    document = every_document()
    known = tables_of(document)
    definitions = {name: _schema_of_table(model) for name, model in sorted(known.items()) if model is not document}
    description = {"$defs": definitions, **_schema_of_table(document)}
    for name, model in known.items():
        properties = definitions.get(name, description)["properties"]  # the document is not a definition
        for key_name, (meaning, _) in fields_of(model).items():
            _annotate(properties[key_name], meaning)
    definitions["Parameter"] = {"anyOf": [NUMBER_SCHEMA, QUANTITY_SCHEMA, definitions["Parameter"]]}
    point = {"type": "string", "description": "the name of a point"}
    formula = {"type": ["string", "number"], "description": "the formula alone"}
    definitions["Definition"] = {"anyOf": [formula, definitions["Definition"]]}
    definitions["Frame"] = {"anyOf": [point, definitions["Frame"]]}
    return {"$schema": "http://json-schema.org/draft-04/schema#", **_of_every_draft(description)}


def _schema_of_table(table: type[Table]) -> dict[str, Any]:
    """Return the JSON Schema of a table, which refers to the schemas of tables in it."""
    keys = {key.alias or name: (name, key) for name, key in table.model_fields.items()}
    required = [written for written, (_, key) in keys.items() if key.is_required()]
    return {
        "additionalProperties": table.others,
        "description": inspect.cleandoc(table.__doc__ or ""),
        "properties": {written: _schema_of_key(written, key) for written, (_, key) in keys.items()},
        **({"required": required} if required else {}),
        "title": table.__name__,
        "type": "object",
    }


def _schema_of_key(name: str, key: Key) -> dict[str, Any]:
    """Return the JSON Schema of a key with default and description."""
    result = _schema_of_type(key.type)
    default = key.default.plain() if isinstance(key.default, Table) else key.default
    default = list(default) if isinstance(default, tuple) else default
    result |= {} if key.is_required() else {"default": default}
    result |= {} if key.description is None else {"description": key.description}
    inner = inner_table(key.annotation)
    is_table = inner is not None and inner.shape == "table"
    return result if is_table else result | {"title": name.replace("_", " ").title()}


def _schema_of_type(annotation: Any) -> dict[str, Any]:
    """Return the JSON Schema of a type with marks."""
    plain, marks = marks_of(annotation)
    for mark in marks:
        if isinstance(mark, JsonSchema):
            return dict(mark.schema)
    result = _schema_of_plain(plain)
    for mark in marks:
        if isinstance(mark, Within):
            result |= {word: value for word, value in _bounds(mark, result["type"]) if value is not None}
    return result


def _bounds(mark: Within, kind: str) -> list[tuple[str, float | None]]:
    """Return the bounds of a type by the keywords of JSON Schema."""
    noun = "Length" if kind == "string" else "Properties"
    return [
        ("minimum", mark.ge),
        ("maximum", mark.le),
        ("exclusiveMinimum", mark.gt),
        (f"min{noun}", mark.min_length),
        (f"max{noun}", mark.max_length),
    ]


def _schema_of_plain(plain: Any) -> dict[str, Any]:
    """Return the JSON Schema of a type without marks."""
    origin, parts = get_origin(plain), get_args(plain)
    if origin in (Union, UnionType):
        each = [_schema_of_type(part) for part in parts]
        flat = [part for entry in each for part in (entry["anyOf"] if set(entry) == {"anyOf"} else [entry])]
        return {"anyOf": flat}
    if origin is Literal:
        kind = {"type": "integer" if isinstance(parts[0], int) else "string"}
        return ({"const": parts[0]} if len(parts) == 1 else {"enum": list(parts)}) | kind
    if origin is dict:
        inner = _schema_of_type(parts[1])
        return {"type": "object", "additionalProperties": inner or True}
    if origin is tuple:
        length = {} if parts[-1] is Ellipsis else {"maxItems": len(parts), "minItems": len(parts)}
        return {"type": "array", "items": _schema_of_type(parts[0]), **length}
    return {"$ref": f"#/$defs/{plain.__name__}"} if plain not in _JSON else dict(_JSON[plain])


def _of_every_draft(node: Any) -> Any:
    """Return a JSON Schema with keywords of draft 4 only: later keywords are replaced by equivalents."""
    if isinstance(node, list):
        return [_of_every_draft(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    node = {key_name: _of_every_draft(entry) for key_name, entry in node.items()}
    if "const" in node:
        node["enum"] = [node.pop("const")]
    return node


def _annotate(entry: dict[str, Any], meaning: KeyMetadata) -> None:
    """Add the unit, names and references of a key to the JSON Schema of the key."""
    units = every_unit(meaning)
    if units:
        entry["x-unit"] = " or ".join(units)
        entry["description"] += f" ({entry['x-unit']})"
    if units and entry.get("type") == "number":
        entry.pop("type")
        entry["anyOf"] = [NUMBER_SCHEMA, QUANTITY_SCHEMA]
    if meaning.names is not None:
        entry["x-names"] = meaning.names.description


def json_schema() -> str:
    """Return the JSON Schema of scene files as text."""
    return json.dumps(schema(), indent=2) + "\n"
