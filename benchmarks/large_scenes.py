"""Large scenes of equal parts, from the scene to its first steps: what grows with the number of bodies.

    python -m benchmarks.large_scenes [--scenes net chain] [--bodies 100 1000] [--method generalized_alpha]
    [--json out.json] [--quick]

``net``: a taut cable net ten knots wide in absolute coordinates, written with [repeat]. ``chain``: rods on hinges about
y in joint coordinates; ``joined``: the same in absolute coordinates. Every case is a process of its own with an empty
cache. CPU seconds of Python for scene and C, and of the compilers; statements and kB of the C; the largest memory of
Python; time per step and body.
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
COLUMNS = ("scene", "C", "compilers", "statements", "kB of C", "MB", "us per step and body")
WIDTH, STEP, STEPS, TIMES = 10, 1e-3, 50, 5
#: Files beside those that the equations and the stepper are in.
NOT_OF_SCENE = ("main.c", "interface.c")
SPRING = "stiffness = 1000, damping = 1, length = 0.95"
#: With WIDE for the last knot of a row, ROWS for the last row.
NET = """
format = 1
name = "net"
coordinates = "absolute"
simulation = { step = 0.001, duration = 0.5, rho_inf = 0.8 }

[repeat.knots]
indices = { i = [1, ROWS], j = [1, WIDE] }
bodies."knot_{i}_{j}" = { mass = 0.1, inertia = [1e-5, 1e-5, 1e-5], group = "R3xSO3" }
points."eye_{i}_{j}" = { body = "knot_{i}_{j}" }

[repeat.knots.joints."free_{i}_{j}"]
type = "free"
parent = "base"
child = "knot_{i}_{j}"
initial = { position = ["{i}", "{j}", 0] }

[repeat.along]
indices = { i = [2, ROWS], j = [1, WIDE] }
springs."along_{i}_{j}" = { first = "eye_{i - 1}_{j}", second = "eye_{i}_{j}", SPRING }

[repeat.across]
indices = { i = [1, ROWS], j = [2, WIDE] }
springs."across_{i}_{j}" = { first = "eye_{i}_{j - 1}", second = "eye_{i}_{j}", SPRING }

[repeat.edges]
indices = { i = [1, ROWS], side = 2 }
points."post_{i}_{side}" = { body = "base", position = ["{i}", "{side * (WIDE + 1)}", 0] }
springs."edge_{i}_{side}" = { first = "post_{i}_{side}", second = "eye_{i}_{1 + side * (WIDE - 1)}", SPRING }
"""


def scene_of(kind: str, bodies: int) -> Any:
    """Return a scene of so many bodies; of a net, whole rows."""
    from benchmarks import chains  # noqa: PLC0415  # importing eomgen is part of what is measured
    from eomgen.scene.load import load_toml  # noqa: PLC0415

    if kind != "net":
        return chains.scene("joint" if kind == "chain" else "absolute", "hinge", bodies)
    rows = max(2, bodies // WIDTH)
    return load_toml(NET.replace("ROWS", f"{rows}").replace("WIDE", f"{WIDTH}").replace("SPRING", SPRING))


def cpu_seconds() -> tuple[float, float]:
    """Return CPU seconds of this process, and of the compilers that it waited for."""
    own, others = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime, others.ru_utime + others.ru_stime


def measured(kind: str, bodies: int, method: str) -> dict[str, float]:
    """Write the C of a scene, compile it and take steps, in this process."""
    import eomgen  # noqa: PLC0415
    from eomgen.integrators.families.register import method_named  # noqa: PLC0415
    from eomgen.simulation.timing import RepeatedRun  # noqa: PLC0415

    began, _ = cpu_seconds()
    scene = scene_of(kind, bodies)
    read, before = cpu_seconds()
    model = eomgen.build(scene, method=method)
    built, after = cpu_seconds()
    folder, largest = model.library.folder, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    texts = [path.read_text(encoding="utf-8") for path in folder.glob("*.c") if path.name not in NOT_OF_SCENE]
    run = model.simulate(STEPS * STEP, STEP, method=method, record_every=STEPS, error_estimate=False)
    if not run.success:
        raise RuntimeError(run.message)
    repeated = RepeatedRun(model, run, method_named(method))
    seconds = statistics.median(repeated.seconds() for _ in range(TIMES)) / STEPS
    return {
        "bodies": len(scene.bodies),
        "scene": read - began,
        "C": built - read,
        "compilers": after - before,
        "statements": sum(text.count(";") for text in texts),
        "kB of C": sum(map(len, texts)) / 1e3,
        "MB": largest / 1e3,
        "us per step and body": 1e6 * seconds / len(scene.bodies),
    }


def in_process(kind: str, bodies: int, method: str) -> dict[str, float]:
    """Return what ``measured`` gives in a process of its own with an empty cache."""
    code = "import json, sys; from benchmarks.large_scenes import measured"
    code += "; print(json.dumps(measured(sys.argv[1], int(sys.argv[2]), sys.argv[3])))"
    with tempfile.TemporaryDirectory() as cache:
        result = subprocess.run(
            [sys.executable, "-c", code, kind, f"{bodies}", method],
            capture_output=True,
            text=True,
            check=False,
            cwd=ROOT,
            env={**os.environ, "EOMGEN_CACHE": cache},
        )
    if result.returncode:
        raise RuntimeError(result.stderr)
    return {str(name): float(value) for name, value in json.loads(result.stdout.splitlines()[-1]).items()}


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.large_scenes", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--scenes", nargs="+", choices=("net", "chain", "joined"), default=["net", "chain"])
    parser.add_argument("--bodies", nargs="+", type=int, default=[100, 1000])
    parser.add_argument("--method", default="generalized_alpha")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="one small chain, once")
    arguments = parser.parse_args(words)
    if arguments.quick:
        arguments.scenes, arguments.bodies, arguments.method = ["chain"], [6], "rk4"
    print(machine())
    lines, data = [], []
    for kind in arguments.scenes:
        for bodies in arguments.bodies:
            found = in_process(kind, bodies, arguments.method)
            data.append({"scene of": kind, "method": arguments.method, **found})
            cells = [figure(found[key]) if found[key] < 100 else f"{found[key]:.0f}" for key in COLUMNS]
            lines.append([kind, f"{found['bodies']:.0f}", *cells])
    print("\nCPU seconds of Python for the scene and for its C, and of the compilers\n")
    print(table(["scene", "bodies", *COLUMNS], lines))
    if arguments.json:
        text = json.dumps({"machine": machine(), "scenes": data}, indent=1)
        arguments.json.write_text(text + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
