"""Partials of the values that sampled states take at their samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import ModelError, Problem
from eomgen.products.linear.sampling import SampledPart

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Weights of f(h) - f(-h) and f(2 h) - f(-2 h).
_WEIGHTS = (2.0 / 3.0, -1.0 / 12.0)


def sampled_part(model: CompiledModel, q: Array, v: Array, z: Array, keywords: Mapping[str, Any]) -> SampledPart | None:
    """Return the sampled states, and the partials of their new values at a state; None without sampled states.

    Partials are differences of fourth order, dq left-trivialised.

    Parameters
    ----------
    model : CompiledModel
        The model with sampled states.
    q, v, z : (nq,), (nv,) and (nz,) ndarray
        The state.
    keywords : mapping
        Time, parameters, inputs and base, as keywords of the model's functions.

    Raises
    ------
    ModelError
        A function of the caller, or one in C, gives values.
    """
    rows = model.library.layout["sampled"]
    if not rows:
        return None
    names = tuple(str(model.states[int(row["state"])]) for row in rows)
    called = [name for name, row in zip(names, rows, strict=True) if int(row["controller"]) >= 0]
    if called:
        fault = f"a function gives {', '.join(called)}, and its slopes are not known [E0089]"
        hint = "sampled states by formulas, or inputs in place of the controller"
        raise ModelError(Problem("linearize", fault, hint))
    sizes = [1e-3 * np.maximum(np.abs(part), 1.0) for part in (np.zeros(len(v)), v, z)]
    changes = np.diag(np.concatenate(sizes))
    nv = len(v)
    total = np.zeros((len(rows), len(changes)))
    for factor, weight in zip((1.0, 2.0), _WEIGHTS, strict=True):
        for sign in (1.0, -1.0):
            moved = sign * factor * changes
            at_q = model.integrate(np.broadcast_to(q, (len(moved), len(q))), moved[:, :nv])
            state = at_q, v + moved[:, nv : 2 * nv], np.zeros((len(moved), nv))
            (values,) = model.evaluate("samples", *state, z=z + moved[:, 2 * nv :], **keywords).values()
            total += sign * weight * np.asarray(values).reshape(len(moved), -1).T
    total /= np.diag(changes)
    return SampledPart(
        names,
        tuple(int(row["state"]) for row in rows),
        tuple(float(row["period"]) for row in rows),
        tuple(float(row["offset"]) for row in rows),
        tuple(int(row["level"]) for row in rows),
        total[:, :nv],
        total[:, nv : 2 * nv],
        total[:, 2 * nv :],
    )
