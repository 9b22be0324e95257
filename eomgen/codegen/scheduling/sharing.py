"""Sharing: stretches of operations that a function has several times, as for the corners of a car, become one C
function that is called with tables of places and numbers.

Recursions record the same operations for each body of a kind, so sequences of operation codes repeat on the tape, at
any distance. Repeats are found by ranks of windows (prefix doubling: Karp, Miller and Rosenberg 1972). Operands within
a stretch are locals; all others are workspace entries, whose places stand in tables of the calls, as numbers do.

Left and right sides differ by signs: signs of constants stand in the table of numbers, and an operand whose sign
differs is multiplied by a factor 1 or -1 from that table, which changes no bit of a product.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass, field
from eomgen.codegen.program import PART_LIMIT
from eomgen.codegen.scheduling.rerolling import READ, Unmatched, match_stores
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import ARITY, Ref, Tape, record

#: Least number of operations of a function in which stretches are looked for.
SHARE_FROM = PART_LIMIT
#: Time of a call, in operations.
CALL = 10
#: Least and largest number of operations of a stretch: an operand from a table takes twice as long as one from a fixed
#: place, and compilers take more than proportional time for long functions.
SHORTEST, LONGEST = 48, 1100
#: Numbers of occurrences that are looked for first: many short texts are shorter than few long ones.
_OCCURRENCES = (4, 3, 2)
#: Distances up to which an operand's distance is part of the operation's code.
_NEAR = 12
#: Places of operands in place of positions in a function: of values from outside, of constants, and of no operand.
_BEFORE, _OF_CONSTANT, _ABSENT = range(-1, -4, -1)
#: Block of the numbers of a stretch, besides ``READ``.
NUMBER = "number"

_CONST, _INPUT, _ADD, _SUB, _MUL, _DIV = Op.CONST, Op.INPUT, Op.ADD, Op.SUB, Op.MUL, Op.DIV
_COMMUTATIVE = frozenset({_ADD, _SUB, _MUL})
#: Operations that stay outside: results of loops, and tables, whose texts depend on more than operands.
_OUTSIDE = frozenset({Op.MAP, Op.CURVE})
_CIRCULAR = frozenset({Op.SIN, Op.COS})


@dataclass(frozen=True)
class SharedBody:
    """The operations of a stretch, with inputs in blocks ``READ`` and ``NUMBER``.

    Attributes
    ----------
    kernel, results : operations, and the results that are stored in the workspace, in order
    stores : number of an output and the value that is stored in a component, by outputs
    """

    kernel: Tape
    results: tuple[Ref, ...]
    stores: tuple[tuple[int, Ref], ...]


@dataclass(frozen=True)
class Occurrence:
    """An occurrence of a body.

    Attributes
    ----------
    body : the same object for all occurrences in a function
    nodes : operations that the call computes, in order
    reads : operations or inputs whose values the call reads, one per component of ``READ``
    results : operations whose values are stored in the workspace
    components : of the outputs, one for each of the body's ``stores``
    left : results that the caller copies to outputs: output number, component, sign, operation
    numbers : components of ``NUMBER``
    """

    body: SharedBody
    nodes: tuple[int, ...]
    reads: tuple[int, ...]
    results: tuple[int, ...]
    components: tuple[int, ...]
    left: tuple[Unmatched, ...]
    numbers: tuple[float, ...]


def find_stretches(tape: Tape, live: Sequence[int], outputs: Sequence[Sequence[Ref]]) -> list[Occurrence]:
    """Return the occurrences of shared stretches of a function, or none if these reduce the text too little.

    Parameters
    ----------
    live : operations of the function, in order
    outputs : references of the function's outputs
    """
    if len(live) < SHARE_FROM:
        return []
    search = _RepeatSearch(tape, live)
    groups = search.groups()
    if sum((len(starts) - 1) * length for length, starts in groups) < 0.2 * len(live):  # a fifth of the text
        return []
    return _Occurrences(tape, live, groups, outputs).stretches()


# -- repeats ----------------------------------------------------------------------------------------------------------


class _RepeatSearch:
    """Search of repeated windows in a sequence of operations, for shared stretches.

    Attributes
    ----------
    fixed : operations that no stretch may contain
    op, commutative : code of each operation, a difference as a sum, and whether operands may be exchanged
    places : position of each operand in the sequence, (operations, 3), or one of ``_BEFORE, _OF_CONSTANT, _ABSENT``
    codes : integers that are equal for operations of a kind; ``taken`` : operations in stretches found so far
    """

    def __init__(self, tape: Tape, live: Sequence[int]) -> None:
        """Collect operations and operands of the live nodes as arrays."""
        self.tape = tape
        self.live = live
        self.fixed = _outside(tape, live)
        nodes = np.array(live, dtype=np.int64)
        every = np.frombuffer(bytes(tape.op), dtype=np.uint8)
        self.op = np.where(every == _SUB, _ADD, every)[nodes]
        self.commutative = np.isin(self.op, [_ADD, _MUL])
        position = np.where(every == _CONST, _OF_CONSTANT, _BEFORE)
        position[nodes] = np.arange(len(live))
        arity = np.array(ARITY)[every[nodes]]
        self.places = np.full((len(live), 3), _ABSENT)
        for number, column in enumerate((tape.a, tape.b, tape.c)):
            rows = np.flatnonzero(arity > number)
            refs = np.array([column[live[row]] for row in rows.tolist()], dtype=np.int64)
            self.places[rows, number] = position[np.abs(refs)]
        self.codes = self._codes()
        self.taken = np.array([node in self.fixed for node in live], dtype=bool)

    def _codes(self) -> NDArray[np.int64]:
        """Return an integer for each operation, equal for the same operation with operands of equal kinds, without
        signs. Kinds of operands: the distance of a near operation of the sequence, another value, a constant, or
        none."""
        distance = np.arange(len(self.live))[:, None] - self.places
        near = (self.places >= 0) & (distance <= _NEAR)
        kinds = np.where(near, distance, np.minimum(self.places, _BEFORE))
        kinds = _sort_operands(kinds, self.commutative) - _ABSENT
        code = self.op.astype(np.int64)
        for column in kinds.T:
            code = code * (_NEAR - _ABSENT + 1) + column
        return np.unique(code, return_inverse=True)[1]

    def groups(self) -> list[tuple[int, list[int]]]:
        """Return (length, starts of the occurrences) of repeats, in order of the first start. Repeats do not overlap,
        and operands within a window are at the same positions in all occurrences. Repeats with many occurrences and
        long windows are taken first."""
        ranks = self._ranks()
        repeats: list[tuple[int, list[int]]] = []
        for least in _OCCURRENCES:
            for length in sorted(ranks, reverse=True):
                for starts in self._alike(ranks[length], length, least):
                    repeats += self._free_windows(length, starts, least)
        return sorted(repeats, key=lambda item: item[1][0])

    def _ranks(self) -> dict[int, NDArray[np.int64]]:
        """Return, for each window length (powers of two), an integer at each start that is equal for equal windows of
        codes. Windows are from ``SHORTEST`` to ``LONGEST`` operations long."""
        ranks: dict[int, NDArray[np.int64]] = {}
        rank, length, size = self.codes, 1, len(self.codes)
        while 2 * length <= min(LONGEST, size):
            later = np.full(size, -1, dtype=np.int64)
            later[: size - length] = rank[length:]
            _, rank = np.unique((rank + 1) * (size + 2) + later + 1, return_inverse=True)
            length *= 2
            if length >= SHORTEST:
                ranks[length] = rank
        return ranks

    def _alike(self, rank: NDArray[np.int64], length: int, least: int) -> list[list[int]]:
        """Return lists of the starts of equal windows without taken operations, each of ``least`` windows or more.
        ``rank`` has an integer for each start, equal for equal windows of this ``length``. Lists are in order."""
        before = np.concatenate(([0], np.cumsum(self.taken)))
        starts = np.flatnonzero(before[length:] == before[:-length])
        order = starts[np.argsort(rank[starts], kind="stable")]
        ends = np.concatenate(([0], np.flatnonzero(np.diff(rank[order])) + 1, [len(order)]))
        many = np.flatnonzero(np.diff(ends) >= least)
        return sorted((order[ends[k] : ends[k + 1]].tolist() for k in many), key=lambda group: group[0])

    def _free_windows(self, length: int, windows: Sequence[int], least: int) -> Iterator[tuple[int, list[int]]]:
        """Yield (length, starts) of the usable pieces of a repeat and mark the operations as taken. Overlapping and
        taken windows are dropped; the repeat ends here if fewer than ``least`` remain. The rest is made as long as
        possible, and cut so that operands within a piece agree; pieces shorter than ``SHORTEST`` are dropped."""
        starts: list[int] = []
        for start in windows:
            if (not starts or start >= starts[-1] + length) and not self.taken[start : start + length].any():
                starts.append(start)
        if len(starts) < least:
            return
        room = min([LONGEST, len(self.live) - starts[-1], *(after - start for start, after in pairwise(starts))])
        codes, taken = self.codes, self.taken
        while length < room and all(
            codes[start + length] == codes[starts[0] + length] and not taken[start + length] for start in starts
        ):
            length += 1
        begun = 0
        for end in [*self._cuts(length, starts), length]:
            if end - begun >= SHORTEST:
                for start in starts:
                    taken[start + begun : start + end] = True
                yield end - begun, [start + begun for start in starts]
            begun = end

    def _cuts(self, length: int, starts: Sequence[int]) -> list[int]:
        """Return the offsets at which windows of ``length`` at ``starts`` must be cut into pieces. After the cuts,
        operands within a piece are at the same positions in all occurrences; others are read from outside."""
        begins = np.array(starts)[:, None, None]
        places = self.places[begins[:, :, 0] + np.arange(length)]
        offsets = np.where(places < 0, places, np.maximum(places - begins, _BEFORE))
        commutative = self.commutative[starts[0] : starts[0] + length]
        ordered = _sort_operands(offsets, commutative)
        cuts, begun = [], 0
        for offset in np.flatnonzero((ordered != ordered[0]).any(axis=(0, 2))).tolist():
            within = offsets[:, offset]
            kinds = _sort_operands(np.where((within >= 0) & (within < begun), _BEFORE, within), commutative[offset])
            if (kinds != kinds[0]).any():
                cuts.append(offset)
                begun = offset
        return cuts


def _sort_operands(kinds: NDArray[np.int64], commutative: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return kinds of operands, in the last axis, in an order that is the same for both orders of a commutative
    operation."""
    return np.where(commutative[..., None], np.sort(kinds, axis=-1), kinds)


def _outside(tape: Tape, live: Sequence[int]) -> set[int]:
    """Return the operations that no shared stretch may contain: Maps, curves, and sines and cosines of one angle, which
    are computed in pairs."""
    angles: dict[int, list[int]] = {}
    for node in live:
        if tape.op[node] in _CIRCULAR:
            angles.setdefault(abs(tape.a[node]), []).append(node)
    paired = {node for nodes in angles.values() for node in nodes if len(nodes) > 1}
    return paired | {node for node in live if tape.op[node] in _OUTSIDE}


# -- occurrences -------------------------------------------------------------------------------------------------------


@dataclass
class _Group:
    """A repeat: the occurrences' nodes and operands, operand by operand in the order of the first occurrence."""

    nodes: list[list[int]]
    taken: list[list[list[Ref]]]  # by operation, operand and occurrence
    columns: dict[tuple[int, ...], int] = field(default_factory=dict)  # nodes read from outside -> component of READ
    exports: list[int] = field(default_factory=list)


class _Occurrences:
    """Makes the occurrences of shared stretches. ``groups`` of the constructor are (length, starts) of each repeat
    among the live operations. Attributes: ``owner`` (operation to group, occurrence, offset), ``stores`` (operation to
    output number, component and sign)."""

    def __init__(
        self, tape: Tape, live: Sequence[int], groups: Sequence[tuple[int, list[int]]], outputs: Sequence[Sequence[Ref]]
    ) -> None:
        """Number the operations of all occurrences, match operands, and find stores and exported values."""
        self.tape = tape
        self.live = live
        self.position = {node: index for index, node in enumerate(live)}
        self.owner: dict[int, tuple[int, int, int]] = {}  # node -> group, occurrence, offset
        self.home: dict[int, int] = {}  # node -> first node of the occurrence
        self.groups: list[_Group] = []
        for number, (length, starts) in enumerate(groups):
            nodes = [list(live[start : start + length]) for start in starts]
            for occurrence, members in enumerate(nodes):
                self.owner |= {node: (number, occurrence, offset) for offset, node in enumerate(members)}
                self.home |= dict.fromkeys(members, members[0])
            self.groups.append(_Group(nodes, []))
        for group in self.groups:
            self._pair(group)
        self.stores: dict[int, list[tuple[int, int, int]]] = {}  # node -> output number, component, sign
        for number, refs in enumerate(outputs):
            for component, ref in enumerate(refs):
                if abs(ref) in self.owner:
                    self.stores.setdefault(abs(ref), []).append((number, component, 1 if ref > 0 else -1))
        self._find_exports()

    def _pair(self, group: _Group) -> None:
        """Fill ``taken`` and ``columns`` of a group: the operands of all occurrences in the order of the first
        occurrence. Operands of commutative operations are exchanged if the kinds or earlier matches require this.
        ``columns`` numbers the operands that the occurrences read from outside."""
        tape = self.tape
        offsets = [{node: offset for offset, node in enumerate(members)} for members in group.nodes]

        def place(operand: int, occurrence: int) -> int:
            offset = offsets[occurrence].get(operand)
            if offset is None:
                return -2 if op[operand] is _CONST else -1
            return offset

        op = tape.op
        partner: list[dict[int, int]] = [{} for _ in group.nodes]
        for offset, first in enumerate(group.nodes[0]):
            terms = _terms(tape, first)
            met_first = [abs(ref) for ref in terms]
            taken = [[ref] for ref in terms]
            kinds = [place(node, 0) for node in met_first]
            for occurrence in range(1, len(group.nodes)):
                others = _terms(tape, group.nodes[occurrence][offset])
                known = partner[occurrence]
                if op[first] in _COMMUTATIVE:
                    x, y = abs(others[0]), abs(others[1])
                    turned = place(x, occurrence) != kinds[0] or place(y, occurrence) != kinds[1]
                    if not turned and kinds[0] == kinds[1]:
                        seen = known.get(met_first[0])
                        turned = seen != x and (seen == y or known.get(met_first[1]) == x)
                    if turned:
                        others.reverse()
                for column, node, ref in zip(taken, met_first, others, strict=True):
                    column.append(ref)
                    known[node] = abs(ref)
            group.taken.append(taken)
            for column, kind in zip(taken, kinds, strict=True):
                if kind == -1:
                    group.columns.setdefault(tuple(map(abs, column)), len(group.columns))

    def _find_exports(self) -> None:
        """Set ``exports`` of each group: offsets of values that operations outside of the same occurrence read."""
        tape, owner, home = self.tape, self.owner, self.home
        exported: list[set[int]] = [set() for _ in self.groups]
        for node in self.live:
            here = home.get(node, 0)
            for ref in tape.operands(node):
                if home.get(abs(ref), here) != here:
                    number, _, offset = owner[abs(ref)]
                    exported[number].add(offset)
        for group, offsets in zip(self.groups, exported, strict=True):
            group.exports = sorted(offsets)

    def stretches(self) -> list[Occurrence]:
        """Return all occurrences of all groups in the order of the tape."""
        order = sorted(
            (self.position[nodes[0]], number, occurrence)
            for number, group in enumerate(self.groups)
            for occurrence, nodes in enumerate(group.nodes)
        )
        made = [self._make_stretches(group) for group in self.groups]
        return [made[number][occurrence] for _, number, occurrence in order]

    def _make_stretches(self, group: _Group) -> list[Occurrence]:
        """Return the occurrences of a group, in order, which share one recorded body."""
        kernel, known, numbers = _record_body(self.tape, group)
        columns, left = match_stores(group.nodes, self.stores)
        stores = sorted(columns, key=lambda item: item[1])
        exports = sorted({*group.exports, *(offset for items in left for offset, _ in items)})
        body = SharedBody(
            kernel,
            tuple(known[offset] for offset in exports),
            tuple((output, known[offset] if sign > 0 else -known[offset]) for offset, output, sign, _ in stores),
        )
        return [
            Occurrence(
                body,
                tuple(nodes),
                tuple(column[k] for column in group.columns),
                tuple(nodes[offset] for offset in exports),
                tuple(components[k] for _, _, _, components in stores),
                tuple(item for _, item in left[k]),
                tuple(values[k] for values in numbers),
            )
            for k, nodes in enumerate(group.nodes)
        ]


def _terms(tape: Tape, node: int) -> list[Ref]:
    """Return the operands of an operation, a difference as a sum."""
    taken = list(tape.operands(node))
    if tape.op[node] is _SUB:
        taken[1] = -taken[1]
    return taken


def _record_body(tape: Tape, group: _Group) -> tuple[Tape, list[Ref], dict[tuple[float, ...], Ref]]:
    """Record the operations of the first occurrence of a group on a tape, and return the tape with the reference of
    each operation by offset. Numbers and signs that differ between occurrences become inputs of block ``NUMBER``; the
    last result has the inputs by the numbers, one for each occurrence."""
    kernel, known, numbers = Tape(), list[Ref](), dict[tuple[float, ...], Ref]()
    offsets = {node: offset for offset, node in enumerate(group.nodes[0])}

    def number_input(values: Sequence[float]) -> Ref:
        key = tuple(values)
        if key not in numbers:
            numbers[key] = kernel.input(NUMBER, len(numbers))
        return numbers[key]

    def operand(column: Sequence[Ref]) -> Ref:
        """Return one operand of all occurrences. Constants that differ, and factors 1 or -1, become inputs."""
        first = abs(column[0])
        signs = [1.0 if (ref > 0) == (column[0] > 0) else -1.0 for ref in column]
        if tape.op[first] is _CONST:
            values = [sign * tape.constants[tape.a[abs(ref)]] for ref, sign in zip(column, signs, strict=True)]
            return kernel.constant(values[0]) if len(set(values)) == 1 else number_input(values)
        outside = first not in offsets
        value = kernel.input(READ, group.columns[tuple(map(abs, column))]) if outside else known[offsets[first]]
        return kernel.mul(number_input(signs), value) if -1.0 in signs else value

    for node, columns in zip(group.nodes[0], group.taken, strict=True):
        taken = [operand(column) if column[0] > 0 else -operand(column) for column in columns]
        known.append(record(kernel, _ADD if tape.op[node] is _SUB else tape.op[node], taken))
    return kernel, known, numbers
