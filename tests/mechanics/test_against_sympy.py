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
from eomgen.scene.bodies.model import Base
from eomgen.scene.forces.forces import Effort, Force
from eomgen.scene.forces.springs import Spring
from eomgen.scene.joints.model import Joint
from eomgen.scene.rotations import Rotation
from eomgen.scene.scene import Scene
from eomgen.system.description import Point
from eomgen.system.signals import Input
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.formulas import TIME, call, number, plus, rigid_body, times, vector
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
def double_pendulum_of_kane() -> Equations:
    q1, q2, u1, u2 = me.dynamicsymbols("q1 q2 u1 u2")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [q1, N.y])
    B = A.orientnew("B", "Axis", [q2, A.y])
    A.set_ang_vel(N, u1 * N.y)
    B.set_ang_vel(A, u2 * A.y)
    hinge = me.Point("hinge")
    hinge.set_vel(N, 0)
    elbow = hinge.locatenew("elbow", -0.8 * A.z)
    center_1, center_2 = hinge.locatenew("c1", -0.35 * A.z + 0.1 * A.x), elbow.locatenew("c2", -0.3 * B.z)
    for point, frame, origin in ((elbow, A, hinge), (center_1, A, hinge), (center_2, B, elbow)):
        point.v2pt_theory(origin, N, frame)
    bodies = [
        me.RigidBody("first", center_1, A, 1.3, (me.inertia(A, 0.2, 0.25, 0.1), center_1)),
        me.RigidBody("second", center_2, B, 0.7, (me.inertia(B, 0.05, 0.06, 0.02), center_2)),
    ]
    torque_1 = -(5.0 * (q1 - 0.2) + 0.3 * u1) * N.y
    torque_2 = -(2.0 * q2 + 0.15 * u2) * N.y
    loads = [(center_1, -9.81 * 1.3 * N.z), (center_2, -9.81 * 0.7 * N.z), (A, torque_1 - torque_2), (B, torque_2)]
    kane = me.KanesMethod(N, [q1, q2], [u1, u2], kd_eqs=[q1.diff() - u1, q2.diff() - u2])
    kane.kanes_equations(bodies, loads)
    return numeric([q1, q2], [u1, u2], kane.mass_matrix, kane.forcing)


@pytest.mark.slow
def test_double_pendulum_with_springs_and_dampers(rng) -> None:
    first = rigid_body("first", 1.3, (0.1, 0, -0.35), (0.2, 0.25, 0.1, 0, 0, 0))
    second = rigid_body("second", 0.7, (0, 0, -0.3), (0.05, 0.06, 0.02, 0, 0, 0))
    axis = (0.0, 1.0, 0.0)
    joints = (
        Joint("hinge", "revolute", "base", "first", axis, stiffness=number(5), damping=number(0.3), rest=number(0.2)),
        Joint(
            "elbow",
            "revolute",
            "first",
            "second",
            axis,
            vector((0, 0, -0.8)),
            stiffness=number(2),
            damping=number(0.15),
        ),
    )
    compare(Scene("double", (first, second), joints), double_pendulum_of_kane(), rng)


@cache
def shaken_pendulum_of_kane() -> Equations:
    """A physical pendulum whose hinge is carried by a frame that shakes and pitches by given laws."""
    q, u = me.dynamicsymbols("q u")
    N = me.ReferenceFrame("N")
    pitch = 0.4 * sm.sin(1.7 * t) + 0.2 * t
    Z = N.orientnew("Z", "Axis", [0.3 * sm.cos(2 * t), N.z])
    S = Z.orientnew("S", "Axis", [pitch, Z.x])
    A = S.orientnew("A", "Axis", [q, S.y])
    A.set_ang_vel(S, u * S.y)
    fixed = me.Point("fixed")
    fixed.set_vel(N, 0)
    base = fixed.locatenew(
        "base", 0.2 * sm.sin(3 * t) * N.x + 0.1 * sm.cos(5 * t) * N.y + 0.3 * sm.sin(2 * t) ** 2 * N.z
    )
    base.set_vel(N, base.pos_from(fixed).dt(N))
    hinge = base.locatenew("hinge", 0.5 * S.x - 0.2 * S.y + 0.1 * S.z)
    hinge.v2pt_theory(base, N, S)
    center = hinge.locatenew("center", 0.15 * A.x - 0.6 * A.z)
    center.v2pt_theory(hinge, N, A)
    body = me.RigidBody("rod", center, A, 2.0, (me.inertia(A, 0.3, 0.4, 0.2, 0.02, -0.03, 0.01), center))
    kane = me.KanesMethod(N, [q], [u], kd_eqs=[q.diff() - u])
    kane.kanes_equations([body], [(center, -9.81 * 2.0 * N.z)])
    return numeric([q], [u], kane.mass_matrix, kane.forcing)


@pytest.mark.slow
def test_pendulum_on_a_shaking_base(rng) -> None:
    # SymPy's inertia(frame, xx, yy, zz, xy, yz, zx); ours xx, yy, zz, xy, xz, yz
    rod = rigid_body("rod", 2.0, (0.15, 0, -0.6), (0.3, 0.4, 0.2, 0.02, 0.01, -0.03))
    swing = call("sin", times(2.0, TIME))
    across = times(0.2, call("sin", times(3.0, TIME))), times(0.1, call("cos", times(5.0, TIME)))
    position = vector([*across, times(0.3, times(swing, swing))])
    pitch = plus(times(0.4, call("sin", times(1.7, TIME))), times(0.2, TIME))
    base = Base(position, (Rotation((0, 0, 1), times(0.3, call("cos", times(2.0, TIME)))), Rotation((1, 0, 0), pitch)))
    joint = Joint("hinge", "revolute", "base", "rod", (0, 1, 0), vector((0.5, -0.2, 0.1)))
    compare(Scene("shaken", (rod,), (joint,), base=base), shaken_pendulum_of_kane(), rng)


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
def cart_pole_of_lagrange() -> Equations:
    x, angle = me.dynamicsymbols("x angle")
    force = sm.Symbol("force")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [angle, N.y])
    origin = me.Point("origin")
    origin.set_vel(N, 0)
    cart = origin.locatenew("cart", x * N.x)
    cart.set_vel(N, x.diff() * N.x)
    center = cart.locatenew("center", 0.4 * A.z)
    center.v2pt_theory(cart, N, A)
    trolley = me.Particle("trolley", cart, 3.0)
    pole = me.RigidBody("pole", center, A, 0.5, (me.inertia(A, 0, 0.03, 0), center))
    pole.potential_energy = 0.5 * 9.81 * center.pos_from(origin).dot(N.z)
    trolley.potential_energy = 6.0 * x**2
    drag = -0.2 * x.diff() * N.x
    lagrange = me.LagrangesMethod(
        me.Lagrangian(N, trolley, pole), [x, angle], forcelist=[(cart, force * N.x + drag)], frame=N
    )
    lagrange.form_lagranges_equations()
    return numeric([x, angle], [x.diff(), angle.diff()], lagrange.mass_matrix, lagrange.forcing, [force])


def test_cart_and_pole(rng) -> None:
    cart = rigid_body("cart", 3.0)
    pole = rigid_body("pole", 0.5, (0, 0, 0.4), (0, 0.03, 0, 0, 0, 0))
    joints = (
        Joint("slide", "prismatic", "base", "cart", (1, 0, 0), stiffness=number(12), damping=number(0.2)),
        Joint("hinge", "revolute", "cart", "pole", (0, 1, 0)),
    )
    effort = Effort("motor", "slide", Symbol("input", "force"))
    scene = Scene("cart_pole", (cart, pole), joints, inputs=(Input("force"),), elements=(effort,))
    compare(scene, cart_pole_of_lagrange(), rng)


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


@pytest.mark.long
def test_gimbal_with_a_massless_ring_a_skew_axis_and_a_rotor(rng) -> None:
    ring, bob = rigid_body("ring", 0.0), rigid_body("bob", 1.2, (0.1, 0, -0.7), (0.2, 0.3, 0.15, 0.01, 0.03, 0.02))
    joints = (
        Joint("outer", "revolute", "base", "ring", (1, 0, 0), rotor_inertia=number(0.05)),
        Joint("inner", "revolute", "ring", "bob", (0, 0.6, 0.8), vector((0, 0.2, -0.1))),
    )
    compare(Scene("gimbal", (ring, bob), joints), gimbal_of_lagrange(), rng)
