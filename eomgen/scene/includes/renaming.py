"""Renaming of the data of an included file into the names of the including file, key by key."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from eomgen.base.text import key_of, nearest, shown
from eomgen.formula.units.labels import number_in_label
from eomgen.formula.units.parser import UnitError, is_quantity
from eomgen.scene.document.schema import Include, document_for, section_keys
from eomgen.scene.formula.namespaces import Included, Namespace
from eomgen.scene.formula.scope import REACTING
from eomgen.scene.reading.key_metadata import Inner, Meaning, Table, fields_of
from eomgen.scene.reading.kinds import Refused
from eomgen.scene.reading.report import Report
from eomgen.system.description import BASE, WORLD


class Renamer:
    """Renames the entries that an included file names.

    Parameters
    ----------
    space : Namespace
    base : str
        Name in the including file for the file's base.
    file : Path
        The included file, from the folder of the including one.
    """

    def __init__(self, space: Namespace, base: str, file: Path) -> None:
        self.space = space
        self.base = base
        self.file = file

    def document(self, data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """Return the sections of a file, each entry under its new name."""
        result = {}
        schema = document_for(data)
        sections = section_keys(schema)
        for section, (_, inner) in fields_of(schema).items():
            if section in sections and inner is not None and isinstance(data.get(section), Mapping):
                names = self.space.names[section]
                entries = data[section].items()
                result[section] = {
                    names[name]: self.entry(inner.model, entry) for name, entry in entries if name in names
                }
        return result

    def entry(self, model: type[Table], entry: Any) -> Any:
        if isinstance(entry, str) and "point" in model.model_fields:
            entry = {"point": entry}  # the short form of a frame
        if not isinstance(entry, Mapping):
            return entry
        known = fields_of(model)
        return {key: self.value(*known[key], value) if key in known else value for key, value in entry.items()}

    def value(self, meaning: Meaning, inner: Inner | None, value: Any) -> Any:
        if inner is not None:
            if inner.shape == "list" and isinstance(value, list | tuple):
                return [self.entry(inner.model, entry) for entry in value]
            if inner.shape == "entries" and isinstance(value, Mapping):
                return {name: self.entry(inner.model, entry) for name, entry in value.items()}
            return self.entry(inner.model, value)
        if meaning.refers:
            return self.reference(meaning.refers, value)
        if meaning.sets and isinstance(value, Mapping):
            return {self.number(name): self.texts(entry) for name, entry in value.items()}
        if meaning.path and isinstance(value, str):
            return str(self.file.parent / value)
        return self.texts(value) if meaning.unit or meaning.names is not None else value

    def reference(self, section: str, name: Any) -> Any:
        """Return the new name of an entry that a key refers to; for an unknown entry, words that are no name.

        A key may name several in a list, or hold something for each of them in a table.
        """
        if isinstance(name, list | tuple):
            return [self.reference(section, entry) for entry in name]
        if isinstance(name, Mapping):
            known = self.space.names[section]
            return {known.get(entry, entry): self.texts(value) for entry, value in name.items()}
        if section == "bodies" and name in (BASE, WORLD):
            return self.base if name == BASE else WORLD
        if not isinstance(name, str) or not name:
            return name
        if section == "reactions":
            section = self.space.section_with(name, REACTING)
        return self.space.names[section].get(name, f"{name} in {self.file.name}")

    def number(self, name: str) -> str:
        """Return the new name of a component of the state: ``q.joint``, ``v.beam[2]``, or an internal state."""
        names = self.space.names
        match = re.fullmatch(r"\s*([qv])\s*\.\s*(\w+)(.*)", name, re.DOTALL)
        if match is None:
            return names["states"].get(name.strip(), name)
        letter, joint, index = match.groups()
        return f"{letter}.{names['joints'].get(joint, names['beams'].get(joint, joint))}{index}"

    def texts(self, value: Any) -> Any:
        """Return a value whose formulas carry their namespace."""
        if isinstance(value, Refused):
            return value
        if isinstance(value, str):
            return Included(value, self.space)
        if isinstance(value, list | tuple):
            return [self.texts(entry) for entry in value]
        return {name: self.texts(entry) for name, entry in value.items()} if isinstance(value, Mapping) else value


def overridden(key: str, entry: Include, data: dict[str, Any], known: frozenset[str], report: Report) -> dict[str, str]:
    """Put the values of an include in place of the parameters of a file, and return the formulas among them.

    Parameters
    ----------
    key : str
        Of the include.
    data : dict
        Of the included file; its parameters are changed, and parameters given by formulas left out.
    known : frozenset of str
        Names of the including file, which no unit may have.
    """
    section = data.get("parameters", {})
    parameters = dict(section) if isinstance(section, Mapping) else {}
    formulas: dict[str, str] = {}
    for name, value in entry.parameters.items():
        place = f"{key}.parameters.{key_of(name)}"
        if name not in parameters:
            fault = f"{shown(entry.file)} has no parameter {shown(name)}"
            report.add(place, fault, nearest(name, parameters) or "without parameters")
            continue
        if isinstance(value, str) and not is_quantity(value):
            formulas[name] = value
            del parameters[name]
            continue
        own = parameters[name] if isinstance(parameters[name], Mapping) else {}
        label = own.get("unit", "")
        try:
            if isinstance(value, str):
                number, unit = number_in_label(value, label if isinstance(label, str) else "", known)
                parameters[name] = {**own, "value": number, "unit": unit}
            else:
                parameters[name] = {**own, "value": value}
        except UnitError as error:
            report.add(place, error.what, error.hint)
    data["parameters"] = parameters
    return formulas
