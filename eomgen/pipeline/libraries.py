"""Compiled libraries: from the cache, of other numbers, or of a Program, as the row of the profile says: on the tape
engine, whole, or in two: functions that runs call first, the others in the background."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache, cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.data import without_garbage_collection
from eomgen.base.messages import Log
from eomgen.integrators.families.register import stamp_of
from eomgen.toolchain.cache import TEMPLATES
from eomgen.toolchain.compiler import compilers_at_once
from eomgen.toolchain.library import Successor
from eomgen.toolchain.profiles import compiler_seconds, run_seconds_on_tape
from eomgen.toolchain.tables import packed_tables

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.codegen.targets.c.target import LibraryInTwo, LibraryTexts
    from eomgen.codegen.targets.target import Names
    from eomgen.pipeline.programs import BeginLibrary
    from eomgen.pipeline.requests import LibraryRequest
    from eomgen.pipeline.structures import KnownLibrary, Structure
    from eomgen.system.system import System
    from eomgen.toolchain.builder import Builder
    from eomgen.toolchain.compiler import RunningCompilers
    from eomgen.toolchain.library import Library

    #: Derives the Program, and the reason if the Program has no stepper.
    WriteProgram = Callable[[BeginLibrary], tuple[Program, str]]

_LOG = Log(__name__)
#: Operations of all functions from which on compilers begin with the stepper before the functions are scheduled.
_LONG = 4500
#: Added to the content of a library with the functions that runs call.
_OF_RUNS = b"\0of runs"


def new_library(request: LibraryRequest, write: WriteProgram, steps: float | None = None) -> Library:
    """Return a library that the cache does not have, made as the row of the profile says; a slower one may come first.

    It is compiled, or a copy of a library of equal structure with the numbers of this model (``structures``).

    Parameters
    ----------
    write : returns the Program of the request and the reason for a missing stepper
    steps : of the only run, which may be stepped by the profile of short runs
    """
    job, builder = LibraryJob(request, write), request.builder
    profile = builder.profile
    if steps is not None and profile.short_runs:
        on_tape = builder.variant(profile=profile.short_runs)
        if job.is_faster(on_tape, steps):
            return job.library(on_tape)
    if profile.split and request.selection.whole and builder.real == "double":
        return job.library_in_two()
    library = job.library(builder)
    if profile.successor:
        library.successor = Successor(partial(job.library, builder.variant(profile=profile.successor)))
    return library


class LibraryJob:
    """The making of one requested library, by any of several builders from one Program, which is written once.

    Attributes
    ----------
    texts : by name: of the stepper and its headers, if the stepper is compiled first; all texts of a library on the
        tape engine, if all of its functions are data
    apart : whether these are texts of a library with its numbers in a separate file
    structure : finds the structure of the model, None for a model whose library is not kept for other numbers
    known : the library of an earlier model that differs in numbers alone, if one is found
    """

    def __init__(self, request: LibraryRequest, write: WriteProgram) -> None:
        self.request, self.builder, self.content = request, request.builder, request.content
        self._write = write
        self.texts: dict[str, str] = {}
        self.apart = True
        self.structure: Callable[[], Structure | None] = lambda: None
        self.known: KnownLibrary | None = None

    @cached_property
    def program(self) -> tuple[Program, str]:
        """The Program, written at the first use, and the reason for a missing stepper; the wrapper is compiled
        meanwhile."""
        from eomgen.codegen.targets.c.interface import INTERFACE_CDEF, interface_header  # noqa: PLC0415

        self.builder.begin_wrapper(INTERFACE_CDEF, interface_header())
        with without_garbage_collection():
            return self._write(self.begin)

    def is_faster(self, on_tape: Builder, steps: float) -> bool:
        """Return whether a run of ``steps`` steps is estimated to end on the tape engine before the compilers would
        end. False if a library that differs in numbers alone is known. ``on_tape`` is the builder of the tape
        engine."""
        there = on_tape.find(self.content)
        if there is None:
            from eomgen.codegen.metadata import loop_operations  # noqa: PLC0415  # a library of the cache has a layout

            program, _ = self.program
            functions, loops = list(map(vars, program.functions)), loop_operations(program)
        else:
            functions, loops = there.layout["functions"], there.layout["loop_operations"]
        if self.known is not None:
            return False
        compiled = compiler_seconds(functions, compilers_at_once(), loops)
        evaluated = run_seconds_on_tape(functions, steps)
        _LOG.info("estimated %.2g s of compilers, and %.2g s of the run on the tape engine", compiled, evaluated)
        return evaluated < compiled

    # -- while the Program is made -------------------------------------------------------------------------------------

    def begin(self, system: System, data: Mapping[str, Any], functions: Sequence[str], names: Names) -> Program | None:
        """Return a Program without statements if a library that differs in numbers alone is known, else None.

        In the latter case, compile in the background, while functions are scheduled: the stepper of a long model, or of
        one on the tape engine, if its text depends on no statement; the whole library of a short model on the tape
        engine.

        Parameters
        ----------
        system : System of the model
        data : of the method
        functions : of the model
        names : of the target
        """
        tape, counts, builder = system.tape, system.counts, self.builder
        if tape.maps or tape.curves or data.get("inputs") == "series" or builder.real != "double":
            return None
        from eomgen.codegen.convert import to_program  # noqa: PLC0415  # a library of the cache is not derived
        from eomgen.pipeline.structures import known_library, structure_of  # noqa: PLC0415

        program = to_program(system, data, functions, names=names, scheduled=False)
        family = stamp_of(self.request.method)
        self.apart = builder.profile.other_numbers
        self.structure = cache(partial(structure_of, system, functions, program, family))
        if self.apart:
            self.known = known_library(builder, self.structure())
            if self.known is not None:
                return program
        if builder.profile.on_tape:
            self._begin_on_tape(program)
        elif builder.profile.split and sum(counts[name].flops for name in functions) >= _LONG:
            self._begin_stepper(program, {f"{program.prefix}.c"})
        return None

    def _begin_on_tape(self, program: Program) -> None:
        """Compile the library on the tape engine if all of its functions are data, else its stepper."""
        from eomgen.codegen.targets.c.interface import INTERFACE_CDEF  # noqa: PLC0415
        from eomgen.codegen.targets.c.tape_code import before_scheduling  # noqa: PLC0415
        from eomgen.codegen.targets.c.target import written_on_tape  # noqa: PLC0415

        if (printed := before_scheduling(program)) is None:
            self._begin_stepper(program, ())
        else:
            self.texts |= written_on_tape(printed, self._templates)
            self.builder.begin_on_tape(self.texts, INTERFACE_CDEF)

    def _begin_stepper(self, program: Program, straight: Collection[str]) -> None:
        from eomgen.codegen.targets.c.target import written_stepper  # noqa: PLC0415

        self.texts |= written_stepper(program, self._templates, tape=self.builder.profile.on_tape)
        self.builder.begin_source(f"{program.prefix}_step.c", self.texts, straight)

    # -- whole libraries -----------------------------------------------------------------------------------------------

    def library(self, builder: Builder, running: RunningCompilers | None = None) -> Library:
        """Return the library with all functions: from the cache of a builder, else derived, and compiled or copied
        from a library of equal structure.

        Parameters
        ----------
        running : as of ``Builder.build``
        """
        cached = builder.find(self.content)
        if cached is not None:
            return cached
        with builder.claim(self.content):
            cached = builder.find(self.content)
            if cached is not None:
                return cached
            compile_whole = self._compile_on_tape if builder.profile.on_tape else self._compile
            program, _ = self.program
            with without_garbage_collection():
                return compile_whole(program, builder, running)

    def _compile(self, program: Program, builder: Builder, running: RunningCompilers | None) -> Library:
        """Return the compiled library of the Program, or a copy of one with equal structure that has this model's
        numbers. ``running`` is as of ``Builder.build``. A compiled library is kept by structure."""
        from eomgen.pipeline.structures import keep_structure, known_library  # noqa: PLC0415

        apart = builder.real == "double"  # others convert literals while compiling, tables at each use
        structure = self.structure() if apart else None
        if (known := self.known or known_library(builder, structure)) is not None:
            layout = {**known.layout, "notes": program.notes, **self._marks}
            return builder.with_tables(self.content, known.entry, known.tables, layout)
        from eomgen.codegen.targets.c.target import straight_sources, written_library  # noqa: PLC0415

        ready = self.texts if apart == self.apart else {}
        files = written_library(program, self._templates, apart=apart, ready=ready)
        tables, straight = partial(_tables, files) if files.apart else None, straight_sources(program)
        library = self._build(builder, self.content, files, self._layout(program), running, straight, tables)
        return keep_structure(builder, structure, library)

    def _compile_on_tape(self, program: Program, builder: Builder, running: RunningCompilers | None) -> Library:
        """Return the library of the Program on the tape engine; ``running`` is as of ``Builder.build``."""
        from eomgen.codegen.targets.c.interface import fingerprint  # noqa: PLC0415
        from eomgen.codegen.targets.c.tape_code import functions_of_data, on_tape  # noqa: PLC0415
        from eomgen.codegen.targets.c.target import written_on_tape  # noqa: PLC0415

        printed, tape = on_tape(program)
        texts = {} if self.apart else self.texts
        early = f"{printed.prefix}.c" in texts and len(functions_of_data(printed)) == len(printed.functions)
        headers = {name: text for name, text in texts.items() if name != f"{printed.prefix}.c"}
        files = texts if early else written_on_tape(printed, self._templates, headers)
        heads = tape.placed_heads(len(printed.functions))
        data = packed_tables(fingerprint(files).encode(), {"tape": tape.numbers}, heads, tape.code)
        layout = self._layout(printed)
        if builder.is_compiling:
            from eomgen.pipeline import model  # noqa: F401, PLC0415  # which the caller needs next
            from eomgen.simulation import simulate  # noqa: F401, PLC0415  # likewise
        return self._build(builder, self.content, files, layout, running, tables=lambda: data)

    # -- libraries in two ----------------------------------------------------------------------------------------------

    def library_in_two(self) -> Library:
        """Return the library with all functions from the cache; else, if it takes long, a library with the functions
        that runs call, whose successor has all functions and is compiled in the background.

        Objects of both are the same, so their functions have the same bits.
        """
        first = self._find_in_two()
        if first is None:
            with self.builder.claim(self.content):
                first = self._find_in_two() or self._compile_first()
        if first.lacking and first.successor is None:  # of an earlier process: few processes call its other functions
            first.successor = Successor(partial(self._complete, first, None), at_once=False)
        return first

    def _find_in_two(self) -> Library | None:
        """Return the library with all functions or with the functions of runs, if one is in the cache."""
        return self.builder.find(self.content) or self.builder.find(self.content + _OF_RUNS)

    def _compile_first(self) -> Library:
        """Return the library with the functions that runs call, and begin its successor; the library with all functions
        if the others do not take long, or if it is a copy of one of equal structure."""
        program, _ = self.program
        with without_garbage_collection():
            if not program.later:
                return self._compile(program, self.builder, None)
            files = self._write_in_two(program, self.texts)
            layout, tables = {**self._layout(program), "later": program.later}, partial(_tables, files.of_runs)
            arguments = self.content + _OF_RUNS, files.of_runs, layout, None, files.straight, tables
            first = self._build(self.builder, *arguments)
        first.successor = Successor(partial(self._complete, first, files))
        return first

    def _complete(self, first: Library, files: LibraryInTwo | None, running: RunningCompilers | None) -> Library:
        """Return the library with all functions, from the cache, with tables of an equal structure, or compiled.

        Parameters
        ----------
        first : the library with the functions that runs call
        files : of the first library, if its files were written before
        running : as of ``Builder.build``
        """
        builder = self.builder
        with builder.claim(self.content):
            cached = builder.find(self.content)
            if cached is not None:
                return cached
            program, _ = self.program
            layout = {**first.layout, "later": (), "digest": first.digest}
            if self.known is not None:
                return builder.with_tables(self.content, self.known.entry, self.known.tables, layout)
            if files is None:
                files = self._write_in_two(program, {})
                deque(files.of_runs, maxlen=0)
            from eomgen.pipeline.structures import keep_structure  # noqa: PLC0415

            tables = partial(_tables, files.whole, first.fingerprint)
            library = self._build(builder, self.content, files.whole, layout, running, files.straight, tables)
            return keep_structure(builder, self.structure(), library)

    def _write_in_two(self, program: Program, ready: Mapping[str, str]) -> LibraryInTwo:
        from eomgen.codegen.targets.c.target import written_in_two  # noqa: PLC0415  # a library of the cache is not written

        return written_in_two(program, self._templates, ready)

    # -- parts of all --------------------------------------------------------------------------------------------------

    @property
    def _templates(self) -> Path:
        return self.builder.cache.folder / TEMPLATES

    @property
    def _marks(self) -> dict[str, Any]:
        """The part of a layout on the request, and the reason if there is no stepper."""
        return {"stepper_refused": self.program[1], **self.request.marks}

    def _layout(self, program: Program) -> dict[str, Any]:
        from eomgen.codegen.metadata import interface_layout  # noqa: PLC0415

        return {**interface_layout(program), **self._marks}

    def _build(
        self,
        builder: Builder,
        content: bytes,
        files: Mapping[str, str] | Iterable[tuple[str, str]],
        layout: Mapping[str, Any],
        running: RunningCompilers | None = None,
        straight: Collection[str] = (),
        tables: Callable[[], bytes] | None = None,
    ) -> Library:
        """Return the library of the Program, compiled of these files; arguments as of ``Builder.build``."""
        from eomgen.codegen.targets.c.interface import INTERFACE_CDEF  # noqa: PLC0415
        from eomgen.codegen.targets.c.naming import file_name  # noqa: PLC0415

        written = {source.name: file_name(source.written) for source in self.program[0].sources}
        return builder.build(content, files, INTERFACE_CDEF, layout, written, running, straight, tables)


def _tables(texts: LibraryTexts, mark: str = "") -> bytes:
    """Return the tables of a library whose texts are written; ``mark``: its fingerprint, if it has one already."""
    from eomgen.codegen.targets.c.interface import fingerprint  # noqa: PLC0415

    return packed_tables(fingerprint(texts.written).encode(), texts.numbers, fingerprint=mark.encode())
