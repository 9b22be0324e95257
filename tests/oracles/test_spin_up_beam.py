"""The spin-up beam against the digits of dossier 1.10.1."""

import pytest

from tests.anchors import anchor
from tests.oracles.spin_up_beam import SET_A, SET_B, simulate

# modes: peak, its time, v(5), v(7.5), v(10), amplitude after the spin-up
PUBLISHED = {
    1: (-0.578260, 6.7642, -0.471115, -0.563212, -0.361011, 2.696e-3),
    2: (-0.573549, 6.7563, -0.468592, -0.558186, -0.359786, 3.423e-3),
    3: (-0.574443, 6.7622, *anchor("spin_up_beam").reference, 3.611e-3),
    5: (-0.574380, 6.7620, -0.468784, -0.559530, -0.362842, 3.643e-3),
}


@pytest.mark.long_except_every(3)
@pytest.mark.long_cases("5")
@pytest.mark.slow
@pytest.mark.parametrize("modes", list(PUBLISHED))
def test_set_a_moves_as_published(modes: int) -> None:
    run, (peak, time, *samples, residual) = simulate(SET_A, modes), PUBLISHED[modes]
    assert run.peak == pytest.approx(peak, abs=6e-7) and run.peak_time == pytest.approx(time, abs=6e-5)
    assert run.deflection([5.0, 7.5, 10.0]) == pytest.approx(samples, abs=6e-7)
    assert run.residual == pytest.approx(residual, abs=6e-7)


@pytest.mark.long_except_every(3)
@pytest.mark.long_cases("5--0.534419")
@pytest.mark.slow
@pytest.mark.parametrize(("modes", "peak"), [(1, -0.537892), (2, -0.533847), (3, -0.534471), (5, -0.534419)])
def test_set_b_moves_as_published(modes: int, peak: float) -> None:
    run = simulate(SET_B, modes)
    assert run.peak == pytest.approx(peak, abs=6e-7)
    if modes == 5:
        assert run.peak_time == pytest.approx(6.766, abs=6e-4)
        assert run.deflection([5.0, 10.0]) == pytest.approx([-0.423054, -0.347748], abs=6e-7)
        assert run.residual == pytest.approx(8.30e-3, abs=6e-6)


@pytest.mark.slow
def test_without_stiffening_the_beam_runs_away() -> None:
    run = simulate(SET_A, 3, end=15.0, stiffening=False)
    assert run.deflection([10.0, 15.0]) == pytest.approx([-72.0, -8.1e10], rel=7e-3)
