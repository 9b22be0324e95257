"""Schema of events and modes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pydantic import model_validator

from eomgen.scene.formula.scope import EVERYTHING
from eomgen.scene.reading.key_metadata import ANY_UNIT, Table, key, of_fixed_parameters, optional, shown_power
from eomgen.scene.reading.kinds import Description, Finite, Value
from eomgen.system.events import LEAST_INTERVAL


class EventEntry(Table):
    """Action at the roots of a formula along a run."""

    when: Value = key("formula with the event at its roots", unit=ANY_UNIT, names=EVERYTHING)
    direction: Literal["rising", "falling", "both"] = key("direction in which the formula passes zero", "both")
    action: Literal["record", "count", "stop", "reset", "impact", "switch"] = key("effect on the run", "record")
    reset: dict[str, Value] | None = optional(
        'new values of `"q.joint"`, `"v.joint"` or a state, from values before the event; for `reset`',
        unit=ANY_UNIT,
        names=EVERYTHING,
        sets=True,
        kind="values by quantity",
    )
    restitution: Value | None = optional("rate of `when` after an `impact`, by minus the one before", names=EVERYTHING)
    mode: str | None = optional("mode that a `switch` sets", refers="modes")
    to: Value | None = optional("new value of the mode of a `switch`", names=EVERYTHING)
    least_interval: Value | None = of_fixed_parameters(
        "least time between two events; an event that comes again sooner ends the run",
        unit="s",
        shown_default=f"{shown_power(LEAST_INTERVAL)} of the step",
    )
    description: Description = key("text of one line for tables", "")


class ModeEntry(Table):
    """A number that only events change, `mode.name` in formulas."""

    value: Finite = key("number at the start of a run")
    description: Description = key("text of one line for tables", "")

    @model_validator(mode="before")
    @classmethod
    def _from_number(cls, data: object) -> object:
        return data if isinstance(data, Mapping) else {"value": data}
