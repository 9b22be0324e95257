"""NVRTC by ctypes, for tests of the texts for the device, and the registers that kernels take:
``python -m tests.gpu.device_compiler --update`` writes ``registers.json`` anew, with names of rows only these rows."""

from __future__ import annotations

import ctypes
import importlib.util
import json
import re
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import eomgen
from eomgen.pipeline.documents import as_document
from eomgen.pipeline.generation import exported_program
from eomgen.products.gpu.kernels import ALL_REGISTERS
from eomgen.products.gpu.nvrtc import EXACT, Usage, compile_cubin, nvrtc, options_for
from eomgen.products.gpu.target import CUDA, RUNS, cuda_files, functions_in_rows, memory_of_functions, run_texts
from eomgen.toolchain.cache import Cache
from tests.examples.demos import demo_module

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
#: Examples with a scene in another file than ``scene.toml``, or by a function of a program: its file, name, arguments.
ELSEWHERE: dict[str, str | tuple[str, str, *tuple[int, ...]]] = {
    "acrobot_swing_up": "model/scene.toml",
    "car": "system/car.toml",
    "car_in_side_wind": "system/car.toml",
    "cart_pole_swing_up": "model/scene.toml",
    "coupled_fmus": "scenes/monolith.toml",
    "driving_car": "system/lane_change.toml",
    "duffing_random_excitation": "system/oscillator.toml",
    "fastest_panda": ("demo.py", "arm"),
    "flexible_slider_crank": ("crank.py", "scene", 4),
    "flying_spaghetti": ("spaghetti.py", "scene", 16),
    "frame_in_earthquake": ("demo.py", "scene"),
    "heavy_top": "se3.toml",
    "hopping_leg": "system/hopper.toml",
    "identified_arm": ("demo.py", "scene"),
    "identified_quarter_car": ("demo.py", "scene"),
    "moored_platform": "system/platform.toml",
    "motorcycle": "system/motorcycle.toml",
    "quarter_car_on_random_road": ("demo.py", "scene"),
    "right_angle_cantilever": ("cantilever.py", "scene", 10),
    "roll_up": ("roll_up.py", "scene", 8),
    "rolling_tyre": "system/wheel.toml",
    "rotor_blade": ("blade.py", "scene", 8),
    "scalar_wave": ("demo.py", "pulse"),
    "tippe_top": "system/top.toml",
    "vehicle_with_preview": "model/scene.toml",
}
#: Folders without a text of their own for a card: fields on meshes, Hamiltonians, waves, and scenes of other examples.
WITHOUT_TEXT = frozenset(
    (
        "density_field",
        "henon_heiles",
        "outer_solar_system",
        "radar_image_of_a_swell",
        "receding_horizon",
        "storm_in_lagrangian_waves",
        "turned_four_bar",
        "verification",
    )
)
FOLDERS = {path.parent.name for path in (ROOT / "examples").glob("*/README.md")} | {"verification"}
EXAMPLES = sorted(FOLDERS - WITHOUT_TEXT)
#: The record of runs has one column, the first coordinate.
COLUMN = "#define EG_COLUMN_COUNT 1\n#define EG_COLUMNS(take) take(0, line[1])\n"


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
    step : the kernel of steps of the README is compiled in place of the kernels of functions
    """
    data = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    name = f"{data['model']}.cu"
    texts = dict.fromkeys(("math.h", "string.h", "stddef.h", "stdint.h"), "")
    texts |= {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir() if path.suffix in (".c", ".h")}
    text = (folder / name).read_text(encoding="utf-8")
    if step:
        readme = (folder / "README.md").read_text(encoding="utf-8")
        (kernel,) = re.findall(r"^    extern .*?^    }$", readme, re.MULTILINE | re.DOTALL)
        text = text[: text.index("/*", text.index("_step.c"))] + kernel
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


def described(model: str) -> Any:
    """Return the scene of a robot or of an example."""
    if model in ("panda", "talos"):
        from benchmarks.robots import ROBOTS, scene

        return scene(ROBOTS[model])
    there, folder = ELSEWHERE.get(model, "scene.toml"), ROOT / "examples" / model
    if isinstance(there, str):
        return folder / there
    file, function, *arguments = there
    sys.path[:0] = [str(folder)] * (str(folder) not in sys.path)
    return getattr(demo_module(model, file), function)(*arguments)


def texts_of(model: str, term: str = "") -> Iterator[tuple[str, dict[str, str], tuple[str, ...]]]:
    """Yield names, texts and options for NVRTC: of the functions of a model, or of one term, and of runs."""
    document, front_end = as_document(described(model))
    program, refusal = exported_program(document, front_end, CUDA, [term] if term else None)
    more = options_for(memory_of_functions(program), nvrtc().version)
    yield f"{program.prefix}.cu", cuda_files(program, in_rows=functions_in_rows(program)), (*EXACT, *more)
    if not term and not refusal:
        texts, size = run_texts(program, COLUMN, "double")
        yield RUNS, texts, (*EXACT, *options_for(size, nvrtc().version))


def usage(model: str, function: str = "") -> dict[str, int]:
    """Return registers of a thread, bytes of its stack with all calls, and bytes of registers that are stored and
    loaded, for a kernel on an H100 or H200; without a function, the most of all kernels of an example: of its
    functions, of runs and of reductions."""
    if function == "step":
        return _usage_of_step(model)
    again, rows = [ALL_REGISTERS] * bool(function), dict[str, Usage]()
    with tempfile.TemporaryDirectory() as folder:
        for name, texts, options in texts_of(model, function.removesuffix("_rows")):
            rows |= compile_cubin(texts, name, "sm_90", options, again=again, cache=Cache(folder)).usage
    chosen = [row for name, row in rows.items() if name.endswith(f"_{function}_kernel" if function else "")]
    return {key: max(getattr(row, key) for row in chosen) for key in ("registers", "stack", "spills")}


def _usage_of_step(model: str) -> dict[str, int]:
    with tempfile.TemporaryDirectory() as folder:
        eomgen.generate(described(model), folder, target="cuda")
        status, log = compile_text(Path(folder), "-arch=sm_90", "--ptxas-options=-v", step=True)
    assert status == 0, log
    part = next(text for text in log.split("Compiling entry function")[1:] if "'ends'" in text)
    (stack,) = re.findall(r"(\d+) bytes cumulative stack", part)
    (registers,) = re.findall(r"Used (\d+) registers", part)
    return {
        "registers": int(registers),
        "stack": int(stack),
        "spills": sum(map(int, re.findall(r"(\d+) bytes spill", log))),
    }


def rows_of_table() -> list[str]:
    """Return the names of all rows: a model with a function, or an example."""
    return [f"{model} {function}" for model in MODELS for function in MODELS[model]] + EXAMPLES


def write(rows: Mapping[str, Mapping[str, int]]) -> None:
    """Write the table anew, with the rows that are known."""
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(rows[name])}" for name in rows_of_table() if name in rows)
    TABLE.write_text(f'{{\n "version": "{version()}",\n "kernels": {{\n{lines}\n }}\n}}\n', encoding="utf-8")


if __name__ == "__main__":
    assert sys.argv[1:2] == ["--update"]
    rows = json.loads(TABLE.read_text(encoding="utf-8"))["kernels"] if sys.argv[2:] else {}
    for name in sys.argv[2:] or rows_of_table():
        rows[name] = usage(*name.split())
        write(rows)
