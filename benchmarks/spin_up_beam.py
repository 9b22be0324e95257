"""The spin-up beam: our two steppers, SciPy on the same generated right-hand side at equal error, and EXUDYN's beam
elements.

    python -m benchmarks.spin_up_beam [--repeats 7] [--json out.json] [--quick]

Set A with three bending modes, 20 s. Errors are the largest ones of the tip's deflection at whole tenths of a second:
of ours and SciPy's against DOP853 at 1e-12 on the same equations, of EXUDYN's 16 elements against its own run with a
quarter of the step.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import date
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import eomgen
from benchmarks.measure import figure, machine, pin_to_core, table
from eomgen.pipeline.model import Model
from tests.oracles import exudyn_beams
from tests.oracles.spin_up_beam import SET_A

Array = NDArray[np.float64]
SCENE = Path(__file__).resolve().parent.parent / "examples" / "spin_up_beam" / "scene.toml"
STEP, RISE = 1e-3, 15.0


@dataclass(frozen=True)
class Run:
    """One contestant: steps or evaluations, CPU milliseconds for the whole run, and its error in m."""

    name: str
    calls: int
    milliseconds: float
    spread: float
    error: float


def tip(q: Array) -> Array:
    """Return the deflection of the tip: each coordinate is its part of it."""
    return np.asarray(q.sum(axis=-1))


def timed(call: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Return the median of CPU milliseconds and their relative range."""
    taken = []
    for _ in range(repeats):
        start = time.thread_time()
        call()
        taken.append(1e3 * (time.thread_time() - start))
    middle = statistics.median(taken)
    return middle, (max(taken) - min(taken)) / middle


def scipy_tip(model: Model, end: float, times: Array, method: str, tolerance: float) -> tuple[Array, int]:
    """Return the tip's deflection at times and the evaluations; the solver stops where the base's law has a kink."""
    y, values, calls = np.concatenate([model.initial_q, model.initial_v]), list[Array](), 0
    for start, stop in ((0.0, min(RISE, end)), (RISE, end)):
        if stop <= start:
            continue
        inside = times[(times > start) & (times <= stop)]
        given = {"method": method, "rtol": tolerance, "atol": 1e-3 * tolerance}
        found = solve_ivp(model.rhs, (start, stop), y, t_eval=inside, **given)
        if not found.success:
            raise RuntimeError(f"{method}: {found.message}")
        y, calls = found.y[:, -1], calls + int(found.nfev)
        values.append(tip(found.y[: model.nq, : len(inside)].T))
    return np.concatenate(values), calls


def ours(model: Model, end: float, method: str, reference: Array, repeats: int) -> Run:
    """Measure one of our steppers; the time is that of the compiled loop, the last row recorded only."""
    every = round(0.1 / STEP)
    solution = model.simulate(end, STEP, method=method, record_every=every, error_estimate=False)
    error = float(np.abs(tip(solution.q)[1:] - reference).max())
    timed_run = partial(model.simulate, end, STEP, method=method, record_every=10**9, error_estimate=False)
    middle, spread = timed(timed_run, repeats)
    return Run(f"eomgen, {method}", int(solution.stats["steps"]), middle, spread, error)


def scipy_at(model: Model, end: float, times: Array, method: str, reference: Array, error: float, repeats: int) -> Run:
    """Measure a solver of SciPy at the loosest tolerance, in steps of a half power of ten, that meets an error."""
    for exponent in np.arange(2.0, 13.0, 0.5):
        values, calls = scipy_tip(model, end, times, method, 10.0**-exponent)
        found = float(np.abs(values - reference).max())
        if found <= error:
            # called now
            middle, spread = timed(lambda: scipy_tip(model, end, times, method, 10.0**-exponent), repeats)  # noqa: B023
            return Run(f"SciPy, {method}", calls, middle, spread, found)
    raise RuntimeError(f"{method} does not meet {error:.1e} m")


def exudyn_run(end: float, times: Array, repeats: int) -> Run:
    """Measure EXUDYN's 16 elements at our step."""
    steps = round(end / STEP)
    values = exudyn_beams.spin_up(SET_A, 16, end=end, steps=steps).at(times)[:, 1]
    finer = exudyn_beams.spin_up(SET_A, 16, end=end, steps=4 * steps).at(times)[:, 1]
    middle, spread = timed(lambda: exudyn_beams.spin_up(SET_A, 16, end=end, steps=steps), repeats)
    return Run("EXUDYN, 16 elements", steps, middle, spread, float(np.abs(values - finer).max()))


def measured(end: float, repeats: int) -> list[Run]:
    """Return all runs."""
    model = eomgen.build(SCENE)
    times = np.arange(1, round(10 * end) + 1) / 10
    reference, _ = scipy_tip(model, end, times, "DOP853", 1e-12)
    runs = [ours(model, end, method, reference, repeats) for method in ("generalized_alpha", "rk4")]
    met = runs[0].error
    runs += [scipy_at(model, end, times, method, reference, met, min(repeats, 3)) for method in ("DOP853", "Radau")]
    return [*runs, exudyn_run(end, times, 1)]


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.spin_up_beam", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--core", type=int, help="the core to stay on (the last one by default)")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="half a second, once")
    arguments = parser.parse_args(words)
    eomgen.build(SCENE)  # with both cores, before this process stays on one
    core = None if arguments.quick else pin_to_core(arguments.core)
    runs = measured(0.5 if arguments.quick else 20.0, 1 if arguments.quick else arguments.repeats)
    first = runs[0].milliseconds
    rows = [
        [
            run.name,
            f"{run.calls}",
            f"{figure(run.milliseconds)} ±{50 * run.spread:.0f}%",
            f"{run.milliseconds / first:.3g}",
            f"{run.error:.1e}",
        ]
        for run in runs
    ]
    print(f"{machine()}, core {core}\n")
    print(table(("contestant", "steps or calls", "ms", "in units of the first", "error, m"), rows))
    if arguments.json:
        content = {"date": f"{date.today()}", "machine": machine(), "runs": [asdict(run) for run in runs]}
        arguments.json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
