"""Descriptions of keys in JSON Schemas, for tests of their words."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

#: A description without a head noun, also behind the words for which it holds: "`torus`: of the tube".
HEADLESS = re.compile(
    r"(?:[^:;]*: )?(?:of|in|on|at|along|about|to|from|for|with|by|within|between|through|"
    r"across|beyond|per|after|before|over|under|which|whose|whom|that|what|where|when|how|who|whether|if)\b"
)


def nodes(node: Any) -> Iterator[dict[str, Any]]:
    if isinstance(node, dict):
        yield node
    for entry in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from nodes(entry)


def headless_descriptions(schema: str) -> list[tuple[str, str]]:
    """Return keys of a schema with their descriptions, if these have no head noun."""
    keys = [entry for node in nodes(json.loads(schema)) for entry in node.get("properties", {}).items()]
    described = [(name, entry["description"]) for name, entry in keys if "description" in entry]
    assert len(described) > 30
    return [key for key in described if HEADLESS.match(key[1])]
