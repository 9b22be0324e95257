"""Beams in compiled models: static deflection, points on them, units, what is refused, rates, and large trees."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError

LENGTH, DENSITY, STIFFNESS, LOAD = 2.0, 1.5, 80.0, 0.4


def cantilever(**changes: Any) -> dict[str, Any]:
    """Return a cantilever along x under its weight and a force at its tip, both along z."""
    bending = {"shapes": "polynomial", "modes": 3, "stiffness": "EI"}
    return {
        "format": 1,
        "name": "cantilever",
        "gravity": [0, 0, -9.81],
        "parameters": {
            "EI": {"value": STIFFNESS, "tunable": True},
            "mass_per_length": {"value": DENSITY, "tunable": True},
        },
        "beams": {
            "beam": {"length": LENGTH, "mass_per_length": "mass_per_length", "bending_z": bending, "stiffening": False}
        },
        "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "beam"}},
        "points": {"tip": {"body": "beam", "position": [LENGTH, 0, 0]}},
        "forces": {"load": {"body": "beam", "point": [LENGTH, 0, 0], "force": [0, 0, -LOAD]}},
        "outputs": {"tip": {"position": "tip"}},
        **changes,
    }


@cache
def model() -> eomgen.Model:
    return eomgen.build(cantilever())


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1.0, 2.5])
def test_static_deflection_of_a_cantilever(scale: float) -> None:
    """Under weight and a load at the tip it sinks by q L^4 / 8 EI + P L^3 / 3 EI, which cubic and quartic shapes hold
    exactly."""
    parameters = {"EI": scale * STIFFNESS, "mass_per_length": DENSITY / scale}
    found = model().equilibrium(parameters=parameters)
    sinks = DENSITY / scale * 9.81 * LENGTH**4 / (8.0 * scale * STIFFNESS) + LOAD * LENGTH**3 / (
        3.0 * scale * STIFFNESS
    )
    tip = model().outputs(found.q, np.zeros(3), parameters=parameters)["tip"]
    np.testing.assert_allclose(tip, [LENGTH, 0.0, -sinks], rtol=1e-9)


@pytest.mark.slow
def test_a_run_beyond_order_1_blames_the_beam_and_not_the_step() -> None:
    scene: dict[str, Any] = {
        "format": 1,
        "name": "hinged",
        "beams": {"b": {"length": 1, "mass_per_length": 1, "bending_y": {"modes": 3, "stiffness": 100}}},
        "bodies": {"tip": {"mass": 0.3}},
        "joints": {
            "c": {"type": "revolute", "axis": [0, 0, 1], "parent": "base", "child": "b"},
            "m": {"type": "fixed", "parent": "b", "child": "tip", "position": [0.5, 0, 0]},
        },
    }
    run = eomgen.build(scene).simulate(0.2, 1e-3, initial={"c": 0, "b": [0.05, -0.04, 0.04]})
    assert not run.success and "the energy is out of balance" in run.message
    assert run.message.endswith(
        "the deflection of beam b is beyond the range of order = 1: the inertia matrix is not positive definite; try:"
        " order = 2"
    )


def test_points_of_a_beam_are_those_of_the_scene() -> None:
    assert model().point("beam", [0, 0, 0], model().initial_q).position == pytest.approx([0, 0, 0])
    for ask in (model().point, model().point_jacobian):
        with pytest.raises(UsageError) as caught:
            ask("beam", [1.0, 0, 0], model().initial_q)
        assert (
            str(caught.value)
            == "usage error: point of beam: the beam deforms, and the compiled model knows its shapes at the points of"
            " the scene only; try: an entry of [points] with an output of it; r = 0 for the frame"
        )


def test_elastic_coordinates_have_units_and_names() -> None:
    assert model().q_names == ["q.beam[0]", "q.beam[1]", "q.beam[2]"]
    assert (model().q_units, model().v_units) == (["m"] * 3, ["m/s"] * 3)


def hinged(modes: int, beams: int = 1) -> dict[str, Any]:
    """Return a chain of elastic beams on hinges about y, with a mass at its end."""
    blade = {
        "length": LENGTH,
        "mass_per_length": DENSITY,
        "polar_inertia": 0.01,
        "bending_y": {"modes": modes, "stiffness": 60.0},
        "bending_z": {"modes": modes, "stiffness": STIFFNESS, "damping_ratio": 0.01},
    }
    joints: dict[str, Any] = {}
    for k in range(beams):
        carrier = {"parent": f"beam{k - 1}", "position": [LENGTH, 0, 0]} if k else {"parent": "base"}
        start = {"initial": {"position": 0.3}}
        joints[f"hinge{k}"] = {"type": "revolute", "axis": [0, 1, 0], "child": f"beam{k}", **start, **carrier}
    joints["end"] = {"type": "fixed", "parent": f"beam{beams - 1}", "child": "ball", "position": [LENGTH, 0, 0.1]}
    return {
        "format": 1,
        "name": f"hinged_{beams}",
        "beams": {f"beam{k}": blade for k in range(beams)},
        "bodies": {"ball": {"mass": 0.5, "inertia": [0.01, 0.02, 0.02]}},
        "joints": joints,
        "points": {"end": {"body": "ball", "position": [0.1, 0, 0]}},
        "outputs": {"end": {"position": "end"}, "speed": {"velocity": "end"}, "rush": {"acceleration": "end"}},
    }


@cache
def pendulum() -> eomgen.Model:
    return eomgen.build(
        hinged(1), terms=["rates_1", "poses", "twists", "accelerations", "outputs", "energy", "mass", "force"]
    )


def test_what_hangs_on_a_beam_moves_as_its_poses_say() -> None:
    """Velocities and accelerations of a body on a beam, and of a point on it, against differences of poses along a
    parabola."""
    rng = np.random.default_rng(3)
    model, h = pendulum(), 1e-4
    q, v, a = 0.2 * rng.normal(size=3), rng.normal(size=3), rng.normal(size=3)
    steps = np.array([-2.0, -1.0, 0.0, 1.0, 2.0]) * h
    along = [q + v * s + 0.5 * a * s * s for s in steps]
    places = np.array([model.point("ball", [0.1, 0, 0], at).position for at in along])
    velocity = (places[0] - 8.0 * places[1] + 8.0 * places[3] - places[4]) / (12.0 * h)
    acceleration = (-places[0] + 16.0 * places[1] - 30.0 * places[2] + 16.0 * places[3] - places[4]) / (12.0 * h * h)
    found = model.point("ball", [0.1, 0, 0], q, v, a=a)
    np.testing.assert_allclose(found.position, model.outputs(q, v, a=a)["end"], atol=1e-14)
    for result, expected in ((found.velocity, velocity), (model.outputs(q, v, a=a)["speed"], velocity)):
        np.testing.assert_allclose(result, expected, rtol=1e-9, atol=1e-9)
    for result in (found.acceleration, model.outputs(q, v, a=a)["rush"]):
        np.testing.assert_allclose(result, acceleration, rtol=1e-6, atol=1e-6)
