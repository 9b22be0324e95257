"""Critical points of equilibria: limit points and bifurcations of a path, by signs of the stiffness alone, and linear
buckling loads.

Between two points of a path the load factor turns round (a limit point), or the number of negative stiffnesses changes
(a bifurcation, if the factor does not turn round). Each stiffness that changes its sign is located by Brent's method
along the path; stiffnesses with a common zero belong to one bifurcation: R. Seydel, Practical Bifurcation and Stability
Analysis (2010), chapter 5.

(K + mu K') phi = 0, K' being the derivative of the tangent stiffness along the path: Z. P. Bazant and L. Cedolin,
Stability of Structures (1991), section 4.4.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np
import scipy.linalg
from scipy.optimize import brentq
from scipy.sparse import csc_array
from scipy.sparse.linalg import LinearOperator, eigs

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass
from eomgen.base.rounding import SUMMED, WRITTEN
from eomgen.solvers.bordered_newton import WHOLE, LoadedState, LoadedStatics, correct, direction, held_factor, sparse
from eomgen.solvers.equilibrium_path import PathPoint, point_within
from eomgen.solvers.tangent_stiffness import Components, TangentStiffness, canonical_direction, compliance

Kind = Literal["limit point", "bifurcation"]


@dataclass(frozen=True)
class CriticalPoint:
    """A point at which a path loses or regains stability.

    Attributes
    ----------
    kind : ``limit point``, if the load factor turns round, or ``bifurcation``
    point : state and direction of the path there
    modes : (nv, n) displacements with zero stiffness, the largest component of each 1 (rad, or the scene's length)
    """

    kind: Kind
    point: PathPoint
    modes: Array


@dataclass(frozen=True)
class ExaminedPoint:
    """A point of a path, and the stiffness there."""

    point: PathPoint
    stiffness: TangentStiffness


def examined(statics: LoadedStatics, point: PathPoint) -> ExaminedPoint:
    """Return a point of the path with the stiffness at this point."""
    return ExaminedPoint(point, TangentStiffness.at(statics, point.rest))


def lowest_frequency_squared(statics: LoadedStatics, examined: ExaminedPoint) -> float:
    """Return the real eigenvalue nearest to zero of the stiffness relative to the mass, (rad/s)^2; NaN without a real
    one."""
    values, _ = examined.stiffness.next_to_zero(1, statics.mass(examined.point.rest))
    return float(values[0]) if len(values) else np.nan


def critical_points(statics: LoadedStatics, before: ExaminedPoint, after: ExaminedPoint) -> list[CriticalPoint]:
    """Return the critical points between two neighbouring points of a path, in order: a limit point if the load factor
    turns round, and bifurcations before and after it. A limit point stands alone if the number of negative stiffnesses
    changes by one."""
    way = after.point.stride
    if before.point.direction.s * after.point.direction.s >= 0.0:
        return _bifurcations(statics, before, after, (0.0, before), (way, after))
    turning = _StepFunction(statics, before.point, after.point, lambda examined_point: examined_point.point.direction.s)
    turn, at = turning.root((0.0, before.point.direction.s), (way, after.point.direction.s), before, after)
    limit = CriticalPoint("limit point", at.point, _modes(at, 1))
    if abs(before.stiffness.negative - after.stiffness.negative) == 1:
        return [limit]
    sides = [turn + sign * 1e-3 * way for sign in (-1.0, 1.0)]
    near = [turning.examined(side) if 0.0 < side < way else None for side in sides]
    below = _bifurcations(statics, before, after, (0.0, before), (sides[0], near[0])) if near[0] else []
    above = _bifurcations(statics, before, after, (sides[1], near[1]), (way, after)) if near[1] else []
    return [*below, limit, *above]


def scaled_mode(sizes: Array, mode: Array) -> Array:
    """Return a displacement whose largest component is 1: 1 rad, or the scene's length."""
    parts = mode / sizes
    largest = parts[int(np.argmax(np.abs(parts)))]
    return mode / largest if largest else mode


class _LostPointError(Exception):
    """Error for a point that was not found between two points of a path."""


class _StepFunction:
    """A number, given by ``value`` of an examined point, as a function of the arc length between two points of a
    path."""

    def __init__(
        self, statics: LoadedStatics, first: PathPoint, second: PathPoint, value: Callable[[ExaminedPoint], float]
    ) -> None:
        self._statics, self._first, self._second, self._value = statics, first, second, value
        self._known: dict[float, ExaminedPoint] = {}

    def examined(self, way: float) -> ExaminedPoint | None:
        """Return the examined point at an arc length; None if the correction fails. Points found once are kept."""
        if way not in self._known:
            reached = point_within(self._statics, self._first, self._second, way)
            if isinstance(reached, str):
                return None
            self._known[way] = examined(self._statics, reached)
        return self._known[way]

    def root(
        self, low: tuple[float, float], high: tuple[float, float], first: ExaminedPoint, second: ExaminedPoint
    ) -> tuple[float, ExaminedPoint]:
        """Return the arc length at which the number is zero, and the examined point nearest to it. ``low`` and ``high``
        are pairs of arc length and number, of opposite signs, at the points ``first`` and ``second``. If no point is
        found next to the root, the arc length is interpolated."""
        tried = {low[0]: low[1], high[0]: high[1]}
        self._known.update({low[0]: first, high[0]: second})

        def value(way: float) -> float:
            if way not in tried:
                if (point := self.examined(way)) is None:
                    raise _LostPointError
                tried[way] = self._value(point)
            return tried[way]

        try:
            where = float(brentq(value, low[0], high[0], xtol=SUMMED * self._second.stride, rtol=SUMMED))
        except _LostPointError:  # singular at the root: interpolate linearly between neighbours
            negative = max((way for way in tried if tried[way] * low[1] > 0.0), default=low[0])
            positive = min((way for way in tried if tried[way] * high[1] > 0.0), default=high[0])
            share = tried[negative] / (tried[negative] - tried[positive])
            where = negative + share * (positive - negative)
        nearest = min(self._known, key=lambda way: abs(way - where))
        return where, self._known[nearest]


#: Arc length from the start of a step, and the point there.
_Located = tuple[float, ExaminedPoint]


def _bifurcations(
    statics: LoadedStatics, first: ExaminedPoint, second: ExaminedPoint, low: _Located, high: _Located
) -> list[CriticalPoint]:
    """Return the bifurcations, in order, between ``low`` and ``high`` within the step from ``first`` to ``second``.
    Stiffnesses with a common zero make one bifurcation."""
    below, above = low[1].stiffness, high[1].stiffness
    if below.negative == above.negative and below.symmetric == above.symmetric:
        return []
    located: list[_Located] = []
    for value in _sign_changes(below, above):
        along = _StepFunction(statics, first.point, second.point, value)
        ends = [(way, value(examined_end)) for way, examined_end in (low, high)]
        if ends[0][1] * ends[1][1] < 0.0:
            located.append(along.root(ends[0], ends[1], low[1], high[1]))
    located.sort(key=lambda item: item[0])
    points: list[CriticalPoint] = []
    apart = WRITTEN * second.point.stride
    while located:
        together = [item for item in located if item[0] - located[0][0] <= apart]
        located = located[len(together) :]
        at = together[len(together) // 2][1]
        points.append(CriticalPoint("bifurcation", at.point, _modes(at, len(together))))
    return points


def _sign_changes(below: TangentStiffness, above: TangentStiffness) -> list[Callable[[ExaminedPoint], float]]:
    """Return functions of examined points, one for each stiffness that changes sign between two points, with the same
    root: eigenvalues if both stiffnesses are symmetric, else determinants by group of components."""
    if below.symmetric and above.symmetric:
        numbers = range(min(below.negative, above.negative), max(below.negative, above.negative))
        neutral = min(below.neutral, above.neutral)
        return [partial(_eigenvalue, number, len(numbers) + 2, neutral) for number in numbers]
    groups = below.groups(above)
    signs = enumerate(zip(below.determinants(groups), above.determinants(groups), strict=True))
    return [partial(_determinant, group, groups, was[1]) for group, (was, now) in signs if was[0] * now[0] < 0]


def _eigenvalue(number: int, count: int, neutral: int, point: ExaminedPoint) -> float:
    """Return the eigenvalue of rank ``number`` (from the lowest) of the stiffness at a point; ``count`` eigenvalues
    next to zero are computed, and ``neutral`` zero ones left out."""
    negative = point.stiffness.negative if neutral else point.stiffness.below(0.0)
    values = point.stiffness.next_to_zero(count + neutral)[0][neutral:]
    sign = -1.0 if number < negative else 1.0
    alike = np.sort(np.abs(values[sign * values > 0.0]))
    index = negative - number - 1 if number < negative else number - negative
    far = float(np.max(np.abs(values[np.isfinite(values)]), initial=1.0))
    return sign * (float(alike[index]) if index < len(alike) else far)


def _determinant(group: int, groups: Components, logarithm: float, point: ExaminedPoint) -> float:
    """Return the determinant of a group of components at a point, divided by exp(logarithm)."""
    sign, now = point.stiffness.determinants(groups)[group]
    return sign * float(np.exp(np.clip(now - logarithm, -600.0, 600.0)))


def _modes(at: ExaminedPoint, count: int) -> Array:
    """Return the displacements with the ``count`` smallest stiffnesses, (nv, n), canonical, so that rounding does not
    change them; one column of zeros without any."""
    stiffness, result = at.stiffness, []
    directions = stiffness.next_to_zero(count)[1][:, :count]
    if not directions.shape[1]:
        return np.zeros((len(stiffness.sizes), 1))
    while directions.shape[1]:
        mode = canonical_direction(directions, stiffness.sizes)
        result.append(mode)
        scaled = directions / stiffness.sizes[:, np.newaxis]
        unit = mode / stiffness.sizes / np.linalg.norm(mode / stiffness.sizes)
        left, sizes, _ = np.linalg.svd(scaled - np.outer(unit, unit @ scaled), full_matrices=False)
        directions = stiffness.sizes[:, np.newaxis] * left[:, : directions.shape[1] - 1]
        if not sizes.size or sizes[0] == 0.0:
            break
    return np.array(result).T


#: Later changes of the load factor for the derivative of the stiffness, as a part of the lowest buckling load.
_PART = 0.02


def linear_buckling(statics: LoadedStatics, rest: LoadedState, count: int) -> tuple[Array, Array]:
    """Return changes mu of the load factor from a preload to linear buckling, (n,), smallest size first, and modes,
    (nv, n), whose largest component is 1 rad or the scene's length. ``rest`` is the preload, ``count`` the largest n.

    Raises
    ------
    ArithmeticError
        The stiffness is singular already, the path has no tangent, or there is no equilibrium near the preload.
    """
    change = 1e-2 * statics.reach
    factors, modes = np.zeros(0), np.zeros((len(statics.sizes), 0))
    for _ in range(3):
        factors, modes = _factors(statics, rest, change, count)
        if not len(factors):
            break
        wanted = _PART * float(np.abs(factors[0]))
        if 0.5 * change <= wanted <= 2.0 * change:
            break
        change = wanted
    scaled = [scaled_mode(statics.sizes, mode) for mode in modes.T]
    return factors, np.array(scaled).T.reshape(len(statics.sizes), len(scaled))


def load_scale(statics: LoadedStatics, rest: LoadedState) -> float:
    """Return the order of magnitude of the load factor's change that displaces the softest motion by 1 rad or by the
    scene's length; 0 if the load or the stiffness is without effect."""
    tangents = statics.tangents(rest)
    solve = compliance(tangents.K, tangents.B)
    force = float(np.linalg.norm(statics.by_factor(rest).residual * statics.sizes))
    if solve is None or not force > 0.0:
        return 0.0
    along, softness = np.ones(len(statics.sizes)), 0.0
    for _ in range(3):  # inverse iteration: the order of magnitude is enough
        along = solve(along / statics.sizes) / statics.sizes
        softness = float(np.linalg.norm(along))
        if not np.isfinite(softness) or softness == 0.0:
            return 0.0
        along = along / softness
    return 1.0 / (softness * force)


def half_way(statics: LoadedStatics, rest: LoadedState, factor: float) -> float | None:
    """Return the critical load factor minus the present one, as ``linear_buckling`` predicts it at half of ``factor``.
    It equals ``factor`` if the structure keeps its shape. None without an equilibrium at half of ``factor``, or without
    a prediction."""
    onwards = direction(statics, rest, held_factor(statics, rest))
    if onwards is None or onwards.s == 0.0:
        return None
    point = correct(statics, rest, onwards, 0.5 * factor / onwards.s, held_factor(statics, rest))
    if point.trouble:
        return None
    try:
        factors, _ = _factors(statics, point.rest, _PART * abs(factor), 4)
    except ArithmeticError:
        return None
    changes = point.rest.s - rest.s + factors
    return float(changes[np.argmin(np.abs(changes - factor))]) if len(changes) else None


def _rate(statics: LoadedStatics, rest: LoadedState, change: float) -> csc_array:
    """Return K' = dK/d(load factor), (nv, nv), by central differences over ``change`` along the path. Raises
    ArithmeticError without a tangent of the path, or without an equilibrium nearby."""
    onwards = direction(statics, rest, held_factor(statics, rest))
    if onwards is None or onwards.s == 0.0:
        raise ArithmeticError("the tangent stiffness is singular there [E2086]")
    ends = []
    for sign in (1.0, -1.0):
        way = sign * change / onwards.s
        point = correct(statics, rest, onwards, way, held_factor(statics, rest))
        if point.trouble:
            raise ArithmeticError(f"there is no equilibrium near it: {point.trouble}")
        ends.append(sparse(statics.tangents(point.rest).K))
    return csc_array((ends[0] - ends[1]) / (2.0 * change))


def _factors(statics: LoadedStatics, rest: LoadedState, change: float, count: int) -> tuple[Array, Array]:
    """Return the real mu of (K + mu K') phi = 0 under the constraints, smallest size first, at most ``count``, and the
    phi as columns; ``change`` as of ``_rate``. Raises ArithmeticError for a singular K."""
    rate, tangents = _rate(statics, rest, change), statics.tangents(rest)
    nv = len(statics.sizes)
    solve = compliance(sparse(tangents.K), sparse(tangents.B))
    if solve is None:
        raise ArithmeticError("the tangent stiffness is singular there [E2086]")
    if nv <= WHOLE:
        values, vectors = scipy.linalg.eig(solve(rate.toarray()))
    else:
        operator = LinearOperator((nv, nv), matvec=lambda x: solve(rate @ x), dtype=float)
        values, vectors = eigs(operator, k=min(2 * count + 4, nv - 2), which="LM", v0=np.ones(nv))
    inverse: Complex = np.asarray(values, complex)
    mu = -np.divide(1.0, inverse, out=np.full_like(inverse, np.inf), where=inverse != 0.0)
    kept = np.isfinite(mu) & (np.abs(mu.imag) <= WRITTEN * np.abs(mu))
    kept &= np.abs(inverse) > np.max(np.abs(inverse)) / 1e8
    sizes = np.abs(mu) * np.where(mu.real < 0.0, 1.0 + WRITTEN, 1.0)  # of two of the same size the positive one first
    order = [k for k in np.argsort(sizes, kind="stable") if kept[k]][:count]
    return mu.real[order], np.asarray(vectors).real[:, order]
