"""Consistent positions and velocities from an approximate guess, and redundant constraint equations.

Positions by Gauss-Newton steps of least kinetic size, q <- q exp(-M^-1 B^T (B M^-1 B^T)^+ Phi); velocities by the same
projection of B v + Phi_t. The pseudo-inverse lets redundant rows be, as long as they do not contradict each other.

Nothing here is measured by an absolute number: a row is held against what its own summands add up to, which rounding is
a few digits below, and against what it can be, the extent of what it closes. So units of length and of time, and the
place of a machine, make no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from eomgen.arrays import Array
from eomgen.errors import ModelError, Problem
from eomgen.lie.product import Factor, update

MAX_ITERATIONS = 50
EPSILON = float(np.finfo(float).eps)
#: Rounding errors of a row, in units of the last place of what the magnitudes of its summands add up to: what they are,
#: and where they are sought no more because they can be no more.
ROUNDING, WORST_ROUNDING = 4.0, 1e4
#: Violations above this part of the extent are a contradiction, axes and lengths being given to six digits or more;
#: what a guess was off by is told above the second.
CONTRADICTION, REPORTED = 1e-6, 1e-10
#: A row that is new by less than this part of what a row of its kind can be here is redundant: lengths and axes that
#: are meant to fit are given to so many digits. Below the second, it is redundant by a hair; below the third, others go
#: first.
REDUNDANT, ALMOST_REDUNDANT, LITTLE = 1e-6, 1e-4, 1e-3
#: What is left of a row that vanishes but for rounding, in units of the last place of its summands: at most, and as a
#: rule.
VANISHING, VANISHED = 4096.0, 64.0
#: Singular values of B, its rows weighed, below this part of the largest belong to rows that follow from others:
#: corrections leave such directions alone, which can be moved along but change nothing to first order.
SINGULAR = 3e-5
#: How far nearby configurations are: rad, and part of the extent.
NEARBY = 0.05
#: Pivots of M, scaled to a unit diagonal, that make up for coordinates that nothing resists here.
_RESISTANCE = 1e-14
#: So many rows are listed in a message.
_LISTED = 5
_LEFT_OUT = "parameters with which the constraints can be met together, or a scene with these values of its own"


@dataclass(frozen=True)
class Constrained:
    """A constrained system as callables at fixed parameters.

    Attributes
    ----------
    factors : of the configuration
    names : of the rows, the ``holonomic`` first ones at position level
    units : of the rows, ``m``, ``1`` or ``m/s``
    angular : (nv,) whether a velocity component turns something
    constraint(q, t) -> (holonomic,), velocity(q, v, t) -> (rows,), jacobian(q, t) -> (rows, nv), mass(q) -> (nv, nv)
    sizes(q, t) -> (rows,), (rows,)
        What the magnitudes of the summands of each row add up to, in its unit (m at velocity level), and the extent of
        what it joins, m: what turning may move it by.
    """

    factors: Sequence[Factor]
    names: Sequence[str]
    units: Sequence[str]
    angular: NDArray[np.bool_]
    holonomic: int
    constraint: Callable[[Array, float], Array]
    velocity: Callable[[Array, Array, float], Array]
    jacobian: Callable[[Array, float], Array]
    mass: Callable[[Array], Array]
    sizes: Callable[[Array, float], tuple[Array, Array]]

    def without(self, left_out: Sequence[int]) -> Constrained:
        """Return the system without some of its rows."""
        kept = [row for row in range(len(self.names)) if row not in left_out]
        at_position = [row for row in kept if row < self.holonomic]

        def sizes(q: Array, t: float) -> tuple[Array, Array]:
            size, extent = self.sizes(q, t)
            return size[kept], extent[kept]

        return replace(
            self,
            names=[self.names[row] for row in kept],
            units=[self.units[row] for row in kept],
            holonomic=len(at_position),
            constraint=lambda q, t: self.constraint(q, t)[at_position],
            velocity=lambda q, v, t: self.velocity(q, v, t)[kept],
            jacobian=lambda q, t: self.jacobian(q, t)[kept],
            sizes=sizes,
        )


def split_sizes(values: Array) -> tuple[Array, Array]:
    """Return what ``constraint_size`` gives, one array after the other, as ``Constrained.sizes`` does."""
    rows = len(values) // 2
    return values[:rows], values[rows:]


@dataclass(frozen=True)
class Assembly:
    """A consistent state, and how far the guess was from it.

    Attributes
    ----------
    violations : mapping from row to what it was off by in the guess, where that is more than round-off
    rate_violations : the same for the rates of the rows, at the corrected position
    deviations : a sentence for each row that the state does not meet either, by so little that it is no contradiction
    extent : m, of the largest that a row joins
    """

    q: Array
    v: Array
    iterations: int
    violations: dict[str, float]
    rate_violations: dict[str, float]
    deviations: tuple[str, ...] = ()
    extent: float = 1.0

    def corrections(self) -> list[str]:
        """Return one sentence for each row that the guess did not meet."""
        at_position = [
            f"initial position corrected: {name} was off by {value:.3g}" for name, value in self.violations.items()
        ]
        rates = self.rate_violations.items()
        return at_position + [
            f"initial velocity corrected: {name} changed at {value:.3g} per s" for name, value in rates
        ]


def assemble(system: Constrained, q: Array, v: Array, t: float = 0.0) -> Assembly:
    """Return the consistent state nearest to a guess.

    Raises
    ------
    ModelError
        The constraints contradict each other, or the guess is too far away; names the rows that stay violated.
    """
    first, start = system.constraint(q, t), _Rows(system, q, t)
    q, iterations = _position(system, q, t)
    rows = _Rows(system, q, t)
    guess, rates = v, system.velocity(q, v, t)
    v = v - rows.correction(rates)
    left = system.velocity(q, v, t)
    limits = np.maximum(rows.rate_limits(np.maximum(np.abs(guess), np.abs(v))), CONTRADICTION * np.abs(rates))
    limits = np.maximum(limits, np.finfo(float).tiny)  # below it numbers have no digits to be met by
    if not np.all(np.abs(left) <= limits):
        raise _contradiction(rows, system.names, left, limits, "velocities", iterations)
    violations = _named(system.names, first, REPORTED * start.scale)
    changed = _named(system.names, rates, REPORTED * (rows.possible @ np.abs(guess)))
    off = _named(system.names, system.constraint(q, t), REPORTED * rows.scale)
    deviations = tuple(f"{name} stays off by {by:.3g}" for name, by in off.items())
    return Assembly(q, v, iterations, violations, changed, deviations, rows.machine)


class _Rows:
    """The rows of B at one configuration in the metric of the kinetic energy, M = L L^T, and what they are measured
    by."""

    def __init__(self, system: Constrained, q: Array, t: float) -> None:
        self.holonomic = system.holonomic
        self.B = _jacobian(system, q, t)
        self.angular = system.angular
        self.size, extent = system.sizes(q, t)
        self.machine = machine = float(np.max(extent, initial=0.0)) or 1.0
        # what a row joins may lie at one place but for what is no contradiction; then it is met by motions of the whole
        # machine
        self.extent = np.where(extent > CONTRADICTION * machine, extent, machine)
        self.lengths = np.array([unit != "1" for unit in system.units], dtype=bool)
        self._mass = system.mass(q)

    @property
    def scale(self) -> Array:
        """What violations of the rows are measured by, in their units."""
        return np.where(self.lengths, self.extent, 1.0)

    @property
    def limits(self) -> Array:
        """Violations of the holonomic rows beyond which they are not met."""
        return np.maximum(
            CONTRADICTION * self.scale[: self.holonomic], WORST_ROUNDING * EPSILON * self.size[: self.holonomic]
        )

    def rate_limits(self, speeds: Array) -> Array:
        """Return rates of rows, (rows,), beyond which they are not met at components of v as large as ``speeds``."""
        return np.maximum(
            CONTRADICTION * (self.possible @ speeds), WORST_ROUNDING * EPSILON * (self._of_summands @ speeds)
        )

    def lever(self, row: int) -> float:
        """Return by how much turning moves what a row measures, in m per rad; 0 for rows of angles."""
        return float(np.max(np.abs(self.B[row][self.angular]), initial=0.0)) if self.lengths[row] else 0.0

    def at_long_lever(self, row: int) -> bool:
        """Return whether velocities along a row's direction, which it has in full, are beside its turns too little to
        be told."""
        straight = np.where(self.angular, 0.0, self.B[row])
        if not np.max(np.abs(straight), initial=0.0) > 0.1:
            return False
        part = float(np.linalg.norm(np.linalg.solve(self.metric, straight)))
        return part < 10.0 * REDUNDANT * float(np.linalg.norm(self.weighed[row]))

    @cached_property
    def metric(self) -> Array:
        """L of M = L L^T; coordinates that nothing resists at this configuration are given a trifle of inertia."""
        try:
            return np.asarray(np.linalg.cholesky(self._mass))
        except np.linalg.LinAlgError:
            weights = np.sqrt(np.maximum(np.diag(self._mass), 0.0))
            weights = np.where(weights > 0.0, weights, 1.0)
            values, vectors = np.linalg.eigh(self._mass / np.outer(weights, weights))
            raised = (vectors * np.maximum(values, _RESISTANCE * values[-1])) @ vectors.T
            return np.asarray(np.linalg.cholesky(raised * np.outer(weights, weights)))

    @cached_property
    def weighed(self) -> Array:
        """B L^-T."""
        return np.asarray(np.linalg.solve(self.metric, self.B.T).T)

    @cached_property
    def _speeds(self) -> Array:
        """Squares of what a unit of kinetic energy lets each velocity component be, (nv,)."""
        return np.asarray(np.sum(np.linalg.inv(self.metric) ** 2, axis=0))

    def _entries(self, scale: Array) -> Array:
        """Return what entries of B are where a row has a scale: that per radian; per metre, 1 or what turns by it."""
        reach = np.where(self.extent > 0.0, self.extent, 1.0)
        return np.where(self.angular, scale[:, np.newaxis], (np.where(self.lengths, 1.0, 1.0 / reach))[:, np.newaxis])

    @cached_property
    def possible(self) -> Array:
        """What entries of B can be here, (rows, nv)."""
        return np.maximum(self._entries(self.scale), np.abs(self.B))

    @cached_property
    def _of_summands(self) -> Array:
        """What the magnitudes of the summands of entries of B add up to at most, (rows, nv)."""
        return np.maximum(self._entries(np.maximum(self.scale, self.size)), np.abs(self.B))

    @cached_property
    def vanishing(self) -> Array:
        """Lengths of weighed rows that are rounding and nothing else, (rows,)."""
        return np.asarray(VANISHING * EPSILON * np.sqrt(self._of_summands**2 @ self._speeds))

    def hides(self, row: int, rest: Array) -> bool:
        """Return whether what is left of a weighed row may be new or rounding: rows made of places far away."""
        length, vanishing = float(np.linalg.norm(rest)), float(self.vanishing[row])
        new = max(REDUNDANT * float(self.natural[row]), vanishing * VANISHED / VANISHING)
        return new < length <= vanishing

    @cached_property
    def natural(self) -> Array:
        """Lengths that weighed rows can have: those with entries as large as their kind allows, where they have any,
        (rows,)."""
        there = np.abs(self.B) > VANISHING * EPSILON * self._of_summands
        return np.asarray(np.sqrt(np.where(there, self.possible, 0.0) ** 2 @ self._speeds))

    def correction(self, violation: Array) -> Array:
        """Return M^-1 B^T (B M^-1 B^T)^+ violation of the first rows; rows that vanish are left alone."""
        count = len(violation)
        says = self.natural[:count] > self.vanishing[:count]
        weights = 1.0 / self.natural[:count][says]
        if not np.any(says):
            return np.zeros(self.B.shape[1])
        rows = self.weighed[:count][says] * weights[:, np.newaxis]
        along = np.linalg.lstsq(rows, violation[says] * weights, rcond=SINGULAR)[0]
        return np.asarray(np.linalg.solve(self.metric.T, along))


def left_over(system: Constrained, q: Array, rows: Sequence[int], t: float = 0.0) -> dict[int, float]:
    """Return what the given rows are off by at a configuration, where that is more than rounding."""
    violation, limits = system.constraint(q, t), REPORTED * _Rows(system, q, t).scale
    return {row: float(violation[row]) for row in rows if row < system.holonomic and abs(violation[row]) > limits[row]}


def _jacobian(system: Constrained, q: Array, t: float) -> Array:
    """Return B. Raises ModelError with the names of rows that are not finite."""
    B = system.jacobian(q, t)
    undefined = [name for name, finite in zip(system.names, np.all(np.isfinite(B), axis=1), strict=True) if not finite]
    if undefined:
        listed = ", ".join(undefined[:_LISTED]) + (
            f" and {len(undefined) - _LISTED} more" if len(undefined) > _LISTED else ""
        )
        what = f"these rows have no finite derivative where constraints are to be met: {listed}"
        hint = "a state in which the points of a distance lie apart, and lengths above 0"
        raise ModelError(Problem("constraints", what, hint))
    return B


#: Evaluates constraints with all their rows, those included that were left out, at parameters (np,).
EveryRow = Callable[[Array], "Constrained"]


def check_left_out(
    system: Constrained, left_out: Sequence[str], q: Array, v: Array, t: float = 0.0, at: str = ""
) -> list[str]:
    """Check that rows that were left out as redundant still follow from the others, at a state that meets these.

    Returns a sentence for each that is off, by so little that it is no contradiction.

    Parameters
    ----------
    system : Constrained
        With all its rows.
    left_out : names of rows
    at : where, in words: the parameters at which this is so

    Raises
    ------
    ModelError
        Rows that are not met, or would be held by nothing if the state moves on.
    """
    rows = [number for number, name in enumerate(system.names) if name in left_out]
    there = _Rows(system, q, t)
    violation = system.constraint(q, t)
    off = [
        f"{system.names[row]} by {violation[row]:.3g}"
        for row in rows
        if row < system.holonomic and not abs(violation[row]) <= there.limits[row]
    ]
    if not off:
        rates, limits = system.velocity(q, v, t), there.rate_limits(np.abs(v))
        off = [f"{system.names[row]} by {rates[row]:.3g} per s" for row in rows if not abs(rates[row]) <= limits[row]]
    if off:
        what = f"rows that were left out, because they follow from others at the default parameters, are off at {at}: "
        what += "; ".join(off[:_LISTED])
        raise ModelError(Problem("constraints", what, _LEFT_OUT))
    kept = [row for row in range(len(system.names)) if row not in rows]
    dependent = redundancy(system, q, t, rows=[*kept, *rows]).dependent
    if len(dependent) < len(rows):
        new = [system.names[row] for row in rows if row not in dependent]
        what = f"rows that were left out, because they follow from others at the default parameters, do not at {at}: "
        what += ", ".join(new[:_LISTED])
        raise ModelError(Problem("constraints", what, _LEFT_OUT))
    by = left_over(system, q, rows, t)
    return [
        f"{system.names[row]}, left out because it follows from others, is off by {by[row]:.3g} at {at}" for row in by
    ]


def _position(system: Constrained, q: Array, t: float) -> tuple[Array, int]:
    best = np.inf
    for iteration in range(MAX_ITERATIONS):
        violation, rows = system.constraint(q, t), _Rows(system, q, t)
        if not np.all(np.isfinite(violation)):
            break
        summands = np.maximum(rows.size[: system.holonomic], np.finfo(float).tiny)
        size = float(np.max(np.abs(violation) / summands, initial=0.0)) / EPSILON
        met = bool(np.all(np.abs(violation) <= rows.limits))
        if size <= ROUNDING or (met and size >= 0.5 * best):
            return q, iteration
        best = min(best, size)
        step = -rows.correction(violation)
        largest = float(np.max(np.abs(step[system.angular]), initial=0.0))
        q = update(system.factors, q, step / max(1.0, largest))
    violation, rows = system.constraint(q, t), _Rows(system, q, t)
    raise _contradiction(rows, system.names, violation, rows.limits, "positions", MAX_ITERATIONS)


def _named(names: Sequence[str], values: Array, limits: Array) -> dict[str, float]:
    return {name: float(value) for name, value, limit in zip(names, values, limits, strict=False) if abs(value) > limit}


def _contradiction(
    rows: _Rows, names: Sequence[str], left: Array, limits: Array, what: str, iterations: int
) -> ModelError:
    order = np.argsort(-np.abs(left) / np.maximum(limits, np.finfo(float).tiny))
    worst = [f"{names[k]} by {left[k]:.3g}" for k in order[:5] if not abs(left[k]) <= limits[k]]
    text = (
        f"the {what} of the constraints cannot be met together: after {iterations} corrections still off:"
        f" {'; '.join(worst)}"
    )
    first = int(order[0])
    if rows.lever(first) * SINGULAR > rows.extent[first]:
        text += f"; {_long_lever(rows, names, first)}"
        hint = _NEARER_FRAMES
    else:
        hint = "an initial state nearer to assembly, or lengths and axes that fit"
    return ModelError(Problem("constraints", text, hint))


_NEARER_FRAMES = "the two frames of the constraint near each other, or its first and second exchanged"


def _long_lever(rows: _Rows, names: Sequence[str], row: int) -> str:
    text = f"turning moves {names[row]} by {rows.lever(row):.3g} m per rad"
    return (
        f"{text}, where what it joins measures {rows.extent[row]:.3g} m" if rows.lever(row) > rows.extent[row] else text
    )


@dataclass(frozen=True)
class Redundancy:
    """Which constraint equations are independent.

    Attributes
    ----------
    dependent : rows that follow from those before them
    hardly : rows that nearly do, and how much of them is new, as a part of what such rows can be
    """

    dependent: tuple[int, ...]
    hardly: dict[int, float]


def redundancy(
    system: Constrained, q: Array, t: float = 0.0, samples: int = 3, rows: Sequence[int] | None = None
) -> Redundancy:
    """Return the rows that follow from others, at the given and at nearby consistent configurations.

    Rows are taken in order: the first to say something is kept. Those of which little is new wait until the others are
    through, and are then taken by how much it is. A row that is dependent at one configuration only (a singular
    position) is no redundant row. What is left of a row is held against what a row of its kind can be there, and
    against rounding, never against the row itself: one that vanishes but for rounding says nothing. ``rows``: those
    looked at, all by default.

    Raises
    ------
    ModelError
        Rounding of places far away hides whether rows say something.
    """
    looked_at = range(len(system.names)) if rows is None else rows
    here = _Rows(system, q, t)
    if _all_new(here, looked_at):
        return Redundancy((), {})
    at_configurations = [here, *(_Rows(system, near, t) for near in _nearby(system, q, t, samples - 1))]
    bases: list[list[Array]] = [[] for _ in at_configurations]

    def rests(row: int) -> list[Array]:
        return [_remainder(at.weighed[row], basis) for at, basis in zip(at_configurations, bases, strict=True)]

    def news(row: int, left: Sequence[Array]) -> list[float]:
        """Return which part of a row is new, place by place, 0 where that is nothing."""
        parts = []
        for at, rest in zip(at_configurations, left, strict=True):
            length, natural = float(np.linalg.norm(rest)), float(at.natural[row])
            says = natural > 0.0 and length > max(REDUNDANT * natural, float(at.vanishing[row]))
            parts.append(length / natural if says else 0.0)
        return parts

    def take(left: Sequence[Array], parts: Sequence[float]) -> None:
        for basis, rest, part in zip(bases, left, parts, strict=True):
            if part > 0.0:
                basis.append(rest / np.linalg.norm(rest))

    waiting: list[int] = []
    for row in looked_at:
        left = rests(row)
        parts = news(row, left)
        if max(parts) < LITTLE:
            waiting.append(row)
        else:
            take(left, parts)
    hardly: dict[int, float] = {}
    while waiting:
        lefts = {row: rests(row) for row in waiting}
        parts_of = {row: news(row, left) for row, left in lefts.items()}
        best = max(waiting, key=lambda row: max(parts_of[row]))
        if max(parts_of[best]) == 0.0:
            break
        waiting.remove(best)
        take(lefts[best], parts_of[best])
        if max(parts_of[best]) < ALMOST_REDUNDANT:
            hardly[best] = max(parts_of[best])
    far = [row for row in looked_at if here.at_long_lever(row)] if waiting else []
    if far:
        raise _lever_too_long(system, here, far[0], waiting)
    hidden = [
        row
        for row in waiting
        if all(at.hides(row, rest) for at, rest in zip(at_configurations, rests(row), strict=True))
    ]
    if hidden:
        raise _too_far_away(system, here, hidden)
    return Redundancy(tuple(waiting), hardly)


def _lever_too_long(system: Constrained, here: _Rows, row: int, dependent: Sequence[int]) -> ModelError:
    listed = ", ".join(system.names[row] for row in dependent[:_LISTED])
    what = (
        f"{_long_lever(here, system.names, row)}, so that nothing tells whether these rows follow from others: {listed}"
    )
    return ModelError(Problem("constraints", what, f'{_NEARER_FRAMES}, or coordinates = "joint"'))


def _too_far_away(system: Constrained, here: _Rows, rows: Sequence[int]) -> ModelError:
    listed = ", ".join(system.names[row] for row in rows[:_LISTED])
    size, extent = max(float(here.size[row]) for row in rows), min(float(here.extent[row]) for row in rows)
    what = (
        f"rounding hides whether these rows follow from others: {listed}; places up to {size:.3g} m away are"
        " subtracted in "
    )
    what += f"them, and what they join measures {extent:.3g} m"
    return ModelError(Problem("constraints", what, "frames of constraints and an origin nearer to the machine"))


def _all_new(here: _Rows, rows: Sequence[int]) -> bool:
    """Return whether much of each row is new at one configuration already."""
    natural = here.natural[list(rows)]
    if len(rows) > here.B.shape[1] or not np.all(natural > 0.0):
        return False
    left = np.abs(np.diag(np.linalg.qr((here.weighed[list(rows)] / natural[:, np.newaxis]).T, mode="r")))
    return bool(np.all(left >= LITTLE)) and bool(np.all(left * natural > here.vanishing[list(rows)]))


def _nearby(system: Constrained, q: Array, t: float, count: int) -> list[Array]:
    """Return consistent configurations near a given one, as far away along each coordinate as inertia lets it go."""
    rows, generator = _Rows(system, q, t), np.random.default_rng(1)
    configurations: list[Array] = []
    extent = float(np.max(rows.extent, initial=0.0))
    for attempt in range(3 * count):
        way = np.linalg.solve(rows.metric.T, generator.standard_normal(len(system.angular)))
        turn = float(np.max(np.abs(way[system.angular]), initial=0.0))
        travel = float(np.max(np.abs(way[~system.angular]), initial=0.0))
        longest = max(turn, travel / extent if extent > 0.0 else 0.0) or 1.0
        try:
            near, _ = _position(
                system, update(system.factors, q, way * (NEARBY / longest / 2 ** (attempt // count))), t
            )
        except ModelError:
            continue
        configurations.append(near)
        if len(configurations) == count:
            break
    return configurations


def _remainder(row: Array, basis: Sequence[Array]) -> Array:
    """Return what of a row the basis does not span (Gram-Schmidt, twice for accuracy)."""
    if not basis:
        return row
    Q = np.array(basis)
    rest = row - Q.T @ (Q @ row)
    return rest - Q.T @ (Q @ rest)
