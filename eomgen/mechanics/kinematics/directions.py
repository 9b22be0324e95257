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
from eomgen.symbolic.calculus.configuration import configuration_seeds, tangent_seeds
from eomgen.symbolic.calculus.loops import Tangent
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import multiply, skew
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape, dot
from eomgen.system.system import base_place

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


def block_directions(block: str, count: int, first: int = 0) -> Seeds:
    """Return the components of an input block as directions of differentiation, numbered from ``first``."""
    return {InputSymbol(block, k): {first + k: ONE} for k in range(count)}


def motion_directions(tree: Tree, blocks: str = "va") -> Seeds:
    """Return the directions of q, and then of v and a, or of the blocks named."""
    seeds = configuration_directions(tree)
    for number, block in enumerate(blocks, 1):
        seeds |= block_directions(block, tree.nv, number * tree.nv)
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
    pose, twist, acceleration = (
        [value.ref for value in base.struct[base_place(first) : base_place(first) + size]]
        for first, size in (("quaternion", 7), ("omega", 6), ("omega_dot", 6))
    )
    rates: dict[Ref | InputSymbol, Ref] = dict(zip(twist, acceleration, strict=True))
    for key, tangent in tangent_seeds(tape, "SE3", pose).items():
        rates[key] = dot(tape, list(tangent.values()), [twist[direction] for direction in tangent])
    return {ref: rate for ref, rate in rates.items() if ref != ZERO}
