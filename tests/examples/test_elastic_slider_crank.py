"""The elastic slider-crank: published digits in both variants, two ways to close the loop, order, and a ladder of
stiffness."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen import Model, Solution
from tests.anchors import anchor
from tests.oracles.elastic_crank import Crank
from tests.oracles.test_elastic_crank import SAMPLES, TIMES

pytestmark = pytest.mark.slow

FOLDER = Path(__file__).parents[2] / "examples" / "elastic_slider_crank"
PUBLISHED = {"stretch_inertia": 15.0}


@pytest.fixture(scope="module")
def model() -> Model:
    return eomgen.build(FOLDER / "scene.toml")


def elastic(run: Solution) -> np.ndarray:
    return np.hstack([run.outputs["bending"], run.outputs["stretch"]])


@pytest.mark.long_cases("False-5e-07", "True-2e-06")
@pytest.mark.parametrize(("published", "step"), [(True, 2e-6), (False, 5e-7)])
def test_partitioned_coordinates_give_the_samples_of_both_variants(model: Model, published: bool, step: float) -> None:
    """The stretch of the consistent rod vibrates with 95 krad/s, and the steps must be fine enough for that."""
    parameters = PUBLISHED if published else None
    run = model.simulate(step=step, method="rk4_partitioned", parameters=parameters, record_every=round(0.02 / step))
    assert run.success and run.t[1:] == pytest.approx(TIMES)
    np.testing.assert_allclose(elastic(run)[1:], SAMPLES[published], rtol=1e-6)


@pytest.mark.long
def test_published_reference_is_met_in_all_positions_velocities_accelerations_and_multipliers(model: Model) -> None:
    run = model.simulate(step=1e-6, method="rk4_partitioned", parameters=PUBLISHED, record_every=100000)
    anchor("elastic_crank_positions").check([*run.outputs["angles"][-1], *np.ravel(run.outputs["slider"][-1])])
    v, a = run.v[-1], run.a[-1]
    anchor("elastic_crank_velocities").check([v[0], v[0] + v[1], *v[2:]])  # the rod turns relative to the crank
    second = [6488.737541276957, 33.91137060286523, 0.1715134772216488, -1.422449408912512, 1.003946428124810]
    assert a[1:] == pytest.approx([*second, 2167.938629509884], rel=1e-4)
    anchor("elastic_crank_multipliers").check(np.sort(np.abs(run.multipliers[-1])))


def test_mass_and_coupling_are_those_of_the_oracle(model: Model) -> None:
    """Published terms are in absolute angles; here the rod's angle is relative to the crank."""
    rng = np.random.default_rng(4)
    q, v = rng.uniform(-0.3, 0.3, 7), rng.normal(size=7)
    q[3:] *= 1e-3
    T = np.zeros((7, 7))  # ours: crank, rod against crank, q1 .. q4, slider; published: crank, rod, slider, q1 .. q4
    T[0, 0] = T[1, 0] = T[1, 1] = T[2, 6] = 1.0
    T[3:, 2:6] = np.eye(4)
    ours, rates = np.linalg.solve(T, q), np.linalg.solve(T, v)
    for published, close in ((False, 1e-14), (True, 2e-8)):  # pi as the programs write it makes the difference
        oracle = Crank(published=published)
        M, c = oracle.mass_and_coupling(q, v)
        parameters = PUBLISHED if published else None
        rounding = 2e-11  # of the published moment of inertia of the rod
        np.testing.assert_allclose(model.mass(ours, parameters=parameters), T.T @ M @ T, atol=max(close, rounding))
        np.testing.assert_allclose(model.coupling(ours, rates, parameters=parameters), T.T @ c, atol=close)


@cache
def end_states(method: str, steps: tuple[float, ...]) -> list[Solution]:
    """Return runs of 8 ms with a rod a hundred times softer, which steps of microseconds resolve."""
    model = eomgen.build(FOLDER / "scene.toml")
    softer = {"modulus": 0.2e10}
    return [
        model.simulate(8e-3, step, method=method, parameters=softer, record_every=round(8e-3 / step)) for step in steps
    ]


def test_multipliers_and_partitioned_coordinates_agree_to_the_order_of_the_first() -> None:
    coarse, fine = end_states("generalized_alpha", (4e-6, 2e-6))
    (exact,) = end_states("rk4_partitioned", (2e-6,))
    for name in ("q", "v", "multipliers"):
        wanted = getattr(exact, name)[-1]
        errors = [np.abs(getattr(run, name)[-1] - wanted).max() for run in (coarse, fine)]
        assert errors[1] < 2e-3 * np.abs(wanted).max()
        assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("method", ["generalized_alpha", "generalized_alpha_index3"])
def test_ladder_of_stiffness_ends_at_the_rigid_mechanism(model: Model, method: str) -> None:
    """From a start on the slow motion, the rod stretched as its forces say, in steps in which the crank turns 8.6
    degrees."""
    away = []
    for decade in range(9):
        factor = 10.0**decade
        end = 0.3 + 1.69327969e-5 / factor
        rod = {"position": [0.0, 0.0, 1.03339863e-5 / factor, 1.69327969e-5 / factor], "velocity": [0.0] * 4}
        start = {
            "rod": rod,
            "cylinder": {"position": 0.15 + end, "velocity": 0.0},
            "big_end": {"velocity": -22.5 / end - 150.0},
        }
        changed = {"modulus": 0.2e12 * factor}
        run = model.simulate(step=1e-3, rho_inf=0.6, method=method, parameters=changed, initial=start)
        assert run.success and run.stats["halvings"] == 0, (decade, run.message)
        crank, angle = run.outputs["angles"].T
        rigid = -np.arcsin(0.5 * np.sin(crank))
        slider = 0.15 * np.cos(crank) + 0.3 * np.cos(rigid)
        away.append(max(np.abs(angle - rigid).max(), np.abs(run.outputs["slider"] - slider).max()))
    assert away[0] == pytest.approx(1.7e-5, rel=0.05)
    np.testing.assert_allclose(away, away[0] / 10.0 ** np.arange(9), rtol=0.05, atol=1e-12)
