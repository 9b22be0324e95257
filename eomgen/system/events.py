"""Events of a system and their actions: roots of formulas, with directions, resets, impacts and modes."""

from __future__ import annotations

from typing import Literal

from eomgen.base.data import dataclass

Direction = Literal["rising", "falling", "both"]
Action = Literal["count", "record", "stop", "reset", "impact", "switch"]
#: Least time between two events of a kind, as a share of a step, if the scene gives none.
LEAST_INTERVAL = 1e-9


@dataclass(frozen=True)
class Assignment:
    """A number of the state that an event sets.

    Attributes
    ----------
    block, index : the number: of ``q``, ``v`` or ``z``
    place : index of the formula among the ``event_actions``
    """

    block: str
    index: int
    place: int


@dataclass(frozen=True)
class EventRow:
    """One event of a System, in the order of the term ``events``.

    Attributes
    ----------
    sign : of the rate at the roots that count: 1 rising, -1 falling, 0 both
    has_rate : whether the term gives the rate of the function; else the term's rate is zero
    assignments : of ``reset``
    restitution : place among the ``event_actions`` of an impact's restitution
    gradient : row of an impact in the term ``event_impulse``
    mode, value : of ``switch``: number of the mode, index of the new value among the ``event_actions``
    least_interval : s; an event that comes again sooner ends the run; 0: the stepper's own bound
    """

    name: str
    action: Action = "record"
    sign: int = 0
    has_rate: bool = True
    assignments: tuple[Assignment, ...] = ()
    restitution: int = -1
    gradient: int = -1
    mode: int = -1
    value: int = -1
    least_interval: float = 0.0
    description: str = ""


@dataclass(frozen=True)
class Mode:
    """A number that only events change; ``parameter``: the tunable parameter for the value at the start."""

    name: str
    parameter: int


def mode_parameter(mode: str) -> str:
    """Return the name of the tunable parameter that holds the value of a mode at the start of a run."""
    return f"mode_{mode}"
