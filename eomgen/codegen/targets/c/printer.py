"""Statements of a Program -> lines of C; doubles in shortest round-trip form, functions as ``EG_`` macros; long
lines are folded.

Parentheses keep the order of evaluation of the tape, because floating-point sums are not associative.
"""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, cast

from eomgen.base.data import dataclass, field
from eomgen.codegen.program import Expression, ProgramShared, Statement
from eomgen.codegen.targets.c.naming import INNER, comment
from eomgen.codegen.targets.c.tables import WIDTH, chosen, place, shift

#: Characters of a line that are looked at together.
_WINDOW = 4000

_INDENT = "    "
_COMMENT_LINE = re.compile(r"\s*(/\*|\*) ")
#: A line of a comment without indentation, and a line of a comment whose sentence goes on in the next line.
_PARAGRAPH = re.compile(r"\s*\* ([^\s*].*)")
_UNENDED = re.compile(r"(?:/\*|^\s*\*) [^\s*](?:.*[^.:;])?$")
#: Places at which a line may end: after a comma or an assignment, before an operator.
_BREAK = re.compile(
    r"(?<=,) (?=\S)|(?<= =) (?=\S)| (?=(?:&&|\|\||[+?:-]) )|(?<=:) (?=return )|(?<=[;{]) (?=return |\(void\))"
)
#: A part of a table of numbers.
_NUMBERS = re.compile(r"[\d{},.e+ -]*")
#: Declaration of values of earlier parts.
_LOADS = re.compile(r"const real (?:\w+ = w\[\d+\](?:, |;))+")
#: A value that later parts read: its name stands here if it is read in this part, too.
_KEPT = re.compile(r"const real (\w+) = (w\[\d+\] = )")
#: Tokens without breaks inside: texts and comments.
_CLOSED = re.compile(r'"(?:[^"\\]|\\.)*"|/\*.*?\*/')


def wrap_text(text: str) -> str:
    """Return C text with paragraphs of comments and signatures filled and no line longer than WIDTH, but for directives
    and texts that cannot be cut.

    Templates break lines before names and numbers are known; a call or a condition that is too long is broken anew.
    """
    pieces: list[str] = []
    within = False  # a comment that an earlier line began: a product may begin with a star, too
    # a macro of a template without output leaves a line of blanks
    for line in _joined_lines([line.rstrip() for line in text.split("\n") if not line.isspace()]):
        pieces += _pieces(line, within)
        opened, closed = line.rfind("/*"), line.rfind("*/")
        within = opened > closed or (within and closed < 0)
    return "\n".join(pieces)


def _joined_lines(lines: Sequence[str]) -> list[str]:
    """Return lines of C with each paragraph of a comment, each signature and each call that is too long in one line."""
    result: list[str] = []
    number, end = 0, len(lines)
    while number < end:
        line, last = lines[number], number + 1
        if "/*" in line and "*/" not in line:
            while last < end and "*/" not in lines[last - 1]:
                last += 1
            result += _paragraphs(lines[number:last])
        elif line.count("(") > line.count(")") and _is_plain(line):
            depth = line.count("(") - line.count(")")
            while depth > 0 and last < end and _is_plain(lines[last]):
                depth += lines[last].count("(") - lines[last].count(")")
                last += 1
            group = lines[number:last]
            if depth == 0 and (not line[0].isspace() or max(map(len, group)) > WIDTH):
                result.append(" ".join([line, *(part.strip() for part in group[1:])]).replace("( ", "("))
            else:
                result += group
        else:
            result.append(line)
        number = last
    return result


def _is_plain(line: str) -> bool:
    """Return whether a line is code without texts, comments and directives."""
    return not ('"' in line or "/*" in line or line.startswith("#") or line.endswith("\\"))


def _paragraphs(lines: Sequence[str]) -> list[str]:
    """Return the lines of one comment with each paragraph joined into one line. An indented line begins a paragraph,
    and a line that ends with ``.``, ``:`` or ``;`` ends one."""
    result = [lines[0]]
    for line in lines[1:]:
        text = _PARAGRAPH.match(line)
        if text and _UNENDED.search(result[-1]) and "SPDX" not in result[-1]:
            result[-1] += f" {text[1]}"
        else:
            result.append(line)
    return result


def _pieces(line: str, within: bool = False) -> list[str]:
    if len(line) <= WIDTH or line.lstrip().startswith("#") or line.endswith("\\"):
        return [line]
    if _COMMENT_LINE.match(line) and (within or "/*" in line):
        return _folded_comment(line)
    indent = line[: len(line) - len(line.lstrip())]
    behind = re.search(r"\s*(/\*[^\"]*\*/)$", line)
    if behind and not re.search(r"\*/|/\*", line[: behind.start()]):
        return [*_pieces(indent + behind[1]), *_pieces(line[: behind.start()])]
    return _folded_code(line, indent + _INDENT)


def _folded_comment(line: str) -> list[str]:
    """Return a long line of a comment broken between words into lines of at most ``WIDTH`` characters. Further lines
    begin with a star below the star of the first line; lines of an indented item stay indented."""
    indent = line[: len(line) - len(line.lstrip())]
    prefix = f"{indent} * " if line.lstrip().startswith("/*") else f"{indent}* "
    item = re.match(r"\s*\*( {2,})\S", line)
    prefix += " " * (len(item[1]) + 1) if item else ""  # further lines of an item are indented by two more
    pieces = []
    while len(line) > WIDTH:
        cut = line.rfind(" ", len(prefix) + 1, WIDTH + 1)
        if line[cut + 1 :] == "*/":
            cut = line.rfind(" ", len(prefix) + 1, cut)
        if cut < 0:
            break
        pieces.append(line[:cut].rstrip())
        line = prefix + line[cut + 1 :].lstrip()
    return [*pieces, line]


def _folded_code(line: str, indent: str) -> list[str]:
    """Return a long line of C broken into lines of at most ``WIDTH`` characters, if possible; ``indent`` begins the
    further lines. Breaks are at the fewest open brackets, as late as possible, in the second half."""
    pieces = []
    line, rest = line[:_WINDOW], line[_WINDOW:]  # a table of numbers may be as long as a book: page by page
    while len(line) + len(rest) > WIDTH:
        head = line[: WIDTH + 2]
        marked = '"' in head or "/*" in head
        if rest and (marked or len(line) < WIDTH + 2):
            size = len(rest) if marked else _WINDOW
            line, rest = line + rest[:size], rest[size:]
            continue
        start = len(line) - len(line.lstrip())
        if _NUMBERS.fullmatch(head):  # the rule below, without a look at each of the breaks
            cut = line.rfind(", ", start, WIDTH) + 1
            if cut > 0:
                pieces.append(line[:cut])
                line = indent + line[cut + 1 :]
                continue
        cut, after = _cut(line, start, [match.span() for match in _CLOSED.finditer(line)] if marked else [])
        if not cut:
            break
        pieces.append(line[:cut])
        line = indent + line[after:]
    return [*pieces, line + rest]


def _cut(line: str, start: int, closed: Sequence[tuple[int, int]]) -> tuple[int, int]:
    """Return the end of the first piece of a line and the start of the next; (0, 0) if the line cannot be broken.

    Parameters
    ----------
    line : str
    start : number of spaces at its beginning
    closed : first and last character of texts and comments, which stay whole
    """
    cuts = [
        match.start()
        for match in _BREAK.finditer(line, start, WIDTH + 1)
        if match.start() <= WIDTH and not any(first < match.start() < last for first, last in closed)
    ]
    if not cuts:  # a long name of a function with one long argument
        cut = line.rfind("(", start, WIDTH) + 1
        return (0, 0) if any(first < cut < last for first, last in closed) else (cut, cut)
    late = [cut for cut in cuts if cut > WIDTH // 2] or cuts[-1:]
    cut = min(late, key=lambda cut: (line.count("(", 0, cut) - line.count(")", 0, cut), -cut))
    return cut, cut + 1


_SUM, _PRODUCT, _PREFIX, _ATOM = range(1, 5)
_OPERATORS = {"ADD": (" + ", _SUM), "SUB": (" - ", _SUM), "MUL": (" * ", _PRODUCT), "DIV": (" / ", _PRODUCT)}


def indent_lines(lines: Sequence[str], depth: int) -> str:
    """Return lines as text, four spaces for each level, each line ended."""
    return "".join(f"{'    ' * depth}{line}\n" if line else "\n" for line in lines)


def number(value: float) -> str:
    """Return the shortest text that reads back as the same double."""
    return repr(float(value))


#: Kinds of statements that count with ``i``.
_COUNTING = frozenset({"fill", "gather", "spread", "angles", "circular"})

#: Angles are filled up to a multiple of this, the number of doubles in a common vector register.
LANES = 4


#: Magnitudes of numbers in laws of mechanics: these numbers stay in the text, since compilers replace doubling by a sum
#: and keep constants in registers.
_COMMON = frozenset({0.0, 0.5, 1.0, 2.0})
#: Expressions of the counters of a loop, and operators that may be around one.
_COUNTED = frozenset({"row", "numbers", "cell", "cells", "choice", "neg"})


def counts(statement: Statement) -> bool:
    """Return whether the text of a statement is a loop over ``i``."""
    return statement.kind in _COUNTING and not (statement.kind == "circular" and statement.data[-1] == 1)


def _line_key(statement: Statement) -> int | None:
    """Return the number of the output to which a statement stores a positive zero, else None. Neighbouring statements
    with the same number are printed in one line."""
    kind, data = statement.kind, statement.data
    is_zero = kind == "out" and data[2] == ("K", 0.0) and math.copysign(1.0, data[2][1]) > 0.0
    return data[0] if is_zero else None


@dataclass
class NumberTable:
    """Numbers of a function in another file's table, so that the function's text is independent of the numbers.

    Attributes
    ----------
    name : of the array in C
    values : entries of the table
    """

    name: str
    values: list[float] = field(default_factory=list)
    _places: dict[float, int] = field(default_factory=dict)

    def entry(self, value: float) -> str:
        """Return the C text of the table's entry with a number; the number is appended unless the table has it."""
        if value not in self._places:
            self._places[value] = len(self.values)
            self.values.append(value)
        return f"{self.name}[{self._places[value]}]"

    def first_of(self, values: Sequence[float]) -> int:
        """Append numbers and return the index of the first appended number."""
        self.values += values
        return len(self.values) - len(values)


def stays_in_text(value: float, *, divides: bool) -> bool:
    """Return whether a number, or a number that ``divides``, stands in the text of a function with other numbers in
    tables."""
    return abs(value) in _COMMON or (divides and _is_power_of_two(("K", value)))


def _is_power_of_two(expression: Expression) -> bool:
    """Return whether an expression is a constant power of two, for whose reciprocal compilers multiply in divisions."""
    if isinstance(expression, int) or expression[0] != "K":
        return False
    return abs(math.frexp(expression[1])[0]) == 0.5  # the mantissa of all powers


def _table(declared: str, values: Sequence[str]) -> list[str]:
    """Return the lines of C that declare an array (``declared`` without a size) with values, 16 in a line."""
    rows = [", ".join(values[k : k + 16]) for k in range(0, len(values), 16)]
    return [f"{declared}[{len(values)}] = {{", *(f"    {row}{',' if row is not rows[-1] else ' };'}" for row in rows)]


@dataclass
class Printer:
    """Prints expressions and statements of a function as C.

    Attributes
    ----------
    inputs : for each input block, a text with one ``{}`` for the component: ``q[{}]``; component texts for structs.
    outputs : for each output, by number, the name of the array or the texts of components.
    prefix : of the model's functions.
    local : letter of local values without a name, before the number.
    constants : names of positive numbers.
    names : names of local values, by number.
    numbers : the table from which numbers are read; without a table, numbers stand in the text.
    place_type : integer type of places in the workspace in tables of shared stretches.
    shared : the shared stretches of the Program.
    together : numbers of the stretches with a function for several calls.
    """

    inputs: Mapping[str, str | Sequence[str]]
    outputs: Sequence[str | Sequence[str]] = ()
    prefix: str = ""
    local: str = "x"
    constants: Mapping[float, str] = field(default_factory=dict)
    names: Mapping[int, str] = field(default_factory=dict)
    numbers: NumberTable | None = None
    place_type: str = "int"
    shared: Sequence[ProgramShared] = ()
    together: Collection[int] = ()
    _first_local: int | None = None  # register of local value 0 in a function on the tape engine

    def expression(self, expression: Expression) -> str:
        """Return an expression as C text."""
        return self._print(expression)[0]

    def _print(self, expression: Expression) -> tuple[str, int]:
        """Return the C text of an expression, and the rank of its outermost operator."""
        if isinstance(expression, int):
            return (self._local(expression), _ATOM) if expression > 0 else (f"-{self._local(-expression)}", _PREFIX)
        kind = expression[0]
        operator = _OPERATORS.get(kind)
        if operator is not None:
            symbol, rank = operator
            left, left_rank = self._print(expression[1])
            if kind == "DIV" and _is_power_of_two(expression[2]):
                right, right_rank = f"K({number(expression[2][1])})", _ATOM
            else:
                right, right_rank = self._print(expression[2])
            if left_rank < rank:
                left = f"({left})"
            if right_rank <= rank or right_rank == _PREFIX:
                right = f"({right})"
            return left + symbol + right, rank
        if kind == "K":
            return self._constant(expression[1])
        if kind == "in":
            text = self.inputs[expression[1]]
            return (text.format(expression[2]) if isinstance(text, str) else text[expression[2]]), _ATOM
        if kind == "w":
            return f"w[{expression[1]}]", _ATOM
        if kind == "neg":
            inner, rank = self._print(expression[1])
            return (f"-{inner}" if rank == _ATOM else f"-({inner})"), _PREFIX
        if kind == "CURVE":
            return f"{self.prefix}_curve{expression[2] + 1}({self._print(expression[1])[0]}, {expression[3]})", _ATOM
        arguments = ", ".join(self._print(operand)[0] for operand in expression[1:])
        return f"EG_{kind}({arguments})", _ATOM

    def _constant(self, value: float) -> tuple[str, int]:
        """Return the C text of a number in the macro ``K``, and the text's rank: ``_PREFIX`` for ``-K(name)``, else
        ``_ATOM``. A magnitude in ``constants`` is written by name. With a table, a number that is not common becomes an
        entry of the table, which is appended if new. Other numbers are digits."""
        named = self.constants.get(abs(value))
        if named is not None:
            return (f"K({named})", _ATOM) if value > 0.0 else (f"-K({named})", _PREFIX)
        if self.numbers is not None and abs(value) not in _COMMON:
            return f"K({self.numbers.entry(value)})", _ATOM
        return f"K({number(value)})", _ATOM

    def _local(self, number: int) -> str:
        if self._first_local is not None:
            return f"w[{self._first_local + number}]"
        return self.names.get(number) or f"{self.local}{number}"

    def _array(self, block: str) -> str:
        """Return the text of a block that a loop can index, with ``{}`` for the component.

        Raises
        ------
        TypeError : the components of the block are members of a struct; ``scheduling.rerolling.UNINDEXED`` names
            the blocks that loops may not read.
        """
        text = "w[{}]" if block == "w" else self.inputs[block]
        if not isinstance(text, str):
            raise TypeError(f"a loop reads the block {block!r}, whose components are members of a struct")
        return text

    def lines(self, statements: Sequence[Statement]) -> list[str]:
        """Return statements as lines of C, without indentation."""
        lines: list[str] = []
        for output, group in itertools.groupby(statements, _line_key):
            if output is None:
                lines += self._lines(group, first=not lines)
            else:
                targets = [self._target(output, statement.data[1]) for statement in group]
                lines.append(f"{' = '.join(targets)} = K(0.0);")
        used = Counter(re.findall(r"\w+", " ".join(lines)))
        return [_KEPT.sub(lambda made: made[0 if used[made[1]] > 1 else 2], line) for line in lines]

    def _lines(self, statements: Iterable[Statement], *, first: bool) -> list[str]:
        """Return statements as lines of C; ``first`` says that no line stands before, so that a label needs no blank
        line. Raises ValueError for an unknown kind of statement."""
        lines: list[str] = []
        for statement in statements:
            kind, data = statement.kind, statement.data
            if kind in ("let", "save"):
                self._add_value(lines, kind, data)
            elif kind == "label":
                headline = comment(data[0])
                lines += [*([""] if lines or not first else []), f"/* {headline[:1].upper()}{headline[1:]} */"]
            elif (printed := getattr(self, f"_print_{kind}", None)) is not None:
                lines += printed(*data)
            else:
                raise ValueError(f"no C for a statement of kind {kind!r}")
        return lines

    def _print_out(self, output: int, component: int, expression: Expression) -> list[str]:
        return [f"{self._target(output, component)} = {self._print(expression)[0]};"]

    def _print_sincos(self, sine: int, cosine: int, angle: Expression) -> list[str]:
        names = [self._local(number) for number in (sine, cosine)]
        return [f"real {names[0]}, {names[1]};", f"EG_SINCOS({self._print(angle)[0]}, &{names[0]}, &{names[1]});"]

    def _print_circular(self, sine: int, cosine: int, block: str, start: int, step: int, length: int) -> list[str]:
        if length == 1:
            return [f"EG_SINCOS({self._print(('in', block, start))[0]}, &w[{sine}], &w[{cosine}]);"]
        angle = self._array(block).format(place(start, step))
        call = f"EG_SINCOS({angle}, &w[{place(sine, 1)}], &w[{place(cosine, 1)}]);"
        return [f"for (i = 0; i < {length}; ++i) {{", f"    {call}", "}"]

    def _print_loop(self, number_: int, first: int, results: int) -> list[str]:
        return [f"{self.prefix}_loop{number_ + 1}(&w[{first}], &w[{results}]);"]

    def _print_call(self, number_: int, first: int, results: int) -> list[str]:
        return [f"{self.prefix}_external{number_ + 1}(&w[{first}], &w[{results}]);"]

    def _print_add(self, number_: int, first: int, outputs: Sequence[int]) -> list[str]:
        arguments = ", ".join(str(self.outputs[output]) for output in outputs)
        return [f"{self.prefix}_loop{number_ + 1}(&w[{first}], {arguments});"]

    def _print_gather(self, to: int, to_step: int, block: str, start: int, step: int, length: int) -> list[str]:
        return self._copy(f"w[{place(to, to_step)}]", self._array(block).format(place(start, step)), length)

    def _add_value(self, lines: list[str], kind: str, data: Sequence[Any]) -> None:
        """Append the line of a ``let`` (local value) or ``save`` (copy into the workspace) statement to ``lines``, in
        place. The line is joined with the last one if both load values from the workspace, or declare a value and its
        copy."""
        value, last = self._print(data[1])[0], lines[-1] if lines else ""
        if kind == "save":
            made, line = f"const real {value} = ", f"w[{data[0]}] = {value};"
            if last.startswith(made):
                line = f"{made}w[{data[0]}] = {lines.pop()[len(made) :]}"
        else:
            line = f"const real {self._local(data[0])} = {value};"
            if _LOADS.fullmatch(line) and _LOADS.fullmatch(last) and len(last + line) < WIDTH:
                line = f"{lines.pop()[:-1]}, {line.removeprefix('const real ')}"
        lines.append(line)

    def _print_share(
        self, number_: int, places: Sequence[int], outputs: Sequence[int], values: Sequence[float]
    ) -> list[str]:
        """Return the C lines that call shared stretch ``number_`` (from 0) once or several times, with tables of places
        and numbers (``values``). ``outputs`` are the numbers of the outputs passed on."""
        text, name = self.shared[number_], f"{self.prefix}_shared{number_ + 1}"
        if number_ in self.together and len(places) > text.places:
            return self._call(f"{name}_together", outputs, places, values)
        return [line for call in text.single_calls(places, values) for line in self._call(name, outputs, *call)]

    def _call(self, name: str, outputs: Sequence[int], places: Sequence[int], values: Sequence[float]) -> list[str]:
        """Return the C lines that call function ``name`` of a shared stretch."""
        lines = [f"    {line}" for line in _table(f"static const {self.place_type} at", list(map(str, places)))]
        arguments = ["w", *(str(self.outputs[output]) for output in outputs), "at"]
        if values and self.numbers is not None:
            arguments.append(f"&{self.numbers.name}[{self.numbers.first_of(values)}]")
        elif values:
            lines += [f"    {line}" for line in _table("static const double k", [number(value) for value in values])]
            arguments.append("k")
        return ["{", *lines, f"    {name}({', '.join(arguments)});", "}"]

    # statements of the tape engine, see ``tape_code``

    def _print_data(self, number_: int, blocks: Sequence[str]) -> list[str]:
        pointers = {"t": "&t", "p": "(const real *)p", "base": "(const real *)base"}
        inputs = ", ".join(pointers.get(block, block) for block in blocks)
        return [
            f"const real *const in[] = {{ {inputs or 'NULL'} }};",
            f"real *const out[] = {{ {', '.join(map(str, self.outputs)) or 'NULL'} }};",
            f"eomgen_tape_function(&{self.prefix}_tape, {number_}, in, out);",
        ]

    def _print_run(self, begin: int) -> list[str]:
        return [f"eomgen_tape(w, out, {self.prefix}_tape.code + {begin});"]

    def _print_curve(self, target: int, argument: int, curve: int, derivative: int) -> list[str]:
        return [f"w[{target}] = {self.prefix}_curve{curve + 1}(w[{argument}], {derivative});"]

    def _print_registers(
        self, registers: int, copies: Sequence[tuple[str, int, int]], numbers: Sequence[int], first_local: int
    ) -> list[str]:
        """Return the C lines that declare the array ``w`` of registers and fill inputs and numbers; from here on local
        values are in it."""
        self._first_local = first_local
        lines = [f"real w[{registers}];", f"real *const out[] = {{ {', '.join(map(str, self.outputs))} }};"]
        for block, to, size in copies:
            copied = f"w[{to}] = t;" if block == "t" else f"memcpy(&w[{to}], {block}, {size} * sizeof(real));"
            lines.append(copied)
        first, start, count = numbers
        if count:
            lines.append(f"eomgen_tape_numbers(&w[{first}], {self.prefix}_tape.numbers + {start}, {count});")
        return lines

    def _print_angles(self, angles: Sequence[tuple[int, int, Expression]]) -> list[str]:
        """Return the C lines that take sines and cosines of many angles in one loop, which compilers can vectorise.
        ``angles`` are (number of the local sine, number of the local cosine, angle)."""
        size = -(-len(angles) // LANES) * LANES
        values = [self._print(angle)[0] for _, _, angle in angles] + ["K(0.0)"] * (size - len(angles))
        lines = [f"const real angle[{size}] = {{ {', '.join(values)} }};", f"real sine[{size}], cosine[{size}];"]
        end = size if size == len(angles) else f"EG_ANGLES({len(angles)}, {size})"
        lines += [f"for (i = 0; i < {end}; ++i) {{", "    EG_SINCOS(angle[i], &sine[i], &cosine[i]);", "}"]
        for position, (sine, cosine, _) in enumerate(angles):
            pair = f"{self._local(sine)} = sine[{position}], {self._local(cosine)} = cosine[{position}]"
            lines.append(f"const real {pair};")
        return lines

    def _print_repeat(
        self,
        count: int,
        statements: Sequence[Statement],
        read: Sequence[Expression],
        target_expressions: Sequence[Expression],
        period: int = 1,
    ) -> list[str]:
        """Return the C lines of a ``repeat`` statement: tables of indices, then per iteration loads, body and stores.
        ``count`` iterations of ``statements`` read the expressions ``read`` and store to ``target_expressions``; with a
        ``period``, a loop of this length runs within each iteration."""
        tables: list[str] = []
        names: list[str] = []

        def table(kind: str, values: Sequence[str], counter: str = "k") -> str:
            name = f"table{len(names)}"
            names.append(name)
            tables.extend(_table(f"static const {kind} {name}", values))
            return f"{name}[{counter}]"

        def at(kind: str, rule: Sequence[Any]) -> str:
            if kind == "choice":
                return chosen([(end, place(start, step, "k")) for end, start, step in rule])
            if kind == "cell":
                *first, step = rule
                texts = [] if len(first) == 2 else [str(value) for value in first[0]]
                return shift(table("int", texts, INNER) if texts else place(first[0], first[1], INNER), step)
            return place(rule[0], rule[1], "k") if len(rule) == 2 else table("int", [str(value) for value in rule[0]])

        def text(expression: Expression) -> str:
            """Return the C text of an expression that depends on the counter of a loop."""
            if not isinstance(expression, tuple) or expression[0] not in _COUNTED:
                return self.expression(expression)
            kind, *rest = expression
            if kind == "neg":
                inner = rest[0]
                is_counted = isinstance(inner, tuple) and inner[0] in _COUNTED
                return f"-{text(inner)}" if is_counted else self.expression(expression)
            if kind in ("numbers", "cells"):
                counter = "k" if kind == "numbers" else INNER
                if self.numbers is not None:
                    first = self.numbers.first_of(rest[0])
                    return f"K({self.numbers.name}[{first} + {counter}])"
                return f"K({table('double', [number(value) for value in rest[0]], counter)})"
            if kind == "choice" and rest[0] == "numbers":

                def constant(value: float) -> str:
                    return number(value) if self.numbers is None else self.numbers.entry(value)

                return f"({chosen([(end, f'K({constant(value)})') for end, value in rest[1:]])})"
            return self._array(rest[0]).format(at(kind, rest[1:]))

        def target(expression: Expression) -> str:
            kind, array, *rule = cast("tuple[Any, ...]", expression)
            return f"{'w' if array == 'w' else self.outputs[array]}[{at(kind, rule)}]"

        loaded = [f"const real r{position} = {text(expression)};" for position, expression in enumerate(read)]
        targets = [[target(item) for item in target_expressions]]
        loads: dict[str, str | Sequence[str]] = {"read": [f"r{k}" for k in range(len(read))]}
        inside = Printer(loads, targets, self.prefix, "y", self.constants, numbers=self.numbers)
        body = [f"        {line}" for line in [*loaded, *inside.lines(statements)]]
        if period > 1:
            inner_loop = f"        for ({INNER} = 0; {INNER} < {period}; ++{INNER}) {{"
            body = [inner_loop, *(f"    {line}" for line in body), "        }"]
        lines = ["{", *(f"    {line}" for line in tables), f"    int {f'{INNER}, ' if period > 1 else ''}k;"]
        return [*lines, f"    for (k = 0; k < {count}; ++k) {{", *body, "    }", "}"]

    def _target(self, output: int, component: int) -> str:
        target = self.outputs[output]
        return f"{target}[{component}]" if isinstance(target, str) else target[component]

    def _print_fill(self, output: int, size: int) -> list[str]:
        target = self.outputs[output]
        if not isinstance(target, str):
            return [f"{component} = K(0.0);" for component in target]
        return self._copy(f"{target}[i]", "K(0.0)", size)

    def _print_spread(
        self, output: int, to: int, to_step: int, start: int, step: int, length: int, sign: int
    ) -> list[str]:
        target, minus = self.outputs[output], "-" if sign < 0 else ""
        if not isinstance(target, str):
            return [f"{target[to + k * to_step]} = {minus}w[{start + k * step}];" for k in range(length)]
        return self._copy(f"{target}[{place(to, to_step)}]", f"{minus}w[{place(start, step)}]", length)

    @staticmethod
    def _copy(target: str, source: str, length: int) -> list[str]:
        return [f"for (i = 0; i < {length}; ++i) {{", f"    {target} = {source};", "}"]


class BranchingPrinter(Printer):
    """Printer for numbers that are never lanes: a SELECT becomes ``?:``, which computes one operand alone."""

    def _print(self, expression: Expression) -> tuple[str, int]:
        if not isinstance(expression, int) and expression[0] == "SELECT":
            condition, chosen, rest = (self._print(operand)[0] for operand in expression[1:])
            return f"({condition} != K(0.0) ? {chosen} : {rest})", _ATOM
        return super()._print(expression)
