"""Lengths and curves of constraints, for messages on constraints that no position meets."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping

import numpy as np

from eomgen.formula.curves import Curve
from eomgen.formula.discontinuities import applications
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import ZERO
from eomgen.scene.joints.model import Constraint


def numbers_of_constraints(constraints: Iterable[Constraint], parameters: Mapping[str, float] | None) -> list[str]:
    """Return clauses for messages: the constant lengths of constraints, m, and for curves in their equations and
    surfaces the ranges of arguments and values; each once.

    Parameters
    ----------
    parameters : values by name, for lengths; None for ranges alone
    """
    result = []
    for item in constraints:
        for name, formula in () if parameters is None else item.given_lengths():
            with contextlib.suppress(ArithmeticError, KeyError):  # lengths over time
                length = evaluate(formula, lambda symbol: (parameters or {})[symbol.name])
                result.append(f"{item.name} has {name} = {length:.6g} m")
        for law in (item.equation, item.surface):
            for used in applications(ZERO if law is None else law):
                curve = used.curve
                if isinstance(curve, Curve):
                    name, of_line, _ = curve.name.partition(", ")  # a line of a map
                    values = "" if of_line else f", with values from {np.min(curve.y):.6g} to {np.max(curve.y):.6g}"
                    result.append(f"{name} has points from {curve.start:.6g} to {curve.end:.6g}{values}")
    return list(dict.fromkeys(result))
