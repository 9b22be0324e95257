"""Motions that grow by many orders of magnitude over a run, faster than any power of time: unstable equations.

The largest velocities of the four quarters of a run are compared. A velocity that grows from each to the next by a
large factor grows exponentially: constant forces give factors below 2 behind the first quarters.
"""

from __future__ import annotations

import numpy as np

from eomgen.results.finding import Finding
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import States

#: Factors of growth from quarter to quarter, and from the first to the last one, from which on it is reported.
_EACH, _OVERALL = 10.0, 1e6
#: Travel in the last quarter, in parts of the largest coordinate in m of the first one, or in rad: a motion that
#: swings, or falls over from an equilibrium, travels less.
_FAR = 1e3
#: Rows of a quarter that tell its largest velocity.
_ROWS = 8


def unbounded_growth(run: Run, states: States) -> Finding | None:
    """Return a finding on the velocity that grows most by the equations of motion; None if none grows far."""
    quarters = np.array_split(np.arange(len(states.t)), 4)
    if not run.model.nv or len(quarters[-1]) < _ROWS:
        return None
    sizes = np.array([np.abs(states.v[rows]).max(axis=0) for rows in quarters])
    lengths = [index for index, unit in enumerate(run.model.q_units) if unit == "m"]
    longest = float(np.abs(states.q[quarters[0]][:, lengths]).max(initial=0.0)) or 1.0
    scales = np.array([longest if unit == "m/s" else 1.0 for unit in run.model.v_units])
    travel = sizes[-1] * (states.t[-1] - states.t[quarters[-1][0]])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        each, overall = (sizes[1:] / sizes[:-1]).min(axis=0), sizes[-1] / sizes[0]
    grown = np.flatnonzero((each >= _EACH) & (overall >= _OVERALL) & (travel > _FAR * scales) & np.isfinite(overall))
    if not len(grown):
        return None
    one = grown[np.argmax(overall[grown])]
    name, unit = run.model.v_names[one], run.model.v_units[one]
    samples = ", or a shorter time between samples" if "samples" in run.model.library.layout["method"] else ""
    text = (
        f"the motion grows without end: {name} by a factor of {overall[one]:.2g}, from at most {sizes[0, one]:.3g}"
        f" {unit} in the first quarter of the run to {sizes[-1, one]:.3g} {unit} in the last one"
    )
    hint = f"other signs or sizes of gains, damping and stiffnesses{samples}"
    return Finding(value=float(overall[one]), text=text, hint=hint)
