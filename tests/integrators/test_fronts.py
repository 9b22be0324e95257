"""Elimination front by front solves what NumPy solves, and shares its code between fronts of one structure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from eomgen.integrators.newton.elimination import Elimination, eliminate
from eomgen.integrators.newton.stages import Fronts, fewest_operations, make_fronts

Entries = dict[tuple[int, int], np.ndarray]
SIZE = 3


def tree_matrix(
    parents: list[int], rng: np.random.Generator, coupled: tuple[int, ...] = ()
) -> tuple[Entries, list[Any]]:
    """Return blocks on the diagonal and between neighbours of a tree, and the stages from its tips to its root.

    ``coupled`` pairs of blocks are neighbours besides, which closes a loop.
    """
    count = len(parents)
    pairs = [(k, k) for k in range(count)]
    for k, parent in [*enumerate(parents), *([coupled] if coupled else [])]:  # type: ignore[misc]
        if parent >= 0:
            pairs += [(k, parent), (parent, k)]
    entries: Entries = {}
    for row, column in pairs:
        block = rng.normal(size=(SIZE, SIZE)) + (6.0 * np.eye(SIZE) if row == column else 0.0)
        for i in range(SIZE):
            for j in range(SIZE):
                if row == column or (i + j) % 2 == 0:
                    entries[SIZE * row + i, SIZE * column + j] = np.array([block[i, j]])
    stages = [(list(range(SIZE * k, SIZE * k + SIZE)),) * 2 for k in reversed(range(count))]
    return entries, stages


def solved(fronts: Fronts, elimination: Elimination, entries: Entries, right: np.ndarray) -> np.ndarray:
    """Run the fronts as the C does."""
    S = np.array([entries[place][0] for place in fronts.read_order])
    F = np.zeros(len(fronts.slots))
    y = right[list(elimination.rows)]
    for kind, at in zip(fronts.kind_of, fronts.table, strict=True):
        work: Mapping[str, Any] = fronts.kinds[kind]
        f = F[at[0] : at[0] + work["size"]]
        for row in work["rows"]:
            for k, entry, received in row["loads"]:
                assert received or f[k] == 0.0
                f[k] += S[at[1] + entry] if entry >= 0 else 0.0
            for taken in row["taken"]:
                for target, upper in taken["updates"]:
                    f[target] -= f[taken["slot"]] * f[upper]
                for target, upper in taken["outside"]:
                    front, slot = row["targets"][target]
                    F[at[1 + 2 * front] + slot] -= f[taken["slot"]] * f[upper]
                f[taken["slot"]] *= f[taken["pivot"]]
            if "diagonal" in row:
                f[row["diagonal"]] = 1.0 / f[row["diagonal"]]
                f[row["upper"]] *= f[row["diagonal"]]
        for (front, offset), terms in work["forward"]:
            for factor, own in terms:
                y[(at[2] if not front else at[2 + 2 * front]) + offset] -= f[factor] * y[at[2] + own]
    for kind, at in reversed(list(zip(fronts.kind_of, fronts.table, strict=True))):
        work, f = fronts.kinds[kind], F[at[0] :]
        for own, diagonal, across in work["backward"]:
            y[at[2] + own] *= f[diagonal] if diagonal >= 0 else 0.0
            for factor, (front, offset) in across:
                y[at[2] + own] -= f[factor] * y[(at[2] if not front else at[2 + 2 * front]) + offset]
    x = np.zeros(len(right))
    x[list(elimination.columns)] = y
    return x


CHAIN = [-1, *range(29)]
TREE = [-1, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6]


@pytest.mark.parametrize(("parents", "coupled"), [(CHAIN, ()), (TREE, ()), (CHAIN, (29, 3)), (TREE, (14, 7))])
@pytest.mark.parametrize("sided", [None, 30])
def test_fronts_solve_what_numpy_solves(
    parents: list[int], coupled: tuple[int, ...], sided: int | None, rng: np.random.Generator
) -> None:
    entries, stages = tree_matrix(parents, rng, coupled)
    size = SIZE * len(parents)
    if sided is not None:  # the tips, which come first, get the right sides; what they hand on reaches rows without any
        entries = {(size - 1 - row, size - 1 - column): value for (row, column), value in entries.items()}
        stages = [tuple([size - 1 - k for k in part] for part in stage) for stage in stages]
    elimination = eliminate(size, entries, stages)
    fronts = make_fronts(elimination, list(entries), sided)
    assert 0 < fewest_operations(elimination, list(entries)) <= fronts.operations <= elimination.operations
    A = np.zeros((size, size))
    for place, value in entries.items():
        A[place] = value[0]
    right = rng.normal(size=size) * (np.arange(size) < (sided or size))
    np.testing.assert_allclose(
        solved(fronts, elimination, entries, right), np.linalg.solve(A, right), rtol=1e-10, atol=1e-12
    )


def test_a_chain_has_a_handful_of_kinds_of_fronts_however_long(rng: np.random.Generator) -> None:
    def kinds(links: int) -> int:
        entries, stages = tree_matrix([-1, *range(links - 1)], rng)
        return len(make_fronts(eliminate(SIZE * links, entries, stages), list(entries)).kinds)

    assert kinds(20) <= 4
    assert kinds(60) == kinds(20)


#: Entries of equal size: which of them is the largest, so that it would be the pivot, is decided by noise alone.
EVEN = np.array([[1.0, 1, 1, 1], [1, -1, 1, -1], [1, 1, -1, -1], [1, -1, -1, 1]])


def test_stages_of_one_structure_take_their_pivots_in_one_order(rng: np.random.Generator) -> None:
    """The first stage of a structure decides for the others, or else each would have code of its own."""
    links, size = 30, len(EVEN)
    entries: Entries = {}
    for k in range(links):
        block = EVEN * (1.0 + 0.02 * rng.uniform(-1.0, 1.0, EVEN.shape))
        entries |= {(size * k + i, size * k + j): np.array([block[i, j]]) for i in range(size) for j in range(size)}
        if k:
            for i in range(size):
                across = {(size * k + i, size * (k - 1) + i), (size * (k - 1) + i, size * k + i)}
                entries |= {place: np.array([0.01 * rng.uniform(0.5, 1.0)]) for place in across}
    stages = [(list(range(size * k, size * k + size)),) * 2 for k in reversed(range(links))]
    elimination = eliminate(size * links, entries, stages)
    assert elimination.stages == tuple(range(0, size * links, size))
    pivots = list(zip(elimination.rows, elimination.columns, strict=True))
    orders = [
        [(row - size * k, column - size * k) for row, column in pivots[size * (links - 1 - k) : size * (links - k)]]
        for k in reversed(range(links))
    ]
    assert all(order == orders[0] for order in orders)
    assert len(make_fronts(elimination, list(entries)).kinds) <= 4
