"""Reading of the initial shapes of geometrically exact beams."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from eomgen.base.arrays import Array
from eomgen.scene.bodies import beam_schema as written
from eomgen.scene.bodies.beam_keys import Keys
from eomgen.scene.bodies.initial_shapes import Bent, Shape, Turned, relative_twist, through_frames, through_points
from eomgen.scene.geometry.rotations import quaternion_of
from eomgen.scene.reading.values import Values

#: How far from the beam's frame the first point or frame may be, by the size of the shape.
_AT_ORIGIN = 1e-9
#: Angle from x from which on the second point is behind the first one.
_BEHIND = 0.5 * math.pi
#: Least distance of a bend between chords from a reversal by half a turn, rad; nearer bends have no defined side.
_FOLDED = math.radians(5.0)
#: Largest angle from x of a piece between frames, rad, and the angle from which on a note reports it.
_OFF_AXIS, _OBLIQUE = math.radians(40.0), math.radians(3.0)


def read_shape(whole: Keys, values: Values) -> Shape | None:
    """Return the shape through given points or frames; None without a valid one."""
    given = whole.entry.shape
    if given is None:
        return None
    key, report = f"{whole.key}.shape", values.report
    if whole.entry.curvature is not None:
        report.add(f"{whole.key}.curvature", "curvature and shape are both given", "one of them")
    both = given.points is not None and given.frames is not None
    if both or (given.points is None and given.frames is None):
        fault = "points and frames are both given" if both else "the shape has neither points nor frames"
        report.add(key, fault, "one of them" if both else "points = [[0, 0, 0], [1, 0, 0], [2, 1, 0]]")
        return None
    if given.points is not None:
        return _through_points(f"{key}.points", given.points, values)
    return _through_frames(f"{key}.frames", given.frames or (), values)


def _through_points(key: str, given: Sequence[Sequence[float | str]], values: Values) -> Shape | None:
    points = np.array([values.constants(f"{key}[{place}]", point) for place, point in enumerate(given)])
    if not _several(key, "points", points, values):
        return None
    chord = points[1]
    if np.arctan2(np.hypot(chord[1], chord[2]), chord[0]) >= _BEHIND:
        fault = "the second point is not ahead of the first one, from where the beam leaves along x"
        values.report.add(f"{key}[1]", fault, "axes with x along the beam, and the rotation of its joint")
        return None
    chords = np.diff(points, axis=0)
    for place, (before, after) in enumerate(pairwise(chords), 1):
        turn = np.arctan2(float(np.linalg.norm(np.cross(before, after))), float(before @ after))
        if turn > math.pi - _FOLDED:
            fault = f"the points go back on themselves: by {math.degrees(turn):.4g} degrees"
            values.report.add(f"{key}[{place}]", fault, "points around the bend, closer together")
            return None
    return through_points(points)


def _through_frames(key: str, given: Sequence[written.ShapeFrame], values: Values) -> Shape | None:
    positions = np.array(
        [values.constants(f"{key}[{place}].position", item.position) for place, item in enumerate(given)]
    )
    if not _several(key, "frames", positions, values):
        return None
    turned = [values.constant_rotations(f"{key}[{place}].rotation", item.rotation) for place, item in enumerate(given)]
    quaternions = [quaternion_of(rotation) for rotation in turned if rotation is not None]
    if len(quaternions) < len(given):
        return None
    if abs(abs(quaternions[0][0]) - 1.0) > _AT_ORIGIN:
        fault = "the first frame is turned against the beam's, which it is"
        values.report.add(f"{key}[0].rotation", fault, "no rotation here, and that of the beam's joint")
        return None
    poses = np.column_stack([np.array(quaternions), positions])
    for place, (before, after) in enumerate(pairwise(turned), 1):
        twist = relative_twist(poses[place - 1], poses[place])
        turn = max(float(np.linalg.norm(twist[:3])), _turn_about_one_axis(before or (), after or ()))
        if turn > math.pi - _AT_ORIGIN:
            fault = f"the frame is turned by {math.degrees(turn):.6g} degrees against the one before"
            fault += ", and which way the beam goes round is told below 180 alone"
            values.report.add(f"{key}[{place}].rotation", fault, "a frame between them")
            return None
        off = math.atan2(float(np.hypot(twist[4], twist[5])), float(twist[3]))
        if off > _OFF_AXIS:
            fault = f"from the frame before to this one the axis goes {math.degrees(off):.6g} degrees off the x of both"
            values.report.add(f"{key}[{place}]", fault, "rotations with x along the beam, or points in place of frames")
            return None
        if off > _OBLIQUE:
            fault = f"up to here sections are {math.degrees(off):.3g} degrees off across the axis, and stiffnesses are"
            values.note([f"{key}[{place}]: {fault} in the axes of the sections"])
    return through_frames(poses)


def _turn_about_one_axis(before: Sequence[tuple[Array, float]], after: Sequence[tuple[Array, float]]) -> float:
    """Return the angle between two rotations about one common axis, which may be above half a turn; 0 for other
    rotations."""
    given = [*before, *after]
    if not given or len(before) > 1 or len(after) > 1:
        return 0.0
    axis = given[-1][0] / np.linalg.norm(given[-1][0])
    if any(np.linalg.norm(np.cross(axis, other)) > _AT_ORIGIN * np.linalg.norm(other) for other, _ in given):
        return 0.0
    first, second = (
        sum(math.copysign(angle, angle * float(axis @ other)) for other, angle in rotation)
        for rotation in (before, after)
    )
    return abs(second - first)


def _several(key: str, plural: str, places: Array, values: Values) -> bool:
    """Tell whether a list has two places or more, neighbours apart, the first at the beam's origin; report faults."""
    report = values.report
    if len(places) < 2:
        report.add(key, f"a shape needs two {plural} at least, not {len(places)}", "[0, 0, 0], and where the beam goes")
        return False
    if not np.all(np.isfinite(places)):
        return False
    apart = np.linalg.norm(np.diff(places, axis=0), axis=1)
    size = float(np.max(apart))
    if np.linalg.norm(places[0]) > _AT_ORIGIN * size:
        listed = ", ".join(f"{number:.6g}" for number in places[0])
        fault = f"the first of the {plural} is at [{listed}], and the origin of the beam's frame is there"
        report.add(f"{key}[0]", fault, "[0, 0, 0]; the place of the beam is that of its joint")
        return False
    if float(np.min(apart)) <= _AT_ORIGIN * size:
        place = int(np.argmin(apart))
        report.add(f"{key}[{place + 1}]", f"two of the {plural} one behind the other are at one place", "one of them")
        return False
    return True


def bent_shape(pieces: Sequence[tuple[float, Keys]], values: Values) -> Shape:
    """Return the shape of given curvature; ``pieces``: end of each piece, m, and its keys."""
    ends = [end for end, _ in pieces]
    length = ends[-1]
    straight = np.zeros(3)

    def at(x: float) -> tuple[Array, bool]:
        keys = pieces[min(bisect_right(ends, x), len(pieces) - 1)][1]
        given = keys["curvature"]
        if given is None or values.report.concerns(keys.of("curvature")):
            return straight, False
        there = values.at(x / length)
        numbers = np.array(there.constants(keys.of("curvature"), given))
        return (numbers if np.all(np.isfinite(numbers)) else straight), bool(there.varied)

    return Bent(length, lambda x: at(x)[0], lambda start, end: not at(0.5 * (start + end))[1])


def pretwisted(whole: Keys, shape: Shape, values: Values) -> Shape:
    """Return a shape with the sections turned about its axis as the beam says."""
    given, key = whole.entry.pretwist, f"{whole.key}.pretwist"
    if given is None:
        return shape

    def angle(x: float) -> float:
        if values.report.concerns(key):
            return 0.0
        number = values.at(x / shape.length).constant(key, given)
        return number if math.isfinite(number) else 0.0

    at_start = angle(0.0)
    if abs(at_start) > _AT_ORIGIN:
        fault = f"the pretwist is {at_start:.6g} rad at s = 0, where the sections have the axes of the beam's frame"
        hint = "the angle from there on, and the rest as rotation of the joint"
        if angle(shape.length) == at_start:
            hint = f'"{at_start:.6g} * s" for that much up to the other end, or a rotation of the joint'
        values.report.add(key, fault, hint)
    return Turned(shape, angle)
