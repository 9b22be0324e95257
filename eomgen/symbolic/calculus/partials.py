"""First derivatives on the same tape: sparse forward partials, also of long recursions whose intermediates stay
unknowns, and reverse gradients.

Griewank and Walther, Evaluating Derivatives (2008), chapter 3. Input symbols own their tangents: see ``configuration``.

If a function is not smooth, a derivative is chosen: ABS gives sign(x), so 0 at 0; SIGN, LT and LE give 0; MIN and
MAX take the operand they return, the first one recorded if both are equal; SELECT takes the branch it returns and
never differentiates its condition. Branches that are not taken have no derivatives for any values, see
``branches``; slopes of norms at 0 are 0, see ``edges``. POW with an exponent that varies needs a base of at least 0.

Named intermediates of long recursions may be kept as unknowns. The Jacobian of y = f(x, s(x)) with s given step by step
is dense, but the pair (y, definitions of s) has a sparse one: each step of a recursion knows only its neighbour.
Eliminating the intermediates again in a good order is the linear-time recursion (Griewank and Walther 2008, chapter 9:
the extended system).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from eomgen.symbolic.branches import (
    choose,
    common_condition,
    guarded_product,
    may_be_unbounded,
    plus,
    times,
    zero_unless,
)
from eomgen.symbolic.calculus.configuration import tangent_seeds
from eomgen.symbolic.calculus.loops import Tangent, map_adjoints, map_partials, signed_tangent
from eomgen.symbolic.edges import logarithm_of_base, power_slope
from eomgen.symbolic.external import Call, call_adjoints
from eomgen.symbolic.operations import ELEMENTARY, LEAVES, UNARY, InputSymbol, Op
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape, quotient

__all__ = [
    "Seeds", "Tangent", "forward_partials", "gradient", "gradient_along", "jacobian_vector", "signed_tangent",
    "tangent_seeds", "weighted_gradient",
]  # fmt: skip  # a table
Seeds = Mapping[Ref | InputSymbol, Mapping[int, Ref]]
#: Operations that return one of their operands.
CHOICES = frozenset({Op.SELECT, Op.MIN, Op.MAX})
#: Operations whose slope may be infinite at the edge of the domain, with a finite value.
WITH_EDGES = frozenset({op for op, row in ELEMENTARY.items() if row.rough} | {Op.POW})


def forward_partials(tape: Tape, outputs: Sequence[Ref], seeds: Seeds) -> list[Tangent]:
    """Differentiate outputs along several directions at once.

    Parameters
    ----------
    seeds : mapping from InputSymbol, or reference of a node, to {direction: derivative}
        Derivatives of the independent quantities; all other inputs are constants. A seeded node that is not an input is
        treated as independent: operands of this node are not differentiated.

    Returns
    -------
    list of {direction: reference}
        One per output. A direction that is absent has derivative zero by structure.

    Notes
    -----
    Linear in (live nodes) x (directions that reach them). Each local partial is recorded once and shared by all
    directions. Derivatives of a named node take the name with the number of the direction, ``length_d2``.
    """
    first = len(tape.op)
    tangents, _ = _tangents(tape, outputs, seeds)
    for node in [node for node in tangents if node in tape.names]:
        for direction, ref in tangents[node].items():
            if abs(ref) >= first:  # an older node means a quantity of motion, too
                tape.name(ref, f"{tape.names[node]}_d{direction}")
    return [signed_tangent(tangents, ref) for ref in outputs]


def _tangents(
    tape: Tape, outputs: Sequence[Ref], seeds: Seeds, cuts: Collection[int] = (), first: int = 0
) -> tuple[dict[int, Tangent], dict[int, Tangent]]:
    """Return the derivatives {direction: reference} of the nodes that the outputs need, by node; see
    ``forward_partials``. Nodes without a derivative are absent. Nodes among ``cuts`` become independent, with
    directions from ``first`` on: the second mapping has the derivatives of their definitions."""
    seeded = seeds_by_node(tape, seeds)
    tangents: dict[int, Tangent] = {}
    definitions: dict[int, Tangent] = {}
    maps: dict[int, list[Tangent]] = {}
    for node in tape.live(outputs):
        if node in seeded:
            tangents[node] = seeded[node]
            continue
        op = tape.op[node]
        if op in LEAVES or node in tape.converged:
            continue
        if op is Op.MAP:
            number = tape.a[node]
            if number not in maps:
                maps[number] = map_partials(tape, number, tangents, forward_partials)
            tangent = maps[number][tape.b[node]]
        else:
            tangent = node_tangent(tape, node, op, tangents)
            if tangent and node in cuts:
                tangent, definitions[node] = {first + len(definitions): ONE}, tangent
        if tangent:
            tangents[node] = tangent
    return tangents, definitions


def jacobian_vector(tape: Tape, outputs: Sequence[Ref], direction: Mapping[Ref | InputSymbol, Ref]) -> list[Ref]:
    """Differentiate outputs along one direction.

    Parameters
    ----------
    tape : of the outputs; derivatives are recorded here
    outputs : references to be differentiated
    direction : from each independent quantity, an input symbol or a node, to its derivative; all other inputs are
        constants

    Returns
    -------
    derivatives of the outputs; ``ZERO`` for structural zeros
    """
    tangents, _ = _tangents(tape, outputs, {key: {0: ref} for key, ref in direction.items()})
    return [signed_tangent(tangents, ref).get(0, ZERO) for ref in outputs]


def gradient(tape: Tape, output: Ref, wrt: Sequence[Ref]) -> list[Ref]:
    """Differentiate one output with respect to many nodes, treated as independent, by one reverse sweep."""
    return weighted_gradient(tape, [output], [ONE], wrt)


def weighted_gradient(tape: Tape, outputs: Sequence[Ref], weights: Sequence[Ref], wrt: Sequence[Ref]) -> list[Ref]:
    """Return the derivatives of sum_k weights[k] outputs[k] in the nodes ``wrt``, by one reverse sweep. The weights are
    held constant, and the nodes treated as independent. ``ZERO`` stands for structural zeros."""
    wanted = {abs(ref) for ref in wrt}
    adjoints: dict[int, Ref] = {}
    for output, weight in zip(outputs, weights, strict=True):
        _accumulate(tape, adjoints, output, weight)
    live = tape.live(outputs)
    reach = _depending(tape, live, wanted)
    pending = Counter(tape.a[node] for node in live if tape.op[node] is Op.MAP)
    of_maps: dict[int, dict[int, Ref]] = {}
    for node in reversed(live):
        op = tape.op[node]
        follow = node in adjoints and node in reach and node not in wanted
        if op is Op.MAP:
            number = tape.a[node]
            pending[number] -= 1
            if follow:
                of_maps.setdefault(number, {})[tape.b[node]] = adjoints[node]
            # first recorded result of the Map: all adjoints are complete
            if not pending[number] and number in of_maps:
                for ref, adjoint in _adjoints_of(tape, number, of_maps[number], reach):
                    _accumulate(tape, adjoints, ref, adjoint)
        elif follow and op not in LEAVES:
            for ref, adjoint in _adjoints_of_operands(tape, node, adjoints[node], reach):
                _accumulate(tape, adjoints, ref, adjoint)
    return [adjoints.get(ref, ZERO) if ref > 0 else tape.mul(-ONE, adjoints.get(-ref, ZERO)) for ref in wrt]


def gradient_along(tape: Tape, outputs: Sequence[Ref], weights: Sequence[Ref], seeds: Seeds, size: int) -> list[Ref]:
    """Return the derivatives of sum_k weights[k] outputs[k] along each of ``size`` directions, by one reverse sweep.

    Parameters
    ----------
    seeds : mapping from InputSymbol, or reference of a node, to {direction: derivative} As of ``forward_partials``.

    Returns
    -------
    list of Ref
        One per direction.
    """
    keys = {key: tape.input(key.block, key.index) if isinstance(key, InputSymbol) else key for key in seeds}
    adjoints = dict(zip(keys, weighted_gradient(tape, outputs, weights, list(keys.values())), strict=True))
    along = [ZERO] * size
    for key, tangent in seeds.items():
        for direction, ref in tangent.items():
            along[direction] = tape.add(along[direction], tape.mul(ref, adjoints[key]))
    return along


def _adjoints_of_operands(tape: Tape, node: int, adjoint: Ref, reach: set[int]) -> Iterator[tuple[Ref, Ref]]:
    """Yield pairs (operand, share of the adjoint) for the operands of a node that are in ``reach``. ``adjoint`` is the
    adjoint of the node."""
    operands, op = tape.operands(node), tape.op[node]
    if op in CHOICES:
        condition, *branches = _choice(tape, op, operands)
        for ref, share in zip(branches, ((adjoint, ZERO), (ZERO, adjoint)), strict=True):
            if abs(ref) in reach:
                yield ref, choose(tape, condition, *share)
        return
    active = [k for k, ref in enumerate(operands) if abs(ref) in reach]
    for k, partial in _local_partials(tape, node, op, active):
        product = guarded_product if may_be_unbounded(tape, partial, adjoint) else times
        yield operands[k], product(tape, partial, adjoint)


def _adjoints_of(tape: Tape, number: int, adjoints: Mapping[int, Ref], reach: set[int]) -> list[tuple[Ref, Ref]]:
    """Return pairs (reference, adjoint) for references that a Map or a call reads, from the adjoints by number of the
    result. ``number`` is the index in ``tape.maps``; operands of calls outside of ``reach`` are left out."""
    called = tape.maps[number]
    if isinstance(called, Call):
        pairs = call_adjoints(tape, called, adjoints, [abs(ref) in reach for ref in called.operands])
    else:
        pairs = map_adjoints(tape, number, adjoints, weighted_gradient)
    condition = common_condition(tape, adjoints.values()) if tape.conditions else None
    return [(ref, zero_unless(tape, condition, adjoint)) for ref, adjoint in pairs]


def seeds_by_node(tape: Tape, seeds: Seeds) -> dict[int, Tangent]:
    """Return seeds {direction: derivative} by node number, with signs of references applied and zeros dropped."""
    by_node: dict[int, Tangent] = {}
    for key, tangent in seeds.items():
        ref = tape.input(key.block, key.index) if isinstance(key, InputSymbol) else key
        by_node[abs(ref)] = {d: value if ref > 0 else -value for d, value in tangent.items() if abs(value) != ZERO}
    return by_node


def node_tangent(tape: Tape, node: int, op: Op, tangents: Mapping[int, Tangent]) -> Tangent:
    """Return the tangent {direction: derivative} of an operation, given the tangents by node; empty without
    derivatives. Zero derivatives are left out."""
    operands = tape.operands(node)
    inner = [signed_tangent(tangents, ref) for ref in operands]
    if not any(inner):
        return {}
    directions = dict.fromkeys(direction for tangent in inner for direction in tangent)
    if op in CHOICES:
        condition, then, otherwise = _choice(tape, op, operands)
        first, second = signed_tangent(tangents, then), signed_tangent(tangents, otherwise)
        taken = {d: choose(tape, condition, first.get(d, ZERO), second.get(d, ZERO)) for d in directions}
        return {d: ref for d, ref in taken.items() if ref != ZERO}
    partials = _local_partials(tape, node, op, [k for k, tangent in enumerate(inner) if tangent])
    product = guarded_product if op in WITH_EDGES else times
    result: Tangent = {}
    for direction in directions:
        total = ZERO
        for k, partial in partials:
            derivative = inner[k].get(direction)
            if derivative is not None:
                total = plus(tape, total, product(tape, partial, derivative))
        if total != ZERO:
            result[direction] = total
    return result


def _choice(tape: Tape, op: Op, operands: Sequence[Ref]) -> tuple[Ref, Ref, Ref]:
    """Return condition, then, otherwise of a node that returns one of its operands."""
    if op is Op.SELECT:
        return operands[0], operands[1], operands[2]
    x, y = operands
    return (tape.call(Op.LE, x, y) if op is Op.MIN else tape.call(Op.LE, y, x)), x, y


def _local_partials(tape: Tape, node: int, op: Op, active: Iterable[int]) -> list[tuple[int, Ref]]:
    """Return pairs (position of the operand, partial derivative) for the positions ``active`` of a node's operands.
    Structural zeros are left out. Not for choices."""
    operands = tape.operands(node)
    if op in UNARY:
        return [(0, _slope(tape, node, op, operands[0]))]
    if op is Op.CURVE:
        curve, order = tape.curves[tape.b[node]]
        return [(0, tape.curve(curve, order + 1, operands[0]))]
    x, y = operands
    partials: list[tuple[int, Ref]] = []
    for k in active:
        partial = ZERO
        match op, k:
            case (Op.ADD, _) | (Op.SUB, 0):
                partial = ONE
            case (Op.SUB, 1):
                partial = -ONE
            case (Op.MUL, _):
                partial = y if k == 0 else x
            case (Op.DIV, 0):
                partial = tape.div(ONE, y)
            case (Op.DIV, 1):
                partial = tape.mul(-node, tape.div(ONE, y))
            case (Op.ATAN2, _):
                squares = tape.add(tape.mul(x, x), tape.mul(y, y))
                partial = quotient(tape, y if k == 0 else -x, squares, squares)
            case (Op.POW, 0):
                partial = power_slope(tape, x, y)
            case (Op.POW, 1):
                partial = tape.mul(node, logarithm_of_base(tape, x)) if abs(x) != ZERO else ZERO
        if partial != ZERO:
            partials.append((k, partial))
    return partials


def _slope(tape: Tape, node: int, op: Op, x: Ref) -> Ref:
    """Return f'(x) of a function of one number, whose node is f(x)."""
    if op in ELEMENTARY:
        return ELEMENTARY[op].slope(tape, x, node)
    return tape.call(Op.SIGN, x) if op is Op.ABS else ZERO


def _depending(tape: Tape, live: Iterable[int], on: set[int]) -> set[int]:
    reach: set[int] = set()
    of_maps: dict[int, bool] = {}
    for node in live:
        if node in tape.converged and node not in on:
            continue
        if tape.op[node] is Op.MAP:
            if tape.a[node] not in of_maps:
                of_maps[tape.a[node]] = any(abs(ref) in reach for ref in tape.operands(node))
            follows = of_maps[tape.a[node]]
        else:
            follows = any(abs(ref) in reach for ref in tape.operands(node))
        if follows or node in on:
            reach.add(node)
    return reach


def _accumulate(tape: Tape, adjoints: dict[int, Ref], ref: Ref, adjoint: Ref) -> None:
    if abs(adjoint) != ZERO:
        adjoints[abs(ref)] = plus(tape, adjoints.get(abs(ref), ZERO), adjoint if ref > 0 else -adjoint)


def cut_partials(
    tape: Tape, outputs: Sequence[Ref], seeds: Seeds, cuts: Iterable[Ref], first: int
) -> tuple[list[Tangent], list[Tangent], list[int]]:
    """Differentiate outputs with some nodes (cuts) held as independent unknowns, and the definitions of these nodes.

    Parameters
    ----------
    seeds : as of ``forward_partials``
    cuts : references of operations; leaves, repetitions and operations that no output depends on are skipped
    first : direction of the first used cut; used cuts are numbered in the order of the tape

    Returns
    -------
    tangents of the outputs, and of the definitions of the used cuts, and these cuts' nodes

    Notes
    -----
    With s the cut nodes and s = g(x, s) the definitions of the cut nodes, the results are rows of [f_x, f_s] and [g_x,
    g_s]. Results of Maps are not cut.
    """
    tangents, definitions = _tangents(tape, outputs, seeds, {abs(ref) for ref in cuts}, first)
    return [signed_tangent(tangents, ref) for ref in outputs], list(definitions.values()), list(definitions)
