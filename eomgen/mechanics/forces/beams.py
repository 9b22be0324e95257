"""Strain energy and structural damping of a beam, as loads on its elastic coordinates."""

from __future__ import annotations

from eomgen.mechanics.forces.loads import Loads
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.tree.beam_body import ElasticBody, deformations
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Scalar, dot

Rows = list[list[Scalar]]


def stiffness_and_damping(body: ElasticBody, quantities: Quantities) -> tuple[Rows, Rows]:
    """Return stiffness K and damping D of a beam's elastic coordinates, (n, n) each.

    D is stiffness damping times K, plus 2 zeta sqrt(k m) on the diagonal for each coordinate alone, which is modal
    damping if the shapes are modes of the beam alone.
    """
    algebra, integrals, n = body.algebra, body.mass.integrals, body.size
    K, D = ([[algebra.zero] * n for _ in range(n)] for _ in range(2))
    for item, here in deformations(body.beam):
        stiffness, share = quantities.formula(item.stiffness), quantities.formula(item.stiffness_damping)
        for k in here:
            for j in here:
                K[k][j] = stiffness * float(integrals.k[k, j])
                D[k][j] = share * K[k][j]
            if item.damping_ratio:
                critical = 2.0 * algebra.call(Op.SQRT, K[k][k] * body.inertia_of(k))
                D[k][k] = D[k][k] + item.damping_ratio * critical
    return K, D


def add_structure(loads: Loads, body: ElasticBody, quantities: Quantities) -> None:
    """Add -K eta - D eta' to the loads, with the strain energy and the dissipated power."""
    K, D = stiffness_and_damping(body, quantities)
    q, v = body.coordinates.q, body.coordinates.v
    for dof, coordinate, rate, stiff, damped in zip(body.coordinates.dofs, q, v, K, D, strict=True):
        elastic, viscous = dot(stiff, q), dot(damped, v)
        loads.efforts[dof] = loads.efforts[dof] - (elastic + viscous)
        loads.potential = loads.potential + 0.5 * (coordinate * elastic)
        loads.power = loads.power - rate * viscous
