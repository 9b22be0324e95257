"""Inputs and internal states from the written form."""

from __future__ import annotations

import functools

from eomgen.scene.control.schema import State as WrittenState
from eomgen.scene.formula.discontinuities import applications
from eomgen.scene.formula.nodes import Formula, Operation
from eomgen.scene.formula.piecewise import AnyCurve
from eomgen.scene.formula.scope import STATE, TIME
from eomgen.scene.reading.values import Values
from eomgen.scene.scene import Input, State
from eomgen.scene.signals import schema as written
from eomgen.scene.signals.curves import Curves
from eomgen.scene.signals.roads import Harmonic
from eomgen.text import key_of


def read_input(name: str, entry: written.Input, curves: Curves, values: Values) -> tuple[Input, dict[str, AnyCurve]]:
    """Return an input, and the curves that it is made of."""
    key = key_of("inputs", name)
    parts: list[Formula] = []
    if entry.formula is not None:
        parts.append(values.formula(f"{key}.formula", entry.formula, TIME))
    parts += curves.signal(key, entry)
    harmonics: tuple[Harmonic, ...] = ()
    if entry.road is not None:
        found = curves.road(f"{key}.road", entry.road)
        parts += [] if isinstance(found, tuple) else [found]
        harmonics = found if isinstance(found, tuple) else ()
    table = {at.curve.name: at.curve for part in parts for at in applications(part)}
    formula = functools.reduce(lambda x, y: Operation("add", (x, y)), parts) if parts else None
    return Input(name, formula, entry.unit, entry.description, harmonics), table


def read_state(name: str, entry: WrittenState, values: Values) -> State:
    """Return an internal state."""
    key = key_of("states", name)
    rate = values.formula(f"{key}.rate", entry.rate, STATE)
    initial = values.constant(f"{key}.initial", entry.initial)
    return State(name, rate, initial, entry.unit, entry.description)
