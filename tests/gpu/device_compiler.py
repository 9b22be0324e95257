"""NVRTC by ctypes, for tests of the texts for the device, and the registers that kernels take:
``python -m tests.gpu.device_compiler --update`` writes ``registers.json`` anew."""

from __future__ import annotations

import ctypes
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

ROOT = Path(__file__).parents[2]
TABLE = Path(__file__).parent / "registers.json"
#: Models with budgets: file of ``examples`` or robot of ``benchmarks.robots``, and functions.
MODELS: dict[str, tuple[str, ...]] = {
    "panda": ("inverse_dynamics", "forward_dynamics", "partials"),
    "talos": ("inverse_dynamics", "forward_dynamics"),
    "four_bar": ("inverse_dynamics", "partials", "constraint_jacobian"),
    "active_vehicle": ("forward_dynamics", "partials"),
    "spin_up_beam": ("forward_dynamics", "partials"),
}
_ENTRY = r"entry function '(\w+)'.*\n.*\n.* (\d+) bytes stack frame, (\d+) bytes .*, (\d+) bytes .*\n.*Used (\d+)"


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


def compile_text(folder: Path, *options: str) -> tuple[int, str]:
    """Return status and log of NVRTC for a folder of the target ``cuda``, by the options of its manifest."""
    data = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    name = f"{data['model']}.cu"
    texts = dict.fromkeys(("math.h", "string.h", "stddef.h", "stdint.h"), "")
    texts |= {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir() if path.suffix in (".c", ".h")}
    every = [*data["nvrtc"], "-w", *options]
    library, program = _library(), ctypes.c_void_p()
    text = (folder / name).read_bytes()
    library.nvrtcCreateProgram(
        ctypes.byref(program), text, name.encode(), len(texts), _strings([*texts.values()]), _strings([*texts])
    )
    status = library.nvrtcCompileProgram(program, len(every), _strings(every))
    size = ctypes.c_size_t()
    library.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    log = ctypes.create_string_buffer(size.value)
    library.nvrtcGetProgramLog(program, log)
    library.nvrtcDestroyProgram(ctypes.byref(program))
    return status, log.value.decode()


def _strings(texts: Sequence[str]) -> Any:
    return (ctypes.c_char_p * len(texts))(*(text.encode() for text in texts))


def usage(model: str) -> dict[str, dict[str, int]]:
    """Return registers of a thread, and bytes of its stack and of registers in memory, for the functions of a model on
    an H100 or H200."""
    if model in ("panda", "talos"):
        from benchmarks.robots import ROBOTS, scene

        described: Any = scene(ROBOTS[model])
    else:
        described = ROOT / "examples" / model / "scene.toml"
    with tempfile.TemporaryDirectory() as folder:
        eomgen.generate(described, folder, list(MODELS[model]), target="cuda")
        status, log = compile_text(Path(folder), "-arch=sm_90", "--ptxas-options=-v")
    assert status == 0, log
    rows = {name: numbers for name, *numbers in re.findall(_ENTRY, log)}
    names = {
        function: next(name for name in rows if name.endswith(f"_{function}_kernel")) for function in MODELS[model]
    }
    return {
        function: {
            "registers": int(rows[name][3]),
            "stack": int(rows[name][0]),
            "spills": sum(map(int, rows[name][1:3])),
        }
        for function, name in names.items()
    }


if __name__ == "__main__":
    assert sys.argv[1:] == ["--update"]
    rows = {f"{model} {function}": row for model in MODELS for function, row in usage(model).items()}
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(row)}" for name, row in rows.items())
    TABLE.write_text(f'{{\n "version": "{version()}",\n "kernels": {{\n{lines}\n }}\n}}\n', encoding="utf-8")
