"""This platform's library of an FMU, compiled with the headers of FMI that eomgen carries."""

from __future__ import annotations

import platform
import sys
from collections.abc import Mapping
from pathlib import Path

from eomgen.base.files import template_folder
from eomgen.products.fmu.interface import Interface
from eomgen.products.fmu.sources import wrapper_name
from eomgen.toolchain.builder import SHARED, Builder

#: Names of processors in FMI 3.0, and of platforms in FMI 2.0, which knows x86 alone.
_PROCESSORS = {"AMD64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
_SYSTEMS = {"linux": ("linux", "linux64", ".so"), "darwin": ("darwin", "darwin64", ".dylib")}
_SYSTEMS["win32"] = ("windows", "win64", ".dll")


def binary_path(interface: Interface) -> str:
    """Return the path of this platform's library in the archive."""
    system, old, ending = _SYSTEMS.get(sys.platform, (sys.platform, sys.platform, ".so"))
    processor = _PROCESSORS.get(platform.machine(), platform.machine())
    folder = old if interface.version == 2 else f"{processor}-{system}"
    return f"binaries/{folder}/{interface.identifier}{ending}"


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
    wrapper = wrapper_name(interface)
    shared = f"#define FMI{interface.version}_OVERRIDE_FUNCTION_PREFIX 1\n{files[wrapper]}"
    whole = {**files, **headers(interface.version), wrapper: shared}
    content = "\0".join(f"{name}\0{text}" for name, text in sorted(whole.items()))

    def write(folder: Path) -> None:
        for name, text in whole.items():
            (folder / name).write_text(text, encoding="utf-8")

    entry = Builder(profile=profile).build_folder(b"fmu\0" + content.encode(), write)
    return entry.file(SHARED).read_bytes()
