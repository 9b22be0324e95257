"""Sampled states as a back end needs them: internal states with new values at sample times, and the functions
that return these values."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SampleRow:
    """One sampled state of a System, in the order of the term ``samples``, which gives the values.

    Attributes
    ----------
    state : its number in z
    period, offset : s; samples are at offset + k period, k = 0, 1, ...
    quantum : values are rounded to whole multiples of it; 0: they are not
    level : of states sampled at the same time, lower levels are set first
    controller : number of the controller that returns the value in place of the term; -1: none
    """

    state: int
    period: float
    offset: float = 0.0
    quantum: float = 0.0
    level: int = 0
    controller: int = -1


@dataclass(frozen=True)
class CSource:
    """A C file that a scene brings along.

    Attributes
    ----------
    name : of the file, without its folder
    text : all of it
    """

    name: str
    text: str


@dataclass(frozen=True)
class SampledController:
    """A function called at samples: maps signals and its own memory to values that are held.

    Attributes
    ----------
    name : of its entry
    signals, outputs : their names in the scene
    signal_states, value_states, memory_states : names of the internal states that hold them; all are sampled together
    declared : whether its memory is declared to be all that it keeps
    function : name of its C function; empty: its caller gives one
    source : the file with that
    """

    name: str
    signals: tuple[str, ...]
    outputs: tuple[str, ...]
    signal_states: tuple[str, ...]
    value_states: tuple[str, ...]
    memory_states: tuple[str, ...] = ()
    declared: bool = True
    function: str = ""
    source: CSource | None = None
