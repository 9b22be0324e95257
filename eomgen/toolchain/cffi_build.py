"""C in addition to the model's own: its wrapper by cffi (API mode), or none if Python's headers are missing (ABI mode),
and companions for as many samples as there are lanes.

cffi's own ``compile()`` drags setuptools in (0.6 s); its generated C is compiled here directly instead. The wrapper
depends on the interface only, so one object serves all models.

A companion is one function of the model for batches in lanes, with parts kept apart from inlining. The model's own text
is compiled a second time with ``real`` as vectors. A companion has one function, since a vector's compiler takes as
long for each function as for a number's, and a large batch asks for one: all files stand in one, in which the other
functions are declared static first, and a compiler drops static functions that are not called.
"""

from __future__ import annotations

import importlib.machinery
import importlib.util
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from eomgen.errors import ToolchainError
from eomgen.toolchain.tables import library_texts

MODULE = "_eomgen_model"
_ABI_FLAGS = getattr(sys, "abiflags", "")  # not on Windows


def python_headers() -> Path | None:
    """Return the folder of Python.h, or None; None on Windows, whose extension modules are linked with a library of
    Python."""
    if sys.platform == "win32":
        return None
    usual = Path(sys.base_prefix, "include", f"python{sys.version_info.major}.{sys.version_info.minor}{_ABI_FLAGS}")
    if (usual / "Python.h").is_file():
        return usual
    import sysconfig  # noqa: PLC0415  # executes the whole configuration of Python

    folders = (Path(sysconfig.get_path(key)) for key in ("include", "platinclude"))
    return next((folder for folder in folders if (folder / "Python.h").is_file()), None)


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
    """Return ``ffi`` and ``lib`` of an extension module. Raises ToolchainError when the module cannot be loaded."""
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
    """Return ``ffi`` and ``lib`` of a plain shared library. Raises ToolchainError when the library cannot be loaded."""
    import cffi  # noqa: PLC0415  # the API mode does without

    ffi = cffi.FFI()
    ffi.cdef(cdef)
    try:
        return ffi, ffi.dlopen(str(path))
    except OSError as error:
        raise unloadable(path, error) from error


def unloadable(path: Path, error: Exception) -> ToolchainError:
    """Return the ToolchainError for a library that cannot be loaded, with a remedy that fits the loader's error."""
    where_nothing_runs = "failed to map segment" in str(error)  # the loader's message for a file system mounted noexec
    hint = (
        "EOMGEN_CACHE=<a folder on a file system from which programs may run>"
        if where_nothing_runs
        else "building again"
    )
    return ToolchainError(f"the compiled library {path} cannot be loaded: {error} [E2104]", hint)


#: The file that a companion is compiled from.
SOURCE = "lanes.c"
_APART = "__attribute__((noinline)) "
_DECLARED = r"(?m)^void (\w+)\("


def companion_files(folder: Path, layout: Mapping[str, Any], function: str) -> dict[str, str]:
    """Return texts by file name of the companion with one function of the library in a folder: headers, and
    ``lanes.c``.

    Files of the scene and the tables of numbers are added unchanged.

    Raises
    ------
    OSError, UnicodeError
        The library's sources cannot be read.
    """
    from eomgen.toolchain.rows_ahead import MACROS, with_fetches  # noqa: PLC0415  # only for companions

    prefix = str(layout["prefix"])
    number = [item["name"] for item in layout["functions"]].index(function)
    files = library_texts(folder)
    headers = {name: text for name, text in files.items() if name.endswith(".h")}
    pattern = re.compile(rf"{re.escape(prefix)}(_\d+|_curves|_external|_tables)?\.c")
    texts = [text for name, text in files.items() if pattern.fullmatch(name)]
    interface = files["interface.c"]
    # no prototypes: the types of the arguments are declared later, and the prototypes that follow fit to these
    names = (name for text in headers.values() for name in re.findall(_DECLARED, text))
    declared = {name for name in names if name.startswith(f"{prefix}_")}
    # functions in separate files stay separate here, too, since products are fused with sums within a function
    separate_functions = re.findall(_DECLARED, headers.get(f"{prefix}_parts.h", ""))
    text = [
        f"/* {SOURCE}: {function} of the model {prefix}, a sample in each lane. */",
        f"#define EOMGEN_ONLY_FUNCTION {number}",
        *(f"static {_APART if name in separate_functions else ''}void {name}();" for name in sorted(declared)),
        *MACROS,
        "",
        *with_fetches(texts, interface, layout["functions"][number], prefix),
        interface,
    ]
    further = re.compile(rf"{re.escape(prefix)}_(user_.*|numbers)\.c")
    return {**headers, SOURCE: "\n".join(text), **{name: files[name] for name in files if further.fullmatch(name)}}
