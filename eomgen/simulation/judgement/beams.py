"""Checks of beams whose motion no beam can have: elements that turn too far, and slopes beyond the linear theory."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.rest.state_warnings import LARGE_SHORTENING
from eomgen.results.dense_output import BATCH
from eomgen.results.finding import FAILURE, Finding
from eomgen.simulation.judgement.finished_run import ANY_FAILURE, Check, FinishedRun


def turned_elements(model: CompiledModel, t: Array, q: Array, p: Array) -> Finding | None:
    """Return a finding on an element of an exact beam that turns by more than half a turn first; None if none does.

    None also for models without ``poses``, and for a single row.

    Parameters
    ----------
    t, q : (rows,) in s, (rows, nq)
    p : (np,) tunable parameters
    """
    beams = model.description.exact_beams
    if not beams or "poses" not in model.functions or len(t) < 2:
        return None
    for start in range(0, len(t) - 1, BATCH):
        rows = slice(start, start + BATCH + 1)  # the last row is the first row of the next batch
        if result := _passage(model, t[rows], q[rows], p):
            return result
    return None


def _passage(model: CompiledModel, t: Array, q: Array, p: Array) -> Finding | None:
    """Return a finding on the first element of an exact beam that passes half a turn between rows; None if none does.
    `t` (n,) are times in s, `q` (n, nq) configurations and `p` (np,) parameters."""
    beams = model.description.exact_beams
    quaternion = model.evaluate("poses", q, t=t, parameters=p)["pose"][..., :4]
    index = {name: k for k, name in enumerate(model.bodies)}
    for nodes in beams:
        of_nodes = quaternion[:, [index[name] for name in nodes]]
        cosine = np.sum(of_nodes[:, :-1] * of_nodes[:, 1:], axis=-1)
        before, after = cosine[:-1], cosine[1:]
        # other changes of sign are due to the sign of a pose's quaternion and mean no rotation
        passed = (before * after < 0.0) & (np.maximum(np.abs(before), np.abs(after)) < 0.7)
        if passed.any():
            number = int(np.argmax(passed.any(axis=0)))
            when = t[1:][passed[:, number]][0]
            sentence = f"element {number + 1} of the beam {nodes[0]} turns by more than half a turn at t = {when:.6g} s"
            hint = f"elements = {2 * (len(nodes) - 1)}, which turn less each"
            return Finding(time=float(when), text=f"{sentence}, which strains cannot show", hint=hint)
    return None


def _large_deflection(run: FinishedRun) -> Iterator[Finding]:
    if (bending := run.bending) is not None:
        yield Finding.of(str(bending), bending.shortening, bending.time)


def _impossible_deflection(run: FinishedRun) -> bool:
    return run.bending is not None and not run.bending.possible


def _turned_element(run: FinishedRun) -> Iterator[Finding]:
    finding = turned_elements(run.run.model, run.states.t, run.states.q, run.run.parameters)
    if finding is not None:
        yield finding


ROWS = (
    Check(
        "large_deflection [W0223]",
        _large_deflection,
        ("complete", "modal beams"),
        severity=FAILURE,
        fails=_impossible_deflection,
        unless=(ANY_FAILURE,),
        limits=(LARGE_SHORTENING,),
    ),
    Check("turned_element [W0224]", _turned_element, ("two rows", "exact beams"), severity=FAILURE),
)
