"""Reserved words of formulas and units."""

from __future__ import annotations

from collections.abc import Mapping

WORDS = frozenset({"if", "else", "and", "or", "not"})
FUNCTIONS: Mapping[str, int] = {
    **dict.fromkeys(("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"), 1),
    **dict.fromkeys(("exp", "log", "sqrt", "abs", "sign"), 1),
    **dict.fromkeys(("atan2", "min", "max"), 2),
}
RESERVED = WORDS | FUNCTIONS.keys() | {"t", "pi"}
