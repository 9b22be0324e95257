"""Compared quantities of two runs, and their errors: configuration, velocity, multipliers and the scene's outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import asdict, dataclass
from eomgen.base.messages import nearest, shown
from eomgen.errors import Problem, UsageError
from eomgen.lie.product import Factor
from eomgen.pipeline.model import Model
from eomgen.results.solution import Solution

#: Quantities of every run besides the outputs of the scene.
STATE, Q, V, MULTIPLIERS = "state", "q", "v", "multipliers"
OWN = (STATE, Q, V, MULTIPLIERS)
#: Sizes of an error over time.
MEASURES = ("largest", "rms", "final")


@dataclass(frozen=True)
class ErrorSize:
    """An error relative to the size of the quantity: largest, root mean square over time, and last value."""

    largest: float
    rms: float
    final: float

    def to_dict(self) -> dict[str, float]:
        return asdict(self)


@dataclass(frozen=True)
class Observation:
    """Observed quantities of a run at the times of comparison.

    Attributes
    ----------
    t : (nt,)
    q, v, multipliers : (nt, n)
    factors, units : of q
    rows : names of the constraint rows
    poses : of the bodies, name -> (nt, 7)
    twists : name -> (nt, 6), angular first
    outputs : name -> (nt, n)
    """

    t: Array
    q: Array
    v: Array
    multipliers: Array
    factors: tuple[Factor, ...]
    units: tuple[str, ...]
    rows: tuple[str, ...]
    poses: Mapping[str, Array]
    twists: Mapping[str, Array]
    outputs: Mapping[str, Array]

    @property
    def arrays(self) -> dict[str, Array]:
        """All arrays by name, in the form of ``with_arrays``."""
        own = {"t": self.t, "q": self.q, "v": self.v, "multipliers": self.multipliers}
        kinds = {"poses": self.poses, "twists": self.twists, "outputs": self.outputs}
        return own | {f"{kind}.{name}": array for kind, named in kinds.items() for name, array in named.items()}


def with_arrays(
    arrays: Mapping[str, Array], factors: tuple[Factor, ...], units: tuple[str, ...], rows: tuple[str, ...]
) -> Observation:
    """Return the observation that has these arrays, by the names of ``Observation.arrays``."""

    def named(kind: str) -> dict[str, Array]:
        return {key.partition(".")[2]: array for key, array in arrays.items() if key.startswith(f"{kind}.")}

    t, q, v, multipliers = (arrays[name] for name in ("t", "q", "v", "multipliers"))
    return Observation(t, q, v, multipliers, factors, units, rows, named("poses"), named("twists"), named("outputs"))


def observed(model: Model, solution: Solution) -> Observation:
    """Return the observation of a run."""
    there = "poses" in model.terms
    poses = {name: np.asarray(array) for name, array in solution.poses.items() if name != "base"} if there else {}
    p = solution.metadata["parameters"] or None
    twists = {}
    if "twists" in model.terms:
        twists = {name: model.twist(name, solution.q, solution.v, solution.t, parameters=p) for name in poses}
    return Observation(
        solution.t,
        solution.q,
        solution.v,
        solution.multipliers,
        model.factors,
        tuple(model.q_units),
        model.multipliers,
        poses,
        twists,
        {name: array.reshape(len(solution.t), -1) for name, array in solution.outputs.items()},
    )


def check_output(argument: str, name: str, model: Model) -> None:
    """Check that runs of a model have a quantity. Raises UsageError, which names the argument."""
    own = tuple(name for name in OWN if name != MULTIPLIERS or model.multipliers)
    known = (*own, *(output.name for output in model.description.outputs))
    if name not in known:
        raise UsageError(Problem(argument, f"the scene has no output {shown(name)}", nearest(name, known)))


def errors(of: Observation, reference: Observation) -> dict[str, ErrorSize]:
    """Return the errors of a run against a reference at all times of the run, by quantity.

    The reference has these times and may have further times between; errors are relative to the largest value over all
    times of the reference.

    ``q`` and ``v`` are coordinates if both runs have the same coordinates, else poses and twists of the bodies. Each
    kind of component (lengths, angles) is relative to the largest motion, or velocity, of this kind in the reference;
    outputs and multipliers are relative to the largest value of each; ``state`` is the larger error of q and v.
    Multipliers are compared if both runs have the same rows.
    """
    result: dict[str, Array] = {}
    at = _places(of.t, reference.t)
    if of.factors == reference.factors:
        result[Q] = _largest(_coordinates(of, reference, at))
        result[V] = _relative(of.v - reference.v[at], reference.v, _kinds(of))
    elif of.poses and reference.poses:
        result[Q] = _largest(_of_poses(of.poses, reference.poses, at))
        if of.twists and reference.twists:
            result[V] = _twists(of.twists, reference.twists, at)
    if result:
        result[STATE] = np.max(np.stack(list(result.values())), axis=0)
    if of.rows and of.rows == reference.rows:
        result[MULTIPLIERS] = _one_kind(of.multipliers - reference.multipliers[at], reference.multipliers)
    for name, values in reference.outputs.items():
        if name in of.outputs and of.outputs[name].shape[1:] == values.shape[1:]:
            result[name] = _one_kind(of.outputs[name] - values[at], values)
    return {name: _size(series) for name, series in result.items()}


def _places(t: Array, among: Array) -> slice:
    """Return the indices of the times of a run among a reference's times, equally spaced from the first time on."""
    every = round(float((t[1] - t[0]) / (among[1] - among[0]))) if len(t) > 1 else 1
    return slice(0, every * (len(t) - 1) + 1, every)


def known_errors(of: Observation, reference: Observation, uncertainty: Mapping[str, ErrorSize]) -> dict[str, ErrorSize]:
    """Return the errors of a run, none below the uncertainty of the reference."""
    result = errors(of, reference)
    for name, size in result.items():
        if (bar := uncertainty.get(name)) is not None:
            sizes = (max(getattr(size, measure), getattr(bar, measure)) for measure in MEASURES)
            result[name] = ErrorSize(*sizes)
    return result


def _size(series: Array) -> ErrorSize:
    with np.errstate(over="ignore", invalid="ignore"):
        rms = float(np.sqrt(np.mean(series**2)))
        return ErrorSize(float(np.max(series)), rms, float(series[-1]))


def _one_kind(difference: Array, reference: Array) -> Array:
    """Return the norm of a difference, (nt,), relative to the largest norm of the reference."""
    with np.errstate(over="ignore", invalid="ignore"):
        size = float(np.max(np.linalg.norm(reference, axis=1), initial=0.0))
        result: Array = np.linalg.norm(difference, axis=1) / (size or 1.0)
    return result


def _kinds(of: Observation) -> list[list[int]]:
    """Return the components of v by kind: rotations, and components with another unit."""
    kinds: dict[str, list[int]] = {}
    for factor in of.factors:
        for k in range(factor.v_size):
            of_group = "rad" if k < 3 else "m"
            kind = of.units[factor.q_start + k] if factor.group == "R" else of_group
            kinds.setdefault(kind, []).append(factor.v_start + k)
    return list(kinds.values())


def _relative(difference: Array, reference: Array, kinds: Sequence[Sequence[int]]) -> Array:
    result = np.zeros(len(difference))
    with np.errstate(over="ignore", invalid="ignore"):
        for kind in kinds:
            size = float(np.max(np.abs(reference[:, kind]), initial=0.0))
            result = np.maximum(result, np.max(np.abs(difference[:, kind]), axis=1) / (size or 1.0))
    return result


#: By kind: errors of components, (nt, n), and the motion from the start of the reference.
_Parts = dict[str, list[tuple[Array, Array]]]


def _coordinates(of: Observation, reference: Observation, at: slice) -> _Parts:
    parts: _Parts = {}
    for factor in of.factors:
        here, there = of.q[:, factor.q], reference.q[:, factor.q]
        if factor.group == "R":
            for k in range(factor.q_size):
                kind = of.units[factor.q_start + k]
                moved = np.abs(there[:, k] - there[0, k])
                parts.setdefault(kind, []).append((np.abs(here[:, k] - there[at, k]), moved))
            continue
        parts.setdefault("rad", []).append((_angle(here[:, :4], there[at, :4]), _angle(there[:1, :4], there[:, :4])))
        if factor.q_size > 4:
            parts.setdefault("m", []).append(_distances(here[:, 4:], there[:, 4:], at))
    return parts


def _of_poses(poses: Mapping[str, Array], reference: Mapping[str, Array], at: slice) -> _Parts:
    parts: _Parts = {"rad": [], "m": []}
    for name in reference:
        here, there = poses[name], reference[name]
        parts["rad"].append((_angle(here[:, :4], there[at, :4]), _angle(there[:1, :4], there[:, :4])))
        parts["m"].append(_distances(here[:, 4:], there[:, 4:], at))
    return parts


def _distances(here: Array, there: Array, at: slice) -> tuple[Array, Array]:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.linalg.norm(here - there[at], axis=1), np.linalg.norm(there - there[0], axis=1)


def _largest(parts: _Parts) -> Array:
    """Return the largest error over all kinds, (nt,), each relative to the largest motion of this kind."""
    series = []
    for members in parts.values():
        size = max((float(np.max(moved)) for _, moved in members), default=0.0)
        series += [error / (size or 1.0) for error, _ in members]
    result: Array = np.max(np.stack(series), axis=0) if series else np.zeros(0)
    return result


def _angle(first: Array, second: Array) -> Array:
    """Return the angle between rotations given as quaternions (w, x, y, z), rad, (nt,)."""
    w = np.sum(first * second, axis=1)
    cross = np.cross(first[:, 1:], second[:, 1:])
    vector = first[:, :1] * second[:, 1:] - second[:, :1] * first[:, 1:] - cross
    result: Array = 2.0 * np.arctan2(np.linalg.norm(vector, axis=1), np.abs(w))
    return result


def _twists(twists: Mapping[str, Array], reference: Mapping[str, Array], at: slice) -> Array:
    """Return the error of twists, (nt,), angular and linear parts each relative to the largest."""
    result = np.zeros(len(next(iter(twists.values()))))
    for part in (slice(0, 3), slice(3, 6)):
        size = max(float(np.max(np.linalg.norm(array[:, part], axis=1))) for array in reference.values())
        for name, array in reference.items():
            difference = np.linalg.norm(twists[name][:, part] - array[at, part], axis=1)
            result = np.maximum(result, difference / (size or 1.0))
    return result
