"""Meshes of STL and OBJ files, and by optional packages of COLLADA and binary glTF files; paths of packages.

A mesh is thinned to as many triangles as a picture can show.
"""

from __future__ import annotations

import os
import re
from bisect import bisect_left
from collections.abc import Iterator
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.base.files import read_bytes
from eomgen.base.messages import counted, shown
from eomgen.errors import FileError, Problem
from eomgen.system.description import Shape

#: Largest file, bytes, and number of triangles that are kept of a mesh.
LARGEST, MOST = 200_000_000, 2_000
#: Endings of the files that are read.
ENDINGS = (".stl", ".obj", ".dae", ".glb")
#: Triangle of a binary STL file: normal, three corners, attribute.
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = np.dtype([("title", "S80"), ("triangles", "<u4")])
_VERTEX = re.compile(rb"^\s*vertex\s+(.*?)\s*$", re.MULTILINE | re.IGNORECASE)
#: Formats by ending, with the format to choose in place of one that is not read.
_OTHERS = (".gltf", ".ply", ".step", ".stp", ".iges", ".igs", ".3mf", ".fbx")
_PACKAGE, _FILE = "package:", "file:"

Triangles = tuple[Array, NDArray[np.intp]]
#: Triangles with colours as of ``PictureMesh``.
Painted = tuple[Array, NDArray[np.intp], NDArray[np.int16]]
#: Axes of a file as rows of x, y and z here, z up, by ``up_axis`` of COLLADA.
_UP = {
    "X_UP": ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "Y_UP": ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "Z_UP": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
}


class PictureMesh(NamedTuple):
    """A mesh of a picture.

    Attributes
    ----------
    vertices : (n, 3)
    faces : (m, 3), numbers of vertices, counterclockwise from outside
    colors : (m, 3) red, green and blue of the faces, 0 to 255, -1 for the colour of the shape; (0, 3) without any
    closed : whether the surface of the file is closed, so that no back of a face is seen
    """

    vertices: Array
    faces: NDArray[np.intp]
    colors: NDArray[np.int16]
    closed: bool = False


_PLAIN = np.zeros((0, 3), dtype=np.int16)
_NO_TRIANGLES: Painted = (np.zeros((0, 3)), np.zeros((0, 3), dtype=np.intp), _PLAIN)


class MeshError(FileError):
    """A mesh that cannot be read."""

    def __init__(self, where: str, fault: str, hint: str = "") -> None:
        super().__init__(Problem(where, fault, hint))


def mesh_path(path: Path) -> Path:
    """Return the file of a path that may have ``package://NAME/...`` or ``file://...`` after its folder; the given path
    if no package with the file is found. A package is a folder of this name that holds the folder of the path, or lies
    in a folder that does: no list of packages is asked for."""
    parts = path.parts
    if _FILE in parts:
        return Path("/", *parts[parts.index(_FILE) + 1 :])
    if _PACKAGE not in parts:
        return path
    index = parts.index(_PACKAGE)
    name, rest = parts[index + 1 : index + 2], parts[index + 2 :]
    folder = Path(*parts[:index]).resolve()
    for holder in (folder, *folder.parents):
        if (there := holder.joinpath(*name, *rest)).is_file():
            return there
    return path


def read_mesh(path: Path, most: int = MOST) -> PictureMesh:
    """Return the mesh of a file with at most ``most`` triangles, counterclockwise from outside, in the units of the
    file; of a COLLADA file in m.

    Raises
    ------
    MeshError
        If the file cannot be read, is of another kind, or has no triangles.
    """
    ending, name = path.suffix.lower(), path.name
    if ending not in ENDINGS:
        kind = "its ending does not belong to a mesh [E1370]"
        if ending in _OTHERS:
            kind = f"files of the kind {shown(ending)} are not read [E1369]"
        raise MeshError(name, kind, f"{path.stem}.stl or {path.stem}.obj, exported from the same program")
    data = read_bytes(path, LARGEST)
    colors = _PLAIN
    if ending in (".stl", ".obj"):
        vertices, faces = (_stl if ending == ".stl" else _obj)(data, name)
    else:
        vertices, faces, colors = _in_library(data, name, ending)
    if not len(faces):
        raise MeshError(name, "the mesh has no triangles [E1373]", "an export with the surfaces of the part")
    if not np.all(np.isfinite(vertices)):
        raise MeshError(name, "a vertex of the mesh is not a finite number [E1374]", "the export of the mesh once more")
    mesh = _merge_vertices(vertices, faces, colors)._replace(closed=_is_closed(vertices, faces))
    if not len(mesh.faces):
        fault = "each triangle of the mesh has two equal corners [E1375]"
        raise MeshError(name, fault, "the export of the mesh once more")
    return _thin(_outward(mesh), most)


def is_readable(path: Path) -> bool:
    """Return whether a file has the ending and the size of a mesh and may be read; the content is not examined."""
    try:
        size = path.stat().st_size
    except OSError:
        return False
    return path.suffix.lower() in ENDINGS and path.is_file() and 0 < size <= LARGEST and os.access(path, os.R_OK)


@lru_cache(maxsize=64)
def _read_before(path: Path, most: int, stamp: tuple[int, int]) -> PictureMesh:
    """Return the mesh of a file that has not changed since the stamp, read at the first call."""
    return read_mesh(path, most)


def with_mesh(shape: Shape, file: str, most: int) -> Shape:
    """Return a copy of a shape with the mesh of a file as bytes; colours are taken from the file if the shape has none.

    Parameters
    ----------
    file : path of the mesh
    most : largest number of triangles that are kept

    Raises
    ------
    FileError
        The file is not there, or holds no mesh.
    """
    try:
        status = Path(file).stat()
        stamp = status.st_mtime_ns, status.st_size
    except (OSError, ValueError):  # which the reading reports
        stamp = 0, 0
    mesh = _read_before(Path(file), most, stamp)
    colors = b"" if shape.color else mesh.colors.astype("<i2").tobytes()
    vertices, faces = mesh.vertices.astype("<f4").tobytes(), mesh.faces.astype("<i4").tobytes()
    return replace(shape, vertices=vertices, faces=faces, face_colors=colors, closed=mesh.closed, unread=None)


def _in_library(data: bytes, name: str, ending: str) -> Painted:
    """Return vertices (n, 3), faces (m, 3) and colours (m, 3) or (0, 3) of a COLLADA or binary glTF file as read by an
    optional package: in m, with z up. Raises MeshError if the package is missing or fails; ``name`` is for messages."""
    package, read = {".dae": ("pycollada", _collada), ".glb": ("trimesh", _glb)}[ending]
    try:
        vertices, faces, colors = zip(_NO_TRIANGLES, *read(data), strict=True)
    except ImportError:
        fault = f"{ending} files are read by {package}, which is not installed [E2222]"
        raise MeshError(name, fault, "python -m pip install 'eomgen[meshes]', or an STL file") from None
    except Exception as error:  # the package raises errors of many kinds for files that are not consistent
        fault = f"{package} cannot read the file: {error} [E2223]"
        raise MeshError(name, fault, "the export of the mesh once more, or an STL file") from None
    starts = np.cumsum([0, *map(len, vertices[:-1])])
    painted = np.concatenate(colors)
    return (
        np.concatenate(vertices),
        np.concatenate([part + start for part, start in zip(faces, starts, strict=True)]),
        painted if np.any(painted >= 0) else _PLAIN,
    )


def _collada(data: bytes) -> Iterator[Painted]:
    """Yield vertices (n, 3), m, z up, faces (m, 3) and colours (m, 3) of each part of a COLLADA file, with the diffuse
    colour of the material. Raises ValueError without a scene, and errors of the package."""
    import collada  # type: ignore[import-untyped]  # noqa: PLC0415  # an optional package

    left_out = [collada.common.DaeBrokenRefError, collada.common.DaeUnsupportedError]
    document = collada.Collada(BytesIO(data), ignore=left_out)
    if document.errors:  # nodes with a material that is not there are left out: they are drawn without colours
        plain = re.sub(rb"<bind_material>.*?</bind_material>", b"", data, flags=re.DOTALL)
        document = collada.Collada(BytesIO(plain), ignore=left_out)
    axes = np.array(_UP.get(document.assetInfo.upaxis, _UP["Z_UP"])) * (document.assetInfo.unitmeter or 1.0)
    if document.scene is None:
        raise ValueError("it has no visual scene")
    for geometry in document.scene.objects("geometry"):
        turned = np.linalg.det(geometry.matrix[:3, :3]) < 0.0
        for part in geometry.primitives():
            triangles = part.triangleset() if hasattr(part, "triangleset") else part
            faces = np.asarray(triangles.vertex_index, dtype=np.intp)
            if faces.shape[-1] == len("xyz"):  # not lines
                yield (
                    triangles.vertex @ axes.T,
                    faces[:, ::-1] if turned else faces,
                    _colors(getattr(getattr(triangles.material, "effect", None), "diffuse", None), len(faces)),
                )


def _glb(data: bytes) -> Iterator[Painted]:
    """Yield vertices (n, 3), turned from y up to z up, faces (m, 3) and colours (m, 3), all -1, of each part of a
    binary glTF file."""
    import trimesh  # noqa: PLC0415  # an optional package

    scene = trimesh.load_scene(BytesIO(data), file_type="glb")
    for node in scene.graph.nodes_geometry:
        matrix, geometry = scene.graph[node]
        mesh = scene.geometry[geometry]
        if hasattr(mesh, "faces"):
            places = mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]
            faces = np.asarray(mesh.faces, dtype=np.intp)
            yield places @ np.array(_UP["Y_UP"]).T, faces, _colors(None, len(faces))


def _colors(color: object, count: int) -> NDArray[np.int16]:
    """Return red, green and blue, 0 to 255, for each face; -1 without a colour, as of textures."""
    known = isinstance(color, tuple) and len(color) >= len("rgb")
    parts = np.round(255.0 * np.clip(color[:3], 0.0, 1.0)) if known else np.full(3, -1.0)  # type: ignore[index]
    return np.tile(parts.astype(np.int16), (count, 1))


def _stl(data: bytes, name: str) -> Triangles:
    """Return corners (3 m, 3) and faces (m, 3) of a binary or text STL file. Raises MeshError; ``name`` is for
    messages."""
    header = _HEADER.itemsize
    count = int(np.frombuffer(data, _HEADER, 1)["triangles"][0]) if len(data) >= header else -1
    promised = header + _TRIANGLE.itemsize * count
    if count >= 0 and promised == len(data):
        corners = np.frombuffer(data, _TRIANGLE, offset=header)["corners"].astype(float).reshape(-1, 3)
    elif data.lstrip()[:5].lower() == b"solid":
        corners = _text_corners(data, name)
    elif count < 0:
        fault = f"the file has {counted(len(data), 'byte')}, too few for an STL file [E1376]"
        raise MeshError(name, fault, "a whole file")
    else:
        held = max(len(data) - header, 0) // _TRIANGLE.itemsize
        fault = f"the header of the STL file promises {counted(count, 'triangle')}, and {held} follow [E1377]"
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
        raise MeshError(name, f"the file ends within a triangle: it has {len(rows)} corners [E1378]", "a whole file")
    return np.array(rows, dtype=float).reshape(-1, 3)


def _obj(data: bytes, name: str) -> Triangles:
    """Return vertices (n, 3) and triangles (m, 3) of an OBJ file; polygons are cut into triangles from their first
    corner. Raises MeshError; ``name`` is for messages."""
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
        for corner, index in zip(corners, places, strict=True):
            if not 0 <= index < len(vertices) or corner == 0:
                fault = f"the face has the vertex {corner}, and there are {len(vertices)} before it [E1379]"
                raise MeshError(f"{name}:{number}", fault, "vertices before the faces, counted from 1")
        faces += [[places[0], places[k], places[k + 1]] for k in range(1, len(places) - 1)]
    return np.array(vertices, dtype=float).reshape(-1, 3), np.array(faces, dtype=np.intp).reshape(-1, 3)


def _not_numbers(name: str, line: int, keyword: str, text: bytes) -> NoReturn:
    fault = f"numbers are needed after {keyword}, not {shown(text.decode('utf-8', 'replace'))} [E1385]"
    raise MeshError(f"{name}:{line}", fault, "the export of the mesh once more")


def _merge_vertices(vertices: Array, faces: NDArray[np.intp], colors: NDArray[np.int16]) -> PictureMesh:
    """Return the mesh of faces (m, 3) with equal vertices merged within each colour, without triangles of two equal
    corners and without unused vertices."""
    corners = vertices[faces.ravel()]
    rows = np.column_stack([corners, np.repeat(_groups(colors.astype(float)), 3)]) if len(colors) else corners
    places = _groups(rows)
    unique = np.empty((np.max(places) + 1, 3))
    unique[places] = corners
    return _drop_unused(unique, places.reshape(-1, 3), colors)


def _is_closed(vertices: Array, faces: NDArray[np.intp]) -> bool:
    """Return whether the surface of faces (m, 3) is closed: all but 2 % of the edges join faces that turn opposite ways
    around the edge."""
    places = _groups(vertices)[faces]
    edges = np.concatenate([places[:, [0, 1]], places[:, [1, 2]], places[:, [2, 0]]])
    ways = np.sign(edges[:, 1] - edges[:, 0])
    left = np.bincount(_groups(np.sort(edges, axis=1).astype(float)), ways)
    return bool(np.sum(left != 0.0) <= 0.02 * len(left))  # few gaps and turned faces


def _groups(rows: Array) -> NDArray[np.intp]:
    """Return a number from 0 for each row (n, k), equal for equal rows: faster than ``np.unique`` of rows by a factor
    of 5."""
    order = np.lexsort(rows.T)
    differs = np.any(rows[order[1:]] != rows[order[:-1]], axis=1)
    groups = np.empty(len(rows), dtype=np.intp)
    groups[order] = np.concatenate([[0], np.cumsum(differs)])
    return groups


def _drop_unused(vertices: Array, faces: NDArray[np.intp], colors: NDArray[np.int16]) -> PictureMesh:
    a, b, c = faces.T
    kept = (a != b) & (b != c) & (c != a)
    numbers, places = np.unique(faces[kept], return_inverse=True)
    return PictureMesh(vertices[numbers], places.reshape(-1, 3), colors[kept] if len(colors) else colors)


def _outward(mesh: PictureMesh) -> PictureMesh:
    """Return the mesh with faces that are counterclockwise from outside: with a positive volume."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] - np.mean(mesh.vertices, axis=0) for k in range(3))
    return mesh if np.sum(a * np.cross(b, c)) >= 0.0 else mesh._replace(faces=mesh.faces[:, ::-1])


def _thin(mesh: PictureMesh, most: int) -> PictureMesh:
    """Return the mesh with the vertices in each cell of a grid merged, by the finest grid that leaves at most ``most``
    triangles; a smaller mesh stays. Surfaces of two colours, of which one covers the other, stay two.

    The vertex of a cell has the least sum of squared distances from the planes of the cell's triangles, weighted by
    areas, so that edges stay sharp (Lindstrom 2000, Out-of-core simplification of large polygonal models). Triangles
    keep the side that they show.
    """
    low, side = np.min(mesh.vertices, axis=0), float(np.max(np.ptp(mesh.vertices, axis=0)))
    colors = np.zeros(len(mesh.vertices))
    if len(mesh.colors):
        colors[mesh.faces] = _groups(mesh.colors.astype(float))[:, np.newaxis]

    def grid(number: int) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Return for a grid the cell of each vertex (n,), the indices of faces with corners in three cells, and a
        number for each of these faces, equal for equal corners in equal order."""
        rows = np.floor((mesh.vertices - low) * (200.0 * 0.92**number / side))  # 200 cells along it in the finest grid
        cells = _groups(np.column_stack([rows, colors]))
        a, b, c = cells[mesh.faces].T
        kept = np.flatnonzero((a != b) & (b != c) & (c != a))
        faces = cells[mesh.faces[kept]]
        turns = (np.argmin(faces, axis=1)[:, np.newaxis] + np.arange(3)) % 3
        turned = faces[np.arange(len(faces))[:, np.newaxis], turns]
        return cells, kept, _groups(turned.astype(float)) if len(kept) else kept

    if len(mesh.faces) <= most:
        return mesh
    coarse = bisect_left(range(63), True, key=lambda number: bool(np.max(grid(number)[2], initial=-1) < most))
    cells, kept, numbers = grid(coarse)
    places, areas = _least_squares(mesh, cells, side / (200.0 * 0.92**coarse))
    first = np.sort(np.unique(numbers, return_index=True)[1])
    faces = cells[mesh.faces[kept[first]]]
    shown_sides = np.stack([np.bincount(numbers, areas[kept, k]) for k in range(3)], axis=1)[numbers[first]]
    a, b, c = (places[faces[:, k]] for k in range(3))
    turned = np.sum(np.cross(b - a, c - a) * shown_sides, axis=1) < 0.0
    faces[turned] = faces[turned][:, ::-1]
    return _drop_unused(places, faces, mesh.colors[kept[first]] if len(mesh.colors) else mesh.colors)._replace(
        closed=mesh.closed
    )


def _least_squares(mesh: PictureMesh, cells: NDArray[np.intp], size: float) -> tuple[Array, Array]:
    """Return the vertex (k, 3) of each of k cells that fits the face planes best, at most ``size`` from the mean vertex
    per axis, and the area vectors (m, 3) of all faces. ``cells`` (n,) is the cell of each vertex."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a) / 2.0
    weights = np.linalg.norm(areas, axis=1)
    normals = areas / np.where(weights == 0.0, 1.0, weights)[:, np.newaxis]
    count, corners = np.max(cells) + 1, cells[mesh.faces].ravel()
    sums: Array = np.stack([np.bincount(cells, mesh.vertices[:, k]) for k in range(3)], axis=1)
    means = sums / np.bincount(cells)[:, np.newaxis]

    def cell_sums(values: Array) -> Array:
        """Return the sum in each cell over the corners of faces (m, 3), weighted by areas."""
        return np.bincount(corners, (weights[:, np.newaxis] * values).ravel(), minlength=count).astype(float)

    # distances of the planes are from the mean of the cell, so that small machines far from the origin lose no digits
    ones = np.ones((1, 3))
    matrix = np.stack([cell_sums(normals[:, [i]] * normals[:, [j]] * ones) for i in range(3) for j in range(3)], axis=1)
    distances = np.einsum("ik,ijk->ij", normals, a[:, np.newaxis, :] - means[cells[mesh.faces]])
    right = np.stack([cell_sums(normals[:, [k]] * distances) for k in range(3)], axis=1)
    matrix = matrix.reshape(-1, 3, 3)
    # a pull to the mean of the cell decides the place of a vertex within a plane
    pull = 0.002 * np.trace(matrix, axis1=1, axis2=2) + np.finfo(float).tiny
    shifts = np.linalg.solve(matrix + pull[:, np.newaxis, np.newaxis] * np.eye(3), right[..., np.newaxis])[..., 0]
    return means + np.clip(shifts, -size, size), areas
