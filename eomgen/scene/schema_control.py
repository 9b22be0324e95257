"""The shape of what has memory: internal states, and the controllers that are made of them."""

from __future__ import annotations

from typing import Literal

from eomgen.scene.formula_scope import FIXED_PARAMETERS, PARAMETERS, STATE
from eomgen.scene.schema_key import ANY_UNIT, Table, key
from eomgen.scene.schema_values import Description, Unit, Value


class State(Table):
    """An internal state z, which its rate moves."""

    rate: Value = key("its time derivative", names=STATE)
    initial: Value = key("at the start", 0.0, unit=ANY_UNIT, names=FIXED_PARAMETERS)
    unit: Unit = key("label", "")
    description: Description = key("for tables", "")


class Controller(Table):
    """A controller, filter or actuator, made of internal states; its output is called by its name."""

    type: Literal["pi", "pid", "low_pass", "lead_lag"] = key("which of the equations below", kind="see below")
    signal: Value = key("e, what goes in", names=STATE)
    proportional: Value | None = key("kp, `pi` and `pid`", None, names=PARAMETERS, shown_default="`0`")
    integral: Value | None = key("ki, `pi` and `pid`", None, names=PARAMETERS, shown_default="`0`")
    derivative: Value | None = key("kd, `pid`", None, names=PARAMETERS, shown_default="`0`")
    gain: Value | None = key("k, `low_pass` and `lead_lag`", None, names=PARAMETERS, shown_default="`1`")
    time_constant: Value | None = key(
        "T, of the filter; all but `pi`", None, unit="s", names=PARAMETERS, shown_default="required"
    )
    lead: Value | None = key("lead time L, `lead_lag`", None, unit="s", names=PARAMETERS, shown_default="required")
    minimum: Value | None = key("lower limit of the output", None, names=PARAMETERS)
    maximum: Value | None = key("upper limit of the output", None, names=PARAMETERS)
    tracking: Value | None = key(
        "time in which the integral of a limited `pi` or `pid` comes back",
        None,
        unit="s",
        names=PARAMETERS,
        shown_default="kp/ki",
    )
    initial: Value = key("x at the start", 0.0, names=FIXED_PARAMETERS)
    initial_filtered: Value | None = key(
        "f at the start, `pid` and `lead_lag`", None, names=FIXED_PARAMETERS, shown_default="`0`"
    )
    unit: Unit = key("label of the output", "")
    description: Description = key("for tables", "")
