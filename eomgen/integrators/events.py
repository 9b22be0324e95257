"""Events, sampled states and discontinuities as data for the templates: their detection, clocks and treatment in a
stepper besides its steps, and the times at which steps are split.

A derivative of order k that jumps within a step costs an error of order k + 1 there, once; a jump of at least the order
of the method does no harm. Implicit methods find the accelerations of prescribed motions by differences, so
there it costs an error of order k, which numerical damping takes away over many steps. Times have a margin: a step
ends so much before one and goes on so much after it, so that rounding never puts an evaluation on the wrong side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from eomgen.base.rounding import SUMMED
from eomgen.errors import ModelError, Problem
from eomgen.integrators.families.family import Field, Status
from eomgen.system.events import LEAST_INTERVAL, EventRow, Mode
from eomgen.system.signals import SampledController, SampleRow

if TYPE_CHECKING:
    from eomgen.system.system import Discontinuity, System


#: Number of events that a call of ``run`` stores for the caller; the call ends after the step in which half of the
#: storage is used.
LOG = 64
#: Events within one step of the time grid at most.
MOST = LOG // 2
#: Shortest part of a step that is stepped, as a share of the step; shorter parts are two terms of a Taylor series.
SHORTEST = 1e-8

STOPPED = Status(
    20, "EVENT_STOP", "an event of the scene has ended the run", "an action other than stop, or a later end"
)
ACCUMULATED = Status(
    21,
    "EVENTS_ACCUMULATE",
    "an event comes again and again at once",
    "an event that stops the run, or switches a mode, where the motion comes to rest",
)
NOT_FINITE = Status(
    22,
    "EVENT_NOT_FINITE",
    "the action of an event gives values that are not finite",
    "formulas of the action that have a value there",
)
NO_IMPULSE = Status(
    23,
    "EVENT_WITHOUT_IMPULSE",
    "no impulse gives the velocities that an event asks for: constraints, or other velocities, decide them",
    "fewer velocities in the reset, or a formula whose gradient the constraints leave free",
)
OFF_CONSTRAINTS = Status(
    24,
    "EVENT_OFF_CONSTRAINTS",
    "the positions that an event sets break the constraints",
    "positions of all joints of the loop that meet the constraints, or velocities alone",
)
NEGATIVE_RESTITUTION = Status(
    25,
    "EVENT_NEGATIVE_RESTITUTION",
    "the restitution of an impact is negative, and the motion would go on through the obstacle",
    "a formula of the restitution that gives 0 or more there",
)
LOG_FULL = Status(
    26,
    "EVENT_LOG_FULL",
    f"more events lie between two rows than the {LOG} that are kept",
    "a smaller step, which is the distance of rows here, or the action count for events that come often",
)
NO_VALUE = Status(
    27,
    "EVENT_WITHOUT_VALUE",
    "the formula of an event, or its rate, has no finite value within the next step",
    "a formula that is finite on both sides of its root: roots, logarithms and quotients may not be",
)
#: Events with the state at the event.
_AT_EVENTS = (STOPPED, ACCUMULATED, NOT_FINITE, NO_IMPULSE, OFF_CONSTRAINTS, NEGATIVE_RESTITUTION, LOG_FULL)
STATUSES = (*_AT_EVENTS, NO_VALUE)
#: Numbers of these statuses: the state is at the event, between points of the time grid.
AT_EVENTS = frozenset(status.number for status in _AT_EVENTS)


#: Facts of each event for the templates: whether its rate is known, whether the action changes the motion, sets the
#: state, sets positions, is an impact, stops the run, or only counts.
_FLAGS: Mapping[str, Callable[[EventRow], bool]] = {
    "has_rate": lambda row: row.has_rate,
    "acts": lambda row: row.action not in ("record", "count"),
    "moves": lambda row: row.action in ("reset", "impact"),
    "places": lambda row: any(item.block == "q" for item in row.assignments),
    "impacts": lambda row: row.action == "impact",
    "stops": lambda row: row.action == "stop",
    "counts": lambda row: row.action == "count",
}


def event_data(rows: Sequence[EventRow], modes: Sequence[Mode]) -> dict[str, Any]:
    """Return the events and modes of a scene as data of the templates, JSON types only; empty without events. Keys:
    rows, modes, flags (one number for each event), and limits of the log and of steps."""
    if not rows:
        return {}
    return {
        "rows": [asdict(row) for row in rows],
        "modes": [asdict(mode) for mode in modes],
        "flags": {name: [int(test(row)) for row in rows] for name, test in _FLAGS.items()},
        "log": LOG,
        "most": MOST,
        "shortest": SHORTEST,
        "least_interval": LEAST_INTERVAL,
        "last_status": _AT_EVENTS[-1].name,
        "named": max((len(row.assignments) for row in rows), default=0),
    }


def event_state(rows: Sequence[EventRow], modes: Sequence[Mode]) -> tuple[Field, ...]:
    """Return the members of a stepper's state that events and modes need; none without events."""
    if not rows:
        return ()
    count, group = len(rows), "event_state"
    return (
        Field("event_known", "1: the signs are known", 0, "long", group, "known"),
        Field("event_side", "signs of the event functions: 1, -1, 0 on a root", count, "long", group, "side"),
        Field("event_count", "", count, "long", group, "count"),
        Field("event_time", "time of the last event of each kind, s", count, "real", group, "time"),
        Field("event_beyond", "values beyond zero by rounding at the last step's end", count, "real", group, "beyond"),
        Field("event_alone", "1: no other event has changed the rate since", count, "long", group, "alone"),
        Field("event_last", "number of the last event", 0, "long", group, "last"),
        *([Field("mode", "values of the modes", len(modes), "real", group, "mode")] if modes else []),
    )


#: Number of the status of a failed function, and its remedy.
CONTROLLER_FAILED = 30
CONTROLLER_ADVICE = "a function that gives finite values from the signals of that time, and returns 0"
#: Record of a stepper on the last function that failed; all zero but the first: the caller gave no function.
CONTROLLER_FAILURE = (
    Field("failed_controller", "number of the controller whose function failed last, from 1; 0: none", 0, "long"),
    Field("controller_returned", "return value of that function, 0 without an error", 0, "long"),
    Field(
        "controller_not_finite",
        "number of the value, then memory, of this controller that is not finite, from 1; 0: none; after the last one: "
        "values, then memory, that were written beyond their size",
        0,
        "long",
    ),
)


def sample_data(
    rows: Sequence[SampleRow], controllers: Sequence[SampledController] = (), states: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the sampled states as data of the templates, JSON types only.

    Keys: ``clocks``, each a period and the first time in s; ``rows`` with the index of their clock; ``closest``, how
    far a sample may be moved, s; and if there are any, ``controllers``, and ``from_caller``: whether the caller gives
    functions. ``set_at`` of a row is the level of evaluation at which the term gives its value, -1 if a controller
    does.

    Parameters
    ----------
    states : names of all internal states, in order
    """
    clocks = list(dict.fromkeys((row.period, row.offset) for row in rows))
    numbers = {name: number for number, name in enumerate(states)}
    called = [_controller_data(item, rows, numbers, clocks) for item in controllers]
    return {
        "clocks": [list(clock) for clock in clocks],
        "rows": [
            {
                **asdict(row),
                "clock": clocks.index((row.period, row.offset)),
                "set_at": row.level if row.controller < 0 else -1,
            }
            for row in rows
        ],
        # how far a sample may be moved onto a point of the time grid
        "closest": 1e-5 * min(row.period for row in rows),
        **({"controllers": called, "from_caller": any(not item["function"] for item in called)} if called else {}),
    }


def controller_data(system: System) -> dict[str, Any]:
    """Return the samples of a controller alone, as ``sample_data`` does, with clocks in whole ticks and the key
    ``tick``.

    ``tick``, s, is the longest time that divides all periods and first times; 0 without sampled states.

    Raises
    ------
    ModelError
        Clocks without a common tick.
    """
    if not system.sampled:
        return {"tick": 0.0, "clocks": [], "rows": [], "controllers": []}
    data = sample_data(system.sampled, system.controllers, [state.name for state in system.states])
    parts = {time: Fraction(time).limit_denominator(10**9) for clock in data["clocks"] for time in clock}
    shared = math.lcm(*(part.denominator for part in parts.values()))
    tick = Fraction(math.gcd(*(int(part * shared) for part in parts.values())), shared)
    exact = all(abs(float(part) - time) <= SUMMED * time for time, part in parts.items())
    # which are counted in 32 bits
    if not exact or max(parts.values()) / tick > 2**32 - 1:
        periods = " and ".join(f"{time:.9g} s" for time in parts if time)
        fault = f"the times of samples, {periods}, have no common divisor that a counter of 32 bits can count [E0331]"
        raise ModelError(Problem(system.name, fault, "periods and delays that are whole multiples of one time"))
    clocks = [[int(parts[time] / tick) for time in clock] for clock in data["clocks"]]
    return {"controllers": [], **data, "tick": float(tick), "clocks": clocks}


def _controller_data(
    item: SampledController,
    rows: Sequence[SampleRow],
    numbers: Mapping[str, int],
    clocks: Sequence[tuple[float, float]],
) -> dict[str, Any]:
    """Return the data of a sampled controller for the templates: names, indices of its states, clock and C function.
    `rows` are all sampled states, `numbers` the index of each internal state by name, `clocks` pairs of period and
    first time in s."""
    by_state = {row.state: row for row in rows}
    value_rows = [by_state[numbers[name]] for name in item.value_states]
    return {
        "name": item.name,
        "signals": list(item.signals),
        "outputs": list(item.outputs),
        "signal_states": [numbers[name] for name in item.signal_states],
        "value_states": [row.state for row in value_rows],
        "memory_states": [numbers[name] for name in item.memory_states],
        "quantum": value_rows[0].quantum,
        "level": value_rows[0].level,
        "clock": clocks.index((value_rows[0].period, value_rows[0].offset)),
        "declared": item.declared,
        "function": item.function,
        "source": item.source.name if item.source else "",
    }


def controller_status(controllers: Sequence[SampledController]) -> tuple[Status, ...]:
    """Return the status of a controller's function that fails; none without sampled controllers with functions."""
    if not controllers:
        return ()
    names = ", ".join(item.name for item in controllers)
    who = f"the function of the controller {names}" if len(controllers) == 1 else f"a controller's function ({names})"
    text = f"{who} reports an error, gives values that are not finite, or is missing"
    return (Status(CONTROLLER_FAILED, "CONTROLLER_FAILED", text, CONTROLLER_ADVICE),)


def jump_data(
    discontinuities: tuple[Discontinuity, ...], order: int, *, by_differences: bool = False
) -> dict[str, Any]:
    """Return the times at which forces jump within a step so that a method of an order loses accuracy.

    A mapping: ``once``, times in s; ``periodic``, pairs of first time and period; ``margin`` and ``blur``, the distance
    that steps keep from these times. Empty if there are none.

    Parameters
    ----------
    discontinuities : of the system, with the order of the derivative that jumps
    order : of the method
    by_differences : whether the method finds accelerations that constraints prescribe by differences of velocities
    """
    those = [item for item in discontinuities if item.order + 1 < order + (by_differences and item.constraint)]
    if not those:
        return {}
    margin = 32.0  # about the time of a jump, in times the precision of the numbers that the time is made of
    return {
        "once": sorted({item.time for item in those if item.period == 0.0}),
        "periodic": [
            list(pair) for pair in dict.fromkeys((item.time, item.period) for item in those if item.period > 0.0)
        ],
        "margin": margin,
        "blur": max(margin * item.blur for item in those),
    }
