"""Forward dynamics: M = L^T D L along the tree with three substitutions, or articulated bodies.

Featherstone, Rigid Body Dynamics Algorithms (2008), section 6.5 and chapter 7. The algorithm that is expected to be
faster is kept, and articulated bodies if the elimination of M loses digits.
"""

from __future__ import annotations

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.dynamics import separated
from eomgen.mechanics.dynamics.articulated_bodies import articulated_forward
from eomgen.mechanics.dynamics.elimination import solve_tree
from eomgen.mechanics.kinematics.fields import total_fields
from eomgen.symbolic.latency import expected_cycles
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import Ref
from eomgen.system.system import Block

#: More operations, which take longer to compile and more room, have to be worth it: the expected time goes down to this
#: part at least.
FASTER = 0.85


def forward_blocks(derivation: Derivation) -> list[Block]:
    """Return vdot, (nv,), as the block of the term ``forward_dynamics``."""
    values = forward_dynamics(derivation)
    return [derivation.block("vdot", (len(values),), values, "time derivative of v")]


def forward_dynamics(derivation: Derivation) -> list[Scalar]:
    """Return vdot, (nv,), by the algorithm that is expected to be the fastest and loses no digits.

    Deep trees try articulated bodies only; elastic trees and joints that follow others have M only.
    """
    loads = derivation.loads
    if not derivation.free_columns:
        return _by_mass_matrix(derivation)
    tree = derivation.tree if derivation.ill_scaled else derivation.grouped  # moved masses cost digits, too
    articulated = articulated_forward(tree, derivation.motion, loads.wrenches, loads.efforts)
    if derivation.deep or derivation.ill_scaled:
        return articulated
    ways = [articulated, _by_mass_matrix(derivation)]
    fewest, other = sorted(ways, key=lambda values: derivation.tape.counts(_refs(values)).weight)
    faster = expected_cycles(derivation.tape, _refs(other)) < FASTER * expected_cycles(derivation.tape, _refs(fewest))
    return other if faster else fewest


def _refs(values: list[Scalar]) -> list[Ref]:
    return [value.ref for value in values]


def _by_mass_matrix(derivation: Derivation) -> list[Scalar]:
    grouped, loads = derivation.grouped, derivation.loads
    fields = total_fields(grouped, derivation.motion, accelerations=False, gravity=True)
    net = separated.net_wrenches(grouped, fields, loads.wrenches)
    bias = separated.generalized(grouped, net, "bias force", separated.elastic_rows(grouped, fields))
    right = [effort - load for effort, load in zip(loads.efforts, bias, strict=True)]
    M = separated.mass_rows(grouped, derivation.composites)
    with derivation.tape.block("elimination of the mass matrix from the tips to the root"):
        return solve_tree(M, right, derivation.tree.dof_parents())
