"""Time to a given error of steps in passes, explicit steps and series, on a shear frame with a pendulum.

    python -m benchmarks.steps_in_passes [--rounds 21] [--quick] [--core N] [--json out.json]

Errors are those at 10 s, relative to the largest magnitude of each coordinate and velocity: against digits by DOP853,
and where the first storey is a million times as stiff, against tdg3 in steps of 0.5 ms, without the stiff coordinate.
Each method has the largest step, or tolerance, of a ladder of 16 to the factor of ten that meets the error. Times are
the processor's for whole runs in one call, methods in turns.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import eomgen
from benchmarks.measure import machine, pin_to_core, table
from eomgen.integrators.methods import canonical_name, method_named
from eomgen.simulation.timing import Repeated
from tests.models.shear_frame import RESPONSE, SCALE, shear_frame

Array = NDArray[np.float64]
END, ERRORS = 10.0, (1e-5, 1e-8)
FIXED, BY_TOLERANCE = ("tdg1", "tdg2", "tdg3", "rk4"), ("tdg3", "rk45", "taylor")
#: Largest steps, s, and tolerances of the ladder.
LONGEST, COARSEST, RUNGS = 0.06, 1e-2, 16
#: Spacing of states of methods that choose their steps, s.
SPACING = 0.05
SLOW = [1, 2, 3, 5, 6, 7]


def end_of(model: eomgen.Model, **options: Any) -> Array | None:
    """Return q and v at the end, or None where the run failed."""
    end = model.simulate(END, record_every=1_000_000, error_estimate=False, **options)
    return np.concatenate([end.q[-1], end.v[-1]]) if end.success else None


def contestants(quick: bool) -> list[tuple[str, bool]]:
    """Return methods, and whether they choose their steps."""
    found = [(method, False) for method in FIXED] + [(method, True) for method in BY_TOLERANCE]
    return [item for item in found if item[0] in ("tdg3", "rk4")] if quick else found


def cheapest(model: eomgen.Model, method: str, chooses: bool, exact: Array, kept: list[int], error: float) -> Any:
    """Return the options of the first rung that meets an error, and its error; None where there is none."""
    for rung in range(6 * RUNGS):
        part = 10.0 ** (-rung / RUNGS)
        options: dict[str, Any] = {"method": method}
        if chooses:
            options |= {"step": SPACING, "tolerance": max(COARSEST * part * part, 1e-14)}
        else:
            options["step"] = END / round(END / (LONGEST * part))
        found = end_of(model, **options)
        missed = np.inf if found is None else float(np.abs((found - exact) / SCALE)[kept].max())
        if missed <= error:
            return options, missed
    return None


def times(model: eomgen.Model, runs: Mapping[str, Mapping[str, Any]], rounds: int) -> dict[str, float]:
    """Return ms of each run, medians over rounds in turns."""
    repeated = {}
    for name, options in runs.items():
        solution = model.simulate(END, record_every=1_000_000, error_estimate=False, **options)
        chosen = canonical_name(options["method"], options.get("tolerance"))
        repeated[name] = Repeated(model, solution, method_named(chosen, tolerance=options.get("tolerance")))
    taken: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in repeated.items():
            taken[name].append(1e3 * run.seconds())
    return {name: statistics.median(ms) for name, ms in taken.items()}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--rounds", type=int, default=21)
    parser.add_argument("--quick", action="store_true", help="tdg3 and rk4 in fixed steps to 1e-5, no times")
    parser.add_argument("--core", type=int)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    pin_to_core(options.core)
    print(machine())
    soft, stiff = eomgen.build(shear_frame()), eomgen.build(shear_frame(ground_stiffness=2e11))
    fine = end_of(stiff, method="tdg3", step=5e-4)
    found: dict[str, Any] = {}
    rows = []
    for scene, model, exact, kept in (("soft", soft, RESPONSE, list(range(8))), ("stiff", stiff, fine, SLOW)):
        for error in ERRORS[:1] if options.quick else ERRORS:
            assert exact is not None
            met = {}
            for method, chooses in contestants(options.quick):
                best = cheapest(model, method, chooses, exact, kept, error) if not (options.quick and chooses) else None
                if best is not None:
                    met[f"{method}{', tolerance' if chooses else ''}"] = best
            ms = {} if options.quick else times(model, {name: item[0] for name, item in met.items()}, options.rounds)
            for name, (given, missed) in met.items():
                size = given.get("tolerance", given["step"])
                entry = {
                    "size": size,
                    "error": missed,
                    "ms": ms.get(name),
                    "of_rk4": ms[name] / ms["rk4"] if ms else None,
                }
                found[f"{scene}, {error:g}, {name}"] = entry
                timed = [f"{ms[name]:.3f}", f"{ms[name] / ms['rk4']:.2f}"] if ms else ["", ""]
                rows.append([scene, f"{error:g}", name, f"{size:.2g}", f"{missed:.1e}", *timed])
    print(table(["frame", "error", "method", "step or tolerance", "missed", "ms", "of rk4"], rows))
    if options.json:
        options.json.write_text(json.dumps(found, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
