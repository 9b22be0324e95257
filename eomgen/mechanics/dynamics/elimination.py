"""Elimination of matrices with a tree's sparsity: Featherstone, Rigid Body Dynamics Algorithms (2008), section 6.5."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.symbolic.scalar import Scalar


def solve_tree(M: Sequence[Sequence[Scalar]], right: Sequence[Scalar], parents: Sequence[int]) -> list[Scalar]:
    """Return M^-1 right for a mass matrix with the sparsity of a tree.

    Parameters
    ----------
    parents : (nv,) for each component the nearest one towards the root it is coupled with, -1 at the root
        Elimination runs from the tips to the root, so branches that do not meet never fill.
    """
    size = len(right)
    A = [list(row) for row in M]
    factors: list[dict[int, Scalar]] = [{} for _ in range(size)]
    inverse: list[Scalar] = list(right)
    for k in reversed(range(size)):
        inverse[k] = _reciprocal(A[k][k])
        above = _ancestors(parents, k)
        for i in above:
            factor = A[k][i] * inverse[k]
            factors[k][i] = factor
            for j in above[above.index(i) :]:
                A[i][j] = A[j][i] = A[i][j] - factor * A[k][j]
    x = list(right)
    for k in reversed(range(size)):
        for i, factor in factors[k].items():
            x[i] = x[i] - factor * x[k]
    x = [value * inverse[k] for k, value in enumerate(x)]
    for k in range(size):
        for i, factor in factors[k].items():
            x[k] = x[k] - factor * x[i]
    return x


def _reciprocal(value: Scalar) -> Scalar:
    return Scalar(value.tape, value.tape.constant(1.0)) / value


def _ancestors(parents: Sequence[int], k: int) -> list[int]:
    ancestors = []
    while (k := parents[k]) >= 0:
        ancestors.append(k)
    return ancestors
