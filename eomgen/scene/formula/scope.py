"""Scopes of formulas: permitted names, and permitted kinds of quantities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from eomgen.formula.piecewise import AnyCurve

#: Words before the name of a curve, and which derivative they stand for.
DERIVATIVES: Mapping[str, int] = {"derivative": 1, "second_derivative": 2}
ENERGIES = ("kinetic", "potential", "total", "base_power", "power")


@dataclass(frozen=True)
class Scope:
    """Which kinds of symbols a formula may use; ``power`` stands for the powers among the energies."""

    description: str
    kinds: frozenset[str]


_STATE = frozenset(
    {"parameter", "time", "curve", "input", "state", "controller", "q", "v", "position", "velocity", "length", "rate", "energy"}
    | {"load", "deflection"}
)
FIXED_PARAMETERS = Scope("fixed parameters", frozenset({"fixed"}))
PARAMETERS = Scope("parameters", frozenset({"parameter"}))
TIME = Scope("time, parameters and curves", frozenset({"parameter", "time", "curve"}))
_ROAD = frozenset({"parameter", "time", "curve", "input", "position"})
ROAD = Scope("time, parameters, inputs, curves and the position of the wheel's centre", _ROAD)
SPRING_FORCE = Scope("time, parameters, inputs, states, positions and velocities (not accelerations or tensions)", _STATE)
STATE = Scope("time, parameters, inputs, states, positions, velocities and tensions (not accelerations)", _STATE | {"tension"})
EVERYTHING = Scope("any quantity", _STATE | {"tension", "a", "acceleration", "power"})


@dataclass(frozen=True)
class Names:
    """The names that formulas of one scene may mention.

    Attributes
    ----------
    parameters : mapping from name to whether it is tunable.
    joints : mapping from name to joint type; an empty type where it is not known.
    beams : mapping from name to number of elastic coordinates; 0 where it is not known.
    curves : mapping from name to curve.
    """

    parameters: Mapping[str, bool] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()
    states: tuple[str, ...] = ()
    controllers: tuple[str, ...] = ()
    joints: Mapping[str, str] = field(default_factory=dict)
    beams: Mapping[str, int] = field(default_factory=dict)
    points: tuple[str, ...] = ()
    springs: tuple[str, ...] = ()
    tyres: tuple[str, ...] = ()
    curves: Mapping[str, AnyCurve] = field(default_factory=dict)
