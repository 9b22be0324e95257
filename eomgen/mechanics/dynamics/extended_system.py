"""Partials of inverse dynamics of long trees, linear in the number of links: the recursion's steps stay unknowns.

Between links the equations pass on only angular velocity, angular acceleration, acceleration of the origin, and the
transmitted wrench (poses and twists too, if applied forces need them). With these as unknowns s, the matrix of a
Newton step is sparse, and eliminating them from the tips to the root is the articulated-body recursion for an implicit
step.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from eomgen.mechanics.dynamics.separated import carried_loads, net_wrenches
from eomgen.mechanics.forces.internal_states import InternalStates
from eomgen.mechanics.kinematics.directions import configuration_directions
from eomgen.mechanics.kinematics.fields import angular_velocities, total_fields
from eomgen.mechanics.kinematics.points import Kinematics
from eomgen.mechanics.kinematics.wrenches import Wrench
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.links import ROOT, Tree
from eomgen.symbolic.calculus.cuts import cut_partials
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ONE, Ref

Entries = dict[tuple[int, int], Ref]


def extended_partials(
    tree: Tree,
    kinematics: Kinematics,
    base: BaseMotion,
    loads: Sequence[Wrench | None],
    residual: Sequence[Scalar],
    internal: InternalStates,
) -> tuple[dict[str, Entries], tuple[int, ...]]:
    """Return the nonzeros by (row, column) of K, C, M, X, and of Rz, Fq, Fv, Fz, Fx of internal states.

    Also returned is, for each unknown s, the first velocity component of its link.

    Rows: the residual, then one definition g(q, v, a, s) - s for each unknown s. Columns of K (left-trivialised), C, M:
    velocity components; of X: the unknowns s; of Rz: internal states. F: rows are the rates of internal states.
    """
    tape, nv = tree.algebra.tape, tree.nv
    seeds = configuration_directions(tree)
    for k in range(nv):
        seeds[InputSymbol("v", k)], seeds[InputSymbol("a", k)] = {nv + k: ONE}, {2 * nv + k: ONE}
    first = 3 * nv + internal.count
    seeds |= internal.seeds(3 * nv)
    owners: dict[int, int] = {}
    alone = _alone(tree)
    if len(alone) < len(tree.links):
        for link, scalar in _passed_on(tree, kinematics, base, loads, posed=internal.count > 0):
            if link not in alone:
                owners.setdefault(abs(scalar.ref), tree.links[link].dofs[0])
    outputs = [value.ref for value in (*residual, *internal.rates())]
    tangents, definitions, used = cut_partials(tape, outputs, seeds, owners, first)
    entries: dict[str, Entries] = {"K": {}, "C": {}, "M": {}, "X": {}}
    for names, rows in (
        (("K", "C", "M", "Rz", "X"), [*tangents[:nv], *definitions]),
        (("Fq", "Fv", "", "Fz", "Fx"), tangents[nv:]),
    ):
        for row, tangent in enumerate(rows):
            for direction, ref in tangent.items():
                kind = direction // nv if direction < 3 * nv else 3 if direction < first else 4
                column = direction - (0, nv, 2 * nv, 3 * nv, first)[kind]
                entries.setdefault(names[kind], {})[row, column] = ref
    for number in range(len(definitions)):
        row = nv + number
        entries["X"][row, number] = tape.sub(entries["X"].get((row, number), tape.constant(0.0)), ONE)
    return entries, tuple(owners[node] for node in used)


def _alone(tree: Tree) -> set[int]:
    """Return the links on the base without children: the recursion has no quantities for them."""
    carrying = {link.parent for link in tree.links}
    return {index for index, link in enumerate(tree.links) if link.parent == ROOT and index not in carrying}


def _passed_on(
    tree: Tree, kinematics: Kinematics, base: BaseMotion, loads: Sequence[Wrench | None], *, posed: bool
) -> Iterable[tuple[int, Scalar]]:
    """Yield the quantities of the recursion with the number of their link; poses and twists if
    ``posed``."""
    fields = total_fields(tree, base, accelerations=True, gravity=True)
    net = net_wrenches(tree, fields, loads)
    for index, omega in enumerate(angular_velocities(tree, base.omega)):
        yield from ((index, entry) for entry in omega)
    for index, field in enumerate(fields):
        yield from ((index, entry) for entry in (*field.alpha, *field.origin))
    for index, (moment, force) in enumerate(carried_loads(tree, net, "inverse dynamics")):
        yield from ((index, entry) for entry in (*moment, *force))
    if posed or any(load is not None for load in loads):
        for index in range(len(tree.links)):
            R, p = kinematics.pose(index)
            omega, velocity = kinematics.twist(index)
            yield from ((index, entry) for entry in (*R[0], *R[1], *R[2], *p, *omega, *velocity))


def pattern(entries: Entries) -> tuple[tuple[tuple[int, int], ...], tuple[Ref, ...]]:
    """Return the indices (row, column) in row order, and their references."""
    indices = tuple(sorted(entries))
    return indices, tuple(entries[index] for index in indices)
