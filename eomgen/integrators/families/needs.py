"""What a method may ask about a system, and what it says where the answer is not what it needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol


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
