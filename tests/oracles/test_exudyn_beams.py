"""EXUDYN's beams: against the published spin-up, and the elastic pendulum's converged numbers that other tests use."""

import numpy as np
import pytest

from tests.oracles.elastic_pendulum import MIDDLE, TIMES, TIP
from tests.oracles.exudyn_beams import Pendulum, spin_up, swing
from tests.oracles.spin_up_beam import SET_A, simulate

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")  # EXUDYN renames settings with each version


@pytest.mark.long
def test_spin_up_is_as_published_and_near_the_linear_equation() -> None:
    coarse, fine = spin_up(SET_A, 8), spin_up(SET_A, 16)
    assert coarse.position[:, 1].min() == pytest.approx(-0.573393, abs=3e-5)
    assert fine.position[:, 1].min() == pytest.approx(-0.573974, abs=3e-5)
    assert fine.t[fine.position[:, 1].argmin()] == pytest.approx(6.762, abs=0.01)
    assert fine.position[:, 0].min() == pytest.approx(-0.01885, abs=3e-5)
    assert fine.position[fine.t > 15.0, 0].mean() == pytest.approx(5.1423e-4, abs=1e-7)
    extrapolated = fine.position[:, 1] + (fine.position[:, 1] - coarse.position[:, 1]) / 3
    linear = simulate(SET_A, 5, end=18.0).deflection(fine.t.tolist())
    assert np.abs(extrapolated - linear).max() < 1e-3


@pytest.mark.slow
def test_pendulum_with_few_elements_is_near_its_converged_motion() -> None:
    middle, tip = swing(Pendulum(), 8, end=2.0, steps=1000)
    np.testing.assert_allclose(middle.at(TIMES), MIDDLE, atol=2e-3)
    np.testing.assert_allclose(tip.at(TIMES), TIP, atol=2e-3)
    rigid = np.linalg.norm(TIP, axis=1) - 2 * np.linalg.norm(MIDDLE, axis=1)
    assert np.abs(TIP - 2 * np.array(MIDDLE)).max() > 0.01 > np.abs(rigid).max()  # it bends much and stretches little
