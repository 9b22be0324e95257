"""Validation of tunable parameters at every call, by the requirements of the description."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.errors import Problem, UsageError
from eomgen.formula.evaluate import OTHER_VALUES, evaluate, evaluate_batch, symbols
from eomgen.formula.nodes import Formula
from eomgen.system.description import Description, Requirement

#: Sets of parameters that are checked at once: as many as caches hold.
_BATCH = 8192
#: So many parameters are listed in a message.
_LISTED = 8


class Requirements:
    """The requirements that tunable parameters decide.

    Parameters
    ----------
    names : sequence of str
        Tunable parameters, in the order of arrays.
    """

    def __init__(self, description: Description, names: Sequence[str]) -> None:
        self.names = tuple(names)
        self.required = description.requirements
        self._fixed = description.values({})
        self._met = b""  # the last set of parameters that met everything

    def check(self, parameters: Array) -> None:
        """Check one set of parameters, or a batch (..., np) of them.

        Raises
        ------
        UsageError
            With all that is wrong at the first set that does not meet a requirement.
        """
        if not self.required:
            return
        if parameters.ndim == 1:
            given = parameters.tobytes()
            if given != self._met:  # loops of a caller, and the runs of this package, hand in the same again and again
                self._check_one(parameters.tolist())
                self._met = given
            return
        rows = parameters.reshape(-1, len(self.names))
        for start in range(0, len(rows), _BATCH):
            part = rows[start : start + _BATCH]
            for row in np.flatnonzero(self._broken(part)).tolist():
                # raises, unless the last digit of a function differs between the two
                self._check_one(part[row].tolist())

    def _check_one(self, row: Sequence[float]) -> None:
        values = self._fixed | dict(zip(self.names, row, strict=True))
        stages: dict[int, list[Problem]] = {}
        for item in self.required:
            problem = _problem(item, values, self.names)
            if problem is not None:
                stages.setdefault(0 if item.rule is None else item.rule.stage, []).append(problem)
        if stages:
            raise UsageError(stages[min(stages)])

    def _broken(self, rows: Array) -> NDArray[np.bool_]:
        """Return a mask of the sets of parameters (n, np) that break a requirement, all at once."""
        values: dict[str, float | Array] = {**self._fixed, **dict(zip(self.names, rows.T, strict=True))}
        result = np.zeros(len(rows), dtype=bool)
        known: dict[Formula, Array] = {}
        for item in self.required:
            for formula in item.formulas:
                if formula not in known:
                    known[formula] = evaluate_batch(formula, lambda symbol: values[symbol.name])
            numbers = [known[formula] for formula in item.formulas]
            missing = [np.isnan(number) for number in numbers]
            if any(unknown.any() for unknown in missing):
                numbers = [np.where(unknown, 1.0, number) for unknown, number in zip(missing, numbers, strict=True)]
            for unknown in missing:
                result |= unknown
            if item.rule is not None:
                result |= item.rule.broken(numbers)
        return result


def _problem(item: Requirement, values: Mapping[str, float], names: Sequence[str]) -> Problem | None:
    """Return the problem of a requirement that is broken at the values of all parameters, None if it is met."""
    try:
        numbers = [evaluate(formula, lambda symbol: values[symbol.name]) for formula in item.formulas]
    except ArithmeticError as error:
        return Problem(item.where, f"{error} at {_listed(item, values, names)}", OTHER_VALUES)
    if item.rule is None or not item.rule.broken(numbers):
        return None
    fault, hint = item.rule.fault(numbers)
    return Problem(item.where, f"{fault} at {_listed(item, values, names)}", hint)


def _listed(item: Requirement, values: Mapping[str, float], names: Sequence[str]) -> str:
    """Return the tunable parameters that a requirement depends on, with their values."""
    mentioned = {symbol.name for formula in item.formulas for symbol in symbols(formula) if symbol.kind == "parameter"}
    specified = [f"{name} = {values[name]:.6g}" for name in names if name in mentioned]
    more = f" and {len(specified) - _LISTED} more" if len(specified) > _LISTED else ""
    return ", ".join(specified[:_LISTED]) + more
