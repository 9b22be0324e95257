"""Runs that violate a constraint by a share of the machine say so, or fail."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.simulation.judgement.invariants import largest_violation

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def four_bar() -> eomgen.Model:
    return eomgen.build(EXAMPLES / "four_bar" / "scene.toml")


def test_the_row_the_time_and_the_size_are_named(four_bar: eomgen.Model) -> None:
    run = four_bar.simulate(0.1, 1e-3)
    p = four_bar.parameter_array({})
    assert largest_violation(four_bar, run.t, run.q, p) is None
    q = run.q.copy()
    q[70, 2] += 1e-4
    found = largest_violation(four_bar, run.t, q, p)
    violation = np.abs(next(iter(four_bar.evaluate("constraint", q[70], t=run.t[70]).values())))
    worst = int(np.argmax(violation))
    assert found is not None
    assert (
        found.text == f"the constraint {four_bar.multipliers[worst]} is off by {violation[worst]:.3g} m at t = 0.07 s"
    )
    assert violation[worst] / 2.0 < found.share < violation[worst] / 0.05  # links of 0.05 to 2 m


def test_iterations_that_end_too_early_are_doubted_and_worse_ones_fail(four_bar: eomgen.Model) -> None:
    start = {"q": four_bar.initial_q, "v": four_bar.initial_v}  # on the constraints
    tight, loose, wrong = (
        four_bar.simulate(0.1, 5e-3, initial=start, settings={"rtol": tolerance, "atol": tolerance})
        for tolerance in (1e-12, 0.01, 0.3)
    )
    assert tight.message == "reached t = 0.1 s in 20 steps"
    off = r"the constraint rocker_pin: origins meet along [xyz] is off by \S+ m at t = \S+ s"
    assert loose.success
    assert re.fullmatch(f"reached t = 0.1 s in 20 steps; {off}; try: a step smaller than 0.005 s", loose.message)
    assert not wrong.success
    doing = "more than 0.001 of the size of the machine, or rad; try: a smaller step"
    assert re.fullmatch(f"reached t = 0.1 s in 20 steps, but {off}, {doing}", wrong.message)
