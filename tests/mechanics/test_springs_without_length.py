"""Springs of length 0, whose force is defined where their ends meet, against the harmonic oscillator; and the names of
springs whose force has no direction there."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen

MASS, STIFFNESS = 2.0, 50.0


def tied(count: int, length: float, damping: float) -> eomgen.Scene:
    """Return free bodies, each tied to a place of its own, from which it starts with a velocity."""
    builder = eomgen.SceneBuilder("tied", gravity=[0, 0, 0])
    for k in range(count):
        start = {"position": [0.1 * k, 0, 0], "velocity": [0, 0, 0, 1.0, 0.5, 0]}
        builder.body(f"b{k}", MASS, center_of_mass=[0, 0, 0], inertia=[1, 1, 1])
        builder.joint(f"j{k}", "free", "base", f"b{k}", initial=start)
        builder.point(f"p{k}", "base", [0.1 * k, 0, 0]).point(f"e{k}", f"b{k}")
        builder.spring(f"s{k}", f"p{k}", f"e{k}", stiffness=STIFFNESS, length=length, damping=damping)
    return builder.build()


@pytest.mark.slow_cases("generalized_alpha-in a loop", "rk4-in a loop", "generalized_alpha-alone")
@pytest.mark.parametrize("count", [1, 8], ids=["alone", "in a loop"])
@pytest.mark.parametrize("method", ["rk4", "generalized_alpha"])
def test_a_spring_of_length_0_pulls_from_its_own_end(method: str, count: int) -> None:
    run = eomgen.build(tied(count, 0.0, 0.0), method=method, profile="quick").simulate(1.0, 0.002)
    assert run.message == "reached t = 1 s in 500 steps"
    rate = np.sqrt(STIFFNESS / MASS)
    for k in range(count):
        off = run.q[:, 7 * k + 4] - 0.1 * k - np.sin(rate * run.t) / rate
        assert np.abs(off).max() < 1e-4
    energy = run.energy
    np.testing.assert_allclose(energy["kinetic"] + energy["potential"], 0.5 * count * MASS * 1.25, rtol=1e-3)


@pytest.mark.slow_cases("0.0-1.0")
@pytest.mark.parametrize(("length", "damping"), [(0.2, 0.0), (0.0, 1.0)])
def test_a_spring_without_direction_is_named(length: float, damping: float) -> None:
    run = eomgen.build(tied(2, length, damping), profile="quick").simulate(1.0, 0.002)
    assert not run.success
    assert ": the ends of the springs s0, s1 meet, and a force along the line between them has no direction" in (
        run.message
    )
