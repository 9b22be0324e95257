"""Warnings of forward dynamics at parameters with which the elimination of M loses digits."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.compiled.terms import Evaluated
from eomgen.errors import NumericalError
from eomgen.system.cancellation import LOST, cancellation, digits_kept, relative_error

#: States of a batch that are looked at, and sets of parameters that are remembered.
_STATES, _REMEMBERED = 4, 1000


def check_digits(model: Evaluated, q: ArrayLike, p: Array, accelerations: Array) -> None:
    """Warn of accelerations that lose digits at parameters other than the defaults, once for each set of these.

    How M is eliminated is chosen by the defaults when a model is built. Only the first states of a batch are examined.

    Parameters
    ----------
    q, p, accelerations : (..., nq), (..., np), (..., nv)

    Raises
    ------
    NumericalError
        Accelerations that are not finite since all digits are lost.
    """
    evaluator = model.evaluator
    if "mass" not in evaluator.functions or "p" not in evaluator.functions.inputs("mass"):
        return  # no parameter is in M
    p = p.reshape(-1, p.shape[-1])[:_STATES]
    known, key = evaluator.digits_lost, p.tobytes()
    if key not in known:
        if len(known) >= _REMEMBERED:
            known.clear()
        known[key] = 0.0 if np.array_equal(p, evaluator.parameters(None)[np.newaxis]) else _lost(model, q, p)
        if known[key] > LOST:
            fault = f"forward_dynamics: at these parameters {digits_kept(known[key])}"
            warnings.warn(f"{fault}; try: {_hint(model)}", RuntimeWarning, stacklevel=4)
    if known[key] > LOST and not np.all(np.isfinite(accelerations)):
        fault = "forward_dynamics: accelerations are not finite at these parameters, since light or short links carry"
        raise NumericalError(f"{fault} heavy or long ones: M loses all digits when it is eliminated", _hint(model))


def _lost(model: Evaluated, q: ArrayLike, p: Array) -> float:
    """Return the relative error of accelerations by cancellation, the largest of some states; 1 for an infinite M."""
    evaluator = model.evaluator
    q = evaluator.configuration(q)
    q = q.reshape(-1, q.shape[-1])[:_STATES]
    count = max(len(q), len(p))
    q, p = (rows if len(rows) == count else np.repeat(rows[:1], count, axis=0) for rows in (q, p))
    M = evaluator.call("mass", q=q, parameters=p)[0]
    joints = [factor.v for factor in evaluator.factors]
    ratio = float(np.max(cancellation(M, joints), initial=1.0))
    articulated = bool(evaluator.functions.library.layout["facts"]["ill_scaled"])
    return relative_error(ratio, articulated=articulated) if np.isfinite(ratio) else 1.0


def _hint(model: Evaluated) -> str:
    if model.evaluator.functions.library.layout["facts"]["ill_scaled"]:
        return "links that differ less"
    return "these parameters as defaults of the scene, or links that differ less"
