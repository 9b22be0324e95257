"""Stated against true errors of runs; ``python -m tests.simulation.stated_errors`` prints the table.

References are SciPy's DOP853 at 1e-12 on the equations as they stand here, not on those that eomgen derives.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

import eomgen
from eomgen.arrays import Array

#: Rates of (q, v, z) by time.
Rates = Callable[[float, Array], list[float]]


class Case(NamedTuple):
    """A scene of sliders and hinges: its dictionary, its rates, its duration, times between which rates are smooth, and
    the steps of its runs."""

    name: str
    scene: dict[str, Any]
    rates: Rates
    duration: float
    breaks: tuple[float, ...]
    steps: tuple[float, ...]


def sliders(name: str, efforts: dict[str, str], start: dict[str, tuple[float, float]], **more: Any) -> dict[str, Any]:
    """Return a scene of unit masses on perpendicular rails, pushed by formulas."""
    axes = dict(zip(start, ([1, 0, 0], [0, 1, 0], [0, 0, 1]), strict=False))
    joints = {
        joint: {
            "type": "prismatic", "parent": "base", "child": f"mass_{joint}", "axis": axes[joint],
            "initial": {"position": q, "velocity": v},
        }
        for joint, (q, v) in start.items()
    }  # fmt: skip
    return {
        "format": 1, "name": name, "gravity": [0, 0, 0],
        "bodies": {f"mass_{joint}": {"mass": 1.0} for joint in start}, "joints": joints,
        "efforts": {f"on_{joint}": {"joint": joint, "effort": text} for joint, text in efforts.items()}, **more,
    }  # fmt: skip


def _spring(t: float, y: Array) -> list[float]:
    return [y[1], -100.0 * y[0]]


def _damped(t: float, y: Array) -> list[float]:
    return [y[1], -100.0 * y[0] - 3.0 * y[1] + 5.0 * math.cos(7.0 * t)]


def _van_der_pol(t: float, y: Array) -> list[float]:
    return [y[1], 5.0 * (1.0 - y[0] ** 2) * y[1] - y[0]]


def _duffing(t: float, y: Array) -> list[float]:
    return [y[1], y[0] - y[0] ** 3 - 0.2 * y[1] + 0.3 * math.cos(1.2 * t)]


def _kepler(t: float, y: Array) -> list[float]:
    cube = (y[0] ** 2 + y[1] ** 2) ** 1.5
    return [y[2], y[3], -y[0] / cube, -y[1] / cube]


def _filtered(t: float, y: Array) -> list[float]:
    return [y[1], -40.0 * y[0] + 4.0 * y[2], -(y[2] - math.sin(3.0 * t)) / 0.02]


def _integrating(t: float, y: Array) -> list[float]:
    return [y[1], 30.0 * (1.0 - y[0]) - 4.0 * y[1] + 20.0 * y[2], 1.0 - y[0]]


def _floor(t: float, y: Array) -> list[float]:
    return [y[1], -9.81 + (2e3 * max(-y[0], 0.0))]


def _table(t: float, y: Array) -> list[float]:
    return [y[1], -25.0 * y[0] + float(np.interp(t, [0.0, 0.5, 0.9, 1.4, 2.0], [0.0, 3.0, -2.0, 4.0, 0.0]))]


def _pendulum(t: float, y: Array) -> list[float]:
    return [y[1], -9.81 * 0.5 / (0.25 + 1e-9) * math.sin(y[0])]


def _beam(t: float, y: Array) -> list[float]:
    """First two bending modes of a cantilever of unit modal masses, beside one another."""
    return [y[2], y[3], -400.0 * y[0], -15700.0 * y[1]]


POINTS = {"points": [[0, 0], [0.5, 3], [0.9, -2], [1.4, 4], [2.0, 0]], "interpolation": "linear"}
PENDULUM = {
    "format": 1, "name": "swing", "gravity": [0, 0, -9.81],
    "bodies": {"bob": {"mass": 1.0, "center_of_mass": [0, 0, -0.5], "inertia": [1e-9, 1e-9, 1e-9]}},
    "joints": {"hinge": {
        "type": "revolute", "parent": "base", "child": "bob", "axis": [0, -1, 0], "initial": {"position": 2.0},
    }},
}  # fmt: skip

CASES = (
    Case("spring", sliders("spring", {"x": "-100*q.x"}, {"x": (0.1, 0.0)}), _spring, 5.0, (), (0.02, 0.005)),
    Case("damped, driven", sliders("damped", {"x": "-100*q.x - 3*v.x + 5*cos(7*t)"}, {"x": (0.1, 0.0)}),
         _damped, 5.0, (), (0.02, 0.005)),
    Case("van der Pol", sliders("pol", {"x": "5*(1-q.x**2)*v.x - q.x"}, {"x": (2.0, 0.0)}),
         _van_der_pol, 10.0, (), (0.02, 0.005)),
    Case("Duffing", sliders("duffing", {"x": "q.x - q.x**3 - 0.2*v.x + 0.3*cos(1.2*t)"}, {"x": (0.5, 0.0)}),
         _duffing, 15.0, (), (0.05, 0.01)),
    Case("Kepler 0.5", sliders(
        "kepler", {axis: f"-q.{axis}/(q.x**2+q.y**2)**1.5" for axis in "xy"},
        {"x": (0.5, 0.0), "y": (0.0, math.sqrt(3))}),
        _kepler, 13.0, (), (0.02, 0.005)),
    Case("filtered force", sliders("filtered", {"x": "-40*q.x + 4*lag"}, {"x": (0.1, 0.0)},
                                   states={"lag": {"rate": "-(lag - sin(3*t))/0.02"}}),
         _filtered, 4.0, (), (0.01, 0.002)),
    Case("PI control", sliders("servo", {"x": "30*(1-q.x) - 4*v.x + 20*sum"}, {"x": (0.0, 0.0)},
                               states={"sum": {"rate": "1-q.x"}}),
         _integrating, 4.0, (), (0.02, 0.005)),
    Case("contact", sliders("contact", {"x": "-9.81 + 2000*max(-q.x, 0)"}, {"x": (0.3, 0.0)}),
         _floor, 1.2, (), (0.004, 0.001)),
    Case("linear table", sliders("table", {"x": "-25*q.x + push"}, {"x": (0.1, 0.0)}, inputs={"push": POINTS}),
         _table, 2.0, (0.5, 0.9, 1.4), (0.02, 0.005)),
    Case("pendulum", PENDULUM, _pendulum, 5.0, (), (0.02, 0.005)),
    Case("two modes", sliders("modes", {"x": "-400*q.x", "y": "-15700*q.y"}, {"x": (0.1, 0.0), "y": (0.01, 0.0)}),
         _beam, 1.0, (), (0.004, 0.001)),
    Case("three steps", sliders("short", {"x": "-100*q.x"}, {"x": (0.1, 0.0)}), _spring, 0.06, (), (0.02,)),
)  # fmt: skip  # a table
METHODS: tuple[tuple[str, dict[str, float]], ...] = (
    ("generalized_alpha", {}), ("rk4", {}), ("rk45", {"tolerance": 1e-5}),
    ("generalized_alpha", {"tolerance": 1e-5}),
)  # fmt: skip  # two lines


class Row(NamedTuple):
    """A run: the stated error over the true one, the true error as a part of the motion, and names of its findings."""

    case: str
    method: str
    step: float
    stated: float
    true: float
    share: float
    findings: tuple[str, ...]

    @property
    def ratio(self) -> float:
        return self.stated / self.true

    @property
    def counted(self) -> bool:
        """Whether the error is neither rounding nor all of the motion."""
        return 1e-9 < self.share < 0.5

    def __str__(self) -> str:
        method = f"{self.case:16} {self.method:28} {self.step:<6g}"
        return (
            f"{method} {self.stated:9.2e} {self.true:9.2e} {self.ratio:7.2f} {100 * self.share:8.2g} %  "
            + ", ".join(self.findings)
        )


@cache
def model_of(name: str) -> eomgen.Model:
    case = next(case for case in CASES if case.name == name)
    return eomgen.build(case.scene, profile="quick")


def exact(case: Case, start: Array, times: Array) -> Array:
    """Return (q, v, z) at times, (n, size), by smooth pieces."""
    found = np.empty((len(times), len(start)))
    edges = [0.0, *case.breaks, case.duration + 1e-12]
    state = start
    for begin, end in pairwise(edges):
        piece = solve_ivp(case.rates, (begin, end), state, "DOP853", rtol=1e-12, atol=1e-14, dense_output=True,
                          max_step=0.01)  # fmt: skip
        here = (times >= begin - 1e-12) & (times <= end)
        found[here] = piece.sol(times[here]).T
        state = piece.y[:, -1]
    return found


def rows() -> Iterator[Row]:
    """Yield all runs of the table."""
    for case in CASES:
        model = model_of(case.name)
        for method, options in METHODS:
            for step in case.steps[: 1 if options else None]:
                run = model.simulate(case.duration, step, method=method, **options)
                label = f"{method}{' ' if options else ''}{options.get('tolerance', '')}"
                if not run.error.available:
                    yield Row(case.name, label, step, math.nan, math.nan, 0.0, tuple(one.name for one in run.findings))
                    continue
                times = run.error.t
                start = np.concatenate([run.q[0], run.v[0], run.z[0]])
                reference = exact(case, start, times)
                places = np.searchsorted(run.t, times - 1e-9)
                motion = np.hstack([run.q[places], run.z[places]])
                right = np.hstack([reference[:, : model.nq], reference[:, 2 * model.nq :]])
                off, size = np.abs(motion - right).max(axis=0), np.ptp(right, axis=0)
                worst = int(np.argmax(off / size))
                stated = np.concatenate([run.error.increment, run.error.z])[worst]
                share = float(off[worst] / size[worst])
                names = tuple(finding.name for finding in run.findings)
                yield Row(case.name, label, step, float(stated), float(off[worst]), share, names)


def main() -> None:
    found = []
    for row in rows():
        found.append(row)
        print(row, flush=True)
    counted = [row for row in found if row.counted]
    near = sum(1 / 3 <= row.ratio <= 3 for row in counted)
    silent = [row for row in counted if row.ratio < 1 / 3 and not row.findings]
    print(
        f"{len(found)} runs, {len(counted)} counted, {near} within 3, {len(silent)} understated by more than 3 silently"
    )


if __name__ == "__main__":
    sys.exit(main())
