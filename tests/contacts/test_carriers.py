"""Contacts on beams, on bases that move and on surfaces that move: powers, partials, and the rate of the gap."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.errors import DescriptionError
from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from tests.contacts.pairs import scene_of
from tests.contacts.states import OWN
from tests.mechanics.checks import check_partials, check_powers, states_of
from tests.mechanics.test_beam_energy import nearly_straight
from tests.oracles.evaluation import tape_evaluator
from tests.oracles.states import derivative

#: NumPy evaluates both branches of a choice, and square roots of places without a contact.
pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")
SCENE = """format = 1
name = "ball"
inputs = {{ lift = {{}}, lift_rate = {{}} }}
points.ground = {{ body = "world", position = [0.1, 0.2, -0.1] }}
outputs.seen.formula = ["gap.floor", "gap_rate.floor", "normal_force.floor"]
[curves.rough]
points = [[-9, 0.2], [-1, 0], [0, 0.1], [1, 0], [9, 0.3]]
interpolation = "linear"
[bodies.ball]
mass = 2
inertia = [0.128, 0.13, 0.12]
[joints.ball]
type = "free"
parent = "base"
child = "ball"
[contacts.floor]
first = {{ {first}, axis = [0.1, 0, 1], x_axis = [1, 0, 0] }}
second = {{ {second} }}
{shape}
normal = {{ type = "linear", stiffness = 300, damping = 20, onset = 0.2 }}
tangential = {{ {law} }}
{more}
"""
COULOMB, VISCOUS = 'type = "coulomb", friction = 0.4, velocity = 0.5', 'type = "viscous", damping = 0.2'
BASE = """[base]
position = ["0.3 * sin(2 * t)", "0.1 * t", 0]
rotation = [{ axis = [1, 2, 3], angle = "0.4 * sin(t)" }]
"""
BEAM = """[joints.root]
type = "free"
parent = "base"
child = "beam"
[beams.beam]
length = 2.0
mass_per_length = 3.0
"""
SHAPES = f"""{BEAM}polar_inertia = 0.1
bending_y = {{ modes = 2, stiffness = 400 }}
bending_z = {{ modes = 1, stiffness = 500 }}
torsion = {{ modes = 1, stiffness = 40 }}
"""
EXACT = f"""{BEAM}model = "cosserat"
elements = 2
rotary_inertia = [0.1, 0.1, 0.1]
stiffness = {{ stretch = 500, shear_y = 400, shear_z = 400, torsion = 40, bending_y = 50, bending_z = 50 }}
"""
BALL, TIP = 'body = "ball", position = [0.1, 0.05, 0.02]', 'body = "beam", position = [2.0, 0.1, 0.05]'
WHEEL = f"{BALL}, axis = [0.1, 1, 0]"
GROUND, WORLD = 'body = "base"', 'point = "ground"'
SPHERE, FOLLOWER = 'shape = "sphere"\nradius = 2.0', 'shape = "follower"\nradius = 1.0'
WAVES, ROUGH = '"0.1 * sin(0.5 * x + 3 * t) + 0.02 * y**2"', '"rough(x) + 0.1 * sin(3 * t) * y"'
CASES = {
    "a sphere on a beam": (TIP, BALL, SPHERE, SHAPES),
    "a sphere on an exact beam": (TIP, BALL, SPHERE, EXACT),
    "a beam on the ground": (GROUND, TIP, SPHERE, SHAPES),
    "an exact beam on the ground": (GROUND, TIP, SPHERE, EXACT),
    "a moving base": (GROUND, BALL, SPHERE, BASE),
    "the world under a moving base": (WORLD, BALL, SPHERE, BASE),
    "a moving surface": (GROUND, BALL, f"{SPHERE}\nsurface = {WAVES}", ""),
    "a moving surface of the world": (WORLD, BALL, f"{SPHERE}\nsurface = {WAVES}", BASE),
    "a follower on a moving road": (WORLD, WHEEL, f"{FOLLOWER}\nsurface = {ROUGH}", BASE),
    "a follower on a beam": (TIP, WHEEL, f"{FOLLOWER}\nsurface = {ROUGH}", SHAPES),
}


def scene(first: str, second: str, shape: str, more: str, law: str = VISCOUS) -> Scene:
    return scene_of(SCENE.format(first=first, second=second, shape=shape, more=more, law=law))


@pytest.mark.slow
@pytest.mark.slow_except("a beam on the ground", "a moving surface", "a follower on a moving road")
@pytest.mark.parametrize("case", CASES)
def test_powers_and_partials_and_the_rate_of_the_gap(case: str, rng: np.random.Generator) -> None:
    carried = scene(*CASES[case])
    system = derive(carried, ["residual", "partials", "energy", "forward_dynamics", "outputs"])
    evaluate, state = tape_evaluator(system), states_of(system, rng, count=12)
    if "exact" not in case:
        state = nearly_straight(system, state)
    gap, rate, force = evaluate("outputs", state)["y"].T
    known = np.isfinite(gap)
    assert np.count_nonzero(known) > 4 and np.count_nonzero(force[known] > 1.0) > 1
    state = {name: block[known] for name, block in state.items()}
    rates = {"q": state["v"], "t": np.ones((len(state["v"]), 1))}
    change = derivative(evaluate, system.factors, "outputs", state, rates)["y"][:, 0]
    np.testing.assert_allclose(change, rate[known], rtol=1e-9, atol=1e-10)
    check_partials(system, state, 1e-10)
    state["a"] = evaluate("forward_dynamics", state)["vdot"]
    check_powers(system, state, 1e-10)


def test_absolute_coordinates_have_the_forces_of_joints(rng: np.random.Generator) -> None:
    first, second, shape, _ = CASES["a follower on a moving road"]
    text = SCENE.format(first=first, second=second, shape=shape, more="", law=COULOMB)
    systems = [derive(scene_of(text, coordinates=coordinates), ["force"]) for coordinates in ("joint", "absolute")]
    state = states_of(systems[0], rng, count=12)
    joint, absolute = (tape_evaluator(system)("force", state)["Q"] for system in systems)
    assert np.abs(joint).max() > 100.0
    np.testing.assert_allclose(absolute, joint, rtol=1e-11, atol=1e-10)


def test_inputs_move_a_surface_by_their_rate(rng: np.random.Generator) -> None:
    """The force is that of a surface over time with the same height and rate."""
    surfaces = ('"lift + 0.1 * x"\nsurface_rate = "lift_rate"', '"0.3 + 0.7 * t + 0.1 * x"')
    seen = []
    for surface in surfaces:
        system = derive(scene(GROUND, BALL, f"{SPHERE}\nsurface = {surface}", ""), ["force", "outputs"])
        state = states_of(system, np.random.default_rng(2), count=12)
        state["u"][:], state["t"][:] = [0.3, 0.7], 0.0
        evaluate = tape_evaluator(system)
        seen.append(np.hstack([evaluate("force", state)["Q"], evaluate("outputs", state)["y"]]))
    assert np.abs(seen[0]).max() > 100.0
    np.testing.assert_allclose(*seen, rtol=1e-12, atol=1e-12)


def test_a_follower_on_a_plane_is_an_upright_disc(rng: np.random.Generator) -> None:
    """With a law of slip too, whose forces act on the road and not at the lowest point of the disc."""
    law = 'type = "brush", coefficients = { STIFFNESS = 15, FRICTION = 0.9 }'
    forces = []
    for shape in ("disc", "follower"):
        text = SCENE.format(first=GROUND, second=WHEEL, shape=f'shape = "{shape}"\nradius = 1.0', more="", law=law)
        system = derive(
            scene_of(text.replace("[0.1, 0, 1]", "[0, 0, 1]").replace("[0.1, 1, 0]", "[0, 1, 0]")), ["force"]
        )
        q, v = np.array([[1, 0, 0, 0, 0.3, -0.2, 0.7]]), np.array([[0.1, 6.0, 0.3, 5.0, 0.4, -0.2]])
        state = {"q": q, "v": v, "t": np.zeros((1, 1)), "u": np.zeros((1, 2)), "z": np.array([[0.05, -0.03]])}
        forces.append(tape_evaluator(system)("force", state)["Q"][0])
    assert np.abs(forces[0]).min() > 0.1
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-12)


def test_followers_take_maps_and_kinks() -> None:
    values = "[[0, 0, 0], [0, 0.2, 0], [0, 0, 0]]"
    maps = f'[maps.land]\nx = [-1, 0, 1]\ny = [-1, 0, 1]\nvalues = {values}\noutside = "hold"\n'
    gaps = []
    for surface in ("map.land(x, y)", "rough(x) + 0.1"):
        text = SCENE.format(
            first=GROUND, second=WHEEL, shape=f'{FOLLOWER}\nsurface = "{surface}"', more=maps, law=COULOMB
        )
        system = derive(scene_of(text.replace("[0.1, 0, 1]", "[0, 0, 1]")), ["outputs"])
        q, v = np.array([[1, 0, 0, 0, -0.1, -0.05, 1.0]]), np.zeros((1, 6))
        state = {"q": q, "v": v, "t": np.zeros((1, 1)), "u": np.zeros((1, 2))}
        gaps.append(tape_evaluator(system)("outputs", state)["y"][0, 0])
    np.testing.assert_allclose(gaps, 0.02 - 0.2, rtol=1e-12)


@pytest.mark.slow
def test_a_tyre_by_file_drives_on_a_measured_road() -> None:
    """Over a crest with a kink, after which the wheel is in the air; with half the step the loads are the same within a
    hundredth of the largest."""
    law = f'type = "magic_formula", file = "{OWN.as_posix()}"'
    shape = 'shape = "follower"\nradius = 0.31\nsurface = "rough(0.5 * (x - 1.2)) - 0.1"'
    text = SCENE.format(first=GROUND, second=WHEEL, shape=shape, more="", law=law).replace("[0.1, 0, 1]", "[0, 0, 1]")
    text = text.replace(", position = [0.1, 0.05, 0.02], axis = [0.1, 1, 0]", ", axis = [0, 1, 0]")
    text = text.replace('normal = { type = "linear", stiffness = 300, damping = 20, onset = 0.2 }', "")
    text = text.replace("mass = 2\ninertia = [0.128, 0.13, 0.12]", "mass = 300\ninertia = [20, 1, 20]")
    start = "initial = { position = [0, 0, 0.235], velocity = [0, 32, 0, 10, 0, 0] }"
    model = eomgen.build(scene_of(text.replace('child = "ball"', f'child = "ball"\n{start}')), profile="quick")
    coarse, fine = (model.simulate(0.25, step) for step in (1e-3, 5e-4))
    assert coarse.success and fine.success
    loads = [run.outputs["seen"][:: 250 * k // 10, 2] for run, k in ((coarse, 1), (fine, 2))]
    assert loads[0].min() == 0.0 and loads[0].max() > 6000.0
    np.testing.assert_allclose(*loads, atol=1e-2 * loads[0].max())


WRONG = {
    'surface = "lift"': "(contacts.floor): the contact needs the rate of the surface, which does not follow",
    'surface = "0.1 * x"\nsurface_rate = "1"': "(contacts.floor.surface_rate): no input moves the surface",
    'surface = "0.1 * sin(t)"\nsurface_rate = "5"': "(contacts.floor.surface_rate): no input moves the surface",
    "surface_rate = 1": "(contacts.floor.surface_rate): no input moves the surface, whose rate follows",
    'surface = "rough(x)"': "(contacts.floor.surface): a contact needs three derivatives of its surface, and rough"
    ' bends at -9; try: interpolation = "quintic", or shape = "follower" for a wheel',
    'surface = "abs(x)"': "(contacts.floor.surface): a contact needs three derivatives of its surface, and abs has a"
    ' corner; try: a smooth function, such as sqrt(x**2 + d**2) for abs(x), or shape = "follower" for a wheel',
    'surface = "z"': "(contacts.floor.surface): the height of a surface depends on x and y, not on z; try: ",
    'surface = "q.ball"': "(contacts.floor.surface): q.ball",
}


@pytest.mark.parametrize("keys", WRONG)
def test_what_a_wrong_surface_is_told(keys: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        scene(GROUND, BALL, f"{SPHERE}\n{keys}", "")
    assert WRONG[keys] in str(caught.value)
