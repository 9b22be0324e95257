"""Calculus on Maps: the derivative, the adjoint and the jet of a loop are loops again; tangents of tape nodes.

The kernel is differentiated once for any number of elements; derivatives of carries are carries (Griewank and
Walther 2008, chapter 3), adjoints of carries run backwards through the elements over stored carries (chapter 4).
The function that differentiates the kernel is an argument, since a kernel may contain loops itself.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from typing import Any, cast

from eomgen.base.data import dataclass, replace
from eomgen.symbolic.external import Call, call_partials
from eomgen.symbolic.map import KERNEL_BLOCKS, Map, T, add_map, splice
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape

Tangent = dict[int, Ref]  # direction -> derivative; directions with a derivative of zero by structure are absent


def signed_tangent(tangents: Mapping[int, Tangent], ref: Ref) -> Tangent:
    """Return the tangent of a reference, given the tangents of nodes."""
    tangent = tangents.get(abs(ref), {})
    return tangent if ref > 0 else {direction: -derivative for direction, derivative in tangent.items()}


#: ``partials.forward_partials``, ``jets.jets`` and ``partials.weighted_gradient``.
ForwardPartials = Callable[[Tape, Sequence[Ref], Mapping[Ref | InputSymbol, Mapping[int, Ref]]], list[Tangent]]
Jets = Callable[[Tape, Sequence[Ref], Mapping[Ref | InputSymbol, Sequence[Ref]], int], list[list[Ref]]]
WeightedGradient = Callable[[Tape, Sequence[Ref], Sequence[Ref], Sequence[Ref]], list[Ref]]


def map_partials(
    tape: Tape, number: int, tangents: Mapping[int, Tangent], forward_partials: ForwardPartials
) -> list[Tangent]:
    """Return the tangent of every result of a Map or a call, in order, as {direction: derivative}.

    ``number`` is the index in ``tape.maps``, ``tangents`` the tangents of nodes, ``forward_partials`` differentiates
    the kernel. One loop carries all directions. Only if most products would be with zeros (no carries, and few
    directions reach each element) the loop gives the local partials of each element instead, which are combined
    outside; or, if fewer directions reach an element than the element gathers numbers, the derivatives of the element
    along these directions. Derivatives in quantities shared by all elements are combined outside, too, if these
    quantities are fewer than the directions that change them.
    """
    loop = cast("Map | Call", tape.maps[number])
    if isinstance(loop, Call):
        return call_partials(tape, loop, [signed_tangent(tangents, ref) for ref in loop.operands])
    outer = {symbol: [signed_tangent(tangents, ref) for ref in refs] for symbol, refs in _outer(loop).items()}
    directions = set(chain.from_iterable(chain.from_iterable(outer.values())))
    if not loop.initial:
        slots, shared = _varying(outer, "gather"), _varying(outer, "shared")
        reached = sum(len(tangent) for column in slots for tangent in column)
        sparse = 4 * reached < loop.count * len(slots) * len(directions)
        local = _local_directions(loop, outer) if sparse else None
        if local is not None and local.count < len(slots):
            return _partials_along(tape, loop, outer, local, forward_partials)
        if sparse or (not slots and len(shared) < len(directions)):
            return _combined_partials(tape, loop, outer, forward_partials)
    return _partials_in_all(tape, loop, outer, sorted(directions), forward_partials)


def _varying(outer: Mapping[InputSymbol, Sequence[Tangent]], block: str) -> list[Sequence[Tangent]]:
    """Return the tangents of the inputs of a block that any direction changes."""
    return [column for symbol, column in outer.items() if symbol.block == block and any(column)]


def _partials_in_all(
    tape: Tape,
    loop: Map,
    outer: Mapping[InputSymbol, Sequence[Tangent]],
    directions: Sequence[int],
    forward_partials: ForwardPartials,
) -> list[Tangent]:
    """Return the tangents of all results by one loop that carries all directions."""
    growth = _Growth(loop)
    seeds: dict[Ref | InputSymbol, dict[int, Ref]] = {}
    for direction in directions:
        touched = {symbol for symbol, column in outer.items() if any(direction in tangent for tangent in column)}
        for symbol in _moving(loop, touched):
            column = [tangent.get(direction, ZERO) for tangent in outer[symbol]]
            seeds.setdefault(symbol, {})[direction] = growth.add_input(symbol, direction, column)
    return growth.finish(tape, forward_partials(growth.kernel, growth.refs, seeds))


def map_jets(tape: Tape, number: int, jet: Callable[[Ref], Sequence[Ref]], order: int, jets: Jets) -> list[list[Ref]]:
    """Return the jet of every result of a Map, in order: coefficients 0 to ``order``. ``number`` is the index in
    ``tape.maps``, ``jet`` returns the jet of an outer reference, ``jets`` differentiates the kernel. The loop over the
    further coefficients is recorded on the tape."""
    loop = cast("Map", tape.maps[number])
    outer = {symbol: [jet(ref) for ref in refs] for symbol, refs in _outer(loop).items()}
    loop = replace(
        loop,
        shared=tuple(jet(ref)[0] for ref in loop.shared),
        gather=tuple(tuple(jet(ref)[0] for ref in slot) for slot in loop.gather),
        initial=tuple(jet(ref)[0] for ref in loop.initial),
    )
    growth = _Growth(loop)
    seeds: dict[Ref | InputSymbol, Sequence[Ref]] = {}
    varying = {symbol for symbol, column in outer.items() if any(ref != ZERO for path in column for ref in path[1:])}
    for symbol in _moving(loop, varying):
        later = [growth.add_input(symbol, k, [path[k] for path in outer[symbol]]) for k in range(1, order + 1)]
        seeds[symbol] = [growth.kernel.input(symbol.block, symbol.index), *later]
    series = jets(growth.kernel, growth.refs, seeds, order)
    rows = growth.finish(tape, [{k: ref for k, ref in enumerate(path) if k and ref != ZERO} for path in series])
    values = add_map(tape, loop).flat
    return [[value, *(row.get(k, ZERO) for k in range(1, order + 1))] for value, row in zip(values, rows, strict=True)]


def map_adjoints(
    tape: Tape, number: int, adjoints: Mapping[int, Ref], weighted_gradient: WeightedGradient
) -> list[tuple[Ref, Ref]]:
    """Return pairs (outer reference, adjoint) for all references that a Map reads; a reference may occur several times.
    ``number`` is the index in ``tape.maps``, ``adjoints`` the adjoints by number of the result; ``weighted_gradient``
    differentiates the kernel. Carries are recorded in a loop forwards, adjoints in a loop backwards."""
    loop = cast("Map", tape.maps[number])
    kernel = Tape()
    refs = splice(kernel, loop.kernel, loop.kernel_refs, {})
    carried = [] if not loop.initial else _carries_of_elements(tape, loop)
    shared, gather = list(loop.shared), [tuple(reversed(slot)) for slot in (*loop.gather, *carried)]
    stored = {InputSymbol("carry", k): kernel.input("gather", len(loop.gather) + k) for k in range(len(loop.initial))}
    sums, last, stacked = loop.split_kernel(splice(kernel, kernel, refs, stored))
    outputs: list[Ref] = []
    weights: list[Ref] = []
    for k, ref in enumerate(sums):
        if k in adjoints:
            outputs.append(ref)
            weights.append(kernel.input("shared", len(shared)))
            shared.append(adjoints[k])
    for k, ref in enumerate(last):
        outputs.append(ref)
        weights.append(kernel.input("carry", k))
    start = len(sums) + len(last)
    for k, ref in enumerate(stacked):
        column = [adjoints.get(start + i * len(stacked) + k, ZERO) for i in range(loop.count)]
        if any(adjoint != ZERO for adjoint in column):
            outputs.append(ref)
            weights.append(kernel.input("gather", len(gather)))
            gather.append(tuple(reversed(column)))
    inputs = [
        *(kernel.input("shared", j) for j in range(len(loop.shared))),
        *(stored[InputSymbol("carry", k)] for k in range(len(last))),
        *(kernel.input("gather", j) for j in range(len(loop.gather))),
    ]
    of_shared, of_carry, of_gather = _split(
        weighted_gradient(kernel, outputs, weights, inputs), len(loop.shared), len(last)
    )
    elements = tuple(tuple(reversed(column)) for column in loop.elements)
    initial = tuple(adjoints.get(len(sums) + k, ZERO) for k in range(len(last)))
    columns = elements, tuple(shared), tuple(gather), initial
    backward = Map(kernel, loop.count, *columns, tuple(of_shared), tuple(of_carry), tuple(of_gather), loop.label)
    results = add_map(tape, compact(backward, range(len(last))))
    pairs = [*zip(loop.shared, results.sums, strict=True), *zip(loop.initial, results.last, strict=True)]
    for row, i in zip(results.rows, reversed(range(loop.count)), strict=True):
        pairs += [(slot[i], adjoint) for slot, adjoint in zip(loop.gather, row, strict=True)]
    return pairs


def compact(loop: Map, wanted: Iterable[int]) -> Map:
    """Return a Map without unused operations, inputs and carries. The carries numbered in ``wanted`` come first;
    further carries stay only if results depend on them."""
    carries = list(wanted)
    needed: set[InputSymbol] = set()
    fresh = loop.kernel.depends_on([*loop.sums, *loop.stacked, *(loop.last[k] for k in carries)])
    while fresh:
        needed |= fresh
        others = sorted({symbol.index for symbol in fresh if symbol.block == "carry"} - set(carries))
        carries += others
        fresh = loop.kernel.depends_on([loop.last[k] for k in others]) - needed
    kernel = Tape()
    kept = {block: sorted(symbol.index for symbol in needed if symbol.block == block) for block in KERNEL_BLOCKS}
    kept["carry"] = carries
    bindings = {
        InputSymbol(name, old): kernel.input(name, new) for name in KERNEL_BLOCKS for new, old in enumerate(kept[name])
    }
    refs = splice(kernel, loop.kernel, [*loop.sums, *(loop.last[k] for k in carries), *loop.stacked], bindings)
    sums, last, stacked = _split(refs, len(loop.sums), len(carries))
    blocks = zip(KERNEL_BLOCKS, (loop.elements, loop.shared, loop.gather, loop.initial), strict=True)
    elements, shared, gather, initial = (cast(Any, tuple(column[k] for k in kept[block])) for block, column in blocks)
    carried = tuple(sums), tuple(last), tuple(stacked)
    return Map(kernel, loop.count, elements, shared, gather, initial, *carried, loop.label)


class _Growth:
    """Copy of a Map with further kernel inputs, each a tangent or Taylor coefficient (companion) of an input of the
    Map."""

    def __init__(self, loop: Map) -> None:
        self.loop = loop
        self.kernel = Tape()
        self.refs = splice(self.kernel, loop.kernel, loop.kernel_refs, {})
        self._shared, self._gather, self._initial = list(loop.shared), list(loop.gather), list(loop.initial)
        self._slots = {column: slot for slot, column in reversed(list(enumerate(loop.gather)))}
        self._carried: list[tuple[int, int]] = []

    def add_input(self, symbol: InputSymbol, label: int, column: Sequence[Ref]) -> Ref:
        """Return the kernel reference of a new input, companion ``label`` (direction or order) of the input ``symbol``.
        ``column`` are the outer references of the companion: one for each element, or one if shared or a carry. Zeros
        and ones are constants, and an equal gathered column is reused."""
        constant = column[0] in (ZERO, ONE) and all(ref == column[0] for ref in column)
        if symbol.block == "carry":
            self._initial.append(column[0])
            self._carried.append((symbol.index, label))
            return self.kernel.input("carry", len(self._initial) - 1)
        if constant:
            return column[0]
        if symbol.block == "shared":
            self._shared.append(column[0])
            return self.kernel.input("shared", len(self._shared) - 1)
        sign, slot = next(
            (
                (sign, known)
                for sign in (1, -1)
                if (known := self._slots.get(tuple(ref if ref == ZERO else sign * ref for ref in column))) is not None
            ),
            (1, len(self._gather)),
        )
        if slot == len(self._gather):
            self._slots[tuple(column)] = slot
            self._gather.append(tuple(column))
        return sign * self.kernel.input("gather", slot)

    def rows(self, tape: Tape, companions: Sequence[Mapping[int, Ref]]) -> list[list[Tangent]]:
        """Record the loop that computes the companions, and return for each element the companions of all results, by
        label. ``companions`` are kernel references by label, one mapping for each result."""
        loop, stacked = self.loop, _flat(companions)
        columns = loop.elements, tuple(self._shared), tuple(self._gather)
        grown = Map(self.kernel, loop.count, *columns, stacked=stacked, label=loop.label)
        return [_label(companions, row) for row in add_map(tape, compact(grown, ())).rows]

    def finish(self, tape: Tape, companions: Sequence[Mapping[int, Ref]]) -> list[Tangent]:
        """Record the loop that computes companions of all results, and return these by label for each result of the
        Map, in order. ``companions`` are kernel references by label, one mapping for each of the Map's ``kernel_refs``.
        Zeros are left out."""
        loop = self.loop
        sums, last, stacked = loop.split_kernel(companions)
        old = len(loop.last)
        old_last = self.refs[len(sums) : len(sums) + old]
        columns = loop.elements, tuple(self._shared), tuple(self._gather), tuple(self._initial)
        all_last = (*old_last, *(last[k].get(label, ZERO) for k, label in self._carried))
        grown = Map(self.kernel, loop.count, *columns, _flat(sums), all_last, _flat(stacked), loop.label)
        results = add_map(tape, compact(grown, range(old, len(self._initial))))
        finals: list[Tangent] = [{} for _ in loop.last]
        # old carries that are still needed follow
        for (k, label), ref in zip(self._carried, results.last, strict=False):
            finals[k][label] = ref
        of_elements = chain.from_iterable(_label(stacked, row) for row in results.rows)
        return list(map(_nonzero, (*_label(sums, results.sums), *finals, *of_elements)))


def _combined_partials(
    tape: Tape, loop: Map, outer: Mapping[InputSymbol, Sequence[Tangent]], forward_partials: ForwardPartials
) -> list[Tangent]:
    """Return the tangents of a Map's results, in order, from local partials of each element, combined outside of the
    loop. ``outer`` holds the tangents of the outer references of each kernel input."""
    active = [symbol for symbol, column in outer.items() if any(column)]
    kernel = Tape()
    refs = splice(kernel, loop.kernel, loop.kernel_refs, {})
    partials = forward_partials(kernel, refs, {symbol: {k: ONE} for k, symbol in enumerate(active)})
    sums, _, stacked = loop.split_kernel(partials)
    summed = [{k: ref for k, ref in row.items() if active[k].block == "shared"} for row in sums]
    local = [{k: ref for k, ref in row.items() if active[k].block == "gather"} for row in sums] + stacked
    partial_loop = replace(loop, kernel=kernel, sums=_flat(summed), stacked=_flat(local))
    results = add_map(tape, compact(partial_loop, ()))
    totals = [_combine(tape, {}, row, [outer[symbol][0] for symbol in active]) for row in _label(summed, results.sums)]
    rows: list[Tangent] = []
    for i, row in enumerate(results.rows):
        here = [outer[symbol][i if symbol.block == "gather" else 0] for symbol in active]
        of_sums, of_rows = _split(_label(local, row), len(loop.sums), 0)[::2]
        totals = [_combine(tape, total, partial, here) for total, partial in zip(totals, of_sums, strict=True)]
        rows += [_combine(tape, {}, partial, here) for partial in of_rows]
    return totals + rows


@dataclass(frozen=True)
class _LocalDirections:
    """Directions that reach each element, with local numbers that are equal for directions that change the same
    gathered numbers.

    Attributes
    ----------
    count : the most numbers that any element has
    numbers : by element, from the local number to the direction
    """

    count: int
    numbers: tuple[Mapping[int, int], ...]


def _local_directions(loop: Map, outer: Mapping[InputSymbol, Sequence[Tangent]]) -> _LocalDirections | None:
    """Return the directions that reach each element, numbered so that elements share numbers. ``outer`` holds the
    tangents of the outer references of each kernel input. None if shared quantities change too."""
    gathered = [column for symbol, column in outer.items() if symbol.block == "gather"]
    if any(any(column) for symbol, column in outer.items() if symbol.block != "gather"):
        return None
    kinds: dict[tuple[tuple[int, ...], int], int] = {}
    numbers = []
    for i in range(loop.count):
        changed: dict[int, list[int]] = {}
        for slot, column in enumerate(gathered):
            for direction in column[i]:
                changed.setdefault(direction, []).append(slot)
        alike: Counter[tuple[int, ...]] = Counter()
        here = {}
        for direction in sorted(changed):
            slots = tuple(changed[direction])
            here[kinds.setdefault((slots, alike[slots]), len(kinds))] = direction
            alike[slots] += 1
        numbers.append(here)
    return _LocalDirections(len(kinds), tuple(numbers))


def _partials_along(
    tape: Tape,
    loop: Map,
    outer: Mapping[InputSymbol, Sequence[Tangent]],
    local: _LocalDirections,
    forward_partials: ForwardPartials,
) -> list[Tangent]:
    """Return the tangents of a Map's results, in order, by a loop over the local directions of the elements. ``outer``
    holds the tangents of the outer references of each kernel input."""
    growth = _Growth(loop)
    seeds: dict[Ref | InputSymbol, dict[int, Ref]] = {}
    gathered = {symbol: column for symbol, column in outer.items() if symbol.block == "gather"}
    for symbol, column in gathered.items():
        for number in range(local.count):
            along = [
                tangent.get(here[number], ZERO) if number in here else ZERO
                for tangent, here in zip(column, local.numbers, strict=True)
            ]
            if any(ref != ZERO for ref in along):
                seeds.setdefault(symbol, {})[number] = growth.add_input(symbol, number, along)
    sums, _, stacked = loop.split_kernel(forward_partials(growth.kernel, growth.refs, seeds))
    rows = growth.rows(tape, [*sums, *stacked])
    totals: list[Tangent] = [{} for _ in sums]
    results: list[Tangent] = []
    for row, here in zip(rows, local.numbers, strict=True):
        tangents = [{here[number]: ref for number, ref in tangent.items() if number in here} for tangent in row]
        for total, tangent in zip(totals, tangents, strict=False):
            for direction, ref in tangent.items():
                total[direction] = tape.add(total.get(direction, ZERO), ref)
        results += tangents[len(sums) :]
    return list(map(_nonzero, [*totals, *results]))


def _combine(tape: Tape, total: Tangent, partials: Mapping[int, Ref], tangents: Sequence[Tangent]) -> Tangent:
    """Return the tangent total + sum_k partials[k] tangents[k], without zeros."""
    result = dict(total)
    for k, partial in partials.items():
        for direction, tangent in tangents[k].items():
            result[direction] = tape.add(result.get(direction, ZERO), tape.mul(partial, tangent))
    return _nonzero(result)


def _nonzero(tangent: Tangent) -> Tangent:
    return {direction: ref for direction, ref in tangent.items() if ref != ZERO}


def _carries_of_elements(tape: Tape, loop: Map) -> list[tuple[Ref, ...]]:
    """Return, for each carry, the value on entry to every element."""
    kernel = Tape()
    last = tuple(splice(kernel, loop.kernel, loop.last, {}))
    carries = tuple(kernel.input("carry", k) for k in range(len(last)))
    rows = add_map(tape, compact(replace(loop, kernel=kernel, sums=(), last=last, stacked=carries), ())).rows
    return [tuple(row[k] for row in rows) for k in range(len(carries))]


def _outer(loop: Map) -> dict[InputSymbol, tuple[Ref, ...]]:
    """Return the outer references of each kernel input; one for shared and carry, one per element for gather."""
    columns: dict[InputSymbol, tuple[Ref, ...]] = {
        InputSymbol("shared", k): (ref,) for k, ref in enumerate(loop.shared)
    }
    columns |= {InputSymbol("gather", k): slot for k, slot in enumerate(loop.gather)}
    return columns | {InputSymbol("carry", k): (ref,) for k, ref in enumerate(loop.initial)}


def _moving(loop: Map, moving: set[InputSymbol]) -> list[InputSymbol]:
    """Return the kernel inputs that depend on the inputs ``moving``: these inputs, and dependent carries, sorted."""
    reached = set(moving)
    sources = [loop.kernel.depends_on([ref]) for ref in loop.last]
    for _ in sources:
        reached |= {InputSymbol("carry", k) for k, source in enumerate(sources) if source & reached}
    return sorted(reached, key=_position)


def _position(symbol: InputSymbol) -> tuple[str, int]:
    return (symbol.block, symbol.index)


def _label(rows: Sequence[Mapping[int, Ref]], refs: Sequence[Ref]) -> list[Tangent]:
    """Label the rows of a flat sequence of references."""
    remaining = iter(refs)
    return [{label: next(remaining) for label in row} for row in rows]


def _flat(rows: Sequence[Mapping[int, Ref]]) -> tuple[Ref, ...]:
    """Return the references of all rows, as ``_label`` takes them."""
    return tuple(chain.from_iterable(row.values() for row in rows))


def _split(values: Sequence[T], first: int, second: int) -> tuple[list[T], list[T], list[T]]:
    return list(values[:first]), list(values[first : first + second]), list(values[first + second :])
