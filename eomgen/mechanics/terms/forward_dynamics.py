"""Forward dynamics: M = L^T D L without fill along the tree and three substitutions, or articulated bodies where they cost less.

Featherstone, Rigid Body Dynamics Algorithms (2008), section 6.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from eomgen.mechanics.dynamics import separated
from eomgen.mechanics.dynamics.articulated_bodies import articulated_forward
from eomgen.mechanics.kinematics.fields import total_fields
from eomgen.symbolic.scalar import Scalar

if TYPE_CHECKING:
    from eomgen.mechanics.derivation import Derivation


def forward_dynamics(derivation: Derivation) -> list[Scalar]:
    """Return vdot by the way that takes the fewest operations; deep trees try articulated bodies only, where these can serve."""
    ways, tree, loads = [], derivation.tree, derivation.loads
    if not (tree.following or tree.elastic):
        ways.append(articulated_forward(derivation.grouped, derivation.motion, loads.wrenches, loads.efforts))
    if not ways or not derivation.deep:
        ways.append(_by_mass_matrix(derivation))
    return min(ways, key=lambda values: derivation.tape.counts([value.ref for value in values]).weight)


def _by_mass_matrix(derivation: Derivation) -> list[Scalar]:
    grouped, loads = derivation.grouped, derivation.loads
    fields = total_fields(grouped, derivation.motion, accelerations=False, gravity=True)
    net = separated.net_wrenches(grouped, fields, loads.wrenches)
    bias = separated.generalized(grouped, net, "bias force", separated.elastic_rows(grouped, fields))
    right = [effort - load for effort, load in zip(loads.efforts, bias, strict=True)]
    M = separated.mass_matrix(grouped, derivation.composites)
    with derivation.tape.block("elimination of the mass matrix from the tips to the root"):
        return solve_tree(M, right, derivation.tree.dof_parents())


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
    found = []
    while (k := parents[k]) >= 0:
        found.append(k)
    return found
