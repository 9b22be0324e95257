"""How good the error estimate of runs is: against the true error, over scenes, methods, steps and tolerances.

    python -m benchmarks.error_estimates [--scenes four-bar ...] [--json out.json] [--points]

A point is a run. Its true error is the largest one of a coordinate or an internal state over the rows compared, as a
part of the motion, against a reference by another method at a tight tolerance; the estimate is ``solution.error``.
Points whose true error is less than ten times the reference's own, or rounding, are left out and counted.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import eomgen
from benchmarks.measure import table
from eomgen.base.arrays import Array
from eomgen.simulation.accuracy.motion_size import differences, motion_size, shares

EXAMPLES = Path(__file__).parent.parent / "examples"
#: An estimate within this factor of the true error is good.
GOOD = 3.0
#: True errors, as parts of the motion, below which rounding decides.
ROUNDING = 1e-11
#: How much larger than the error of the reference an error has to be.
MARGIN = 10.0
TREE = ("generalized_alpha", "hht", "newmark", "rk4", "taylor", "rk45")
BY_TOLERANCE = ("taylor", "rk45")
LOOP = ("generalized_alpha", "generalized_alpha_index3", "generalized_alpha_spatial", "rk4_partitioned")
TOLERANCES = tuple(10.0**-k for k in range(3, 13))


@dataclass(frozen=True)
class Case:
    """A scene, how long it runs, and its largest step, which is halved for each further one.

    Attributes
    ----------
    scene : path below ``examples``, or data
    steps : how many steps there are of each method
    options : of ``simulate``
    """

    name: str
    scene: str | Mapping[str, Any]
    t_end: float
    step: float
    methods: tuple[str, ...] = TREE
    steps: int = 7
    options: Mapping[str, Any] = field(default_factory=dict)


_STOPPED = {
    "format": 1,
    "name": "pendulum_between_stops",
    "bodies": {"rod": {"mass": 1.0, "center_of_mass": [0, 0, -0.4], "inertia": [0.06, 0.06, 0.001]}},
    "joints": {
        "hinge": {
            "type": "revolute",
            "parent": "base",
            "child": "rod",
            "axis": [0, 1, 0],
            "initial": {"position": 1.2},
            "limits": {"lower": -0.5, "upper": 1.5, "stiffness": 400.0, "damping": 2.0},
        }
    },
}

CASES = (
    Case("double pendulum, shaking base", "double_pendulum_on_shaking_base/scene.toml", 3.0, 0.032),
    Case("robot arm", "robot_arm/scene.toml", 1.0, 0.016),
    Case("four-bar", "four_bar/scene.toml", 1.0, 0.016, LOOP),
    Case("spatial slider-crank", "slider_crank_spatial/scene.toml", 0.1, 8e-4, LOOP),
    Case("heavy top, fast, SO3", "heavy_top/joint_coordinates.toml", 1.0, 4e-3),
    Case("heavy top, fast, SE3", "heavy_top/se3.toml", 1.0, 4e-3, LOOP),
    Case("heavy top, fast, R3xSO3", "heavy_top/r3xso3.toml", 1.0, 4e-3, LOOP),
    Case("symmetric top", "symmetric_top/scene.toml", 2.0, 0.016),
    Case("free body", "free_spinning_body/scene.toml", 5.0, 0.064),
    Case("spin-up beam", "spin_up_beam/scene.toml", 20.0, 0.064),
    Case("elastic slider-crank", "elastic_slider_crank/scene.toml", 0.02, 4e-5, LOOP, 5),
    Case("active vehicle", "active_vehicle/scene.toml", 2.0, 0.008),
    Case("active quarter car", "active_quarter_car/scene.toml", 2.0, 0.008),
    Case("servo with limited PI", "pi_servo/scene.toml", 2.0, 0.008),
    Case("pendulum between stops", _STOPPED, 3.0, 0.016),
    Case("quarter car on bump", "quarter_car_on_bump/scene.toml", 1.5, 0.004),
)


@dataclass(frozen=True)
class Point:
    """A run: true and estimated error as parts of the motion, and how many components are within the factor.

    Attributes
    ----------
    setting : step in s, or tolerance
    reference : error of the reference, as a part of the motion
    failure : why there are no numbers
    """

    case: str
    method: str
    setting: float
    true: float = math.nan
    estimate: float = math.nan
    order: float = math.nan
    reference: float = math.nan
    cost: float = math.nan
    made_by: str = ""
    warned: bool = False
    failure: str = ""

    @property
    def counts(self) -> bool:
        """Whether its true error is known."""
        return not self.failure and self.true > max(ROUNDING, MARGIN * self.reference)

    @property
    def good(self) -> bool:
        return self.true / GOOD <= self.estimate <= self.true * GOOD


def reference_rows(model: eomgen.Model, case: Case) -> tuple[Array, float]:
    """Return rows of the motion at multiples of the largest step, and how far a looser one is off, as a part of the
    motion."""
    tight, loose = (_by_dop853(model, case, tolerance) for tolerance in (1e-13, 1e-11))
    return tight, share_of(model, tight, loose, tight)


def share_of(model: eomgen.Model, first: Array, second: Array, motion: Array) -> float:
    """Return the largest difference of rows of two motions, as a part of the motion."""
    apart = differences(model, first, second, ({}, {}))
    return float(shares(apart, motion_size(model, motion, {})).max(initial=0.0))


def _by_dop853(model: eomgen.Model, case: Case, tolerance: float) -> Array:
    first = model.simulate(0.0, case.step, error_estimate=False, **case.options)
    times = np.arange(0.0, case.t_end * (1.0 + 1e-9), case.step)
    y = np.concatenate([first.q[0], first.v[0], first.z[0]])
    found = [y[np.newaxis]]
    jumps = [float(t) for t in model.discontinuity_times(0.0, float(times[-1])) if 0.0 < t < times[-1]]
    for start, end in zip([0.0, *jumps], [*jumps, float(times[-1])], strict=True):
        asked = np.append(times[(times > start) & (times < end)], end)
        inner = np.nextafter(start, end), np.nextafter(end, start)  # the side of a jump on which the motion is
        solved = solve_ivp(
            model.rhs,
            inner,
            y,
            "DOP853",
            np.clip(asked, *inner),
            rtol=tolerance,
            atol=tolerance * 1e-2,
            max_step=case.step,
        )
        if not solved.success:
            raise RuntimeError(f"{case.name}: {solved.message}")
        y = solved.y[:, -1]
        found.append(solved.y.T if end in times else solved.y.T[:-1])
    states = np.concatenate(found)
    q, v, z = np.split(states, [model.nq, model.nq + model.nv], axis=1)
    unknown = np.zeros((len(q), model.nv + len(model.multipliers)))
    return np.hstack([times[:, np.newaxis], q, v, unknown, z])


def rows_of(solution: eomgen.Solution) -> Array:
    """Return the rows of a solution in the order of the record."""
    parts = (solution.t[:, np.newaxis], solution.q, solution.v, solution.a, solution.multipliers, solution.z)
    return np.hstack(parts)


def point(model: eomgen.Model, case: Case, method: str, setting: float, known: tuple[Array, float]) -> Point:
    """Return what a run with a step, or a tolerance, is off by, and what it says."""
    options = dict(case.options)
    stepped = {"step": case.step, "tolerance": setting} if method in BY_TOLERANCE else {"step": setting}
    solution = model.simulate(case.t_end, method=method, record_every=1, **stepped, **options)
    if len(solution.t) < 2 or solution.t[-1] < case.t_end * (1.0 - 1e-9):
        return Point(case.name, method, setting, failure=solution.message)
    rows, (reference, own_error) = rows_of(solution), known
    places = np.searchsorted(solution.t, reference[:, 0] - 0.25 * stepped["step"])
    true = share_of(model, rows[places], reference, rows)
    error = solution.error
    return Point(
        case.name,
        method,
        setting,
        true,
        error.relative if error.available else math.nan,
        error.order,
        own_error,
        error.cost,
        error.method if error.available else error.reason,
        "estimated error" in solution.message or not solution.success,
    )


def points_of(case: Case) -> Iterator[Point]:
    """Yield all points of a scene."""
    scene = case.scene if not isinstance(case.scene, str) else EXAMPLES / case.scene
    model = eomgen.build(scene)
    known = reference_rows(model, case)
    for method in case.methods:
        try:
            model.simulate(0.0, case.step, method=method)
        except eomgen.errors.EomgenError as refused:
            print(f"{case.name}: {refused}", file=sys.stderr)
            continue
        settings = TOLERANCES if method in BY_TOLERANCE else [case.step / 2**k for k in range(case.steps)]
        for setting in settings:
            yield point(model, case, method, setting, known)


def rates(points: Sequence[Point], key: Callable[[Point], str]) -> list[list[str]]:
    """Return rows of a table: a key, points that count, the share of good ones, and quantiles of the ratio."""
    found = []
    for name in dict.fromkeys(map(key, points)):
        mine = [p for p in points if key(p) == name]
        counted = [p for p in mine if p.counts]
        if not counted:
            found.append([name, "0 of 0", *[""] * (len(HEADER) - 2)])
            continue
        ratio = np.array([p.estimate / p.true for p in counted])
        low, middle, high = np.nanquantile(ratio, [0.025, 0.5, 0.975])
        good = sum(p.good for p in counted)
        failed = sum(bool(p.failure) for p in mine)
        silent = sum(p.true > 0.1 and not p.warned for p in counted)
        share = f"{100.0 * good / len(counted):.1f} %"
        found.append([name, f"{good} of {len(counted)}", share, f"{low:.2g}", f"{middle:.2g}", f"{high:.2g}"])
        found[-1] += [str(failed), str(silent)]
    return found


def line(p: Point) -> str:
    """Return a point as a line of text, marked X where the estimate is no good."""
    mark = " " if not p.counts else "." if p.good else "X"
    head = f"{mark} {p.case:30s} {p.method:26s} {p.setting:9.3g}"
    if p.failure:
        return f"{head} {p.failure}"
    errors = (
        f"true {p.true:9.2e} estimate {p.estimate:9.2e} ratio {p.estimate / p.true:7.2g} reference {p.reference:.1g}"
    )
    return f"{head} {errors} order {p.order:5.2f} {p.made_by}{' warned' if p.warned else ''}"


HEADER = ("", "good", "share", "2.5 %", "median", "97.5 %", "ended early", "wrong by 10 % and silent")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="*", help="parts of names of scenes; all by default")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--points", action="store_true", help="print every point")
    given = parser.parse_args(arguments)
    chosen = [c for c in CASES if not given.scenes or any(part in c.name for part in given.scenes)]
    points: list[Point] = []
    for case in chosen:
        for found in points_of(case):
            points.append(found)
            if given.points:
                print(line(found), flush=True)
    for key in (lambda p: p.case, lambda p: p.method, lambda p: "all"):
        print(table(HEADER, rates(points, key)))
        print()
    if given.json:
        given.json.write_text(json.dumps([asdict(p) for p in points], indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
