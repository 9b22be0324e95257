"""The outer solar system: compositions of eomgen beside the Taylor steps of heyoka and the integrators of REBOUND, at
the same error.

    python -m venv .bench/rebound && .bench/rebound/bin/pip install rebound
    python -m benchmarks.solar_system [--quick] [--days D] [--core N] [--rebound PYTHON] [--json out.json]

For each error that is asked for, of the energy and of the places at the end, each side gets the method, the step or the
tolerance with which it gets there first. All then take turns on one core, and medians of processor times of the rounds
are shown. Building and compiling count on no side. Places are held against heyoka in long double at 1e-18. REBOUND has
two sides: its integrators of any bodies, and those of Wisdom and Holman, whose steps hold the motions of Kepler about
the sun exactly.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
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
#: Integrators of REBOUND of any bodies, and of a sun with planets, with their options.
LEAPFROGS = tuple(("leapfrog", {"order": order}) for order in (2, 4, 6, 8))
WISDOM_HOLMAN = (
    ("whfast", {"safe_mode": 0}),
    ("whfast", {"safe_mode": 0, "corrector": 11}),
    ("whfast", {"safe_mode": 0, "corrector": 17, "kernel": "LAZY"}),
    ("saba", {"safe_mode": 0, "type": "4"}),
    ("saba", {"safe_mode": 0, "type": "10_6_4"}),
    ("saba", {"safe_mode": 0, "type": "H_10_6_4"}),
)
#: The Python of an environment that has REBOUND.
REBOUND_PYTHON = ".bench/rebound/bin/python"
#: Largest changes of IAS15's last coefficient that are accepted.
EPSILONS = (1e-1, 1e-3, 1e-5, 1e-7, 1e-9)
#: Errors that are asked for, by what they are of.
KINDS = {"energy": ENERGY_ERRORS, "places, au": PLACE_ERRORS}


@dataclass(frozen=True)
class Contestant:
    """One way to the end: what runs it once, its errors of the energy and of places, and what it is."""

    label: str
    run: Callable[[], float]
    errors: dict[str, float]
    seconds: float


def _timed(run: Callable[[], object]) -> Callable[[], float]:
    """Return what runs something and says the processor time that it took."""

    def seconds() -> float:
        began = time.process_time()
        run()
        return time.process_time() - began

    return seconds


def _contestant(label: str, run: Callable[[], float], errors: dict[str, float]) -> Contestant:
    return Contestant(label, run, errors, min(run() for _ in range(3)))


def _start(model: Any) -> tuple[Array, Array, Array]:
    """Return masses (6,), places and velocities (6, 3)."""
    masses, items = np.array(list(model.parameters.values())[1:]), model.document.coordinates
    places = np.array([item.position for item in items]).reshape(6, 3)
    momenta = np.array([item.momentum_value for item in items]).reshape(6, 3)
    return masses, places, momenta / masses[:, None]


def _errors(model: Any, states: Array, exact: Array) -> dict[str, float]:
    """Return errors of rows of places and velocities of bodies, (rows, 6, 6)."""
    masses = _start(model)[0]
    places = states[:, :, :3].reshape(-1, 18)
    energy = model.energy(places, (states[:, :, 3:] * masses[:, None]).reshape(-1, 18))
    return {
        "energy": float(np.abs(energy / energy[0] - 1).max()),
        "places, au": float(np.abs(places[-1] - exact).max()),
    }


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

            found.append(_contestant(f"{method}, {step:.3g} d", _timed(once), errors))
    return found


def _heyoka(model: Any, kind: str, tolerance: float) -> Any:
    """Return an integrator of the same bodies."""
    import heyoka  # noqa: PLC0415  # the numbers of this side need it

    number = np.longdouble if kind == "long double" else np.float64
    masses, places, speeds = _start(model)
    start = np.hstack([places, speeds]).ravel().astype(number)
    system = heyoka.model.nbody(6, masses=masses.tolist(), Gconst=model.parameters["G"])
    fp_type = np.longdouble if kind == "long double" else float
    return heyoka.taylor_adaptive(system, start, tol=number(tolerance), fp_type=fp_type, compact_mode=False)


def _places(state: Array) -> Array:
    return np.asarray(state, float).reshape(-1, 6, 6)[:, :, :3].reshape(-1, 18)


def theirs(model: Any, exact: Array, days: float) -> list[Contestant]:
    """Return heyoka's runs by all tolerances."""
    found = []
    for tolerance in TOLERANCES:
        integrator = _heyoka(model, "double", tolerance)
        start = integrator.state.copy()
        rows = integrator.propagate_grid(np.linspace(0, days, GRID + 1))[-1]
        errors = _errors(model, np.asarray(rows, float).reshape(-1, 6, 6), exact)

        def once(integrator: Any = integrator, start: Array = start) -> object:
            integrator.time = 0.0
            integrator.state[:] = start
            return integrator.propagate_until(days)

        found.append(_contestant(f"{tolerance:.1e}", _timed(once), errors))
    return found


class Rebound:
    """REBOUND in a process of its own."""

    def __init__(self, python: str, model: Any) -> None:
        self.process = subprocess.Popen(
            [python, str(Path(__file__).with_name("rebound_runs.py"))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": ""},
        )  # fmt: skip
        masses, places, velocities = _start(model)
        state = {"masses": masses.tolist(), "places": places.tolist(), "velocities": velocities.tolist()}
        self.about = self.ask({"G": model.parameters["G"], **state})

    def ask(self, question: dict[str, Any]) -> dict[str, Any]:
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write(json.dumps(question) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit("REBOUND ended without an answer; see above, and the head of this file")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def contestants(self, model: Any, exact: Array, days: float, *, planets: bool) -> list[Contestant]:
        """Return runs of the integrators of any bodies, or of those of planets about a sun, by all steps."""
        asked: list[tuple[str, dict[str, Any]]] = []
        for integrator, options in WISDOM_HOLMAN if planets else LEAPFROGS:
            for steps in (round(days / step) for step in STEPS):
                given = {"integrator": integrator, "options": options, "step": days / steps, "fixed": True}
                told = ", ".join(f"{value}" for name, value in options.items() if name != "safe_mode")
                asked.append((f"{integrator}{f' {told}' if told else ''}, {days / steps:.3g} d", given))
        for epsilon in () if planets else EPSILONS:
            given = {"integrator": "ias15", "options": {"epsilon": epsilon}, "step": 10.0, "fixed": False}
            asked.append((f"ias15 {epsilon:.0e}", given))
        found = []
        for label, given in asked:
            states = np.array(self.ask({**given, "days": days, "rows": GRID})["states"])
            if np.isfinite(states).all():

                def once(given: dict[str, Any] = given) -> float:
                    return float(self.ask({**given, "days": days, "rows": 0})["seconds"])

                found.append(_contestant(label, once, _errors(model, states, exact)))
        return found


def first(contestants: Sequence[Contestant], kind: str, error: float) -> Contestant | None:
    """Return the fastest that meets an error."""
    return min(
        (item for item in contestants if item.errors[kind] <= error), key=lambda item: item.seconds, default=None
    )


def measured(days: float, rounds: int, python: str = REBOUND_PYTHON) -> list[dict[str, Any]]:
    """Return a row for each error that is asked for; REBOUND's sides where an environment has it."""
    model: Any = eomgen.build(SYSTEM)
    reference = _heyoka(model, "long double", 1e-18)
    reference.propagate_until(np.longdouble(days))
    exact = _places(reference.state)[0]
    sides = {"eomgen": ours(model, exact, days), "heyoka": theirs(model, exact, days)}
    if Path(python).exists():
        rebound = Rebound(python, model)
        print(f"REBOUND {rebound.about['rebound']}")
        sides["REBOUND"] = rebound.contestants(model, exact, days, planets=False)
        sides["Wisdom-Holman"] = rebound.contestants(model, exact, days, planets=True)
    rows = []
    for kind, errors in KINDS.items():
        for error in errors:
            best = {side: first(contestants, kind, error) for side, contestants in sides.items()}
            times: dict[str, list[float]] = {side: [] for side in sides}
            for _ in range(rounds):
                for side, item in best.items():
                    if item is not None:
                        times[side].append(item.run())
            medians = {side: statistics.median(taken) if taken else None for side, taken in times.items()}
            row: dict[str, Any] = {"error of": kind, "asked": error}
            for side, item in best.items():
                row |= {f"{side} run": item.label if item else "none", f"{side} s": medians[side]}
                row[f"{side} error"] = item.errors[kind] if item else None
            own = medians["eomgen"]
            row |= {
                f"{side} / eomgen": seconds / own if own and seconds else None
                for side, seconds in medians.items()
                if side != "eomgen"
            }
            rows.append(row)
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of the days, one round")
    parser.add_argument("--days", type=float, default=DAYS)
    parser.add_argument("--core", type=int, default=None)
    parser.add_argument("--rebound", default=REBOUND_PYTHON, help="of an environment that has it")
    parser.add_argument("--json", type=Path, default=None)
    given = parser.parse_args(arguments)
    pin_to_core(given.core)
    rows = measured(given.days / 10 if given.quick else given.days, 1 if given.quick else ROUNDS, given.rebound)
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
