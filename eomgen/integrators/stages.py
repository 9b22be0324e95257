"""Which unknowns are eliminated together: body after body, each with the multipliers of the constraints that hold it.

A body here is a factor of the configuration (a rotation and the position behind it are one), with what shares its inertia.
Of the bodies whose constraint equations they can all take up, the one with the fewest neighbours comes first, so that chains and
trees are eliminated from their tips to their roots and the work grows with the number of bodies only: minimum degree (Tinney
and Walker 1967) on bodies instead of unknowns.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from eomgen.integrators.iteration_matrix import Packing, Place, Unknowns
from eomgen.lie.product import FactorLike

Stage = tuple[list[int], list[int]]


def stages_of_tree(unknowns: Unknowns, factors: Sequence[FactorLike], owners: Sequence[int]) -> list[Stage]:
    """Return the stages of a long tree: link after link, tips first, each with what the recursion keeps of it.

    Parameters
    ----------
    owners : for each inner unknown, the first velocity component of its link
    """
    inner: dict[int, list[int]] = {}
    for number, owner in enumerate(owners):
        inner.setdefault(owner, []).append(unknowns.size + number)
    result: list[Stage] = []
    for factor in reversed(factors):
        own = [*range(factor.v_start, factor.v_start + factor.v_size), *inner.get(factor.v_start, ())]
        result.append((own, own))
    return result


def stages(unknowns: Unknowns, factors: Sequence[FactorLike], packing: Packing) -> list[Stage]:
    """Return rows and columns of the iteration matrix, stage by stage."""
    body_of = _bodies(unknowns.v, [*_of_one_body(factors), *packing.places["M"]])
    bodies: dict[int, list[int]] = {}
    for component, body in enumerate(body_of):
        bodies.setdefault(body, []).append(component)
    held: dict[int, set[int]] = {body: set() for body in bodies}
    touched: dict[int, set[int]] = {constraint: set() for constraint in range(unknowns.lam)}
    for constraint, column in packing.places["B"]:
        held[body_of[column]].add(constraint)
        touched[constraint].add(body_of[column])
    neighbours: dict[int, set[int]] = {body: set() for body in bodies}
    groups = [*touched.values()]
    groups += [{body_of[row], body_of[column]} for name in ("K", "C") for row, column in packing.places[name]]
    for group in groups:
        for body in group:
            neighbours[body] |= group - {body}
    result: list[Stage] = []
    left = set(bodies)
    while left:
        body = min(left, key=lambda b: (len(held[b]) > len(bodies[b]), len(neighbours[b]), b))
        left.remove(body)
        rows, columns = list(bodies[body]), list(bodies[body])
        for constraint in sorted(held[body]):
            _add_constraint(unknowns, constraint, rows, columns)
            for other in touched[constraint] & left:
                held[other].discard(constraint)
        for other in neighbours[body]:
            neighbours[other] |= neighbours[body] - {other}
            neighbours[other].discard(body)
        result.append((rows, columns))
    return result


def _add_constraint(unknowns: Unknowns, constraint: int, rows: list[int], columns: list[int]) -> None:
    columns.append(unknowns.v + constraint)
    for row in (unknowns.phi_row(constraint), unknowns.velocity_row(constraint)):
        if row is not None:
            rows.append(row)
    if unknowns.eta and constraint < unknowns.holonomic:
        columns.append(unknowns.v + unknowns.lam + constraint)


def _of_one_body(factors: Sequence[FactorLike]) -> Iterator[Place]:
    """Yield pairs of components of the same factor, and of a rotation and the position stored behind it."""
    rotations = {(factor.q_start + 4, factor.v_start + 3) for factor in factors if factor.group == "SO3"}
    for factor in factors:
        yield from ((factor.v_start, factor.v_start + k) for k in range(1, factor.v_size))
        if factor.group == "R" and (factor.q_start, factor.v_start) in rotations:
            yield factor.v_start - 1, factor.v_start


def _bodies(size: int, pairs: Iterable[Place]) -> list[int]:
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
