"""The JSON Schema of scene files, for editors: pydantic's schema with units and scopes, in draft 4."""

from __future__ import annotations

import json
from typing import Any

from eomgen.scene.document.schema import every_document
from eomgen.scene.reading.key_metadata import Meaning, every_unit, fields_of, tables_of
from eomgen.scene.reading.kinds import NUMBER_SCHEMA, QUANTITY_SCHEMA


def schema() -> dict[str, Any]:
    """Return the JSON Schema of scene files; ``x-unit`` and ``x-names`` say the unit of a key and the scope of its
    formulas.

    It holds keywords that draft 4 and later drafts read alike, since editors of TOML know draft 4.
    """
    document = every_document()
    description = document.model_json_schema()
    definitions = description["$defs"]
    for name, model in tables_of(document).items():
        properties = definitions.get(name, description)["properties"]  # the document itself is no definition
        for key_name, (meaning, _) in fields_of(model).items():
            _annotate(properties[key_name], meaning)
    definitions["Parameter"] = {"anyOf": [NUMBER_SCHEMA, QUANTITY_SCHEMA, definitions["Parameter"]]}
    point = {"type": "string", "description": "the name of a point"}
    definitions["Frame"] = {"anyOf": [point, definitions["Frame"]]}
    return {"$schema": "http://json-schema.org/draft-04/schema#", **_of_every_draft(description)}


def _of_every_draft(node: Any) -> Any:
    """Return a JSON Schema without the keywords that came after draft 4, which others can say."""
    if isinstance(node, list):
        return [_of_every_draft(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    node = {key_name: _of_every_draft(entry) for key_name, entry in node.items()}
    if "prefixItems" in node:
        node["items"] = node.pop("prefixItems")[0]  # lists of a length are lists of one kind here
    if "const" in node:
        node["enum"] = [node.pop("const")]
    return node


def _annotate(entry: dict[str, Any], meaning: Meaning) -> None:
    """Add the unit, names and references of a key to its JSON Schema."""
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
