"""A parked wheel is held by its bristles: a rest on a slope, and frequencies of the whole model."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from tests.contacts.pairs import scene_of

PULL, STIFFNESS, RADIUS, SPRING, LENGTH, FRICTION = 0.4, 2e5, 0.31, 5e4, 1e-3, 0.8
WHEEL = f"""format = 1
name = "parked"
gravity = [{-PULL}, 0, -9.81]
bodies = {{ trolley = {{ mass = 200 }}, hub = {{ mass = 100 }}, wheel = {{ mass = 20, inertia = [0.6, 1.1, 0.6] }} }}
[joints]
rail = {{ type = "prismatic", parent = "base", child = "trolley", axis = [1, 0, 0] }}
lift = {{ type = "prismatic", parent = "trolley", child = "hub", axis = [0, 0, 1], initial = {{ position = 0.305 }} }}
axle = {{ type = "revolute", parent = "hub", child = "wheel", axis = [0, 1, 0], stiffness = {SPRING} }}
[contacts.road]
first = {{ body = "base", axis = [0, 0, 1], x_axis = [1, 0, 0] }}
second = {{ body = "wheel", axis = [0, 1, 0] }}
shape = "disc"
radius = {RADIUS}
normal = {{ type = "linear", stiffness = {STIFFNESS}, damping = 500 }}
"""
BRISTLES = f'tangential = {{ type = "bristles", friction = {FRICTION}, bristle_length = {LENGTH} }}\n'


@pytest.mark.slow
def test_bristles_hold_a_parked_wheel_on_a_slope() -> None:
    """The pull of 320 kg stretches the bristles by F / (friction load / length), and turns the axle by F r / k."""
    found = eomgen.build(scene_of(WHEEL + BRISTLES), profile="quick").equilibrium()
    force, load = 320.0 * PULL, 120.0 * 9.81
    stretch = force * LENGTH / (FRICTION * load)
    assert found.z == pytest.approx([-stretch, 0.0], abs=1e-12)
    turn = -force * RADIUS / SPRING
    assert found.q[2] == pytest.approx(turn, rel=1e-9) and not found.undetermined
    assert found.q[0] - RADIUS * turn == pytest.approx(-stretch, rel=1e-9)


@pytest.mark.slow
def test_frequencies_of_a_parked_wheel_are_the_undamped_ones_of_the_linear_model() -> None:
    """Without a pull; before, bristles were held, and the wheel had no spring along the road."""
    text = WHEEL.replace(f"gravity = [{-PULL}", "gravity = [0").replace("damping = 500", "damping = 0") + BRISTLES
    model = eomgen.build(scene_of(text), profile="quick")
    found = model.equilibrium()
    assert found.stable and not found.undetermined
    values = np.linalg.eigvals(model.linearize(found.q, z=found.z).state_space().A)
    expected = sorted(value.imag for value in values if value.imag > 1e-6)
    np.testing.assert_allclose(found.frequencies, expected, rtol=1e-9)
