"""Systems of SymPy as models: accelerations against SymPy's own mass matrix and forcing; runs, C, refusals."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from sympy.physics import mechanics as me
from sympy.physics.biomechanics import (
    FirstOrderActivationDeGroote2016,
    MusculotendonDeGroote2016,
    MusculotendonFormulation,
)
from sympy.physics.mechanics import dynamicsymbols

import eomgen
from tests.sympy_mechanics.corpus import accelerations, compared, value

T = dynamicsymbols._t


def oscillator() -> Any:
    """Of LagrangesMethod, with a force and a potential that varies over time."""
    q, force = dynamicsymbols("q f")
    m, k, w = sympy.symbols("m k omega")
    frame, point = me.ReferenceFrame("N"), me.Point("P")
    point.set_vel(frame, q.diff(T) * frame.x)
    lagrangian = m * q.diff(T) ** 2 / 2 - k * (q - sympy.sin(w * T)) ** 4 / 4
    return me.LagrangesMethod(lagrangian, [q], forcelist=[(point, force * frame.x)], frame=frame)


def disc() -> Any:
    """A rolling disc with components of the angular velocity as speeds: the centre has a velocity and no place."""
    q, u = list(dynamicsymbols("q1:4")), list(dynamicsymbols("u1:4"))
    r, m, g = sympy.symbols("r m g")
    ground = me.ReferenceFrame("N")
    yaw = ground.orientnew("Y", "Axis", [q[0], ground.z])
    lean = yaw.orientnew("L", "Axis", [q[1], yaw.x])
    wheel = lean.orientnew("R", "Axis", [q[2], lean.y])
    turned = wheel.ang_vel_in(ground)
    wheel.set_ang_vel(ground, u[0] * lean.x + u[1] * lean.y + u[2] * lean.z)
    contact = me.Point("C")
    contact.set_vel(ground, 0)
    center = contact.locatenew("D", r * lean.z)
    center.v2pt_theory(contact, ground, wheel)
    inertia = me.inertia(lean, m * r**2 / 4, m * r**2 / 2, m * r**2 / 4)
    body = me.RigidBody("disc", center, wheel, m, (inertia, center))
    apart = turned - u[0] * lean.x - u[1] * lean.y - u[2] * lean.z
    return me.KanesMethod(
        ground,
        q_ind=q,
        u_ind=u,
        kd_eqs=[apart.dot(axis) for axis in lean],
        bodies=[body],
        forcelist=[(center, -m * g * yaw.z)],
    )


def cart() -> Any:
    """A System of joints with gravity, a spring along a path, a damper, and a cable around a cylinder."""
    length, m, g, k, c, r = sympy.symbols("l m g k c r")
    rail, wagon, bob = me.RigidBody("rail"), me.RigidBody("wagon"), me.RigidBody("bob", mass=m)
    system = me.System.from_newtonian(rail)
    slider = me.PrismaticJoint("slider", rail, wagon, joint_axis=rail.x)
    pin = me.PinJoint("pin", wagon, bob, joint_axis=wagon.z, child_point=length * bob.y)
    system.add_joints(slider, pin)
    system.apply_uniform_gravity(-g * rail.y)
    force = dynamicsymbols("F")
    system.add_loads(me.Force(wagon.masscenter, force * rail.x))
    hook = bob.masscenter.locatenew("hook", r * bob.x)
    winch = wagon.masscenter.locatenew("winch", r * wagon.y)
    drum = me.WrappingCylinder(r, wagon.masscenter, wagon.z)
    rim = wagon.masscenter.locatenew("rim", r * wagon.frame.x)
    rim.set_vel(rail.frame, rim.vel(rail.frame))
    winch.set_vel(rail.frame, winch.vel(rail.frame))
    system.add_actuators(
        me.LinearSpring(k, me.LinearPathway(hook, rail.masscenter), length / 2),
        me.TorqueActuator(-c * pin.speeds[0], wagon.z, bob, wagon),
        me.ForceActuator(k, me.WrappingPathway(winch, rim, drum)),
        me.LinearDamper(c, me.ObstacleSetPathway(hook, rim, rail.masscenter)),
        me.DuffingSpring(k, k, me.LinearPathway(bob.masscenter, winch), r),
    )
    return system


def wheel() -> Any:
    """A disc that rolls upright without slip, with a speed for its angle, which moves nothing, and auxiliary speeds of
    its contact."""
    q, u, extra = list(dynamicsymbols("x y yaw")), list(dynamicsymbols("u1:5")), list(dynamicsymbols("a1:3"))
    m, r, g = sympy.symbols("m r g")
    push = dynamicsymbols("F")
    plane, origin, center = me.ReferenceFrame("N"), me.Point("O"), me.Point("C")
    origin.set_vel(plane, 0)
    runner = plane.orientnew("R", "Axis", [q[2], plane.z])
    runner.set_ang_vel(plane, u[2] * plane.z)
    disc = me.ReferenceFrame("D")  # without an orientation
    disc.set_ang_vel(runner, u[3] * runner.y)
    center.set_pos(origin, q[0] * plane.x + q[1] * plane.y + r * plane.z)
    center.set_vel(plane, u[0] * plane.x + u[1] * plane.y)
    contact = center.locatenew("P", -r * plane.z)
    moved = extra[0] * runner.x + extra[1] * runner.y
    contact.set_vel(plane, center.vel(plane) + disc.ang_vel_in(plane).cross(-r * plane.z) + moved)
    inertia = me.inertia(runner, m * r**2 / 4, m * r**2 / 2, m * r**2 / 4)
    body = me.RigidBody("disc", center, disc, m, (inertia, center))
    loads = [(center, push * runner.x - m * g * plane.z)]
    slip = [contact.vel(plane).dot(axis).subs(dict.fromkeys(extra, 0)) for axis in (runner.x, runner.y)]
    return me.KanesMethod(
        plane,
        q_ind=q,
        u_ind=u[2:],
        u_dependent=u[:2],
        u_auxiliary=extra,
        velocity_constraints=slip,
        kd_eqs=[item.diff(T) - speed for item, speed in zip(q, u[:3], strict=True)],
        bodies=[body],
        forcelist=loads,
    )


def sleigh() -> Any:
    """A rigid body on a knife edge, which makes one of three speeds dependent: Chaplygin."""
    q, u = list(dynamicsymbols("x y theta")), list(dynamicsymbols("u1:4"))
    m, inertia, a, drag = sympy.symbols("m I a c")
    plane = me.ReferenceFrame("N")
    runner = plane.orientnew("R", "Axis", [q[2], plane.z])
    runner.set_ang_vel(plane, u[2] * plane.z)
    origin, edge = me.Point("O"), me.Point("E")
    origin.set_vel(plane, 0)
    edge.set_pos(origin, q[0] * plane.x + q[1] * plane.y)
    edge.set_vel(plane, u[0] * plane.x + u[1] * plane.y)
    center = edge.locatenew("C", a * runner.x)
    center.v2pt_theory(edge, plane, runner)
    body = me.RigidBody("sleigh", center, runner, m, (me.inertia(runner, 0, 0, inertia), center))
    return me.KanesMethod(
        plane,
        q_ind=q,
        u_ind=[u[0], u[2]],
        u_dependent=[u[1]],
        velocity_constraints=[edge.vel(plane).dot(runner.y)],
        kd_eqs=[item.diff(T) - speed for item, speed in zip(q, u, strict=True)],
        bodies=[body],
        forcelist=[(edge, -drag * u[0] * plane.x)],
    )


def rocket() -> Any:
    """A body that loses mass along a slope, with an inertia that falls with time: rates of both are inertial forces."""
    q, u = list(dynamicsymbols("x a")), list(dynamicsymbols("u1:3"))
    m, k, thrust = sympy.symbols("m k thrust")
    plane, origin = me.ReferenceFrame("N"), me.Point("O")
    origin.set_vel(plane, 0)
    turned = plane.orientnew("B", "Axis", [q[1], plane.z])
    turned.set_ang_vel(plane, u[1] * plane.z)
    nose = origin.locatenew("C", q[0] * plane.x)
    nose.set_vel(plane, u[0] * plane.x)
    mass = m * sympy.exp(-k * T) + m * q[0] ** 2 / 9
    center = nose.locatenew("S", k * turned.x)
    center.v2pt_theory(nose, plane, turned)
    body = me.RigidBody("rocket", center, turned, mass, (me.inertia(turned, 1, 1, mass / 3), center))
    return me.KanesMethod(
        plane,
        q_ind=q,
        u_ind=u,
        kd_eqs=[one.diff(T) - speed for one, speed in zip(q, u, strict=True)],
        bodies=[body],
        forcelist=[(nose, thrust * turned.x)],
    )


CASES = (oscillator, disc, cart, sleigh, wheel, rocket)


@pytest.mark.parametrize("made", CASES, ids=lambda made: made.__name__)
def test_equations_are_those_of_sympy(made: Callable[[], Any]) -> None:
    error, _ = compared(made(), states=1)
    assert error < 1e-12


def test_matrices_are_evaluated_as_they_are_written() -> None:
    """M(q) and f(q, v, t) with a Piecewise, roots and powers, on both sides of the conditions."""
    q = list(dynamicsymbols("x y"))
    v = [item.diff(T) for item in q]
    a, b = sympy.symbols("a b")
    mass = sympy.Matrix([[a + q[1] ** 2, b / 4], [b / 4, a * sympy.sqrt(1 + q[0] ** 2)]])
    stop = sympy.Piecewise((q[0] ** 3, (q[0] > 0.5) & sympy.Ne(q[1], 2)), (sympy.Abs(q[0]), True))
    stop += sympy.sinc(q[0]) * sympy.sec(q[1]) + sympy.Heaviside(q[0] - sympy.Rational(2, 5))
    force = sympy.Matrix([-stop * v[1], sympy.exp(-q[1]) / (a + sympy.cos(T)) - b * v[0] ** sympy.Rational(2)])
    document = eomgen.from_sympy((mass, force), parameters={a: 1.0, b: 1.1}, q=q)
    of_motion = sympy.lambdify([v, q, T], [item.xreplace({a: 1.0, b: 1.1}) for item in (mass, force)])
    for x, y in ((0.3, 0.4), (0.45, 0.2), (0.8, 0.7), (0.8, 2.0)):
        state = {"q": [x, y], "v": [0.6, -0.9], "t": [0.37], "p": [*document.parameters.values()]}
        expected = np.linalg.solve(*of_motion(state["v"], state["q"], 0.37)).ravel()
        np.testing.assert_allclose(accelerations(document, state), expected, rtol=1e-12)


def pendulum() -> tuple[Any, list[Any], dict[Any, float]]:
    """A point on a circle in x and y: description, coordinates, values of the symbols."""
    x, y = dynamicsymbols("x y")
    m, g, length = sympy.symbols("m g l")
    lagrangian = m * (x.diff(T) ** 2 + y.diff(T) ** 2) / 2 - m * g * y
    system = me.LagrangesMethod(lagrangian, [x, y], hol_coneqs=[x**2 + y**2 - length**2])
    return system, [x, y], {m: 2.0, g: 9.81, length: 1.0}


def test_constraints_are_equations_of_the_model() -> None:
    """The start is on the circle, and the multiplier is the tension of the string over twice its length."""
    system, (x, y), values = pendulum()
    document = eomgen.from_sympy(system, parameters=values, initial={x: 0.5, y: -0.8, x.diff(T): 1.0})
    q, v = np.array(document.initial_q), np.array(document.initial_v)
    np.testing.assert_allclose([q @ q, q @ v], [1.0, 0.0], atol=1e-12)
    assert document.rows.names == ("holonomic 1: formula",)
    derived = eomgen.derive(document, ["residual", "constraint", "constraint_velocity", "energy"])
    assert derived.facts.constraints
    assert derived.facts.conservative
    assert not derived.facts.velocity_constraints
    tension = 2.0 * (v @ v - 9.81 * q[1])
    a = (np.array([0.0, -2.0 * 9.81]) - tension * q) / 2.0
    state = {"q": q, "v": v, "a": a, "lam": [0.5 * tension], "p": [*document.parameters.values()]}
    for name, expected in (("residual", [0, 0]), ("constraint", [0]), ("constraint_velocity", [0])):
        result = value(derived, name, state)
        np.testing.assert_allclose(result, expected, atol=1e-11)


@pytest.mark.slow
def test_constraints_hold_along_runs() -> None:
    """Positions, to rounding, over 20 000 steps; accelerations of the pendulum, and its frequency."""
    system, (x, y), values = pendulum()
    document = eomgen.from_sympy(system, parameters=values, initial={x: 0.5, y: -0.8, x.diff(T): 1.0})
    model = eomgen.build(document, profile="quick")
    for method in ("rk4_partitioned", "generalized_alpha"):
        run = model.simulate(20.0, 1e-3, method=method)
        assert run.success
        assert np.abs(np.sum(run.q**2, axis=1) - 1.0).max() <= 1e-12
        assert np.ptp(run.energy["total"]) < 1e-4
    modes = model.linearize(model.equilibrium().q).modes()
    np.testing.assert_allclose(np.abs(modes.eigenvalues), np.sqrt(9.81), rtol=1e-9)


def test_places_that_time_moves_have_a_driver() -> None:
    """A point on a rail that is moved by sin(w t): the rate of its energy is the power of the driver, F v_t."""
    q, (m, w) = dynamicsymbols("q"), sympy.symbols("m w")
    frame, origin = me.ReferenceFrame("N"), me.Point("O")
    origin.set_vel(frame, 0)
    place = origin.locatenew("P", q * frame.x + sympy.sin(w * T) * frame.x)
    place.set_vel(frame, place.pos_from(origin).dt(frame))
    u = dynamicsymbols("u")
    system = me.KanesMethod(frame, [q], [u], [q.diff(T) - u], bodies=[me.Particle("p", place, m)], forcelist=[])
    document = eomgen.from_sympy(system, parameters={m: 2.0, w: 3.0})
    derived = eomgen.derive(document, ["energy", "poses"])
    state = {"q": [0.3], "v": [0.7], "a": [1.1], "t": [0.4], "p": [*document.parameters.values()]}
    result = value(derived, "energy", state)
    speed = 0.7 + 3.0 * np.cos(1.2)
    np.testing.assert_allclose(result, [speed**2, 0.0, 0.0, 2.0 * speed * (1.1 - 9.0 * np.sin(1.2))], atol=1e-13)
    np.testing.assert_allclose(value(derived, "poses", state), [1, 0, 0, 0, 0.3 + np.sin(1.2), 0, 0])


def test_any_rotation_has_a_quaternion() -> None:
    """Of a frame by three angles about fixed axes, which SymPy keeps as one matrix, over all four cases."""
    angles = dynamicsymbols("a b c")
    frame, origin = me.ReferenceFrame("N"), me.Point("O")
    origin.set_vel(frame, 0)
    turned = frame.orientnew("B", "Space", angles, "ZXY")
    body = me.RigidBody("b", origin, turned, 1, (me.inertia(turned, 1, 2, 3), origin))
    speeds = dynamicsymbols("u1:4")
    kinematic = [angle.diff(T) - speed for angle, speed in zip(angles, speeds, strict=True)]
    document = eomgen.from_sympy(me.KanesMethod(frame, angles, speeds, kinematic, bodies=[body], forcelist=[]))
    derived = eomgen.derive(document, ["poses"])
    matrix = sympy.lambdify([angles], frame.dcm(turned))
    for q in ([0.1, 0.2, 0.3], [3.0, 0.1, 0.2], [0.1, 3.0, 0.1], [0.2, 0.1, 3.0], [3.0, 3.1, 2.9]):
        w, x, y, z = value(derived, "poses", {"q": q})[:4]
        own = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        np.testing.assert_allclose(np.eye(3) + 2 * w * own + 2 * own @ own, matrix(q), atol=1e-14)


def test_coordinates_without_inertia_move_by_constraints() -> None:
    """A spring's end has no mass and is at s = x^2 of a cart, so M is singular: a = -2 k x^3 / m of the cart."""
    x, s = dynamicsymbols("x s")
    m, k = sympy.symbols("m k")
    system = me.LagrangesMethod(m * x.diff(T) ** 2 / 2 - k * s**2 / 2, [x, s], hol_coneqs=[s - x**2])
    start = {x: 0.4, s: 0.16, x.diff(T): 0.5, s.diff(T): 0.4}
    document = eomgen.from_sympy(system, parameters={m: 2.0, k: 3.0}, initial=start)
    state = {"q": document.initial_q, "v": document.initial_v, "p": [*document.parameters.values()]}
    a = -2.0 * 3.0 * 0.4**3 / 2.0
    rates = accelerations(document, state)
    np.testing.assert_allclose(rates, [a, 2.0 * 0.5**2 + 2.0 * 0.4 * a], rtol=1e-13)
    of_spring = {**state, "a": rates, "lam": [-3.0 * 0.16]}
    np.testing.assert_allclose(value(eomgen.derive(document, ["residual"]), "residual", of_spring), 0.0, atol=1e-13)


def muscle(tendon: Any) -> tuple[Any, Any, dict[Any, float], dict[Any, float]]:
    """An arm on a pin with a biceps: system, muscle, values, initial state."""
    length, m, g, r = sympy.symbols("l m g r")
    wall, arm = me.RigidBody("wall"), me.RigidBody("arm", mass=m)
    system = me.System.from_newtonian(wall)
    pin = me.PinJoint("pin", wall, arm, joint_axis=wall.z, child_point=length * arm.y)
    system.add_joints(pin)
    system.apply_uniform_gravity(-g * wall.y)
    first = wall.masscenter.locatenew("origin", r * wall.x)
    second = arm.masscenter.locatenew("insertion", length / 2 * arm.y + r * arm.x)
    activation = FirstOrderActivationDeGroote2016.with_defaults("biceps")
    pathway = me.LinearPathway(first, second)
    biceps = MusculotendonDeGroote2016.with_defaults("biceps", pathway, activation, musculotendon_dynamics=tendon)
    system.add_actuators(biceps)
    values = {"l": 0.3, "m": 1.0, "g": 9.81, "r": 0.05, "arm_izz": 0.01}
    values |= {"l_T_slack_biceps": 0.03, "F_M_max_biceps": 100.0, "l_M_opt_biceps": 0.12}
    return system, biceps, values, {pin.coordinates[0]: 0.3} | dict.fromkeys(biceps.x, 0.6)


@pytest.mark.slow
@pytest.mark.parametrize("tendon", list(MusculotendonFormulation)[:3], ids=lambda item: item.name.lower())
def test_states_of_muscles_are_internal_states(tendon: Any) -> None:
    """Rates of activation, and of fibers or tendons, and the acceleration, are the ones of SymPy."""
    system, biceps, values, start = muscle(tendon)
    document = eomgen.from_sympy(system, parameters=values, initial=start, name="arm")
    assert [*document.states] == [str(item.func) for item in biceps.x]
    assert document.inputs == ("e_biceps",)
    derived = eomgen.derive(document, ["internal_rate", "forward_dynamics"])
    system.form_eoms()
    motion = system.eom_method
    rates = [*biceps.rhs(), motion.forcing[0] / motion.mass_matrix[0]]
    known = {item: values[str(item)] for item in sympy.Matrix(rates).free_symbols - {T}}
    q, u, turned = motion.q[0], motion.u[0], motion.kindiffdict()
    own = sympy.lambdify([q, u, list(biceps.x), biceps.r[0]], [item.doit().subs(turned).subs(known) for item in rates])
    state = {"q": [0.3], "v": [0.2], "z": [0.6, 0.7][: len(biceps.x)], "u": [0.4], "p": [*document.parameters.values()]}
    expected = np.array(own(0.3, 0.2, state["z"], 0.4), dtype=float)
    results = [value(derived, name, state) for name in ("internal_rate", "forward_dynamics")]
    np.testing.assert_allclose(np.concatenate(results), expected, rtol=1e-10)
    if tendon is MusculotendonFormulation.RIGID_TENDON:
        model = eomgen.build(document, profile="quick")
        ends = [
            model.simulate(1.0, 1e-3, method=name, inputs={"e_biceps": 0.5}) for name in ("rk4", "generalized_alpha")
        ]
        np.testing.assert_allclose(ends[0].z[-1], ends[1].z[-1], atol=1e-5)
        np.testing.assert_allclose(ends[0].q[-1], ends[1].q[-1], atol=1e-4)


def test_further_functions_of_time_have_rates() -> None:
    """A filtered force: z' = (f - z) / tau."""
    q, f, z = dynamicsymbols("q f z")
    m, tau = sympy.symbols("m tau")
    frame, point = me.ReferenceFrame("N"), me.Point("P")
    point.set_vel(frame, q.diff(T) * frame.x)
    system = me.LagrangesMethod(m * q.diff(T) ** 2 / 2, [q], forcelist=[(point, z * frame.x)], frame=frame)
    document = eomgen.from_sympy(system, parameters={m: 2, tau: 0.5}, states={z: (f - z) / tau}, initial={z: 3.0})
    assert (document.states, document.inputs) == ({"z": 3.0}, ("f",))
    derived = eomgen.derive(document, ["internal_rate", "internal_partials"])
    state = {"q": [0.0], "v": [0.0], "z": [3.0], "u": [1.0], "t": [0.0], "p": [*document.parameters.values()]}
    for name, expected in (("internal_rate", [-4.0]), ("internal_partials", [-1.0, 0.0, 0.0, -2.0])):
        np.testing.assert_allclose(value(derived, name, state), expected)


def test_symbols_without_an_effect_are_no_parameters() -> None:
    """The mass of a lone disc cancels in no term, but r of a point does."""
    document = eomgen.from_sympy(disc(), parameters={"g": 9.81, "m": 2.0, "r": 0.5})
    assert [*document.parameters] == ["g", "m", "r"]
    assert document.coordinates == ("q1", "q2", "q3")
    assert document.speeds == ("u1", "u2", "u3")
    q, (m, k, free) = dynamicsymbols("q"), sympy.symbols("m k free")
    lagrangian = m * q.diff(T) ** 2 / 2 - k * q**2 / 2 + free
    document = eomgen.from_sympy(me.LagrangesMethod(lagrangian, [q]), parameters={m: 1, "k": 2, free: 3})
    assert document.parameters == {"k": 2.0, "m": 1.0}


@pytest.mark.slow
def test_it_runs_is_linear_and_is_written_as_c(tmp_path: Path) -> None:
    """An oscillator about rest and its C, which needs no library."""
    q, (m, k) = dynamicsymbols("q"), sympy.symbols("m k")
    system = me.LagrangesMethod(m * q.diff(T) ** 2 / 2 - k * q**2 / 2, [q])
    document = eomgen.from_sympy(system, parameters={m: 2.0, k: 8.0}, initial={q: 1.0}, name="oscillator")
    model = eomgen.build(document, profile="quick")
    for method in ("rk4", "generalized_alpha"):
        run = model.simulate(1.0, 1e-3, method=method)
        assert run.success
        np.testing.assert_allclose(run.q[-1], np.cos(2.0), atol=1e-5)
    run = model.simulate(1.0, 1e-3, method="rk4", parameters={"k": 2.0})
    np.testing.assert_allclose(run.q[-1], np.cos(1.0), atol=1e-10)
    np.testing.assert_allclose(np.abs(model.linearize().modes().eigenvalues), 2.0)
    eomgen.generate(document, tmp_path, method="rk4")
    command = "cc -std=c99 -Wall -Wextra -Wpedantic -Werror *.c -lm -o program && ./program"
    done = subprocess.run(command, shell=True, cwd=tmp_path, capture_output=True, text=True, check=True)
    last = [float(item) for item in done.stdout.splitlines()[-1].split(",")]
    np.testing.assert_allclose(last[1], np.cos(2.0 * last[0]), atol=1e-9)


def particle(mass: Any = 1) -> Any:
    """Return the frame and a particle on its x axis, at the coordinate q."""
    frame, origin = me.ReferenceFrame("N"), me.Point("O")
    origin.set_vel(frame, 0)
    point = origin.locatenew("P", dynamicsymbols("q") * frame.x)
    point.set_vel(frame, point.pos_from(origin).dt(frame))
    return frame, me.Particle("p", point, mass)


def moved(mass: Any) -> Any:
    """Return a KanesMethod of a particle with a mass that may be anything."""
    (frame, body), q, u = particle(mass), *dynamicsymbols("q u")
    return me.KanesMethod(frame, [q], [u], [q.diff(T) - u], bodies=[body], forcelist=[])


#: Arguments that are none, with the answer; m and q are a symbol and a coordinate of a free mass.
M, Q, R = sympy.Symbol("m"), dynamicsymbols("q"), dynamicsymbols("r")
FREE = M * Q.diff(T) ** 2 / 2
NONE: tuple[tuple[str, type[Exception], str, Callable[[], object]], ...] = (
    ("no value", eomgen.UsageError, "no values for m", lambda: eomgen.from_sympy(me.LagrangesMethod(FREE, [Q]))),
    ("no system", eomgen.UsageError, "int is none of SymPy's descriptions", lambda: eomgen.from_sympy(3)),
    ("no constraint met", eomgen.DescriptionError, "the constraints are not met",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE, [Q], hol_coneqs=[Q**2 + 1]), parameters={M: 1})),
    ("a function", eomgen.DescriptionError, "the function gamma has no",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE - sympy.gamma(Q), [Q]), parameters={M: 1})),
    ("a rate", eomgen.DescriptionError, r"the rate Derivative\(r",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE + Q * R.diff(T), [Q]), parameters={M: 1})),
    ("no symbol", eomgen.UsageError, "the system has no free symbol k",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE, [Q]), parameters={M: 1, "k": 1})),
    ("no bodies", eomgen.DescriptionError, "the KanesMethod has no bodies",
     lambda: eomgen.from_sympy(me.KanesMethod(particle()[0], q_ind=[Q], u_ind=[R], kd_eqs=[Q.diff(T) - R]))),
    ("matrices without q", eomgen.UsageError, "matrices alone have no coordinates",
     lambda: eomgen.from_sympy((sympy.eye(1), [0]))),
    ("another size", eomgen.DescriptionError, "and f 1 entries",
     lambda: eomgen.from_sympy((sympy.eye(2), [0]), q=[Q])),
    ("text as M", eomgen.UsageError, "a matrix of expressions is needed for M, not a list",
     lambda: eomgen.from_sympy(([["m"]], [0]), q=[Q])),
    ("text as q", eomgen.DescriptionError, "'q' is not a coordinate; try: dynamicsymbols",
     lambda: eomgen.from_sympy((sympy.eye(1), [0]), q=["q"])),
    ("q twice", eomgen.DescriptionError, "two coordinates have the name 'q'",
     lambda: eomgen.from_sympy((sympy.eye(2), [0, 0]), q=[Q, Q])),
    ("M is not symmetric", eomgen.DescriptionError, r"M\[0, 1\] is 2 and M\[1, 0\] is 0",
     lambda: eomgen.from_sympy((sympy.Matrix([[1, 2], [0, 1]]), [0, 0]), q=[Q, R])),
    ("no mapping", eomgen.UsageError, "parameters: values by symbol are needed, not a list",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE, [Q]), parameters=[1])),  # type: ignore[arg-type]
    ("not finite", eomgen.UsageError, "the value of m is nan, not a finite number",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE, [Q]), parameters={M: float("nan")})),
    ("an acceleration", eomgen.UsageError, "there is no coordinate Derivative",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE, [Q]), parameters={M: 1}, initial={Q.diff(T, 2): 1})),
    ("no name", eomgen.UsageError, "None is not a name",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE, [Q]), name=None)),  # type: ignore[arg-type]
    ("a function of q", eomgen.DescriptionError, r"the function f\(q\(t\)\) has no counterpart",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE - sympy.Function("f")(Q), [Q]), parameters={M: 1})),
    ("an integral", eomgen.DescriptionError, "the function Integral has no counterpart",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE - sympy.Integral(Q, (M, 0, 1)), [Q]), parameters={M: 1})),
    ("no finite constant", eomgen.DescriptionError, "the number 'nan' has no counterpart",
     lambda: eomgen.from_sympy((sympy.Matrix([[sympy.nan]]), [0]), q=[Q])),
    ("nonlinear in rates", eomgen.DescriptionError, "constraint of velocities number 1 is not linear in the rates",
     lambda: eomgen.from_sympy(
         me.LagrangesMethod(FREE + R.diff(T) ** 2, [Q, R], nonhol_coneqs=[Q.diff(T) ** 2 + R.diff(T) ** 2 - 1]),
         parameters={M: 1}, initial={Q.diff(T): 1})),
    ("no body", eomgen.DescriptionError, "'a' is not a body; try: RigidBody or Particle",
     lambda: eomgen.from_sympy(me.KanesMethod(
         particle()[0], [Q], [R], [Q.diff(T) - R], bodies=["a"], forcelist=[]))),
    ("no kinematic equations", eomgen.DescriptionError, "1 coordinates have 1 speeds and 0 kinematic equations",
     lambda: eomgen.from_sympy(me.KanesMethod(particle()[0], [Q], [R], bodies=[particle()[1]], forcelist=[]))),
    ("no coordinates", eomgen.DescriptionError, "the system has no coordinates",
     lambda: eomgen.from_sympy(me.System())),
    ("a mass of an input", eomgen.DescriptionError, "a place or a mass depends on an input",
     lambda: eomgen.from_sympy(moved(dynamicsymbols("w")))),
    ("two frames of one name", eomgen.DescriptionError, "no orientation in N, another frame of this name",
     lambda: eomgen.from_sympy(me.KanesMethod(
         particle()[0], [Q], [R], [Q.diff(T) - R], bodies=[particle()[1]], forcelist=[]))),
    ("a rate as text", eomgen.UsageError, "the rate of r\\(t\\) is 'x', not an expression",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE, [Q]), parameters={M: 1}, states={R: "x"})),
    ("a coordinate as a state", eomgen.UsageError, r"'q\(t\)' cannot be an internal state",
     lambda: eomgen.from_sympy(me.LagrangesMethod(FREE, [Q]), parameters={M: 1}, states={Q: -Q})),
)  # fmt: skip  # a table


@pytest.mark.parametrize(("kind", "text", "call"), [row[1:] for row in NONE], ids=[row[0] for row in NONE])
def test_arguments_that_are_none_have_one_answer(kind: type[Exception], text: str, call: Callable[[], object]) -> None:
    with pytest.raises(kind, match=text):
        call()


def test_coordinates_without_a_mass_are_named() -> None:
    """Forces alone are derived, and accelerations refused; a mass of zero, or a negative one, is noted."""
    lagrangian = FREE - R**2 * sympy.Symbol("k")
    document = eomgen.from_sympy(me.LagrangesMethod(lagrangian, [Q, R]), parameters={M: 1, "k": 2})
    assert [note.code for note in document.observed.notes] == ["W0262"]
    assert set(eomgen.derive(document, ["mass", "force"]).functions) == {"mass", "force"}
    with pytest.raises(
        eomgen.ModelError, match="no mass moves with the coordinate r, so the mass matrix has no inverse"
    ):
        eomgen.derive(document, ["forward_dynamics"])
    document = eomgen.from_sympy(me.LagrangesMethod(FREE, [Q]), parameters={M: -1})
    assert "negative eigenvalue at the start" in document.observed.notes[0]


def test_greek_letters_have_the_names_of_sympy() -> None:
    lagrangian = FREE * sympy.Symbol("λ") - Q**2 * sympy.Symbol("Ω_ü₁")
    document = eomgen.from_sympy(me.LagrangesMethod(lagrangian, [Q]), parameters={M: 1, "λ": 2, "Omega_u1": 3})
    assert document.parameters == {"m": 1, "lambda": 2, "Omega_u1": 3}


def test_potential_energies_of_bodies_act_in_lagrangians_alone() -> None:
    """SymPy's equations of Kane leave them out without a word."""
    ground, bob = me.RigidBody("ground"), me.Particle("bob", mass=2)
    system = me.System.from_newtonian(ground)
    system.add_joints(me.PrismaticJoint("slide", ground, bob, Q, Q.diff(T), joint_axis=ground.z))
    bob.potential_energy = 5 * Q**2
    document = eomgen.from_sympy(system)
    assert document.observed.notes[0].startswith(
        "no force follows from the potential energy of bob in Kane's equations"
    )
    system.form_eoms(me.LagrangesMethod)
    document = eomgen.from_sympy(system)
    assert not document.observed.notes
    np.testing.assert_allclose(accelerations(document, {"q": [0.5], "v": [0.0]}), [-2.5])
    assert [hinge.name for hinge in document.observed.drawing.hinges] == ["slide"]


def test_an_angular_velocity_that_contradicts_the_orientation_is_refused() -> None:
    """As of a frame on a frame that turns, with the rate of its own angle alone."""
    q, u = dynamicsymbols("q1:3"), dynamicsymbols("u1:3")
    plane, origin = me.ReferenceFrame("N"), me.Point("O")
    origin.set_vel(plane, 0)
    first = plane.orientnew("A", "Axis", [q[0], plane.z])
    second = first.orientnew("B", "Axis", [q[1], first.z])
    second.set_ang_vel(plane, u[1] * plane.z)
    body = me.RigidBody("b", origin, second, 1, (me.inertia(second, 1, 1, 1), origin))
    kinematic = [one.diff(T) - speed for one, speed in zip(q, u, strict=True)]
    system = me.KanesMethod(plane, q, u, kinematic, bodies=[body], forcelist=[])
    with pytest.raises(eomgen.DescriptionError, match="angular velocity of the frame B is not the rate of the"):
        eomgen.from_sympy(system)
