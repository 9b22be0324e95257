"""Rows of families with adaptive steps by an estimate of the local error: settings, statistics, statuses.

Gustafsson, ACM Trans. Math. Softw. 17 (1991) 533, for the control of steps; Hairer, Norsett and Wanner, Solving
Ordinary Differential Equations I, II.4, for the meaning of a tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.family import Field, Setting, Sizes, Status

#: Least and largest tolerance of adaptive steps.
SMALLEST_TOLERANCE, LARGEST_TOLERANCE = 1e-14, 0.1


class StepControl(NamedTuple):
    """Numbers by which adaptive steps are chosen, by the names of the templates; a family may replace some.

    Attributes
    ----------
    safety : part of the step that an error estimate allows which is taken: rejections cost a whole step
    least_growth : growth of a step below which the step stays as it is; 1: no data is kept for one step size
    most_growth, most_reduction : change of a step at most, to the next one and after a rejection
    after_failure : part of its size with which a failed step is repeated
    longest : the longest step, in steps of the time grid: laws shorter than a step may be missed
    most_steps, most_attempts : steps within one row, and attempts at one step, before a run stops: a call of compiled
        code hears no Ctrl-C
    memory : decay of the sizes of the motion: a size fades while the velocity changes by this multiple of the size
    coarse : part of the largest size so far that counts as the size of a smaller motion
    short : a step that is shorter than this part of a usual one is allowed the usual one's error: if forces have a
        corner, errors do not shrink as fast as steps do
    accurate : error of an explicit step, as a part of the motion, up to which the end of the step is used to measure
        the size of the motion
    noisy_growth : growth of a step at most if rounding may be a tenth of the error that is allowed: smaller errors
        cannot be seen
    """

    safety: float = 0.9
    least_growth: float = 1.0
    most_growth: float = 4.0
    most_reduction: float = 0.1
    after_failure: float = 0.25
    longest: float = 64.0
    most_steps: int = 1_000_000
    most_attempts: int = 60
    memory: float = 4.0
    coarse: float = 1e-3
    short: float = 0.05
    accurate: float = 0.01
    noisy_growth: float = 1.125


CONTROL = StepControl()


def check_tolerance(tolerance: float) -> None:
    """Raise UsageError if a tolerance is out of its range."""
    if not (math.isfinite(tolerance) and SMALLEST_TOLERANCE <= tolerance <= LARGEST_TOLERANCE):
        fault = f"the tolerance must lie in {SMALLEST_TOLERANCE:g}..{LARGEST_TOLERANCE:g}, not {tolerance:g} [E0332]"
        raise UsageError(Problem("tolerance", fault, "1e-6"))


def tolerance_setting(tolerance: float) -> Setting:
    """Return the setting ``tolerance`` with this default; the least value in single precision is 1e-5."""
    comment = "tolerance of the local error of a step, relative to the motion within it"
    return Setting("tolerance", tolerance, comment, single=1e-5)


def longest_setting(longest: float) -> Setting:
    """Return the row of a bound on the method's own steps; ``longest``: in steps of the grid, if there is none."""
    return Setting(
        "largest_step",
        0.0,
        f"largest step that the method chooses, s, at most {longest:.0f} steps of the grid; 0: only this bound",
    )


def step_state(sizes: Sizes) -> tuple[Field, ...]:
    """Return the members of a stepper's state by which the size of the next adaptive step is chosen."""
    rates = "sizes of the rates of z, and the largest"
    return (
        Field("own_step", "size of the next adaptive step, s; 0: none yet", group="control", member="step"),
        Field(
            "own_error",
            "error estimate of the last step as a multiple of the tolerance",
            group="control",
            member="error",
        ),
        Field("own_speed", "size of velocities, and the largest so far", 2, group="control", member="speed"),
        Field("own_change", "size of accelerations, and the largest so far", 2, group="control", member="change"),
        *((Field("own_rates", rates, 2 * sizes.z, group="control", member="rates"),) if sizes.z else ()),
    )


STEP_GROUPS: tuple[tuple[str, str], ...] = (("control", "Data for the size of the next adaptive step."),)


def step_statistics() -> tuple[Field, ...]:
    """Return the statistics of adaptive steps as members of the state: counts, extreme steps and estimated errors."""
    return (
        Field("own_steps", "adaptive steps", 0, "long"),
        Field("rejections", "adaptive steps that were repeated with smaller ones", 0, "long"),
        Field("smallest_step", "smallest adaptive step, s"),
        Field("smallest_step_time", "time at the start of the smallest step, s"),
        Field("largest_step", "largest adaptive step, s"),
        Field(
            "hardest",
            "the velocity component, or then the internal state, with the largest error in the smallest step",
            0,
            "long",
        ),
        Field("estimated_error", "sum of the estimates of local errors, relative to the motion"),
    )


def step_statuses() -> tuple[Status, ...]:
    """Return the failures of adaptive steps: a step that is too small, and too many steps within one row."""
    small = "the step became too small for the time to move on: the motion has a singularity near, or forces jump"
    stiff = "the tolerance is too small for this order, or the motion is stiff"
    many = f"{CONTROL.most_steps} steps were not enough for one row: {stiff}"
    return (
        Status(8, "STEP_TOO_SMALL", small, "a tolerance larger than {tolerance:.3g}, or the forces near that time"),
        Status(9, "TOO_MANY_STEPS", many, "a tolerance larger than {tolerance:.3g}, another method, or shorter rows"),
    )


def step_data(order: int, control: StepControl = CONTROL) -> Mapping[str, Any]:
    """Return the data of the templates for the choice of adaptive steps; ``order``: power of the step in the local
    error."""
    return {"own_steps": True, "own_order": order, **control._asdict()}
