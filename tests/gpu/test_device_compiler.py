"""NVRTC takes the text of each example, and kernels take the registers of ``registers.json``; not collected if NVRTC is
not installed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import eomgen
from tests.gpu.device_compiler import MODELS, TABLE, compile_text, folder_of_libraries, usage, version

__test__ = folder_of_libraries() is not None
EXAMPLES = Path(__file__).parents[2] / "examples"
SCENES = sorted(path.parent.name for path in EXAMPLES.glob("*/scene.toml"))
#: Registers and bytes that another version of NVRTC may take more.
ALLOWANCE = 1.25


@pytest.mark.slow
@pytest.mark.long_cases("elastic_pendulum", "hanging_chain", "misaligned_four_bar", "unbalanced_shaft")
@pytest.mark.parametrize("name", SCENES)
def test_the_text_of_an_example_compiles_in_double_and_in_float(name: str, tmp_path: Path) -> None:
    eomgen.generate(EXAMPLES / name / "scene.toml", tmp_path, target="cuda")
    for number in ([], ["-DEOMGEN_REAL_FLOAT"]):
        status, log = compile_text(tmp_path, "-arch=compute_90", "--Ofast-compile=max", *number)
        assert status == 0, log


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_kernels_take_the_registers_of_the_table(model: str) -> None:
    table = json.loads(TABLE.read_text(encoding="utf-8"))
    now = {f"{model} {function}": row for function, row in usage(model).items()}
    if version() == table["version"]:
        assert now == {name: row for name, row in table["kernels"].items() if name.startswith(f"{model} ")}
    for name, row in now.items():
        for key, number in row.items():
            assert number <= ALLOWANCE * table["kernels"][name][key] + 16, (name, key)
