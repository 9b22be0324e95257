"""Notes on calls of runs that are allowed but hardly intended: steps and sampling periods longer than the run, inputs
without a value."""

from __future__ import annotations

from collections.abc import Collection
from operator import itemgetter

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.text import counted, listed
from eomgen.compiled.model import CompiledModel
from eomgen.simulation.stepping.time_grid import WHOLE, TimeGrid

#: A step of so many runs is more likely their end.
_EXCHANGED = 100.0
#: Standard deviations that a standard normal variable exceeds with a probability of 1e-15.
_IMPROBABLE = 8.0


def exchanged_times(grid: TimeGrid) -> list[str]:
    """Return one sentence if the step is longer than the run, as for exchanged arguments."""
    span = grid.end - grid.start
    if not 0.0 < span * (1.0 + WHOLE) < grid.step:
        return []
    sentence = f"the step, {grid.step:.6g} s, is longer than the run, {span:.6g} s, which is one shorter step"
    exchanged = f"; simulate({grid.step:.6g}, {span:.6g}) has the end first, and then the step"
    return [sentence + (exchanged if grid.step >= _EXCHANGED * span else "")]


def doubtful_call(model: CompiledModel, grid: TimeGrid, given: Collection[str], p: Array) -> list[str]:
    """Return one sentence for each doubt about a run.

    Parameters
    ----------
    given : names of the inputs that the caller gives
    p : (np,) parameters
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
        sentence = f"the inputs {listed(silent)} are 0" if many else f"the input {silent[0]} is 0"
        notes.append(f"{sentence}: neither the scene nor the run gives {'them' if many else 'it'}")
    return [*notes, *_improbable_variables(model, p)]


def _improbable_variables(model: CompiledModel, p: Array) -> list[str]:
    """Return a sentence on variables of random processes and waves that no draw of a normal distribution gives."""
    large = np.flatnonzero(np.abs(p) > _IMPROBABLE).tolist()
    if not large:
        return []
    names = tuple(model.parameters)
    normal = {item.name for item in model.description.parameters if item.standard_normal}
    result = [(names[k], abs(float(p[k]))) for k in large if names[k] in normal]
    if not result:
        return []
    name, value = max(result, key=itemgetter(1))
    sentence = (
        f"{name} is {value:.6g} standard deviations out: it is a standard normal variable of a random process or sea"
    )
    return [sentence + (f" ({counted(len(result), 'variable')} beyond {_IMPROBABLE:g})" if len(result) > 1 else "")]
