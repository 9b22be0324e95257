"""Stages of elimination: body by body, each with the multipliers of the constraints that act on it.

A body here is a factor of the configuration (a rotation and the position behind it are one), with factors that share
its inertia; if these are many with a sparse inertia matrix, such as finite elements, each is a body of its own.
Of the bodies whose constraint equations they can all take up, the one with the fewest neighbours comes first,
so that chains and trees are eliminated from their tips to their roots and the work grows with the number of bodies
only: minimum degree (Tinney and Walker 1967) on bodies instead of unknowns.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from heapq import heapify, heappop, heappush

from eomgen.integrators.newton.matrix import MatrixIndex, Packing, Unknowns
from eomgen.lie.product import Factor

Stage = tuple[list[int], list[int]]

#: Internal states that touch no more bodies (of long trees: links) than these are eliminated first.
_TWO, _ONE = 2, 1
#: Inertia of so many components or more with so small a share of nonzeros is sparse.
_MANY, _SPARSE = 20, 0.25


def stages_of_tree(
    unknowns: Unknowns, factors: Sequence[Factor], owners: Sequence[int], packing: Packing
) -> list[Stage]:
    """Return the stages of a long tree: link after link, tips first, each with the quantities of its recursion.

    Parameters
    ----------
    owners : for each inner unknown, a velocity component of its link; links of a joint of several coordinates share a
        factor
    """
    link_of = [0] * unknowns.v
    for factor in factors:
        link_of[factor.v] = [factor.v_start] * factor.v_size
    inner: dict[int, list[int]] = {}
    for number, owner in enumerate(owners):
        inner.setdefault(link_of[owner], []).append(unknowns.size + number)
    early, late, _ = _internal_states(unknowns, packing, [*link_of, *(link_of[owner] for owner in owners)], _ONE)
    result: list[Stage] = []
    for factor in reversed(factors):
        own = [*range(factor.v_start, factor.v_start + factor.v_size), *inner.get(factor.v_start, ())]
        result.append((own, own))
    return [(own, own) for own in (early,) if own] + result + [(own, own) for own in (late,) if own]


def stages(unknowns: Unknowns, factors: Sequence[Factor], packing: Packing) -> list[Stage]:
    """Return rows and columns of the iteration matrix, stage by stage."""
    body_of = _bodies(unknowns.v, _sharing(unknowns, factors, packing))
    bodies: dict[int, list[int]] = {}
    for component, body in enumerate(body_of):
        bodies.setdefault(body, []).append(component)
    held: dict[int, set[int]] = {body: set() for body in bodies}
    touched: dict[int, set[int]] = {constraint: set() for constraint in range(unknowns.lam)}
    for constraint, column in packing.nonzeros["B"]:
        held[body_of[column]].add(constraint)
        touched[constraint].add(body_of[column])
    neighbours: dict[int, set[int]] = {body: set() for body in bodies}
    groups = [*touched.values()]
    groups += [{body_of[row], body_of[column]} for name in ("K", "C", "M") for row, column in packing.nonzeros[name]]
    for group in groups:
        for body in group:
            neighbours[body] |= group - {body}
    early, late, pairs = _internal_states(unknowns, packing, body_of, _TWO)
    for group in pairs:
        for body in group:
            neighbours[body] |= group - {body}
    result: list[Stage] = [(early, early)] if early else []
    left = set(bodies)

    def rank(body: int) -> tuple[bool, int, int]:
        return len(held[body]) > len(bodies[body]), len(neighbours[body]), body

    queue = [rank(body) for body in bodies]
    heapify(queue)
    while left:
        first = heappop(queue)
        body = first[-1]
        if body not in left or first != rank(body):
            continue  # it was taken, or stands in the queue with its present rank as well
        left.remove(body)
        rows, columns = list(bodies[body]), list(bodies[body])
        for constraint in sorted(held[body]):
            _add_constraint(unknowns, constraint, rows, columns)
            for other in touched[constraint] & left:
                held[other].discard(constraint)
        for other in neighbours[body]:
            neighbours[other] |= neighbours[body] - {other}
            neighbours[other].discard(body)
        for other in neighbours[body].union(*(touched[constraint] & left for constraint in held[body])):
            heappush(queue, rank(other))
        result.append((rows, columns))
    return [*result, (late, late)] if late else result


def _sharing(unknowns: Unknowns, factors: Sequence[Factor], packing: Packing) -> list[MatrixIndex]:
    """Return pairs of components of one body."""
    of_factors = list(_of_one_body(factors))
    inertia = packing.nonzeros["M"]
    if unknowns.lam:
        return [*of_factors, *inertia]
    body_of = _bodies(unknowns.v, [*of_factors, *inertia])
    sizes, nonzeros = Counter(body_of), Counter(body_of[row] for row, _ in inertia)
    sparse = {body for body, size in sizes.items() if size >= _MANY and nonzeros[body] <= _SPARSE * size * size}
    return [*of_factors, *((row, column) for row, column in inertia if body_of[row] not in sparse)]


def _internal_states(
    unknowns: Unknowns, packing: Packing, body_of: Sequence[int], few: int
) -> tuple[list[int], list[int], list[set[int]]]:
    """Return the internal states eliminated before all bodies, the states after them, and the unknowns that the first
    touch.

    States that depend on each other go together. The bodies touched by a state become neighbours of each other when it
    is eliminated, which is cheap only for a ``few``.

    Parameters
    ----------
    body_of : for each velocity component, and each inner unknown behind them
    """
    touching: dict[int, set[int]] = {state: set() for state in range(unknowns.z)}
    for name, first in (("Fq", 0), ("Fv", 0), ("Fx", unknowns.v)):
        for state, column in packing.nonzeros[name]:
            touching[state].add(body_of[first + column])
    for row, state in packing.nonzeros["Rz"]:
        touching[state].add(body_of[row])
    groups: dict[int, list[int]] = {}
    for state, group in enumerate(_bodies(unknowns.z, packing.nonzeros["Fz"])):
        groups.setdefault(group, []).append(state)
    early: list[int] = []
    late: list[int] = []
    touched = []
    for states in groups.values():
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


def _of_one_body(factors: Sequence[Factor]) -> Iterator[MatrixIndex]:
    """Yield pairs of components of the same factor, and of a rotation and the position stored behind it."""
    rotations = {(factor.q_start + 4, factor.v_start + 3) for factor in factors if factor.group == "SO3"}
    for factor in factors:
        yield from ((factor.v_start, factor.v_start + k) for k in range(1, factor.v_size))
        if factor.group == "R" and (factor.q_start, factor.v_start) in rotations:
            yield factor.v_start - 1, factor.v_start


def _bodies(size: int, pairs: Iterable[MatrixIndex]) -> list[int]:
    """Return for each component the smallest one that it is joined with, directly or through others."""
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
