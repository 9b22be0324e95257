"""Time of equilibria, load paths, linear models and Campbell diagrams of the examples, with models that are built.

    python -m benchmarks.statics [--cases roll_up rotor_blade] [--rounds 5] [--core N] [--json out.json] [--quick]

The processor's time in this process, ms: first call, and median of the next calls; calls of compiled functions in one
call, and the share of the time outside of compiled functions (Python, NumPy and SciPy). Threads of OpenBLAS that wait
for work count as processor time, so OPENBLAS_NUM_THREADS=1 belongs to figures from a machine that does other work, too.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import json
import statistics
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import eomgen
from benchmarks.measure import figure, machine, pin_to_core, table
from eomgen.compiled.functions import Functions
from eomgen.pipeline.model import Model

EXAMPLES = Path(__file__).parents[1] / "examples"
#: Examples whose scene is a function of a script: file, and arguments.
SCRIPTS: dict[str, tuple[str, Sequence[Any]]] = {
    "rotor_blade": ("blade.py", (8,)),
    "roll_up": ("roll_up.py", (8,)),
    "right_angle_cantilever": ("cantilever.py", (10,)),
    "moored_platform": ("demo.py", ()),
    "frame_in_earthquake": ("demo.py", ()),
    "flexible_slider_crank": ("crank.py", (8,)),
    "identified_quarter_car": ("demo.py", ()),
    "quarter_car_on_random_road": ("demo.py", ()),
}
#: Examples from files, further files of an example after a slash.
FILES = (
    "active_quarter_car",
    "active_vehicle",
    "cable_net",
    "elastic_vehicle",
    "elastic_vehicle/full_car",
    "four_bar",
    "half_car_on_measured_road",
    "hanging_chain",
    "heavy_top/se3",
    "pi_servo",
    "quarter_car",
    "robot_arm",
    "sea_arm",
    "shear_frame_with_pendulum",
    "spherical_pendulum",
    "spin_up_beam",
    "spin_up_beam/exact",
    "symmetric_top",
    "unbalanced_shaft",
)
#: Loads of paths with their last values; speeds of Campbell diagrams with their values.
PATHS = {"roll_up": ("turns", 1.0), "quarter_car": ("t", 1.0)}
SPEEDS: dict[str, tuple[str, Sequence[float]]] = {
    "rotor_blade": ("speed", np.linspace(0.0, 1.0, 5).tolist()),
}
Job = Callable[[], object]


class Count:
    """Calls of compiled functions, and the processor's seconds in them."""

    def __init__(self) -> None:
        self.calls, self.seconds = 0, 0.0

    @contextlib.contextmanager
    def on(self) -> Iterator[None]:
        """Count within a context."""
        bare = Functions.__call__

        def counted(functions: Functions, name: str, blocks: Mapping[str, Any]) -> tuple[Any, ...]:
            began = time.process_time()
            result = bare(functions, name, blocks)
            self.seconds += time.process_time() - began
            self.calls += 1
            return result

        Functions.__call__ = counted  # type: ignore[method-assign, assignment]
        try:
            yield
        finally:
            Functions.__call__ = bare  # type: ignore[method-assign]


def model_of(name: str) -> Model:
    """Return the model of an example."""
    if name not in SCRIPTS:
        folder, _, file = name.partition("/")
        return eomgen.build(EXAMPLES / folder / f"{file or 'scene'}.toml", profile="quick")
    file, arguments = SCRIPTS[name]
    spec = importlib.util.spec_from_file_location(f"example_{name}", EXAMPLES / name / file)
    if spec is None or spec.loader is None:
        raise FileNotFoundError(file)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return eomgen.build(module.scene(*arguments), profile="quick")


def jobs_of(name: str, model: Model) -> dict[str, Job]:
    """Return the jobs of an example by their names."""
    jobs: dict[str, Job] = {"equilibrium": model.equilibrium, "linearize": lambda: model.linearize().modes()}
    if name in PATHS:
        load, end = PATHS[name]
        jobs[f"path {load}"] = lambda: model.equilibrium_path(load, end, progress=False)
    if name in SPEEDS:
        speed, values = SPEEDS[name]
        jobs[f"campbell {speed}"] = lambda: model.campbell(speed, values, progress=False)
    return jobs


def measured(job: Job, rounds: int) -> dict[str, Any]:
    """Return the milliseconds of the first call and of the next calls, compiled calls, and the share of Python."""

    def seconds() -> float:
        began = time.process_time()
        job()
        return time.process_time() - began

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            first = seconds()
        except eomgen.EomgenError as error:
            return {"refused": str(error).partition("\n")[0]}
        later = [seconds() for _ in range(rounds)]
        count = Count()
        with count.on():
            whole = seconds()
    return {
        "first, ms": 1e3 * first,
        "ms": 1e3 * statistics.median(later),
        "calls": count.calls,
        "Python, %": 100.0 * (1.0 - count.seconds / max(whole, 1e-9)),
    }


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.statics", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--cases", nargs="+", default=[*SCRIPTS, *FILES], metavar="NAME")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--core", type=int)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="one small example, once")
    arguments = parser.parse_args(words)
    if arguments.quick:
        arguments.cases, arguments.rounds = ["quarter_car"], 1
    pin_to_core(arguments.core)
    print(machine())
    data, lines, refused = [], [], []
    for name in arguments.cases:
        for job, call in jobs_of(name, model_of(name)).items():
            row = measured(call, arguments.rounds)
            data.append({"example": name, "job": job, **row})
            if "refused" in row:
                refused.append(f"{name}, {job}: {row['refused']}")
            else:
                lines.append([name, job, *(figure(number) for number in list(row.values()))])
    header = ["example", "job", "first, ms", "ms", "calls", "Python, %"]
    print("\n" + table(header, lines), *([""] if refused else []), *refused, sep="\n")
    if arguments.json:
        arguments.json.write_text(json.dumps({"machine": machine(), "jobs": data}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
