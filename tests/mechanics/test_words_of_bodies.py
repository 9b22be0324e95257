"""Rotation vectors and angular velocities of bodies in formulas, against poses and their rates."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import eomgen
from eomgen.errors import DescriptionError
from eomgen.mechanics.derive import derive
from tests.mechanics.checks import states_of
from tests.models.library import scene_file
from tests.models.toml_text import toml_text
from tests.oracles.evaluation import tape_evaluator
from tests.oracles.states import derivative, quaternion_product, rotation_of

WORDS = {
    "turn": [f"rotation.hand[{k}]" for k in range(3)],
    "turning": [f"angular_velocity.hand[{k}]" for k in range(3)],
    "turning_faster": [f"angular_acceleration.hand[{k}]" for k in range(3)],
}


def chain(coordinates: str = "joint", **words: list[str] | str) -> eomgen.SceneBuilder:
    """Return a ship on a base that moves, with an arm and a hand that is fixed to it, and outputs of formulas."""
    builder = eomgen.SceneBuilder("chain", coordinates=coordinates)
    builder.base(position=["sin(t)", 0, 0], rotation=[([0, 1, 2], "0.7 * t")])
    for body in ("ship", "arm", "hand"):
        builder.body(body, 1.0, inertia=[1, 2, 2.5])
    builder.joint("sea", "free", "base", "ship", initial={"velocity": [1, 2, 0, 0, 0, 0]})
    place: dict[str, Any] = {"axis": [1, 2, 3], "position": [0.1, 0.2, 0.3], "damping": 0.1}
    builder.joint("elbow", "revolute", "ship", "arm", **place)
    builder.joint("wrist", "fixed", "arm", "hand", rotation=[([1, 0, 0], 0.4)], position=[0, 0.3, 0])
    for name, formula in words.items():
        builder.output(name, formula=formula)
    return builder


def gyroscope() -> eomgen.Scene:
    """Return the chain with an effort by the motion of its bodies."""
    effort = "-2 * angular_velocity.hand[0] * rotation.ship[1] - 3 * rotation.arm[2]"
    return chain().effort("gyro", "elbow", effort).build()


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_turn_and_turning_are_of_the_pose_and_its_rate(coordinates: str, rng: np.random.Generator) -> None:
    """Along velocities and the base's motion, by complex steps: dR/dt R' is the matrix of the angular velocity."""
    words = {name: WORDS[name] for name in ("turn", "turning")}
    system = derive(chain(coordinates, **words).build(), ("outputs", "poses", "residual"))
    evaluate, state = tape_evaluator(system), states_of(system, rng, 8)
    hand = list(system.bodies).index("hand")
    y, quaternion = evaluate("outputs", state)["y"], evaluate("poses", state)["pose"][:, hand, :4]
    np.testing.assert_allclose(Rotation.from_rotvec(y[:, :3]).as_matrix(), rotation_of(quaternion), atol=1e-11)
    rates = derivative(evaluate, system.factors, "poses", state, {"q": state["v"], "t": np.ones((8, 1))})["pose"]
    back = quaternion * np.array([1.0, -1.0, -1.0, -1.0])
    np.testing.assert_allclose(2.0 * quaternion_product(rates[:, hand, :4], back)[:, 1:], y[:, 3:], atol=1e-12)


def test_angular_accelerations_are_the_rates_of_angular_velocities(rng: np.random.Generator) -> None:
    """On a body that turns, and on one that the moving base holds; complex steps along the motion."""
    kinds = [(kind, body) for kind in ("turning", "turning_faster") for body in ("hand", "frame")]
    builder = chain(**{f"{kind}_{body}": [text.replace("hand", body) for text in WORDS[kind]] for kind, body in kinds})
    system = derive(builder.body("frame", 1.0).joint("held", "fixed", "base", "frame").build(), ("outputs",))
    evaluate, state = tape_evaluator(system), states_of(system, rng)
    along = {"q": state["v"], "v": state["a"], "t": np.ones((4, 1))}
    rates = derivative(evaluate, system.factors, "outputs", state, along)["y"]
    np.testing.assert_allclose(evaluate("outputs", state)["y"][:, 6:], rates[:, :6], atol=1e-11)


def test_bodies_of_included_files_have_the_names_of_the_file(tmp_path: Path) -> None:
    scene_file(tmp_path, "pendulum", outputs__angle={"formula": "angular_velocity.rod[1]"})
    outputs = {"same": {"formula": "angular_velocity.left_rod[1]"}}
    whole = {"format": 1, "name": "whole", "include": {"left": {"file": "pendulum.toml"}}, "outputs": outputs}
    (tmp_path / "whole.toml").write_text(toml_text(whole), encoding="utf-8")
    one, other = eomgen.load(tmp_path / "whole.toml").outputs
    assert one.values == other.values


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
    strains = ("stretch", "shear_y", "shear_z", "torsion", "bending_y", "bending_z")
    section: dict[str, Any] = {"stiffness": dict.fromkeys(strains, 1.0), "rotary_inertia": [1, 1, 1]}
    builder = chain(x=formula).beam("rope", 1.0, model="cosserat", elements=2, mass_per_length=0.05, **section)
    with pytest.raises(DescriptionError) as caught:
        builder.joint("root", "fixed", "base", "rope").build()
    assert fault in str(caught.value)
