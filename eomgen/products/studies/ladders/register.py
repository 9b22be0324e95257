"""The ladders, one row each: scaled quantity, values, reference and conditions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.products.studies.ladders.runs import ROWS, RunConditions
from eomgen.products.studies.ladders.scaling import (
    DAMPING,
    GRAVITY,
    LENGTH,
    MASS,
    ORIGIN,
    RATIO,
    RATIO_LAST,
    STIFFNESS,
    TIME,
    SceneUnits,
)
from eomgen.products.studies.ladders.subject import FACTORS, OWN, SINGLE, STEPS, Subject

#: References of a cell: the scene's own run by the same method, another method, the numbers of the equations.
SAME, OTHER, EQUATIONS = "the same motion as the scene is", "another method", "the equations as the scene is"
#: Methods of a ladder: all that serve the scene; the scene's, the default and an explicit one; methods with
#: the parameter ``rho_inf``; the scene's alone.
ALL, FEW, DAMPED, ONE = "all", "few", "damped", "one"


@dataclass(frozen=True)
class Ladder:
    """A ladder: a quantity of a scene that is scaled from one extreme to the other, with conditions and references.

    Attributes
    ----------
    name : of the option, of the map's row and of cells
    scales : in words
    values : from one extreme to the opposite extreme
    conditions : of a cell, as a function of the value
    applies : reason for which a scene has no such ladder, empty if there is a ladder
    against : one of the words above
    methods : one of the words above
    bound : error, relative to the motion, up to which a cell holds
    """

    name: str
    scales: str
    values: tuple[float, ...]
    conditions: Callable[[Subject, float], RunConditions]
    applies: Callable[[Subject], str] = lambda subject: ""
    against: str = OTHER
    methods: str = FEW
    bound: float = 0.01


#: Reason for which a factor has no effect in a scene.
_ABSENT: Mapping[str, str] = {
    STIFFNESS: "it has no key stiffness with a value",
    DAMPING: "it has no key damping with a value",
    GRAVITY: "it is without gravity",
    RATIO: "no body in it has a mass of its own",
    RATIO_LAST: "no two bodies in it have a mass of their own",
    ORIGIN: "nothing in it is fixed at a place",
}


def _with(*factors: str) -> Callable[[Subject], str]:
    def applies(subject: Subject) -> str:
        if not subject.has(FACTORS):
            return f"its numbers cannot be scaled: {subject.why_not[FACTORS]}"
        missing = [name for name in factors if name not in subject.factors]
        if missing:
            return f"it has numbers that have to be fixed, so no factor {missing[0]}"
        return next((_ABSENT[name] for name in factors if name in _ABSENT and name not in subject.used), "")

    return applies


def _similar(*factors: str) -> Callable[[Subject], str]:
    there = _with(*factors)

    def applies(subject: Subject) -> str:
        return there(subject) or subject.not_similar(factors)

    return applies


def _in_units(name: str) -> Callable[[Subject, float], RunConditions]:
    return lambda subject, value: subject.in_units(SceneUnits(**{name: value}), subject.conditions())


def _at_origin(subject: Subject, value: float) -> RunConditions:
    shift = np.zeros(subject.model(OWN).nq)
    for factor in subject.model(OWN).factors:
        if factor.name.endswith(".position") or (subject.scene.coordinates == "absolute" and factor.q_size == 7):
            shift[factor.q_start + (4 if factor.q_size == 7 else 0)] = value
    conditions = subject.conditions(model=FACTORS, parameters={ORIGIN: value}, shift=shift)
    return conditions.vary(q=conditions.q + shift)


def _factor(name: str) -> Callable[[Subject, float], RunConditions]:
    return lambda subject, value: subject.conditions(model=FACTORS, parameters={name: value})


def _spins(subject: Subject) -> str:
    turns = _angular(subject)
    if not np.any(turns):
        return "nothing in it turns by a velocity of its own"
    return (
        "it is held by constraints at rest"
        if subject.model(OWN).multipliers and not np.any(subject.start[1][turns])
        else ""
    )


def _angular(subject: Subject) -> Array:
    return np.array([unit == "rad/s" for unit in subject.model(OWN).v_units], dtype=bool)


def _spin(subject: Subject, value: float) -> RunConditions:
    q, v = subject.start
    turns = _angular(subject)
    fastest = float(np.max(np.abs(v[turns])))
    conditions = subject.conditions(steps=2 * ROWS)
    v = v * (value / conditions.step / fastest) if fastest else np.where(turns, value / conditions.step, v)
    return conditions.vary(q=q, v=v)


def _angles(subject: Subject) -> list[int]:
    model = subject.model(OWN)
    return [
        k
        for factor in model.factors
        if factor.group == "R"
        for k in range(factor.q_start, factor.q_start + factor.q_size)
        if model.q_units[k] == "rad"
    ]


def _has_angles(subject: Subject) -> str:
    return "" if _angles(subject) else "it has no angles as coordinates"


def _turn(subject: Subject, value: float, *, more: bool) -> RunConditions:
    """Return conditions with all angles at a number of turns, next to singular places, or by as many turns more."""
    q = np.array(subject.start[0])
    q[_angles(subject)] = 2.0 * np.pi * value + (q[_angles(subject)] if more else 1e-9)
    return subject.conditions(q=q)


def _decades(first: int, last: int, by: int = 1) -> tuple[float, ...]:
    return tuple(float(f"1e{k}") for k in range(first, last + 1, by))


_LENGTHS = (1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9)
_TIMES = (1e-6, 1e-3, 1e3, 1e6, 1e8)
_FACTORS = _decades(-12, 12, 3)
_TURNS = (0.4999999, 0.5, 1.0, 1e3, 1e6, 1e9)
_SPINS = (0.01, 0.1, 0.5, 1.0, 2.0, 3.0, 5.0, 6.2, 6.3, 10.0, 1e3, 1e6, 1e10)

LADDERS: tuple[Ladder, ...] = (
    Ladder("length", "unit of length, m", _LENGTHS, _in_units("length"), _similar(LENGTH), SAME, FEW, 1e-6),
    Ladder("mass", "unit of mass, kg", _LENGTHS, _in_units("mass"), _similar(MASS), SAME, FEW, 1e-6),
    Ladder("time", "unit of time, s", _TIMES, _in_units("time"), _similar(TIME), SAME, FEW, 1e-6),
    Ladder(
        "origin",
        "distance of the origin, m",
        _decades(2, 8, 2),
        _at_origin,
        lambda subject: _with(ORIGIN)(subject) or subject.not_movable(_at_origin(subject, subject.extent)),
        SAME,
        FEW,
        1e-4,
    ),
    Ladder(
        "structure",
        "numbers near 0, 1 and axes, by",
        _decades(-13, -7),
        lambda subject, _: subject.conditions(),
        lambda subject: "" if subject.data is not None else "the scene has no text whose numbers could be moved",
        EQUATIONS,
        ONE,
    ),
    Ladder(
        "step",
        "step by shortest period",
        _decades(-8, 0),
        lambda subject, value: subject.conditions(
            step=value * subject.period, steps=STEPS if value < 0.1 else 2 * ROWS
        ),
        methods=ALL,
    ),
    Ladder("stiffness", "all stiffnesses, times", _FACTORS, _factor(STIFFNESS), _with(STIFFNESS)),
    Ladder("damping", "all dampings, times", _FACTORS, _factor(DAMPING), _with(DAMPING)),
    Ladder("gravity", "gravity, times", (0.0, 1e-3, 1.0, 1e3, 1e6), _factor(GRAVITY), _with(GRAVITY)),
    Ladder("ratio", "inertia of the first body, times", _FACTORS, _factor(RATIO), _with(RATIO)),
    Ladder("ratio_last", "inertia of the last body, times", _FACTORS, _factor(RATIO_LAST), _with(RATIO_LAST)),
    Ladder("spin", "turn within a step, rad", _SPINS, _spin, _spins),
    Ladder("turns", "angles, turns more", _TURNS, partial(_turn, more=True), _has_angles),
    Ladder("right_angles", "all angles, turns", (0.0, 0.25, 0.5, 0.75), partial(_turn, more=False), _has_angles),
    Ladder(
        "rho_inf",
        "spectral radius at infinity",
        (0.0, 0.2, 0.5, 0.8, 0.95, 1.0),
        lambda subject, value: subject.conditions(given={"rho_inf": value}),
        methods=DAMPED,
    ),
    Ladder("start", "start of the run, s", _decades(3, 12, 3), lambda subject, value: subject.conditions(start=value)),
    Ladder(
        "count",
        "steps",
        _decades(5, 7),
        lambda subject, value: subject.conditions(step=STEPS * subject.fine / value, steps=int(value)),
        methods=ONE,
    ),
    Ladder(
        "float",
        "single precision, step by period",
        _decades(-5, -1),
        lambda subject, value: subject.conditions(model=SINGLE, step=value * subject.period),
        lambda subject: "" if subject.has(SINGLE) else subject.why_not[SINGLE],
    ),
)
BY_NAME: Mapping[str, Ladder] = {ladder.name: ladder for ladder in LADDERS}


def methods_of(ladder: Ladder, subject: Subject, wanted: Sequence[str]) -> list[str]:
    """Return the names of methods that a ladder runs with: the `wanted` ones that can step the scene, if there are any.
    Otherwise the ladder's, the scene's first. A ladder of one method ignores `wanted`."""
    methods = [str(subject.model(OWN).description.simulation.method)]
    every = {
        ONE: lambda: methods,
        FEW: lambda: [*methods, *subject.methods(ladders="few")],
        ALL: lambda: [*methods, *subject.methods(ladders="few"), *subject.methods(ladders="all")],
        DAMPED: lambda: subject.methods(ladders="damped"),
    }[ladder.methods]()
    result = [name for name in dict.fromkeys(every) if subject.runs(name)]
    chosen = [name for name in (wanted if ladder.methods != ONE else []) if subject.runs(name)]
    return chosen or result
