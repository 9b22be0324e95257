"""Map: a loop over elements with the same operations that stays a loop, on the tape, in its derivatives and in C.

Numbers of the elements may differ: they are columns.

A Map computes, for i = 0 .. count-1 in this order, with e, s, g, c the four input blocks of its kernel:

    e = (elements[0][i], elements[1][i], ...)     constants of element i, one column per index
    s = shared                                    references of the outer tape, the same for all elements
    g = (gather[0][i], gather[1][i], ...)         references of the outer tape, one per slot and element
    c = initial for i = 0, else the ``last`` results of element i - 1

    sum[k] += kernel(sums[k])      c_next[k] = kernel(last[k])      row[i][k] = kernel(stacked[k])

Results are numbered: first the sums, then the final carries, then the rows, element after element:

    sum k -> k      final carry k -> S + k      row[i][k] -> S + L + i * R + k      (S, L, R = number of sums, last,
    stacked)

The kernel is a Tape of its own with input blocks ``element``, ``shared``, ``gather`` and ``carry`` only, and without
Maps. Sums start from zero and are added in the order of the elements; C may add every n-th element first. A
loop and its unrolled form do the same operations, except that unrolling lets the tape fold the constants of the
elements, which may round differently.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple, TypeVar, cast

from eomgen.base.data import dataclass, replace
from eomgen.symbolic.operations import Counts, InputSymbol, Op
from eomgen.symbolic.tape import ZERO, Ref, Tape, record_node

T = TypeVar("T")
KERNEL_BLOCKS = ("element", "shared", "gather", "carry")
#: Operations as globals: looking a member up in an enumeration takes five times as long.
_CONST, _INPUT, _MAP = Op.CONST, Op.INPUT, Op.MAP


class MapResults(NamedTuple):
    """References of the results of a Map: sums, carries after the last element, and rows[element][k]."""

    sums: tuple[Ref, ...]
    last: tuple[Ref, ...]
    rows: tuple[tuple[Ref, ...], ...]

    @property
    def flat(self) -> list[Ref]:
        """All references in numerical order."""
        return [*self.sums, *self.last, *(ref for row in self.rows for ref in row)]


@dataclass(frozen=True, eq=False)
class Map:
    """A loop over ``count`` elements with the same operations; see the module for the exact meaning.

    Attributes
    ----------
    kernel : Tape
        Computation of one element.
    count : int
        Number of elements, at least 1.
    elements : tuple of columns
        ``elements[index][i]``: constant ``index`` of element i.
    shared : tuple of Ref
        Outer references of kernel inputs ``("shared", index)``.
    gather : tuple of slots
        ``gather[slot][i]``: outer reference of kernel input ``("gather", slot)`` for element i.
    initial : tuple of Ref
        Outer references of kernel inputs ``("carry", index)`` for the first element.
    sums, last, stacked : tuples of kernel references
        Results that are summed, that become the carry (as many as ``initial``), that are kept for each element.
    label : str
        Physical meaning, for a comment in the C; two Maps that differ in the label only are equal.
    """

    kernel: Tape
    count: int
    elements: tuple[tuple[float, ...], ...] = ()
    shared: tuple[Ref, ...] = ()
    gather: tuple[tuple[Ref, ...], ...] = ()
    initial: tuple[Ref, ...] = ()
    sums: tuple[Ref, ...] = ()
    last: tuple[Ref, ...] = ()
    stacked: tuple[Ref, ...] = ()
    label: str = ""

    def __post_init__(self) -> None:
        if self.kernel.maps:
            raise ValueError(
                "the kernel of a Map holds a Map itself; unroll the inner one or write two Maps one after the other"
            )

    @property
    def kernel_refs(self) -> tuple[Ref, ...]:
        """All kernel references that an element computes: sums, last, stacked."""
        return self.sums + self.last + self.stacked

    def split_kernel(self, values: Sequence[T]) -> tuple[list[T], list[T], list[T]]:
        """Split values that belong to ``kernel_refs`` into sums, last and stacked results."""
        first, second = len(self.sums), len(self.sums) + len(self.last)
        return list(values[:first]), list(values[first:second]), list(values[second:])

    @cached_property
    def references(self) -> tuple[Ref, ...]:
        """Distinct references of the outer tape that the Map reads, element after element."""
        elements = zip(*self.gather, strict=True)
        return tuple(dict.fromkeys([*self.shared, *self.initial, *(ref for element in elements for ref in element)]))

    @property
    def size(self) -> int:
        """Number of results."""
        return len(self.sums) + len(self.last) + self.count * len(self.stacked)

    def counts(self) -> Counts:
        """Return the operation counts of the whole loop: the kernel's times the number of elements, plus additions of
        the sums."""
        sums = Counts(additions=len(self.sums), statements=len(self.sums))
        of_element = self.kernel.counts(self.kernel_refs) + sums
        return Counts(*(self.count * number for number in vars(of_element).values()))

    def join(self, other: Map) -> Map | None:
        """Return one loop with the sums of both loops, this loop's first; None if both cannot be joined, or no
        operation is saved. Loops that only sum over the same references are joined; shared subexpressions are computed
        once."""
        if not isinstance(other, Map):  # a call of an external function
            return None
        alike = self.count == other.count and set(self.references) == set(other.references)
        if not alike or any((*loop.last, *loop.stacked) for loop in (self, other)):
            return None
        kernel = Tape()
        columns: dict[tuple[float, ...], Ref] = {}
        shared: dict[Ref, Ref] = {}
        slots: dict[tuple[Ref, ...], Ref] = {}
        sums: list[Ref] = []
        for loop in (self, other):
            bindings: dict[InputSymbol, Ref] = {}
            for index, column in enumerate(loop.elements):
                symbol = columns.setdefault(column, kernel.input("element", len(columns)))
                bindings[InputSymbol("element", index)] = symbol
            for index, ref in enumerate(loop.shared):
                bindings[InputSymbol("shared", index)] = shared.setdefault(ref, kernel.input("shared", len(shared)))
            for index, slot in enumerate(loop.gather):
                bindings[InputSymbol("gather", index)] = slots.setdefault(slot, kernel.input("gather", len(slots)))
            sums += splice(kernel, loop.kernel, loop.sums, bindings)
        separate_count = sum(loop.kernel.counts(loop.sums).statements for loop in (self, other))
        if kernel.counts(sums).statements == separate_count:
            return None
        labels = dict.fromkeys(label for loop in (self, other) for label in loop.label.split("; ") if label)
        both = "; ".join(labels)
        return Map(kernel, self.count, tuple(columns), tuple(shared), tuple(slots), sums=tuple(sums), label=both)

    def copy_to(self, target: Tape, there: Callable[[Ref], Ref], *, unrolled: bool) -> list[Ref]:
        """Record the same loop, or the unrolled operations, on another tape, and return the references of all results.
        ``there`` maps references of the outer tape to references of the other tape."""
        loop = replace(
            self,
            shared=tuple(map(there, self.shared)),
            gather=tuple(tuple(map(there, slot)) for slot in self.gather),
            initial=tuple(map(there, self.initial)),
        )
        return (unroll(target, loop) if unrolled else add_map(target, loop)).flat

    @staticmethod
    def together(loops: Mapping[int, Map]) -> list[tuple[Map, dict[int, int]]]:
        """Return the loops after joining as many numbered loops as possible, see ``join``. Each loop comes with a
        mapping: from the numbers of the replaced loops to the position of the loop's first result."""
        joined: list[tuple[Map, dict[int, int]]] = []
        for number, loop in loops.items():
            for position, (candidate, starts) in enumerate(joined):
                both = candidate.join(loop)
                if both is not None:
                    joined[position] = (both, {**starts, number: len(candidate.sums)})
                    break
            else:
                joined.append((loop, {number: 0}))
        return joined

    @cached_property
    def key(self) -> tuple[object, ...]:
        """Key that is equal for equal loops, independent of the order of recording of the kernels."""
        compact = Tape()
        refs = splice(compact, self.kernel, self.kernel_refs, {})
        nodes = tuple(zip(compact.op, compact.a, compact.b, compact.c, strict=True))
        return (
            nodes,
            tuple(compact.constants[1:]),
            tuple(compact.inputs),
            *map(tuple, self.split_kernel(refs)),
            self.count,
            self.elements,
            self.shared,
            self.gather,
            self.initial,
        )


def add_map(tape: Tape, loop: Map) -> MapResults:
    """Put a Map on a tape and return the references to the results; equal Maps are put there only once.

    Results that are a constant of the kernel come back as constants, so zeros by structure stay visible.
    """
    constants = [loop.kernel.value(ref) for ref in loop.kernel_refs]
    number = next((n for n, known in enumerate(tape.maps) if cast("Map", known).key == loop.key), len(tape.maps))
    if number == len(tape.maps) and None in constants:
        tape.maps.append(loop)
    sums, last, stacked = loop.split_kernel(constants)
    start = len(sums) + len(last)

    def result(position: int, value: float | None) -> Ref:
        return tape.map_result(number, position) if value is None else tape.constant(value)

    return MapResults(
        tuple(result(k, None if value is None else loop.count * value) for k, value in enumerate(sums)),
        tuple(result(len(sums) + k, value) for k, value in enumerate(last)),
        tuple(
            tuple(result(start + i * len(stacked) + k, value) for k, value in enumerate(stacked))
            for i in range(loop.count)
        ),
    )


def unroll(tape: Tape, loop: Map) -> MapResults:
    """Record the operations of a Map on the outer tape, element after element, and return the results."""
    sums, carry = [ZERO] * len(loop.sums), list(loop.initial)
    rows: list[tuple[Ref, ...]] = []
    for i in range(loop.count):
        blocks = {
            "element": [tape.constant(column[i]) for column in loop.elements],
            "shared": loop.shared,
            "gather": [slot[i] for slot in loop.gather],
            "carry": carry,
        }
        bindings = {InputSymbol(name, index): ref for name, refs in blocks.items() for index, ref in enumerate(refs)}
        terms, carry, row = loop.split_kernel(splice(tape, loop.kernel, loop.kernel_refs, bindings))
        sums = [tape.add(total, term) for total, term in zip(sums, terms, strict=True)]
        rows.append(tuple(row))
    return MapResults(tuple(sums), tuple(carry), tuple(rows))


def splice(
    target: Tape,
    source: Tape,
    refs: Sequence[Ref],
    bindings: Mapping[InputSymbol, Ref],
    *,
    unrolled: bool = False,
    known: Mapping[int, Ref] | None = None,
) -> list[Ref]:
    """Copy references, with all operations on which the references depend, from one tape to another.

    Parameters
    ----------
    target : tape of the copies
    source : tape of the references
    refs : references on the source tape
    bindings : references on the target tape in place of inputs of the source; other inputs stay inputs
    unrolled : whether Maps are recorded element by element in place of loops
    known : nodes of the source with references on the target tape

    Returns
    -------
    copies of ``refs``, references on the target tape
    """
    copy: dict[int, Ref] = {}
    of_maps: dict[int, list[Ref]] = {}

    def there(ref: Ref) -> Ref:
        copied = copy[abs(ref)]
        return copied if ref > 0 or copied == ZERO else -copied

    for node in source.live(refs):
        op = source.op[node]
        if known and node in known:
            copy[node] = known[node]
        elif op is _CONST:
            copy[node] = target.copied_constant(source, node)
        elif op is _INPUT:
            symbol = source.inputs[source.a[node]]
            bound = bindings.get(symbol)
            copy[node] = target.input(symbol.block, symbol.index) if bound is None else bound
        elif op is _MAP:
            number = source.a[node]
            if number not in of_maps:
                of_maps[number] = cast("Map", source.maps[number]).copy_to(target, there, unrolled=unrolled)
            copy[node] = of_maps[number][source.b[node]]
        else:
            copy[node] = record_node(target, source, node, [there(ref) for ref in source.operands(node)])
    target.converged |= {abs(copy[node]) for node in source.converged.intersection(copy)}
    target.lengths |= {abs(copy[node]) for node in source.lengths.intersection(copy)}
    return [there(ref) for ref in refs]
