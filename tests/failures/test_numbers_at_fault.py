"""Mistakes in constraints, maps, shapes, states and definitions whose messages name the number that is at fault."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from eomgen.errors import DescriptionError, ModelError
from eomgen.pipeline import pipeline
from eomgen.scene.load import from_data

ARM: dict[str, Any] = {
    "format": 1,
    "name": "arm",
    "bodies": {
        "cart": {"mass": 2.0},
        "arm": {"mass": 1.5, "center_of_mass": [0, 0, -0.4], "inertia": [0.03, 0.03, 0.002]},
    },
    "joints": {
        "rail": {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0]},
        "hinge": {
            "type": "revolute",
            "parent": "cart",
            "child": "arm",
            "axis": [0, 1, 0],
            "initial": {"position": 0.5},
        },
    },
    "points": {
        "tip": {"body": "arm", "position": [0, 0, -0.4]},
        "pin": {"body": "cart", "position": [0, 0.1, 0]},
        "mount": {"body": "base", "position": [0.5, 0, 0]},
    },
}
HELD: dict[str, Any] = ARM | {"joints": {**ARM["joints"], "rail": {"type": "fixed", "parent": "base", "child": "cart"}}}
BALL: dict[str, Any] = {
    "format": 1,
    "name": "ball",
    "bodies": {"ball": {"mass": 1.0, "inertia": [0.004, 0.004, 0.004]}},
    "joints": {"ball": {"type": "free", "parent": "base", "child": "ball", "initial": {"position": [5, 0, 0.1]}}},
}
TIP = {"first": {"body": "base"}, "second": {"body": "arm", "position": [0, 0, -0.4]}}
GROUND = {
    "type": "sliding",
    "first": {"body": "base", "axis": [0, 0, 1]},
    "second": {"body": "ball"},
    "shape": "sphere",
}
SIZES = "numbers without a unit are in m and in rad"
MOTOR = {"x": [-100, 0, 100], "x_unit": "rad/s", "y": [0, 12], "values": [[1, 2], [0, 3], [-1, 4]], "outside": "hold"}


def formula(equation: str, **sections: Any) -> dict[str, Any]:
    return {**sections, "constraints": {"c": {"type": "formula", **TIP, "equation": equation}}}


@pytest.mark.parametrize(
    ("base", "sections", "pieces"),
    [
        pytest.param(
            ARM,
            formula("z + 0.35 - lift(x)", curves={"lift": {"points": [[-500, 0], [-250, 5], [0, 8], [500, 0]]}}),
            ("off: c: formula by -7.33; lift has points from -500 to 500, with values from 0 to 8; try: ", SIZES),
            id="a curve in mm",
        ),
        pytest.param(
            ARM,
            formula("z - slot(x)", curves={"slot": {"points": [[0.1, -0.35], [0.15, -0.351], [0.25, -0.353]]}}),
            (
                "c: formula; slot has points from 0.1 to 0.25, with values from -0.353 to -0.35; try: a state in which"
                " the formula and its derivatives have values, within the ends of its curves and maps",
            ),
            id="a curve that begins beyond the start",
        ),
        pytest.param(
            HELD,
            {"constraints": {"rod": {"type": "distance", "first": "mount", "second": "tip", "length": 500}}},
            (
                "rod: distance by -499; in doubt is constraints.rod.length: the length is 500 m, and the scene is no"
                " larger than 0.5 m; try: ",
                SIZES,
            ),
            id="a length in mm",
        ),
        pytest.param(
            BALL,
            {
                "maps": {"land": {"x": [0, 4, 8], "y": [-1, 0, 1], "values": [[0, 0, 0], [0.1, 0, 0], [0, 0, 0]]}},
                "constraints": {"ground": {**GROUND, "radius": 0.1, "surface": "map.land(y, x)"}},
            },
            (
                "contact with the surface; map.land along x has points from 0 to 8; map.land"
                " along y has points from -1 to 1; try: a start near the surface and within the ends of its curves and"
                " maps",
            ),
            id="a map asked outside its grid",
        ),
    ],
)
def test_constraints_that_are_not_met_name_their_numbers(
    base: Mapping[str, Any], sections: Mapping[str, Any], pieces: tuple[str, ...]
) -> None:
    with pytest.raises(ModelError) as refused:
        pipeline.derive(from_data({**base, **sections}), ["forward_dynamics"])
    for piece in pieces:
        assert piece in str(refused.value)


def test_a_linear_equation_is_met_from_any_distance() -> None:
    scene = from_data(ARM | {"constraints": {"c": {"type": "formula", "equation": "q.hinge - 90 - 0.3 * sin(t)"}}})
    system = pipeline.derive(scene, ["forward_dynamics"])
    assert system.initial_q[1] == pytest.approx(90.0, rel=1e-12)
    assert any(
        note.startswith("constraints.c.equation: q.hinge stands against 90 rad, 14.3 turns") for note in scene.notes
    )


@pytest.mark.parametrize(("radius", "told"), [(100, True), (0.1, False), (5, False)])
def test_radii_beyond_the_scene_are_told(radius: float, told: bool) -> None:
    data = BALL | {"constraints": {"ground": {**GROUND, "radius": radius}}}
    data["joints"] = {"ball": {**BALL["joints"]["ball"], "initial": {"position": [0.5, 0, 0.1]}}}
    note = (
        "constraints.ground.radius: the radius is 100 m, and the scene is no larger than 0.5 m; numbers without a unit"
        " are in m"
    )
    assert (note in from_data(data).notes) == told


def test_a_curve_far_above_the_scene_is_told() -> None:
    lift = {"points": [[-500, 0], [-250, 50], [0, 80], [500, 0]]}
    note = "curves.lift: the largest value of the curve is 80 m, and the scene is no larger than 0.5 m; numbers without"
    for equation, told in (("z + 0.35 - lift(x)", True), ("z + 0.35 - lift(x) / 1000", False)):
        notes = from_data(ARM | formula(equation, curves={"lift": lift})).notes
        assert any(each.startswith(note) for each in notes) == told


@pytest.mark.parametrize(
    ("body", "first", "told"),
    [
        ("arm", "mount", "the point mount belongs to base, and the shape moves with arm: motion of hinge, rail takes"),
        ("base", "tip", "the point tip belongs to arm, and the shape moves with base: motion of hinge, rail takes"),
        ("arm", "pin", ""),  # on the axis of the hinge
        ("cart", "tip", "the point tip belongs to arm, and the shape moves with cart: motion of hinge takes"),
    ],
)
def test_shapes_that_leave_their_points_are_told(body: str, first: str, told: str) -> None:
    second = "tip" if first != "tip" else "pin"
    rod = {"type": "capsule", "body": body, "first": first, "second": second, "radius": 0.01}
    rod["second"] = {"arm": "tip", "base": "mount", "cart": "pin"}[body]
    notes = [note for note in from_data(ARM | {"shapes": {"rod": rod}}).notes if note.startswith("shapes.")]
    if told:
        assert notes == [f"shapes.rod.first: {told} one from the other; try: a point of {body}"]
    else:
        assert notes == []


@pytest.mark.parametrize(
    ("sections", "message"),
    [
        (
            {"maps": {"motor": MOTOR}, "efforts": {"e": {"joint": "hinge", "effort": "map.motor(12, v.hinge)"}}},
            "map.motor takes x in rad/s, and y is given in rad/s; try: map.motor(x, y), with both arguments exchanged",
        ),
        (
            {"states": {"angle": {"sample": "1 ms", "next": "q.hinge"}}},
            "the key 'next' is unknown here; try: formula",
        ),
        (
            {"constraints": {"c": {"type": "rolling", "friction": 0.8, **TIP}}},
            "the key 'friction' is unknown here; try: no friction: a rolling contact does not slip",
        ),
    ],
)
def test_descriptions_name_cause_and_remedy(sections: Mapping[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError) as refused:
        from_data(ARM | dict(sections))
    assert message in str(refused.value)
    assert "is missing" not in str(refused.value)


def on_rail(effort: str, **sections: Any) -> dict[str, Any]:
    return {**sections, "efforts": {"e": {"joint": "rail", "effort": effort}}}


ROAD = {"road": {"points": [[0, 0], [0.1, 20], [0.2, 0], [0.3, 15], [1, 0]]}}
BY_PLANE = {"first": {"body": "base", "axis": [0, 0, -1]}, "radius": 0.1}


@pytest.mark.parametrize(
    ("base", "sections", "note"),
    [
        (
            ARM,
            on_rail("-min(position.tip[2] + 400, 0)"),
            "efforts.e.effort: position.tip[2] stands against 400 m, and the size of the scene is 0.5 m: lengths in"
            ' formulas are in m; try: a parameter of "400 mm" in its place',
        ),
        (
            ARM,
            {"base": {"rotation": [{"axis": [0, 0, 1], "angle": "30*sin(t)"}]}},
            "base.rotation[0].angle goes to and fro over 60 rad, 9.55 turns: angles in formulas are radians; try: a"
            ' parameter of "30 deg" as the amplitude',
        ),
        (
            ARM,
            {"curves": ROAD, "base": {"position": [0, 0, "road(t)"]}, "simulation": {"duration": 0.3, "step": 1e-3}},
            "base.position[2] shakes the base over 22.59 m, and the size of the scene is 0.5 m: numbers without a"
            " unit are in m; try: the unit of the curve's values, or a factor of 0.001",
        ),
        (
            BALL,
            {"constraints": {"c": {"type": "formula", "equation": "q.ball[3] - 0.1", "unit": "rad"}}},
            "constraints.c.equation: q.ball[3] is a component of a quaternion, of the half angle, and no angle; try: a"
            " joint of angles, such as universal, or 2 * asin(q.ball[k])",
        ),
        (BALL, {"constraints": {"c": {"type": "formula", "equation": "q.ball[6] - 0.1", "unit": "m"}}}, ""),
        (
            BALL,
            {"constraints": {"c": {**GROUND, **BY_PLANE}}},
            "constraints.c: ball starts 0.1 m below the plane, and is moved to the side of its z axis; try: first.axis"
            " in the opposite direction, or a start on this side",
        ),
        (BALL, {"constraints": {"c": {**GROUND, "radius": 0.1}}}, ""),
    ],
)
def test_values_out_of_place_are_told(base: Mapping[str, Any], sections: Mapping[str, Any], note: str) -> None:
    notes = [text for text in from_data({**base, **sections}).notes if not text.startswith("road:")]
    assert notes == ([note] if note else [])


@pytest.mark.parametrize("radius", [25, 400])
def test_angles_and_quaternions_at_the_start_are_no_lengths(radius: float) -> None:
    """A hinge at 0.5 rad and an arm of 4 mm: the scene is no larger than 4 mm."""
    arm = {**ARM["bodies"]["arm"], "center_of_mass": [0, 0, 0.004]}
    data = {**ARM, "bodies": {"cart": {"mass": 2e-6}, "arm": {**arm, "mass": 1e-6, "inertia": [0, 0, 0]}}, "points": {}}
    data["shapes"] = {"s": {"type": "sphere", "body": "arm", "radius": f"{radius} / 1000"}}
    note = "shapes.s: the size of the shape is 0.4 m, and the scene is no larger than 0.004 m; numbers without a unit"
    assert any(text.startswith(note) for text in from_data(data).notes) == (radius == 400)
