"""Formulas of the energy of a cell of a field."""

from __future__ import annotations

from collections.abc import Iterable

from eomgen.errors import DescriptionError, Problem
from eomgen.formula.nodes import Formula
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import Names, Scope
from eomgen.scene.formula.tokens import FormulaError

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
