"""Equilibria along a load factor: steps of arc length, past limit points, with step control (Keller 1977).

A step goes along the tangent of the path and is corrected across it. It is taken if corrections are few and small
compared with the step, the path does not turn much meanwhile, and the load factor changes in the sense of the tangents
at both ends: else it would have two limit points between, or the step leaps to another path.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from eomgen.base.data import dataclass
from eomgen.base.rounding import SUMMED
from eomgen.solvers.bordered_newton import (
    CorrectedPoint,
    Direction,
    LoadedState,
    LoadedStatics,
    correct,
    direction,
    held_factor,
)


@dataclass(frozen=True)
class PathPoint:
    """A point of a path of equilibria.

    Attributes
    ----------
    rest : the equilibrium
    direction : in which the path goes on
    way : length of the path from the start to this point
    corrections : number of Newton's corrections for this point
    stride : length of the step to this point, along the direction of the previous point
    """

    rest: LoadedState
    direction: Direction
    way: float
    corrections: int
    stride: float


@dataclass(frozen=True)
class StepLimits:
    """Largest steps along a path: change of a displacement component, rad or lengths of the scene, and change of the
    load factor."""

    displacement: float = 0.5
    factor: float = np.inf


class PathEndError(Exception):
    """The path cannot be followed further.

    Attributes
    ----------
    why : str
    point : the last point; None if there is none
    """

    def __init__(self, why: str, point: PathPoint | None) -> None:
        super().__init__(why)
        self.why, self.point = why, point


def first_point(statics: LoadedStatics, guess: LoadedState, sign: float, *, balanced: bool = False) -> PathPoint:
    """Return the point of the path near a guess at the guess's load factor, going on to more load, or less (``sign``).

    Parameters
    ----------
    balanced : whether the guess is an equilibrium already and needs no correction

    Raises
    ------
    PathEndError
        There is no equilibrium near the start.
    """
    held = held_factor(statics, guess, sign)
    result = correct(statics, guess, held, 0.0) if not balanced else CorrectedPoint(guess, 0.0 * statics.sizes, 0)
    if result.trouble:
        raise PathEndError(result.trouble, None)
    onwards = direction(statics, result.rest, held)
    if onwards is None:
        raise PathEndError("the tangent stiffness is singular there [E2086]", None)
    return PathPoint(result.rest, onwards, 0.0, result.corrections, 0.0)


def follow(
    statics: LoadedStatics, start: PathPoint, target: float, limits: StepLimits, step: float = np.inf
) -> Iterator[PathPoint]:
    """Yield the points of a path after ``start`` until the load factor of the last point is ``target``.

    The path may pass limit points, at which the factor turns back.

    Parameters
    ----------
    limits : largest changes in a step
    step : first step, as a part of the limits

    Raises
    ------
    PathEndError
        No step is short enough.
    """
    point, part = start, min(1.0, step)
    while True:
        longest = _longest(statics, point, limits)
        last = ""
        while True:
            if part < 1e-7:
                raise PathEndError(last, point)
            way = part * longest
            reached = step_to(statics, point, way, target)
            if isinstance(reached, PathPoint):
                break
            last, part = reached, 0.4 * part
        yield reached
        if abs(reached.rest.s - target) <= SUMMED * statics.reach:
            return
        point = reached
        # steps are meant to need five corrections
        part = min(1.0, part * min(2.0, max(0.5, (5 / max(reached.corrections, 1)) ** 0.5)))


def _longest(statics: LoadedStatics, point: PathPoint, limits: StepLimits) -> float:
    """Return the longest step from a point within ``limits``, in the measure of the path; inf without a bound."""
    along = point.direction
    moves = float(np.max(np.abs(along.unknowns[: len(statics.sizes)]) / statics.sizes, initial=0.0))
    loads = abs(along.s)
    return min(
        limits.displacement / moves if moves > 0.0 else np.inf,
        limits.factor / loads if loads > 0.0 and np.isfinite(limits.factor) else np.inf,
        statics.reach / loads if loads > 0.0 else np.inf,
    )


def step_to(statics: LoadedStatics, point: PathPoint, way: float, target: float = np.inf) -> PathPoint | str:
    """Return the next point of a path, or, as text, the reason for which a step of this length fails.

    Parameters
    ----------
    statics : LoadedStatics
        The scene at rest under a load factor.
    point : PathPoint
        Present point.
    way : float
        Length of the step in the measure of ``LoadedStatics``.
    target : float, optional
        Load factor at which the step ends if the factor is reached within the step.
    """
    along, start = point.direction, point.rest
    left = (target - start.s) / along.s if along.s != 0.0 and np.isfinite(target) else np.inf
    ends = 0.0 < left <= 1.001 * way
    plane = held_factor(statics, start, np.sign(along.s)) if ends else along
    result = correct(statics, start, along, left if ends else way, plane)
    passes = not ends and 0.0 < left < np.inf and (result.rest.s - target) * along.s > 0.0  # by corrections
    if result.trouble or passes:
        return result.trouble or step_to(statics, point, left, target)
    rest = LoadedState(result.rest.q, result.rest.multipliers, result.rest.z, target) if ends else result.rest
    stride, change = left if ends else way, rest.s - start.s
    length = statics.length(result.displacement, change)
    corrected = statics.length(result.displacement - stride * along.unknowns[: len(statics.sizes)])
    if corrected > 0.5 * length:
        return "the path turns too sharply [E2089]"
    onwards = direction(statics, rest, along)
    if onwards is None:
        return "the tangent stiffness is singular there [E2086]"
    against = along.s * onwards.s > 0.0 > change * along.s and abs(change) > SUMMED * statics.reach
    if against or _cosine(statics, along, onwards) < 0.7:
        return "the path turns too sharply [E2089]"
    return PathPoint(rest, onwards, point.way + length, result.corrections, stride)


def point_within(statics: LoadedStatics, first: PathPoint, second: PathPoint, way: float) -> PathPoint | str:
    """Return the point at an arc length between two neighbouring points of a path, or the reason why there is none.

    Parameters
    ----------
    statics : LoadedStatics
        The scene at rest under a load factor.
    first, second : PathPoint
        Neighbouring points.
    way : float
        Arc length from the first point.
    """
    start, along = first.rest, first.direction
    at_factor = start.s + second.stride * along.s
    ends = along.s != 0.0 and abs(second.rest.s - at_factor) <= SUMMED * statics.reach
    return step_to(statics, first, way, start.s + way * along.s if ends else np.inf)


def _cosine(statics: LoadedStatics, first: Direction, second: Direction) -> float:
    nv, reach = len(statics.sizes), statics.reach
    return float(first.unknowns[:nv] @ (statics.measure * second.unknowns[:nv]) + first.s / reach * second.s / reach)
