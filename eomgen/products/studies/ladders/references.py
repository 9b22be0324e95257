"""References of cells: another method at fine steps, held against a second one."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.pipeline.model import Model
from eomgen.products.studies.ladders.runs import REACHED, ROWS, Conditions, Ended, Request
from eomgen.products.studies.ladders.subject import OWN, Subject

#: Two references have to agree to this.
AGREED = 1e-3
#: Seconds for each of two, and their steps.
LIMIT, MOST_STEPS = 10.0, 400_000
#: Ratio of errors of velocities to errors of positions, at the same step.
VELOCITY = 3.0
#: Roundings that are within any bound.
_ROUNDINGS = 10.0
#: Roundings of a coordinate that a reference's step has to change it by at least, if it moves at all: each step
#: loses half of one.
_STEP_ROUNDINGS = 10.0
#: Motion below this part of the largest is measured by it.
_SMALL = 1e-3
_DOUBLE = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class Reference:
    """Expected result of a run.

    Attributes
    ----------
    by : the methods that say so; why there is none
    arrays : of the observation, None if no two methods agree
    uncertainty : the difference of both
    """

    by: str
    arrays: dict[str, Array] | None = None
    uncertainty: float = np.inf


def reference(subject: Subject, conditions: Conditions, ended: Callable[[Request, float], Ended]) -> Reference:
    """Return the first reference that a second method confirms.

    Parameters
    ----------
    ended : gives how a run ends that has so many seconds
    """
    tried = []
    for name, first, second in _pairs(subject, conditions):
        one = ended(first, LIMIT)
        if one.how != REACHED or one.arrays is None or not one.finite:
            tried.append(f"{name}: {one.how}")
            continue
        other = ended(second, LIMIT)
        if other.how != REACHED or other.arrays is None or not other.finite:
            tried.append(f"{name}: {other.how}")
            continue
        if not (_resolved(subject, first, one.arrays) and _resolved(subject, second, other.arrays)):
            tried.append(f"{name}: steps change the coordinates by their rounding only")
            continue
        apart = difference(subject, other.arrays, one.arrays, AGREED).worst
        if apart <= AGREED:
            return Reference(name, dict(one.arrays), apart)
        tried.append(f"{name}: apart by {apart:.2g}")
    return Reference("; ".join(tried))


def _resolved(subject: Subject, request: Request, arrays: Mapping[str, Array]) -> bool:
    """Return whether steps change the coordinates that move by many times their rounding.

    If they do not, finer steps lose more of the motion: two of them may agree on standing still.
    """
    conditions = request.conditions
    model = subject.model(OWN)
    if conditions.q is None:
        return True
    speed = np.max(np.abs(arrays["v"]), axis=0)
    if conditions.sizes is not None:
        speed = speed * conditions.sizes[1]
    for factor in model.factors:
        if factor.group == "R":
            moves = conditions.step * speed[factor.v]
            if np.any((moves > 0.0) & (moves < _STEP_ROUNDINGS * np.spacing(np.abs(conditions.q[factor.q])))):
                return False
    return True


class Errors(NamedTuple):
    """Largest errors of a run over its rows: of coordinates by their motion, of velocities by the largest, each kind by
    itself."""

    position: float
    velocity: float

    @property
    def worst(self) -> float:
        """Both on one scale."""
        return max(self.position, self.velocity / VELOCITY)


def difference(
    subject: Subject, of: Mapping[str, Array], held: Mapping[str, Array], bound: float, epsilon: float = _DOUBLE
) -> Errors:
    """Return the errors of one run held against another; of internal states, if both have them, as of coordinates.

    Motion of a kind is measured by a thousandth of the others' at least, in radians and parts of the machine's size.
    Ten roundings are within any bound: of the machine's size and of a radian, and of the largest displacement of its
    parts in these. Forces on displaced bodies are rounded, and they turn, too.

    Parameters
    ----------
    of, held : ``t``, ``q`` and ``v`` of the rows
    bound : of an error
    epsilon : last place of the numbers of the run
    """
    if of["q"].shape != held["q"].shape:
        return Errors(float("inf"), float("inf"))
    model, extent, span = subject.model(OWN), subject.extent, float(held["t"][-1] - held["t"][0])
    scale = {"rad": 1.0, "m": extent}
    wrong: dict[str, float] = {}
    moved: dict[str, float] = {}
    for kind, error, motion in _positions(model, of["q"], held["q"]):
        wrong[kind] = max(wrong.get(kind, 0.0), error)
        moved[kind] = max(moved.get(kind, 0.0), motion)
    turned = max(1.0, *(motion / scale[kind] for kind, motion in moved.items() if kind in scale))
    rounding = _ROUNDINGS * epsilon / bound
    most = _SMALL * max((motion / scale[kind] for kind, motion in moved.items() if kind in scale), default=0.0)
    least = {kind: max(rounding * turned, most) * size for kind, size in scale.items()}
    sizes = {kind: max(motion, least.get(kind, 0.0)) or 1.0 for kind, motion in moved.items()}
    position = max((error / sizes[kind] for kind, error in wrong.items()), default=0.0)
    if "z" in of and "z" in held:
        position = max(position, _of_states(model, of["z"], held["z"], rounding))

    kinds = {kind: [k for k, unit in enumerate(model.v_units) if unit == kind] for kind in set(model.v_units)}
    fastest = {kind: float(np.max(np.abs(held["v"][:, columns]))) for kind, columns in kinds.items()}
    rates = {f"{kind}/s": size for kind, size in scale.items()}
    speeds = [speed / rates[kind] for kind, speed in fastest.items() if kind in rates]
    turning, slow = max(turned / span, *speeds), _SMALL * max(speeds, default=0.0)
    velocity = 0.0
    for kind, columns in kinds.items():
        size = max(fastest[kind], max(rounding * turning, slow) * rates.get(kind, 0.0)) or 1.0
        velocity = max(velocity, float(np.max(np.abs(of["v"][:, columns] - held["v"][:, columns]))) / size)
    result = Errors(position, velocity)
    return result if np.all(np.isfinite(result)) else Errors(float("inf"), float("inf"))


def _of_states(model: Model, of: Array, held: Array, rounding: float) -> float:
    """Return the largest error of internal states (n, nz), each by its own motion, or a thousandth of the largest of
    its unit."""
    errors, motions = np.abs(of - held).max(axis=0, initial=0.0), np.ptp(held, axis=0)
    largest = dict.fromkeys(model.z_units, 0.0)
    for unit, motion in zip(model.z_units, motions, strict=True):
        largest[unit] = max(largest[unit], float(motion))
    least = np.array([_SMALL * largest[unit] for unit in model.z_units])
    sizes = np.maximum(np.maximum(motions, least), rounding * np.abs(held).max(axis=0, initial=0.0))
    return float(np.max(errors / np.where(sizes > 0.0, sizes, 1.0), initial=0.0))


def _positions(model: Model, of: Array, held: Array) -> Iterator[tuple[str, float, float]]:
    """Yield kind, largest error and largest motion of each coordinate, rotation and place."""
    for factor in model.factors:
        here, there = of[:, factor.q], held[:, factor.q]
        if factor.group == "R":
            for k in range(factor.q_size):
                kind = model.q_units[factor.q_start + k]
                motion = float(np.max(np.abs(there[:, k] - there[0, k])))
                yield kind, float(np.max(np.abs(here[:, k] - there[:, k]))), motion
            continue
        yield "rad", _angle(here[:, :4], there[:, :4]), _angle(there[:1, :4], there[:, :4])
        if factor.q_size > 4:
            apart, way = here[:, 4:] - there[:, 4:], there[:, 4:] - there[0, 4:]
            yield "m", float(np.max(np.linalg.norm(apart, axis=1))), float(np.max(np.linalg.norm(way, axis=1)))


def _angle(one: Array, two: Array) -> float:
    """Return the largest angle between rotations (w, x, y, z), rad."""
    closest = np.minimum(np.linalg.norm(one - two, axis=1), np.linalg.norm(one + two, axis=1))
    return float(np.max(4.0 * np.arcsin(np.minimum(0.5 * closest, 1.0))))


def _pairs(subject: Subject, conditions: Conditions) -> Iterator[tuple[str, Request, Request]]:
    free = conditions.varied(given={})
    span = conditions.step * conditions.steps
    # steps that resolve the fastest motion of the scene as it is
    fine = subject.fine * conditions.parameters.get("unit_time", 1.0)
    own = conditions.steps if 4 * conditions.steps <= MOST_STEPS else ROWS * int(np.ceil(span / fine / ROWS))

    def finer(method: str, times: int, **more: float) -> Request:
        steps = own * times
        return Request(free.varied(step=span / steps, steps=steps), method, {"error_estimate": False, **more})

    def tight(method: str) -> Request:
        changed = free.varied(step=span / ROWS, steps=ROWS)
        return Request(changed, method, {"error_estimate": False, "tolerance": 1e-14})

    times = max(1, min(4 * int(np.ceil(span / own / fine)), MOST_STEPS // (4 * own)))
    step = "of the step" if own == conditions.steps else f"of {span / own:.3g} s"
    for stepped in subject.methods(fine_by="steps"):
        for series in subject.methods(fine_by="tolerance"):
            yield f"{series}, held against {stepped} at 1/{times} {step}", tight(series), finer(stepped, times)
        yield f"{stepped} at 1/{times} and 1/{2 * times} {step}", finer(stepped, 2 * times), finer(stepped, times)
    for damped, few in itertools.product(subject.methods(fine_by="damping"), (4, 64)):
        many = min(few * 4, max(2, MOST_STEPS // own))
        text = f"{damped} at 1/{many} and 1/{many // 2} {step}"
        yield text, finer(damped, many, rho_inf=0.5), finer(damped, max(1, many // 2), rho_inf=0.8)
