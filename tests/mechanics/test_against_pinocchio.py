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
from tests.oracles.pinocchio_oracle import PinocchioOracle, oracle_from_urdf, robot_file
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


@pytest.mark.slow_cases("talos")
@pytest.mark.parametrize("name", ROBOTS)
def test_every_term_of_a_robot(name: str, rng: np.random.Generator) -> None:
    """Both readers agree before right angles are made exact; forward dynamics errs by the condition of M."""
    system, evaluate, oracle, damping = model(name)
    assert system.nv == ROBOTS[name][3]
    assert oracle.deviation < 5e-9, "the scene's placements or inertias are not those of the file"
    state = random_states(system, STATES, rng)
    resistance = damping * state["v"]
    assert relative_error(evaluate("mass", state)["M"], oracle.mass(state), 2) <= 1e-12
    for term, block, expected in (
        ("coupling", "h", oracle.coupling(state)),
        ("force", "Q", oracle.weight(state) - resistance),
        ("inverse_dynamics", "tau", oracle.inverse_dynamics(state) + resistance),
        ("forward_dynamics", "vdot", oracle.forward_dynamics(state, -resistance)),
    ):
        assert relative_error(evaluate(term, state)[block], expected) <= 1e-12, term


@pytest.mark.slow_cases("anymal_b")
@pytest.mark.parametrize("name", ["panda", "anymal_b", "solo12"])
def test_partials(name: str, rng: np.random.Generator) -> None:
    path, root, lock, _ = ROBOTS[name]
    system = derive(load(robot_file(path), root=root, lock=lock), ["partials"])
    _, _, oracle, damping = model(name)
    state = random_states(system, STATES, rng)
    found = tape_evaluator(system)("partials", state)
    by_q, by_v = oracle.partials(state)
    for block, expected in (("K", by_q), ("C", by_v + np.diag(damping)), ("M", oracle.mass(state))):
        assert relative_error(found[block], expected, 2) <= 1e-12, block
