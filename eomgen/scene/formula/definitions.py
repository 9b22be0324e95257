"""Named expressions of a scene: read in the scope of the formula that mentions them, each once.

A formula that mentions a definition has its expression in place of its name. The expression bears the name, by which
the recorded equations and the C call its value; equal expressions are recorded once, so the value is computed once.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from eomgen.base.data import dataclass, field, replace
from eomgen.formula.nodes import Application, Formula, Operation, Symbol, distinct_nodes
from eomgen.scene.formula.scope import SceneNames, Scope
from eomgen.scene.formula.tokens import DEPTH, FormulaError

_NUMBER = re.compile(r"\s*-?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,2})?\s*", re.ASCII)
#: Remedy for definitions that are too large.
IN_PLACE = "an internal state, an input or an output in place of a definition"


class DefinitionError(FormulaError):
    """A definition that mentions itself, directly or through other definitions, or mentions too many definitions; the
    message names the definitions."""


@dataclass(frozen=True)
class WrittenDefinition:
    """A definition's formula in a scope, and the size of the formula: operations, levels, and nested definitions."""

    formula: Formula
    operations: int
    levels: int


@dataclass(eq=False)
class NamedExpression:
    """A named expression as text, and the formulas of the text in the scopes read so far.

    Attributes
    ----------
    name : in the scene
    text : with the names of the file of the definition
    open : the definitions of the scene that are being read, from the outermost to the innermost
    used : whether a formula mentions the expression
    """

    name: str
    text: str
    open: list[NamedExpression] = field(default_factory=list, repr=False)
    used: bool = False
    _written: dict[Scope, WrittenDefinition] = field(default_factory=dict, repr=False)

    @property
    def number(self) -> float | None:
        """The number that the text is; None for formulas."""
        return float(self.text) if _NUMBER.fullmatch(self.text) else None

    def read(self, scope: Scope, read: Callable[[str], Formula]) -> WrittenDefinition:
        """Return the formula of the expression in a scope, labelled with the name, and the size; each scope is read
        once.

        Parameters
        ----------
        read : reads a text in the names of the scene; mentioned definitions are read by further calls of this method

        Raises
        ------
        FormulaError
            With the text of the definition; for a definition that mentions itself, or that mentions too many
            definitions.
        """
        self.used = True
        if scope not in self._written:
            if self in self.open:
                fault = f"the definition {self.name} mentions itself [E1517]"
                raise DefinitionError(fault, 1, "an expression of other names")
            if len(self.open) >= DEPTH:
                raise DefinitionError(f"more than {DEPTH} definitions are within one another [E1518]", 1, IN_PLACE)
            self.open.append(self)
            try:
                formula = read(self.text)
            finally:
                self.open.pop()
            if isinstance(formula, Operation):
                formula = replace(formula, label=self.name)
            self._written[scope] = WrittenDefinition(formula, *extent(formula, {}))
        return self._written[scope]


def named_expressions(texts: Mapping[str, str | float]) -> dict[str, NamedExpression]:
    """Return the named expressions of a file, which may mention one another; a number is a text, too."""
    together: list[NamedExpression] = []
    return {
        name: NamedExpression(name, text if isinstance(text, str) else repr(text), together)
        for name, text in texts.items()
    }


def expand(symbol: Symbol, names: SceneNames, scope: Scope, read: Callable[[str], Formula]) -> WrittenDefinition:
    """Return the formula of a definition in a scope, with the size; ``symbol`` stands for the definition in another
    formula, and ``read`` reads a text as a formula.

    Raises
    ------
    FormulaError
        Naming the definition.
    """
    definition: NamedExpression = names.definitions[symbol.name]
    try:
        return definition.read(scope, read)
    except DefinitionError:
        raise
    except FormulaError as error:
        fault = f"in the definition {symbol.name}, {error.fault} [E1519]"
        raise FormulaError(fault, error.column, error.hint) from None


def definition_symbols(formula: Formula) -> set[Symbol]:
    """Return the symbols of definitions in a formula before their expansion."""
    return {node for node in distinct_nodes(formula) if isinstance(node, Symbol) and node.kind == "definition"}


def check_extent(formula: Formula, parts: Mapping[Symbol, WrittenDefinition]) -> None:
    """Raise FormulaError if a formula with its definitions written out has too many operations or levels. ``parts`` has
    the formula and the size of each definition by its symbol."""
    operations, levels = extent(formula, parts)
    if operations > 20_000 or levels > 150:  # Python visits each operation and level
        fault = f"the formula has {operations} operations in {levels} levels, of 20000 and 150 at most [E1520]"
        raise FormulaError(fault, 1, IN_PLACE)


def extent(formula: Formula, parts: Mapping[Symbol, WrittenDefinition]) -> tuple[int, int]:
    """Return the numbers of operations and nested levels in a formula; the symbols in ``parts`` count with the size of
    their definition."""
    known: dict[int, tuple[int, int]] = {}

    def of(node: Formula) -> tuple[int, int]:
        if isinstance(node, Symbol) and node in parts:
            return parts[node].operations, parts[node].levels
        if id(node) not in known:
            inner = node.arguments if isinstance(node, Operation) else ()
            inner = (node.argument,) if isinstance(node, Application) else inner
            counted = [of(part) for part in inner]
            levels = 1 + max((levels for _, levels in counted), default=0)
            known[id(node)] = bool(inner) + sum(count for count, _ in counted), levels
        return known[id(node)]

    return of(formula)
