"""Time to a given error of steps in passes, explicit steps, series, and peers: a shear frame with a pendulum, fast top.

    python -m benchmarks.steps_in_passes [--rounds 21] [--problems ...] [--quick] [--core N] [--json out.json]

Errors of the frame are those at 10 s, relative to the largest magnitude of each coordinate and velocity: against digits
by DOP853, and where the first storey is a million times as stiff, against tdg3 in steps of 0.5 ms with which rk4
agrees, without the stiff coordinate. Those of the top are at 1 s. Each method has the largest step, or tolerance, of a
ladder of 16 to the factor of ten that meets the error; peers by ``frame_peers``. Times are the processor's for whole
runs in one call, contestants in turns; those that take more than 0.2 s sit out most turns.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import eomgen
from benchmarks import frame_peers, tops
from benchmarks.frame_peers import Run
from benchmarks.measure import machine, pin_to_core, table
from eomgen.integrators.families.register import canonical_name, method_named
from eomgen.simulation.timing import RepeatedRun
from tests.models.shear_frame import RESPONSE, SCALE, shear_frame

Array = NDArray[np.float64]
FIXED, BY_TOLERANCE = ("tdg1", "tdg2", "tdg3", "lsrt2", "rk4"), ("rk45", "taylor")
#: Rungs of the ladders to the factor of ten, tolerance from which they start, and most steps.
RUNGS, COARSEST, MOST_STEPS = 16, 1e-2, 500_000
SLOW = [1, 2, 3, 5, 6, 7]
#: Contestants that take longer, s, take part in so many turns; a turn is repeated runs of so many s at least.
LONG, TURNS_OF_LONG, TURN = 0.2, 3, 5e-3


class Problem(ABC):
    """A motion, and what of its end is looked at.

    Attributes
    ----------
    end, spacing : s; of states of methods that choose their steps
    longest : largest step of the ladder, s
    errors : that are asked for, largest first
    """

    name: str
    end: float
    spacing: float
    longest: float
    errors: tuple[float, ...]
    model: eomgen.Model

    @abstractmethod
    def missed(self, end: Array) -> float:
        """Return the error of q and v at the end."""

    @abstractmethod
    def peers(self) -> dict[str, tuple[str, Callable[[], frame_peers.Ways]]]:
        """Return each peer's package and ways."""

    @property
    def start(self) -> Array:
        return np.concatenate([self.model.initial_q, self.model.initial_v])

    def run(self, **options: Any) -> eomgen.Solution:
        return self.model.simulate(self.end, record_every=1_000_000, error_estimate=False, **options)


class Frame(Problem):
    """A shear frame by its first storey, N/m, and the coordinates and velocities that are looked at."""

    end, spacing, longest, errors = 10.0, 0.05, 0.06, (1e-5, 1e-8)

    def __init__(self, name: str, ground_stiffness: float, kept: Sequence[int]) -> None:
        self.name, self.ground_stiffness, self.kept = name, ground_stiffness, list(kept)

    @cached_property
    def model(self) -> eomgen.Model:  # type: ignore[override]
        return eomgen.build(shear_frame(ground_stiffness=self.ground_stiffness))

    @cached_property
    def exact(self) -> Array:
        """q and v at the end. Raises SystemExit where two methods differ."""
        if self.name == "soft frame":
            return RESPONSE
        fine, explicit = (
            end_of(self.run(method=method, step=step)) for method, step in (("tdg3", 5e-4), ("rk4", 5e-5))
        )
        if fine is None or explicit is None or np.abs((fine - explicit) / SCALE).max() > 1e-11:
            raise SystemExit("the references disagree")
        return fine

    def missed(self, end: Array) -> float:
        error = float(np.abs((end - self.exact) / SCALE)[self.kept].max())
        return error if np.isfinite(error) else np.inf

    def peers(self) -> dict[str, tuple[str, Callable[[], frame_peers.Ways]]]:
        stiffness, start, end = self.ground_stiffness, self.start, self.end
        found: dict[str, tuple[str, Callable[[], frame_peers.Ways]]] = {
            "heyoka": (
                "heyoka",
                lambda: frame_peers.heyoka_ways(frame_peers.frame_in_heyoka(stiffness), start, end),
            )
        }
        if self.name == "stiff frame":
            found |= {
                "SciPy Radau": ("scipy", lambda: frame_peers.scipy_ways(stiffness, start, end, "Radau")),
                "SciPy BDF": ("scipy", lambda: frame_peers.scipy_ways(stiffness, start, end, "BDF")),
                "CVODE, BDF": ("scikit-sundae", lambda: frame_peers.cvode_ways(stiffness, end)),
            }
        return found


class Top(Problem):
    """The fast heavy top on its ball joint; the larger error of its centre of mass, m, and of its rotation, rad."""

    name, end, spacing, longest, errors = "fast top", 1.0, 0.05, 0.03, (1e-5, 1e-9)

    @cached_property
    def model(self) -> eomgen.Model:  # type: ignore[override]
        return eomgen.build(tops.scene())

    def missed(self, end: Array) -> float:
        if not np.isfinite(end).all():
            return np.inf
        found = tops.motion(self.model, end[:4] / np.linalg.norm(end[:4]), end[4:], np.zeros(3))
        exact = tops.reference(1)
        expected = tops.Motion(exact.center[-1], exact.quaternion[-1], exact.multipliers[-1])
        return max(tops.errors(found, expected)[:2])

    def peers(self) -> dict[str, tuple[str, Callable[[], frame_peers.Ways]]]:
        start, end = self.start, self.end
        return {
            "heyoka": (
                "heyoka",
                lambda: frame_peers.heyoka_ways(frame_peers.of_scene_in_heyoka(tops.scene()), start, end),
            )
        }


PROBLEMS = (Frame("soft frame", 2e5, range(8)), Frame("stiff frame", 2e11, SLOW), Top())


@dataclass(frozen=True)
class OwnRun(Run):
    """A run of eomgen, timed without Python between."""

    timed: Callable[[], float] = float

    @classmethod
    def of(cls, problem: Problem, options: Mapping[str, Any]) -> Run:
        tolerance, taken = options.get("tolerance"), [0]

        def call() -> Array | None:
            solution = problem.run(**options)
            counts = solution.stats
            taken[0] = int(counts.get("own_steps", counts.get("expansions", counts["steps"])))
            return end_of(solution)

        @cache
        def repeated() -> RepeatedRun:
            method = method_named(canonical_name(options["method"], tolerance), tolerance=tolerance)
            return RepeatedRun(problem.model, problem.run(**options), method)

        size = options["step"] if tolerance is None else tolerance
        return cls(f"{size:.2g}", call, lambda: taken[0], timed=lambda: repeated().seconds())

    def seconds(self) -> float:
        return self.timed()


def end_of(solution: eomgen.Solution) -> Array | None:
    """Return q and v at the end, or None where the run failed."""
    return np.concatenate([solution.q[-1], solution.v[-1]]) if solution.success else None


def contestants(quick: bool) -> list[tuple[str, bool]]:
    """Return methods, and whether they choose their steps."""
    if quick:
        return [("tdg3", False), ("rk4", False)]
    return [(method, False) for method in FIXED] + [(method, True) for method in BY_TOLERANCE]


def own_ways(problem: Problem, method: str, chooses: bool) -> frame_peers.Ways:
    """Yield a method's runs of all rungs."""
    parts = [10.0 ** (-rung / RUNGS) for rung in range(6 * RUNGS)]

    def way(size: float) -> Run:
        step = problem.end / round(problem.end / size)
        sizes = {"step": problem.spacing, "tolerance": size} if chooses else {"step": step}
        return OwnRun.of(problem, {"method": method, **sizes})

    if chooses:
        yield way, [COARSEST * part**2 for part in parts if COARSEST * part**2 >= 1e-14]
    else:
        fewest = problem.end / MOST_STEPS
        yield way, [problem.longest * part for part in parts if problem.longest * part >= fewest]


def met(problem: Problem, errors: Sequence[float], quick: bool) -> dict[float, dict[str, tuple[Run, float]]]:
    """Return for each error the best run of each contestant that meets it, and what it misses by; say what is
    missing."""
    ways = {
        f"{method}{', tolerance' if chooses else ''}": own_ways(problem, method, chooses)
        for method, chooses in contestants(quick)
    }
    for name, (package, make) in ({} if quick else problem.peers()).items():
        lacking = frame_peers.missing(package)
        if lacking:
            print(f"{name}: {lacking}")
        else:
            ways[name] = make()
    found: dict[float, dict[str, tuple[Run, float]]] = {error: {} for error in errors}
    for name, those in ways.items():
        for error, best in frame_peers.cheapest(those, problem.missed, errors).items():
            found[error][name] = best
    return found


def _turn(run: Run) -> float:
    """Return the mean time of runs until they took ``TURN``, ms."""
    taken: list[float] = []
    while sum(taken) < TURN:
        taken.append(run.seconds())
    return 1e3 * statistics.fmean(taken)


def times(runs: Mapping[str, Run], rounds: int) -> dict[str, float]:
    """Return ms of each run, medians over rounds in turns."""
    taken: dict[str, list[float]] = {name: [] for name in runs}
    for turn in range(rounds):
        for name, run in runs.items():
            if turn < TURNS_OF_LONG or taken[name][0] < 1e3 * LONG:
                taken[name].append(_turn(run))
    return {name: statistics.median(ms) for name, ms in taken.items()}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--rounds", type=int, default=21)
    parser.add_argument("--quick", action="store_true", help="tdg3 and rk4 in fixed steps to 1e-5, no times, no peers")
    parser.add_argument("--core", type=int)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--problems", nargs="*", choices=[problem.name for problem in PROBLEMS], help="all by default")
    options = parser.parse_args(arguments)
    pin_to_core(options.core)
    print(machine())
    found: dict[str, Any] = {}
    rows = []
    for problem in PROBLEMS[: 2 if options.quick else None]:
        if options.problems and problem.name not in options.problems:
            continue
        errors = problem.errors[:1] if options.quick else problem.errors
        for error, best in met(problem, errors, options.quick).items():
            ms = {} if options.quick else times({name: run for name, (run, _) in best.items()}, options.rounds)
            for name, (run, missed) in best.items():
                entry: dict[str, Any] = {"setting": run.label, "error": missed, "steps": run.steps()}
                timed = ["", "", ""]
                if ms:
                    ratios = ms[name] / ms["rk4"], ms["tdg3"] / ms[name]
                    entry |= {"ms": ms[name], "of_rk4": ratios[0], "tdg3_of_this": ratios[1]}
                    timed = [f"{ms[name]:.3g}", *(f"{ratio:.2g}" for ratio in ratios)]
                found[f"{problem.name}, {error:g}, {name}"] = entry
                rows.append([problem.name, f"{error:g}", name, run.label, f"{run.steps()}", f"{missed:.1e}", *timed])
    header = ["problem", "error", "method", "setting", "steps", "missed", "ms", "of rk4", "tdg3 by this"]
    print(table(header, rows))
    if options.json:
        options.json.write_text(json.dumps(found, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
