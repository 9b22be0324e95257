"""Entries of files with ``kind = "hamiltonian"``: tables, texts, parameters and formulas, each fault by its key."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from eomgen.base.text import NAME_RULE, is_legal, listed, nearest, shown
from eomgen.errors import DescriptionError, Problem
from eomgen.formula.evaluate import evaluate, symbols
from eomgen.formula.nodes import Formula, Number
from eomgen.products.fields.documents.document import Parameter
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import Names, Scope
from eomgen.scene.formula.tokens import FormulaError
from eomgen.scene.reading.kinds import described
from eomgen.scene.reading.report import Report

#: Value of the key ``kind`` in files of Hamiltonian systems.
KIND = "hamiltonian"
OF_PARAMETERS = Scope("parameters", frozenset({"parameter"}))


class Entries:
    """The entries of a file, and the report of their faults."""

    def __init__(self, data: Mapping[str, Any], report: Report) -> None:
        self.data = data
        self.report = report

    def head(self, known: Iterable[str]) -> str:
        """Check the keys of a file, its format and its kind; return its name."""
        data, report = self.data, self.report
        check_keys("", data, known, report)
        if data.get("format") != 1:
            report.add("format", f"the format is {_said(data, 'format')}", "format = 1")
        if data.get("kind") != KIND:
            report.add("kind", f"the kind is {_said(data, 'kind')}", f'kind = "{KIND}"')
        name = data.get("name")
        if not isinstance(name, str) or not is_legal(name):
            report.add("name", f"the name {described(name)} is not legal", NAME_RULE)
        return str(name)

    def section(self, key: str) -> Mapping[str, Any]:
        """Return a section, empty if it is missing or no table."""
        result = self.data.get(key, {})
        if not isinstance(result, Mapping):
            self.report.add(key, f"a table is needed here, not {described(result)}", f"[{key}]")
            return {}
        return result

    def text(self, key: str, table: Mapping[str, Any], name: str) -> str:
        result = table.get(name, "")
        if not isinstance(result, str):
            where = f"{key}.{name}" if key else name
            self.report.add(where, f"a text is needed here, not {described(result)}", f'{name} = "..."')
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
        """Return a finite number, or the value of a formula of parameters; NaN if it is neither.

        Returns
        -------
        value : float
        formula : Formula or None
            None for a number, and for a formula without parameters.
        """
        if isinstance(value, str):
            values = {item.name: item.value for item in known}
            formula = self.formula(key, value, Names(parameters=dict.fromkeys(values, True)), OF_PARAMETERS)
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
            self.report.add(key, "the value is missing" if value is None else f"this is {described(value)}", hint)
            return math.nan, None
        return float(value), None

    def formula(self, key: str, text: object, names: Names, scope: Scope) -> Formula | None:
        """Return a formula; None for a value that is none, which is reported."""
        if isinstance(text, int | float) and not isinstance(text, bool):
            return Number(float(text))
        if not isinstance(text, str):
            self.report.add(key, f"a formula is needed here, not {described(text)}", 'a text: "p_x**2/2"')
            return None
        try:
            return read_formula(text, names, scope)
        except FormulaError as error:
            self.report.add(key, error.what, self.hint(error))
            return None

    def hint(self, error: FormulaError) -> str:
        """Return a hint for a formula with a fault."""
        if "units are not read" in error.what:
            return 'the number alone; unit = "m" beside it is a label'
        return error.hint


def _said(data: Mapping[str, Any], key: str) -> str:
    return described(data[key]) if key in data else "missing"


def check_keys(key: str, table: Mapping[str, Any], known: Iterable[str], report: Report) -> None:
    """Report keys of a table that are not known."""
    every = list(known)
    for name in table:
        if name not in every:
            hint = nearest(str(name), every) or f"one of {listed(every)}"
            report.add(f"{key}.{name}" if key else str(name), f"the key {shown(str(name))} is unknown here", hint)


_SCOPE = Scope("fields, data, parameters and names of where", frozenset({"state"}))


def cell_formula(where: str, text: str, names: Iterable[str]) -> Formula:
    """Read a formula of a cell, whose symbols are states with one of the names.

    Raises
    ------
    DescriptionError
    """
    try:
        return read_formula(text, Names(states=tuple(names)), _SCOPE)
    except FormulaError as error:
        raise DescriptionError(Problem(where, error.what, error.hint)) from None
