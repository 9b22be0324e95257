"""Constraint equations at one configuration: their Jacobian scaled by lengths, which decides their rank, corrections in
the metric of the kinetic energy, and the lengths (extents of the joined bodies) that scale their violations.

Geometry alone decides rank: a rotation counts as the displacement of the points that it moves, for all masses.

No absolute number is a scale here: a row is compared with the sum of magnitudes of its summands, with rounding
a few digits below, and with its largest possible value, the extent of the joined bodies. So units and the
place of a machine, make no difference.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import first_of
from eomgen.errors import ModelError, Problem
from eomgen.lie.product import Factor, update
from eomgen.solvers.beams import Beams
from eomgen.solvers.regular_inertia import inertia_with_rows

if TYPE_CHECKING:
    from eomgen.solvers.sparse_rows import SparseRows

EPSILON = float(np.finfo(float).eps)
#: Rounding errors of a row, in units of the last place of the sum of the magnitudes of summands: upper bound.
WORST_ROUNDING = 1e4
#: Violations above this part of the extent are a contradiction, axes and lengths being given to six digits or more;
#: the violation of a guess is reported above the second.
CONTRADICTION, REPORTED = 1e-6, 1e-10
#: Part of the norm of a row of this kind below which the new part of a row is redundant: lengths and axes that are
#: meant to fit are given to this accuracy.
REDUNDANT = 1e-6
#: Residual of a row that vanishes up to rounding, in units of the last place of the summands: upper bound, and typical
#: value.
VANISHING, VANISHED = 4096.0, 64.0
#: Singular values of B with weighed rows below this part of the largest belong to redundant rows. Corrections have no
#: components in such directions: motions along them change constraints only to second order.
SINGULAR = 3e-5
#: Pivots of M, scaled to a unit diagonal, that make up for coordinates without inertia here.
_RESISTANCE = 1e-14
#: End of the name of a row that is a formula of the user.
FORMULA = ": formula"
#: Largest number of rows listed in a message.
LISTED = 5


@dataclass(frozen=True)
class ConstrainedSystem:
    """A constrained system as callables at fixed parameters.

    Attributes
    ----------
    factors : of the configuration
    names : of the rows, the first ``holonomic`` rows at position level
    units : of the rows, ``m``, ``1`` or ``m/s``
    angular : (nv,) whether a velocity component turns something
    constraint(q, t) -> (holonomic,), velocity(q, v, t) -> (rows,), jacobian(q, t) -> (rows, nv), mass(q) -> (nv, nv)
    sizes(q, t) -> (rows,), (rows,)
        Sum of the magnitudes of the summands of each row, in the unit of the row (m at velocity level), and the extent
        of the joined bodies, m: the largest displacement by rotation.
    Of large systems ``jacobian`` and ``mass`` both give ``scipy.sparse`` matrices.
    move(q, step) -> (nq,)
        Moves a configuration by a step (nv,); None: by the exponential of each factor.
    beams : geometrically exact beams, which corrections strain only if necessary; None if the system has none
    elastic : (nv,) components that deform other beams, likewise; None if the system has none
    """

    factors: Sequence[Factor]
    names: Sequence[str]
    units: Sequence[str]
    angular: NDArray[np.bool_]
    holonomic: int
    constraint: Callable[[Array, float], Array]
    velocity: Callable[[Array, Array, float], Array]
    jacobian: Callable[[Array, float], Any]
    mass: Callable[[Array], Any]
    sizes: Callable[[Array, float], tuple[Array, Array]]
    move: Callable[[Array, Array], Array] | None = None
    beams: Beams | None = None
    elastic: NDArray[np.bool_] | None = None

    def displace(self, q: Array, step: Array) -> Array:
        """Return a configuration moved by a step, (nv,)."""
        return update(self.factors, q, step) if self.move is None else self.move(q, step)

    def stiff(self, elastic: NDArray[np.bool_]) -> ConstrainedSystem:
        """Return the system in which elastic components, a mask (nv,), stay, and the remaining components are the
        unknowns."""
        free = ~elastic

        def move(q: Array, step: Array) -> Array:
            whole = np.zeros(len(elastic))
            whole[free] = step
            return self.displace(q, whole)

        return replace(
            self,
            angular=self.angular[free],
            jacobian=lambda q, t: self.jacobian(q, t)[:, free],
            mass=lambda q: self.mass(q)[np.ix_(free, free)],
            move=move,
            elastic=None,
        )

    def holding(self, held: NDArray[np.bool_]) -> ConstrainedSystem:
        """Return the system whose corrections leave the components marked in ``held``, (nv,), as they are. All
        components stay unknowns, with columns of 0 in the Jacobian and no coupling in the inertia matrix."""
        free = np.where(held, 0.0, 1.0)

        def jacobian(q: Array, t: float) -> Any:
            B = self.jacobian(q, t)
            return B * free if isinstance(B, np.ndarray) else B.multiply(free).tocsr()

        def mass(q: Array) -> Any:
            M = self.mass(q)
            if isinstance(M, np.ndarray):
                return np.asarray(M * np.outer(free, free) + np.diag(np.diag(M) * held))
            from scipy.sparse import diags  # noqa: PLC0415  # of large systems alone

            return (diags(free) @ M @ diags(free) + diags(M.diagonal() * held)).tocsr()

        return replace(self, jacobian=jacobian, mass=mass)

    def without(self, left_out: Sequence[int]) -> ConstrainedSystem:
        """Return the system without the constraint rows of the given numbers."""
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


def elastic_components(factors: Sequence[Factor], beams: Sequence[str]) -> NDArray[np.bool_] | None:
    """Return a mask (nv,) of the velocity components that deform beams with elastic coordinates; None without such
    beams.

    Parameters
    ----------
    beams : names of the factors of beams
    """
    deforming = [np.full(factor.v_size, factor.name in beams) for factor in factors]
    return np.concatenate(deforming) if beams else None


def spread(factors: Sequence[Factor], q: Array) -> Array:
    """Return the distance between bodies that move freely, (n,) in m, which is not visible in frames at body
    origins."""
    places = [q[:, factor.q][:, 4:] for factor in factors if factor.group == "SE3"]
    return np.asarray(np.ptp(places, axis=0).max(axis=1)) if places else np.zeros(len(q))


def split_sizes(values: Array) -> tuple[Array, Array]:
    """Return the results of ``constraint_size`` as two arrays, like ``ConstrainedSystem.sizes``."""
    rows = len(values) // 2
    return values[:rows], values[rows:]


#: Function that evaluates all constraint rows, including rows left out of the equations, at parameters (np,).
EveryRow = Callable[[Array], "ConstrainedSystem"]


class RowScales:
    """Scales of the rows of B at one configuration, or of many samples at once."""

    #: Number of rows at position level, and which components of v are rotations, and which rows are lengths.
    holonomic: int
    angular: NDArray[np.bool_]
    lengths: NDArray[np.bool_]
    #: (..., rows) sum of magnitudes of summands, and extent of the joined bodies; (..., rows, nv) Jacobian.
    size: Array
    extent: Array
    B: Any

    @property
    def scale(self) -> Array:
        """Scales of violations, (..., rows), in the units of the rows."""
        return np.where(self.lengths, self.extent, 1.0)

    @property
    def limits(self) -> Array:
        """Violations of the holonomic rows above which a row is not met."""
        first = np.s_[..., : self.holonomic]
        return np.maximum(CONTRADICTION * self.scale[first], WORST_ROUNDING * EPSILON * self.size[first])

    @property
    def summands(self) -> Array:
        """Sums of magnitudes among the summands of rows, (..., rows)."""
        return np.maximum(self.scale, self.size)

    def entries_of_row(self, scale: Array) -> tuple[Array, Array]:
        """Return the entries of B that a row of a scale, (..., rows), has per radian, and per metre: 1 for lengths, 1 /
        extent for angles."""
        reach = np.where(self.extent > 0.0, self.extent, 1.0)
        return scale, np.where(self.lengths, 1.0, 1.0 / reach)

    def largest_entries(self, scale: Array) -> Array:
        """Return the largest possible entries of B here, (..., rows, nv), for rows of a scale."""
        turning, straight = self.entries_of_row(scale)
        natural = np.where(self.angular, turning[..., np.newaxis], straight[..., np.newaxis])
        return np.asarray(np.maximum(natural, np.abs(self.B)))


class RowsInMetric(RowScales):
    """The rows of B at one configuration, scaled by lengths, with scales of violations. Corrections by these rows are
    of least kinetic size, by M = L L^T. Large systems have sparse rows."""

    def __init__(self, system: ConstrainedSystem, q: Array, t: float) -> None:
        """Evaluate Jacobian, inertia and scales of the rows at a configuration and a time."""
        self.holonomic = system.holonomic
        B, mass = _jacobian(system, q, t), system.mass(q)
        self._sparse: SparseRows | None = None
        if not isinstance(B, np.ndarray):
            from eomgen.solvers.sparse_rows import SparseRows  # noqa: PLC0415  # of large systems alone

            self._sparse = SparseRows(B, mass)
        self._whole = B, mass
        self.angular = system.angular
        self.size, extent = system.sizes(q, t)
        apart = float(spread(system.factors, q[np.newaxis])[0])
        if apart:  # frames at origins of free bodies have no extent except rounding
            extent = np.where(extent > WORST_ROUNDING * EPSILON * np.maximum(self.size, apart), extent, 0.0)
        self.lengths = np.array([unit not in ("1", "1/s") for unit in system.units], dtype=bool)
        # travels alone have no extent: the largest summands are the scale
        summands = float(np.max(self.size[self.lengths], initial=0.0))
        self.machine = machine = _positive(float(np.max(extent, initial=0.0))) or apart or _positive(summands) or 1.0
        # Bodies joined by a row may coincide up to a tolerated contradiction; motions of the whole machine then satisfy
        # the row.
        self.extent = np.where(extent > CONTRADICTION * machine, extent, machine)

    @cached_property
    def B(self) -> Array:
        """The constraint Jacobian, (rows, nv)."""
        return self._whole[0] if self._sparse is None else np.asarray(self._sparse.B.toarray())

    @cached_property
    def _mass(self) -> Array:
        return self._whole[1] if self._sparse is None else np.asarray(self._sparse.M.toarray())

    @cached_property
    def _in_blocks(self) -> SparseRows | None:
        """The rows, if they are sparse and M has small blocks."""
        return None if self._sparse is None or self._sparse.inverse is None else self._sparse

    def rate_limits(self, speeds: Array) -> Array:
        """Return the rates of rows, (rows,), above which a row counts as violated, for components of v up to
        ``speeds``, (nv,)."""
        return np.maximum(
            CONTRADICTION * self.possible_rates(speeds), WORST_ROUNDING * EPSILON * self._rates_of_summands(speeds)
        )

    def possible_rates(self, speeds: Array) -> Array:
        """Return the largest possible rates of rows, (rows,), for components of v of magnitudes up to ``speeds``,
        (nv,)."""
        if self._sparse is None:
            return np.asarray(self.possible @ speeds)
        return self._sparse.larger(*self.entries_of_row(self.scale), self.angular, speeds, 1)

    def _rates_of_summands(self, speeds: Array) -> Array:
        if self._sparse is None:
            return np.asarray(self._summand_sizes @ speeds)
        return self._sparse.larger(*self.entries_of_row(self.summands), self.angular, speeds, 1)

    def lever(self, row: int) -> float:
        """Return the change of a row by rotation, in m per rad; 0 for rows of angles."""
        return float(np.max(np.abs(self.B[row][self.angular]), initial=0.0)) if self.lengths[row] else 0.0

    def has_long_lever(self, row: int) -> bool:
        """Return whether translations in a row are too small against its rotations to be resolved, although the row has
        a full translation (an entry above 0.1)."""
        straight = np.where(self.angular, 0.0, self.B[row])
        if not np.max(np.abs(straight), initial=0.0) > 0.1:
            return False
        part = float(np.linalg.norm(straight))
        return part < 10.0 * REDUNDANT * float(np.linalg.norm(self.scaled_rows[row]))

    @cached_property
    def metric(self) -> Array:
        """L of M = L L^T, (nv, nv); coordinates without inertia get inertia from the rows, or else a small inertia."""
        with contextlib.suppress(np.linalg.LinAlgError):
            return np.asarray(np.linalg.cholesky(self._mass))
        try:
            return np.asarray(np.linalg.cholesky(inertia_with_rows(self._mass, self.B, 1.0 / self.reach)))
        except np.linalg.LinAlgError:
            weights = np.sqrt(np.maximum(np.diag(self._mass), 0.0))
            weights = np.where(weights > 0.0, weights, 1.0)
            values, vectors = np.linalg.eigh(self._mass / np.outer(weights, weights))
            raised = (vectors * np.maximum(values, _RESISTANCE * (values[-1] or 1.0))) @ vectors.T
            return np.asarray(np.linalg.cholesky(raised * np.outer(weights, weights)))

    @cached_property
    def reach(self) -> Array:
        """Displacements per unit of v, (nv,): 1 for translations; for a rotation the largest extent, m, among the
        length rows that depend on it, or of the machine."""
        if self._sparse is None:
            row, column = np.nonzero(self.B)
        else:
            row, column = self._sparse.row, self._sparse.column
        reach, of_lengths = np.zeros(len(self.angular)), self.lengths[row]
        np.maximum.at(reach, column[of_lengths], self.extent[row[of_lengths]])
        return np.where(self.angular, np.where(reach > 0.0, reach, self.machine), 1.0)

    @cached_property
    def scaled_rows(self) -> Array:
        """B scaled by lengths, (rows, nv)."""
        return np.asarray(self.B / self.reach)

    @cached_property
    def without_resistance(self) -> Array:
        """Motions (nv, n), displacements of unit length, that move no inertia and that the rows allow. They span the
        null space of [M B^T; B 0], judged by the rows scaled by lengths."""
        reach, inertia = np.asarray(self.reach), np.maximum(np.diag(self._mass), 0.0)
        weights = np.sqrt(np.where(inertia > 0.0, inertia, 1.0))
        values, vectors = np.linalg.eigh(self._mass / np.outer(weights, weights))
        null = vectors[:, values <= _RESISTANCE * max(values[-1], 0.0)] * (reach / weights)[:, np.newaxis]
        if not null.shape[1]:
            return null
        null = np.linalg.qr(null)[0]
        natural = np.where(self.natural > 0.0, self.natural, 1.0)
        _, sizes, along = np.linalg.svd((self.scaled_rows / natural[:, np.newaxis]) @ null)
        held = np.count_nonzero(sizes > SINGULAR * sizes[:1])
        return np.asarray(null @ along[held:].T)

    @property
    def speeds(self) -> Array:
        """Squares of the velocity components of unit displacement per second, (nv,)."""
        return 1.0 / np.asarray(self.reach) ** 2

    @cached_property
    def possible(self) -> Array:
        """Largest possible entries of B here, (rows, nv)."""
        return self.largest_entries(self.scale)

    @cached_property
    def _summand_sizes(self) -> Array:
        """Largest sum of magnitudes among the summands of each entry in B, (rows, nv)."""
        return self.largest_entries(self.summands)

    @cached_property
    def vanishing(self) -> Array:
        """Lengths of weighed rows that are only rounding, (rows,)."""
        if self._sparse is not None:
            squares = self._sparse.larger(*self.entries_of_row(self.summands), self.angular, self.speeds, 2)
            return VANISHING * EPSILON * np.sqrt(squares)
        with np.errstate(over="ignore"):  # of equations of 1e154 and more
            return np.asarray(VANISHING * EPSILON * np.sqrt(self._summand_sizes**2 @ self.speeds))

    def hides(self, row: int, rest: Array) -> bool:
        """Return whether the remainder of a row, ``rest`` (nv,), may be a new condition as well as rounding. So it is
        for rows made of places far away."""
        length, vanishing = float(np.linalg.norm(rest)), float(self.vanishing[row])
        new = max(REDUNDANT * float(self.natural[row]), vanishing * VANISHED / VANISHING)
        return new < length <= vanishing

    @cached_property
    def natural(self) -> Array:
        """Possible lengths of rows scaled by lengths, (rows,): as long as with the largest possible entries in place of
        nonzeros. Zero for a row that vanishes."""
        if self._sparse is not None:
            row, column, magnitudes = self._sparse.row, self._sparse.column, self._sparse.magnitudes
            possible, least = (
                np.maximum(np.where(self.angular[column], turning[row], straight[row]), magnitudes)
                for turning, straight in map(self.entries_of_row, (self.scale, self.summands))
            )
            squares = np.where(magnitudes > VANISHING * EPSILON * least, possible, 0.0) ** 2 * self.speeds[column]
            return np.sqrt(np.bincount(row, squares, minlength=len(self.size)))
        there = np.abs(self.B) > VANISHING * EPSILON * self._summand_sizes
        with np.errstate(over="ignore"):  # of equations of 1e154 and more
            return np.asarray(np.sqrt(np.where(there, self.possible, 0.0) ** 2 @ self.speeds))

    def all_new(self, least: float) -> bool | None:
        """Return whether each row, next to earlier rows, adds a new part of at least ``least`` times its possible
        length. None if the rows are not sparse, or if only whole matrices can show it."""
        natural = self.natural
        if self._sparse is None or not np.all(natural > 0.0):
            return None
        independent = self._sparse.scale(self.reach).independent(1.0 / natural, len(natural))
        if independent is None:
            return None
        return bool(np.all(independent.new >= least)) and bool(np.all(independent.new * natural > self.vanishing))

    def correction(self, violation: Array) -> Array:
        """Return the velocity change M^-1 B^T (B M^-1 B^T)^+ violation, (nv,), for violations of the first rows. Rows
        that vanish are left alone. Singular values of B, scaled by lengths, give its range; in this range the
        correction is of least kinetic size."""
        count = len(violation)
        says = self.natural[:count] > self.vanishing[:count]
        weights = 1.0 / self.natural[:count][says]
        if not np.any(says):
            return np.zeros(len(self.angular))
        if np.all(says) and self._in_blocks is not None:
            kinetic = 1.0 / self._in_blocks.lengths[:count]
            independent = self._in_blocks.independent(kinetic, count)
            if independent is not None:
                return independent.correction(violation * kinetic)
        rows = self.scaled_rows[:count][says] * weights[:, np.newaxis]
        left, values, right = np.linalg.svd(rows, full_matrices=False)
        kept = values > SINGULAR * values[0]
        # B = U S V: a change x with V x = S^-1 U^T violation, of least kinetic size
        along = left[:, kept].T @ (violation[says] * weights) / values[kept]
        directions = np.linalg.solve(self.metric, (right[kept] * self.reach).T).T
        least = np.linalg.lstsq(directions, along, rcond=None)[0]
        return np.asarray(np.linalg.solve(self.metric.T, least))


def _positive(extent: float) -> float:
    """Return an extent, m; 0 for rounding around zero."""
    return extent if extent > 1e-100 else 0.0


def _jacobian(system: ConstrainedSystem, q: Array, t: float) -> Any:
    """Return the constraint Jacobian B, (rows, nv), sparse in large systems. Raises ModelError with the names of rows
    that are not finite."""
    B = system.jacobian(q, t)
    finite = np.all(np.isfinite(B), axis=1) if isinstance(B, np.ndarray) else np.isfinite(B @ np.ones(B.shape[1]))
    undefined = [name for name, there in zip(system.names, finite, strict=True) if not there]
    if undefined:
        listed = first_of(undefined, LISTED)
        fault = f"these rows have no finite derivative where constraints are to be met: {listed} [E2083]"
        kinds = {name.rpartition(": ")[2] for name in undefined}
        of_slip = "contact with the surface" if "contact with the surface" in kinds else "contact"
        kinds = {of_slip if kind.startswith("no slip") else kind for kind in kinds}
        remedies = {
            "contact": "a state in which no disc lies flat on the plane on which it rolls",
            "contact with the surface": "a start near the surface and within the ends of its curves and maps, and a"
            " body that is smaller than the valleys of the surface",
            FORMULA.removeprefix(": "): "a state in which the formula and its derivatives have values, within the ends"
            " of its curves and maps",
        }
        hints = [remedy for kind, remedy in remedies.items() if kind in kinds]
        if kinds - remedies.keys():
            hints.append("a state in which the points of a distance differ, and lengths above 0")
        hint = "; ".join(hints)
        raise ModelError(Problem("constraints", fault, hint, data=constraints_named(undefined[:LISTED])))
    return B


def constraints_named(rows: Iterable[str]) -> dict[str, list[str]]:
    """Return the names of the constraints of rows, in their order, as data of a problem."""
    return {"constraints": list(dict.fromkeys(row.partition(": ")[0] for row in rows))}


def is_driven(row: str) -> bool:
    """Return whether a row of the constraints, by its name, is the drive of a joint."""
    return row.endswith((": driven angle", ": driven travel"))


#: Remedy if rotation moves a row far more than the size of the joined bodies.
NEARER_FRAMES = "the two frames of the constraint near each other, or its first and second exchanged"


def long_lever(rows: RowsInMetric, names: Sequence[str], row: int) -> str:
    """Return a text on how far rotation moves a row, m per rad, compared with the extent of the joined bodies."""
    text = f"turning moves {names[row]} by {rows.lever(row):.3g} m per rad"
    measure = f", but the bodies that it joins measure {rows.extent[row]:.3g} m"
    return text + measure * bool(rows.lever(row) > rows.extent[row])
