"""The wrapper of a compiled model: C by cffi (API mode), or none if Python's headers are missing (ABI mode).

cffi's own ``compile()`` drags setuptools in (0.6 s); its generated C is compiled here directly instead. The wrapper
depends on the interface only, so one object serves all models.
"""

from __future__ import annotations

import importlib.machinery
import importlib.util
import sysconfig
from pathlib import Path
from typing import Any

from eomgen.errors import ToolchainError

MODULE = "_eomgen_model"


def python_headers() -> Path | None:
    """Return the folder of Python.h, or None."""
    for key in ("include", "platinclude"):
        folder = Path(sysconfig.get_paths()[key])
        if (folder / "Python.h").is_file():
            return folder
    return None


def wrapper_source(cdef: str, header: str) -> str:
    """Return the C of the extension module around an interface declared in ``header``."""
    import io  # noqa: PLC0415  # only when something is built

    import cffi  # noqa: PLC0415
    from cffi import recompiler  # noqa: PLC0415

    ffi = cffi.FFI()
    ffi.cdef(cdef)
    preamble = f'#include "{header}"\n'
    maker = recompiler.Recompiler(ffi, MODULE)
    maker.collect_type_table()
    maker.collect_step_tables()
    text = io.StringIO()
    maker.write_source_to_f(text, preamble)
    return text.getvalue()


def load_api(path: Path) -> tuple[Any, Any]:
    """Return ``ffi`` and ``lib`` of an extension module. Raises ToolchainError when it cannot be loaded."""
    loader = importlib.machinery.ExtensionFileLoader(MODULE, str(path))
    spec = importlib.util.spec_from_file_location(MODULE, path, loader=loader)
    try:
        if spec is None:
            raise ImportError("not an extension module")
        module = importlib.util.module_from_spec(spec)
        loader.exec_module(module)
    except (ImportError, OSError, SystemError) as error:
        raise unloadable(path, error) from error
    return module.ffi, module.lib


def load_abi(path: Path, cdef: str) -> tuple[Any, Any]:
    """Return ``ffi`` and ``lib`` of a plain shared library. Raises ToolchainError when it cannot be loaded."""
    import cffi  # noqa: PLC0415  # the API mode does without

    ffi = cffi.FFI()
    ffi.cdef(cdef)
    try:
        return ffi, ffi.dlopen(str(path))
    except OSError as error:
        raise unloadable(path, error) from error


def unloadable(path: Path, error: Exception) -> ToolchainError:
    """Return the problem of a library that cannot be loaded."""
    where_nothing_runs = "failed to map segment" in str(error)  # the loader's message for a file system mounted noexec
    hint = (
        "EOMGEN_CACHE=<a folder on a file system from which programs may run>"
        if where_nothing_runs
        else "building again"
    )
    return ToolchainError(f"the compiled library {path} cannot be loaded: {error}", hint)
