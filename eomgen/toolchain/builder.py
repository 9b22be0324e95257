"""Builder: sources to a loaded library through the cache; the entry point of the toolchain.

Cache keys of libraries: digests of everything that their bytes depend on.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import re
import shutil
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from functools import cache, partial
from pathlib import Path
from typing import Any

from eomgen.base.messages import Log
from eomgen.base.progress import counted_units
from eomgen.base.version import __version__, checkout_stamp
from eomgen.errors import EomgenError, ToolchainError
from eomgen.toolchain.cache import Cache, Entry
from eomgen.toolchain.cffi_build import (
    companion_files,
    load_abi,
    load_api,
    python_headers,
    wrapper_source,
)
from eomgen.toolchain.compiler import (
    DEFAULT_TIMEOUT,
    Begun,
    Compilation,
    Compiler,
    RunningCompilers,
    compile_and_link,
    compile_library,
    compile_object,
    faults_in,
    find_compiler,
    in_background,
    library_suffix,
    preprocess,
    processor_digest,
    write_texts,
)
from eomgen.toolchain.library import LaneLibrary, Library
from eomgen.toolchain.profiles import (
    ENGINE_FLAGS,
    OF_ANGLES,
    OF_STRAIGHT,
    STANDARD_PROFILE,
    CompilerProfile,
    beside_straight,
    passes_for,
    without_slow_passes,
)
from eomgen.toolchain.profiles import profile as profile_named
from eomgen.toolchain.tables import TABLES, library_texts, tables_in


def library_key(content: bytes, compiler: Compiler, profile: CompilerProfile, flags: Sequence[str], mode: str) -> str:
    """Return the key of the library of these content bytes that a compiler makes with these flags on this machine.

    Parameters
    ----------
    content : everything that the sources depend on
    flags : all flags of the compiler, with the flags of the profile
    mode : of cffi, ``api`` or ``abi``
    """
    return _digest(compiler.identity, content, profile, flags, mode)


def origin_of(content: bytes, profile: CompilerProfile, flags: Sequence[str], mode: str) -> str:
    """Return the key of the same library for any compiler."""
    return _digest("", content, profile, flags, f"{mode} on {platform.system()} {platform.machine()}")


def wrapper_key(compiler: Compiler, cdef: str, header: str, headers: Path) -> str:
    """Return the key of the extension module's object, made with the headers of Python in this folder."""
    from _cffi_backend import __version__ as version  # noqa: PLC0415  # cffi takes a backend of its own version alone

    content = "\0".join((compiler.identity, cdef, header, version, library_suffix(), str(headers)))
    return hashlib.sha256(b"wrapper\0" + content.encode()).hexdigest()


def _digest(compiler: str, content: bytes, profile: CompilerProfile, flags: Sequence[str], mode: str) -> str:
    machine = processor_digest() if profile.native else ""
    digest = hashlib.sha256()
    for text in (compiler, " ".join(flags), machine, mode, library_suffix()):
        digest.update(text.encode() + b"\0")
    digest.update(content)
    return digest.hexdigest()


def _with_includes(name: str, texts: Mapping[str, str]) -> bytes:
    """Return a digest of file ``name`` in ``texts`` and of all files included by name, each once, without comments."""
    names, content = [name], hashlib.sha256()
    for included in names:
        text = re.sub(_COMMENT, lambda match: match[0] if match[0][0] == '"' else " ", texts[included])
        content.update(f"{included}\0{text}\0".encode())
        names += [file for file in re.findall(_INCLUDED, text) if file in texts and file not in names]
    return content.digest()


_LOG = Log(__name__)
_INCLUDED = r'(?m)^#include "([^"]+)"'
#: Comments, and texts, which may hold the signs of a comment.
_COMMENT = r'(?s)"(?:[^"\\\n]|\\.)*"|/\*.*?\*/'
_OBJECT = "object.o"
_LIBRARY, _LAYOUT, _CDEF, _COMMANDS = "model", "layout.json", "interface.cdef", "commands.txt"
_LANES, _ROUTINE, SHARED = "lanes.so", "routine.so", "shared.so"
#: Files by which another process loads a library; libraries with their numbers in the text have no tables.
_FILES = (_LIBRARY, _LAYOUT, _CDEF, TABLES)
#: Start of a loop in C.
_LOOP = "for ("
#: The source of the tape engine is the same for all models, so that the object of the source is in the cache.
_ENGINE = "eomgen_tape.c"
#: Says why a stepper cannot be made for lanes.
REFUSED = "refused.txt"
#: From files and the name of one file to the text of that file without directives of the preprocessor.
Preprocess = Callable[[Mapping[str, str], str], str]
#: Maps the files of a library, and a function that removes directives of the preprocessor from one of them, to the
#: files of its lanes, or to the reason in ``refused.txt`` alone.
LaneFiles = Callable[[Mapping[str, str], Preprocess], Mapping[str, str]]
#: File with the origin of an entry, found without a compiler.
_ORIGIN = "origin.txt"
#: A vector register of AVX-512 has eight lanes; compilers split it in two unless a flag forbids the split.
_WIDE = ("-mprefer-vector-width=512",) if platform.machine() in ("x86_64", "AMD64") else ()
#: Most values of lanes wait in memory until a statement uses the value; gcc's order of statements is 7 % faster then
#: (Panda, AVX2).
_OF_GCC = ("-flive-range-shrinkage",)
_REALS = {
    "double": (),
    "float": ("-DEOMGEN_REAL_FLOAT",),
    "complex": ("-DEOMGEN_REAL_COMPLEX",),
    "lanes": ("-DEOMGEN_REAL_LANES", *_WIDE),
}


def _copy_object(made: Path, folder: Path) -> None:
    shutil.copyfile(made, folder / _OBJECT)


def _headers_first(files: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return files in an order in which each can be compiled at once: headers before sources, the longest sources
    first."""
    return sorted(files.items(), key=lambda file: (file[0].endswith(".c"), -len(file[1])))


class Builder:
    """Builds and finds libraries for one compiler, profile and number type.

    Without an installed compiler the builder finds libraries made by any compiler for this machine and Python, and
    builds none.

    Parameters
    ----------
    profile : str
        Name of a row of ``profiles.PROFILES``.
    real : str
        ``double``, ``float``, ``complex`` or ``lanes`` (as many samples at a time as a vector register holds).
    mode : str, optional
        ``api`` or ``abi``; by default API if Python.h is present.
    cache, compiler : optional
        The user's cache and the first compiler found by default.
    timeout : float
        Seconds for compiling all files of a library.
    """

    def __init__(
        self,
        profile: str = STANDARD_PROFILE,
        real: str = "double",
        mode: str | None = None,
        cache: Cache | None = None,
        compiler: Compiler | None = None,
        timeout: float = DEFAULT_TIMEOUT,
    ) -> None:
        """Choose profile, compiler, cache and mode of the loader. Raises ToolchainError."""
        if real not in _REALS:
            raise ToolchainError(f"no number type {real!r} [E2098]", f"one of {', '.join(_REALS)}")
        self.profile: CompilerProfile = profile_named(profile)
        self.real = real
        self._compiler = compiler
        self._missing: ToolchainError | None = None
        if compiler is None:
            self._find_compiler()
        self.flags = (*self.profile.flags, *_REALS[real])
        if real == "lanes" and self._compiler is not None and "clang" not in self._compiler.version:
            self.flags += _OF_GCC
        self.headers = python_headers() if mode in (None, "api") else None
        if mode == "api" and self.headers is None:
            raise ToolchainError(
                "Python.h is missing, so the API mode of cffi cannot be built [E2099]",
                "apt install python3-dev, or mode abi",
            )
        self.mode = "abi" if self.headers is None else "api"
        self.cache = Cache() if cache is None else cache
        self.timeout = timeout
        self._begun: dict[str, Begun] = {}

    def variant(self, *, profile: str | None = None, real: str | None = None) -> Builder:
        """Return a builder with another profile or number type, the same compiler and cache."""
        profile_name = self.profile.name if profile is None else profile
        number = self.real if real is None else real
        return Builder(profile_name, number, self.mode, self.cache, self._compiler, self.timeout)

    def _find_compiler(self) -> None:
        """Look for a compiler; a missing compiler is reported when a build needs a compiler, a wrong ``CC`` now."""
        try:
            self._compiler = find_compiler()
        except ToolchainError as error:
            if os.environ.get("CC"):
                raise
            self._missing = error

    @property
    def compiler(self) -> Compiler:
        """The compiler. Raises ToolchainError if there is none."""
        if self._compiler is not None:
            return self._compiler
        assert self._missing is not None  # since no compiler was found
        problem = self._missing.problems[0]
        fault = (
            f"{problem.what}, and the cache {self.cache.folder} has no library of this model with these terms, this"
            f" method and profile {self.profile.name} for this machine [E2101]"
        )
        raise ToolchainError(fault, problem.hint)

    @property
    def binary(self) -> str:
        """Name of the file of a library in its entry of the cache."""
        return _LIBRARY + library_suffix()

    def key(self, content: bytes) -> str:
        """Return the cache key of the caller's ``content`` bytes on this machine, with these flags."""
        return library_key(content, self.compiler, self.profile, self.flags, self.mode)

    def find(self, content: bytes) -> Library | None:
        """Return the loaded library that was built for these content bytes, or None. Imports neither SymPy nor Jinja.

        A damaged library is removed and counts as missing.

        Raises
        ------
        ToolchainError
            There is no compiler, and the library that another machine's made cannot be loaded here.
        """
        if self._compiler is None:
            return self._found_without_compiler(content)
        key = self.key(content)
        entry = self.cache.get(key)
        if entry is None:
            return None
        try:
            library = self._load(entry, self.mode)
            _LOG.info("took the library from the cache, %s", entry.file(self.binary))
            return library
        except (ToolchainError, OSError, ValueError, KeyError, TypeError):
            self.cache.remove(key)
            return None

    def _found_without_compiler(self, content: bytes) -> Library | None:
        for mode in ("api", "abi"):
            origin = origin_of(content, self.profile, self.flags, mode)
            for entry in self.cache.holding(_ORIGIN, origin):
                library = self._load(entry, mode)
                _LOG.info("took the library from the cache, there is no compiler: %s", library.folder)
                return library
        return None

    def claim(self, content: bytes) -> AbstractContextManager[None]:
        """Return a context with the right to make the library of these content bytes; other processes wait."""
        return self.cache.claim(self.key(content))

    def build(
        self,
        content: bytes,
        files: Mapping[str, str] | Iterable[tuple[str, str]],
        cdef: str,
        layout: Mapping[str, Any],
        written: Mapping[str, str] | None = None,
        running: RunningCompilers | None = None,
        straight: Collection[str] = (),
        tables: Callable[[], bytes] | None = None,
    ) -> Library:
        """Compile files, keep the library under these content bytes, and return the loaded library, if cached at once.

        Parameters
        ----------
        content : bytes
            Everything that the files depend on; two different sets of files must not share these bytes.
        files : mapping from name to text, or pairs of both as they are written, headers before files that include them
            C sources and headers; ``interface.h`` has the declarations of ``cdef``. ``main.c`` is left out. A source is
            compiled while the next sources in the order are written.
        cdef : str
            Declarations of the interface for cffi.
        layout : mapping
            JSON data, handed back as ``Library.layout``.
        written : mapping
            Files written by the user, with the names that compilers show in messages.
        running
            Collection of the compiler's processes, for a caller who may stop these.
        straight
            Names of long sources without branches, which need few passes of the compiler.
        tables
            Returns the tables that the loader hands over to the library, when all files are written.

        Raises
        ------
        ToolchainError
            The files cannot be compiled. If the fault is in a file of the user, the error names the line in that file.
        """
        cached = self.find(content)
        if cached is not None:
            return cached

        lines, fresh, total = 0, 0, 0
        taken: list[tuple[str, str]] = []
        rest: Iterator[tuple[str, str]] = iter(_headers_first(files) if isinstance(files, Mapping) else files)

        def every() -> Iterator[tuple[str, str]]:
            """Yield all files; again from the first if the cache is full and another folder is tried."""
            yield from taken
            for item in rest:
                taken.append(item)
                yield item

        def compile_sources(folder: Path) -> list[str]:
            """Write, compile and link the sources in a folder, and return the commands of the compilers."""
            nonlocal lines, fresh, total
            texts: dict[str, str] = {}
            sources: list[Path] = []
            title = f"compiling {layout.get('prefix', 'a model')}"
            title += " by zig, which makes its C library at the first use" if self.compiler.is_zig else ""
            with (
                counted_units(title) if running is None else nullcontext() as progress,
                Compilation(
                    self.compiler, self.flags, timeout=self.timeout, running=running, progress=progress
                ) as compilation,
            ):
                for name, text in every():
                    (folder / name).write_text(text, encoding="utf-8")
                    lines += text.count("\n")
                    texts[name] = text
                    if not name.endswith(".c") or name == "main.c":
                        continue
                    source = folder / name
                    sources.append(source)
                    total = len(sources)
                    if name in (written or {}):  # may include files that are unknown here
                        compilation.add(source)
                        fresh += 1
                        continue
                    flags = self._flags_for(name, text, straight, loops=bool(layout.get("loop_operations")))
                    key = self._object_key(name, texts, flags)
                    known, begun = self.cache.get(key), self._begun.pop(key, None)
                    fresh += known is None or begun is not None
                    if known is None:
                        kept = partial(self.cache.put, key, partial(_copy_object, source.with_suffix(".o")))
                        compilation.add(source, flags, begun, kept)
                    else:
                        shutil.copyfile(known.file(_OBJECT), source.with_suffix(".o"))
                        compilation.take(source, flags)
                output = folder / self.binary
                wrapper = partial(self._wrapper, cdef, texts.get("interface.h", ""))
                commands = compilation.link(sorted(sources), output, wrapper)
            for source in sources:
                source.with_suffix(".o").unlink(missing_ok=True)
            return commands

        def fill(folder: Path) -> None:
            whole = files if self.profile.on_tape and isinstance(files, Mapping) else {}
            ready = self._linked_entry(whole, cdef) if whole else None
            commands = compile_sources(folder) if ready is None else _copy_library(ready, whole, folder)
            if tables is not None:
                (folder / TABLES).write_bytes(tables())
            (folder / _LAYOUT).write_text(json.dumps(layout), encoding="utf-8")
            (folder / _CDEF).write_text(cdef, encoding="utf-8")
            (folder / _ORIGIN).write_text(origin_of(content, self.profile, self.flags, self.mode), encoding="utf-8")
            (folder / _COMMANDS).write_text("\n".join([self.compiler.version, *commands, ""]), encoding="utf-8")

        key = self.key(content)
        began = time.perf_counter()
        try:
            entry = self.cache.put(key, fill)
        except ToolchainError as error:
            if faults := [fault for p in error.problems for fault in faults_in(p.what, written or {})]:
                raise ToolchainError(faults) from None
            raise self._with_kept_sources(error, key) from error
        seconds = time.perf_counter() - began
        kept = f"linked {total} kept objects" if total else "copied a linked library"
        done = f"compiled {fresh} of {total} files" if fresh else kept
        by = f"{self.compiler.version}, {self.profile.name}"
        _LOG.info("%s, %d lines of C, in %.2f s by %s", done, lines, seconds, by)
        _LOG.debug("commands: %s", entry.text(_COMMANDS).replace("\n", "; ").rstrip("; "))
        return self._load(entry, self.mode)

    def with_tables(self, content: bytes, entry: Entry, tables: bytes, layout: Mapping[str, Any]) -> Library:
        """Copy a library of the cache with other tables and layout, keep the copy under these content bytes, and load
        the copy.

        Parameters
        ----------
        content, layout : as of ``build``
        entry : of the earlier library
        tables : bytes of ``packed_tables``
        """
        origin = origin_of(content, self.profile, self.flags, self.mode).encode()
        changed = {TABLES: tables, _LAYOUT: json.dumps(layout).encode(), _ORIGIN: origin}
        made = self._copy(self.key(content), entry, changed)
        _LOG.info("took the library of an earlier model with other numbers, %s", made.file(self.binary))
        return self._load(made, self.mode)

    def _copy(self, key: str, entry: Entry, changed: Mapping[str, bytes]) -> Entry:
        """Return the entry of a key; if the cache has none, a copy of ``entry`` with the files ``changed`` or added."""

        def fill(folder: Path) -> None:
            for name in (*entry.files, *changed):
                (folder / name).write_bytes(changed[name] if name in changed else entry.file(name).read_bytes())

        return self.cache.get(key) or self.cache.put(key, fill)

    def _object_key(self, name: str, texts: Mapping[str, str], flags: Sequence[str]) -> str:
        return library_key(_with_includes(name, texts), self.compiler, self.profile, flags, "object")

    def begin_source(self, name: str, texts: Mapping[str, str], straight: Collection[str]) -> None:
        """Compile a source in the background while the caller derives the others, unless the cache has the object.

        ``build`` takes the object, and reports faults.

        Parameters
        ----------
        name : of the source
        texts : of the source and of all files that the source includes, by name
        straight : as of ``build``
        """
        flags = self._flags_for(name, texts[name], straight)
        key = self._object_key(name, texts, flags)
        if self.cache.get(key) is not None:
            return

        def object_file() -> Path | None:
            entry = self.cache.get(key)
            return None if entry is None else entry.file(_OBJECT)

        def compile_source(running: RunningCompilers, folder: Path) -> None:
            object_path, _ = compile_object(self.compiler, folder / name, flags, running=running)
            object_path.rename(folder / _OBJECT)

        self._begin(key, Begun(object_file), texts, compile_source)

    def _begin(
        self, key: str, begun: Begun, texts: Mapping[str, str], compile_texts: Callable[[RunningCompilers, Path], None]
    ) -> RunningCompilers:
        """Compile texts in the background into an entry of the cache without the texts, and return the collection of
        the compilers. The event ``begun.ended`` is set at the end, even after an exception; errors of eomgen are left
        to ``build``."""

        def work(running: RunningCompilers) -> None:
            def fill(folder: Path) -> None:
                write_texts(folder, texts)
                compile_texts(running, folder)
                for name in texts:
                    (folder / name).unlink()

            try:
                with suppress(EomgenError):
                    self.cache.put(key, fill)
            finally:
                begun.ended.set()

        self._begun[key] = begun
        return in_background("eomgen-begun", work, lower=False)

    def begin_on_tape(self, files: Mapping[str, str], cdef: str) -> None:
        """Compile and link in the background the library of one source on the tape engine, while the caller derives the
        tape.

        Only the source is compiled if the cache lacks the objects of the engine or of the wrapper. ``build`` takes the
        result, and reports faults.

        Parameters
        ----------
        files, cdef : as of ``build``
        """
        (name,) = (name for name in files if name.endswith(".c") and name != _ENGINE)
        engine = self.cache.get(self._object_key(_ENGINE, files, self._flags_for(_ENGINE, files[_ENGINE], ())))
        wrapper = self._known_wrapper(cdef, files["interface.h"])
        if engine is None or wrapper is None:
            self.begin_source(name, files, ())
            return
        key = self._linked_key(files, cdef)
        if self.cache.get(key) is not None:
            return
        flags = self._flags_for(name, files[name], ())
        objects = (engine.file(_OBJECT), *wrapper)

        def link_source(running: RunningCompilers, folder: Path) -> None:
            command = compile_and_link(self.compiler, folder / name, flags, objects, folder / self.binary, running)
            (folder / _COMMANDS).write_text(command, encoding="utf-8")

        # without the wait the thread would wait for Python at each file, in turns with the caller
        self._begin(key, Begun(lambda: None), files, link_source).started.wait(1.0)
        _LOG.debug("began the library on the tape engine, by %s", self.compiler.version)  # asked for meanwhile

    @property
    def is_compiling(self) -> bool:
        """Whether a compilation that was begun goes on."""
        return any(not begun.ended.is_set() for begun in self._begun.values())

    def _linked_entry(self, files: Mapping[str, str], cdef: str) -> Entry | None:
        """Return the cache entry of the library linked by ``begin_on_tape``, after waiting; None without."""
        key = self._linked_key(files, cdef)
        if (begun := self._begun.pop(key, None)) is not None:
            begun.ended.wait()
        return self.cache.get(key)

    def _linked_key(self, files: Mapping[str, str], cdef: str) -> str:
        texts = "".join(f"{name}\0{text}\0" for name, text in sorted(files.items()))
        return library_key(f"linked\0{cdef}\0{texts}".encode(), self.compiler, self.profile, self.flags, self.mode)

    def _flags_for(self, name: str, text: str, straight: Collection[str], *, loops: bool = False) -> tuple[str, ...]:
        if name == _ENGINE:
            return (*ENGINE_FLAGS, *_REALS[self.real])
        if self.profile.on_tape:  # without passes
            return self.flags
        if name in straight:
            further = OF_ANGLES if _LOOP in text else OF_STRAIGHT
            return without_slow_passes(self.flags, self.compiler.version, further)
        if straight:  # in a run of a model this long, functions take most of the time, not the stepper
            return without_slow_passes(self.flags, self.compiler.version, beside_straight(text))
        return passes_for(text, self.flags, self.compiler.version, loops=loops)

    def build_lanes(self, library: Library, cdef: str, files_of: LaneFiles) -> LaneLibrary | str:
        """Return the library that steps several trajectories side by side, or a sentence on why there is none.

        Parameters
        ----------
        library : Library
            With the stepper of a method.
        cdef : str
            Declarations of the functions of the lanes.
        files_of : callable
            Gives the files of the lanes, made of the files of the library.

        Raises
        ------
        ToolchainError
            There is no compiler, or the files cannot be compiled.
        """
        if self.profile.on_tape:
            return "the model is on the tape engine until its compiler is done"
        compiler, flags = self.compiler, (*self.profile.flags, *_REALS["lanes"])
        texts, tables = library_texts(library.folder), tables_in(library.folder)
        described = [library.layout[name] for name in ("prefix", "method", "sizes", "functions")]
        # version and stamp: of the code that makes the files of the lanes from these texts
        content = b"lanes of " + json.dumps([texts, *described, __version__, checkout_stamp()]).encode()
        key = library_key(content, compiler, self.profile, flags, "abi")

        def fill(folder: Path) -> None:
            (folder / TABLES).write_bytes(tables)
            lane_files = files_of(texts, partial(preprocess, compiler))
            write_texts(folder, lane_files)
            sources = [folder / name for name in sorted(lane_files) if name.endswith(".c")]
            if not sources:
                return
            passes = passes_for("".join(lane_files.values()), flags, compiler.version)
            compile_library(compiler, sources, folder / _LANES, passes, timeout=self.timeout)

        entry = self.cache.take(key, fill)
        if REFUSED in entry.files:
            return entry.text(REFUSED)
        return LaneLibrary(self._with_tables(entry, tables).file(_LANES), cdef, library.layout, tables)

    def _with_tables(self, entry: Entry, tables: bytes) -> Entry:
        """Return an entry with these tables: the entry itself, or a copy if it has others."""
        key = hashlib.sha256(f"tables of {entry.folder.name}\0".encode() + tables).hexdigest()
        return entry if tables_in(entry.folder) == tables else self._copy(key, entry, {TABLES: tables})

    def build_routine(self, source: str, cdef: str) -> tuple[Any, Any]:
        """Return ``ffi`` and ``lib`` of one C file that is the same for all models, from the cache if possible.

        Raises
        ------
        ToolchainError
            There is no compiler, or the file cannot be compiled.
        """
        content = f"routine\0{cdef}\0{source}".encode()
        key = library_key(content, self.compiler, self.profile, self.flags, "abi")

        def fill(folder: Path) -> None:
            file = folder / "routine.c"
            file.write_text(source, encoding="utf-8")
            compile_library(self.compiler, [file], folder / _ROUTINE, self.flags, timeout=self.timeout)

        entry = self.cache.take(key, fill)
        return _load_routine(entry.file(_ROUTINE), cdef)

    def build_folder(self, content: bytes, write: Callable[[Path], None]) -> Entry:
        """Return the cache entry of a folder of C files and their shared library, ``SHARED``, made if the cache has
        none.

        Parameters
        ----------
        content : bytes
            Everything that the files depend on.
        write : callable
            Writes the files to an empty folder.

        Raises
        ------
        ToolchainError
            There is no compiler, or a file cannot be compiled.
        """
        key = library_key(b"folder\0" + content, self.compiler, self.profile, self.flags, "abi")

        def fill(folder: Path) -> None:
            write(folder)
            compile_library(
                self.compiler, sorted(folder.glob("*.c")), folder / SHARED, self.flags, timeout=self.timeout
            )

        try:
            return self.cache.take(key, fill)
        except ToolchainError as error:
            raise self._with_kept_sources(error, key) from error

    def _with_kept_sources(self, error: ToolchainError, key: str) -> ToolchainError:
        """Return an error of the compiler that names the folder to which the cache has moved the sources."""
        location = f"C compiler, sources kept in {self.cache.failed_folder(key)}"
        return ToolchainError([type(p)(location, p.what, p.hint) for p in error.problems])

    def begin_wrapper(self, cdef: str, header: str) -> None:
        """Compile the object of the extension module in the background, unless the cache has one; not in the ABI mode.
        ``build`` compiles the object again after a fault, and reports the fault. ``cdef`` are the declarations,
        ``header`` the text of the interface's header."""

        def work(running: RunningCompilers) -> None:
            with suppress(EomgenError, OSError):
                self._wrapper(cdef, header, running)

        if self.headers is not None:
            in_background("eomgen-wrapper", work, lower=False)

    def _wrapper(self, cdef: str, header: str, running: RunningCompilers | None = None) -> list[Path]:
        """Return the path of the extension module's object in a list, compiled if the cache has none; empty in the ABI
        mode. The object is the same for all models."""
        headers = self.headers
        known = self._known_wrapper(cdef, header)
        if known is not None or headers is None:
            return known or []
        key = wrapper_key(self.compiler, cdef, header, headers)

        def fill(folder: Path) -> None:
            (folder / "interface.h").write_text(header, encoding="utf-8")
            source = folder / "wrapper.c"
            source.write_text(wrapper_source(cdef, "interface.h"), encoding="utf-8")
            compile_object(self.compiler, source, ("-O1", f"-I{headers}"), running=running)

        return [self.cache.take(key, fill).file("wrapper.o")]

    def _known_wrapper(self, cdef: str, header: str) -> list[Path] | None:
        """Return the extension module's object in the cache, in a list, empty in ABI mode; None if missing."""
        if self.headers is None:
            return []
        entry = self.cache.get(wrapper_key(self.compiler, cdef, header, self.headers))
        return None if entry is None else [entry.file("wrapper.o")]

    def load_files(self, files: Mapping[str, bytes], mode: str) -> Library:
        """Return the library of files of ``library_files``, which are kept in the cache.

        Raises
        ------
        ToolchainError
            The library cannot be loaded here.
        KeyError, ValueError, TypeError
            A file is missing, or is none of a library.
        FileError
            The files cannot be kept.
        """
        digest = hashlib.sha256(b"given\0" + mode.encode())
        names = [name for name in _FILES if name in files or name != TABLES]
        for name in names:
            digest.update(hashlib.sha256(files[name]).digest())

        def fill(folder: Path) -> None:
            for name in names:
                path = folder / (name + library_suffix() if name == _LIBRARY else name)
                path.write_bytes(files[name])

        key = digest.hexdigest()
        return self._load(self.cache.get(key) or self.cache.put(key, fill), mode)

    def _load(self, entry: Entry, mode: str) -> Library:
        layout = json.loads(entry.text(_LAYOUT))
        path = entry.file(self.binary)
        ffi, lib = load_api(path) if mode == "api" else load_abi(path, entry.text(_CDEF))
        tables = entry.file(TABLES).read_bytes() if TABLES in entry.files else b""
        library = Library(ffi, lib, layout, mode, path, tables)
        library.profile = self.profile.name
        sources = any(name.endswith(".c") for name in entry.files)
        if self.real == "double" and self._compiler is not None and not self.profile.on_tape and sources:
            library.companion = partial(self._companion, entry.folder, library.layout)
        return library

    def _companion(
        self, folder: Path, layout: Mapping[str, Any], function: str, running: RunningCompilers | None = None
    ) -> Library | None:
        """Return the library of one function for as many samples as there are lanes, made of the files of a library's
        folder.

        The library is compiled if ``running``, a collection for the compiler's processes, is given, else taken from the
        cache; None if the cache has none.

        Raises
        ------
        ToolchainError
            The library cannot be compiled.
        OSError, UnicodeError
            The library's sources cannot be read.
        """
        files, tables = companion_files(folder, layout, function), tables_in(folder)
        content = b"companion\0" + "\0".join(f"{name}\0{text}" for name, text in sorted(files.items())).encode()
        builder = self.variant(real="lanes")
        if running is not None:
            cdef = (folder / _CDEF).read_text(encoding="utf-8")
            companion_layout = {**layout, "stack": 8 * int(layout.get("stack", 0))}  # of eight lanes
            with builder.claim(content):
                builder.build(content, files, cdef, companion_layout, running=running, tables=lambda: tables)
        entry = self.cache.get(builder.key(content))
        return None if entry is None else builder._load(self._with_tables(entry, tables), self.mode)


def library_files(library: Library) -> dict[str, bytes]:
    """Return the files by which another process loads a library, by names that are the same on all machines."""
    suffix = {_LIBRARY: library_suffix()}
    files = {name: library.folder / f"{name}{suffix.get(name, '')}" for name in _FILES}
    return {name: file.read_bytes() for name, file in files.items() if name != TABLES or file.is_file()}


def _copy_library(linked: Entry, files: Mapping[str, str], folder: Path) -> list[str]:
    """Write ``files`` and the library of a linked entry to a folder; return the commands as one text in a list."""
    write_texts(folder, files)
    name = _LIBRARY + library_suffix()
    shutil.copy(linked.file(name), folder / name)
    return [linked.text(_COMMANDS)]


@cache
def _load_routine(routine: Path, cdef: str) -> tuple[Any, Any]:
    """Return ``ffi`` and ``lib`` of a routine; the declarations take longer to read than the routine takes to run."""
    return load_abi(routine, cdef)
