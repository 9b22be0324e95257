"""Examine what building needs, item by item, and name the command that mends what is broken."""

from __future__ import annotations

import platform
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from eomgen.build.cache import default_folder
from eomgen.build.cffi_build import python_headers
from eomgen.build.compiler import compile_library, find_compiler, install_hint, library_suffix
from eomgen.errors import EomgenError

PACKAGES = ("sympy", "numpy", "scipy", "jinja2", "cffi", "pydantic", "click", "rich", "platformdirs", "matplotlib", "pint")
_PROBE = "#include <math.h>\ndouble eomgen_probe(double x) { return sqrt(x); }\n"


@dataclass(frozen=True)
class Check:
    """One item: whether it is fine, what was found, what mends it, and whether building fails without it (``needed``)."""

    name: str
    ok: bool
    found: str
    remedy: str = ""
    needed: bool = True


def examine() -> list[Check]:
    """Return all checks; none of them raises."""
    return [_python(), *map(_guarded, (_compiler, _compiles, _headers, _cache)), *map(_package, PACKAGES)]


def _guarded(check: Callable[[], Check]) -> Check:
    try:
        return check()
    except (EomgenError, OSError) as error:
        return Check(check.__name__.strip("_").replace("_", " "), False, str(error), "see the message")


def _python() -> Check:
    fine = sys.version_info >= (3, 11)
    return Check(
        "python",
        fine,
        f"{platform.python_version()} on {platform.system()} {platform.machine()}",
        "" if fine else "python 3.11 or later",
    )


def _compiler() -> Check:
    try:
        compiler = find_compiler()
        return Check("compiler", True, f"{compiler.version} ({compiler.path})")
    except EomgenError as error:
        return Check("compiler", False, error.problems[0].what, error.problems[0].hint)


def _compiles() -> Check:
    with tempfile.TemporaryDirectory(prefix="eomgen-doctor-") as folder:
        source = Path(folder) / "probe.c"
        source.write_text(_PROBE, encoding="ascii")
        try:
            compile_library(find_compiler(), [source], Path(folder) / f"probe{library_suffix()}", ("-O0",), timeout=60)
        except EomgenError as error:
            return Check("compiles", False, error.problems[0].what, install_hint())
    return Check("compiles", True, "a small library builds and links")


def _headers() -> Check:
    folder = python_headers()
    if folder is not None:
        return Check("Python.h", True, str(folder), needed=False)
    return Check(
        "Python.h", False, "missing; models are loaded in ABI mode, with a slower call", "apt install python3-dev", needed=False
    )


def _cache() -> Check:
    folder = default_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        return Check(
            "cache",
            False,
            f"{folder} cannot be written: {error.strerror or error}",
            "export EOMGEN_CACHE=<a folder you own>",
            needed=False,
        )
    return Check("cache", True, str(folder), needed=False)


def _package(name: str) -> Check:
    try:
        return Check(name, True, version(name))
    except PackageNotFoundError:
        return Check(name, False, "not installed", f"pip install {name}")
