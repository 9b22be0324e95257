"""Times that studies may take."""

from __future__ import annotations

from typing import Any

from eomgen.compiled.arguments import number_of
from eomgen.errors import Problem, UsageError


def study_seconds(name: str, value: Any) -> float:
    """Return the value of an argument that is a time of computation, s; raise UsageError unless it is positive."""
    seconds = number_of(name, value)
    if not seconds > 0.0:
        fault = f"a study takes a positive number of seconds, not {seconds:g} [E1141]"
        raise UsageError(Problem(name, fault, f"{name}=60"))
    return seconds
