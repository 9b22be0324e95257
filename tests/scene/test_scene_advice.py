"""What a newcomer stumbles over: degrees, follow-on problems, the world, units left out; each message is asserted
whole."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.scene.load import load_toml
from tests.models.cache import shared_cache
from tests.models.urdf import load_urdf
from tests.models.urdf import replaced as urdf_replaced
from tests.oracles.evaluation import tape_evaluator
from tests.scene.test_scene_files import PENDULUM, problems, read, replaced

__all__ = ["shared_cache"]

RADIANS = 'try: angles are in radians: 45 * pi / 180, or "45 deg" alone'


@pytest.mark.parametrize(
    ("formula", "what"),
    [
        ("45 * deg", "unknown name 'deg' (column 6)"),
        ("-(45 deg)", "the number '45' runs into a name (column 3)"),
        ("t + 45deg", "the number '45' runs into a name (column 5)"),
        ("-(45\N{DEGREE SIGN})", "the character '\\xb0' (U+00B0 DEGREE SIGN) is not part of formulas (column 5)"),
    ],
)
def test_degrees_are_answered_with_radians(formula: str, what: str) -> None:
    [found] = problems(f'rest = "{formula}"')
    assert found == f"scene.toml:15 (joints.hinge.rest): {what}; {RADIANS}"


def test_degrees_may_be_a_parameter() -> None:
    text = PENDULUM.replace("length = 0.8", "length = 0.8\ndeg = 0.017453292519943295", 1)
    assert read('rest = "45 * deg"', text).joints[0].rest is not None


@pytest.mark.parametrize("section", ["points", "frames"])
def test_a_place_in_another_unit_is_noted_by_its_own_key(section: str) -> None:
    text = FLOATING.replace("mass = 1", "mass = 1, inertia = [0.1, 0.1, 0.1]") + "".join(
        f'[{kind}.{name}]\nbody = "ball"\nposition = [{x}, 0, 0]\n'
        for kind, name, x in (("points", "a", 0.3), ("points", "b", 0.4), (section, "far", 500))
    )
    (note,) = [note for note in load_toml(text).notes if ".far." in note]
    fault = f"{section}.far.position: the point is 500 m from the body's origin, and all else is within 0.4 m; numbers"
    assert note == f"{fault} without a unit are in m"


# -- one cause, one problem --------------------------------------------------------------------------------------------

FLOATING = """
format = 1
name = "ball"
bodies.ball = { mass = 1 }
joints.root = { type = "free", parent = "base", child = "ball" }
"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", 'scene.toml: the scene is empty; try: format = 1, name = "...", and [bodies] and [joints]'),
        (
            replaced("[0, 1, 0]", '"-z"'),
            "(joints.hinge.axis): a list of 3 entries is needed here, not '-z'; try: [0, 0, -1]",
        ),
    ],
)
def test_one_cause_is_one_problem(text: str, expected: str) -> None:
    found = problems(text=text)
    assert expected in found[0]
    assert len(found) == 1 + ("principal moments" in expected)


def test_a_missing_axis_hides_no_inertia_that_cannot_be() -> None:
    text = replaced("axis = [0, 1, 0]\n", "").replace("inertia = [0.1, 0.1, 0.01]", "inertia = [0, 0, 0]")
    text = text.replace("center_of_mass", "#")
    assert [problem.partition(": ")[2] for problem in problems(text=text)] == [
        "a revolute joint needs an axis; try: axis = [0, 0, 1]"
    ]


def test_formulas_that_mention_a_refused_name_are_not_problems() -> None:
    text = PENDULUM.replace("length = 0.8", 'length = 0.8\n"my-mass" = 2\nmax = 3', 1)
    extra = 'rest = "my-mass * 2"\nstiffness = "max * length"\ndamping = "nonsense"'
    found = problems(extra, text)
    assert [problem.partition("(")[2].partition(":")[0] for problem in found] == [
        "parameters.'my-mass')",
        "parameters.max)",
        "joints.hinge.damping)",
    ]


# -- the world ---------------------------------------------------------------------------------------------------------

TETHERED = """
format = 1
name = "tethered"
gravity = [0, 0, 0]
bodies.cart = { mass = 2 }
springs.tether = { first = "hook", second = "anchor", stiffness = 30, damping = 0.5, length = 1.2 }
[base]
position = ["0.3 * sin(2 * t)", 0, 0]
[joints.rail]
type = "prismatic"
parent = "base"
child = "cart"
axis = [1, 0, 0]
damping = 0.8
initial = { velocity = 0.4 }
[points]
hook = { body = "cart" }
anchor = { body = "world", position = [2, 0, 0] }
[outputs]
anchor = { position = "anchor" }
speed = { velocity = "hook" }
acceleration = { acceleration = "hook" }
kinetic = { energy = "kinetic" }
supply = { energy = "base_power" }
own = { position = "hook", unit = "mm" }
"""


def test_a_spring_to_the_world_pulls_by_its_length_in_the_world() -> None:
    system = eomgen.derive(load_toml(TETHERED), terms=["force", "outputs"])
    t, q, v = 0.4, 0.15, -0.7
    x, speed = 0.3 * np.sin(2 * t) + q, 0.6 * np.cos(2 * t) + v
    evaluate = tape_evaluator(system)
    state = {"t": np.array([[t]]), "q": np.array([[q]]), "v": np.array([[v]])}
    state["base"] = evaluate("base", state)["base"]
    tension = 30 * ((2 - x) - 1.2) - 0.5 * speed
    assert evaluate("force", state)["Q"][0, 0] == pytest.approx(tension - 0.8 * v, rel=1e-12)


@pytest.mark.slow
def test_energy_is_balanced_with_a_spring_to_the_world() -> None:
    solution = eomgen.build(load_toml(TETHERED), profile="quick").simulate(2.0, 1e-3, method="rk4")
    power = solution.energy["power"] + solution.energy["base_power"]
    work = np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(solution.t))
    assert abs(solution.energy["total"][-1] - solution.energy["total"][0] - work) < 1e-5
    assert np.max(np.abs(solution.energy["base_power"])) > 0.1
    np.testing.assert_allclose(solution.outputs["anchor"], np.tile([2.0, 0.0, 0.0], (len(solution.t), 1)), atol=1e-14)


def test_the_world_is_no_body() -> None:
    [taken] = problems("[bodies.world]\nmass = 1")
    assert taken.startswith(
        "scene.toml:15 (bodies.world): the name world is reserved for the frame at rest while the base moves; try: "
    )
    [pushed] = problems('[forces]\nf = { body = "world" }')
    assert pushed == "scene.toml:16 (forces.f.body): a force on the world has no effect: it rests; try: a body"
    [parent] = problems(text=replaced('parent = "base"', 'parent = "world"'))
    assert parent.endswith("(joints.hinge.parent): there is no body 'world'; try: base")


def test_a_link_named_world() -> None:
    text = urdf_replaced('"foot"', '"world"')
    assert next(point.name for point in load_urdf(text).points) == "world"
    scene = load_urdf(text, root="free")
    assert scene.joints[0].child == "world_link"
    assert scene.notes[0].startswith("the link world is the body world_link, because world is the name of the frame at")


# -- units and angles --------------------------------------------------------------------------------------------------


def test_outputs_by_name_have_units() -> None:
    units = {output.name: output.unit for output in load_toml(TETHERED).outputs}
    assert units == {"anchor": "m", "speed": "m/s", "acceleration": "m/s^2", "kinetic": "J", "supply": "W", "own": "mm"}


def test_angles_near_a_right_one_are_told_from_exact_ones() -> None:
    def notes(shoulder: str) -> list[str]:
        text = urdf_replaced('<child link="upper"/>', f'<child link="upper"/><origin rpy="{shoulder} 0 0"/>')
        return [note for note in load_urdf(text).notes if "right angle" in note]

    assert notes("1.57079632679") == notes("0.0005") == notes("1.5") == []
    for angle in ("1.5708", "-3.1416"):
        assert notes(angle) == [
            f"angles near a right angle, but not exact, are kept in the poses of shoulder ({angle}): "
            "pi/2 written in full, 1.5707963267948966, would be made exact and save operations"
        ]


def test_a_constraint_between_two_points_of_the_world_closes_nothing() -> None:
    points = '[points]\na = { body = "world" }\nb = { body = "world", position = [1, 0, 0] }\n'
    [found] = problems(f'{points}[constraints]\nc = {{ type = "distance", first = "a", second = "b", length = 1 }}')
    assert "(constraints.c.second): both frames are in the same rigid body: world; try: " in found


def test_bodies_of_absolute_coordinates_have_inertia() -> None:
    text = 'coordinates = "absolute"\n' + replaced("inertia = [0.1, 0.1, 0.01]\n", "")
    [found] = problems(text=text)
    fault = "scene.toml:7 (bodies.link): in absolute coordinates the body link has a free joint, and the bodies that it"
    assert found.startswith(f"{fault} carries lack mass, or inertia about some axis; try: inert")
    assert read(text='coordinates = "absolute"\n' + PENDULUM).coordinates == "absolute"
