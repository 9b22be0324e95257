"""Inputs and internal states from the written form."""

from __future__ import annotations

import functools

from eomgen.scene import schema_signals as written
from eomgen.scene.corners import applications
from eomgen.scene.curve import AnyCurve
from eomgen.scene.curves import Curves
from eomgen.scene.formula_nodes import Formula, Operation
from eomgen.scene.formula_scope import STATE, TIME
from eomgen.scene.names import key_of
from eomgen.scene.roads import Harmonic
from eomgen.scene.scene import Input, State
from eomgen.scene.schema_control import State as WrittenState
from eomgen.scene.values import Values


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
