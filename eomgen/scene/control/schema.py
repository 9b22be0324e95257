"""Schema of internal states, controllers and state feedback, and of the calibration of gains."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from eomgen.scene.formula.scope import FIXED_PARAMETERS, PARAMETERS, STATE
from eomgen.scene.reading.keys import Table, key
from eomgen.scene.reading.kinds import Description, Finite, NumberPair, Numbers, Unit, Value

Names = Annotated[tuple[Annotated[str, Field(max_length=200)], ...], Field(strict=False)]
Modes = Annotated[tuple[Annotated[int, Field(ge=1, le=100_000)], ...], Field(strict=False)]
Poles = Annotated[tuple[NumberPair, ...], Field(strict=False)]
_BY_JOINT = "table of numbers by joint"


class Calibration(Table):
    """How the gains of a state feedback are found, from the linear model of the scene with these gains at zero."""

    method: Literal["lqr", "imsc", "pole_placement"] = key("which of the methods below")
    at: Literal["equilibrium", "initial"] = key(
        "where the model is linearised: at the equilibrium next to the initial state, stable or not; or at the initial"
        " state, which has to be in balance or in steady motion",
        "equilibrium",
    )
    position_weights: dict[str, Finite] | None = key(
        "`lqr`: cost of q² by joint, from its value there on", None, refers="joints", kind=_BY_JOINT
    )
    velocity_weights: dict[str, Finite] | None = key("`lqr`: cost of v²", None, refers="joints", kind=_BY_JOINT)
    signal_weights: dict[str, Finite] | None = key(
        "`lqr`: cost of the squares of the controller's `signals`", None, kind="table of numbers by signal"
    )
    output_weights: dict[str, Finite] | None = key(
        "`lqr`: cost of the squares of named outputs, accelerations among them",
        None,
        refers="outputs",
        kind="table of numbers by output",
    )
    effort_weights: Numbers | None = key(
        "`lqr`: cost of the squares of what the controller gives; `imsc`: R of modal forces",
        None,
        kind="number, or list of them",
    )
    modes: Modes | None = key(
        "`imsc` and `pole_placement`: which modes are fed back, slow ones first, from 1",
        None,
        kind="list of whole numbers",
        shown_default="as many as outputs",
    )
    frequencies: Numbers | None = key(
        "`pole_placement`: w_d of these modes",
        None,
        unit="rad/s",
        kind="list of numbers, rad/s",
        shown_default="those of the model",
    )
    damping_ratios: Numbers | None = key(
        "`pole_placement`: zeta_d of these modes", None, kind="number, or list of them"
    )
    poles: Poles | None = key(
        "`pole_placement`: all eigenvalues of the closed loop, in place of `modes`, [real, imaginary], 1/s",
        None,
        kind="list of pairs of numbers",
    )


class Controller(Table):
    """A controller, filter or actuator; its output is called by its name."""

    type: Literal["pi", "pid", "low_pass", "lead_lag", "state_feedback", "skyhook"] = key(
        "which of the equations below", kind="see below"
    )
    signal: Value | None = key(
        "e, what goes in", None, names=STATE, shown_default="required, but for `state_feedback` and `skyhook`"
    )
    proportional: Value | None = key("kp, `pi` and `pid`", None, names=PARAMETERS, shown_default="`0`")
    integral: Value | None = key("ki, `pi` and `pid`", None, names=PARAMETERS, shown_default="`0`")
    derivative: Value | None = key("kd, `pid`", None, names=PARAMETERS, shown_default="`0`")
    gain: Value | None = key("k, `low_pass` and `lead_lag`", None, names=PARAMETERS, shown_default="`1`")
    time_constant: Value | None = key(
        "T, of the filter; `pid`, `low_pass` and `lead_lag`", None, unit="s", names=PARAMETERS, shown_default="required"
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
    outputs: Names | None = key(
        "`state_feedback`: what it gives, `NAME_front` for `front`",
        None,
        kind="list of names",
        shown_default="one, called `NAME`",
    )
    coordinates: Names | None = key(
        "`state_feedback`: joints of one coordinate whose q and v are fed back",
        None,
        refers="joints",
        kind="list of joints",
    )
    signals: dict[str, Value] | None = key(
        "`state_feedback`: further quantities that are fed back", None, names=STATE, kind="table of values of the state"
    )
    position_references: dict[str, Value] | None = key(
        "`state_feedback`: what is taken off a coordinate",
        None,
        names=STATE,
        refers="joints",
        kind="table of values of the state, by joint",
        shown_default="its value where it is calibrated, or `0`",
    )
    signal_references: dict[str, Value] | None = key(
        "the same of `signals`",
        None,
        names=STATE,
        kind="table of values of the state, by signal",
        shown_default="its value where it is calibrated, or `0`",
    )
    position_gains: dict[str, Numbers] | None = key(
        "`state_feedback`: one for each output",
        None,
        refers="joints",
        kind=_BY_JOINT,
        shown_default="`0`, or calibrated",
    )
    velocity_gains: dict[str, Numbers] | None = key(
        "the same of velocities", None, refers="joints", kind=_BY_JOINT, shown_default="`0`, or calibrated"
    )
    signal_gains: dict[str, Numbers] | None = key(
        "the same of `signals`", None, kind="table of numbers by signal", shown_default="`0`, or calibrated"
    )
    calibration: Calibration | None = key("`state_feedback`: how gains are found", None, kind="table, below")
    spring: str | None = key(
        "`skyhook`: between whose points it acts", None, refers="springs", shown_default="required"
    )
    damping: Value | None = key(
        "`skyhook`: c, of the spring's second point against the world",
        None,
        unit="N s/m",
        names=PARAMETERS,
        shown_default="`0`",
    )
    groundhook: Value | None = key(
        "`skyhook`: c_g, of its first point against the world",
        None,
        unit="N s/m",
        names=PARAMETERS,
        shown_default="`0`",
    )
    clipped: bool | None = key("`skyhook`: only what a damper can do", None, shown_default="`false`")
    minimum_damping: Value | None = key(
        "of a clipped `skyhook`: the softest damper", None, unit="N s/m", names=PARAMETERS, shown_default="`0`"
    )
    maximum_damping: Value | None = key(
        "of a clipped `skyhook`: the hardest damper", None, unit="N s/m", names=PARAMETERS, shown_default="required"
    )
    width: Value | None = key(
        "of a clipped `skyhook`: rate over which corners are rounded",
        None,
        unit="m/s",
        names=PARAMETERS,
        shown_default="sharp corners",
    )
    unit: Unit = key("label of the output", "")
    description: Description = key("for tables", "")
