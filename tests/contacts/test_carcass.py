"""Carcass and friction of tyres give no energy: a wheel that bounces, one that brakes to rest, one that hangs on ice.

The carcass is a spring of constant stiffness C whose force friction limits to F, so it stores F^2/(2 C) at most.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import eomgen
from tests.contacts.pairs import scene_of
from tests.contacts.states import own_tyre
from tests.contacts.test_rolling_tyre import BRUSH, LINEAR_SLIP, TYRE, VAN, coefficients_of, locked_wheel

#: Laws with the largest stiffness of the carcass, N/m, and the largest friction.
LAWS = {
    "linear": (f'type = "linear", {coefficients_of(LINEAR_SLIP)}', 15.0 * 4000.0 / 0.3, 1.1),
    "brush": (f'type = "brush", {coefficients_of(BRUSH)}', 15.0 * 4000.0 / 0.3, 0.9),
    "tmeasy": (f'type = "tmeasy", {coefficients_of(VAN)}', VAN["DFY1"] / 0.3, 2145.5 / 1900.0),
    "magic_formula": (TYRE, own_tyre().numbers["LATERAL_STIFFNESS"], 1.05),
}
GUIDED = """format = 1
name = "wheel"
gravity = [0, 0, -9.81]
[bodies]
along = {{ mass = 0 }}
across = {{ mass = 0 }}
axle = {{ mass = {mass} }}
wheel = {{ mass = 20, inertia = [0.6, 1.1, 0.6] }}
[joints]
x = {{ type = "prismatic", parent = "base", child = "along", axis = [1, 0, 0], initial = {{ velocity = {x} }} }}
y = {{ type = "prismatic", parent = "along", child = "across", axis = [0, 1, 0], initial = {{ velocity = {y} }} }}
z = {{ type = "prismatic", parent = "across", child = "axle", axis = [0, 0, 1], initial = {{ position = {z} }} }}
spin = {{ type = "revolute", parent = "axle", child = "wheel", axis = [0, 1, 0], initial = {{ velocity = {spin} }} }}
[contacts.road]
first = {{ body = "base", axis = [0, 0, 1], x_axis = [1, 0, 0] }}
second = {{ body = "wheel", axis = [0, 1, 0] }}
shape = "disc"
radius = 0.31
normal = {{ type = "linear", stiffness = "200 kN/m" }}
tangential = {{ {law} }}
[outputs]
seen = {{ formula = ["energy.total", "normal_force.road"] }}
"""


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(
    ("mass", "x", "y", "z", "spin"),
    [
        pytest.param(20, 0.0, 0.3, 0.33, 0.0, id="at-rest"),
        pytest.param(0, 3.0, 0.5, 0.4, 10.0, id="rolls"),
        pytest.param(0, 0.0, 0.5, 0.4, 100.0, id="spins", marks=pytest.mark.long),
        pytest.param(0, 10.0, 0.3, 0.35, 30.0, id="brakes", marks=pytest.mark.long),
        pytest.param(0, 0.0, 5.0, 0.4, 0.0, id="slides", marks=pytest.mark.long),
    ],
)
def test_a_wheel_that_bounces_gains_no_energy(law: str, mass: float, x: float, y: float, z: float, spin: float) -> None:
    """It never has more than at the start, and later gets back no more than the carcass can store."""
    text, stiffness, friction = LAWS[law]
    scene = scene_of(GUIDED.format(law=text, mass=mass, x=x, y=y, z=z, spin=spin))
    run = eomgen.build(scene, profile="quick").simulate(2.0, 5e-4, method="rk4", error_estimate=False)
    energy, load = run["seen"].T
    assert run.success and (load == 0.0).any() and load.max() > 1500.0
    assert energy.max() < energy[0] + 1e-9
    stored = (friction * load.max()) ** 2 / (2.0 * stiffness)
    assert (energy - np.minimum.accumulate(energy)).max() < 1.1 * stored
    assert energy[0] - energy[-1] > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["[1, 0, 0]", "[0, 1, 0]"])
@pytest.mark.parametrize("law", LAWS)
def test_a_locked_wheel_that_stops_is_thrown_back_by_its_carcass_alone(law: str, axis: str) -> None:
    """Of the speed F / sqrt(C m) at most, and then comes to rest."""
    text, stiffness, friction = LAWS[law]
    run = eomgen.build(locked_wheel(text, "[0, 0, -9.81]", axis, 5.0)).simulate(3.0, 1e-3, method="rk4")
    way, speed = run.q[:, 0], run.v[:, 0]
    bound = friction * 400.0 * 9.81 / math.sqrt(stiffness * 400.0)
    assert 1.0 < way.max() < 2.0
    assert 0.1 * bound < -speed.min() < bound
    assert np.abs(speed[-500:]).max() < 0.02 * bound


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["[1, 0, 0]", "[0, 1, 0]"])
def test_friction_holds_a_wheel_up_to_nine_tenths_of_its_limit(axis: str) -> None:
    """A pull of 0.18 of the weight, on ice with a friction of 0.2, and of 0.22, at which it slides."""
    law = 'type = "brush", coefficients = { STIFFNESS = 15, FRICTION = 0.2 }'
    for pull, slides in ((0.18, False), (0.22, True)):
        along = [9.81 * pull * float(number) for number in axis.strip("[]").split(",")]
        scene = locked_wheel(law, f"[{along[0]}, {along[1]}, -9.81]", axis)
        run = eomgen.build(scene, profile="quick").simulate(6.0, 1e-3, method="rk4", error_estimate=False)
        assert (run.v[-1, 0] > 0.5) if slides else (np.abs(run.v[-1000:, 0]).max() < 1e-5), (pull, run.v[-1])


@pytest.mark.slow
def test_the_carcass_of_a_small_wheel_is_as_soft_as_its_normal_law() -> None:
    """A toy of 0.2 kg on a slope stands at explicit steps of 1 ms; both stiffnesses are equal at STIFFNESS = 15."""
    law = 'type = "brush", coefficients = { STIFFNESS = 15, FRICTION = 0.9 }'
    text = GUIDED.replace("mass = 20, inertia = [0.6, 1.1, 0.6]", "mass = 0.1, inertia = [1e-5, 2e-5, 1e-5]")
    text = text.replace('200 kN/m"', '200 N/m", damping = 2').replace("radius = 0.31", "radius = 0.03")
    text = text.replace("[0, 0, -9.81]", "[0, 1, -9.81]")
    scene = scene_of(text.format(law=law, mass=0.1, x=0.0, y=0.0, z=0.02, spin=0.0))
    run = eomgen.build(scene, profile="quick").simulate(3.0, 1e-3, method="rk4", error_estimate=False)
    assert run.success and not run.findings, run.findings
    assert np.abs(run.v[-1]).max() < 1e-6
    assert run.q[-1, 1] == pytest.approx(0.2 * 1.0 / 200.0, rel=0.1)
