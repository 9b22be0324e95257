"""Compiled libraries of Programs: whole, or in two: functions that runs call first, the others in the background."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass, field, without_garbage_collection
from eomgen.system.terms import Selection
from eomgen.toolchain.library import Successor
from eomgen.toolchain.tables import packed_tables

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.codegen.targets.c.target import LibraryInTwo, LibraryTexts
    from eomgen.codegen.targets.target import Names
    from eomgen.integrators.families.register import Method
    from eomgen.pipeline.structures import KnownLibrary, Structure
    from eomgen.system.system import System
    from eomgen.toolchain.builder import Builder
    from eomgen.toolchain.compiler import RunningCompilers
    from eomgen.toolchain.library import Library

#: Operations of the functions that no run calls from which on these are compiled after the others: half a second of a
#: compiler.
_MUCH = 3000


#: Operations of all functions from which on compilers begin with the stepper before the functions are scheduled.
_LONG = 4500


@dataclass
class EarlyTexts:
    """Texts of a library that are known before its functions are scheduled.

    Attributes
    ----------
    family : digest of the method's code and templates, if it is of another distribution
    texts : by name: of the stepper and its headers, if the stepper is compiled first; all texts of a library on the
        tape engine, if all of its functions are data
    apart : whether these are texts of a library with its numbers in a separate file
    structure : finds the structure of the model, None for a model whose library is not kept for other numbers
    known : the library, of an earlier model that differs in numbers alone
    """

    family: str = ""
    texts: dict[str, str] = field(default_factory=dict)
    apart: bool = True
    structure: Callable[[], Structure | None] = lambda: None
    known: KnownLibrary | None = None


def begin_library(
    builder: Builder,
    ready: EarlyTexts,
    system: System,
    data: Mapping[str, Any],
    functions: Sequence[str],
    names: Names,
) -> Program | None:
    """Look for a library that differs in numbers alone, and return a Program without statements if there is one. Else
    compile the stepper of a long model, or of one on the tape engine, while functions are scheduled, if its text
    depends on no statement; of a short model on the tape engine the whole library.

    Parameters
    ----------
    ready : completed
    data : of the method
    functions : of the model
    names : of the target
    """
    tape, counts = system.tape, system.counts
    if tape.maps or tape.curves or data.get("inputs") == "series" or builder.real != "double":
        return None
    from eomgen.codegen.convert import to_program  # noqa: PLC0415  # a library of the cache is not derived
    from eomgen.pipeline.structures import known_library, structure_of  # noqa: PLC0415

    program = to_program(system, data, functions, names=names, scheduled=False)
    ready.apart = not builder.profile.on_tape
    ready.structure = cache(partial(structure_of, system, functions, program, ready.family))
    if ready.apart:
        ready.known = known_library(builder, ready.structure())
        if ready.known is not None:
            return program
    from eomgen.toolchain.cache import TEMPLATES  # noqa: PLC0415

    templates = builder.cache.folder / TEMPLATES
    if not ready.apart:
        from eomgen.codegen.targets.c.interface import INTERFACE_CDEF  # noqa: PLC0415
        from eomgen.codegen.targets.c.tape_code import before_scheduling  # noqa: PLC0415
        from eomgen.codegen.targets.c.target import written_on_tape, written_stepper  # noqa: PLC0415

        if (printed := before_scheduling(program)) is not None:
            ready.texts |= written_on_tape(printed, templates)
            builder.begin_on_tape(ready.texts, INTERFACE_CDEF)
        else:
            ready.texts |= written_stepper(program, templates, tape=True)
            builder.begin_source(f"{program.prefix}_step.c", ready.texts, ())
    elif builder.profile.split and sum(counts[name].flops for name in functions) >= _LONG:
        from eomgen.codegen.targets.c.target import written_stepper  # noqa: PLC0415

        ready.texts |= written_stepper(program, templates)
        builder.begin_source(f"{program.prefix}_step.c", ready.texts, {f"{program.prefix}.c"})
    return None


def functions_of_runs(system: System, method: Method, called: Collection[str], start: str) -> set[str]:
    """Return the functions that runs call.

    Parameters
    ----------
    called : by the steps of the method, or to bring a state onto the constraints
    start : of the runs
    """
    early = set(Selection(None, start).functions(list(system.functions), called, implicit=method.implicit))
    if system.multipliers and start != "equilibrium":
        early -= {"residual"} - method.calls(system)  # runs take other functions, and analyses of a state the residual
    return early


def functions_for_later(program: Program, early: Collection[str]) -> tuple[str, ...]:
    """Return the functions of a Program that are not ``early``, nor called by an early one; none if the compilers are
    done with these soon."""
    called = {function.same_as for function in program.functions if function.name in early}
    later = [function for function in program.functions if function.name not in early and function.name not in called]
    work = sum(function.operations for function in later)
    return tuple(function.name for function in later) if work >= _MUCH else ()


def library_in_two(
    content: bytes,
    program: Callable[[], tuple[Program, str]],
    builder: Builder,
    marks: Mapping[str, Any],
    ready: EarlyTexts,
) -> Library:
    """Return the library with all functions from the cache; else, if it takes long, a library with the functions that
    runs call, whose successor has all functions and is compiled in the background.

    Objects of both are the same, so their functions have the same bits.

    Parameters
    ----------
    content : everything that the library depends on
    program : derives the Program, and the reason if the Program has no stepper
    marks : further data of the layout
    ready : texts that ``program`` finds in the cache
    """
    first = _known(content, builder)
    if first is None:
        with builder.claim(content):
            first = _known(content, builder) or _first(content, *program(), builder, marks, ready)
    if first.lacking and first.successor is None:  # of an earlier process: few processes call its other functions
        first.successor = Successor(partial(_whole, first, content, program, builder, None, ready), at_once=False)
    return first


def _known(content: bytes, builder: Builder) -> Library | None:
    """Return the library with all functions or with the functions of runs, if one is in the cache."""
    return builder.find(content) or builder.find(_of_runs(content))


def _of_runs(content: bytes) -> bytes:
    return content + b"\0of runs"


def _first(
    content: bytes,
    program: Program,
    refusal: str,
    builder: Builder,
    marks: Mapping[str, Any],
    ready: EarlyTexts,
) -> Library:
    """Return the library with the functions that runs call, and begin its successor; the library with all functions if
    the others do not take long."""
    if not program.later:
        return whole_library(program, refusal, builder, content, marks, None, ready)
    with without_garbage_collection():
        files = _written(program, builder, ready.texts)
        layout = {**_layout(program, refusal, marks), "later": program.later}
        tables = partial(_tables, files.of_runs)
        first = _built(program, builder, _of_runs(content), files.of_runs, layout, None, files.straight, tables)
    made = partial(_whole, first, content, lambda: (program, refusal), builder, files, ready)
    first.successor = Successor(made)
    return first


def _whole(
    first: Library,
    content: bytes,
    program: Callable[[], tuple[Program, str]],
    builder: Builder,
    files: LibraryInTwo | None,
    ready: EarlyTexts,
    running: RunningCompilers | None,
) -> Library:
    """Return the library with all functions.

    Parameters
    ----------
    files : of the first library, if its files were written before
    ready : with the library, if ``program`` finds one of the same structure
    running : as of ``Builder.build``
    """
    with builder.claim(content):
        cached = builder.find(content)
        if cached is not None:
            return cached
        made, _ = program()
        layout = {**first.layout, "later": (), "digest": first.digest}
        if ready.known is not None:
            return builder.with_tables(content, ready.known.entry, ready.known.tables, layout)
        if files is None:
            files = _written(made, builder, {})
            deque(files.of_runs, maxlen=0)
        from eomgen.pipeline.structures import keep_structure  # noqa: PLC0415

        tables = partial(_tables, files.whole, first.fingerprint)
        library = _built(made, builder, content, files.whole, layout, running, files.straight, tables)
        return keep_structure(builder, ready.structure(), library)


def _written(program: Program, builder: Builder, ready: Mapping[str, str]) -> LibraryInTwo:
    from eomgen.codegen.targets.c.target import written_in_two  # noqa: PLC0415  # a library of the cache is not written
    from eomgen.toolchain.cache import TEMPLATES  # noqa: PLC0415

    return written_in_two(program, builder.cache.folder / TEMPLATES, ready)


def _layout(program: Program, refusal: str, marks: Mapping[str, Any]) -> dict[str, Any]:
    """Return the layout of a library, with the reason if the Program has no stepper, and further data."""
    from eomgen.codegen.metadata import interface_layout  # noqa: PLC0415

    return {**interface_layout(program), "stepper_refused": refusal, **marks}


def _built(
    program: Program,
    builder: Builder,
    content: bytes,
    files: Mapping[str, str] | Iterable[tuple[str, str]],
    layout: Mapping[str, Any],
    running: RunningCompilers | None = None,
    straight: Collection[str] = (),
    tables: Callable[[], bytes] | None = None,
) -> Library:
    """Return the library of a Program, compiled of these files; ``tables``: as of ``Builder.build``."""
    from eomgen.codegen.targets.c.interface import INTERFACE_CDEF  # noqa: PLC0415
    from eomgen.codegen.targets.c.naming import file_name  # noqa: PLC0415

    written = {source.name: file_name(source.written) for source in program.sources}
    return builder.build(content, files, INTERFACE_CDEF, layout, written, running, straight, tables)


def _tables(texts: LibraryTexts, mark: str = "") -> bytes:
    """Return the tables of a library whose texts are written; ``mark``: its fingerprint, if it has one already."""
    from eomgen.codegen.targets.c.interface import fingerprint  # noqa: PLC0415

    return packed_tables(fingerprint(texts.written).encode(), texts.numbers, fingerprint=mark.encode())


def whole_library(
    program: Program,
    refusal: str,
    builder: Builder,
    content: bytes,
    marks: Mapping[str, Any],
    running: RunningCompilers | None,
    ready: EarlyTexts,
) -> Library:
    """Return the compiled library of a Program.

    Parameters
    ----------
    refusal : the reason if the Program has no stepper
    marks : further data of the layout
    running : as of ``Builder.build``
    ready : as of ``library_in_two``
    """
    with without_garbage_collection():
        if builder.profile.on_tape:
            return _library_on_tape(program, refusal, builder, content, marks, running, ready)
        from eomgen.pipeline.structures import keep_structure, known_library  # noqa: PLC0415

        apart = builder.real == "double"  # others convert literals while compiling, tables at each use
        structure = ready.structure() if apart else None
        if (known := ready.known or known_library(builder, structure)) is not None:
            layout = {**known.layout, "notes": program.notes, "stepper_refused": refusal, **marks}
            return builder.with_tables(content, known.entry, known.tables, layout)
        from eomgen.codegen.targets.c.target import straight_sources, written_library  # noqa: PLC0415
        from eomgen.toolchain.cache import TEMPLATES  # noqa: PLC0415

        texts = ready.texts if apart == ready.apart else {}
        files = written_library(program, builder.cache.folder / TEMPLATES, apart=apart, ready=texts)
        layout, tables = _layout(program, refusal, marks), partial(_tables, files) if files.apart else None
        library = _built(program, builder, content, files, layout, running, straight_sources(program), tables)
        return keep_structure(builder, structure, library)


def _library_on_tape(
    program: Program,
    refusal: str,
    builder: Builder,
    content: bytes,
    marks: Mapping[str, Any],
    running: RunningCompilers | None,
    ready: EarlyTexts,
) -> Library:
    """Return the library of a Program on the tape engine; arguments as of ``whole_library``."""
    from eomgen.codegen.targets.c.interface import fingerprint  # noqa: PLC0415
    from eomgen.codegen.targets.c.tape_code import functions_of_data, on_tape  # noqa: PLC0415
    from eomgen.codegen.targets.c.target import written_on_tape  # noqa: PLC0415
    from eomgen.toolchain.cache import TEMPLATES  # noqa: PLC0415

    printed, tape = on_tape(program)
    texts = {} if ready.apart else ready.texts
    early = f"{printed.prefix}.c" in texts and len(functions_of_data(printed)) == len(printed.functions)
    headers = {name: text for name, text in texts.items() if name != f"{printed.prefix}.c"}
    files = texts if early else written_on_tape(printed, builder.cache.folder / TEMPLATES, headers)
    heads = tape.placed_heads(len(printed.functions))
    data = packed_tables(fingerprint(files).encode(), {"tape": tape.numbers}, heads, tape.code)
    layout = _layout(printed, refusal, marks)
    if builder.is_compiling:
        from eomgen.pipeline import model  # noqa: F401, PLC0415  # which the caller needs next
        from eomgen.simulation import simulate  # noqa: F401, PLC0415  # likewise
    return _built(printed, builder, content, files, layout, running, tables=lambda: data)
