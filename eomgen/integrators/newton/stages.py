"""Stages of elimination: body by body, each with the multipliers of the constraints that act on it; stages with
equal structure share one function.

A body here is a factor of the configuration (a rotation and the following position are one), with factors that share
its inertia; if these are many with a sparse inertia matrix, such as finite elements, each is a body of its own.
Of the bodies whose constraint equations they can all take up, the one with the fewest neighbours comes first,
so that chains and trees are eliminated from their tips to their roots and the work grows with the number of bodies
only: minimum degree (Tinney and Walker 1967) on bodies instead of unknowns.

A front holds the rows of U and the columns of L of its pivots in one run of the factors. Updates of later entries
are subtracted there, in the runs of the fronts above it: Duff and Reid, ACM TOMS 9 (1983) 302. For a
tree this is the elimination of one body after the other from the tips to the root.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from heapq import heapify, heappop, heappush
from typing import Any

from eomgen.base.data import dataclass
from eomgen.integrators.newton.elimination import Elimination
from eomgen.integrators.newton.matrix import MatrixIndex, Packing, Unknowns
from eomgen.lie.product import Factor

Stage = tuple[list[int], list[int]]
#: Free bodies from which on elimination takes them in the order of the scene, unless that costs many more operations:
#: of rows of equal bodies every front is then like the one a row earlier.
_ROWS = 800


def stages_of_tree(
    unknowns: Unknowns, factors: Sequence[Factor], owners: Sequence[int], packing: Packing
) -> list[Stage]:
    """Return the stages of elimination of a long tree, as pairs of equal row and column indices.

    Link after link, tips first, each with the inner unknowns of its recursion; before and after them internal states.

    Parameters
    ----------
    factors : of the configuration, roots first
    owners : for each inner unknown, a velocity component of the link; links of a joint of several coordinates share a
        factor
    packing : of the partials
    """
    link_of = [0] * unknowns.v
    for factor in factors:
        link_of[factor.v] = [factor.v_start] * factor.v_size
    inner: dict[int, list[int]] = {}
    for number, owner in enumerate(owners):
        inner.setdefault(link_of[owner], []).append(unknowns.size + number)
    early, late, _ = _internal_states(unknowns, packing, [*link_of, *(link_of[owner] for owner in owners)], 1)
    result: list[Stage] = []
    for factor in reversed(factors):
        block = [*range(factor.v_start, factor.v_start + factor.v_size), *inner.get(factor.v_start, ())]
        result.append((block, block))
    return [(block, block) for block in (early,) if block] + result + [(block, block) for block in (late,) if block]


def stages(unknowns: Unknowns, factors: Sequence[Factor], packing: Packing, growth: float = 1.0) -> list[Stage]:
    """Return the stages of elimination as pairs of row and column indices of the iteration matrix.

    A stage has one body, with the constraints that fit; bodies with the fewest neighbours come first.
    Internal states that touch few bodies come before, others after all bodies. ``growth``: ratio of the lengths of the
    scene that is meant and the scene that is derived.
    """
    body_of = joined_components(unknowns.v, _sharing(unknowns, factors, packing))
    bodies = _members(body_of)
    rows_of, touched = defaultdict[int, set[int]](set), defaultdict[int, set[int]](set)
    for constraint, column in packing.nonzeros["B"]:
        rows_of[body_of[column]].add(constraint)
        touched[constraint].add(body_of[column])
    early, late, pairs = _internal_states(unknowns, packing, body_of, 2)
    groups = [*touched.values(), *pairs]
    groups += [{body_of[row], body_of[column]} for name in ("K", "C", "M") for row, column in packing.nonzeros[name]]
    neighbours: dict[int, set[int]] = {body: set() for body in bodies}
    for group in groups:
        for body in group:
            neighbours[body] |= group - {body}
    result: list[Stage] = [(early, early)] if early else []
    left = set(bodies)
    many = growth * len(bodies) >= _ROWS and not unknowns.lam
    in_order = many and _fill(neighbours, by_degree=False) <= 2.5 * _fill(neighbours, by_degree=True)

    def rank(body: int) -> tuple[bool, int, int]:
        degree = 0 if in_order else len(neighbours[body])
        return len(rows_of[body]) > len(bodies[body]), degree, body

    queue = [rank(body) for body in bodies]
    heapify(queue)
    while left:
        first = heappop(queue)
        body = first[-1]
        if body not in left or first != rank(body):
            continue  # already taken, or also in the queue with the present rank
        left.remove(body)
        rows, columns = list(bodies[body]), list(bodies[body])
        for constraint in sorted(rows_of[body]):
            _add_constraint(unknowns, constraint, rows, columns)
            for neighbour in touched[constraint] & left:
                rows_of[neighbour].discard(constraint)
        _join_neighbours(neighbours, body)
        for neighbour in neighbours[body].union(*(touched[constraint] & left for constraint in rows_of[body])):
            heappush(queue, rank(neighbour))
        result.append((rows, columns))
    return [*result, (late, late)] if late else result


def _fill(neighbours: Mapping[int, set[int]], *, by_degree: bool) -> int:
    """Return the sum of squared neighbour counts at the elimination of each body: a measure of the fill. Bodies go in
    the order of their numbers, or if `by_degree` with the fewest neighbours first. `neighbours` by body is not
    changed."""
    left = {body: set(others) for body, others in neighbours.items()}
    queue = [(len(others) if by_degree else 0, body) for body, others in left.items()]
    heapify(queue)
    total = 0
    while left:
        degree, body = heappop(queue)
        if body not in left or (by_degree and degree != len(left[body])):
            continue
        _join_neighbours(left, body)
        others = left.pop(body)
        total += len(others) ** 2
        for neighbour in others if by_degree else ():
            heappush(queue, (len(left[neighbour]), neighbour))
    return total


def _join_neighbours(neighbours: Mapping[int, set[int]], body: int) -> None:
    """Make the neighbours of an eliminated body neighbours of one another."""
    for neighbour in neighbours[body]:
        neighbours[neighbour] |= neighbours[body] - {neighbour}
        neighbours[neighbour].discard(body)


def _members(group_of: Iterable[int]) -> dict[int, list[int]]:
    """Return the numbers of the members of each group."""
    members: dict[int, list[int]] = {}
    for number, group in enumerate(group_of):
        members.setdefault(group, []).append(number)
    return members


def _sharing(unknowns: Unknowns, factors: Sequence[Factor], packing: Packing) -> list[MatrixIndex]:
    """Return pairs of velocity components that belong to one body: of a factor, or joined by an entry of M. Without
    constraints, entries of large sparse inertia matrices, as of finite elements, join no components."""
    of_factors = list(_body_pairs(factors))
    inertia = packing.nonzeros["M"]
    if unknowns.lam:
        return [*of_factors, *inertia]
    body_of = joined_components(unknowns.v, [*of_factors, *inertia])
    sizes, nonzeros = Counter(body_of), Counter(body_of[row] for row, _ in inertia)
    sparse = {body for body, size in sizes.items() if size >= 20 and nonzeros[body] <= 0.25 * size * size}
    return [*of_factors, *((row, column) for row, column in inertia if body_of[row] not in sparse)]


def _internal_states(
    unknowns: Unknowns, packing: Packing, body_of: Sequence[int], few: int
) -> tuple[list[int], list[int], list[set[int]]]:
    """Return the rows of internal states eliminated before all bodies, of states after, and the sets of bodies joined.

    States that depend on each other go together. The bodies coupled with a state become neighbours at the elimination
    of the state, which is cheap only for a ``few``: such states go first, and the third result has their sets of
    bodies.

    Parameters
    ----------
    body_of : for each velocity component, followed by each inner unknown
    """
    touching: dict[int, set[int]] = {state: set() for state in range(unknowns.z)}
    for name, first in (("Fq", 0), ("Fv", 0), ("Fx", unknowns.v)):
        for state, column in packing.nonzeros[name]:
            touching[state].add(body_of[first + column])
    for row, state in packing.nonzeros["Rz"]:
        touching[state].add(body_of[row])
    early: list[int] = []
    late: list[int] = []
    touched = []
    for states in _members(joined_components(unknowns.z, packing.nonzeros["Fz"])).values():
        bodies = set().union(*(touching[state] for state in states))
        rows = [unknowns.first_z + state for state in states]
        if len(bodies) <= few:
            early += rows
            touched.append(bodies)
        else:
            late += rows
    return early, late, touched


def _add_constraint(unknowns: Unknowns, constraint: int, rows: list[int], columns: list[int]) -> None:
    columns.append(unknowns.v + constraint)
    for row in (unknowns.phi_row(constraint), unknowns.velocity_row(constraint)):
        if row is not None:
            rows.append(row)
    if unknowns.eta and constraint < unknowns.holonomic:
        columns.append(unknowns.v + unknowns.lam + constraint)


def _body_pairs(factors: Sequence[Factor]) -> Iterator[MatrixIndex]:
    """Yield pairs of velocity components that suffice to join the components of each body. These are the first
    component of a factor with each other one, and the last component of a rotation with the first of the position
    stored after the rotation."""
    rotations = {(factor.q_start + 4, factor.v_start + 3) for factor in factors if factor.group == "SO3"}
    for factor in factors:
        yield from ((factor.v_start, factor.v_start + k) for k in range(1, factor.v_size))
        if factor.group == "R" and (factor.q_start, factor.v_start) in rotations:
            yield factor.v_start - 1, factor.v_start


def joined_components(size: int, pairs: Iterable[MatrixIndex]) -> list[int]:
    """Return for each of `size` components the smallest index among the components joined with it by pairs. Pairs join
    directly or through other components."""
    first = list(range(size))

    def find(k: int) -> int:
        while first[k] != k:
            first[k] = first[first[k]]
            k = first[k]
        return k

    for row, column in pairs:
        a, b = find(row), find(column)
        first[max(a, b)] = min(a, b)
    return [find(k) for k in range(size)]


#: A row or column of a front: (0, offset) of the front, (k, offset) of the k-th front that receives contributions.
Local = tuple[int, int]


@dataclass(frozen=True)
class Fronts:
    """A factorization as fronts.

    Attributes
    ----------
    kinds : computations of the distinct structures; see ``_Front.work``.
    kind_of : the number of each front's kind, in the order of elimination.
    table : for each front, the starts of its factors, entries, positions; then factors and positions of the fronts that
        receive contributions.
    read_order : the matrix' entries in the order of their first use by fronts.
    slots : place of each factor of the elimination, by (row position, column position).
    """

    kinds: tuple[Mapping[str, Any], ...]
    kind_of: tuple[int, ...]
    table: tuple[tuple[int, ...], ...]
    read_order: tuple[MatrixIndex, ...]
    slots: Mapping[MatrixIndex, int]

    @property
    def operations(self) -> int:
        """Multiply-subtracts in the code of all kinds of fronts, each kind counted once."""
        return sum(
            len(taken["updates"]) + len(taken["outside"])
            for kind in self.kinds
            for row in kind["rows"]
            for taken in row["taken"]
        )


def fewest_operations(elimination: Elimination, entries: Iterable[MatrixIndex]) -> int:
    """Return a lower bound of ``Fronts.operations``, which is found without fronts; ``entries`` as of ``make_fronts``.

    Fronts of one kind agree in the numbers of rows and columns of their pivots, and in the matrix' entries among these;
    each such shape is counted once.
    """
    starts = [start for start in elimination.stages if start < elimination.size]
    below = _rows_below(elimination)
    there = _at_positions(elimination, entries)
    shapes: dict[Hashable, int] = {}
    for start, end in zip(starts, [*starts[1:], elimination.size], strict=True):
        lines = [(pivot, elimination.upper[pivot], below[pivot]) for pivot in range(start, end)]
        shape = tuple(
            [
                (tuple([(pivot, k) in there for k in across]), tuple([(k, pivot) in there for k in rows]))
                for pivot, across, rows in lines
            ]
        )
        shapes[shape] = sum(len(across) * len(rows) for _, across, rows in lines)
    return sum(shapes.values())


def _at_positions(elimination: Elimination, entries: Iterable[MatrixIndex]) -> dict[MatrixIndex, MatrixIndex]:
    """Return entries of the matrix by their positions in the elimination."""
    row_at = {row: position for position, row in enumerate(elimination.rows)}
    column_at = {column: position for position, column in enumerate(elimination.columns)}
    return {(row_at[row], column_at[column]): (row, column) for row, column in entries}


def _rows_below(elimination: Elimination) -> list[list[int]]:
    """Return the rows below each diagonal from which a multiple of the row is subtracted."""
    below: list[list[int]] = [[] for _ in range(elimination.size)]
    for row, across in enumerate(elimination.lower):
        for column in across:
            below[column].append(row)
    return below


def _with_right_side(elimination: Elimination, below: Sequence[Sequence[int]], sided: int | None) -> list[bool]:
    """Return for each position of an elimination whether its right side can differ from zero. `below` has the later
    rows that a row is subtracted from; only the first `sided` rows of the matrix have right sides, None: all."""
    live = [sided is None or row < sided for row in elimination.rows]
    for position, rows in enumerate(below):
        if live[position]:
            for row in rows:
                live[row] = True
    return live


def _kinds_of_work(works: Sequence[Mapping[str, Any]]) -> tuple[list[Mapping[str, Any]], list[int]]:
    """Return the distinct descriptions of work, in the order of first use, and for each front the index of its
    description."""
    keys = [repr(work) for work in works]
    distinct = dict(zip(keys, works, strict=True))
    number = {key: k for k, key in enumerate(distinct)}
    return list(distinct.values()), [number[key] for key in keys]


def make_fronts(elimination: Elimination, entries: Sequence[MatrixIndex], sided: int | None = None) -> Fronts:
    """Return an elimination as fronts: one front for the pivots of each stage, with equal fronts described once.

    Parameters
    ----------
    entries : (row, column) of the matrix, in any order
    sided : number of the first rows that can have right sides, all by default; right sides of other rows are zero
    """
    starts = [start for start in elimination.stages if start < elimination.size]
    ends = [*starts[1:], elimination.size]
    front_of = [number for number, (start, end) in enumerate(zip(starts, ends, strict=True)) for _ in range(start, end)]
    below = _rows_below(elimination)
    at_positions = _at_positions(elimination, entries)
    live = _with_right_side(elimination, below, sided)
    fronts = [
        _Front(start, range(start, end), elimination, below, at_positions, starts, front_of, live)
        for start, end in zip(starts, ends, strict=True)
    ]
    for front in fronts:
        for target in front.targets:
            fronts[front_of[min(target)]].received.add(target)
    descriptions, kind_of = _kinds_of_work([front.work(fronts, front_of) for front in fronts])
    first_factor, first_entry = [0], [0]
    for front in fronts:
        first_factor.append(first_factor[-1] + len(front.own))
        first_entry.append(first_entry[-1] + len(front.read))
    table: list[tuple[int, ...]] = []
    for number, front in enumerate(fronts):
        begins = [first_factor[number], first_entry[number], front.start]
        for reached in front.reached:
            begins += [first_factor[reached], starts[reached]]
        table.append(tuple(begins))
    slots = {
        index: first_factor[number] + k for number, front in enumerate(fronts) for index, k in front.number.items()
    }
    read_order = [at_positions[index] for front in fronts for index in front.read]
    return Fronts(tuple(descriptions), tuple(kind_of), tuple(table), tuple(read_order), slots)


class _Front:
    """The pivots of one stage, with their rows of U and columns of L, and the later entries that they change."""

    def __init__(
        self,
        start: int,
        pivots: range,
        elimination: Elimination,
        below: Sequence[Sequence[int]],
        entries: Mapping[MatrixIndex, MatrixIndex],
        starts: Sequence[int],
        front_of: Sequence[int],
        live: Sequence[bool],
    ) -> None:
        """Collect pivots, factors, entries and targets of later fronts for one stage.

        Parameters
        ----------
        start, pivots : position of the first pivot, and positions of all
        below : for each position, the later rows that its row is subtracted from
        entries : matrix entries by position
        starts, front_of : first position of each front, and front of each position
        live : for each position, whether the right side can differ from zero
        """
        self.start, self.pivots = start, pivots
        self.live = {pivot: live[pivot] for pivot in pivots}
        self.upper = {pivot: elimination.upper[pivot] for pivot in pivots}
        self.below = {pivot: below[pivot] for pivot in pivots}
        border = sorted({k for pivot in pivots for k in (*self.upper[pivot], *self.below[pivot]) if k not in pivots})
        self.reached = sorted({front_of[k] for k in border})
        order = {number: k for k, number in enumerate(self.reached, 1)}
        self.local: dict[int, Local] = {k: (0, k - start) for k in pivots}
        self.local |= {k: (order[front_of[k]], k - starts[front_of[k]]) for k in border}
        self.own: list[MatrixIndex] = []
        for pivot in pivots:
            self.own += [
                (pivot, pivot),
                *((pivot, k) for k in self.upper[pivot]),
                *((k, pivot) for k in self.below[pivot]),
            ]
        self.number = {index: k for k, index in enumerate(self.own)}
        self.read = [index for index in self.own if index in entries]
        self.targets = sorted(
            {(row, k) for pivot in pivots for row in self.below[pivot] for k in self.upper[pivot]} - set(self.own)
        )
        self.received: set[MatrixIndex] = set()

    def work(self, fronts: Sequence[_Front], front_of: Sequence[int]) -> dict[str, Any]:
        """Return the work of a front, with indices local to the front.

        ``size`` factors, the number of ``pivots``; ``rows``, rows of pivots first, with the updates ``taken`` from
        each: the factor in ``slot``, by the ``pivot``, which ``updates`` (factor, multiplied by a factor of an upper
        row) and goes ``outside`` (number in ``targets``); ``loads`` [factor, entry or -1, whether other fronts
        subtracted contributions before]; rows of pivots have their ``diagonal``, ``upper`` factors and the ``columns``
        [front, offset] of both; others have ``targets`` [front reached, factor there]; for right sides ``forward``
        [[front, offset], [[factor, own position], ...]] of each row and ``backward`` [own position, diagonal or -1 if
        the right side stays zero, [[factor, [front, offset]], ...]].
        """
        below: dict[int, list[int]] = {pivot: [] for pivot in self.pivots}
        for pivot in self.pivots:
            for row in self.below[pivot]:
                below.setdefault(row, []).append(pivot)
        entry = {index: k for k, index in enumerate(self.read)}
        return {
            "size": len(self.own),
            "pivots": len(self.pivots),
            "entries": len(self.read),
            "reached": len(self.reached),
            "rows": [self._row(row, below[row], entry, fronts, front_of) for row in sorted(below)],
            "forward": self._forward(),
            "backward": [
                [
                    pivot - self.start,
                    self.number[pivot, pivot] if self.live[pivot] else -1,
                    [[self.number[pivot, k], list(self.local[k])] for k in self.upper[pivot]],
                ]
                for pivot in reversed(self.pivots)
            ],
        }

    def _row(
        self,
        row: int,
        earlier: Sequence[int],
        entry: Mapping[MatrixIndex, int],
        fronts: Sequence[_Front],
        front_of: Sequence[int],
    ) -> dict[str, Any]:
        """Return the work on the row at a position of the elimination, in the terms of ``work``. `earlier` pivots of
        this front are subtracted from the row; `entry` has the local numbers of matrix entries. A row of a later front
        gets the contributions there as ``targets``."""
        is_pivot = row in self.pivots
        upper = [(row, k) for k in (row, *self.upper[row])] if is_pivot else []
        outside = {index: k for k, index in enumerate(index for index in self.targets if index[0] == row)}
        taken = []
        for pivot in earlier:
            by = [((row, k), self.number[pivot, k]) for k in self.upper[pivot]]
            taken.append(
                {
                    "slot": self.number[row, pivot],
                    "pivot": self.number[pivot, pivot],
                    "updates": [[self.number[index], slot] for index, slot in by if index in self.number],
                    "outside": [[outside[index], slot] for index, slot in by if index not in self.number],
                }
            )
        loaded = [*((row, pivot) for pivot in earlier), *upper]
        work = {
            "loads": [[self.number[index], entry.get(index, -1), index in self.received] for index in loaded],
            "taken": taken,
        }
        if is_pivot:
            columns = [list(self.local[k]) for _, k in upper]
            slots = [self.number[index] for index in upper]
            return work | {"diagonal": slots[0], "upper": slots[1:], "columns": columns, "targets": []}
        targets = [(front_of[min(index)], index) for index in outside]
        return work | {
            "targets": [[self.reached.index(front) + 1, fronts[front].number[index]] for front, index in targets]
        }

    def _forward(self) -> list[Any]:
        """Return the forward substitution of a front: for each row its local index and pairs of factor and pivot to
        subtract. Rows of the front come first, since later rows use them. Rows whose right side stays zero are left
        out."""
        terms: dict[int, list[list[int]]] = {pivot: [] for pivot in self.pivots if self.live[pivot]}
        for pivot in self.pivots:
            for row in self.below[pivot] if self.live[pivot] else ():
                terms.setdefault(row, []).append([self.number[row, pivot], pivot - self.start])
        used = {pivot_index for products in terms.values() for _, pivot_index in products}
        return [
            [list(self.local[row]), products]
            for row, products in sorted(terms.items())
            if products or row - self.start in used
        ]
