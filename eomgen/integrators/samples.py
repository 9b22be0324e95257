"""Sampled states as data for the templates: their clocks, which state follows which, and whose functions are called."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from eomgen.integrators.families.family import Field, Status
from eomgen.system.signals import SampledController, SampleRow

#: How far a sample may be moved onto a point of the time grid, as a part of the shortest period.
CLOSEST = 1e-5
#: Number of the status of a function that fails, and its remedy.
CONTROLLER_FAILED = 30
CONTROLLER_ADVICE = "a function that gives finite values from the signals of that time, and returns 0"
#: Record of a stepper on the last function that failed; all zero but the first: the caller gave no function.
CONTROLLER_FAILURE = (
    Field("failed_controller", "whose function failed last, counted from 1; 0: none", 0, "long"),
    Field("controller_returned", "return value of that function, 0 without an error", 0, "long"),
    Field("controller_not_finite", "which of its values, then memory, is not finite, from 1; 0: none", 0, "long"),
)


def sample_data(
    rows: Sequence[SampleRow], controllers: Sequence[SampledController] = (), states: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the sampled states as JSON types: ``clocks``, each a period and its first time in s, ``rows``, and
    ``controllers`` if there are some. ``set_at`` of a row is the level at which the term gives its value, -1 if a
    controller does.

    Parameters
    ----------
    states : names of all internal states, in order
    """
    clocks = list(dict.fromkeys((row.period, row.offset) for row in rows))
    numbers = {name: number for number, name in enumerate(states)}
    called = [_called(item, rows, numbers, clocks) for item in controllers]
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
        "closest": CLOSEST * min(row.period for row in rows),
        **({"controllers": called, "from_caller": any(not item["function"] for item in called)} if called else {}),
    }


def _called(
    item: SampledController,
    rows: Sequence[SampleRow],
    numbers: Mapping[str, int],
    clocks: Sequence[tuple[float, float]],
) -> dict[str, Any]:
    by_state = {row.state: row for row in rows}
    given = [by_state[numbers[name]] for name in item.value_states]
    return {
        "name": item.name,
        "signals": list(item.signals),
        "outputs": list(item.outputs),
        "signal_states": [numbers[name] for name in item.signal_states],
        "value_states": [row.state for row in given],
        "memory_states": [numbers[name] for name in item.memory_states],
        "quantum": given[0].quantum,
        "level": given[0].level,
        "clock": clocks.index((given[0].period, given[0].offset)),
        "declared": item.declared,
        "function": item.function,
        "source": item.source.name if item.source else "",
    }


def controller_status(controllers: Sequence[SampledController]) -> tuple[Status, ...]:
    """Return the status of a function that fails, if any are called."""
    if not controllers:
        return ()
    names = ", ".join(item.name for item in controllers)
    one = f"the function of the controller {names}" if len(controllers) == 1 else f"a controller's function ({names})"
    text = f"{one} reports an error, gives values that are not finite, or is missing"
    return (Status(CONTROLLER_FAILED, "CONTROLLER_FAILED", text, CONTROLLER_ADVICE),)
