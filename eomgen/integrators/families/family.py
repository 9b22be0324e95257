"""What a family of methods asks of a system, and what holds its coefficients to their conditions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from eomgen.errors import Problem, UsageError


class FactsLike(Protocol):
    """What a method may ask about a system (``system.Facts`` answers)."""

    @property
    def constraints(self) -> bool: ...
    @property
    def internal_states(self) -> bool: ...


@dataclass(frozen=True)
class Need:
    """Something that a system must or must not have: the fact, the value it must have, why, and what to do otherwise."""

    fact: str
    value: bool
    reason: str
    alternative: str


def hold(text: str, true: bool) -> None:
    if not true:
        raise UsageError(Problem("method", f"the coefficients break a condition of the method: {text}"))


UNCONSTRAINED = Need(
    "constraints", False, "it steps ordinary differential equations and would ignore the constraint equations",
    "generalized_alpha, which keeps constraints, rk4_partitioned, which eliminates them, or a tree of joints",
)  # fmt: skip
