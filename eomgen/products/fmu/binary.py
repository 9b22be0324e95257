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
from eomgen.toolchain.compiler import run_compiler, write_texts
from eomgen.toolchain.cross import zig

#: Names of processors and of systems in FMI 3.0.
_PROCESSORS = {"AMD64": "x86_64", "arm64": "aarch64"}
_SYSTEMS = {"win32": "windows"}


@dataclass(frozen=True)
class TargetMachine:
    """A machine with a library of an FMU.

    Attributes
    ----------
    name : of FMI 3.0
    triple : of zig; empty for a machine for which zig makes no libraries
    ending : of libraries
    folder : of FMI 2.0; empty for a machine that FMI 2.0, which knows x86 alone, does not name
    """

    name: str
    triple: str
    ending: str
    folder: str = ""

    def library_path(self, version: int, identifier: str) -> str:
        """Return the path of the machine's library in the archive, by the version of FMI."""
        return f"binaries/{self.folder if version == 2 else self.name}/{identifier}{self.ending}"


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


def this_machine(version: int) -> TargetMachine:
    """Return the machine on which this process runs. Raises UsageError if the version of FMI has no name for it."""
    processor = _PROCESSORS.get(platform.machine(), platform.machine())
    name = f"{processor}-{_SYSTEMS.get(sys.platform, sys.platform)}"
    machine = MACHINES.get(name, TargetMachine(name, "", ".dll" if sys.platform == "win32" else ".so"))
    if version == 2 and not machine.folder:
        fault = f"FMI 2.0 names x86 machines alone, and this one is {name} [E0859]"
        raise UsageError(Problem("binary", fault, "version=3; or binary=False (--no-binary), for sources alone"))
    return machine


def machine_named(name: str, version: int) -> TargetMachine:
    """Return a machine. Raises UsageError with the known names."""
    names = [machine.name for machine in MACHINES.values() if version == 3 or machine.folder]
    if name not in names:
        remark = "; FMI 2.0 names x86 machines alone" if name in MACHINES else ""
        fault = f"no machine is called {shown(name)}{remark} [E0859]"
        raise UsageError(Problem("machines", fault, f"one of {', '.join(names)}"))
    return MACHINES[name]


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
    builder = Builder(profile=profile)
    entry = builder.build_folder(b"fmu\0" + content.encode(), lambda folder: write_texts(folder, whole))
    return entry.file(SHARED).read_bytes()


def _whole(interface: Interface, files: Mapping[str, str]) -> dict[str, str]:
    """Return the sources of a shared library with the headers of FMI."""
    wrapper = wrapper_name(interface)
    shared = f"#define FMI{interface.version}_OVERRIDE_FUNCTION_PREFIX 1\n{files[wrapper]}"
    return {**files, **headers(interface.version), wrapper: shared}


def cross_built(interface: Interface, files: Mapping[str, str], machine: TargetMachine) -> bytes:
    """Return the bytes of a library for another machine, made by zig.

    Raises
    ------
    ToolchainError
        zig is not installed, or a source cannot be compiled.
    """
    whole = _whole(interface, files)
    with tempfile.TemporaryDirectory() as scratch:
        output = Path(scratch) / f"{interface.identifier}{machine.ending}"
        write_texts(output.parent, whole)
        flags = ["-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden", "-shared", "-s"]
        flags += [] if machine.ending == ".dll" else ["-fPIC"]
        sources = sorted(name for name in whole if name.endswith(".c"))
        words = [*zig().command, "-target", machine.triple, *flags, *sources, "-o", output.name, "-lm"]
        run_compiler(words, output, f"zig for {machine.name}")
        return output.read_bytes()
