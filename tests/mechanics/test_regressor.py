"""The regressor: Y pi + tau0 = tau, columns against Pinocchio's and against complex steps, and what they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import eomgen
from eomgen.errors import EomgenError, UsageError
from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import describe
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from tests.mechanics.checks import states_of
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.pinocchio_oracle import robot_file
from tests.oracles.random_scenes import random_scene, with_base, with_loads, with_mimics
from tests.oracles.robots import panda
from tests.oracles.states import STEP, random_states
from tests.oracles.urdf_robots import oracle_of_scene, robot_files

TERMS = ["inverse_dynamics", "regressor", "regressor_parameters"]
#: Pinocchio's columns of a body in the order of ours: its inertia is xx, xy, yy, xz, yz, zz.
PINOCCHIO = [0, 1, 2, 3, 4, 6, 9, 5, 7, 8]


def closed(scene: Scene, rng: np.random.Generator) -> tuple[float, dict[str, Array], dict[str, Array]]:
    """Return by how much Y pi + tau0 differs from tau, relative to its norm, with states and Y at them."""
    system = derive(scene, TERMS)
    evaluate, state = tape_evaluator(system), states_of(system, rng)
    found, pi = evaluate("regressor", state), evaluate("regressor_parameters", state)["pi"]
    assert found["Y"].shape == (4, system.nv, len(describe(scene).linear_parameters))
    tau = np.einsum("sip,sp->si", found["Y"], np.broadcast_to(pi, (4, pi.shape[-1]))) + found["tau0"]
    return relative_error(tau, evaluate("inverse_dynamics", state)["tau"]), state, found


def against_pinocchio(path: Path, root: str, rng: np.random.Generator) -> tuple[float, float]:
    """Return errors of Y pi and of Y's columns of bodies, both relative to norms."""
    scene = load(path, root=root)
    error, state, found = closed(scene, rng)
    oracle, q, projection = oracle_of_scene(path, scene, root)
    numbers = [number for number, *_ in oracle.joints]
    expected = []
    for k in range(len(state["q"])):
        motion = (oracle.v(projection @ state[name][k]) for name in "va")
        Y = pin.computeJointTorqueRegressor(oracle.model, oracle.data, oracle.q(q(state["q"][k])), *motion)
        columns = [10 * (number - 1) + place for number in numbers for place in PINOCCHIO]
        expected.append(projection.T @ Y[oracle.order][:, columns])
    return error, relative_error(found["Y"][..., : 10 * len(numbers)], np.array(expected), 2)


@pytest.mark.slow_cases("free")
@pytest.mark.parametrize("root", ["fixed", "free"])
def test_a_robot_against_pinocchio(root: str, rng: np.random.Generator) -> None:
    error, of_columns = against_pinocchio(robot_file("ur_description/urdf/ur5_robot.urdf"), root, rng)
    assert error <= 1e-13
    assert of_columns <= 1e-11


@pytest.mark.long
def test_every_fifth_robot_against_pinocchio(rng: np.random.Generator) -> None:
    compared = 0
    for name, path in list(robot_files().items())[::5]:
        for root in ("fixed", "free"):
            try:
                load(path, root=root)
            except EomgenError:
                continue
            error, of_columns = against_pinocchio(path, root, rng)
            assert error <= 1e-13, (name, root)
            assert of_columns <= 1e-11, (name, root)
            compared += 1
    assert compared > 20


@pytest.mark.slow_except("1")
@pytest.mark.parametrize("seed", range(6))
def test_random_trees_with_loads_friction_and_rotors(seed: int, rng: np.random.Generator) -> None:
    scene = with_loads(random_scene(seed, 2 + seed % 4, tunable=0.3 * (seed % 2)), seed)
    for other in (scene, with_base(scene, seed), with_mimics(scene, seed)):
        error, _, found = closed(other, rng)
        assert error <= 1e-13
        assert np.any(found["tau0"])


def arm() -> Scene:
    """Return two links with everything that joints have, a spring between them, a motor, and a body welded on."""
    builder = eomgen.SceneBuilder("arm").parameter("load", 0.7, tunable=True)
    builder.parameter("dry", 0.3, tunable=True).parameter("viscous", 0.0, tunable=True)
    builder.input("torque")
    builder.body("upper", 2.0, center_of_mass=[0.1, 0.2, -0.3], inertia=[0.3, 0.4, 0.2, 0.01, 0.02, 0.03])
    friction = {"coulomb": "dry", "velocity": 0.05, "static": "1.5 * dry", "stribeck": 0.2}
    builder.joint("shoulder", "revolute", "base", "upper", axis=[0, 0.6, 0.8], rotor_inertia=0.05, friction=friction)
    builder.body("lower", 1.0, center_of_mass=[0, 0, -0.2], inertia=[0.05, 0.05, 0.02])
    builder.joint("rail", "prismatic", "upper", "lower", axis=[1, 0, 0], position=[0, 0, -0.5], damping="viscous")
    builder.body("tool", "load", center_of_mass=[0, 0.05, 0], inertia=[0.01, 0.01, 0.01])
    builder.joint("flange", "fixed", "lower", "tool", position=[0, 0, -0.4], rotation=[([1, 0, 0], 0.3)])
    builder.body("stand", 5.0, inertia=[1, 1, 1]).joint("bolts", "fixed", "base", "stand")
    builder.effort("motor", "shoulder", "torque - 3 * q.shoulder")
    return builder.build()


def test_columns_have_names_units_and_values(rng: np.random.Generator) -> None:
    scene = arm()
    parameters = {item.name: item.unit for item in describe(scene).linear_parameters}
    assert list(parameters)[:10] == [f"upper.{name}" for name in (
        "mass", "first_moment_x", "first_moment_y", "first_moment_z",
        "inertia_xx", "inertia_yy", "inertia_zz", "inertia_xy", "inertia_xz", "inertia_yz",
    )]  # fmt: skip  # a table
    assert not any(name.startswith("stand") for name in parameters)  # which nothing moves
    of_joints = {name: unit for name, unit in parameters.items() if name.partition(".")[0] in ("shoulder", "rail")}
    assert of_joints == {
        "shoulder.rotor_inertia": "kg m^2",
        "shoulder.coulomb": "N m",
        "shoulder.static": "N m",
        "rail.damping": "N s/m",  # a tunable parameter, which is 0 by default
    }
    assert (parameters["tool.mass"], parameters["tool.first_moment_y"], parameters["tool.inertia_xy"]) == (
        "kg",
        "kg m",
        "kg m^2",
    )
    error, _, _ = closed(scene, rng)
    assert error <= 1e-13


def test_columns_are_derivatives_of_inverse_dynamics(rng: np.random.Generator) -> None:
    """By complex steps in parameters of the scene, which each column must be alone."""
    system = derive(arm(), TERMS)
    evaluate = tape_evaluator(system)
    state = random_states(system, 4, rng)
    Y = evaluate("regressor", state)["Y"]
    names = [item.name for item in describe(arm()).linear_parameters]

    def by(parameter: int) -> Array:
        p = state["p"].astype(complex)
        p[:, parameter] += 1j * STEP
        return evaluate("inverse_dynamics", {**state, "p": p})["tau"].imag / STEP

    def column(name: str) -> Array:
        return Y[..., names.index(name)]

    # mass m at c, of a given inertia about it: m c, and m (c c 1 - c c^T) about the origin
    of_load = column("tool.mass") + 0.05 * column("tool.first_moment_y")
    of_load = of_load + 0.05**2 * (column("tool.inertia_xx") + column("tool.inertia_zz"))
    assert relative_error(of_load, by(0)) <= 1e-13
    assert relative_error(column("shoulder.coulomb") + 1.5 * column("shoulder.static"), by(1)) <= 1e-13
    assert relative_error(column("rail.damping"), by(2)) <= 1e-13


def test_what_the_regressor_costs() -> None:
    """The Panda's 7 x 70 matrix in fewer operations than half of the partials in q and v."""
    assert derive(panda(), ["regressor"]).counts["regressor"].flops == 1485


@pytest.mark.slow
def test_where_there_is_none() -> None:
    builder = eomgen.SceneBuilder("blade").beam(
        "blade", 1.0, mass_per_length=1.0, bending_y={"modes": 1, "stiffness": 9.0}
    )
    builder.joint("hub", "revolute", "base", "blade", axis=[0, 0, 1])
    beam = eomgen.build(builder.build(), ["inverse_dynamics"])
    with pytest.raises(
        UsageError, match="regressor: the bodies blade deform, and ten numbers do not give their inertia"
    ):
        beam.regressor(beam.initial_q, beam.initial_v, beam.initial_v)
    builder = eomgen.SceneBuilder("rod", coordinates="absolute").body("rod", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("pin", "revolute", "base", "rod", axis=[0, 1, 0])
    absolute = eomgen.build(builder.build(), ["inverse_dynamics"])
    with pytest.raises(UsageError, match=r'try: joint coordinates: eomgen\.load\(path, coordinates="joint"\)'):
        absolute.regressor_parameters()
