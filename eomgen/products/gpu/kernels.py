"""The kernel of a term of a model on a device: its text is made, compiled and loaded, or taken from the cache."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.base.data import replace
from eomgen.pipeline.content import library_content
from eomgen.pipeline.documents import as_document
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import build_reproducible
from eomgen.pipeline.programs import write_program
from eomgen.pipeline.requests import ProgramRequest
from eomgen.products.gpu.driver import Device, Function
from eomgen.products.gpu.nvrtc import EXACT, Cubin, compile_cubin
from eomgen.products.gpu.target import CUDA, cuda_files
from eomgen.system.terms import TERMS, Selection

#: The term with which functions of time alone are compiled, as the law of the base: all scenes have this one.
_WITH = "mass"
_FLOAT = "-DEOMGEN_REAL_FLOAT"


def load_kernel(model: Model, term: str, real: str, device: Device, *, fused: bool) -> Function:
    """Return the kernel of a term, or of a function of time alone, on a device.

    Parameters
    ----------
    real : ``double`` or ``float``
    fused : whether products are fused with sums

    Raises
    ------
    ToolchainError
        NVRTC is not installed, or the text cannot be compiled.
    """
    cubin = compile_term(model, term, device.architecture, real, fused=fused)
    return device.load(cubin.image).function(f"{model.library.layout['prefix']}_{term}_kernel")


def compile_term(model: Model, term: str, architecture: str, real: str = "double", *, fused: bool = False) -> Cubin:
    """Return the machine code of a term for an architecture such as ``sm_90``, from the cache if possible."""
    document, front_end = as_document(model.scene)
    selection = Selection((term if term in TERMS else _WITH,))

    def texts() -> Mapping[str, str]:
        request = ProgramRequest(document, front_end, selection, None)
        return cuda_files(write_program(request, replace(CUDA, steppers=False), build_reproducible)[0])

    options = (*(() if fused else EXACT), *((_FLOAT,) if real == "float" else ()))
    content = library_content(document, front_end, selection, "rk4")
    name = f"{model.library.layout['prefix']}.cu"
    return compile_cubin(texts, name, architecture, options, content=content)
