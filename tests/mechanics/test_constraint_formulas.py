"""Constraints by formulas: closed forms, built-in constraints of the same meaning, forces on points, powers."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.errors import ModelError
from eomgen.formula.nodes import Formula, Number, Symbol
from eomgen.mechanics.derive import derive
from eomgen.scene.joints.model import Constraint, Frame
from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE, WORLD, Point
from tests.mechanics.checks import check_powers, states_of
from tests.mechanics.test_constraints import TERMS, check_derivatives
from tests.oracles.constrained import kkt, mixed_groups, weighty
from tests.oracles.evaluation import Array, Evaluate, relative_error, tape_evaluator
from tests.oracles.formulas import call, vector
from tests.oracles.newton_euler import MOTION, imbalance, moving, with_reactions
from tests.oracles.random_scenes import random_scene, with_base, with_loads

SOLVED = ["constraint", "constraint_velocity", "constraint_jacobian", "constraint_bias", "constraint_size", "mass"]
SOLVED += ["residual", "energy"]
HEAD = 'format = 1\nname = "machine"\ncoordinates = "{coordinates}"\n'
BEAD = (
    HEAD
    + """
bodies.carriage = {{ mass = 0.5, inertia = [1, 1, 1] }}
bodies.bead = {{ mass = 1.5, inertia = [1, 1, 1] }}
joints.x = {{ type = "prismatic", parent = "base", child = "carriage", axis = [1, 0, 0], initial.position = {x} }}
joints.z = {{ type = "prismatic", parent = "carriage", child = "bead", axis = [0, 0, 1], initial.position = {z} }}
points.bead.body = "bead"
[constraints.wire]
type = "formula"
{wire}
"""
)
SLEIGH = """format = 1
name = "sleigh"
gravity = [0, 0, 0]
bodies.sleigh = { mass = 2, center_of_mass = [0.3, 0, 0], inertia = [0.1, 0.1, 0.15] }
points.knife.body = "sleigh"
[joints.plane]
type = "planar"
parent = "base"
child = "sleigh"
axis = [0, 0, 1]
x_axis = [1, 0, 0]
initial = { position = [0, 0, 0], velocity = [1.5, 0, 0] }
[constraints.knife]
type = "formula"
velocity_equation = "cos(q.plane[0]) * velocity.knife[1] - sin(q.plane[0]) * velocity.knife[0]"
unit = "m/s"
"""
CAM = (
    HEAD
    + """
bodies.cam = {{ mass = 2, inertia = [0.01, 0.02, 0.03] }}
bodies.rod = {{ mass = 0.4, inertia = [1, 1, 1] }}
joints.cam = {{ type = "revolute", parent = "base", child = "cam", axis = [0, 1, 0] }}
joints.rod = {{ type = "prismatic", parent = "base", child = "rod", axis = [0, 0, 1], stiffness = 300 }}
{more}
[constraints.contact]
type = "formula"
equation = "q.rod - {lift}"
"""
)


def solved(scene: Scene, q: Array, v: Array, t: float = 0.0) -> tuple[Evaluate, dict[str, Array]]:
    """Return the terms of a scene, and a state with accelerations and multipliers."""
    evaluate = tape_evaluator(derive(scene, SOLVED))
    state = {"q": np.atleast_2d(q), "v": np.atleast_2d(v), "t": np.array([[t]])}
    return evaluate, kkt(evaluate, state)


@pytest.mark.parametrize("way", ["coordinates", "points", "frames"])
def test_a_bead_on_a_parabola(way: str) -> None:
    """(m + M) x'' + m z' (z' x')' with z = c x^2; the wire pushes with its multiplier along the gradient."""
    wire = {
        "coordinates": 'equation = "q.z - 0.7 * q.x**2"',
        "points": 'equation = "position.bead[2] - 0.7 * position.bead[0]**2"',
        "frames": 'first.body = "base"\nsecond = "bead"\nequation = "z - 0.7 * x**2"',
    }[way]
    scene = load_toml(BEAD.format(coordinates="joint", x=0.4, z=0.112, wire=wire))
    x, speed, c, m, M = 0.4, 1.3, 0.7, 1.5, 0.5
    slope = 2 * c * x
    _, state = solved(scene, np.array([x, c * x * x]), np.array([speed, slope * speed]))
    expected = -m * slope * (2 * c * speed**2 + 9.81) / (m + M + m * slope**2)
    assert state["a"][0] == pytest.approx([expected, 2 * c * speed**2 + slope * expected], rel=1e-13)
    push = m * (2 * c * speed**2 + slope * expected + 9.81)
    assert state["lam"][0] == pytest.approx([-push], rel=1e-13)


def test_chaplygins_sleigh() -> None:
    """u' = a w^2 and w' = -m a u w / (I + m a^2) with the speed u along the knife."""
    angle, u, w = 0.6, 1.1, 1.5
    v = np.array([w, u * np.cos(angle), u * np.sin(angle)])
    evaluate, state = solved(load_toml(SLEIGH), np.array([angle, 0.2, -0.3]), v)
    assert evaluate("constraint_velocity", state)["w"][0] == pytest.approx([0.0], abs=1e-15)
    turning = -2 * 0.3 * u * w / (0.15 + 2 * 0.3**2)
    along = np.array([np.cos(angle), np.sin(angle)])
    expected = (0.3 * w**2) * along + u * w * np.array([-along[1], along[0]])
    assert state["a"][0] == pytest.approx([turning, *expected], rel=1e-13)
    assert state["lam"][0, 0] == pytest.approx(-2 * (u * w + 0.3 * turning), rel=1e-13)


def test_a_cam_by_a_table(tmp_path: Path) -> None:
    """A periodic table of 720 angles gives lift, slope and force of the harmonic lift that it was made of."""
    angles = np.linspace(0.0, 2 * np.pi, 721)
    rows = "".join(f"{a!r},{0.01 * (1 - math.cos(a))!r}\n" for a in angles.tolist())
    (tmp_path / "lift.csv").write_text("angle,lift\n" + rows)
    (tmp_path / "cam.toml").write_text(
        CAM.format(
            coordinates="joint",
            lift="lift(q.cam)",
            more='curves.lift = { table = { file = "lift.csv" }, outside = "periodic" }',
        )
    )
    scene = eomgen.load(tmp_path / "cam.toml")
    angle, speed = 7.1, 12.0
    evaluate, state = solved(scene, np.array([angle, 0.01 * (1 - np.cos(angle))]), np.zeros(2))
    slope, curvature = 0.01 * np.sin(angle), 0.01 * np.cos(angle)
    assert abs(evaluate("constraint", state)["Phi"][0, 0]) <= 1e-14
    assert evaluate("constraint_jacobian", state)["B"][0] == pytest.approx(np.array([[-slope, 1.0]]), abs=1e-12)
    bias = evaluate("constraint_bias", {**state, "v": np.array([[speed, slope * speed]])})["g"][0]
    assert bias == pytest.approx([-curvature * speed**2], rel=1e-8)


def _square(one: str, other: str, index: int) -> Formula:
    difference = Symbol("position", one, index) - Symbol("position", other, index)
    return difference * difference


def _with_points(seed: int, *, base: bool, coordinates: str) -> Scene:
    """Return a random tree with points on its last body, on its first one and at rest."""
    scene = weighty(with_loads(random_scene(seed, 4), seed), seed)
    scene = with_base(scene, seed) if base else scene
    first, last = scene.bodies[0].name, scene.bodies[-1].name
    points = (
        Point("there", last, vector((0.3, 0.2, 0.1))),
        Point("here", first, vector((0.1, -0.2, 0.4))),
        Point("still", WORLD, vector((1.7, -1.4, 0.9))),
    )
    groups = mixed_groups(scene) if coordinates == "absolute" else {}
    return replace(scene, points=points, coordinates=coordinates, groups=groups, elements=())


@pytest.mark.slow_except("1-joint-True", "2-absolute-False")
@pytest.mark.parametrize(
    ("seed", "coordinates", "base"),
    [(0, "joint", False), (1, "joint", True), (2, "absolute", False), (0, "absolute", True)],
)
def test_a_formula_of_points_is_the_built_in_distance(seed: int, coordinates: str, base: bool, rng) -> None:
    scene = _with_points(seed, base=base, coordinates=coordinates)
    apart = call("sqrt", _square("here", "there", 0) + _square("here", "there", 1) + _square("here", "there", 2))
    frames = [Frame(point.body, point.position) for point in scene.points[1::-1]]
    length = call("sin", Symbol("time")) + Number(1.3)
    found = []
    for item in (
        Constraint("rod", "formula", Frame(BASE), Frame(BASE), equation=apart - length, framed=False),
        Constraint("rod", "distance", frames[0], frames[1], length=length),
    ):
        system = derive(replace(scene, constraints=(item,)), [*TERMS, "energy"])
        state = states_of(system, np.random.default_rng(seed))
        evaluate = tape_evaluator(system)
        last = -1  # behind the joints' own rows
        found.append(
            [
                evaluate(name, state)[block][:, last]
                for name, block in (
                    ("constraint_jacobian", "B"),
                    ("constraint_velocity", "w"),
                    ("constraint_bias", "g"),
                )
            ]
            + [evaluate("residual", state)["r"], evaluate("partials", state)["K"], evaluate("energy", state)["energy"]]
        )
    for formula, built_in in zip(*found, strict=True):
        assert relative_error(formula, built_in, np.ndim(formula) - 1) <= 1e-11


VELOCITY = (
    Symbol("velocity", "there", 0) * call("sin", Symbol("position", "here", 1))
    - Symbol("velocity", "here", 2) * Symbol("position", "there", 0)
    + 0.3 * call("sin", Symbol("time"))
)
POSITION = (
    Symbol("position", "there", 0) * Symbol("position", "here", 1)
    + call("sin", Symbol("position", "there", 2))
    - Symbol("position", "still", 0)
    + 0.3 * call("sin", Symbol("time"))
)


def _by_formula(scene: Scene, *, at_velocity: bool) -> Scene:
    """Return the scene with a formula of points, which holds a coordinate of a joint, too."""
    kinds = {joint.name: joint.kind for joint in scene.joints}
    own = Symbol("v" if at_velocity else "q", next((name for name in kinds if kinds[name].coordinates), ""))
    equation = VELOCITY if at_velocity else POSITION
    equation = equation + 0.4 * own if own.name else equation
    item = Constraint(
        "made",
        "formula",
        Frame(BASE),
        Frame(BASE),
        equation=equation,
        at_velocity=at_velocity,
        unit="m/s" if at_velocity else "m",
        framed=False,
    )
    return replace(scene, constraints=(item,))


@pytest.mark.slow_except("1-joint-True", "2-absolute-False")
@pytest.mark.parametrize(
    ("seed", "coordinates", "at_velocity"),
    [(0, "joint", False), (1, "joint", True), (2, "absolute", False), (0, "absolute", True)],
)
def test_derivatives_and_powers(seed: int, coordinates: str, at_velocity: bool, rng) -> None:
    """Against complex steps, on a shaking base; energies change by the powers of base and time alone."""
    scene = _by_formula(_with_points(seed, base=True, coordinates=coordinates), at_velocity=at_velocity)
    system = derive(scene, [*TERMS, "energy", "mass"])
    assert system.row_units[-1] == ("m/s" if at_velocity else "m")
    state = states_of(system, rng)
    check_derivatives(system, state)
    evaluate = tape_evaluator(system)
    B, w = evaluate("constraint_jacobian", state)["B"], evaluate("constraint_velocity", state)["w"]
    moving = {**state, "v": state["v"] - (np.linalg.pinv(B) @ w[..., np.newaxis])[..., 0]}
    check_powers(system, kkt(evaluate, moving), 1e-10)


@pytest.mark.slow_except("1-True-False", "2-False-True")
@pytest.mark.parametrize(
    ("seed", "at_velocity", "base"), [(0, False, False), (1, True, False), (2, False, True), (3, True, True)]
)
def test_bodies_under_a_formula_are_in_balance(seed: int, at_velocity: bool, base: bool, rng) -> None:
    """Forces of the multiplier at the points, from the gradient by hand; its efforts are within the joints."""
    scene = _by_formula(_with_points(seed, base=base, coordinates="joint"), at_velocity=at_velocity)
    unheld = with_reactions(replace(scene, constraints=()))
    watched = replace(unheld, constraints=scene.constraints)
    system = derive(watched, MOTION)
    state = states_of(system, rng)
    bodies = moving(unheld, tape_evaluator(system), state)
    places = {
        item.name: bodies.place(item.body, np.array([part.value for part in item.position]))  # type: ignore[union-attr]
        for item in scene.points[:2]
    }
    lam, none = state["lam"][:, 0], np.zeros((len(state["lam"]), 3))
    here, there = places["here"], places["there"]
    on_there, on_here = none.copy(), none.copy()
    if at_velocity:
        on_there[:, 0], on_here[:, 2] = np.sin(here[:, 1]), -there[:, 0]
    else:
        on_there[:, 0], on_there[:, 2], on_here[:, 1] = here[:, 1], np.cos(there[:, 2]), there[:, 0]
    for point, slope in zip(scene.points[:2], (on_there, on_here), strict=True):
        bodies.push(point.body, places[point.name], -lam[:, np.newaxis] * slope, none)
    assert imbalance(bodies).max() <= 1e-12


def test_the_effort_along_an_equation() -> None:
    """drive_effort is minus the multiplier; a formula of coordinates and points has no force of its own."""
    more = '\n[outputs]\npush = { formula = "drive_effort.wire" }\n'
    wire = 'equation = "q.z - 0.7 * q.x**2"'
    text = BEAD.format(coordinates="joint", x=0.4, z=0.112, wire=wire)
    evaluate = tape_evaluator(derive(load_toml(text + more), ["outputs"]))
    state = {"q": np.zeros((1, 2)), "v": np.zeros((1, 2)), "a": np.zeros((1, 2)), "lam": np.array([[2.5]])}
    assert evaluate("outputs", state)["y"][0] == pytest.approx([-2.5])
    with pytest.raises(ModelError) as caught:
        derive(load_toml(text + '\n[outputs]\npush = { reaction_force = "wire" }\n'))
    assert str(caught.value.problems[0]) == (
        "constraints.wire: the constraint wire joins no two frames, so it has no single force and moment; try:"
        " drive_effort.wire, its effort along the equation, or the reaction of a joint"
    )


FLAT = "the derivatives of these equations vanish at their zeros, so they hold no motion: wire: formula; try: equations"
TOGETHER = "the positions of the constraints cannot be met together: after 50 corrections still off: "


@pytest.mark.parametrize(
    ("wire", "message"),
    [
        ('equation = "q.z**2"\nunit = "m"', f"{FLAT} that change their sign there: x in place of x**2"),
        ('equation = "(q.z + 0.1 * q.x)**2"\nunit = "m"', FLAT),
        ('equation = "q.z**2 + 1"\nunit = "m"', f"{TOGETHER}wire: formula by 1"),
        ('equation = "q.z - q.x"\n[constraints.other]\ntype = "formula"\nequation = "q.z - q.x - 0.1"',
            "other: formula by -0.05"),
        ('equation = "q.z - sqrt(q.x - 2)"',
            "these rows have no finite derivative where constraints are to be met: wire: formula; try: a state in "
            "which the formula and its derivatives have values"),
    ],
)  # fmt: skip  # a table
def test_equations_that_hold_nothing_or_cannot_be_met(wire: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        eomgen.build(load_toml(BEAD.format(coordinates="joint", x=0, z=0, wire=wire)))
    assert message in str(caught.value.problems[0])


def test_an_equation_of_a_resting_body() -> None:
    """A joint that holds the body to the base is known when equations are derived."""
    text = BEAD.format(coordinates="joint", x=0.4, z=0.1, wire='equation = "position.plate[2]"')
    plate = '\n[bodies.plate]\nmass = 1\n[joints.plate]\ntype = "fixed"\nparent = "base"\nchild = "plate"\n'
    with pytest.raises(ModelError) as caught:
        derive(load_toml(f'{text}{plate}[points.plate]\nbody = "plate"\n'), ["constraint_jacobian"])
    assert str(caught.value.problems[0]) == (
        "constraints.wire: the equation names no coordinate of a moving joint and no point of a moving body; try: a"
        " coordinate that it may hold"
    )


@pytest.mark.slow
def test_a_start_off_the_wire_and_a_repeated_equation() -> None:
    """Redundant equations are left out by name, and a start is brought onto the wire; oscillations at its bottom."""
    twice = 'equation = "q.z - 0.7 * q.x**2"\n[constraints.twice]\ntype = "formula"\nunit = "m"\n'
    twice += 'equation = "2 * q.z - 1.4 * q.x**2"'
    model = eomgen.build(load_toml(BEAD.format(coordinates="joint", x=0.5, z=0, wire=twice)), profile="quick")
    assert "twice: formula follows from the constraints before it and is left out" in model.notes
    assert "initial position corrected: wire: formula was off by -0.175" in model.notes
    modes = model.linearize(at="equilibrium").modes()
    assert modes.angular_frequency == pytest.approx([np.sqrt(1.4 * 9.81 * 1.5 / 2.0)], rel=1e-9)
    run = model.simulate(1.0, 1e-3)
    assert run.success and np.abs(run.q[:, 1] - 0.7 * run.q[:, 0] ** 2).max() <= 1e-11
