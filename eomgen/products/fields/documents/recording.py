"""Recording of formulas by names of values."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import Formula
from eomgen.formula.recording import record
from eomgen.symbolic.scalar import Algebra, Scalar


def record_at(key: str, algebra: Algebra, formula: Formula, known: Mapping[str, Scalar]) -> Scalar:
    """Record a formula on the tape of ``algebra``, with the scalars ``known`` by name, and return its scalar. A
    ModelError has ``key`` as place."""
    try:
        return record(algebra, formula, lambda symbol: known[symbol.name])
    except ModelError as error:
        raise ModelError([Problem(key, problem.what, problem.hint) for problem in error.problems]) from None
