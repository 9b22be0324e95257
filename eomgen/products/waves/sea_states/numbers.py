"""Conditions on numbers of seas: one message for each that is violated."""

from __future__ import annotations

import math
from typing import Any

from eomgen.errors import Problem, UsageError


def check_number(where: str, value: Any, unit: str = "", hint: str = "", *, above_zero: bool = False) -> None:
    """Raise UsageError unless a value is a finite number, and above 0 if it has to be."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise UsageError(Problem(where, f"a number is needed, not {type(value).__name__}", hint)) from None
    said = f"{number:.6g} {unit}".strip()
    if not math.isfinite(number):
        raise UsageError(Problem(where, f"{said} is no finite number", hint))
    if above_zero and not number > 0.0:
        raise UsageError(Problem(where, f"{said} is not above 0", hint))


def check_whole(where: str, value: Any, least: int, most: int, hint: str = "") -> None:
    """Raise UsageError unless a value is a whole number from ``least`` to ``most``."""
    if isinstance(value, bool) or not hasattr(value, "__index__") or not least <= int(value) <= most:
        said = f"{value:.6g}" if isinstance(value, float) else f"{value!r}"
        fault = (
            f"{said} is no whole number from {least} on" if most > 10**15 else f"{said} is not from {least} to {most}"
        )
        raise UsageError(Problem(where, fault, hint or f"{least}"))
