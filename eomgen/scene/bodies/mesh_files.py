"""Meshes of STL files, binary or text, and OBJ files, thinned to as many triangles as a picture can show."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.files import nearby, read_bytes
from eomgen.base.messages import counted, shown
from eomgen.errors import Problem

#: Largest file, bytes, and number of triangles that are kept of a mesh.
LARGEST, MOST = 200_000_000, 2_000
#: Triangle of a binary STL file: normal, three corners, attribute.
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84
_VERTEX = re.compile(rb"^\s*vertex\s+(.*?)\s*$", re.MULTILINE | re.IGNORECASE)
#: Formats by ending, with the format to choose in place of one that is not read.
_OTHERS = (".glb", ".gltf", ".dae", ".ply", ".step", ".stp", ".iges", ".igs", ".3mf", ".fbx")
#: Significant digits of vertices, relative to the size of the mesh.
_DIGITS = 5

#: Vertices (x, y, z) and faces (three numbers of vertices).
Mesh = tuple[tuple[tuple[float, ...], ...], tuple[tuple[int, ...], ...]]
Triangles = tuple[Array, NDArray[np.intp]]


class MeshError(Exception):
    """A mesh that cannot be read; ``problem`` holds place, fault and remedy."""

    def __init__(self, where: str, fault: str, hint: str = "") -> None:
        self.problem = Problem(where, fault, hint)
        super().__init__(str(self.problem))


def read_mesh(path: Path) -> Mesh:
    """Return the mesh of a file in the units of the file, at most ``MOST`` triangles.

    Raises
    ------
    MeshError
    """
    ending, name = path.suffix.lower(), path.name
    if ending not in (".stl", ".obj"):
        kind = (
            f"files of the kind {shown(ending)} are not read" if ending in _OTHERS else "its ending is none of a mesh"
        )
        raise MeshError(name, kind, f"{path.stem}.stl or {path.stem}.obj, exported from the same program")
    try:
        data = read_bytes(path, LARGEST)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise MeshError(str(path), f"the mesh cannot be read: {reason}", nearby(path)) from None
    if len(data) > LARGEST:
        raise MeshError(name, f"the file has more than {LARGEST // 1_000_000} MB", "a coarser mesh")
    vertices, faces = _obj(data, name) if ending == ".obj" else _stl(data, name)
    if not len(faces):
        raise MeshError(name, "the mesh has no triangles", "an export with the surfaces of the part")
    if not np.all(np.isfinite(vertices)):
        raise MeshError(name, "a vertex of the mesh is not a finite number", "the export of the mesh once more")
    vertices, faces = _merged(vertices, faces)
    if not len(faces):
        raise MeshError(name, "each triangle of the mesh has two equal corners", "the export of the mesh once more")
    vertices, faces = _thinned(*_outward(vertices, faces))
    size = float(np.max(np.ptp(vertices, axis=0)))
    rounded = np.round(vertices, _DIGITS - int(np.floor(np.log10(size))))
    return tuple(map(tuple, rounded.tolist())), tuple(map(tuple, faces.tolist()))


def _stl(data: bytes, name: str) -> Triangles:
    count = int.from_bytes(data[_HEADER - 4 : _HEADER], "little") if len(data) >= _HEADER else -1
    promised = _HEADER + _TRIANGLE.itemsize * count
    if count >= 0 and promised == len(data):
        corners = np.frombuffer(data, _TRIANGLE, offset=_HEADER)["corners"].astype(float).reshape(-1, 3)
    elif data.lstrip()[:5].lower() == b"solid":
        corners = _text_corners(data, name)
    elif count < 0:
        raise MeshError(name, f"the file has {counted(len(data), 'byte')}, too few for an STL file", "a whole file")
    else:
        held = max(len(data) - _HEADER, 0) // _TRIANGLE.itemsize
        fault = f"the header of the STL file promises {counted(count, 'triangle')}, and the file has bytes for {held}"
        raise MeshError(name, fault, "a whole file, or the export once more")
    return corners, np.arange(len(corners), dtype=np.intp).reshape(-1, 3)


def _text_corners(data: bytes, name: str) -> Array:
    rows = []
    for match in _VERTEX.finditer(data):
        words = match[1].split()
        try:
            rows.append([float(word) for word in words])
        except ValueError:
            rows.append([])
        if len(rows[-1]) != 3:
            line = data.count(b"\n", 0, match.start(1)) + 1
            _not_numbers(name, line, "vertex", match[1])
    if len(rows) % 3:
        raise MeshError(name, f"the file ends within a triangle: it has {len(rows)} corners", "a whole file")
    return np.array(rows, dtype=float).reshape(-1, 3)


def _obj(data: bytes, name: str) -> Triangles:
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for number, line in enumerate(data.splitlines(), 1):
        words = line.split()
        if not words or words[0] not in (b"v", b"f"):
            continue
        try:
            if words[0] == b"v":
                x, y, z = (float(word) for word in words[1:4])
                vertices.append([x, y, z])
                continue
            corners = [int(word.split(b"/")[0]) for word in words[1:]]
        except ValueError:
            _not_numbers(name, number, words[0].decode(), b" ".join(words[1:]))
        places = [corner - 1 if corner > 0 else len(vertices) + corner for corner in corners]
        for corner, place in zip(corners, places, strict=True):
            if not 0 <= place < len(vertices) or corner == 0:
                fault = f"the face has the vertex {corner}, and there are {len(vertices)} before it"
                raise MeshError(f"{name}:{number}", fault, "vertices before the faces, counted from 1")
        faces += [[places[0], places[k], places[k + 1]] for k in range(1, len(places) - 1)]
    return np.array(vertices, dtype=float).reshape(-1, 3), np.array(faces, dtype=np.intp).reshape(-1, 3)


def _not_numbers(name: str, line: int, keyword: str, text: bytes) -> NoReturn:
    fault = f"numbers are needed behind {keyword}, not {shown(text.decode('utf-8', 'replace'))}"
    raise MeshError(f"{name}:{line}", fault, "the export of the mesh once more")


def _merged(vertices: Array, faces: NDArray[np.intp]) -> Triangles:
    """Return the mesh with equal vertices as one, without triangles of two equal corners and unused vertices."""
    unique, places = np.unique(vertices, axis=0, return_inverse=True)
    return _used(unique, places.reshape(-1)[faces])


def _used(vertices: Array, faces: NDArray[np.intp]) -> Triangles:
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    numbers, places = np.unique(faces, return_inverse=True)
    return vertices[numbers], places.reshape(-1, 3)


def _outward(vertices: Array, faces: NDArray[np.intp]) -> Triangles:
    """Return the mesh with faces that are counterclockwise from outside: with a positive volume."""
    a, b, c = (vertices[faces[:, k]] - np.mean(vertices, axis=0) for k in range(3))
    return vertices, faces if np.sum(a * np.cross(b, c)) >= 0.0 else faces[:, ::-1]


def _thinned(vertices: Array, faces: NDArray[np.intp]) -> Triangles:
    """Return the mesh with vertices of a grid's cell as one, in the finest grid that leaves at most ``MOST``
    triangles."""
    cells, low = 200.0, np.min(vertices, axis=0)
    side = float(np.max(np.ptp(vertices, axis=0)))
    coarse = vertices, faces
    while len(coarse[1]) > MOST:
        _, places = np.unique(np.floor((vertices - low) * (cells / side)), axis=0, return_inverse=True)
        places = places.reshape(-1)
        means = np.stack([np.bincount(places, vertices[:, k]) for k in range(3)], axis=1) / np.bincount(places)[:, None]
        joined = places[faces]
        kept = np.unique(np.sort(joined, axis=1), axis=0, return_index=True)[1]
        coarse = _used(means, joined[np.sort(kept)])
        cells *= 0.8
    return coarse
