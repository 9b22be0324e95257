"""Surfaces of solids in pictures: closed, exactly as large as the polygons that they are made of."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from eomgen.products.pictures.solids import SolidPart, drawn_shape, parts_of
from eomgen.system.description import Shape

#: Area of a polygon of 30 corners in a circle of radius 1.
POLYGON = 15.0 * np.sin(2.0 * np.pi / 30.0)


def volume(part: SolidPart) -> float:
    """Return the volume of faces of any number of corners, counterclockwise from outside."""
    total = 0.0
    for face in part.faces:
        a = part.vertices[face[0]]
        total += sum(float(np.dot(a, np.cross(part.vertices[b], part.vertices[c]))) for b, c in pairwise(face[1:]))
    return total / 6.0


def of_profile(profile: Sequence[tuple[float, float]]) -> float:
    """Return the volume of frusta over polygons: places along the axis, and radii."""
    frusta = ((z2 - z1) * (a * a + a * b + b * b) / 3.0 for (z1, a), (z2, b) in pairwise(profile))
    return POLYGON * sum(frusta)


def quarter(radius: float, sign: float, rings: int = 8) -> list[tuple[float, float]]:
    angles = np.linspace(0.0, np.pi / 2.0, rings)
    half = [(sign * radius * float(np.sin(angle)), radius * float(np.cos(angle))) for angle in angles]
    return half if sign > 0.0 else half[::-1]


SPHERE = [*quarter(1.0, -1.0), *quarter(1.0, 1.0)]
#: Of ellipsoids, which have twice as many rings.
FINE = [*quarter(1.0, -1.0, 15), *quarter(1.0, 1.0, 15)]


@pytest.mark.parametrize(
    ("kind", "sizes", "exact"),
    [
        ("box", (0.3, 0.2, 0.7), 0.042),
        ("cylinder", (0.3, 0.7), POLYGON * 0.3**2 * 0.7),
        ("sphere", (0.3,), of_profile(SPHERE) * 0.3**3),
        ("capsule", (0.3, 0.7), of_profile(SPHERE) * 0.3**3 + POLYGON * 0.3**2 * 0.7),
        ("ellipsoid", (0.3, 0.7, 0.2), of_profile(FINE) * 0.3 * 0.7 * 0.2),
    ],
)
def test_surfaces_are_closed_and_enclose_their_polygons(kind: str, sizes: tuple[float, ...], exact: float) -> None:
    (part,) = parts_of(kind, sizes)
    assert volume(part) == pytest.approx(exact, rel=1e-12)
    places = [tuple(place) for place in np.round(part.vertices, 12).tolist()]
    edges = Counter(
        (places[face[k - 1]], places[face[k]])
        for face in part.faces
        for k in range(len(face))
        if places[face[k - 1]] != places[face[k]]
    )
    assert set(edges.values()) == {1} and all((b, a) in edges for a, b in edges)
    half = {
        "cylinder": (0.3, 0.3, 0.35), "capsule": (0.3, 0.3, 0.65), "box": (0.15, 0.1, 0.35),
        "sphere": (0.3, 0.3, 0.3), "ellipsoid": sizes,
    }[kind]  # fmt: skip  # two lines
    assert part.vertices.max(axis=0).tolist() == pytest.approx(half, rel=6e-3)
    assert part.vertices.min(axis=0).tolist() == pytest.approx([-side for side in half], rel=6e-3)
    assert part.color == ""


def test_a_wheel_is_a_tyre_with_spokes_and_a_rim_between_them() -> None:
    tyre, spokes, rim = parts_of("wheel", (2.0, 1.0))
    assert [part.color for part in (tyre, spokes, rim)] == ["#33383f", "", "#c3cad3"]
    across = np.hypot(*tyre.vertices[:, :2].T)
    assert (across.max(), across.min()) == pytest.approx((2.0, 1.32))
    assert (np.ptp(tyre.vertices[:, 2]), len(tyre.faces)) == (1.0, 7 * 30)
    # of both sides, each of 30 sectors, two of six are spokes, one beside the other
    assert (len(spokes.faces), len(rim.faces)) == (20, 40)
    assert {len(face) for face in (*spokes.faces, *rim.faces)} == {3}
    angles = sorted({round(angle_of(spokes, face)) % 360 for face in spokes.faces})
    assert angles == [6, 18, 78, 90, 150, 162, 222, 234, 294, 306]
    disc = spokes.vertices
    hub, rims = disc[np.hypot(*disc[:, :2].T) < 1e-9], disc[np.hypot(*disc[:, :2].T) > 1e-9]
    assert sorted(set(np.round(hub[:, 2], 12))) == [-0.3, 0.3]
    assert sorted(set(np.round(rims[:, 2], 12))) == [-0.425, 0.425]
    assert np.hypot(*rims[:, :2].T) == pytest.approx(1.32)


def angle_of(part: SolidPart, face: Sequence[int]) -> float:
    x, y, _ = part.vertices[list(face)].mean(axis=0)
    return float(np.degrees(np.arctan2(y, x)))


def shape(kind: str, **values: Any) -> Shape:
    fields: dict[str, Any] = {"name": "part", "body": "hull", "kind": kind, "axes": tuple(map(tuple, np.eye(3)))}
    known = Shape.__dataclass_fields__
    return Shape(**{**{name: () for name in known if name in ("sizes", "position")}, **fields, **values})


def mesh(faces: list[list[int]], closed: bool) -> Shape:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    return shape("mesh", vertices=corners.tobytes(), faces=np.array(faces, np.int32).tobytes(), closed=closed)


TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


@pytest.mark.parametrize(
    ("scale", "sign"), [((2.0,), 1.0), ((-2.0,), -1.0), ((1.0, 2.0, -3.0), -1.0), ((-1.0, -2.0, 3.0), 1.0)]
)
def test_meshes_keep_their_outside_when_they_are_mirrored(scale: tuple[float, ...], sign: float) -> None:
    (part,) = drawn_shape(mesh(TETRAHEDRON, sign > 0.0), scale, (1.0, 2.0, 3.0))
    drawn = SolidPart(np.array(part["vertices"]) - [1.0, 2.0, 3.0], part["faces"])
    size = abs(np.prod(np.array(scale))) ** (3 // len(scale))
    assert volume(drawn) == pytest.approx(size / 6.0, rel=1e-5)
    assert (part["faces"] == TETRAHEDRON) == (sign > 0.0)
    assert (part["closed"], part["origin"]) == (sign > 0.0, [1.0, 2.0, 3.0])
