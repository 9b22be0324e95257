"""Scenes with constraints are made ready: redundant rows found and named, guesses corrected, contradictions refused by
name."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.errors import ModelError
from eomgen.mechanics.derive import derive
from eomgen.pipeline.initial_assembly import constraint_equations, with_initial_assembly
from eomgen.scene.bodies.model import Body
from eomgen.scene.joints.model import Constraint, Frame, Joint
from eomgen.scene.scene import Scene
from eomgen.system.system import System
from tests.oracles.formulas import number, vector

CRANK, COUPLER, ROCKER, GROUND = 0.3, 0.8, 0.6, 0.9

EXAMPLES = Path(__file__).parents[2] / "examples"


def bar(name: str, length: float) -> Body:
    inertia = tuple(number(value) for value in (0.001, 0.01, 0.01, 0.0, 0.0, 0.0))
    return Body(name, number(1.0), vector((length / 2, 0, 0)), inertia)  # type: ignore[arg-type]  # six entries


def hinge(name: str, parent: str, child: str, at: float, angle: float, rate: float) -> Joint:
    place = vector((at, 0, 0))
    return Joint(name, "revolute", parent, child, position=place, initial_position=(angle,), initial_velocity=(rate,))


def four_bar(coordinates: str = "joint", rocker: float = ROCKER, tilt: float = 0.0) -> Scene:
    """Return a planar four-bar from a guess that does not close; revolute where three of five equations say nothing
    new."""
    tilted = ((1.0, 0.0, 0.0), (0.0, math.cos(tilt), -math.sin(tilt)), (0.0, math.sin(tilt), math.cos(tilt)))
    joints = (
        hinge("a", "base", "crank", 0.0, 1.2, 3.0),
        hinge("b", "crank", "coupler", CRANK, -1.0, 0.0),
        hinge("c", "base", "rocker", GROUND, 1.9, 0.0),
    )
    end, tip = Frame("coupler", vector((COUPLER, 0, 0))), Frame("rocker", vector((rocker, 0, 0)), tilted)
    loop = Constraint("loop", "revolute", end, tip)
    bodies = (bar("crank", CRANK), bar("coupler", COUPLER), bar("rocker", rocker))
    return Scene("four_bar", bodies, joints, constraints=(loop,), coordinates=coordinates)  # type: ignore[arg-type]


def assembled(scene: Scene) -> System:
    return with_initial_assembly(partial(derive, scene))


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_redundant_rows_of_a_planar_loop_are_named_and_left_out(coordinates: str) -> None:
    system = assembled(four_bar(coordinates))
    assert [name for name in system.multipliers if name.startswith("loop")] == [
        "loop: origins meet along x",
        "loop: origins meet along y",
    ]
    assert [note for note in system.notes if "left out" in note] == [
        "loop: origins meet along z follows from the constraints before it and is left out",
        "loop: z stays perpendicular to x follows from the constraints before it and is left out",
        "loop: z stays perpendicular to y follows from the constraints before it and is left out",
    ]
    B = constraint_equations(system).jacobian(np.array(system.initial_q), 0.0)
    assert np.linalg.matrix_rank(B) == len(system.multipliers) == system.nv - 1


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_a_guess_is_corrected_and_the_note_says_by_how_much(coordinates: str) -> None:
    system = assembled(four_bar(coordinates))
    q, v = np.array(system.initial_q), np.array(system.initial_v)
    equations = constraint_equations(system)
    assert np.abs(equations.constraint(q, 0.0)).max() <= 1e-12
    assert np.abs(equations.velocity(q, v, 0.0)).max() <= 1e-12
    closing = [math.cos(1.2) * CRANK + math.cos(0.2) * COUPLER, math.sin(1.2) * CRANK + math.sin(0.2) * COUPLER]
    rocker = [GROUND + math.cos(1.9) * ROCKER, math.sin(1.9) * ROCKER]
    gap = np.array(closing) - np.array(rocker)
    turned = math.cos(1.9) * gap[0] + math.sin(1.9) * gap[1]  # in the second frame's axes
    assert f"initial position corrected: loop: origins meet along x was off by {turned:.3g}" in system.notes


def test_the_corrected_loop_closes_as_triangles_say() -> None:
    q = assembled(four_bar()).initial_q
    first, second = q[0], q[0] + q[1]
    end = [CRANK * f(first) + COUPLER * f(second) for f in (math.cos, math.sin)]
    assert np.allclose(end, [GROUND + math.cos(q[2]) * ROCKER, math.sin(q[2]) * ROCKER], atol=1e-12)


@pytest.mark.parametrize(
    ("coordinates", "key"), [("joint", "constraints.rocker_pin"), ("absolute", "joints.crank_pin")]
)
def test_a_loop_of_a_file_that_cannot_close_is_refused_with_its_line(
    coordinates: str, key: str, tmp_path: Path
) -> None:
    text = (EXAMPLES / "four_bar" / "scene.toml").read_text(encoding="utf-8")
    text = text.replace("ground = { value = 0.4", "ground = { value = 4")
    file = tmp_path / "scene.toml"
    file.write_text(text.replace('name = "four_bar"', f'name = "f"\ncoordinates = "{coordinates}"'), encoding="utf-8")
    line = file.read_text(encoding="utf-8").splitlines().index(f"[{key}]") + 1
    with pytest.raises(ModelError) as caught:
        eomgen.derive(eomgen.load(file))
    assert caught.value.problems[0].where == f"{file.name}:{line} ({key})"


@pytest.mark.slow_except("1e-09-joint")
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("tilt", [1e-9, 1e-8, 1e-7])
def test_a_loop_whose_axes_fit_to_seven_digits_is_the_planar_one(coordinates: str, tilt: float) -> None:
    """Seven digits are what a drawing has; taken at their word, the rows would lock the loop, or contradict each
    other."""
    planar, tilted = assembled(four_bar(coordinates)), assembled(four_bar(coordinates, tilt=tilt))
    assert tilted.multipliers == planar.multipliers
    np.testing.assert_allclose(tilted.initial_q, planar.initial_q, rtol=0, atol=tilt)
    np.testing.assert_allclose(tilted.initial_v, planar.initial_v, rtol=0, atol=10.0 * tilt)
    said = (
        "loop: z stays perpendicular to y follows from the constraints before it and is left out, though it is off by"
        f" {tilt:.3g}"
    )
    assert said in tilted.notes


def test_an_axis_out_of_the_plane_is_a_contradiction() -> None:
    with pytest.raises(ModelError, match="loop: z stays perpendicular to y"):
        assembled(four_bar(tilt=math.radians(5.0)))


@pytest.mark.parametrize("length", [1.323, 1.3, 1.1])
def test_a_drive_that_begins_at_zero_leaves_the_other_rows_no_less_exact(length: float) -> None:
    """Its summands are zero there, so that rounding is all of them."""
    builder = eomgen.SceneBuilder("driven").body("cart", 2.0).body("top", 1.5, inertia=[0.1, 0.14, 0.08])
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], drive="0.1 * sin(3 * t)")
    start = {"position": [0.8, 0.36, -0.48, 0.0]}
    builder.joint("ball", "spherical", "cart", "top", initial=start)
    ends = {"body": "base", "position": [0.6, 0.5, 0.9]}, {"body": "top", "position": [0.3, 0.0, 0.5]}
    scene = builder.constraint("rod", "distance", *ends, length=length).build()
    system = with_initial_assembly(partial(derive, scene))
    assert np.abs(constraint_equations(system).constraint(np.array(system.initial_q), 0.0)).max() < 1e-14


def test_references_of_turns_are_not_among_the_corrections() -> None:
    scene = eomgen.load(EXAMPLES / "four_bar" / "scene.toml", coordinates="absolute")
    system = eomgen.derive(scene, terms=["mass"])
    assert len(system.angles) == 2
    assert len(system.initial_q) == 21 + len(system.angles)
    assert any(note.startswith("initial position corrected: ") for note in system.notes)
