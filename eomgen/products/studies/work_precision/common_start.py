"""One initial state for all formulations of a scene: its own formulation's, as poses and twists of the bodies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import NumericalError, Problem
from eomgen.lie.product import update
from eomgen.pipeline.model import Model

#: Gauss-Newton's steps at most, and the largest change at which they end, rad and m.
MOST_STEPS, SETTLED = 50, 1e-14
#: Poses within this distance, rad and parts of the size of the machine, are the requested ones.
MET = 1e-9


def same_start(
    own: Model, q: Array, v: Array, other: Model, t: float, parameters: Mapping[str, float] | None
) -> dict[str, Any]:
    """Return the initial state of another formulation with the poses and twists of the bodies of ``own``.

    Parameters
    ----------
    q, v : (nq,), (nv,), consistent, of ``own``

    Raises
    ------
    NumericalError
        The other formulation has no such state.
    """
    bodies = [name for name in own.bodies if name in other.bodies]
    poses = {name: own.pose(name, q, t, parameters=parameters) for name in bodies}
    here = np.array(other.initial_q, dtype=float)
    for _ in range(MOST_STEPS):
        apart = np.concatenate([_apart(other.pose(n, here, t, parameters=parameters), poses[n]) for n in bodies])
        change = np.linalg.lstsq(_per_velocity(other, bodies, here, t, parameters)[0], apart, rcond=None)[0]
        here = update(other.factors, here, change)
        if np.abs(change).max() < SETTLED:
            break
    apart = np.concatenate([_apart(other.pose(n, here, t, parameters=parameters), poses[n]) for n in bodies])
    size = 1.0 + max(float(np.abs(pose[4:]).max()) for pose in poses.values())
    if np.abs(apart).max() > MET * size:
        off = np.abs(apart).max()
        fault = f"{other.name} cannot begin at the start of the scene's own formulation: bodies are off by {off:.2g}"
        raise NumericalError(Problem("formulation", fault, "the scene's own formulation"))
    columns, rest = _per_velocity(other, bodies, here, t, parameters)
    twists = np.concatenate([own.twist(name, q, v, t, parameters=parameters) for name in bodies])
    return {"q": here, "v": np.linalg.lstsq(columns, twists - rest, rcond=None)[0]}


def _per_velocity(
    model: Model, bodies: list[str], q: Array, t: float, parameters: Mapping[str, float] | None
) -> tuple[Array, Array]:
    """Return the twists of the bodies per velocity component, (6 n, nv), and at rest, (6 n,)."""
    rest, *moved = (
        np.concatenate([model.twist(name, q, v, t, parameters=parameters) for name in bodies])
        for v in np.vstack([np.zeros(model.nv), np.eye(model.nv)])
    )
    return np.stack([column - rest for column in moved], axis=1), rest


def _apart(here: Array, there: Array) -> Array:
    """Return the small rotation (rad) and translation (m) in body axes that lead from one pose to another, (6,)."""
    w, x = here[0], here[1:4]
    scalar = w * there[0] + x @ there[1:4]
    vector = w * there[1:4] - there[0] * x - np.cross(x, there[1:4])
    length = float(np.linalg.norm(vector))
    angle = 2.0 * np.arctan2(length, scalar if scalar >= 0.0 else -scalar)
    turn = (angle / length if length > 0.0 else 0.0) * vector * (1.0 if scalar >= 0.0 else -1.0)
    shift = there[4:] - here[4:]
    turned = shift + 2.0 * np.cross(-x, np.cross(-x, shift) + w * shift)
    return np.concatenate([turn, turned])
