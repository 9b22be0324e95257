"""Reading of sampled states: their clock, and the registers that delay them."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Protocol

from eomgen.base.data import dataclass
from eomgen.base.messages import key_of
from eomgen.base.rounding import COMPUTED
from eomgen.formula.nodes import ZERO, Formula, Symbol
from eomgen.formula.units.parser import dimension_of
from eomgen.scene.formula.scope import LOAD
from eomgen.scene.reading.formula_units import dimension_of_formula
from eomgen.scene.reading.kinds import Value
from eomgen.scene.reading.values import Values
from eomgen.system.signals import Sampling, State

if TYPE_CHECKING:
    from eomgen.scene.signals.schema import StateEntry as WrittenState


class WrittenClock(Protocol):
    """The keys of an entry that is sampled."""

    sample: Value | None
    delay: Value | None
    quantum: Value | None


@dataclass(frozen=True)
class Clock:
    """Times of samples, and the rounding and delay of sampled values.

    Attributes
    ----------
    period : s
    quantum : values are rounded to whole multiples of the quantum; 0: no rounding
    whole, rest : the delay: number of whole samples, and remainder in s
    """

    period: float
    quantum: float = 0.0
    whole: int = 0
    rest: float = 0.0


def read_clock(key: str, entry: WrittenClock, values: Values) -> Clock | None:
    """Return the clock of a sampled entry with the dotted key ``key``; None if period or delay have a fault, which is
    reported. A quantum that is not positive, and a delay that ends shortly after a sample, are reported, too."""
    period = values.constant(f"{key}.sample", entry.sample or 0.0)
    quantum = 0.0 if entry.quantum is None else values.constant(f"{key}.quantum", entry.quantum)
    delay = values.constant(f"{key}.delay", entry.delay or 0.0)
    if math.isnan(period):
        return None
    if not 0.0 < period < math.inf:
        fault = f"the time between two samples is {period:.6g} s, and has to be positive [E1867]"
        values.report.add(f"{key}.sample", fault, 'sample = "1 ms"')
        return None
    if entry.quantum is not None and quantum <= 0.0:
        hint = "a positive number, or no quantum where values are not rounded"
        values.report.add(f"{key}.quantum", f"the quantum {quantum:.6g} is not positive [E0529]", hint)
    if not 0.0 <= delay <= 1000 * period:
        fault = f"a delay of {delay:.6g} s is not between 0 and 1000 samples, {1000 * period:.6g} s [E1868]"
        values.report.add(f"{key}.delay", fault, f"delay = {period:.6g}")
        return None
    whole = round(delay / period)
    rest = 0.0
    if abs(delay - whole * period) > COMPUTED * period:
        whole = math.floor(delay / period)
        rest = delay - whole * period
        if rest < 1e-4 * period:  # as good as the sample itself
            fault = f"the delay ends {rest:.3g} s after a sample, which is too near to it [E1869]"
            values.report.add(f"{key}.delay", fault, f"delay = {whole * period:.9g}")
    return Clock(period, quantum, whole, rest)


@dataclass(frozen=True)
class HeldValue:
    """A sampled value, from which states are made.

    Attributes
    ----------
    name, initial, unit, description : of the state
    formula : sampled value
    key, place : dotted key of the entry, and file, line and key of the formula, for messages
    controller : name of the sampled controller that gives the value; empty without one
    """

    name: str
    formula: Formula
    initial: float
    unit: str
    description: str
    key: str
    place: str
    controller: str = ""


def held_states(value: HeldValue, clock: Clock, values: Values) -> list[State]:
    """Return the state that holds a sampled value, preceded by the states that hold the value during the delay of the
    clock, whose names that are taken are reported. ``values`` is the reader of values."""
    name = value.name

    def held_state(label: str, formula: Formula, offset: float = 0.0, *, register: bool = True) -> State:
        text = value.description if label == name else f"what {name} will be"
        rounded, controller = (0.0, "") if register else (clock.quantum, value.controller)
        sampling = Sampling(formula, clock.period, offset, rounded, register, value.place, controller)
        return State(label, ZERO, value.initial, value.unit, text, sampling)

    if not clock.whole and not clock.rest:
        return [held_state(name, value.formula, register=False)]
    labels = [f"{name}_sampled", *(f"{name}_sampled_{k}" for k in range(2, clock.whole + (clock.rest > 0.0) + 1))]
    taken = {*values.names.states, *values.names.parameters, *values.names.inputs} & set(labels)
    for label in sorted(taken):
        fault = f"the name {label} is taken, and is needed for the value that {name} holds during its delay [E1870]"
        values.report.add(value.key, fault, "another name")
    made = [held_state(labels[0], value.formula, register=False)]
    made += [held_state(label, Symbol("state", before)) for before, label in itertools.pairwise(labels)]
    return [*made, held_state(name, Symbol("state", labels[-1]), clock.rest)]


def read_sampled_state(name: str, entry: WrittenState, values: Values) -> list[State]:
    """Return a sampled state of an entry of [states], preceded by states that hold the value during the delay; empty
    for a faulty clock. Faults, and a quantum in another unit than the formula, are reported."""
    key = key_of("states", name)
    location = values.report.where(f"{key}.formula")
    initial = values.constant(f"{key}.initial", entry.initial)
    formula = ZERO if entry.formula is None else values.formula(f"{key}.formula", entry.formula, LOAD)
    clock = read_clock(key, entry, values)
    if clock is None:
        return []
    step, dimension = dimension_of(values.units.get(f"{key}.quantum", "")), dimension_of_formula(formula, values.names)
    if step is not None and dimension is not None and step.powers != dimension.powers:
        fault = f"the quantum is in {step}, and the formula in {dimension} [E1871]"
        hint = f"a difference of two neighbouring values of the formula, in {dimension}"
        values.report.add(f"{key}.quantum", fault, hint)
    return held_states(HeldValue(name, formula, initial, entry.unit, entry.description, key, location), clock, values)
