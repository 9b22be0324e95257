"""Places of bodies at the start of a run, from their joints alone, and notes on tyres deep in their road there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.text import key_of
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Symbol
from eomgen.lie.numeric import rotation_matrix
from eomgen.scene.forces.tyres import Tyre
from eomgen.scene.geometry.rotations import about_axis
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading.values import Values
from eomgen.system.description import BASE, Point


def tyres_in_the_road(
    tyres: Sequence[Tyre], points: Sequence[Point], places: Mapping[str, tuple[Array, Array]], values: Values
) -> list[str]:
    """Return a note on each tyre that starts deep in its road; inputs are zero there, and t is."""
    by_name, notes = {point.name: point for point in points}, []
    for tyre in tyres:
        point = by_name.get(tyre.center)
        if point is None or point.body not in places:
            continue
        turned, origin = places[point.body]
        place = origin + turned @ np.array([values.value(part) for part in point.position])

        def value_of(symbol: Symbol, place: Array = place) -> float:
            if symbol.kind == "position":
                return float(place[symbol.index])
            return values.parameters[symbol.name] if symbol.kind == "parameter" else 0.0

        try:
            road = evaluate(tyre.road, value_of)
        except (ArithmeticError, KeyError):
            continue
        radius, stiffness = values.value(tyre.radius), values.value(tyre.stiffness)
        if note := tyre.drawn().deep(float(place[2]), radius, road, stiffness):
            notes.append(f"{key_of('tyres', tyre.name)}: {note}")
    return notes


def initial_places(joints: Sequence[Joint], values: Values) -> dict[str, tuple[Array, Array]]:
    """Return orientation and position of the bodies at the start, as far as joints alone decide them."""
    result: dict[str, tuple[Array, Array]] = {BASE: (np.eye(3), np.zeros(3))}
    for joint in joints:
        moved = _moved(joint)
        if joint.parent not in result or moved is None or joint.mimic is not None or joint.drive:
            continue
        turned, origin = result[joint.parent]
        offset = np.array([values.value(part) for part in joint.position])
        axes = turned @ np.array(joint.orientation)
        place = origin + turned @ offset + axes @ moved[1]
        if np.all(np.isfinite(place)):
            result[joint.child] = axes @ moved[0], place
    return {name: place for name, place in result.items() if name != BASE}


def _moved(joint: Joint) -> tuple[Array, Array] | None:
    """Return rotation and translation of a joint at its initial position; None for types that are not checked."""
    q, axis = joint.initial_position, np.array(joint.axis)
    if not any(q):
        return np.eye(3), np.zeros(3)
    if joint.type == "free":
        return rotation_matrix(np.array(q[:4])), np.array(q[4:])
    if joint.type == "prismatic":
        return np.eye(3), q[0] * axis
    if joint.type == "revolute":
        return about_axis(axis, q[0]), np.zeros(3)
    return None
