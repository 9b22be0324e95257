"""Stiffness, damping and geometric stiffness matrices of beams, (nv, nv) each.

With shortening -eta^T H(x) eta / 2, an axial force N(x) adds int N phi' phi'^T dx to the stiffness; N follows from the
forces needed by the masses and bodies further out. In beam axes

    K_geo = -A_x G0 + (omega_y^2 + omega_z^2) G1 - sum_c F_c,x H(x_c)

with A the acceleration of the frame minus gravity, omega its angular velocity, F_c the inertia force of a body at x_c
minus its applied force. It holds for any motion of the frame, to first order in the elastic coordinates (Kane, Ryan
and Banerjee 1987).
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.mechanics.dynamics.separated import carried_loads, net_wrenches
from eomgen.mechanics.forces.beams import stiffness_and_damping
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.fields import total_fields
from eomgen.mechanics.kinematics.wrenches import Wrench
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.links import Tree
from eomgen.symbolic.scalar import Scalar

Square = list[list[Scalar]]


def _square(tree: Tree) -> Square:
    return [[tree.algebra.zero] * tree.nv for _ in range(tree.nv)]


def structural(tree: Tree, quantities: Quantities) -> tuple[Square, Square]:
    """Return K and D of all beams, (nv, nv) each; zero outside of elastic coordinates."""
    K, D = _square(tree), _square(tree)
    for link in tree.links:
        if link.elastic is not None:
            with tree.algebra.tape.block(f"stiffness and damping of {link.name}"):
                for total, own in zip((K, D), stiffness_and_damping(link.elastic, quantities), strict=True):
                    _add(total, link.dofs, own)
    return K, D


def geometric(tree: Tree, base: BaseMotion, loads: Sequence[Wrench | None]) -> Square:
    """Return K_geo for the present motion, (nv, nv).

    Parameters
    ----------
    loads : applied wrenches by link, in link axes
    """
    total = _square(tree)
    fields = total_fields(tree, base, accelerations=True, gravity=True)
    transmitted = carried_loads(tree, net_wrenches(tree, fields, loads), "transmitted wrench")
    for link, field, (_, force) in zip(tree.links, fields, transmitted, strict=True):
        with tree.algebra.tape.block(f"geometric stiffness of {link.name}"):
            if link.elastic is not None:
                _add(total, link.dofs, link.elastic.geometric_stiffness(field.origin[0], field.gradient[0][0]))
            elif link.station is not None:
                axial = link.rotation.rotate(force)[0]
                _add(total, link.dofs, [[-(axial * entry) for entry in row] for row in link.station.shortening])
    return total


def _add(total: Square, dofs: Sequence[int], own: Sequence[Sequence[Scalar]]) -> None:
    for row, values in zip(dofs, own, strict=True):
        for column, value in zip(dofs, values, strict=True):
            total[row][column] = total[row][column] + value
