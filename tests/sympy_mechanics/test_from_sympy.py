"""Systems of SymPy as models: accelerations against SymPy's own mass matrix and forcing; runs, C, refusals."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import sympy
from sympy.physics import mechanics as me
from sympy.physics.mechanics import dynamicsymbols

import eomgen
from eomgen.symbolic.evaluate import evaluate
from tests.models.cache import shared_cache

__all__ = ["shared_cache"]

T = dynamicsymbols._t


class Case(NamedTuple):
    """A description, and SymPy's M and f of M udot = f with the rates of coordinates by the speeds."""

    system: Any
    mass: Any
    force: Any
    q: list[Any]
    u: list[Any]
    rates: dict[Any, Any]
    inputs: tuple[Any, ...] = ()


def oscillator() -> Case:
    """Of LagrangesMethod, with a force and a potential that varies over time."""
    q, force = dynamicsymbols("q f")
    m, k, w = sympy.symbols("m k omega")
    frame, point = me.ReferenceFrame("N"), me.Point("P")
    point.set_vel(frame, q.diff(T) * frame.x)
    lagrangian = m * q.diff(T) ** 2 / 2 - k * (q - sympy.sin(w * T)) ** 4 / 4
    system = me.LagrangesMethod(lagrangian, [q], forcelist=[(point, force * frame.x)], frame=frame)
    system.form_lagranges_equations()
    return Case(system, system.mass_matrix, system.forcing, [q], [q.diff(T)], {q.diff(T): q.diff(T)}, (force,))


def disc() -> Case:
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
    system = me.KanesMethod(
        ground,
        q_ind=q,
        u_ind=u,
        kd_eqs=[apart.dot(axis) for axis in lean],
        bodies=[body],
        forcelist=[(center, -m * g * yaw.z)],
    )
    system.kanes_equations()
    return Case(system, system.mass_matrix, system.forcing, q, u, system.kindiffdict())


def cart() -> Case:
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
    )
    system.form_eoms()
    return Case(
        system,
        system.mass_matrix,
        system.forcing,
        list(system.q),
        list(system.u),
        system.eom_method.kindiffdict(),
        (force,),
    )


def rattleback() -> Case:
    """An ellipsoid that rolls on a plane, whose principal axes of inertia are turned: Kane and Levinson 1982."""
    q, u = list(dynamicsymbols("q1:4")), list(dynamicsymbols("u1:4"))
    m, g, a, b, c, h, sigma = sympy.symbols("m g a b c h sigma")
    plane = me.ReferenceFrame("N")
    yaw = plane.orientnew("Y", "Axis", [q[0], plane.z])
    lean = yaw.orientnew("L", "Axis", [q[1], yaw.x])
    stone = lean.orientnew("R", "Axis", [q[2], lean.y])
    turned = stone.ang_vel_in(plane)
    stone.set_ang_vel(plane, u[0] * stone.x + u[1] * stone.y + u[2] * stone.z)
    normal = [plane.z.dot(axis) for axis in stone]
    size = sympy.sqrt(sum((axis * item) ** 2 for axis, item in zip((a, b, c), normal, strict=True)))
    contact = me.Point("P")
    contact.set_vel(plane, 0)
    parts = zip((a, b, c), normal, stone, strict=True)
    arm = sum((axis**2 * item / size * direction for axis, item, direction in parts), me.Vector(0))
    center = contact.locatenew("C", arm - h * stone.z)
    center.set_vel(plane, stone.ang_vel_in(plane).cross(center.pos_from(contact)))
    inertia = me.inertia(stone, *sympy.symbols("A B C D"), 0, 0)
    system = me.KanesMethod(
        plane,
        q_ind=q,
        u_ind=u,
        kd_eqs=[turned.dot(axis) - speed for axis, speed in zip(stone, u, strict=True)],
        bodies=[me.RigidBody("stone", center, stone, m, (inertia, center))],
        forcelist=[(center, m * g * plane.z), (stone, -sigma * stone.ang_vel_in(plane))],
    )
    system.kanes_equations()
    return Case(system, system.mass_matrix, system.forcing, q, u, system.kindiffdict())


def sleigh() -> Case:
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
    system = me.KanesMethod(
        plane,
        q_ind=q,
        u_ind=[u[0], u[2]],
        u_dependent=[u[1]],
        velocity_constraints=[edge.vel(plane).dot(runner.y)],
        kd_eqs=[item.diff(T) - speed for item, speed in zip(q, u, strict=True)],
        bodies=[body],
        forcelist=[(edge, -drag * u[0] * plane.x)],
    )
    system.kanes_equations()
    return Case(system, system.mass_matrix, system.forcing, q, list(system.u), system.kindiffdict())


def chain(links: int) -> tuple[Any, dict[Any, float]]:
    """A pendulum in space of point masses, each on two angles."""
    ground, origin = me.ReferenceFrame("N"), me.Point("O")
    origin.set_vel(ground, 0)
    m, length, g = sympy.symbols("m l g")
    frame, point, q, u, bodies = ground, origin, [], [], []
    for k in range(links):
        angles, speeds = dynamicsymbols(f"q{k}_0:2"), dynamicsymbols(f"u{k}_0:2")
        middle = frame.orientnew(f"A{k}", "Axis", [angles[0], frame.x])
        frame = middle.orientnew(f"B{k}", "Axis", [angles[1], middle.y])
        point = point.locatenew(f"P{k}", -length * frame.z)
        bodies.append(me.Particle(f"p{k}", point, m))
        q, u = [*q, *angles], [*u, *speeds]
    kinematic = [angle.diff(T) - speed for angle, speed in zip(q, u, strict=True)]
    weights = [(body.point, -m * g * ground.z) for body in bodies]
    system = me.KanesMethod(ground, q_ind=q, u_ind=u, kd_eqs=kinematic, bodies=bodies, forcelist=weights)
    return system, {m: 1.3, length: 0.5, g: 9.81}


def matrices() -> Case:
    """Plain M(q) and f(q, v, t) with a Piecewise, roots and powers."""
    q = list(dynamicsymbols("x y"))
    v = [item.diff(T) for item in q]
    a, b = sympy.symbols("a b")
    mass = sympy.Matrix([[a + q[1] ** 2, b / 4], [b / 4, a * sympy.sqrt(1 + q[0] ** 2)]])
    stop = sympy.Piecewise((q[0] ** 3, q[0] > 0.5), (sympy.Abs(q[0]), True))
    force = sympy.Matrix([-stop * v[1], sympy.exp(-q[1]) / (a + sympy.cos(T)) - b * v[0] ** sympy.Rational(2)])
    return Case((mass, force), mass, force, q, v, {item: item for item in v})


CASES: dict[str, Callable[[], Case]] = {
    "oscillator": oscillator, "disc": disc, "cart": cart, "matrices": matrices, "rattleback": rattleback,
    "sleigh": sleigh,
}  # fmt: skip  # a table


def taken(case: Case, name: str = "taken") -> tuple[Any, dict[str, float]]:
    """Return the document with values of all free symbols."""
    symbols = sorted((case.mass.free_symbols | case.force.free_symbols) - {T}, key=str)
    values = {str(item): 1.0 + 0.1 * place for place, item in enumerate(symbols)}
    options = {"q": case.q} if isinstance(case.system, tuple) else {}
    return eomgen.from_sympy(case.system, parameters=values, name=name, **options), values


def largest_error(case: Case, states: int = 5) -> float:
    """Return the largest relative difference of accelerations, and of speeds, from SymPy's own at random states."""
    document, values = taken(case)
    system = eomgen.derive(document, ["forward_dynamics", "outputs"])
    speeds = [sympy.Dummy() for _ in case.u]
    coordinates = [sympy.Dummy() for _ in case.q]
    given = [sympy.Dummy() for _ in case.inputs]
    names = list(values)
    own = dict(zip((*case.u, *case.q, *case.inputs), (*speeds, *coordinates, *given), strict=True))
    arguments = [T, coordinates, speeds, sympy.symbols(names), given]
    rates = sympy.Matrix([case.rates[item.diff(T)] for item in case.q])
    accelerations = [sympy.Dummy() for _ in case.u]
    change = (
        rates.jacobian(case.u) * sympy.Matrix(accelerations) + rates.jacobian(case.q) * rates
        if not isinstance(case.u[0], sympy.Derivative)
        else sympy.Matrix(accelerations)
    )
    terms = [sympy.Matrix(item).subs(case.rates).xreplace(own) for item in (case.mass, case.force, rates)]
    of_motion = sympy.lambdify(arguments, terms, cse=True)
    of_change = sympy.lambdify([*arguments, accelerations], change.xreplace(own), cse=True)
    random, worst = np.random.default_rng(1), 0.0
    for _ in range(states):
        q, u = random.uniform(0.2, 1.0, len(case.q)), random.uniform(-1.0, 1.0, len(case.u))
        inputs, p = random.normal(size=len(case.inputs)), list(values.values())
        state: Sequence[Any] = (0.37, q, u, p, inputs)
        mass, force, v = (np.array(item, dtype=float) for item in of_motion(*state))
        expected = np.array(of_change(*state, np.linalg.solve(mass, force).ravel()), dtype=float).ravel()
        blocks = {"q": q, "v": v.ravel(), "u": inputs, "t": [0.37], "p": [values[name] for name in document.parameters]}
        for name, wanted in (("forward_dynamics", expected), ("outputs", u)):
            if name in system.functions:
                function = system.functions[name]
                result = evaluate(system.tape, function.refs, {block: blocks[block] for block in function.inputs})
                worst = max(worst, float(np.abs(result - wanted).max() / np.abs(wanted).max()))
    return worst


@pytest.mark.parametrize("name", CASES)
@pytest.mark.slow_except("oscillator", "disc")
def test_accelerations_and_speeds_are_those_of_sympy(name: str) -> None:
    assert largest_error(CASES[name]()) < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("links", [6, 20])
@pytest.mark.long_cases("20")
def test_a_chain_in_space_is_the_one_of_universal_joints(links: int) -> None:
    """SymPy forms no equations here: a scene with the same chain is the reference, to 1e-12."""
    builder = eomgen.SceneBuilder("chain")
    for k in range(links):
        builder.body(f"p{k}", 1.3, center_of_mass=[0, 0, -0.5], inertia=[0, 0, 0])
        parent, height = (f"p{k - 1}", -0.5) if k else ("base", 0.0)
        builder.joint(
            f"j{k}", "universal", parent, f"p{k}", axis=[1, 0, 0], second_axis=[0, 1, 0], position=[0, 0, height]
        )
    system, values = chain(links)
    document = eomgen.from_sympy(system, parameters=values)
    random = np.random.default_rng(1)
    state = {"q": random.uniform(-0.8, 0.8, 2 * links), "v": random.normal(size=2 * links), "p": document.values}
    for term in ("mass", "forward_dynamics"):
        results = []
        for described in (document, builder.build()):
            derived = eomgen.derive(described, [term])
            function = derived.functions[term]
            results.append(evaluate(derived.tape, function.refs, {block: state[block] for block in function.inputs}))
        np.testing.assert_allclose(results[0], results[1], rtol=0, atol=1e-12 * np.abs(results[1]).max())


@pytest.mark.slow
def test_constraints_hold_along_runs() -> None:
    """A point on a circle in x and y: it starts on the circle, stays there, and moves as a pendulum."""
    x, y = dynamicsymbols("x y")
    m, g, length = sympy.symbols("m g l")
    lagrangian = m * (x.diff(T) ** 2 + y.diff(T) ** 2) / 2 - m * g * y
    system = me.LagrangesMethod(lagrangian, [x, y], hol_coneqs=[x**2 + y**2 - length**2])
    start = {x: 0.5, y: -0.8, x.diff(T): 1.0}
    document = eomgen.from_sympy(system, parameters={m: 2.0, g: 9.81, length: 1.0}, initial=start)
    q, v = np.array(document.initial_q), np.array(document.initial_v)
    np.testing.assert_allclose([q @ q, q @ v], [1.0, 0.0], atol=1e-12)
    run = eomgen.build(document, profile="quick").simulate(2.0, 1e-3, method="rk4")
    np.testing.assert_allclose(np.hypot(*run.q.T), 1.0, atol=1e-9)
    energy = 0.5 * np.sum(run.v**2, axis=1) + 9.81 * run.q[:, 1]
    np.testing.assert_allclose(energy, energy[0], atol=1e-8)


def test_coordinates_without_inertia_move_by_constraints() -> None:
    """A spring's end has no mass and moves twice as far as a cart, so M is singular: a = -2 k s / m of a cart."""
    x, s = dynamicsymbols("x s")
    m, k = sympy.symbols("m k")
    system = me.LagrangesMethod(m * x.diff(T) ** 2 / 2 - k * s**2 / 2, [x, s], hol_coneqs=[s - 2 * x])
    document = eomgen.from_sympy(system, parameters={m: 2.0, k: 3.0}, initial={x: 0.4, s: 0.8})
    derived = eomgen.derive(document, ["forward_dynamics"])
    function = derived.functions["forward_dynamics"]
    state = {"q": document.initial_q, "v": document.initial_v, "p": document.values}
    result = evaluate(derived.tape, function.refs, {block: state[block] for block in function.inputs})
    np.testing.assert_allclose(result, [-2.4, -4.8], rtol=1e-14)


def test_symbols_without_an_effect_are_no_parameters() -> None:
    """The mass of a lone disc cancels in no term, but r of a point does."""
    document, _ = taken(disc())
    assert document.parameters == ("g", "m", "r")
    assert document.coordinates == ("q1", "q2", "q3")
    assert document.speeds == ("u1", "u2", "u3")
    q, (m, k, free) = dynamicsymbols("q"), sympy.symbols("m k free")
    lagrangian = m * q.diff(T) ** 2 / 2 - k * q**2 / 2 + free
    document = eomgen.from_sympy(me.LagrangesMethod(lagrangian, [q]), parameters={m: 1, "k": 2, free: 3})
    assert document.parameters == ("k", "m")
    assert document.values == (2.0, 1.0)


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


def test_refusals() -> None:
    q, r = dynamicsymbols("q r")
    m, k = sympy.symbols("m k")
    free = m * q.diff(T) ** 2 / 2
    bound = me.LagrangesMethod(free, [q], hol_coneqs=[q**2 + 1])
    odd = me.LagrangesMethod(free - sympy.gamma(q), [q])
    rated = me.LagrangesMethod(free + q * r.diff(T), [q])
    u = dynamicsymbols("u")
    bare = me.KanesMethod(me.ReferenceFrame("N"), q_ind=[q], u_ind=[u], kd_eqs=[q.diff(T) - u])
    cases: tuple[tuple[Any, type[Exception], str], ...] = (
        (lambda: eomgen.from_sympy(me.LagrangesMethod(free, [q])), eomgen.UsageError, r"no values for m"),
        (lambda: eomgen.from_sympy(3), eomgen.UsageError, "int is none of SymPy's descriptions"),
        (lambda: eomgen.from_sympy(bound, parameters={m: 1}), eomgen.DescriptionError, "the constraints are not met"),
        (lambda: eomgen.from_sympy(odd, parameters={m: 1}), eomgen.DescriptionError, "the function gamma has no"),
        (lambda: eomgen.from_sympy(rated, parameters={m: 1}), eomgen.DescriptionError, r"the rate Derivative\(r"),
        (
            lambda: eomgen.from_sympy(me.LagrangesMethod(free, [q]), parameters={m: 1, k: 1}),
            eomgen.UsageError,
            "the system has no free symbol k",
        ),
        (
            lambda: eomgen.from_sympy(me.LagrangesMethod(free, [q]), parameters={m: 1}, initial={r: 1}),
            eomgen.UsageError,
            "there is no coordinate r",
        ),
        (lambda: eomgen.from_sympy(bare), eomgen.DescriptionError, "the KanesMethod has no bodies"),
        (lambda: eomgen.from_sympy((sympy.eye(1), [0])), eomgen.UsageError, "matrices alone have no coordinates"),
        (lambda: eomgen.from_sympy((sympy.eye(2), [0]), q=[q]), eomgen.DescriptionError, "M is 2 x 2 and f has 1"),
        (lambda: eomgen.from_sympy(3, name="1 a"), eomgen.UsageError, "'1 a' is not a name"),
    )  # fmt: skip  # pairs
    for call, kind, text in cases:
        with pytest.raises(kind, match=text):
            call()
