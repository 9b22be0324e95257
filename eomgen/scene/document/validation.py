"""Validation of nested data entry by entry: invalid entries are reported and skipped."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from eomgen.base.text import key_of
from eomgen.scene.document.faults import child_hint, explained
from eomgen.scene.document.schema import Document, document_for, section_keys, without_absent_sections
from eomgen.scene.reading.kinds import Refused
from eomgen.scene.reading.report import Report


def read_document(data: Mapping[str, Any], report: Report) -> tuple[Document, dict[str, set[str]]]:
    """Turn nested data into a Document; invalid entries are reported and left out.

    Returns
    -------
    document : Document
        Of the entries that are well formed.
    refused : dict
        For each section, the names of the entries left out: they exist, and are not to be reported as unknown.
    """
    schema = document_for(data)
    sections = section_keys(schema)
    refused: dict[str, set[str]] = {section: set() for section in sections}
    kept = dict(data)
    try:
        return without_absent_sections(schema, kept).model_validate(kept), refused
    except ValidationError as error:
        broken = False
        for detail in error.errors(include_url=False):
            parts = (part for part in detail["loc"] if isinstance(part, str | int))
            location = tuple(part for part in parts if not str(part).startswith("#"))  # tags are no keys
            fault, hint = explained(detail["type"], detail["msg"], location, detail.get("input"), schema)
            if detail["type"] == "missing" and location[0] == "joints" and location[-1] == "child":
                hint = child_hint(data)
            if not isinstance(detail.get("input"), Refused):
                report.add(key_of(*location), fault, hint)
            section = str(location[0])
            if section in sections and len(location) > 1 and isinstance(kept.get(section), Mapping):
                refused[section].add(str(location[1]))
                kept[section] = {name: entry for name, entry in kept[section].items() if name != location[1]}
            elif section in kept:
                broken = broken or section in sections
                del kept[section]
    if broken:  # every reference into a section that is not there would be a problem of its own
        report.raise_problems()
    return without_absent_sections(schema, kept).model_validate({"format": 1, "name": "scene", **kept}), refused
