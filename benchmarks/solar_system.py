"""The outer solar system: compositions of eomgen beside the Taylor steps of heyoka, at the same error.

    python -m benchmarks.solar_system [--quick] [--days D] [--core N] [--json out.json]

For each error that is asked for, of the energy and of the places at the end, each side gets the method, the step or the
tolerance with which it gets there first. Both then take turns on one core, and medians of processor times of the rounds
are shown. Building and compiling count on neither side. Places are held against heyoka in long double at 1e-18.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import eomgen
from benchmarks.measure import figure, machine, pin_to_core, table

Array = NDArray[np.float64]
SYSTEM = Path(__file__).parents[1] / "examples" / "outer_solar_system" / "system" / "outer_solar_system.toml"
ENERGY_ERRORS = (1e-5, 1e-7, 1e-9, 1e-11)
PLACE_ERRORS = (1e-1, 1e-3, 1e-5)  # au
METHODS = ("leapfrog", "minimum_norm2", "omf4", "blanes_moan4", "suzuki6", "blanes_moan6", "kahan_li8")
STEPS = tuple(400.0 / 2 ** (k / 2) for k in range(11))  # days, about
#: With larger ones bodies are thrown out by encounters that there are not.
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(8, 31))
DAYS, ROUNDS, GRID = 1_000_000.0, 7, 1000
#: Errors that are asked for, by what they are of.
KINDS = {"energy": ENERGY_ERRORS, "places, au": PLACE_ERRORS}


@dataclass(frozen=True)
class Contestant:
    """One way to the end: what runs it once, its errors of the energy and of places, and what it is."""

    label: str
    run: Callable[[], object]
    errors: dict[str, float]
    seconds: float


def _timed(run: Callable[[], object]) -> float:
    began = time.process_time()
    run()
    return time.process_time() - began


def ours(model: Any, exact: Array, days: float) -> list[Contestant]:
    """Return runs by all compositions and steps."""
    found = []
    for method in METHODS:
        for steps in (round(days / step) for step in STEPS):
            step, every = days / steps, max(1, steps // GRID)
            run = model.simulate(days, step, method=method, record_every=every, error_estimate=False)
            if not run.success:
                continue
            errors = {"energy": run.energy_error, "places, au": float(np.abs(run.q[-1] - exact).max())}

            def once(method: str = method, step: float = step, steps: int = steps) -> object:
                return model.simulate(days, step, method=method, record_every=steps, error_estimate=False)

            found.append(Contestant(f"{method}, {step:.3g} d", once, errors, min(_timed(once) for _ in range(3))))
    return found


def _heyoka(model: Any, kind: str, tolerance: float) -> Any:
    """Return an integrator of the same bodies."""
    import heyoka  # noqa: PLC0415  # the numbers of this side need it

    number = np.longdouble if kind == "long double" else np.float64
    parameters = list(model.parameters.values())
    masses = parameters[1:]
    items = model.document.coordinates
    places = np.array([item.position for item in items]).reshape(6, 3)
    speeds = np.array([item.momentum_value for item in items]).reshape(6, 3) / np.array(masses)[:, None]
    start = np.hstack([places, speeds]).ravel().astype(number)
    system = heyoka.model.nbody(6, masses=masses, Gconst=parameters[0])
    fp_type = np.longdouble if kind == "long double" else float
    return heyoka.taylor_adaptive(system, start, tol=number(tolerance), fp_type=fp_type, compact_mode=False)


def _places(state: Array) -> Array:
    return np.asarray(state, float).reshape(-1, 6, 6)[:, :, :3].reshape(-1, 18)


def theirs(model: Any, exact: Array, days: float) -> list[Contestant]:
    """Return heyoka's runs by all tolerances."""
    masses = np.array(list(model.parameters.values())[1:])
    found = []
    for tolerance in TOLERANCES:
        integrator = _heyoka(model, "double", tolerance)
        start = integrator.state.copy()
        rows = integrator.propagate_grid(np.linspace(0, days, GRID + 1))[-1]
        states = np.asarray(rows, float).reshape(-1, 6, 6)
        momenta = (states[:, :, 3:] * masses[:, None]).reshape(-1, 18)
        energy = model.energy(states[:, :, :3].reshape(-1, 18), momenta)
        errors = {
            "energy": float(np.abs(energy / energy[0] - 1).max()),
            "places, au": float(np.abs(_places(rows)[-1] - exact).max()),
        }

        def once(integrator: Any = integrator, start: Array = start) -> object:
            integrator.time = 0.0
            integrator.state[:] = start
            return integrator.propagate_until(days)

        found.append(Contestant(f"{tolerance:.1e}", once, errors, min(_timed(once) for _ in range(3))))
    return found


def first(contestants: Sequence[Contestant], kind: str, error: float) -> Contestant | None:
    """Return the fastest that meets an error."""
    return min(
        (item for item in contestants if item.errors[kind] <= error), key=lambda item: item.seconds, default=None
    )


def measured(days: float, rounds: int) -> list[dict[str, Any]]:
    """Return a row for each error that is asked for."""
    model: Any = eomgen.build(SYSTEM)
    reference = _heyoka(model, "long double", 1e-18)
    reference.propagate_until(np.longdouble(days))
    exact = _places(reference.state)[0]
    sides = (ours(model, exact, days), theirs(model, exact, days))
    rows = []
    for kind, errors in KINDS.items():
        for error in errors:
            pair = [first(side, kind, error) for side in sides]
            times: list[list[float]] = [[], []]
            for _ in range(rounds):
                for taken, item in zip(times, pair, strict=True):
                    if item is not None:
                        taken.append(_timed(item.run))
            medians = [statistics.median(taken) if taken else None for taken in times]
            rows.append(
                {
                    "error of": kind,
                    "asked": error,
                    **{
                        f"{side} {what}": value
                        for side, item, median in zip(("eomgen", "heyoka"), pair, medians, strict=True)
                        for what, value in (
                            ("run", item.label if item else "none"),
                            ("error", item.errors[kind] if item else None),
                            ("s", median),
                        )
                    },
                    "heyoka / eomgen": medians[1] / medians[0] if medians[0] and medians[1] else None,
                }
            )
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of the days, one round")
    parser.add_argument("--days", type=float, default=DAYS)
    parser.add_argument("--core", type=int, default=None)
    parser.add_argument("--json", type=Path, default=None)
    given = parser.parse_args(arguments)
    pin_to_core(given.core)
    rows = measured(given.days / 10 if given.quick else given.days, 1 if given.quick else ROUNDS)
    header = list(rows[0])
    print(machine())
    print(table(header, [[_shown(row[name]) for name in header] for row in rows]))
    if given.json is not None:
        given.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


def _shown(value: Any) -> str:
    return "-" if value is None else figure(value) if isinstance(value, float) else str(value)


if __name__ == "__main__":
    sys.exit(main())
