"""Forward dynamics: M = L^T D L along the tree with three substitutions, or articulated bodies if cheaper.

Featherstone, Rigid Body Dynamics Algorithms (2008), section 6.5.
"""

from __future__ import annotations

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.dynamics import separated
from eomgen.mechanics.dynamics.articulated_bodies import articulated_forward
from eomgen.mechanics.dynamics.elimination import solve_tree
from eomgen.mechanics.kinematics.fields import total_fields
from eomgen.symbolic.scalar import Scalar
from eomgen.system.system import Block


def forward_blocks(derivation: Derivation) -> list[Block]:
    """Return vdot, (nv,), as the block of the term ``forward_dynamics``."""
    values = forward_dynamics(derivation)
    return [derivation.block("vdot", (len(values),), values, "time derivative of v")]


def forward_dynamics(derivation: Derivation) -> list[Scalar]:
    """Return vdot, (nv,), by the algorithm with the fewest operations; deep trees try articulated bodies only."""
    ways, tree, loads = [], derivation.tree, derivation.loads
    if tree.rigid and not tree.following:
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
    M = separated.mass_rows(grouped, derivation.composites)
    with derivation.tape.block("elimination of the mass matrix from the tips to the root"):
        return solve_tree(M, right, derivation.tree.dof_parents())
