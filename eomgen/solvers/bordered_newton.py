"""Newton's method for rest under a load factor: sparse, bordered by an arc-length condition, section forces
extrapolated.

Unknowns are q (along its group), multipliers, internal states and the load factor s. With the row of a plane across the
path the matrix is regular at limit points, too: H. B. Keller, in Applications of Bifurcation Theory (1977) 359.
Strains of stiff elements are extrapolated as in ``StiffStrains``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse import block_array, coo_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import SUMMED
from eomgen.lie.few_poses import update_one
from eomgen.lie.product import Factor

#: Corrections at most.
ITERATIONS = 12
#: Unknowns up to which matrices are made as whole arrays: a sparse one of this size takes longer to make than to solve.
WHOLE = 200

#: Whole up to ``WHOLE`` unknowns, sparse beyond.
Matrix = csc_array | Array
#: The map from right sides to solutions of equations; None if the equations are singular.
Solution = Callable[[Array], Array | None]


def sparse(matrix: Matrix) -> csc_array:
    """Return a matrix as a sparse one."""
    return matrix if isinstance(matrix, csc_array) else csc_array(matrix)


def whole(matrix: Matrix) -> Array:
    """Return a matrix as a whole array."""
    return matrix if isinstance(matrix, np.ndarray) else np.asarray(matrix.toarray(), dtype=float)


def plus(matrix: Matrix, added: Matrix) -> Matrix:
    """Return the sum of two matrices; a full matrix if the first matrix is full."""
    return matrix + whole(added) if isinstance(matrix, np.ndarray) else csc_array(matrix + sparse(added))


class StiffStrains(Protocol):
    """Strains of elements whose stiffness may be large, by which section forces are extrapolated."""

    @property
    def stiffness(self) -> Array:
        """(elements, m, m) section forces by strain."""

    def values(self, q: Array) -> Array:
        """Return the strains, (elements, m)."""

    def derivative(self, q: Array, d: Array) -> Matrix:
        """Return the Jacobian of the strains in q, (m elements, nv); d: the strains at q."""

    def doubt(self, d: Array) -> str:
        """Return why strains are meaningless, such as an element that turns by half a turn; empty if none is."""

    def geometric(self, q: Array, d: Array, derivative: Matrix, forces: Array) -> Matrix:
        """Return the part of section forces in the tangent, (nv, nv): the derivative of generalized forces by q,
        left-trivialised, with constant section forces.

        Parameters
        ----------
        q, d : (nq,) and (elements, m) ndarray
            Configuration, and the strains there.
        derivative : (m elements, nv) matrix
            Jacobian of the strains.
        forces : (elements, m) ndarray
            Section forces.
        """


@dataclass(frozen=True)
class LoadedState:
    """A configuration q, multipliers, internal states z, and the load factor s."""

    q: Array
    multipliers: Array
    z: Array
    s: float


@dataclass(frozen=True)
class Balance:
    """Unbalanced quantities: residual (nv,), constraints (rows,), rates of internal states (nz,)."""

    residual: Array
    constraint: Array
    rates: Array

    @property
    def vector(self) -> Array:
        if not len(self.constraint) and not len(self.rates):
            return self.residual
        return np.concatenate([self.residual, self.constraint, self.rates])


@dataclass(frozen=True)
class Tangents:
    """Partials: K (nv, nv), B (rows, nv), Rz (nv, nz), Fq (nz, nv), Fz (nz, nz), all whole or all sparse."""

    K: Matrix
    B: Matrix
    Rz: Matrix
    Fq: Matrix
    Fz: Matrix


@dataclass(frozen=True)
class LoadedStatics:
    """Statics of a scene under a load factor s, as callables of a ``LoadedState``.

    Attributes
    ----------
    factors : of the configuration
    sizes : (nv,) scales of components of a displacement: 1 rad, or the scene's length
    reach : scale of the load factor
    balance(rest), tangents(rest), by_factor(rest) : unbalanced quantities, their partials, their derivative by s
    followed(q, s) : q with counted turns adapted to the poses
    strains(s) : of stiff elements; None if there are none
    mass(rest) : (nv, nv)
    """

    factors: Sequence[Factor]
    sizes: Array
    reach: float
    balance: Callable[[LoadedState], Balance]
    tangents: Callable[[LoadedState], Tangents]
    by_factor: Callable[[LoadedState], Balance]
    followed: Callable[[Array, float], Array]
    strains: Callable[[float], StiffStrains | None]
    mass: Callable[[LoadedState], Matrix]

    @cached_property
    def measure(self) -> Array:
        """(nv,) weights of squares of displacements in lengths of paths."""
        return 1.0 / (self.sizes**2 * max(len(self.sizes), 1))

    def length(self, displacement: Array, s: float = 0.0) -> float:
        """Return the length of a displacement (nv,) and a change of the load factor, without squares, which underflow
        at the reach of an extreme load."""
        return math.hypot(*np.sqrt(self.measure) * displacement, s / self.reach)


@dataclass(frozen=True)
class Direction:
    """A direction in unknowns and load factor: (nv + rows + nz,) and s. ``direction`` and ``held_factor`` return one of
    length 1 by ``LoadedStatics.length``, in which multipliers and internal states do not count."""

    unknowns: Array
    s: float


@dataclass(frozen=True)
class CorrectedPoint:
    """Result of Newton's corrections: state, displacement from the start of the step, (nv,), and number of corrections.
    ``trouble`` is the reason for missing convergence; empty after convergence."""

    rest: LoadedState
    displacement: Array
    corrections: int
    trouble: str = ""


def direction(statics: LoadedStatics, rest: LoadedState, before: Direction) -> Direction | None:
    """Return the direction, of length 1, in which the path of equilibria goes on at a state, on the side of ``before``.
    None if the bordered matrix is singular."""
    right = np.zeros(len(before.unknowns) + 1)
    right[-1] = 1.0 / statics.reach
    solved = _solution(statics, rest, statics.tangents(rest), before)(right)
    if solved is None:
        return None
    unknowns, s = solved[:-1], float(solved[-1])
    length = statics.length(unknowns[: len(statics.sizes)], s)
    return Direction(unknowns / length, s / length) if length > 0.0 and math.isfinite(length) else None


def held_factor(statics: LoadedStatics, rest: LoadedState, sign: float = 1.0) -> Direction:
    """Return the direction along the load factor alone (``sign``: up or down), with displacements of 0. Corrections
    orthogonal to this direction keep the factor."""
    return Direction(np.zeros(len(statics.sizes) + len(rest.multipliers) + len(rest.z)), sign * statics.reach)


def correct(
    statics: LoadedStatics, start: LoadedState, along: Direction, way: float, plane: Direction | None = None
) -> CorrectedPoint:
    """Return the equilibrium near a step of length ``way`` along a direction, by Newton's corrections orthogonal to a
    plane's normal. Without convergence, ``trouble`` of the result has the reason.

    Parameters
    ----------
    statics : LoadedStatics
        The scene at rest under a load factor.
    start : LoadedState
        Rest at the start of the step.
    along : Direction
        Direction of the step.
    way : float
        Length of the step in the measure of ``LoadedStatics``.
    plane : Direction, optional
        Normal of the plane in which the corrections lie; ``along`` by default.
    """
    nv = len(statics.sizes)
    plane = along if plane is None else plane
    change = way * along.unknowns
    strains = statics.strains(start.s)
    predicted = _extrapolate_strains(strains, start.q, change[:nv])
    rest, displacement = _move(statics, start, change, way * along.s), change[:nv].copy()
    last = np.inf
    for count in range(1, ITERATIONS + 1):
        try:
            tangents, balance = statics.tangents(rest), statics.balance(rest).vector
        except np.linalg.LinAlgError:
            return CorrectedPoint(rest, displacement, count, "the equations cannot be evaluated there [E2084]")
        if not np.isfinite(balance).all():
            return CorrectedPoint(rest, displacement, count, "forces are not finite there [E2085]")
        strains = statics.strains(rest.s)
        if strains is not None:
            d = strains.values(rest.q)
            if doubt := strains.doubt(d):
                return CorrectedPoint(rest, displacement, count, doubt)
            derivative = strains.derivative(rest.q, d)
            forces = np.einsum("eij,ej->ei", strains.stiffness, predicted - d)
            added = strains.geometric(rest.q, d, derivative, forces)
            tangents = replace(tangents, K=plus(tangents.K, added))
        solution = _solution(statics, rest, tangents, plane, fixed=not plane.unknowns.any())
        solved = solution(np.append(-balance, 0.0))
        if solved is None:
            return CorrectedPoint(rest, displacement, count, "the tangent stiffness is singular there [E2086]")
        step = solved[:nv]
        if strains is not None:
            predicted = d + (derivative @ step).reshape(d.shape)
        size, moved = _sizes(statics, solved)
        if size > 10.0:
            return CorrectedPoint(rest, displacement, count, "corrections grow [E2087]")
        rest, displacement = _move(statics, rest, solved[:-1], float(solved[-1])), displacement + step
        # rad or lengths of the scene; corrections that no longer shrink are rounding
        if moved <= 1e-8 or (moved <= 1e-5 and count > 2 and moved > 0.3 * last):
            return CorrectedPoint(rest, displacement, count)
        if moved <= 3e-4:  # one more with the same factors is the last if at this ratio the next one would be rounding
            solved = solution(np.append(-statics.balance(rest).vector, 0.0))
            if solved is not None and _sizes(statics, solved)[1] ** 2 <= 1e-13 * moved:
                rest = _move(statics, rest, solved[:-1], float(solved[-1]))
                return CorrectedPoint(rest, displacement + solved[:nv], count + 1)
        if count > 5 and moved > 2.0 * last:
            return CorrectedPoint(rest, displacement, count, "corrections grow [E2087]")
        last = moved
    return CorrectedPoint(rest, displacement, ITERATIONS, "corrections do not converge [E2088]")


def _sizes(statics: LoadedStatics, solved: Array) -> tuple[float, float]:
    """Return the largest displacement of a correction, rad or lengths of the scene, without and with the change of the
    load factor, relative to ``reach``, added."""
    size = float((np.abs(solved[: len(statics.sizes)]) / statics.sizes).max(initial=0.0))
    return size, size + abs(float(solved[-1])) / statics.reach


def _extrapolate_strains(strains: StiffStrains | None, q: Array, change: Array) -> Array:
    if strains is None:
        return np.zeros((0, 0))
    d = strains.values(q)
    if not np.any(change):
        return d
    extrapolated: Array = d + (strains.derivative(q, d) @ change).reshape(d.shape)
    return extrapolated


def _move(statics: LoadedStatics, rest: LoadedState, change: Array, s: float) -> LoadedState:
    nv, rows = len(statics.sizes), len(rest.multipliers)
    factor = rest.s + s
    q = statics.followed(update_one(statics.factors, rest.q, change[:nv]), factor)
    return LoadedState(q, rest.multipliers + change[nv : nv + rows], rest.z + change[nv + rows :], factor)


def _solution(
    statics: LoadedStatics, rest: LoadedState, tangents: Tangents, plane: Direction, *, fixed: bool = False
) -> Solution:
    """Return the map from right sides, (nv + rows + nz + 1,), to solutions of the equations bordered by the plane's
    normal.

    The map returns None for a singular matrix.

    Parameters
    ----------
    fixed : whether the load factor stays, so that its derivative does not count
    """
    nv = len(statics.sizes)
    inner = nv + len(rest.multipliers)
    end = inner + len(rest.z)
    row = np.zeros(end + 1)
    np.multiply(statics.measure, plane.unknowns[:nv], out=row[:nv])
    row[end] = plane.s / statics.reach / statics.reach
    blocks = tangents.K, tangents.B, tangents.Rz, tangents.Fq, tangents.Fz
    if isinstance(tangents.K, np.ndarray):
        bordered = np.zeros((end + 1, end + 1))
        bordered[:nv, :nv], bordered[end] = tangents.K, row
        if end > nv:
            B, Rz, Fq, Fz = (whole(block) for block in blocks[1:])
            bordered[nv:inner, :nv], bordered[:nv, nv:inner] = B, B.T
            bordered[:nv, inner:end], bordered[inner:end, :nv], bordered[inner:end, inner:end] = Rz, Fq, Fz
        if not fixed:
            bordered[:end, end] = statics.by_factor(rest).vector
        return _scaled_solution(bordered)
    by_factor = np.zeros(end) if fixed else statics.by_factor(rest).vector
    parts = [slice(0, nv), slice(nv, inner), slice(inner, end)]
    of_q, by_q, of_z, rate_q, rate_z = (sparse(block) for block in blocks)
    last_column = [coo_array(by_factor[part, np.newaxis]) for part in parts]
    matrix = block_array(
        [
            [of_q, by_q.T, of_z, last_column[0]],
            [by_q, None, None, last_column[1]],
            [rate_q, None, rate_z, last_column[2]],
            [*(coo_array(row[np.newaxis, part]) for part in parts), coo_array([[row[-1]]])],
        ],
        format="csc",
    )
    return _scaled_solution(matrix)


def _scaled_solution(matrix: Matrix) -> Solution:
    """Return the map from right sides (n,) to solutions of equations, whose rows and columns are scaled alike for
    solving. A singular matrix is shifted a little; the map returns None if solutions are not finite even then."""
    scaled: Matrix
    if isinstance(matrix, np.ndarray):
        sizes = np.abs(matrix)
        rows, columns = _inverse_roots(sizes.max(axis=1)), _inverse_roots(sizes.max(axis=0))
        scaled = rows[:, np.newaxis] * matrix * columns
    else:
        sizes, of_column = np.abs(matrix.data), columns_of(matrix)
        largest_of_row, largest_of_column = np.zeros(matrix.shape[0]), np.zeros(matrix.shape[1])
        np.maximum.at(largest_of_row, matrix.indices, sizes)
        np.maximum.at(largest_of_column, of_column, sizes)
        rows, columns = _inverse_roots(largest_of_row), _inverse_roots(largest_of_column)
        data = rows[matrix.indices] * matrix.data * columns[of_column]
        scaled = csc_array((data, matrix.indices, matrix.indptr), shape=matrix.shape)
    known = [solver(scaled)]

    def solution(right: Array) -> Array | None:
        for number in range(2):
            if number == len(known):
                known.append(solver(plus(scaled, csc_array(diags_array(np.full(len(rows), SUMMED))))))
            if (solve := known[number]) is not None:
                result: Array = columns * solve(rows * right)
                if np.isfinite(result).all():
                    return result
        return None

    return solution


def solver(matrix: Matrix) -> Callable[[Array], Array] | None:
    """Return the map from right sides (n, ...) to solutions; None if the matrix is exactly singular."""
    if isinstance(matrix, np.ndarray):
        triangles, pivots, fault = dgetrf(matrix)
        return None if fault else lambda right: np.asarray(dgetrs(triangles, pivots, right)[0])
    try:
        return splu(matrix).solve
    except RuntimeError:  # exactly singular
        return None


def columns_of(matrix: csc_array) -> NDArray[np.intp]:
    """Return the columns of the stored entries of a matrix, (count,)."""
    return np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))


def _inverse_roots(sizes: Array) -> Array:
    sizes[~(sizes > 0.0)] = 1.0
    return 1.0 / np.sqrt(sizes)
