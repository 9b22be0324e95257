"""Rows of a motion stepped by its caller, recorded at the caller's request, as a ``Solution``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.results.error_estimate import ErrorEstimate
from eomgen.results.solution import Solution
from eomgen.simulation.motions import Motions
from eomgen.simulation.run_metadata import run_metadata
from eomgen.simulation.run_model import RunModel
from eomgen.simulation.stepping.run import Run


@dataclass(frozen=True)
class RecordedRow:
    """A state of a motion, with the inputs (nu,) and parameters (np,) that it has."""

    t: float
    q: Array
    v: Array
    a: Array
    z: Array
    multipliers: Array
    u: Array
    p: Array


def recorded_solution(
    run: Run, rows: Sequence[RecordedRow], statistics: Mapping[str, Any], notes: Sequence[str], stopped: str
) -> Solution:
    """Return rows as a solution; between them its inputs are linear."""
    model = run.model
    t = np.array([row.t for row in rows])
    q, v, a, z, multipliers, u, p = (
        np.array([getattr(row, name) for row in rows]) for name in ("q", "v", "a", "z", "multipliers", "u", "p")
    )
    base = model.base(t, parameters=p) if model.evaluator.moving_base else None
    given: dict[str, Any] = {"z": z, "multipliers": multipliers if model.multipliers else None}
    given |= {"parameters": p, "base": base}
    inputs = u if model.nu else None
    between = {name: partial(np.interp, xp=t, fp=u[:, k]) for k, name in enumerate(model.inputs)}
    signals = replace(run.signals, given=between)
    metadata = run_metadata(replace(run, parameters=p[-1], signals=signals))
    metadata |= {"start": "a caller's", "corrections": (), "notes": list(notes), "energy_balance": "not looked at"}
    last = f"{len(t)} recorded rows to t = {t[-1]:.6g} s"
    return Solution(
        t=t,
        q=q,
        v=v,
        a=a,
        z=z,
        multipliers=multipliers,
        outputs=model.outputs(q, v, a, t, inputs, **given) if "outputs" in model.functions else {},
        energy=model.energy(q, v, a, t, inputs, **given) if "energy" in model.functions else {},
        stats=dict(statistics),
        message=f"{last}; the motion was {stopped}" if stopped else last,
        metadata=metadata,
        model=RunModel(model, p[-1], signals if model.nu else None, None, motions=Motions(model).between(t, p)),
        error=ErrorEstimate.missing("a motion that a caller steps is not run a second time"),
    )
