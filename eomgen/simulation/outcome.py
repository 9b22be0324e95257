"""Outcome: attributes of a ``Solution`` of a run, each evaluated when it is first asked for.

A sweep that reads last states alone so pays for no judgement. The source of every attribute is the run's own: its rows,
its parameters, and the stepper as it was left.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from eomgen.results.finding import Finding
from eomgen.results.solution import Solution
from eomgen.simulation.judgement.finished_run import FinishedRun
from eomgen.simulation.judgement.register import Verdict
from eomgen.simulation.judgement.start_checks import starts_beyond_limits
from eomgen.simulation.run_metadata import run_metadata
from eomgen.simulation.run_model import run_model
from eomgen.simulation.stepping.states import states_of


class Outcome(FinishedRun):
    """A finished run with its verdict: attributes of its ``Solution``, evaluated when they are first asked for."""

    def solution(self, *, at_once: bool) -> Solution:
        """Return the solution; ``at_once``: with every attribute evaluated."""
        recorded = {
            **states_of(self.trajectory.rows, self.run.model)._asdict(),
            "interrupted": self.trajectory.interrupted,
            "events": self.events,
            "model": run_model(self.run, self.stepper.library, self.events),
        }
        return Solution.later(recorded, self, at_once=at_once)

    @cached_property
    def _verdict(self) -> Verdict:
        return Verdict(self)

    @cached_property
    def stats(self) -> dict[str, Any]:
        known = {} if self.balance.error is None else {"energy_error": self.balance.error}
        return {**self.statistics, **known, "wall_time": self.wall}

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
        run, beginning, events = self.run, self.beginning, self.events
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
            "energy_balance": str(self.balance),
        }

    def _notes(self, *names: str) -> list[str]:
        return [str(finding) for name in names for finding in self._verdict.of(name)]
