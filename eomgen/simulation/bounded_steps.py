"""Runs with bounded steps, after a run whose adaptive steps pass over a law of time."""

from __future__ import annotations

from eomgen.base.data import replace
from eomgen.base.messages import Log
from eomgen.simulation.execution import CostlyRunError, Execution, own_steps
from eomgen.simulation.judgement.finished_run import RunStart
from eomgen.simulation.outcome import JudgedRun

_LOG = Log(__name__)
#: Steps of a run with a bound, as a multiple of the expected ones, at which the run is given up.
_GIVEN_UP = 4.0


def bound_steps(outcome: JudgedRun, execution: Execution, beginning: RunStart) -> JudgedRun:
    """Return the outcome of the run repeated with a largest step, if adaptive steps pass over a law of time.

    The run itself is returned if no law is passed over, or if runs with bounds would take too many steps. Up to three
    smaller bounds are tried; a bound at which the run fails is left, with a hint in the finding. Checkpoints of the
    repeated run replace the checkpoints of the first run.

    Parameters
    ----------
    outcome : of the first run
    execution : by which the run is repeated
    beginning : start of the run
    """
    run, taken = outcome.run, own_steps(outcome.statistics)
    # about a second: steps are counted, not seconds, so that the same run is bounded on every machine
    short = 1e5 / max(1, run.model.nv + run.model.nz)
    if taken > short:  # then the examination, which repeats the run, takes long as well
        return outcome
    left = max(30.0 * taken, short)  # steps of all runs with a bound: users wait for so many without asking
    try:
        # the first bound is of the width along a path that the law has not changed
        for _ in range(3):
            law = outcome.passed_over if outcome.has(("complete", "two rows")) else None
            if law is None or not law.step:
                break
            known = outcome.run.settings["largest_step"]
            bound = min(law.step, 0.5 * known) if known else law.step
            steps = (run.grid.reached - run.grid.start) / bound
            left -= steps
            if left <= 0.0:
                break
            _LOG.info("%s: steps of at most %.3g s, for %s", run.model.name, bound, law.law)
            settings = {**run.settings, "largest_step": bound}
            bounded_run = replace(run, settings=settings, bounded_for=law.law)
            try:
                # steps become tiny at a jump that holds the motion
                bounded = execution.outcome(bounded_run, beginning, _GIVEN_UP * (steps + taken))
            except CostlyRunError:
                outcome = _with_checkpoints(outcome, execution, beginning)
                break
            if not (bounded.complete or bounded.trajectory.interrupted):  # at a jump that no step is small enough for
                reason = f"with largest_step = {bound:.2g} it fails at t = {bounded.trajectory.rows[-1, 0]:.6g} s"
                hint = f"a method of fixed steps, of {bound:.2g} s ({reason})"
                outcome = _with_checkpoints(outcome, execution, beginning)
                outcome.passed_over = law._replace(finding=replace(law.finding, hint=hint))
                break
            outcome = bounded
    except KeyboardInterrupt:  # in an examination after the run, which is complete
        pass
    return outcome


def _with_checkpoints(outcome: JudgedRun, execution: Execution, beginning: RunStart) -> JudgedRun:
    """Return the outcome of a run, executed again if another run has overwritten checkpoints."""
    return outcome if outcome.writer is None else execution.outcome(outcome.run, beginning)
