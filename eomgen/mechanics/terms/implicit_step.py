"""Functions for an implicit step: all equations at once, and the nonzeros of their partials at once; for large trees
the quantities of the recursion are unknowns, too.

Partials of inverse dynamics of long trees, linear in the number of links: the recursion's steps stay unknowns.

Between links the equations pass on only angular velocity, angular acceleration, acceleration of the origin, and the
transmitted wrench (poses and twists too, if applied forces need them). With these as unknowns s, the matrix of a
Newton step is sparse, and eliminating them from the tips to the root is the articulated-body recursion for an implicit
step.
"""

from __future__ import annotations

from collections.abc import Iterable

from eomgen.mechanics.dynamics.separated import carried_loads, net_wrenches
from eomgen.mechanics.kinematics.directions import block_directions, motion_directions
from eomgen.mechanics.kinematics.fields import angular_velocities, total_fields
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.tree.links import ROOT, Tree
from eomgen.symbolic.calculus.partials import cut_partials, forward_partials
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ONE, ZERO, Ref
from eomgen.system.system import Block

Entries = dict[tuple[int, int], Ref]


def extended_partials(derivation: Derivation) -> tuple[dict[str, Entries], tuple[int, ...]]:
    """Return the nonzeros by (row, column) of K, C, M, X, and of Rz, Fq, Fv, Fz, Fx of internal states.

    Also returned is, for each unknown s, the first velocity component of the unknown's link.

    Rows: the residual, then one definition g(q, v, a, s) - s for each unknown s. Columns of K (left-trivialised), C, M:
    velocity components; of X: the unknowns s; of Rz: internal states. F: rows are the rates of internal states.
    """
    tape, tree, internal = derivation.tape, derivation.grouped, derivation.internal
    nv, seeds = tree.nv, motion_directions(tree)
    first = 3 * nv + internal.count
    seeds |= block_directions("z", internal.count, 3 * nv)
    owners: dict[int, int] = {}
    alone = _alone(tree)
    if len(alone) < len(tree.links):
        for link, scalar in _passed_on(derivation):
            if link not in alone:
                owners.setdefault(abs(scalar.ref), tree.links[link].dofs[0])
    outputs = [value.ref for value in (*derivation.inverse, *internal.rates)]
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
    """Return the numbers of the links on the base without children, for which the recursion has no quantities."""
    carrying = {link.parent for link in tree.links}
    return {index for index, link in enumerate(tree.links) if link.parent == ROOT and index not in carrying}


def _passed_on(derivation: Derivation) -> Iterable[tuple[int, Scalar]]:
    """Yield (number of the link, scalar) for all quantities that the recursion of inverse dynamics passes between
    links. Poses and twists are among them if there are internal states or applied wrenches."""
    tree, base, loads = derivation.grouped, derivation.motion, derivation.loads.wrenches
    fields = total_fields(tree, base, accelerations=True, gravity=True)
    net = net_wrenches(tree, fields, loads)
    for index, omega in enumerate(angular_velocities(tree, base.omega)):
        yield from ((index, entry) for entry in omega)
    for index, field in enumerate(fields):
        yield from ((index, entry) for entry in (*field.alpha, *field.origin))
    for index, (moment, force) in enumerate(carried_loads(tree, net, "inverse dynamics")):
        yield from ((index, entry) for entry in (*moment, *force))
    if derivation.internal.count or any(load is not None for load in loads):
        for index in range(len(tree.links)):
            R, p = derivation.kinematics.pose(index)
            omega, velocity = derivation.kinematics.twist(index)
            yield from ((index, entry) for entry in (*R[0], *R[1], *R[2], *p, *omega, *velocity))


def equations(derivation: Derivation) -> list[Block]:
    """Return the residual block, the blocks of constraints and constraint velocities, and the block of internal-state
    rates. Blocks that the scene does not have are left out."""
    blocks = derivation.residual()
    if derivation.constraints is not None:
        blocks += [*derivation.constraint(), *derivation.constraint_velocity()]
    return blocks + (derivation.internal_rate() if derivation.scene.states else [])


def iteration(derivation: Derivation) -> list[Block]:
    """Return blocks of the nonzeros of all partials for an implicit step: K, C, M, B, Z and matrices of internal
    states. For large trees without constraints these are the partials of each step of the recursion, unless the tree is
    flat (see ``differentiated_iteration``). Empty matrices of internal states are left out; the (row, column) of
    nonzeros are entered into ``derivation.patterns`` by name of the matrix.
    """
    if (
        derivation.tree.large
        and derivation.sparse
        and derivation.flat
        and (derivation.has_constraints or derivation.has_carried_links)
    ):
        blocks = differentiated_iteration(derivation)
    elif derivation.tree.large and not derivation.has_constraints:
        return extended_iteration(derivation)
    else:
        matrices = derivation.partials()
        if derivation.constraints is not None:
            matrices += [*derivation.constraint_jacobian(), *derivation.velocity_partials()]
        blocks = [_pack(derivation, block) for block in matrices]
    internal = [_pack(derivation, block) for block in derivation.internal_partials()]
    return blocks + [block for block in internal if block.refs]


def differentiated_iteration(derivation: Derivation) -> list[Block]:
    """Return the nonzeros of K, C, M, and for constraints B and Z, as blocks, by forward differentiation. Positions are
    entered into ``derivation.patterns``. For many bodies of which few carry other bodies: along long branches
    recursions are cheaper."""
    tape, nv, calculus = derivation.tape, derivation.tree.nv, derivation.constraints
    residual = derivation.residual()[0].refs
    seeds = motion_directions(derivation.tree)
    with tape.block("partials of the residual"):
        tangents = forward_partials(tape, residual, seeds)
    entries: dict[str, Entries] = {name: {} for name in ("K", "C", "M")}
    for row, tangent in enumerate(tangents):
        for direction, ref in tangent.items():
            kind, column = divmod(direction, nv)
            entries["KCM"[kind]][row, column] = ref
    if calculus is not None:
        with tape.block("partials of the rates of the constraints"):
            of_rates = forward_partials(tape, [value.ref for value in calculus.velocity()], calculus.seeds)
        for name, rows in (("B", calculus.tangents), ("Z", of_rates)):
            entries[name] = {(row, column): ref for row, tangent in enumerate(rows) for column, ref in tangent.items()}
    return [nonzeros(derivation, name, of_matrix, name) for name, of_matrix in entries.items()]


def extended_iteration(derivation: Derivation) -> list[Block]:
    """Return the nonzeros of the matrices of ``extended_partials``, which has the partials of each recursion step, as
    blocks. The (row, column) of nonzeros are entered into ``derivation.patterns`` by name of the matrix. The first
    velocity component of the link of each inner unknown is entered into ``derivation.inner_owners``, empty without
    inner unknowns.
    """
    with derivation.tape.block("partials of each step of the recursion"):
        partials, derivation.inner_owners = extended_partials(derivation)
    return [nonzeros(derivation, name, entries, f"{name} of the extended system") for name, entries in partials.items()]


def jacobian_values(derivation: Derivation) -> list[Block]:
    """Return the block of the nonzeros of the constraint Jacobian, row by row; positions are entered into
    ``derivation.patterns``.
    """
    rows = derivation.calculus().tangents
    entries = {(row, column): ref for row, tangent in enumerate(rows) for column, ref in tangent.items()}
    return [nonzeros(derivation, "B", entries, "B: constraint Jacobian, left-trivialised")]


def mass_values(derivation: Derivation) -> list[Block]:
    """Return the block of the nonzeros of M, both triangles, row by row; positions are entered into
    ``derivation.patterns``."""
    entries: Entries = {}
    for row, along in enumerate(derivation.mass_rows):
        for column, value in along.items():
            entries[row, column] = entries[column, row] = value.ref
    return [nonzeros(derivation, "M_values", entries, "M: inertia matrix")]


def nonzeros(derivation: Derivation, name: str, entries: Entries, description: str) -> Block:
    """Return the block of the nonzeros among the entries of a matrix, row by row. Their (row, column) are entered into
    ``derivation.patterns`` under the name."""
    places = derivation.patterns[name] = tuple(sorted(position for position, ref in entries.items() if ref != ZERO))
    return Block(name, (len(places),), tuple(entries[position] for position in places), f"nonzeros of {description}")


def _pack(derivation: Derivation, block: Block) -> Block:
    """Return the block of the entries of a dense matrix that are not zero by structure, row by row. The (row, column)
    of the entries are entered into ``derivation.patterns``."""
    entries = {divmod(k, block.shape[1]): ref for k, ref in enumerate(block.refs)}
    return nonzeros(derivation, block.name, entries, f"{block.name}: {block.description}")
