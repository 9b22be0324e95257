"""Body Jacobians against Pinocchio's frames and complex steps of the poses; accelerations against complex steps of the
twists."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.formula.nodes import ZERO, Number
from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from tests.mechanics.checks import states_of
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.random_scenes import random_scene, with_base
from tests.oracles.states import angular_velocity, derivative, jacobian, rotation_of

STATES = 5


def scene_of(seed: int) -> Scene:
    scene = random_scene(seed, 2 + seed % 5, tunable=0.2 * (seed % 2))
    return with_base(scene, seed, turning=seed % 3 == 1) if seed % 3 else scene


def in_absolute_coordinates(scene: Scene) -> Scene:
    groups = {body.name: ("SE3", "R3xSO3")[k % 2] for k, body in enumerate(scene.bodies)}
    joints = tuple(replace(joint, rotor_inertia=ZERO) for joint in scene.joints)
    massive = (Number(1.0),) * 3 + (ZERO,) * 3
    # it takes no massless ones
    bodies = tuple(replace(body, mass=Number(1.0), inertia=massive) for body in scene.bodies)
    return replace(scene, coordinates="absolute", groups=groups, joints=joints, bodies=bodies)


@pytest.mark.parametrize("absolute", [False, True], ids=["joint", "absolute"])
@pytest.mark.parametrize("seed", range(6))
def test_columns_are_complex_steps_of_the_poses(seed: int, absolute: bool, rng: np.random.Generator) -> None:
    """omega~ = R^T dR and v = R^T dx along each left-trivialised direction; a moving base takes no part."""
    scene = in_absolute_coordinates(scene_of(seed)) if absolute else scene_of(seed)
    system = derive(scene, ["poses", "jacobians"])
    assert system.functions["jacobians"].inputs in (("q",), ("p", "q"))
    evaluate, state = tape_evaluator(system), states_of(system, rng, STATES)
    poses, found = evaluate("poses", state)["pose"], evaluate("jacobians", state)["J"]
    rates = jacobian(evaluate, system.factors, "poses", "pose", state, "q")
    for k in range(len(system.bodies)):
        omega = angular_velocity(poses[:, k, :4, np.newaxis], rates[:, k, :4], axis=1)
        linear = np.einsum("sji,sjk->sik", rotation_of(poses[:, k, :4]), rates[:, k, 4:])
        assert relative_error(found[:, k], np.concatenate([omega, linear], axis=1), 2, floor=1e-3) <= 1e-12


@pytest.mark.parametrize("absolute", [False, True], ids=["joint", "absolute"])
@pytest.mark.parametrize("seed", range(6))
def test_accelerations_are_rates_of_twists(seed: int, absolute: bool, rng: np.random.Generator) -> None:
    """In body axes the origin accelerates with dv/dt + omega x v, v being the components of its velocity."""
    scene = in_absolute_coordinates(scene_of(seed)) if absolute else scene_of(seed)
    system = derive(scene, ["twists", "accelerations"])
    evaluate, state = tape_evaluator(system), states_of(system, rng, STATES)
    along = {"q": state["v"], "v": state["a"], "t": np.ones((STATES, 1))}
    rates = derivative(evaluate, system.factors, "twists", state, along)["twist"]
    twist, found = evaluate("twists", state)["twist"], evaluate("accelerations", state)["acceleration"]
    expected = rates.copy()
    expected[..., 3:] += np.cross(twist[..., :3], twist[..., 3:])
    assert relative_error(found, expected, floor=1e-3) <= 1e-12


def test_they_are_made_only_when_asked_for() -> None:
    system = derive(random_scene(0, 3))
    assert {"poses", "twists"} <= set(system.functions)
    assert not {"jacobians", "accelerations"} & set(system.functions)
