"""Springs whose ends pass one another in a run: their length is zero there, and their force turns round at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula
from eomgen.lie.numeric import rotated
from eomgen.results.finding import Finding
from eomgen.system.description import BASE, WORLD

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Ends meet if they come nearer than this part of the length of the spring at rest.
_MET = 0.05
#: Rows that are looked at, evenly chosen, and how far ends may move between two of them, in lengths at rest.
_ROWS, _FAR = 2048, 2.0
#: Signs that turn a quaternion into its inverse.
_BACK = np.array([1.0, -1.0, -1.0, -1.0])


def passed_springs(model: CompiledModel, t: Array, q: Array, p: Array) -> Finding | None:
    """Return a finding on springs whose ends pass one another; None if there are none.

    Springs without a length at rest are left out: their law is linear, and has no point at which the force reverses. So
    are runs of models without ``poses``.

    Parameters
    ----------
    t, q : (rows,) in s, (rows, nq)
    p : (np,) tunable parameters
    """
    lines = [line for line in model.description.drawing.lines if line.elastic]
    if not lines or "poses" not in model.functions or len(t) < 2:
        return None
    values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))

    def number(formula: Formula) -> float:
        try:
            return float(evaluate(formula, lambda symbol: values[symbol.name]))
        except (ArithmeticError, KeyError):
            return 0.0

    lengths = {line.name: number(line.length) for line in lines}
    if not any(length > 0.0 for length in lengths.values()):
        return None
    t, q = (array[:: -(-len(t) // _ROWS)] for array in (t, q))
    pose = model.evaluate("poses", q, t=t, parameters=p)["pose"]
    pose_of = {name: pose[:, k] for k, name in enumerate(model.bodies)}
    still = np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    pose_of |= {WORLD: still, BASE: model.base(t, parameters=p)[:, :7] if "base" in model.functions else still}
    points = {
        point.name: (point.body, np.array([number(part) for part in point.position]))
        for point in model.description.drawing.points
    }
    result: dict[str, float] = {}
    for line in lines:
        ends = [(pose_of[body], place) for body, place in (points[line.first], points[line.second])]
        first, second = (rotated(pose[:, :4], place) + pose[:, 4:] for pose, place in ends)
        apart = second - first
        seen = [rotated(pose[:, :4] * _BACK, apart) for pose, _ in ends]
        met = np.flatnonzero(np.logical_and(*(_meetings(vectors, lengths[line.name]) for vectors in seen)))
        if len(met):
            result[line.name] = float(t[met[0] + 1])
    if not result:
        return None
    named = ", ".join(f"{name} at t = {time:.6g} s" for name, time in result.items())
    sentence = f"the ends of the spring{'s' * (len(result) > 1)} {named} pass one another"
    text = f"{sentence}, where a force along the line between them turns round"
    return Finding(time=min(result.values()), text=text, hint="limits that stop the motion before")


def _meetings(vectors: Array, length: float) -> Array:
    """Return between which rows a spring from end to end, (rows, 3), turns round by way of next to no length."""
    before, after = vectors[:-1], vectors[1:]
    way = after - before
    square = np.sum(way * way, axis=1)
    share = np.clip(-np.sum(before * way, axis=1) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    shortest = np.linalg.norm(before + share[:, np.newaxis] * way, axis=1)
    turned = np.sum(before * after, axis=1) < 0.0
    return np.asarray(turned & (shortest < _MET * length) & (square < (_FAR * length) ** 2))
