"""Buckling loads do not depend on the unit of the load parameter."""

from __future__ import annotations

import math

import pytest

import eomgen

WIDTH, THICKNESS, LENGTH, MODULUS = 2.5e-4, 1e-4, 0.03, 2e11


def strip(unit: float) -> eomgen.Model:
    """Return a pinned strip that is pushed by ``unit`` N times the parameter ``load``."""
    scene = eomgen.SceneBuilder("strip", gravity=(0, 0, 0))
    scene.parameter("load", 0.0, tunable=True)
    section = {"shape": "rectangle", "width": THICKNESS, "height": WIDTH, "elastic_modulus": MODULUS}
    scene.beam(
        "strip", model="cosserat", length=LENGTH, elements=8, section={**section, "poisson_ratio": 0.3, "density": 7800}
    )
    scene.joint("pin", "universal", "base", "strip", axis=[0, 1, 0], second_axis=[0, 0, 1])
    end = {"body": "strip", "position": [LENGTH, 0, 0]}
    scene.constraint("guide", "point_on_line", {"body": "base", "axis": [1, 0, 0]}, end)
    scene.force("push", "strip", point=[LENGTH, 0, 0], force=[f"-{unit} * load", 0, 0])
    return eomgen.build(scene.build())


@pytest.mark.long_except("1e-13")
@pytest.mark.slow_cases("1.0", "1e-13")
@pytest.mark.parametrize("unit", [1.0, pytest.param(1e-9, marks=pytest.mark.slow), 1e-13])
def test_the_first_load_is_that_of_euler_in_any_unit(unit: float) -> None:
    euler = math.pi**2 * MODULUS * WIDTH * THICKNESS**3 / 12.0 / LENGTH**2
    loads = strip(unit).buckling_loads("load", count=1)
    assert loads.values[0] * unit == pytest.approx(euler, rel=1e-3) and not loads.warning
