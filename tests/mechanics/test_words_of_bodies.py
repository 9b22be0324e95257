"""Rotation vectors and angular velocities of bodies in formulas, against poses and their rates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import eomgen
from eomgen.errors import DescriptionError
from eomgen.mechanics.derive import derive
from eomgen.scene.load import load_toml
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.states import derivative, jacobian, on_base, quaternion_product, random_states, rotation_of

SCENE = """
format = 1
name = "chain"
coordinates = "joint"
[base]
position = ["sin(t)", 0, 0]
rotation = [{ axis = [0, 1, 2], angle = "0.7 * t" }]
[bodies.ship]
mass = 1
inertia = [1, 2, 2.5]
[bodies.arm]
mass = 1
inertia = [1, 2, 2.5]
[bodies.hand]
mass = 1
inertia = [1, 2, 2.5]
[joints.sea]
type = "free"
parent = "base"
child = "ship"
[joints.elbow]
type = "revolute"
parent = "ship"
child = "arm"
axis = [1, 2, 3]
position = [0.1, 0.2, 0.3]
damping = 0.1
[joints.wrist]
type = "fixed"
parent = "arm"
child = "hand"
rotation = [{ axis = [1, 0, 0], angle = 0.4 }]
position = [0, 0.3, 0]
[outputs]
turn = { formula = ["rotation.hand[0]", "rotation.hand[1]", "rotation.hand[2]"], unit = "rad" }
turning = { formula = ["angular_velocity.hand[0]", "angular_velocity.hand[1]", "angular_velocity.hand[2]"] }
"""
PART = """
format = 1
name = "part"
[bodies.disc]
mass = 1
inertia = [1, 1, 1]
[joints.axle]
type = "revolute"
parent = "base"
child = "disc"
axis = [0, 0, 1]
[outputs]
speed = { formula = "angular_velocity.disc[2]" }
"""


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_turn_and_turning_are_of_the_pose_and_its_rate(coordinates: str, rng: np.random.Generator) -> None:
    """Along velocities and the base's motion, by complex steps: dR/dt R' is the matrix of the angular velocity."""
    system = derive(load_toml(SCENE.replace('"joint"', f'"{coordinates}"')), ("outputs", "poses", "residual"))
    evaluate = tape_evaluator(system)
    state = on_base(evaluate, random_states(system, 8, rng))
    hand = list(system.bodies).index("hand")
    R = rotation_of(evaluate("poses", state)["pose"][:, hand, :4])
    y = evaluate("outputs", state)["y"]
    np.testing.assert_allclose(Rotation.from_rotvec(y[:, :3]).as_matrix(), R, atol=1e-11)
    rates = derivative(evaluate, system.factors, "poses", state, {"q": state["v"], "t": np.ones((8, 1))})["pose"]
    quaternion, rate = evaluate("poses", state)["pose"][:, hand, :4], rates[:, hand, :4]
    back = quaternion * np.array([1.0, -1.0, -1.0, -1.0])
    np.testing.assert_allclose(2.0 * quaternion_product(rate, back)[:, 1:], y[:, 3:], atol=1e-12)


def test_angular_accelerations_are_the_rates_of_angular_velocities(rng: np.random.Generator) -> None:
    """On a body that turns, and on the moving base; complex steps along the motion."""
    words = [
        f"angular_{of}.{body}[{k}]"
        for of in ("velocity", "acceleration")
        for body in ("hand", "frame")
        for k in range(3)
    ]
    parts = (
        SCENE.split("[outputs]", maxsplit=1)[0]
        + f"""
[bodies.frame]
mass = 1
[joints.held]
type = "fixed"
parent = "base"
child = "frame"
[outputs]
words = {{ formula = {words} }}
"""
    )
    system = derive(load_toml(parts), ("outputs",))
    evaluate = tape_evaluator(system)
    state = on_base(evaluate, random_states(system, 4, rng))
    along = {"q": state["v"], "v": state["a"], "t": np.ones((4, 1))}
    rates = derivative(evaluate, system.factors, "outputs", state, along)["y"]
    np.testing.assert_allclose(evaluate("outputs", state)["y"][:, 6:], rates[:, :6], atol=1e-11)


def test_forces_by_the_motion_of_bodies_have_exact_partials(rng: np.random.Generator) -> None:
    effort = """
[efforts.gyro]
joint = "elbow"
effort = "-2 * angular_velocity.hand[0] * rotation.ship[1] - 3 * rotation.arm[2]"
"""
    system = derive(load_toml(SCENE + effort), ("residual", "partials"))
    evaluate = tape_evaluator(system)
    state = on_base(evaluate, random_states(system, 4, rng))
    found = evaluate("partials", state)
    for name, block in (("K", "q"), ("C", "v")):
        expected = jacobian(evaluate, system.factors, "residual", "r", state, block)
        assert relative_error(found[name], expected, axes=2) < 1e-11


@pytest.mark.slow
def test_a_run_records_both(tmp_path: Path) -> None:
    moving = 'child = "ship"\ninitial = { velocity = [1, 2, 0, 0, 0, 0] }'
    run = eomgen.build(load_toml(SCENE.replace('child = "ship"', moving)))
    solution = run.simulate(0.5, 1e-3)
    turns = Rotation.from_rotvec(solution.outputs["turn"])
    by_differences = (turns[2:] * turns[:-2].inv()).as_rotvec() / 2e-3
    np.testing.assert_allclose(by_differences, solution.outputs["turning"][1:-1], atol=2e-6)
    pose = run.pose("hand", solution.q, t=solution.t)
    np.testing.assert_allclose(turns.as_matrix(), rotation_of(pose[:, :4]), atol=1e-12)


def test_bodies_of_included_files_have_the_names_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "part.toml").write_text(PART, encoding="utf-8")
    whole = """
format = 1
name = "whole"
[include.left]
file = "part.toml"
[outputs]
same = { formula = "angular_velocity.left_disc[2]" }
"""
    (tmp_path / "whole.toml").write_text(whole, encoding="utf-8")
    scene = eomgen.load(tmp_path / "whole.toml")
    assert {output.values for output in scene.outputs} == {scene.outputs[0].values}


BEAM = """
[beams.rope]
length = 1.0
model = "cosserat"
elements = 2
mass_per_length = 0.05
rotary_inertia = [2e-7, 1e-7, 1e-7]
stiffness = { stretch = 1e4, shear_y = 3e3, shear_z = 3e3, torsion = 0.02, bending_y = 0.03, bending_z = 0.03 }
[joints.root]
type = "fixed"
parent = "base"
child = "rope"
"""


@pytest.mark.parametrize(
    ("formula", "fault"),
    [
        ("rotation.hand", "rotation.hand has 3 components (column 1); try: rotation.hand[0]"),
        ("rotation.hand[3]", "rotation.hand has no component 3 (column 1); try: an index from 0 to 2"),
        ("angular_velocity.han[0]", "angular_velocity.han: there is no body 'han' (column 1); try: hand"),
        (
            "rotation.rope[0]",
            "rotation.rope: the beam rope bends, and has no axes of its own (column 1); try: a body that is fixed to"
            " the beam at the place of interest",
        ),
    ],
)
def test_mistakes_are_named(formula: str, fault: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        load_toml(f'{SCENE}\nx = {{ formula = "{formula}" }}\n{BEAM}')
    assert fault in str(caught.value)
