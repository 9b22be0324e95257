"""Joints, points and frames given in another frame at the design position: equal to placements in their own bodies."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import eomgen
from eomgen.errors import DescriptionError
from eomgen.formula.evaluate import evaluate, symbols
from tests.models.cosserat import beam_scene

BODY = {"mass": 1.0, "inertia": [0.1, 0.2, 0.3]}


def scene_of(joints: dict[str, Any], **sections: Any) -> Any:
    bodies = {entry["child"]: BODY for entry in joints.values()}
    return eomgen.load({"format": 1, "name": "drawn", "bodies": bodies, "joints": joints, **sections})


def numbers(position: Any, parameters: dict[str, float]) -> np.ndarray:
    return np.array([evaluate(item, lambda symbol: parameters[symbol.name]) for item in position])


def rotation_of(matrix: Any) -> list[dict[str, Any]]:
    vector = Rotation.from_matrix(matrix).as_rotvec()
    return [{"axis": vector.tolist(), "angle": float(np.linalg.norm(vector))}]


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 6))
def test_placements_in_any_frame_are_the_same_as_in_their_own(seed: int, count: int) -> None:
    """Random trees: poses composed by SciPy, given in the world or in a random earlier body, against the parent."""
    rng = np.random.default_rng(seed)
    turned = [Rotation.random(random_state=rng) for _ in range(count)]
    place = rng.uniform(-1.0, 1.0, (count, 3))
    points = rng.uniform(-1.0, 1.0, (count, 3))
    joints: dict[str, Any] = {}
    expected = {}
    poses = {"base": (Rotation.identity(), np.zeros(3)), "world": (Rotation.identity(), np.zeros(3))}
    for number in range(count):
        parent = "base" if number == 0 else f"b{rng.integers(number)}"
        frames = ["world", "base", *(f"b{other}" for other in range(number))]
        frame = frames[rng.integers(len(frames))]
        carrier, origin = poses[frame]
        poses[f"b{number}"] = carrier * turned[number], origin + carrier.apply(place[number])
        joints[f"j{number}"] = {
            "type": "spherical", "parent": parent, "child": f"b{number}",
            "position": place[number].tolist(), "in": frame,
            "rotation": rotation_of(turned[number].as_matrix()),
        }  # fmt: skip  # a table
        own, at = poses[parent]
        expected[f"j{number}"] = own.inv() * poses[f"b{number}"][0], own.inv().apply(poses[f"b{number}"][1] - at)
    given_points = {
        f"p{number}": {"body": f"b{number}", "position": points[number].tolist(), "in": f"b{count - 1}"}
        for number in range(count)
    }
    scene = scene_of(joints, points=given_points)
    for joint in scene.joints:
        axes, position = expected[joint.name]
        assert np.abs(numbers(joint.position, {}) - position).max() < 1e-13
        assert np.abs(np.array(joint.orientation) - axes.as_matrix()).max() < 1e-12
    last, at = poses[f"b{count - 1}"]
    for number, point in enumerate(scene.points):
        own, origin = poses[f"b{number}"]
        expected_point = own.inv().apply(at + last.apply(points[number]) - origin)
        assert np.abs(numbers(point.position, {}) - expected_point).max() < 1e-12


ARMS = {
    "upper": {"type": "revolute", "parent": "base", "child": "upper", "axis": [0, 1, 0], "position": [0.1, 0, "h"]},
    "lower": {
        "type": "revolute", "parent": "upper", "child": "lower", "axis": [0, 1, 0],
        "position": ["0.1 + l", 0, "h"], "in": "world",
    },
}  # fmt: skip  # a table
LENGTHS = {"h": {"value": 0.7, "tunable": True}, "l": {"value": 0.4, "tunable": True}}


def test_formulas_of_parameters_stay_and_shared_parts_cancel() -> None:
    points = {
        "tip": {"body": "lower", "position": ["0.1 + 2 * l", 0, "h - l"], "in": "world"},
        "knee": {"body": "upper", "position": [0, 0, 0], "in": "lower"},
    }
    scene = scene_of(ARMS, parameters=LENGTHS, points=points)
    lower = scene.joints[1]
    assert [sorted(symbol.name for symbol in symbols(item)) for item in lower.position] == [["l"], [], []]
    tip = scene.points[0].position
    assert [sorted({symbol.name for symbol in symbols(item)}) for item in tip] == [["l"], [], ["l"]]
    for parameters in ({"h": 0.7, "l": 0.4}, {"h": -2.0, "l": 3.0}):
        length = parameters["l"]
        assert np.abs(numbers(lower.position, parameters) - [length, 0, 0]).max() < 1e-15
        assert np.abs(numbers(tip, parameters) - [length, 0, -length]).max() < 1e-15
        assert np.abs(numbers(scene.points[1].position, parameters) - [length, 0, 0]).max() < 1e-15


@pytest.mark.slow
def test_a_distance_without_a_length_is_the_one_of_the_design_position() -> None:
    """The length follows tunable parameters, parts that both places share cancel, and no note disturbs the choice."""
    points = {"end": {"body": "lower", "position": [0.1, "3 * l", "h"], "in": "world"}}
    tie = {"type": "distance", "first": {"body": "upper", "position": [0, 0, "l"]}, "second": "end"}
    scene = scene_of(ARMS, parameters=LENGTHS, points=points, constraints={"tie": tie})
    length = scene.constraints[0].length
    assert {symbol.name for symbol in symbols(length)} == {"l"}
    for value in (0.4, 3.0):
        assert evaluate(length, lambda symbol, value=value: value) == pytest.approx(np.sqrt(10.0) * value, rel=1e-15)
    assert scene.notes == ()
    run = eomgen.build(scene).simulate(0.01, 1e-3, parameters={"l": 0.5}, error_estimate=False)
    assert not run.metadata["corrections"]


def test_masses_of_a_list_in_the_world_are_the_ones_in_the_bodies() -> None:
    """Centre of mass and inertia of a turned body, given in the world, against SciPy's rotation."""
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5])
    joints = {
        "a": {
            "type": "spherical", "parent": "base", "child": "a", "position": [1, "h", 3],
            "rotation": rotation_of(turn.as_matrix()),
        }
    }  # fmt: skip  # a table
    inertia = np.array([[0.3, 0.02, -0.01], [0.02, 0.25, 0.03], [-0.01, 0.03, 0.2]])
    body = {"mass": 2.0, "center_of_mass": [1.1, "h + 0.2", 3.3], "inertia": inertia.tolist(), "in": "world"}
    scene = eomgen.load({"format": 1, "name": "drawn", "parameters": LENGTHS, "bodies": {"a": body}, "joints": joints})
    (read,) = scene.bodies
    R = turn.as_matrix()
    for height in (0.7, -2.0):
        center = numbers(read.center_of_mass, {"h": height})
        np.testing.assert_allclose(center, R.T @ [0.1, 0.2, 0.3], atol=1e-14)
    xx, yy, zz, xy, xz, yz = numbers(read.inertia, {})
    own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    np.testing.assert_allclose(own, R.T @ inertia @ R, atol=1e-14)
    joints["a"] |= {"position": [0, 0, 0]}
    with pytest.raises(DescriptionError, match="in needs a center_of_mass, in the axes of world") as caught:
        eomgen.load({"format": 1, "name": "d", "bodies": {"a": {**BODY, "in": "world"}}, "joints": joints})
    assert "try: center_of_mass = [0, 0, 0]" in str(caught.value)


def test_a_force_acts_at_a_place_of_the_world() -> None:
    joints = {**ARMS, "lower": {**ARMS["lower"], "rotation": [{"axis": [0, 0, 1], "angle": "90 deg"}]}}
    push = {"body": "lower", "point": [0.2, 0.3, 0.4], "force": [1, 2, 3], "in": "world"}
    (force,) = scene_of(joints, parameters=LENGTHS, forces={"push": push}).elements
    place = numbers(force.point, {"h": 0.7, "l": 0.4})
    assert place == pytest.approx([0.3, 0.3, -0.3], abs=1e-15)
    for change, said in (
        ({"in": "wrld"}, "forces.push.in): there is no body 'wrld'; try: world"),
        ({"point": None}, "forces.push.in): in needs a point, in the axes of world; try: point = [0, 0, 0]"),
    ):
        wrong = {key: value for key, value in {**push, **change}.items() if value is not None}
        with pytest.raises(DescriptionError, match=re.escape(said)):
            scene_of(joints, parameters=LENGTHS, forces={"push": wrong})


def test_frames_of_constraints_and_bushings_turn_with_the_frame_they_are_given_in() -> None:
    quarter = [{"axis": [0, 0, 1], "angle": "90 deg"}]
    joints = {
        "a": {"type": "revolute", "parent": "base", "child": "a", "axis": [0, 0, 1], "rotation": quarter},
        "b": {"type": "free", "parent": "base", "child": "b", "initial": {"position": [1, 0, 0]}},
    }
    sides = {
        "first": {"body": "a", "position": [1, 0, 0], "axis": [1, 0, 0], "x_axis": [0, 0, 1], "in": "world"},
        "second": {"point": "end", "axis": [1, 0, 0], "x_axis": [0, 0, 1], "in": "world"},
    }
    points = {"end": {"body": "b", "position": [0, 0, 0]}}
    bushing = {**sides, "stiffness": [1e3, 1e3, 1e3]}
    scene = scene_of(
        joints, points=points, constraints={"pin": {"type": "revolute", **sides}}, bushings={"rubber": bushing}
    )
    for held in (scene.constraints[0], scene.elements[0]):
        assert numbers(held.first.position, {}).tolist() == [0, -1, 0]
        assert np.array(held.first.orientation)[:, 2].tolist() == [0, -1, 0]
        assert np.array(held.second.orientation)[:, 2].tolist() == [1, 0, 0]


UNKNOWN = "the design position is not known: "
AXIS_ALONE = {"body": "lower", "axis": [0, 0, 1], "in": "world"}
MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "circle": (
        {"joints": {**ARMS, "lower": {**ARMS["lower"], "in": "lower"}}},
        f'joints.lower.in): {UNKNOWN}these bodies are placed in one another: lower, lower; try: in = "base"',
    ),
    "moving base": (
        {"base": {"position": ["sin(t)", 0, 0]}},
        f'joints.lower.in): {UNKNOWN}the base has a place of its own in the world; try: in = "base"',
    ),
    "axis alone": (
        {"constraints": {"c": {"type": "spherical", "first": AXIS_ALONE, "second": {"body": "base"}}}},
        "constraints.c.first.in): in needs a position",
    ),
}


@pytest.mark.parametrize(("change", "message"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_are_told_with_their_key(change: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=re.escape(message)):
        scene_of(**{"joints": ARMS, "parameters": LENGTHS, **change})


MOVING = {
    "joints": {"hinge": {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 1, 0]}},
    "base": {"position": ["t", 0, 0]},
}


def test_a_point_of_the_world_is_placed_in_the_world_although_the_base_moves() -> None:
    (point,) = scene_of(**MOVING, points={"mark": {"body": "world", "position": [1, 2, 3], "in": "world"}}).points
    assert (point.body, numbers(point.position, {}).tolist()) == ("world", [1, 2, 3])


@pytest.mark.parametrize("frame", ["base", "arm"])
def test_a_point_of_the_world_is_not_placed_in_frames_that_move_with_the_base(frame: str) -> None:
    with pytest.raises(DescriptionError) as raised:
        scene_of(**MOVING, points={"mark": {"body": "world", "position": [1, 2, 3], "in": frame}})
    fault = "(points.mark.in): the design position is not known: the base has a place of its own in the world"
    assert f'{fault}; try: in = "world", or body = "base"' in str(raised.value)


def test_places_on_exact_beams_are_counted_along_the_beam() -> None:
    data = beam_scene(4, {"force": [0.0, 0.0, 1.0]})
    data.setdefault("points", {})["end"] = {"body": "rope", "position": [1.0, 0, 0], "in": "world"}
    with pytest.raises(DescriptionError) as raised:
        eomgen.load(data)
    assert "points.end.in): the design position is not known: places on the geometrically exact beam rope are" in str(
        raised.value
    )


def test_constraints_have_places_of_frames_and_equations_have_none() -> None:
    hinge = {"type": "revolute", "parent": "base", "axis": [0, 1, 0]}
    hinges = {name: {**hinge, "child": name} for name in ("arm", "leg")}
    constraints = {
        "gear": {"type": "formula", "equation": "q.arm - 2 * q.leg", "unit": "rad"},
        "pin": {"type": "spherical", "first": {"body": "arm", "position": [1, 0, 0]}, "second": {"body": "leg"}},
    }
    places = scene_of(hinges, constraints=constraints).design_places()
    named = [place.name for place in places if place.name.startswith("constraints.")]
    assert named == ["constraints.pin.first", "constraints.pin.second"]
