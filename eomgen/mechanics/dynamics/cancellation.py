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
    with np.errstate(all="ignore"):  # numbers that are not finite are refused elsewhere
        for joints in _coupled(M, [factor.v for factor in tree.factors]):
            first, end = joints[0].start, joints[-1].stop
            places = [(i, j) for i in range(first, end) for j in M[i]]
            values = evaluate(tree.algebra.tape, [M[i][j].ref for i, j in places], {"p": parameters, "q": q})
            matrices = np.zeros((_POSITIONS, end - first, end - first))
            for (i, j), value in zip(places, values.T, strict=True):
                matrices[:, i - first, j - first] = matrices[:, j - first, i - first] = value
            own = [slice(joint.start - first, joint.stop - first) for joint in joints]
            if np.any(cancellation(matrices, own) > MOST_CANCELLATION):
                return True
    return False


def _coupled(M: Sequence[Mapping[int, Scalar]], joints: Sequence[slice]) -> list[list[slice]]:
    """Return runs of successive joints that M couples, without joints that are coupled to no other: such a joint has
    the same inertia whether others are locked or free."""
    runs: list[list[slice]] = []
    for joint in joints:
        first = min((min(M[i], default=i) for i in range(joint.start, joint.stop)), default=joint.start)
        coupled = [joint]
        while runs and first < runs[-1][-1].stop:
            runs[-1].extend(coupled)
            coupled = runs.pop()
        runs.append(coupled)
    return [run for run in runs if len(run) > 1]
