"""The error for derivatives of runs that are no numbers, with the formulas that may have none."""

from __future__ import annotations

from eomgen.compiled.model import CompiledModel
from eomgen.errors import NumericalError, Problem
from eomgen.formula.rough_operations import rough_operations


def undefined_derivatives(model: CompiledModel, where: str) -> NumericalError:
    """Return the error for derivatives that are no finite numbers; ``where``: the place in words."""
    found = rough_operations(model.description.formulas)
    fault = f"derivatives are no finite numbers {where}: "
    if found:
        fault += f"a formula has none there, of the forces perhaps {found}"
    else:
        fault += "a formula has none there (a root, a logarithm or a power at zero)"
    hint = "a formula that is smooth there, sqrt(x**2 + 1e-6) for abs(x); eomgen check names formulas that are not"
    return NumericalError(Problem("sensitivities", fault, hint))
