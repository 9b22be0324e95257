"""The text for the device on the host: a C++ compiler takes the file of the target ``cuda``, and a C compiler the C, so
that bits can be compared."""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import eomgen

Array = NDArray[Any]

#: A run of the default start, after the model's header or its text for the device.
RUN = """
#include <stdlib.h>
#if defined(__cplusplus)
extern "C"
#endif
long eg_bytes(int workspace) { return workspace ? (long)sizeof(P_workspace) : (long)sizeof(P_state); }
#if defined(__cplusplus)
extern "C"
#endif
int eg_run(long steps, const eomgen_real *u_table, eomgen_real *record, long *recorded)
{
    P_parameters p;
    P_settings settings;
    P_state *state = (P_state *)calloc(1, sizeof *state);
    P_workspace *work = (P_workspace *)calloc(1, sizeof *work);
    P_status status;
    P_default_parameters(&p);
    P_default_settings(&settings);
    P_default_state(state);
    status = P_initialize(&p, &settings, state, work, u_table);
    if (!status)
        status = P_run(&p, &settings, state, work, steps, 1, u_table, record, recorded);
    free(state);
    free(work);
    return status;
}
"""
#: The thread that a kernel computes on the host.
THREAD = """
extern "C" void eg_set_thread(long long i) { eg_thread = i; }
"""
#: Numbers of a recorded run, and rows of inputs in a step, at most.
ROOM, ROWS = 200_000, 16


class View(ctypes.Structure):
    """``eg_array``: an array of samples."""

    _fields_ = (("at", ctypes.c_void_p), ("sample", ctypes.c_longlong), ("component", ctypes.c_longlong))


def view(array: Array, layout: str) -> tuple[View, Array]:
    """Return an array [samples][numbers] as ``rows``, ``columns`` or ``broadcast`` of its first sample, and its
    memory."""
    samples, numbers = array.shape
    memory = np.ascontiguousarray(array.T if layout == "columns" else array)
    sample, component = {"rows": (numbers, 1), "columns": (1, samples), "broadcast": (0, 1)}[layout]
    return View(memory.ctypes.data, sample, component), memory


class Pair:
    """A scene as C and as text for the device, both compiled for the host."""

    def __init__(self, scene: Any, folder: Path, *, real: str = "double", level: str = "-O2", **options: Any) -> None:
        self.number = np.float32 if real == "float" else np.float64
        for target in ("c", "cuda"):
            eomgen.generate(scene, folder / target, target=target, real=real, **options)
        data = json.loads((folder / "cuda" / "manifest.json").read_text(encoding="utf-8"))
        self.name, self.kernels, self.parameters = data["model"], data["kernels"], data["quantities"]["parameters"]
        self.thread_bytes = data.get("thread_bytes", {})
        self.inputs_without_formula = data["sizes"]["u"] * ("inputs" not in data["functions"])
        self.has_steps = (folder / "cuda" / f"{self.name}_step.c").exists()
        flags = [
            level,
            "-ffp-contract=off",
            "-shared",
            "-fPIC",
            "-w",
            *(["-DEOMGEN_REAL_FLOAT"] * (real == "float")),
        ]
        run = RUN.replace("P_", f"{self.name}_") if self.has_steps else ""
        (folder / "run.c").write_text(f'#include "c/{self.name}.h"\n{run}', encoding="utf-8")
        (folder / "run.cpp").write_text(f'#include "cuda/{self.name}.cu"\n{run}{THREAD}', encoding="utf-8")
        sources = [path for path in (folder / "c").glob("*.c") if path.name != "main.c"]
        for compiler, standard, files in (("cc", "c99", ["run.c", *sources]), ("c++", "c++20", ["run.cpp"])):
            assert shutil.which(compiler), f"the test needs the compiler {compiler}"
            command = [compiler, f"-std={standard}", *flags, *files, "-o", f"{compiler}.so", "-lm"]
            subprocess.run(command, check=True, cwd=folder)
        self.c, self.device = (ctypes.CDLL(str(folder / f"{compiler}.so")) for compiler in ("cc", "c++"))

    def runs(self, steps: int) -> tuple[tuple[int, int, Array], tuple[int, int, Array]]:
        """Return status, number of rows and numbers of a run from the scene's start, by the C and by the text for the
        device."""
        results, held = [], np.full(ROWS * (steps + 1) * self.inputs_without_formula, 0.1, self.number)
        for library in (self.c, self.device):
            record, recorded = np.zeros(ROOM, self.number), ctypes.c_long()
            table = ctypes.c_void_p(held.ctypes.data if len(held) else None)
            taken = ctypes.c_void_p(record.ctypes.data)
            status = library.eg_run(ctypes.c_long(steps), table, taken, ctypes.byref(recorded))
            results.append((status, recorded.value, record))
        return results[0], results[1]

    def inputs(self, kernel: Mapping[str, Any], rng: np.random.Generator, samples: int) -> dict[str, Array]:
        """Return random arguments of a function, [samples][numbers]: parameters near the values of the scene."""
        arrays = {}
        for argument in kernel["inputs"]:
            name, size = argument["name"], argument["size"]
            near = np.array([item["value"] for item in self.parameters]) if name == "p" else np.zeros(size)
            spread = 0.1 * np.maximum(np.abs(near), 1.0) if name == "p" else np.full(size, 0.5)
            arrays[name] = (near + spread * rng.uniform(-1.0, 1.0, (samples, size))).astype(self.number)
        return arrays

    def by_c(self, kernel: Mapping[str, Any], inputs: Mapping[str, Array]) -> list[Array]:
        """Return the outputs of a function by the C, [samples][numbers]."""
        function, of_time = (
            getattr(self.c, f"{self.name}_{kernel['function']}"),
            np.ctypeslib.as_ctypes_type(self.number),
        )
        function.restype = None
        samples = max(map(len, inputs.values()), default=1)
        outputs = [np.zeros((samples, item["size"]), self.number) for item in kernel["outputs"]]
        for i in range(samples):
            arguments = [
                of_time(array[i, 0]) if name == "t" else ctypes.c_void_p(array[i].ctypes.data)
                for name, array in inputs.items()
            ]
            function(*arguments, *(ctypes.c_void_p(output[i].ctypes.data) for output in outputs))
        return outputs

    def by_kernel(self, name: str, inputs: Mapping[str, Array], layouts: Sequence[str], out: str) -> list[Array]:
        """Return the outputs of a kernel, with ``layouts`` for the inputs, in turn, and ``out`` for the outputs."""
        function, kernel = getattr(self.device, name), self.kernels[name]
        function.restype = None
        function.argtypes = [View] * (len(kernel["inputs"]) + len(kernel["outputs"])) + [ctypes.c_longlong]
        samples = max(map(len, inputs.values()), default=1)
        zeros = [np.zeros((samples, item["size"]), self.number) for item in kernel["outputs"]]
        given = [view(array, layouts[place % len(layouts)]) for place, array in enumerate(inputs.values())]
        taken = [view(array, out) for array in zeros]
        for i in range(samples + 1):  # the last thread has no sample
            self.device.eg_set_thread(ctypes.c_longlong(i))
            function(*(item for item, _ in (*given, *taken)), samples)
        return [memory.T if out == "columns" else memory for _, memory in taken]


def same_bits(first: Array, second: Array) -> bool:
    """Return whether two arrays have equal bits; all that is not a number is equal."""
    nan = np.isnan(first)
    return bool((np.isnan(second) == nan).all()) and first[~nan].tobytes() == second[~nan].tobytes()
