"""Scales of constraint rows: never zero where summands vanish, from lengths and not from masses, in any unit."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest

import eomgen

GEARS = """
format = 1
name = "gears"
gravity = [0, 0, 0]
bodies.sun = {{ mass = 1, inertia = [0.01, 0.01, 2e-3] }}
bodies.carrier = {{ mass = 2, inertia = [0.01, 0.01, 8e-3] }}
bodies.planet = {{ mass = 0.4, inertia = [1e-3, 1e-3, 5e-4] }}
joints.sun = {{ type = "revolute", parent = "base", child = "sun", axis = [0, 0, 1] }}
joints.carrier = {{ type = "revolute", parent = "base", child = "carrier", axis = [0, 0, 1] }}
[joints.planet]
type = "revolute"
parent = "carrier"
child = "planet"
axis = [0, 0, 1]
position = [0.072, 0, 0]
[constraints]
outer = {{ type = "formula", equation = "52 * q.carrier + 16 * q.planet", unit = "rad" }}
inner = {{ type = "formula", equation = "20 * (q.sun - q.carrier) + 16 * q.planet", unit = "rad" }}
[efforts]
motor = {{ joint = "sun", effort = {torque!r} }}
"""
#: Speed ratios of sun, carrier and planet, and the inertia that the carrier feels.
RATIOS = np.array([3.6, 1.0, 1 - 52 / 16])
INERTIA = float(RATIOS @ np.diag([2e-3, 8e-3 + 0.4 * 0.072**2, 5e-4]) @ RATIOS)


def built(text: str, **options: Any) -> Any:
    return eomgen.build(tomllib.loads(text), profile="quick", **options)


@pytest.mark.slow_cases("rk4_partitioned", "rk45_partitioned")
@pytest.mark.parametrize("method", ["rk4_partitioned", "rk45_partitioned"])
def test_gears_start_from_rest_at_zero(method: str) -> None:
    """All summands of the rows, and of their rates, vanish at the start. Oracle: constant acceleration."""
    for torque in (3.0, 1e-6):
        model = built(GEARS.format(torque=torque), method=method)
        for step in (1e-2, 1e-3, 7e-3):
            run = model.simulate(0.2, step, error_estimate=False)
            assert run.success, run.message
            angle = 0.5 * torque * 3.6 / INERTIA * run.t[-1] ** 2
            assert run.columns()["q.carrier"][-1] == pytest.approx(angle, rel=1e-9)


RACKS = """
format = 1
name = "racks"
gravity = [0, 0, 0]
bodies.a = {{ mass = 1 }}
bodies.b = {{ mass = 2 }}
joints.a = {{ type = "prismatic", parent = "base", child = "a", axis = [1, 0, 0] }}
joints.b = {{ type = "prismatic", parent = "base", child = "b", axis = [1, 0, 0] }}
constraints.pair = {{ type = "formula", equation = "{factor!r} * (q.a - 3 * q.b)", unit = "m" }}
efforts.push = {{ joint = "a", effort = {force!r} }}
"""


@pytest.mark.slow_cases("rk4_partitioned", "rosenbrock")
@pytest.mark.slow_cases("generalized_alpha")
@pytest.mark.parametrize("method", ["rk4_partitioned", "generalized_alpha", "rosenbrock"])
def test_travels_without_any_length_start_from_zero(method: str) -> None:
    """No length of the scene scales these rows. Oracle: an equivalent mass of 1 + 2/9 kg."""
    for factor, force in ((1.0, 1.0), (1e6, 1e-6), (1e-6, 1e6)):
        run = built(RACKS.format(factor=factor, force=force), method=method).simulate(0.1, 1e-3, error_estimate=False)
        assert run.success, run.message
        assert run.columns()["q.a"][-1] == pytest.approx(0.5 * force / (1 + 2 / 9) * 0.1**2, rel=1e-7)


TWO_LINKS = """
format = 1
name = "two_links"
gravity = [-1, 0, -9.81]
{coordinates}
bodies.arm = {{ mass = 1, inertia = [0.01, 0.01, 0.01], center_of_mass = [0.4, 0, 0] }}
bodies.fore = {{ mass = 1, inertia = [0.01, 0.01, 0.01], center_of_mass = [0.4, 0, 0] }}
joints.shoulder = {{ type = "revolute", parent = "base", child = "arm", axis = [0, 0, 1], initial.position = 0.5 }}
points.tip = {{ body = "fore", position = [1, 0, 0] }}
[joints.elbow]
type = "revolute"
parent = "arm"
child = "fore"
axis = [0, 0, 1]
position = [1, 0, 0]
initial = {{ position = -1 }}
[constraints.held]
type = "formula"
equation = "{equation}"
"""


@pytest.mark.slow_cases("rk4_partitioned-")
@pytest.mark.long_except_every(3)
@pytest.mark.slow_cases(
    'rk4_partitioned-coordinates = "absolute"', "generalized_alpha-", 'generalized_alpha-coordinates = "absolute"'
)
@pytest.mark.parametrize("coordinates", ["", 'coordinates = "absolute"'])
@pytest.mark.parametrize("method", ["rk4_partitioned", "generalized_alpha"])
def test_an_equation_whose_only_summand_vanishes_is_held(coordinates: str, method: str) -> None:
    """The tip moves along y = 0, so the shoulder has half of the elbow's angle, against it: a slider-crank of equal
    links. Oracle: the same law by coordinates, whose summands do not vanish."""
    run = built(TWO_LINKS.format(coordinates=coordinates, equation="position.tip[1]"), method=method).simulate(
        0.5, 1e-3, error_estimate=False
    )
    by_angles = built(TWO_LINKS.format(coordinates="", equation="2 * q.shoulder + q.elbow"), method=method)
    other = by_angles.simulate(0.5, 1e-3, error_estimate=False)
    assert run.success, run.message
    turned = run.columns()["q.shoulder"] if not coordinates else run.q[:, 3] * 2
    if coordinates:
        turned = 2 * np.arctan2(run.q[:, 3], run.q[:, 0])
    assert turned[-1] == pytest.approx(other.columns()["q.shoulder"][-1], abs=1e-6)


def test_a_weld_that_is_met_to_rounding_is_no_contradiction(tmp_path: Any) -> None:
    """The slide can do nothing about the violation of 1e-18 m that rounding of the file leaves across it."""
    for angle in (30, 45, 75):
        path = tmp_path / f"held_{angle}.xml"
        path.write_text(
            f"""<mujoco><worldbody><body name="wall" euler="0 {angle} 0"><geom size="0.05"/></body>
            <body name="block" pos="0 0 -0.2"><joint type="slide" axis="0 0 1"/><geom size="0.05"/>
            <body name="bob"><joint axis="0 1 0"/><geom size="0.05" pos="0.1 0 0"/></body></body></worldbody>
            <equality><weld body1="wall" body2="block"/></equality></mujoco>"""
        )
        assert eomgen.derive(eomgen.load(str(path)), ["mass"]).multipliers


JACK = """
format = 1
name = "jack"
gravity = [0, 0, -9.81]
{coordinates}
bodies.arm = {{ mass = 100, inertia = [10, 10, 10], center_of_mass = [1, 0, 0] }}
bodies.barrel = {{ mass = {mass!r}, inertia = [{inertia!r}, {inertia!r}, {inertia!r}] }}
bodies.rod = {{ mass = {mass!r}, inertia = [{inertia!r}, {inertia!r}, {inertia!r}] }}
joints.arm = {{ type = "revolute", parent = "base", child = "arm", axis = [0, 1, 0] }}
[joints.barrel]
type = "revolute"
parent = "base"
child = "barrel"
axis = [0, 1, 0]
position = [0, 0, -1]
initial = {{ position = -0.7853981633974483 }}
[joints.rod]
type = "prismatic"
parent = "barrel"
child = "rod"
axis = [1, 0, 0]
drive = "1.4142135623730951 + 0.1 * sin(t)"
[constraints.pin]
type = "revolute"
first = {{ body = "arm", position = [1, 0, 0], axis = [0, 1, 0] }}
second = {{ body = "rod", axis = [0, 1, 0] }}
{more}
"""


@pytest.mark.slow_cases("0.001-")
@pytest.mark.long_except_every(2)
@pytest.mark.slow_cases('1e-09-coordinates = "absolute"')
@pytest.mark.slow_cases('0.001-coordinates = "absolute"', '1e-08-coordinates = "absolute"')
@pytest.mark.parametrize("coordinates", ["", 'coordinates = "absolute"'])
@pytest.mark.parametrize("mass", [1e-3, 1e-8, 1e-9])
def test_geometry_alone_decides_the_rank_of_constraints(mass: float, coordinates: str) -> None:
    """A jack of nearly no mass drives an arm of 100 kg. Oracle: the triangle of arm, jack and wall."""
    text = JACK.format(mass=mass, inertia=1e-2 * mass, coordinates=coordinates, more="")
    run = built(text, method="generalized_alpha").simulate(1.0, 1e-2, error_estimate=False)
    assert run.success, run.message
    long = np.sqrt(2.0) + 0.1 * np.sin(1.0)
    angle = 2 * np.arctan2(run.q[-1][2], run.q[-1][0]) if coordinates else run.columns()["q.arm"][-1]
    assert angle == pytest.approx(np.arcsin(1 - 0.5 * long**2), abs=1e-8)


def test_a_drive_that_adds_no_condition_is_refused() -> None:
    """It was left out with a note: the machine then moved by the other drive alone."""
    more = """
[constraints.second]
type = "formula"
equation = "q.arm - asin(1 - (1.4142135623730951 + 0.1 * sin(t))**2 / 2)"
unit = "rad"
"""
    with pytest.raises(eomgen.ModelError, match="the drive has no effect: rod: driven travel"):
        built(JACK.format(mass=1.0, inertia=1.0, coordinates="", more=more))
