"""Orders of methods by their coefficients alone: of tableaus by rooted trees in exact fractions, of compositions of two
flows by words.

Butcher, Numerical Methods for Ordinary Differential Equations (2016), sections 301 and 315.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Coefficients = tuple[Fraction, ...]
#: A rooted tree as the sorted tuple of the subtrees at its root; a leaf is ``()``.
Tree = tuple["Tree", ...]


def weight_conditions(
    A: Sequence[Coefficients], c: Coefficients, b: Coefficients, order: int
) -> list[tuple[Fraction, Fraction]]:
    """Return sum_i b_i Phi_i and 1/density for each tree of so many vertices: equal for weights of this order."""
    phi = stage_weights_of(A, c, order)
    return [(_dot(b, phi[tree]), Fraction(1, density(tree))) for tree in rooted_trees(order)]


def order_of_tableau(A: Sequence[Coefficients], b: Coefficients, c: Coefficients, most: int = 7) -> int:
    """Return the order of an explicit tableau, 0 if its sums of rows are not the nodes."""
    if any(sum(row) != node or any(row[k:]) for k, (row, node) in enumerate(zip(A, c, strict=True))):
        return 0
    broken = (k for k in range(1, most + 1) if any(x != y for x, y in weight_conditions(A, c, b, k)))
    return next(broken, most + 1) - 1


def stage_weights_of(A: Sequence[Coefficients], c: Coefficients, order: int) -> dict[Tree, Coefficients]:
    """Return the stage weights (Phi_i for each stage i) of every rooted tree up to an order, by tree. Phi_i is the
    product, over the branches at the root, of sum_j A_ij Phi_j of the branch; c_i for a leaf as a branch."""
    weights: dict[Tree, Coefficients] = {(): (Fraction(1),) * len(c)}
    moved: dict[Tree, Coefficients] = {(): c}
    for tree in (tree for vertices in range(2, order + 1) for tree in rooted_trees(vertices)):
        for branch in tree:
            if branch not in moved:
                moved[branch] = tuple(_dot(row, weights[branch]) for row in A)
        weights[tree] = tuple(math.prod(parts) for parts in zip(*(moved[branch] for branch in tree), strict=True))
    return weights


def _dot(x: Sequence[Fraction], y: Sequence[Fraction]) -> Fraction:
    return sum((left * right for left, right in zip(x, y, strict=True) if left and right), Fraction(0))


@cache
def rooted_trees(vertices: int) -> tuple[Tree, ...]:
    """Return all rooted trees with a number of vertices, bushy ones first."""
    if vertices == 1:
        return ((),)
    return tuple(sorted({grown for tree in rooted_trees(vertices - 1) for grown in _with_another_leaf(tree)}))


def _with_another_leaf(tree: Tree) -> Iterator[Tree]:
    yield tuple(sorted((*tree, ())))
    for index, branch in enumerate(tree):
        for grown in _with_another_leaf(branch):
            yield tuple(sorted((*tree[:index], grown, *tree[index + 1 :])))


def density(tree: Tree) -> int:
    """Return the density of a rooted tree: the product over all vertices of the size of the subtree at the vertex."""
    return _size(tree) * math.prod(map(density, tree))


def _size(tree: Tree) -> int:
    return 1 + sum(map(_size, tree))


def word_defects(alternating: Sequence[float], letters: int) -> list[Array]:
    """Return the differences between the series of a step in words of A and B and the series of exp(h (A + B)).

    Element n of the list has the 2^n words of n letters, numbered as binary numbers with B as 1, up to ``letters``
    letters.

    Parameters
    ----------
    alternating : fractions of a step, of A, B, A, ... in turn
    """
    words = [np.ones(1), *(np.zeros(2**length) for length in range(1, letters + 1))]
    for index, fraction in enumerate(alternating):
        second = index % 2
        after = [array.copy() for array in words]
        for length in range(1, letters + 1):
            for appended in range(1, length + 1):
                heads = np.arange(2 ** (length - appended)) << appended
                tails = heads | (2**appended - 1 if second else 0)
                after[length][tails] += fraction**appended / math.factorial(appended) * words[length - appended]
        words = after
    return [array - 1 / math.factorial(length) for length, array in enumerate(words)]


def order_of(alternating: Sequence[float], most: int = 12) -> int:
    """Return the order of a step of any two flows by its coefficients; 0 if the fractions do not sum up to 1.

    Parameters
    ----------
    alternating : fractions of a step, of A, B, A, ... in turn
    most : orders beyond this are not looked for
    """
    total = max(1.0, math.fsum(abs(fraction) for fraction in alternating))
    defects = word_defects(alternating, most)
    for length in range(1, most + 1):
        allowed = 1e-13 * total**length / math.factorial(length)
        if np.abs(defects[length]).max() > max(allowed, 1e-13):
            return length - 1
    return most
