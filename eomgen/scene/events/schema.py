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

    when: Value = key("the event is at the roots of this formula", unit=ANY_UNIT, names=EVERYTHING)
    direction: Literal["rising", "falling", "both"] = key("how the formula passes zero", "both")
    action: Literal["record", "count", "stop", "reset", "impact", "switch"] = key("see [events](events.md)", "record")
    reset: dict[str, Value] | None = optional(
        'of `reset`: new values of `"q.joint"`, `"v.joint"` or a state, from values before the event',
        unit=ANY_UNIT,
        names=EVERYTHING,
        sets=True,
        kind="values by quantity",
    )
    restitution: Value | None = optional(
        "of `impact`: the rate of `when` afterwards, in parts of its negative before", names=EVERYTHING
    )
    mode: str | None = optional("of `switch`", refers="modes")
    to: Value | None = optional("of `switch`: the new value of the mode", names=EVERYTHING)
    least_interval: Value | None = of_fixed_parameters(
        "an event that comes again sooner ends the run",
        unit="s",
        shown_default=f"{shown_power(LEAST_INTERVAL)} of the step",
    )
    description: Description = key("for tables", "")


class ModeEntry(Table):
    """A number that only events change, `mode.name` in formulas."""

    value: Finite = key("at the start of a run")
    description: Description = key("for tables", "")

    @model_validator(mode="before")
    @classmethod
    def _from_number(cls, data: object) -> object:
        return data if isinstance(data, Mapping) else {"value": data}
