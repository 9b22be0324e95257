"""Poses, twists, points and the base's law: against matrices multiplied along the tree, and against their own
derivatives."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.mechanics.kinematics.bodies import constant_quaternion
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Tape
from eomgen.system.description import BASE, Point
from eomgen.system.system import System
from tests.mechanics.checks import states_of
from tests.mechanics.test_beam_equations import LENGTH, beam_body
from tests.oracles import direct_kinematics
from tests.oracles.evaluation import Array, Evaluate, relative_error, tape_evaluator
from tests.oracles.formulas import value_of, vector
from tests.oracles.random_scenes import point_outputs, random_scene, with_base, with_loads
from tests.oracles.states import (
    derivative,
    random_unit_quaternions,
    rotation_of,
)

STATES = 6


def scene_of(seed: int) -> Scene:
    scene = point_outputs(with_loads(random_scene(seed, 2 + seed % 6, tunable=0.2 * (seed % 2)), seed))
    return with_base(scene, seed, turning=seed % 3 == 1) if seed % 3 else scene


@cache
def derived(seed: int) -> tuple[Scene, System]:
    scene = scene_of(seed)
    return scene, derive(scene, ["poses", "twists", "outputs"])


def prepared(seed: int, rng: np.random.Generator) -> tuple[Scene, System, Evaluate, dict[str, Array]]:
    scene, system = derived(seed)
    return scene, system, tape_evaluator(system), states_of(system, rng, STATES)


def placed(scene: Scene, state: dict[str, Array]) -> dict[str, tuple[Array, Array]]:
    """Return the poses of all bodies, and of the base, by direct kinematics."""
    base = (rotation_of(state["base"][:, :4]), state["base"][:, 4:7]) if scene.base is not None else None
    found = direct_kinematics.poses(scene, state["q"], base)
    found[BASE] = base if base is not None else (np.broadcast_to(np.eye(3), (STATES, 3, 3)), np.zeros((STATES, 3)))
    return found


@pytest.mark.parametrize("seed", range(9))
def test_poses(seed: int, rng) -> None:
    scene, system, evaluate, state = prepared(seed, rng)
    expected, found = placed(scene, state), evaluate("poses", state)["pose"]
    for k, name in enumerate(system.bodies):
        R, p = expected[name]
        assert relative_error(rotation_of(found[:, k, :4]), R, 2) <= 1e-13, name
        assert relative_error(found[:, k, 4:], p) <= 1e-13, name
        assert np.abs(np.linalg.norm(found[:, k, :4], axis=1) - 1.0).max() <= 1e-14


@pytest.mark.parametrize("seed", range(9))
def test_points_and_their_velocities_and_accelerations(seed: int, rng) -> None:
    scene, system, evaluate, state = prepared(seed, rng)
    # state, point, (position, velocity, acceleration), axis
    y = evaluate("outputs", state)["y"].reshape(STATES, -1, 3, 3)
    along = {"q": state["v"], "v": state["a"], "t": np.ones((STATES, 1))}
    rates = derivative(evaluate, system.factors, "outputs", state, along)["y"].reshape(y.shape)
    expected, parameters = placed(scene, state), direct_kinematics.parameter_values(scene)
    for k, point in enumerate(scene.points):
        R, p = expected[point.body]
        r = np.array([value_of(item, parameters) for item in point.position])
        assert relative_error(y[:, k, 0], p + R @ r) <= 1e-13, point.name
        assert relative_error(y[:, k, 1], rates[:, k, 0], floor=1e-3) <= 1e-12, f"velocity of {point.name}"
        assert relative_error(y[:, k, 2], rates[:, k, 1], floor=1e-3) <= 1e-12, f"acceleration of {point.name}"


def test_quaternion_of_a_constant_rotation_has_no_negative_real_part(rng) -> None:
    algebra = Algebra(Tape())
    for quaternion in [*random_unit_quaternions(rng, 50), *np.eye(4), *-np.eye(4)]:
        R = rotation_of(quaternion)
        found = np.array(constant_quaternion(algebra.matrix(R.tolist())))
        assert found[0] >= 0.0
        np.testing.assert_allclose(rotation_of(found), R, rtol=0, atol=1e-15)


def test_sign_of_quaternions_never_jumps() -> None:
    """Through two full turns every body's quaternion moves in small steps, and comes back to where it began."""
    scene = random_scene(2, 4)
    system = derive(scene, ["poses"])
    evaluate = tape_evaluator(system)
    turns = np.linspace(0.0, 4.0 * np.pi, 400)
    q = np.zeros((len(turns), system.nq))
    for factor in system.factors:
        if factor.group == "R":
            q[:, factor.q_start] = turns
        else:
            q[:, factor.q_start], q[:, factor.q_start + 3] = np.cos(turns / 2), np.sin(turns / 2)
    poses = evaluate("poses", {"q": q})["pose"][..., :4]
    assert np.abs(np.diff(poses, axis=0)).max() < 0.5
    np.testing.assert_allclose(poses[-1], poses[0], atol=1e-12)


def test_the_pose_of_a_beam_is_its_frames_whatever_is_attached_at_the_origin() -> None:
    """The axis of a beam with its frame in its middle bends away from the frame's origin, and a point there with the
    axis."""
    body = beam_body("beam", (("bending_y", 2),), 1)
    assert body.beam is not None
    deformations = tuple(replace(item, shapes="free_free") for item in body.beam.deformations)
    middle = replace(body, beam=replace(body.beam, start=-0.5 * LENGTH, deformations=deformations))
    plain = Scene("s", (middle,), (Joint("hinge", "revolute", BASE, "beam", position=vector((0.3, 0.1, 0.2))),))
    with_point = replace(plain, points=(Point("center", "beam", vector((0, 0, 0))),))
    state = {"q": np.array([0.4, 0.1, -0.05]), "v": np.array([0.5, 2.0, 1.0])}
    poses = [tape_evaluator(derive(scene, ["poses"]))("poses", state)["pose"] for scene in (plain, with_point)]
    np.testing.assert_array_equal(poses[0], poses[1])
    np.testing.assert_array_equal(poses[0][0, 4:], (0.3, 0.1, 0.2))
