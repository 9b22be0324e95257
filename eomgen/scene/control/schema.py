"""Schema of internal states, controllers, state feedback with calibrated gains, and reference motions."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from eomgen.scene.formula.scope import FIXED_PARAMETERS, SPRING_FORCE, STATE
from eomgen.scene.reading.key_metadata import ANY_UNIT, Table, key, of_fixed_parameters, of_parameters, optional
from eomgen.scene.reading.kinds import Description, Finite, NumberPair, Numbers, Unit, Value

Names = Annotated[tuple[Annotated[str, Field(max_length=200)], ...], Field(strict=False)]
Modes = Annotated[tuple[Annotated[int, Field(ge=1, le=100_000)], ...], Field(strict=False)]
Poles = Annotated[tuple[NumberPair, ...], Field(strict=False)]
_BY_JOINT = "table of numbers by joint"


class CalibrationEntry(Table):
    """How the gains of a state feedback are found, from the linear model of the scene with these gains at zero."""

    method: Literal["lqr", "imsc", "pole_placement"] = key("one of the methods below")
    at: Literal["equilibrium", "initial"] = key(
        "state of the linearisation: the equilibrium next to the initial state, stable or not; or the initial"
        " state, which has to be in balance or in steady motion",
        "equilibrium",
    )
    position_weights: dict[str, Finite] | None = optional(
        "`lqr`: cost of q² by joint, from its value there on", refers="joints", kind=_BY_JOINT
    )
    velocity_weights: dict[str, Finite] | None = optional("`lqr`: cost of v²", refers="joints", kind=_BY_JOINT)
    signal_weights: dict[str, Finite] | None = optional(
        "`lqr`: cost of the squares of the controller's `signals`", kind="table of numbers by signal"
    )
    output_weights: dict[str, Finite] | None = optional(
        "`lqr`: cost of the squares of named outputs, accelerations among them",
        refers="outputs",
        kind="table of numbers by output",
    )
    effort_weights: Numbers | None = optional(
        "`lqr`: cost of the squares of the outputs; `imsc`: R of modal forces",
        kind="number, or list of them",
    )
    modes: Modes | None = optional(
        "`imsc` and `pole_placement`: modes that are fed back, slow ones first, from 1",
        kind="list of whole numbers",
        shown_default="as many as outputs",
    )
    frequencies: Numbers | None = optional(
        "`pole_placement`: w_d of these modes",
        unit="rad/s",
        kind="list of numbers, rad/s",
        shown_default="the model's",
    )
    damping_ratios: Numbers | None = optional("`pole_placement`: zeta_d of these modes", kind="number, or list of them")
    poles: Poles | None = optional(
        "`pole_placement`: all eigenvalues of the closed loop, in place of `modes`, [real, imaginary], 1/s",
        kind="list of pairs of numbers",
    )


class ControllerEntry(Table):
    """A controller, filter or actuator; its output is called by its name."""

    type: Literal["pi", "pid", "low_pass", "lead_lag", "state_feedback", "skyhook", "sampled"] = key(
        "kind of controller, one of the equations below", kind="see below"
    )
    signal: Value | None = optional(
        "e, its input", names=STATE, shown_default="required, but for `state_feedback`, `skyhook` and `sampled`"
    )
    proportional: Value | None = of_parameters("kp, `pi` and `pid`", shown_default="`0`")
    integral: Value | None = of_parameters("ki, `pi` and `pid`", shown_default="`0`")
    derivative: Value | None = of_parameters("kd, `pid`", shown_default="`0`")
    gain: Value | None = of_parameters("k, `low_pass` and `lead_lag`", shown_default="`1`")
    time_constant: Value | None = of_parameters("T; `pid`, `low_pass`, `lead_lag`", unit="s", shown_default="required")
    lead: Value | None = of_parameters("lead time L, `lead_lag`", unit="s", shown_default="required")
    minimum: Value | None = of_parameters("lower limit of the output")
    maximum: Value | None = of_parameters("upper limit of the output")
    tracking: Value | None = of_parameters("time in which a limited integral returns", unit="s", shown_default="kp/ki")
    initial: Value = key("x at the start", 0.0, names=FIXED_PARAMETERS)
    initial_filtered: Value | None = of_fixed_parameters("f at the start, `pid` and `lead_lag`", shown_default="`0`")
    outputs: Names | None = optional(
        "`state_feedback` and `sampled`: its outputs, `NAME_front` for `front`",
        kind="list of names",
        shown_default="one, called `NAME`",
    )
    coordinates: Names | None = optional(
        "`state_feedback`: joints of one coordinate whose q and v are fed back", refers="joints", kind="list of joints"
    )
    signals: dict[str, Value] | None = optional(
        "`state_feedback`: further quantities that are fed back; `sampled`: arguments of its function",
        names=STATE,
        kind="table of values of the state",
    )
    position_references: dict[str, Value] | None = optional(
        "`state_feedback`: reference, subtracted from a coordinate",
        names=STATE,
        refers="joints",
        kind="table of values of the state, by joint",
        shown_default="its calibrated value, or `0`",
    )
    signal_references: dict[str, Value] | None = optional(
        "`state_feedback`: reference, subtracted from a signal of `signals`",
        names=STATE,
        kind="table of values of the state, by signal",
        shown_default="its calibrated value, or `0`",
    )
    position_gains: dict[str, Numbers] | None = optional(
        "`state_feedback`: gains by each output", refers="joints", kind=_BY_JOINT, shown_default="`0`, or calibrated"
    )
    velocity_gains: dict[str, Numbers] | None = optional(
        "`state_feedback`: gains of velocities", refers="joints", kind=_BY_JOINT, shown_default="`0`, or calibrated"
    )
    signal_gains: dict[str, Numbers] | None = optional(
        "`state_feedback`: gains of `signals`", kind="table of numbers by signal", shown_default="`0`, or calibrated"
    )
    calibration: CalibrationEntry | None = optional("way in which the gains of a `state_feedback` are found")
    spring: str | None = optional("`skyhook`: spring of its two points", refers="springs", shown_default="required")
    damping: Value | None = of_parameters(
        "`skyhook`: c, damping of the spring's second point against the world", unit="N s/m", shown_default="`0`"
    )
    groundhook: Value | None = of_parameters(
        "`skyhook`: c_g, damping of the spring's first point against the world", unit="N s/m", shown_default="`0`"
    )
    clipped: bool | None = optional("`skyhook`: only forces of a damper", shown_default="`false`")
    minimum_damping: Value | None = of_parameters("softest damper if `clipped`", unit="N s/m", shown_default="`0`")
    maximum_damping: Value | None = of_parameters("hardest damper if `clipped`", unit="N s/m", shown_default="required")
    width: Value | None = of_parameters(
        "rate over which the corners of a clipped `skyhook` are rounded", unit="m/s", shown_default="sharp corners"
    )
    sample: Value | None = of_fixed_parameters("`sampled`: time between samples", unit="s", shown_default="required")
    delay: Value | None = of_fixed_parameters("`sampled`: time from sample to effect", unit="s", shown_default="`0`")
    quantum: Value | None = of_fixed_parameters("`sampled`: rounding step", unit=ANY_UNIT, shown_default="not rounded")
    source: Annotated[str, Field(min_length=1, max_length=1000)] | None = optional(
        "`sampled`: C file with its function, path from the folder of the scene file",
        path=True,
        shown_default="none: the caller's",
    )
    function: Annotated[str, Field(min_length=1, max_length=64)] | None = optional(
        "`sampled`: name of the function in `source`", shown_default="required with `source`"
    )
    memory: Annotated[int, Field(ge=0, le=256)] | None = optional(
        "`sampled`: numbers that its function keeps from sample to sample",
        kind="whole number up to 256",
        shown_default="`0` with `source`; else left to the function",
    )
    unit: Unit = key("label of the output", "")
    description: Description = key("text of one line for tables", "")


def _by_joint(description: str) -> Any:
    """Return a key with values of the state by joint."""
    return key(
        description, {}, refers="joints", names=SPRING_FORCE, kind="table of values by joint", shown_default="`{}`"
    )


class ReferenceEntry(Table):
    """Coordinates, velocities and accelerations of joints, in place of the present ones."""

    position: dict[str, Value] = _by_joint("coordinates of joints of one coordinate, rad or m, else the present ones")
    velocity: dict[str, Value] = _by_joint("velocities of such joints, rad/s or m/s; others have the present velocity")
    acceleration: dict[str, Value] = _by_joint("accelerations of such joints, rad/s² or m/s²; others have 0")
