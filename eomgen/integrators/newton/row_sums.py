"""Coordinates that relative springs and dampers join, and row sums of K and C that no subtraction has touched.

A spring k (x_1 - x_2) has k [1 -1; -1 1] in K: its rows add up to zero. If k is so large that k + m is k in doubles,
assembled diagonals have lost masses and all weaker springs, and no elimination finds them again. Off-diagonal entries
and row sums hold all of it (Grassmann, Taksar and Heyman, Operations Research 33 (1985) 1107; Alfa, Xue and Ye, Math.
Comp. 71 (2002) 217: entrywise small errors for any condition number). Row sums of K over a group of coordinates are
derivatives of the forces along a common motion of the group, and on the tape the derivative of x_1 - x_2 along that is
zero, not a difference of numbers.

A group is eligible if M does not couple its coordinates with each other; if each force that depends on several of
them, or on their rates, is the same when all are moved alike; and if their entries of K and C off the diagonal are
the same on both sides of it and nowhere positive: springs of negative stiffness are not.

Right sides lose as much: a link's force on one row, and its opposite on the other, each take the digits of weaker
forces there. So mutual forces of two rows are given apart from the rest of the residual, link by link, and
eliminated as a source on its link (see ``solver``), not as two large numbers that nearly cancel; if the elimination
is written out, that is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.data import replace
from eomgen.base.rounding import SUMMED
from eomgen.integrators.newton.matrix import MatrixIndex
from eomgen.integrators.newton.sample_matrices import samples_of
from eomgen.integrators.newton.solver import GROUPS_UNROLLED
from eomgen.integrators.newton.stages import joined_components
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.operations import LEAVES, InputSymbol, Op
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from eomgen.system.system import INPUT_BLOCKS, Block, Function, System

#: The functions that give row sums, and the residual with the forces of links separately.
ROW_SUMS, APART = "row_sums", "relative_forces"
#: Blocks of the function ``row_sums``, and the variables of differentiation of each block.
_ALONG = {"K_sum": "q", "C_sum": "v"}


def with_row_sums(system: System) -> System:
    """Return a system with the groups of coordinates that relative springs and dampers join, and with functions for
    them: ``row_sums``, if sums are not zero, and for small systems ``relative_forces``, the residual without the forces
    of links, and these. The system itself is returned if it has constraints, inner unknowns or no such group."""
    matrix = "iteration" if "iteration" in system.functions else "partials"
    forces = "equations" if system.facts.internal_states else "residual"
    if system.multipliers or system.inner_owners or not {matrix, forces} <= set(system.functions):
        return system
    entries = _entries(system, system.functions[matrix])
    coordinates = _coordinates(system)
    groups = _join_groups(entries, coordinates)
    if not groups:
        return system
    residual = next(block.refs for block in system.functions[forces].outputs if block.name == "r")
    summands = {k: _summands(system.tape, residual[k]) for group in groups for k in group}
    with system.tape.block("row sums of stiffness and damping"):
        groups, sums, mutual = _sum_mutual_forces(system.tape, summands, groups, coordinates)
    groups = _resisting(system, groups)
    if not groups:
        return system
    completed = _add_row_sums(system, tuple(groups), sums)
    if system.nv + system.nz > GROUPS_UNROLLED:
        return completed
    links = [_links(entries, summands, group, mutual) for group in groups]
    if any(pairs is None for pairs in links):
        return completed
    by_pair = {pair: terms for pairs in links if pairs is not None for pair, terms in pairs.items()}
    with system.tape.block("forces without relative springs and dampers, and the forces of these"):
        return _with_forces_apart(completed, system.functions[forces], summands, by_pair)


def _entries(system: System, function: Function) -> dict[str, dict[MatrixIndex, Ref]]:
    """Return tape references to the nonzeros of K, C and M in a function of partials, by matrix and (row, column)."""
    blocks = {block.name: block.refs for block in function.outputs}
    result: dict[str, dict[MatrixIndex, Ref]] = {}
    for name in ("K", "C", "M"):
        refs = blocks.get(name, ())
        packed = function.name == "iteration"
        indices = system.patterns.get(name, ()) if packed else [divmod(k, system.nv) for k in range(len(refs))]
        result[name] = {index: ref for index, ref in zip(indices, refs, strict=True) if abs(ref) != ZERO}
    return result


def _coordinates(system: System) -> dict[int, int]:
    """Return the index in q of each velocity component that is the rate of one coordinate, by component."""
    return {
        factor.v_start + k: factor.q_start + k
        for factor in system.factors
        if factor.group == "R"
        for k in range(factor.v_size)
    }


def _join_groups(entries: Mapping[str, Mapping[MatrixIndex, Ref]], coordinates: Mapping[int, int]) -> list[list[int]]:
    """Return the groups of two or more components that equal off-diagonal entries of K and C join, unless M couples
    them. `entries` are the references of K, C and M; `coordinates` the components that are rates of coordinates."""
    symmetric = (
        (row, column)
        for name in ("K", "C")
        for (row, column), ref in entries[name].items()
        if row < column and {row, column} <= coordinates.keys() and entries[name].get((column, row)) == ref
    )
    first = joined_components(1 + max(coordinates, default=-1), symmetric)
    coupled = {
        first[row]
        for row, column in entries["M"]
        if row != column and {row, column} <= coordinates.keys() and first[row] == first[column]
    }
    members: dict[int, list[int]] = {}
    for k in coordinates:
        members.setdefault(first[k], []).append(k)
    return [sorted(group) for root, group in sorted(members.items()) if len(group) > 1 and root not in coupled]


def _sum_mutual_forces(
    tape: Tape,
    summands: Mapping[int, Sequence[Ref]],
    groups: Sequence[Sequence[int]],
    coordinates: Mapping[int, int],
) -> tuple[list[list[int]], dict[str, dict[int, Ref]], set[Ref]]:
    """Return groups whose mutual forces do not change with a common motion, their row sums, and all mutual forces. Row
    sums are references by block (K_sum, C_sum) and component. A mutual force is a summand of the residual that depends
    on several coordinates of the group. `summands` has the summands of each component's residual. Operations are added
    to the tape."""
    seeds: dict[Ref | InputSymbol, dict[int, Ref]] = {}
    for number, group in enumerate(groups):
        for k in group:
            seeds[InputSymbol("q", coordinates[k])] = {2 * number: ONE}
            seeds[InputSymbol("v", k)] = {2 * number + 1: ONE}
    terms = sorted({abs(ref) for refs in summands.values() for ref in refs})
    along = dict(zip(terms, forward_partials(tape, terms, seeds), strict=True))
    touched = _dependencies(tape, terms, {key: group for group in groups for key in group}, coordinates)
    kept: list[list[int]] = []
    result: set[Ref] = set()
    sums: dict[str, dict[int, Ref]] = {name: {} for name in _ALONG}
    for number, group in enumerate(groups):
        members = sum(1 << k for k in group)
        mutual = {abs(ref) for k in group for ref in summands[k] if (touched[abs(ref)] & members).bit_count() > 1}
        if any(along[term].get(2 * number + part, ZERO) != ZERO for term in mutual for part in (0, 1)):
            continue
        kept.append(list(group))
        result |= mutual
        for part, name in enumerate(_ALONG):
            for k in group:
                total = ZERO
                for ref in summands[k]:
                    tangent = along[abs(ref)].get(2 * number + part, ZERO)
                    total = tape.add(total, tangent if ref > 0 else tape.mul(-ONE, tangent))
                sums[name][k] = total
    return kept, sums, result


def _summands(tape: Tape, ref: Ref) -> list[Ref]:
    """Return the summands of a reference on the tape, with signs and in order; nested sums and differences are
    resolved."""
    result: list[Ref] = []
    left = [ref]
    while left:
        item = left.pop()
        op, sign = tape.op[abs(item)], 1 if item > 0 else -1
        if op in (Op.ADD, Op.SUB):
            first, second = tape.operands(abs(item))
            left += [sign * (second if op is Op.ADD else -second), sign * first]
        elif abs(item) != ZERO:
            result.append(item)
    return result


def _dependencies(
    tape: Tape, terms: Sequence[Ref], members: Mapping[int, Sequence[int]], coordinates: Mapping[int, int]
) -> dict[int, int]:
    """Return for each operation below some terms the coordinates of groups on which it depends, as bits of an integer.
    Bit k is set for the component k of `members` if its coordinate or velocity is used."""
    bits = {InputSymbol("q", coordinates[k]): 1 << k for k in members}
    bits |= {InputSymbol("v", k): 1 << k for k in members}
    result: dict[int, int] = {}
    of_maps: dict[int, int] = {}
    for node in tape.live(terms):
        node_bits = of_maps.get(tape.a[node], -1) if tape.op[node] is Op.MAP else -1
        if node_bits >= 0:  # results of a Map have the same operands
            result[node] = node_bits
            continue
        node_bits = 0
        if tape.op[node] is Op.INPUT:
            node_bits = bits.get(tape.inputs[tape.a[node]], 0)
        elif tape.op[node] not in LEAVES:
            for ref in tape.operands(node):
                node_bits |= result.get(abs(ref), 0)
            if tape.op[node] is Op.MAP:
                of_maps[tape.a[node]] = node_bits
        result[node] = node_bits
    return result


def _resisting(system: System, groups: Sequence[Sequence[int]]) -> list[list[int]]:
    """Return the groups whose off-diagonal entries of K and C are nowhere positive in samples, and in part negative.
    Rounding does not count. So springs and dampers resist relative motion."""
    samples = samples_of(system)
    member = {k: number for number, group in enumerate(groups) for k in group}
    worst, least = np.full(len(groups), -np.inf), np.zeros(len(groups))
    for name in ("K", "C"):
        for (row, column), number in samples.packing.nonzeros[name].items():
            if row != column and row in member and member[row] == member.get(column):
                values = samples.numbers[:, number]
                worst[member[row]] = max(worst[member[row]], values.max())
                least[member[row]] = min(least[member[row]], values.min())
    return [
        list(group) for group, large, small in zip(groups, worst, least, strict=True) if large <= -SUMMED * small > 0.0
    ]


def _add_row_sums(system: System, groups: tuple[Sequence[int], ...], sums: Mapping[str, Mapping[int, Ref]]) -> System:
    """Return the system with groups of coordinates, and with the function ``row_sums`` of sums that are not zero by
    structure. `sums` has references on the tape by block (K_sum, C_sum) and component."""
    blocks, patterns = [], {}
    for name, along in _ALONG.items():
        nonzeros = {k: sums[name][k] for group in groups for k in group if abs(sums[name][k]) != ZERO}
        if nonzeros:
            description = (
                f"row sums of {name[0]} over each group, of components {', '.join(map(str, nonzeros))} of {along}"
            )
            blocks.append(Block(name, (len(nonzeros),), tuple(nonzeros.values()), description))
            patterns[name] = tuple((k, k) for k in nonzeros)
    functions: dict[str, Any] = dict(system.functions)
    if blocks:
        read = {symbol.block for symbol in system.tape.depends_on(ref for block in blocks for ref in block.refs)}
        inputs = tuple(block for block in INPUT_BLOCKS if block in read)
        description = "row sums of stiffness and damping over coordinates that relative springs join"
        functions[ROW_SUMS] = Function(ROW_SUMS, description, inputs, tuple(blocks))
    return replace(
        system,
        functions=functions,
        patterns={**system.patterns, **patterns},
        relative=tuple(tuple(group) for group in groups),
    )


def _links(
    entries: Mapping[str, Mapping[MatrixIndex, Ref]],
    summands: Mapping[int, Sequence[Ref]],
    group: Sequence[int],
    mutual: set[Ref],
) -> dict[tuple[int, int], list[Ref]] | None:
    """Return the mutual forces of each pair of rows (smaller first) that K or C couple; the force is opposite in the
    second.

    None if some mutual force does not act on two rows of such a pair in opposite directions, or if K or C is not
    symmetric.

    Parameters
    ----------
    entries : references of K, C and M
    summands : of the residual of each component
    group : components
    mutual : references of mutual forces
    """
    members = set(group)
    inside = {
        name: {index: ref for index, ref in entries[name].items() if index[0] != index[1] and set(index) <= members}
        for name in ("K", "C")
    }
    for matrix in inside.values():
        if any(matrix.get((column, row)) != ref for (row, column), ref in matrix.items()):
            return None
    links: dict[tuple[int, int], list[Ref]] = {
        (min(index), max(index)): [] for matrix in inside.values() for index in matrix
    }
    owners: dict[Ref, list[tuple[int, Ref]]] = {}
    for k in group:
        for ref in summands[k]:
            if abs(ref) in mutual:
                owners.setdefault(abs(ref), []).append((k, ref))
    for places in owners.values():
        if len(places) != 2 or places[0][1] != -places[1][1] or (places[0][0], places[1][0]) not in links:
            return None
        links[places[0][0], places[1][0]].append(places[0][1])
    return links


def _with_forces_apart(
    system: System,
    forces: Function,
    summands: Mapping[int, Sequence[Ref]],
    links: Mapping[tuple[int, int], Sequence[Ref]],
) -> System:
    """Return the system with the function ``relative_forces``: the residual without the forces of links, and these
    forces. The block ``mutual`` has one force for each pair of rows in `links`, the sum of its references. `forces` is
    the function with the whole residual, `summands` its summands by component. The pairs are kept as
    ``System.links``."""
    tape = system.tape
    apart = {abs(ref) for terms in links.values() for ref in terms}

    def total(refs: Sequence[Ref]) -> Ref:
        value = ZERO
        for ref in refs:
            value = tape.add(value, ref)
        return value

    rest = {k: total([ref for ref in refs if abs(ref) not in apart]) for k, refs in summands.items()}
    mutual = tuple(total(terms) for terms in links.values())
    blocks = []
    for block in forces.outputs:
        if block.name == "r":
            refs = tuple(rest[k] if any(k in pair for pair in links) else ref for k, ref in enumerate(block.refs))
            blocks.append(replace(block, refs=refs, description="residual without the forces of links"))
        else:
            blocks.append(block)
    pairs = ", ".join(f"{i} and {j}" for i, j in links)
    description = f"forces of links, which the residual has besides, with a minus in the second, of rows {pairs}"
    blocks.append(Block("mutual", (len(mutual),), mutual, description))
    read = {symbol.block for symbol in tape.depends_on(ref for block in blocks for ref in block.refs)}
    inputs = tuple(block for block in INPUT_BLOCKS if block in read)
    text = "the residual, and apart from it the forces of relative springs and dampers between two coordinates"
    functions = {**system.functions, APART: Function(APART, text, inputs, tuple(blocks))}
    return replace(system, functions=functions, links=tuple(links))
