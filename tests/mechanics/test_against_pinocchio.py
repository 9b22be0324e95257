"""Robots from URDF files against Pinocchio (Carpentier et al. 2019): two readers, two algorithms, one set of
numbers."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.load import load
from eomgen.system.system import System
from tests.oracles.evaluation import Array, Evaluate, relative_error, tape_evaluator
from tests.oracles.pinocchio_oracle import PinocchioOracle, oracle_from_urdf, oracle_of_tree, robot_file
from tests.oracles.robots import panda
from tests.oracles.states import random_states

FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
ROBOTS: dict[str, tuple[str, str, tuple[str, ...], int]] = {
    "panda": ("panda_description/urdf/panda.urdf", "fixed", FINGERS, 7),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", "fixed", (), 6),
    "anymal_b": ("anymal_b_simple_description/robots/anymal.urdf", "free", (), 18),
    "solo12": ("solo_description/robots/solo12.urdf", "free", (), 18),
    "talos": ("talos_data/robots/talos_reduced.urdf", "free", (), 38),
    "double_pendulum_continuous": ("double_pendulum_description/urdf/double_pendulum_continuous.urdf", "fixed", (), 2),
}
LARGE = {"anymal_b", "talos"}
TERMS = ["mass", "coupling", "force", "inverse_dynamics", "forward_dynamics"]
STATES = 20


@cache
def model(name: str) -> tuple[System, Evaluate, PinocchioOracle, Array]:
    """Return a robot's system, its functions, Pinocchio's model of the same file, and the joints' damping by
    component."""
    path, root, lock, _ = ROBOTS[name]
    scene = load(robot_file(path), root=root, lock=lock)
    system = derive(scene, TERMS)
    # numbers in a URDF
    damping = {joint.name: joint.damping.value for joint in scene.joints}  # type: ignore[union-attr]
    by_component = np.array([damping[factor.name] for factor in system.factors for _ in range(factor.v_size)])
    return system, tape_evaluator(system), oracle_from_urdf(robot_file(path), scene, root, lock), by_component


@pytest.fixture(params=[pytest.param(name, marks=[pytest.mark.slow] * (name in LARGE)) for name in ROBOTS])
def robot(request: pytest.FixtureRequest) -> tuple[System, Evaluate, PinocchioOracle, Array]:
    return model(request.param)


@pytest.mark.slow_except("double_pendulum_continuous")
@pytest.mark.parametrize("name", ROBOTS)
def test_both_readers_agree_before_snapping(name: str) -> None:
    system, _, oracle, _ = model(name)
    assert system.nv == ROBOTS[name][3]
    assert oracle.deviation < 5e-9, "the scene's placements or inertias are not those of the file"


def test_mass_matrix(robot, rng) -> None:
    system, evaluate, oracle, _ = robot
    state = random_states(system, STATES, rng)
    assert relative_error(evaluate("mass", state)["M"], oracle.mass(state), 2) <= 1e-12


def test_coupling(robot, rng) -> None:
    system, evaluate, oracle, _ = robot
    state = random_states(system, STATES, rng)
    assert relative_error(evaluate("coupling", state)["h"], oracle.coupling(state)) <= 1e-12


def test_force_is_weight_and_damping(robot, rng) -> None:
    system, evaluate, oracle, damping = robot
    state = random_states(system, STATES, rng)
    expected = oracle.weight(state) - damping * state["v"]
    assert relative_error(evaluate("force", state)["Q"], expected) <= 1e-12


def test_inverse_dynamics(robot, rng) -> None:
    system, evaluate, oracle, damping = robot
    state = random_states(system, STATES, rng)
    expected = oracle.inverse_dynamics(state) + damping * state["v"]
    assert relative_error(evaluate("inverse_dynamics", state)["tau"], expected) <= 1e-12


@pytest.mark.slow_except("ur5")
def test_forward_dynamics(robot, rng) -> None:
    """Errors of any solution grow with the condition of M; the residual of ours, by Pinocchio's rnea, does not."""
    system, evaluate, oracle, damping = robot
    state = random_states(system, STATES, rng)
    found = evaluate("forward_dynamics", state)["vdot"]
    expected = oracle.forward_dynamics(state, -damping * state["v"])
    assert relative_error(found, expected) <= 1e-12


def test_partials_of_the_arm(rng) -> None:
    scene = panda()
    system = derive(scene, ["partials"])
    evaluate = tape_evaluator(system)
    oracle = oracle_of_tree(scene)
    state = random_states(system, STATES, rng)
    found = evaluate("partials", state)
    by_q, by_v = oracle.partials(state)
    assert relative_error(found["K"], by_q, 2) <= 1e-12
    assert relative_error(found["C"], by_v, 2) <= 1e-12
    assert relative_error(found["M"], oracle.mass(state), 2) <= 1e-12


@pytest.mark.parametrize("name", [pytest.param("anymal_b", marks=pytest.mark.slow), "solo12"])
def test_partials_with_a_free_root(name: str, rng) -> None:
    path, root, lock, _ = ROBOTS[name]
    system = derive(load(robot_file(path), root=root, lock=lock), ["partials"])
    evaluate, (_, _, oracle, damping) = tape_evaluator(system), model(name)
    state = random_states(system, STATES, rng)
    found = evaluate("partials", state)
    by_q, by_v = oracle.partials(state)
    assert relative_error(found["K"], by_q, 2) <= 1e-12
    assert relative_error(found["C"], by_v + np.diag(damping), 2) <= 1e-12
