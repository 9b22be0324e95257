"""Geometrically exact beams whose sections and initial shapes vary along the axis: what is read, and what is refused."""

# ruff: noqa: E501 (a row of the table is a message, quoted whole)

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.scene.load import from_data
from tests.models.cosserat import ROLL_UP, beam_scene
from tests.scene.test_cosserat_beams import beam_of, numbers

ROD = {"points": [[0, 0, 0], [1, 0, 0]]}
PART = {"length": 4.0, "elements": 2}
FRAME: dict[str, Any] = {"position": [1.0, 0.0, 0.0], "rotation": []}


def through(*frames: dict[str, Any]) -> dict[str, Any]:
    return {"frames": [{"position": [0, 0, 0]}, *frames]}


def about_z(angle: str) -> list[dict[str, Any]]:
    return [{"axis": [0, 0, 1], "angle": angle}]


def scene(changes: dict[str, Any], **sections: Any) -> dict[str, Any]:
    """Return a scene of a beam of 4 elements with other keys, without those that are None, and nothing on it."""
    data = beam_scene(4, {}, changes) | sections
    del data["forces"]
    data["beams"]["rope"] = {key: value for key, value in data["beams"]["rope"].items() if value is not None}
    return data


def test_linear_formulas_of_s_have_the_values_of_the_middle_of_each_element() -> None:
    parts = beam_of(from_data(scene({"mass_per_length": "load * (2 - s)"}))).parts
    found = [numbers((part.section.mass_per_length,))[0] for part in parts]
    np.testing.assert_allclose(found, 2.0 - np.array([1, 3, 5, 7]) / 8, rtol=1e-15)


def test_curves_give_what_was_measured_along_a_beam() -> None:
    curves = {"measured": {"points": [[0.0, 1.0], [0.5, 2.0], [1.0, 5.0]], "interpolation": "linear"}}
    parts = beam_of(from_data(scene({"mass_per_length": "measured(s) + 0 * load"}, curves=curves))).parts
    found = [numbers((part.section.mass_per_length,))[0] for part in parts]
    np.testing.assert_allclose(found, [1.25, 1.75, 2.75, 4.25], rtol=1e-15)


def test_what_a_part_does_not_say_is_the_beams() -> None:
    section = {
        "shape": "circle", "diameter": 0.1, "elastic_modulus": 2e11, "poisson_ratio": 0.3, "density": 1000.0,
    }  # fmt: skip  # a table
    parts = [PART, {**PART, "section": section}, {**PART, "stiffness": ROLL_UP | {"torsion": 7.0}, "elements": 1}]
    beam = beam_of(from_data(scene({"length": None, "elements": None, "parts": parts, "stiffness_damping": 0.5})))
    assert beam.places == (0.0, 2.0, 4.0, 6.0, 8.0, 12.0)
    stiffness = [numbers(part.section.stiffness[0])[0] for part in beam.parts]
    torsion = 2e11 / 2.6 * np.pi * 0.1**4 / 32
    np.testing.assert_allclose(stiffness, [500.0, 500.0, torsion, torsion, 7.0], rtol=1e-14)
    np.testing.assert_allclose([numbers(part.section.damping[0])[0] for part in beam.parts], 0.5 * np.array(stiffness))
    masses = [numbers((part.section.mass_per_length,))[0] for part in beam.parts]
    np.testing.assert_allclose(masses, [1.0, 1.0, *[250.0 * np.pi * 0.01] * 2, 1.0], rtol=1e-14)


def test_alike_elements_are_one() -> None:
    parts = beam_of(from_data(scene({"curvature": [0.0, 0.1, 0.0]}))).parts
    assert all(part is parts[0] for part in parts)


@pytest.mark.slow
def test_a_beam_of_points_has_the_length_of_its_curve() -> None:
    u = np.linspace(0.0, 2.0, 9)
    points = [[0.0, 0.0, 0.0], *np.column_stack([np.sin(u), 1.0 - np.cos(u), 0.0 * u])[1:].tolist()]
    assert beam_of(from_data(scene({"length": None, "shape": {"points": points}}))).length == pytest.approx(
        2.0, abs=2e-4
    )


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"elements": None, "parts": [PART]}, "(beams.rope.length): length is given, and parts too, which have their own"),
    ({"length": None}, "(beams.rope): the key length is missing; try: length = 1.0"),
    ({"length": 1e308}, "(beams.rope): the length of an element, 2.5e+307 m, is too large or too small to be squared"),
    (
        {"length": None, "elements": None, "parts": [{"length": 1.0, "elements": 10_000}, PART]},
        "(beams.rope.parts): the parts have 10002 elements, and 10000 are the most of a beam; try: fewer elements",
    ),
    ({"mass_per_length": "1 - 2 * s"}, "(beams.rope.mass_per_length): at s = 0.625, the mass per length is -0.25"),
    (
        {"rotary_inertia": [3.0, 1.0, 1.0]},
        "(beams.rope.rotary_inertia): no section has the rotary inertia 3 about x with 1 about y and 1 about z: one exceeds the sum of the others; try: [polar, about y, about z], of which the first is the sum of the others",
    ),
    (
        {"pretwist": "0.1 + s"},
        "(beams.rope.pretwist): the pretwist is 0.1 rad at s = 0, where sections have the axes of the beam; try: the angle from there on, and the rest as rotation of the joint",
    ),
    (
        {"pretwist": "90 deg"},
        "(beams.rope.pretwist): the pretwist is 1.5708 rad at s = 0, where sections have the axes of the beam; try: \"1.5708 * s\" for that much up to the other end, or a rotation of the joint",
    ),
    ({"pretwist": "15 * s"}, "(beams.rope.pretwist): one of the 4 elements turns by 214.859 degrees at rest, and only"),
    ({"shape": ROD}, "(beams.rope.length): length is given, and follows from the shape"),
    ({"curvature": [0, 0, 0.1], "length": None, "shape": ROD}, "(beams.rope.curvature): curvature and shape are both"),
    ({"length": None, "shape": {}}, "(beams.rope.shape): the shape has neither points nor frames; try: points = [[0,"),
    (
        {"length": None, "shape": {"points": [[0, 0, 0]]}},
        "(beams.rope.shape.points): a shape needs two points at least, not 1; try: [0, 0, 0], and where the beam goes",
    ),
    (
        {"length": None, "shape": {"points": [[0, 0, 0.5], [1, 0, 0]]}},
        "(beams.rope.shape.points[0]): the first of the points is at [0, 0, 0.5], and the origin of the beam's frame is there; try: [0, 0, 0]; the joint of the beam says its place",
    ),
    (
        {"length": None, "shape": {"points": [[0, 0, 0], [1, 0, 0], [1, 0, 0]]}},
        "(beams.rope.shape.points[2]): two of the points in succession are at one place; try: one of them",
    ),
    (
        {"length": None, "shape": {"points": [[0, 0, 0], [-1, 0, 1]]}},
        "(beams.rope.shape.points[1]): the second point is not ahead of the first one, from where the beam leaves along x; try: axes with x along the beam, and the rotation of its joint",
    ),
    ({"length": None, "shape": {"frames": [{"position": [0, 0, 0], "rotation": [{"axis": [0, 0, 1], "angle": 0.1}]}, FRAME]}}, "(beams.rope.shape.frames[0].rotation): the first frame is turned relative to the beam's frame, which it has to equal; try: no rotation here; the beam's"),
    (
        {"length": None, "shape": through({"position": [-1, 0, 0]})},
        "(beams.rope.shape.frames[1]): from the frame before the axis goes 180 degrees off the x of both; try: rotations with x along the beam, or points in place of frames",
    ),
    (
        {"length": None, "shape": through({"position": [0, 2, 0], "rotation": about_z("180 deg")})},
        "(beams.rope.shape.frames[1].rotation): the turn from the frame before by 180 degrees is not below 180; try: a frame between them",
    ),
    (
        {"prestrain": {"stretch": 1.5}},
        "(beams.rope.prestrain.stretch): a beam that is stretched by 1.5 of its length at the start has no length at rest; try: a number below 1: the length at rest is (1 - stretch) times the length of the initial shape",
    ),
    (
        {"rotary_inertia": [1.0, 1.0, 1e-14]},
        "(beams.rope.rotary_inertia): sections with a rotary inertia of 1 kg m about x, 1 about y and 1e-14 about z have none about some axis: it is below 1e-12 of the largest; try: a section that is less thin",
    ),
]  # fmt: skip  # a table


@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_what_no_beam_can_be_is_refused_with_one_message(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=re.escape(message)) as caught:
        from_data(scene(changes))
    assert len(caught.value.problems) == 1, str(caught.value)


NOTED: list[tuple[dict[str, Any], str]] = [
    (
        {"rotary_inertia": [5e4, 2.5e4, 2.5e4]},
        "beams.rope.rotary_inertia: the radius of gyration of the sections is 224 m, and the scene is no larger than 10 m; numbers without a unit are in kg m",
    ),
    (
        {"length": None, "rotary_inertia": [0.02, 0.01, 0.01], "shape": through({"position": [1.0, 0.1, 0.0]})},
        "beams.rope.shape.frames[1]: up to here sections, whose axes stiffnesses have, are 5.71 degrees off across the axis",
    ),
]


@pytest.mark.parametrize(("changes", "note"), NOTED)
def test_what_hardly_is_meant_is_noted_once(changes: dict[str, Any], note: str) -> None:
    data = scene(changes)
    del data["parameters"]
    assert from_data(data).notes == (note,)


def test_frames_of_an_arc_are_joined_by_it() -> None:
    places = [(k, {"position": [np.sin(k), 1 - np.cos(k), 0.0], "rotation": about_z(str(k))}) for k in (2.0, 4.0, 6.0)]
    beam = beam_of(from_data(scene({"length": None, "shape": through(*(frame for _, frame in places))})))
    assert beam.length == pytest.approx(6.0, rel=1e-12)
    np.testing.assert_allclose(beam.parts[2].twist, [0, 0, 1.5, 1.5, 0, 0], atol=1e-12)


def test_a_parameter_that_is_called_s_is_refused_where_s_is_the_place() -> None:
    data = scene({"mass_per_length": "2 * s"}, parameters={"s": {"value": 1.0}})
    data["joints"] = {"clamp": {"type": "fixed", "parent": "base", "child": "rope"}}
    message = "s is the place along the beam here, and a parameter is called so too (column 5); try: another name"
    with pytest.raises(DescriptionError, match=re.escape(message)):
        from_data(data)


def test_s_is_no_name_of_the_other_model() -> None:
    beam = {"length": 1.0, "mass_per_length": "1 + s", "bending_y": {"modes": 1, "stiffness": 1.0}}
    with pytest.raises(DescriptionError, match=r"beams\.rod\.mass_per_length\): unknown name 's'"):
        from_data({"format": 1, "name": "x", "beams": {"rod": beam}, "joints": scene({})["joints"]})
