"""The spin-up beam: published digits, its linear equation by other means, and EXUDYN's beams."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen import Solution
from tests.anchors import anchor
from tests.models.library import scene
from tests.oracles.exudyn_beams import spin_up
from tests.oracles.spin_up_beam import SET_A, SET_B, simulate

FOLDER = Path(__file__).parents[2] / "examples" / "spin_up_beam"
TIMES = np.linspace(1.0, 20.0, 39)


@cache
def run_of(name: str) -> Solution:
    run = eomgen.build(FOLDER / f"{name}.toml").simulate()
    assert run.success or name == "without_stiffening", run.message
    return run


def tip_at(run: Solution, times: np.ndarray) -> np.ndarray:
    rows = np.rint(times / 1e-3).astype(int)
    np.testing.assert_allclose(run.t[rows], times, atol=1e-9)
    return run.outputs["tip_deflection"][rows]


@pytest.mark.slow
def test_set_a_has_the_published_peak_and_vibration() -> None:
    run = run_of("scene")
    tip = run.outputs["tip_deflection"]
    assert tip.min() == pytest.approx(-0.5744, abs=1e-4)
    assert run.t[tip.argmin()] == pytest.approx(6.762, abs=2e-3)
    assert np.abs(tip[run.t > 15.0]).max() == pytest.approx(3.611e-3, rel=1e-3)
    anchor("spin_up_beam").check(tip_at(run, np.array([5.0, 7.5, 10.0])))


@pytest.mark.slow
@pytest.mark.long_cases("scene-beam0", "set_b-beam1")
@pytest.mark.parametrize(("name", "beam"), [("scene", SET_A), ("set_b", SET_B)])
def test_both_sets_follow_the_linear_equation(name: str, beam: object) -> None:
    exact = simulate(beam, 3).deflection(TIMES.tolist())  # type: ignore[arg-type]  # a Beam
    assert np.abs(tip_at(run_of(name), TIMES) - exact).max() < 2e-6


@pytest.mark.slow
def test_stretch_is_that_of_a_turning_rod_and_changes_bending_little() -> None:
    run = run_of("with_stretch")
    mean = run.outputs["tip_elongation"][run.t > 16.0].mean()
    assert mean == pytest.approx(1.2 * 6.0**2 * 10.0**3 / (3 * 2.8e7), rel=1e-3)
    softened = np.sqrt(1.2 * 6.0**2 / 2.8e7)
    assert mean == pytest.approx(np.tan(softened * 10.0) / softened - 10.0, rel=3e-5)
    change = run.outputs["tip_deflection"] - run_of("scene").outputs["tip_deflection"]
    assert 1e-5 < np.abs(change).max() < 3e-4


@pytest.mark.slow
def test_without_stiffening_it_runs_away_as_its_equation_says() -> None:
    run = run_of("without_stiffening")
    assert not run.success and "but the beam blade bends by slopes of 1.09e+04" in run.message
    tip = run.outputs["tip_deflection"]
    assert run.t[np.abs(tip) > 10.0][0] < 10.0
    exact = simulate(SET_A, 3, end=12.0, stiffening=False).deflection([5.0, 10.0, 12.0])
    np.testing.assert_allclose(tip_at(run, np.array([5.0, 10.0, 12.0])), exact, rtol=1e-3)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # EXUDYN renames settings with each version
def test_geometrically_exact_beams_of_exudyn_agree_to_a_millimetre() -> None:
    coarse, fine = spin_up(SET_A, 8), spin_up(SET_A, 16)
    limit = fine.position[:, 1] + (fine.position[:, 1] - coarse.position[:, 1]) / 3
    assert limit.min() == pytest.approx(run_of("scene").outputs["tip_deflection"].min(), abs=3e-4)
    assert np.abs(tip_at(run_of("scene"), fine.t.round(3)) - limit).max() < 1e-3


@pytest.mark.long
def test_our_geometrically_exact_beams_go_where_exudyns_are() -> None:
    times = np.linspace(1.0, 18.0, 341)
    tips = []
    for elements in (8, 16):
        run = eomgen.build(scene("spin_up_beam/exact", beams__blade__elements=elements)).simulate(18.0)
        tips.append(run.outputs["tip_deflection"][np.rint(times / 1e-2).astype(int)])
    theirs = spin_up(SET_A, 16, steps=7200).at(times)[:, 1]
    assert np.abs((4.0 * tips[1] - tips[0]) / 3.0 - theirs).max() < 4e-4
    assert np.abs(tips[1] - theirs).max() < 2e-3
