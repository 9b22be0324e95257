"""Which method a scene should have that names none: candidates over all examples, by what a demanded error costs.

    python -m benchmarks.default_method [--scenes NAME ...] [--out default_method.json] [--from default_method.json]

For every scene file of ``examples`` each candidate runs from coarse steps, or tolerances, to fine ones, until its
error is at most the finest demand. Errors are the largest over time, of q or v, as a part of the motion, against a
reference of two methods at tight tolerances (that of ``eomgen.tradeoff``). Costs are medians of the processor's time
of the steps alone. A candidate meets a demand at its cheapest point whose error is at most the demand; its ratio is
that cost over the cheapest one of all candidates. The second table is of runs as they are given: with the scene's own
step, or the method's own tolerance.

``auto`` is what its choice for each step gives; the choice itself is timed apart. A rule is a candidate that names one
method for scenes with constraints and one for those without.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from benchmarks.measure import machine, table
from eomgen.compiled.initial_state import initial_state
from eomgen.errors import EomgenError
from eomgen.integrators.families.register import AUTO, STANDARD, check_needs, method_named
from eomgen.products.studies.work_precision.axes import Configuration, candidates
from eomgen.products.studies.work_precision.formulations import formulations
from eomgen.products.studies.work_precision.reference import RunReference, reference
from eomgen.products.studies.work_precision.running import (
    REACHED,
    REFUSED,
    TOO_LONG,
    Runner,
    ladder_grid,
    measure_seconds,
    per_coarsest,
)
from eomgen.simulation.automatic_method import RESOLVED, choose_method, largest_eigenvalue
from eomgen.system.system import Facts

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
DEMANDS = (1e-3, 1e-6)
#: The choice of ``auto`` without its condition that forces are smooth.
CORNERS = "auto, at corners too"
#: Methods with fixed steps, and with steps of their own and the tolerances that are compared.
STEPPED = (AUTO, CORNERS, "generalized_alpha", "trapezoidal", "rk4", "rk4_partitioned")
BY_TOLERANCE: Mapping[str, tuple[float, ...]] = {
    "rk45": tuple(10.0**-k for k in range(2, 11)),
    "taylor": tuple(10.0**-k for k in range(2, 11)),
    "generalized_alpha_adaptive": tuple(10.0**-k for k in range(1, 9)),
}
#: Rules: name -> method without constraints, with constraints.
RULES: Mapping[str, tuple[str, str]] = {
    "rk4, or rk4_partitioned": ("rk4", "rk4_partitioned"),
    "rk4, or generalized_alpha": ("rk4", "generalized_alpha"),
    "rk45, or generalized_alpha_adaptive": ("rk45", "generalized_alpha_adaptive"),
}
#: Ends of runs, s, by folder, where the scene's own is long, or chaotic: the motion is compared up to there.
ENDS: Mapping[str, float] = {
    "active_quarter_car": 4.0,
    "active_vehicle": 4.0,
    "elastic_slider_crank": 0.02,
    "elastic_vehicle": 4.0,
    "half_car_on_measured_road": 4.0,
    "hanging_chain": 1.0,
    "heavy_top": 1.0,
    "jerk_limited_arm": 0.5,
    "quarter_car": 4.0,
    "sea_arm": 0.5,
}
#: Seconds that a run, and that the references of a scene, may take.
LONGEST, REFERENCES = 5.0, 15.0
#: A cost is the median of so many, of fewer where they take longer than so many seconds.
REPEATS, SPENT = 9, 0.3


@dataclass(frozen=True)
class Point:
    """One run.

    Attributes
    ----------
    resolution : step in s, or tolerance; nan where it is the method's own
    given : whether this is the run as it is given
    by : the method that ran, which ``auto`` chose
    ended : how
    """

    scene: str
    candidate: str
    resolution: float
    given: bool
    by: str
    ended: str
    error: float
    seconds: float
    said: str = ""


@dataclass(frozen=True)
class Subject:
    """A scene with its runner and its reference."""

    name: str
    runner: Runner
    reference: RunReference

    @property
    def formulation(self) -> str:
        return self.runner.formulations.own

    def point(self, candidate: str, by: str, resolution: float, *, tolerance: bool, given: bool = False) -> Point:
        """Return the point of a run."""
        runner, configuration = self.runner, Configuration(self.formulation, by)
        if tolerance:
            own = runner.method(configuration).parameters["tolerance"]
            outcome = runner.run(configuration, tolerance=float(own) if math.isnan(resolution) else resolution)
        else:
            in_row = round(runner.grid.row * runner.grid.coarsest / resolution)
            outcome = runner.run(configuration, Fraction(in_row, runner.grid.coarsest))
        error = seconds = math.inf
        if outcome.ended == REACHED and outcome.observation is not None and outcome.repeated is not None:
            error = self.reference.errors_of(outcome.observation)["state"].largest
            first = measure_seconds(outcome.repeated, 1)
            more = min(REPEATS - 1, int(SPENT / max(first[0], 1e-9)))
            seconds = statistics.median([*first, *measure_seconds(outcome.repeated, more)])
            error = error if math.isfinite(error) else math.inf
        return Point(self.name, candidate, resolution, given, by, outcome.ended, error, seconds, outcome.said[:200])


def scenes() -> dict[str, Path]:
    """Return all scene files of the examples by name; files that only others include are none."""
    found = sorted(EXAMPLES.glob("*/*.toml"))
    named = {f"{file.parent.name}/{file.stem}": file for file in found if "[simulation]" in file.read_text("utf-8")}
    return {name.removesuffix("/scene"): file for name, file in named.items()}


def subject(name: str, file: Path) -> Subject:
    """Return a scene with its reference. Raises EomgenError."""
    found = formulations(file, {}, others=False)
    simulation = found.scenes[found.own].simulation
    end = min(ENDS.get(file.parent.name, math.inf), simulation.duration)
    grid = ladder_grid(end, simulation.step, simulation.step * simulation.record_every, ())
    runner = Runner(found, grid, limit=LONGEST)
    every = candidates(found.own, runner.model(found.own), (), {})
    return Subject(name, runner, reference(runner, every, REFERENCES, lambda _: None))


def points_of(one: Subject, step: float) -> Iterator[Point]:
    """Yield the points of all candidates on a scene; one that is refused gives one point that says why."""
    runner, grid = one.runner, one.runner.grid
    model = runner.model(one.formulation)
    facts = Facts(**{name: bool(value) for name, value in model.library.layout["facts"].items()})
    coarsest = grid.row * grid.coarsest
    steps = [coarsest / count for count in per_coarsest(type(grid)(coarsest, 1), ())]
    own = min(steps, key=lambda size: abs(size - step))
    for name in (*STEPPED, *BY_TOLERANCE):
        try:
            if name not in (AUTO, CORNERS):
                check_needs(method_named(name), facts)
                runner.prepare(Configuration(one.formulation, name))
        except EomgenError as error:
            yield Point(one.name, name, math.nan, True, name, REFUSED, math.inf, math.inf, str(error)[:200])
            continue
        tolerances = BY_TOLERANCE.get(name, ())
        if tolerances:
            yield one.point(name, name, math.nan, tolerance=True, given=True)
        met = False
        for resolution in tolerances or steps:
            given = not tolerances and resolution == own
            if met and (tolerances or resolution < own):
                break
            if met and not given:
                continue
            by = name if name not in (AUTO, CORNERS) else chosen(one, resolution, corners=name == CORNERS)
            found = one.point(name, by, resolution, tolerance=bool(tolerances), given=given)
            yield found
            met = met or found.error <= min(DEMANDS)
            if found.ended == TOO_LONG:
                break


def chosen(one: Subject, step: float, *, corners: bool) -> str:
    """Return what ``auto`` chooses for a step, or what it would choose if corners of forces did not count."""
    model = one.runner.model(one.formulation)
    p = model.parameter_array()
    if not corners or model.library.layout["facts"]["smooth"]:
        return choose_method(model, None, p, 0.0, step)[0]
    fastest = largest_eigenvalue(model, initial_state(model, None, p), 0.0, p)
    explicit = "rk4_partitioned" if model.multipliers else "rk4"
    return explicit if fastest is not None and step * fastest <= RESOLVED else STANDARD


def seconds_to_choose(one: Subject, step: float) -> float:
    """Return the processor's time of the choice of ``auto``, s."""
    model = one.runner.model(one.formulation)
    taken = []
    for _ in range(REPEATS):
        began = time.thread_time()
        choose_method(model, None, model.parameter_array(), 0.0, step)
        taken.append(time.thread_time() - began)
    return statistics.median(taken)


def with_rules(points: Sequence[Point]) -> list[Point]:
    """Return the points, and those of the rules: which scenes have constraints is told by what is refused there."""
    constrained = {p.scene for p in points if p.candidate == "rk4" and p.ended == REFUSED and math.isnan(p.resolution)}
    found = list(points)
    for rule, (free, bound) in RULES.items():
        for p in points:
            if p.candidate == (bound if p.scene in constrained else free):
                found.append(Point(**{**asdict(p), "candidate": rule}))
    return found


def costs(points: Sequence[Point], demand: float) -> dict[str, dict[str, float]]:
    """Return the cheapest time that meets a demand, by scene and candidate; none where nothing meets it."""
    found: dict[str, dict[str, float]] = {}
    for p in points:
        mine = found.setdefault(p.scene, {})
        if p.error <= demand:
            mine[p.candidate] = min(mine.get(p.candidate, math.inf), p.seconds)
    return found


def demanded(points: Sequence[Point]) -> str:
    """Return a table: how often each candidate meets each demand, at which ratio to the cheapest."""
    header = ["candidate", "does not run"]
    for demand in DEMANDS:
        header += [f"meets {demand:g}", "median to best", "90 %", "worst"]
    by_demand = {demand: costs(points, demand) for demand in DEMANDS}
    rows = []
    for name in dict.fromkeys(p.candidate for p in points):
        row = [name, str(len({p.scene for p in points if p.candidate == name and refused(p)}))]
        for found in by_demand.values():
            able = [times for times in found.values() if times]
            ratios = [times[name] / min(times.values()) for times in able if name in times]
            row += [f"{len(ratios)} of {len(able)}"]
            row += [f"{x:.3g}" for x in np.quantile(ratios, [0.5, 0.9, 1.0])] if ratios else ["", "", ""]
        rows.append(row)
    return table(header, rows)


def as_given(points: Sequence[Point]) -> str:
    """Return a table of the runs as given: their errors, and their times over those of generalized-alpha."""
    first = {p.scene: p for p in points if p.given and p.candidate == "generalized_alpha"}
    header = ["candidate", "runs to its end", "error at most 1e-3", "1e-6", "wrong by 10 %", "median error"]
    rows = []
    for name in dict.fromkeys(p.candidate for p in points):
        mine = [p for p in points if p.given and p.candidate == name]
        ended = [p for p in mine if p.ended == REACHED]
        within = [str(sum(p.error <= demand for p in ended)) for demand in DEMANDS]
        ratios = [p.seconds / first[p.scene].seconds for p in ended if p.scene in first]
        middle, worst = (f"{f(ratios):.3g}" if ratios else "" for f in (statistics.median, max))
        error = f"{statistics.median(p.error for p in ended):.1e}" if ended else ""
        wrong = str(sum(not p.error <= 0.1 for p in ended))
        rows.append([name, f"{len(ended)} of {len(mine)}", *within, wrong, error, middle, worst])
    return table([*header, "time to generalized_alpha, median", "worst"], rows)


def refused(point: Point) -> bool:
    """Return whether a point stands for a candidate that a scene refuses."""
    return point.ended == REFUSED and math.isnan(point.resolution)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="*", help="names of examples; all by default")
    parser.add_argument("--out", type=Path, help="a file of all points, from which a run that was ended goes on")
    given = parser.parse_args(arguments)
    points: list[Point] = []
    choices: dict[str, float] = {}
    if given.out is not None and given.out.exists():
        held = json.loads(given.out.read_text(encoding="utf-8"))
        points, choices = [Point(**p) for p in held["points"]], held["choices"]
    print(machine())
    for name, file in scenes().items():
        if name in choices or (given.scenes and name not in given.scenes):
            continue
        try:
            one = subject(name, file)
        except EomgenError as error:
            print(f"{name}: no reference: {error}", flush=True)
            continue
        step = float(one.runner.model(one.formulation).library.layout["defaults"]["step"])
        found = list(points_of(one, step))
        choices[name] = seconds_to_choose(one, step)
        points += found
        bar, end = one.reference.bar("state"), one.runner.grid.end
        print(f"{name}: {end:.4g} s, {len(found)} runs, reference known to {bar:.1e}", flush=True)
        for p in found:
            if p.given:
                ran = f"{p.candidate:28s}{p.by:28s}{p.ended:9s}{p.error:9.1e}{1e3 * p.seconds:10.3g} ms"
                print(f"  {ran}  {p.said[:80]}")
        if given.out is not None:
            text = json.dumps({"machine": machine(), "points": [asdict(p) for p in points], "choices": choices})
            given.out.write_text(text + "\n", encoding="utf-8")
    ruled = with_rules(points)
    print(f"\n{len({p.scene for p in points})} scenes\n\n{demanded(ruled)}\n\n{as_given(ruled)}\n")
    if choices:
        middle, worst = 1e3 * statistics.median(choices.values()), 1e3 * max(choices.values())
        print(f"the choice of auto takes {middle:.2g} ms in the median, {worst:.2g} ms at most")


if __name__ == "__main__":
    main()
