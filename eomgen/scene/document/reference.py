"""The JSON Schema of scene files, for editors."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.scene.document.schema import every_document
from eomgen.scene.reading.key_metadata import KeyMetadata, Table, every_unit, fields_of, tables_of
from eomgen.scene.reading.kinds import NUMBER_SCHEMA, QUANTITY_SCHEMA


def schema() -> dict[str, Any]:
    """Return the JSON Schema of scene files, as ``schema_of``."""
    point = {"type": "string", "description": "the name of a point"}
    formula = {"type": ["string", "number"], "description": "the formula alone"}
    short = {"ParameterEntry": (NUMBER_SCHEMA, QUANTITY_SCHEMA), "DefinitionEntry": (formula,), "FrameEntry": (point,)}
    return schema_of(every_document(), short)


def schema_of(document: type[Table], short: Mapping[str, Sequence[dict[str, Any]]]) -> dict[str, Any]:
    """Return the JSON Schema of files, with units of keys in ``x-unit`` and the scope of formulas in ``x-names``.

    The schema has only keywords with equal meaning in draft 4 and later drafts, since editors of TOML know draft 4.

    Parameters
    ----------
    document : type of Table
        All of a file.
    short : mapping
        Schemas of other values in place of a table, by name of the table's class, which the document must contain.
    """
    description = document.model_json_schema()
    definitions = description["$defs"]
    for name, model in tables_of(document).items():
        part = definitions.get(name, description)  # the document is not a definition
        part["title"] = name.removesuffix("Entry")
        for key_name, (meaning, _) in fields_of(model).items():
            _annotate(part["properties"][key_name], meaning)
    for name, others in short.items():
        definitions[name] = {"anyOf": [*others, definitions[name]]}
    return {"$schema": "http://json-schema.org/draft-04/schema#", **_to_draft_4(description)}


def _to_draft_4(node: Any) -> Any:
    """Return a JSON Schema, or a part of one, with keywords of draft 4 only: later keywords are replaced by
    equivalents."""
    if isinstance(node, list):
        return [_to_draft_4(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    node = {key_name: _to_draft_4(entry) for key_name, entry in node.items()}
    if "prefixItems" in node:
        node["items"] = node.pop("prefixItems")[0]  # lists of a length are lists of one kind here
    if "patternProperties" in node:  # other names are not legal
        node["additionalProperties"] = False
    if "const" in node:
        node["enum"] = [node.pop("const")]
    return node


def _annotate(entry: dict[str, Any], meaning: KeyMetadata) -> None:
    """Add the unit, the scope of formulas, and text with a unit as an alternative to ``entry``, the JSON Schema of a
    key, in place."""
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
