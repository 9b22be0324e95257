"""Kernels and ensembles on a card of NVIDIA: times over the bytes they move, over GRiD, and over the processor.

    python -m benchmarks.gpu --prepare    # without a card: machine code of all kernels, in minutes
    python -m benchmarks.gpu --dry        # without a card: all rows on the processor, with few states
    python -m benchmarks.gpu              # on the card, 8 minutes at most

It needs ``pip install -e '.[gpu]' example-robot-data``; ``--prepare`` counts operations if nvdisasm of the CUDA toolkit
is on the path, and the time of a call needs PyTorch.

Prepared files stand in the folder ``--folder`` and in the cache ``EOMGEN_CACHE``, which both travel to the card's
machine. Times of kernels are the least of several rounds of launches, with outputs on the card. Times of GRiD, MuJoCo
Warp, JAX and of 16 cores in lanes are those of a study on an H100 of 26 November 2026, and are not measured here.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

import eomgen
from benchmarks.measure import figure, machine, table
from benchmarks.robots import ROBOTS, driven, scene
from eomgen.products.ensembles.side_by_side import CommonRunData
from eomgen.products.gpu import driver, nvrtc
from eomgen.products.gpu.arrays import TorchArrays
from eomgen.products.gpu.driver import Device, Function, Memory
from eomgen.products.gpu.ensembles import DeviceSamples, SampleArray, compile_runs
from eomgen.products.gpu.kernels import compile_term

EXAMPLES = Path(__file__).parents[1] / "examples"
STAND_IN = Path(__file__).parents[1] / "tests" / "gpu" / "stand_in.cpp"
SECONDS = 480.0
#: For predictions, an H100 in that study: bytes and operations a second; bytes a second of all first-level caches,
#: 132 of 128 bytes a clock at 1.755 GHz. Bytes of a load by its kind.
MEMORY, ARITHMETIC, CACHE = 2.99e12, 15.8e12, 132 * 128 * 1.755e9
WIDTHS = {"U8": 1, "S8": 1, "U16": 2, "S16": 2, "64": 8, "128": 16}


@dataclass(frozen=True)
class States:
    """A row of a function of states: the robot, the term, whether states are columns or rows, the goal of its time over
    the time of its bytes, and GRiD's ns a state in double with the goal of the ratio."""

    robot: str
    term: str
    goal: float
    columns: bool = True
    grid: float | None = None
    grid_goal: float | None = None

    @property
    def file(self) -> str:
        return f"{self.robot}_{self.term}{'' if self.columns else '_rows'}"


STATES = (
    States("panda", "inverse_dynamics", 1.15, grid=3.91, grid_goal=0.022),
    States("panda", "forward_dynamics", 1.35, grid=9.84, grid_goal=0.011),
    States("panda", "partials", 1.5, grid=13.8, grid_goal=0.05),
    States("panda", "partials", 3.0, columns=False),
    States("panda", "forward_dynamics_derivatives", 2.5, grid=27.7, grid_goal=0.05),
    States("talos", "inverse_dynamics", 1.5),
    States("talos", "forward_dynamics", 4.0),
)


@dataclass(frozen=True)
class Runs:
    """A row of runs: example, method, varied quantities, column, samples and steps of 1 ms; ns a step and sample of
    another program in the study, with its name, and the goal of the ratio."""

    example: str
    method: str
    vary: Mapping[str, str]
    column: str
    samples: int
    steps: int
    other: str
    nanoseconds: float
    goal: float

    def model(self) -> eomgen.Model:
        return eomgen.build(EXAMPLES / self.example / "scene.toml", profile="reproducible", method=self.method)


RUNS = (
    Runs(
        "double_pendulum_on_shaking_base", "rk4", {"m2": "normal(0.6, 5%)"}, "q.elbow", 2**17, 1000,
        "MuJoCo Warp in float", 32.7, 0.0012,
    ),
    Runs(
        "four_bar", "generalized_alpha", {"v.drive": "uniform(0.5, 2)"}, "q.drive", 2**15, 1000,
        "16 cores", 10.2, 0.1,
    ),
    Runs(
        "active_vehicle", "generalized_alpha", {"skyhook": "uniform(800, 1200)"}, "q.heave", 2**15, 1000,
        "16 cores", 13.7, 0.1,
    ),
)  # fmt: skip


def prepare(folder: Path, architecture: str) -> None:
    """Write machine code and sizes of all rows of states, and let the cache have the code of runs."""
    folder.mkdir(parents=True, exist_ok=True)
    for row in STATES:
        began = time.perf_counter()
        robot = scene(ROBOTS[row.robot])
        model = eomgen.build(driven(robot) if "forward" in row.term else robot, [row.term], profile="reproducible")
        code = compile_term(model, row.term, architecture, fused=True)
        function = next(item for item in model.library.layout["functions"] if item["name"] == row.term)
        kernel = f"{model.library.layout['prefix']}_{row.term}{'' if row.columns else '_rows'}_kernel"
        sizes = {
            "kernel": kernel,
            "inputs": dict(zip(function["inputs"], function["input_sizes"], strict=True)),
            "outputs": [int(item["size"]) for item in function["outputs"]],
            "p": [float(value) for value in model.parameters.values()],
        }
        (folder / f"{row.file}.cubin").write_bytes(code.image)
        (folder / f"{row.file}.json").write_text(json.dumps(sizes), encoding="utf-8")
        moved = [*zip(function["inputs"], function["input_sizes"], strict=True), *enumerate(sizes["outputs"])]
        usage, needed = code.usage.get(kernel), 8 * sum(size for name, size in moved if name != "p")
        told = "no report"  # of the stand-in
        if usage is not None:
            told = f"{usage}, {predicted(folder / f'{row.file}.cubin', kernel, needed, row.grid)}"
        print(f"{row.file}: {told}, {time.perf_counter() - began:.0f} s", flush=True)
    for run in RUNS:
        began, model = time.perf_counter(), run.model()
        places = CommonRunData.of(model, model.simulate(0.01, 1e-3, error_estimate=False)).places
        code = compile_runs(model, run.method, model.library, [run.column], places, architecture)
        print(f"{run.example}: {code.usage}, {time.perf_counter() - began:.0f} s", flush=True)


def predicted(file: Path, kernel: str, needed: int, grid: float | None) -> str:
    """Return the operations of a kernel, the bytes of its registers that a thread moves to and from memory of the card
    and of the block, and the time over the time of ``needed`` bytes: least, if spills stay in the first-level cache,
    and most, if all of these go to memory. The longest of memory, arithmetic and cache counts, in full overlap."""
    if shutil.which("nvdisasm") is None:
        return "operations: nvdisasm is not on the path"
    listing = subprocess.run(["nvdisasm", "-c", file], capture_output=True, text=True, check=True).stdout
    (code,) = [part for part in listing.split("\t.section\t")[1:] if re.match(rf'"?\.text\.{kernel}\W', part)]
    moves, operations = {"L": 0, "S": 0}, 0
    for word, kinds in re.findall(r"\*/ +(?:@!?\w+ )?([A-Z]\w*)([.\w]*)", code):
        if word in ("LDL", "STL", "LDS", "STS"):
            moves[word[2]] += next((WIDTHS[kind] for kind in kinds.split(".") if kind in WIDTHS), 4)
        operations += word in ("DFMA", "DADD", "DMUL", "DSETP", "DMNMX")
    floor = needed / MEMORY
    inner = max(operations / ARITHMETIC, (moves["L"] + moves["S"]) / CACHE)
    least, most = (max(bytes_ / MEMORY, inner) for bytes_ in (needed, needed + moves["L"]))
    ratios = f"{figure(least / floor)} to {figure(most / floor)} of the time of bytes"
    over = "" if grid is None else f", {figure(1e9 * least / grid)} to {figure(1e9 * most / grid)} of GRiD"
    return f"{operations} operations, {moves['L']} bytes to memory, {moves['S']} in the block: {ratios}{over}"


def time_states(device: Device, folder: Path, row: States, count: int, bandwidth: float) -> list[str]:
    """Return the cells of a row of states."""
    sizes = json.loads((folder / f"{row.file}.json").read_text(encoding="utf-8"))
    kernel = device.load((folder / f"{row.file}.cubin").read_bytes()).function(sizes["kernel"])
    random, numbers = np.random.default_rng(1), 0
    kept, arguments = list[Memory](), list[Any]()
    for name, size in [*sizes["inputs"].items(), *enumerate(sizes["outputs"])]:
        common = name == "p"
        array = np.array(sizes["p"] or [0.0]) if common else random.uniform(-1.0, 1.0, (int(size), count))
        kept.append(device.upload(array))
        strides = (0, 1) if common else (1, count) if row.columns else (int(size), 1)
        arguments.append(SampleArray(kept[-1].pointer, *strides))
        numbers += 0 if common else int(size)
    arguments.append(ctypes.c_longlong(count))
    seconds = least(device, lambda: kernel.launch(count, arguments))
    each, needed = 1e9 * seconds / count, 8.0 * numbers * count / bandwidth
    name = f"{row.robot} {row.term}, {'columns' if row.columns else 'rows'}"
    grid = ("-", "-") if row.grid is None else (figure(each / row.grid), figure(row.grid_goal))
    return [name, figure(each), figure(seconds / needed), figure(row.goal), *grid, str(kernel.local_bytes)]


def least(device: Device, launch: Any, rounds: int = 7, launches: int = 10) -> float:
    """Return the least time of a launch, s, over rounds of several launches."""
    launch()
    device.wait()
    result = np.inf
    for _ in range(rounds):
        began = time.perf_counter()
        for _ in range(launches):
            launch()
        device.wait()
        result = min(result, (time.perf_counter() - began) / launches)
    return float(result)


def copy_bandwidth(device: Device, size: int) -> float:
    """Return the bytes that a copy on the device reads and writes in a second."""
    source, target = device.allocate(size), device.allocate(size)
    addresses = ctypes.c_uint64(target.pointer), ctypes.c_uint64(source.pointer)
    seconds = least(device, lambda: device.call("cuMemcpyDtoDAsync_v2", *addresses, ctypes.c_size_t(size), None))
    return 2.0 * size / seconds


def time_runs(row: Runs, samples: int, steps: int) -> list[str]:
    """Return the cells of a row of runs: the time of the kernel of runs, and of the whole call."""
    model = row.model()
    options: dict[str, Any] = {"vary": row.vary, "columns": [row.column], "points": 11, "error_estimate": False}
    model.simulate_many(1e-3 * steps, 1e-3, **options, samples=64, device="gpu")
    with kernel_times() as spent:
        began = time.perf_counter()
        model.simulate_many(1e-3 * steps, 1e-3, **options, samples=samples, device="gpu")
        whole = time.perf_counter() - began
    kernel = next(seconds for name, seconds in spent.items() if name.endswith("_runs"))
    each = 1e9 * kernel / samples / steps
    ratio = figure(each / row.nanoseconds)
    return [f"{row.example}, {row.method}", figure(each), f"{whole:.2f} s", row.other, ratio, figure(row.goal)]


@contextmanager
def kernel_times() -> Iterator[dict[str, float]]:
    """Yield the seconds of kernels by name, of all launches within the context."""
    spent: dict[str, float] = {}
    launch = Function.launch

    def timed(self: Function, *arguments: Any, **options: Any) -> None:
        began = time.perf_counter()
        launch(self, *arguments, **options)
        self.device.wait()
        spent[self.name] = spent.get(self.name, 0.0) + time.perf_counter() - began

    Function.launch = timed  # type: ignore[method-assign]
    try:
        yield spent
    finally:
        Function.launch = launch  # type: ignore[method-assign]


def time_ensembles(samples: int, steps: int) -> str:
    """Return a line on one ensemble with statistics, on the processor and on the card."""
    model = RUNS[0].model()
    seconds = []
    options: dict[str, Any] = {"vary": RUNS[0].vary, "columns": ["tip"], "points": 101, "error_estimate": False}
    for where in ("cpu", "gpu"):
        model.simulate_many(1e-3 * steps, 1e-3, **options, samples=64, device=where)
        began = time.perf_counter()
        model.simulate_many(1e-3 * steps, 1e-3, **options, samples=samples, device=where)
        seconds.append(time.perf_counter() - began)
    told = f"{samples} pendulums, {steps} steps, statistics: {seconds[1]:.3f} s, of all cores {seconds[0]:.3f} s"
    return f"{told}; ratio {figure(seconds[1] / seconds[0])}, goal 0.01"


def time_calls(*, dry: bool) -> str:
    """Return a line on the processor's time of a call with tensors of PyTorch, one state, without the kernel's time."""
    try:
        torch = import_module("torch")
    except ImportError:
        return "call with tensors: PyTorch is not installed"
    if dry:
        TorchArrays.kind, TorchArrays.stream = "cpu", lambda self, device: 0  # type: ignore[method-assign]
    model = eomgen.build(EXAMPLES / "robot_arm" / "scene.toml", profile="reproducible")
    functions, options = eomgen.gpu(model), {"dtype": torch.float64, "device": TorchArrays.kind}
    q, v, a = (torch.zeros(1, model.nv, **options) for _ in range(3))
    functions.inverse_dynamics(q, v, a)
    seconds = []
    for _ in range(7):
        began = time.process_time()
        for _ in range(2000):
            functions.inverse_dynamics(q, v, a)
        seconds.append(time.process_time() - began)
        driver.driver().device(0).wait()
    told = f"call with tensors, PyTorch {torch.__version__}: {figure(500 * min(seconds))} us of the processor, goal 8"
    return f"{told}; the stand-in takes the place of the driver" if dry else told


def describe_card() -> str:
    """Return card, driver, and clocks now and at most, by ``nvidia-smi``."""
    query = "name,driver_version,clocks.sm,clocks.mem,clocks.max.sm,clocks.max.mem,power.limit"
    command = ["nvidia-smi", f"--query-gpu={query}", "--format=csv"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError) as error:
        return f"nvidia-smi: {error}"


def stand_in() -> None:
    """Put the stand-in of the tests in place of the driver and of NVRTC."""
    library = Path(tempfile.mkdtemp()) / "stand_in.so"
    subprocess.run(["c++", "-std=c++20", "-O1", "-shared", "-fPIC", STAND_IN, "-o", library, "-ldl"], check=True)
    driver.NAMES = (str(library),)
    nvrtc.candidates = lambda: iter([str(library)])


def _shown(rows: list[list[str]], options: argparse.Namespace) -> list[list[str]]:
    """Return rows of a table; of a dry run the names alone, since times on the processor mean nothing."""
    return [[row[0], *["ran"] * len(row[1:])] for row in rows] if options.dry else rows


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--prepare", action="store_true", help="compile for a card")
    parser.add_argument("--dry", action="store_true", help="all rows on the processor, with few states")
    parser.add_argument("--architecture", default="sm_90", help="of the card (sm_90: H100, H200)")
    parser.add_argument("--folder", type=Path, default=Path("gpu_parts"), help="for prepared files (gpu_parts)")
    options = parser.parse_args()
    if options.dry:
        stand_in()
        options.folder = Path(tempfile.mkdtemp())
    if options.prepare or options.dry:
        prepare(options.folder, options.architecture)
    if options.prepare:
        return 0
    began = time.perf_counter()
    count, samples, steps = (64, 64, 20) if options.dry else (10**6, None, None)
    device = driver.driver().device(0)
    print(f"{device.name}, {device.architecture}, CUDA {device.driver.version}; {machine()}\n{describe_card()}\n")
    bandwidth = 1.0 if options.dry else copy_bandwidth(device, 2**30)
    if options.dry:
        print(f"dry run without times: each row runs with {count} states or samples on the processor\n")
    else:
        print(f"copies of 1 GiB: {1e-12 * bandwidth:.3g} TB/s, read and written\n")
    rows = [time_states(device, options.folder, row, count, bandwidth) for row in STATES]
    of_states = ("states", "ns", "time / bytes", "goal", "/ GRiD (study)", "goal", "stack, bytes")
    print(table(of_states, _shown(rows, options)), "\n", flush=True)
    rows = []
    for row in RUNS:
        if time.perf_counter() - began < 0.7 * SECONDS:
            rows.append(time_runs(row, samples or row.samples, steps or row.steps))
    of_runs = ("runs", "ns a step", "whole call", "other (study)", "ratio", "goal")
    print(table(of_runs, _shown(rows, options)), "\n", flush=True)
    if time.perf_counter() - began < 0.8 * SECONDS:
        told = time_ensembles(samples or 10**5, steps or 1000)
        print(told.partition(":")[0] if options.dry else told)
    print(time_calls(dry=options.dry))
    print(f"{time.perf_counter() - began:.0f} s; chunks of {DeviceSamples.block_size(10**6, 8000, 101)} samples")
    return 0


if __name__ == "__main__":
    sys.exit(main())
