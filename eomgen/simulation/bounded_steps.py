"""A bound of the steps that a method chooses, if the examination of the finished run finds a law between them."""

from __future__ import annotations

import logging
from collections.abc import Callable
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


def with_bounded_steps(outcome: Outcome, stepped: Callable[[Run], Outcome], *, checkpoint: bool) -> Outcome:
    """Return the outcome of the run with a bound of its steps, if they pass over a law and the bound is affordable.

    Parameters
    ----------
    stepped : returns the outcome of another run from the same initial state, and writes its checkpoints
    checkpoint : whether there are any, which have to be of the run that is returned
    """
    run, counts = outcome.run, outcome.statistics
    taken = counts.get("own_steps") or counts.get("expansions") or 1
    left = max(_TIMES * taken, _STEPS / max(1, run.model.nv + run.model.nz))
    try:
        for _ in range(_ROUNDS):
            law = outcome.passed_over if outcome.has(("complete", "two rows")) else None
            if law is None or not law.step:
                break
            known = outcome.run.settings["largest_step"]
            bound = min(law.step, _SMALLER * known) if known else law.step
            left -= (run.grid.reached - run.grid.start) / bound if bound else left
            if left <= 0.0:
                break
            _LOG.info("%s: steps of at most %.3g s, for %s", run.model.name, bound, law.law)
            settings = {**run.settings, "largest_step": bound}
            bounded = stepped(replace(run, settings=settings, bounded_for=law.law))
            if not (bounded.complete or bounded.trajectory.interrupted):  # at a jump that no step is small enough for
                reason = f"with largest_step = {bound:.2g} it fails at t = {bounded.trajectory.rows[-1, 0]:.6g} s"
                hint = f"a method of fixed steps, of {bound:.2g} s ({reason})"
                outcome = stepped(outcome.run) if checkpoint else outcome
                outcome.passed_over = law._replace(finding=replace(law.finding, hint=hint))
                break
            outcome = bounded
    except KeyboardInterrupt:  # in an examination: the run itself is complete
        pass
    return outcome
