"""A body on a ball joint with a spring and wind, against Kane's method of SymPy's own mechanics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
import sympy as sm
import sympy.physics.mechanics as me

from eomgen.formula.nodes import Symbol
from eomgen.mechanics.derive import derive
from eomgen.scene.forces.forces import Force
from eomgen.scene.forces.springs import Spring
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.description import Point
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.formulas import number, rigid_body, times, vector
from tests.oracles.states import quaternion_product, random_states

TERMS = ["mass", "coupling", "force", "forward_dynamics"]
STATES = 20
Equations = Callable[..., tuple[Array, Array]]


def numeric(coordinates: Sequence[Any], speeds: Sequence[Any], M: sm.Matrix, forcing: sm.Matrix) -> Equations:
    """Return (q, v) -> (M, right-hand side) with plain symbols in place of functions of time."""
    plain = {item: sm.Symbol(f"y{k}") for k, item in enumerate([*speeds, *coordinates])}
    arguments = ([plain[item] for item in coordinates], [plain[item] for item in speeds])
    return sm.lambdify(arguments, [sm.Matrix(item).subs(plain).doit() for item in (M, forcing)], cse=True)


def ball_pendulum_of_kane() -> Equations:
    """A rigid body on a ball joint in Euler angles, with the body's own angular velocity as speeds, pulled by a
    spring."""
    angles, speeds = me.dynamicsymbols("q1:4"), me.dynamicsymbols("u1:4")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Body", angles, "123")
    omega = A.ang_vel_in(N)
    kinematics = [omega.dot(axis) - u for axis, u in zip(A, speeds, strict=True)]
    turning = sum((u * axis for axis, u in zip(A, speeds, strict=True)), me.Vector(0))
    A.set_ang_vel(N, turning)
    hinge = me.Point("hinge")
    hinge.set_vel(N, 0)
    center = hinge.locatenew("center", 0.1 * A.x + 0.2 * A.y - 0.5 * A.z)
    tip = hinge.locatenew("tip", 0.3 * A.x - 1.0 * A.z)
    for point in (center, tip):
        point.v2pt_theory(hinge, N, A)
    post = hinge.locatenew("post", 1.0 * N.x + 0.4 * N.y - 0.7 * N.z)
    span = post.pos_from(tip)
    length = sm.sqrt(span.dot(span))
    stretching = -tip.vel(N).dot(span) / length
    pull = (40.0 * (length - 0.5) + 3.0 * stretching) / length * span
    wind = -0.6 * tip.vel(N)
    body = me.RigidBody("bob", center, A, 1.5, (me.inertia(A, 0.3, 0.25, 0.2, 0.01, 0.02, -0.03), center))
    kane = me.KanesMethod(N, angles, speeds, kd_eqs=kinematics)
    kane.kanes_equations([body], [(center, -9.81 * 1.5 * N.z), (tip, pull + wind)])
    return numeric(angles, speeds, kane.mass_matrix, kane.forcing)


def quaternions_of_angles(angles: Array) -> Array:
    """Return the quaternions of intrinsic turns about x, y, z."""
    total = np.broadcast_to([1.0, 0.0, 0.0, 0.0], (len(angles), 4))
    for k in range(3):
        turn = np.zeros((len(angles), 4))
        turn[:, 0], turn[:, 1 + k] = np.cos(angles[:, k] / 2), np.sin(angles[:, k] / 2)
        total = quaternion_product(total, turn)
    return total


@pytest.mark.slow
def test_body_on_a_ball_joint_with_spring_damper_and_wind(rng) -> None:
    body = rigid_body("bob", 1.5, (0.1, 0.2, -0.5), (0.3, 0.25, 0.2, 0.01, -0.03, 0.02))
    joint = Joint("ball", "spherical", "base", "bob", initial_position=(1.0, 0, 0, 0))
    points = (Point("post", "base", vector((1.0, 0.4, -0.7))), Point("tip", "bob", vector((0.3, 0, -1.0))))
    spring = Spring("rope", "post", "tip", number(40), number(3), number(0.5))
    drag = vector([times(-0.6, Symbol("velocity", "tip", k)) for k in range(3)])
    wind = Force("wind", "bob", points[1].position, drag, vector((0, 0, 0)))
    scene = Scene("ball", (body,), (joint,), points=points, elements=(spring, wind))
    system, equations = derive(scene, TERMS), ball_pendulum_of_kane()
    evaluate, state = tape_evaluator(system), random_states(system, STATES, rng)
    angles = rng.uniform(-1.2, 1.2, (STATES, 3))
    state["q"] = quaternions_of_angles(angles)
    expected = [equations(*pair) for pair in zip(angles, state["v"], strict=True)]
    M, right = np.array([one for one, _ in expected]), np.array([other.ravel() for _, other in expected])
    assert relative_error(evaluate("mass", state)["M"], M, 2) <= 1e-12
    assert relative_error(evaluate("force", state)["Q"] - evaluate("coupling", state)["h"], right) <= 1e-12
    vdot = np.linalg.solve(M, right[..., np.newaxis])[..., 0]
    assert relative_error(evaluate("forward_dynamics", state)["vdot"], vdot) <= 1e-12
