"""Carriers of the objects in an animation: bodies by number, frames along beams behind them, and sections of beams."""

from __future__ import annotations

import base64
import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.products.pictures.animation import FEWEST, LARGEST, RATE, _Carriers, _packed_shape, _thinned
from eomgen.products.pictures.beam_curves import drawn_beams, nearest_station, outline, pieces_of
from eomgen.system.description import BASE, WORLD

POSES = {"cabin": np.zeros((2, 7)), "boom": np.zeros((2, 7)), "rope": np.zeros((2, 7)), "rope.2": np.zeros((2, 7))}
AXIS = {"name": "boom", "x": [0.0, 1.0, 3.0]}
ROPE = {"nodes": ["rope", "rope.2"], "outline": [[0.3, 0.4], [0.1, 0.0]]}


def carriers(**more: Any) -> _Carriers:
    return _Carriers({**POSES, **more}, {"axes": [AXIS], "beams": [ROPE]})


def test_frames_along_beams_are_numbered_behind_the_bodies() -> None:
    made = carriers()
    assert made.along == {"boom": [4, 5, 6], "rope": list(range(7, 16))}  # one element in eight pieces
    assert made.count == 16
    assert [made.of(name) for name in ("cabin", "rope.2", WORLD, BASE)] == [0, 3, -1, -1]
    assert carriers(base=np.zeros((2, 7))).of(BASE) == 4


def test_places_on_a_beam_are_carried_by_the_nearest_frame() -> None:
    made = carriers()
    assert made.place("cabin", [1.0, 2.0, 3.0]) == {"carrier": 0, "position": [1.0, 2.0, 3.0]}
    assert made.place("boom", [2.5, 0.2, -0.1]) == {"carrier": 6, "position": [-0.5, 0.2, -0.1]}
    assert made.place("boom", [1.9, 0.2, -0.1]) == {"carrier": 5, "position": [pytest.approx(0.9), 0.2, -0.1]}
    assert nearest_station(AXIS, [-1.0, 0.0, 0.0]) == (0, [-1.0, 0.0, 0.0])


def test_bodies_have_ties_from_the_axes_of_beams_in_place_of_links() -> None:
    made, links = carriers(), [[1.0, 0.0, 0.5]]
    assert made.body({"name": "cabin", "links": links}) == {"name": "cabin", "links": links, "carrier": 0}
    assert made.body({"name": "boom", "links": links}) == {
        "name": "boom", "carrier": 1, "links": [], "axis": [4, 5, 6],
        "ties": [{"carrier": 5, "position": [0.0, 0.0, 0.5]}],
    }  # fmt: skip  # two lines
    rope = made.body({"name": "rope", "links": links, "solid": {"kind": "box", "color": "red"}})
    assert rope["axis"] == made.along["rope"] and rope["pieces_of_element"] == 8
    assert (rope["links"], rope["ties"], rope["outline"]) == ([], [], ROPE["outline"])
    assert rope["solid"] == {"kind": "cylinder", "color": "red", "size": [0.5, 10.0]}


def test_shapes_on_a_beam_move_to_its_nearest_frame() -> None:
    made = carriers()
    shape = {"body": "boom", "origin": [2.5, 0.0, 0.0], "vertices": [[2.5, 1.0, 0.0], [3.0, 0.0, 0.0]]}
    drawn = made.shape(shape, {"boom": 1})
    assert (drawn["carrier"], drawn["body"]) == (6, 1)
    assert drawn["vertices"] == [[-0.5, 1.0, 0.0], [0.0, 0.0, 0.0]]
    drawn = made.shape({**shape, "body": "rope.2"}, {"rope": 2})
    assert (drawn["carrier"], drawn["body"], drawn["vertices"]) == (3, 2, shape["vertices"])
    assert made.shape({**shape, "body": WORLD}, {})["body"] == -1


@pytest.mark.parametrize(("elements", "pieces"), [(1, 8), (6, 8), (7, 7), (24, 2), (47, 2), (48, 1), (500, 1)])
def test_elements_are_drawn_in_pieces(elements: int, pieces: int) -> None:
    assert pieces_of(elements) == pieces


def test_sections_are_circles_or_rectangles_of_the_same_inertia() -> None:
    """Of a disc of radius r the inertia about a diameter is m r^2/4; of a rectangle with half sides y, z it is
    m z^2/3 about y and m y^2/3 about z."""
    round_one = np.array(outline(2.0, [1.0, 2.0 * 0.02**2 / 4.0, 2.0 * 0.02**2 / 4.0], 1.0))
    assert len(round_one) == 16 and np.hypot(*round_one.T) == pytest.approx(0.02)
    assert np.degrees(np.arctan2(round_one[1, 1], round_one[1, 0])) == pytest.approx(22.5)
    # between a 400th and a 30th of the length, the sides in proportion
    assert np.hypot(*np.array(outline(2.0, [0.0, 0.0, 0.0], 4.0)).T) == pytest.approx(0.01)
    assert np.hypot(*np.array(outline(2.0, [0.0, 50.0, 50.0], 3.0)).T) == pytest.approx(0.1)
    assert outline(1.0, [0.0, 3.0, 12.0], 3.0)[0] == pytest.approx([0.1, 0.05])
    assert outline(1.0, [0.0, 3e-8, 12.0], 3.0)[0] == pytest.approx([0.1, 0.0075])
    assert outline(1.0, [0.0, 12.0, 0.0], 3.0)[0] == pytest.approx([0.0075, 0.1])
    assert np.hypot(*np.array(outline(0.0, [0.0, 1.0, 2.0], 4.0)).T) == pytest.approx(0.01)
    assert len(outline(1.0, [0.0, 0.9991e-4, 1e-4], 1.0)) == 16 and len(outline(1.0, [0.0, 0.998e-4, 1e-4], 1.0)) == 4


def test_beams_are_drawn_with_the_section_of_their_heaviest_node() -> None:
    bodies = [
        {"name": name, "mass": mass, "inertia": [1.0, mass * 1e-4, mass * 1e-4]}
        for name, mass in zip("abc", (0, 2, 1), strict=True)
    ]
    (drawn,) = drawn_beams([["a", "b", "c"]], bodies, [1.0])
    assert drawn["nodes"] == ["a", "b", "c"] and np.hypot(*np.array(drawn["outline"]).T) == pytest.approx(0.02)


def test_pages_of_many_bodies_have_fewer_rows() -> None:
    t = np.linspace(0.0, 10.0 * FEWEST / RATE, 20_001)
    assert len(_thinned(t, 28)) == 10 * FEWEST + 1
    assert len(_thinned(t, LARGEST // 50)) == 51
    assert len(_thinned(t, 10 * LARGEST)) == 3  # two and more: the ends


def test_rows_without_a_finite_pose_are_left_out() -> None:
    made = _Carriers({"cabin": np.zeros((3, 7))}, {})
    poses = np.tile([1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0], (3, 1))
    poses[1, 4] = math.nan
    solution = cast(Any, SimpleNamespace(t=np.arange(3.0), q=np.zeros((3, 0))))
    rows, whole = made.moved(solution, {"cabin": poses})
    assert rows.tolist() == [0, 2] and whole.shape == (2, 1, 7)
    poses[:] = math.inf
    with pytest.raises(ValueError, match="no pose is finite"):
        made.moved(solution, {"cabin": poses})


@pytest.mark.parametrize("count", [4, 70_000])
def test_shapes_are_packed_in_steps_of_their_size_and_triangles(count: int, rng: np.random.Generator) -> None:
    vertices = np.add(rng.uniform(-0.3, 0.5, size=(count, 3)), [10.0, 0.0, 0.0])
    shape = {"name": "hull", "vertices": vertices.tolist(), "faces": [[0, 1, 2, 3], [3, 2, 1]]}
    packed, kind = _packed_shape(shape), "<u4" if count > 65_535 else "<u2"
    steps = np.frombuffer(base64.b64decode(packed["vertices"]), "<u2").reshape(-1, 3)
    size = np.max(vertices - vertices.min(axis=0))
    np.testing.assert_array_equal(packed["low"], vertices.min(axis=0))
    assert packed["step"] == pytest.approx(size / 65_535) and packed["wide"] is (count > 65_535)
    np.testing.assert_allclose(packed["low"] + packed["step"] * steps, vertices, atol=0.51 * packed["step"])
    triangles = np.frombuffer(base64.b64decode(packed["faces"]), kind).reshape(-1, 3)
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3], [3, 2, 1]] and packed["name"] == "hull"
    point = _packed_shape({"vertices": [[1.0, 2.0, 3.0]], "faces": []})
    assert (point["low"], point["step"], point["faces"]) == ([1.0, 2.0, 3.0], 1.0, "")
