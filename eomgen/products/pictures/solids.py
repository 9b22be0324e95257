"""Surfaces of solids in pictures: vertices and faces of boxes, round solids and wheels, in the frame of the solid."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.errors import FileError
from eomgen.system.description import Shape

#: Edges of a round solid around its axis, of a hemisphere along it, and pieces of the longest side of a box: pictures
#: sort faces by distance, so none may be long.
_AROUND, _ALONG, _PIECES = 30, 7, 6
#: Profile of a wheel: axial place by half of the width, and radius by the radius; both ends are at the rim.
_TYRE = ((-0.85, 0.66), (-1.0, 0.8), (-0.9, 0.93), (-0.55, 1.0), (0.55, 1.0), (0.9, 0.93), (1.0, 0.8), (0.85, 0.66))
_RUBBER, _RIM = "#33383f", "#c3cad3"

Faces = list[list[int]]


class SolidPart(NamedTuple):
    """Part of a solid in one colour: vertices (n, 3), faces, counterclockwise from outside, and ``#rrggbb``, empty
    for the colour of the solid."""

    vertices: Array
    faces: Faces
    color: str = ""


def parts_of(kind: str, sizes: Sequence[float]) -> list[SolidPart]:
    """Return the surfaces of a solid in its own frame, one for each colour; ``kind`` and ``sizes`` as of ``Shape``, z
    the axis of symmetry."""
    if kind == "box":
        return [SolidPart(*_box(sizes))]
    if kind == "wheel":
        return list(_wheel(*sizes))
    if kind == "ellipsoid":
        angles = np.pi * np.arange(4 * _ALONG + 1) / (4 * _ALONG)
        profile = [(-math.cos(angle), math.sin(angle)) for angle in angles.tolist()]
        profile[0], profile[-1] = (-1.0, 0.0), (1.0, 0.0)
        ball, faces = _revolved(profile)
        poles = np.roll(ball, int(np.argmax(sizes)) + 1, axis=1)  # of the longest axis, whose ends are sharp
        return [SolidPart(poles * np.array(sizes), faces)]
    radius, length = (sizes[0], sizes[1] if len(sizes) > 1 else 0.0)
    if kind == "cylinder":
        pieces = max(1, min(_PIECES, round(length / radius)))
        walls = [(-length / 2 + length * k / pieces, radius) for k in range(pieces + 1)]
        return [SolidPart(*_revolved([(-length / 2, 0.0), *walls, (length / 2, 0.0)]))]
    angles = np.linspace(0.0, 0.5 * np.pi, _ALONG + 1)
    half = [(length / 2 + radius * np.sin(angle), radius * np.cos(angle)) for angle in angles]
    whole = [(-along, across) for along, across in reversed(half)] + half[0 if length else 1 :]
    return [SolidPart(*_revolved(whole))]


def faces_of_grid(rows: int, columns: int) -> NDArray[np.intp]:
    """Return the faces (n, 4) between the places of a grid, which are numbered row by row."""
    places = np.arange(rows * columns).reshape(rows, columns)
    return np.stack([places[:-1, :-1], places[1:, :-1], places[1:, 1:], places[:-1, 1:]], axis=-1).reshape(-1, 4)


def _box(size: Sequence[float]) -> tuple[Array, Faces]:
    """Return vertices (n, 3) and faces of a box with these sides, cut into pieces of about equal lengths."""
    along = [side * np.linspace(-0.5, 0.5, 1 + max(1, round(_PIECES * side / max(size)))) for side in size]
    vertices, faces = np.zeros((0, 3)), list[list[int]]()
    for normal, sign in product(range(3), (-1, 1)):
        first, second = along[(normal + 1) % 3], along[(normal + 2) % 3]
        x, y = np.meshgrid(first, second, indexing="ij")
        corners = np.stack([np.full_like(x, 0.5 * sign * size[normal]), x, y], axis=-1).reshape(-1, 3)
        faces += (len(vertices) + faces_of_grid(*x.shape)[:, ::sign]).tolist()
        vertices = np.concatenate([vertices, np.roll(corners, normal, axis=1)])
    return vertices, faces


def _revolved(profile: Sequence[tuple[float, float]]) -> tuple[Array, Faces]:
    """Return vertices (n, 3) and faces of the surface of a profile, pairs of place along z and radius, turned about
    z."""
    angles = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    vertices = np.concatenate([np.column_stack([r * ring, np.full(_AROUND, z)]) for z, r in profile])
    faces: Faces = []
    for row in range(len(profile) - 1):
        (_, below), (_, above) = profile[row], profile[row + 1]
        for k in range(_AROUND):
            here, beside = row * _AROUND + k, row * _AROUND + (k + 1) % _AROUND
            face = [here, beside, beside + _AROUND, here + _AROUND]
            if below == 0.0:  # a point of the axis
                face = [here, beside + _AROUND, here + _AROUND]
            elif above == 0.0:
                face = [here, beside, here + _AROUND]
            faces.append(face)
    return vertices, faces


def _wheel(radius: float, width: float) -> Iterator[SolidPart]:
    """Yield the tyre, the spokes in the colour of the wheel, and the rim between the spokes, which show its spin."""
    yield SolidPart(*_revolved([(0.5 * width * z, radius * r) for z, r in _TYRE]), _RUBBER)
    (edge, rim), inner = _TYRE[-1], 0.5 * width * 0.6
    vertices, faces = _revolved(
        [(-inner, 0.0), (-0.5 * width * edge, radius * rim), (0.5 * width * edge, radius * rim), (inner, 0.0)]
    )
    sides = [face for face in faces if len(face) == 3]
    spokes = [face for number, face in enumerate(sides) if number % 6 < 2]
    yield SolidPart(vertices, spokes)
    yield SolidPart(vertices, [face for face in sides if face not in spokes], _RIM)


def drawn_shape(shape: Shape, sizes: Sequence[float], position: Sequence[float]) -> list[dict[str, Any]]:
    """Return the parts of a shape as JSON types, with vertices in the frame of the body, m; none of a mesh that cannot
    be read, with a warning."""
    try:
        shape = shape.whole()
    except FileError as error:
        text = f"the shape {shape.name} is left out of pictures: {error.problems[0]} [W0096]"
        warnings.warn(text, RuntimeWarning, stacklevel=2)
        return []
    if shape.kind == "mesh":
        vertices = np.frombuffer(shape.vertices, np.float32).reshape(-1, 3) * np.array(sizes)
        faces = np.frombuffer(shape.faces, np.int32).reshape(-1, 3)
        mirrored = np.prod(np.sign(sizes)) ** (3 // len(sizes)) < 0.0
        parts = _by_color(vertices, faces[:, ::-1] if mirrored else faces, shape.face_colors)
        closed = shape.closed
    else:
        parts, closed = parts_of(shape.kind, sizes), True
    return [
        {
            "name": shape.name,
            "body": shape.body,
            "origin": list(position),
            "color": part.color or shape.color,
            "own": not part.color,
            "opacity": shape.opacity,
            "vertices": _rounded(np.array(position) + part.vertices @ np.array(shape.axes).T),
            "faces": part.faces,
            "closed": closed,
        }
        for part in parts
    ]


def _by_color(vertices: Array, faces: NDArray[np.int32], packed: bytes) -> list[SolidPart]:
    """Return the parts of a mesh, one for each colour of faces; a single part without colours.

    Parameters
    ----------
    packed : colours of the faces, as of ``Shape``
    """
    if not packed:
        return [SolidPart(vertices, faces.tolist())]
    colors = np.frombuffer(packed, np.int16).reshape(-1, 3)
    parts = []
    for color in np.unique(colors, axis=0):
        of_color = faces[np.all(colors == color, axis=1)]
        numbers, places = np.unique(of_color, return_inverse=True)
        text = "#" + "".join(f"{part:02x}" for part in color.tolist()) if color[0] >= 0 else ""
        parts.append(SolidPart(vertices[numbers], places.reshape(-1, 3).tolist(), text))
    return parts


def _rounded(vertices: Array) -> list[list[float]]:
    size = float(np.max(np.abs(vertices), initial=0.0)) or 1.0
    rounded: list[list[float]] = np.round(vertices, 6 - int(np.floor(np.log10(size)))).tolist()
    return rounded
