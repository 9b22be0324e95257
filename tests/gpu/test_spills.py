"""The report of NVRTC on registers, the second compilation of kernels that spill while registers are free, and the
options of texts whose threads keep many values in memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace

import pytest

from eomgen.products.gpu import nvrtc
from eomgen.products.gpu.nvrtc import Cubin, Usage, compile_cubin, options_for
from eomgen.toolchain.cache import Cache

#: A kernel that keeps its spills in memory of the block, with a function whose spills the kernel's own entry takes off.
IN_BLOCK = """ptxas info    : Compiling entry function 'arm_kernel' for 'sm_90'
ptxas         .     0 bytes stack frame, -648 bytes spill stores, -712 bytes spill loads
ptxas info    : Used 255 registers, used 0 barriers, 31232 bytes smem
ptxas info    : Function properties for arm_part1
ptxas         .     0 bytes stack frame, 648 bytes spill stores, 712 bytes spill loads
"""
FEW = """ptxas info    : Compiling entry function 'arm_kernel' for 'sm_90'
ptxas         .     752 bytes stack frame, 748 bytes spill stores, 748 bytes spill loads
ptxas info    : Used 168 registers, used 0 barriers, 752 bytes cumulative stack size, 26880 bytes smem
"""
#: A text for steps, which stay functions: these come before the kernel.
STEPS = """ptxas info    : Function properties for arm_advance
ptxas         .     168 bytes stack frame, 116 bytes spill stores, 120 bytes spill loads
ptxas info    : Compiling entry function 'arm_runs' for 'sm_90'
ptxas         .     3904 bytes stack frame, 32 bytes spill stores, 30 bytes spill loads
ptxas info    : Used 255 registers, used 0 barriers, 4872 bytes cumulative stack size
"""
ALL = FEW.replace("168", "255").replace("75", "10").replace("74", "10")


def test_spills_in_memory_of_the_block_are_no_spills() -> None:
    assert Cubin(b"", IN_BLOCK).usage == {"arm_kernel": Usage(255, 0, 0)}
    assert Cubin(b"", FEW).usage == {"arm_kernel": Usage(168, 752, 1496)}


def test_functions_before_the_first_kernel_are_its_own() -> None:
    assert Cubin(b"", STEPS).usage == {"arm_runs": Usage(255, 4872, 298)}
    assert Cubin(b"", "").usage == {}


@pytest.mark.parametrize(
    ("logs", "again", "calls", "taken"),
    [
        ([IN_BLOCK], ["-DMORE"], 1, 255),
        ([FEW, ALL], ["-DMORE"], 2, 255),
        ([FEW, FEW.replace("748", "900")], ["-DMORE"], 2, 168),
        ([FEW], [], 1, 168),
    ],
    ids=["no spills", "fewer spills", "more spills", "no second options"],
)
def test_kernels_that_spill_early_are_compiled_again(
    logs: list[str], again: list[str], calls: int, taken: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Sequence[str]] = []

    def compile_(texts: Mapping[str, str], name: str, options: Sequence[str]) -> tuple[bytes, str]:
        given.append(options)
        return str(len(given)).encode(), logs[len(given) - 1]

    compiler = SimpleNamespace(identity="1", version="1", compile=compile_)
    monkeypatch.setattr(nvrtc, "nvrtc", lambda: compiler)
    code = compile_cubin({"arm.cu": ""}, "arm.cu", "sm_90", again=again, cache=Cache(tmp_path))
    assert (len(given), code.usage["arm_kernel"].registers) == (calls, taken)
    assert ("-DMORE" in given[-1]) == (calls == 2)


def test_options_that_come_with_the_texts_are_of_both_compilations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Sequence[str]] = []

    def compile_(texts: Mapping[str, str], name: str, options: Sequence[str]) -> tuple[bytes, str]:
        given.append(options[-2:])
        return b"", FEW

    compiler = SimpleNamespace(identity="1", version="1", compile=compile_)
    monkeypatch.setattr(nvrtc, "nvrtc", lambda: compiler)
    compile_cubin(lambda: ({"arm.cu": ""}, ["-DA"]), "arm.cu", "sm_90", ["-DO"], again=["-DB"], cache=Cache(tmp_path))
    assert given == [("-DO", "-DA"), ("-DA", "-DB")]


@pytest.mark.parametrize(("version", "size", "calls"), [("13.5", 1020, 0), ("13.5", 1021, 1), ("12.9", 1021, 0)])
def test_functions_stay_functions_if_registers_cannot_hold_their_values(version: str, size: int, calls: int) -> None:
    assert options_for(size, version).count("--Ofast-compile=min") == calls
