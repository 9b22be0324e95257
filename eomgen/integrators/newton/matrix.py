"""Iteration matrix of Newton's method as data: unknowns, nonzeros, entries as functions of the system's partials.

Unknowns (E, h lam, eta) with the mean velocity D = E - B_n^T eta and q = q_n o exp(h D); equations (h r, Phi/h, w):

    [ m M + c C + k K T     B^T          0        ]        K, C, M    partials of the residual in q, v and vdot
    [ B T                    0     -B T B_n^T     ]        B, Z       of w = B v + Phi_t in v and in q
    [ b B + z Z T            0    -z Z T B_n^T    ]        T          tangent operator at h D, B_n: B at q_n

Internal states z add the unknowns y = (z - z_n)/h and the equations h (f - zdot), f = zdot(q, v, z, t):

    [ c Fv + k Fq T          0             0       k Fz - d ]      F, Rz  partials of f, and of the residual in z
    and k Rz in the columns of y and the rows of the residual; the entry next to B_n^T is left out, as below

Rows of coordinates that relative springs join hold sums over their group in place of the diagonal: see ``row_sums``.

With m = b*, c = h g*, k = h^2, b = g*, z = h, d = h dzdot/dy this is the derivative of a step. The entry -h^2 K T B_n^T
next to B^T is left out: eta is O(h^2), so that it costs no iteration, and it would couple bodies that share no joint.
With m = b = 1, c = k = z = 0 and T = 1 the same entries hold [M B^T; B 0], which gives consistent accelerations and
multipliers. Index 3 has no eta, and of w the velocity-level rows only. If forces of constraints act at the start of a
step and Phi holds at the end, B of the rows of Phi differs from B of the columns of lam (``with_end_jacobian``).
Scaling by powers of the step: Arnold and Hante 2017; Bottasso, Dopico and Trainelli 2008.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.lie import numeric
from eomgen.lie.groups import group_named
from eomgen.lie.product import Factor

MatrixIndex = tuple[int, int]

#: Weights of the sum of matrices above, by position in the arrays of terms.
WEIGHTS = ("M", "C", "K", "B", "Z", "one", "zdot")
_MATRICES = ("K", "C", "M", "B", "Z", "X", "Rz", "Fq", "Fv", "Fz", "Fx")
#: Row sums of K and C over groups of coordinates, as entries of the diagonal.
SUMS = {"K": "K_sum", "C": "C_sum"}


@dataclass(frozen=True)
class Unknowns:
    """Numbers of unknowns of each kind in a step, and places of the equations.

    The order is v, lam, eta, then ``z`` internal states. ``inner`` unknowns (the extended system of a long tree) belong
    to the matrix only and come after all others, from ``size`` on, as do their equations. The solution of inner
    unknowns is not needed. Their equations have no right side in Newton's iterations, but have one in methods with one
    factorization and for consistent accelerations at a start.
    """

    v: int
    lam: int
    holonomic: int
    stabilised: bool
    inner: int = 0
    z: int = 0

    @property
    def eta(self) -> int:
        return self.holonomic if self.stabilised else 0

    @property
    def size(self) -> int:
        return self.v + self.lam + self.eta + self.z

    @property
    def first_z(self) -> int:
        """First row and column of the internal states."""
        return self.size - self.z

    @property
    def matrix_size(self) -> int:
        return self.size + self.inner

    def equation(self, row: int) -> int:
        """Return the matrix' row of a row of K, C, M or X: a residual, or the definition of an inner unknown."""
        return row if row < self.v else self.size + row - self.v

    @property
    def skipped_rows(self) -> int:
        """Number of rows of w that are not equations."""
        return 0 if self.stabilised else self.holonomic

    def phi_row(self, constraint: int) -> int | None:
        """Return the row of Phi/h that belongs to a constraint row; None for rows of velocity constraints."""
        return self.v + constraint if constraint < self.holonomic else None

    def velocity_row(self, constraint: int) -> int | None:
        """Return the row of w that belongs to a constraint row; None for holonomic rows without stabilisation."""
        return None if constraint < self.skipped_rows else self.v + self.holonomic + constraint - self.skipped_rows

    @property
    def data(self) -> dict[str, int]:
        """Numbers of unknowns by kind, and starts of kinds and of rows, for the templates."""
        return {
            "v": self.v,
            "lam": self.lam,
            "holonomic": self.holonomic,
            "eta": self.eta,
            "size": self.size,
            "phi": self.v,
            "w": self.v + self.holonomic,
            "skipped": self.skipped_rows,
            "first_z": self.first_z,
        }


@dataclass(frozen=True)
class Packing:
    """Index of each nonzero among the numbers of one evaluation of the partials.

    Attributes
    ----------
    function : str
        ``iteration`` (nonzeros only) or ``partials`` (whole matrices).
    nonzeros : by matrix, from (row, column) to the position in one array of all numbers.
    blocks : by matrix, the position of the first number and the count.
    """

    function: str
    nonzeros: Mapping[str, Mapping[MatrixIndex, int]]
    blocks: Mapping[str, tuple[int, int]]
    size: int


def pack(patterns: Mapping[str, Sequence[MatrixIndex]]) -> Packing:
    """Return the packing of the function ``iteration``."""
    return _append_matrices(Packing("iteration", {}, {}, 0), patterns, _MATRICES)


def with_end_jacobian(packing: Packing) -> Packing:
    """Return the packing with further numbers for B at the end of a step, which follow all other numbers, for rows of
    Phi."""
    first = packing.blocks.get("B", (0, 0))[0]
    moved = {index: packing.size + number - first for index, number in packing.nonzeros["B"].items()}
    blocks = {**packing.blocks, "B_end": (packing.size, len(moved))}
    return Packing(packing.function, {**packing.nonzeros, "B_end": moved}, blocks, packing.size + len(moved))


def dense(nonzero: Mapping[str, Sequence[MatrixIndex]], nv: int) -> Packing:
    """Return the packing of the function ``partials``, whose outputs are whole matrices (nv, nv) one after the other.
    `nonzero` has the nonzeros of each matrix by name, in the order of the outputs."""
    nonzeros: dict[str, dict[MatrixIndex, int]] = {name: {} for name in _MATRICES}
    blocks: dict[str, tuple[int, int]] = {}
    for number, (name, pattern) in enumerate(nonzero.items()):
        start = number * nv * nv
        nonzeros[name] = {(row, column): start + row * nv + column for row, column in pattern}
        blocks[name] = (start, nv * nv)
    return Packing("partials", nonzeros, blocks, len(nonzero) * nv * nv)


def with_sums(packing: Packing, patterns: Mapping[str, Sequence[MatrixIndex]]) -> Packing:
    """Return the packing with row sums of K and C after the other numbers."""
    return _append_matrices(packing, patterns, SUMS.values())


def _append_matrices(packing: Packing, patterns: Mapping[str, Sequence[MatrixIndex]], names: Iterable[str]) -> Packing:
    """Return the packing with the nonzeros of further matrices `names`, by their patterns, after the other numbers."""
    nonzeros, blocks, size = dict(packing.nonzeros), dict(packing.blocks), packing.size
    for name in names:
        pattern = patterns.get(name, ())
        nonzeros[name] = {index: size + k for k, index in enumerate(pattern)}
        if pattern:
            blocks[name] = (size, len(pattern))
        size += len(pattern)
    return Packing(packing.function, nonzeros, blocks, size)


@dataclass
class NonzeroTerms:
    """Terms of each nonzero in the numbers of a packing.

    Attributes
    ----------
    moved : rows of (number, tangent) pairs
        Products of a matrix with T; their numbers continue the numbers of the packing.
    tangents : (factor number, start) pairs, and ``tangent_size`` numbers in all
        The required blocks of T: nine numbers of a rotation, then on SE(3) nine numbers of the block below.
    linear, products : from (row, column) to terms
        (weight, number), and (weight, number, nonzero of B_n), which are subtracted.
    rate_diagonal : places from which d is subtracted, one for each internal state
    """

    moved: list[list[tuple[int, int]]] = field(default_factory=list)
    tangents: list[tuple[int, int]] = field(default_factory=list)
    tangent_size: int = 0
    linear: dict[MatrixIndex, list[tuple[int, int]]] = field(default_factory=dict)
    rate_diagonal: list[MatrixIndex] = field(default_factory=list)
    products: dict[MatrixIndex, list[tuple[int, int, int]]] = field(default_factory=dict)

    @property
    def entries(self) -> set[MatrixIndex]:
        return set(self.linear) | set(self.products) | set(self.rate_diagonal)

    @property
    def operations(self) -> int:
        """Multiplications of one assembly."""
        products = sum(len(terms) for terms in self.products.values())
        return sum(len(row) for row in self.moved) + sum(len(terms) for terms in self.linear.values()) + 2 * products


def iteration_terms(
    unknowns: Unknowns,
    factors: Sequence[Factor],
    packing: Packing,
    groups: Sequence[Sequence[int]] = (),
    *,
    every_tangent: bool = False,
) -> NonzeroTerms:
    """Return the terms of the iteration matrix at the head of this module, in the numbers of a packing.

    Parameters
    ----------
    unknowns : of the step
    factors : of the configuration; rotations have blocks of T
    groups : coordinates over which the diagonal holds row sums instead
    every_tangent : whether blocks of T that the matrix does not need are included
    """
    terms = NonzeroTerms()
    columns = _tangent_rows(factors, terms, packing, every_tangent)
    of_positions = packing.nonzeros.get("B_end", packing.nonzeros["B"])
    sources = {**{name: packing.nonzeros[name] for name in ("K", "Z", "Fq")}, "B": of_positions}
    moved = {name: _times_tangent(sources[name], columns, terms, packing.size) for name in ("K", "B", "Z", "Fq")}
    nonzeros, z, inner = packing.nonzeros, unknowns.first_z, unknowns.size
    transposed = {(column, constraint): number for (constraint, column), number in nonzeros["B"].items()}

    def state_row(state: int) -> int:
        return z + state

    # weight, numbers of a block, the matrix' row of a row of the block, and the first column
    blocks: tuple[tuple[str, Mapping[MatrixIndex, int], Callable[[int], int | None], int], ...] = (
        ("M", nonzeros["M"], unknowns.equation, 0),
        ("C", nonzeros["C"], unknowns.equation, 0),
        ("K", moved["K"], unknowns.equation, 0),
        ("one", nonzeros["X"], unknowns.equation, inner),
        ("one", transposed, unknowns.equation, unknowns.v),
        ("B", nonzeros["B"], unknowns.velocity_row, 0),
        ("Z", moved["Z"], unknowns.velocity_row, 0),
        ("one", moved["B"], unknowns.phi_row, 0),
        ("K", moved["Fq"], state_row, 0),
        ("C", nonzeros["Fv"], state_row, 0),
        ("K", nonzeros["Rz"], unknowns.equation, z),
        ("K", nonzeros["Fz"], state_row, z),
        ("one", nonzeros["Fx"], state_row, inner),
    )
    for name, numbers, row_of, first in blocks:
        weight = WEIGHTS.index(name)
        for (row, column), number in numbers.items():
            if (equation := row_of(row)) is not None:
                terms.linear.setdefault((equation, first + column), []).append((weight, number))
    for k in chain.from_iterable(groups):
        terms.linear[k, k] = [
            (WEIGHTS.index(name), nonzeros[of][k, k])
            for name, of in {"M": "M", **SUMS}.items()
            if (k, k) in nonzeros.get(of, ())
        ]
    terms.rate_diagonal += [(unknowns.first_z + state, unknowns.first_z + state) for state in range(unknowns.z)]
    if unknowns.eta:
        _add_products(terms, unknowns, packing, moved)
    return terms


def _add_products(
    terms: NonzeroTerms, unknowns: Unknowns, packing: Packing, moved: Mapping[str, Mapping[MatrixIndex, int]]
) -> None:
    """Add to the terms, in place, the products of constraint rows with B_n^T, in the columns of eta. `moved` has the
    nonzeros of B and Z times T, by matrix."""
    by_column: dict[int, list[tuple[int, int]]] = {}
    start = packing.blocks["B"][0]
    for (constraint, column), number in packing.nonzeros["B"].items():
        if constraint < unknowns.holonomic:
            by_column.setdefault(column, []).append((constraint, number - start))
    for name in ("B", "Z"):
        weight = WEIGHTS.index("one" if name == "B" else "Z")
        for (constraint, column), number in moved[name].items():
            equation = unknowns.velocity_row(constraint) if name == "Z" else unknowns.phi_row(constraint)
            if equation is None:
                continue
            for other_constraint, nonzero in by_column.get(column, ()):
                index = (equation, unknowns.v + unknowns.lam + other_constraint)
                terms.products.setdefault(index, []).append((weight, number, nonzero))


def _tangent_rows(
    factors: Sequence[Factor], terms: NonzeroTerms, packing: Packing, every: bool
) -> dict[int, list[tuple[int, int]]]:
    """Return by velocity component the nonzeros of its row of T, as pairs (column, number of the tangent), for
    rotations and poses. Blocks that no matrix needs are left out unless `every`. The blocks used are appended to
    ``terms.tangents``."""
    needed = {column for name in ("K", "B", "Z", "Fq") for _, column in packing.nonzeros[name]}
    rows: dict[int, list[tuple[int, int]]] = {}
    for number, factor in enumerate(factors):
        at, start = factor.v_start, terms.tangent_size
        if factor.group == "R" or not (every or needed & set(range(at, at + factor.v_size))):
            continue
        terms.tangents.append((number, start))
        terms.tangent_size += 18 if factor.group == "SE3" else 9
        for i in range(3):
            rows[at + i] = [(at + j, start + 3 * i + j) for j in range(3)]
            if factor.group == "SE3":
                below = [(at + j, start + 9 + 3 * i + j) for j in range(3)]
                rows[at + 3 + i] = below + [(at + 3 + j, start + 3 * i + j) for j in range(3)]
    return rows


def _times_tangent(
    nonzeros: Mapping[MatrixIndex, int],
    tangent_rows: Mapping[int, list[tuple[int, int]]],
    terms: NonzeroTerms,
    first: int,
) -> dict[MatrixIndex, int]:
    """Return the nonzeros of a matrix times T, from (row, column) to the number of the value. Entries in columns
    without T keep their numbers. Products are appended to ``terms.moved`` and numbered from `first` on."""
    result: dict[MatrixIndex, int] = {}
    sums: dict[MatrixIndex, list[tuple[int, int]]] = {}
    for (row, column), number in nonzeros.items():
        if column in tangent_rows:
            for target, tangent in tangent_rows[column]:
                sums.setdefault((row, target), []).append((number, tangent))
        else:
            result[row, column] = number
    for index, products in sums.items():
        result[index] = first + len(terms.moved)
        terms.moved.append(products)
    return result


def evaluate_terms(
    terms: NonzeroTerms, numbers: Array, tangents: Array, B_n: Array, weights: Sequence[float] | Array
) -> dict[MatrixIndex, Array]:
    """Return the values (n,) of all matrix entries at n samples, by (row, column).

    Parameters
    ----------
    numbers : (n, size), of the packing
    tangents : (n, tangent size), blocks of T
    B_n : (n, nonzeros of B)
    weights : (weights,) of all samples, or (n, weights) of each, in the order of ``WEIGHTS``
    """
    moved = np.zeros((len(terms.moved), len(numbers)))
    for at, pairs in _summands(terms.moved):
        moved[at] = moved[at] + (numbers[:, pairs[:, 0]] * tangents[:, pairs[:, 1]]).T
    values = np.concatenate([numbers.T, moved])
    places = {index: position for position, index in enumerate(dict.fromkeys([*terms.linear, *terms.entries]))}
    entries = np.zeros((len(places), len(numbers)))
    of_samples = np.broadcast_to(np.array(weights, float), (len(numbers), len(WEIGHTS)))
    for at, linear in _summands(list(terms.linear.values())):
        entries[at] = entries[at] + of_samples[:, linear[:, 0]].T * values[linear[:, 1]]
    for index, products in terms.products.items():
        for weight, number, nonzero in products:
            entries[places[index]] -= of_samples[:, weight] * values[number] * B_n[:, nonzero]
    for index in terms.rate_diagonal:
        entries[places[index]] -= of_samples[:, WEIGHTS.index("zdot")]
    return {index: entries[places[index]] for index in terms.entries}


def _summands(rows: Sequence[Sequence[tuple[int, int]]]) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Yield, for the first terms of all rows, then the second terms and so on, the rows with such a term and the terms
    (m, 2)."""
    sizes = np.fromiter(map(len, rows), np.intp, len(rows))
    flat = np.fromiter(chain.from_iterable(chain.from_iterable(rows)), np.intp).reshape(-1, 2)
    starts = np.cumsum(sizes) - sizes
    for position in range(sizes.max(initial=0)):
        at = np.flatnonzero(sizes > position)
        yield at, flat[starts[at] + position]


def tangent_numbers(factors: Sequence[Factor], terms: NonzeroTerms, theta: Array) -> Array:
    """Return the numbers of the blocks of T in ``terms.tangents``, (n, tangent size), at increments theta (n, nv)."""
    result = np.zeros((len(theta), terms.tangent_size))
    alike: dict[tuple[str, int], list[tuple[int, int]]] = {}
    for number, start in terms.tangents:
        factor = factors[number]
        alike.setdefault((factor.group, factor.v_size), []).append((factor.v_start, start))
    for (group, size), places in alike.items():
        v_starts, starts = np.array(places).T[..., np.newaxis]
        T = numeric.tangent(group_named(group, size), theta[:, v_starts + np.arange(size)])
        result[:, starts + np.arange(9)] = T[..., :3, :3].reshape(len(theta), -1, 9)
        if group == "SE3":
            result[:, starts + np.arange(9, 18)] = T[..., 3:, :3].reshape(len(theta), -1, 9)
    return result
