"""The machine of a measurement: processor, compiler, versions."""

from __future__ import annotations

import platform
from pathlib import Path

from eomgen.base.version import __version__
from eomgen.errors import ToolchainError
from eomgen.toolchain.compiler import find_compiler


def machine() -> dict[str, str]:
    """Return processor, system, compiler and versions by name."""
    try:
        compiler = find_compiler().version
    except ToolchainError:
        compiler = "unknown"
    return {
        "processor": _processor(),
        "system": f"{platform.system()} {platform.release()}",
        "compiler": compiler,
        "python": platform.python_version(),
        "eomgen": __version__,
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.machine())
