"""Reactions of joints and constraints: against Newton and Euler body by body, by virtual work, and by power."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.errors import DescriptionError, ModelError
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Symbol
from eomgen.mechanics.derive import derive
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.forces.forces import Effort
from eomgen.scene.forces.springs import Spring
from eomgen.scene.joints.model import Reaction
from eomgen.scene.load import load, load_toml
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE, Point
from eomgen.system.signals import Output
from eomgen.system.system import System
from tests.mechanics.test_constraints import free_joint
from tests.models.elements import elements_with
from tests.oracles.constrained import HILL, constraint, mixed_groups, small_body, variants, weighty
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.formulas import number, value_of, vector
from tests.oracles.newton_euler import MOTION, imbalance, moving, pull, with_reactions
from tests.oracles.random_scenes import random_scene, with_base
from tests.oracles.states import on_base, random_states, rotation_of

STATES = 4
SPRING = Spring("strut", "here", "there", stiffness=number(30.0), damping=number(2.0), length=number(0.4))


def with_spring(scene: Scene) -> Scene:
    """Return the scene with a spring from the base to its last body, and joints with dampers and a motor."""
    here, there = (
        Point("here", BASE, vector((0.7, -0.4, 0.9))),
        Point("there", scene.bodies[-1].name, vector((0.3, 0.2, 0.1))),
    )
    driven = next(joint for joint in scene.joints if joint.kind.moves)
    motor = Effort("motor", driven.name, Symbol("time"), driven.kind.v_size - 1)
    joints = tuple(
        replace(joint, damping=number(0.7)) if joint.type in ("revolute", "prismatic") else joint
        for joint in scene.joints
    )
    elements = elements_with(scene, springs=(SPRING,), efforts=(motor,))
    return replace(scene, joints=joints, points=(here, there), elements=elements)


def states_of(system: System, rng: np.random.Generator) -> dict[str, Array]:
    evaluate, state = tape_evaluator(system), random_states(system, STATES, rng)
    state["t"] = rng.uniform(0.2, 1.0, (STATES, 1))
    state["lam"] = rng.uniform(-9.0, 9.0, (STATES, len(system.multipliers)))
    return on_base(evaluate, state) if "base" in system.functions else state


def pulled(scene: Scene, system: System, state: dict[str, Array]):
    """Return the bodies of a scene with its reactions and its spring acting on them."""
    bodies = moving(scene, tape_evaluator(system), state)
    ends = [(point.body, np.array([value_of(part, {}) for part in point.position])) for point in scene.points[:2]]
    span = bodies.place(*ends[1]) - bodies.place(*ends[0])
    length = np.linalg.norm(span, axis=-1, keepdims=True)
    speed = bodies.velocity_at(ends[1][0], bodies.place(*ends[1])) - bodies.velocity_at(
        ends[0][0], bodies.place(*ends[0])
    )
    tension = 30.0 * (length - 0.4) + 2.0 * np.sum(speed * span, axis=-1, keepdims=True) / length
    pull(bodies, *ends, tension)
    return bodies


@pytest.mark.parametrize("seed", range(8))
def test_every_body_of_a_tree_is_in_balance(seed: int, rng) -> None:
    """Any accelerations, fixed joints and massless bodies between, a spring, dampers and a motor."""
    scene = with_reactions(with_spring(random_scene(seed, 5)))
    system = derive(scene, MOTION)
    assert imbalance(pulled(scene, system, states_of(system, rng))).max() <= 1e-12


@pytest.mark.parametrize("seed", range(4))
def test_on_a_moving_base(seed: int, rng) -> None:
    scene = with_reactions(with_base(random_scene(seed, 4), seed))
    system = derive(scene, MOTION)
    assert imbalance(moving(scene, tape_evaluator(system), states_of(system, rng))).max() <= 1e-12


@pytest.mark.parametrize("kind, driven, shape", variants())
def test_the_virtual_work_of_a_constraint_is_that_of_its_multipliers(kind: str, driven: bool, shape: str, rng) -> None:
    """J^T of the reactions on both bodies is -B^T lam, for any multipliers and wherever the frames are."""
    joints = tuple(replace(free_joint(name), position=vector((0.3, -0.2, 0.5))) for name in ("one", "two"))
    loop = constraint(rng, kind, "one", "two", driven=driven, shape=shape)
    scene = replace(Scene("pair", (small_body("one"), small_body("two")), joints), constraints=(loop,))
    outputs = (Output("loop", tuple(Symbol("reaction", "loop", k) for k in range(6))),)
    scene = replace(scene, outputs=outputs, reactions=(Reaction("loop", "constraints", "loop", None, "two"),))
    system = derive(scene, ["outputs", "constraint_jacobian", "poses"])
    state, evaluate = states_of(system, rng), tape_evaluator(system)
    load, pose = evaluate("outputs", state)["y"], evaluate("poses", state)["pose"]
    moment, force = load[:, :3], load[:, 3:]
    r = np.array([value_of(part, {}) for part in loop.second.position])
    on_two = np.concatenate([moment + np.cross(r, force), force], axis=1)  # about the body's origin, in its axes
    R = [rotation_of(pose[:, number, :4]) for number in (0, 1)]
    turn = np.swapaxes(R[0], 1, 2) @ R[1]
    arm = np.einsum("kji,kj->ki", R[0], pose[:, 1, 4:] - pose[:, 0, 4:]) + turn @ r
    back = np.einsum("kij,kj->ki", turn, force)
    on_one = -np.concatenate([np.einsum("kij,kj->ki", turn, moment) + np.cross(arm, back), back], axis=1)
    B = evaluate("constraint_jacobian", state)["B"]
    expected = -np.einsum("kij,ki->kj", np.broadcast_to(B, (STATES, *B.shape[-2:])), state["lam"])
    assert relative_error(np.concatenate([on_one, on_two], axis=1), expected) <= 1e-13


@pytest.mark.parametrize("seed", range(4))
def test_absolute_coordinates(seed: int, rng) -> None:
    """The recursion over bodies in world axes, both groups of absolute bodies, a loop besides."""
    scene = weighty(random_scene(seed, 4), seed)
    start = {"initial_position": (1.0, 0.0, 0.0, 0.0), "initial_velocity": (0.0, 0.0, 0.0)}
    joints = tuple(
        joint if joint.kind.moves else replace(joint, type="spherical", **start)  # type: ignore[arg-type]  # numbers
        for joint in scene.joints
    )
    scene = replace(scene, joints=joints, coordinates="absolute", groups=mixed_groups(scene))
    loop = constraint(rng, "distance", BASE, scene.bodies[-1].name)
    scene = with_reactions(replace(scene, constraints=(loop,)))
    system = derive(scene, MOTION)
    assert imbalance(moving(scene, tape_evaluator(system), states_of(system, rng))).max() <= 1e-12


def test_of_the_pin_of_a_pendulum_in_closed_form() -> None:
    """T = m (g cos q + l v^2) along the rod and m (g sin q + l a) across it, a = -g sin q / l."""
    scene = load_toml(PENDULUM)
    system = derive(scene, ["outputs", "mass", "residual"])
    evaluate = tape_evaluator(system)
    q, v, g, m, length = 0.6, 1.7, 9.81, 2.0, 0.8
    state = {"q": np.array([[q]]), "v": np.array([[v]]), "a": np.array([[-g * np.sin(q) / length]])}
    across, moment, along = evaluate("outputs", state)["y"][0]
    assert along == pytest.approx(m * (g * np.cos(q) + length * v * v), rel=1e-14)
    assert abs(across) <= 1e-14 and abs(moment) <= 1e-14
    shifted = load_toml(PENDULUM.replace('"reaction.rod.moment[1]"', '"reaction.end.moment[1]"'))
    about_end = tape_evaluator(derive(shifted, ["outputs"]))("outputs", state)["y"][0, 1]
    assert about_end == pytest.approx(0.3 * along, rel=1e-13)


PENDULUM = """format = 1
name = "pendulum"
bodies.bob = { mass = 2.0, center_of_mass = [0, 0, -0.8] }
joints.pin = { type = "revolute", parent = "base", child = "bob", axis = [0, -1, 0] }
points.end = { body = "bob", position = [0.3, 0, -0.8] }
reactions.rod = { joint = "pin", axes = "bob" }
reactions.end = { joint = "pin", axes = "bob", point = "end" }
outputs.load = { formula = ["reaction.rod.force[0]", "reaction.rod.moment[1]", "reaction.rod.force[2]"] }
"""


@pytest.mark.slow
def test_a_beam_carries_what_its_coordinates_say(rng) -> None:
    """The moment about a revolute joint's axis is the residual of its coordinate, whatever hangs on a beam."""
    bends = {f"bending_{axis}": {"stiffness": 200.0, "modes": 2} for axis in "yz"}
    builder = SceneBuilder("crane").beam("boom", 2.0, mass_per_length=3.0, **bends)
    builder.joint("root", "revolute", "base", "boom", axis=[0, 1, 0])
    builder.body("load", 1.5, center_of_mass=[0.2, 0.1, 0], inertia=[0.1, 0.2, 0.3])
    builder.joint("wrist", "revolute", "boom", "load", axis=[0, 0, 1], position=[2.0, 0, 0])
    builder.reaction("root_load", joint="root", axes="boom").reaction("wrist_load", joint="wrist", axes="load")
    builder.output("about_axes", formula=["reaction.root_load.moment[1]", "reaction.wrist_load.moment[2]"])
    system = derive(builder.build(), ["outputs", "residual"])
    state, evaluate = random_states(system, STATES, rng), tape_evaluator(system)
    state["q"] *= 0.05
    found, r = evaluate("outputs", state)["y"], evaluate("residual", state)["r"]
    names = [factor.name for factor in system.factors]
    by_name = {name: r[:, system.factors[k].v_start] for k, name in enumerate(names)}
    assert found[:, 0] == pytest.approx(by_name["root"], rel=1e-11)
    assert found[:, 1] == pytest.approx(by_name["wrist"], rel=1e-11)


@pytest.mark.parametrize("turning", [False, True], ids=["at rest", "turning base"])
def test_axes_and_points_may_belong_to_another_branch(turning: bool, rng) -> None:
    builder = SceneBuilder("fork").body("left", 2.0, center_of_mass=[0.1, 0.3, -0.5], inertia=[0.2, 0.3, 0.4])
    builder.body("right", 1.0, center_of_mass=[0.2, 0, 0.4], inertia=[0.1, 0.1, 0.1])
    if turning:
        builder.base(position=["0.1*sin(t)", 0, 0], rotation=[{"axis": [0.6, 0, 0.8], "angle": "0.7 * t"}])
    builder.joint("first", "revolute", "base", "left", axis=[1, 2, 2], position=[0.5, 0, 0])
    builder.joint("second", "universal", "base", "right", axis=[0, 0, 1], second_axis=[1, 0, 0], position=[0, 0.4, 0.1])
    builder.point("tip", "right", position=[0.3, -0.2, 0.6]).point("root", "left")
    for name, more in {
        "world": {},
        "other": {"axes": "right"},
        "base": {"axes": "base"},
        "far": {"point": "tip"},
    }.items():
        builder.reaction(f"in_{name}", joint="first", **{"axes": "world", **more})
        parts = [f"reaction.in_{name}.{part}[{k}]" for part in ("moment", "force") for k in range(3)]
        builder.output(name, formula=parts)
    builder.output("tip", position="tip").output("root", position="root")
    system = derive(builder.build(), ["outputs", "poses", *(["base_motion"] * turning)])
    evaluate, state = tape_evaluator(system), states_of(system, rng)
    y = evaluate("outputs", state)["y"]
    world, other, base, far = (y[:, 6 * k : 6 * k + 6].reshape(STATES, 2, 3) for k in range(4))
    tip, root = y[:, 24:27], y[:, 27:30]
    poses = evaluate("poses", state)["pose"]
    R = rotation_of(poses[:, list(system.bodies).index("right"), :4])
    np.testing.assert_allclose(np.einsum("sij,skj->ski", R, other), world, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(base, axis=-1), np.linalg.norm(world, axis=-1), rtol=1e-12)
    assert np.allclose(base, world) != turning
    np.testing.assert_allclose(far[:, 1], world[:, 1], rtol=1e-12)
    np.testing.assert_allclose(far[:, 0], world[:, 0] - np.cross(tip - root, world[:, 1]), rtol=1e-12, atol=1e-11)


#: What a multiplier of 1 is on the body of ``second`` where the frames coincide: moment, force, in their axes.
MEANT = {
    "origins meet along x": (0, 0, 0, 1, 0, 0),
    "origins meet along y": (0, 0, 0, 0, 1, 0),
    "origins meet along z": (0, 0, 0, 0, 0, 1),
    "z stays perpendicular to x": (0, 1, 0, 0, 0, 0),
    "z stays perpendicular to y": (-1, 0, 0, 0, 0, 0),
    "x stays perpendicular to y": (0, 0, 1, 0, 0, 0),
    "origin stays in the plane": (0, 0, 0, 0, 0, 1),
    "point stays on the line along x": (0, 0, 0, 1, 0, 0),
    "point stays on the line along y": (0, 0, 0, 0, 1, 0),
    "travel follows the angle": (0, 0, -0.02, 0, 0, 1),
    "driven angle": (0, 0, -1, 0, 0, 0),
    "driven travel": (0, 0, 0, 0, 0, 1),
    "distance": (0, 0, 0, -1, 0, 0),
    "contact": (0, 0, 0, 0, 0, -1),
    "contact with the surface": (0, 0, 0, 0, 0, -1),
    "formula": (0, 0, 0, 0, 0, -1),
    "no slip along x": (0, 0.3, 0, -1, 0, 0),
    "no slip along y": (-0.3, 0, 0, 0, -1, 0),
}


@pytest.mark.slow
def test_the_table_of_multipliers_on_the_page() -> None:
    """Every equation of every type, one multiplier of 1 at a time, the frames together."""
    seen = set()
    for kind, driven, shape in variants():
        more = {"distance": "length = 0.5", "helical": "pitch = 0.02", "formula": EQUATION}.get(kind, "")
        if shape.startswith(HILL):
            shape, more = shape.removeprefix(HILL), 'surface = "0.2 * x * y"\n'  # noqa: PLW2901  # level at the contact
        more += _surface(shape) if kind in ("rolling", "sliding") else ""
        more += "\ndrive = 0" if driven else ""
        x_axis = "" if kind in ("distance", "spherical", "rolling", "sliding") else ", x_axis = [1, 0, 0]"
        axes = "" if kind in ("distance", "spherical") else f", axis = [0, 0, 1]{x_axis}"
        only_first = kind in ("point_on_line", "formula") or shape in ("sphere", "ellipsoid")
        touching = ([0, 0, 0.3], "rotation")
        place, turn = {"distance": ([0.5, 0, 0], ""), "rolling": touching, "sliding": touching}.get(
            kind, ([0, 0, 0], "")
        )
        second = "" if only_first else ", axis = [0, 1, 0]" if turn else axes
        scene = load_toml(
            TWO.format(kind=kind, axes=axes if kind != "distance" else "", second=second, more=more, place=place)
        )
        system = derive(scene, ["outputs", "constraint"])
        state = {"q": np.array([system.initial_q]), "v": np.zeros((1, 6)), "a": np.zeros((1, 6))}
        evaluate = tape_evaluator(system)
        assert np.abs(evaluate("constraint", state)["Phi"]).max() <= 1e-15
        for row, name in enumerate(system.multipliers):
            label = name.removeprefix("it: ")
            load = evaluate("outputs", {**state, "lam": np.eye(len(system.multipliers))[row : row + 1]})["y"][0]
            expected = MEANT[label] if kind != "universal" or "perpendicular" not in label else (0, 0, 1, 0, 0, 0)
            assert load == pytest.approx(np.array(expected, float), abs=1e-15), (kind, label)
            seen.add(label)
    assert seen == set(MEANT)


EQUATION = 'equation = "z - 2 * x * y"'


def _surface(shape: str) -> str:
    """Return the keys of a surface that reaches 0.3 m down."""
    sizes = {"ellipsoid": "semi_axes = [0.5, 0.4, 0.3]", "torus": "radius = 0.2\ntube_radius = 0.1"}
    return f'shape = "{shape}"\n' + sizes.get(shape, "radius = 0.3")


TWO = """format = 1
name = "two"
bodies.a = {{ mass = 1, inertia = [1, 1, 1] }}
joints.a = {{ type = "free", parent = "base", child = "a", initial = {{ position = {place} }} }}
[constraints.it]
type = "{kind}"
first = {{ body = "base"{axes} }}
second = {{ body = "a"{second} }}
{more}
[outputs]
load = {{ formula = [
    "reaction.it.moment[0]", "reaction.it.moment[1]", "reaction.it.moment[2]",
    "reaction.it.force[0]", "reaction.it.force[1]", "reaction.it.force[2]",
] }}
"""


def test_the_effort_of_a_drive_moves_the_machine(rng) -> None:
    """Its effort times the rate of the law is the power of the drivers; positive drives the coordinate up."""
    for kind in ("revolute", "prismatic", "cylindrical"):
        text = TWO.partition("[outputs]")[0] + '[outputs]\neffort = {{ formula = "drive_effort.it" }}\n'
        axes = ", axis = [0, 0, 1], x_axis = [1, 0, 0]"
        scene = load_toml(text.format(kind=kind, axes=axes, second=axes, more='drive = "0.3 * t"', place=[0, 0, 0]))
        system = derive(scene, ["outputs", "energy"])
        size = len(system.multipliers)
        state = {"q": np.array([system.initial_q]), "v": np.zeros((1, 6)), "a": np.zeros((1, 6)), "t": np.zeros((1, 1))}
        state["lam"] = rng.normal(size=(1, size))
        evaluate = tape_evaluator(system)
        effort, energy = evaluate("outputs", state)["y"], evaluate("energy", state)["energy"]
        assert energy[0, 3] == pytest.approx(0.3 * effort[0, 0], rel=1e-14), kind
        assert effort[0, 0] == pytest.approx((-1 if kind == "revolute" else 1) * state["lam"][0, -1])


@pytest.mark.parametrize(
    "formula, said",
    [
        ("reaction.pin", "reaction.pin is a force and a moment; try: reaction.pin.force[0] or reaction.pin.moment[0]"),
        (
            "reaction.pin[2]",
            "reaction.pin is a force and a moment; try: reaction.pin.force[0] or reaction.pin.moment[0]",
        ),
        ("reaction.pni.force[0]", "reaction.pni: there is no joint, constraint or reaction 'pni'; try: pin"),
        ("reaction.pin.torque[0]", "reaction.pin has no part 'torque'"),
        ("reaction.pin.force", "reaction.pin.force has 3 components; try: reaction.pin.force[0]"),
        ("reaction.pin.force[3]", "reaction.pin.force has no component 3"),
        ("drive_effort.pin", "drive_effort.pin: pin has no drive"),
    ],
)
def test_what_is_said_of_formulas(formula: str, said: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        load_toml(PENDULUM.replace('"reaction.rod.moment[1]"', f'"{formula}"'))
    assert said in str(caught.value).replace(" (column 1)", "")


def test_a_force_cannot_depend_on_a_reaction() -> None:
    with pytest.raises(DescriptionError) as caught:
        load_toml(PENDULUM + '[efforts.friction]\njoint = "pin"\neffort = "-0.1 * reaction.pin.force[0]"\n')
    assert "reaction.pin cannot be used here" in str(caught.value) and "not accelerations" in str(caught.value)


@pytest.mark.parametrize(
    "entry, said",
    [
        ("{}", "a reaction needs one of joint and constraint, not none"),
        ('{ joint = "pin", constraint = "pin" }', "a reaction needs one of joint and constraint, not both"),
        ('{ joint = "pn" }', "there is no joint 'pn'; try: pin"),
        ('{ constraint = "pin" }', "there is no constraint 'pin'; try: a [constraints] section"),
        ('{ joint = "pin", point = "tip" }', "there is no point 'tip'; try: one of end"),
        ('{ joint = "pin", axes = "bop" }', "there is no body 'bop'; try: bob"),
    ],
)
def test_what_is_said_of_entries(entry: str, said: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        load_toml(PENDULUM.replace('{ joint = "pin", axes = "bob" }', entry))
    assert said in str(caught.value)


def test_reactions_of_an_included_file_have_its_prefix(tmp_path) -> None:
    (tmp_path / "part.toml").write_text(PENDULUM + 'outputs.plain = { reaction_force = "pin" }\n')
    (tmp_path / "whole.toml").write_text('format = 1\nname = "whole"\ninclude.left = { file = "part.toml" }\n')
    scene = load(tmp_path / "whole.toml")
    names = {item.name: {symbol.name for value in item.values for symbol in symbols(value)} for item in scene.outputs}
    assert names == {"left_load": {"left_rod"}, "left_plain": {"left_pin"}}
    assert scene.reactions[0] == Reaction("left_rod", "joints", "left_pin", None, "left_bob")


def test_absolute_coordinates_have_no_reaction_of_a_fixed_joint() -> None:
    text = PENDULUM + 'joints.weld = { type = "fixed", parent = "bob", child = "tip" }\nbodies.tip = { mass = 1 }\n'
    text = text.replace("mass = 2.0,", "mass = 2.0, inertia = [1, 1, 1],")
    text += 'outputs.it = { reaction_force = "weld" }\n'
    assert derive(load_toml(text), ["outputs"]).outputs[1].unit == "N"
    with pytest.raises(ModelError, match="the reaction of the fixed joint weld is unknown: absolute coordinates"):
        derive(load_toml(text, coordinates="absolute"), ["outputs"])
