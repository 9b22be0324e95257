"""Initial shapes of geometrically exact beams: frames of sections along the axis, and how elements turn between them.

A shape of given strains k(s) solves H' = H k on SE(3), by steps of fourth order of Magnus (Iserles, Munthe-Kaas,
Norsett and Zanna, Acta Numerica 9 (2000) 215); frames along a curve turn as little as possible (Wang, Juttler, Zheng
and Liu, ACM Trans. Graph. 27 (2008) 2, by double reflection).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.scene.geometry.rotations import quaternion_of_matrix

#: Steps within an element of a shape whose strains vary.
_STEPS = 8
#: Parts of a piece of a spline, between which frames are turned.
_PARTS = 64
_GAUSS = math.sqrt(3.0) / 6.0
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])


class Shape(Protocol):
    """An initial shape, of so many m."""

    @property
    def length(self) -> float: ...

    def between(self, start: Fraction, end: Fraction) -> tuple[Array, float]:
        """Return the logarithm, (6,), of the pose of the section at x = ``end`` m relative to the section at x =
        ``start`` m, and the angle of the turn between them, rad, which may be above half a turn."""
        ...


@dataclass(frozen=True)
class Bent:
    """A shape by its curvature, (3,), 1/m, section axes, at x; ``constant`` tells whether it is the same on a range."""

    length: float
    curvature: Callable[[float], Array]
    constant: Callable[[float, float], bool]

    def between(self, start: Fraction, end: Fraction) -> tuple[Array, float]:
        width, begin = float(end - start), float(start)
        if self.constant(begin, float(end)):
            strain = self._strain(begin + 0.5 * width)
            return width * strain, width * float(np.linalg.norm(strain[:3]))
        pose, turn, step = IDENTITY, 0.0, width / _STEPS
        for number in range(_STEPS):
            middle = begin + (number + 0.5) * step
            first, second = (self._strain(middle + sign * _GAUSS * step) for sign in (-1.0, 1.0))
            bracket = numeric.bracket_matrix(SE3, first) @ second
            increment = 0.5 * step * (first + second) + 0.5 * _GAUSS * step**2 * bracket
            pose = numeric.compose(SE3, pose, numeric.exp(SE3, increment))
            turn += float(np.linalg.norm(increment[:3]))
        return numeric.log(SE3, pose), turn

    def _strain(self, x: float) -> Array:
        return np.concatenate([self.curvature(x), [1.0, 0.0, 0.0]])


@dataclass(frozen=True)
class Joined:
    """A shape through poses, (count, 7), by helices, each with a length, m, > 0."""

    poses: Array
    lengths: Array

    @property
    def length(self) -> float:
        return float(np.sum(self.lengths))

    def between(self, start: Fraction, end: Fraction) -> tuple[Array, float]:
        first, last = float(start), float(end)
        ends = np.concatenate([[0.0], np.cumsum(self.lengths)])
        inner = [float(x) for x in ends[1:-1] if first < x < last]
        pose, turn = IDENTITY, 0.0
        for x, y in zip([first, *inner], [*inner, last], strict=True):
            piece = min(max(int(np.searchsorted(ends, 0.5 * (x + y), side="right")) - 1, 0), len(self.lengths) - 1)
            whole = relative_twist(self.poses[piece], self.poses[piece + 1])
            part = (y - x) / self.lengths[piece] * whole
            pose, turn = numeric.compose(SE3, pose, numeric.exp(SE3, part)), turn + float(np.linalg.norm(part[:3]))
        return numeric.log(SE3, pose), turn


@dataclass(frozen=True)
class Turned:
    """A shape with its sections turned about the axis by an angle at each x, rad."""

    shape: Shape
    angle: Callable[[float], float]

    @property
    def length(self) -> float:
        return self.shape.length

    def between(self, start: Fraction, end: Fraction) -> tuple[Array, float]:
        twist, turn = self.shape.between(start, end)
        before, after = self.angle(float(start)), self.angle(float(end))
        pose = numeric.compose(SE3, numeric.compose(SE3, _about_x(-before), numeric.exp(SE3, twist)), _about_x(after))
        return numeric.log(SE3, pose), turn + abs(after - before)


def relative_twist(first: Array, second: Array) -> Array:
    """Return the logarithm, (6,), of a pose in another, of at most half a turn."""
    return numeric.log(SE3, numeric.compose(SE3, numeric.inverse(SE3, first), second))


def _about_x(angle: float) -> Array:
    return np.array([math.cos(0.5 * angle), math.sin(0.5 * angle), 0.0, 0.0, 0.0, 0.0, 0.0])


def through_points(points: Array) -> Joined:
    """Return a shape along the cubic spline through points, (count, 3), that leaves the first one along x."""
    knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    slopes = _slopes(knots, points)
    places, tangents = [points[:1]], [slopes[:1]]
    for piece in range(len(points) - 1):
        place, tangent = _hermite(points[piece : piece + 2], slopes[piece : piece + 2], knots[piece + 1] - knots[piece])
        places.append(place)
        tangents.append(tangent)
    axis = np.concatenate(places)
    poses = _least_turning(axis, np.concatenate(tangents))
    return through_frames(poses)


def _slopes(knots: Array, points: Array) -> Array:
    """Return the derivatives of a spline at its knots: along x at the first one; the last two pieces are one cubic, or
    a single piece is a parabola."""
    widths = np.diff(knots)
    count = len(knots)
    matrix, right = np.zeros((count, count)), np.zeros((count, 3))
    matrix[0, 0], right[0] = 1.0, [1.0, 0.0, 0.0]
    for k in range(1, count - 1):
        before, after = 1.0 / widths[k - 1], 1.0 / widths[k]
        matrix[k, k - 1 : k + 2] = before, 2.0 * (before + after), after
        right[k] = 3.0 * (before**2 * (points[k] - points[k - 1]) + after**2 * (points[k + 1] - points[k]))
    chords = np.diff(points, axis=0) / widths[:, np.newaxis]
    if count == 2:
        matrix[1], right[1] = (1.0, 1.0), 2.0 * chords[0]
    else:
        share = (widths[-1] / widths[-2]) ** 2
        matrix[-1, -3:] = -share, 1.0 - share, 1.0
        right[-1] = 2.0 * (chords[-1] - share * chords[-2])
    return np.asarray(np.linalg.solve(matrix, right), dtype=float)


def _hermite(points: Array, slopes: Array, width: float) -> tuple[Array, Array]:
    """Return places and derivatives of one piece of a spline at the ends of its parts but the first."""
    u = np.arange(1, _PARTS + 1)[:, np.newaxis] / _PARTS
    (a, b), (c, d) = points, width * slopes
    place = (1 + 2 * u) * (1 - u) ** 2 * a + u * (1 - u) ** 2 * c + u**2 * (3 - 2 * u) * b + u**2 * (u - 1) * d
    rate = 6 * u * (1 - u) * (b - a) + (1 - u) * (1 - 3 * u) * c + u * (3 * u - 2) * d
    return place, rate / width


def _least_turning(axis: Array, tangents: Array) -> Array:
    """Return frames, (count, 7), with x along a curve and the least turn about it; the first is the beam's frame."""
    along = tangents / np.linalg.norm(tangents, axis=1)[:, np.newaxis]
    across = np.array([0.0, 1.0, 0.0])
    poses = [IDENTITY]
    for k in range(len(axis) - 1):
        first = axis[k + 1] - axis[k]
        mirrored, reflected = (_reflected(vector, first) for vector in (across, along[k]))
        across = _reflected(mirrored, along[k + 1] - reflected)
        y = across - along[k + 1] * (along[k + 1] @ across)
        y = y / np.linalg.norm(y)
        matrix = np.column_stack([along[k + 1], y, np.cross(along[k + 1], y)])
        poses.append(np.concatenate([quaternion_of_matrix(matrix.tolist()), axis[k + 1]]))
    return np.array(poses)


def _reflected(vector: Array, normal: Array) -> Array:
    square = float(normal @ normal)
    return vector if square < 1e-30 else vector - 2.0 / square * (normal @ vector) * normal


def through_frames(poses: Array) -> Joined:
    """Return a shape through frames, (count, 7)."""
    return Joined(poses, np.array([np.linalg.norm(relative_twist(*pair)[3:]) for pair in pairwise(poses)]))
