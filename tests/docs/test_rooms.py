"""The picture of the rooms is drawn from the code, and an arrow meets the boxes of its two rooms alone."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import pytest

from tests.rooms import APART, PRODUCTS, arrows, drawing
from tests.test_doors import DOORS

PAGE = Path(__file__).parents[2] / "docs" / "rooms.svg"
PICTURE = PAGE.read_text(encoding="utf-8")
NUMBER = r"(-?\d+)"
Point = tuple[float, float]
Box = tuple[float, float, float, float]


@pytest.mark.slow
def test_the_picture_of_the_rooms_is_up_to_date() -> None:
    assert drawing() == PICTURE, "run: python -m tests.rooms docs/rooms.svg"


def boxes() -> dict[str, Box]:
    """Return the left, upper, right and lower side of each box by its name, the block of the core among them."""
    rectangles = re.findall(
        rf'<rect x="{NUMBER}" y="{NUMBER}" width="{NUMBER}" height="{NUMBER}"[^>]*>\s*'
        r'<text [^>]*font-size="13"[^>]*>([^<]+)<',
        PICTURE,
    )
    return {
        name: (float(x), float(y), float(x) + float(width), float(y) + float(height))
        for x, y, width, height, name in rectangles
    }


def arrows_drawn() -> list[list[Point]]:
    """Return points along each arrow, 50 for each line and Bezier curve of its path."""
    drawn = []
    for path in re.findall(r'<path d="([^"]*)" fill="none"', PICTURE):
        points: list[Point] = []
        for text in re.findall(r"[MLC]([^MLC]*)", path):
            values = [float(value) for value in text.split()]
            controls = points[-1:] + list(zip(values[::2], values[1::2], strict=True))
            points += [bezier(controls, step / 50) for step in range(51)]
        drawn.append(points)
    return drawn


def bezier(controls: list[Point], share: float) -> Point:
    while len(controls) > 1:  # de Casteljau
        controls = [(x1 + share * (x2 - x1), y1 + share * (y2 - y1)) for (x1, y1), (x2, y2) in pairwise(controls)]
    return controls[0]


def boxes_at(point: Point, margin: float) -> list[str]:
    """Return the names of the boxes, widened by a margin, that contain a point; the core only if no other does."""
    x, y = point
    names = [
        name
        for name, (left, upper, right, lower) in boxes().items()
        if left - margin < x < right + margin and upper - margin < y < lower + margin
    ]
    return [name for name in names if name != "the core"] or names


@pytest.mark.slow
def test_arrows_lead_from_users_to_imported_rooms() -> None:
    ends = [(boxes_at(points[0], 1.5), boxes_at(points[-1], 1.5)) for points in arrows_drawn()]
    products = [name.removeprefix(PRODUCTS) for name in DOORS if name.startswith(PRODUCTS) and name not in APART]
    expected = [(room, to) for room, targets in arrows().items() for to in targets]
    expected += [(product, "the core") for product in products]
    assert sorted(ends) == sorted(([room], [to]) for room, to in expected)


def test_no_arrow_crosses_a_box() -> None:
    crossed = [(points[0], boxes_at(point, -1.0)) for points in arrows_drawn() for point in points]
    assert [place for place in crossed if place[1] not in ([], ["the core"])] == []
