"""Entries of files with ``kind = "hamiltonian"``: tables, texts, parameters and formulas, each fault by its key;
their JSON Schema for editors, draft 4 on."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from typing import Any

from eomgen.base.data import replace
from eomgen.base.messages import NAME_RULE, is_legal, listed, nearest, shown, unmentioned
from eomgen.errors import DescriptionError, Problem
from eomgen.formula.evaluate import evaluate, symbols
from eomgen.formula.nodes import Formula, Number
from eomgen.products.fields.documents.document import DATA_KINDS, OPERATOR_KINDS, Chains, Parameter, Run
from eomgen.scene.formula.definitions import IN_PLACE, NamedExpression, named_expressions
from eomgen.scene.formula.namespaces import in_order_of_mention, mentions_any, read_included
from eomgen.scene.formula.scope import SceneNames, Scope
from eomgen.scene.formula.tokens import FormulaError
from eomgen.scene.reading.kinds import described
from eomgen.scene.reading.report import Report

#: Value of the key ``kind`` in files of Hamiltonian systems.
KIND = "hamiltonian"
OF_PARAMETERS = Scope("parameters", frozenset({"parameter"}))


class FieldEntries:
    """The entries of a file, and the report of faults."""

    def __init__(self, data: Mapping[str, Any], report: Report) -> None:
        self.data = data
        self.report = report
        #: Definitions with a fault that is reported, and definitions that mention such a definition.
        self.refused: set[str] = set()
        self.defined: dict[str, NamedExpression] = {}

    def head(self, known: Iterable[str]) -> str:
        """Check keys, format and kind of a file; return the name."""
        data, report = self.data, self.report
        check_keys("", data, known, report)
        if data.get("format") != 1:
            report.add("format", f"the format is {_said(data, 'format')} [E0709]", "format = 1")
        if data.get("kind") != KIND:
            report.add("kind", f"the kind is {_said(data, 'kind')} [E0712]", f'kind = "{KIND}"')
        name = data.get("name")
        if not isinstance(name, str) or not is_legal(name):
            report.add("name", f"the name {described(name)} is not legal [E0715]", NAME_RULE)
        return str(name)

    def section(self, key: str) -> Mapping[str, Any]:
        """Return a section, empty if missing or no table."""
        result = self.data.get(key, {})
        if not isinstance(result, Mapping):
            self.report.add(key, f"a table is needed here, not {described(result)} [E0716]", f"[{key}]")
            return {}
        return result

    def text(self, key: str, table: Mapping[str, Any], name: str) -> str:
        result = table.get(name, "")
        if not isinstance(result, str):
            where = f"{key}.{name}" if key else name
            self.report.add(where, f"a text is needed here, not {described(result)} [E0717]", f'{name} = "..."')
            return ""
        return result

    def parameters(self) -> list[Parameter]:
        made: list[Parameter] = []
        for name, entry in self.section("parameters").items():
            key = f"parameters.{name}"
            table = entry if isinstance(entry, Mapping) else {"value": entry}
            check_keys(key, table, ("value", "unit", "description"), self.report)
            value, formula = self.number(f"{key}.value" if table is entry else key, table.get("value"), made)
            labels = self.text(key, table, "unit"), self.text(key, table, "description")
            made.append(Parameter(name, value, *labels, formula))
        return made

    def number(self, key: str, value: object, known: Iterable[Parameter]) -> tuple[float, Formula | None]:
        """Return a finite number, or the value of a formula of parameters; NaN if neither.

        Returns
        -------
        value : float
        formula : Formula or None
            None for a number, and for a formula without parameters.
        """
        if isinstance(value, str):
            values = {item.name: item.value for item in known}
            formula = self.formula(key, value, SceneNames(parameters=dict.fromkeys(values, True)), OF_PARAMETERS)
            if formula is None:
                return math.nan, None
            try:
                number = evaluate(formula, lambda symbol: values[symbol.name])
            except ArithmeticError as error:
                self.report.add(key, str(error), "another formula")
                return math.nan, None
            return number, formula if any(True for _ in symbols(formula)) else None
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            hint = "a finite number, or a formula of parameters"
            self.report.add(
                key, "the value is missing [E0718]" if value is None else f"this is {described(value)} [E0719]", hint
            )
            return math.nan, None
        return float(value), None

    def formula(
        self, key: str, text: object, names: SceneNames, scope: Scope, inner: SceneNames | None = None
    ) -> Formula | None:
        """Return a formula; None for a value that is none, which is reported. ``inner``: names for definitions."""
        if isinstance(text, int | float) and not isinstance(text, bool):
            return Number(float(text))
        if not isinstance(text, str):
            self.report.add(key, f"a formula is needed here, not {described(text)} [E0721]", 'a text: "p_x**2/2"')
            return None
        try:
            return read_included(text, names, scope, inner)
        except FormulaError as error:
            if not mentions_any(text, self.refused):
                self.report.add(key, error.what, self.hint(error))
            return None

    def definitions(self, names: SceneNames, scope: Scope, example: str) -> None:
        """Read the definitions alone, each with all names of the file; formulas read them in their own names."""
        texts: dict[str, str | float] = {}
        for name, text in self.section("definitions").items():
            if isinstance(text, str | int | float) and not isinstance(text, bool):
                texts[name] = text
            else:
                fault = f"a formula is needed here, not {described(text)} [E0721]"
                self.report.add(f"definitions.{name}", fault, f'{name} = "{example}"')
                self.refused.add(name)
        self.defined = named_expressions(texts)
        names = replace(names, definitions=self.defined)
        for name in in_order_of_mention(self.defined):
            if self.formula(f"definitions.{name}", self.defined[name].text, names, scope) is None:
                self.refused.add(name)

    def unused(self) -> tuple[str, ...]:
        """Return a note on the definitions that no formula mentions; none if formulas mention all."""
        note = unmentioned("definition", "definitions", [name for name, item in self.defined.items() if not item.used])
        return (note,) if note else ()

    def hint(self, error: FormulaError) -> str:
        """Return a hint for a formula with a fault."""
        own = [name for name in self.section("definitions") if error.fault.startswith(f"unknown name {shown(name)}")]
        if own:
            return f"the formula of {own[0]}: numbers are of parameters alone"
        if error.hint == IN_PLACE:  # such files have no inputs
            return "shorter definitions, or terms that repeat"
        if "units are not read" in error.what:
            return 'the number alone; unit = "m" with it is a label'
        return error.hint


def _said(data: Mapping[str, Any], key: str) -> str:
    return described(data[key]) if key in data else "missing"


def check_keys(key: str, table: Mapping[str, Any], known: Iterable[str], report: Report) -> None:
    """Report keys of a table that are not known."""
    every = list(known)
    for name in table:
        if name not in every:
            hint = nearest(str(name), every) or f"one of {listed(every)}"
            report.add(
                f"{key}.{name}" if key else str(name), f"the key {shown(str(name))} is unknown here [E0722]", hint
            )


_SCOPE = Scope("fields, data, parameters, definitions and names of where", frozenset({"state"}))


def cell_formula(
    where: str,
    text: str,
    names: Iterable[str],
    definitions: Mapping[str, NamedExpression] | None = None,
    of_where: Iterable[str] = (),
) -> Formula:
    """Read a formula of a cell, whose symbols are states with one of the names.

    Parameters
    ----------
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


Schema = dict[str, Any]
_LEGAL = "^[A-Za-z_][A-Za-z0-9_]{0,63}$"
_MASSES = ("fisher", "prior", "unit")
_FORMULA: Schema = {"type": ["string", "number"], "description": "a formula or a number"}
_TYPES = {"float": "number", "int": "integer", "str": "string", "bool": "boolean"}
_OF_RUNS = {
    "duration": "from t = 0 to the end",
    "step": "of equal steps",
    "method": "a composition, implicit_midpoint, gauss<order>, rk4 or rk45",
    "record_every": "steps between recorded rows",
    "tolerance": "of rk45",
    "compensated": "carry rounding errors of sums over to the next ones",
}
_OF_OPERATORS = {
    "white": "the white field itself: true",
    "power": "a formula of wave numbers, or a table: the power spectrum of the field",
    "lognormal_power": "the power spectrum of exp(field)",
    "filter": "a formula of wave numbers",
    "smoothing": "the radius of a Gaussian filter",
    "difference": "the axis of a derivative",
    "mask": "a formula of places",
}


def json_schema(*, mesh: bool = False) -> str:
    """Return the JSON Schema, as text, of files of coordinates or, with ``mesh``, of files of fields on a mesh."""
    return json.dumps(_of_fields() if mesh else _of_coordinates(), indent=2) + "\n"


def _table(properties: Schema, *required: str, description: str = "") -> Schema:
    result: Schema = {"type": "object", "additionalProperties": False, "properties": properties}
    return (
        result | ({"required": [*required]} if required else {}) | ({"description": description} if description else {})
    )


def _entries(entry: Schema, description: str, *, copies: bool = False) -> Schema:
    """Return the schema of a section of named entries; names of copies have braces."""
    named: Schema = {"additionalProperties": entry} if copies else {"patternProperties": {_LEGAL: entry}}
    return {
        "type": "object",
        "description": description,
        **({} if copies else {"additionalProperties": False}),
        **named,
    }


def _text(description: str) -> Schema:
    return {"type": "string", "description": description}


def _head(properties: Schema, *required: str) -> Schema:
    head: Schema = {
        "format": {"enum": [1], "description": "of the file"},
        "kind": {"enum": [KIND], "description": "kind of the file"},
        "name": {"type": "string", "pattern": _LEGAL, "description": "of the system, a legal C identifier"},
        "description": _text("in words"),
    }
    result = _table({**head, **properties}, "format", "kind", "name", *required)
    return {"$schema": "http://json-schema.org/draft-04/schema#", **result}


def _parameters() -> Schema:
    of_one = {"value": _FORMULA, "unit": _text("a label"), "description": _text("in words")}
    return {"anyOf": [_FORMULA, _table(of_one, "value")]}


def _sections(*, copies: bool) -> dict[str, Schema]:
    pair: Schema = {"type": "array", "items": _FORMULA, "minItems": 2, "maxItems": 2}
    coordinate = _table(
        {
            "initial": pair | {"description": "the coordinate and its momentum at the start"},
            "momentum": _text("name of the momentum; p_ and the coordinate by default"),
            "unit": _text("a label"),
            "momentum_unit": _text("a label"),
        },
        "initial",
    )
    output: Schema = {"anyOf": [_FORMULA, _table({"formula": _FORMULA, "unit": _text("a label")}, "formula")]}
    terms: Schema = {"type": "object", "additionalProperties": _FORMULA, "description": "terms whose sum is H"}
    return {
        "parameters": _entries(_parameters(), "numbers that runs may change", copies=copies),
        "coordinates": _entries(coordinate, "coordinates with their momenta", copies=copies),
        "definitions": _entries(_FORMULA, "names of formulas, each of other definitions in any order", copies=copies),
        "hamiltonian": terms if copies else {"anyOf": [_FORMULA, terms], "description": "H, or terms whose sum it is"},
        "outputs": _entries(output, "quantities of the state along a run", copies=copies),
    }


def _of_coordinates() -> Schema:
    sections = _sections(copies=False)
    ranges: Schema = {"type": "object", "description": "i = 3, from 0 on, or i = [1, 3]: the first and the last"}
    repeat = _table(
        {"indices": ranges, "where": _text("a condition of indices"), **_sections(copies=True)},
        "indices",
        description="copies of entries, with indices in braces",
    )
    simulation = _of_dataclass(Run, _OF_RUNS)
    for name in ("duration", "step", "tolerance"):
        simulation[name] |= {"minimum": 0}
    return _head(
        {
            **sections,
            "repeat": {"type": "object", "additionalProperties": repeat, "description": "copies"},
            "simulation": _table(simulation, description="defaults of runs"),
        }
    )


def _of_dataclass(made: type, said: dict[str, str]) -> dict[str, Schema]:
    """Return schemas of the keys of a table whose defaults are in a class."""
    result: dict[str, Schema] = {}
    for item in fields(made):
        result[item.name] = {"type": _TYPES[str(item.type)], "description": said.get(item.name, item.name)}
        if item.default is not MISSING and item.default != "":
            result[item.name]["default"] = item.default
    return result


def _of_fields() -> Schema:
    where: Schema = {"type": "object", "additionalProperties": _FORMULA, "description": "formulas with a name"}
    table = _table({"file": _text("k and P"), "columns": {"type": "array", "items": {"type": "string"}}}, "file")
    operators: Schema = {kind: {**_FORMULA, "description": _OF_OPERATORS[kind]} for kind in OPERATOR_KINDS}
    operators["white"] = {"enum": [True], "description": _OF_OPERATORS["white"]}
    operators["difference"] = {"enum": ["x", "y", "z"], "description": _OF_OPERATORS["difference"]}
    for kind in ("power", "lognormal_power"):
        operators[kind] = {"anyOf": [_FORMULA, table], "description": _OF_OPERATORS[kind]}
    operators |= {"of": _text("the operator before this one"), "where": where}
    data: Schema = dict.fromkeys(DATA_KINDS, _FORMULA)
    data |= {"file": _text("a .npy or .csv"), "column": _text("of the .csv")}
    data |= dict.fromkeys(("minimum", "beta", "deviation"), _FORMULA)
    whole: Schema = {"type": "integer", "minimum": 2}
    side: Schema = {"type": "number", "minimum": 0}
    several = {"type": "array", "minItems": 1, "maxItems": 3}
    mesh = {
        "cells": {"anyOf": [whole, {**several, "items": whole}], "description": "along each axis"},
        "length": {"anyOf": [side, {**several, "items": side}], "description": "of the box, or of each side"},
        "unit": _text("of length, a label"),
    }
    return _head(
        {
            "mesh": _table(mesh, "cells", "length", description="periodic"),
            "parameters": _entries(_parameters(), "numbers of formulas"),
            "definitions": _entries(_FORMULA, "names of formulas, each of other definitions in any order"),
            "operators": _entries(_table(operators), "from the white field to fields of the cells"),
            "prior": _table({"white": {"enum": [True], "description": "independent standard normal numbers"}}),
            "truth": _table({"seed": {"type": "integer", "minimum": 0, "description": "of the white field"}}, "seed"),
            "data": _entries({"anyOf": [_FORMULA, _table(data)]}, "numbers in the cells"),
            "cell": _table({"energy": _FORMULA, "where": where}, "energy", description="the energy of a cell"),
            "mass": _table({"choice": {"enum": [*_MASSES], "description": "of the momenta"}}),
            "sampling": _table(_of_dataclass(Chains, {}), description="defaults of sample"),
        },
        "mesh",
        "operators",
        "cell",
    )
