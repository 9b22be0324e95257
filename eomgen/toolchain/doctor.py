"""Checks of the build requirements one by one, with the command that repairs each failure."""

from __future__ import annotations

import importlib.util
import os
import platform
import shlex
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from eomgen.base.data import dataclass
from eomgen.base.products import objects_of
from eomgen.errors import EomgenError, FileError
from eomgen.toolchain.cache import closing, default_folder, refusal, writable_by_others
from eomgen.toolchain.cffi_build import python_headers
from eomgen.toolchain.compiler import as_root, compile_library, find_compiler, install_command, library_suffix

PACKAGES = (
    "sympy",
    "numpy",
    "scipy",
    "jinja2",
    "cffi",
    "pydantic",
    "click",
    "rich",
    "platformdirs",
    "matplotlib",
)
#: Bytes that should be free for compiled models.
ROOM = 50_000_000
#: Makes another folder for temporary files.
_TEMPORARY = 'mkdir -p "$HOME/tmp" && export TMPDIR="$HOME/tmp"'
_PROBE = "#include <math.h>\ndouble eomgen_probe(double x) { return sqrt(x); }\n"


@dataclass(frozen=True)
class ToolchainCheck:
    """Result of one check of the build requirements. ``name`` of the requirement, whether the check is ``ok``, the text
    ``found``, the command that mends a fault, and whether builds need this."""

    name: str
    ok: bool
    found: str
    remedy: str = ""
    needed: bool = True


def examine() -> list[ToolchainCheck]:
    """Return all checks; none of them raises."""
    machine = (_temporary, _compiler, _compiles, _headers, _cache, _room)
    return [_python(), *map(_run_check, (*machine, *objects_of("eomgen.doctor"))), *map(_package, PACKAGES)]


def _run_check(check: Callable[[], ToolchainCheck]) -> ToolchainCheck:
    try:
        return check()
    except (EomgenError, OSError) as error:
        return ToolchainCheck(check.__name__.strip("_").replace("_", " "), False, str(error), "see the message")


def _python() -> ToolchainCheck:
    running = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    return ToolchainCheck("python", True, running)  # an older one cannot read the package


def _temporary() -> ToolchainCheck:
    """Check the temporary folder, in which compilers write for any cache."""
    try:
        with tempfile.TemporaryFile():
            return ToolchainCheck("temporary files", True, tempfile.gettempdir())
    except OSError as error:
        named = next((name for name in ("TMPDIR", "TEMP", "TMP") if os.environ.get(name)), "")
        remedy = f"unset {named}" if named else _TEMPORARY
        return ToolchainCheck("temporary files", False, str(error.strerror or error), remedy)


def _compiler() -> ToolchainCheck:
    try:
        compiler = find_compiler()
        reason = "named by CC" if os.environ.get("CC") else "the first of cc, gcc, clang and the package ziglang"
        kind = "zig, " if compiler.is_zig else ""
        return ToolchainCheck("compiler", True, f"{kind}{compiler.version} ({compiler.path}), {reason}")
    except EomgenError as error:
        return ToolchainCheck("compiler", False, error.problems[0].what, _other_compiler())


def _other_compiler() -> str:
    """Return the command that puts another compiler in the place of one that is of no use."""
    return "unset CC" if os.environ.get("CC") else install_command()


def _compiles() -> ToolchainCheck:
    try:
        zig = find_compiler().is_zig
        first = _seconds_of_build()
        later = _seconds_of_build() if zig else first
    except EomgenError as error:
        remedy = _TEMPORARY if isinstance(error, FileError) else _other_compiler()
        return ToolchainCheck("compiles", False, error.problems[0].what, remedy)
    result = f"a small library builds and links in {later:.2g} s"
    if first > later + 2.0:
        result += f"; zig took {first:.2g} s to make its C library for this machine, once"
    return ToolchainCheck("compiles", True, result)


def _seconds_of_build() -> float:
    """Return the time in which a small library is compiled and linked. Raises ToolchainError or FileError."""
    with tempfile.TemporaryDirectory(prefix="eomgen-doctor-") as folder:
        source = Path(folder) / "probe.c"
        source.write_text(_PROBE, encoding="ascii")
        began = time.perf_counter()
        compiler, output = find_compiler(), Path(folder) / f"probe{library_suffix()}"
        compile_library(compiler, [source], output, ("-O0",), timeout=900 if compiler.is_zig else 60)
        return time.perf_counter() - began


def _headers() -> ToolchainCheck:
    folder = python_headers()
    if folder is not None or sys.platform == "win32":
        result = str(folder or "not used on Windows, whose models are loaded in ABI mode")
        return ToolchainCheck("Python.h", True, result, needed=False)
    remedy = "the headers of this Python, from where it was installed"
    if shutil.which("apt-get") and sys.base_prefix == "/usr":
        remedy = as_root("apt-get install -y python3-dev")
    result = "missing; models are loaded in ABI mode, with a slower call"
    return ToolchainCheck("Python.h", False, result, remedy, needed=False)


def _cache() -> ToolchainCheck:
    try:
        folder = default_folder()
    except FileError as error:
        return ToolchainCheck("cache", False, error.problems[0].what, "unset EOMGEN_CACHE")
    if reason := refusal(folder):
        return ToolchainCheck("cache", False, f"{folder} cannot be written: {reason}", _repair(folder), needed=False)
    if others := writable_by_others(folder):
        fault = f"{folder} {others}, and its libraries are run"
        return ToolchainCheck("cache", False, fault, closing(folder) or _repair(folder), needed=False)
    return ToolchainCheck("cache", True, str(folder), needed=False)


def _repair(folder: Path) -> str:
    """Return the shell command that makes a folder usable as a cache. A file in this place is moved away, and a folder
    of the user's own made writable; else another folder is chosen."""
    if folder.exists() and not folder.is_dir():
        return f"mv {shlex.quote(str(folder))} {shlex.quote(str(folder))}.old"
    if folder.is_dir() and hasattr(os, "geteuid"):
        status = folder.stat()
        if status.st_uid == os.geteuid() and not status.st_mode & 0o200:
            return f"chmod u+rwx {shlex.quote(str(folder))}"
    return "unset EOMGEN_CACHE" if os.environ.get("EOMGEN_CACHE") else 'export EOMGEN_CACHE="$HOME/eomgen-cache"'


def _room() -> ToolchainCheck:
    try:
        folder = default_folder()
    except FileError:
        return ToolchainCheck("room", True, "not known, the cache has no folder", needed=False)
    while not folder.is_dir() and folder != folder.parent:
        folder = folder.parent
    free = shutil.disk_usage(folder).free
    result = f"{free / 1e6:.0f} MB free for the cache in {folder}"
    if free >= ROOM:
        return ToolchainCheck("room", True, result, needed=False)
    elsewhere = "unset EOMGEN_CACHE" if os.environ.get("EOMGEN_CACHE") else "export EOMGEN_CACHE=/var/tmp/eomgen-cache"
    return ToolchainCheck("room", False, result, elsewhere, needed=False)


def _package(name: str) -> ToolchainCheck:
    install = f"{shlex.quote(sys.executable)} -m pip install"
    try:
        result = version(name)
    except PackageNotFoundError:
        return ToolchainCheck(name, False, "not installed", f"{install} {name}")
    if importlib.util.find_spec(name) is None:
        fault = f"{result} is recorded, but its files are gone"
        return ToolchainCheck(name, False, fault, f"{install} --force-reinstall {name}")
    return ToolchainCheck(name, True, result)
