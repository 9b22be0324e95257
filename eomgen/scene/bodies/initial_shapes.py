"""Initial shapes of geometrically exact beams and their reading: frames of sections along the axis, and how elements
turn between them.

A shape of given strains k(s) solves H' = H k on SE(3), by steps of fourth order of Magnus (Iserles, Munthe-Kaas,
Norsett and Zanna, Acta Numerica 9 (2000) 215); frames along a curve turn as little as possible (Wang, Juttler, Zheng
and Liu, ACM Trans. Graph. 27 (2008) 2, by double reflection).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED
from eomgen.formula.nodes import Formula
from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.scene.reading.values import Values
from eomgen.scene.rotations import quaternion_of, quaternion_of_matrix

if TYPE_CHECKING:
    from eomgen.scene.bodies import beam_schema as written
    from eomgen.scene.bodies.beam_schema import BeamKeys

_GAUSS = math.sqrt(3.0) / 6.0
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])


class InitialShape(Protocol):
    """An initial shape with a length in m."""

    @property
    def length(self) -> float: ...

    def between(self, start: Fraction, end: Fraction) -> tuple[Array, float]:
        """Return the logarithm, (6,), of the pose of the section at x = ``end`` m relative to the section at x =
        ``start`` m, and the rotation angle between both sections, rad, which may exceed half a turn."""
        ...


@dataclass(frozen=True)
class CurvatureShape:
    """Axis of a beam given by its curvature.

    Attributes
    ----------
    length : m
    curvature : function of x, m along the axis, that returns the curvature vector (3,), 1/m, in section axes
    constant : function of both ends of a range of x that returns whether the curvature is constant between them
    knots : x, in order, at which the curvature jumps or bends
    """

    length: float
    curvature: Callable[[float], Array]
    constant: Callable[[float, float], bool]
    knots: Sequence[float] = ()

    def between(self, start: Fraction, end: Fraction) -> tuple[Array, float]:
        """Return the logarithm (6,) of the pose of the section at x = ``end`` relative to the section at ``start``, m,
        and the length of the rotation along the way, rad."""
        width, begin = float(end - start), float(start)
        if self.constant(begin, float(end)):
            strain = self._strain(begin + 0.5 * width)
            return width * strain, width * float(np.linalg.norm(strain[:3]))
        pose, turn = IDENTITY, 0.0
        for low, high in pairwise([begin, *(knot for knot in self.knots if begin < knot < float(end)), float(end)]):
            step = (high - low) / 8
            for number in range(8):
                middle = low + (number + 0.5) * step
                first, second = (self._strain(middle + sign * _GAUSS * step) for sign in (-1.0, 1.0))
                bracket = numeric.bracket_matrix(SE3, first) @ second
                increment = 0.5 * step * (first + second) + 0.5 * _GAUSS * step**2 * bracket
                pose = numeric.compose(SE3, pose, numeric.exp(SE3, increment))
                turn += float(np.linalg.norm(increment[:3]))
        return numeric.log(SE3, pose), turn

    def _strain(self, x: float) -> Array:
        return np.concatenate([self.curvature(x), [1.0, 0.0, 0.0]])


@dataclass(frozen=True)
class HelixShape:
    """A shape through poses, (count, 7), quaternion first, by helices between them, with the lengths (count - 1,), m, >
    0."""

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
            whole = numeric.difference(SE3, self.poses[piece], self.poses[piece + 1])
            part = (y - x) / self.lengths[piece] * whole
            pose, turn = numeric.compose(SE3, pose, numeric.exp(SE3, part)), turn + float(np.linalg.norm(part[:3]))
        return numeric.log(SE3, pose), turn


@dataclass(frozen=True)
class RotatedSectionShape:
    """A shape with sections rotated about the axis by an angle, rad, a function of x in m along the axis."""

    shape: InitialShape
    angle: Callable[[float], float]

    @property
    def length(self) -> float:
        return self.shape.length

    def between(self, start: Fraction, end: Fraction) -> tuple[Array, float]:
        twist, turn = self.shape.between(start, end)
        before, after = self.angle(float(start)), self.angle(float(end))
        pose = numeric.compose(SE3, numeric.compose(SE3, _about_x(-before), numeric.exp(SE3, twist)), _about_x(after))
        return numeric.log(SE3, pose), turn + abs(after - before)


def _about_x(angle: float) -> Array:
    return np.array([math.cos(0.5 * angle), math.sin(0.5 * angle), 0.0, 0.0, 0.0, 0.0, 0.0])


def through_points(points: Array) -> HelixShape:
    """Return a shape along the cubic spline through points, (count, 3), that leaves the first point along x."""
    knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    curve = _spline(knots, points)
    share = np.arange(64) / 64  # parts of a piece, between which frames are turned
    at = np.append((knots[:-1, np.newaxis] + share * np.diff(knots)[:, np.newaxis]).ravel(), knots[-1])
    return through_frames(_least_turning(curve(at), curve(at, 1)))


def _spline(knots: Array, points: Array) -> Any:
    """Return the cubic spline through points (count, 3) at the knots (count,), along x at the first knot; the last two
    pieces are one cubic, a single piece is a parabola."""
    from scipy.interpolate import CubicHermiteSpline, CubicSpline  # noqa: PLC0415  # few beams have points

    ahead = np.array([1.0, 0.0, 0.0])
    if len(points) > 2:
        return CubicSpline(knots, points, bc_type=((1, ahead), "not-a-knot"))
    return CubicHermiteSpline(knots, points, [ahead, 2.0 * (points[1] - points[0]) / knots[1] - ahead])


def _least_turning(axis: Array, tangents: Array) -> Array:
    """Return poses (count, 7) at the places ``axis`` (count, 3) of a curve, with x along its tangents (count, 3) and
    the least rotation about the curve; the first pose is the identity."""
    along = tangents / np.linalg.norm(tangents, axis=1)[:, np.newaxis]
    across = np.array([0.0, 1.0, 0.0])
    poses = [IDENTITY]
    for k in range(len(axis) - 1):
        first = axis[k + 1] - axis[k]
        mirrored, reflected = (_reflect(vector, first) for vector in (across, along[k]))
        across = _reflect(mirrored, along[k + 1] - reflected)
        y = across - along[k + 1] * (along[k + 1] @ across)
        y = y / np.linalg.norm(y)
        matrix = np.column_stack([along[k + 1], y, np.cross(along[k + 1], y)])
        poses.append(np.concatenate([quaternion_of_matrix(matrix.tolist()), axis[k + 1]]))
    return np.array(poses)


def _reflect(vector: Array, normal: Array) -> Array:
    square = float(normal @ normal)
    return vector if square < 1e-30 else vector - 2.0 / square * (normal @ vector) * normal


def through_frames(poses: Array) -> HelixShape:
    """Return a shape through frames, (count, 7)."""
    return HelixShape(poses, np.array([np.linalg.norm(numeric.difference(SE3, *pair)[3:]) for pair in pairwise(poses)]))


#: Angle from x above which the second point has the smaller x.
_BEHIND = 0.5 * math.pi
#: Least distance of a bend between chords from a reversal by half a turn, rad; nearer bends have no defined side.
_FOLDED = math.radians(5.0)
#: Largest angle from x of a piece between frames, rad, and the angle above which a note reports the piece.
_OFF_AXIS, _OBLIQUE = math.radians(40.0), math.radians(3.0)


def read_shape(whole: BeamKeys, values: Values) -> InitialShape | None:
    """Return the initial shape through the points or frames in the entry of a beam; None without the key ``shape``, and
    for a faulty shape, which is reported."""
    entry = whole.entry.shape
    if entry is None:
        return None
    key, report = f"{whole.key}.shape", values.report
    if whole.entry.curvature is not None:
        report.add(f"{whole.key}.curvature", "curvature and shape are both given [E1356]", "one of them")
    both = entry.points is not None and entry.frames is not None
    if both or (entry.points is None and entry.frames is None):
        fault = "points and frames are given [E1357]" if both else "the shape has neither points nor frames [E1358]"
        report.add(key, fault, "one of them" if both else "points = [[0, 0, 0], [1, 0, 0], [2, 1, 0]]")
        return None
    if entry.points is not None:
        return _through_points(f"{key}.points", entry.points, values)
    return _through_frames(f"{key}.frames", entry.frames or (), values)


def _through_points(key: str, entries: Sequence[Sequence[float | str]], values: Values) -> InitialShape | None:
    """Return the shape along a spline through points, formulas of fixed parameters in m, in the axes of the beam's
    frame.

    None, after a report at ``key``, for fewer than two points, a first point off the origin of the frame, two
    successive points at one place, a second point that is not ahead of the first (along x), and points that go back on
    themselves. None also for values that are not finite, which are reported elsewhere.
    """
    points = np.array([values.constants(f"{key}[{index}]", point) for index, point in enumerate(entries)])
    if not _several(key, "points", points, values):
        return None
    chord = points[1]
    if np.arctan2(np.hypot(chord[1], chord[2]), chord[0]) >= _BEHIND:
        fault = "the second point is not ahead of the first one, from where the beam leaves along x [E1359]"
        values.report.add(f"{key}[1]", fault, "axes with x along the beam, and the rotation of its joint")
        return None
    chords = np.diff(points, axis=0)
    for index, (before, after) in enumerate(pairwise(chords), 1):
        turn = np.arctan2(float(np.linalg.norm(np.cross(before, after))), float(before @ after))
        if turn > math.pi - _FOLDED:
            fault = f"the points go back on themselves: by {math.degrees(turn):.4g} degrees [E1360]"
            values.report.add(f"{key}[{index}]", fault, "points around the bend, closer together")
            return None
    return through_points(points)


def _through_frames(key: str, frames: Sequence[written.ShapeFrame], values: Values) -> InitialShape | None:
    """Return the shape through frames; a piece that is oblique by more than 3 degrees is noted.

    None, after a report, for fewer than two frames, two successive frames at one place, a first frame that is not the
    beam's, a turn of 180 degrees or more between frames, and a piece that is more than 40 degrees off the x of its
    frames. None also for values that are not finite, which are reported elsewhere.
    """
    positions = np.array(
        [values.constants(f"{key}[{index}].position", item.position) for index, item in enumerate(frames)]
    )
    if not _several(key, "frames", positions, values):
        return None
    turned = [values.constant_rotations(f"{key}[{index}].rotation", item.rotation) for index, item in enumerate(frames)]
    quaternions = [quaternion_of(rotation) for rotation in turned if rotation is not None]
    if len(quaternions) < len(frames):
        return None
    if abs(abs(quaternions[0][0]) - 1.0) > COMPUTED:
        fault = "the first frame is turned relative to the beam's frame, which it has to equal [E1361]"
        values.report.add(f"{key}[0].rotation", fault, "no rotation here; the beam's joint has one")
        return None
    poses = np.column_stack([np.array(quaternions), positions])
    for index, (before, after) in enumerate(pairwise(turned), 1):
        twist = numeric.difference(SE3, poses[index - 1], poses[index])
        turn = max(float(np.linalg.norm(twist[:3])), _turn_about_one_axis(before or (), after or ()))
        if turn > math.pi - COMPUTED:
            fault = f"the turn from the frame before by {math.degrees(turn):.6g} degrees is not below 180 [E1362]"
            values.report.add(f"{key}[{index}].rotation", fault, "a frame between them")
            return None
        off = math.atan2(float(np.hypot(twist[4], twist[5])), float(twist[3]))
        if off > _OFF_AXIS:
            fault = f"from the frame before the axis goes {math.degrees(off):.6g} degrees off the x of both [E1363]"
            values.report.add(f"{key}[{index}]", fault, "rotations with x along the beam, or points in place of frames")
            return None
        if off > _OBLIQUE:
            fault = f"up to here sections, whose axes stiffnesses have, are {math.degrees(off):.3g} degrees"
            values.note([f"{key}[{index}]: {fault} off across the axis [E1364]"])
    return through_frames(poses)


def _turn_about_one_axis(before: Sequence[tuple[Array, float]], after: Sequence[tuple[Array, float]]) -> float:
    """Return the angle, rad, between two rotations about one common axis, which may be above half a turn; 0 for other
    rotations. Each is a sequence of at most one pair of axis and angle."""
    pairs = [*before, *after]
    if not pairs or len(before) > 1 or len(after) > 1:
        return 0.0
    axis = pairs[-1][0] / np.linalg.norm(pairs[-1][0])
    if any(np.linalg.norm(np.cross(axis, along)) > COMPUTED * np.linalg.norm(along) for along, _ in pairs):
        return 0.0
    first, second = (
        sum(math.copysign(angle, angle * float(axis @ along)) for along, angle in rotation)
        for rotation in (before, after)
    )
    return abs(second - first)


def _several(key: str, plural: str, places: Array, values: Values) -> bool:
    """Return whether places (count, 3) are at least two, with distinct neighbours, the first at the beam's origin;
    faults are reported at ``key``, values that are not finite elsewhere. ``plural`` is the noun for messages."""
    report = values.report
    if len(places) < 2:
        fault = f"a shape needs two {plural} at least, not {len(places)} [E1365]"
        report.add(key, fault, "[0, 0, 0], and where the beam goes")
        return False
    if not np.all(np.isfinite(places)):
        return False
    distances = np.linalg.norm(np.diff(places, axis=0), axis=1)
    size = float(np.max(distances))
    if np.linalg.norm(places[0]) > COMPUTED * size:
        listed = ", ".join(f"{number:.6g}" for number in places[0])
        fault = f"the first of the {plural} is at [{listed}], and the origin of the beam's frame is there [E1366]"
        report.add(f"{key}[0]", fault, "[0, 0, 0]; the joint of the beam says its place")
        return False
    if float(np.min(distances)) <= COMPUTED * size:
        index = int(np.argmin(distances))
        report.add(f"{key}[{index + 1}]", f"two of the {plural} in succession are at one place [E1367]", "one of them")
        return False
    return True


def bent_shape(pieces: Sequence[tuple[float, BeamKeys]], values: Values) -> InitialShape:
    """Return the shape by the key ``curvature`` of a beam and its parts; ``pieces``: x of the end of each piece, m, and
    the keys. Faulty and missing curvatures count as straight."""
    ends = [end for end, _ in pieces]
    length = ends[-1]
    straight = np.zeros(3)

    def at(x: float) -> tuple[Array, Mapping[str, Formula]]:
        keys = pieces[min(bisect_right(ends, x), len(pieces) - 1)][1]
        value = keys["curvature"]
        if value is None or values.report.concerns(keys.of("curvature")):
            return straight, {}
        there = values.at(x / length)
        numbers = np.array(there.constants(keys.of("curvature"), value))
        return (numbers if np.all(np.isfinite(numbers)) else straight), there.varied

    knots: list[float] = []
    for start, end in pairwise([0.0, *ends]):
        inside = values.knots(at(0.5 * (start + end))[1].values())
        knots += [length * s for s in inside if start < length * s < end]
    return CurvatureShape(length, lambda x: at(x)[0], lambda start, end: not at(0.5 * (start + end))[1], knots)


def pretwist(whole: BeamKeys, shape: InitialShape, values: Values) -> InitialShape:
    """Return a shape whose sections are rotated about the axis by the pretwist of the beam, a function of s; the given
    shape without one. A pretwist other than 0 at s = 0 is reported."""
    value, key = whole.entry.pretwist, f"{whole.key}.pretwist"
    if value is None:
        return shape

    def angle(x: float) -> float:
        if values.report.concerns(key):
            return 0.0
        number = values.at(x / shape.length).constant(key, value)
        return number if math.isfinite(number) else 0.0

    at_start = angle(0.0)
    if abs(at_start) > COMPUTED:
        fault = f"the pretwist is {at_start:.6g} rad at s = 0, where sections have the axes of the beam [E1368]"
        hint = "the angle from there on, and the rest as rotation of the joint"
        if angle(shape.length) == at_start:
            hint = f'"{at_start:.6g} * s" for that much up to the other end, or a rotation of the joint'
        values.report.add(key, fault, hint)
    return RotatedSectionShape(shape, angle)
