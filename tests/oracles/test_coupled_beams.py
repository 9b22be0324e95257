"""Uniform cantilevers of coupled sections against closed forms without coupling."""

import numpy as np
import pytest

from tests.oracles.coupled_beams import frequencies, turning_tip

STIFFNESS = np.diag([1e8, 1e9, 1e9, 4e5, 1e5, 4e5])
INERTIA = np.diag([10.0, 10.0, 10.0, 0.5, 1e-6, 0.5 - 1e-6])


def test_a_slender_cantilever_has_its_bending_frequencies() -> None:
    """EI and m give sqrt(EI/m)/L^2 times 3.51602 and 22.0345 across both axes; rotary inertia takes a little off."""
    found = frequencies(STIFFNESS, np.diag([10.0, 10.0, 10.0, 0.5, 1e-6, 1e-6]), 10.0, 30.0, 3)
    assert found == pytest.approx([3.51602, 2.0 * 3.51602, 22.0345], rel=2e-3)


def test_a_straight_blade_stretches_by_its_centrifugal_force() -> None:
    tip, loads = turning_tip(STIFFNESS, INERTIA, 10.0, 2.0)
    k = np.sqrt(10.0 * 4.0 / 1e8)
    assert tip == pytest.approx([np.tan(10.0 * k) / k, 0.0, 0.0], rel=1e-8, abs=1e-8)
    assert loads[0] == pytest.approx(1e8 * (1.0 / np.cos(10.0 * k) - 1.0), rel=1e-6)
