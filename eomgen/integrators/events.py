"""Events as data for the templates: detection and treatment in a stepper besides its steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from eomgen.integrators.families.family import Field, Status
from eomgen.system.events import LEAST_INTERVAL, EventRow, Mode

#: Number of events that a call of ``run`` stores for the caller; the call ends after the step in which half of the
#: storage is used.
LOG = 64
#: Events within one step of the time grid at most.
MOST = LOG // 2
#: Shortest part of a step that is stepped, as a share of it; shorter ones are two terms of a Taylor series.
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
#: Their numbers: the state is at the event, between points of the time grid.
AT_EVENTS = frozenset(status.number for status in _AT_EVENTS)


#: Facts of each event for the templates: whether its rate is known, the action changes the motion, sets the state
#: itself, is an impact, stops the run, or only counts.
_FLAGS: Mapping[str, Callable[[EventRow], bool]] = {
    "has_rate": lambda row: row.has_rate,
    "acts": lambda row: row.action not in ("record", "count"),
    "moves": lambda row: row.action in ("reset", "impact"),
    "impacts": lambda row: row.action == "impact",
    "stops": lambda row: row.action == "stop",
    "counts": lambda row: row.action == "count",
}


def event_data(rows: Sequence[EventRow], modes: Sequence[Mode]) -> dict[str, Any]:
    """Return the events and modes as JSON types; empty without events."""
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
    """Return the members of a stepper's state that events need."""
    if not rows:
        return ()
    count, group = len(rows), "event_state"
    return (
        Field("event_known", "1 behind the first step", 0, "long", group, "known"),
        Field("event_side", "signs of the functions: 1, -1, 0 on a root", count, "long", group, "side"),
        Field("event_count", "", count, "long", group, "count"),
        Field("event_time", "of the last one of each, s", count, "real", group, "time"),
        Field("event_last", "number of the last event", 0, "long", group, "last"),
        *([Field("mode", "values of the modes", len(modes), "real", group, "mode")] if modes else []),
    )
