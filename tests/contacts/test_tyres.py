"""Tyres: the law of their contact, energy, exact partials, slip forces, and motions known in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from eomgen.mechanics.derive import derive
from eomgen.scene.builder import SceneBuilder
from tests.mechanics.checks import check_partials, check_powers, states_of
from tests.oracles.evaluation import Array, tape_evaluator
from tests.oracles.states import derivative, random_states, rotation_of

HILLY = "0.3 * sin(0.7 * position.hub[0]) * cos(0.9 * position.hub[1]) + 0.2 * position.hub[0]"
ROADS: dict[str, dict[str, Any]] = {
    "flat": {},
    "hilly": {"road": HILLY},
    "curves": {"road": "hump(position.hub[0]) + coarse(position.hub[1])", "road_rate": None},
    "waves": {"road": f"{HILLY} + 0.1 * sin(3 * t + position.hub[0])"},
    "lifted": {"road": "lift + 0.1 * position.hub[1]", "road_rate": "lift_rate"},
}
SLIP = {"stiffness": [15, 12], "friction": 0.8, "velocity": 0.3, "axis": [0.1, 1.0, -0.2]}


def wheel(coordinates: str = "joint", *, tyre: dict[str, Any], moving: bool = False) -> SceneBuilder:
    """Return a free wheel whose hub is off its centre of mass, on a road."""
    builder = SceneBuilder("wheel", coordinates=coordinates).body("wheel", 5.0, inertia=[0.1, 0.18, 0.1])
    builder.joint("free", "free", "base", "wheel").point("hub", "wheel", [0.02, 0.05, -0.01])
    builder.input("lift", 0.0).input("lift_rate", 0.0)
    builder.curve("hump", bump={"length": 1.5, "height": 0.3, "position": -0.6})
    builder.curve("coarse", road={"class": "F", "harmonics": 9})
    if moving:
        builder.base(position=["0.3 * sin(2 * t)", "0.1 * t", 0], rotation=[([1, 2, 3], "0.4 * sin(t)")])
    return builder.tyre("tyre", "hub", radius=0.3, stiffness=900.0, damping=40.0, onset=0.2, **tyre)


def near_the_road(state: dict[str, Array], rng: np.random.Generator) -> dict[str, Array]:
    """Return states that are about half in contact, half in the air."""
    count = len(state["q"])
    state["q"][:, 4:6] = rng.uniform(-1.0, 1.0, (count, 2))
    state["q"][:, 6] = rng.uniform(-0.4, 0.9, count)
    return state


def test_normal_forces_follow_their_law_and_are_normal_to_the_road(rng: np.random.Generator) -> None:
    builder = wheel(tyre=ROADS["waves"]).output("tyre", formula=["load.tyre", "deflection.tyre"])
    system = derive(builder.build(), ["force", "outputs"])
    evaluate = tape_evaluator(system)
    state = near_the_road(random_states(system, 80, rng), rng)
    R = rotation_of(state["q"][:, :4])
    arm = np.array([0.02, 0.05, -0.01])
    x, y, z = (state["q"][:, 4:7] + R @ arm).T
    vx, vy, vz = np.einsum("kij,kj->ki", R, state["v"][:, 3:] + np.cross(state["v"][:, :3], arm)).T
    t = state["t"][:, 0]
    height = 0.3 * np.sin(0.7 * x) * np.cos(0.9 * y) + 0.2 * x + 0.1 * np.sin(3 * t + x)
    along_x = 0.21 * np.cos(0.7 * x) * np.cos(0.9 * y) + 0.2 + 0.1 * np.cos(3 * t + x)
    along_y = -0.27 * np.sin(0.7 * x) * np.sin(0.9 * y)
    d = 0.3 + height - z
    rate = along_x * vx + along_y * vy + 0.3 * np.cos(3 * t + x) - vz
    u = np.clip(d / 0.2, 0.0, 1.0)
    size = u * u * (3 - 2 * u) * np.maximum(0.0, 900.0 * np.maximum(d, 0.0) + 40.0 * rate)
    force = size[:, np.newaxis] * np.stack([-along_x, -along_y, np.ones_like(d)], axis=1) + [0, 0, -5.0 * 9.81]
    outputs = evaluate("outputs", state)["y"]
    np.testing.assert_allclose(outputs[:, 1], d, rtol=0, atol=1e-14)
    np.testing.assert_allclose(outputs[:, 0], size * np.sqrt(1 + along_x**2 + along_y**2), rtol=1e-12, atol=1e-11)
    np.testing.assert_allclose(
        np.einsum("kij,kj->ki", R, evaluate("force", state)["Q"][:, 3:]), force, rtol=1e-12, atol=1e-10
    )
    assert 10 < np.count_nonzero(size) < 70


def test_slip_forces_follow_their_law(rng: np.random.Generator) -> None:
    """On a flat road, against the definitions written with NumPy."""
    forces = []
    states: dict[str, Array] = {}
    for slip in (SLIP, None):
        system = derive(wheel(tyre={"slip": slip}).output("load", formula="load.tyre").build(), ["force", "outputs"])
        states = states or near_the_road(random_states(system, 50, rng), rng)
        forces.append(tape_evaluator(system)("force", states)["Q"])
    loads = tape_evaluator(system)("outputs", states)["y"][:, 0]
    deflections = 0.3 - (states["q"][:, 6] + (rotation_of(states["q"][:, :4]) @ [0.02, 0.05, -0.01])[:, 2])
    for k in range(50):
        R = Rotation.from_quat(states["q"][k, [1, 2, 3, 0]]).as_matrix()
        omega, linear = R @ states["v"][k, :3], R @ states["v"][k, 3:]
        hub = R @ [0.02, 0.05, -0.01]
        side = R @ SLIP["axis"] * [1.0, 1.0, 0.0]  # type: ignore[operator]
        side /= np.linalg.norm(side)
        ahead = np.cross(side, [0, 0, 1])
        center = linear + np.cross(omega, hub)
        contact = hub + np.array([0.0, 0.0, deflections[k] - 0.3])
        patch = linear + np.cross(omega, contact)
        asked = np.array([15 * patch @ ahead, 12 * patch @ side]) / np.hypot(center @ ahead, 0.3)
        grip = -loads[k] * asked / np.sqrt(1 + asked @ asked / 0.8**2)
        force = grip[0] * ahead + grip[1] * side
        np.testing.assert_allclose(R @ (forces[0][k, 3:] - forces[1][k, 3:]), force, rtol=1e-10, atol=1e-9)
        np.testing.assert_allclose(
            R @ (forces[0][k, :3] - forces[1][k, :3]), np.cross(contact, force), rtol=1e-10, atol=1e-9
        )
        assert np.linalg.norm(force) <= 0.8 * loads[k] + 1e-12


def test_absolute_coordinates_give_the_same_forces(rng: np.random.Generator) -> None:
    systems = [
        derive(wheel(kind, tyre={**ROADS["hilly"], "slip": SLIP}).build(), ["force"]) for kind in ("joint", "absolute")
    ]
    state = near_the_road(random_states(systems[0], 40, rng), rng)
    joint, absolute = (tape_evaluator(system)("force", state)["Q"] for system in systems)
    np.testing.assert_allclose(absolute, joint, rtol=1e-12, atol=1e-11)


@pytest.mark.slow
@pytest.mark.slow_except("0-flat", "3-waves", "4-lifted")
@pytest.mark.parametrize(("number", "road"), [*enumerate(ROADS), (7, "flat")])
def test_partials_are_complex_steps_and_the_energy_changes_by_the_powers(
    number: int, road: str, rng: np.random.Generator
) -> None:
    scene = wheel(tyre={**ROADS[road], "slip": SLIP if number % 2 else None}, moving=number % 4 > 1).build()
    system = derive(scene, ["residual", "partials", "energy", "forward_dynamics"])
    state = near_the_road(states_of(system, rng, count=40), rng)
    check_partials(system, state, 1e-11)
    state["a"] = tape_evaluator(system)("forward_dynamics", state)["vdot"]
    check_powers(system, state, 1e-11)


def test_a_wheel_that_moves_along_a_diagonal_has_the_slope_along_it(rng: np.random.Generator) -> None:
    """There x and y are one quantity times constants, which must not hide the slopes."""
    for sign in (1.0, -1.0):
        builder = SceneBuilder("sledge").body("sledge", 2.0).point("hub", "sledge")
        builder.joint("rail", "prismatic", "base", "sledge", axis=[1, sign, 0])
        builder.tyre("tyre", "hub", radius=0.3, stiffness=900.0, damping=40.0, onset=0.1, road=HILLY)
        system = derive(builder.build(), ["energy", "force", "forward_dynamics"])
        evaluate = tape_evaluator(system)
        state = random_states(system, 20, rng)
        state["a"] = evaluate("forward_dynamics", state)["vdot"]
        rate = derivative(evaluate, system.factors, "energy", state, {"q": state["v"], "v": state["a"]})["energy"]
        power = evaluate("energy", state)["energy"][:, 2]
        np.testing.assert_allclose(rate[:, 0] + rate[:, 1], power, rtol=1e-11, atol=1e-10)
        assert np.abs(evaluate("force", state)["Q"]).max() > 1.0


def test_a_tyre_on_a_body_that_is_fixed_to_the_base_does_nothing() -> None:
    builder = (
        SceneBuilder("stand")
        .body("stand", 1.0)
        .joint("bolt", "fixed", "base", "stand")
        .point("foot", "stand", [0, 0, 0.1])
    )
    builder.body("flap", 1.0, inertia=[0.1, 0.1, 0.1]).joint("hinge", "revolute", "stand", "flap", axis=[1, 0, 0])
    without = derive(builder.build(), ["force", "energy"])
    with_tyre = derive(builder.tyre("tyre", "foot", radius=0.3, stiffness=900.0).build(), ["force", "energy"])
    for function in ("force", "energy"):
        assert with_tyre.counts[function] == without.counts[function]


# -- motions -----------------------------------------------------------------------------------------------------------
