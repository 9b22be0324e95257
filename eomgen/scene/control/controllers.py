"""Controllers, filters and actuators with memory: nothing but internal states and formulas, made of a few numbers.

A limited integral is brought back by what the limits take off, over the tracking time (Astrom and Rundqwist, Integrator windup
and how to avoid it, American Control Conference 1989).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

from eomgen.scene.control.schema import Controller as Written
from eomgen.scene.forces.model import Spring
from eomgen.scene.formula.evaluate import symbols
from eomgen.scene.formula.nodes import Formula, Number, Operation, Symbol
from eomgen.scene.formula.scope import PARAMETERS, STATE
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import UNKNOWN, Values
from eomgen.scene.scene import Controller, State
from eomgen.text import key_of


def read_controller(name: str, entry: Written, values: Values) -> tuple[list[State], Controller]:
    """Return the states and the output of a controller with memory; what is wrong is reported."""
    key = key_of("controllers", name)
    e = UNKNOWN if entry.signal is None else values.formula(f"{key}.signal", entry.signal, STATE)

    def number(field: str, default: float) -> Formula:
        written = getattr(entry, field)
        return Number(default) if written is None else values.formula(f"{key}.{field}", written, PARAMETERS)

    def start(field: str) -> float:
        written = getattr(entry, field)
        return 0.0 if written is None else values.constant(f"{key}.{field}", written)

    T = number("time_constant", math.nan)
    x, f = (Symbol("state", f"{name}_{suffix}") for suffix in ("integral", "filtered"))
    limits = Limits(key, entry, values)
    made: dict[str, tuple[Formula, float]] = {}
    if entry.type in ("pi", "pid"):
        kp, ki = number("proportional", 0.0), number("integral", 0.0)
        free = _sum(_product(kp, e), x)
        if entry.type == "pid":
            rate = _quotient(_difference(e, f), T)
            free = _sum(free, _product(number("derivative", 0.0), rate))
            made["filtered"] = rate, start("initial_filtered")
        rate = _product(ki, e)
        if limits.given:
            back = _quotient(_difference(limits.of(free), free), _tracking(key, entry, kp, ki, values))
            rate = _sum(rate, back)
        made = {"integral": (rate, start("initial")), **made}
    elif entry.type == "low_pass":
        made["filtered"] = _quotient(_difference(_product(number("gain", 1.0), e), f), T), start("initial")
        free = f
    else:
        made["filtered"] = _quotient(_difference(e, f), T), start("initial_filtered")
        share = _quotient(number("lead", 0.0), T)
        free = _product(number("gain", 1.0), _sum(f, _product(share, _difference(e, f))))
    what = {"integral": "integral", "filtered": "filtered signal"}
    states = [
        State(f"{name}_{suffix}", rate, initial, entry.unit if suffix == "integral" or entry.type == "low_pass" else "",
              f"{what[suffix]} of the controller {name}")
        for suffix, (rate, initial) in made.items()
    ]  # fmt: skip
    return states, Controller(name, limits.of(free), entry.unit, entry.description)


class Limits:
    """The limits of a controller's output."""

    def __init__(self, key: str, entry: Written, values: Values) -> None:
        self.bounds: dict[str, Formula] = {}
        for field, operation in (("minimum", "max"), ("maximum", "min")):
            written = getattr(entry, field)
            if written is not None:
                self.bounds[operation] = values.formula(f"{key}.{field}", written, PARAMETERS)
        if len(self.bounds) == 2:
            values.require(f"{key}.minimum", RELATIONS["limits of an output"], [self.bounds["max"], self.bounds["min"]])

    @property
    def given(self) -> bool:
        return bool(self.bounds)

    def of(self, formula: Formula) -> Formula:
        """Return a formula held between the limits."""
        for operation, bound in self.bounds.items():
            formula = Operation(operation, (bound, formula))
        return formula


def _tracking(key: str, entry: Written, kp: Formula, ki: Formula, values: Values) -> Formula:
    """Return the tracking time: the one given, or the integral time kp/ki."""
    if entry.tracking is not None:
        return values.formula(f"{key}.tracking", entry.tracking, PARAMETERS)
    values.require(key, RELATIONS["integral time"], [kp, ki])
    return Operation("div", (kp, ki))


def _sum(x: Formula, y: Formula) -> Formula:
    return Operation("add", (x, y))


def _difference(x: Formula, y: Formula) -> Formula:
    return Operation("sub", (x, y))


def _product(x: Formula, y: Formula) -> Formula:
    return Operation("mul", (x, y))


def _quotient(x: Formula, y: Formula) -> Formula:
    return Operation("div", (x, y))


def algebraic_loop(depends: Mapping[str, Sequence[str]]) -> list[str]:
    """Return a cycle among what uses what without a state between, its first member again at its end; or nothing."""
    try:
        TopologicalSorter(depends).prepare()
    except CycleError as error:
        cycle: list[str] = error.args[1]
        return cycle[::-1]
    return []


def check_loops(controllers: Sequence[Controller], springs: Sequence[Spring], values: Values) -> None:
    """Report outputs of controllers that depend on themselves at the same instant, directly or through tensions of springs."""
    depends = {f"controllers.{item.name}": _used(item.output) for item in controllers}
    depends |= {f"springs.{item.name}": _used(item.force) for item in springs}
    loop = algebraic_loop(depends)
    if loop:
        chain = " uses ".join(part.replace("springs.", "tension.") for part in loop)
        what = f"an algebraic loop: {chain}, with no state between"
        values.report.add(loop[0], what, "a low_pass controller, or a state, somewhere in the loop")


def _used(formula: Formula) -> list[str]:
    sections = {"controller": "controllers", "tension": "springs"}
    return sorted({f"{sections[s.kind]}.{s.name}" for s in symbols(formula) if s.kind in sections})
