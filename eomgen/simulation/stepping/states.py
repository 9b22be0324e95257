"""States at the rows of a run, and compiled functions evaluated at them in batches: outputs and energies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.equations import of_motion
from eomgen.compiled.model import CompiledModel
from eomgen.simulation.stepping.inputs import InputSignals

#: Rows in one call.
_BATCH = 65536


class States(NamedTuple):
    """States at rows: t (n,) s, q (n, nq), v (n, nv), a (n, nv), multipliers (n, rows of constraints), z (n, nz)."""

    t: Array
    q: Array
    v: Array
    a: Array
    multipliers: Array
    z: Array


class Prescribed(NamedTuple):
    """Inputs u (n, nu) and the state of the base (n, 19) at rows; None if there are none."""

    u: Array | None
    base: Array | None


def states_of(rows: Array, model: CompiledModel) -> States:
    """Return the states in rows (n, width) of a run, each in an array of its own."""
    nv, width = model.nv, rows.shape[1]
    v = 1 + model.nq
    a, multipliers, z = v + nv, v + 2 * nv, width - model.nz
    return States(
        rows[:, 0].copy(),
        rows[:, 1:v].copy(),
        rows[:, v:a].copy(),
        rows[:, a:multipliers].copy(),
        rows[:, multipliers:z].copy(),
        rows[:, z:].copy(),
    )


def prescribed(model: CompiledModel, t: Array, p: Array, signals: InputSignals | None) -> Prescribed:
    """Return inputs and the base at times (n,); evaluated once, since a road of many harmonics costs more than all else
    of a row.

    Parameters
    ----------
    p : (np,) or (n, np) parameters
    signals : signals of the inputs; None: the scene's formulas
    """
    u, drivers = None, {"t": t, "p": p}  # parameters of a run, which were looked over as it began
    if model.nu:
        u = model.evaluator.formula_inputs(drivers) if signals is None else signals.rows(t)
    return Prescribed(u, model.evaluator.functions("base", drivers)[0] if model.evaluator.moving_base else None)


def evaluated(name: str, model: CompiledModel, states: States, given: Prescribed, p: Array) -> dict[str, Array]:
    """Return the outputs, or the energy, at all rows; empty if the model was built without the term.

    Parameters
    ----------
    name : ``outputs`` or ``energy``
    given : at the rows
    p : (np,) or (n, np) parameters
    """
    if name not in model.functions:
        return {}
    result: list[Mapping[str, Array]] = []
    t, q, v, a, multipliers, z = states
    blocks = {"t": t, "q": q, "v": v, "a": a, "lam": multipliers, "z": z, "u": given.u, "base": given.base, "p": p}
    for start in range(0, len(t), _BATCH):
        part = slice(start, start + _BATCH)
        there = {
            name: block if name == "p" and p.ndim == 1 else block[part]
            for name, block in blocks.items()
            if block is not None
        }
        result.append(of_motion(model, name, there))
    if len(result) == 1:
        return dict(result[0])
    return {key: np.concatenate([one[key] for one in result]) for key in result[0]} if result else {}
