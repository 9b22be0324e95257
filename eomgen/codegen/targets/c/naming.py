"""Legal, distinct C identifiers and safe comments from names of users."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import lru_cache
from itertools import accumulate

from eomgen.codegen.program import Addition, OutputArray, Program, ProgramFunction, ProgramLoop, ProgramShared
from eomgen.codegen.scheduling.stretches import ranges
from eomgen.codegen.targets.c.tables import Lookup, RowLookup, chosen, place, shift
from eomgen.codegen.targets.target import Names
from eomgen.errors import ModelError
from eomgen.system.system import base_component

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
#: An underscore between two words avoids clashes with names of the generated code: x12, w, angle, EG_...
_LOCAL = re.compile(r"(?!EG_|eg_)[A-Za-z][A-Za-z0-9]*_[A-Za-z0-9_]*")
_COMMENT_UNSAFE = re.compile(r"[^A-Za-z0-9 _.,:;='()\[\]{}<>+^|/-]")
_C_WORDS = re.compile(
    r"auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|register|restrict|return|short|signed|sizeof|static|struct|switch|"
    r"typedef|union|unsigned|void|volatile|while|_Bool|_Complex|_Imaginary|asm|bool|catch|class|delete|explicit|export|false|friend|mutable|namespace|new|operator|private|protected|public|template|this|throw|"
    r"true|try|typename|using|virtual|real|complex|main|count|inputs|outputs|strides"
)

_STANDARD_HEADERS = re.compile(
    r"alloca|assert|complex|ctype|errno|features|fenv|float|inttypes|iso646|limits|locale|math|memory|setjmp|signal|stdarg|stdbool|"
    r"stddef|stdint|stdio|stdlib|string|strings|tgmath|threads|time|uchar|unistd|wchar|wctype"
)


#: Counter of loops within loops in functions of the model. Counters, locals and arguments share one space of names, and
#: j is an argument, the rate of the acceleration.
INNER = "n"
#: Locals and counters of functions of the model, which no argument may be named as.
_LOCALS = re.compile(rf"[xy]\d+|r\d+|[wijk{INNER}]|angle|sine|cosine|table\d+|eg_.*|EG_.*")
#: Names of generated code.
_TAKEN = ("main", "interface", "eg", "eomgen", "eomgen_real")
#: Blocks of a function whose rows are fetched while lanes compute, see ``templates/c/interface/rows.c.jinja``.
MOST_ROWS = 16
#: Number of places that 16 bits can hold.
MOST_SHORT = 1 << 16


def mangle(name: str, prefix: str = "p_") -> str:
    """Return a C identifier for a name, different for different names.

    Letters, digits and underscores stay; everything else, and an underscore in front of a ``Z``, becomes ``_Z<hex>_``.
    """
    text: list[str] = []
    for position, character in enumerate(name):
        if character == "_" and name[position + 1 : position + 2] == "Z":
            text.append("_Z5f_")
        elif character == "_" or (character.isascii() and character.isalnum()):
            text.append(character)
        else:
            text.append(f"_Z{ord(character):x}_")
    return prefix + "".join(text)


def comment(text: str, limit: int = 200) -> str:
    """Return text that is safe within a C comment, shortened to ``limit`` characters with dots at the end. The text
    cannot end a comment, continue a line, form a trigraph or leave ASCII."""
    clean = _COMMENT_UNSAFE.sub("_", " ".join(text.split())).replace("//", "/_")
    return clean if len(clean) <= limit else clean[: limit - 3] + "..."


def file_name(text: str) -> str:
    """Return the name of a file as quoted in messages of compilers: letters, digits, dots, dashes and underscores."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", text)


def c_string(text: str) -> str:
    """Return a string literal of C: characters of names such as der(q.arm[2]) unchanged, any other text in octal
    escapes."""
    plain = re.fullmatch(r"[A-Za-z0-9_.,()\[\]]*", text) is not None
    return f'"{text}"' if plain else '"' + "".join(f"\\{byte:03o}" for byte in text.encode()) + '"'


def free_prefix(name: str) -> str:
    """Return the prefix of a model's symbols and files: its name, followed by ``_model`` if the name is a word of C or
    taken by headers or generated code.

    Raises
    ------
    ModelError
        A name that is not an identifier.
    """
    taken = _C_WORDS.fullmatch(name) or _STANDARD_HEADERS.fullmatch(name.lower()) or name.lower() in _TAKEN
    prefix = f"{name}_model" if taken else name
    if not _IDENTIFIER.fullmatch(prefix):
        raise ModelError(
            f"the model's name {prefix!r} is not a C identifier [E0217]",
            "letters, digits and underscores, a letter first",
        )
    return prefix


def check_identifier(name: str, kind: str) -> str:
    """Return a name that mechanics gave to a function. Raises ModelError unless the name is an identifier."""
    if not _IDENTIFIER.fullmatch(name):
        raise ModelError(f"{kind} {name!r} is not an identifier [E0220]")
    return name


def output_name(name: str, inputs: tuple[str, ...]) -> str:
    """Return the C name of an output argument: ``name``, followed by ``_out`` for an input, a local or a word of C.
    Raises ModelError unless the name is an identifier."""
    check_identifier(name, "the output")
    clash = name in inputs or _C_WORDS.fullmatch(name) or _LOCALS.fullmatch(name)
    return f"{name}_out" if clash else name


def local_names(names: Sequence[tuple[int, str]], taken: Collection[str]) -> dict[int, str]:
    """Return C identifiers for local values, by number, from names in mechanics, (number, text). Names that are illegal
    in C, longer than 40 characters, or equal to an earlier one or to one of ``taken`` are left out."""
    texts: dict[int, str] = {}
    used = set(taken)
    for number, text in names:
        name = re.sub(r"[^A-Za-z0-9_]+", "_", text)
        if name not in used and len(name) <= 40 and _LOCAL.fullmatch(name) and not _C_WORDS.fullmatch(name):
            used.add(name)
            texts[number] = name
    return texts


NAMES = Names(free_prefix, check_identifier, mangle, output_name)

_POINTERS = {
    "q": "NQ", "v": "NV", "a": "NV", "j": "NV", "s": "NV", "a_higher": "NA_HIGHER", "z": "NZ", "lam": "NLAM", "u": "NU",
    "u_dot": "NU", "u_ddot": "NU", "u_higher": "NU_HIGHER", "base_rates": "NBASE_RATES",
    "weights": "NWEIGHTS", "direction": "NDIRECTION",
}  # fmt: skip  # a table
_DERIVATIVES = ("j", "s", "a_higher", "u_dot", "u_ddot", "u_higher", "base_rates")
#: Arguments read only by the functions of a Taylor stepper.
_SERIES = ("followed", "t_k", "q_k", "v_k", "z_k", "sums", "left", "right", "kept", "previous", "order")


def _starts(items: Sequence[Addition]) -> dict[tuple[int, ...], int]:
    """Return the first addition that has each table of starts."""
    result: dict[tuple[int, ...], int] = {}
    for number, item in enumerate(items):
        if item.starts:
            result.setdefault(item.starts, number)
    return result


@lru_cache(64)  # of the additions of a loop, declared before they are read
def _lookup(name: str, values: tuple[int, ...]) -> Lookup:
    return Lookup(name, values, len(values) > 100)  # shorter ones stand in one line


class CNames:
    """C texts for the names, declarations and argument lists of one Program, used by the templates."""

    #: Whether steppers keep cosines and sines of the distances in a grid of times.
    keeps_turns = True
    #: Word before large functions of steppers that are called from several places, before more of a large model, and
    #: before arcs, exponentials, logarithms and powers.
    called, in_large, elementary = "", "", "inline"

    def __init__(self, program: Program) -> None:
        self.program = program
        self.prefix = program.prefix
        self._rows: dict[tuple[tuple[int, ...], ...], RowLookup] = {}

    def input_type(self, block: str) -> str:
        """Return the declaration of an input argument: ``const real *q``."""
        if block == "p":
            return f"const {self.prefix}_parameters *p"
        if block == "base":
            return f"const {self.prefix}_base_state *base"
        return "real t" if block == "t" else f"const real *{block}"

    def output_type(self, argument: str, *, real: str = "real", restrict: bool = True) -> str:
        """Return the declaration of an array that a function fills: ``real *restrict tau``. ``real``: number type."""
        return f"{real} *{'restrict ' if restrict else ''}{argument}"

    def input_size(self, block: str) -> str:
        """Return the number of reals in an input block as C text: a macro of the model's header, ``1`` for ``t``."""
        if block == "p":
            return f"{self.prefix.upper()}_NP"
        if block == "base":
            return f"{self.prefix.upper()}_NBASE"
        return "1" if block == "t" else f"{self.prefix.upper()}_{_POINTERS[block]}"

    def constant_macros(self) -> dict[float, str]:
        """Return the macros of the numbers that have a name."""
        return {named.value: f"{self.prefix.upper()}_{named.member}" for named in self.program.constants}

    def base_members(self) -> list[str]:
        """Return the members of the base's state, component by component: ``position[2]``."""
        return [f"{name}[{index}]" for name, size, _ in self.program.base_fields for index in range(size)]

    def base_targets(self) -> list[str]:
        """Return the argument in which the function ``base`` stores components."""
        return [f"base->{member}" for member in self.base_members()]

    def input_texts(self) -> dict[str, str | Sequence[str]]:
        """Return the texts by which statements read input blocks: for arrays one with ``{}`` for the component,
        ``q[{}]``. For the structs ``p`` and ``base``, a list with the text of each component."""
        texts: dict[str, str | Sequence[str]] = {block: block + "[{}]" for block in _POINTERS}
        texts |= {block: block + "[{}]" for block in _SERIES}
        texts["t"] = "t"
        texts["p"] = [f"p->{parameter.member}" for parameter in self.program.parameters]
        texts["base"] = self.base_targets()
        return texts

    def arguments(self, function: ProgramFunction, *, restrict: bool = False) -> str:
        """Return the parameter list of a function's declaration in C, inputs before outputs, ``void`` if empty.
        ``restrict`` adds this qualifier to outputs, as in definitions."""
        parts = [self.input_type(block) for block in function.inputs]
        if function.name == "base":
            parts.append(f"{self.prefix}_base_state *{'restrict ' if restrict else ''}base")
        else:
            parts += [self.output_type(output.argument, restrict=restrict) for output in function.outputs]
        return ", ".join(parts) or "void"

    @staticmethod
    def call_arguments(function: ProgramFunction) -> str:
        """Return the arguments with which a function calls another of the same inputs and outputs."""
        return ", ".join([*function.inputs, *(output.argument for output in function.outputs)])

    @property
    def place_type(self) -> str:
        """Type of places in the workspace of a function in tables of shared stretches."""
        functions = self.program.functions
        sizes = [max((output.size for output in function.outputs), default=0) for function in functions]
        most = max([*sizes, *(function.workspace for function in functions)], default=0)
        return "unsigned short" if most <= MOST_SHORT else "int"

    @staticmethod
    def shared_outputs(text: ProgramShared) -> list[str]:
        """Return the arguments in which a shared stretch stores values: the workspace, then outputs of the caller."""
        return ["w", *(f"o{number}" for number in range(1, len(text.results)))]

    def shared_parameters(self, text: ProgramShared, real: str = "real") -> str:
        """Return the parameter list in C of a shared stretch: the workspace, outputs of the caller, places, numbers if
        any. ``real`` is the number type."""
        texts = [self.output_type(name, real=real) for name in self.shared_outputs(text)]
        texts.append(f"const {self.place_type} *restrict at")
        return ", ".join([*texts, *(["const double *restrict k"] if text.numbers else [])])

    def shared_stores(self, text: ProgramShared) -> Iterator[tuple[str, int, int]]:
        """Yield each argument in which a shared stretch stores values, the number of the first one, and how many."""
        ends = accumulate(text.results, initial=0)
        yield from zip(self.shared_outputs(text), ends, text.results, strict=False)

    @staticmethod
    def shared_comment(text: ProgramShared) -> str:
        """Return the C comment above a shared stretch: number of calls, labels of the equations."""
        labels = "; ".join(comment(label) for label in text.labels if label) or "repeated operations"
        numbers = " and numbers k[...]" if text.numbers else ""
        return f"/* {text.calls} calls with other places w[at[...]]{numbers}: {labels}. */"

    def part_arguments(self, function: ProgramFunction, number: int) -> str:
        """Return the parameter list in C of part ``number`` of a function: inputs read, workspace, outputs filled."""
        part = function.parts[number]
        texts = [self.input_type(block) for block in part.inputs]
        texts += ["real *restrict w"] if part.workspace else []
        if function.name == "base":
            texts += [f"{self.prefix}_base_state *restrict base"] if part.outputs else []
        else:
            texts += [self.output_type(function.outputs[index].argument) for index in part.outputs]
        return ", ".join(texts) or "void"

    def part_call(self, function: ProgramFunction, number: int) -> str:
        """Return the arguments of the call of a part by its function."""
        part = function.parts[number]
        texts = [*part.inputs, *(["w"] if part.workspace else [])]
        texts += [function.outputs[index].argument for index in part.outputs]
        return ", ".join(texts)

    def unused_arguments(self, function: ProgramFunction) -> list[str]:
        """Return the input arguments that no part of a function reads."""
        if function.same_as:
            return []
        used = {block for part in function.parts for block in part.inputs}
        return [block for block in function.inputs if block not in used]

    def is_on_tape(self, function: ProgramFunction) -> bool:
        """Return whether a function has statements of the tape engine, which declare their registers."""
        return any(item.kind in ("data", "registers") for part in function.parts for item in part.statements)

    @staticmethod
    def _call(
        function: ProgramFunction,
        output: Callable[[int, OutputArray], str],
        array: Callable[[int, str], str] = lambda _, block: block,
    ) -> str:
        """Return the arguments of a call with local copies of ``p``, ``t`` and ``base``. ``array`` and ``output`` give
        the texts of the other inputs and of the outputs, by number."""
        copies = {"p": "&p", "t": "t", "base": "&base"}
        texts = [copies.get(block) or array(number, block) for number, block in enumerate(function.inputs)]
        outputs = ["&base"] if function.name == "base" else [output(*item) for item in enumerate(function.outputs)]
        return ", ".join([*texts, *outputs])

    def direct_arguments(self, function: ProgramFunction) -> str:
        """Return the arguments with which the interface for doubles calls a function for sample ``i``, on the caller's
        arrays."""
        return self._call(
            function,
            lambda number, output: f"outputs[{number}] + i * {output.size}",
            lambda number, _: f"inputs[{number}] + i * strides[{number}]",
        )

    def buffered_arguments(self, function: ProgramFunction) -> str:
        """Return the arguments of a call from the other interfaces, as local copies."""
        return self._call(function, lambda _, output: output.argument)

    def buffers(self, function: ProgramFunction) -> list[tuple[str, str]]:
        """Return (name, C text of the size) of each local array into which a wrapper copies arguments. Such wrappers
        exist if the caller's number type is not double; parameters and base (structs) and t are passed directly."""
        inputs = [(block, self.input_size(block)) for block in function.inputs if block not in ("p", "t", "base")]
        outputs = (
            [] if function.name == "base" else [(output.argument, str(output.size)) for output in function.outputs]
        )
        return inputs + outputs

    def rows(self, function: ProgramFunction) -> list[str]:
        """Return C texts of the addresses that a block of samples reads and writes, for prefetching. Each input is at
        sample ``next``, each output at sample ``here``; empty for more than ``MOST_ROWS`` addresses."""
        inputs = [
            f"inputs[{number}] + next * strides[{number}]"
            for number, block in enumerate(function.inputs)
            if block not in ("p", "t", "base")
        ]
        outputs = [] if function.name == "base" else function.outputs
        rows = [*inputs, *(f"outputs[{number}] + here * {output.size}" for number, output in enumerate(outputs))]
        return rows if len(rows) <= MOST_ROWS else []

    def main_arguments(self, function: ProgramFunction) -> str:
        """Return the arguments with which the stand-alone program calls a function: results go to arrays named
        ``<function>_<output>``."""
        return self._call(function, lambda _, output: f"{function.name}_{output.name}")

    def derivative_blocks(self) -> list[str]:
        """Return the blocks of time derivatives that functions take or drivers fill, in the order of arguments."""
        filled = {output.name for function in self.program.functions for output in function.outputs}
        taken = {block for function in self.program.functions for block in function.inputs}
        return [block for block in _DERIVATIVES if block in taken | filled]

    def driver_arguments(self, function: ProgramFunction) -> str:
        """Return the arguments of a call of a driver that fills input blocks."""
        return self._call(function, lambda _, output: output.name)

    def zeros_of_base(self) -> str:
        """Return the components of the base's state that are zero at all times, ``omega[0]``, in words."""
        return ", ".join(map(base_component, self.program.base_zeros))

    def places(self, loop: ProgramLoop) -> RowLookup:
        """Return the table of places from which the elements of a loop gather values; equal tables are shared."""
        if loop.places not in self._rows:
            self._rows[loop.places] = RowLookup(loop.places)
        return self._rows[loop.places]

    def loop_inputs(self, loop: ProgramLoop) -> dict[str, str | Sequence[str]]:
        """Return the C texts by which the statements of a loop read input blocks, by block. Blocks: ``element``
        (constants), ``shared``, ``gather`` (by range, or by table of places) and ``carry``."""
        column = iter(range(len(loop.index)))
        at = "h[at[{}]]" if loop.places and self.places(loop).row else "g[places[element][{}]]"
        return {
            "element": f"K(constants[{{}}][element{' + lane' if loop.lanes > 1 else ''}])",
            "shared": [f"g[{index}]" for index in loop.shared],
            "gather": [
                f"g[{chosen([(end, place(start, step, 'element')) for end, start, step in result], 'element')}]"
                if result
                else at.format(next(column))
                for result in loop.index
            ],
            "carry": "carry[{}]",
        }

    def loop_parameters(self, loop: ProgramLoop, real: str = "real") -> str:
        """Return the parameters of a loop: inputs, and outputs or targets of additions."""
        names = [f"r{k}" for k in range(loop.outputs)] if loop.additions else ["r"]
        return ", ".join([f"const {real} *restrict g", *(self.output_type(name, real=real) for name in names)])

    @staticmethod
    def addition_tables(items: Sequence[Addition]) -> str:
        """Return C declarations of the tables of columns and places of additions; none for equally spaced ones."""
        tables: dict[str, tuple[int, ...]] = {}
        for number, item in enumerate(items):
            tables |= {f"column{number}": item.columns, f"place{number}": item.places}
        tables = {name: values for name, values in tables.items() if len(ranges(values)) > 1}
        tables |= {f"start{number}": starts for starts, number in _starts(items).items()}
        return "".join(_lookup(name, values).declaration() for name, values in tables.items())

    @staticmethod
    def addition(items: Sequence[Addition], number: int, count: int) -> str:
        """Return the C statements that add a part of the row of ``element`` to an output: addition ``number`` of
        ``items``. ``count`` is the number of elements of the loop; conditions are printed if needed."""
        item = items[number]

        def at(name: str, values: tuple[int, ...]) -> str:
            (_, start, step), *more = ranges(values)
            return _lookup(f"{name}{number}", values).at("j") if more else place(start, step, "j")

        conditions = [f"element >= {item.first}"] if item.first else []
        conditions += [f"element < {item.end}"] if item.end < count else []
        element = f"(element - {item.first})" if item.first else "element"
        at_place = at("place", item.places)
        if item.starts:
            start = _lookup(f"start{_starts(items)[item.starts]}", item.starts).at("element")
            at_place = start if at_place == "0" else f"{start} + {at_place}"
        target = f"r{item.output}[{shift(at_place, item.step, element)}]"
        value = f"row[{at('column', item.columns)}]"
        lines = [f"for (j = 0; j < {len(item.columns)}; ++j)"]
        lines.append(f"    {target} = {target} {'+' if item.sign > 0 else '-'} {value};")
        if conditions:
            lines = [f"if ({' && '.join(conditions)})", *(f"    {line}" for line in lines)]
        return "\n".join(f"        {line}" for line in lines)

    @staticmethod
    def loop_outputs(loop: ProgramLoop) -> list[str | Sequence[str]]:
        """Return the C texts of a loop element's three results: terms of sums, next carries, components of the row."""
        if loop.additions:
            return ["term", "next", "row"]
        head = loop.sums + len(loop.initial)
        start = f"{head} + " if head else ""
        width = f"{loop.stacked} * element" if loop.stacked > 1 else "element"
        rows = [f"r[{start}{width}{f' + {k}' if k else ''}]" for k in range(loop.stacked)]
        return ["term", "next", rows]
