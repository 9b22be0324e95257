"""Checks of accuracy: halved steps, discretisation error, kept quantities, rounding; and the cause of large errors.

Findings of several of these checks form one sentence, with the hint of the last one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from eomgen.analysis.state_warnings import linear_range_exceeded
from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.base.messages import listed
from eomgen.results.error_estimate import NOTICED, ErrorEstimate, LargestError
from eomgen.results.finding import FAILURE, Finding
from eomgen.simulation.accuracy.motion_size import REST
from eomgen.simulation.judgement.failures import FAULTS
from eomgen.simulation.judgement.finished_run import Check, FinishedRun
from eomgen.simulation.judgement.invariants import (
    FAILED_ENERGY,
    REPORTED_ENERGY,
    REPORTED_MOMENTUM,
    REPORTED_VIOLATION,
    momentum_drift,
)
from eomgen.simulation.judgement.invariants import FAILED_VIOLATION as BROKEN
from eomgen.simulation.judgement.singular_positions import nearest_singular, way_through

LARGE_ERROR = Limit(0.1, "1", "error in parts of the motion", "a tenth of a motion is seen in a plot")
DOUBTFUL_ERROR = Limit(
    LARGE_ERROR / 1.5, "1", "estimated error in parts of the motion", "errors are up to 1.5 times their estimate"
)
WRONG_VELOCITY = Limit(
    0.3,
    "1",
    "estimated error of a velocity in parts of the largest velocity, for a beam of its own largest velocity",
    "over one step, velocities are some three times less accurate than coordinates",
)
#: Error target of hints, and largest error that follows powers of the step, relative to the motion.
AIM, FOLLOWED = 0.01, 0.5
FEW_QUANTA = Limit(
    6.0,
    "1",
    "estimated error of a rounded state in quanta",
    "runs differ by up to 2 quanta, estimates are up to twice a difference, errors up to 1.5 times an estimate",
)
#: Least motion in parts of its reach in double precision, and in single precision.
FINEST = (REST, 1e3 * float(np.finfo(np.float32).eps))
#: The method whose multipliers have the least rounding.
ROUNDING_LEAST = "generalized_alpha"
ROUNDED = Limit(0.01, "1", "rounding in parts of the multipliers", "a choice: the error at which hints aim")


def _halved_steps(run: FinishedRun) -> Iterator[Finding]:
    if halvings := _halvings(run):
        text = f"the step was halved {halvings} time{'s' * (halvings != 1)}"
        yield Finding(value=float(halvings), text=text, hint=_remedy(run))


def _halvings(run: FinishedRun) -> int:
    """Return the number of halved steps; 0 if the error is known to be small."""
    halvings = int(run.statistics.get("halvings", 0))
    return halvings if halvings and not run.error.relative < AIM else 0


def _discretisation_error(run: FinishedRun) -> Iterator[Finding]:
    error = run.error
    largest = noticed_error(error)
    if largest is None:
        return
    since = ""
    if error.relative > LARGE_ERROR:
        since = f", above {100.0 * LARGE_ERROR:.0f} % from t = {error.above(LARGE_ERROR):.6g} s on"
    unordered = ", and no less at half the step" if error.unordered else ""
    text = f"the estimated error is {largest}{since}{unordered}"
    yield Finding(value=largest.share, time=largest.time, text=text, hint=_remedy_of_error(run))


def noticed_error(error: ErrorEstimate) -> LargestError | None:
    """Return the estimated error to report, of coordinates before outputs and velocities; None if errors are small, and
    shrink with the step."""
    output, velocity = error.largest_output, error.largest_velocity
    if error.largest is not None and error.relative > DOUBTFUL_ERROR:
        return error.largest
    if output is not None and output.share > DOUBTFUL_ERROR:
        return output
    if error.largest is not None and error.unordered:
        return error.largest if error.relative > NOTICED or output is None else output
    return velocity if velocity is not None and velocity.share > WRONG_VELOCITY else None


def _remedy_of_error(run: FinishedRun) -> str:
    """Return the hint of a run whose estimated error is large."""
    if rounded := _rounded_states(run):
        fixed = f"none, if the hardware has the quantum of {listed(rounded)}: compared runs differ by quanta, which is"
        return f"{fixed} no error of the run; no smaller step helps"
    largest = noticed_error(run.error)
    return (_refinement(run, largest) if largest is not None else "") or _remedy(run)


def _rounded_states(run: FinishedRun) -> list[str]:
    """Return the sampled states whose values in compared runs differ by whole quanta, and by few: by rounding."""
    z, names = run.error.z, list(run.run.model.z_names)
    sampled = [state for state in run.run.model.description.states if state.sampling and state.sampling.quantum]
    return [
        state.name
        for state in sampled
        if state.sampling and 0.0 < z[names.index(f"z.{state.name}")] < FEW_QUANTA * state.sampling.quantum
    ]


def _refinement(run: FinishedRun, largest: LargestError) -> str:
    """Return the step that makes a large error small, by the order of the method; empty if other remedies apply."""
    error, step = run.error, run.longest_part
    share = max(error.relative, largest.share if largest is error.largest_output else 0.0)
    if _rounds(run) or run.run.method.chooses_steps or not share > AIM or _halvings(run):
        return ""
    if error.unordered or share > FOLLOWED:
        end = error.above(min(LARGE_ERROR, error.relative / 2.0))
        earlier = f", or a run to t = {end:.6g} s" if largest is error.largest else ""
        return f"a step much smaller than {step:.3g} s{earlier}"
    return f"a step smaller than {step * error.refinement(AIM, share):.2g} s"


class UnresolvedComponent(NamedTuple):
    """A coordinate or internal state with a large error in parts of its motion; the unit begins with a space."""

    name: str
    travel: float
    error: float
    unit: str


def _unresolved_coordinate(run: FinishedRun) -> Iterator[Finding]:
    unresolved = unresolved_coordinates(run)
    if not unresolved:
        return
    name, travel, error, unit = max(unresolved, key=lambda one: one.error / one.travel)
    more = f" (and {len(unresolved) - 1} more)" if len(unresolved) > 1 else ""
    size = f"its motion of {travel:.2g}{unit} has an estimated error of {error:.2g}{unit}"
    text = f"{name}{more} is not resolved: {size}"
    yield Finding(value=error / travel, text=text, hint=_remedy_of_error(run))


def unresolved_coordinates(run: FinishedRun) -> list[UnresolvedComponent]:
    """Return coordinates of joints and internal states with a motion that is relatively small, and a large estimated
    error in parts of this motion.

    Motion below a billionth of the reach of the coordinate, ``run.reach``, is rounding.
    """
    if not run.error.available:
        return []
    result = _hidden(run, run.states.q, run.states.z)
    return _hidden(run, *run.between_rows) if result and run.rows_are_sparse else result


def _hidden(run: FinishedRun, q: Array, z: Array) -> list[UnresolvedComponent]:
    """Return the coordinates and internal states with large errors in parts of the motions of q, (n, nq), and z,
    (n, nz)."""
    model, error = run.run.model, run.error
    reported = noticed_error(error)
    part = FINEST[run.single]
    q_travel, z_travel = (np.ptp(values, axis=0).tolist() for values in (q, z))
    errors, of_states = error.increment.tolist(), error.z.tolist()
    axes = [(factor.q_start, factor.v_start) for factor in model.factors if factor.group == "R"]
    known = [(model.q_names[k], q_travel[k], errors[j], model.q_units[k], j) for k, j in axes]
    known += zip(model.z_names, z_travel, of_states, model.z_units, range(-len(of_states), 0), strict=True)
    large = [
        one for one in known if one[2] > DOUBTFUL_ERROR * one[1] > 0.0 and (reported is None or one[0] != reported.name)
    ]
    if not large:
        return []
    reach = np.concatenate([run.reach, np.abs(z).max(axis=0)])
    return [
        UnresolvedComponent(name, travel, by, "" if unit in ("", "1") else f" {unit}")
        for name, travel, by, unit, place in large
        if travel > part * reach[place]
    ]


def _energy_balance(run: FinishedRun) -> Iterator[Finding]:
    error = run.balance.error
    if error is not None and error > REPORTED_ENERGY:
        text = f"the energy is out of balance by {100.0 * error:.3g} % of the energies at work"
        yield Finding(value=error, text=text, hint=_remedy(run))


def _energy_gained(run: FinishedRun) -> bool:
    return run.balance.gain > FAILED_ENERGY and (
        run.conservative or not run.rows_are_sparse
    )  # rows may miss pulses of power


def _momentum_drift(run: FinishedRun) -> Iterator[Finding]:
    if len(run.changes):
        return
    inputs = run.run.signals if run.run.takes_rows else None
    t, q, v, _, multipliers, z = run.states
    drift = momentum_drift(run.run.model, (t, q, v, z), run.run.parameters, inputs, multipliers)
    if drift is not None and not run.at_rest:
        yield Finding(value=drift.share, text=str(drift), hint=_remedy(run))


def _constraint_violation(run: FinishedRun) -> Iterator[Finding]:
    violation = run.violation
    if violation is not None and violation.share <= BROKEN:
        yield Finding(value=violation.share, time=violation.time, text=violation.text, hint=_remedy(run))


def _multiplier_rounding(run: FinishedRun) -> Iterator[Finding]:
    if (share := _rounding(run)) > ROUNDED:
        other = "" if run.run.name == ROUNDING_LEAST else f"{ROUNDING_LEAST}, "
        double = ", or double precision" if run.single else ""
        text = f"up to {100.0 * share:.2g} % of the multipliers is rounding, which grows as 1/step^2"
        yield Finding(value=share, text=text, hint=f"{other}a step larger than {run.longest_part:.3g} s{double}")


def _rounding(run: FinishedRun) -> float:
    """Return the part of the multipliers that is rounding; 0 if all multipliers are zero, or if corrections of Newton's
    method do not shrink because a step passes over a law."""
    share = float(run.statistics.get("max_rounding", 0.0)) if run.states.multipliers.any() else 0.0
    return 0.0 if share > ROUNDED and passes_growth(run) else share


STEP_OF_GROWTH = Limit(
    1.0,
    "1",
    "step times the fastest rate at which a law of velocities makes motion grow",
    "implicit steps have a pole at 2 at most, beyond which growth turns into decay: Hairer, Wanner, Solving Ordinary"
    " Differential Equations II (1996), IV.3",
)


def passes_growth(run: FinishedRun) -> bool:
    """Return whether the steps of a run pass over a law that makes motion grow."""
    return not run.run.method.chooses_steps and run.settings["step"] * run.fastest.growth.rate > STEP_OF_GROWTH


def _rounds(run: FinishedRun) -> bool:
    """Return whether errors are mostly rounding of single precision, of which smaller steps have more."""
    return run.single and run.error.unordered


def _remedy(run: FinishedRun) -> str:
    """Return the hint of a doubtful run whose cause is not known."""
    if _rounds(run):
        return f"double precision; rounding grows where steps are smaller than {run.longest_part:.3g} s"
    if not run.run.method.chooses_steps:
        return f"a step smaller than {run.longest_part:.3g} s"
    settings = run.settings
    events = f", or a step smaller than {settings['step']:.3g} s, in each of which events are looked for"
    return f"a tolerance smaller than {settings['tolerance']:.3g}{events if run.has(('events',)) else ''}"


def _linear_range(run: FinishedRun) -> Iterator[Finding]:
    sentence = linear_range_exceeded(run.run.model, run.states.t, run.states.q, run.run.parameters)
    if sentence and not _rounds(run):
        yield Finding.of(sentence)


def _singular_position(run: FinishedRun) -> Iterator[Finding]:
    if _rounds(run):
        return
    singular = nearest_singular(run.run.model, run.states.t, run.states.q, run.run.parameters)
    if singular is not None:
        hint = way_through(run.run.method, run.settings["step"])
        yield Finding(value=singular.part, time=singular.time, text=singular.text, hint=hint)


_DOUBTS = (
    Check("halved_steps", _halved_steps, unless=FAULTS, continues=", and "),
    Check(
        "discretisation_error",
        _discretisation_error,
        unless=FAULTS,
        continues=", and ",
        limits=(LARGE_ERROR, DOUBTFUL_ERROR, WRONG_VELOCITY, FEW_QUANTA),
    ),
    Check("unresolved_coordinate", _unresolved_coordinate, unless=FAULTS, continues=", and ", limits=(DOUBTFUL_ERROR,)),
    Check(
        "energy_balance",
        _energy_balance,
        severity=FAILURE,
        fails=_energy_gained,
        unless=FAULTS,
        continues=", and ",
        limits=(REPORTED_ENERGY, FAILED_ENERGY),
    ),
    Check("momentum_drift", _momentum_drift, unless=FAULTS, continues=", and ", limits=(REPORTED_MOMENTUM,)),
    Check(
        "constraint_violation",
        _constraint_violation,
        unless=FAULTS,
        continues=", and ",
        limits=(REPORTED_VIOLATION, BROKEN),
    ),
    Check(
        "multiplier_rounding",
        _multiplier_rounding,
        ("complete", "constraints"),
        unless=FAULTS,
        continues=", and ",
        limits=(ROUNDED,),
    ),
)
_FOUND = tuple(check.name for check in _DOUBTS)
ROWS = (
    *_DOUBTS,
    Check("linear_range", _linear_range, unless=("multiplier_rounding",), after=_FOUND, continues="; "),
    Check(
        "singular_position",
        _singular_position,
        ("complete", "constraints", "fixed steps"),
        unless=("multiplier_rounding", "linear_range"),
        after=_FOUND,
        continues="; ",
    ),
)
