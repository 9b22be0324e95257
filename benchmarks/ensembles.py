"""What an ensemble costs: on threads of this process and on processes of a Dask cluster, to reduce, and in memory.

    python -m benchmarks.ensembles [--samples 4000] [--processes 4] [--threads 2] [--rounds 3] [--memory 1000 10000]
        [--json out.json] [--quick]

The double pendulum on a shaking base, 5000 steps a sample. Local threads and Dask's processes take turns; the processes
are there before the clock runs, and have made their model. The first check is that all give the same bits. Wall time
holds where nothing else runs; processor time per sample, of all processes together, holds under load too, and is what
the throughput of full processors follows from. Memory is the largest resident size of a process of its own that runs so
many samples with a folder.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import eomgen
from benchmarks.measure import machine
from eomgen.pipeline.model import Model
from eomgen.products.ensembles import Ensemble
from eomgen.products.ensembles.cluster import processes as local_cluster
from eomgen.products.ensembles.statistics import Reduction

SCENE = Path(__file__).parents[1] / "examples" / "double_pendulum_on_shaking_base" / "scene.toml"
VARY = {"m2": "uniform(0.4, 0.8)", "q.shoulder": "normal(0.8, 0.1)", "q.elbow": "normal(-0.3, 0.1)"}
#: Samples of a block that is reduced.
BLOCK = 256


def bits(found: Ensemble) -> bytes:
    """Return all statistics and results of an ensemble."""
    arrays = (*found.reduction.arrays().values(), *found.values.values(), *found.results.values())
    return b"".join(array.tobytes() for array in arrays)


def on_dask(model: Model, processes: int, threads: int, rounds: int, options: dict[str, Any]) -> dict[str, float]:
    """Return seconds of the clock, and of processors per sample, of threads and of a cluster's processes."""
    distributed = importlib.import_module("distributed")
    taken: dict[str, list[float]] = {name: [] for name in ("wall local", "wall dask", "cpu local", "cpu dask")}
    with (
        local_cluster(processes) as cluster,
        distributed.Client(cluster) as client,
    ):
        few = {**options, "samples": 16 * processes}
        model.simulate_many(**few, cluster=client)
        runs: dict[str, Callable[[], Ensemble]] = {
            "local": lambda: model.simulate_many(**options, workers=threads),
            "dask": lambda: model.simulate_many(**options, cluster=client),
        }
        seen: set[bytes] = set()
        for _ in range(rounds):
            for name, run in runs.items():
                wall, here = time.perf_counter(), time.process_time()
                there = sum(client.run(time.process_time).values())
                found = run()
                there = sum(client.run(time.process_time).values()) - there
                taken[f"wall {name}"].append(time.perf_counter() - wall)
                taken[f"cpu {name}"].append((time.process_time() - here + there) / found.done)
                seen.add(bits(found))
    if len(seen) != 1:
        raise SystemExit("the bits of local and distributed runs differ")
    return {name: statistics.median(values) for name, values in taken.items()}


def reduction(columns: int, times: int, blocks: int) -> float:
    """Return the processor's time to reduce a sample, s: of blocks behind as many that are kept as they are."""
    generator = np.random.default_rng(0)
    reduced = Reduction(columns, times, BLOCK)
    taken = 0.0
    for number in range(2 * blocks):
        block = generator.normal(size=(BLOCK, columns, times))
        began = time.process_time()
        reduced.add(block)
        taken += (time.process_time() - began) * (number >= blocks)
    return taken / (blocks * BLOCK)


def resident() -> float:
    """Return the largest resident size of this process so far, MB; ``getrusage`` would count that of its parent too."""
    text = Path("/proc/self/status").read_text(encoding="ascii")
    return int(next(line for line in text.splitlines() if line.startswith("VmHWM")).split()[1]) / 1024


def memory(samples: int, t_end: float) -> dict[str, float]:
    """Run samples with a folder, and return the largest resident size and what is on the disk, MB."""
    model = eomgen.build(SCENE)
    with tempfile.TemporaryDirectory() as folder:
        found = model.simulate_many(t_end, vary=VARY, samples=samples, folder=folder)
        largest = resident()
        found.save(Path(folder) / "tables")
        read = resident()
        disk = sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file()) / 1e6
    return {"samples": samples, "run": largest, "with tables": read, "disk": disk}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=4000)
    parser.add_argument("--processes", type=int, default=4)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--memory", type=int, nargs="*", default=[1000, 10_000])
    parser.add_argument("--t-end", type=float, default=5.0, help="of samples whose memory is measured")
    parser.add_argument("--quick", action="store_true", help="few short samples: a check, and no measurement")
    parser.add_argument("--one", type=int, default=None, help=argparse.SUPPRESS)
    parser.add_argument("--json", type=Path, default=None)
    chosen = parser.parse_args(arguments)
    if chosen.one is not None:
        print(json.dumps(memory(chosen.one, chosen.t_end)))
        return 0
    if chosen.quick:
        chosen.samples, chosen.processes, chosen.rounds, chosen.memory, chosen.t_end = 40, 2, 1, [], 0.1
    print(machine())
    model = eomgen.build(SCENE)
    options: dict[str, Any] = {"vary": VARY, "samples": chosen.samples, "t_end": 0.1 if chosen.quick else 5.0}
    rows: dict[str, Any] = {"samples": chosen.samples, "processes": chosen.processes, "threads": chosen.threads}
    rows |= on_dask(model, chosen.processes, chosen.threads, chosen.rounds, options)
    rows["local / dask"] = rows["wall local"] / rows["wall dask"]
    print(f"{chosen.samples} samples, the same bits; medians of {chosen.rounds} rounds")
    for name, label in (("local", f"{chosen.threads} threads"), ("dask", f"{chosen.processes} processes of Dask")):
        own = 1e3 * rows[f"cpu {name}"]
        print(f"  {label:24} {rows[f'wall {name}']:8.2f} s of the clock  {own:7.3f} ms of processors per sample")
    print(f"  throughput of Dask / of threads {rows['local / dask']:.2f}")
    rows["reduction"] = reduction(6, 301, 1 if chosen.quick else 16)
    print(f"reduction of 6 columns at 301 times: {1e3 * rows['reduction']:.3f} ms of the caller per sample")
    rows["memory"] = []
    for samples in chosen.memory:
        command = [sys.executable, "-m", "benchmarks.ensembles", "--one", str(samples), "--t-end", str(chosen.t_end)]
        text = subprocess.run(command, capture_output=True, text=True, check=True, env=os.environ).stdout
        rows["memory"].append(row := json.loads(text))
        print(
            f"memory of {samples:8d} samples: {row['run']:7.1f} MB while they run, {row['with tables']:7.1f} MB with"
            f" the tables that are written then, {row['disk']:7.1f} MB on the disk"
        )
    if chosen.json:
        chosen.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
