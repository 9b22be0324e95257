"""FORM and SORM of OpenTURNS, by finite differences, beside `eomgen random` on the same runs of an oscillator.

    python -m benchmarks.random_vibration_peers [--samples 200000] [--quick]

q'' + 0.2 q' + q + 0.1 q^3 = 0.5 (1 + 0.3 g)^2, covariance of g exp(-tau^2 / 2) by 21 modes, from rest, q at 15 s. Both
take the model's own runs, OpenTURNS through a function in Python. Probabilities are held against samples; counted are
runs of the model, and adjoint runs and tangents; times are user times of the process, without the build. Needs
OpenTURNS (the extra `bench`).
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

import eomgen
from benchmarks.sensitivities import seconds
from eomgen.base.arrays import Array
from eomgen.pipeline.model import Model
from eomgen.products.reliability.tails.distribution import steepest_descent
from eomgen.products.reliability.tails.most_probable_point import points_on_curve
from eomgen.products.reliability.vibration.run_response import RunResponse

#: About the quantiles from 0.001 to 0.999.
THRESHOLDS = (-1.0978, -0.7159, -0.1798, 1.1862, 1.7565, 2.1683)
#: Thresholds of a whole distribution.
CURVE = 40
#: Standard normal variables of the process.
VARIABLES = 21


@dataclass(frozen=True)
class Peer:
    """What OpenTURNS finds at one threshold: P(q <= threshold) by FORM and by SORM (Breitung), and its runs."""

    form: float
    sorm: float
    runs: int


def oscillator() -> Model:
    builder = eomgen.SceneBuilder("duffing", gravity=[0, 0, 0])
    builder.parameter("cubic", 0.1, tunable=True)
    builder.random(
        "force",
        "squared_exponential",
        correlation_time="1 s",
        modes=VARIABLES,
        translation="0.5 * (1 + 0.3 * g)**2",
        unit="N",
    )
    builder.body("mass", 1.0)
    builder.joint("slide", "prismatic", "base", "mass", axis=[1, 0, 0], initial={"position": 0.488353313})
    builder.effort("all", joint="slide", effort="force - q.slide - cubic * q.slide**3 - 0.2 * v.slide")
    builder.output("q", formula="q.slide", unit="m").simulation(method="trapezoidal", step=0.05, duration=15.0)
    return eomgen.build(builder.build())


def displacement(model: Model, points: Array) -> Array:
    """Return q (m,) at 15 s at points (m, 21)."""
    table = {f"force_z{k}": column for k, column in enumerate(points.T, 1)}
    return np.asarray(model.simulate_many(table=table, columns=["output.q"], points=2).results["output.q.final"])


def peer(model: Model, threshold: float, median: float) -> Peer:
    """Return what OpenTURNS finds at a threshold, by Abdo and Rackwitz's search from the mean."""
    openturns: Any = importlib.import_module("openturns")
    runs = 0

    def sample(points: object) -> Array:
        nonlocal runs
        at = np.array(points)
        runs += len(at)
        return displacement(model, at)[:, None]

    function = openturns.PythonFunction(VARIABLES, 1, func_sample=sample)
    vector = openturns.CompositeRandomVector(function, openturns.RandomVector(openturns.Normal(VARIABLES)))
    below = threshold < median
    event = openturns.ThresholdEvent(vector, openturns.Less() if below else openturns.Greater(), threshold)
    search = openturns.AbdoRackwitz()
    search.setStartingPoint([0.0] * VARIABLES)
    search.setMaximumCallsNumber(100_000)
    algorithm = openturns.SORM(search, event)
    algorithm.run()
    found = algorithm.getResult()
    form = openturns.Normal().computeComplementaryCDF(found.getHasoferReliabilityIndex())
    sorm = found.getEventProbabilityBreitung()
    return Peer(form, sorm, runs) if below else Peer(1.0 - form, 1.0 - sorm, runs)


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--samples", type=int, default=200_000)
    parser.add_argument("--quick", action="store_true", help="one threshold, a thousand samples, no times")
    given = parser.parse_args(words)
    if importlib.util.find_spec("openturns") is None:
        print("OpenTURNS is not there: pip install 'eomgen[bench]'")
        return 0
    thresholds = THRESHOLDS[3:4] if given.quick else THRESHOLDS
    model = oscillator()
    y = displacement(
        model, np.random.default_rng(1).standard_normal((1000 if given.quick else given.samples, VARIABLES))
    )
    counted = np.array([float(np.mean(y <= threshold)) for threshold in thresholds])
    peers: list[Peer] = []
    studies: list[eomgen.RandomVibration] = []
    eomgen.random_vibration(model, "q", thresholds=thresholds[:1])  # compiles what derivatives need
    median = float(np.median(y))
    of_peers = seconds(lambda: peers.extend(peer(model, threshold, median) for threshold in thresholds))
    own = seconds(lambda: studies.append(eomgen.random_vibration(model, "q", thresholds=thresholds)))
    (found,) = studies
    print(f"{'y':>8} {'samples':>10} | {'FORM':>9} {'SORM':>9} {'runs':>6} | {'form':>9} {'quadratic':>9}")
    form, quadratic = (found.distributions[name].below for name in ("form", "quadratic"))
    for k, threshold in enumerate(thresholds):
        one = peers[k]
        cells = f"{one.form:9.5f} {one.sorm:9.5f} {one.runs:6d} | {form[k]:9.5f} {quadratic[k]:9.5f}"
        print(f"{threshold:8.4f} {counted[k]:10.5f} | {cells}")
    print("largest error of the CDF")
    for name, values in (
        ("OpenTURNS FORM", [one.form for one in peers]),
        ("OpenTURNS SORM", [one.sorm for one in peers]),
        ("eomgen form", form),
        ("eomgen quadratic", quadratic),
    ):
        print(f"  {name:<17} {float(np.max(np.abs(np.array(values) - counted))):.5f}")
    print(f"OpenTURNS: {sum(one.runs for one in peers)} runs{'' if given.quick else f', {of_peers:.1f} s'}")
    cost = found.costs["most_probable_points"]
    checks = sum(one.runs for name, one in found.costs.items() if name != "most_probable_points")
    print(
        f"eomgen: {cost.runs} runs, {cost.adjoints} adjoint runs, {cost.tangents} tangents, and {checks} runs to check"
        f"{'' if given.quick else f', {own:.1f} s'}"
    )
    if not given.quick:
        cost, least = whole_curve(model)
        print(
            f"{CURVE} thresholds from 0.001 to 0.999: {cost[0]} runs, {cost[1]} adjoint runs, {cost[2]} tangents,"
            f" {least:.2f} s, the least of 7"
        )
    return 0


def whole_curve(model: Model) -> tuple[tuple[int, int, int], float]:
    """Return what the distribution at many thresholds costs: runs, adjoint runs and tangents, and its user time."""
    thresholds = 0.4999 + 0.5333 * special.ndtri(np.linspace(1e-3, 0.999, CURVE))
    variables, span, spent, times = [f"force_z{k}" for k in range(1, VARIABLES + 1)], (15.0, 0.05), (0, 0, 0), []

    def found() -> None:
        nonlocal spent
        response = RunResponse(model, variables, "q", span, {})
        points, _ = points_on_curve(response, list(thresholds))
        ordered = [points[k] for k in sorted(points)]
        steepest_descent([point.form for point in ordered], [point.threshold for point in ordered])
        spent = response.costs

    for _ in range(7):
        times.append(seconds(found))
    return spent, min(times)


if __name__ == "__main__":
    sys.exit(main())
