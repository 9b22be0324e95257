"""Elimination of matrices with a tree's sparsity: Featherstone, Rigid Body Dynamics Algorithms (2008), section 6.5."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.symbolic.scalar import Scalar


def solve_tree(M: Sequence[Mapping[int, Scalar]], right: Sequence[Scalar], parents: Sequence[int]) -> list[Scalar]:
    """Return M^-1 right for a mass matrix with the sparsity of a tree.

    Parameters
    ----------
    M : rows of the lower triangle, by column
    parents : (nv,) for each component the nearest one towards the root it is coupled with, -1 at the root
        Elimination runs from the tips to the root, so branches that do not meet never fill.
    """
    factors, inverse = factored(M, parents)
    x = [value * inverse[k] for k, value in enumerate(half_solved(factors, right))]
    for k in range(len(right)):
        for i, factor in factors[k].items():
            x[k] = x[k] - factor * x[i]
    return x


def factored(M: Sequence[Mapping[int, Scalar]], parents: Sequence[int]) -> tuple[list[dict[int, Scalar]], list[Scalar]]:
    """Return L and 1 / D of M = L^T D L: the rows of the unit lower triangle L by column, and the inverse diagonal."""
    size = len(M)
    A = [dict(row) for row in M]
    factors: list[dict[int, Scalar]] = [{} for _ in range(size)]
    inverse = [M[k][k] for k in range(size)]
    for k in reversed(range(size)):
        inverse[k] = _reciprocal(A[k][k])
        above = _ancestors(parents, k)
        for i in (i for i in above if i in A[k]):
            factor = A[k][i] * inverse[k]
            factors[k][i] = factor
            for j in above[above.index(i) :]:
                if j in A[k]:
                    change = factor * A[k][j]
                    A[i][j] = A[i][j] - change if j in A[i] else -change
    return factors, inverse


def half_solved(factors: Sequence[dict[int, Scalar]], right: Sequence[Scalar]) -> list[Scalar]:
    """Return L^-T right, for the L of ``factored``."""
    x = list(right)
    for k in reversed(range(len(x))):
        for i, factor in factors[k].items():
            x[i] = x[i] - factor * x[k]
    return x


def _reciprocal(value: Scalar) -> Scalar:
    return Scalar(value.tape, value.tape.constant(1.0)) / value


def _ancestors(parents: Sequence[int], k: int) -> list[int]:
    ancestors = []
    while (k := parents[k]) >= 0:
        ancestors.append(k)
    return ancestors
