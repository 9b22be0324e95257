"""The target ``cuda``: the C of a model and its stepper, unchanged, and kernels that call it for many states or runs.

``NAME.cu`` includes ``eomgen_cuda.h``, by which NVRTC takes C as CUDA, and the C of the model. A C++ compiler takes the
same text for the host, with the same bits if products are not fused with sums.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from eomgen.codegen.folder import MANIFEST, manifest
from eomgen.codegen.program import Program, ProgramFunction
from eomgen.codegen.targets.c.interface import fingerprint
from eomgen.codegen.targets.c.naming import NAMES
from eomgen.codegen.targets.c.target import model_in_one_file
from eomgen.codegen.targets.target import Target
from eomgen.products.gpu.driver import BLOCK
from eomgen.products.gpu.names import CudaNames
from eomgen.products.gpu.nvrtc import AS_CALLS, HEADERS, options_for

#: Live values of a part at most. 255 registers of 32 bits hold about 110 numbers; the rest of 256 threads fits into
#: the first-level cache.
LIVE_LIMIT = 175
#: Numbers of the longest output of a function with a kernel for rows, at least and at most.
LEAST, MOST = 32, 90
#: Operations for each number of the outputs at most. A thread that writes a number far from the others' fills a sector
#: of the second-level cache, 32 bytes: at 5.5 TB/s as long as 92 operations in double take, at 15.8e12 a second.
OPERATIONS = 92
#: Options by which NVRTC takes the text; the last keeps the bits: products are not fused with sums.
NVRTC = ("--std=c++20", "-default-device", "-fmad=false")
#: The same for a C++ compiler, which makes a library for the host.
HOST = ("c++", "-x", "c++", "-std=c++20", "-O2", "-ffp-contract=off", "-shared", "-fPIC")
#: File of the kernel of runs.
RUNS = "runs.cu"
#: Template of the structs of a stepper, by file name.
STRUCTS = {"structs": "c/integrators/common/header.h.jinja"}
#: Members of a struct for lanes, and for all other numbers: cffi knows no conditions.
_OF_LANES = re.compile(r"#ifdef EOMGEN_IN_LANES\n.*?#else\n(.*?)#endif\n", re.DOTALL)


def functions_in_rows(program: Program) -> list[ProgramFunction]:
    """Return the functions with a kernel for rows: outputs are long, fit in the memory of a block, and take longer to
    write than to compute. A pass over an output leaves out the operations of others, but none of those whose values
    pass from part to part."""
    return [
        item
        for item in program.functions
        if LEAST <= max(output.size for output in item.outputs) <= MOST
        and (len(item.outputs) == 1 or not item.workspace)
        and item.operations <= OPERATIONS * sum(output.size for output in item.outputs)
    ]


def memory_of_functions(program: Program) -> int:
    """Return the bytes of the values in double that pass from part to part of a function, at most."""
    return 8 * max(function.workspace for function in program.functions)


def cuda_files(program: Program, more: Mapping[str, str] = MappingProxyType({}), **known: object) -> dict[str, str]:
    """Return the text for the device by file name, without manifest: ``NAME.cu`` and the files that it includes.

    Parameters
    ----------
    more : templates of further files, by name
    known : names for these templates
    """
    templates = {"eomgen_cuda.h": "gpu/eomgen_cuda.h.jinja", f"{program.prefix}.cu": "gpu/model.cu.jinja", **more}
    known = {"called": program.functions, "in_rows": (), "threads": BLOCK, **known}
    return model_in_one_file(program, CudaNames, templates, **known)


def _kernels(program: Program) -> dict[str, dict[str, Any]]:
    """Return kernels by name: function, arrays in order with the numbers of a sample, and threads of a block, at most
    or, if it writes rows, exactly."""
    return {
        f"{program.prefix}_{function.name}{ending}_kernel": {
            "function": function.name,
            "inputs": [{"name": block, "size": program.input_size(block)} for block in function.inputs],
            "outputs": [{"name": output.argument, "size": output.size} for output in function.outputs],
            "threads": BLOCK,
        }
        for functions, ending in ((program.functions, ""), (functions_in_rows(program), "_rows"))
        for function in functions
    }


def thread_bytes(program: Program, real: str, structs: str) -> dict[str, int]:
    """Return the bytes of the structs ``state`` and ``workspace`` of a run, from their declarations in C."""
    from cffi import FFI  # noqa: PLC0415  # slow to import

    declarations, prefix, p = FFI(), program.prefix, program.sizes["p"]
    declarations.cdef(
        f"typedef {real} eomgen_real;"
        f"typedef struct {{ {f'eomgen_real all[{p}]' if p else 'char none'}; }} {prefix}_parameters;"
        f"typedef struct {{ eomgen_real all[{program.sizes['base'] or 1}]; }} {prefix}_base_state;"
        + _OF_LANES.sub(r"\1", structs)
    )
    return {name: declarations.sizeof(f"{prefix}_{name}") for name in ("state", "workspace")}


def run_texts(program: Program, head: str, real: str) -> tuple[dict[str, str], int]:
    """Return the kernel for runs, after lines ``head``, with all files that it includes, by name, and the bytes that a
    thread takes for state and workspace."""
    files = cuda_files(program, STRUCTS, called=())
    size = sum(thread_bytes(program, real, files.pop("structs")).values())
    return {RUNS: f'{head}#include "{program.prefix}.cu"\n', **files}, size


def _files(program: Program) -> dict[str, str]:
    """Return the texts of the folder by file name."""
    real = str(program.defaults.get("real", "double"))
    options = ["-DEOMGEN_REAL_FLOAT"] * (real == "float")
    commands = {
        "nvrtc": [*NVRTC, *options],
        "nvrtc_13": options_for(memory_of_functions(program), "13"),
        "host": " ".join([*HOST, *options, f"{program.prefix}.cu", "-o", f"{program.prefix}.so"]),
    }
    templates = {"README.md": "gpu/README.md.jinja"} | (STRUCTS if program.method else {})
    data: dict[str, Any] = {"kernels": _kernels(program), "empty_headers": HEADERS}
    known = {"commands": commands, "interface": data, "dtype": "float32" if real == "float" else "float64"}
    files = cuda_files(program, templates, **known, as_calls=AS_CALLS, in_rows=functions_in_rows(program))
    if structs := files.pop("structs", None):
        data["thread_bytes"] = thread_bytes(program, real, structs)
    return {**files, MANIFEST: manifest(program, files, fingerprint=fingerprint(files), **commands, **data)}


CUDA = Target("cuda", "CUDA C++", NAMES, _files, steppers=True, live_limit=LIVE_LIMIT)
"""Kernels for NVRTC, with functions of states and whole runs."""
