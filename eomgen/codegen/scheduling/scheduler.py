"""Scheduling of one function: statement order, fused sine and cosine, nested expressions, and values that later parts
read.

Compilers need time that grows faster than the length of a function (72 600 statements: over 180 s whole, 10 s in
chunks), so a long function becomes parts of nearly equal length; a value that a later part needs waits in a slot of a
workspace. Repeats in a long function become loops first.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain

from eomgen.base.data import dataclass, field, replace
from eomgen.codegen.program import NEST_LIMIT, PART_LIMIT, Addition, Expression, FunctionPart, ProgramShared, Statement
from eomgen.codegen.scheduling.accumulation import FEW_RUNS, accumulate_maps
from eomgen.codegen.scheduling.bodies import Bodies, RunLoop
from eomgen.codegen.scheduling.few_live import split_by_live_values
from eomgen.codegen.scheduling.plan import PartPlan, Plan
from eomgen.codegen.scheduling.rerolling import (
    READ,
    UNINDEXED,
    RerolledLoop,
    Unmatched,
    copies,
    find_loops,
    is_circular,
    loop_iteration,
    rule,
    runs,
)
from eomgen.codegen.scheduling.roles import Roles
from eomgen.codegen.scheduling.sharing import NUMBER, Occurrence
from eomgen.codegen.scheduling.stretches import repeat_statements
from eomgen.symbolic.external import Call
from eomgen.symbolic.map import Map
from eomgen.symbolic.operations import LEAVES, Op
from eomgen.symbolic.tape import ZERO, Ref, Tape
from eomgen.system.system import WHOLE, Sample

_CONST, _INPUT, _MAP = Op.CONST, Op.INPUT, Op.MAP
_NAMES = {op: op.name for op in Op}
#: Least number of occurrences of a value in an output for which a loop stores the value.
REPEATED_FROM = 64
#: Values stored in one loop, if a function has loops, from this many on.
COPIED_FROM = 8
#: Functions with more operations are searched for repetitions, and written with loops if the loops reduce the number of
#: operations below this part.
REROLL_FROM = PART_LIMIT
REROLLED_PART = 0.6


@dataclass(frozen=True)
class Schedule:
    """Parts of a function, size of the workspace, and number of operations (a loop's kernel counts once)."""

    parts: tuple[FunctionPart, ...]
    workspace: int
    operations: int


@dataclass
class OpenPart:
    """The part of a function that is being written: the statements so far, the names of input blocks that these read,
    and the numbers of the outputs that they fill. ``label`` is the last printed label."""

    statements: list[Statement] = field(default_factory=list)
    inputs: set[str] = field(default_factory=set)
    outputs: set[int] = field(default_factory=set)
    workspace: bool = False
    label: str | None = None
    names: list[tuple[int, str]] = field(default_factory=list)
    loaded: dict[int, int] = field(default_factory=dict)  # named values of earlier parts -> local values


class Scheduler:
    """Writes a function, part after part, and operation by operation in the order of the plan."""

    def __init__(
        self,
        plan: Plan,
        outputs: Sequence[Sequence[Ref]],
        additions: Mapping[int, tuple[Addition, ...]],
        input_order: Sequence[str],
        nest_limit: int,
        bodies: Bodies,
    ) -> None:
        """Begin without statements. ``plan`` and ``outputs`` describe the function; ``additions`` are of the loops of
        Maps to outputs, by number of the Map; ``input_order`` is the order of input blocks in arguments, ``nest_limit``
        the largest number of operations in a statement, and ``bodies`` are of the Program, to be extended."""
        self.plan = plan
        self.tape = plan.tape
        self.roles = Roles(plan.tape)
        self.outputs = outputs
        self.additions = additions
        self.input_order = input_order
        self.nest_limit = nest_limit
        self.bodies = bodies
        self.expressions: dict[int, Expression] = {}  # of nodes that have been written, or wait to be nested
        self.waiting: dict[int, int] = {}  # node -> operations in the expression
        self.locals = 0
        self.slots = 0
        self.kept: dict[int, int] = {}  # node -> slot read by loops, besides the local value
        self.label = ""
        self.open = OpenPart()
        self.circular: set[int] = set()  # sines and cosines that were taken beforehand
        self.crossed: dict[int, int] = {}  # node of an earlier part -> slot
        self.free: list[int] = []  # slots of values after their last read
        self.step = 0  # position in the order of the plan
        self.last_reads = plan.last_reads() if plan.stretches else {}
        self.ends: dict[int, list[int]] = {}  # position after which slots are free
        self.texts: dict[int, int] = {}  # id of the body of a stretch -> number of its text

    # -- expressions ----------------------------------------------------------------------------------------------

    def leaf(self, ref: Ref) -> Expression:
        """Return the expression that reads the value of a reference: a constant, an input, a local value or a workspace
        slot. A negative reference gives the negative of the value. Notes in the open part which input blocks and
        whether the workspace are read."""
        node = abs(ref)
        code = self.tape.op[node]
        if code is _CONST:
            value = self.tape.constants[self.tape.a[node]]
            return ("K", value if ref > 0 else -value)
        if code is _INPUT:
            symbol = self.tape.inputs[self.tape.a[node]]
            self.open.inputs.add(symbol.block)
            expression: Expression = ("in", symbol.block, symbol.index)
        else:
            expression = self.expressions[node]
            if isinstance(expression, int):
                return expression if ref > 0 else -expression
            if expression[0] == "w":
                self.open.workspace = True
        return expression if ref > 0 else ("neg", expression)

    def _take(self, refs: Sequence[Ref]) -> tuple[list[Expression], int]:
        """Return the expressions of the operands ``refs``, and 1 plus the number of operations nested in these
        expressions. Operands that wait to be nested are nested in order of length up to ``nest_limit``; the others are
        written as statements."""
        waiting = self.waiting
        nested = [abs(ref) for ref in refs if abs(ref) in waiting]
        if len(nested) > 1:
            nested.sort(key=waiting.__getitem__)  # the shortest first, so that most fit
        total = 1
        for node in nested:
            if total + waiting[node] <= self.nest_limit:
                total += waiting.pop(node)
            else:
                self._write(node)
        return [self._operand(ref) for ref in refs], total

    def _operand(self, ref: Ref) -> Expression:
        """Return the expression of an operand. A value of an earlier part that has a name in mechanics is first loaded
        into a local value of this name, once per part."""
        node, loaded = abs(ref), self.open.loaded
        if node not in self.crossed or isinstance(self.expressions[node], int) or not self.roles.names[node]:
            return self.leaf(ref)
        if node not in loaded:
            self._emit("let", self._local(node), self.leaf(node))
            loaded[node] = self.locals
        return loaded[node] if ref > 0 else -loaded[node]

    def _write(self, node: int) -> None:
        """Give a waiting node a separate statement."""
        del self.waiting[node]
        self._emit("let", self._local(node), self.expressions[node])
        self.expressions[node] = self.locals

    def _local(self, node: int) -> int:
        """Return the number of a new local value, named after the operation."""
        self.locals += 1
        if name := self.roles.name(node, self.label):
            self.open.names.append((self.locals, name))
        return self.locals

    def _emit(self, kind: str, *data: object) -> None:
        if kind != "fill" and self.open.label != self.label:
            self.open.label = self.label
            if self.label:
                self.open.statements.append(Statement("label", (self.label,)))
        self.open.statements.append(Statement(kind, data))

    def _emit_loops(
        self, count: int, statements: Sequence[Statement], read: Sequence[Expression], targets: Sequence[Expression]
    ) -> None:
        for data in repeat_statements(count, statements, read, targets):
            self._emit("repeat", *data)

    def reserve(self, count: int) -> int:
        """Return the first of ``count`` new slots of the workspace."""
        self.slots += count
        return self.slots - count

    def _store(self, node: int) -> None:
        """Save the value of a node in the workspace if later parts read the value, and write the value to components of
        outputs. A value that occurs at least ``REPEATED_FROM`` times in an output is written by a loop."""
        if self.plan.last_part[node] > self.plan.part_of[node]:
            self.crossed[node] = self.free.pop() if self.free else self.reserve(1)
            self.open.workspace = True
            self._emit("save", self.crossed[node], self.expressions[node])
        stores = self.plan.stores.get(node, ())
        if len(stores) >= REPEATED_FROM:
            stores = self._store_repeated(node, stores)
        for number, component, sign in stores:
            self.open.outputs.add(number)
            self._emit("out", number, component, self.leaf(sign * node))

    def _store_repeated(self, node: int, stores: Sequence[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
        """Write a value by one loop for each (output, sign) with at least ``REPEATED_FROM`` components. ``stores`` and
        the result are (output number, component, sign); returned are the stores that no loop has written."""
        groups: dict[tuple[int, int], list[int]] = {}
        for number, component, sign in stores:
            groups.setdefault((number, sign), []).append(component)
        many = {key: components for key, components in groups.items() if len(components) >= REPEATED_FROM}
        stored = Statement("out", (0, 0, ("in", READ, 0)))
        for (number, sign), components in many.items():
            self.open.outputs.add(number)
            read = (self.leaf(sign * node),)
            self._emit_loops(len(components), (stored,), read, (("row", number, *rule(components)),))
        return [(number, component, sign) for number, component, sign in stores if (number, sign) not in many]

    # -- loops: rerolled loops, shared stretches, and sines and cosines of inputs -------------------------------------

    def _circular(self) -> None:
        """Write loops that compute the sines and cosines of all input angles of the function into the workspace. The
        sines lie in adjacent slots, then the cosines. Sines and cosines that are outputs are stored. Blocks that loops
        cannot index get one statement for each angle."""
        tape = self.tape
        nodes = [node for node in self.plan.live if is_circular(tape, node)]
        angles = sorted({abs(tape.a[node]) for node in nodes}, key=self._symbol)
        slot = {leaf: self.slots + number for number, leaf in enumerate(angles)}
        places: dict[str, list[tuple[int, int]]] = {}
        for leaf in angles:
            block, index = self._symbol(leaf)
            places.setdefault(block, []).append((slot[leaf], index))
        for block, positions in places.items():
            self.open.inputs.add(block)
            longest = 1 if block in UNINDEXED else len(positions)
            for to, start, _, step, length in chain.from_iterable(
                runs(positions[k : k + longest], shortest=1) for k in range(0, len(positions), longest)
            ):
                self._emit("circular", to, to + len(angles), block, start, step, length)
        self.slots += 2 * len(angles)
        self.open.workspace = self.open.workspace or bool(angles)
        for node in nodes:
            self.circular.add(node)
            self.expressions[node] = ("w", slot[abs(tape.a[node])] + (len(angles) if tape.op[node] is Op.COS else 0))
        self._store_all((*store, node) for node in nodes for store in self.plan.stores.get(node, ()))

    def _symbol(self, leaf: int) -> tuple[str, int]:
        symbol = self.tape.inputs[self.tape.a[leaf]]
        return symbol.block, symbol.index

    def slot(self, node: int) -> int:
        """Return the workspace index of the value of a node; the value is saved there at the first call. For a value
        kept as a negative, the index of the value without the minus is returned."""
        expression = self.expressions.get(node)
        if isinstance(expression, tuple) and expression[0] == "neg":
            expression = expression[1]
        if isinstance(expression, tuple) and expression[0] == "w":
            return int(expression[1])
        if node in self.crossed:
            return self.crossed[node]
        if node not in self.kept:
            self.kept[node] = self._slot_of(node)
            self._emit("save", self.kept[node], self.leaf(node))
        return self.kept[node]

    def _slot_of(self, node: int) -> int:
        """Return a slot for a value, which is free after the last read of the value if the function has stretches."""
        if not self.plan.stretches:
            return self.reserve(1)
        slot = self.free.pop() if self.free else self.reserve(1)
        self.ends.setdefault(max(self.last_reads.get(node, 0), self.step), []).append(slot)
        return slot

    def _share(self, group: Sequence[Occurrence]) -> None:
        """Write the call of shared stretches that are computed together, and note the places of the results: slots of
        the workspace. Results that go to outputs in only one occurrence (``left``) are stored after the call."""
        number, stores = self._text_of(group), group[0].body.stores
        read = [[self.slot(node) for node in stretch.reads] for stretch in group]
        given = [[self._slot_of(node) for node in stretch.results] for stretch in group]
        rows = [[*first, *then, *stretch.components] for first, then, stretch in zip(read, given, group, strict=True)]
        self.open.workspace = True
        outputs = tuple(dict.fromkeys(output for output, _ in stores))
        self.open.outputs |= set(outputs)
        numbers = chain.from_iterable(stretch.numbers for stretch in group)
        self._emit("share", number, tuple(chain.from_iterable(rows)), outputs, tuple(numbers))
        for stretch, slots in zip(group, given, strict=True):
            self.expressions |= {node: ("w", slot) for node, slot in zip(stretch.results, slots, strict=True)}
        for stretch in group:
            self._store_all(stretch.left)

    def _text_of(self, group: Sequence[Occurrence]) -> int:
        """Return the number of the statements of a group among the shared texts of the Program, which equal statements
        share. The body is scheduled at the first occurrence; each occurrence counts and adds a label."""
        stretch, body, shared = group[0], group[0].body, self.bodies.shared
        assert shared is not None  # a function without shared texts has no stretches
        if id(body) not in self.texts:
            outputs = dict.fromkeys(output for output, _ in body.stores)
            stored = [[ref for output, ref in body.stores if output == number] for number in outputs]
            results = [body.results, *stored]
            made = schedule(body.kernel, results, (READ, NUMBER), part_limit=10**9, fill=False, reroll=False)
            statements = made.parts[0].statements
            sizes = len(stretch.reads), len(stretch.numbers), tuple(map(len, results))
            known = next((k for k, text in enumerate(shared) if text.statements == statements), len(shared))
            if known == len(shared):
                shared.append(ProgramShared((), 0, *sizes, made.operations, statements))
            self.texts[id(body)] = known
        number = self.texts[id(body)]
        text = shared[number]
        labels = dict.fromkeys((*text.labels, *(self.tape.label(stretch.nodes[0]) for stretch in group)))
        shared[number] = replace(text, calls=text.calls + len(group), labels=tuple(labels))
        return number

    def _repeat(self, loop: RerolledLoop) -> None:
        """Write a rerolled loop as ``repeat`` statements; results that other operations read stay in the workspace, by
        iteration. Values that not all iterations store alike are written to outputs after the loop."""
        iteration = loop_iteration(self.tape, loop, self.plan.read_outside, self.plan.stores, self)
        for k, nodes in enumerate(loop.iterations):
            for number, position in enumerate(iteration.exports):
                self.expressions[nodes[position]] = ("w", iteration.first + k * len(iteration.exports) + number)
        for expression in iteration.read:
            plain = expression[1] if isinstance(expression, tuple) and expression[0] == "neg" else expression
            if isinstance(plain, tuple) and plain[0] == "row" and plain[1] != "w":
                self.open.inputs.add(plain[1])
        self.open.outputs |= {item[1] for item in iteration.given if isinstance(item, tuple) and item[1] != "w"}
        self.open.workspace = True
        made = schedule(iteration.kernel, [iteration.results], (READ,), part_limit=10**9, fill=False, reroll=False)
        self._emit_loops(len(loop.iterations), made.parts[0].statements, iteration.read, iteration.given)
        self._store_all(iteration.unmatched)

    def _store_all(self, stores: Iterable[Unmatched]) -> None:
        """Write existing values to outputs, many values of one output and sign by a loop. ``stores`` are (output
        number, component, sign, node)."""
        groups: dict[tuple[int, int], list[tuple[int, Ref]]] = {}
        for number, component, sign, node in stores:
            groups.setdefault((number, sign), []).append((component, sign * node))
        for (number, _), items in groups.items():
            if not self._copy(number, items):
                for component, ref in items:
                    self.open.outputs.add(number)
                    self._emit("out", number, component, self.leaf(ref))

    def _copy(self, number: int, items: Sequence[tuple[int, Ref]]) -> bool:
        """Write existing values to an output by one loop and return True; return False without writing if no loop fits.
        ``items`` are (component, reference) of output ``number``. No loop fits fewer than ``COPIED_FROM`` values, or
        values of different kinds (see ``rerolling.copies``)."""
        if len(items) < COPIED_FROM:
            return False
        data = copies([self.leaf(ref) for _, ref in items], number, [component for component, _ in items])
        if data is None:
            return False
        self.open.outputs.add(number)
        self._emit_loops(*data)
        return True

    # -- operations one by one ----------------------------------------------------------------------------------------

    def _node(self, node: int) -> None:
        """Write the statements of an operation, or keep the expression to be nested in the only operation that reads
        the value. An operation that stands for a Map, a rerolled loop, a shared stretch or a pair of sine and cosine
        writes all of that."""
        tape, plan = self.tape, self.plan
        code = tape.op[node]
        if code is _MAP:
            self._map(node)
        elif node in plan.loops:
            self._repeat(plan.loops[node])
        elif node in plan.stretches:
            self._share(plan.stretches[node])
        elif node in self.circular:
            return
        elif node in plan.members:
            if node not in self.expressions:
                self._sine_and_cosine(node)
        else:
            taken, total = self._take(tape.operands(node))
            expression = (_NAMES[code], *taken)
            if code is Op.CURVE:
                curve, derivative = tape.curves[tape.b[node]]
                number = self.bodies.curves.setdefault(id(curve), len(self.bodies.curves))
                expression = ("CURVE", taken[0], number, derivative)
            if plan.uses[node] > 1 or plan.last_part[node] > plan.part_of[node]:
                self._emit("let", self._local(node), expression)
                self.expressions[node] = self.locals
                self._store(node)
            elif node in plan.stores:
                number, component, sign = plan.stores[node][0]
                self.open.outputs.add(number)
                self._emit("out", number, component, expression if sign > 0 else ("neg", expression))
            else:
                self.expressions[node] = expression
                self.waiting[node] = total

    def _sine_and_cosine(self, node: int) -> None:
        sine, cosine = self._sine_then_cosine(node)
        (argument,), _ = self._take((self.tape.a[sine],))
        self.expressions[sine], self.expressions[cosine] = self._local(sine), self._local(cosine)
        self._emit("sincos", self.locals - 1, self.locals, argument)
        self._store(sine)
        self._store(cosine)

    def _sine_then_cosine(self, node: int) -> tuple[int, int]:
        (member,) = self.plan.members[node]
        return (node, member) if self.tape.op[node] is Op.SIN else (member, node)

    def _angles(self, nodes: Sequence[int]) -> None:
        """Write one statement that computes sine and cosine of all angles of a part that are inputs, which compilers
        vectorise. Fewer than three angles are left out; both sine and cosine must be needed."""
        tape = self.tape
        leaders = [
            node
            for node in nodes
            if tape.op[node] in (Op.SIN, Op.COS) and node in self.plan.members and tape.op[abs(tape.a[node])] is _INPUT
        ]
        if len(leaders) < 3:
            return
        angles = []
        for node in leaders:
            sine, cosine = self._sine_then_cosine(node)
            self.expressions[sine], self.expressions[cosine] = self._local(sine), self._local(cosine)
            angles.append((self.locals - 1, self.locals, self.leaf(tape.a[sine])))
        self._emit("angles", tuple(angles))
        for node in leaders:
            for member in (node, *self.plan.members[node]):
                self._store(member)

    def _map(self, node: int) -> None:
        """Write the statements of a Map by its kind, for all its results at once.

        A loop or an external function copies the gathered values into the workspace, is called, and leaves the results
        there; results that are outputs are stored. Loops that add to outputs are passed on to ``_add``.
        ``node`` is one result of the Map.
        """
        tape = self.tape
        loop = self.plan.maps[tape.a[node]][0]
        if isinstance(loop, Call):
            kind, number, operands, head, width = "call", self._call_number(loop), loop.operands, 0, loop.size
        elif tape.a[node] in self.additions:
            self._add(node, loop, self.additions[tape.a[node]])
            return
        else:
            kind, number, operands = "loop", self._loop_number(RunLoop(loop)), loop.references
            head, width = len(loop.sums) + len(loop.last), max(1, len(loop.stacked))
        first = self.reserve(len(operands) + loop.size)
        results = first + len(operands)
        self.open.workspace = True
        self._gather(operands, first)
        self._emit(kind, number, first, results)
        members = self.plan.group(node)
        for result in members:
            self.expressions[result] = ("w", results + self._place(result))
        self._spread(members, head, width)

    def _call_number(self, call: Call) -> int:
        """Return the number of an external function in the Program; calls of one routine share it."""
        calls = self.bodies.calls
        number = next((k for k, known in enumerate(calls) if known.routine == call.routine), len(calls))
        if number == len(calls):
            calls.append(call)
        return number

    def _add(self, node: int, loop: Map, additions: Sequence[Addition]) -> None:
        """Write the run of a loop whose elements add rows to outputs, after all other operations of the function."""
        first = self.reserve(len(loop.references))
        self.open.workspace = True
        self.label = self.tape.label(node)
        self._gather(loop.references, first)
        outputs = sorted({item.output for item in additions})
        places = tuple(replace(item, output=outputs.index(item.output)) for item in additions)
        self.open.outputs |= set(outputs)
        self._emit("add", self._loop_number(RunLoop(loop, places)), first, tuple(outputs))

    def _loop_number(self, run: RunLoop) -> int:
        """Return the number of a loop in the Program; equal loops are one."""
        for number, known in enumerate(self.bodies.loops):
            same = known.loop is run.loop or known.loop.key == run.loop.key
            if same and known.additions == run.additions:
                return number
        self.bodies.loops.append(run)
        return len(self.bodies.loops) - 1

    def _place(self, result: int) -> int:
        """Return the place of a Map's result among the results of the loop."""
        return self.plan.maps[self.tape.a[result]][1] + self.tape.b[result]

    def _gather(self, refs: Sequence[Ref], slot: int) -> None:
        """Write the copies of the values of ``refs`` into consecutive workspace slots from ``slot`` on. Equally spaced
        inputs and workspace values are copied by loops, other values one by one."""
        sources: dict[tuple[str, bool], list[tuple[int, int]]] = {}
        for position, ref in enumerate(refs, slot):
            node = abs(ref)
            expression = self.leaf(ref)
            if node in self.waiting:
                del self.waiting[node]
            operand, is_minus = expression, False
            if isinstance(operand, tuple) and operand[0] == "neg":
                operand, is_minus = operand[1], True
            if isinstance(operand, tuple) and operand[0] == "in" and operand[1] not in UNINDEXED:
                sources.setdefault((operand[1], is_minus), []).append((position, operand[2]))
            elif isinstance(operand, tuple) and operand[0] == "w":
                sources.setdefault(("w", is_minus), []).append((position, operand[1]))
            else:
                self._emit("save", position, expression)
        for (block, is_minus), places in sources.items():
            self._copy_to_workspace(block, places, is_minus=is_minus)

    def _copy_to_workspace(self, block: str, places: Sequence[tuple[int, int]], *, is_minus: bool) -> None:
        """Write copies of components of an input block, or of the workspace (``"w"``), to workspace slots. ``places``
        are (target slot, source component); ``is_minus`` copies the negatives. Many copies become loops."""
        values: list[Expression] = [("w", start) if block == "w" else ("in", block, start) for _, start in places]
        if is_minus:
            values = [("neg", value) for value in values]
        stretches = list(runs(places))
        if is_minus or len(stretches) > FEW_RUNS:
            if len(places) >= COPIED_FROM:
                self._emit_loops(*copies(values, "w", [to for to, _ in places]))
                return
            stretches = [(to, start, 1, 1, 1) for to, start in places]
        of_place = dict(zip(places, values, strict=True))
        for to, start, to_step, step, length in stretches:
            if length == 1:
                self._emit("save", to, of_place[to, start])
            else:
                self._emit("gather", to, to_step, block, start, step, length)

    def _spread(self, members: Sequence[int], head: int, width: int) -> None:
        """Write the results of a Map or an external call that are outputs to these outputs, equally spaced ones by
        loops. ``members`` are the nodes of the results. The first ``head`` results belong to no element; after these
        each element has ``width`` results, and results in the same column are written together."""
        groups: dict[tuple[int, int, int], list[tuple[int, int]]] = {}
        for node in members:
            result = self._place(node)
            column = -1 - result if result < head else (result - head) % width
            for number, component, sign in self.plan.stores.get(node, ()):
                expression = self.expressions[node]
                if isinstance(expression, tuple):
                    groups.setdefault((number, sign, column), []).append((component, expression[1]))
        for (number, sign, _), places in groups.items():
            self.open.outputs.add(number)
            for to, start, to_step, step, length in runs(places):
                if length == 1:
                    self._emit("out", number, to, ("w", start) if sign > 0 else ("neg", ("w", start)))
                else:
                    self._emit("spread", number, to, to_step, start, step, length, sign)

    def _leaves_out(self, may_fill: bool) -> None:
        """Write the components of outputs that are constants or inputs, before all operations. An output with
        more than ``COPIED_FROM`` zeros, if these are the majority, is filled with zeros by a loop if ``may_fill``."""
        for number, refs in enumerate(self.outputs):
            zeros = refs.count(ZERO)
            fill = may_fill and zeros > COPIED_FROM and 2 * zeros > len(refs)
            if fill:
                self.open.outputs.add(number)
                self._emit("fill", number, len(refs))
            left = [
                (component, ref)
                for component, ref in enumerate(refs)
                if not (fill and ref == ZERO) and self.tape.op[abs(ref)] in LEAVES
            ]
            if self.plan.loops or len(left) >= REPEATED_FROM:
                numbers = [item for item in left if self.tape.number(item[1]) is not None]
                if self._copy(number, numbers):
                    left = [item for item in left if self.tape.number(item[1]) is None]
            for component, ref in self._without_inputs(number, left):
                self.open.outputs.add(number)
                self._emit("out", number, component, self.leaf(ref))

    def _without_inputs(self, number: int, items: list[tuple[int, Ref]]) -> list[tuple[int, Ref]]:
        """Write the components of output ``number`` that copy inputs by loops if they are many, and return the other
        items. ``items`` are (component, reference). A loop is written for each input block and sign with
        ``REPEATED_FROM`` components."""
        groups: dict[tuple[str, bool], list[tuple[int, Ref]]] = {}
        for component, ref in items:
            symbol = self.tape.symbol(ref)
            if symbol is not None and symbol.block not in UNINDEXED:
                groups.setdefault((symbol.block, ref < 0), []).append((component, ref))
        copied = {
            component
            for group in groups.values()
            if len(group) >= REPEATED_FROM and self._copy(number, group)
            for component, _ in group
        }
        return [item for item in items if item[0] not in copied]

    def run(self, may_fill: bool) -> Schedule:
        """Write all parts of the function and return the Schedule. Slots of the workspace are used again after the last
        part that reads the value. ``may_fill``: whether outputs of mostly zeros are filled by a loop first."""
        plan = self.plan
        parts: list[FunctionPart] = []
        for number in range(plan.parts):
            self.open = OpenPart()
            if number == 0:
                self._leaves_out(may_fill)
            if not plan.loops:
                self._angles(plan.by_part[number] if plan.angles_first else ())
            elif number == 0:
                self._circular()
            begin = end = 0
            for node in plan.by_part[number]:
                if not begin <= node < end:
                    begin, end, self.label = self.tape.label_range(node)
                self._node(node)
                self.free += self.ends.pop(self.step, ())
                self.step += 1
            for node in [node for node in self.crossed if plan.last_part[node] <= number]:
                self.free.append(self.crossed.pop(node))
            for node, kept in (self.kept | self.crossed).items():
                self.expressions[node] = ("w", kept)
            length = sum(plan.weight(node) for node in plan.by_part[number])
            inputs = tuple(block for block in self.input_order if block in self.open.inputs)
            outputs = tuple(sorted(self.open.outputs))
            statements, names = tuple(self.open.statements), tuple(self.open.names)
            parts.append(FunctionPart(statements, inputs, outputs, self.open.workspace, length, names))
        return Schedule(tuple(parts), self.slots, sum(plan.weight(node) for node in plan.order))


def schedule(
    tape: Tape,
    outputs: Sequence[Sequence[Ref]],
    input_order: Sequence[str],
    part_limit: int = PART_LIMIT,
    nest_limit: int = NEST_LIMIT,
    bodies: Bodies | None = None,
    *,
    fill: bool = True,
    reroll: bool = True,
    sample: Sample = WHOLE,
    live_limit: int = 0,
) -> Schedule:
    """Return the statements of a function, in parts, that compute the operations needed for the outputs.

    Parameters
    ----------
    outputs : for each output array, the references row by row.
    input_order : the order of the input blocks read by parts.
    part_limit, nest_limit : operations per part and per statement at most.
    bodies : of the Program, completed here; without, no stretches are shared.
    fill : whether many structural zeros may become a loop.
    reroll : whether repeats may become loops.
    sample : the longer scene for which loops are judged, if the tape belongs to a shorter sample of the scene.
    live_limit : if not 0, functions without loops have parts with at most this number of live values, of any length.
    """

    apart, bodies = accumulate_maps(tape, outputs), bodies or Bodies()

    def reroll_loops(tape: Tape, live: Sequence[int]) -> list[RerolledLoop]:
        return _worthwhile(tape, live, sample) if reroll else []

    plan = Plan(tape, apart.outputs, part_limit, reroll_loops, apart.nodes, share=bodies.shared is not None)
    if not live_limit or plan.loops or plan.stretches or plan.maps:
        return Scheduler(plan, apart.outputs, apart.additions, input_order, nest_limit, bodies).run(fill)
    made, slots, stored = list[Schedule](), dict[int, int](), set[int]()  # slots of operations in the workspace
    parts = split_by_live_values(plan, outputs, live_limit)
    for number, part in enumerate(parts):
        later = {node for other in parts[number + 1 :] for head in other.given for node in plan.group(head)}
        left = [[ZERO if abs(ref) in stored else ref for ref in refs] for refs in outputs]
        own = PartPlan(plan, part.order, left, later - slots.keys())
        writer = Scheduler(own, () if made else outputs, {}, input_order, nest_limit, bodies)
        writer.expressions = {node: ("w", slots[node]) for head in part.given for node in plan.group(head)}
        writer.slots = len(slots)
        made.append(writer.run(fill))
        slots |= writer.crossed
        stored.update(own.live)
    texts = tuple(chain.from_iterable(item.parts for item in made))
    return Schedule(texts, len(slots), sum(item.operations for item in made))


def _worthwhile(tape: Tape, live: Sequence[int], sample: Sample) -> list[RerolledLoop]:
    """Return the rerolled loops of a function, or none if loops would reduce the number of written operations too
    little. Numbers of operations are judged for the longer scene of which the tape is a sample. Functions up to
    ``REROLL_FROM`` operations have no loops; loops must reduce the operations to the part ``REROLLED_PART``."""
    written = sum(tape.op[node] is not _MAP for node in live)
    if written * sample.growth <= REROLL_FROM:
        return []
    loops = find_loops(tape, live, sample)
    saved = sum((len(loop.iterations) - 1) * loop.period for loop in loops)
    missing = sum((sample.iterations(len(loop.iterations)) - len(loop.iterations)) * loop.period for loop in loops)
    return loops if written - saved <= REROLLED_PART * (written + missing) else []
