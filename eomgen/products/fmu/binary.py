"""Libraries of an FMU, for this machine and for others by zig, compiled with the headers of FMI that eomgen carries."""

from __future__ import annotations

import platform
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from eomgen.base.data import dataclass
from eomgen.base.files import template_folder
from eomgen.base.messages import shown
from eomgen.errors import Problem, UsageError
from eomgen.products.fmu.interface import Interface
from eomgen.products.fmu.sources import wrapper_name
from eomgen.toolchain.builder import SHARED, Builder
from eomgen.toolchain.compiler import run_compiler
from eomgen.toolchain.cross import zig

#: Names of processors in FMI 3.0, and of platforms in FMI 2.0, which knows x86 alone.
_PROCESSORS = {"AMD64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
_SYSTEMS = {"linux": ("linux", "linux64", ".so"), "darwin": ("darwin", "darwin64", ".dylib")}
_SYSTEMS["win32"] = ("windows", "win64", ".dll")


def platform_folder(version: int) -> str:
    """Return the folder of this machine's library. Raises UsageError if the version of FMI has no name for the
    machine."""
    system, old, _ = _SYSTEMS.get(sys.platform, (sys.platform, sys.platform, ".so"))
    processor = _PROCESSORS.get(platform.machine(), platform.machine())
    if version == 2 and processor != "x86_64":
        fault = f"FMI 2.0 names x86 machines alone, and this one is {processor}-{system} [E0859]"
        raise UsageError(Problem("binary", fault, "version=3; or binary=False (--no-binary), for sources alone"))
    return old if version == 2 else f"{processor}-{system}"


def binary_path(interface: Interface) -> str:
    """Return the path of this machine's library in the archive."""
    ending = _SYSTEMS.get(sys.platform, ("", "", ".so"))[2]
    return f"binaries/{platform_folder(interface.version)}/{interface.identifier}{ending}"


def headers(version: int) -> dict[str, str]:
    """Return the headers of a version of FMI by name."""
    folder = template_folder() / "fmu" / f"fmi{version}"
    return {file.name: file.read_text(encoding="utf-8") for file in sorted(folder.glob("*.h"))}


def built(interface: Interface, files: Mapping[str, str], profile: str = "reproducible") -> bytes:
    """Return the library of sources, from the cache if compiled before.

    Parameters
    ----------
    files : of ``source_files``
    profile : of the compiler, as of ``eomgen.build``

    Raises
    ------
    ToolchainError
        There is no compiler, or a source cannot be compiled.
    """
    whole = _whole(interface, files)
    content = "\0".join(f"{name}\0{text}" for name, text in sorted(whole.items()))

    def write(folder: Path) -> None:
        for name, text in whole.items():
            (folder / name).write_text(text, encoding="utf-8")

    entry = Builder(profile=profile).build_folder(b"fmu\0" + content.encode(), write)
    return entry.file(SHARED).read_bytes()


def _whole(interface: Interface, files: Mapping[str, str]) -> dict[str, str]:
    """Return the sources of a shared library with the headers of FMI."""
    wrapper = wrapper_name(interface)
    shared = f"#define FMI{interface.version}_OVERRIDE_FUNCTION_PREFIX 1\n{files[wrapper]}"
    return {**files, **headers(interface.version), wrapper: shared}


@dataclass(frozen=True)
class TargetMachine:
    """A machine for which zig makes libraries.

    Attributes
    ----------
    name : of FMI 3.0
    triple : of zig
    ending : of libraries
    folder : of FMI 2.0; empty for a machine that FMI 2.0 does not name
    """

    name: str
    triple: str
    ending: str
    folder: str = ""


MACHINES: Mapping[str, TargetMachine] = {
    machine.name: machine
    for machine in (
        TargetMachine("x86_64-linux", "x86_64-linux-gnu", ".so", "linux64"),
        TargetMachine("aarch64-linux", "aarch64-linux-gnu", ".so"),
        TargetMachine("x86_64-windows", "x86_64-windows-gnu", ".dll", "win64"),
        TargetMachine("x86_64-darwin", "x86_64-macos", ".dylib", "darwin64"),
        TargetMachine("aarch64-darwin", "aarch64-macos", ".dylib"),
    )
}


def machine_named(name: str, version: int) -> TargetMachine:
    """Return a machine. Raises UsageError with the known names."""
    names = [machine.name for machine in MACHINES.values() if version == 3 or machine.folder]
    if name not in names:
        remark = "; FMI 2.0 names x86 machines alone" if name in MACHINES else ""
        fault = f"no machine is called {shown(name)}{remark} [E0859]"
        raise UsageError(Problem("machines", fault, f"one of {', '.join(names)}"))
    return MACHINES[name]


def cross_built(interface: Interface, files: Mapping[str, str], machine: TargetMachine) -> tuple[str, bytes]:
    """Return the path in the archive and the bytes of a library for another machine, made by zig.

    Raises
    ------
    ToolchainError
        zig is not installed, or a source cannot be compiled.
    """
    whole, identifier = _whole(interface, files), interface.identifier
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name, text in whole.items():
            (folder / name).write_text(text, encoding="utf-8")
        output = folder / f"{identifier}{machine.ending}"
        flags = ["-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden", "-shared", "-s"]
        flags += [] if machine.ending == ".dll" else ["-fPIC"]
        sources = sorted(name for name in whole if name.endswith(".c"))
        words = [*zig().command, "-target", machine.triple, *flags, *sources, "-o", output.name, "-lm"]
        run_compiler(words, output, f"zig for {machine.name}")
        inside = machine.folder if interface.version == 2 else machine.name
        return f"binaries/{inside}/{output.name}", output.read_bytes()
