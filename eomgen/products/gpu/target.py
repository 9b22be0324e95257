"""The target ``cuda``: the C of a model and its stepper, unchanged, and kernels that call it for many states or runs.

``NAME.cu`` includes ``eomgen_cuda.h``, by which NVRTC takes C as CUDA, and the C of the model. A C++ compiler takes the
same text for the host, with the same bits if products are not fused with sums.
"""

from __future__ import annotations

from eomgen.codegen.folder import MANIFEST, manifest
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.interface import fingerprint
from eomgen.codegen.targets.c.naming import NAMES
from eomgen.codegen.targets.c.target import model_in_one_file
from eomgen.codegen.targets.target import Target
from eomgen.products.gpu.names import CudaNames

#: Threads of a block, at most; 64, 128 and 256 were equally fast on an H100.
THREADS = 128


def cuda_files(program: Program, *, states: bool = True) -> dict[str, str]:
    """Return the text for the device by file name, without manifest: ``NAME.cu`` and the files that it includes.

    Parameters
    ----------
    states : whether there are kernels for functions of states
    """
    called = [function for function in program.functions if function.name != "base" and states]
    templates = {"eomgen_cuda.h": "gpu/eomgen_cuda.h.jinja", f"{program.prefix}.cu": "gpu/model.cu.jinja"}
    return model_in_one_file(program, CudaNames, templates, called=called, threads=THREADS)


def _files(program: Program) -> dict[str, str]:
    files = cuda_files(program)
    return {**files, MANIFEST: manifest(program, files, fingerprint=fingerprint(files), threads=THREADS)}


CUDA = Target("cuda", "CUDA C++", NAMES, _files, steppers=True)
"""Kernels for NVRTC, with functions of states and whole runs."""
