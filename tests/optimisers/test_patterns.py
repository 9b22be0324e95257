"""Patterns of derivatives against dense matrices of NumPy and SciPy; derivatives in components of quaternions by their
products against the chain rule."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy import sparse

from eomgen.base.arrays import Array
from eomgen.lie import numeric, product
from eomgen.lie.groups import group_named
from eomgen.lie.product import Factor
from eomgen.products.optimisers.functions import (
    Exported,
    Pattern,
    column_order,
    dense,
    dense_pattern,
    empty,
    exported_group_function,
    in_components,
    lower_pattern,
    symmetric,
)
from eomgen.products.optimisers.group_functions import group_function


def whole(pattern: Pattern, numbers: Array) -> Array:
    """Return the dense matrix of a pattern with these numbers."""
    result = np.zeros(pattern.shape)
    np.add.at(result, (pattern.rows, pattern.columns), numbers[pattern.places])
    return result


def drawn(rng: np.random.Generator, height: int, width: int, share: float = 0.5) -> tuple[Pattern, Array, Array]:
    """Return a random pattern with its numbers, and the dense matrix."""
    matrix = np.where(rng.random((height, width)) < share, rng.normal(size=(height, width)), 0.0)
    rows, columns = np.nonzero(matrix)
    order = rng.permutation(len(rows))
    numbers = np.empty(len(rows))
    numbers[order] = matrix[rows, columns]
    return column_order((height, width), rows, columns, order), numbers, matrix


def test_patterns_are_matrices_in_compressed_columns(rng: np.random.Generator) -> None:
    pattern, numbers, matrix = drawn(rng, 4, 5)
    compressed = sparse.csc_array(matrix)
    assert pattern.casadi_sparsity == (4, 5, *compressed.indptr, *compressed.indices)
    np.testing.assert_array_equal(numbers[pattern.places], compressed.data)
    np.testing.assert_array_equal(whole(pattern.transpose, numbers), matrix.T)
    np.testing.assert_array_equal(pattern.transpose.rows, sparse.csc_array(matrix.T).indices)
    np.testing.assert_array_equal(whole(pattern.block(slice(1, 3), slice(2, 5)), numbers), matrix[1:3, 2:5])
    assert dense(2, 3).casadi_sparsity == (2, 3, 1) and empty(3, 0).casadi_sparsity == (3, 0, 0)
    np.testing.assert_array_equal(whole(dense(2, 3), np.arange(6.0)), np.arange(6.0).reshape(3, 2).T)
    assert empty(2, 3).casadi_sparsity == (2, 3, 0, 0, 0, 0)
    by_rows = dense_pattern(matrix != 0.0, 7)  # of a memory with seven numbers in a row
    memory = np.zeros((4, 7))
    memory[:, :5] = matrix
    np.testing.assert_array_equal(whole(by_rows, memory.ravel()), matrix)


def test_lower_triangles_hold_symmetric_matrices(rng: np.random.Generator) -> None:
    matrix = np.where(rng.random((5, 5)) < 0.6, rng.normal(size=(5, 5)), 0.0)
    matrix = matrix + matrix.T
    low, left = np.nonzero(np.tril(matrix))
    pattern = symmetric(5, low, left)
    np.testing.assert_array_equal(whole(pattern, matrix[low, left]), matrix)
    np.testing.assert_array_equal(pattern.casadi_sparsity, (5, 5, *sparse.csc_array(matrix).indptr,
                                                            *sparse.csc_array(matrix).indices))  # fmt: skip
    np.testing.assert_array_equal(whole(lower_pattern(matrix != 0.0), np.tril(matrix).ravel()), matrix)
    function = Exported("f", {"x": 5}, ("y", 1), empty(1, 5), pattern, 0, len(low))
    np.testing.assert_array_equal(whole(function.lower, matrix[low, left]), np.tril(matrix))
    assert function.work_of_hessian == len(low) and function.slices == {"x": slice(0, 5)}


#: A number, a rotation and a pose, in the order of a configuration.
FACTORS = [Factor("R", "a", 0, 1, 0, 1), Factor("SO3", "b", 1, 4, 1, 3), Factor("SE3", "c", 5, 7, 4, 6)]


def step_from(q: Array, change: Array) -> Array:
    """Return the increment (nv,) from q to q + change, whose quaternions are made unit ones."""
    there, here = q + change, q.copy()
    for first in (1, 5):
        for place in (there, here):
            place[first : first + 4] = place[first : first + 4] / np.linalg.norm(place[first : first + 4])
    return product.difference(FACTORS, here, there)


def test_derivatives_in_components_are_the_chain_rule(rng: np.random.Generator) -> None:
    """J T, and T^T H T + sum of (J^T weights)_i S_i, by differences of the increment from q to q + dq."""
    nq, nv, rest = 12, 10, 2
    jacobian, J, dense_J = drawn(rng, 3, nv + rest, 0.7)
    H = np.where(rng.random((nv + rest, nv + rest)) < 0.5, rng.normal(size=(nv + rest, nv + rest)), 0.0)
    H = H + H.T
    low, left = np.nonzero(np.tril(H))
    tangent = Exported(
        "f", {"q": nv, "v": rest}, ("y", 3), jacobian, symmetric(nv + rest, low, left), len(J), len(J) + len(low)
    )
    program = SimpleNamespace(
        factors=[{**vars(factor)} for factor in FACTORS], sizes={"v": nv}, input_size={"q": nq}.__getitem__
    )
    made = in_components(cast(Any, program), tangent)
    assert made.sizes == {"q": nq, "v": rest} and made.components is not None
    q = np.concatenate([[0.3], *(1.3 * numeric.exp(group_named("SO3"), rng.normal(size=3)) for _ in "b"),
                        numeric.exp(group_named("SE3"), rng.normal(size=6))])  # fmt: skip
    q[5:9] *= 0.8
    h, unit = 1e-4, np.eye(nq)
    T = np.zeros((nv + rest, nq + rest))
    T[nv:, nq:] = np.eye(rest)
    T[:nv, :nq] = np.stack([(step_from(q, h * e) - step_from(q, -h * e)) / (2.0 * h) for e in unit], axis=-1)
    S = np.zeros((nv + rest, nq + rest, nq + rest))
    for i, e in enumerate(unit):
        for j, f in enumerate(unit):
            signs = ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
            mixed = sum(sign * step_from(q, h * (a * e + b * f)) for a, b, sign in signs)
            S[:nv, i, j] = mixed / (4.0 * h * h)
    numbers = of_products(made.components, {"J": J, "H": H[low, left]}, q, weights := rng.normal(size=3))
    np.testing.assert_allclose(whole(made.jacobian, numbers["J"]), dense_J @ T, atol=1e-7)
    expected = T.T @ H @ T + np.einsum("i,ijk->jk", dense_J.T @ weights, S)
    np.testing.assert_allclose(whole(made.hessian, numbers["H"]), expected, atol=2e-6)
    counts = made.components["counts"]
    assert (made.first, made.work, made.work_of_hessian) == (counts["J"], sum(counts.values()), counts["H"])
    assert [counts[name] for name in ("of_J", "of_H", "T", "S")] == [len(J), len(low), 1 + 12 + 21, 30 + 66]
    ends = np.cumsum(list(counts.values()))
    assert list(made.components["places"].values()) == [0, *ends[:-1]]


def of_products(components: Any, given: dict[str, Array], q: Array, weights: Array) -> dict[str, Array]:
    """Return the numbers of both derivatives by the tables, as the C adds products up."""
    counts, tables = components["counts"], components["tables"]
    T, S = np.zeros(counts["T"]), np.zeros(counts["S"])
    T[0] = 1.0
    for factor in components["factors"]:
        p, first, second = q[factor["q"] : factor["q"] + 4], factor["first"], factor["second"]
        w, x, y, z = p
        n = p @ p
        turn = 2.0 / n * np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])
        T[first : first + 12] = turn.ravel()
        pairs = [(a, b) for a in range(4) for b in range(a + 1)]
        S[second : second + 30] = [-(row[a] * p[b] + row[b] * p[a]) / n for row in turn for a, b in pairs]
        if factor["pose"]:
            back = numeric.rotation_matrix(p / np.sqrt(n)).T
            T[first + 12 : first + 21] = back.ravel()
            bends = [-0.5 * np.cross(turn[:, a], back[:, j]) for a in range(4) for j in range(3)]
            S[second + 30 : second + 66] = np.array(bends).T.ravel()

    def added(name: str, size: int, a: Array, b: Array, result: Array | None = None) -> Array:
        total = np.zeros(size) if result is None else result
        for target, left, right in tables[name]:
            total[target] += a[left] * b[right]
        return total

    first = added("first", counts["J"], given["J"], T)
    middle = added("middle", counts["middle"], given["H"], T)
    gradient = added("gradient", counts["gradient"], given["J"], weights)
    second = added("bent", counts["H"], gradient, S, added("second", counts["H"], middle, T))
    return {"J": first, "H": second}


@pytest.mark.parametrize("group", ["SO3", "SE3"])
@pytest.mark.parametrize("name", ["update", "configuration_rate", "increment_rate", "cotangent"])
def test_functions_of_groups_have_their_nonzeros(name: str, group: str) -> None:
    """Sizes of arguments and results, patterns within them, and symmetric Hessians."""
    function = group_function(name, group)
    q, v = (4, 3) if group == "SO3" else (7, 6)
    sizes = {"update": ({"q": q, "theta": v}, q), "configuration_rate": ({"q": q, "v": v}, q),
             "increment_rate": ({"theta": v, "v": v}, v), "cotangent": ({"theta": v, "x": v}, v)}[name]  # fmt: skip
    assert (function.sizes, function.size) == sizes
    made = exported_group_function(function)
    assert made.jacobian.shape == (sizes[1], sum(sizes[0].values())) and made.first == len(function.jacobian)
    assert made.work - made.first == len(function.hessian) and all(row >= column for row, column in function.hessian)
    both = set(zip(made.hessian.rows.tolist(), made.hessian.columns.tolist(), strict=True))
    assert both == {(b, a) for a, b in both} and {entry for entry in both if entry[0] >= entry[1]} == {
        *function.hessian
    }
