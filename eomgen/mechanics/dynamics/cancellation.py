"""Whether the elimination of a tree's inertia matrix loses digits, by its values in a few positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from eomgen.lie.product import update
from eomgen.mechanics.tree.links import Tree
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Scalar
from eomgen.system.cancellation import cancellation

#: Largest ratio of composite to articulated inertia with which M is factored. Robots have up to 1200, chains of equal
#: links 1000 at 30 links.
MOST_CANCELLATION = 3e3
#: Number of positions in which the ratio is evaluated.
_POSITIONS = 6


def loses_digits(
    tree: Tree, M: Sequence[Mapping[int, Scalar]], start: Sequence[float], parameters: Sequence[float]
) -> bool:
    """Return whether the ratio of composite to articulated inertia exceeds ``MOST_CANCELLATION`` in some position.

    Parameters
    ----------
    M : (nv,) rows of the lower triangle, by column
    start : (nq,) position from which joints are turned by up to half a turn; travels stay
    parameters : values of the tunable parameters
    """
    turns = np.random.default_rng(0).uniform(-3.0, 3.0, (_POSITIONS, tree.nv)) * np.array(tree.angular())
    q = update(tree.factors, np.tile(start, (_POSITIONS, 1)), turns)
    places = [(i, j) for i, row in enumerate(M) for j in row]
    matrices = np.zeros((_POSITIONS, tree.nv, tree.nv))
    with np.errstate(all="ignore"):  # numbers that are not finite are refused elsewhere
        values = evaluate(tree.algebra.tape, [M[i][j].ref for i, j in places], {"p": parameters, "q": q})
        for (i, j), value in zip(places, values.T, strict=True):
            matrices[:, i, j] = matrices[:, j, i] = value
        ratios = cancellation(matrices, [factor.v for factor in tree.factors])
    return bool(np.any(ratios > MOST_CANCELLATION))
