"""Scales of constraint rows: never zero where summands vanish, from lengths and not from masses, in any unit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from tests.models.library import scene


def built(file: str, method: str = "generalized_alpha", **changes: Any) -> Any:
    return eomgen.build(scene(f"../tests/solvers/scenes/{file}", **changes), profile="quick", method=method)


@pytest.mark.slow_cases("rk4_partitioned", "rosenbrock")
@pytest.mark.parametrize("method", ["rk4_partitioned", "generalized_alpha", "rosenbrock"])
def test_travels_without_any_length_start_from_zero(method: str) -> None:
    """No length of the scene scales these rows. Oracle: an equivalent mass of 1 + 2/9 kg."""
    for factor, force in ((1.0, 1.0), (1e6, 1e-6), (1e-6, 1e6)):
        law = {"constraints__pair__equation": f"{factor!r} * (q.a - 3 * q.b)", "efforts__push__effort": force}
        run = built("racks", method, **law).simulate(0.1, 1e-3, error_estimate=False)
        assert run.success, run.message
        assert run.columns()["q.a"][-1] == pytest.approx(0.5 * force / (1 + 2 / 9) * 0.1**2, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("method", ["rk4_partitioned", "generalized_alpha"])
def test_an_equation_whose_only_summand_vanishes_is_held(coordinates: str, method: str) -> None:
    """The tip moves along y = 0, so the shoulder has half of the elbow's angle, against it: a slider-crank of equal
    links. Oracle: the same law by coordinates, whose summands do not vanish."""
    run = built("two_links", method, coordinates=coordinates).simulate(0.5, 1e-3, error_estimate=False)
    by_angles = built("two_links", method, constraints__held__equation="2 * q.shoulder + q.elbow")
    other = by_angles.simulate(0.5, 1e-3, error_estimate=False)
    assert run.success, run.message
    joint = coordinates == "joint"
    turned = run.columns()["q.shoulder"] if joint else 2 * np.arctan2(run.q[:, 3], run.q[:, 0])
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


@pytest.mark.slow
@pytest.mark.parametrize(("mass", "coordinates"), [(1e-9, "joint"), (1e-3, "absolute"), (1e-9, "absolute")])
def test_geometry_alone_decides_the_rank_of_constraints(mass: float, coordinates: str) -> None:
    """A jack of nearly no mass drives an arm of 100 kg. Oracle: the triangle of arm, jack and wall."""
    light = {"mass": mass, "inertia": [1e-2 * mass] * 3}
    model = built("jack", coordinates=coordinates, bodies__barrel=light, bodies__rod=light)
    run = model.simulate(1.0, 1e-2, error_estimate=False)
    assert run.success, run.message
    long = np.sqrt(2.0) + 0.1 * np.sin(1.0)
    angle = run.columns()["q.arm"][-1] if coordinates == "joint" else 2 * np.arctan2(run.q[-1][2], run.q[-1][0])
    assert angle == pytest.approx(np.arcsin(1 - 0.5 * long**2), abs=1e-8)


def test_a_drive_that_adds_no_condition_is_refused() -> None:
    """It was left out with a note: the machine then moved by the other drive alone."""
    equation = "q.arm - asin(1 - (1.4142135623730951 + 0.1 * sin(t))**2 / 2)"
    with pytest.raises(eomgen.ModelError, match="the drive has no effect: rod: driven travel"):
        built("jack", constraints__second={"type": "formula", "equation": equation, "unit": "rad"})
