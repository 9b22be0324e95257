"""Ten million steps of the slow top and of a four-bar: constraints, energy, quaternions, angular momentum about the
vertical.

    python -m benchmarks.long_run [--steps 10000000] [--cases "four-bar"] [--rho-inf 0.9] [--json out.json]

What generalized-alpha takes from the energy is a matter of its order: over the first tenth the trend is measured with
half the step too. In joint coordinates an angle that grows from turn to turn loses digits, and the loop of a turning
crank with it.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import date
from functools import cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import eomgen
from benchmarks import tops
from benchmarks.measure import figure, machine, table
from eomgen.integrators.families.register import terms_of
from eomgen.pipeline.model import Model
from eomgen.results.solution import Solution

Array = NDArray[np.float64]
ROWS = 10_000
METHOD = "generalized_alpha"
CRANK, COUPLER, ROCKER, GROUND = 0.3, 0.8, 0.6, 0.9  # m; the crank can turn all the way round
TURNING = 20.0  # rad/s


@dataclass(frozen=True)
class LongRun:
    """What is left of the invariants after a run.

    Attributes
    ----------
    constraint, velocity : largest violation of the constraints and of their rates at any step.
    energy : kinetic energy at the start, J.
    drop : largest distance of the energy from its first value, J.
    trend : slope of the energy over the run, W.
    trend_of_tenth, trend_of_half : the same over the first tenth, with the step and with half of it.
    quaternion : largest distance of a quaternion's length from 1.
    momentum : largest change of the angular momentum about the vertical, in units of its first value; nan without
        meaning.
    """

    case: str
    steps: int
    step: float
    constraint: float
    velocity: float
    energy: float
    drop: float
    trend: float
    trend_of_tenth: float
    trend_of_half: float
    quaternion: float
    momentum: float
    seconds: float
    message: str

    @property
    def order(self) -> float:
        """The order at which the trend vanishes with the step; nan where there is no trend to speak of."""
        ratio = self.trend_of_tenth / self.trend_of_half if self.trend_of_half else float("nan")
        return math.log2(ratio) if ratio > 0.0 else float("nan")


@cache
def four_bar(coordinates: str, rate: float) -> Model:
    """Return a four-bar under gravity, from a guess that does not close; ``rate`` of the crank at the start, rad/s."""
    builder = eomgen.SceneBuilder("four_bar", coordinates=coordinates)
    for name, length in (("crank", CRANK), ("coupler", COUPLER), ("rocker", ROCKER)):
        builder.body(name, 1.0, center_of_mass=[length / 2, 0, 0], inertia=[0.001, length**2 / 12, length**2 / 12])
    for name, parent, child, at, angle, speed in (
        ("a", "base", "crank", 0.0, -1.2, -rate),
        ("b", "crank", "coupler", CRANK, 1.0, 0.0),
        ("c", "base", "rocker", GROUND, -1.9, 0.0),
    ):
        initial = {"position": [angle], "velocity": [speed]}
        builder.joint(name, "revolute", parent, child, axis=[0, 1, 0], position=[at, 0, 0], initial=initial)
    pin = {"axis": [0, 1, 0]}
    ends = [
        {"body": name, "position": [length, 0, 0], **pin} for name, length in (("coupler", COUPLER), ("rocker", ROCKER))
    ]
    builder.constraint("loop", "revolute", ends[0], ends[1])
    return eomgen.build(builder.build(), terms=(*terms_of(METHOD, constrained=True), "energy"), method=METHOD)


@dataclass(frozen=True)
class Case:
    """What gives a model, under a name, and the step that its motion asks for, s."""

    name: str
    model: Callable[[], Model]
    step: float


def cases() -> list[Case]:
    """Return what is run."""
    found = [
        Case(f"slow top, {one.name}", partial(one.model, tops.SLOW), 1e-3)
        for one in (tops.JOINT, tops.SE3, tops.R3XSO3)
    ]
    for coordinates in ("joint", "absolute"):
        for name, rate in (("swinging", 0.0), ("turning", TURNING)):
            found.append(
                Case(f"four-bar {name}, {coordinates} coordinates", partial(four_bar, coordinates, rate), 2.5e-4)
            )
    return found


def measured(case: Case, steps: int, rho_inf: float) -> LongRun:
    """Run a model and look at its invariants; then over a tenth of the time at half the step."""
    model, step = case.model(), case.step
    began = time.thread_time()
    solution = _run(model, steps, step, rho_inf)
    seconds = time.thread_time() - began
    momentum = float("nan")
    if "top" in model.bodies:
        vertical = tops.vertical_momentum(model, solution.q, solution.v)
        momentum = float(np.max(np.abs(vertical / vertical[0] - 1.0)))
    total = solution.energy["total"]
    violation = [float(solution.stats.get(name, 0.0)) for name in ("max_constraint", "max_constraint_velocity")]
    finer = _run(model, steps // 5, step / 2, rho_inf)
    return LongRun(
        case.name,
        int(solution.stats["steps"]),
        step,
        violation[0],
        violation[1],
        float(solution.energy["kinetic"][0]),
        float(np.max(np.abs(total - total[0]))),
        trend(solution),
        trend(solution, 0.1),
        trend(finer),
        longest(model, solution.q),
        momentum,
        seconds,
        solution.message,
    )


def _run(model: Model, steps: int, step: float, rho_inf: float) -> Solution:
    every = max(1, steps // ROWS)
    return model.simulate(steps * step, step, method=METHOD, rho_inf=rho_inf, record_every=every, error_estimate=False)


def trend(solution: Solution, part: float = 1.0) -> float:
    """Return the slope of a straight line through the energy, or through its first part, in W."""
    rows = max(2, round(part * len(solution.t)))
    total = solution.energy["total"][:rows]
    return float(np.polyfit(solution.t[:rows], total - total[0], 1)[0])


def longest(model: Model, q: Array) -> float:
    """Return how far the length of any quaternion is from 1."""
    turning = [factor.q_start for factor in model.factors if factor.group != "R"]
    lengths = [np.linalg.norm(q[:, start : start + 4], axis=1) for start in turning]
    return float(np.max(np.abs(np.array(lengths) - 1.0))) if lengths else 0.0


HEADER = (
    "case", "step, s", "steps", "constraint", "its rate", "kinetic energy, J", "change of energy, J", "trend, W",
    "its order in the step", "quaternion", "vertical momentum", "CPU s",
)  # fmt: skip  # a table


def lines_of(runs: Sequence[LongRun]) -> list[list[str]]:
    return [
        [
            run.case,
            f"{run.step:g}",
            f"{run.steps:.4g}",
            f"{run.constraint:.1e}",
            f"{run.velocity:.1e}",
            figure(run.energy),
            f"{run.drop:.1e}",
            f"{run.trend:.1e}",
            f"{run.order:.1f}",
            f"{run.quaternion:.1e}",
            f"{run.momentum:.1e}",
            figure(run.seconds),
        ]
        for run in runs
    ]


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.long_run", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--steps", type=int, default=10_000_000)
    parser.add_argument("--cases", default="", help="only those whose names hold this text")
    parser.add_argument("--rho-inf", type=float, default=0.9)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args(words)
    print(machine(), flush=True)
    runs = [measured(case, arguments.steps, arguments.rho_inf) for case in cases() if arguments.cases in case.name]
    print(f"\nrho_inf {arguments.rho_inf:g}\n\n{table(HEADER, lines_of(runs))}\n")
    for run in runs:
        print(f"{run.case}: {run.message}")
    if arguments.json:
        content = {"date": f"{date.today()}", "machine": machine(), "rho_inf": arguments.rho_inf}
        content |= {"runs": [asdict(run) for run in runs]}
        arguments.json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
