"""Consistent positions and velocities from an approximate guess, of one sample or of many at once.

Positions by Gauss-Newton steps of least kinetic size, q <- q exp(-M^-1 B^T (B M^-1 B^T)^+ Phi); velocities by the same
projection of B v + Phi_t. The pseudo-inverse lets redundant rows be, as long as they do not contradict each other.

The correction of a sample, and its end, follow from its own numbers alone; samples that are done wait.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import SUMMED
from eomgen.errors import ModelError, Problem
from eomgen.lie.product import Factor, update
from eomgen.solvers.beams import Beams, StrainedStart
from eomgen.solvers.constraint_rows import (
    CONTRADICTION,
    EPSILON,
    NEARER_FRAMES,
    REPORTED,
    SINGULAR,
    VANISHING,
    WORST_ROUNDING,
    ConstrainedSystem,
    RowScales,
    RowsInMetric,
    constraints_named,
    is_driven,
    long_lever,
    spread,
)
from eomgen.solvers.regular_inertia import inertia_with_rows

if TYPE_CHECKING:
    from eomgen.solvers.rigid_beams import RigidBeams
    from eomgen.solvers.strain_energy import Strains


MAX_ITERATIONS = 50
#: Rounding errors of a row, in units of the last place of the sum of the magnitudes of the row's summands.
ROUNDING = 4.0
#: Suffix of the names of equations by which beams do not stretch, after the beam's name.
_NO_STRETCH = ": no stretch of element "


@dataclass(frozen=True)
class Assembly:
    """A consistent state q, v, and the distance of the guess from this state.

    Attributes
    ----------
    iterations : number of corrections of positions
    violations : mapping from row to the violation in the guess, if above round-off
    rate_violations : the same for the rates of the rows, at the corrected position
    deviations : a sentence for each row that the state does not satisfy exactly either, with a violation too small for
        a contradiction
    extent : m, largest extent of the bodies that a row joins
    strained : strain of beams in a loop that closes only with strained beams; None if no beam is strained
    """

    q: Array
    v: Array
    iterations: int
    violations: dict[str, float]
    rate_violations: dict[str, float]
    deviations: tuple[str, ...] = ()
    extent: float = 1.0
    strained: StrainedStart | None = None

    def corrections(self, *, given: bool = False) -> list[str]:
        """Return a sentence for each row that the guess violated, for strained beams, and for each violated rate.

        Parameters
        ----------
        given : bool
            Whether the guess has values of a caller: a sentence says if a drive overrides them.

        Returns
        -------
        list of str
            On the violation before the correction; empty without violations. Positions off by less than 1e-7 of the
            size of the joined bodies have no sentence, nor have ``deviations``, which the correction left.
        """
        driven = filter(is_driven, (*self.violations, *self.rate_violations) if given else ())
        ends = dict.fromkeys(driven, ": its drive prescribes it, and the initial value is not taken [W0307]")
        at_position = [
            f"initial position corrected: {name} was off by {value:.3g}{ends.get(name, ' [W0286]')}"
            for name, value in self.violations.items()
        ]
        at_position += [f"initial position corrected: {self.strained} [W0287]"] if self.strained is not None else []
        return at_position + [
            f"initial velocity corrected: {name} changed at {value:.3g} per s{ends.get(name, '')}"
            for name, value in self.rate_violations.items()
        ]


class KeptComponents(NamedTuple):
    """Components of v, masks (nv,), that corrections leave as given, together with the coordinates that they change.

    A state that cannot satisfy the constraints in this way is refused.

    Attributes
    ----------
    positions, velocities : masks of components held in corrections of positions and of velocities
    names : of joints that are held
    """

    positions: NDArray[np.bool_]
    velocities: NDArray[np.bool_]
    names: tuple[str, ...]


def assemble(
    system: ConstrainedSystem, q: Array, v: Array, t: float = 0.0, kept: KeptComponents | None = None
) -> Assembly:
    """Return the consistent state nearest to a guess; beams are strained only if a loop cannot close otherwise.

    Parameters
    ----------
    system : ConstrainedSystem
        Constraints and inertia.
    q, v : (nq,) and (nv,) ndarray
        Guess; v left-trivialised.
    t : float, optional
        Time, s.
    kept : KeptComponents, optional
        Components that stay as given.

    Raises
    ------
    ModelError
        The constraints contradict each other, or the guess is too far away; names the rows that stay violated.
    """
    if kept is None:
        return _assemble(system, system, q, v, t)
    for_positions, for_rates = (
        system.holding(mask) if np.any(mask) else system for mask in (kept.positions, kept.velocities)
    )
    try:
        return _assemble(for_positions, for_rates, q, v, t)
    except ModelError as error:
        problem = error.problems[0]
        hint = f"no hold of the initial state of {', '.join(kept.names)}, {problem.hint}"
        raise ModelError(replace(problem, hint=hint)) from None


def _assemble(system: ConstrainedSystem, for_rates: ConstrainedSystem, q: Array, v: Array, t: float) -> Assembly:
    """Return the consistent state nearest to a guess q, v at time t. Positions are corrected by ``system``, velocities
    by ``for_rates``, which may hold other components. Raises ModelError if the constraints cannot be satisfied
    together."""
    first, start = system.constraint(q, t), RowsInMetric(system, q, t)
    rigid, strained, before = None, None, 0
    if system.beams is not None:
        rigid, q, strained, before = _with_beams(system, system.beams, q, t)
    elif system.elastic is not None:
        closed, corrections, met = _close_rigid_beams(system.stiff(system.elastic), q, t)
        if met:
            q, before = closed, corrections
    q, iterations = consistent_position(system, q, t)
    iterations += before
    system = for_rates
    rows = RowsInMetric(system, q, t)
    guess, rates = v, system.velocity(q, v, t)
    left = rates
    if rigid is not None and np.any(rigid.free) and np.any(np.abs(rates) > REPORTED * rows.possible_rates(np.abs(v))):
        v = v + _rigid_change(system, rigid, q, v, t)
        left = system.velocity(q, v, t)
    elif system.elastic is not None and np.any(np.abs(rates) > REPORTED * rows.possible_rates(np.abs(v))):
        change = np.zeros(len(v))
        change[~system.elastic] = -RowsInMetric(system.stiff(system.elastic), q, t).correction(rates)
        v = v + change
        left = system.velocity(q, v, t)
    v = v - rows.correction(left)
    left = system.velocity(q, v, t)
    limits = np.maximum(rows.rate_limits(np.maximum(np.abs(guess), np.abs(v))), CONTRADICTION * np.abs(rates))
    limits = np.maximum(limits, np.finfo(float).tiny)  # smaller limits are below the resolution of numbers
    if not np.all(np.abs(left) <= limits):
        raise _contradiction(rows, system.names, left, limits, "velocities", iterations)
    violations = _values_beyond(system.names, first, 1e-7 * start.scale)  # positions given to seven digits reach this
    changed = _values_beyond(system.names, rates, REPORTED * rows.possible_rates(np.abs(guess)))
    off = _values_beyond(system.names, system.constraint(q, t), REPORTED * rows.scale)
    deviations = tuple(f"{name} stays off by {by:.3g}" for name, by in off.items())
    return Assembly(q, v, iterations, violations, changed, deviations, rows.machine, strained)


def _with_beams(
    system: ConstrainedSystem, beams: Beams, q: Array, t: float
) -> tuple[RigidBeams, Array, StrainedStart | None, int]:
    """Return the guess with loops closed by joints and rigid motions of the beams, or else with the least strain.

    Returns
    -------
    shapes of the beams in the guess; configuration, by corrections of least kinetic size if neither way closes the
    loops; strain of the beams, or None; number of corrections
    """
    from eomgen.solvers.rigid_beams import RigidBeams  # noqa: PLC0415  # few models have exact beams

    rigid = RigidBeams(beams, system.factors, system.angular, q)
    closed, iterations, met = _close_rigid_beams(rigid.reduce(system), q, t)
    if met:
        return rigid, closed, None, iterations
    from eomgen.solvers.strain_energy import Strains  # noqa: PLC0415  # imports SciPy

    strains = Strains(beams, system, q)
    # Newton's method finds stretched shapes, which pull straight; Gauss-Newton finds more of the compressed shapes
    ways = (_least_strained(system, strains, closed, t, geometric=geometric) for geometric in (True, False))
    best = min((way for way in ways if way is not None), key=itemgetter(0), default=None)
    if best is None:
        closed, more = consistent_position(system, q, t)
        return rigid, closed, strains.at_start(closed, np.zeros(0)), iterations + more
    _, closed, multipliers, more = best
    return rigid, closed, strains.at_start(closed, multipliers), iterations + more


def _close_rigid_beams(system: ConstrainedSystem, q: Array, t: float) -> tuple[Array, int, bool]:
    """Return the configuration of rigid beams with the smallest violations, the number of corrections, and whether the
    constraints are satisfied. ``system`` has the free coordinates as unknowns."""
    best, least, waited = q, np.inf, 0
    for iteration in range(MAX_ITERATIONS):
        violation, rows = system.constraint(q, t), RowsInMetric(system, q, t)
        if not np.all(np.isfinite(violation)):
            break
        summands = np.maximum(rows.size[: system.holonomic], np.finfo(float).tiny)
        size = float(np.max(np.abs(violation) / rows.scale[: system.holonomic], initial=0.0))
        if size < least:
            waited = waited if size > 0.9 * least else 0
            best, least = q, size
        if np.all(np.abs(violation) / summands <= ROUNDING * EPSILON):
            return q, iteration, True
        waited += 1
        if waited > 4 or not len(system.angular):
            break
        step = -rows.correction(violation)
        largest = float(np.max(np.abs(step[system.angular]), initial=0.0))
        q = system.displace(q, step / max(1.0, largest))
    return best, iteration, least <= REPORTED


def _least_strained(
    system: ConstrainedSystem, strains: Strains, q: Array, t: float, *, geometric: bool
) -> tuple[float, Array, Array, int] | None:
    """Minimize the strain energy on the constraints, from a nearby configuration.

    Near buckling shapes differ little in energy; then the result is the best shape among all iterates.

    Returns
    -------
    strain energy, J; configuration; multipliers; number of steps. None if no iterate meets the constraints.
    """
    energy, best = np.inf, None
    for iteration in range(MAX_ITERATIONS):
        violation = system.constraint(q, t)
        if not np.all(np.isfinite(violation)):
            break
        try:
            step, multipliers = strains.step(q, t, violation, geometric=geometric)
        except RuntimeError:  # singular
            break
        if not np.all(np.isfinite(step)):
            break
        before, energy = energy, strains.energy(strains.changes(q))
        met = bool(np.all(np.abs(violation) <= RowsInMetric(system, q, t).limits))
        if met and (best is None or energy < best[0]):
            best = energy, q, multipliers, iteration
        if met and abs(before - energy) <= SUMMED * energy:
            break
        largest = float(np.max(np.abs(step[system.angular]), initial=0.0))
        q = system.displace(q, step / max(1.0, largest))
    return best


def _rigid_change(system: ConstrainedSystem, rigid: RigidBeams, q: Array, v: Array, t: float) -> Array:
    """Return the change of velocities, (nv,), that brings the rates of the rows to zero as far as rigid motions of
    beams can."""
    reduced = rigid.reduce(system)
    held = rigid.beams.holds(system.names)
    change = np.zeros(len(v))
    change[rigid.free] = -RowsInMetric(reduced, q, t).correction(system.velocity(q, v, t)[~held])
    along: Array = rigid.velocities(q, change[np.newaxis])[0]
    return along


def consistent_position(system: ConstrainedSystem, q: Array, t: float) -> tuple[Array, int]:
    """Return the configuration nearest to a guess on the constraints at time t, and the number of corrections.

    Raises
    ------
    ModelError
        The constraints contradict each other, or the guess is too far away.
    """
    best = np.full(system.holonomic, np.inf)
    for iteration in range(MAX_ITERATIONS):
        violation, rows = system.constraint(q, t), RowsInMetric(system, q, t)
        if not np.all(np.isfinite(violation)):
            break
        summands = np.maximum(rows.size[: system.holonomic], np.finfo(float).tiny)
        size = np.abs(violation) / summands / EPSILON
        met = np.abs(violation) <= rows.limits
        # row by row: if summands of a row cancel, any part of the row is rounding
        if np.all((size <= ROUNDING) | (met & (size >= 0.5 * best))):
            return q, iteration
        best = np.minimum(best, size)
        step = -rows.correction(violation)
        if not np.any(step):
            break
        largest = float(np.max(np.abs(step[system.angular]), initial=0.0))
        if largest > 1.0:  # a whole step that meets all rows, as of a row that is linear, needs no shortening
            whole = system.displace(q, step)
            if np.all(np.abs(system.constraint(whole, t)) <= rows.limits):
                q = whole
                continue
        q = system.displace(q, step / max(1.0, largest))
    violation, rows = system.constraint(q, t), RowsInMetric(system, q, t)
    raise _contradiction(rows, system.names, violation, rows.limits, "positions", MAX_ITERATIONS)


def _values_beyond(names: Sequence[str], values: Array, limits: Array) -> dict[str, float]:
    return {name: float(value) for name, value, limit in zip(names, values, limits, strict=False) if abs(value) > limit}


def _contradiction(
    rows: RowsInMetric, names: Sequence[str], left: Array, limits: Array, level: str, iterations: int
) -> ModelError:
    """Return the error for constraints that cannot be satisfied together, with the rows that are most off and a remedy.
    ``left`` are the remaining violations or rates, ``limits`` the tolerated ones; ``level`` is "positions" or
    "velocities"."""
    order = np.argsort(-np.abs(left) / np.maximum(limits, np.finfo(float).tiny))
    off = [k for k in order[:5] if not abs(left[k]) <= limits[k]]
    rest = [f"{names[k]} by {left[k]:.3g}" for k in off]
    first, lengths = int(order[0]), _lengths(names, left, limits)
    if lengths:
        rest.append(", ".join(level for level, _ in lengths))
        hint = " and ".join(dict.fromkeys(hint for _, hint in lengths))
    elif rows.lever(first) * SINGULAR > rows.extent[first]:
        rest.append(long_lever(rows, names, first))
        hint = NEARER_FRAMES
    else:
        hint = "an initial state nearer to assembly, or lengths and axes that fit"
        if level == "positions" and len(off) == 1 and names[first].endswith(": formula"):
            hint = "an initial state nearer to assembly, or an equation that is 0 in some state: q**2 + 1 never is"
        if level == "positions" and (driven := [name.partition(":")[0] for name in filter(is_driven, names)]):
            hint += f", or a drive of {' and '.join(driven)} that starts within the range of its loop"
    still = f"after {iterations} corrections still off: {'; '.join(rest)}"
    fault = f"the {level} of the constraints cannot be met together: {still} [E2082]"
    return ModelError(Problem("constraints", fault, hint, data=constraints_named([names[k] for k in off])))


def _lengths(names: Sequence[str], left: Array, limits: Array) -> list[tuple[str, str]]:
    """Return for each inextensible beam that stays strained a sentence on the missing or excess length, and a remedy.
    ``left`` are the violations of the named rows, ``limits`` the tolerated ones."""
    by_beam: dict[str, float] = {}
    for name, value, limit in zip(names, left, limits, strict=False):
        beam, is_stretch, _ = name.partition(_NO_STRETCH)
        if is_stretch and not abs(value) <= limit:
            by_beam[beam] = by_beam.get(beam, 0.0) + float(value)
    longer = 'a longer beam, ends that are nearer to each other, or model = "kirchhoff", which stretches'
    shorter = "an initial shape that is bent, which says to which side the beam is to bend"
    ways = {beam: ("longer", longer) if by > 0.0 else ("shorter", shorter) for beam, by in by_beam.items()}
    off = {beam: f"{way} by more than {abs(by_beam[beam]):.3g} m" for beam, (way, _) in ways.items()}
    text = "the beam {} would have to be {}, and it does not stretch"
    return [(text.format(beam, off[beam]), hint) for beam, (_, hint) in ways.items()]


#: Numbers of samples.
Chosen = NDArray[np.intp]


@dataclass(frozen=True)
class ConstrainedSamples:
    """A constrained system as callables of n chosen samples, each with its parameters.

    Attributes
    ----------
    factors : of the configuration
    lengths : (rows,) whether a row is measured in m, the first ``holonomic`` rows at position level
    angular : (nv,) whether a velocity component turns something
    constraint(q, chosen) -> (n, holonomic), velocity(q, v, chosen) -> (n, rows), jacobian(q, chosen) -> (n, rows, nv)
    mass(q, chosen) -> (n, nv, nv)
    sizes(q, chosen) -> (n, rows), (n, rows)
        As of ``ConstrainedSystem``.
    """

    factors: Sequence[Factor]
    lengths: NDArray[np.bool_]
    angular: NDArray[np.bool_]
    holonomic: int
    constraint: Callable[[Array, Chosen], Array]
    velocity: Callable[[Array, Array, Chosen], Array]
    jacobian: Callable[[Array, Chosen], Array]
    mass: Callable[[Array, Chosen], Array]
    sizes: Callable[[Array, Chosen], tuple[Array, Array]]

    def of(self, samples: Chosen) -> ConstrainedSamples:
        """Return the system of the samples with the numbers ``samples``, numbered anew from 0."""
        return replace(
            self,
            constraint=lambda q, chosen: self.constraint(q, samples[chosen]),
            velocity=lambda q, v, chosen: self.velocity(q, v, samples[chosen]),
            jacobian=lambda q, chosen: self.jacobian(q, samples[chosen]),
            mass=lambda q, chosen: self.mass(q, samples[chosen]),
            sizes=lambda q, chosen: self.sizes(q, samples[chosen]),
        )

    def holding(self, held: NDArray[np.bool_]) -> ConstrainedSamples:
        """Return the system whose corrections leave the components marked in ``held``, (nv,), as they are."""
        if not held.any():
            return self
        free = np.where(held, 0.0, 1.0)

        def mass(q: Array, chosen: Chosen) -> Array:
            M = self.mass(q, chosen)
            return np.asarray(M * np.outer(free, free) + np.eye(len(free)) * M * held)

        return replace(self, jacobian=lambda q, chosen: self.jacobian(q, chosen) * free, mass=mass)


class ConsistentStates(NamedTuple):
    """States on the constraints.

    Attributes
    ----------
    q, v : (n, nq), (n, nv)
    met : (n,) whether the constraints are met; ``consistency`` examines the remaining states and describes their faults
    """

    q: Array
    v: Array
    met: NDArray[np.bool_]


class _SampleRows(RowScales):
    """The rows of B of many samples with their scales, as ``RowsInMetric`` of one; ``defined`` marks the samples, (n,),
    whose rows are finite and whose inertia with rows is positive definite."""

    def __init__(self, system: ConstrainedSamples, q: Array, chosen: Chosen) -> None:
        """Evaluate Jacobians, inertia and scales of the rows at the chosen samples."""
        self.holonomic, self.lengths = system.holonomic, system.lengths
        self.B, mass = system.jacobian(q, chosen), system.mass(q, chosen)
        self.size, extent = system.sizes(q, chosen)
        apart = spread(system.factors, q)
        rounding = WORST_ROUNDING * EPSILON * np.maximum(self.size, apart[:, np.newaxis])
        extent = np.where((apart[:, np.newaxis] == 0.0) | (extent > rounding), extent, 0.0)
        machine = extent.max(axis=1, initial=0.0)
        summands = self.size[:, system.lengths].max(axis=1, initial=0.0)
        for sizes in (apart, summands, np.ones(len(q))):
            machine = np.where(machine > 0.0, machine, sizes)
        machine = machine[:, np.newaxis]
        self.extent = np.where(extent > CONTRADICTION * machine, extent, machine)
        self.angular = system.angular
        parts = (self.B, mass, self.size, self.extent)
        finite = [np.isfinite(part).all(axis=tuple(range(1, part.ndim))) for part in parts]
        self.defined: NDArray[np.bool_] = np.logical_and.reduce(finite)
        mass[~self.defined], self.B[~self.defined] = np.eye(mass.shape[-1]), 0.0
        touched = np.where((self.B != 0.0) & self.lengths[:, np.newaxis], self.extent[:, :, np.newaxis], 0.0)
        reach = touched.max(axis=1, initial=0.0)
        self.reach = np.where(system.angular, np.where(reach > 0.0, reach, machine), 1.0)
        self.reach[~self.defined] = 1.0
        self.metric = self._factorise(mass)

    def _factorise(self, mass: Array) -> Array:
        """Return L of M = L L^T, (n, nv, nv); inertia of rows is added to a singular M. Samples with coordinates that
        neither inertia nor rows determine are marked as not ``defined``."""
        try:
            return np.asarray(np.linalg.cholesky(mass))
        except np.linalg.LinAlgError:
            for k, matrix in enumerate(mass):
                try:
                    np.linalg.cholesky(matrix)
                    continue
                except np.linalg.LinAlgError:
                    mass[k] = inertia_with_rows(matrix, self.B[k], 1.0 / self.reach[k])
                try:
                    np.linalg.cholesky(mass[k])
                except np.linalg.LinAlgError:
                    self.defined[k], mass[k] = False, np.eye(len(matrix))
            return np.asarray(np.linalg.cholesky(mass))

    def rate_limits(self, speeds: Array) -> Array:
        """Return the rates of rows, (n, rows), above which a row counts as violated, for components of v up to
        ``speeds`` (n, nv)."""
        return np.maximum(
            CONTRADICTION * _times(self.largest_entries(self.scale), speeds),
            WORST_ROUNDING * EPSILON * _times(self.largest_entries(self.summands), speeds),
        )

    def correction(self, violation: Array) -> Array:
        """Return M^-1 B^T (B M^-1 B^T)^+ violation, (n, nv), for violations (n, count) of the first rows. Rows that
        vanish are left alone, and dependent directions of rows."""
        count = violation.shape[1]
        if count == 0:
            return np.zeros((len(violation), self.B.shape[2]))
        speeds = 1.0 / self.reach**2
        summands = self.largest_entries(self.summands)
        vanishing = VANISHING * EPSILON * np.sqrt(_times(summands**2, speeds))[:, :count]
        there = np.abs(self.B) > VANISHING * EPSILON * summands
        natural = np.sqrt(_times(np.where(there, self.largest_entries(self.scale), 0.0) ** 2, speeds))[:, :count]
        says = natural > vanishing
        weights = np.where(says, 1.0 / np.where(says, natural, 1.0), 0.0)
        rows = self.B[:, :count] / self.reach[:, np.newaxis] * weights[:, :, np.newaxis]
        left, values, right = np.linalg.svd(rows, full_matrices=False)
        kept = values > SINGULAR * values[:, :1]
        along = _times(np.swapaxes(left, 1, 2), violation * weights) * kept / np.where(kept, values, 1.0)
        ways = right * self.reach[:, np.newaxis] * kept[:, :, np.newaxis]
        directions = np.linalg.solve(self.metric, np.swapaxes(ways, 1, 2))
        least = _times(np.linalg.pinv(np.swapaxes(directions, 1, 2)), along)
        return np.asarray(np.linalg.solve(np.swapaxes(self.metric, 1, 2), least[:, :, np.newaxis]))[:, :, 0]


def consistent_states(
    system: ConstrainedSamples, q: Array, v: Array, kept: KeptComponents | None = None
) -> ConsistentStates:
    """Return the consistent states nearest to n guesses.

    Parameters
    ----------
    system : ConstrainedSamples
        Constraints and inertia of n samples.
    q, v : (n, nq) and (n, nv) ndarray
        Guesses; v left-trivialised.
    kept : KeptComponents, optional
        Components that stay as given.
    """
    for_rates = system
    if kept is not None:
        system, for_rates = system.holding(kept.positions), system.holding(kept.velocities)
    with np.errstate(all="ignore"):
        q, met = _positions(system, q)
        chosen = np.flatnonzero(met)
        v = np.array(v, dtype=float)
        if not len(chosen):
            return ConsistentStates(q, v, met)
        system = for_rates
        rows, guess = _SampleRows(system, q[chosen], chosen), v[chosen]
        rates = system.velocity(q[chosen], guess, chosen)
        corrected = guess - rows.correction(np.where(np.isfinite(rates), rates, 0.0))
        left = system.velocity(q[chosen], corrected, chosen)
        limits = rows.rate_limits(np.maximum(np.abs(guess), np.abs(corrected)))
        limits = np.maximum(np.maximum(limits, CONTRADICTION * np.abs(rates)), np.finfo(float).tiny)
        v[chosen] = corrected
        met[chosen] = rows.defined & (np.abs(left) <= limits).all(axis=1)
    return ConsistentStates(q, v, met)


def _positions(system: ConstrainedSamples, q: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return configurations on the constraints, (n, nq), and a mask (n,) of the samples whose corrections succeeded."""
    q, met = np.array(q, dtype=float), np.zeros(len(q), dtype=bool)
    best = np.full((len(q), system.holonomic), np.inf)
    chosen = np.arange(len(q))
    for _ in range(MAX_ITERATIONS):
        violation, rows = system.constraint(q[chosen], chosen), _SampleRows(system, q[chosen], chosen)
        summands = np.maximum(rows.size[:, : system.holonomic], np.finfo(float).tiny)
        size = np.abs(violation) / summands / EPSILON
        kept = np.abs(violation) <= rows.limits
        done = ((size <= ROUNDING) | (kept & (size >= 0.5 * best[chosen]))).all(axis=1)
        going = rows.defined & np.isfinite(violation).all(axis=1)
        met[chosen[done & going]] = True
        best[chosen] = np.minimum(best[chosen], size)
        going &= ~done
        if not going.any():
            break
        violation[~going] = 0.0
        step = -rows.correction(violation)[going]
        chosen = chosen[going]
        largest = np.abs(step[:, system.angular]).max(axis=1, initial=0.0)
        q[chosen] = update(system.factors, q[chosen], step / np.maximum(1.0, largest)[:, np.newaxis])
    return q, met


def _times(matrices: Array, vectors: Array) -> Array:
    """Return products of matrices (n, rows, columns) and vectors (n, columns)."""
    return np.asarray(np.matmul(matrices, vectors[:, :, np.newaxis]))[:, :, 0]
