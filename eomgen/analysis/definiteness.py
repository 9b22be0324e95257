"""Warnings if the inertia matrix is not positive definite, with the cause: masses, a beam, or too large a step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from eomgen.base.arrays import Array

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


class InertiaWarning(NamedTuple):
    """The fault of the inertia matrix of a state, and a remedy."""

    text: str
    hint: str


def inertia_warning(
    model: CompiledModel, q: Array, p: Array, start: Array | None = None, step: float = 0.0, where: str = "there"
) -> InertiaWarning | None:
    """Return a warning if the inertia matrix at q is not positive definite; None if it is, or is not known.

    Parameters
    ----------
    p : parameters
    start : (nq,)
        State at the start of the run that led to q, with steps of ``step`` seconds.
    where : name of the state in the message
    """
    smallest = _smallest(model, q, p)
    if smallest is None or smallest > 0.0:
        return None
    text = f"the inertia matrix {where} is not positive definite, its smallest eigenvalue is {smallest:.3g}"
    beams = beams_beyond_linear_range(model, q, p)
    if beams:
        text += f": this is beyond the range of order = 1 of beam{'s' * (len(beams) > 1)} {', '.join(beams)}"
    if start is not None and _definite(model, start, p):  # the masses are fine, and the state has run away
        return InertiaWarning(text, f"a step smaller than {step:.3g} s{', then order = 2' if beams else ''}")
    return InertiaWarning(text, "order = 2" if beams else "masses and inertias that bodies can have")


def beams_beyond_linear_range(model: CompiledModel, q: Array, p: Array) -> Sequence[str]:
    """Return the beams of order 1 without whose deformation the inertia matrix at q would be positive definite.

    Empty if it is positive definite, or would not be even so.
    """
    first = {item.name for item in model.description.coordinates if item.linear}
    factors = [factor for factor in model.factors if factor.name in first]
    straight = q.copy()
    for factor in factors:
        straight[factor.q] = 0.0
    if not factors or _definite(model, q, p) or not _definite(model, straight, p):
        return ()
    causes = []
    for factor in factors:
        alone = straight.copy()
        alone[factor.q] = q[factor.q]
        if not _definite(model, alone, p):
            causes.append(factor.name)
    return tuple(causes or (factor.name for factor in factors))


def linear_range_exceeded(model: CompiledModel, t: Array, q: Array, p: Array) -> str:
    """Return a clause on beams of order 1 that deform too far in some row of a run, with a remedy; empty if none
    does.

    Looked at are the rows in which each of them deforms most, the last one, and up to 200 between.
    """
    first = {item.name for item in model.description.coordinates if item.linear}
    parts = [factor.q for factor in model.factors if factor.name in first]
    if not parts:
        return ""
    rows = {int(np.argmax(np.linalg.norm(q[:, part], axis=1))) for part in parts} | {len(t) - 1}
    for row in sorted(rows | set(range(0, len(t), len(t) // 200 + 1))):
        if beams := beams_beyond_linear_range(model, q[row], p):
            named = f"beam{'s' * (len(beams) > 1)} {', '.join(beams)}"
            sentence = f"at t = {t[row]:.6g} s the deflection of {named} is beyond the range of order = 1"
            return f"{sentence}: the inertia matrix is not positive definite; try: order = 2"
    return ""


def _definite(model: CompiledModel, q: Array, p: Array) -> bool:
    smallest = _smallest(model, q, p)
    return smallest is not None and smallest > 0.0


def _smallest(model: CompiledModel, q: Array, p: Array) -> float | None:
    """Return the smallest eigenvalue of M; None if there is no M, or one that is not finite."""
    if "mass" not in model.functions:
        return None
    M = model.mass(q, parameters=p)
    return float(np.linalg.eigvalsh(M)[0]) if M.size and np.all(np.isfinite(M)) else None
