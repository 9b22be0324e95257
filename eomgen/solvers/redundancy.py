"""Rank: redundant constraint equations, which rows follow from others and whether rows that were left out still do;
equations by formulas whose derivatives vanish, which are refused; and independent columns of a matrix, taken from the
left, with the others as combinations of these.

Orthogonalisation with a second pass (Giraud, Langou and Rozloznik 2005) gives the part of a column outside the span of
earlier ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.errors import ModelError, Problem
from eomgen.lie.product import update
from eomgen.solvers.consistency import consistent_position
from eomgen.solvers.constraint_rows import (
    FORMULA,
    LISTED,
    NEARER_FRAMES,
    REDUNDANT,
    REPORTED,
    ConstrainedSystem,
    RowsInMetric,
    long_lever,
)

#: Relative new part of a row below which other rows are taken first; a tenth of it is nearly redundant.
LITTLE = 1e-3
_LEFT_OUT = "parameters with which the constraints can be met together, or a scene with these values of its own"


@dataclass(frozen=True)
class Redundancy:
    """Which constraint equations are independent.

    Attributes
    ----------
    dependent : rows that follow from earlier rows
    hardly : nearly dependent rows, and the new part of each row, relative to the norm of rows of its kind
    """

    dependent: tuple[int, ...]
    hardly: dict[int, float]


@np.errstate(over="ignore", invalid="ignore")  # lengths whose squares have no value: steps from there fail by name
def redundancy(
    system: ConstrainedSystem, q: Array, t: float = 0.0, samples: int = 3, rows: Sequence[int] | None = None
) -> Redundancy:
    """Return the rows that follow from other rows, at a consistent configuration and at nearby consistent
    configurations.

    Rows are taken in order: the first to add a condition is kept. Rows with a small new part wait until the other rows
    are examined, and are then taken by decreasing new part. A row that is dependent at one configuration only (a
    singular position) is not a redundant row. The new part of a row is compared with the norm of a row of its kind, and
    with rounding, never with the row: a row that vanishes up to rounding adds no condition.

    Parameters
    ----------
    system : ConstrainedSystem
        Constraints and inertia.
    q, t : (nq,) ndarray and float
        Consistent configuration, and time, s.
    samples : int, optional
        Number of configurations, the given one included.
    rows : sequence of int, optional
        Rows to examine; all by default.

    Raises
    ------
    ModelError
        Rounding of places far away hides whether rows add a condition, or the derivatives of an equation by a formula
        vanish at its zeros.
    """
    looked_at = range(len(system.names)) if rows is None else rows
    here = RowsInMetric(system, q, t)
    if _all_new(here, looked_at):
        return Redundancy((), {})
    at_configurations = [here, *(RowsInMetric(system, near, t) for near in _nearby(system, q, t, samples - 1))]
    bases: list[list[Array]] = [[] for _ in at_configurations]

    def rests(row: int) -> list[Array]:
        return [_remainder(at.scaled_rows[row], basis) for at, basis in zip(at_configurations, bases, strict=True)]

    def news(row: int, left: Sequence[Array]) -> list[float]:
        """Return the new part of a row at each configuration, relative to its possible length; 0 without news."""
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
        if max(parts_of[best]) < 0.1 * LITTLE:
            hardly[best] = max(parts_of[best])
    _refuse_long_levers(system, here, looked_at, waiting)
    _refuse_flat(system, looked_at, at_configurations)
    hidden = [
        row
        for row in waiting
        if all(at.hides(row, rest) for at, rest in zip(at_configurations, rests(row), strict=True))
    ]
    if hidden:
        size, extent = max(float(here.size[row]) for row in hidden), min(float(here.extent[row]) for row in hidden)
        places = f"places up to {size:.3g} m away are subtracted in them, and the bodies that they join measure"
        fault = f"rounding hides whether these rows follow from others: {_names(system, hidden)}; {places}"
        hint = "frames of constraints and an origin nearer to the machine"
        raise ModelError(Problem("constraints", f"{fault} {extent:.3g} m [E2094]", hint))
    return Redundancy(tuple(waiting), hardly)


def _refuse_flat(system: ConstrainedSystem, rows: Sequence[int], configurations: Sequence[RowsInMetric]) -> None:
    """Raise ModelError if derivatives of equations by formulas, among ``rows``, vanish at their zeros."""
    of_formulas = [row for row in rows if system.names[row].endswith(FORMULA)]
    if flat := [row for row in of_formulas if _vanishes(row, configurations)]:
        fault = "the derivatives of these equations vanish at their zeros, so they hold no motion:"
        fault = f"{fault} {_names(system, flat)} [E2092]"
        raise ModelError(Problem("constraints", fault, "equations that change their sign there: x in place of x**2"))


def _vanishes(row: int, at_configurations: Sequence[RowsInMetric]) -> bool:
    """Return whether a row of B is zero at the first configuration, and nearly zero at the further configurations. The
    further configurations satisfy the constraints only to a tolerance."""
    lengths = [float(np.linalg.norm(at.scaled_rows[row])) for at in at_configurations]
    possible = [float(np.sqrt(at.possible[row] ** 2 @ at.speeds)) for at in at_configurations]
    zero = lengths[0] <= max(REDUNDANT * possible[0], float(at_configurations[0].vanishing[row]))
    # next to a zero that is met to a tolerance
    return zero and all(length <= 1e-2 * size for length, size in zip(lengths[1:], possible[1:], strict=True))


def _refuse_long_levers(
    system: ConstrainedSystem, here: RowsInMetric, rows: Sequence[int], waiting: Sequence[int]
) -> None:
    """Raise ModelError if long levers in ``rows`` hide whether the waiting rows follow from others."""
    far = [row for row in rows if here.has_long_lever(row)] if waiting else []
    if far:
        lever, names = long_lever(here, system.names, far[0]), _names(system, waiting)
        fault = f"{lever}, so that it is unknown whether these rows follow from others: {names} [E2093]"
        raise ModelError(Problem("constraints", fault, f'{NEARER_FRAMES}, or coordinates = "joint"'))


def _names(system: ConstrainedSystem, rows: Sequence[int]) -> str:
    return ", ".join(system.names[row] for row in rows[:LISTED])


def _all_new(here: RowsInMetric, rows: Sequence[int]) -> bool:
    """Return whether each of the rows clearly adds a condition at one configuration, so that no further one is needed.
    The new part must be at least ``LITTLE`` of the possible length of a row."""
    if len(rows) == len(here.size) and (shown := here.all_new(LITTLE)) is not None:
        return shown
    natural = here.natural[list(rows)]
    if len(rows) > here.B.shape[1] or not np.all(natural > 0.0):
        return False
    left = np.abs(np.diag(np.linalg.qr((here.scaled_rows[list(rows)] / natural[:, np.newaxis]).T, mode="r")))
    return bool(np.all(left >= LITTLE)) and bool(np.all(left * natural > here.vanishing[list(rows)]))


def _nearby(system: ConstrainedSystem, q: Array, t: float, count: int) -> list[Array]:
    """Return up to ``count`` consistent configurations near a given one, by pseudo-random displacements of all
    coordinates. Attempts that cannot be brought onto the constraints are repeated with smaller displacements."""
    rows, generator = RowsInMetric(system, q, t), np.random.default_rng(1)
    configurations: list[Array] = []
    extent = float(np.max(rows.extent, initial=0.0))
    for attempt in range(3 * count):
        way = generator.standard_normal(len(system.angular)) / rows.reach
        turn = float(np.max(np.abs(way[system.angular]), initial=0.0))
        travel = float(np.max(np.abs(way[~system.angular]), initial=0.0))
        longest = max(turn, travel / extent if extent > 0.0 else 0.0) or 1.0
        try:
            near, _ = consistent_position(
                system, update(system.factors, q, way * (0.05 / longest / 2 ** (attempt // count))), t
            )
        except ModelError:
            continue
        configurations.append(near)
        if len(configurations) == count:
            break
    return configurations


def _remainder(row: Array, basis: Sequence[Array]) -> Array:
    """Return the part of a row, (nv,), outside the span of the orthonormal basis (Gram-Schmidt, twice for accuracy)."""
    if not basis:
        return row
    Q = np.array(basis)
    rest = row - Q.T @ (Q @ row)
    return rest - Q.T @ (Q @ rest)


def left_over(system: ConstrainedSystem, q: Array, rows: Sequence[int], t: float = 0.0) -> dict[int, float]:
    """Return the violations, above rounding, of examined rows at a configuration, by number of the row.

    Parameters
    ----------
    system : ConstrainedSystem
        Constraints and inertia.
    q, t : (nq,) ndarray and float
        Configuration, and time, s.
    rows : sequence of int
        Rows to examine; rows at velocity level are ignored.
    """
    violation, limits = system.constraint(q, t), REPORTED * RowsInMetric(system, q, t).scale
    return {row: float(violation[row]) for row in rows if row < system.holonomic and abs(violation[row]) > limits[row]}


def check_left_out(
    system: ConstrainedSystem, left_out: Sequence[str], q: Array, v: Array, t: float = 0.0, at: str = ""
) -> list[str]:
    """Check that rows left out as redundant still follow from the remaining rows, at a state that satisfies the
    remaining rows.

    Returns a sentence for each row with a violation above rounding but too small for a contradiction.

    Parameters
    ----------
    system : ConstrainedSystem
        With all rows.
    left_out : names of rows
    q, v, t : the state, left-trivialised, and the time, s
    at : in words: the parameters of the state, for messages

    Raises
    ------
    ModelError
        Rows that are violated, or would not be held by any motion.
    """
    rows = [number for number, name in enumerate(system.names) if name in left_out]
    there = RowsInMetric(system, q, t)
    violation = system.constraint(q, t)
    off = [
        f"{system.names[row]} by {violation[row]:.3g}"
        for row in rows
        if row < system.holonomic and not abs(violation[row]) <= there.limits[row]
    ]
    if not off:
        rates, limits = system.velocity(q, v, t), there.rate_limits(np.abs(v))
        off = [f"{system.names[row]} by {rates[row]:.3g} per s" for row in rows if not abs(rates[row]) <= limits[row]]
    left_out_rows = "rows that were left out, because they follow from others at the default parameters"
    if off:
        fault = f"{left_out_rows}, are off at {at}: {'; '.join(off[:LISTED])} [E2095]"
        raise ModelError(Problem("constraints", fault, _LEFT_OUT))
    kept = [row for row in range(len(system.names)) if row not in rows]
    dependent = redundancy(system, q, t, rows=[*kept, *rows]).dependent
    if len(dependent) < len(rows):
        new = [system.names[row] for row in rows if row not in dependent]
        fault = f"{left_out_rows}, do not at {at}: {', '.join(new[:LISTED])} [E2096]"
        raise ModelError(Problem("constraints", fault, _LEFT_OUT))
    by = left_over(system, q, rows, t)
    return [
        f"{system.names[row]}, left out because it follows from others, is off by {by[row]:.3g} at {at}" for row in by
    ]


#: Part of a column that counts as rounding.
ROUNDING = 1e-10


class NoRankGap(ArithmeticError):
    """Error for columns that are so nearly dependent that rounding hides whether they are."""


@dataclass(frozen=True)
class IndependentColumns:
    """Independent columns ``kept`` of a matrix A, and ``others``, which are A[:, kept] @ coefficients; zero columns are
    neither.

    Attributes
    ----------
    coefficients : (kept, others)
    own : smallest part of a kept column that is independent of the previous kept columns
    left : largest part of any other column that is independent of the kept columns: rounding
    """

    kept: tuple[int, ...]
    others: tuple[int, ...]
    coefficients: Array
    own: float
    left: float


def independent_columns(A: Array) -> IndependentColumns:
    """Return the independent columns of A, (rows, columns), taken from the left; A needs at least as many rows as its
    rank.

    Raises
    ------
    NoRankGap
        Some columns are so nearly dependent that rounding hides whether they are.
    """
    size = np.linalg.norm(A, axis=0)
    present = np.flatnonzero(size > ROUNDING * np.max(size, initial=0.0))
    unit = A[:, present] / size[present]
    basis, kept, others, parts = list[Array](), list[int](), list[int](), list[float]()
    for index in range(len(present)):
        rest = _remainder(unit[:, index], basis)
        part = float(np.linalg.norm(rest))
        parts.append(part)
        if part > ROUNDING and len(kept) < min(A.shape):
            basis.append(rest / part)
            kept.append(index)
        else:
            others.append(index)
    low, left = min((parts[k] for k in kept), default=1.0), max((parts[k] for k in others), default=0.0)
    if low < 1e3 * left:  # no clear gap between kept columns and columns left out
        raise NoRankGap(f"a column differs from those before it by {low:.1e} of its norm, and rounding is {left:.1e}")
    solved = np.linalg.lstsq(unit[:, kept], unit[:, others], rcond=None)[0]
    solved[np.abs(solved) < 1e2 * ROUNDING] = 0.0
    scale = size[present]
    result = solved * scale[others] / scale[kept][:, np.newaxis]
    columns = present[kept], present[others]
    return IndependentColumns(
        tuple(map(int, columns[0])), tuple(map(int, columns[1])), np.vectorize(short, otypes=[float])(result), low, left
    )


def short(number: float) -> float:
    """Return the ten-digit decimal or the fraction that equals a number up to rounding, else the number."""
    for candidate in (float(f"{number:.10g}"), float(Fraction(number).limit_denominator(360))):
        if abs(candidate - number) <= 1e-11 * abs(number):
            return candidate
    return number
