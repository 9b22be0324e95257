"""NVRTC by ctypes, for tests of the texts for the device, and the registers that kernels take:
``python -m tests.gpu.device_compiler --update`` writes ``registers.json`` anew, with names of rows only these rows."""

from __future__ import annotations

import ctypes
import dataclasses
import importlib.util
import json
import re
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import eomgen
from eomgen.products.gpu.kernels import ALL_REGISTERS
from eomgen.products.gpu.nvrtc import compile_cubin
from eomgen.toolchain.cache import Cache

ROOT = Path(__file__).parents[2]
TABLE = Path(__file__).parent / "registers.json"
#: Models with budgets: file of ``examples`` or robot of ``benchmarks.robots``, and functions; ``step``: the stepper.
MODELS: dict[str, tuple[str, ...]] = {
    "panda": ("inverse_dynamics", "forward_dynamics", "partials", "partials_rows"),
    "talos": ("inverse_dynamics", "forward_dynamics"),
    "four_bar": ("inverse_dynamics", "partials", "constraint_jacobian", "step"),
    "active_vehicle": ("forward_dynamics", "partials", "step"),
    "spin_up_beam": ("forward_dynamics", "partials", "step"),
}
#: Examples with a scene in a file. All others are programs in Python that describe, control or train, with no text of
#: their own for a card.
EXAMPLES = sorted(path.parent.name for path in (ROOT / "examples").glob("*/scene.toml"))
#: Examples without a row: NVRTC compiles their runs for minutes, or no time was measured.
NOT_MEASURED = frozenset(
    (
        "cable_net",
        "elastic_pendulum",
        "elastic_vehicle",
        "half_car_on_measured_road",
        "hanging_chain",
        "jerk_limited_arm",
        "misaligned_four_bar",
        "pi_servo",
        "quarter_car_on_bump",
        "rattleback",
        "robot_arm",
        "sea_arm",
        "slider_crank_spatial",
        "unbalanced_shaft",
    )
)
#: A kernel of steps, after the model and its stepper.
STEP = """
EG_KERNEL(128) P_step_kernel(const P_parameters *p, const P_settings *settings, P_state *states, long steps)
{
    P_workspace work;
    P_state state = states[EG_THREAD];
    memset(&work, 0, sizeof work);
    while (steps-- > 0 && !P_step(p, settings, &state, &work, NULL))
        continue;
    states[EG_THREAD] = state;
}
"""


def folder_of_libraries() -> Path | None:
    """Return the folder of NVRTC in this Python's packages, None if it has none."""
    spec = importlib.util.find_spec("nvidia")
    roots = [Path(root) for root in spec.submodule_search_locations or ()] if spec else []
    found = [path for root in roots for path in sorted(root.glob("*/lib/libnvrtc.so.*"))]
    return found[-1].parent if found else None


@cache
def _library() -> Any:
    folder = folder_of_libraries()
    assert folder is not None
    for pattern in ("libnvrtc-builtins.so.*", "libnvrtc.so.*"):
        library = ctypes.CDLL(str(sorted(folder.glob(pattern))[-1]), mode=ctypes.RTLD_GLOBAL)
    return library


def version() -> str:
    """Return the version of NVRTC: ``13.5``."""
    numbers = ctypes.c_int(), ctypes.c_int()
    _library().nvrtcVersion(*map(ctypes.byref, numbers))
    return ".".join(str(number.value) for number in numbers)


def compile_text(folder: Path, *options: str, step: bool = False) -> tuple[int, str]:
    """Return status and log of NVRTC for a folder of the target ``cuda``, by the options of its manifest.

    Parameters
    ----------
    options : further ones
    step : a kernel of steps is compiled in place of the kernels of functions
    """
    data = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    name = f"{data['model']}.cu"
    texts = dict.fromkeys(("math.h", "string.h", "stddef.h", "stdint.h"), "")
    texts |= {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir() if path.suffix in (".c", ".h")}
    text = (folder / name).read_text(encoding="utf-8")
    if step:
        text = text[: text.index("/*", text.index("_step.c"))] + STEP.replace("P_", f"{data['model']}_")
    every = [*data["nvrtc"], "-w", *options]
    library, program = _library(), ctypes.c_void_p()
    included = len(texts), _strings([*texts.values()]), _strings([*texts])
    library.nvrtcCreateProgram(ctypes.byref(program), text.encode(), name.encode(), *included)
    status = library.nvrtcCompileProgram(program, len(every), _strings(every))
    size = ctypes.c_size_t()
    library.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    log = ctypes.create_string_buffer(size.value)
    library.nvrtcGetProgramLog(program, log)
    library.nvrtcDestroyProgram(ctypes.byref(program))
    return status, log.value.decode()


def _strings(texts: Sequence[str]) -> Any:
    return (ctypes.c_char_p * len(texts))(*(text.encode() for text in texts))


def usage(model: str, function: str = "") -> dict[str, int]:
    """Return registers of a thread, bytes of its stack with all calls, and bytes of registers that are stored and
    loaded, for a kernel on an H100 or H200; without a function, the most of all kernels of an example: of its
    functions, of runs and of reductions."""
    if model in ("panda", "talos"):
        from benchmarks.robots import ROBOTS, scene

        described: Any = scene(ROBOTS[model])
    else:
        described = ROOT / "examples" / model / "scene.toml"
    step = function == "step"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        terms = [function.removesuffix("_rows")] if function and not step else None
        eomgen.generate(described, folder, terms, target="cuda")
        if not step:
            texts = {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir() if path.is_file()}
            prefix = json.loads(texts.pop("manifest.json"))["model"]
            again, cache = [ALL_REGISTERS] * bool(function), Cache(folder / "cache")
            code = compile_cubin(texts, f"{prefix}.cu", "sm_90", again=again, cache=cache)
            if function:
                return dataclasses.asdict(code.usage[f"{prefix}_{function}_kernel"])
            rows = [dataclasses.asdict(row) for row in code.usage.values()]
            return {key: max(row[key] for row in rows) for key in rows[0]}
        status, log = compile_text(folder, "-arch=sm_90", "--ptxas-options=-v", step=True)
    assert status == 0, log
    part = next(text for text in log.split("Compiling entry function")[1:] if "_step_kernel'" in text)
    (stack,) = re.findall(r"(\d+) bytes cumulative stack", part)
    (registers,) = re.findall(r"Used (\d+) registers", part)
    return {
        "registers": int(registers),
        "stack": int(stack),
        "spills": sum(map(int, re.findall(r"(\d+) bytes spill", log))),
    }


def rows_of_table() -> list[str]:
    """Return the names of all rows: a model with a function, or an example."""
    return [f"{model} {function}" for model in MODELS for function in MODELS[model]] + [
        name for name in EXAMPLES if name not in NOT_MEASURED
    ]


if __name__ == "__main__":
    assert sys.argv[1:2] == ["--update"]
    kept = json.loads(TABLE.read_text(encoding="utf-8"))["kernels"] if sys.argv[2:] else {}
    rows = kept | {name: usage(*name.split()) for name in sys.argv[2:] or rows_of_table()}
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(rows[name])}" for name in rows_of_table())
    TABLE.write_text(f'{{\n "version": "{version()}",\n "kernels": {{\n{lines}\n }}\n}}\n', encoding="utf-8")
