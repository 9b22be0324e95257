"""Outcome: attributes of a ``Solution`` of a run, each evaluated when it is first asked for.

A sweep that reads last states alone so pays for no judgement. The source of every attribute is the run's own: its rows,
its parameters, and the stepper as it was left.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from eomgen.arrays import Array
from eomgen.results.error_estimate import ErrorEstimate
from eomgen.results.finding import Finding
from eomgen.results.solution import Solution
from eomgen.simulation.accuracy.error_estimation import ErrorEstimation
from eomgen.simulation.checkpoint import CheckpointWriter
from eomgen.simulation.judgement.finished_run import Beginning, FinishedRun
from eomgen.simulation.judgement.register import Verdict
from eomgen.simulation.judgement.start_checks import starts_beyond_limits
from eomgen.simulation.run_metadata import run_metadata
from eomgen.simulation.run_model import run_model
from eomgen.simulation.stepping.chunks import Trajectory
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.stepper import Stepper


class Outcome:
    """Attributes of the ``Solution`` of a run, evaluated when they are first asked for.

    Parameters
    ----------
    stepper : as the run left it
    wall : float
        Duration of the stepping, s.
    writer : of checkpoints; None without any
    estimation : of the discretisation error; None without one
    beginning : None for a resumed run
    """

    def __init__(
        self,
        run: Run,
        stepper: Stepper,
        trajectory: Trajectory,
        wall: float,
        writer: CheckpointWriter | None = None,
        estimation: ErrorEstimation | None = None,
        beginning: Beginning | None = None,
    ) -> None:
        checkpoint = _checkpoint(writer, trajectory)
        self._finished = FinishedRun(run, stepper, trajectory, wall, estimation, beginning, checkpoint)
        self._verdict = Verdict(self._finished)

    def solution(self, *, at_once: bool) -> Solution:
        """Return the solution; ``at_once``: with every attribute evaluated."""
        finished = self._finished
        recorded = {
            **finished.states._asdict(),
            "interrupted": finished.trajectory.interrupted,
            "events": finished.events,
            "model": run_model(finished.run, finished.stepper.library, finished.events),
        }
        return Solution.later(recorded, self, at_once=at_once)

    @cached_property
    def outputs(self) -> dict[str, Array]:
        return self._finished.outputs

    @cached_property
    def energy(self) -> dict[str, Array]:
        return self._finished.energy

    @cached_property
    def stats(self) -> dict[str, Any]:
        balance = self._finished.balance
        known = {} if balance.error is None else {"energy_error": balance.error}
        return {**self._finished.statistics, **known, "wall_time": self._finished.wall}

    @cached_property
    def findings(self) -> tuple[Finding, ...]:
        return self._verdict.findings

    @cached_property
    def success(self) -> bool:
        return self._verdict.success

    @cached_property
    def message(self) -> str:
        return self._verdict.message

    @cached_property
    def metadata(self) -> dict[str, Any]:
        finished = self._finished
        run, beginning, events = finished.run, finished.beginning, finished.events
        model = run.model
        notes = [*model.notes, *run.method.warnings(bool(model.multipliers))]
        if beginning is not None:
            of_scene = starts_beyond_limits(model, model.initial_q, model.parameter_array())
            notes = [note for note in notes if note not in of_scene]
            notes += self._notes("start_beyond_limits", "start_on_impact", "chosen_method")
            notes += [*beginning.notes, *self._notes("exchanged_times", "doubtful_call")]
        return {
            **run_metadata(run),
            **({} if events is None else {"events": events.described()}),
            "start": run.begun,
            "corrections": run.corrections,
            "notes": notes,
            "energy_balance": str(finished.balance),
        }

    def _notes(self, *names: str) -> list[str]:
        return [str(finding) for name in names for finding in self._verdict.of(name)]

    @cached_property
    def error(self) -> ErrorEstimate:
        return self._finished.error


def _checkpoint(writer: CheckpointWriter | None, trajectory: Trajectory) -> str:
    """Return a note on the checkpoint of a run; empty if there is none."""
    if writer is None:
        return ""
    return writer.problem or (f"the checkpoint {writer.path} holds its last state" if trajectory.interrupted else "")
