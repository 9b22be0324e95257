"""Steppers in lanes beside the stepper of one trajectory: the same bits, and time per step and trajectory of one core.

    python -m benchmarks.lane_steppers [--rounds 15] [--quick]

Both take turns; times are of the processor, medians over the rounds, and ratios those of neighbouring turns.
Trajectories begin with velocities of their own, so their steps need not iterate as often. Behind them stands what it
takes to bring the initial states of 1000 four-bars onto their constraints, together and one by one.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import eomgen
from benchmarks.measure import figure, machine, pin_to_core, table
from eomgen.compiled.consistent_states import consistent_samples
from eomgen.integrators.stepper_layout import default_settings
from eomgen.products.ensembles.lane_code import stepper_in_lanes
from eomgen.simulation.stepping.stepper import LaneStepper, Stepper

EXAMPLES = Path(__file__).parents[1] / "examples"
CASES = (
    ("four_bar", "generalized_alpha"),
    ("symmetric_top", "generalized_alpha"),
    ("quarter_car", "generalized_alpha"),
    ("four_bar", "rosenbrock"),
    ("four_bar", "rk4_partitioned"),
    ("double_pendulum_on_shaking_base", "rk4"),
    ("double_pendulum_on_shaking_base", "rk45"),
    ("double_pendulum_on_shaking_base", "taylor"),
    ("robot_arm", "rk4"),
)


@dataclass(frozen=True)
class Row:
    """Nanoseconds per step and trajectory, and how they compare."""

    scene: str
    method: str
    lanes: int
    same: bool
    alone: float
    beside: float
    ratio: float


def measured(name: str, method: str, profile: str, steps: int, rounds: int) -> Row:
    """Return what both steppers take; raises RuntimeError where the method has no lanes."""
    model = eomgen.build(eomgen.load(EXAMPLES / name / "scene.toml"), method=method, profile=profile)
    library = stepper_in_lanes(model, model.library)
    if isinstance(library, str):
        raise RuntimeError(f"{name} with {method}: {library}")
    settings = default_settings(model.library.layout["method"])
    lanes, alone = LaneStepper(library, settings), Stepper(model.library, settings, model.parameter_array())
    rng, count = np.random.default_rng(3), lanes.lanes
    v = model.initial_v * (1.0 + 0.1 * rng.random((count, 1)))
    if not model.multipliers:
        v = v + 0.1 * rng.random((count, model.nv))
    starts = np.array([np.concatenate([[0.0], model.initial_q, row, model.initial_z]) for row in v])
    parameters = np.repeat(model.parameter_array()[np.newaxis], count, axis=0)
    held = rng.random((count, model.nu)) if model.nu and "inputs" not in model.functions else None
    rows = alone.sizes["rows_per_step"]
    tables = [None if held is None else np.repeat(held[k : k + 1], rows * steps + 1, axis=0) for k in range(count)]
    record = np.empty((count, 1, lanes.width))

    def together() -> None:
        record[:] = lanes.runs(starts, parameters, held, steps, 1, 0)[0][:, 1:]

    def one(lane: int) -> None:
        alone.initialize(0.0, model.initial_q, v[lane], tables[lane], model.initial_z)
        alone.run(steps, steps, tables[lane], last)

    last, same = np.empty((1, lanes.width)), True
    together()
    for lane in range(count):
        one(lane)
        same &= np.array_equal(last, record[lane])
    pairs = [(spent(lambda: one(0)), spent(together) / count) for _ in range(rounds)]
    ratio = statistics.median(before / behind for before, behind in pairs)
    single, beside = (statistics.median(column) / steps * 1e9 for column in zip(*pairs, strict=True))
    return Row(name, method, count, same, single, beside, ratio)


def starts(count: int, rounds: int) -> tuple[float, float, float]:
    """Return us for each of so many four-bars to find its initial state, one by one and together, and the largest
    difference of coordinates."""
    model = eomgen.build(eomgen.load(EXAMPLES / "four_bar" / "scene.toml"), method="generalized_alpha")
    rng, p = np.random.default_rng(7), np.repeat(model.parameter_array()[np.newaxis], count, axis=0)
    q = model.initial_q + 0.2 * rng.random((count, model.nq))
    v = model.initial_v + rng.random((count, model.nv))
    found = np.empty_like(q)

    def one_by_one() -> None:
        for k in range(count):
            found[k] = model.consistent(q[k], v[k], parameters=p[k]).q

    one_by_one()
    together = consistent_samples(model, q, v, 0.0, p)
    gap = float(np.abs(together.q - found)[together.met].max())
    times = [(spent(one_by_one), spent(lambda: consistent_samples(model, q, v, 0.0, p))) for _ in range(rounds)]
    alone, beside = (statistics.median(column) / count * 1e6 for column in zip(*times, strict=True))
    return alone, beside, gap if together.met.all() else np.inf


def spent(call: Callable[[], None]) -> float:
    """Return the least processor time of three calls, s."""
    found = []
    for _ in range(3):
        began = time.thread_time()
        call()
        found.append(time.thread_time() - began)
    return min(found)


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.lane_steppers", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--profile", default="fast", help="of the compiler; reproducible: the same bits everywhere")
    parser.add_argument("--quick", action="store_true", help="two cases, reproducible, once: the bits alone")
    chosen = parser.parse_args(words)
    pin_to_core(None)
    cases = CASES[:2] if chosen.quick else CASES
    profile = "reproducible" if chosen.quick else chosen.profile
    steps, rounds = (50, 1) if chosen.quick else (chosen.steps, chosen.rounds)
    found = [measured(name, method, profile, steps, rounds) for name, method in cases]
    alone, beside, gap = starts(20 if chosen.quick else 1000, min(rounds, 3))
    print(machine())
    print(f"starts on constraints: {figure(alone)} us one by one, {figure(beside)} us together, apart by {gap:.1e}")
    print(
        table(
            ("scene", "method", "lanes", "same bits", "alone, ns", "in lanes, ns", "ratio"),
            [
                (
                    row.scene,
                    row.method,
                    str(row.lanes),
                    "yes" if row.same else "no",
                    *map(figure, (row.alone, row.beside, row.ratio)),
                )
                for row in found
            ],
        )
    )
    return int(chosen.quick and not (all(row.same for row in found) and gap < 1e-12))


if __name__ == "__main__":
    sys.exit(main())
