"""tune against a full sweep: whether it meets the demand, how near the best it comes, and what it costs.

    python -m benchmarks.tuning [--scenes NAME,NAME] [--budget 1000] [--sweeps FOLDER] [--out tuning.json]

For each scene one sweep (``eomgen.tradeoff``, all axes, each ladder to its end) and one ``eomgen.tune`` for each
demand.
``to best``: the time of what tune chose over that of the cheapest point of the sweep that meets the demand on the
scene's own run. ``verified``: over that of the cheapest point that meets it on tune's verification runs as well. These
times are medians of runs in turns. ``cost``: the processor's seconds of tune's computation over those of the sweep's
points, builds of neither counted; a sweep that the budget has cut is marked, its full cost is larger. With a folder the
points of the sweeps are kept there, and taken from there.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import statistics
from fractions import Fraction
from pathlib import Path
from typing import Any

import eomgen
from eomgen.errors import EomgenError
from eomgen.pipeline import documents
from eomgen.products.studies.tuning.judge import OWN, Condition, Demand, Judge, conditions, under
from eomgen.products.studies.work_precision.axes import TOLERANCE, candidates
from eomgen.products.studies.work_precision.formulations import formulations
from eomgen.products.studies.work_precision.result import Point
from eomgen.products.studies.work_precision.running import MOST_TIMES, Runner, measure_seconds, tuning_grid
from eomgen.simulation.timing import RepeatedRun

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
DEMANDS = (1e-2, 1e-4, 1e-6, 1e-8)
#: A pendulum that hits a stop.
STOPPED: dict[str, Any] = {
    "format": 1,
    "name": "stopped",
    "bodies": {"rod": {"mass": 1.0, "center_of_mass": [0, 0, -0.3], "inertia": [0.02, 0.02, 0.002]}},
    "joints": {
        "hinge": {
            "type": "revolute",
            "parent": "base",
            "child": "rod",
            "axis": [0, -1, 0],
            "initial": {"position": 1.2},
            "limits": {"lower": -0.3, "upper": 2.0, "stiffness": 2000.0, "damping": 1.0, "onset": 1e-2},
        }
    },
    "simulation": {"step": 1e-3, "duration": 2.0},
}
#: Name -> scene, output, end in s: trees, loops, beams, vehicles, controllers, a stop.
SCENES: dict[str, tuple[Any, str, float | None]] = {
    "heavy top": (EXAMPLES / "heavy_top/joint_coordinates.toml", "centre_of_mass", 1.0),
    "double pendulum": (EXAMPLES / "double_pendulum_on_shaking_base/scene.toml", "state", 4.0),
    "spatial slider-crank": (EXAMPLES / "slider_crank_spatial/scene.toml", "slider", 0.2),
    "four-bar": (EXAMPLES / "four_bar/scene.toml", "state", 1.0),
    "spin-up beam": (EXAMPLES / "spin_up_beam/scene.toml", "tip_deflection", 20.0),
    "quarter car on a bump": (EXAMPLES / "quarter_car_on_bump/scene.toml", "state", None),
    "active quarter car": (EXAMPLES / "active_quarter_car/scene.toml", "state", 2.0),
    "half car on a road": (EXAMPLES / "half_car_on_measured_road/scene.toml", "state", 2.0),
    "PI servo": (EXAMPLES / "pi_servo/scene.toml", "state", None),
    "stop": (STOPPED, "state", None),
}


#: Points of the sweep that are timed beside tune's choice, and in how many turns.
BESIDE, TURNS = 3, 9
#: Conditions among which those of the verification are.
CONDITIONS = 40


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else "")
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--budget", type=float, default=1000.0)
    parser.add_argument("--sweeps", type=Path, default=None)
    parser.add_argument("--out", type=Path, default=None)
    given = parser.parse_args()
    rows: list[dict[str, Any]] = []
    print(f"{'scene':24}{'demand':>8}{'met':>5}{'to best':>9}{'verified':>9}{'cost':>8}  chosen")
    for name in given.scenes.split(","):
        rows += compared(name, given.budget, given.sweeps)
        if given.out is not None:
            given.out.write_text(json.dumps(rows, indent=2) + "\n")
    told = [row for row in rows if "cost" in row]
    met = sum(row["met"] for row in told)
    beaten = [row for row in told if row["ratio"] is not None]
    sure = [row for row in told if row["verified"] is not None]
    near = sum(row["ratio"] <= 1.5 for row in beaten)
    fair = sum(row["verified"] <= 1.5 for row in sure)
    cheap = sum(row["cost"] <= 0.05 for row in told)
    print(
        f"of {len(rows)}: {met} met; within 1.5 x of the sweep's best {near} of {len(beaten)}, of its best that meets "
        f"the demand on the verification runs {fair} of {len(sure)}; for 5 % or less {cheap} of {len(told)}"
    )


def compared(name: str, budget: float, kept: Path | None) -> list[dict[str, Any]]:
    """Return a row for each demand on one scene."""
    scene, output, end = SCENES[name]
    folder = None if kept is None else kept / name.replace(" ", "_")
    try:
        study = eomgen.tradeoff(scene, outputs=[output], t_end=end, budget=budget, folder=folder, resume=True)
    except EomgenError as error:
        print(f"{name:24}sweep: {error}")
        return []
    sweep = sum(point.took for point in study.points)
    cut = sum("budget" in why or "a run" in why for why in study.left_out.values())
    print(
        f"{name:24}sweep: {len(study.points)} points, {sweep:.1f} s{f', {cut} ladders cut' if cut else ''}", flush=True
    )
    return [row(name, demand, study, sweep) | {"cut": cut} for demand in DEMANDS]


def row(name: str, demand: float, study: eomgen.Tradeoff, sweep: float) -> dict[str, Any]:
    """Return what tune gives for one demand, beside the sweep."""
    scene, output, end = SCENES[name]
    found: dict[str, Any] = {"scene": name, "demand": demand, "sweep": sweep, "met": False}
    able = study.best(demand)
    try:
        tuned = eomgen.tune(scene, demand, output=output, t_end=end)
    except EomgenError as error:
        print(f"{name:24}{demand:8g}  {error}{'' if able else ' (nor does the sweep)'}"[:200], flush=True)
        return {**found, "refused": str(error), "best": able.label if able else None}
    assert isinstance(tuned, eomgen.Tuned)
    beside = _Beside(name, demand, tuned, study)
    ratio, best = beside.ratio(verified=False)
    sure, surest = beside.ratio(verified=True)
    cost = tuned.spent[0] / sweep
    print(
        f"{name:24}{demand:8g}{'yes' if tuned.met else 'NO':>5}{_shown(ratio)}{_shown(sure)}{100 * cost:7.1f}%  "
        f"{tuned.label} (best: {best}; verified: {surest})",
        flush=True,
    )
    return {
        **found, "ratio": ratio, "verified": sure, "met": tuned.met, "cost": cost, "chosen": tuned.label,
        "seconds": tuned.seconds, "best": best, "best_verified": surest, "runs": tuned.spent[1],
        "spent": tuned.spent[0], "error": tuned.error, "own": tuned.own,
        "verification": [run.error for run in tuned.verified],
    }  # fmt: skip  # a table


class _Beside:
    """Runs of tune's choice and of points of the sweep, under tune's conditions and timed in turns."""

    def __init__(self, name: str, demand: float, tuned: eomgen.Tuned, study: eomgen.Tradeoff) -> None:
        scene, output, end = SCENES[name]
        self.tuned, self.demand = tuned, demand
        forms = formulations(scene, {}, others=True)
        document, front_end = documents.as_document(forms.scenes[forms.own])
        simulation = front_end.describe(document).simulation
        grid = tuning_grid(end or simulation.duration, simulation.step, simulation.step * simulation.record_every)
        self.runner = Runner(forms, grid)
        every = candidates(forms.own, self.runner.model(forms.own), (), {})
        self.judge = Judge(self.runner, every, Demand(demand, output, "largest"), 9.0, lambda _: None)
        near = itertools.islice(conditions(self.runner, self.judge.reference().observation), CONDITIONS)
        seen = {run.what for run in tuned.verified}
        self.checks = [condition for condition in near if condition.label in seen]
        usable = [p for p in study.usable if study.error(p) <= demand]
        self.points = sorted(usable, key=lambda p: p.seconds or math.inf)

    def ratio(self, *, verified: bool) -> tuple[float | None, str]:
        """Return the time of tune's choice over that of the cheapest of the points, and which this is."""
        entered: list[tuple[str, RepeatedRun]] = []
        for point in self.points:
            if len(entered) == BESIDE:
                break
            if not verified or all(self._meets(point, condition) for condition in (OWN, *self.checks)):
                repeated = self.runner.run(**self._how(point), estimated=False).repeated
                entered += [(point.label, repeated)] if repeated is not None else []
        own = (
            {TOLERANCE: self.tuned.value}
            if self.tuned.kind == TOLERANCE
            else {"per_row": self._per_row(self.tuned.value)}
        )
        chosen = self.runner.run(self.tuned.configuration, **own, estimated=False).repeated
        if not entered or chosen is None:
            return None, "none"
        times: list[list[float]] = [[] for _ in range(len(entered) + 1)]
        for _ in range(TURNS):
            for taken, repeated in zip(times, (chosen, *(r for _, r in entered)), strict=True):
                taken.extend(measure_seconds(repeated, 1))
        medians = [statistics.median(taken) for taken in times]
        least = min(range(len(entered)), key=lambda k: medians[k + 1])
        return medians[0] / medians[least + 1], entered[least][0]

    def _meets(self, point: Point, condition: Condition) -> bool:
        observation = under(self.judge, self._how(point), condition).observation
        return observation is not None and self.judge.error(observation, condition) <= self.demand

    def _how(self, point: Point) -> dict[str, Any]:
        own = {TOLERANCE: point.value} if point.kind == TOLERANCE else {"per_row": self._per_row(point.value)}
        return {"configuration": point.configuration, **own}

    def _per_row(self, step: float) -> Fraction:
        return Fraction(self.runner.grid.row / step).limit_denominator(MOST_TIMES)


def _shown(ratio: float | None) -> str:
    return f"{'-' if ratio is None else f'{ratio:.2f}':>9}"


if __name__ == "__main__":
    main()
