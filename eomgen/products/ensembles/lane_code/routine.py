"""Statements of a stepper's function in lanes: branches, loops and early returns as blocks under masks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pycparser import c_ast

from eomgen.products.ensembles.lane_code.expressions import AssignmentTarget, LaneExpressions, TypedText, pick
from eomgen.products.ensembles.lane_code.source import (
    Array,
    LaneIntegers,
    LaneSource,
    LaneStructure,
    LaneVariable,
    Loop,
    NoValue,
    Pointer,
    Real,
    Region,
    Routine,
    SharedNumber,
    Type,
    UniformInteger,
    declaration,
    expression_text,
    in_lanes,
    leaf,
    no_lanes,
    qualifiers,
    shared_type,
    table_text,
    type_of,
    type_text,
)


class RoutineText(LaneExpressions):
    """The C text for lanes of one function of a stepper.

    Attributes
    ----------
    signature, text : declaration and definition
    called : names of the stepper's functions that the function calls
    functions : names of the model's functions that the function calls under a mask
    returns : type of the result
    stores : number of assignments outside of masked blocks to memory that other lanes may share
    parts : whether lanes take different branches
    """

    def __init__(
        self, source: LaneSource, routine: Routine, outputs: Mapping[str, list[int]], *, whole: bool = False
    ) -> None:
        """Translate a routine into C for lanes, with the mask of active lanes, ``live``, as the first parameter.
        `whole`: for a text that runs with all lanes active, in which such stores need no mask. Facts about variables
        are noted on the routine."""
        super().__init__(source, routine, outputs)
        self._whole, self.stores, self.parts = whole, 0, False
        self._ended = False
        self.loops: list[Loop] = []
        self.lines: list[str] = []
        self.depth = 1
        for name, kind in routine.parameters:
            null = isinstance(kind, Pointer) and name not in routine.given
            self.variables[0][name] = LaneVariable(self._parameter(name, kind), self.top, null)
        arguments = [declaration(name, item.type) for name, item in self.variables[0].items()]
        result = in_lanes(routine.result)
        self.returns = result
        self.signature = f"static {type_text(result)} {routine.name}({', '.join(['eg_wholes live', *arguments])})"
        self._block(routine.node.body)
        head = [] if isinstance(result, NoValue) else [f"    {type_text(result)} result = {{0}};"]
        tail = [] if isinstance(result, NoValue) or self._ended else ["    return result;"]
        self.text = "\n".join([self.signature, "{", *head, *self.lines, *tail, "}"])

    def _parameter(self, name: str, kind: Type) -> Type:
        match kind:
            case UniformInteger():
                return LaneIntegers() if name in self.routine.varying else kind
            case Pointer(to) if isinstance(leaf(to), UniformInteger | Real):
                return Pointer(self.routine.elements.get(name, in_lanes(to)))
            case Pointer(to):
                return Pointer(in_lanes(to))
        return kind

    # -- writing ---------------------------------------------------------------------------------------------------

    def _line(self, text: str) -> None:
        self.lines.append("    " * self.depth + text)

    # -- statements ------------------------------------------------------------------------------------------------

    def _block(self, node: Any) -> bool:
        """Write the statements of a block in a scope of names; return False if control never reaches the end of the
        block."""
        self.variables.append({})
        going = True
        for item in node.block_items or [] if isinstance(node, c_ast.Compound) else [node]:
            if not (going := self._statement(item)):
                break
        self.variables.pop()
        return going

    def _braces(self, node: Any) -> bool:
        self._line("{")
        going = self._inner_block(node)
        self._line("}")
        return going

    def _inner_block(self, node: Any) -> bool:
        self.depth += 1
        going = self._block(node)
        self.depth -= 1
        return going

    def _statement(self, node: Any) -> bool:
        """Write the C for lanes of a statement; return False if control never goes on after it, as for a return.
        Raises UntranslatableConstruct."""
        # one case for each statement of C: a table of methods would hide their results
        match node:
            case None | c_ast.EmptyStatement():
                return True
            case c_ast.Compound():
                return self._braces(node)
            case c_ast.Decl():
                self._declaration(node)
            case c_ast.Assignment():
                self._assign(node)
                behind, self.behind = self.behind, []
                for item in behind:
                    self._increment(item)
            case c_ast.UnaryOp() if node.op in {"++", "--", "p++", "p--"}:
                self._increment(node)
            case c_ast.ExprList() | c_ast.DeclList():
                for item in node:
                    self._statement(item)
            case c_ast.Cast() if isinstance(type_of(node.to_type.type, self.source), NoValue):
                if isinstance(node.expr, c_ast.FuncCall):
                    self._statement(node.expr)
            case c_ast.FuncCall():
                self._line(self.call(node).text + ";")
            case c_ast.If():
                return self._if(node)
            case c_ast.Switch():
                self._switch(node)
            case c_ast.For():
                self._for(node)
            case c_ast.While() | c_ast.DoWhile():
                self._loop(node.cond, None, node.stmt, late=isinstance(node, c_ast.DoWhile))
            case c_ast.Return():
                self._return(node)
                return False
            case c_ast.Break() | c_ast.Continue():
                self._jump(node)
                return False
            case _:
                raise no_lanes(f"a statement {type(node).__name__}", node)
        return True

    def _declaration(self, node: Any) -> None:
        """Write a declaration; a variable whose initial value differs between lanes becomes one with a value for each
        lane. Raises UntranslatableConstruct for the names ``live`` and ``result``."""
        if node.name in ("live", "result"):
            raise no_lanes(f"the name {node.name}, which masks have", node)
        kind = type_of(node.type, self.source)
        constant = "const" in node.quals or (
            isinstance(node.type, c_ast.ArrayDecl) and "const" in qualifiers(node.type)
        )
        if "static" in node.storage and constant:
            self._static(node, kind)
            return
        if isinstance(kind, Pointer):
            self._pointer(node, kind)
            return
        whole = isinstance(kind, UniformInteger)
        kind = in_lanes(kind) if not whole or node.name in self.routine.varying else kind
        text = ""
        if isinstance(node.init, c_ast.InitList):
            text = self.initializer(node.init, kind)
        elif node.init is not None:
            value = self.value(node.init)
            if whole and isinstance(kind, UniformInteger) and not isinstance(value.type, UniformInteger):
                self.routine.varying.add(node.name)
                kind = LaneIntegers()
            text = self.to(value, kind, node)
        self._declare(node.name, kind, text)

    def _declare(self, name: str, kind: Type, text: str = "", *, null: bool = False) -> None:
        """Write the declaration of a variable that begins with a value, if any."""
        self.variables[-1][name] = LaneVariable(kind, self.region, null)
        self._line(f"{declaration(name, kind)} = {text};" if text else f"{declaration(name, kind)};")

    def _pointer(self, node: Any, kind: Pointer) -> None:
        """Write the declaration of a pointer, with the type of its initial value, or else the type found so far."""
        if node.init is None:
            self._declare(node.name, Pointer(self.routine.elements.get(node.name, in_lanes(kind.to))))
            return
        value = self.argument(node.init)
        if value.null:
            value = TypedText(value.text, in_lanes(kind), null=node.name not in self.routine.given)
        self._declare(node.name, value.type, value.text, null=value.null)

    def _static(self, node: Any, kind: Type) -> None:
        if isinstance(kind, LaneStructure) or node.name in self.routine.widened:
            # vectors are not constants of the language
            kind = in_lanes(kind)
            self._declare(node.name, kind, "{{0}}" if node.init is None else self.initializer(node.init, kind))
            return
        kind = shared_type(kind)
        self.variables[-1][node.name] = LaneVariable(kind, self.region)
        self._line(table_text(node, kind))

    def _assign(self, node: Any) -> None:
        if node.op == "=" and isinstance(node.rvalue, c_ast.Assignment):  # a = b = c
            self._assign(node.rvalue)
            self._store(node.lvalue, self.value(node.rvalue.lvalue), node)
            return
        if node.op != "=":
            node = c_ast.Assignment(
                "=", node.lvalue, c_ast.BinaryOp(node.op[:-1], node.lvalue, node.rvalue, node.coord)
            )
        self._store(node.lvalue, self.value(node.rvalue), node)

    def _increment(self, node: Any) -> None:
        unit = c_ast.Constant("int", "1")
        self._store(node.expr, self.value(c_ast.BinaryOp(node.op.strip("p")[0], node.expr, unit)), node)

    def _store(self, target: Any, value: Any, node: Any) -> None:
        """Write the assignment of a value to a target for active lanes. A whole number that becomes different between
        lanes, and pointer targets, are noted on the routine. Raises UntranslatableConstruct for pointers set in some
        lanes only."""
        destination = self.place(target)
        if isinstance(destination.type, Pointer):
            if isinstance(target, c_ast.ID):
                self.routine.outside.add(target.name)
                if not value.null:
                    self.routine.given.add(target.name)
            if not self._within_loops_of(destination.region):
                raise no_lanes(f"the pointer {expression_text(target)}, set where lanes part company", node)
            value = value.as_pointer() if isinstance(value.type, Array) else value
            if isinstance(value.type, Pointer) and value.type != destination.type and not value.null:
                self.routine.elements[target.name] = value.type.to
            self._line(f"{destination.text} = {value.text};")
            return
        if isinstance(destination.type, UniformInteger):
            here = self.region is destination.region or target.name in self.routine.counters
            if here and isinstance(value.type, UniformInteger):
                self._line(f"{destination.text} = {value.text};")
            else:
                self.routine.varying.add(target.name)
            return
        self._line(self.store(destination, value, node) + ";")

    def _within_loops_of(self, region: Region | None) -> bool:
        """Return whether only bodies of loops lie between the present region and an outer one, so that the remaining
        lanes agree."""
        here: Region | None = self.region
        while here is not None and here is not region and here.loop is not None:
            here = here.outer
        return here is region

    def store(self, target: AssignmentTarget, value: Any, node: Any) -> str:
        """Return the C text that stores a value at a target for the active lanes: scattered, direct, merged or picked
        by mask."""
        text = self.to(value, target.type, node)
        is_here = target.region is self.region
        if not is_here and self.region is self.top:
            self.stores += 1
            is_here = self._whole
        if target.lanes:
            kind = "real" if isinstance(target.type, Real) else "wholes"
            return f"eg_scatter_{kind}({self.mask()}, {target.text}, {target.lanes}, {text})"
        if is_here:
            return f"{target.text} = {text}"
        if isinstance(target.type, LaneStructure):
            copied = f"{type_text(target.type)} eg_given = {text}"
            return f"{{ {copied}; eg_merge({self.mask()}, &{target.text}, &eg_given, sizeof eg_given); }}"
        return f"{target.text} = {pick(self.mask(), text, target.text, target.type)}"

    def _return(self, node: Any) -> None:
        """Write a return statement. Within a masked block, active lanes keep the result and are removed from all masks
        around; other lanes go on."""
        value = ""
        if node.expr is not None:
            returned = self.value(node.expr)
            self.routine.gives = self.routine.gives or not returned.null
            value = self.to(returned, self.returns, node)
        if self.region is self.top:
            if self.top.left and value:
                value = self._pick("live", value, "result")
            self._line(f"return {value};" if value else "return;")
            self._ended = self._ended or self.depth == 1
            return
        if value:
            self._line(f"result = {self._pick(self.mask(), value, 'result')};")
        self._leave({"live"}.union(*({loop.run, loop.region.mask} for loop in self.loops if loop.parted)))

    def _pick(self, mask: str, value: str, if_false: str) -> str:
        if not isinstance(self.returns, Real | LaneIntegers):
            raise no_lanes("a structure, returned where lanes part company", self.routine.node)
        return pick(mask, value, if_false, self.returns)

    def _leave(self, masks: set[str], until: Region | None = None) -> None:
        """Write the removal of the active lanes from masks; regions around, before ``until``, have lanes that left."""
        gone = self.fresh("gone")
        self._line(f"const eg_wholes {gone} = {self.mask()};")
        for mask in sorted(masks | {self.mask()}):
            self._line(f"{mask} = {mask} & ~{gone};")
        region: Region | None = self.region
        while region is not None and region is not until:
            region.left = True
            region = region.outer

    def _jump(self, node: Any) -> None:
        word = "break" if isinstance(node, c_ast.Break) else "continue"
        loop = self.loops[-1]
        if self.region is loop.region:
            self._line(f"{word};")
            return
        if not loop.parted:
            raise _DivergentLanes(loop)
        self._leave({loop.region.mask} | ({loop.run} if word == "break" else set()), loop.region)
        loop.region.left = True

    # -- blocks under masks ------------------------------------------------------------------------------------------

    def _if(self, node: Any) -> bool:
        """Write an if statement, with both branches as masked blocks if the condition differs between lanes. Returns
        whether execution may go on after the statement."""
        condition = self.value(node.cond)
        if condition.known_truth is not None:
            chosen = node.iftrue if condition.known_truth else node.iffalse
            return chosen is None or self._braces(chosen)
        if isinstance(condition.type, UniformInteger | SharedNumber | Pointer):
            self._line(f"if ({condition.text}) {{")
            self._inner_block(node.iftrue)
            if node.iffalse is not None:
                self._line("} else {")
                self._inner_block(node.iffalse)
            self._line("}")
            return True
        self.parts = True
        holds = self.fresh("holds")
        self._line(f"const eg_wholes {holds} = {self.truths(condition)};")
        outer = self.region
        before = f"{outer.mask} & {holds}", f"{outer.mask} & ~{holds}"
        otherwise = self.fresh("m") if node.iffalse is not None else ""
        if otherwise:
            self._line(f"eg_wholes {otherwise} = {before[1]};")
        self._under(node.iftrue, before[0])
        if otherwise:
            self._under(node.iffalse, otherwise, otherwise)
        return True

    def _switch(self, node: Any) -> None:
        """Write a switch over a number that all lanes share, whose cases fall through. Raises UntranslatableConstruct
        for a number of each lane, and for cases that end with break, continue or return."""
        chosen = self.value(node.cond)
        if not isinstance(chosen.type, UniformInteger):
            raise no_lanes(f"a choice of its own in each lane: {expression_text(node.cond)}", node)
        self._line(f"switch ({chosen.text}) {{")
        self.variables.append({})
        for case in node.stmt.block_items:
            self._line("default:;" if isinstance(case, c_ast.Default) else f"case {expression_text(case.expr)}:;")
            for item in case.stmts:
                if isinstance(item, c_ast.Break | c_ast.Continue | c_ast.Return):
                    raise no_lanes("a case that ends", item)
                self._statement(item)
        self.variables.pop()
        self._line("}")

    def _under(self, node: Any, mask: str, name: str = "") -> None:
        """Write a block that runs under a mask unless the mask is empty. `mask` is the C text of the mask, `name` its
        variable, which is declared if empty. Lanes that left within the block are removed from the masks around."""
        if not name:
            name = self.fresh("m")
            self._line(f"eg_wholes {name} = {mask};")
        outer, self.region = self.region, Region(name, self.region)
        self._line(f"if (eg_any({name})) {{")
        self.depth += 1
        self._block(node)
        left, self.region = self.region.left, outer
        if left:
            outer.left = True
            self._rejoin(outer)
        self.depth -= 1
        self._line("}")

    def _rejoin(self, outer: Region) -> None:
        """Write the removal of lanes that have left from the mask of the block `outer`; without lanes the block is
        left."""
        if not outer.left:
            return
        base = next((loop.region.mask for loop in reversed(self.loops) if loop.parted), "live")
        if outer.mask != base:
            self._line(f"{outer.mask} = {outer.mask} & {base};")
        if outer is self.top:
            nothing = "" if isinstance(self.returns, NoValue) else " result"
            self._line(f"if (!eg_any(live)) return{nothing};")
        elif self.loops and outer is self.loops[-1].region:
            self._line(f"if (!eg_any({outer.mask})) continue;")

    def _for(self, node: Any) -> None:
        self.variables.append({})
        self._line("{")
        self.depth += 1
        if node.init is not None:
            self._statement(node.init)
        self._loop(node.cond, node.next, node.stmt)
        self.depth -= 1
        self._line("}")
        self.variables.pop()

    def _loop(self, condition: Any, step: Any, body: Any, *, late: bool = False) -> None:
        """Write a loop: as a loop of C if all lanes take the same iterations, else under masks. `condition`, `step` and
        `body` are its parts; `late`: the first iteration has no condition."""
        again = ""
        if late:
            again, step = self.fresh("again"), None
            self._line(f"int {again} = 0;")
        state = len(self.lines), self.depth, self.region, len(self.loops), len(self.variables)
        try:
            if condition is None or isinstance(self.value(condition).type, UniformInteger):
                self._common_loop(condition, step, body, again)
                return
        except _DivergentLanes as divergence:
            if len(self.loops) <= state[3] or divergence.loop is not self.loops[state[3]]:
                raise
            del self.lines[state[0] :], self.loops[state[3] :], self.variables[state[4] :]
            self.depth, self.region = state[1], state[2]
        self._parted_loop(condition, step, body, again)

    def _common_loop(self, condition: Any, step: Any, body: Any, again: str) -> None:
        loop = Loop(self.region)
        self.loops.append(loop)
        test = "" if condition is None else self.value(condition).text
        head = f"!{again} || {test}; {again} = 1" if again else f"{test}; {self._step(step)}"
        self._line(f"for (; {head}) {{")
        self._inner_block(body)
        self._line("}")
        self.loops.pop()
        self._rejoin(self.region)

    def _step(self, step: Any) -> str:
        if step is None:
            return ""
        kept, self.lines = self.lines, []
        self._statement(step)
        made, self.lines = self.lines, kept
        return ", ".join(line.strip().rstrip(";") for line in made)

    def _parted_loop(self, condition: Any, step: Any, body: Any, again: str) -> None:
        """Write a loop under masks that runs until every lane has left; `again` names the variable of a loop with
        its condition at the end, or is empty."""
        self.parts = True
        outer = self.region
        run, turn = self.fresh("run"), self.fresh("m")
        self._line(f"eg_wholes {run} = {outer.mask};")
        loop = Loop(Region(turn, outer), run, parted=True)
        loop.region.loop = loop
        self.loops.append(loop)
        self.region = Region(run, outer)
        stepped = f"{again} = 1" if again else self._step(step)
        self._line(f"for (;; {stepped}) {{")
        self.depth += 1
        if condition is not None:
            first = f"if ({again}) " if again else ""
            self._line(f"{first}{run} = {run} & {self.truths(self.value(condition))};")
        self._line(f"if (!eg_any({run})) break;")
        self._line(f"eg_wholes {turn} = {run};")
        self.region = loop.region
        self._block(body)
        self.depth -= 1
        self._line("}")
        self.loops.pop()
        left, self.region = loop.region.left, outer
        outer.left = outer.left or left
        self._rejoin(outer)


class _DivergentLanes(Exception):
    """Raised if some lanes leave a loop in which other lanes remain."""

    def __init__(self, loop: Loop) -> None:
        super().__init__("lanes part company")
        self.loop = loop
