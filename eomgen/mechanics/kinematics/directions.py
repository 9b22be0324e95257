"""Seeds of differentiation along each velocity component (left-trivialised) and along the motion.

Left-trivialised. Rotation matrices of ball and free joints own their change, dR = R w~, besides the quaternions they
are made of:
functions of an orientation are functions of its matrix, and derivatives through the matrix are a third of the size.
"""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.mechanics.tree.base import BaseState
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.joint_types import GROUPS
from eomgen.symbolic.calculus.configuration import configuration_seeds, rotation
from eomgen.symbolic.calculus.loops import Tangent
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import multiply, skew
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from eomgen.system.system import BASE_LAYOUT

Seeds = dict[Ref | InputSymbol, Tangent]


def configuration_directions(tree: Tree) -> Seeds:
    """Return the tangents of q and of joint rotation matrices, as {reference: {direction: partial}}. Direction k is
    velocity component k, left-trivialised. The result seeds forward differentiation."""
    tape = tree.algebra.tape
    seeds: Seeds = dict(configuration_seeds(tape, [(f.group, f.q_start, f.q_size, f.v_start) for f in tree.factors]))
    for link in tree.links:
        if link.kind not in GROUPS:
            continue
        start = link.dofs[0]
        R = link.rotation.factors[-1].matrix
        by_axis = [multiply(R, skew(axis)) for axis in tree.algebra.identity]
        for i in range(3):
            for j in range(3):
                if tape.value(R[i][j].ref) is None:
                    changes = {start + k: by_axis[k][i][j].ref for k in range(3)}
                    seeds[R[i][j].ref] = {direction: ref for direction, ref in changes.items() if abs(ref) != ZERO}
        for k, position in enumerate(link.coordinates.q[4:]):
            seeds[position.ref] = {start + 3 + j: R[k][j].ref for j in range(3)}
    return seeds


def rates_along(tape: Tape, seeds: Mapping[Ref | InputSymbol, Tangent]) -> dict[Ref | InputSymbol, Ref]:
    """Return the time derivatives of t and of the keys of ``seeds`` along the inputs v, by reference. These serve
    directional derivatives at constant v."""
    rates: dict[Ref | InputSymbol, Ref] = {InputSymbol("t", 0): ONE}
    for key, tangent in seeds.items():
        total = ZERO
        for direction, ref in tangent.items():
            total = tape.add(total, tape.mul(ref, tape.input("v", direction)))
        rates[key] = total
        if isinstance(key, int) and key in tape.names:
            tape.name(total, f"{tape.names[key]}_dot")
    return rates


def rates_of(tape: Tape, seeds: Mapping[Ref | InputSymbol, Tangent], base: BaseState) -> dict[Ref | InputSymbol, Ref]:
    """Return the time derivatives of t, q and a moving base, by reference, for total derivatives at constant v."""
    rates = rates_along(tape, seeds)
    return rates | _base_rates(tape, base) if base.moving else rates


def _base_rates(tape: Tape, base: BaseState) -> dict[Ref | InputSymbol, Ref]:
    """Return the time derivatives of the base struct's numbers that are not 0, by reference. Pose from twist, twist
    from the acceleration, which is held constant."""
    start: dict[str, int] = {}
    offset = 0
    for name, size, _ in BASE_LAYOUT:
        start[name], offset = offset, offset + size
    rates: dict[Ref | InputSymbol, Ref] = {}

    def block(name: str, size: int) -> list[Ref]:
        return [value.ref for value in base.struct[start[name] : start[name] + size]]

    quaternion, omega, velocity = block("quaternion", 4), block("omega", 3), block("velocity", 3)
    half = tape.constant(0.5)
    w, x, y, z = (tape.mul(half, ref) for ref in quaternion)
    a, b, c = omega
    rows = ((-x, -y, -z), (w, -z, y), (z, w, -x), (-y, x, w))
    for ref, row in zip(quaternion, rows, strict=True):
        rates[ref] = tape.add(tape.add(tape.mul(row[0], a), tape.mul(row[1], b)), tape.mul(row[2], c))
    R = rotation(tape, quaternion)
    for ref, line in zip(block("position", 3), R, strict=True):
        terms = [tape.mul(entry, part) for entry, part in zip(line, velocity, strict=True)]
        rates[ref] = tape.add(tape.add(terms[0], terms[1]), terms[2])
    rates |= dict(zip(omega, block("omega_dot", 3), strict=True))
    rates |= dict(zip(velocity, block("velocity_dot", 3), strict=True))
    return {ref: rate for ref, rate in rates.items() if ref != ZERO}
