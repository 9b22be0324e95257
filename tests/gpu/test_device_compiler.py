"""NVRTC takes the text of each example, and kernels take the registers of ``registers.json``; not collected if NVRTC is
not installed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import eomgen
from eomgen.errors import ToolchainError
from eomgen.products.gpu.nvrtc import compile_cubin, nvrtc, options_for
from eomgen.toolchain.cache import Cache
from tests.gpu.device_compiler import (
    ELSEWHERE,
    EXAMPLES,
    ROOT,
    TABLE,
    compile_text,
    described,
    folder_of_libraries,
    rows_of_table,
    usage,
    version,
)

__test__ = folder_of_libraries() is not None
#: Registers and bytes that another version of NVRTC may take more.
ALLOWANCE = 1.25


def test_the_table_has_a_row_for_each_example() -> None:
    assert list(json.loads(TABLE.read_text(encoding="utf-8"))["kernels"]) == rows_of_table()


@pytest.mark.slow
@pytest.mark.long_cases("elastic_pendulum", "hanging_chain", "misaligned_four_bar", "unbalanced_shaft")
@pytest.mark.long_cases(*ELSEWHERE.keys() - {"heavy_top", "tippe_top"})
@pytest.mark.parametrize("name", EXAMPLES)
def test_the_text_of_an_example_compiles_in_double_and_in_float(name: str, tmp_path: Path) -> None:
    eomgen.generate(described(name), tmp_path, target="cuda")
    for number in ([], ["-DEOMGEN_REAL_FLOAT"]):
        status, log = compile_text(tmp_path, "-arch=compute_90", "--Ofast-compile=max", *number)
        assert status == 0, log


@pytest.mark.slow
@pytest.mark.long_cases(*[name for name in rows_of_table() if name in EXAMPLES])
@pytest.mark.parametrize("name", rows_of_table())
def test_a_kernel_takes_the_registers_of_the_table(name: str) -> None:
    table = json.loads(TABLE.read_text(encoding="utf-8"))
    now, most = usage(*name.split()), table["kernels"][name]
    if version() == table["version"]:
        assert now == most, "if the change is meant: python -m tests.gpu.device_compiler --update"
    assert all(number <= ALLOWANCE * most[key] + 16 for key, number in now.items())


def test_kernels_spill_to_memory_of_the_block_unless_functions_stay_functions(tmp_path: Path) -> None:
    header = (ROOT / "templates" / "gpu" / "eomgen_cuda.h.jinja").read_text(encoding="utf-8")
    first = header.index("#if !defined(EG_SPILL_TO_BLOCK)")
    guarded = header[first : header.index("#endif", first)] + "#endif\n"
    kernel = 'extern "C" __global__ void arm_kernel(int *at) { EG_SPILL_TO_BLOCK; *at = 1; }'
    texts, of_calls = {"arm.cu": guarded + kernel}, options_for(1021, nvrtc().version)
    for options in ((), of_calls):
        code = compile_cubin(texts, "arm.cu", "sm_90", options, cache=Cache(tmp_path))
        assert code.usage["arm_kernel"].spills == 0
    with pytest.raises(ToolchainError, match="not allowed for per-function compilation"):
        compile_cubin(texts, "arm.cu", "sm_90", of_calls[:1], cache=Cache(tmp_path))
