"""Entries of files with ``kind = "hamiltonian"``: names, parameters and formulas, each fault by its key; their JSON
Schema for editors, draft 4 on."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, TypeVar

from eomgen.base.data import replace
from eomgen.base.messages import NAME_RULE, is_legal, shown, unused_note
from eomgen.errors import DescriptionError, Problem
from eomgen.formula.evaluate import evaluate, symbols
from eomgen.formula.nodes import Formula, Number
from eomgen.formula.words import RESERVED
from eomgen.products.fields.documents.document import NamedNumber
from eomgen.products.fields.documents.schema import KIND, FieldFile, File, HamiltonianFile
from eomgen.scene.document.reference import schema_of
from eomgen.scene.document.validation import read_table
from eomgen.scene.formula.definitions import IN_PLACE, NamedExpression, named_expressions
from eomgen.scene.formula.namespaces import in_order_of_mention, mentions_any, read_included
from eomgen.scene.formula.scope import SceneNames, Scope
from eomgen.scene.formula.tokens import FormulaError
from eomgen.scene.reading.report import Report
from eomgen.scene.sources.source import read_text, shown_file
from eomgen.scene.sources.toml import toml_data


def toml_file(path: str | os.PathLike[str]) -> tuple[dict[str, Any], dict[str, int], str]:
    """Return the data of a TOML file, the line of each key, and the file's name for messages. Raises FileError or
    DescriptionError for a file that cannot be read, or is not TOML."""
    path = Path(path).expanduser()
    file = shown_file(path)
    return *toml_data(read_text(path), file), file


OF_PARAMETERS = Scope("parameters", frozenset({"parameter"}))
Kind = TypeVar("Kind", bound=File)
_FORMULA = {"type": ["string", "number"], "description": "a formula or a number"}


class FieldEntries(Generic[Kind]):
    """The entries of a file of a Hamiltonian system, checked against a schema; faults go to ``report``.

    Attributes
    ----------
    data : the content of the file, unchecked
    file : the content as an object of the schema, without the entries that the schema refuses
    left_out : names of entries that the schema refuses, which exist
    refused : definitions with a fault, and definitions that mention one; formulas that mention these are not reported
    defined : expressions of the definitions, by name
    """

    #: Words of formulas, which are not valid names.
    words = RESERVED

    def __init__(self, data: Mapping[str, Any], report: Report, schema: type[Kind], sections: Sequence[str]) -> None:
        self.data = data
        self.report = report
        instead = {"format": 1, "kind": KIND, "name": "system"}
        self.file, self._refused = read_table(schema, sections, data, report, instead)
        self.left_out: set[str] = set().union(*self._refused.values())
        self.refused: set[str] = set()
        self.defined: dict[str, NamedExpression] = {}
        if not is_legal(self.file.name):
            report.add("name", f"the name {shown(self.file.name)} is not legal [E0715]", NAME_RULE)

    def content_without(self, *sections: str) -> bytes:
        """Return the data of the file without some keys, as the same bytes for the same data."""
        kept = {key: item for key, item in self.data.items() if key not in sections}
        return json.dumps(kept, sort_keys=True, default=str).encode()

    def names_in(self, section: str) -> list[str]:
        """Return the names of all entries of a section, refused entries last."""
        return [*getattr(self.file, section), *sorted(self._refused[section])]

    def keys_in(self, *sections: str) -> list[tuple[str, str]]:
        """Return key and name of all entries of sections."""
        return [(f"{section}.{name}", name) for section in sections for name in self.names_in(section)]

    def check_names(self, entries: Iterable[tuple[str, str]], taken: Mapping[str, tuple[str, str]]) -> dict[str, str]:
        """Return the section in which each name stands first; report names that are not legal, are words of formulas,
        stand in ``taken`` (with fault and hint), or belong to two entries. ``entries`` has pairs of key
        (SECTION.NAME) and name."""
        seen: dict[str, str] = {}
        for key, name in entries:
            if not is_legal(name):
                self.report.add(key, f"the name {shown(name)} is not legal [E0715]", NAME_RULE)
            elif name in taken:
                self.report.add(key, *taken[name])
            elif name in self.words:  # formulas would read the word, and never this entry
                self.report.add(key, f"the name {name} is a word of formulas [E0729]", f"{name}_value")
            elif name in seen:
                hint = 'momentum = "..." in a coordinate names its own' if key.startswith("coord") else "another name"
                self.report.add(key, f"the name {name} is given twice, in [{seen[name]}] too [E0730]", hint)
            seen.setdefault(name, key.partition(".")[0])
        return seen

    def parameters(self) -> list[NamedNumber]:
        made: list[NamedNumber] = []
        for name, entry in self.file.parameters.items():
            key = f"parameters.{name}"
            is_table = isinstance(self.data["parameters"][name], Mapping)
            value, formula = self.number(f"{key}.value" if is_table else key, entry.value, made)
            made.append(NamedNumber(name, value, entry.unit, entry.description, formula))
        return made

    def number(self, key: str, value: float | str, known: Iterable[NamedNumber]) -> tuple[float, Formula | None]:
        """Return a number, or the value of a formula of the parameters ``known``; a faulty formula is reported at
        ``key``.

        Returns
        -------
        value : float
            NaN for a faulty formula.
        formula : Formula or None
            None for a number, and for a formula that is faulty or without parameters.
        """
        if not isinstance(value, str):
            return value, None
        values = {item.name: item.value for item in known}
        formula = self.formula(key, value, SceneNames(parameters=dict.fromkeys(values, True)), OF_PARAMETERS)
        if formula is None or not values.keys() >= {symbol.name for symbol in symbols(formula)}:
            return math.nan, None
        try:
            number = evaluate(formula, lambda symbol: values[symbol.name])
        except ArithmeticError as error:
            self.report.add(key, str(error), "another formula")
            return math.nan, None
        return number, formula if any(True for _ in symbols(formula)) else None

    def formula(
        self, key: str, text: float | str, names: SceneNames, scope: Scope, inner: SceneNames | None = None
    ) -> Formula | None:
        """Return the formula of a text or a number; None for a faulty one, which is reported at ``key`` unless it
        mentions a faulty definition. ``names`` are the allowed names, ``scope`` is their description in messages,
        ``inner`` the names for mentioned definitions."""
        if not isinstance(text, str):
            return Number(text)
        left_out = dict.fromkeys(self.left_out, True)
        names = replace(names, parameters={**names.parameters, **left_out})
        inner = inner and replace(inner, parameters={**inner.parameters, **left_out})
        try:
            return read_included(text, names, scope, inner)
        except FormulaError as error:
            if not mentions_any(text, self.refused):
                self.report.add(key, error.what, self.hint(error))
            return None

    def definitions(self, names: SceneNames, scope: Scope) -> None:
        """Read the definitions for faults, each with all names of the file, and store them in ``defined``; names of
        faulty definitions are added to ``refused``."""
        self.defined = named_expressions(self.file.definitions)
        names = replace(names, definitions=self.defined)
        for name in in_order_of_mention(self.defined):
            if self.formula(f"definitions.{name}", self.defined[name].text, names, scope) is None:
                self.refused.add(name)

    def note_on_unused(self) -> tuple[str, ...]:
        """Return a note on the definitions that no formula mentions; none if formulas mention all."""
        note = unused_note("definition", "definitions", [name for name, item in self.defined.items() if not item.used])
        return (note,) if note else ()

    def hint(self, error: FormulaError) -> str:
        """Return the hint of an error in a formula, changed for errors whose usual remedy (inputs, units, definitions)
        does not exist in such files."""
        if error.name in self.names_in("definitions"):
            return f"the formula of {error.name}: numbers are of parameters alone"
        if error.hint == IN_PLACE:  # such files have no inputs
            return "shorter definitions, or terms that repeat"
        if error.code in ("E0319", "E1581"):  # a number with a unit
            return 'the number alone; unit = "m" with it is a label'
        return error.hint


_SCOPE = Scope("fields, data, parameters, definitions and names of where", frozenset({"state"}))


def cell_formula(
    where: str,
    text: str,
    names: Iterable[str],
    definitions: Mapping[str, NamedExpression] | None = None,
    of_where: Iterable[str] = (),
) -> Formula:
    """Return the formula ``text`` of a cell, whose symbols are states with one of the names; the first argument is its
    key in messages.

    Parameters
    ----------
    names : fields, data and parameters, for the formula and definitions
    definitions : named expressions of ``names``
    of_where : further names, which definitions do not have

    Raises
    ------
    DescriptionError
    """
    inner = SceneNames(states=tuple(names), definitions=definitions or {})
    try:
        return read_included(text, replace(inner, states=(*inner.states, *of_where)), _SCOPE, inner)
    except FormulaError as error:
        raise DescriptionError(Problem(where, error.what, error.hint)) from None


def json_schema(*, mesh: bool = False) -> str:
    """Return the JSON Schema, as text, for files of coordinates, or with ``mesh`` for files of fields on a mesh."""
    short = ("ParameterTable", "DataTable" if mesh else "OutputTable")
    return (
        json.dumps(schema_of(FieldFile if mesh else HamiltonianFile, dict.fromkeys(short, (_FORMULA,))), indent=2)
        + "\n"
    )
