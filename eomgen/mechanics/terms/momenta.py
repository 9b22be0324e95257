"""Generalized momenta, and their rates: both sides of Lagrange's equations in left-trivialised velocities.

With the inertial kinetic energy T(q, v, t), p = dT/dv, and ad_v the bracket with v (Hamel 1904; Bloch, Krishnaprasad,
Marsden and Ratiu, Commun. Math. Phys. 175 (1996) 1):

    dp/dt - ad_v^T p = dT/dq + Q - B^T lam
"""

from __future__ import annotations

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.kinematics.directions import configuration_directions
from eomgen.symbolic.calculus.partials import gradient
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.tape import ZERO, Ref
from eomgen.system.system import Block


def momenta(derivation: Derivation) -> list[Block]:
    """Return p = dT/dv, and dT/dq + Q, left-trivialised, (nv,) each; kg m/s and N, or kg m^2/s and N m of angles."""
    tape, nv = derivation.tape, derivation.tree.nv
    kinetic = derivation.energies()["kinetic"].ref
    seeds = configuration_directions(derivation.tree)
    velocities = [tape.input("v", k) for k in range(nv)]
    places = [tape.input(key.block, key.index) if isinstance(key, InputSymbol) else key for key in seeds]
    Q = derivation.force()[0].refs
    with tape.block("momenta"):
        p = gradient(tape, kinetic, velocities)
        along = list(Q)
        for slope, tangent in zip(gradient(tape, kinetic, places), seeds.values(), strict=True):
            for direction, ref in tangent.items() if slope != ZERO else ():
                along[direction] = tape.add(along[direction], tape.mul(slope, ref))
    return [
        _vector("momentum", nv, p, "generalized momenta p = dT/dv"),
        _vector("momentum_rate", nv, along, "dT/dq + Q, left-trivialised"),
    ]


def _vector(name: str, size: int, refs: list[Ref], description: str) -> Block:
    return Block(name, (size,), tuple(refs), description)
