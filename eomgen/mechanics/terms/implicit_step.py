"""Functions of an implicit step: all equations at once, and the nonzeros of all their partials at once."""

from __future__ import annotations

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.dynamics.extended_system import extended_partials, pattern
from eomgen.symbolic.tape import ZERO
from eomgen.system.system import Block


def equations(derivation: Derivation) -> list[Block]:
    """Return the blocks of residual, constraints with rates, and rates of internal states, as far as they exist."""
    blocks = derivation.residual()
    if derivation.constraints is not None:
        blocks += [*derivation.constraint(), *derivation.constraint_velocity()]
    return blocks + (derivation.internal_rate() if derivation.scene.states else [])


def iteration(derivation: Derivation) -> list[Block]:
    """Return the nonzeros of all partials: of the whole tree, or for large trees of each step of the recursion."""
    if derivation.constraints is None and derivation.large:
        return extended_iteration(derivation)
    matrices = derivation.partials()
    if derivation.constraints is not None:
        matrices += [*derivation.constraint_jacobian(), *derivation.velocity_partials()]
    blocks = [_packed(derivation, block) for block in matrices]
    internal = [_packed(derivation, block) for block in derivation.internal_partials()]
    return blocks + [block for block in internal if block.refs]


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
    blocks = []
    for name, entries in partials.items():
        indices, refs = pattern(entries)
        derivation.patterns[name] = indices
        blocks.append(Block(name, (len(refs),), refs, f"nonzeros of {name} of the extended system"))
    return blocks


def jacobian_values(derivation: Derivation) -> list[Block]:
    """Return the nonzeros of the constraint Jacobian."""
    return [_packed(derivation, derivation.constraint_jacobian()[0])]


def _packed(derivation: Derivation, block: Block) -> Block:
    """Return the entries of a matrix that are not zero by structure, row by row, and keep where they belong."""
    columns = block.shape[1]
    derivation.patterns[block.name] = tuple(divmod(k, columns) for k, ref in enumerate(block.refs) if ref != ZERO)
    refs = tuple(ref for ref in block.refs if ref != ZERO)
    return Block(block.name, (len(refs),), refs, f"nonzeros of {block.name}: {block.description}")
