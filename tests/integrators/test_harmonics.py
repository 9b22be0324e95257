"""Inputs that are sums of harmonics, block by block on the grid of the steps: against their sums in extended precision,
and the same bits whatever the workspace holds."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import eomgen
from eomgen.base.random_inputs import road_harmonics
from eomgen.integrators.harmonics import LEAST, PAIRS, harmonics_data
from eomgen.pipeline.model import Model

#: Speed, seed and distance behind the first wheel: five inputs share frequencies, which is more than are summed side by
#: side, and one has its own.
ROADS = ((15.0, 3, 0.0), (15.0, 3, 2.6), (15.0, 4, 0.0), (15.0, 4, 2.6), (15.0, 5, 0.0), (22.0, 3, 0.0))
HARMONICS = 30  # no multiple of what C takes at a time
STEP = 2e-3


def scene(*, formula: str | None = None, harmonics: int = HARMONICS) -> eomgen.Scene:
    """Return unit masses on rails, each with an input as its force: accelerations are the inputs."""
    builder = eomgen.SceneBuilder("masses", gravity=[0, 0, 0])
    for number, (speed, seed, offset) in enumerate(ROADS):
        road = {"class": "C", "speed": speed, "seed": seed, "offset": offset, "harmonics": harmonics}
        builder.input(f"u{number}", road=road, formula=formula)
        builder.body(f"mass{number}", 1.0)
        builder.joint(f"rail{number}", "prismatic", "base", f"mass{number}", axis=[0, 0, 1])
        builder.effort(f"force{number}", f"rail{number}", effort=f"u{number}")
    return builder.build()


@cache
def model() -> Model:
    return eomgen.build(scene())


def sums(times: np.ndarray, harmonics: int = HARMONICS) -> np.ndarray:
    """Return the inputs at times (n,) in extended precision, (n, inputs)."""
    t = times.astype(np.longdouble)[:, None]
    columns = []
    for speed, seed, offset in ROADS:
        a, w, phase = np.array(road_harmonics("C", speed, seed=seed, offset=offset, harmonics=harmonics)).T
        columns.append(np.sum(a * np.cos(w.astype(np.longdouble) * t + phase), axis=1))
    return np.stack(columns, axis=1).astype(float)


@pytest.mark.slow_cases("0.0")
@pytest.mark.parametrize("start", [0.0, 3.7, -1.2345])
def test_accelerations_are_the_sums_at_the_times_of_the_grid(start: float) -> None:
    run = model().simulate(start + 0.3, STEP, t_start=start, error_estimate=False)
    wanted = sums(run.t)
    assert len(run.t) == 151 and np.abs(wanted).max() > 1e-3
    np.testing.assert_allclose(run.a[1:], wanted[1:], rtol=0, atol=5e-14 * np.abs(wanted).max())


@pytest.mark.parametrize("step", [STEP / 3, 7 * STEP])
def test_other_steps_have_turns_of_their_own(step: float) -> None:
    run = model().simulate(50 * step, step, error_estimate=False)
    wanted = sums(run.t)
    np.testing.assert_allclose(run.a[1:], wanted[1:], rtol=0, atol=5e-14 * np.abs(wanted).max())


def test_a_state_at_another_time_begins_another_block() -> None:
    run = model().start(step=STEP)
    for t, counts in ((0.0, (1,)), (5.0, (1, 2 * PAIRS - 2, 1, 1, 3, 80)), (0.5 * STEP, (80,)), (0.0, (80,))):
        run.set_state(t=t)
        for count in counts:
            run.step(n=count)
            wanted = sums(np.array([run.t]))[0]
            np.testing.assert_allclose(run.a, wanted, rtol=0, atol=1e-15)


def test_a_run_in_pieces_has_the_bits_of_the_whole() -> None:
    whole, pieces = model().start(step=STEP), model().start(step=STEP)
    whole.step(n=100)
    for count in (1, 2 * PAIRS - 2, 1, 1, 3, 80):
        pieces.step(n=count)
        pieces = pieces.copy()
    np.testing.assert_array_equal(whole.q, pieces.q)
    np.testing.assert_array_equal(whole.a, pieces.a)


def test_few_harmonics_and_other_inputs_are_evaluated_one_by_one() -> None:
    assert harmonics_data(eomgen.derive(scene())) is not None
    for other in (scene(harmonics=LEAST - 1), scene(formula="sin(t)")):
        assert harmonics_data(eomgen.derive(other)) is None
