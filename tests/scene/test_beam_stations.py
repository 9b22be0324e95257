"""Stations of geometrically exact beams: what is attached between equal nodes gets a node of its own."""

# ruff: noqa: E501 (a row of the table is a message, quoted whole)

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.scene.bodies.cosserat_reading import widths_between
from eomgen.scene.load import from_data
from tests.models.cosserat import beam_scene
from tests.scene.test_cosserat_beams import beam_of, numbers

AXIS = {"axis": [0, 0, 1], "x_axis": [1, 0, 0]}


def scene(elements: int, **sections: Any) -> dict[str, Any]:
    data = beam_scene(elements, {})
    del data["forces"]
    joints = sections.pop("joints", {})
    data["joints"] |= joints
    return data | sections


def test_a_force_between_nodes_gets_one_and_the_elements_stay_as_many() -> None:
    data = scene(8, forces={"push": {"body": "rope", "point": [4.0, 0.1, 0.2], "force": [0, 0, 1]}})
    found = from_data(data)
    beam = beam_of(found)
    np.testing.assert_allclose(beam.places, [0, 4 / 3, 8 / 3, 4, 5.2, 6.4, 7.6, 8.8, 10], rtol=1e-15)
    assert found.forces[0].body == "rope.3" and numbers(found.forces[0].point) == [0.0, 0.1, 0.2]


def test_where_equal_nodes_are_at_all_places_they_stay_equal() -> None:
    data = scene(8, forces={"push": {"body": "rope", "point": [2.5, 0.0, 0.0], "force": [0, 0, 1]}})
    assert {part.length for part in beam_of(from_data(data)).parts} == {Fraction(5, 4)}


ATTACHED: dict[str, dict[str, Any]] = {
    "points": {"points": {"eye": {"body": "rope", "position": [3.0, 0.0, 0.0]}}},
    "frames": {"frames": {"eye": {"body": "rope", "position": [3.0, 0.0, 0.0]}}},
    "joints": {
        "bodies": {"ball": {"mass": 1.0, "inertia": [1, 1, 1]}},
        "joints": {"pin": {"type": "spherical", "parent": "rope", "child": "ball", "position": ["a + 1", 0, 0]}},
        "parameters": {"a": {"value": 2.0}, "load": {"value": 1.0, "tunable": True}},
    },
    "constraints": {
        "constraints": {
            "hold": {"type": "spherical", "first": {"body": "base", "position": [3, 0, 0]}, "second": {"body": "rope", "position": [3, 0, 0]}},
        }
    },
    "bushings": {
        "bushings": {
            "mount": {"first": {"body": "base", **AXIS}, "second": {"body": "rope", "position": [3.0, 0, 0], **AXIS}, "stiffness": [1, 1, 1]}
        }
    },
}  # fmt: skip  # one line for each end


@pytest.mark.parametrize("kind", ATTACHED)
def test_nodes_are_wherever_anything_is_attached(kind: str) -> None:
    found = from_data(scene(4, **ATTACHED[kind]))
    np.testing.assert_allclose(beam_of(found).places, [0.0, 3.0, 16 / 3, 23 / 3, 10.0], rtol=1e-15)


def test_more_places_than_elements_make_more_elements_and_a_note_says_so() -> None:
    points = {f"p{k}": {"body": "rope", "position": [x, 0.0, 0.0]} for k, x in enumerate((1.0, 3.0, 3.0, 7.0))}
    found = from_data(scene(2, points=points))
    assert beam_of(found).places == (0.0, 1.0, 3.0, 7.0, 10.0)
    what = "2 elements become 4, since something is attached at more places than they have nodes"
    assert any(what in note for note in found.notes), found.notes


def test_parts_keep_their_ends_and_their_own_elements() -> None:
    data = scene(4, points={"eye": {"body": "rope", "position": [2.5, 0.0, 0.0]}})
    del data["beams"]["rope"]["length"], data["beams"]["rope"]["elements"]
    data["beams"]["rope"]["parts"] = [{"length": 2.0, "elements": 2}, {"length": 2.0, "elements": 3}]
    np.testing.assert_allclose(beam_of(from_data(data)).places, [0.0, 1.0, 2.0, 2.5, 3.25, 4.0], rtol=1e-15)


def test_elements_are_as_short_as_can_be() -> None:
    assert widths_between([Fraction(0), Fraction(1), Fraction(10)], 4) == (1, 3, 3, 3)
    assert widths_between([Fraction(0), Fraction(5), Fraction(10)], 1) == (5, 5)


NAMES: list[tuple[dict[str, Any], str]] = [
    (
        {"bodies": {"ball": {"mass": 1.0, "inertia": [1, 1, 1]}}, "joints": {"pin": {"type": "fixed", "parent": "rope.3", "child": "ball"}}},
        '(joints.pin.parent): rope.3 is a node of the beam rope, which a scene calls by its place; try: parent = "rope" and position = [7.5, 0, 0]',
    ),
    ({"joints": {"pin": {"type": "fixed", "parent": "base", "child": "rope.2"}}},
        '(joints.pin.child): rope.2 is a node of the beam rope, whose elements carry it; try: child = "rope" at '
        "its first end, or a constraint at x = 5"),
    ({"forces": {"push": {"body": "rope.3", "force": [0, 0, 1]}}},
        "(forces.push.body): 'rope.3' may be a node of the beam rope, and a scene calls nodes by their places; "
        'try: "rope", and a position on it'),
]  # fmt: skip  # one line for each scene


@pytest.mark.parametrize(("sections", "message"), NAMES)
def test_nodes_are_called_by_their_places(sections: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=re.escape(message)) as caught:
        from_data(scene(4, **sections))
    assert len(caught.value.problems) == 1, str(caught.value)
