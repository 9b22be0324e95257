"""Parameters, inputs, internal states and outputs of a Scene."""

from __future__ import annotations

from dataclasses import dataclass

from eomgen.formula.nodes import Formula, Symbol
from eomgen.system.random_processes import RandomProcess


@dataclass(frozen=True)
class Parameter:
    """A named number. Tunable ones are arguments of every call; the others are folded into the code.

    Attributes
    ----------
    standard_normal : whether it is a standard normal variable, of which runs by default have one draw
    """

    name: str
    value: float
    tunable: bool = False
    unit: str = ""
    description: str = ""
    standard_normal: bool = False


@dataclass(frozen=True)
class RoadUnderWheel:
    """A random road that an input gives: its class of ISO 8608, the speed (m/s), the distance (m) by which the wheel
    follows the first one of its track, and the track's seed."""

    road_class: str
    speed: float
    offset: float
    seed: int


@dataclass(frozen=True)
class Input:
    """A named input u_k; its default value is a formula plus a sum of harmonics.

    Attributes
    ----------
    formula : formula of t and parameters, or None
    harmonics : tuples (amplitude, angular frequency, phase), each adding amplitude cos(angular frequency t + phase)
    road : the road described by the harmonics, if any
    random : the random process described by the formula, if any
    """

    name: str
    formula: Formula | None = None
    unit: str = ""
    description: str = ""
    harmonics: tuple[tuple[float, float, float], ...] = ()
    road: RoadUnderWheel | None = None
    random: RandomProcess | None = None

    @property
    def given(self) -> bool:
        """Whether the scene itself specifies the input."""
        return self.formula is not None or bool(self.harmonics)


@dataclass(frozen=True)
class Sampling:
    """When and how an internal state takes new values.

    Attributes
    ----------
    formula : of everything but accelerations
    period, offset : s; samples are at offset + k period, k = 0, 1, ...
    quantum : values are rounded to whole multiples of it; 0: they are not
    register : whether it takes the values of other states from before they are sampled at the same time
    place : file and line, for messages
    controller : the sampled controller that gives the value in place of the formula; empty: none
    """

    formula: Formula
    period: float
    offset: float = 0.0
    quantum: float = 0.0
    register: bool = False
    place: str = ""
    controller: str = ""


@dataclass(frozen=True)
class State:
    """An internal state z_k: zdot_k = ``rate``, a formula of everything but accelerations, from ``initial`` on.

    A sampled one has rate 0 and keeps its value between samples.
    """

    name: str
    rate: Formula
    initial: float = 0.0
    unit: str = ""
    description: str = ""
    sampling: Sampling | None = None


@dataclass(frozen=True)
class Output:
    """A named output: ``values`` are formulas of everything (positions, accelerations and energies included).

    Named energies are the symbols of kind ``energy`` names: see ``kind`` "energy" with name kinetic, potential, total,
    base_power or power.
    """

    name: str
    values: tuple[Formula, ...]
    unit: str = ""
    description: str = ""

    @property
    def quantity(self) -> str:
        """``position``, ``velocity`` or ``acceleration`` if the values are exactly one of them, else empty."""
        kinds = {value.kind if isinstance(value, Symbol) else "" for value in self.values}
        kind = kinds.pop() if len(kinds) == 1 else ""
        return kind if kind in ("position", "velocity", "acceleration") else ""
