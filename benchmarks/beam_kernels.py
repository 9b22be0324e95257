"""What a geometrically exact beam of n equal elements costs: Python, the C and its compiler, memory, and a step.

    python -m benchmarks.beam_kernels [--elements 8 16 64 256 1024 4096] [--model kirchhoff] [--method rattlie]
        [--repeats 3] [--json out.json] [--quick]

The flying spaghetti of ``examples``, by generalized-alpha if not said otherwise, with the functions that its runs
call. Every repeat is a process of its own with an empty cache. Last come the exponents of n in the time of a step and
in Python's, from 64 elements on.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import runpy
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.measure import figure, machine, table

ROOT = Path(__file__).resolve().parent.parent
COLUMNS = ("Python", "compiler", "statements", "kB of C", "MB of memory", "us per step", "ns per step and element")
#: Steps of a run that is timed, and how often it is.
STEPS, TIMES = 40, 7
STEP = 5e-3
#: Exponents are those from so many elements on.
LONG = 64


def seconds(who: int) -> float:
    """Return CPU seconds of this process, or of the compilers it waited for."""
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def measured(elements: int, kind: str, method: str) -> dict[str, float]:
    """Build a beam for runs and take steps, in this process."""
    import eomgen  # noqa: PLC0415  # importing is part of what is measured
    from eomgen.integrators.families.register import method_named  # noqa: PLC0415
    from eomgen.pipeline.pipeline import build_for_run  # noqa: PLC0415
    from eomgen.simulation.timing import RepeatedRun  # noqa: PLC0415

    example = runpy.run_path(str(ROOT / "examples" / "flying_spaghetti" / "spaghetti.py"))
    scene = example["scene"](elements, model=kind)
    model = build_for_run(eomgen.load(scene), method)
    found = {"Python": seconds(resource.RUSAGE_SELF), "compiler": seconds(resource.RUSAGE_CHILDREN)}
    texts = [path.read_text(encoding="utf-8") for path in Path(model.library.folder).glob("*.c")]
    found |= {"statements": float(sum(text.count(";") for text in texts)), "kB of C": sum(map(len, texts)) / 1e3}
    options = {"record_every": STEPS, "error_estimate": False}
    solution = model.simulate(STEPS * STEP, STEP, method=method, **options)
    if not solution.success:
        raise RuntimeError(solution.message)
    found["MB of memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    repeated = RepeatedRun(model, solution, method_named(method))
    found["us per step"] = 1e6 * statistics.median(repeated.seconds() for _ in range(TIMES)) / STEPS
    return found | {"ns per step and element": 1e3 * found["us per step"] / elements}


def in_process(elements: int, kind: str, method: str) -> dict[str, float]:
    """Return what ``measured`` gives in a process of its own with an empty cache."""
    code = "import json, sys; from benchmarks.beam_kernels import measured; _, elements, *how = sys.argv;"
    code += " print(json.dumps(measured(int(elements), *how)))"
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "EOMGEN_CACHE": cache}
        command = [sys.executable, "-c", code, f"{elements}", kind, method]
        result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT, env=environment)
    if result.returncode:
        raise RuntimeError(result.stderr)
    return {str(name): float(value) for name, value in json.loads(result.stdout).items()}


def exponent(elements: Sequence[int], values: Sequence[float]) -> float:
    """Return the slope of a straight line through the logarithms."""
    return statistics.linear_regression([math.log(n) for n in elements], [math.log(value) for value in values]).slope


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.beam_kernels", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--elements", nargs="+", type=int, default=[8, 16, 64, 256, 1024, 4096])
    parser.add_argument("--model", choices=("cosserat", "kirchhoff", "inextensible"), default="cosserat")
    parser.add_argument("--method", default="generalized_alpha")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="two beams of few elements, once")
    arguments = parser.parse_args(words)
    if arguments.quick:
        arguments.elements, arguments.repeats = [3, 6], 1
    print(machine())
    lines, data, medians = [], [], []
    for elements in arguments.elements:
        runs = [in_process(elements, arguments.model, arguments.method) for _ in range(arguments.repeats)]
        medians.append({key: statistics.median(run[key] for run in runs) for key in runs[0]})
        data.append({"elements": elements, "runs": runs})
        cells = [figure(medians[-1][key]) if medians[-1][key] < 100 else f"{medians[-1][key]:.0f}" for key in COLUMNS]
        lines.append([f"{elements}", *cells])
    print("\nCPU seconds from the start of Python on, of Python and of compilers, with an empty cache; medians\n")
    print(table(["elements", *COLUMNS], lines))
    long = [k for k, elements in enumerate(arguments.elements) if elements >= LONG]
    for key in ("us per step", "Python") if len(long) > 1 else ():
        found = exponent([arguments.elements[k] for k in long], [medians[k][key] for k in long])
        print(f"{key}: n to the power of {found:.3f} from {arguments.elements[long[0]]} elements on")
    if arguments.json:
        how = {"model": arguments.model, "method": arguments.method}
        text = json.dumps({"machine": machine(), **how, "beams": data}, indent=1)
        arguments.json.write_text(text + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
