"""Elimination of matrices with a tree's sparsity (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 6.5),
and a check whether it loses digits."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from eomgen.lie.product import update
from eomgen.mechanics.tree.links import Tree
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ONE
from eomgen.system.cancellation import cancellation


def solve_tree(M: Sequence[Mapping[int, Scalar]], right: Sequence[Scalar], parents: Sequence[int]) -> list[Scalar]:
    """Return M^-1 right, (nv,), for a mass matrix with the sparsity of a tree.

    Elimination runs from the tips to the root, so branches that do not meet never fill.

    Parameters
    ----------
    M : rows of the lower triangle, by column
    right : (nv,) right-hand side
    parents : (nv,) for each component the nearest coupled component towards the root, -1 at the root
    """
    factors, inverse = ltdl(M, parents)
    x = [value * inverse[k] for k, value in enumerate(half_solved(factors, right))]
    for k in range(len(right)):
        for i, factor in factors[k].items():
            x[k] = x[k] - factor * x[i]
    return x


def ltdl(M: Sequence[Mapping[int, Scalar]], parents: Sequence[int]) -> tuple[list[dict[int, Scalar]], list[Scalar]]:
    """Return L and 1 / D of M = L^T D L: for each row of the unit lower triangle L the nonzeros left of the diagonal,
    by column, and the inverse diagonal, (nv,). ``M`` and ``parents`` are as in ``solve_tree``."""
    size = len(M)
    A = [dict(row) for row in M]
    factors: list[dict[int, Scalar]] = [{} for _ in range(size)]
    inverse = [M[k][k] for k in range(size)]
    for k in reversed(range(size)):
        inverse[k] = Scalar(A[k][k].tape, ONE) / A[k][k]
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
    """Return L^-T right, (nv,), for the rows L of ``ltdl``."""
    x = list(right)
    for k in reversed(range(len(x))):
        for i, factor in factors[k].items():
            x[i] = x[i] - factor * x[k]
    return x


def _ancestors(parents: Sequence[int], k: int) -> list[int]:
    ancestors = []
    while (k := parents[k]) >= 0:
        ancestors.append(k)
    return ancestors


def loses_digits(
    tree: Tree, M: Sequence[Mapping[int, Scalar]], start: Sequence[float], parameters: Sequence[float]
) -> bool:
    """Return whether the ratio of composite to articulated inertia exceeds 3000 in one of six
    positions.

    The positions are pseudo-random but the same in each call.

    Parameters
    ----------
    M : (nv,) rows of the lower triangle, by column
    start : (nq,) position from which joints are turned by up to 3 rad; travels stay
    parameters : values of the tunable parameters
    """
    positions = 6
    uniform = partial(random.Random(0).uniform, -3.0, 3.0)  # numpy.random takes a thirtieth of a build to import
    turns = np.reshape([uniform() for _ in range(positions * tree.nv)], (positions, tree.nv)) * tree.angular()
    q = update(tree.factors, np.tile(start, (positions, 1)), turns)
    with np.errstate(all="ignore"):  # numbers that are not finite are refused elsewhere
        for joints in _coupled_joints(M, [factor.v for factor in tree.factors]):
            first, end = joints[0].start, joints[-1].stop
            places = [(i, j) for i in range(first, end) for j in M[i]]
            values = evaluate(tree.algebra.tape, [M[i][j].ref for i, j in places], {"p": parameters, "q": q})
            matrices = np.zeros((positions, end - first, end - first))
            for (i, j), value in zip(places, values.T, strict=True):
                matrices[:, i - first, j - first] = matrices[:, j - first, i - first] = value
            slices = [slice(joint.start - first, joint.stop - first) for joint in joints]
            if np.any(cancellation(matrices, slices) > 3e3):
                return True
    return False


def _coupled_joints(M: Sequence[Mapping[int, Scalar]], joints: Sequence[slice]) -> list[list[slice]]:
    """Return lists of successive joints, as slices of v, that M couples with one another. Joints without coupling are
    left out, because their inertia is the same whether other joints are locked or free."""
    runs: list[list[slice]] = []
    for joint in joints:
        first = min((min(M[i], default=i) for i in range(joint.start, joint.stop)), default=joint.start)
        coupled = [joint]
        while runs and first < runs[-1][-1].stop:
            runs[-1].extend(coupled)
            coupled = runs.pop()
        runs.append(coupled)
    return [run for run in runs if len(run) > 1]
