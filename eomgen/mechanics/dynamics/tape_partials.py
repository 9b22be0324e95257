"""Partials of inverse dynamics by forward differentiation of what the tape has recorded: for trees with elastic links.

An elastic coordinate moves the points of its link by different amounts, so there is no frame that moves along with all of them,
which the recursion of ``partials`` needs.
"""

from __future__ import annotations

from eomgen.mechanics.dynamics.separated import inverse_dynamics
from eomgen.mechanics.kinematics.directions import configuration_directions
from eomgen.mechanics.kinematics.fields import BaseMotion
from eomgen.mechanics.tree.links import Tree
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ONE, InputSymbol

Square = list[list[Scalar]]


def differentiated_partials(tree: Tree, base: BaseMotion) -> tuple[Square, Square, Square]:
    """Return K, C, M as ``inertial_partials`` does: of inertia and weight in q (left-trivialised), v and a, (nv, nv), full."""
    algebra, nv = tree.algebra, tree.nv
    tau = inverse_dynamics(tree, base, [None] * len(tree.links))
    seeds = configuration_directions(tree)
    for k in range(nv):
        seeds[InputSymbol("v", k)], seeds[InputSymbol("a", k)] = {nv + k: ONE}, {2 * nv + k: ONE}
    blocks = tuple([[algebra.zero] * nv for _ in range(nv)] for _ in range(3))
    with algebra.tape.block("partials of inertia forces"):
        tangents = forward_partials(algebra.tape, [value.ref for value in tau], seeds)
    for row, tangent in enumerate(tangents):
        for direction, ref in tangent.items():
            block, column = divmod(direction, nv)
            blocks[block][row][column] = Scalar(algebra.tape, ref)
    K, C, M = blocks
    return K, C, M
