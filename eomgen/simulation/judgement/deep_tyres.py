"""Tyres deep in their road at the start of a run, as a hub without its position is thrown up; upright axes of tyres."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula, Symbol
from eomgen.lie.numeric import rotated
from eomgen.system.description import BASE, WORLD

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.simulation.stepping.inputs import InputSignals

_AT_REST = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
#: Horizontal part of a unit vector that counts as upright.
_UPRIGHT = 1e-9


def deep_tyres(model: CompiledModel, t: float, q: Array, p: Array, signals: InputSignals | None) -> list[str]:
    """Return one sentence for each tyre that starts with more than half of its radius in the road.

    Models without ``poses`` have none, nor have roads by curves and waves at places that only a step knows.

    Parameters
    ----------
    t, q, p : s, (nq,), (np,)
    signals : inputs of the run; None if it takes none
    """
    if "poses" not in model.functions:
        return []
    drawing = model.description.drawing
    values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
    inputs = {} if signals is None else dict(zip(model.inputs, signals.rows(np.array([t]))[0].tolist(), strict=False))
    poses = _poses(model, t, q, p)
    points = {point.name: point for point in drawing.points}
    notes = []
    for wheel in drawing.wheels:
        point = points[wheel.center]

        def value(formula: Formula, place: Array | None = None) -> float:
            def value_of(symbol: Symbol) -> float:
                if symbol.kind == "position" and place is not None:
                    return float(place[symbol.index])
                if symbol.kind == "time":
                    return t
                return inputs[symbol.name] if symbol.kind == "input" else values[symbol.name]

            return float(evaluate(formula, value_of))

        try:
            offset = np.array([value(part) for part in point.position])
            pose = poses[point.body]
            place = rotated(pose[:4], offset) + pose[4:]
            note = wheel.deep(float(place[2]), value(wheel.radius), value(wheel.road, place), value(wheel.stiffness))
        except (ArithmeticError, KeyError):
            continue
        notes += [note] if note else []
    return notes


def upright_tyres(model: CompiledModel, t: float, q: Array, p: Array) -> str:
    """Return the tyres whose axis is upright, so that their slip has no directions; empty for none."""
    wheels = [wheel for wheel in model.description.drawing.wheels if wheel.axis is not None]
    if not wheels or "poses" not in model.functions:
        return ""
    poses, points = _poses(model, t, q, p), {point.name: point for point in model.description.drawing.points}
    named = []
    for wheel in wheels:
        axis = rotated(poses[points[wheel.center].body][:4], np.array(wheel.axis))
        if np.hypot(axis[0], axis[1]) <= _UPRIGHT * np.linalg.norm(axis):
            named.append(wheel.name)
    return ", ".join(named)


def _poses(model: CompiledModel, t: float, q: Array, p: Array) -> dict[str, Array]:
    """Return quaternion and position of the bodies, the base and the world, (7,) each."""
    poses = dict(zip(model.bodies, model.evaluate("poses", q, t=t, parameters=p)["pose"], strict=True))
    poses[WORLD] = poses[BASE] = _AT_REST
    if "base" in model.functions:
        poses[BASE] = model.base(t, parameters=p)[:7]
    return poses
