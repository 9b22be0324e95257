"""Derivatives of runs that are no numbers: which formulas may have none."""

from __future__ import annotations

from collections.abc import Iterator

from eomgen.compiled.model import CompiledModel
from eomgen.errors import NumericalError, Problem
from eomgen.formula.evaluate import symbols
from eomgen.formula.infix import infix
from eomgen.formula.nodes import Application, Formula, Number, Operation

#: Functions with arguments at which they have a value and no derivative.
_ROUGH = frozenset({"sqrt", "log", "asin", "acos", "atan2"})
#: What does not move along a motion, so that it is no matter where a derivative is taken.
_GIVEN = frozenset({"parameter", "number", "place"})
#: Formulas that are named.
_NAMED = 2


def undefined_derivatives(model: CompiledModel, where: str) -> NumericalError:
    """Return the error for derivatives that are no finite numbers; ``where``: in words."""
    found = list(dict.fromkeys(text for formula in model.description.formulas for text in _rough(formula)))
    what = f"derivatives are no finite numbers {where}: "
    if found:
        more = f" and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
        what += f"a formula has none there, of the forces perhaps {', '.join(found[:_NAMED])}{more}"
    else:
        what += "a formula has none there (a root, a logarithm or a power at zero)"
    hint = "a formula that is smooth there, sqrt(x**2 + 1e-6) for abs(x); eomgen check names those that are not"
    return NumericalError(Problem("sensitivities", what, hint))


def _rough(formula: Formula) -> Iterator[str]:
    """Yield the operations of a formula whose derivative may be none where they have a value."""
    if isinstance(formula, Application):
        yield from _rough(formula.argument)
    elif isinstance(formula, Operation):
        moving = any(symbol.kind not in _GIVEN for symbol in symbols(formula.arguments[0]))
        if moving and (formula.name in _ROUGH or (formula.name == "pow" and _broken(formula.arguments[1]))):
            yield infix(formula)
        for argument in formula.arguments:
            yield from _rough(argument)


def _broken(exponent: Formula) -> bool:
    """Return whether a power with this exponent may have no derivative at zero."""
    return not isinstance(exponent, Number) or exponent.value < 1.0
