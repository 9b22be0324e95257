"""Functions of an implicit step: all equations at once, and the nonzeros of all their partials at once."""

from __future__ import annotations

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.dynamics.extended_system import Entries, extended_partials, pattern
from eomgen.mechanics.kinematics.directions import configuration_directions
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.tape import ONE, ZERO
from eomgen.system.system import Block


def equations(derivation: Derivation) -> list[Block]:
    """Return the blocks of residual, constraints with rates, and rates of internal states, as far as they exist."""
    blocks = derivation.residual()
    if derivation.constraints is not None:
        blocks += [*derivation.constraint(), *derivation.constraint_velocity()]
    return blocks + (derivation.internal_rate() if derivation.scene.states else [])


def iteration(derivation: Derivation) -> list[Block]:
    """Return the nonzeros of all partials: of the whole tree, or for large trees of each step of the recursion."""
    if derivation.large and derivation.sparse and derivation.flat and (derivation.constrained or derivation.stacked):
        blocks = differentiated_iteration(derivation)
    elif derivation.large and not derivation.constrained:
        return extended_iteration(derivation)
    else:
        matrices = derivation.partials()
        if derivation.constraints is not None:
            matrices += [*derivation.constraint_jacobian(), *derivation.velocity_partials()]
        blocks = [_packed(derivation, block) for block in matrices]
    internal = [_packed(derivation, block) for block in derivation.internal_partials()]
    return blocks + [block for block in internal if block.refs]


def differentiated_iteration(derivation: Derivation) -> list[Block]:
    """Return the nonzeros of K, C, M, and of B and Z of constraints, by forward differentiation with known
    positions.

    For many bodies of which few carry others: along long branches recursions are cheaper.
    """
    tape, nv, calculus = derivation.tape, derivation.tree.nv, derivation.constraints
    residual = derivation.residual()[0].refs
    seeds = configuration_directions(derivation.tree)
    for k in range(nv):
        seeds[InputSymbol("v", k)], seeds[InputSymbol("a", k)] = {nv + k: ONE}, {2 * nv + k: ONE}
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
    return [_nonzeros(derivation, name, of_matrix, name) for name, of_matrix in entries.items()]


def extended_iteration(derivation: Derivation) -> list[Block]:
    """Return the nonzeros of the partials of each step of the recursion, and store their indices."""
    with derivation.tape.block("partials of each step of the recursion"):
        partials, derivation.inner_owners = extended_partials(
            derivation.grouped,
            derivation.kinematics,
            derivation.motion,
            derivation.loads.wrenches,
            derivation.inverse(),
            derivation.internal,
        )
    return [
        _nonzeros(derivation, name, entries, f"{name} of the extended system") for name, entries in partials.items()
    ]


def jacobian_values(derivation: Derivation) -> list[Block]:
    """Return the nonzeros of the constraint Jacobian."""
    rows = derivation.calculus().tangents
    entries = {(row, column): ref for row, tangent in enumerate(rows) for column, ref in tangent.items()}
    return [_nonzeros(derivation, "B", entries, "B: constraint Jacobian, left-trivialised")]


def _nonzeros(derivation: Derivation, name: str, entries: Entries, description: str) -> Block:
    """Return the entries of a matrix, row by row, and keep their positions."""
    indices, refs = pattern({index: ref for index, ref in entries.items() if ref != ZERO})
    derivation.patterns[name] = indices
    return Block(name, (len(refs),), refs, f"nonzeros of {description}")


def _packed(derivation: Derivation, block: Block) -> Block:
    """Return the entries of a matrix that are not zero by structure, row by row, and keep their positions."""
    columns = block.shape[1]
    derivation.patterns[block.name] = tuple(divmod(k, columns) for k, ref in enumerate(block.refs) if ref != ZERO)
    refs = tuple(ref for ref in block.refs if ref != ZERO)
    return Block(block.name, (len(refs),), refs, f"nonzeros of {block.name}: {block.description}")
