"""Warnings about states of a model: springs and tyres turned inside out, beams that are coarse or bent too far, ways
longer than the scene, unbalance, and an inertia matrix that is not positive definite.

Curvature w'' is linear in the deflection w. A bent axis has w''/(1 - w'^2)^(1/2), so strain energy is wrong by
a part of w'^2, and the kinematics of order = 2 by as much. Half the mean square of the slope is also the shortening of
the axis, as a part of its length, so beyond 1 no beam is like that.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.compiled.terms import Inputs
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula, Symbol
from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.lie.numeric import rotated
from eomgen.solvers.regular_inertia import inertia_with_rows
from eomgen.system.description import BASE, WORLD, Wheel

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


#: Limit of the distance of a spring's ends, relative to the distance at start and rest, below which the ends count as
#: passing one another.
_PASSED = 0.05
#: Ratio of a displacement to the size of the scene above which a note is written.
_LONGER = 1.1
#: Signs that make the inverse of a quaternion.
_BACK = np.array([1.0, -1.0, -1.0, -1.0])
_LISTED = 4
#: Estimated error of a beam's displacements that is worth a note.
_COARSE = 0.01
#: Rest is the same to this part of the scene's length, or rad.
SAME = 1e-6


class SceneMeasures:
    """Measures of a scene at given parameters, and the positions of points in a configuration.

    Parameters
    ----------
    p : (np,) tunable parameters
    t : time, s
    base : (19,) state of the base, None for a base that is the world
    """

    def __init__(self, model: CompiledModel, p: Array, t: float, base: Array | None) -> None:
        self.model, self.p, self.t, self.base = model, p, t, base
        self.values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))

    def number(self, formula: Formula) -> float:
        """Return the value of a formula of parameters; 0 for a formula without a value."""
        try:
            return float(evaluate(formula, lambda symbol: self.values[symbol.name]))
        except (ArithmeticError, KeyError):
            return 0.0

    def vector(self, formulas: Sequence[Formula]) -> Array:
        return np.array([self.number(formula) for formula in formulas])

    def length(self, q: Array) -> float:
        """Return the largest length of the scene at q, m: lengths of the description, travels; 1 m if there is none."""
        units = self.model.q_units
        lengths = [*self._lengths, *(abs(value) for value, unit in zip(q.tolist(), units, strict=True) if unit == "m")]
        finite = [length for length in lengths if math.isfinite(length)]
        return max(finite, default=0.0) or 1.0

    @cached_property
    def _lengths(self) -> list[float]:
        """Lengths of the description."""
        every = dict.fromkeys(self.model.description.lengths)
        return [float(np.linalg.norm(self.vector(vector))) for vector in every]

    def gravity(self) -> float:
        """Return the acceleration of gravity, m/s^2."""
        return float(np.linalg.norm(self.vector(self.model.description.gravity)))

    def mass(self) -> float:
        """Return the mass of the scene, kg."""
        return sum(self.number(solid.mass) for solid in self.model.description.drawing.solids)

    def poses(self, path: Array) -> dict[str, tuple[Array, Array]]:
        """Return quaternion and position (rows, ...) in world axes of all bodies at configurations (rows, nq)."""
        rows, model = len(path), self.model
        pose = model.evaluate("poses", path, t=self.t, parameters=self.p, base=self.base)["pose"]
        pose_of = {name: pose[:, index] for index, name in enumerate(model.bodies)}
        still = np.tile([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], (rows, 1))
        pose_of |= {WORLD: still, BASE: still if self.base is None else np.tile(self.base[:7], (rows, 1))}
        return {name: (values[:, :4], values[:, 4:]) for name, values in pose_of.items()}


def equilibrium_notes(measures: SceneMeasures, path: Sequence[Array], u: Inputs) -> list[str]:
    """Return warnings about an equilibrium at the end of a path of configurations; none without poses."""
    if "poses" not in measures.model.functions or len(path) < 2:
        return []
    poses = measures.poses(np.array(path))
    notes = [*_springs(measures, poses), *_tyres(measures, poses, u), *_coarse_beams(measures, poses)]
    return notes or _far(measures, poses, measures.length(path[0]))


def _positions(measures: SceneMeasures, poses: Mapping[str, tuple[Array, Array]]) -> dict[str, tuple[str, Array]]:
    """Return body and world position (rows, 3) of each point."""
    points = measures.model.description.drawing.points
    if not points:
        return {}
    turns, origins = (np.array([poses[point.body][part] for point in points]) for part in (0, 1))
    local = np.array([measures.vector(point.position) for point in points])
    positions = origins + rotated(turns, local[:, np.newaxis])
    return {point.name: (point.body, position) for point, position in zip(points, positions, strict=True)}


def _springs(measures: SceneMeasures, poses: Mapping[str, tuple[Array, Array]]) -> list[str]:
    """Return a note on springs that are inside out, and a note on springs whose ends have moved farther than their
    distance."""
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
            f"inside out, for their ends have passed one another: spring{'s' * (len(passed) > 1)} {_few(passed)}"
        )
    if moved:
        notes.append(
            f"moved farther than they were apart at the start: the ends of spring{'s' * (len(moved) > 1)} {_few(moved)}"
        )
    return notes


def _few(items: Sequence[str]) -> str:
    return ", ".join(items[:_LISTED]) + (f" and {len(items) - _LISTED} more" if len(items) > _LISTED else "")


def _passed_one_another(vectors: Array) -> NDArray[np.bool_]:
    """Return whether springs, from end to end (..., rows, 3) along the path, have turned round by way of next to no
    length, (...)."""
    before, way = vectors[..., :-1, :], np.diff(vectors, axis=-2)
    square = np.sum(way * way, axis=-1)
    share = np.clip(-np.sum(before * way, axis=-1) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    shortest = np.min(np.linalg.norm(before + share[..., np.newaxis] * way, axis=-1), axis=-1)
    first, last = vectors[..., 0, :], vectors[..., -1, :]
    ends = np.minimum(np.linalg.norm(first, axis=-1), np.linalg.norm(last, axis=-1))
    turned: NDArray[np.bool_] = (np.sum(first * last, axis=-1) < 0.0) & (shortest < _PASSED * ends)
    return turned


def _tyres(measures: SceneMeasures, poses: Mapping[str, tuple[Array, Array]], u: Inputs) -> list[str]:
    """Return a note on each wheel with a centre below the road now, but not at the start."""
    model = measures.model
    sunk: list[str] = []
    tyres = model.description.drawing.wheels
    if not tyres:
        return []
    points = _positions(measures, poses)
    of_scene = dict(zip(model.inputs, model.input_values(measures.t, parameters=measures.p).tolist(), strict=True))
    given: Mapping[str, Any] = u if isinstance(u, Mapping) else {}
    inputs = of_scene | {name: float(np.asarray(value)) for name, value in given.items()}
    inputs |= {} if u is None or isinstance(u, Mapping) else dict(zip(model.inputs, np.ravel(u).tolist(), strict=True))
    for tyre in tyres:
        center = points[tyre.center][1]
        try:
            before, after = (_clearance(measures, tyre, center[row], inputs) for row in (0, -1))
        except ArithmeticError:  # a road given by a curve has no value but in the compiled model
            continue
        if before > 0.0 > after:
            sunk.append(tyre.name)
    return (
        [f"inside out, for their centres are below the road: tyre{'s' * (len(sunk) > 1)} {_few(sunk)}"] if sunk else []
    )


def _clearance(measures: SceneMeasures, tyre: Wheel, center: Array, inputs: Mapping[str, float]) -> float:
    """Return the height of a wheel's centre over the road. Raises ArithmeticError."""

    def value_of(symbol: Symbol) -> float:
        if symbol.kind == "position":
            return float(center[symbol.index])
        if symbol.kind == "time":
            return measures.t
        return inputs[symbol.name] if symbol.kind == "input" else measures.values[symbol.name]

    return float(center[2]) - evaluate(tyre.road, value_of)


def _coarse_beams(measures: SceneMeasures, poses: Mapping[str, tuple[Array, Array]]) -> list[str]:
    """Return a note on each beam with too few elements: within an element deflections are linear in the load.

    The displacement of the end of a cantilever under a force is off by half the mean square of the deflections within
    the elements, relative to the lengths of elements: to a factor of 3 from 1 to 8 elements if the estimate is below a
    half. Beyond that the estimate is up to 60 times too large, and the note states no size.
    """
    notes = []
    for beam in measures.model.description.element_stiffness:
        at_rest = np.array([np.concatenate([poses[node][0][-1], poses[node][1][-1]]) for node in beam.nodes])
        relative = numeric.compose(SE3, numeric.inverse(SE3, at_rest[:-1]), at_rest[1:])
        relative[relative[:, 0] < 0.0, :4] *= -1.0
        changes = numeric.log(SE3, relative) - np.array(beam.twists)
        forces = np.einsum("eij,ej->ei", beam.matrices(measures.values), changes)
        within = beam.bending_within(measures.values, forces)
        error = 0.5 * float(np.average(within**2, weights=beam.lengths))
        if error > _COARSE:
            worst = int(np.argmax(within))
            off = f"some {100.0 * error:.1g} %" if error < 0.5 else "an unknown part of their size"
            notes.append(
                f"too few elements in the beam {beam.nodes[0]}: element {worst + 1} bends by"
                f" {100.0 * within[worst]:.0f} % of its length within itself, displacements are off by {off}"
            )
    return notes


def _far(measures: SceneMeasures, poses: Mapping[str, tuple[Array, Array]], length: float) -> list[str]:
    """Return a note on the body that has gone farthest, if that is farther than the scene is large at the start."""
    ways = {name: float(np.linalg.norm(position[-1] - position[0])) for name, (_, position) in poses.items()}
    at_start = np.array([position[0] for name, (_, position) in poses.items() if name != WORLD])
    at_start = np.concatenate([at_start, *(position[:1] for _, position in _positions(measures, poses).values())])
    large = max(float(np.linalg.norm(np.ptp(at_start, axis=0))), length)
    name = max(ways, key=lambda name: ways[name])
    if not ways[name] > _LONGER * large:
        return []
    return [
        f"farther from the start than the whole scene is large, {large:.4g} m: the body {name}, by {ways[name]:.4g} m"
    ]


#: Distance of a centre of mass from its axis, relative to the scene's length, below which the centre lies on the axis.
_ON_AXIS = 1e-12
#: Moment of all parts about the axis, as a part of the largest of one, below which a rotor is in balance: blades sag.
_BALANCED = 0.05
_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def off_axis_hint(model: CompiledModel, measures: SceneMeasures, q: Array, v: Array) -> str:
    """Return a remedy if bodies that turn with v at q are out of balance; empty if none is.

    Half a turn of a single coordinate moves a centre of mass by twice the distance from the axis.
    """
    if "poses" not in model.functions:
        return ""
    worst, result, gravity = 0.0, "", measures.vector(model.description.gravity)
    for factor in model.factors:
        k = factor.v_start
        if factor.group != "R" or factor.v_size != 1 or not v[k] or model.v_units[k] != "rad/s":
            continue
        half = q.copy()
        half[factor.q] += np.pi
        poses = measures.poses(np.array([q, half]))
        before, moment, across = worst, np.zeros(3), np.zeros(3)
        for solid in model.description.drawing.solids:
            turn, origin = poses[solid.name]
            center = origin + rotated(turn, measures.vector(solid.center_of_mass))
            off, mass = 0.5 * float(np.linalg.norm(center[1] - center[0])), measures.number(solid.mass)
            moment += 0.5 * mass * (center[0] - center[1])
            if off > _ON_AXIS * measures.length(q) and mass * off > worst:
                worst = mass * off
                result = (
                    f"centres of mass on the axis of {factor.name} (the centre of {solid.name} is {off:.6g} m off,"
                    f" {worst:.6g} kg m), with gravity and springs that are the same all round it; unbalance acts on"
                    " the balanced rotor as a force that turns (docs/python.md, Rotors)"
                )
                # half a turn reverses the part of gravity across the axis alone
                across = gravity - rotated(turn[1], rotated(turn[0] * _CONJUGATE, gravity))
        own = worst > before and float(np.linalg.norm(moment)) <= _BALANCED * worst
        if own and float(np.linalg.norm(across)) > _ON_AXIS * measures.gravity():
            result = (
                f"gravity along the axis of {factor.name} or none, for the centres of mass balance about this axis, and"
                " gravity across it turns relative to each part; floquet (of a model, in Python) takes such a motion,"
                f" with a drive of {factor.name}"
            )
    return result


#: Shortening of a bent beam, as a part of its length, above which the shortening is reported.
_LARGE = 0.05


class LargestBending(NamedTuple):
    """The place of largest bending of a beam.

    Attributes
    ----------
    beam : name of the beam
    time : s
    shortening : of the axis, as a part of the beam's length: half the mean square of the slope
    """

    beam: str
    time: float
    shortening: float

    @property
    def possible(self) -> bool:
        """Whether there is a beam that is bent so."""
        return self.shortening < 1.0

    def __str__(self) -> str:
        where = f"the beam {self.beam} bends by slopes of {np.sqrt(2.0 * self.shortening):.3g} (root mean square) at"
        shorter = f"t = {self.time:.6g} s, which shortens it by {100.0 * self.shortening:.3g} % of its length"
        wrong = "its equations, linear in curvature, are wrong by as much"
        return f"{where} {shorter}: {wrong}; try: a stiffer beam, smaller loads, or shorter beams in a chain"


def shortenings(model: CompiledModel, q: Array) -> Array:
    """Return the shortening of each beam's axis, as a part of the beam's length, (n, beams), at q (n, nq); infinite if
    not a number."""
    places = {factor.name: factor.q for factor in model.factors}
    beams = model.library.layout["slopes"]
    result = np.empty((len(q), len(beams)))
    with np.errstate(over="ignore", invalid="ignore"):
        for k, item in enumerate(beams):
            bent = q[:, places[item["name"]]]
            result[:, k] = 0.5 * np.einsum("nk,kl,nl->n", bent, np.array(item["squares"]), bent) / item["length"]
    return np.where(np.isnan(result), np.inf, result)


def largest_bending(model: CompiledModel, t: Array, q: Array) -> LargestBending | None:
    """Return the most bent beam in any row of a run, t (n,) in s and q (n, nq), beyond the range of the linear theory;
    None without such a beam. None if none does."""
    shares, beams = shortenings(model, q), model.library.layout["slopes"]
    rows = shares.argmax(axis=0)
    candidates = [
        LargestBending(item["name"], float(t[row]), float(shares[row, k]))
        for k, (item, row) in enumerate(zip(beams, rows, strict=True))
    ]
    most = max(candidates, key=lambda bending: bending.shortening, default=None)
    return most if most is not None and not most.shortening <= _LARGE else None


class InertiaWarning(NamedTuple):
    """The fault of the inertia matrix of a state, and a remedy."""

    text: str
    hint: str


def inertia_warning(
    model: CompiledModel, q: Array, p: Array, start: Array | None = None, step: float = 0.0, where: str = "there"
) -> InertiaWarning | None:
    """Return a warning if the inertia matrix at q is not positive definite; None if positive definite or unknown.

    Parameters
    ----------
    p : parameters
    start : (nq,)
        State at the start of the run that led to q, with steps of ``step`` seconds.
    where : name of the state in the message
    """
    smallest = _smallest(model, q, p)
    if smallest is None or smallest > 0.0:
        return None
    text = f"the inertia matrix {where} is not positive definite, its smallest eigenvalue is {smallest:.3g}"
    beams = beams_beyond_linear_range(model, q, p)
    if beams:
        text += f": this is beyond the range of order = 1 of beam{'s' * (len(beams) > 1)} {', '.join(beams)}"
    if start is not None and _definite(model, start, p):  # the masses are fine, and the state has run away
        return InertiaWarning(text, f"a step smaller than {step:.3g} s{', then order = 2' if beams else ''}")
    return InertiaWarning(text, "order = 2" if beams else "masses and inertias that bodies can have")


def beams_beyond_linear_range(model: CompiledModel, q: Array, p: Array) -> Sequence[str]:
    """Return the beams of order 1 without whose deformation the inertia matrix at q would be positive definite.

    Empty if the matrix is positive definite, or if it would not be so without deformation either.
    """
    first = {item.name for item in model.description.coordinates if item.linear}
    factors = [factor for factor in model.factors if factor.name in first]
    straight = q.copy()
    for factor in factors:
        straight[factor.q] = 0.0
    if not factors or _definite(model, q, p) or not _definite(model, straight, p):
        return ()
    causes = []
    for factor in factors:
        alone = straight.copy()
        alone[factor.q] = q[factor.q]
        if not _definite(model, alone, p):
            causes.append(factor.name)
    return tuple(causes or (factor.name for factor in factors))


def linear_range_exceeded(model: CompiledModel, t: Array, q: Array, p: Array) -> str:
    """Return a clause on beams of order 1 that deform too far in some row of a run, with a remedy; empty if none
    does.

    Examined rows are the rows with the largest deformation of each beam, the last row, and up to 200 rows between.
    """
    first = {item.name for item in model.description.coordinates if item.linear}
    parts = [factor.q for factor in model.factors if factor.name in first]
    if not parts:
        return ""
    rows = {int(np.argmax(np.linalg.norm(q[:, part], axis=1))) for part in parts} | {len(t) - 1}
    for row in sorted(rows | set(range(0, len(t), len(t) // 200 + 1))):
        if beams := beams_beyond_linear_range(model, q[row], p):
            named = f"beam{'s' * (len(beams) > 1)} {', '.join(beams)}"
            sentence = f"at t = {t[row]:.6g} s the deflection of {named} is beyond the range of order = 1"
            return f"{sentence}: the inertia matrix is not positive definite; try: order = 2"
    return ""


def _definite(model: CompiledModel, q: Array, p: Array) -> bool:
    smallest = _smallest(model, q, p)
    return smallest is not None and smallest > 0.0


def _smallest(model: CompiledModel, q: Array, p: Array) -> float | None:
    """Return the smallest eigenvalue of M, with rows of constraints if it is not positive; None without a finite M."""
    if "mass" not in model.functions:
        return None
    M = model.mass(q, parameters=p)
    if not M.size or not np.all(np.isfinite(M)):
        return None
    smallest = float(np.linalg.eigvalsh(M)[0])
    if smallest > 0.0 or "constraint_jacobian" not in model.functions or not model.multipliers:
        return smallest
    (B,) = model.evaluate("constraint_jacobian", q, parameters=p).values()
    return float(np.linalg.eigvalsh(inertia_with_rows(M, B, np.ones(model.nv)))[0])
