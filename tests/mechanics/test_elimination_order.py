"""The order in which the inertia matrix of a tree is eliminated, against elimination of its whole pattern."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.tree.build import build_tree
from eomgen.mechanics.tree.links import Tree
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Tape

TYPES = ("revolute", "prismatic", "helical", "cylindrical", "universal", "planar", "spherical", "free", "fixed")


def tree_of(count: int, seed: int) -> Tree:
    """Return a tree of joints of all types, each on a body before it, or on the base."""
    source = random.Random(seed)
    builder = eomgen.SceneBuilder("tree")
    for k in range(count):
        builder.body(f"body{k}", 1.0, inertia=[0.02, 0.03, 0.025])
        kind = source.choice(TYPES)
        parent = source.choice(["base", *(f"body{j}" for j in range(max(0, k - 3), k))])
        keys: dict[str, Any] = {"position": [0.1, 0.2, 0.0]}
        if kind not in ("spherical", "free", "fixed"):
            keys["axis"] = [0, 0, 1]
        if kind == "helical":
            keys["pitch"] = 0.1
        if kind == "universal":
            keys["second_axis"] = [1, 0, 0]
        builder.joint(f"joint{k}", kind, parent, f"body{k}", **keys)
    return build_tree(Algebra(Tape()), builder.build())


def eliminated(tree: Tree) -> tuple[int, ...]:
    """Return for each row the last column before the diagonal when all rows behind it have been eliminated."""
    filled = np.zeros((tree.nv, tree.nv), dtype=bool)
    paths: list[list[int]] = []
    for link in tree.links:
        paths.append([*(paths[link.parent] if link.parent >= 0 else []), *link.dofs])
        for dof in link.dofs:
            filled[dof, paths[-1]] = filled[paths[-1], dof] = True
    parents = [-1] * tree.nv
    for dof in reversed(range(tree.nv)):
        before = np.flatnonzero(filled[dof, :dof])
        if len(before):
            parents[dof] = int(before[-1])
            filled[np.ix_(before, before)] = True
    return tuple(parents)


@pytest.mark.parametrize("seed", range(6))
def test_nearest_coupled_components_are_those_of_elimination(seed: int) -> None:
    tree = tree_of(24, seed)
    assert tree.nv > 24 and tree.dof_parents() == eliminated(tree)
