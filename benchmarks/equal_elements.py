"""CPU seconds from an elastic bar of N equal elements to its compiled model and its first steps, for several N.

    python -m benchmarks.equal_elements [--elements 20 2000] [--methods generalized_alpha rosenbrock] [--repeats 3]
    [--json out.json] [--quick]

The bar is that of ``examples/scalar_wave``. Every repeat is a process of its own with an empty cache. Besides seconds:
statements and kB of the C, the largest memory of Python, and the time of a step.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.measure import figure, machine, table

ROOT = Path(__file__).resolve().parent.parent
COLUMNS = ("build", "first steps", "statements", "kB of C", "MB of memory", "us per step")
#: Steps of a run that is timed, and how often it is.
STEPS, TIMES = 100, 7


def cpu_seconds() -> float:
    """Return CPU seconds of this process and of the compilers it waited for, Python's own start included."""
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in usage)


def measured(elements: int, mass: str, method: str) -> dict[str, float]:
    """Build a bar and take ten steps, in this process."""
    sys.path.insert(0, str(ROOT / "examples" / "scalar_wave"))
    from bar import Bar  # type: ignore[import-not-found]  # noqa: PLC0415  # a module of the example

    import eomgen  # noqa: PLC0415  # importing is part of what is measured

    bar = Bar("bar", (0.0,) * elements, mass, free_end=True)
    model = eomgen.build(bar, method=method)
    seconds = {"build": cpu_seconds()}
    run = model.simulate(5.0 / elements, 0.5 / elements, method=method, error_estimate=False)
    seconds["first steps"] = cpu_seconds() - seconds["build"]
    if not run.success:
        raise RuntimeError(run.message)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    with tempfile.TemporaryDirectory() as folder:
        files = [path for path in eomgen.generate(bar, Path(folder) / "c", method=method) if path.suffix == ".c"]
        texts = [path.read_text(encoding="utf-8") for path in files]
    size = {"statements": sum(text.count(";") for text in texts), "kB of C": sum(map(len, texts)) / 1e3}
    return {**seconds, **size, "MB of memory": memory, "us per step": microseconds_of_a_step(model, method, elements)}


def microseconds_of_a_step(model: Any, method: str, elements: int) -> float:
    """Return the processor's time of a step in one call of many, the median of some."""
    from eomgen.integrators.families.register import method_named  # noqa: PLC0415  # with the other imports of eomgen
    from eomgen.simulation.timing import RepeatedRun  # noqa: PLC0415

    step = 0.5 / elements
    solution = model.simulate(STEPS * step, step, method=method, record_every=STEPS, error_estimate=False)
    repeated = RepeatedRun(model, solution, method_named(method))
    return 1e6 * statistics.median(repeated.seconds() for _ in range(TIMES)) / STEPS


def in_process(elements: int, mass: str, method: str) -> dict[str, float]:
    """Return what ``measured`` gives in a process of its own with an empty cache."""
    code = "import json, sys; from benchmarks.equal_elements import measured"
    code += "; print(json.dumps(measured(int(sys.argv[1]), *sys.argv[2:])))"
    with tempfile.TemporaryDirectory() as cache:
        result = subprocess.run(
            [sys.executable, "-c", code, f"{elements}", mass, method],
            capture_output=True,
            text=True,
            check=False,
            cwd=ROOT,
            env={**os.environ, "EOMGEN_CACHE": cache},
        )
    if result.returncode:
        raise RuntimeError(result.stderr)
    return {str(name): float(value) for name, value in json.loads(result.stdout).items()}


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.equal_elements", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--elements", nargs="+", type=int, default=[20, 200, 2000])
    parser.add_argument("--methods", nargs="+", default=["generalized_alpha", "rosenbrock"])
    parser.add_argument("--masses", nargs="+", default=["consistent", "lumped"])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="two bars of few elements, once")
    arguments = parser.parse_args(words)
    if arguments.quick:
        arguments.elements, arguments.methods, arguments.masses, arguments.repeats = (
            [3, 6],
            ["rosenbrock"],
            ["lumped"],
            1,
        )
    print(machine())
    lines, data = [], []
    for mass in arguments.masses:
        for method in arguments.methods:
            first = 0.0
            for elements in arguments.elements:
                runs = [in_process(elements, mass, method) for _ in range(arguments.repeats)]
                middle = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
                first = first or middle["build"]
                data.append({"mass": mass, "method": method, "elements": elements, "runs": runs})
                cells = [figure(middle[key]) if middle[key] < 100 else f"{middle[key]:.0f}" for key in COLUMNS]
                lines.append([mass, method, f"{elements}", *cells, f"{middle['build'] / first:.2f}"])
    print("\nCPU seconds from the start of Python on, compilers included, with an empty cache; medians\n")
    print(table(["mass", "method", "elements", *COLUMNS, "build by the first"], lines))
    if arguments.json:
        arguments.json.write_text(json.dumps({"machine": machine(), "bars": data}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
