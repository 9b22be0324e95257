"""Frequencies of a cantilever on a base that turns steadily, against the published table (Wright 1982; Yoo and Shin
1998)."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import eomgen
from tests.anchors import anchor

#: Rate, offset of the clamp over the length, flapwise and lagwise frequencies, all by sqrt(rho A L^4 / E I).
TABLE = [
    (0, 0, (3.51602, 22.03449), (3.51602, 22.03449)),
    (6, 0, *anchor("rotating_beam_6").reference.reshape(2, 2)),
    (12, 0, *anchor("rotating_beam_12").reference.reshape(2, 2)),
    (2, 1, (4.83369, 23.36604), (4.40052, 23.28029)),
    (12, 1, *anchor("rotating_beam_12_on_hub").reference.reshape(2, 2)),
]

#: Anchor cases by rate and offset.
ANCHORS = {(6, 0): "rotating_beam_6", (12, 0): "rotating_beam_12", (12, 1): "rotating_beam_12_on_hub"}


@cache
def blade(offset: int) -> eomgen.Model:
    """Return a blade of unit length, mass and stiffness that bends both ways, clamped at a distance from the axis."""
    bending = {"modes": 11, "shapes": "polynomial", "stiffness": 1.0}
    builder = eomgen.SceneBuilder("blade", gravity=[0, 0, 0]).parameter("rate", 0.0, tunable=True)
    builder.base(rotation=[([0, 0, 1], "rate * t")])
    builder.beam("blade", 1.0, mass_per_length=1.0, bending_y=bending, bending_z=bending)
    builder.joint("clamp", "fixed", "base", "blade", position=[offset, 0, 0])
    return eomgen.build(builder.build(), profile="instant")


@pytest.mark.slow_cases("0-0-flap0-lag0", "2-1-flap3-lag3")
@pytest.mark.parametrize("rate, offset, flap, lag", TABLE)
def test_frequencies(rate: int, offset: int, flap: tuple[float, float], lag: tuple[float, float]) -> None:
    lin = blade(offset).linearize(parameters={"rate": float(rate)}, t=0.7)
    assert lin.reference.what == ("steady motion" if rate else "equilibrium")
    np.testing.assert_allclose(lin.reference.q, 0.0, atol=1e-12)
    frequencies = lin.modes().angular_frequency
    nearest = [frequencies[np.argmin(np.abs(frequencies - wanted))] for wanted in (*flap, *lag)]
    np.testing.assert_allclose(nearest, (*flap, *lag), rtol=0, atol=7e-6)  # five decimals are printed
    if case := ANCHORS.get((rate, offset)):
        anchor(case).check(nearest)


@pytest.mark.slow
def test_without_stiffening_the_lag_is_unstable_beyond_its_frequency() -> None:
    builder = eomgen.SceneBuilder("soft", gravity=[0, 0, 0]).base(rotation=[([0, 0, 1], "4 * t")])
    builder.beam("blade", 1.0, mass_per_length=1.0, bending_y={"modes": 2, "stiffness": 1.0}, stiffening=False)
    model = eomgen.build(builder.joint("clamp", "fixed", "base", "blade").build(), profile="instant")
    lin = model.linearize()
    np.testing.assert_allclose(lin.undamped_frequencies[0], -np.sqrt(4.0**2 - 3.516015**2), rtol=1e-5)
    assert lin.modes().stability == "unstable"
