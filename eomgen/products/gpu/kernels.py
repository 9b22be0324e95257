"""The kernel of a term of a model on a device: the text is made, compiled and loaded, or taken from the cache."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.base.data import replace
from eomgen.codegen.metadata import interface_layout
from eomgen.codegen.program import Program
from eomgen.compiled.model import CompiledModel
from eomgen.pipeline.content import library_content
from eomgen.pipeline.documents import as_document
from eomgen.pipeline.generation import exported_program
from eomgen.products.gpu.driver import Device, Function, Module
from eomgen.products.gpu.nvrtc import EXACT, LAYOUT, Cubin, compile_cubin, nvrtc, options_for
from eomgen.products.gpu.target import CUDA, cuda_files, functions_in_rows, memory_of_functions
from eomgen.system.terms import Selection

_FLOAT = "-DEOMGEN_REAL_FLOAT"
#: For blocks of 144 threads at most, NVRTC 13 gives a thread all 255 registers; for 64 some kernels get 168,
#: and spill the rest. Blocks have 64 threads all the same.
ALL_REGISTERS = "-DEG_BOUND(threads)=144"
#: The last Program whose text was written, by the content of the library: several terms of a model follow each other.
_PROGRAMS: dict[bytes, Program] = {}


class Term:
    """Arguments and outputs of kernels: names of blocks with sizes, names of outputs with shapes.

    Parameters
    ----------
    function : of the layout of a Program
    prefix : of the names of its kernels
    in_rows : whether there is a kernel for rows
    """

    def __init__(self, function: Mapping[str, Any], prefix: str, *, in_rows: bool) -> None:
        self.name: str = function["name"]
        self.blocks: tuple[str, ...] = tuple(function["inputs"])
        self.sizes = tuple(int(size) for size in function["input_sizes"])
        self.names = tuple(str(output["name"]) for output in function["outputs"])
        self.shapes = [tuple(output["shape"]) for output in function["outputs"]]
        self._start, self._in_rows = f"{prefix}_{self.name}", in_rows

    def kernel(self, module: Module, *, rows: bool) -> Function:
        """Return the kernel for outputs in rows, or for all others."""
        return module.function(f"{self._start}{'_rows' if rows and self._in_rows else ''}_kernel")


def load_kernel(model: CompiledModel, term: str, real: str, device: Device, *, fused: bool) -> tuple[Module, Term]:
    """Return the kernels of a term, or of a function of time alone, on a device, and their arguments.

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
    layout = json.loads(cubin.layout)
    function = next(function for function in layout["functions"] if function["name"] == term)
    return device.load(cubin.image), Term(function, layout["prefix"], in_rows=term in layout["in_rows"])


def compile_term(
    model: CompiledModel, term: str, architecture: str, real: str = "double", *, fused: bool = False
) -> Cubin:
    """Return the machine code of a term for an architecture such as ``sm_90``, from the cache if possible.

    The text is a part of the text of the model with all its terms, since the order of operations, and so the bits,
    depend on the terms that a scene is derived with.
    """
    layout, (document, front_end) = model.library.layout, as_document(model.scene)
    selection = Selection.from_data(layout["selection"]) if term in model.functions else Selection((term,))
    content = library_content(document, front_end, selection, layout["built_method"])

    def texts() -> tuple[Mapping[str, str], Sequence[str]]:
        whole = _PROGRAMS.get(content)
        if whole is None:
            program, _ = exported_program(document, front_end, CUDA, selection.terms, layout["built_method"])
            whole = replace(program, method={}, series=(), base_of_step=None)
            _PROGRAMS.clear()
            _PROGRAMS[content] = whole
        kept = {term, whole.function(term).same_as}
        program = replace(whole, functions=tuple(one for one in whole.functions if one.name in kept))
        in_rows = functions_in_rows(program)
        told = {**interface_layout(program), "in_rows": [item.name for item in in_rows]}
        files = {**cuda_files(program, in_rows=in_rows), LAYOUT: json.dumps(told)}
        return files, options_for(memory_of_functions(program), nvrtc().version)

    options = (*(() if fused else EXACT), *((_FLOAT,) if real == "float" else ()))
    every = term.encode() + b"\0" + content
    return compile_cubin(texts, f"{layout['prefix']}.cu", architecture, options, again=[ALL_REGISTERS], content=every)
