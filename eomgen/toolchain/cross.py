"""Programs and objects for other machines by zig: from a folder of generated C to a file next to the sources, the size
of the model's code, and the deepest stack.

Formats: System V gABI (ELF), Microsoft PE and COFF, Apple Mach-O, WebAssembly core 1.0; of objects alone.
"""

from __future__ import annotations

import json
import re
import shlex
import struct
import tempfile
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

from eomgen.base.data import dataclass
from eomgen.base.files import read_file
from eomgen.base.messages import nearest, shown
from eomgen.errors import FileError, Problem, ToolchainError, UsageError
from eomgen.toolchain.compiler import PIP_INSTALL, ZIG_PACKAGE, Compiler, run_compiler, zig_program


@dataclass(frozen=True)
class CrossTarget:
    """A machine for which programs are made.

    Attributes
    ----------
    name : as on the command line
    triple : of zig: processor, operating system, C library
    flags : further flags
    ending : of the file
    linked : whether a program is made; else an object with all functions, to be linked into firmware
    runner : words of a program that runs the file on another machine, if there is any
    """

    name: str
    triple: str
    ending: str = ""
    flags: tuple[str, ...] = ()
    linked: bool = True
    runner: tuple[str, ...] = ()


TARGETS: Mapping[str, CrossTarget] = {
    target.name: target
    for target in (
        CrossTarget("x86_64-linux", "x86_64-linux-musl", runner=("qemu-x86_64-static",)),
        CrossTarget("aarch64-linux", "aarch64-linux-musl", runner=("qemu-aarch64-static",)),
        CrossTarget("riscv64-linux", "riscv64-linux-musl", runner=("qemu-riscv64-static",)),
        CrossTarget("x86_64-windows", "x86_64-windows-gnu", ".exe", runner=("wine",)),
        CrossTarget("arm64-macos", "aarch64-macos"),
        CrossTarget("wasm32", "wasm32-wasi", ".wasm", runner=("wasmtime",)),
        # for the headers of a C library; the object has no call of an operating system
        CrossTarget("cortex-m4", "thumb-linux-musleabihf", ".o", ("-mcpu=cortex_m4", "-ffunction-sections"), False),
    )
}


class CrossBuild(NamedTuple):
    """File for another machine.

    Attributes
    ----------
    target : name
    file : the program or the object
    size : bytes of the file; of a program with the C library
    code : bytes of the machine code of the model and its stepper, without ``main`` and the C library
    stack : bytes of the frames of the deepest chain of calls of the model's functions, without the C library
    command : that made the file
    """

    target: str
    file: Path
    size: int
    code: int
    stack: int
    command: str


def cross_target(name: str) -> CrossTarget:
    """Return a target. Raises UsageError with the known names."""
    if name not in TARGETS:
        fault = f"no machine is called {shown(name)} [E0859]"
        raise UsageError(Problem("--for", fault, f"{nearest(name, list(TARGETS))}; known are {', '.join(TARGETS)}"))
    return TARGETS[name]


def zig() -> Compiler:
    """Return the compiler zig. Raises ToolchainError."""
    program = zig_program()
    if program is None:
        fault = f"files for other machines are made by the package {ZIG_PACKAGE}, which is not installed [E2116]"
        raise ToolchainError(Problem("--for", fault, PIP_INSTALL))
    return Compiler((str(program), "cc"), program)


def cross_build(folder: Path, name: str) -> CrossBuild:
    """Compile a folder that ``eomgen.generate`` wrote for another machine, and return the made file with sizes.

    ``name`` is a key of ``TARGETS``; the program or object is written into the folder.

    Raises
    ------
    UsageError
        There is no such target.
    ToolchainError
        zig is not installed, or the files cannot be compiled.
    FileError
        The folder was not written by eomgen.
    """
    target, compiler = cross_target(name), zig()
    try:
        manifest = json.loads(read_file(folder / "manifest.json"))
        words, prefix = shlex.split(manifest["compile"]), str(manifest["model"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FileError(
            Problem(str(folder), f"this is not a folder of eomgen's: {error} [E2117]", "eomgen generate")
        ) from None
    flags = [word for word in words if word.startswith(("-std", "-O", "-f", "-D"))]
    common = [*compiler.command, "-target", target.triple, *target.flags, *flags, "-g0"]
    output = (folder / f"{prefix}-{name}{target.ending}").resolve()
    location = f"zig for {name}, sources in {folder}"
    frames: dict[str, int] = {}
    calls: dict[str, set[str]] = {}
    with tempfile.TemporaryDirectory() as scratch:
        objects = []
        for word in words:
            if not word.endswith(".c") or word == "main.c":
                continue
            source, binary = str((folder / word).resolve()), Path(scratch) / f"{Path(word).stem}.o"
            frames |= _frames(run_compiler([*common, _SAY_FRAMES, "-c", source, "-o", str(binary)], binary, location))
            listing = binary.with_suffix(".ll")
            run_compiler([*common, "-S", "-emit-llvm", source, "-o", str(listing)], listing, location)
            calls |= _calls(listing.read_text(encoding="utf-8"))
            objects.append(binary)
        code = sum(code_bytes(binary.read_bytes()) for binary in objects)
        main = [str((folder / "main.c").resolve())] if target.linked else ["-nostdlib", "-r"]
        end = ["-s", "-lm"] if target.linked else []
        command = [*common, *main, *map(str, objects), *end, "-o", str(output)]
        run_compiler(command, output, location)
    return CrossBuild(name, output, output.stat().st_size, code, _deepest(frames, calls), shlex.join(command))


#: Of clang: a warning for each function, with the size of the frame.
_SAY_FRAMES = "-Wframe-larger-than=0"
_FRAME = re.compile(r"stack frame size \((\d+)\) exceeds limit \(0\) in '(\w+)'")
_DEFINED = re.compile(r"^define .*?@\"?([\w.$]+)\"?\(", re.MULTILINE)
_CALLED = re.compile(r"\bcall\b.*?@\"?([\w.$]+)\"?\(")


def _frames(warnings: str) -> dict[str, int]:
    """Return the bytes of the frames of functions, by name."""
    return {name: int(size) for size, name in _FRAME.findall(warnings)}


def _calls(text: str) -> dict[str, set[str]]:
    """Return the functions that each function of a listing of LLVM calls."""
    pieces = _DEFINED.split(text)
    return {name: set(_CALLED.findall(body)) for name, body in zip(pieces[1::2], pieces[2::2], strict=True)}


def _deepest(frames: Mapping[str, int], calls: Mapping[str, set[str]]) -> int:
    """Return the largest sum of frames along a chain of calls; generated C has no recursion."""

    @cache
    def depth(name: str) -> int:
        return frames.get(name, 0) + max((depth(callee) for callee in calls[name] if callee in calls), default=0)

    return max(map(depth, calls), default=0)


def code_bytes(data: bytes) -> int:
    """Return the bytes of machine code in an object file: ELF, COFF, Mach-O or WebAssembly. Raises ValueError."""
    if data[:4] == b"\x7fELF":
        return sum(_elf_sizes(data))
    if data[:4] == b"\xcf\xfa\xed\xfe":
        return sum(_mach_o_sizes(data))
    if data[:4] == b"\0asm":
        return sum(size for kind, size in _wasm_sections(data) if kind == 10)  # code
    if data[:2] == b"\x64\x86":
        return sum(_coff_sizes(data))
    raise ValueError("an object file of an unknown format")


def _elf_sizes(data: bytes) -> Iterator[int]:
    """Yield the sizes, in bytes, of the sections with instructions of an ELF file of 32 or 64 bits."""
    wide = data[4] == 2
    table = struct.unpack_from("<Q" if wide else "<I", data, 40 if wide else 32)[0]
    size, count = struct.unpack_from("<HH", data, 58 if wide else 46)
    for k in range(count):
        if wide:
            flags, length = struct.unpack_from("<8xQ16xQ", data, table + k * size)
        else:
            flags, length = struct.unpack_from("<8xI8xI", data, table + k * size)
        if flags & 4:  # SHF_EXECINSTR
            yield length


def _coff_sizes(data: bytes) -> Iterator[int]:
    """Yield the sizes of sections with code, which follow the header of 20 bytes."""
    for k in range(struct.unpack_from("<2xH", data)[0]):
        length, flags = struct.unpack_from("<16xI16xI", data, 20 + 40 * k)
        if flags & 0x20:  # IMAGE_SCN_CNT_CODE
            yield length


def _mach_o_sizes(data: bytes) -> Iterator[int]:
    """Yield the sizes, in bytes, of the sections with instructions of a Mach-O file of 64 bits."""
    offset = 32
    for _ in range(struct.unpack_from("<16xI", data)[0]):
        kind, length = struct.unpack_from("<II", data, offset)
        if kind == 0x19:  # LC_SEGMENT_64
            for k in range(struct.unpack_from("<64xI", data, offset)[0]):
                size, flags = struct.unpack_from("<40xQ16xI", data, offset + 72 + 80 * k)
                if flags & 0x80000400:  # pure or some instructions
                    yield size
        offset += length


def _wasm_sections(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield (kind, size in bytes) of the sections of a WebAssembly file."""
    offset = 8
    while offset < len(data):
        kind, offset = data[offset], offset + 1
        size = shift = 0
        while True:  # LEB128
            byte, offset = data[offset], offset + 1
            size |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                break
        yield kind, size
        offset += size
