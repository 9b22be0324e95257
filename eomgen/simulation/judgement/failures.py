"""Checks of the end of a run: early stops, and motions that do not follow the equations."""

from __future__ import annotations

from collections.abc import Iterator

from eomgen.results.finding import FAILURE, NOTE, Finding
from eomgen.simulation.judgement.check import Check
from eomgen.simulation.judgement.constraint_violation import FAILED
from eomgen.simulation.judgement.diagnosis import instability
from eomgen.simulation.judgement.end_message import message_of
from eomgen.simulation.judgement.finished_run import FinishedRun


def end_of(run: FinishedRun) -> str:
    """Return the sentence on the end of a run."""
    return message_of(run.last_run, run.stepper, run.trajectory, run.events)


def _stopped(run: FinishedRun) -> Iterator[Finding]:
    if not run.complete:
        yield Finding.of(end_of(run), time=run.trajectory.rows[-1, 0])


def _checkpoint(run: FinishedRun) -> Iterator[Finding]:
    yield Finding.of(run.checkpoint)


def _unstable(run: FinishedRun) -> Iterator[Finding]:
    growth = run.growth
    if growth is None:
        return
    totals = run.energy.get("total")
    energies = "" if totals is None else f", and the total energy from {totals[0]:.3g} to {totals[-1]:.3g} J"
    fault, hint = instability(growth, run.run.method)
    yield Finding(value=growth.after, time=growth.end, text=f"{fault}{energies}", hint=hint)


def _infinite_energy(run: FinishedRun) -> Iterator[Finding]:
    if (time := run.balance.infinite) is not None:
        text = f"the energy is beyond the finite numbers from t = {time:.6g} s on"
        yield Finding(time=time, text=text, hint="other initial velocities, forces or units")


def _broken_constraint(run: FinishedRun) -> Iterator[Finding]:
    violation = run.violation
    if violation is not None and violation.share > FAILED:
        text = f"{violation.text}, more than {FAILED:g} of the size of the machine, or rad"
        yield Finding(value=violation.share, time=violation.time, text=text, hint="a smaller step")


ROWS = (
    Check("stopped", _stopped, needs=(), severity=FAILURE),
    Check("checkpoint", _checkpoint, needs=("checkpoint",), severity=NOTE),
    Check("unstable", _unstable, needs=("complete", "fixed steps"), severity=FAILURE),
    Check("infinite_energy", _infinite_energy, severity=FAILURE, unless=("unstable",)),
    Check("broken_constraint", _broken_constraint, severity=FAILURE, unless=("unstable", "infinite_energy")),
)
#: Failures of runs that reached their end without following the equations.
FAULTS = ("unstable", "infinite_energy", "broken_constraint")
