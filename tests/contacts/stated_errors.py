"""``python -m tests.contacts.stated_errors [WORD]``: stated against true errors of scenes with contact and friction.

References are SciPy's DOP853 at 1e-12 on rates by hand, or on ``Model.rhs``, and ``rk45_partitioned`` at 1e-11 for the
closed loop. Every scene runs in two steps and at two tolerances, by implicit and explicit methods. ``WORD`` chooses
scenes by a part of the name.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from scipy.integrate import solve_ivp

import eomgen
from eomgen.simulation.accuracy.motion_size import differences_of, motion_size, shares
from tests.contacts.stated_scenes import CASES, Case
from tests.oracles.evaluation import Array
from tests.simulation.stated_errors import Row

STEPS, TOLERANCES = (1.0, 0.25), (1e-4, 1e-6)
FIXED, ADAPTIVE = ("generalized_alpha", "rk4"), ("generalized_alpha", "rk45")
OF_LOOPS = {"rk4": "rk4_partitioned", "rk45": "rk45_partitioned"}


def reference(case: Case, model: eomgen.Model) -> Callable[[Array], Array]:
    """Return the function from times (n,) to q, v, z there, (n, nq + nv + nz); of a loop, times of a fourth of the
    step."""
    if model.multipliers:
        fine = model.simulate(case.duration, case.step / 4, method="rk45_partitioned", tolerance=1e-11,
                              error_estimate=False)  # fmt: skip
        assert fine.success, fine.message
        rows = np.hstack([fine.q, fine.v, fine.z])
        return lambda times: rows[np.searchsorted(fine.t, times - 1e-9)]
    start = model.simulate(0.0, case.step, method="rk4", error_estimate=False)
    state = np.concatenate([start.q[0], start.v[0], start.z[0]])
    limits = {"rtol": 1e-12, "atol": 1e-14, "max_step": case.step, "dense_output": True}
    found = solve_ivp(case.rates or model.rhs, (0.0, case.duration + case.step), state, "DOP853", **limits)
    assert found.success, found.message
    return lambda times: found.sol(times).T


def rows_of(case: Case) -> Iterator[Row]:
    """Yield the runs of a case."""
    model = eomgen.build(case.scene, profile="quick")
    known = reference(case, model)
    for part in STEPS:
        yield from (row_of(case, model, known, method, step=part * case.step) for method in FIXED)
    for tolerance in TOLERANCES:
        yield from (row_of(case, model, known, method, tolerance=tolerance) for method in ADAPTIVE)


def row_of(case: Case, model: eomgen.Model, known: Callable[[Array], Array], method: str, **setting: float) -> Row:
    method = OF_LOOPS.get(method, method) if model.multipliers else method
    options = {"step": case.step, **setting}
    run = model.simulate(case.duration, method=method, **options)
    names, label = tuple(finding.name for finding in run.findings), f"{method}{' tol' * ('tolerance' in setting)}"
    (value,) = setting.values()
    if len(run.t) < 2 or run.t[-1] < case.duration * (1 - 1e-9) or not run.error.available:
        return Row(case.name, label, value, np.nan, np.nan, 1.0, names)
    times = run.error.t
    right = known(times)
    places = np.searchsorted(run.t, times - 1e-6 * case.step)
    parts = [model.nq, model.nq + model.nv]
    ours = dict(zip("qvz", (run.q[places], run.v[places], run.z[places]), strict=True))
    theirs = dict(zip("qvz", np.split(right, parts, axis=1), strict=True))
    none = {"multipliers": np.zeros((len(places), 0))}
    off = differences_of(model.factors, {**ours, **none}, {**theirs, **none}, ({}, {}))
    rest = [run.a[places], run.multipliers[places]]
    size = motion_size(model, np.hstack([times[:, np.newaxis], theirs["q"], theirs["v"], *rest, theirs["z"]]), {})
    share = shares(off, size).max(axis=0)
    worst = int(np.argmax(share))
    true = np.hstack([off["increment"], off["z"]])[:, worst].max()
    stated = np.concatenate([run.error.increment, run.error.z])[worst]
    return Row(case.name, label, value, float(stated), float(true), float(share[worst]), names)


def counts(found: Sequence[Row]) -> str:
    """Return how many runs and scenes are within 3, wrong without a word, and told although right."""
    counted = [row for row in found if row.counted]
    poor = [row for row in counted if not row.near]
    scenes, bad = {row.case for row in counted}, {row.case for row in poor}
    within = f"{len(counted) - len(poor)} of {len(counted)} runs, {len(scenes - bad)} of {len(scenes)} scenes within 3"
    told = sum(bool(row.findings) and row.share < 0.01 for row in found)
    return f"{within}\nwrong and silent: {sum(row.wrong for row in found)}\ntold and right: {told}"


def main(words: list[str]) -> int:
    """Print the table of the cases whose names contain all words."""
    found: list[Row] = []
    for case in CASES:
        if all(word in case.name for word in words):
            for row in rows_of(case):
                found.append(row)
                print(row, "" if row.near or not row.counted else "<<<", flush=True)
    print(counts(found))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
