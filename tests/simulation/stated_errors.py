"""Stated against true errors of runs.

References are SciPy's DOP853 at 1e-12 on the equations as they stand in ``stated_scenes``, on ``Model.rhs`` if there
are none; ``rk4_partitioned`` at a sixteenth of the step for closed loops, and generalized-alpha at a sixty-fourth,
whose own error is 1/4096, for absolute coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

import eomgen
from eomgen.base.arrays import Array
from tests.simulation.stated_scenes import CASES, SAMPLED, Case, Rates, SampledCase

#: Parts of a step in references of closed loops, and of absolute coordinates.
_FINE, _FINEST = 16, 64


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
        return 1e-9 < self.share < 0.5 and not math.isnan(self.stated)

    @property
    def near(self) -> bool:
        """Whether the stated error is within a factor of three of the true one."""
        return 1 / 3 <= self.ratio <= 3

    @property
    def understated(self) -> bool:
        """Whether the stated error is less than a third of the true one, and no finding says so."""
        return self.counted and self.ratio < 1 / 3 and not self.findings

    @property
    def wrong(self) -> bool:
        """Whether the error is more than a tenth of the motion, and no finding says so."""
        return self.share > 0.1 and not self.findings

    def __str__(self) -> str:
        method = f"{self.case:26} {self.method:28} {self.step:<6g}"
        return (
            f"{method} {self.stated:9.2e} {self.true:9.2e} {self.ratio:7.2f} {100 * self.share:8.2g} %  "
            + ", ".join(self.findings)
        )


@cache
def model_of(name: str) -> eomgen.Model:
    case = next(case for case in (*CASES, *SAMPLED) if case.name == name)
    return eomgen.build(case.scene, profile="quick")


def exact(rates: Rates, edges: Sequence[float], start: Array, times: Array) -> Array:
    """Return (q, v, z) at times, (n, size), by pieces between edges that are smooth."""
    found = np.empty((len(times), len(start)))
    state = start
    for begin, end in pairwise(edges):
        piece = solve_ivp(rates, (begin, end), state, "DOP853", rtol=1e-12, atol=1e-14, dense_output=True,
                          max_step=0.01 if end - begin > 0.1 else np.inf)  # fmt: skip
        here = (times >= begin - 1e-12) & (times <= end)
        found[here] = piece.sol(times[here]).T
        state = piece.y[:, -1]
    return found


def reference(case: Case, model: eomgen.Model, run: eomgen.Solution, step: float) -> Array:
    """Return q and z, (n, nq + nz), at the rows that the estimate compares."""
    times = run.error.t
    if case.rates is None and model.multipliers:
        absolute = model.nq > model.nv
        method, parts = ("generalized_alpha", _FINEST) if absolute else ("rk4_partitioned", _FINE)
        fine = model.simulate(case.duration, step / parts, method=method, error_estimate=False)
        assert fine.success, fine.message
        places = np.searchsorted(fine.t, times - 1e-9)
        return np.hstack([fine.q[places], fine.z[places]])
    start = np.concatenate([run.q[0], run.v[0], run.z[0]])
    found = exact(case.rates or model.rhs, [0.0, *case.breaks, case.duration + 1e-12], start, times)
    return np.hstack([found[:, : model.nq], found[:, model.nq + model.nv :]])


def rows() -> Iterator[Row]:
    """Yield all runs of the table."""
    for case in CASES:
        for method, options in case.methods:
            for step in case.steps[: 1 if options else None]:
                yield _row(case, method, options, step)
    yield from map(_sampled, SAMPLED)


def _row(case: Case, method: str, options: Mapping[str, float], step: float) -> Row:
    model = model_of(case.name)
    run = model.simulate(case.duration, step, method=method, **options)
    label = f"{method}{' ' if options else ''}{options.get('tolerance', '')}"
    names = tuple(finding.name for finding in run.findings)
    if not run.error.available:
        return Row(case.name, label, step, math.nan, math.nan, 0.0, names)
    right = reference(case, model, run, step)
    places = np.searchsorted(run.t, run.error.t - 1e-9)
    motion = np.hstack([run.q[places], run.z[places]])
    off, size = np.abs(motion - right).max(axis=0), np.ptp(right, axis=0)
    size = np.maximum(size, 1e-3 * size.max())
    worst = int(np.argmax(off / size))
    stated = np.concatenate([run.error.q, run.error.z])[worst]
    return Row(case.name, label, step, float(stated), float(off[worst]), float(off[worst] / size[worst]), names)


def _sampled(case: SampledCase) -> Row:
    """Return the stated error of an ensemble against the largest one of the runs that are examined."""
    model = model_of(case.name)
    found = model.simulate_many(
        case.duration, case.step, method="generalized_alpha", vary={"k": case.values}, samples=16
    )
    true, size = 0.0, 0.0
    for k in (float(model.parameter_array()[0]), *(found.values["k"][number] for number in found.error.of_samples)):
        run = model.simulate(
            case.duration, case.step, method="generalized_alpha", parameters={"k": k}, error_estimate=False
        )
        right = exact(case.rates(k), [0.0, case.duration + 1e-12], np.array([run.q[0, 0], run.v[0, 0]]), run.t)[:, 0]
        true, size = max(true, float(np.abs(run.q[:, 0] - right).max())), max(size, float(np.ptp(right)))
    said = ("discretisation_error",) if "; try: a step" in str(found.error) else ()
    return Row(case.name, "generalized_alpha", case.step, found.error.columns["output.x"], true, true / size, said)
