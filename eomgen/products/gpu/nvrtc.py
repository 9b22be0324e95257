"""NVRTC, NVIDIA's compiler for devices, by ctypes: from texts to the machine code of a card, kept in the cache.

NVRTC is a library, which needs neither a card nor nvcc. The packages torch, CuPy and JAX bring NVRTC along.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import functools
import hashlib
import importlib.util
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from eomgen.base.data import dataclass, replace
from eomgen.errors import Problem, ToolchainError
from eomgen.toolchain.cache import Cache
from eomgen.toolchain.compiler import printable, write_texts

#: Options of every compilation: C as functions of the device, and a report on registers.
OPTIONS = ("--std=c++20", "-default-device", "-w", "--ptxas-options=-v")
#: Products are not fused with sums, so that the bits are equal to the processor's.
EXACT = ("-fmad=false",)
#: Functions stay functions, each compiled on its own, without spills to memory of the block. By default NVRTC 13 puts
#: copies of functions into each other and compiles all together, which takes up to twenty times as long, but lets few
#: numbers be registers for the whole run. NVRTC 12 has no such option.
AS_CALLS = ("--Ofast-compile=min", "-DEG_SPILL_TO_BLOCK=")
#: Headers of C that a text may include: NVRTC has none, and ``eomgen_cuda.h`` has the names that are needed.
HEADERS = ("float.h", "limits.h", "math.h", "stddef.h", "stdint.h", "stdio.h", "string.h")
#: Installs NVRTC for this Python.
INSTALL = "pip install 'eomgen[gpu]'"
_LIBRARY = r"libnvrtc.*\.so(\.\d+)*|nvrtc64_\w+\.dll"
_CUBIN, _LOG = "kernels.cubin", "log.txt"
#: A text without code that is kept with the machine code.
LAYOUT = "layout.json"
#: Lines of a message with a fault of a text.
_SHOWN = 12
#: A kernel in the report on registers, and numbers of its text, with the functions that it calls.
_ENTRY, _REGISTERS = r"Compiling entry function '(\w+)'", r"Used (\d+) registers"
_STACK, _SPILLS = r"(\d+) bytes (?:cumulative )?stack", r"(-?\d+) bytes spill (?:stores|loads)"
#: Registers of a thread at most.
_ALL = 255


@dataclass(frozen=True)
class Usage:
    """Memory for a thread of a kernel: ``registers``, bytes in the ``stack``, and bytes in ``spills``, for registers
    that are stored in memory of the card and loaded again."""

    registers: int
    stack: int
    spills: int


@dataclass(frozen=True)
class Cubin:
    """Machine code of a card: the ``image`` that the driver loads, the ``log`` of the compiler, and the ``layout`` that
    came with the texts."""

    image: bytes
    log: str
    layout: str = ""

    @functools.cached_property
    def usage(self) -> dict[str, Usage]:
        """Memory for a thread, by the name of the kernel."""
        functions, *parts = re.split(_ENTRY, self.log)
        if parts:
            parts[1] += functions  # which a kernel of steps calls come before it, called by others after these
        return {
            name: Usage(_numbers(_REGISTERS, text)[0], max(_numbers(_STACK, text)), _sum_of_spills(text))
            for name, text in zip(parts[::2], parts[1::2], strict=True)
        }

    @property
    def spills(self) -> int:
        """Bytes of spills of all kernels."""
        return sum(usage.spills for usage in self.usage.values())


def _sum_of_spills(text: str) -> int:
    """Return the bytes of spills of a kernel: the entry subtracts spills in memory of the block."""
    return max(0, sum(_numbers(_SPILLS, text)))


def _numbers(pattern: str, text: str) -> list[int]:
    return [int(number) for number in re.findall(pattern, text)]


def compile_cubin(
    texts: Mapping[str, str] | Callable[[], tuple[Mapping[str, str], Sequence[str]]],
    name: str,
    architecture: str,
    options: Sequence[str] = EXACT,
    *,
    again: Sequence[str] = (),
    content: bytes = b"",
    cache: Cache | None = None,
) -> Cubin:
    """Return the machine code of a text for an architecture, from the cache if the text was compiled before.

    Parameters
    ----------
    texts : mapping or callable
        The text and all files that it includes, by name; or a function that returns these, perhaps ``layout.json``,
        and further options, with ``content``.
    name : str
        Of the text.
    architecture : str
        Such as ``sm_90``.
    options : sequence of str
        Further options of NVRTC.
    again : sequence of str
        More options, for a second compilation if kernels spill registers although some are free; the code with fewer
        spills is taken.
    content : bytes
        Everything that the texts depend on, so that these are made only if the cache has no machine code.
    cache : Cache, optional
        The user's cache by default.

    Raises
    ------
    ToolchainError
        NVRTC is not installed, or refuses the text.
    """
    compiler, store = nvrtc(), Cache() if cache is None else cache
    every = (f"--gpu-architecture={architecture}", *OPTIONS, *options)
    told = "\0".join(("cubin", compiler.identity, name, *every, *again, ""))
    if not callable(texts):
        content = "\0".join(chain.from_iterable(sorted(texts.items()))).encode()
    key = hashlib.sha256(told.encode() + content).hexdigest()

    def fill(folder: Path) -> None:
        files, more = texts() if callable(texts) else (texts, ())
        write_texts(folder, files)
        code = Cubin(*compiler.compile(files, name, (*every, *more)))
        if again and any(usage.spills and usage.registers < _ALL for usage in code.usage.values()):
            second = Cubin(*compiler.compile(files, name, (*every, *more, *again)))
            code = min(code, second, key=lambda each: each.spills)
        for file in files.keys() - {LAYOUT}:
            (folder / file).unlink()
        (folder / _CUBIN).write_bytes(code.image)
        (folder / _LOG).write_text(code.log, encoding="utf-8")

    try:
        entry = store.take(key, fill)
    except ToolchainError as error:
        where = f"NVRTC {compiler.version}, sources kept in {store.failed_folder(key)}"
        raise ToolchainError([replace(problem, where=where) for problem in error.problems]) from error
    layout = entry.text(LAYOUT) if LAYOUT in entry.files else ""
    return Cubin(entry.file(_CUBIN).read_bytes(), entry.text(_LOG), layout)


class Nvrtc:
    """The library NVRTC.

    Parameters
    ----------
    path : of the library

    Attributes
    ----------
    version : such as ``13.0``
    identity : changes when the library does
    """

    def __init__(self, path: str) -> None:
        self.path, self._library = path, ctypes.CDLL(path)
        self._library.nvrtcGetErrorString.restype = ctypes.c_char_p
        numbers = ctypes.c_int(), ctypes.c_int()
        self._library.nvrtcVersion(*map(ctypes.byref, numbers))
        self.version = ".".join(str(number.value) for number in numbers)
        size = Path(path).stat().st_size if Path(path).is_file() else 0
        self.identity = f"{path}|{self.version}|{size}"

    def compile(self, texts: Mapping[str, str], name: str, options: Sequence[str]) -> tuple[bytes, str]:
        """Return machine code and log of text ``name``, which includes the other texts. Raises ToolchainError."""
        program, headers = ctypes.c_void_p(), {**dict.fromkeys(HEADERS, ""), **texts}
        own = headers.pop(name).encode(), name.encode()
        included = len(headers), _strings([*headers.values()]), _strings([*headers])
        self._check(self._library.nvrtcCreateProgram(ctypes.byref(program), *own, *included))
        try:
            status = self._library.nvrtcCompileProgram(program, len(options), _strings(options))
            log = self._result(program, "ProgramLog").rstrip(b"\0").decode(errors="replace")
            self._check(status, log)
            return self._result(program, "CUBIN"), log
        finally:
            self._library.nvrtcDestroyProgram(ctypes.byref(program))

    def _result(self, program: ctypes.c_void_p, name: str) -> bytes:
        """Return the log or the machine code of a program."""
        size = ctypes.c_size_t()
        self._check(getattr(self._library, f"nvrtcGet{name}Size")(program, ctypes.byref(size)))
        buffer = ctypes.create_string_buffer(size.value)
        self._check(getattr(self._library, f"nvrtcGet{name}")(program, buffer))
        return buffer.raw

    def _check(self, status: int, log: str = "") -> None:
        if not status:
            return
        lines = [printable(line) for line in log.splitlines() if line.strip()]
        faults = [line for line in lines if "error" in line] or lines
        text = self._library.nvrtcGetErrorString(status).decode()
        fault = "\n  ".join([f"the text cannot be compiled: {text}", *faults[:_SHOWN]])
        raise ToolchainError(Problem("", f"{fault} [E2276]", "another version of NVRTC, or a report of this fault"))


def _strings(texts: Sequence[str]) -> Any:
    return (ctypes.c_char_p * len(texts))(*(text.encode() for text in texts))


def options_for(size: int, version: str) -> tuple[str, ...]:
    """Return the options by which NVRTC takes a text whose threads keep so many bytes in memory: a stepper's state and
    workspace, or values that pass from part to part of a function."""
    return AS_CALLS * (size > 4 * _ALL and int(version.partition(".")[0]) >= 13)


@functools.cache
def nvrtc() -> Nvrtc:
    """Return the library NVRTC of this Python or of this machine. Raises ToolchainError if there is none."""
    faults = []
    for path in candidates():
        try:
            return Nvrtc(path)
        except (OSError, AttributeError) as error:
            faults.append(f"{path}: {printable(str(error))}")
    tried = f": {'; '.join(faults)}" if faults else ""
    fault = f"the library NVRTC, which compiles for the card, was not found{tried} [E2277]"
    raise ToolchainError(Problem("NVRTC", fault, INSTALL))


def candidates() -> Iterator[str]:
    """Yield the paths of libraries NVRTC in the order of the search: in wheels by NVIDIA, which PyTorch, CuPy and JAX
    install as well, the newest first; on the loader's path; in installations of CUDA."""
    spec = importlib.util.find_spec("nvidia")
    wheels = (spec.submodule_search_locations or ()) if spec is not None else ()
    yield from _libraries(path for folder in wheels for path in Path(folder).rglob("*nvrtc*"))
    if loaded := ctypes.util.find_library("nvrtc"):
        yield loaded
    roots = (os.environ.get("CUDA_PATH"), os.environ.get("CUDA_HOME"), sys.prefix, "/usr/local/cuda")
    folders = [Path(root, part) for root in roots if root for part in ("lib64", "lib", "bin")]
    yield from _libraries(path for folder in folders for path in folder.glob("*nvrtc*"))


def _libraries(paths: Iterable[Path]) -> Iterator[str]:
    """Yield the files among paths that are libraries NVRTC, the last one first."""
    for path in sorted(paths, reverse=True):
        if re.fullmatch(_LIBRARY, path.name) and "builtins" not in path.name:
            yield str(path)
