"""Notes on calls of runs that are allowed, and hardly meant: steps and samples longer than the run, inputs nobody
gives."""

from __future__ import annotations

from collections.abc import Collection

from eomgen.compiled.model import CompiledModel
from eomgen.simulation.stepping.time_grid import WHOLE, TimeGrid
from eomgen.text import listed

#: A step of so many runs is more likely their end.
_EXCHANGED = 100.0


def exchanged_times(grid: TimeGrid) -> list[str]:
    """Return one sentence if the step is longer than the run, as for exchanged arguments."""
    span = grid.end - grid.start
    if not 0.0 < span * (1.0 + WHOLE) < grid.step:
        return []
    what = f"the step, {grid.step:.6g} s, is longer than the run, {span:.6g} s, which is one shorter step"
    exchanged = f"; simulate({grid.step:.6g}, {span:.6g}) has the end first, and then the step"
    return [what + (exchanged if grid.step >= _EXCHANGED * span else "")]


def doubtful_call(model: CompiledModel, grid: TimeGrid, given: Collection[str]) -> list[str]:
    """Return one sentence for each doubt about a run.

    Parameters
    ----------
    given : names of the inputs that the caller gives
    """
    description, notes = model.description, []
    span = grid.end - grid.start
    longest = span * (1.0 + WHOLE)
    periods = {
        state.sampling.controller or state.name: state.sampling.period
        for state in description.states
        if state.sampling is not None
    }
    notes += [
        f"{name} is sampled once: every {period:.6g} s in a run of {span:.6g} s"
        for name, period in periods.items()
        if 0.0 < longest < period
    ]
    silent = [item.name for item in description.inputs if not item.given and item.name not in given]
    if silent:
        many = len(silent) > 1
        what = f"the inputs {listed(silent)} are 0" if many else f"the input {silent[0]} is 0"
        notes.append(f"{what}: neither the scene nor the run gives {'them' if many else 'it'}")
    return notes
