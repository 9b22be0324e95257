"""The target ``cuda``: the C of a model and its stepper, unchanged, and kernels that call it for many states or runs.

``NAME.cu`` includes ``eomgen_cuda.h``, by which NVRTC takes C as CUDA, and the C of the model. A C++ compiler takes the
same text for the host, with the same bits if products are not fused with sums.
"""

from __future__ import annotations

import math

from eomgen.codegen.folder import MANIFEST, manifest
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.interface import fingerprint
from eomgen.codegen.targets.c.naming import NAMES
from eomgen.codegen.targets.c.target import model_in_one_file
from eomgen.codegen.targets.target import Target
from eomgen.products.gpu.names import CudaNames

#: Bytes of numbers in C.
_SIZES = {"eomgen_real": 8, "double": 8, "long": 8, "int": 4, "eomgen_bits": 8}
#: Threads of a block, at most; 64, 128 and 256 were equally fast on an H100.
THREADS = 128


def cuda_files(program: Program, *, states: bool = True) -> dict[str, str]:
    """Return the text for the device by file name, without manifest: ``NAME.cu`` and the files that it includes.

    Parameters
    ----------
    states : whether there are kernels for functions of states
    """
    called = program.functions if states else []
    templates = {"eomgen_cuda.h": "gpu/eomgen_cuda.h.jinja", f"{program.prefix}.cu": "gpu/model.cu.jinja"}
    return model_in_one_file(program, CudaNames, templates, called=called, threads=THREADS)


def _files(program: Program) -> dict[str, str]:
    files, facts = cuda_files(program), {"threads": THREADS}
    if program.method:
        header = files[f"{program.prefix}.h"]
        facts["run_bytes"] = sum(bytes_of(header, f"{program.prefix}_{part}") for part in ("state", "workspace"))
    return {**files, MANIFEST: manifest(program, files, fingerprint=fingerprint(files), **facts)}


def bytes_of(header: str, name: str) -> int:
    """Return the bytes of a struct in a header of C, in double, with the alignment of a 64-bit device."""
    return _layout_of(header, name)[0]


def _layout_of(header: str, name: str) -> tuple[int, int]:
    """Return bytes and alignment of a type."""
    before, closing, _ = header.partition(f"\n}} {name};")
    if not closing or name in _SIZES:
        simple = _SIZES.get(name, 4)  # else an enumeration
        return simple, simple
    code = "".join(part.rpartition("*/")[2] for part in before.rpartition("\ntypedef struct ")[2].split("/*"))
    code = code.partition("{")[2]
    place, widest = 0, 1
    for declaration in code.split(";")[:-1]:
        kind, _, declared = declaration.strip().partition(" ")
        size, alignment = _layout_of(header, kind)
        widest = max(widest, alignment)
        for member in declared.split(","):
            count = math.prod(int(factor.rstrip("] ")) for part in member.split("[")[1:] for factor in part.split("*"))
            place = -(-place // alignment) * alignment + count * size
    return -(-place // widest) * widest, widest


CUDA = Target("cuda", "CUDA C++", NAMES, _files, steppers=True)
"""Kernels for NVRTC, with functions of states and whole runs."""
