"""Load steps: unbalanced forces at the start are held by forces of constant direction, which are removed along a path;
and the search for a stable rest next to an unstable one, reproducible under rounding errors.

If there is no load at the start, this is the same as applying dead loads step by step: the factor s of the loads
goes from 0 to 1. Forces that hold are constant in the axes of the base, so components of bodies that turn change.

A structure leaves an unstable rest along the direction of the most negative stiffness. A dead force along this
direction holds the structure; the force grows and then vanishes at another rest. The motion is a path of equilibria
over the size of the force, from zero back to zero (J. M. T. Thompson and G. W. Hunt, A General Theory of Elastic
Stability (1973), chapter 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, diags_array

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import WRITTEN
from eomgen.lie.product import Factor
from eomgen.solvers.bordered_newton import (
    Balance,
    Direction,
    LoadedState,
    LoadedStatics,
    Matrix,
    Tangents,
    direction,
    plus,
)
from eomgen.solvers.equilibrium_path import PathEndError, PathPoint, StepLimits, first_point, follow
from eomgen.solvers.tangent_stiffness import TangentStiffness, canonical_direction


@dataclass(frozen=True)
class RotatingTriples:
    """Triples of components of v in rotating axes.

    Attributes
    ----------
    quaternions : (n, 4) indices in q of the quaternions of the axes
    triples, turned_by : (n, 3) indices in v of the triples, and of the angular velocities of the axes
    """

    quaternions: NDArray[np.intp]
    triples: NDArray[np.intp]
    turned_by: NDArray[np.intp]


def turning_blocks(factors: Sequence[Factor]) -> RotatingTriples:
    """Return the triples of v of all rotations and poses that are in rotating axes; positions of R3xSO3 are not."""
    blocks = []
    for factor in factors:
        if factor.group in ("SO3", "R3xSO3", "SE3"):
            blocks.append((factor.q_start, factor.v_start, factor.v_start))
        if factor.group == "SE3":
            blocks.append((factor.q_start, factor.v_start + 3, factor.v_start))
    places = np.array(blocks, np.intp).reshape(-1, 3, 1)
    return RotatingTriples(places[:, 0] + np.arange(4), places[:, 1] + np.arange(3), places[:, 2] + np.arange(3))


def dead_forces(blocks: RotatingTriples, q: Array, forces: Array, *, back: bool) -> Array:
    """Return generalized forces (nv,) whose triples on free rotations are turned from body axes to base axes, or back.

    Parameters
    ----------
    blocks : RotatingTriples
        Indices of quaternions in q and of triples in forces.
    q, forces : (nq,) and (nv,) ndarray
        Configuration and generalized forces.
    back : bool
        From base axes to body axes.
    """
    result = forces.copy()
    if blocks.quaternions.size:
        places = blocks.triples
        w, vector = q[blocks.quaternions[:, 0]], q[blocks.quaternions[:, 1:]]
        vector = -vector if back else vector
        doubled = 2.0 * _cross(vector, forces[places])
        result[places] = forces[places] + w[:, np.newaxis] * doubled + _cross(vector, doubled)
    return result


def _cross(first: Array, second: Array) -> Array:
    """Return cross products of rows, (n, 3); ``np.cross`` takes four times as long for few rows."""
    after, before = [1, 2, 0], [2, 0, 1]
    return np.asarray(first[:, after] * second[:, before] - first[:, before] * second[:, after])


def with_turned(K: Matrix, blocks: RotatingTriples, forces: Array, factor: float) -> Matrix:
    """Return a stiffness (nv, nv) plus ``factor`` times the derivative by q of forces that are constant in base axes.

    A whole stiffness gives a whole result, which is a copy.

    Parameters
    ----------
    forces : (nv,), in body axes
    """
    nv = len(forces)
    if not blocks.triples.size:
        return K
    rows = blocks.triples[:, [0, 0, 1, 1, 2, 2]]
    columns = blocks.turned_by[:, [1, 2, 0, 2, 0, 1]]
    x, y, z = forces[blocks.triples].T
    entries = factor * np.stack([-z, y, z, -x, -y, x], axis=1)
    if isinstance(K, np.ndarray):
        total = K.copy()
        np.add.at(total, (rows.ravel(), columns.ravel()), entries.ravel())
        return total
    return csc_array(K + csc_array((entries.ravel(), (rows.ravel(), columns.ravel())), shape=(nv, nv)))


#: Largest step of a path, in rad or lengths of the scene.
_LIMITS = StepLimits(0.2)


@dataclass(frozen=True)
class StableBranch:
    """A stable rest, the displacement (nv,) that left the first unstable rest, and the configurations between."""

    rest: LoadedState
    left_along: Array
    path: list[Array]


def stable_branch(statics: LoadedStatics, rest: LoadedState, onwards: Direction) -> StableBranch | None:
    """Return a stable rest that is reached from an unstable rest under the same loads.

    None if the given rest is stable, if no stable rest is found, or if forces have no potential or internal states take
    part.

    Parameters
    ----------
    onwards : direction of the path at the rest; sets the side of a mode along the path, other modes start positively
    """
    if len(rest.z):
        return None
    first: Array | None = None
    path = [rest.q]
    for _ in range(4):  # unstable rests in succession
        stiffness = TangentStiffness.at(statics, rest)
        if not stiffness.symmetric:
            return None
        if not stiffness.negative:
            return None if first is None else StableBranch(rest, first, path)
        value, mode = _most_unstable(stiffness)
        first_side = _side(statics, mode, onwards) if first is None else 1.0
        for side in (first_side, -first_side):
            branch = _led_off(statics, rest, value, side * mode)
            if branch is not None:
                break
        else:
            return None
        first = side * mode if first is None else first
        rest, path = branch[0], [*path, *branch[1]]
    return None if first is None or TangentStiffness.at(statics, rest).negative else StableBranch(rest, first, path)


def _side(statics: LoadedStatics, mode: Array, onwards: Direction) -> float:
    """Return the sign of the component of a mode along a direction; 1 if orthogonal."""
    scaled, along = mode / statics.sizes, onwards.unknowns[: len(mode)] / statics.sizes
    share = float(scaled @ along) / (float(np.linalg.norm(scaled) * np.linalg.norm(along)) or 1.0)
    return -1.0 if share < -1e-2 else 1.0  # a smaller share is rounding


def _most_unstable(stiffness: TangentStiffness) -> tuple[float, Array]:
    """Return the most negative stiffness and the displacement along it, (nv,), reproducible if several are equal."""
    values, directions = stiffness.next_to_zero(stiffness.negative + stiffness.neutral)
    lowest = float(np.min(values))
    alike = values <= (1.0 - WRITTEN) * lowest
    return lowest, canonical_direction(directions[:, alike], stiffness.sizes)


def _led_off(
    statics: LoadedStatics, rest: LoadedState, value: float, mode: Array
) -> tuple[LoadedState, list[Array]] | None:
    """Return the next rest on one side of a mode with negative stiffness, and configurations on the way. ``value`` is
    the stiffness, ``mode`` the displacement (nv,), whose sign is the side. None if the path does not return to the
    force 0."""
    measure = 1.0 / statics.sizes**2
    beside = 1e-6 * abs(value) * measure  # for families of equilibria
    led = _held_back(statics, rest, mode * measure, abs(value), beside)
    start = replace(rest, s=0.0)
    unknowns = np.zeros(len(mode) + len(rest.multipliers) + len(rest.z))
    unknowns[: len(mode)] = mode
    along = direction(led, start, Direction(unknowns, 0.0))
    if along is None:
        return None
    path = []
    try:
        for point in follow(led, PathPoint(start, along, 0.0, 0, 0.0), 0.0, _LIMITS, 0.1):
            path.append(point.rest.q)
            if point.rest.s == 0.0:
                return replace(point.rest, s=rest.s), path
            if len(path) > 200:
                return None
    except PathEndError:
        return None
    return None


def _held_back(statics: LoadedStatics, rest: LoadedState, force: Array, reach: float, beside: Array) -> LoadedStatics:
    """Return statics whose load factor s multiplies a dead force, (nv,), at the load factor of ``rest``. The last
    argument, (nv,), is added to the diagonal of Newton's matrix; ``reach`` is the scale of s."""
    blocks = turning_blocks(statics.factors)
    fixed = dead_forces(blocks, rest.q, force, back=False)

    def acting(at: LoadedState) -> Array:
        return dead_forces(blocks, at.q, fixed, back=True)

    def balance(at: LoadedState) -> Balance:
        now = statics.balance(replace(at, s=rest.s))
        return replace(now, residual=now.residual - at.s * acting(at))

    def tangents(at: LoadedState) -> Tangents:
        now = statics.tangents(replace(at, s=rest.s))
        return replace(now, K=plus(with_turned(now.K, blocks, acting(at), -at.s), csc_array(diags_array(beside))))

    def by_factor(at: LoadedState) -> Balance:
        return Balance(-acting(at), np.zeros(len(at.multipliers)), np.zeros(len(at.z)))

    return replace(
        statics,
        reach=reach,
        balance=balance,
        tangents=tangents,
        by_factor=by_factor,
        followed=lambda q, s: statics.followed(q, rest.s),
        strains=lambda s: statics.strains(rest.s),
        mass=lambda at: statics.mass(replace(at, s=rest.s)),
    )


#: Steps at most.
MAX_STEPS = 2000


class LoadSteps(NamedTuple):
    """Rest at the end of load steps, configurations on the way, and the displacement (nv,) along which an unstable rest
    was left first; None if none was."""

    rest: LoadedState
    path: Sequence[Array]
    left_along: Array | None


def by_load_steps(statics: LoadedStatics, start: LoadedState, limits: StepLimits, *, stable: bool = False) -> LoadSteps:
    """Return the rest that is reached by applying the unbalanced forces at the start step by step, from 0 to the full
    loads.

    Parameters
    ----------
    statics : at full loads; the load factor is ignored
    start : on the constraints
    limits : of the steps
    stable : whether the path leaves a rest that becomes unstable for a stable rest nearby, if one is found

    Raises
    ------
    PathEndError
        The path cannot be followed to the end; the error has the last point, including the load factor.
    """
    first = statics.balance(start)
    held, balanced = _hold(statics, start, first), bool(np.isfinite(first.vector).all() and not first.constraint.any())
    point = first_point(held, replace(start, s=0.0), 1.0, balanced=balanced)
    path, left_along, part = [point.rest.q], None, np.inf
    try:
        while point.rest.s != 1.0:
            for reached in follow(held, point, 1.0, limits, part):
                before, point = point, reached
                path.append(point.rest.q)
                if point.way > 100.0:  # rad, or lengths of the scene
                    raise PathEndError("displacements grow without more load: nothing opposes them [E2090]", point)
                if len(path) > MAX_STEPS:
                    raise PathEndError(f"{MAX_STEPS} steps are not enough [E2091]", point)
                branch = stable_branch(held, point.rest, before.direction) if stable else None
                if branch is not None:
                    left_along = branch.left_along if left_along is None else left_along
                    path += branch.path
                    point, part = replace(first_point(held, branch.rest, 1.0), way=point.way), 0.2
                    break
    except KeyboardInterrupt as stop:
        stop.add_note(f"load steps had come to {100.0 * point.rest.s:.3g} % of the loads, in {len(path) - 1} steps")
        raise
    return LoadSteps(point.rest, path, left_along)


def _hold(statics: LoadedStatics, start: LoadedState, first: Balance) -> LoadedStatics:
    """Return statics in which the residual at the start, ``first``, times 1 - s, is balanced by an additional dead
    load. So s from 0 to 1 leads from the start to rest under the loads."""
    blocks = turning_blocks(statics.factors)
    fixed = dead_forces(blocks, start.q, first.residual, back=False)

    def balance(rest: LoadedState) -> Balance:
        now, left = statics.balance(rest), 1.0 - rest.s
        residual = now.residual - left * dead_forces(blocks, rest.q, fixed, back=True)
        return Balance(residual, now.constraint, now.rates - left * first.rates)

    def tangents(rest: LoadedState) -> Tangents:
        now = statics.tangents(rest)
        held = dead_forces(blocks, rest.q, fixed, back=True)
        return replace(now, K=with_turned(now.K, blocks, held, rest.s - 1.0))

    def by_factor(rest: LoadedState) -> Balance:
        held = dead_forces(blocks, rest.q, fixed, back=True)
        return Balance(held, np.zeros(len(first.constraint)), first.rates)

    return replace(statics, reach=1.0, balance=balance, tangents=tangents, by_factor=by_factor)
