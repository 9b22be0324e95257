"""A bound of the steps that a method chooses, if the examination of the finished run finds a law between them."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from eomgen.simulation.outcome import Outcome
from eomgen.simulation.stepping.run import Run

_LOG = logging.getLogger(__name__)

#: Cost of all runs with a bound: so many times the steps of the run without one, as users wait for that without asking,
#: or so many steps divided by the number of velocities and internal states, about a second. Steps are counted, not
#: seconds, so that the same run is bounded on every machine.
_TIMES, _STEPS = 30.0, 1e5
#: Maximum number of runs with a bound: the first bound is of the width along a path that the law has not changed.
_ROUNDS = 3
#: Factor by which a bound is reduced at least, if it is not enough.
_SMALLER = 0.5
#: Ratio of the steps of a run with a bound to the steps that the bound explains, above which the run is given up: steps
#: become tiny at a jump that holds the motion.
_GIVEN_UP = 4.0


class CostlyRunError(Exception):
    """A run with a bound takes many more steps than the bound explains."""


def with_bounded_steps(outcome: Outcome, stepped: Callable[[Run, float], Outcome], *, checkpoint: bool) -> Outcome:
    """Return the outcome of the run with a bound of its steps, if they pass over a law and the bound is affordable.

    Parameters
    ----------
    stepped : returns the outcome of another run from the same initial state, and writes its checkpoints; raises
        CostlyRunError if the run takes more steps than its second argument says
    checkpoint : whether there are any, which have to be of the run that is returned
    """
    run, taken = outcome.run, own_steps(outcome.statistics)
    short = _STEPS / max(1, run.model.nv + run.model.nz)
    if taken > short:  # then the examination, which repeats the run, takes long as well
        return outcome
    left = max(_TIMES * taken, short)
    try:
        for _ in range(_ROUNDS):
            law = outcome.passed_over if outcome.has(("complete", "two rows")) else None
            if law is None or not law.step:
                break
            known = outcome.run.settings["largest_step"]
            bound = min(law.step, _SMALLER * known) if known else law.step
            steps = (run.grid.reached - run.grid.start) / bound
            left -= steps
            if left <= 0.0:
                break
            _LOG.info("%s: steps of at most %.3g s, for %s", run.model.name, bound, law.law)
            settings = {**run.settings, "largest_step": bound}
            try:
                bounded = stepped(replace(run, settings=settings, bounded_for=law.law), _GIVEN_UP * (steps + taken))
            except CostlyRunError:
                outcome = stepped(outcome.run, math.inf) if checkpoint else outcome
                break
            if not (bounded.complete or bounded.trajectory.interrupted):  # at a jump that no step is small enough for
                reason = f"with largest_step = {bound:.2g} it fails at t = {bounded.trajectory.rows[-1, 0]:.6g} s"
                hint = f"a method of fixed steps, of {bound:.2g} s ({reason})"
                outcome = stepped(outcome.run, math.inf) if checkpoint else outcome
                outcome.passed_over = law._replace(finding=replace(law.finding, hint=hint))
                break
            outcome = bounded
    except KeyboardInterrupt:  # in an examination: the run itself is complete
        pass
    return outcome


def own_steps(counts: Mapping[str, int | float]) -> float:
    """Return the number of steps that a method chose, from the counts of its stepper; 1 before the first one."""
    return float(counts.get("own_steps") or counts.get("expansions") or 1)
