"""Stages of elimination: minimum degree on bodies, and bodies of one component where inertia is sparse."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from eomgen.errors import ModelError
from eomgen.integrators.newton.elimination import Elimination, eliminate
from eomgen.integrators.newton.matrix import Unknowns, pack
from eomgen.integrators.newton.signs import _parity, _sign_of_determinant
from eomgen.integrators.newton.solver import _pivots
from eomgen.integrators.newton.stages import _fill, stages, stages_of_tree
from eomgen.lie.product import Factor

Pairs = list[tuple[int, int]]


def sliders(count: int) -> list[Factor]:
    return [Factor("R", f"slider{k}", k, 1, k, 1) for k in range(count)]


def stages_of(count: int, stiffness: Pairs, inertia: Pairs) -> list[list[int]]:
    """Return the rows of each stage."""
    unknowns = Unknowns(count, 0, 0, False)
    return [rows for rows, _ in stages(unknowns, sliders(count), pack({"K": stiffness, "M": inertia}))]


def banded(count: int, width: int) -> Pairs:
    return [(row, column) for row in range(count) for column in range(count) if abs(row - column) <= width]


def by_minimum_degree(count: int, pairs: Pairs) -> list[int]:
    """Return the order of elimination, found by looking at all that is left before each one."""
    joined = np.zeros((count, count), bool)
    for row, column in pairs:
        joined[row, column] = joined[column, row] = row != column
    left, order = set(range(count)), []
    while left:
        one = min(left, key=lambda k: (sum(joined[k, other] for other in left), k))
        left.remove(one)
        order.append(one)
        for first in left:
            for second in left - {first}:
                joined[first, second] |= joined[one, first] and joined[one, second]
    return order


def test_bodies_of_one_component_come_in_order_of_minimum_degree(rng: np.random.Generator) -> None:
    for count in (5, 12, 30):
        pairs = [(int(row), int(column)) for row, column in rng.integers(count, size=(2 * count, 2))]
        diagonal = [(k, k) for k in range(count)]
        found = stages_of(count, pairs, diagonal)
        assert found == [[k] for k in by_minimum_degree(count, pairs)]


@pytest.mark.slow_except("20")
@pytest.mark.parametrize("count", [20, 200])
def test_components_of_sparse_inertia_are_bodies_of_their_own(count: int) -> None:
    assert stages_of(count, banded(count, 1), banded(count, 1)) == [
        [k] for k in by_minimum_degree(count, banded(count, 1))
    ]
    assert len(stages_of(count, [], banded(count, 2))) == count  # coupled by inertia alone


def test_components_of_dense_inertia_are_one_body() -> None:
    assert stages_of(40, banded(40, 1), banded(40, 39)) == [list(range(40))]
    assert stages_of(5, banded(5, 1), banded(5, 1)) == [list(range(5))]  # few


def fill_of(count: int, pairs: Pairs, order: list[int]) -> int:
    """Return the sum of squared numbers of neighbours at each elimination, by a dense pattern."""
    joined = np.zeros((count, count), bool)
    for row, column in pairs:
        joined[row, column] = joined[column, row] = row != column
    total, left = 0, set(range(count))
    for one in order:
        left.remove(one)
        beside = [k for k in left if joined[one, k]]
        total += len(beside) ** 2
        joined[np.ix_(beside, beside)] = True
        np.fill_diagonal(joined, val=False)
    return total


def test_fill_is_that_of_a_dense_pattern(rng: np.random.Generator) -> None:
    for count in (4, 12, 25):
        pairs = [(int(row), int(column)) for row, column in rng.integers(count, size=(2 * count, 2))]
        neighbours: dict[int, set[int]] = {k: set() for k in range(count)}
        for row, column in pairs:
            if row != column:
                neighbours[row].add(column)
                neighbours[column].add(row)
        before = {body: set(others) for body, others in neighbours.items()}
        assert _fill(neighbours, by_degree=False) == fill_of(count, pairs, [*range(count)])
        assert _fill(neighbours, by_degree=True) == fill_of(count, pairs, by_minimum_degree(count, pairs))
        assert neighbours == before


def test_links_of_a_tree_go_from_its_tips_with_their_inner_unknowns_and_states() -> None:
    """Links of 1, 2 and 1 velocities; states 0 and 1 touch one link each and go first, 2 touches two links."""
    factors = [Factor("R", "a", 0, 1, 0, 1), Factor("R", "b", 1, 2, 1, 2), Factor("R", "c", 3, 1, 3, 1)]
    unknowns = Unknowns(4, 0, 0, False, inner=3, z=3)
    packing = pack({"Fq": [(0, 2)], "Fx": [(1, 1), (2, 0)], "Fv": [(2, 1)], "Fz": [(0, 0)], "Rz": [(1, 0)]})
    found = stages_of_tree(unknowns, factors, [3, 2, 0], packing)
    expected = [[4, 5], [3, 7], [1, 2, 8], [0, 9], [6]]
    assert [rows for rows, _ in found] == expected and all(rows == columns for rows, columns in found)
    alone = stages_of_tree(Unknowns(4, 0, 0, False, inner=3), factors, [3, 2, 0], pack({}))
    assert [rows for rows, _ in alone] == [[3, 4], [1, 2, 5], [0, 6]]


def test_signs_of_determinants_are_those_of_dense_matrices(rng: np.random.Generator) -> None:
    for size in (1, 4, 7, 8):
        A = rng.normal(size=(size, size))
        places = np.indices(A.shape).reshape(2, -1)
        assert _sign_of_determinant(A.ravel(), places) == np.sign(np.linalg.det(A))
        order = tuple(int(k) for k in rng.permutation(size))
        assert _parity(order) == round(np.linalg.det(np.eye(size)[list(order)]))
    assert _sign_of_determinant(np.ones(4), np.indices((2, 2)).reshape(2, -1)) == 0


def test_pivots_serve_at_all_states_but_a_singular_first_one() -> None:
    """[[a, 1], [1, a]] is singular for a = 1."""

    def pivots(*diagonal: float) -> Elimination:
        a, one = np.array(diagonal), np.ones(len(diagonal))
        values = {(0, 0): a, (0, 1): one, (1, 0): one, (1, 1): a}
        return _pivots(partial(eliminate, 2), values, len(diagonal), constrained=False)

    for regular in ((2.0, 3.0, 4.0), (1.0, 3.0, 4.0)):
        found = pivots(*regular)
        assert found.size == 2 and {*found.rows} == {*found.columns} == {0, 1} and found.operations > 0
    for singular in ((1.0,), (1.0, 1.0), (2.0, 1.0, 3.0)):
        with pytest.raises(ModelError):
            pivots(*singular)
