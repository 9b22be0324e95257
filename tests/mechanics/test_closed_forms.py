"""Systems whose equations are known in closed form: written here by hand, from textbooks."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.errors import ModelError
from eomgen.mechanics.derive import derive
from eomgen.scene.bodies.model import Base, Body
from eomgen.scene.joints.model import Joint
from eomgen.scene.rotations import Rotation
from eomgen.scene.scene import Scene
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.formulas import TIME, rigid_body, times, vector
from tests.oracles.states import on_base, random_states, rotation_of

STATES = 10
IDENTITY_POSE = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def free_body(body: Body) -> Scene:
    return Scene("body", (body,), (Joint("float", "free", "base", body.name, initial_position=IDENTITY_POSE),))


def test_double_pendulum_of_point_masses(rng) -> None:
    """Equal unit masses and lengths, relative angles (Spong, Hutchinson and Vidyasagar, Robot Modeling and Control)."""
    masses = [rigid_body(name, 1.0, (1.0, 0, 0)) for name in ("upper", "lower")]
    joints = (
        Joint("shoulder", "revolute", "base", "upper", (0, 0, 1)),
        Joint("elbow", "revolute", "upper", "lower", (0, 0, 1), vector((1.0, 0, 0))),
    )
    system = derive(
        Scene("double", tuple(masses), joints, gravity=vector((0, -9.81, 0))), ["mass", "coupling", "force"]
    )
    evaluate, state = tape_evaluator(system), random_states(system, STATES, rng)
    (q1, q2), (v1, v2) = state["q"].T, state["v"].T
    c2, s2 = np.cos(q2), np.sin(q2)
    M = np.array([[3.0 + 2.0 * c2, 1.0 + c2], [1.0 + c2, np.ones(STATES)]]).transpose(2, 0, 1)
    h = np.stack([-s2 * (2.0 * v1 * v2 + v2**2), s2 * v1**2], axis=1)
    Q = -9.81 * np.stack([2.0 * np.cos(q1) + np.cos(q1 + q2), np.cos(q1 + q2)], axis=1)
    assert relative_error(evaluate("mass", state)["M"], M, 2) <= 1e-14
    assert relative_error(evaluate("coupling", state)["h"], h) <= 1e-14
    assert relative_error(evaluate("force", state)["Q"], Q) <= 1e-14


def test_free_rigid_body_obeys_newton_and_euler(rng) -> None:
    """I w' + w x I w = 0 and m (u' + w x u) = m R^T g in body axes, about the centre of mass."""
    inertia = np.array([[0.4, 0.01, -0.02], [0.01, 0.3, 0.03], [-0.02, 0.03, 0.2]])
    body = rigid_body("body", 1.7, (0, 0, 0), (0.4, 0.3, 0.2, 0.01, -0.02, 0.03))
    system = derive(free_body(body))
    evaluate, state = tape_evaluator(system), random_states(system, STATES, rng)
    omega, velocity = state["v"][:, :3], state["v"][:, 3:]
    expected = np.concatenate([np.cross(omega, omega @ inertia), 1.7 * np.cross(omega, velocity)], axis=1)
    assert relative_error(evaluate("coupling", state)["h"], expected) <= 1e-14
    weight = 1.7 * np.einsum("kji,j->ki", rotation_of(state["q"][:, :4]), [0, 0, -9.81])
    assert (
        relative_error(evaluate("force", state)["Q"], np.concatenate([np.zeros((STATES, 3)), weight], axis=1)) <= 1e-14
    )
    spin = np.linalg.solve(inertia, -np.cross(omega, omega @ inertia)[..., np.newaxis])[..., 0]
    fall = weight / 1.7 - np.cross(omega, velocity)
    assert relative_error(evaluate("forward_dynamics", state)["vdot"], np.concatenate([spin, fall], axis=1)) <= 1e-13
    assert system.facts.constant_mass


def test_gyroscopic_moment_of_a_wheel_on_a_turning_base() -> None:
    """A wheel that spins at s on a table turning at W needs the moment I s W across both: here it loads a tilt
    hinge."""
    axial, across = 0.04, 0.025
    frame = rigid_body("frame", 0.0)
    wheel = rigid_body("wheel", 1.0, (0, 0, 0), (axial, across, across, 0, 0, 0))
    joints = (
        Joint("tilt", "revolute", "base", "frame", (0, 1, 0)),
        Joint("spin", "revolute", "frame", "wheel", (1, 0, 0)),
    )
    table = Base(rotations=(Rotation((0, 0, 1), times(3.0, TIME)),))
    system = derive(Scene("gyroscope", (frame, wheel), joints, gravity=vector((0, 0, 0)), base=table))
    evaluate = tape_evaluator(system)
    state = {"q": np.zeros((1, 2)), "v": np.array([[0.0, 50.0]]), "a": np.zeros((1, 2)), "t": np.array([[0.4]])}
    b = evaluate("base_motion", on_base(evaluate, state))["b"]
    np.testing.assert_allclose(b, [[axial * 50.0 * 3.0, 0.0]], rtol=1e-14, atol=1e-14)


def test_bead_on_a_turning_rod() -> None:
    """m (x'' - W^2 x) along the rod: the base's centrifugal force and nothing of h."""
    bead, joint = rigid_body("bead", 0.4), Joint("slide", "prismatic", "base", "bead", (1, 0, 0))
    table = Base(rotations=(Rotation((0, 0, 1), times(5.0, TIME)),))
    system = derive(Scene("bead", (bead,), (joint,), base=table))
    evaluate = tape_evaluator(system)
    state = on_base(
        evaluate, {"q": np.array([[0.3]]), "v": np.array([[2.0]]), "a": np.array([[1.0]]), "t": np.array([[0.2]])}
    )
    np.testing.assert_allclose(evaluate("base_motion", state)["b"], [[-0.4 * 25.0 * 0.3]], rtol=1e-14)
    np.testing.assert_allclose(evaluate("partials", state)["K"], [[[-0.4 * 25.0]]], rtol=1e-14)
    np.testing.assert_array_equal(evaluate("coupling", state)["h"], [[0.0]])


def test_unknown_term_is_named() -> None:
    rod = rigid_body("rod", 1.0, (0.5, 0, 0), (0, 0, 0.1, 0, 0, 0))
    scene = Scene("pendulum", (rod,), (Joint("hinge", "revolute", "base", "rod", (0, 0, 1)),))
    with pytest.raises(ModelError, match=r"no term is called 'inertia'.*one of mass, mass_values, coupling"):
        derive(scene, ["inertia"])


def test_scene_without_motion_is_refused() -> None:
    rod = rigid_body("rod", 1.0)
    with pytest.raises(ModelError, match="scene 'welded' has no moving joint"):
        derive(Scene("welded", (rod,), (Joint("weld", "fixed", "base", "rod"),)))
