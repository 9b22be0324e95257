"""Warnings of a static equilibrium at the end of a path: springs and tyres that are inside out, beams with too few
elements, ways longer than the scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.compiled.rest.state_warnings import Rest, SceneMeasures, StateWarning
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Symbol
from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.lie.numeric import rotated
from eomgen.system.description import WORLD, Wheel

PASSED = Limit(0.05, "1", "distance of the ends of a spring in parts of the distance at start and rest", "a choice")
LONGER = Limit(1.1, "1", "displacement in parts of the size of the scene", "a choice")
#: Signs that make the inverse of a quaternion.
_BACK = np.array([1.0, -1.0, -1.0, -1.0])
_LISTED = 4
COARSE = Limit(0.01, "1", "estimated error of displacements of a beam in parts", "the error at which hints aim")


def _positions(measures: SceneMeasures, poses: Mapping[str, tuple[Array, Array]]) -> dict[str, tuple[str, Array]]:
    """Return body and world position (rows, 3) of each point."""
    points = measures.model.description.drawing.points
    if not points:
        return {}
    turns, origins = (np.array([poses[point.body][part] for point in points]) for part in (0, 1))
    local = np.array([measures.vector(point.position) for point in points])
    positions = origins + rotated(turns, local[:, np.newaxis])
    return {point.name: (point.body, position) for point, position in zip(points, positions, strict=True)}


def _springs(rest: Rest) -> list[str]:
    """Return a note on springs inside out and one on springs whose ends have moved farther than their distance at the
    start; empty without such springs."""
    measures, poses = rest.measures, rest.poses
    springs = measures.model.description.drawing.lines
    if not springs:
        return []
    points = _positions(measures, poses)
    ends = [[points[name] for name in (spring.first, spring.second)] for spring in springs]
    turns = np.array([[poses[body][0] * _BACK for body, _ in pair] for pair in ends])
    vectors = np.array([end - start for (_, start), (_, end) in ends])
    in_bodies = rotated(turns, vectors[:, np.newaxis])  # (springs, 2, rows, 3)
    apart = np.linalg.norm(in_bodies[:, 0, 0], axis=-1)
    travel = np.min(np.linalg.norm(in_bodies[:, :, -1] - in_bodies[:, :, 0], axis=-1), axis=1)
    turned = np.all(_passed_one_another(in_bodies), axis=1)
    passed = [spring.name for spring, inside_out in zip(springs, turned, strict=True) if inside_out]
    moved = [
        f"{spring.name} ({far:.4g} m, {near:.4g} m apart)"
        for spring, inside_out, far, near in zip(springs, turned, travel.tolist(), apart.tolist(), strict=True)
        if far > near > 0.0 and not inside_out
    ]
    notes = []
    if passed:
        notes.append(
            f"inside out, for their ends have passed one another: spring{'s' * (len(passed) > 1)}"
            f" {_few(passed)} [W0014]"
        )
    if moved:
        notes.append(
            f"moved farther than they were apart at the start: the ends of spring{'s' * (len(moved) > 1)}"
            f" {_few(moved)} [W0015]"
        )
    return notes


def _few(items: Sequence[str]) -> str:
    return ", ".join(items[:_LISTED]) + (f" and {len(items) - _LISTED} more" if len(items) > _LISTED else "")


def _passed_one_another(vectors: Array) -> NDArray[np.bool_]:
    """Return, (...), whether springs have turned round along a path by way of next to no length; ``vectors`` (...,
    rows, 3) lead from end to end."""
    before, way = vectors[..., :-1, :], np.diff(vectors, axis=-2)
    square = np.sum(way * way, axis=-1)
    share = np.clip(-np.sum(before * way, axis=-1) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    shortest = np.min(np.linalg.norm(before + share[..., np.newaxis] * way, axis=-1), axis=-1)
    first, last = vectors[..., 0, :], vectors[..., -1, :]
    ends = np.minimum(np.linalg.norm(first, axis=-1), np.linalg.norm(last, axis=-1))
    turned: NDArray[np.bool_] = (np.sum(first * last, axis=-1) < 0.0) & (shortest < PASSED * ends)
    return turned


def _tyres(rest: Rest) -> list[str]:
    """Return a note on each wheel with a centre below the road now, but not at the start."""
    measures, poses, u = rest.measures, rest.poses, rest.u
    model = measures.model
    sunk: list[str] = []
    tyres = model.description.drawing.wheels
    if not tyres:
        return []
    points = _positions(measures, poses)
    of_scene = dict(zip(model.inputs, model.input_values(measures.t, parameters=measures.p).tolist(), strict=True))
    input_values: Mapping[str, Any] = u if isinstance(u, Mapping) else {}
    inputs = of_scene | {name: float(np.asarray(value)) for name, value in input_values.items()}
    inputs |= {} if u is None or isinstance(u, Mapping) else dict(zip(model.inputs, np.ravel(u).tolist(), strict=True))
    for tyre in tyres:
        center = points[tyre.center][1]
        try:
            before, after = (_clearance(measures, tyre, center[row], inputs) for row in (0, -1))
        except ArithmeticError:  # a road given by a curve has no value but in the compiled model
            continue
        if before > 0.0 > after:
            sunk.append(tyre.name)
    named = f"tyre{'s' * (len(sunk) > 1)} {_few(sunk)}"
    return [f"inside out, for their centres are below the road: {named} [W0291]"] if sunk else []


def _clearance(measures: SceneMeasures, tyre: Wheel, center: Array, inputs: Mapping[str, float]) -> float:
    """Return the height, m, of a wheel's centre (3,) over the road. Raises ArithmeticError for a road without a value
    there."""

    def value_of(symbol: Symbol) -> float:
        if symbol.kind == "position":
            return float(center[symbol.index])
        if symbol.kind == "time":
            return measures.t
        return inputs[symbol.name] if symbol.kind == "input" else measures.values[symbol.name]

    return float(center[2]) - evaluate(tyre.road, value_of)


def _coarse_beams(rest: Rest) -> list[str]:
    """Return a note on each beam with too few elements: within an element deflections are linear in the load.

    The displacement of the end of a cantilever under a force is off by half the mean square of the deflections within
    the elements, relative to the lengths of elements: to a factor of 3 from 1 to 8 elements if the estimate is below a
    half. Beyond that the estimate is up to 60 times too large, and the note states no size.
    """
    measures, poses, notes = rest.measures, rest.poses, []
    for beam in measures.model.description.element_stiffness:
        at_rest = np.array([np.concatenate([poses[node][0][-1], poses[node][1][-1]]) for node in beam.nodes])
        relative = numeric.compose(SE3, numeric.inverse(SE3, at_rest[:-1]), at_rest[1:])
        relative[relative[:, 0] < 0.0, :4] *= -1.0
        changes = numeric.log(SE3, relative) - np.array(beam.twists)
        forces = np.einsum("eij,ej->ei", beam.matrices(measures.values), changes)
        within = beam.bending_within(measures.values, forces)
        error = 0.5 * float(np.average(within**2, weights=beam.lengths))
        if error > COARSE:
            worst = int(np.argmax(within))
            off = f"some {100.0 * error:.1g} %" if error < 0.5 else "an unknown part of their size"
            notes.append(
                f"too few elements in the beam {beam.nodes[0]}: element {worst + 1} bends by"
                f" {100.0 * within[worst]:.0f} % of its length within itself, displacements are off by {off} [W0016]"
            )
    return notes


def _far(rest: Rest) -> list[str]:
    """Return a note, in a list, on the body that has moved farthest, if that is farther than the scene is large at the
    start."""
    measures, poses = rest.measures, rest.poses
    length = measures.length(rest.path[0])
    ways = {name: float(np.linalg.norm(position[-1] - position[0])) for name, (_, position) in poses.items()}
    at_start = np.array([position[0] for name, (_, position) in poses.items() if name != WORLD])
    at_start = np.concatenate([at_start, *(position[:1] for _, position in _positions(measures, poses).values())])
    large = max(float(np.linalg.norm(np.ptp(at_start, axis=0))), length)
    name = max(ways, key=lambda name: ways[name])
    if not ways[name] > LONGER * large:
        return []
    far = f"the body {name}, by {ways[name]:.4g} m"
    return [f"farther from the start than the whole scene is large, {large:.4g} m: {far} [W0292]"]


ROWS = (
    StateWarning("inverted springs", _springs, limits=(PASSED,)),
    StateWarning("inverted tyres", _tyres),
    StateWarning("coarse beams", _coarse_beams, limits=(COARSE,)),
    StateWarning("long ways", _far, alone=True, limits=(LONGER,)),
)
