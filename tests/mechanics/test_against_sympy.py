"""Small systems against SymPy's own mechanics: Kane's and Lagrange's methods, written from scratch for each system."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
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
from tests.oracles.states import on_base, quaternion_product, random_states

TERMS = ["mass", "coupling", "force", "base_motion", "forward_dynamics"]
STATES = 20
t = me.dynamicsymbols._t
Equations = Callable[..., tuple[Array, Array]]


def numeric(
    coordinates: Sequence[Any], speeds: Sequence[Any], M: sm.Matrix, forcing: sm.Matrix, inputs: Sequence[Any] = ()
) -> Equations:
    """Return (q, v, t, u) -> (M, right-hand side) with plain symbols in place of functions of time."""
    plain = {item: sm.Symbol(f"y{k}") for k, item in enumerate([*speeds, *coordinates])}
    time = sm.Symbol("time")
    arguments = ([plain[item] for item in coordinates], [plain[item] for item in speeds], time, list(inputs))
    ready = [sm.Matrix(item).subs(plain).doit().subs(t, time) for item in (M, forcing)]
    return sm.lambdify(arguments, ready, cse=True)


def compare(
    scene: Scene, equations: Equations, rng: np.random.Generator, from_angles: Callable[[Array], Array] | None = None
) -> None:
    """Compare at random states; ``from_angles`` makes q of the three Euler angles that SymPy's equations use
    instead."""
    system = derive(scene, TERMS)
    evaluate = tape_evaluator(system)
    state = random_states(system, STATES, rng)
    coordinates = state["q"]
    if from_angles is not None:
        coordinates = rng.uniform(-1.2, 1.2, (STATES, 3))
        state["q"] = from_angles(coordinates)
    if scene.base is not None:
        state = on_base(evaluate, state)
    M, right = [], []
    for k in range(STATES):
        found = equations(coordinates[k], state["v"][k], state["t"][k, 0], state.get("u", np.zeros((STATES, 0)))[k])
        M.append(found[0])
        right.append(found[1].ravel())
    assert relative_error(evaluate("mass", state)["M"], np.array(M), 2) <= 1e-12
    separated = evaluate("force", state)["Q"] - evaluate("coupling", state)["h"]
    if scene.base is not None:
        separated = separated - evaluate("base_motion", state)["b"]
    assert relative_error(separated, np.array(right)) <= 1e-12
    vdot = np.linalg.solve(np.array(M), np.array(right)[..., np.newaxis])[..., 0]
    assert relative_error(evaluate("forward_dynamics", state)["vdot"], vdot) <= 1e-12


@cache
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
    compare(scene, ball_pendulum_of_kane(), rng, quaternions_of_angles)


@cache
def gimbal_of_lagrange() -> Equations:
    """A bob on two crossed hinges at a distance, the first of them with a rotor behind a gear."""
    first, second = me.dynamicsymbols("first second")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [first, N.x])
    B = A.orientnew("B", "Axis", [second, 0.6 * A.y + 0.8 * A.z])
    origin = me.Point("origin")
    origin.set_vel(N, 0)
    knee = origin.locatenew("knee", 0.2 * A.y - 0.1 * A.z)
    knee.v2pt_theory(origin, N, A)
    center = knee.locatenew("center", 0.1 * B.x - 0.7 * B.z)
    center.v2pt_theory(knee, N, B)
    body = me.RigidBody("bob", center, B, 1.2, (me.inertia(B, 0.2, 0.3, 0.15, 0.01, 0.02, 0.03), center))
    body.potential_energy = 1.2 * 9.81 * center.pos_from(origin).dot(N.z)
    lagrangian = me.Lagrangian(N, body) + 0.05 * first.diff() ** 2 / 2
    lagrange = me.LagrangesMethod(lagrangian, [first, second], frame=N)
    lagrange.form_lagranges_equations()
    return numeric([first, second], [first.diff(), second.diff()], lagrange.mass_matrix, lagrange.forcing)


@pytest.mark.slow
def test_gimbal_with_a_massless_ring_a_skew_axis_and_a_rotor(rng) -> None:
    ring, bob = rigid_body("ring", 0.0), rigid_body("bob", 1.2, (0.1, 0, -0.7), (0.2, 0.3, 0.15, 0.01, 0.03, 0.02))
    joints = (
        Joint("outer", "revolute", "base", "ring", (1, 0, 0), rotor_inertia=number(0.05)),
        Joint("inner", "revolute", "ring", "bob", (0, 0.6, 0.8), vector((0, 0.2, -0.1))),
    )
    compare(Scene("gimbal", (ring, bob), joints), gimbal_of_lagrange(), rng)
