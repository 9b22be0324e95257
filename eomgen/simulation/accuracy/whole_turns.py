"""Angles whose whole turns do not matter: an error of one is measured by a turn, however many turns the motion has.

The equations are evaluated at rows of the run with the angle shifted, which needs no knowledge of their structure: a
shift by a turn must change no force, rate and constraint, and a shift by another angle some of them. The angle of a
symmetric wheel, for which no shift changes any force, is measured by its travel.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.compiled.equations import accelerations
from eomgen.errors import EomgenError

if TYPE_CHECKING:
    from eomgen.simulation.stepping.run import Run

TURN = 2.0 * np.pi
#: Rows at which equations are evaluated, and the other shift, rad.
_ROWS, _OTHER = 8, 1.0
#: Changes below this fraction of the largest value count as rounding.
_ROUNDING = 1e-7


def whole_turns(run: Run, rows: Array, parameters: Array) -> NDArray[np.bool_]:
    """Return for each velocity, (nv,), whether it is the rate of an angle that travels more than a turn, and whole
    turns of it change no equation.

    Parameters
    ----------
    rows : (n, width) of the record
    parameters : (np,), or (n, np), at the rows
    """
    model = run.model
    result = np.zeros(model.nv, dtype=bool)
    travel = np.ptp(rows[:, 1 : 1 + model.nq], axis=0)
    angles = [
        factor
        for factor in model.factors
        if factor.group == "R" and model.q_units[factor.q_start] == "rad" and travel[factor.q_start] > TURN
    ]
    if not angles:
        return result
    places = np.unique(np.linspace(0, len(rows) - 1, min(len(rows), _ROWS)).astype(int))
    held = parameters if parameters.ndim == 1 else parameters[places]
    try:
        known = _equations(run, rows[places], held, 0, 0.0)
        for factor in angles:
            turned, moved = (_equations(run, rows[places], held, factor.q_start, shift) for shift in (TURN, _OTHER))
            result[factor.v_start] = _same(known, turned) and not _same(known, moved)
    except EomgenError:  # a function of the caller, or a state at which the equations have no value
        return np.zeros(model.nv, dtype=bool)
    return result


def _equations(run: Run, rows: Array, parameters: Array, place: int, shift: float) -> list[Array]:
    """Return forces, rates and constraints at rows with one number of q shifted, (n, size) each."""
    model = run.model
    ends = np.cumsum([1, model.nq, model.nv, model.nv, len(model.multipliers)])
    times, q, v, a, _, z = np.split(rows, ends, axis=1)
    t, q = times[:, 0], q.copy()
    q[:, place] += shift
    u = None
    if model.nu:
        u = run.signals.rows(t) if run.takes_rows else model.input_values(t, parameters=parameters)
    result = []
    with np.errstate(all="ignore"):
        if "inverse_dynamics" in model.functions:
            # at the accelerations of the motion forces are zero: no measure for rounding
            result.append(model.inverse_dynamics(q, v, -a, t, u, z=z, parameters=parameters))
        elif "forward_dynamics" in model.functions and not model.multipliers:
            result.append(accelerations(model, q, v, t, u, z=z, parameters=parameters))
        if "internal_rate" in model.functions:
            result.append(model.internal_rates(q, v, z, t, u, parameters=parameters))
        for name in ("constraint", "constraint_jacobian"):
            if model.multipliers and name in model.functions:
                block = next(iter(model.evaluate(name, q, t=t, parameters=parameters).values()))
                result.append(np.asarray(block).reshape(len(t), -1))
    return result


def _same(first: list[Array], second: list[Array]) -> bool:
    """Return whether values are equal up to rounding; non-finite values are unequal."""
    return all(
        bool(np.all(np.abs(one - two) <= _ROUNDING * np.abs(one).max(initial=0.0)))
        for one, two in zip(first, second, strict=True)
    )
