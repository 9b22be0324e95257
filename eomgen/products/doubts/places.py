"""Places that bodies and points take in a run, heights above roads, and how near the ends of springs come; steps and
rows that searches look at."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Symbol
from eomgen.lie.numeric import rotated
from eomgen.system.description import BASE, WORLD, Wheel

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.simulation.accuracy.step_path import StepPath, StepStates

#: Signs that turn a quaternion into its inverse.
BACK = np.array([1.0, -1.0, -1.0, -1.0])
#: No steps.
NONE: NDArray[np.intp] = np.empty(0, dtype=np.intp)


def poses_of(model: CompiledModel, t: ArrayLike, q: Array, p: Array) -> dict[str, Array]:
    """Return quaternion and position of the bodies, the base and the world, (..., 7) each, at states with q (..., nq);
    (7,) if the base or the world rests."""
    poses = np.moveaxis(model.evaluate("poses", q, t=t, parameters=p)["pose"], -2, 0)
    result = dict(zip(model.bodies, poses, strict=True))
    result[WORLD] = result[BASE] = np.array([1.0, *[0.0] * 6])
    if "base" in model.functions:
        result[BASE] = model.base(t, parameters=p)[..., :7]
    return result


def place(pose: Array, local: ArrayLike) -> Array:
    """Return the world position (..., 3) of a place (3,) in a body with a pose (..., 7)."""
    return np.asarray(rotated(pose[..., :4], np.asarray(local)) + pose[..., 4:])


def shortest(vectors: Array) -> Array:
    """Return the least lengths, (..., rows - 1), of vectors (..., rows, 3) on straight ways from row to row."""
    before, way = vectors[..., :-1, :], np.diff(vectors, axis=-2)
    square = np.sum(way * way, axis=-1)
    share = np.clip(-np.sum(before * way, axis=-1) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return np.asarray(np.linalg.norm(before + share[..., np.newaxis] * way, axis=-1))


def height_over_road(
    wheel: Wheel, center: Array, t: float, values: Mapping[str, float], inputs: Mapping[str, float]
) -> float:
    """Return the height of a wheel's centre (3,) over the road, m, by numbers of parameters and inputs. Raises
    ArithmeticError or KeyError for a road without a value, such as a curve that only the compiled model has."""

    def value_of(symbol: Symbol) -> float:
        if symbol.kind == "position":
            return float(center[symbol.index])
        if symbol.kind == "time":
            return t
        return inputs[symbol.name] if symbol.kind == "input" else values[symbol.name]

    return float(center[2]) - evaluate(wheel.road, value_of)


def depth_note(wheel: Wheel, center: Array, t: float, values: Mapping[str, float], inputs: Mapping[str, float]) -> str:
    """Return a note on a tyre that starts deeper in the road than a quarter of the radius, arguments as of
    ``height_over_road``; empty for other tyres, and for a road without a value."""
    try:
        height = height_over_road(wheel, center, t, values, inputs)
    except (ArithmeticError, KeyError):
        return ""
    radius, stiffness = (evaluate(part, lambda symbol: values[symbol.name]) for part in (wheel.radius, wheel.stiffness))
    depth = radius - height
    if not depth > 0.25 * radius > 0.0:
        return ""
    start = f"the tyre {wheel.name} starts {depth:.4g} m deep in its road, with a radius of {radius:.4g} m"
    force = f"{stiffness * depth / 1e3:.3g} kN push it out"
    return f"{start}: {force}; its centre belongs about {radius:.4g} m above the road [W0204]"


def evenly(count: int, most: int) -> NDArray[np.intp]:
    """Return at most ``most`` of the numbers 0 to ``count`` - 1, evenly chosen."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))


def whole_steps(t: Array, changes: Array, breaks: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the numbers of the steps between times t (n,), without ``breaks`` and steps without length, and of these
    the steps that contain none of the times ``changes``."""
    near = 1e-9 * float(t[-1] - t[0])
    begins, ends = np.searchsorted(np.sort(changes), [t[:-1] - near, t[1:] + near])
    steps = np.setdiff1d(np.flatnonzero(np.diff(t) > near), breaks)
    return steps, steps[begins[steps] == ends[steps]]


def sample(path: StepPath, steps: NDArray[np.intp], grid: Array) -> StepStates:
    """Return the states of an interpolant at places (n,), from 0 to 1, within each of the steps (m,), (m n, ...)."""
    t = path.states.t
    times = t[steps][:, np.newaxis] + (t[steps + 1] - t[steps])[:, np.newaxis] * grid
    return path.at(times.ravel(), np.repeat(steps, len(grid)))


def grid_of_step(count: int) -> Array:
    """Return ``count`` places within a step, from 0 to 1, that no oscillation hides from, and both ends."""
    places = (np.arange(count) + np.modf(0.6180339887 * np.arange(1, count + 1))[0]) / count
    return np.concatenate([[0.0], places, [1.0]])
