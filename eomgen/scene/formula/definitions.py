"""Named expressions of a scene: read in the scope of the formula that mentions them, each once.

A formula that mentions a definition has its expression in place of its name. The expression bears the name, by which
the recorded equations and the C call its value; equal expressions are recorded once, so the value is computed once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from eomgen.formula.nodes import Application, Formula, Operation, Symbol
from eomgen.scene.formula.scope import Names, Scope
from eomgen.scene.formula.tokens import FormulaError

#: Operations and levels of a formula with its definitions written out, at most: Python walks each of them.
MOST_OPERATIONS, MOST_LEVELS = 20_000, 150


class CircularDefinition(FormulaError):
    """A definition that mentions itself, through others maybe."""


@dataclass(eq=False)
class NamedExpression:
    """A named expression as text, and its formulas in the scopes in which it has been read.

    Attributes
    ----------
    name : in the scene
    text : in the names of its file
    unit, description : as the file says
    """

    name: str
    text: str
    unit: str = ""
    description: str = ""
    _formulas: dict[Scope, tuple[Formula, int, int]] = field(default_factory=dict, repr=False)
    _open: bool = field(default=False, repr=False)

    def read(self, scope: Scope, read: Callable[[str], Formula]) -> tuple[Formula, int, int]:
        """Return the formula in a scope, with its name, and its numbers of operations and of levels.

        Parameters
        ----------
        read : reads a text in the names of the scene; mentioned definitions are read by further calls of this method

        Raises
        ------
        FormulaError
            In the words of the definition's text, or since the definition mentions itself.
        """
        if scope in self._formulas:
            return self._formulas[scope]
        with self._reading():
            formula = read(self.text)
        if isinstance(formula, Operation):
            formula = replace(formula, label=self.name)
        self._formulas[scope] = (formula, *extent(formula, {}))
        return self._formulas[scope]

    @contextmanager
    def _reading(self) -> Iterator[None]:
        if self._open:
            raise CircularDefinition(f"the definition {self.name} mentions itself", 1, "an expression of other names")
        self._open = True
        try:
            yield
        finally:
            self._open = False


def expanded(symbol: Symbol, names: Names, scope: Scope, read: Callable[[str], Formula]) -> tuple[Formula, int, int]:
    """Return the expression of a symbol of a definition, and its numbers of operations and of levels.

    Raises
    ------
    FormulaError
        Naming the definition.
    """
    definition: NamedExpression = names.definitions[symbol.name]
    try:
        return definition.read(scope, read)
    except CircularDefinition:
        raise
    except FormulaError as error:
        raise FormulaError(f"in the definition {symbol.name}, {error.fault}", error.column, error.hint) from None


def mentioned(formula: Formula) -> set[Symbol]:
    """Return the symbols of definitions in a formula as its text says it."""
    if isinstance(formula, Symbol):
        return {formula} if formula.kind == "definition" else set()
    if isinstance(formula, Application):
        return mentioned(formula.argument)
    if isinstance(formula, Operation):
        return set[Symbol]().union(*(mentioned(part) for part in formula.arguments))
    return set()


def check_extent(formula: Formula, parts: Mapping[Symbol, tuple[Formula, int, int]]) -> None:
    """Check the size of a formula with its definitions written out, before they are. Raises FormulaError."""
    operations, levels = extent(formula, parts)
    if operations > MOST_OPERATIONS or levels > MOST_LEVELS:
        fault = (
            f"the formula has {operations} operations in {levels} levels with its definitions written out, of at most"
            f" {MOST_OPERATIONS} and {MOST_LEVELS}"
        )
        raise FormulaError(fault, 1, "an internal state, an input or an output in place of a definition")


def extent(formula: Formula, parts: Mapping[Symbol, tuple[Formula, int, int]]) -> tuple[int, int]:
    """Return the numbers of operations and of levels of a formula whose symbols may stand for known parts."""
    if isinstance(formula, Symbol) and formula in parts:
        return parts[formula][1:]
    inner = formula.arguments if isinstance(formula, Operation) else ()
    inner = (formula.argument,) if isinstance(formula, Application) else inner
    counted = [extent(part, parts) for part in inner]
    return bool(inner) + sum(count for count, _ in counted), 1 + max((levels for _, levels in counted), default=0)
