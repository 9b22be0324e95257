"""Compared quantities of two runs, and their errors: configuration, velocity, internal states, multipliers and the
scene's outputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import nearest, shown
from eomgen.errors import Problem, UsageError
from eomgen.lie import numeric, product
from eomgen.lie.groups import SO3
from eomgen.lie.product import Factor
from eomgen.pipeline.model import Model
from eomgen.results.solution import Solution
from eomgen.simulation.accuracy.motion_size import Kinds, RunNames, components_of, shares, size_of

#: Quantities of every run besides the outputs of the scene.
STATE, Q, V, Z, MULTIPLIERS = "state", "q", "v", "z", "multipliers"
OWN = (STATE, Q, V, Z, MULTIPLIERS)
_STATES = (Q, V, Z, MULTIPLIERS)
#: Sizes of an error over time.
MEASURES = ("largest", "rms", "final")


@dataclass(frozen=True)
class ErrorSize:
    """An error over time, relative to the size of the quantity: largest value, root mean square, and last value."""

    largest: float
    rms: float
    final: float


def error_in(sizes: Mapping[str, ErrorSize], quantity: str, measure: str) -> float:
    """Return the error in a quantity; infinite if it is not known or not finite."""
    value = float(getattr(sizes.get(quantity), measure, np.inf))
    return value if np.isfinite(value) else np.inf


@dataclass(frozen=True)
class Observation:
    """Observed quantities of a run at the times of comparison.

    Attributes
    ----------
    t : (nt,)
    q, v, z, multipliers : (nt, n)
    components : names and units of q, v, z and the outputs
    rows : names of the constraint rows
    poses : of the bodies, name -> (nt, 7)
    twists : name -> (nt, 6), angular first
    outputs : name -> (nt, n)
    """

    t: Array
    q: Array
    v: Array
    z: Array
    multipliers: Array
    components: RunNames
    rows: tuple[str, ...]
    poses: Mapping[str, Array]
    twists: Mapping[str, Array]
    outputs: Mapping[str, Array]

    @property
    def factors(self) -> tuple[Factor, ...]:
        """Factors of the configuration space."""
        return self.components.factors

    @property
    def arrays(self) -> dict[str, Array]:
        """All arrays by name, in the form of ``with_arrays``."""
        states = {"t": self.t} | {name: getattr(self, name) for name in _STATES}
        kinds = {"poses": self.poses, "twists": self.twists, "outputs": self.outputs}
        return states | {f"{kind}.{name}": array for kind, named in kinds.items() for name, array in named.items()}

    def columns(self, at: slice = slice(None)) -> Kinds:
        """Return states and multipliers of some rows by kind."""
        return {name: getattr(self, name)[at] for name in _STATES}


def with_arrays(arrays: Mapping[str, Array], components: RunNames, rows: tuple[str, ...]) -> Observation:
    """Return the observation with the arrays of ``Observation.arrays``, names of components and names of constraint
    rows."""

    def arrays_by_name(kind: str) -> dict[str, Array]:
        return {key.partition(".")[2]: array for key, array in arrays.items() if key.startswith(f"{kind}.")}

    states = {name: arrays[name] for name in ("t", *_STATES)}
    return Observation(
        **states,
        components=components,
        rows=rows,
        poses=arrays_by_name("poses"),
        twists=arrays_by_name("twists"),
        outputs=arrays_by_name("outputs"),
    )


def observe(model: Model, solution: Solution) -> Observation:
    """Return the observation of a run: states, multipliers, outputs, and poses and twists if the model has these
    terms."""
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
        solution.z,
        solution.multipliers,
        components_of(model),
        model.multipliers,
        poses,
        twists,
        {name: array.reshape(len(solution.t), -1) for name, array in solution.outputs.items()},
    )


def extent_of(model: Model, q: Array) -> float:
    """Return the largest distance between bodies, or between a body and the base, at q, m; 1 if all distances are
    zero."""
    if "poses" not in model.terms or not model.bodies:
        return 1.0
    places = [np.zeros(3), *(np.asarray(model.pose(body, q))[4:] for body in model.bodies)]
    extent = float(np.max(np.ptp(np.stack(places), axis=0)))
    return extent if 0.0 < extent < np.inf else 1.0


def check_measure(measure: str) -> None:
    """Raise UsageError for a size of errors that is none of ``MEASURES``."""
    if measure not in MEASURES:
        fault = f"there is no measure {shown(measure)} [E1126]"
        raise UsageError(Problem("measure", fault, f"one of {', '.join(MEASURES)}"))


def check_output(argument: str, name: str, model: Model) -> None:
    """Check that runs of a model have a quantity. Raises UsageError, which names the argument."""
    quantities = tuple(name for name in OWN if {MULTIPLIERS: model.multipliers, Z: model.nz}.get(name, True))
    known = (*quantities, *(output.name for output in model.description.outputs))
    if name not in known:
        raise UsageError(Problem(argument, f"the scene has no output {shown(name)} [E1135]", nearest(name, known)))


def errors(of: Observation, reference: Observation) -> dict[str, ErrorSize]:
    """Return the errors of a run against a reference at all times of the run, by quantity.

    The reference has these times and may have further times between; errors are relative to the largest value over all
    times of the reference.

    ``q`` and ``v`` are coordinates if both runs have the same coordinates, else poses and twists of the bodies. The
    sizes of coordinates, internal states and outputs are as in error estimates of runs (``size_of``): a demand that is
    met here is met by the estimate of the run. Velocities, and poses of other coordinates, are relative to the largest
    velocity, or motion, of a kind (lengths, angles) in the reference, multipliers to the largest value; ``state`` is
    the largest error of q, v and z. Multipliers are compared if both runs have the same rows.
    """
    result: dict[str, Array] = {}
    at = _places(of.t, reference.t)
    names, there = reference.components, reference.columns(at)
    outputs = {name: reference.outputs[name] for name in names.outputs if _alike(name, of, reference)}
    ours, theirs = {name: of.outputs[name] for name in outputs}, {name: output[at] for name, output in outputs.items()}
    energies = max((float(np.abs(outputs[name]).max()) for name in outputs if names.outputs[name] == "J"), default=0.0)
    with np.errstate(over="ignore", invalid="ignore"):
        size = size_of(names, reference.columns(), outputs, energies=energies)
        if of.factors == reference.factors:
            apart = np.abs(product.difference(of.factors, of.q, there[Q]))
            result[Q] = shares({"increment": apart}, size, ("increment",)).max(axis=1, initial=0.0)
            result[V] = _relative(of.v - there[V], reference.v, names.v_units)
        elif of.poses and reference.poses:
            result[Q] = _errors_of_bodies(of.poses, reference.poses, at, _OF_POSES)
            if of.twists and reference.twists:
                result[V] = _errors_of_bodies(of.twists, reference.twists, at, _OF_TWISTS)
        if of.z.size and of.components.z_names == names.z_names:
            result[Z] = shares({Z: np.abs(of.z - there[Z])}, size, (Z,)).max(axis=1)
        if result:
            result[STATE] = np.max(np.stack(list(result.values())), axis=0)
        if of.rows and of.rows == reference.rows:
            most = float(np.max(np.linalg.norm(reference.multipliers, axis=1), initial=0.0))
            result[MULTIPLIERS] = np.linalg.norm(of.multipliers - there[MULTIPLIERS], axis=1) / (most or 1.0)
        for name in outputs:
            kind = f"output.{name}"
            result[name] = shares({kind: np.abs(ours[name] - theirs[name])}, size, (kind,)).max(axis=1)
        return {name: _size(series) for name, series in result.items()}


def _alike(name: str, of: Observation, reference: Observation) -> bool:
    """Return whether both runs have an output, of the same size."""
    here, there = of.outputs.get(name), reference.outputs.get(name)
    return here is not None and there is not None and here.shape[1:] == there.shape[1:]


def _places(t: Array, among: Array) -> slice:
    """Return the indices of the times of a run among a reference's times, equally spaced from the first time on."""
    every = round(float((t[1] - t[0]) / (among[1] - among[0]))) if len(t) > 1 else 1
    return slice(0, every * (len(t) - 1) + 1, every)


def _size(series: Array) -> ErrorSize:
    return ErrorSize(float(np.max(series)), float(np.sqrt(np.mean(series**2))), float(series[-1]))


def _relative(difference: Array, reference: Array, units: Sequence[str]) -> Array:
    """Return the largest difference of velocities, (nt,), each relative to the largest velocity of the same unit."""
    result = np.zeros(len(difference))
    for unit in set(units):
        same = [k for k, velocity_unit in enumerate(units) if velocity_unit == unit]
        size = float(np.max(np.abs(reference[:, same]), initial=0.0))
        result = np.maximum(result, np.max(np.abs(difference[:, same]), axis=1) / (size or 1.0))
    return result


def angles(first: Array, second: Array) -> Array:
    """Return the angles between rotations given as quaternions (w, x, y, z), rad, (nt,)."""
    return np.asarray(np.linalg.norm(numeric.difference(SO3, first, second), axis=1))


def _distances(first: Array, second: Array) -> Array:
    return np.asarray(np.linalg.norm(first - second, axis=1))


_Parts = tuple[tuple[slice, Callable[[Array, Array], Array]], ...]
#: Rotations and places of poses, angular and linear velocities, each with a function that compares two of them.
_OF_POSES: _Parts = ((slice(0, 4), angles), (slice(4, 7), _distances))
_OF_TWISTS: _Parts = ((slice(0, 3), _distances), (slice(3, 6), _distances))


def _errors_of_bodies(of: Mapping[str, Array], reference: Mapping[str, Array], at: slice, parts: _Parts) -> Array:
    """Return the largest error of poses or twists of bodies, (nt,). Rotations and lengths are relative to the largest
    motion from the start of the reference, velocities to the largest velocity."""
    errors = []
    for part, apart in parts:
        begins = {name: there[:1, part] * float(parts is _OF_POSES) for name, there in reference.items()}
        moved = (apart(begins[name], there[:, part]) for name, there in reference.items())
        size = max(float(np.max(motion)) for motion in moved)
        errors += [apart(of[name][:, part], there[at, part]) / (size or 1.0) for name, there in reference.items()]
    return np.asarray(np.max(np.stack(errors), axis=0))
