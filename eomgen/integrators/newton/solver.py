"""Linear solver of an implicit step as data for the templates: assembly, elimination, substitution."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import accumulate, chain
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.errors import ModelError
from eomgen.integrators.newton.elimination import Elimination, eliminate
from eomgen.integrators.newton.matrix import (
    MatrixIndex,
    NonzeroTerms,
    Packing,
    Unknowns,
    evaluate_terms,
    iteration_terms,
    tangent_numbers,
)
from eomgen.integrators.newton.sample_matrices import SampledPartials
from eomgen.integrators.newton.stages import Fronts, fewest_operations, make_fronts, stages, stages_of_tree
from eomgen.lie.product import Factor
from eomgen.system.system import WHOLE, Sample

#: Multiply-subtracts up to which an elimination is written out, statement by statement.
UNROLLED = 4000
#: Unknowns up to which one with groups is, whose repeated stages do not share code.
GROUPS_UNROLLED = 64
#: Weights that leave inertia and constraints.
_INERTIA = (1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True)
class Solver:
    """Terms of a step's matrix and the way in which templates factor it.

    Attributes
    ----------
    unknowns, packing, terms : of the matrix, see ``newton.matrix``
    elimination : order and fill of the sparse factorization; None for a dense matrix
    fronts : the same as fronts, if stages of the elimination repeat; else None
    growth : length of the scene that is meant, relative to the derived scene
    """

    unknowns: Unknowns
    packing: Packing
    terms: NonzeroTerms
    elimination: Elimination | None
    fronts: Fronts | None = None
    growth: float = 1.0

    @property
    def kind(self) -> str:
        if self.elimination is None:
            return "dense"
        if self.fronts is not None:
            return "fronts"
        return "unrolled" if _is_written_out(self.elimination, self.growth) else "tables"

    @property
    def factor_operations(self) -> float:
        """Multiplications of one assembly and factorization."""
        work = self.unknowns.size**3 / 3 if self.elimination is None else self.elimination.operations
        return float(self.terms.operations + work)

    @property
    def solve_operations(self) -> float:
        return float(self.unknowns.size**2 if self.elimination is None else self.elimination.solve_operations)


def _is_written_out(elimination: Elimination, growth: float) -> bool:
    few = not elimination.groups or growth * elimination.size <= GROUPS_UNROLLED
    return few and growth * elimination.operations <= UNROLLED


def make_solver(
    unknowns: Unknowns,
    factors: Sequence[Factor],
    samples: SampledPartials,
    weights: Sequence[float],
    step: float,
    owners: Sequence[int] = (),
    groups: Sequence[Sequence[int]] = (),
    *,
    at_start: bool = False,
    turned: bool = False,
    sample: Sample = WHOLE,
) -> Solver:
    """Return the linear solver of an implicit step: matrix terms, and pivots chosen by samples of the matrix.

    The pivots must also serve for consistent accelerations. Written-out code, tables, fronts or a dense matrix are
    chosen by the number of operations. Raises ModelError if the matrix is singular at the samples.

    Parameters
    ----------
    unknowns : numbers of unknowns of each kind, and places of the equations
    factors : of the configuration
    samples : numbers of the partials, and velocities, at states of the system
    weights : of the matrices, see ``newton.matrix.WEIGHTS``
    step : s
    owners : for each inner unknown of a long tree, a velocity component of its link
    groups : unknowns joined by relative springs, see ``newton.elimination``
    at_start : whether the linearisation is about zero increments, so that T is 1. Then accelerations are not required,
        so M may be singular; inner unknowns have right sides; pivots are on the diagonal if the choice is free
    turned : with ``at_start``, whether rotations have T(step v) in place of 1
    sample : of the scene that is meant
    """
    growth = sample.growth
    moving = factors if turned or not at_start else ()
    terms = iteration_terms(unknowns, moving, samples.packing, groups, every_tangent=turned)
    B = _weighed_jacobian(unknowns, samples)
    ways = [(step * samples.v, weights)] if at_start else [(step * samples.v, weights), (0.0 * samples.v, _INERTIA)]
    values = evaluate_terms(
        terms,
        np.concatenate([samples.numbers] * len(ways)),
        np.concatenate([tangent_numbers(factors, terms, theta) for theta, _ in ways]),
        np.concatenate([B] * len(ways)),
        np.repeat([chosen for _, chosen in ways], len(samples.numbers), axis=0),
    )
    if not unknowns.inner:
        values = _in_natural_units(unknowns, samples, values)
    packing = samples.packing
    if unknowns.inner:
        order = stages_of_tree(unknowns, factors, owners, packing)
    else:
        order = stages(unknowns, factors, packing, growth)
    options: dict[str, Any] = {"stages": order, "groups": groups, "diagonal_first": at_start, "sample": sample}
    choose: Callable[..., Elimination] = partial(eliminate, unknowns.matrix_size, **options)
    elimination = _pivots(choose, values, len(samples.numbers), constrained="B" in packing.blocks)
    if groups:
        return Solver(unknowns, samples.packing, terms, elimination, None, growth)
    operations = growth * elimination.operations
    # a compiler takes five seconds for the fronts of bodies on joints, and one for tables of the same elimination
    most = min(3 * UNROLLED if sample.orders is None else UNROLLED, operations / 2)
    if fewest_operations(elimination, list(values)) <= most:
        fronts = make_fronts(elimination, list(values), unknowns.matrix_size if at_start else unknowns.size)
        repetitions = 4 if operations <= UNROLLED / 2 else 2  # fronts for each piece of code
        repeated = operations > UNROLLED or growth * len(fronts.kind_of) >= repetitions * len(fronts.kinds)
        if fronts.operations <= most and repeated:
            return Solver(unknowns, samples.packing, terms, elimination, fronts, growth)
    # a loop over a whole matrix runs four times faster per operation than one over tables
    whole = (growth * unknowns.size) ** 3 / 3 < 4.0 * operations
    loop_is_cheaper = operations > UNROLLED and whole and not unknowns.inner
    return Solver(unknowns, samples.packing, terms, None if loop_is_cheaper else elimination, None, growth)


def _pivots(
    choose: Callable[..., Elimination], values: Mapping[MatrixIndex, Array], count: int, *, constrained: bool
) -> Elimination:
    """Return an elimination whose pivots serve at all samples, or if only the scene's own state is singular, at all
    others; ``choose`` makes one from entries. Rings of a gimbal that are aligned in the scene, and links of a linkage
    that lie in one line, do not matter for runs that start elsewhere. ``values`` are entries at ``count`` samples for a
    step, the scene's state first, and, if required, the same for accelerations. Raises ModelError if no pivots serve;
    `constrained` is for its message."""
    try:
        return choose(values, constrained=constrained)
    except ModelError:
        if count < 2:
            raise
        others = np.arange(len(next(iter(values.values())))) % count > 0
        with suppress(ModelError):
            return choose({index: part[others] for index, part in values.items()})
        raise  # of the scene's state, which the message names


def _in_natural_units(
    unknowns: Unknowns, samples: SampledPartials, values: dict[MatrixIndex, Array]
) -> dict[MatrixIndex, Array]:
    """Return the entries in units of the machine's size and mass.

    Rows and columns of a saddle matrix can be equilibrated in many ways, and some equilibrations make the matrix nearly
    singular. So the equilibration begins at the same numbers in any units. Units are powers of 1000 in length and of
    1e6 in inertia, so that pivots depend little on the numbers of a scene.
    """
    scale = samples.scale
    diagonal = [
        abs(samples.numbers[0, number]) * scale[k] ** 2
        for k, number in enumerate(_inertia_numbers(unknowns, samples.packing))
        if number >= 0
    ]
    inertia = _power(max(diagonal, default=1.0), 6)
    largest = np.zeros(unknowns.lam)
    for (constraint, column), number in samples.packing.nonzeros["B"].items():
        reach = np.max(np.abs(samples.numbers[:, number]), initial=0.0) * scale[column]
        largest[constraint] = max(largest[constraint], reach)
    rows, columns = np.ones((2, unknowns.matrix_size))
    rows[: unknowns.v], columns[: unknowns.v] = scale / inertia, scale
    for constraint, reach in enumerate(largest):
        unit = _power(reach, 3)
        for row in (unknowns.phi_row(constraint), unknowns.velocity_row(constraint)):
            if row is not None:
                rows[row] = 1.0 / unit
        columns[unknowns.v + constraint] = inertia / unit
        if constraint < unknowns.eta:
            columns[unknowns.v + unknowns.lam + constraint] = inertia / unit
    if np.all(rows == 1.0) and np.all(columns == 1.0):
        return values
    return {(row, column): part * (rows[row] * columns[column]) for (row, column), part in values.items()}


def _power(size: float, digits: int) -> float:
    """Return the power of 10 ** digits next to a size; 1 for none."""
    return float(10.0 ** (digits * round(np.log10(size) / digits))) if 0.0 < size < np.inf else 1.0


def _weighed_jacobian(unknowns: Unknowns, samples: SampledPartials) -> Array:
    """Return the nonzeros of B at n samples, (n, nonzeros), times 1/M_ii of their columns at the first sample. In this
    way eta, multipliers of the velocity constraints, moves positions. Inertias count at least as half of the digits of
    the largest one: products of rows of B, whose condition is the one of M, keep the digits of heavy parts."""
    start, count = samples.packing.blocks.get("B", (0, 0))
    numbers, diagonal = _inertia_numbers(unknowns, samples.packing), np.zeros(unknowns.v)
    for component, number in enumerate(numbers):
        diagonal[component] = samples.numbers[0, number] if number >= 0 else 0.0
    sizes = samples.scale**2
    least = np.sqrt(np.finfo(float).eps) * np.max(diagonal * sizes, initial=0.0)
    weights = 1.0 / np.maximum(diagonal, (least if least > 0.0 else 1.0) / sizes)
    columns = [column for _, column in samples.packing.nonzeros["B"]]
    return np.asarray(samples.numbers[:, start : start + count] * weights[columns], dtype=float)


def _inertia_numbers(unknowns: Unknowns, packing: Packing) -> list[int]:
    """Return the indices of M_ii among the numbers, -1 if M has no such entry; empty if M is spread over inner
    unknowns."""
    return [] if unknowns.inner else [packing.nonzeros["M"].get((k, k), -1) for k in range(unknowns.v)]


def sources_on_links(solver: Solver, links: Sequence[tuple[int, int]]) -> bool:
    """Return whether right sides can have sources on these pairs of unknowns, apart from sources on the unknowns.

    The elimination of k spreads the source n_k and the sources on links of k, f_kj on k and -f_kj on j, to the
    neighbours of k:

        n_j + (w_kj n_k - d_k f_kj)/p,   f_jm + (w_kj f_km - w_km f_kj)/p,   p = d_k + sum_j w_kj,

    star and mesh with sources. Even a large f contributes n times d/p only. This holds if w is symmetric, and
    other unknowns, whose couplings may not be, change no w.
    """
    elimination = solver.elimination
    if not links or elimination is None or solver.kind != "unrolled":
        return False
    group, below = elimination.groups, [set[int]() for _ in elimination.groups]
    for row, across in enumerate(elimination.lower):
        for column in across:
            below[column].add(row)
    return not any(
        group[row] == group[column] >= 0 and group[pivot] != group[row] and row != column
        for pivot, rows in enumerate(below)
        for row in rows
        for column in elimination.upper[pivot]
    )


def solver_data(
    solver: Solver,
    factors: Sequence[Factor],
    links: Sequence[tuple[int, int]] = (),
    *,
    plain: bool = False,
    iterated: bool = False,
) -> dict[str, Any]:
    """Return the solver as data of templates, JSON types: sizes, terms in the order of stored entries, and the
    elimination.

    The key ``elimination`` is missing for a dense matrix.

    Parameters
    ----------
    solver : terms and elimination of the matrix
    factors : of the configuration
    links : pairs of unknowns with sources on right sides, which follow the sources on unknowns
    plain : whether right sides are taken unchanged, also of inner unknowns; else rows are scaled, and inner unknowns
        have no right side
    iterated : whether an iteration makes up for a vanished pivot that is replaced
    """
    packing, terms = solver.packing, solver.terms
    indices = _sort(terms.entries, solver.elimination) if solver.fronts is None else list(solver.fronts.read_order)
    place_of = {index: position for position, index in enumerate(indices)}
    patterns = {name: [list(index) for index in packing.nonzeros[name]] for name in ("B", "Fq", "Fv", "Fz")}
    data: dict[str, Any] = {
        "kind": solver.kind,
        "function": packing.function,
        "numbers": packing.size,
        "products": len(terms.moved),
        "nonzeros": len(indices),
        "blocks": {name: list(block) for name, block in packing.blocks.items()},
        "tangent_size": terms.tangent_size,
        "tangents": [
            {
                "group": factors[number].group.lower(),
                "v": factors[number].v_start,
                "size": factors[number].v_size,
                "start": start,
            }
            for number, start in terms.tangents
        ],
        "moved": [[list(pair) for pair in row] for row in terms.moved],
        "places": [list(index) for index in indices],
        "entries": [
            {
                "linear": [list(term) for term in terms.linear.get(index, ())],
                "products": [list(term) for term in terms.products.get(index, ())],
            }
            for index in indices
        ],
        "state_pattern": patterns["Fz"],
        "Fq": patterns["Fq"],
        "Fv": patterns["Fv"],
        "inertia": _inertia_numbers(solver.unknowns, packing),
        "rate_diagonal": [place_of[index] for index in terms.rate_diagonal],
        "grouped": _grouped_columns(solver),
        # a dense factorization with pivoting replaces chosen pivots that break down
        "fallback": solver.elimination is None or solver.growth * solver.unknowns.matrix_size <= 120,
        "B": patterns["B"],
        "plain": plain,
        "iterated": iterated,
    }
    if solver.fronts is not None and solver.elimination is not None:
        rights = solver.unknowns.matrix_size if plain else solver.unknowns.size
        data["elimination"] = _fronts_data(solver.fronts, solver.elimination, solver.unknowns.size, rights)
    elif solver.elimination is not None:
        data["elimination"] = _elimination_data(solver.elimination, indices, solver.growth)
        if links:
            _add_sources(data["elimination"], links, unknowns=solver.unknowns.size)
    return data


def _grouped_columns(solver: Solver) -> list[list[int]]:
    """Return the off-diagonal entries, as sorted (row, column) pairs, whose row and column belong to the same group."""
    elimination = solver.elimination
    if elimination is None or not elimination.groups:
        return []
    group = dict(zip(elimination.columns, elimination.groups, strict=True))
    return [
        [row, column]
        for row, column in sorted(solver.terms.entries)
        if row != column and group[row] == group[column] >= 0
    ]


def _sort(indices: Iterable[MatrixIndex], elimination: Elimination | None) -> list[MatrixIndex]:
    """Return the (row, column) of entries row by row in the order of elimination; sorted without an elimination."""
    if elimination is None:
        return sorted(indices)
    row_at = {row: position for position, row in enumerate(elimination.rows)}
    column_at = {column: position for position, column in enumerate(elimination.columns)}
    return sorted(indices, key=lambda index: (row_at[index[0]], column_at[index[1]]))


def _elimination_data(elimination: Elimination, indices: Sequence[MatrixIndex], growth: float) -> dict[str, Any]:
    """Return an elimination as data of the templates, with its factors numbered row by row: L, reciprocal pivot, U.
    `indices` are the (row, column) of the stored matrix entries in order. Small eliminations are written out under
    ``unrolled``, one mapping for each row: entries that are loaded, earlier rows that are subtracted, and slots of L, U
    and pivot. Larger ones have tables of kinds of rows."""
    start, diagonal = [0], []
    slots: list[dict[int, int]] = []
    for position in range(elimination.size):
        across = [*elimination.lower[position], position, *elimination.upper[position]]
        diagonal.append(start[-1] + len(elimination.lower[position]))
        slots.append({column: start[-1] + k for k, column in enumerate(across)})
        start.append(start[-1] + len(across))
    column_at = {column: position for position, column in enumerate(elimination.columns)}
    row_at = {row: position for position, row in enumerate(elimination.rows)}
    entry_at = {(row_at[row], column_at[column]): k for k, (row, column) in enumerate(indices)}
    data: dict[str, Any] = {
        "size": elimination.size,
        "rows": list(elimination.rows),
        "columns": list(elimination.columns),
        "diagonal": diagonal,
        "factors": start[-1],
        "operations": elimination.operations,
    }
    written_out = _is_written_out(elimination, growth)
    if not (written_out and elimination.groups):  # rows that are written out without groups have loops, too
        data |= {"start": start} | _kinds_of_rows(elimination, entry_at)
    if elimination.groups:
        data["groups"] = list(elimination.groups)
    if written_out:
        return data | _write_out(elimination, start[-1], slots, entry_at)
    if elimination.groups:
        data |= {"factors": start[-1] + elimination.size, "sums": elimination.size}
    return data


def _kinds_of_rows(elimination: Elimination, entries: Iterable[MatrixIndex]) -> dict[str, list[int]]:
    """Return tables of the kinds of rows: rows of one kind have factors and entries at equal distances from the
    diagonal. ``kind_of`` has the kind of each row. ``begin`` and ``entry_begin`` are the places of the first distance
    of each kind in ``distance`` and ``entry_distance``, and ``left`` the numbers of factors before the diagonal."""
    columns_of: list[list[int]] = [[] for _ in elimination.rows]
    for row, column in entries:
        columns_of[row].append(column)
    kinds: dict[tuple[tuple[int, ...], tuple[int, ...]], int] = {}
    kind_of = []
    for row, (lower, upper) in enumerate(zip(elimination.lower, elimination.upper, strict=True)):
        distances = tuple([k - row for k in (*lower, row, *upper)]), tuple([k - row for k in columns_of[row]])
        kind_of.append(kinds.setdefault(distances, len(kinds)))
    factors, entry_distances = ([kind[part] for kind in kinds] for part in (0, 1))
    return {
        "kind_of": kind_of,
        "left": [sum(distance < 0 for distance in kind) for kind in factors],
        "begin": [0, *accumulate(map(len, factors))],
        "distance": [*chain.from_iterable(factors)],
        "entry_begin": [0, *accumulate(map(len, entry_distances))],
        "entry_distance": [*chain.from_iterable(entry_distances)],
    }


def _write_out(
    elimination: Elimination, end: int, slots: Sequence[Mapping[int, int]], entry_at: Mapping[MatrixIndex, int]
) -> dict[str, Any]:
    """Return the rows of an elimination, ``unrolled``; with groups of unknowns also numbers of factors and sums.

    Keys of a row: ``loads``, pairs of a slot and the matrix entry that is loaded, -1 for fill; ``taken``, earlier rows
    that are subtracted, with the ``slot`` of the factor of L, ``pivot``, and ``updates``, pairs of the slot that
    changes and the slot that is multiplied. In a row of a group, ``sum`` stands for the diagonal.

    Parameters
    ----------
    end : number of factors without sums
    slots : of each row by column
    entry_at : numbers of matrix entries by positions of row and column
    """
    groups, upper = elimination.groups or (-1,) * elimination.size, elimination.upper
    sums, asked = _number_sums(elimination, groups, end)
    rows = []
    for position, group in enumerate(groups):
        at, own_sums = slots[position], sums[position]
        diagonal = own_sums[group] if group >= 0 else at[position]
        loads = [[slot, entry_at.get((position, column), -1)] for column, slot in at.items() if column != position]
        diagonal_position = len(elimination.lower[position]) if group < 0 else len(loads)
        loads.insert(diagonal_position, [diagonal, entry_at.get((position, position), -1)])

        def updates(earlier: int, position: int = position, group: int = group) -> list[list[int]]:
            changed = [column for column in upper[earlier] if column != position or group < 0]
            pairs = [[slots[position][column], slots[earlier][column]] for column in changed]
            return [*pairs, [sums[position][group], sums[earlier][group]]] if group in sums[earlier] else pairs

        row: dict[str, Any] = {
            "loads": loads,
            "taken": [
                {"slot": at[earlier], "pivot": slots[earlier][earlier], "updates": updates(earlier)}
                for earlier in elimination.lower[position]
            ],
            "lower": [[at[column], column] for column in elimination.lower[position]],
            "upper": [[at[column], column] for column in upper[position]],
            "diagonal": at[position],
        }
        if elimination.groups:
            others = {number: slot for number, slot in own_sums.items() if number != group}
            members = {number: [at[k] for k in upper[position] if groups[k] == number] for number in own_sums}
            row["others"] = [[slot, members[number]] for number, slot in others.items()]
        if group >= 0:
            row |= {"sum": diagonal, "within": members[group]}
        if group in asked[position]:
            row["kept"] = diagonal
        rows.append(row)
    count = sum(map(len, sums))
    return {**({"factors": end + count, "sums": count} if elimination.groups else {}), "unrolled": rows}


def _number_sums(
    elimination: Elimination, groups: Sequence[int], end: int
) -> tuple[list[dict[int, int]], list[set[int]]]:
    """Return, for each row, numbers from `end` on of its sums by group, and the groups of later rows, which need the
    sum of this row over their group."""
    asked: list[set[int]] = [set() for _ in groups]
    for group, across in zip(groups, elimination.lower, strict=True):
        for earlier in across if group >= 0 else ():
            asked[earlier].add(group)
    sums: list[dict[int, int]] = []
    for position, group in enumerate(groups):
        there = {groups[column] for column in elimination.upper[position]}
        numbers = [group] * (group >= 0) + [number for number in sorted(asked[position] & there) if number != group]
        sums.append(dict(zip(numbers, range(end, end + len(numbers)), strict=True)))
        end += len(numbers)
    return sums, asked


def _add_sources(data: dict[str, Any], links: Sequence[tuple[int, int]], *, unknowns: int) -> None:
    """Add the key ``sources`` to the written-out rows of an elimination, in place, for right sides given as forces on
    links. Each source is [column at the far end of the link, number of the right side's component from 1 with a sign, 0
    for none, earlier rows that contribute to the link]. `unknowns` is the number of components before the
    links."""
    at = {column: position for position, column in enumerate(data["columns"])}
    number = {(at[i], at[j]): unknowns + k + 1 for k, (i, j) in enumerate(links)}
    number |= {(j, i): -k for (i, j), k in number.items()}
    beside = [
        [column for _, column in row["upper"] if data["groups"][column] == data["groups"][position] >= 0]
        for position, row in enumerate(data["unrolled"])
    ]
    for position, row in enumerate(data["unrolled"]):
        earlier = [k for _, k in row["lower"] if data["groups"][k] == data["groups"][position]]
        row["sources"] = [
            [column, number.get((position, column), 0), [k for k in earlier if column in beside[k]]]
            for column in beside[position]
        ]


def _fronts_data(fronts: Fronts, elimination: Elimination, size: int, rights: int) -> dict[str, Any]:
    """Return an elimination by fronts as data of the templates: sizes, orders, kinds of fronts and a table of all
    fronts. `size` is the number of unknowns, `rights` the number of rows with right sides. Rows of the table are padded
    to equal length."""
    row_at = {row: position for position, row in enumerate(elimination.rows)}
    column_at = {column: position for position, column in enumerate(elimination.columns)}
    width = max(len(row) for row in fronts.table)
    return {
        "size": elimination.size,
        "rows": list(elimination.rows),
        "columns": list(elimination.columns),
        "operations": elimination.operations,
        "factors": len(fronts.slots),
        "diagonal": [fronts.slots[position, position] for position in range(elimination.size)],
        "row_at": [row_at[row] for row in range(rights)],
        "column_at": [column_at[column] for column in range(size)],
        "kinds": [dict(kind) for kind in fronts.kinds],
        "fronts": [
            [kind, *row, *[0] * (width - len(row))] for kind, row in zip(fronts.kind_of, fronts.table, strict=True)
        ],
    }
