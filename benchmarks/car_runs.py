"""Step steer of both cars of ``examples/driving_car`` at steps of 1 ms: time by real time, and error.

    python -m benchmarks.car_runs [--cars car full_car] [--rounds 9] [--quick] [--core N]

Errors are those of the yaw rate, relative to its largest value, against a run at steps of 0.1 ms. Newton's method ends
at corrections of 1e-10 of the unknowns by default; at 1e-5 the error is still the one of the steps. Times are the
processor's for whole runs with a row every 10 ms, in turns.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import eomgen
from benchmarks.measure import machine, pin_to_core, table

EXAMPLES = Path(__file__).parents[1] / "examples"
CARS: Mapping[str, tuple[str, ...]] = {
    "car": ("generalized_alpha", "rk4"),
    "full_car": ("generalized_alpha", "generalized_alpha_index3"),
}
TOLERANCES = ("1e-10", "1e-5")
STEP, END, ROWS = 1e-3, 5.0, 10


def options_of(rtol: str) -> dict[str, Any]:
    """Return the options of a run by the tolerance of Newton's method, of which ``rk4`` has none."""
    settings = {} if rtol == TOLERANCES[0] else {"settings": {"rtol": float(rtol)}}
    return {"record_every": ROWS, "error_estimate": False, **settings}


def step_steer(car: str) -> eomgen.Model:
    """Return the model of the manoeuvre with a car."""
    text = (EXAMPLES / "driving_car/system/step_steer.toml").read_text(encoding="utf-8")
    path = (EXAMPLES / f"driving_car/system/{car}.toml").as_posix()
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder, "step_steer.toml")
        scene.write_text(text.replace('"car.toml"', f'"{path}"'), encoding="utf-8")
        return eomgen.build(scene)


def main(argv: Sequence[str]) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cars", nargs="+", choices=tuple(CARS), default=list(CARS))
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--quick", action="store_true", help="one round of a shorter run")
    parser.add_argument("--core", type=int)
    options = parser.parse_args(argv)
    rounds, end = (1, 1.5) if options.quick else (options.rounds, END)
    pin_to_core(options.core)
    print(machine())
    rows = []
    for car in options.cars:
        model = step_steer(car)
        exact = model.simulate(end, STEP / 10, method=CARS[car][0], record_every=10 * ROWS)["yaw_rate"].ravel()
        ways = [(method, rtol) for method in CARS[car] for rtol in TOLERANCES if method != "rk4" or rtol == "1e-10"]
        seconds: dict[tuple[str, str], list[float]] = {way: [] for way in ways}
        for _ in range(rounds):
            for method, rtol in ways:
                begun = time.process_time()
                run = model.simulate(end, STEP, method=method, **options_of(rtol))
                seconds[method, rtol].append(time.process_time() - begun)
        for method, rtol in ways:
            run = model.simulate(end, STEP, method=method, **options_of(rtol))
            error = np.abs(run["yaw_rate"].ravel() - exact).max() / np.abs(exact).max()
            taken = statistics.median(seconds[method, rtol])
            calls = run.stats["evaluations"] / run.stats["steps"]
            faster = f"{end / taken:.0f}"
            rows.append([car, method, rtol, f"{calls:.2f}", f"{1e6 * taken * STEP / end:.2f}", faster, f"{error:.1e}"])
    head = ("car", "method", "Newton to", "evaluations a step", "us a step", "times real time", "error of yaw rate")
    print(table(head, rows))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
