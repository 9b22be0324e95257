"""Warnings of a static equilibrium at the end of a path: springs and tyres that are inside out, beams with too few
elements, ways longer than the scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.compiled.rest.state_warnings import Rest, SceneMeasures, StateWarning
from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.lie.numeric import rotated
from eomgen.products.doubts.places import BACK, height_over_road, shortest
from eomgen.system.description import WORLD

PASSED = Limit(0.05, "1", "distance of the ends of a spring in parts of the distance at start and rest", "a choice")
LONGER = Limit(1.1, "1", "displacement in parts of the size of the scene", "a choice")
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
    points, passed, moved = _positions(rest.measures, rest.poses), [], []
    for spring in rest.measures.model.description.drawing.lines:
        (first_body, start), (second_body, end) = points[spring.first], points[spring.second]
        # in both bodies
        seen = np.array([rotated(rest.poses[body][0] * BACK, end - start) for body in (first_body, second_body)])
        first, last = seen[:, 0], seen[:, -1]
        travel = float(np.min(np.linalg.norm(last - first, axis=-1)))
        before, now = np.linalg.norm(first, axis=-1), np.linalg.norm(last, axis=-1)
        near = np.min(shortest(seen), axis=-1) < PASSED * np.minimum(before, now)
        if np.all(near & (np.sum(first * last, axis=-1) < 0.0)):
            passed.append(spring.name)
        elif travel > before[0] > 0.0:
            moved.append(f"{spring.name} ({travel:.4g} m, {before[0]:.4g} m apart)")
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
    return ", ".join(items[:4]) + (f" and {len(items) - 4} more" if len(items) > 4 else "")


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
            before, after = (
                height_over_road(tyre, center[row], measures.t, measures.values, inputs) for row in (0, -1)
            )
        except ArithmeticError:  # a road given by a curve has no value but in the compiled model
            continue
        if before > 0.0 > after:
            sunk.append(tyre.name)
    named = f"tyre{'s' * (len(sunk) > 1)} {_few(sunk)}"
    return [f"inside out, for their centres are below the road: {named} [W0291]"] if sunk else []


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
