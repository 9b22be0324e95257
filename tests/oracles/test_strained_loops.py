"""Loops of bars against a twisted and a bent bar, and a parallelogram that nothing strains."""

import numpy as np
import pytest

from tests.oracles.strained_loops import Bar, Hinge, Loop, Shift

STIFFNESS = (50.0, 80.0, 120.0, 1e6, 5e5, 5e5)
BACK = Shift([0, 0, 0], [-2.0, 0, 0])


def test_a_twisted_bar_has_its_torque() -> None:
    assert Loop([Hinge([1, 0, 0]), Bar(2.0, 3, STIFFNESS), BACK]).turn(0.4) == pytest.approx(50.0 * 0.4 / 2.0)


def test_a_clamped_bar_resists_a_turn_of_its_end_by_four_times_its_bending() -> None:
    def torque(elements: int) -> float:
        return Loop([Hinge([0, 0, 1]), Bar(2.0, elements, STIFFNESS), BACK]).turn(1e-3) / 1e-3

    shear = 12.0 * 120.0 / (5e5 * 2.0**2)
    coarse, fine = torque(4), torque(8)
    assert fine + (fine - coarse) / 3.0 == pytest.approx(60.0 * (4.0 + shear) / (1.0 + shear), rel=1e-3)
    assert abs(coarse / fine - 1.0) > 0.005


def test_a_parallelogram_turns_without_strain() -> None:
    q, pin = np.pi / 2.0, [0, 0, 1]
    bars = [Bar(length, 2, STIFFNESS) for length in (0.5, 1.0, 0.5)]
    loop = Loop(
        [
            Hinge(pin, before=[0, 0, q]),
            bars[0],
            Hinge(pin, before=[0, 0, -q]),
            bars[1],
            Hinge(pin),
            Shift([0, 0, -q], [0, 0, 0]),
            bars[2],
            Hinge(pin, before=[0, 0, q]),
            Shift([0, 0, 0], [-1.0, 0, 0]),
        ]
    )
    assert loop.turn(-0.3) == pytest.approx(0.0, abs=1e-9)
    assert loop.angles == pytest.approx([-0.3, 0.3, -0.3, 0.3])
