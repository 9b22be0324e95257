"""Checks of accuracy: halved steps, stated errors, the balance of energy, constraints.

Findings of several of these checks form one sentence, with the hint of the last one.
"""

from __future__ import annotations

from collections.abc import Iterator

from eomgen.base.limits import Limit
from eomgen.base.messages import listed
from eomgen.results.error_estimate import AIM, NOTICED, ErrorEstimate, LargestError
from eomgen.results.finding import FAILURE, Finding
from eomgen.simulation.judgement.failures import FAULTS
from eomgen.simulation.judgement.finished_run import ANY_FAILURE, Check, FinishedRun
from eomgen.simulation.judgement.invariants import (
    FAILED_ENERGY,
    REPORTED_ENERGY,
    REPORTED_VIOLATION,
)
from eomgen.simulation.judgement.invariants import FAILED_VIOLATION as BROKEN

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
FEW_QUANTA = Limit(
    6.0,
    "1",
    "estimated error of a rounded state in quanta",
    "runs differ by up to 2 quanta, estimates are up to twice a difference, errors up to 1.5 times an estimate",
)


def _halved_steps(run: FinishedRun) -> Iterator[Finding]:
    if halvings := _halvings(run):
        text = f"the step was halved {halvings} time{'s' * (halvings != 1)}"
        yield Finding(value=float(halvings), text=text, hint=remedy(run))


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
    yield Finding(value=largest.share, time=largest.time, text=text, hint=remedy_of_error(run))


def noticed_error(error: ErrorEstimate) -> LargestError | None:
    """Return the estimated error to report: of coordinates, else of outputs, else of velocities. None if all errors are
    small and shrink with the step."""
    output, velocity = error.largest_output, error.largest_velocity
    if error.largest is not None and error.relative > DOUBTFUL_ERROR:
        return error.largest
    if output is not None and output.share > DOUBTFUL_ERROR:
        return output
    if error.largest is not None and error.unordered:
        return error.largest if error.relative > NOTICED or output is None else output
    return velocity if velocity is not None and velocity.share > WRONG_VELOCITY else None


def remedy_of_error(run: FinishedRun) -> str:
    """Return the hint of a run whose estimated error is large."""
    if rounded := _rounded_states(run):
        fixed = f"none, if the hardware has the quantum of {listed(rounded)}: compared runs differ by quanta, which is"
        return f"{fixed} no error of the run; no smaller step helps"
    largest = noticed_error(run.error)
    return (_refinement(run, largest) if largest is not None else "") or remedy(run)


def _rounded_states(run: FinishedRun) -> list[str]:
    """Return the names of sampled states whose estimated error is only a few of their quanta, which means rounding."""
    z, names = run.error.z, list(run.run.model.z_names)
    sampled = [state for state in run.run.model.description.states if state.sampling and state.sampling.quantum]
    return [
        state.name
        for state in sampled
        if state.sampling and 0.0 < z[names.index(f"z.{state.name}")] < FEW_QUANTA * state.sampling.quantum
    ]


def _refinement(run: FinishedRun, largest: LargestError) -> str:
    """Return a hint with the step that makes an estimated error small, by the order of the method. Empty if other
    remedies apply: rounding, adaptive steps, a small error, or halved steps. If the errors do not follow the order, the
    hint names no exact step."""
    error, step = run.error, run.longest_part
    share = max(error.relative, largest.share if largest is error.largest_output else 0.0)
    if rounds(run) or run.run.method.chooses_steps or not share > AIM or _halvings(run):
        return ""
    if error.unordered or share > 0.5:  # larger errors do not follow powers of the step
        end = error.above(min(LARGE_ERROR, error.relative / 2.0))
        earlier = f", or a run to t = {end:.6g} s" if largest is error.largest else ""
        tenth = f"of {step / 10.0:.2g} s or less (half the step does not help)"
        return f"a step {tenth if error.unordered else f'much smaller than {step:.3g} s'}{earlier}"
    return f"a step smaller than {step * error.refinement(AIM, share):.2g} s"


def _energy_balance(run: FinishedRun) -> Iterator[Finding]:
    error = run.balance.error
    if error is not None and error > REPORTED_ENERGY:
        text = f"the energy is out of balance by {100.0 * error:.3g} % of the energies at work"
        yield Finding(value=error, text=text, hint=remedy(run))


def _energy_gained(run: FinishedRun) -> bool:
    told = run.conservative or not run.rows_are_sparse  # rows may miss pulses of power
    return run.balance.gain > FAILED_ENERGY and told


def _constraint_violation(run: FinishedRun) -> Iterator[Finding]:
    violation = run.violation
    if violation is not None and violation.share <= BROKEN:
        yield Finding(value=violation.share, time=violation.time, text=violation.text, hint=remedy(run))


def rounds(run: FinishedRun) -> bool:
    """Return whether errors are mostly rounding of single precision, of which smaller steps have more."""
    return run.single and run.error.unordered


def remedy(run: FinishedRun) -> str:
    """Return the hint for a doubtful run whose cause is unknown: double precision, a smaller step, or a smaller
    tolerance."""
    if rounds(run):
        return f"double precision; rounding grows where steps are smaller than {run.longest_part:.3g} s"
    if not run.run.method.chooses_steps:
        return f"a step smaller than {run.longest_part:.3g} s"
    settings = run.settings
    events = f", or a step smaller than {settings['step']:.3g} s, in each of which events are looked for"
    return f"a tolerance smaller than {settings['tolerance']:.3g}{events if run.has(('events',)) else ''}"


def _unknown_error(run: FinishedRun) -> Iterator[Finding]:
    if run.error.remedy:
        yield Finding(text=f"the discretisation error is not known: {run.error.reason}", hint=run.error.remedy)


ROWS = (
    Check("halved_steps [W0214]", _halved_steps, unless=FAULTS, continues=", and "),
    Check(
        "discretisation_error [W0215]",
        _discretisation_error,
        unless=FAULTS,
        continues=", and ",
        limits=(LARGE_ERROR, DOUBTFUL_ERROR, WRONG_VELOCITY, FEW_QUANTA),
    ),
    Check(
        "energy_balance [W0217]",
        _energy_balance,
        severity=FAILURE,
        fails=_energy_gained,
        unless=FAULTS,
        continues=", and ",
        limits=(REPORTED_ENERGY, FAILED_ENERGY),
    ),
    Check(
        "constraint_violation [W0219]",
        _constraint_violation,
        unless=FAULTS,
        continues=", and ",
        limits=(REPORTED_VIOLATION, BROKEN),
    ),
)
UNKNOWN_ERROR = Check("unknown_error [W0226]", _unknown_error, unless=(ANY_FAILURE,))
