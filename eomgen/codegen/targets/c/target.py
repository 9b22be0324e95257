"""The C target: the folder of a Program, file by file from one Jinja environment, and the files of a library with the
interface that all compiled models share; the functions of a large model over several files, which compilers take side
by side.

The text of the interface is both the cdef for cffi and a C header. ``eomgen_call`` evaluates one function for ``count``
samples. Input ``j`` (in the order of the function's inputs) of sample ``i`` starts at ``inputs[j] + i * strides[j]``; a
stride of 0 gives all samples the same values. Outputs are contiguous, sample after sample. A complex model takes and
gives pairs of doubles; strides count doubles.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from eomgen.base.data import dataclass, field, replace
from eomgen.base.rounding import COMPUTED
from eomgen.codegen.folder import MANIFEST, manifest
from eomgen.codegen.metadata import stack_bytes
from eomgen.codegen.program import PART_LIMIT, FunctionPart, Program, ProgramFunction, ProgramLoop, ProgramShared
from eomgen.codegen.scheduling.joining import LANES
from eomgen.codegen.scheduling.matrix_loops import in_loops
from eomgen.codegen.scheduling.rerolling import READ
from eomgen.codegen.scheduling.sharing import NUMBER
from eomgen.codegen.targets.c.interface import fingerprint, interface_header
from eomgen.codegen.targets.c.naming import CNames, comment, local_names
from eomgen.codegen.targets.c.printer import NumberTable, Printer, counts, indent_lines, number, wrap_text
from eomgen.codegen.targets.c.stepper import stepper_names
from eomgen.codegen.targets.c.tables import curve_tables
from eomgen.codegen.targets.c.tape_code import FUNCTIONS, OPERATIONS, functions_of_data
from eomgen.codegen.targets.c.uniform import MEANINGS, Uniform
from eomgen.system.system import INPUT_BLOCKS

#: Operations per C file, roughly; a file this long compiles in half a second, and an arm of seven joints has three.
FILE_LIMIT = 2 * PART_LIMIT
#: Operations in a statement of a loop, roughly.
_PER_STATEMENT = 2


@dataclass
class SourceFile:
    """A C file of a model: the functions, parts of long functions, loops and shared stretches that the file defines.
    ``name`` has no suffix; ``parts`` are (function, index of the part); loops and shared stretches are numbers in the
    Program; ``later``: no run calls the functions of the file; ``together``: its shared stretches have
    functions that compute several calls together."""

    name: str
    functions: list[ProgramFunction] = field(default_factory=list)
    parts: list[tuple[ProgramFunction, int]] = field(default_factory=list)
    loops: list[int] = field(default_factory=list)
    shared: list[int] = field(default_factory=list)
    operations: int = 0
    later: bool = False
    together: bool = False


def plan_files(program: Program, limit: int = FILE_LIMIT, later: Collection[str] = ()) -> list[SourceFile]:
    """Return the files of a Program; the first file has the prefix as name and calls the parts in the other files.

    Parameters
    ----------
    limit : operations of a file, roughly
    later : functions that stand in files of their own at the end, with the loops and shared stretches that these
        functions alone use
    """
    total = sum(function.operations for function in program.functions)
    total += sum(_PER_STATEMENT * len(loop.statements) for loop in program.loops)
    total += sum(text.operations for text in program.shared)
    # from eight files on longer ones: compilers take 45 ms for each before its first function, and no more run at once
    limit = max(limit, min(2 * limit, total // 8))
    loops, shared = set(range(len(program.loops))), set(range(len(program.shared)))
    if not later:
        return _plan_files(program, [], program.functions, sorted(loops), sorted(shared), total, limit)
    early = [function for function in program.functions if function.name not in later]
    parts = [part for function in (*early, *program.series) for part in function.parts]
    used = list(_called_bodies([*parts, *([program.base_of_step] if program.base_of_step else [])]))
    of_runs = {kind: {number for name, number in used if name == kind} for kind in ("loop", "share")}
    files = _plan_files(program, [], early, sorted(of_runs["loop"]), sorted(of_runs["share"]), total, limit)
    rest = [function for function in program.functions if function.name in later]
    loops, shared = loops - of_runs["loop"], shared - of_runs["share"]
    return [*files, *_plan_files(program, files, rest, sorted(loops), sorted(shared), total, limit)]


def _called_bodies(parts: Iterable[FunctionPart]) -> Iterator[tuple[str, int]]:
    """Yield the kind ``loop`` or ``share``, and the number, of the loops and shared stretches that parts call."""
    for part in parts:
        for item in part.statements:
            if item.kind in ("loop", "add", "share"):
                yield "share" if item.kind == "share" else "loop", item.data[0]


def _called_together(program: Program) -> tuple[set[int], set[int]]:
    """Return the shared stretches with several calls that are computed together, and the ones with other calls."""
    parts = [part for function in program.functions for part in function.parts]
    sizes = [text.places for text in program.shared]
    calls = [item.data for part in parts for item in part.statements if item.kind == "share"]
    together = {number_ for number_, places, *_ in calls if len(places) > sizes[number_]}
    return together, {number_ for number_, places, *_ in calls if len(places) == sizes[number_]}


def _plan_files(
    program: Program,
    before: Sequence[SourceFile],
    functions: Sequence[ProgramFunction],
    loops: Sequence[int],
    shared: Sequence[int],
    total: int,
    limit: int,
) -> list[SourceFile]:
    """Return the files of some functions, loops and shared stretches (numbers in the Program), numbered after
    ``before``. ``total``: operations of the whole Program; up to ``limit`` of them all stand in one file."""

    def new() -> SourceFile:
        number_ = len(before) + len(files) + 1
        return SourceFile(f"{program.prefix}_{number_}" if number_ > 1 else program.prefix, later=bool(before))

    def room(operations: int, limit: int) -> SourceFile:
        if files[-1].operations and files[-1].operations + operations > limit:
            files.append(new())
        return files[-1]

    files: list[SourceFile] = []
    files.append(first := new())
    for function in functions:
        if len(function.parts) > 1 and total > limit:
            for number_, part in enumerate(function.parts):
                target = room(part.operations, limit)
                target.parts.append((function, number_))
                target.operations += part.operations
            first.functions.append(function)
        else:
            target = room(function.operations, limit)
            target.functions.append(function)
            target.operations += function.operations
            target.parts += [(function, number_) for number_ in range(len(function.parts)) if len(function.parts) > 1]
    together, single = _called_together(program) if shared and total > limit else (set[int](), shared)
    for number_ in sorted(set(single).intersection(shared)):
        operations = program.shared[number_].operations
        target = room(operations, limit if total > limit else total)
        target.shared.append(number_)
        target.operations += operations
    for number_ in loops:
        operations = _PER_STATEMENT * len(program.loops[number_].statements)
        target = min(files, key=lambda file: file.operations) if total > limit else first
        if target.operations and target.operations + operations > limit and total > limit:
            files.append(target := new())
        target.loops.append(number_)
        target.operations += operations
    for number_ in sorted(together.intersection(shared)):
        operations = program.shared[number_].operations
        if not (target := room(operations, limit)).together:
            files.append(target := new())
            target.together = True
        target.shared.append(number_)
        target.operations += operations
    return files


#: Meaning of the argument of ``eomgen_size``.
SIZES = ("functions", "q", "v", "z", "u", "p", "lam", "bodies", "base")
#: Distance at which an argument of a curve counts as a break, relative to the argument, or as an end, relative to the
#: range.
SNAP = 8.0 * sys.float_info.epsilon
EDGE = COMPUTED
#: Tables of numbers are private to a library, so that code reads entries without a lookup of addresses.
_HIDDEN = '__attribute__((visibility("hidden")))'
#: The function by which a library takes its tables from the loader.
_TAKE_TABLES = (
    '__attribute__((visibility("default"))) void eomgen_take_tables(const char *fingerprint, const double *numbers,'
    " const void *heads, const void *code)"
)
#: Endings of templates with lines that are long on purpose, or never.
_NOT_FOLDED = ("README.md.jinja", "c/model/tables.c.jinja")


class _Context:
    """Texts and functions for every template of a Program; ``render`` prints a template with these.

    Parameters
    ----------
    file_limit : operations of a C file, roughly
    apart : whether the numbers of the functions stand in tables of another file
    tape : whether the tape engine evaluates functions
    later : names of functions in files at the end, see ``plan_files``
    ready : texts of files that were written before, by name
    names : the names and declarations of the language
    """

    def __init__(
        self,
        program: Program,
        file_limit: int,
        *,
        apart: bool = False,
        tape: bool = False,
        later: Collection[str] = (),
        ready: Mapping[str, str] = MappingProxyType({}),
        names: type[CNames] = CNames,
    ) -> None:
        """Plan the C files and prepare the names and tables that the templates read."""
        self.program = program
        self.ready = ready
        self.tape = tape
        self.apart = apart
        self.number_tables: dict[str, NumberTable] = {}
        self._bodies: dict[tuple[str, int], str] = {}
        self.c = names(program)
        self.files = plan_files(program, sys.maxsize if tape else file_limit, later)
        self.together = {number_ for file in self.files if file.together for number_ in file.shared}
        self.stepper = stepper_names(program) if program.method else {}
        self.tables = curve_tables(program.curves)

    def numbers(self, name: str) -> NumberTable | None:
        """Return the table of numbers of a function, None if numbers stand in the text."""
        if not self.apart:
            return None
        return self.number_tables.setdefault(name, NumberTable(f"{self.program.prefix}_{name}_numbers"))

    @property
    def filled_tables(self) -> list[NumberTable]:
        """The tables of numbers of the functions that were printed before."""
        return [table for table in self.number_tables.values() if table.values]

    def value(self, name: str, number_: float) -> str:
        """Return the C text of a number that is alone in a statement of function ``name``, or of a table's entry for
        it."""
        table = self.numbers(name)
        return number(number_) if table is None else f"{table.name}[{table.first_of([float(number_)])}]"

    def values(self, name: str, columns: Iterable[Sequence[float]]) -> str:
        """Append columns of numbers to the table of function ``name`` and return the C address of the first one. Empty
        if numbers stand in the text, or for no numbers."""
        table = self.numbers(name)
        entries = [float(number_) for column in columns for number_ in column]
        return "" if table is None or not entries else f"&{table.name}[{table.first_of(entries)}]"

    def declaration(self, name: str) -> str:
        """Return the C declaration of the table of numbers of function ``name`` as printed; empty without."""
        table = self.number_tables.get(name)
        if table is None or not table.values:
            return ""
        return f"extern const double {table.name}[{len(table.values)}] {_HIDDEN};\n"

    def body(self, function: ProgramFunction, part: int) -> str:
        """Return the C statements of one part of a function, indented, each line ended; printed once per part."""
        key = (function.name, part)
        if key not in self._bodies:
            self._bodies[key] = self._body(function, part)
        return self._bodies[key]

    def numbers_of(self, function: ProgramFunction, part: int) -> str:
        """Return the declaration of the numbers of one part."""
        self.body(function, part)
        return self.declaration(_part_name(function, part))

    def _body(self, function: ProgramFunction, part: int) -> str:
        """Return the C statements of one part of a function, with declarations; ``part`` is the index."""
        outputs = (
            [self.c.base_targets()] if function.name == "base" else [output.argument for output in function.outputs]
        )
        statements = function.parts[part].statements
        declared = ["int i;"] if any(counts(statement) for statement in statements) else []
        taken = {*function.inputs, *(output.argument for output in function.outputs)}
        names = local_names(function.parts[part].names, taken)
        macros = self.c.constant_macros()
        known = (
            function.name in self.program.function_names
        )  # other functions belong to a stepper, which lanes translate
        numbers = self.numbers(_part_name(function, part)) if known else None
        texts, prefix, places = self.c.input_texts(), self.program.prefix, self.c.place_type
        printer = Printer(texts, outputs, prefix, constants=macros, names=names, numbers=numbers, place_type=places)
        printer.shared, printer.together = self.program.shared, self.together
        return indent_lines([*declared, *printer.lines(statements)], 1)

    def base_of_step(self) -> str:
        """Return the C statements that fill the components of ``work->base`` that the equations of a step read."""
        part = self.program.base_of_step
        if part is None:
            return ""
        members = self.c.base_members()
        targets = [f"work->base.{members[component]}" for component in self.program.base_read]
        names, macros = local_names(part.names, {"p", "t", "work"}), self.c.constant_macros()
        printer = Printer(self.c.input_texts(), [targets], self.program.prefix, constants=macros, names=names)
        return indent_lines(printer.lines(part.statements), 1)

    def kernel(self, loop: ProgramLoop, number_: int) -> str:
        """Return the C statements that compute the results of one element of loop ``number_``, from 1."""
        printer = Printer(self.c.loop_inputs(loop), self.c.loop_outputs(loop), numbers=self.numbers(f"loop{number_}"))
        return indent_lines(printer.lines(loop.statements), 3 if loop.lanes > 1 else 2)

    def shared_statements(self, text: ProgramShared, number_: int, *, together: bool = False) -> str:
        """Return the C statements in the function of shared stretch ``number_``, from 1, or in the function that
        computes several calls ``together``: with values of all calls in arrays."""
        name = f"shared{number_}_together" if together else f"shared{number_}"
        inputs: dict[str, str | Sequence[str]] = {READ: "w[at[{}]]", NUMBER: "K(k[{}])"}
        if together:
            inputs = {READ: "r[{}]", NUMBER: "n[{}]"}
        outputs = [
            [f"s[{k}]" if together else f"{target}[at[{text.reads + k}]]" for k in range(first, first + size)]
            for target, first, size in self.c.shared_stores(text)
        ]
        macros, numbers = self.c.constant_macros(), self.numbers(name)
        printer = Printer(inputs, outputs, self.program.prefix, constants=macros, numbers=numbers)
        return indent_lines(printer.lines(text.statements), 2 if together else 1)

    def file(self, name: str, template: str) -> tuple[str, str]:
        """Return the name and the text of a file that may be written before the functions are scheduled."""
        return name, self.ready.get(name) or self.render(template)

    def render(self, template: str, **extra: object) -> str:
        """Return the text of a template for the Program, with long lines folded; ``extra`` are further names."""
        from eomgen.codegen.targets.c.templates import environment  # noqa: PLC0415  # known texts need no Jinja

        program = self.program
        text = (
            environment()
            .get_template(template)
            .render(
                program=program,
                prefix=program.prefix,
                upper=program.prefix.upper(),
                c=self.c,
                files=self.files,
                split=len(self.files) > 1,
                body=self.body,
                numbers_of=self.numbers_of,
                declaration=self.declaration,
                value=self.value,
                values=self.values,
                apart=self.apart,
                hidden=_HIDDEN,
                take_tables=_TAKE_TABLES,
                kernel=self.kernel,
                shared_statements=self.shared_statements,
                lanes=LANES,
                base_of_step=self.base_of_step(),
                tables=self.tables,
                tape=self.tape,
                **self.stepper,
                **extra,
            )
        )
        return text if template.endswith(_NOT_FOLDED) else wrap_text(text)


def generate_files(program: Program, *, file_limit: int = FILE_LIMIT) -> dict[str, str]:
    """Return the stand-alone folder of a Program: file name to text. The same Program gives the same bytes.

    ``<prefix>.h``, ``<prefix>.c`` (and ``<prefix>_2.c``... of large models), ``<prefix>_step.c`` if there is a
    method, ``<prefix>_curves.c`` if there are curves, and ``<prefix>_tables.c`` if these are long, C files that
    the scene brings along, ``main.c``, ``eomgen_real.h``, ``README.md`` and ``manifest.json``.
    """
    return _files(_Context(program, file_limit))


class LibraryTexts:
    """Texts of a library by name, each written when it is asked for, headers before the sources that include them; with
    the last text all numbers are known.

    Attributes
    ----------
    written : the texts that were asked for
    apart : whether the loader of the library hands the numbers over
    """

    def __init__(self, context: _Context, texts: Iterable[tuple[str, str]], written: dict[str, str]) -> None:
        self._context, self._texts, self.written = context, texts, written
        self.apart = context.apart

    def __iter__(self) -> Iterator[tuple[str, str]]:
        for name, text in self._texts:
            self.written[name] = text
            yield name, text

    @property
    def numbers(self) -> dict[str, Sequence[float]]:
        """Numbers of the functions by the name of their array in C, in the order in which the library takes them; none
        if the numbers are in the texts."""
        return {table.name: table.values for table in self._context.filled_tables}


def written_library(
    program: Program, bytecode: Path, *, apart: bool = False, ready: Mapping[str, str] = MappingProxyType({})
) -> LibraryTexts:
    """Return the texts of a library: the sources of ``generate_files`` but for ``main.c``, and the generic interface.

    Texts are printed one by one as the caller takes each.

    Parameters
    ----------
    program : Program
    bytecode : the folder for the bytecode of the templates if the folder of the templates cannot be written
    apart : whether the loader of the library hands the numbers of the functions over, so that the texts are the same
        for other numbers
    ready : the files of ``written_stepper``, if these were written
    """
    context = _context_of_library(program, bytecode, apart=apart, ready=ready)
    written: dict[str, str] = {}

    def texts() -> Iterator[tuple[str, str]]:
        yield from _sources(context)
        if apart:
            yield _numbers(context)
        yield from _interface(context, "" if apart else fingerprint(written)).items()

    return LibraryTexts(context, texts(), written)


def written_on_tape(
    program: Program, bytecode: Path, ready: Mapping[str, str] = MappingProxyType({})
) -> dict[str, str]:
    """Return the files of the library of a Program on the tape engine, headers first.

    ``<prefix>.c`` has the functions that the stepper calls, the interface, and the stepper if all functions are data:
    compilers take 20 ms for each file before the first function.

    Parameters
    ----------
    bytecode, ready : as of ``written_library``
    """
    prefix, data = program.prefix, functions_of_data(program)
    context = _context_of_library(program, bytecode, apart=False, tape=True, ready=ready)
    step = dict([_stepper(context)]) if program.method else {}
    context.ready = {**ready, **step}
    (file,) = context.files
    called = {f.same_as for f in program.functions} | {f.name for f in program.functions if f.name not in data}
    called |= {f.name for f in program.functions for text in step.values() if f"{prefix}_{f.name}(" in text}
    file.functions = [function for function in file.functions if function.name in called]
    files = dict(_sources(context)) | _interface(context, "", data)
    whole = len(data) == len(program.functions)
    joined = [f"{prefix}.c", *(step if whole else ()), "interface.c"]
    parts = [files.pop(name) for name in joined]
    return {**files, f"{prefix}.c": "\n".join(parts)}


def written_stepper(program: Program, bytecode: Path, *, tape: bool = False) -> dict[str, str]:
    """Return the source of the stepper of a library, and before it the headers that it includes, of a Program whose
    functions may have no statements.

    Parameters
    ----------
    bytecode : as of ``written_library``
    tape : whether the library is on the tape engine, else its numbers are in a separate file
    """
    context = _context_of_library(program, bytecode, apart=not tape, tape=tape)
    prefix = program.prefix
    real, header = ("eomgen_real.h", "c/model/eomgen_real.h.jinja"), (f"{prefix}.h", "c/model/model.h.jinja")
    return {**dict(context.file(*item) for item in (real, header)), **dict([_stepper(context)])}


@dataclass
class LibraryInTwo:
    """Files of a library that is used before all of its functions are compiled, each written when it is asked for.

    Attributes
    ----------
    of_runs : the files of a library with the functions that runs call
    whole : after these, all files of the library with all functions; the same texts but for the interface and the
        declarations of the numbers
    straight : as of ``straight_sources``
    """

    of_runs: LibraryTexts
    whole: LibraryTexts
    straight: frozenset[str]


def written_in_two(program: Program, bytecode: Path, ready: Mapping[str, str] = MappingProxyType({})) -> LibraryInTwo:
    """Return the texts of a library whose functions ``program.later`` come later; the loader has the numbers.

    Parameters
    ----------
    bytecode, ready : as in ``written_library``
    """
    context = _context_of_library(program, bytecode, apart=True, later=program.later, ready=ready)
    early: dict[str, str] = {}

    def run_files() -> Iterator[tuple[str, str]]:
        yield from _sources(context)
        yield _numbers(context)
        yield from _interface(context, "", program.later).items()

    def whole() -> Iterator[tuple[str, str]]:
        last = (f"{program.prefix}_numbers.c", "interface.h", "interface.c")
        yield from [item for item in early.items() if item[0] not in last]
        yield from _later_sources(context)
        yield _numbers(context)
        yield from _interface(context, "").items()

    straight = _straight(program, context.files)
    return LibraryInTwo(LibraryTexts(context, run_files(), early), LibraryTexts(context, whole(), {}), straight)


def _context_of_library(
    program: Program,
    bytecode: Path,
    *,
    apart: bool,
    tape: bool = False,
    later: Collection[str] = (),
    ready: Mapping[str, str] = MappingProxyType({}),
) -> _Context:
    """Return the context for the texts of a library, and set the folder ``bytecode`` for compiled templates. Other
    arguments are as in ``_Context``; on the tape engine, eliminations that are written out become loops."""
    from eomgen.codegen.targets.c.templates import environment, kept_bytecode  # noqa: PLC0415

    environment().bytecode_cache = kept_bytecode(bytecode)
    if apart:
        program = replace(program, constants=())  # macros of constants would change a header that all sources include
    if tape:
        program = replace(program, method=in_loops(program.method))
    return _Context(program, FILE_LIMIT, apart=apart, tape=tape, later=later, ready=ready)


def _numbers(context: _Context) -> tuple[str, str]:
    """Return name and text of the file with the tables of the functions that were printed before."""
    text = context.render("c/model/numbers.c.jinja", number_tables=context.filled_tables)
    return f"{context.program.prefix}_numbers.c", text


def _part_name(function: ProgramFunction, part: int) -> str:
    return f"{function.name}_part{part + 1}" if len(function.parts) > 1 else function.name


def straight_sources(program: Program) -> frozenset[str]:
    """Return the names of the files with functions of a model with several files, if the functions have no loops."""
    return _straight(program, plan_files(program, FILE_LIMIT))


def _straight(program: Program, files: Sequence[SourceFile]) -> frozenset[str]:
    if len(files) == 1 or program.loops:
        return frozenset()
    return frozenset(f"{file.name}.c" for file in files)


def _files(context: _Context) -> dict[str, str]:
    files = dict(_sources(context))
    files["main.c"] = context.render(f"c/{'controller' if context.program.controller else 'main'}/main.c.jinja")
    return files | _documents(context, files, fingerprint(files))


def _sources(context: _Context) -> Iterator[tuple[str, str]]:
    """Yield (name, text) of all headers and then all sources of a model, but for the files of ``_later_sources``.
    Printed when taken; ``main.c`` and the interface of libraries are not among these."""
    program, prefix = context.program, context.program.prefix
    yield context.file("eomgen_real.h", "c/model/eomgen_real.h.jinja")
    yield context.file(f"{prefix}.h", "c/controller/header.h.jinja" if program.controller else "c/model/model.h.jinja")
    if len(context.files) > 1:
        yield f"{prefix}_parts.h", context.render("c/model/parts.h.jinja")
    if program.curves:
        yield f"{prefix}_curves.h", context.render("c/model/curves.h.jinja")
    if program.external:
        yield f"{prefix}_external.h", context.render("c/model/external.h.jinja")
    if context.tape:
        yield "eomgen_tape.h", context.render("c/model/eomgen_tape.h.jinja")
        yield "eomgen_tape.c", context.render("c/model/eomgen_tape.c.jinja", operations=OPERATIONS, unary=FUNCTIONS)
    for file in context.files:
        if not file.later:
            yield f"{file.name}.c", context.render(_template(file), file=file)
    if program.method:
        yield _stepper(context)
    if program.controller:
        yield f"{prefix}_step.c", context.render("c/controller/step.c.jinja")
    if program.curves:
        yield f"{prefix}_curves.c", context.render("c/model/curves.c.jinja", snap=SNAP, edge=EDGE)
    if any(table.is_packed for table in context.tables):
        yield f"{prefix}_tables.c", context.render("c/model/tables.c.jinja")
    if program.external:
        yield f"{prefix}_external.c", context.render("c/model/external.c.jinja", **_external_context(program))
    for source in program.sources:
        text = source.text if source.text.endswith("\n") else f"{source.text}\n"
        yield source.name, context.render("c/model/user_source.c.jinja", source=source) + text
    if program.uniform:
        texts = {"uniform": Uniform(program), "arrays": [(block, MEANINGS[block]) for block in INPUT_BLOCKS]}
        yield "eomgen_uniform.h", context.render("c/uniform/eomgen_uniform.h.jinja", **texts)
        yield f"{prefix}_uniform.h", context.render("c/uniform/model.h.jinja", **texts)
        yield f"{prefix}_uniform.c", context.render("c/uniform/model.c.jinja", **texts)


def _template(file: SourceFile) -> str:
    return "c/model/together.c.jinja" if file.together else "c/model/model.c.jinja"


def _stepper(context: _Context) -> tuple[str, str]:
    from eomgen.codegen.targets.c.templates import stepper_template  # noqa: PLC0415  # known texts need no Jinja

    program = context.program
    return context.file(f"{program.prefix}_step.c", stepper_template(program.method["family"]))


def _later_sources(context: _Context) -> Iterator[tuple[str, str]]:
    """Yield the sources of functions that are compiled later."""
    for file in context.files:
        if file.later:
            yield f"{file.name}.c", context.render(_template(file), file=file)


def _external_context(program: Program) -> dict[str, Any]:
    """Return ``prototypes`` of external functions in C, and ``stems``: names of the calling C functions by label."""
    prototypes = dict.fromkeys(text for source in program.sources for text in source.prototypes)
    labels = list(dict.fromkeys(item.label for item in program.external))
    stems = {label: f"law{number}" for number, label in enumerate(labels, 1)}
    return {"prototypes": list(prototypes), "stems": stems}


def _documents(context: _Context, files: Mapping[str, str], mark: str) -> dict[str, str]:
    """Return the texts of README.md and manifest.json; ``files`` are the other files, ``mark`` is the fingerprint."""
    program = context.program
    sources = sorted(name for name in files if name.endswith(".c"))
    command = compile_command(program, sources)
    texts = {"command": command, "examples": _examples(program), "stack": stack_bytes(program)}
    uniform = Uniform(program)
    template = "c/controller/README.md.jinja" if program.controller else "c/main/README.md.jinja"
    readme = {"README.md": context.render(template, **texts, uniform=uniform)}
    whole = {**files, **readme}
    kind: dict[str, Any] = {"method": program.method["title"]} if program.method else {}
    if program.controller:
        kind["controller"] = {key: program.controller[key] for key in ("tick", "clocks")}
    if program.uniform:
        kind["uniform"] = uniform.manifest()
    return {**readme, MANIFEST: manifest(program, whole, fingerprint=mark, compile=command, **kind)}


def render_files(program: Program, templates: Mapping[str, str], **extra: object) -> dict[str, str]:
    """Return texts by file name: the functions of a Program, and files by templates that mechanical models do not have.

    Parameters
    ----------
    templates : path of the template, by the name of the file
    extra : names for the templates besides the Program
    """
    context = _Context(program, FILE_LIMIT)
    files = {"eomgen_real.h": context.render("c/model/eomgen_real.h.jinja")}
    if len(context.files) > 1:
        files[f"{program.prefix}_parts.h"] = context.render("c/model/parts.h.jinja")
    for file in context.files:
        files[f"{file.name}.c"] = context.render(_template(file), file=file)
    return files | {name: context.render(template, **extra) for name, template in templates.items()}


def model_in_one_file(
    program: Program, names: type[CNames], templates: Mapping[str, str], **extra: object
) -> dict[str, str]:
    """Return texts by file name: the model with all functions in one file, its stepper, and files by templates.

    Parameters
    ----------
    names : names and declarations of a language into which C goes unchanged
    templates, extra : as of ``render_files``
    """
    context = _Context(program, sys.maxsize, names=names)
    return dict(_sources(context)) | {name: context.render(item, **extra) for name, item in templates.items()}


def generate_interface(program: Program, files: Mapping[str, str]) -> dict[str, str]:
    """Return the files of a loadable library besides the model's files: the generic interface and the header."""
    return _interface(_Context(program, FILE_LIMIT), fingerprint(files))


def _interface(context: _Context, mark: str, later: Collection[str] = ()) -> dict[str, str]:
    """Return interface.h and interface.c by name, with fingerprint ``mark``; calls of ``later`` are refused."""
    program = context.program
    sizes = [len(program.functions), *(program.sizes[name] for name in SIZES[1:])]
    offered = [item for item in enumerate(program.functions) if item[1].name not in later]
    texts = {"fingerprint": mark, "sizes": sizes, "offered": offered}
    return {"interface.h": interface_header(), "interface.c": context.render("c/interface/interface.c.jinja", **texts)}


def compile_command(program: Program, sources: list[str]) -> str:
    """Return the command that compiles the stand-alone folder with the bits of the ``reproducible`` profile, in the
    number type of the program."""
    real = "-DEOMGEN_REAL_FLOAT " if program.defaults.get("real") == "float" else ""
    return f"cc -std=c99 -O2 -ffp-contract=off {real}{' '.join(sources)} -o {program.prefix} -lm"


def _examples(program: Program) -> str:
    """Return arguments that set the first parameters and inputs to their present values."""
    return "".join(f" {comment(named.name)}={named.value:.6g}" for named in (*program.parameters, *program.inputs)[:2])
