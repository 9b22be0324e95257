"""Functions of a Program as code for the tape engine, in place of C statements that a compiler has to read.

Operations of a function become instructions of four 16-bit numbers on one array of registers, ``w``: the workspace,
the function's constants, its inputs, local values. The engine (``templates/c/model/eomgen_tape.c.jinja``) evaluates the
operations in the order of the statements, so results have the bits of C without fused products.

The text of a function that is instructions alone depends on the arguments only, and the instructions are data that the
loader of the library hands over: compilers begin before the functions are scheduled. Loops, tables of curves and long
copies stay C, between runs of instructions.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from eomgen.base.data import dataclass, field, replace
from eomgen.codegen.program import Expression, FunctionPart, Program, ProgramFunction, ProgramShared, Statement
from eomgen.codegen.scheduling.rerolling import READ
from eomgen.codegen.targets.c.naming import MOST_SHORT
from eomgen.symbolic.operations import NAMES

#: Functions of one number.
FUNCTIONS = (*(name.upper() for name in NAMES.values()), "ABS", "SIGN")
#: Operations of the engine; the position is the code. An operation has a target and one or two operands.
OPERATIONS = (
    "END", "MOVE", "NEG", "ADD", "SUB", "MUL", "DIV", *FUNCTIONS, "ATAN2", "POW", "MIN", "MAX", "LT", "LE", "SELECT",
    "SINCOS", "TARGET", "OUT", "ZERO",
)  # fmt: skip  # a table
_CODES = {name: code for code, name in enumerate(OPERATIONS)}
#: Length from which on a copy stays a loop of C.
_LONG_COPY = 32


@dataclass
class TapeCode:
    """Code and constants of all functions of a Program.

    Attributes
    ----------
    code : instructions, four numbers each
    numbers : constants, function after function
    heads : by the position of a function that is instructions alone: number of registers, register of the first
        constant, place of the first constant, number of constants, place of the first instruction, numbers of inputs
        and outputs, then register and size of each input, and size of each output
    """

    code: list[int] = field(default_factory=list)
    numbers: list[float] = field(default_factory=list)
    heads: dict[int, list[int]] = field(default_factory=dict)

    def placed_heads(self, functions: int) -> list[int]:
        """Return a list of integers: the index of each function's head, 0 without, for ``functions`` functions; then
        all heads."""
        places, rows, at = [0] * functions, list[int](), functions
        for function, head in self.heads.items():
            places[function] = at + len(rows)
            rows += head
        return [*places, *rows]


def on_tape(program: Program) -> tuple[Program, TapeCode]:
    """Return a Program whose functions run on the tape engine, and the code of these functions. Functions with more
    than ``MOST_SHORT`` registers keep their statements, and so does the state of the base, whose result is a
    struct. Shared stretches are copied into the functions that call them."""
    tape = TapeCode()
    numbered = enumerate(program.functions)
    functions = tuple(_encode(program, function, number, tape) or function for number, function in numbered)
    numbers_by_name = {function.name: number for number, function in enumerate(functions)}
    for number, function in enumerate(functions):
        if function.same_as and numbers_by_name[function.same_as] in tape.heads:
            tape.heads[number] = tape.heads[numbers_by_name[function.same_as]]
    kinds = {statement.kind for function in functions for part in function.parts for statement in part.statements}
    return replace(program, functions=functions, shared=program.shared if "share" in kinds else ()), tape


def before_scheduling(program: Program) -> Program | None:
    """Return the Program of the tape engine, if known before scheduling: all functions are instructions alone.
    ``program`` has no statements. None for a Program of more than 15 000 operations, whose functions may
    get loops, or with the function ``base``, which stays C."""
    operations = sum(function.counts["statements"] for function in program.functions)
    # more may become loops, as functions of chains of some 20 hinges do, and arms have 10 000
    if operations > 15_000 or any(function.name == "base" for function in program.functions):
        return None
    numbered = enumerate(program.functions)
    functions = (function if function.same_as else _as_data(function, number) for number, function in numbered)
    return replace(program, functions=tuple(functions))


def functions_of_data(program: Program) -> frozenset[str]:
    """Return the names of the functions of a Program on the engine that are instructions alone."""
    whole = {f.name for f in program.functions if [s.kind for part in f.parts for s in part.statements] == ["data"]}
    return frozenset(f.name for f in program.functions if (f.same_as or f.name) in whole)


def _as_data(function: ProgramFunction, number: int) -> ProgramFunction:
    """Return a function that is instructions alone."""
    inputs, outputs = function.inputs, tuple(range(len(function.outputs)))
    part = FunctionPart((Statement("data", (number, inputs)),), inputs, outputs, True, function.operations)
    return replace(function, parts=(part,))


def _encode(program: Program, function: ProgramFunction, number: int, tape: TapeCode) -> ProgramFunction | None:
    """Return a function as runs of the engine and append the code to ``tape``; None if the function stays C. ``number``
    is the position of the function in the Program."""
    if function.name == "base" or function.same_as:
        return None
    made = _Assembler(program, _without_calls(program, function), len(tape.code))
    begin, statements = len(tape.code), made.statements()
    if made.registers > MOST_SHORT:
        return None
    constants = (made.first_number, len(tape.numbers), len(made.numbers))
    tape.code += made.code
    tape.numbers += made.numbers
    if len(statements) == 1 and statements[0].kind == "run":
        sizes = [output.size for output in function.outputs]
        places = [entry for _, to, size in made.copies for entry in (to, size)]
        counts = (len(made.copies), len(sizes))
        tape.heads[number] = [made.registers, *constants, begin, *counts, *places, *sizes]
        return replace(_as_data(function, number), workspace=made.registers)
    head = Statement("registers", (made.registers, tuple(made.copies), constants, made.first_local))
    inputs = tuple(block for block, _, _ in made.copies)
    outputs = tuple(range(len(function.outputs)))
    part = FunctionPart((head, *statements), inputs, outputs, workspace=True, operations=function.operations)
    return replace(function, parts=(part,), workspace=made.registers)


def _without_calls(program: Program, function: ProgramFunction) -> ProgramFunction:
    """Return a function with the statements of shared stretches in place of their calls, with other local numbers."""
    parts = []
    for part in function.parts:
        first = _last_local(part.statements)
        statements: list[Statement] = []
        for statement in part.statements:
            if statement.kind != "share":
                statements.append(statement)
                continue
            number, every, outputs, values = statement.data
            text = program.shared[number]
            for places, numbers in text.single_calls(every, values):
                statements += _inline(text, places, outputs, numbers, first)
        parts.append(replace(part, statements=tuple(statements)))
    return replace(function, parts=tuple(parts))


def _inline(
    text: ProgramShared, places: Sequence[int], outputs: Sequence[int], numbers: Sequence[float], first: int
) -> Iterator[Statement]:
    """Yield the statements of a shared stretch for one call; local values are numbered after ``first``."""
    targets = iter(places[text.reads :])
    places_of = [[next(targets) for _ in range(size)] for size in text.results]

    def renumber(expression: Expression) -> Expression:
        if isinstance(expression, int):
            return expression + first if expression > 0 else expression - first
        if expression[0] == "in":
            return ("w", places[expression[2]]) if expression[1] == READ else ("K", numbers[expression[2]])
        return expression if expression[0] == "K" else (expression[0], *map(renumber, expression[1:]))

    for kind, data in ((statement.kind, statement.data) for statement in text.statements):
        if kind == "let":
            yield Statement(kind, (data[0] + first, renumber(data[1])))
        elif kind == "sincos":
            yield Statement(kind, (data[0] + first, data[1] + first, renumber(data[2])))
        elif kind == "out" and data[0] == 0:
            yield Statement("save", (places_of[0][data[1]], renumber(data[2])))
        elif kind == "out":
            yield Statement(kind, (outputs[data[0] - 1], places_of[data[0]][data[1]], renumber(data[2])))
        elif kind != "label":
            raise ValueError(f"no code for a statement of kind {kind!r} of a shared stretch")


class _Assembler:
    """Code of one function for the tape engine: ``code`` and ``numbers`` after ``statements`` was called. Registers lie
    in this order: the workspace, inputs, local values, constants, intermediate values. Parts share the registers of
    local values, because no part reads local values of another one. ``copies`` are block, first register and size of
    each input."""

    def __init__(self, program: Program, function: ProgramFunction, begin: int) -> None:
        """Assign registers to inputs, local values and constants of a function; ``begin`` is the position of the
        code."""
        self.function = function
        self.code: list[int] = []
        self.numbers: list[float] = []
        self._begin = begin
        self._run = begin
        self._target = -1
        self._done: list[Statement] = []
        self._constants: dict[str, int] = {}
        self._deepest = 0
        at = function.workspace
        self.copies: list[tuple[str, int, int]] = []
        self._inputs: dict[str, int] = {}
        for block in function.inputs:
            size = program.input_size(block)
            self._inputs[block] = at
            self.copies.append((block, at, size))
            at += size
        self.first_local = at
        at += 1 + max((_last_local(part.statements) for part in function.parts), default=0)
        self.first_number = at
        for number in (number for part in function.parts for number in _numbers(part.statements)):
            if (key := number.hex()) not in self._constants:
                self._constants[key] = self.first_number + len(self.numbers)
                self.numbers.append(number)
        self._temporary = at + len(self.numbers)

    @property
    def registers(self) -> int:
        """How many registers the function has."""
        return self._temporary + self._deepest

    def statements(self) -> list[Statement]:
        """Return the statements of the whole function: runs of the engine, and between these statements that stay C."""
        for part in self.function.parts:
            for statement in part.statements:
                self._statement(statement)
        self._close()
        if not self._done:  # without outputs
            self._emit("END", 0)
            self._done.append(Statement("run", (self._run,)))
        return self._done

    def _emit(self, name: str, target: int, first: int = 0, second: int = 0) -> None:
        self.code += (_CODES[name], target, first, second)

    def _close(self) -> None:
        """End the current run of instructions, if any, and append a ``run`` statement."""
        here = self._begin + len(self.code)
        if here > self._run:
            self._emit("END", 0)
            self._done.append(Statement("run", (self._run,)))
            self._run = here + 4
            self._target = -1

    def _statement(self, statement: Statement) -> None:
        """Append the instructions of a statement; others end the run and stay C. Labels vanish."""
        kind, data = statement.kind, statement.data
        if kind == "let":
            self._value(data[1], 0, self.first_local + data[0])
        elif kind == "save":
            self._value(data[1], 0, data[0])
        elif kind == "sincos":
            self._sines(((data[0], data[1], data[2]),))
        elif kind == "angles":
            self._sines(data[0])
        elif kind == "out":
            self._out(data[0], data[1], self._value(data[2], 0))
        elif kind == "fill":
            self._aim(data[0])
            self._emit("ZERO", 0, data[1] & 0xFFFF, data[1] >> 16)
        elif kind == "circular" and data[-1] <= _LONG_COPY:
            sine, cosine, block, start, step, length = data
            first = start + (0 if block == "w" else self._inputs[block])
            for k in range(length):
                self._emit("SINCOS", sine + k, cosine + k, first + k * step)
        elif kind == "gather" and data[-1] <= _LONG_COPY:
            to, to_step, block, start, step, length = data
            first = start + (0 if block == "w" else self._inputs[block])
            for k in range(length):
                self._emit("MOVE", to + k * to_step, first + k * step)
        elif kind == "spread" and data[-2] <= _LONG_COPY:
            output, to, to_step, start, step, length, sign = data
            for k in range(length):
                source = ("w", start + k * step)
                self._out(output, to + k * to_step, self._value(source if sign > 0 else ("neg", source), 0))
        elif kind != "label":
            self._close()
            self._done.append(statement)

    def _sines(self, angles: Any) -> None:
        for sine, cosine, angle in angles:
            self._emit("SINCOS", self.first_local + sine, self.first_local + cosine, self._value(angle, 0))

    def _aim(self, output: int) -> None:
        """Let an output be the target of the next instructions."""
        if output != self._target:
            self._emit("TARGET", output)
            self._target = output

    def _out(self, output: int, component: int, source: int) -> None:
        self._aim(output)
        self._emit("OUT", source, component & 0xFFFF, component >> 16)

    def _value(self, expression: Expression, depth: int, target: int | None = None) -> int:
        """Append the instructions of an expression and return the register of the value. ``target`` prescribes the
        register; a free register by default. ``depth``: how many intermediate values are in use."""
        leaf = self._leaf(expression)
        if leaf is not None:
            if target is None or target == leaf:
                return leaf
            self._emit("MOVE", target, leaf)
            return target
        self._deepest = max(self._deepest, depth + 1)
        made = self._temporary + depth if target is None else target
        if isinstance(expression, int):
            self._emit("NEG", made, self.first_local - expression)
            return made
        kind, *operands = expression
        if kind == "CURVE":
            argument = self._value(operands[0], depth)
            self._close()
            self._done.append(Statement("curve", (made, argument, operands[1], operands[2])))
            return made
        if kind in ("ADD", "SUB"):
            kind, operands = _without_negative(kind, operands)
        registers = []
        for operand in operands:
            registers.append(self._value(operand, depth))
            depth += registers[-1] >= self._temporary
        self._emit("NEG" if kind == "neg" else kind, made, *registers[:2])
        if kind == "SELECT":
            self.code += (registers[2], 0, 0, 0)
        return made

    def _leaf(self, expression: Expression) -> int | None:
        """Return the register of an existing value, None for a value to be evaluated."""
        if isinstance(expression, int):
            return self.first_local + expression if expression > 0 else None
        if expression[0] == "K":
            return self._constants[float(expression[1]).hex()]
        if expression[0] == "in":
            return self._inputs[expression[1]] + int(expression[2])
        return int(expression[1]) if expression[0] == "w" else None


def _without_negative(kind: str, operands: list[Expression]) -> tuple[str, list[Expression]]:
    """Return a sum or difference (kind, operands) whose second operand is not a negative; the bits are the same."""
    second = operands[1]
    if isinstance(second, int) and second < 0:
        return "SUB" if kind == "ADD" else "ADD", [operands[0], -second]
    if isinstance(second, tuple) and second[0] == "neg":
        return "SUB" if kind == "ADD" else "ADD", [operands[0], second[1]]
    return kind, operands


def _last_local(statements: tuple[Statement, ...]) -> int:
    """Return the largest number of a local value that statements define, 0 without any."""
    last = 0
    for statement in statements:
        if statement.kind == "let":
            last = max(last, statement.data[0])
        elif statement.kind == "sincos":
            last = max(last, *statement.data[:2])
        elif statement.kind == "angles":
            last = max(last, *(max(sine, cosine) for sine, cosine, _ in statement.data[0]))
    return last


def _numbers(statements: tuple[Statement, ...]) -> Iterator[float]:
    """Yield the constants in the expressions that the engine evaluates."""

    def constants(data: Any) -> Iterator[float]:
        if isinstance(data, tuple) and data[0] == "K":
            yield float(data[1])
        elif isinstance(data, tuple):
            for part in data:
                yield from constants(part)

    for statement in statements:
        if statement.kind in ("let", "save", "sincos", "out", "angles"):
            yield from constants(statement.data)
