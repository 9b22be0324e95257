"""Triangles of COLLADA files: the visual scene with its nodes, units and axes, and the diffuse colours of materials.

COLLADA Digital Asset Schema Release 1.4.1, Khronos Group, 2008. Own reader: the parts that a picture needs are nodes,
positions and polygons; packages for whole documents bring compiled XML libraries along.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.errors import DescriptionError
from eomgen.scene.reading.xml import Element, read_xml

#: Axes of the file as rows of x, y and z here, z up, by ``up_axis``.
_UP = {
    "X_UP": ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "Y_UP": ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "Z_UP": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
}
_POLYGONS = ("triangles", "polylist", "polygons", "tristrips", "trifans")
#: Deepest nesting of nodes and of nodes by reference.
_DEPTH = 60


class ColladaError(Exception):
    """A file that cannot be read, with the fault."""


class Painted(NamedTuple):
    """Triangles with colours: vertices (n, 3), faces (m, 3), and (m, 3) red, green and blue, 0 to 255, -1 for none."""

    vertices: Array
    faces: NDArray[np.intp]
    colors: NDArray[np.int16]


def read_collada(data: bytes, name: str) -> Painted:
    """Return the triangles of the visual scene, in the unit of the scene (m), with z up.

    Raises
    ------
    ColladaError
        A document that is not COLLADA or not consistent.
    """
    try:
        root = read_xml(data.decode("utf-8-sig", "replace"), name)
    except DescriptionError as error:
        raise ColladaError(str(error)) from None
    if root.tag != "COLLADA":
        raise ColladaError(f"its root is <{root.tag}>, not <COLLADA>")
    try:
        return _Document(root).painted()
    except (ValueError, IndexError, KeyError) as error:
        reason = f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
        raise ColladaError(f"the COLLADA file is not consistent: {reason}") from None


class _Document:
    def __init__(self, root: Element) -> None:
        self.root = root
        self.by_id = {item.get("id"): item for item in root.everything() if item.has("id")}
        asset = root.first("asset")
        up = _text(asset, "up_axis") or "Y_UP"
        unit = asset.first("unit") if asset is not None else None
        self.axes = np.array(_UP.get(up, _UP["Z_UP"])) * float(unit.get("meter", "1") if unit is not None else "1")

    def referred(self, reference: str) -> Element:
        """Return the element of a reference ``#id``. Raises KeyError."""
        return self.by_id[reference.removeprefix("#")]

    def painted(self) -> Painted:
        """Return all triangles."""
        vertices: list[Array] = [np.zeros((0, 3))]
        faces: list[NDArray[np.intp]] = [np.zeros((0, 3), dtype=np.intp)]
        colors: list[NDArray[np.int16]] = [np.zeros((0, 3), dtype=np.int16)]
        for instance, matrix in self.instances():
            bound = {
                item.get("symbol"): item.get("target")
                for item in instance.everything()
                if item.tag == "instance_material"
            }
            mesh = self.referred(instance.get("url")).first("mesh")
            for places, corners, material in self.primitives(mesh) if mesh is not None else ():
                moved = places @ matrix[:3, :3].T + matrix[:3, 3]
                turned = corners if np.linalg.det(matrix[:3, :3]) >= 0.0 else corners[:, ::-1]
                faces.append(turned + sum(map(len, vertices)))
                vertices.append(moved)
                colors.append(np.tile(self.color(bound.get(material, "")), (len(corners), 1)))
        return Painted(np.concatenate(vertices) @ self.axes.T, np.concatenate(faces), np.concatenate(colors))

    def instances(self) -> Iterator[tuple[Element, Array]]:
        """Yield the instances of geometries in the scene, each with the matrix (4, 4) to the scene."""
        scene = self.root.first("scene")
        shown = scene.first("instance_visual_scene") if scene is not None else None
        if shown is None:
            every = self.root.first("library_visual_scenes")
            start = every.first("visual_scene") if every is not None else None
        else:
            start = self.referred(shown.get("url"))
        if start is None:
            raise ValueError("it has no visual scene")
        waiting: list[tuple[Element, Array, int]] = [(start, np.eye(4), 0)]
        while waiting:
            node, above, depth = waiting.pop()
            if depth > _DEPTH:
                raise ValueError("nodes hold one another in a circle, or are nested too deep")
            matrix = above @ _matrix(node)
            for instance in node.named("instance_geometry"):
                yield instance, matrix
            waiting += [(child, matrix, depth + 1) for child in node.named("node")]
            waiting += [(self.referred(item.get("url")), matrix, depth + 1) for item in node.named("instance_node")]

    def primitives(self, mesh: Element) -> Iterator[tuple[Array, NDArray[np.intp], str]]:
        """Yield places (n, 3), triangles (m, 3) and the material of each part of a mesh."""
        sources = {item.get("id"): item for item in mesh.named("source")}
        held = {item.get("id"): item for item in mesh.named("vertices")}
        for kind in _POLYGONS:
            for part in mesh.named(kind):
                inputs = list(part.named("input"))
                offsets = [int(item.get("offset", "0")) for item in inputs]
                vertex = next(item for item in inputs if item.get("semantic") == "VERTEX")
                position = next(
                    item
                    for item in held[vertex.get("source").removeprefix("#")].named("input")
                    if item.get("semantic") == "POSITION"
                )
                places = _numbers(sources[position.get("source").removeprefix("#")])
                stride, offset = 1 + max(offsets), int(vertex.get("offset", "0"))
                lists = [
                    np.array(item.text().split(), dtype=np.intp).reshape(-1, stride)[:, offset]
                    for item in part.named("p")
                ]
                counts = _text(part, "vcount").split()
                corners = _triangles(kind, lists, np.array(counts, dtype=np.intp))
                if corners.size and (corners.min() < 0 or corners.max() >= len(places)):
                    raise ValueError(f"a polygon has the vertex {int(corners.max())} of {len(places)}")
                yield places, corners, part.get("material")

    def color(self, target: str) -> NDArray[np.int16]:
        """Return red, green and blue of a material's diffuse colour, 0 to 255; -1 without one, as of textures."""
        none = np.full(3, -1, dtype=np.int16)
        material = self.by_id.get(target.removeprefix("#"))
        effect = material.first("instance_effect") if material is not None else None
        described = self.by_id.get(effect.get("url").removeprefix("#")) if effect is not None else None
        for item in described.everything() if described is not None else ():
            if item.tag == "diffuse" and item.first("color") is not None:
                parts = [float(word) for word in _text(item, "color").split()[:3]]
                if len(parts) == 3:  # red, green, blue
                    return np.round(255.0 * np.clip(parts, 0.0, 1.0)).astype(np.int16)
        return none


def _text(element: Element | None, tag: str) -> str:
    child = element.first(tag) if element is not None else None
    return "" if child is None else child.text()


def _numbers(source: Element) -> Array:
    """Return the first three numbers of each row of a source."""
    array = source.first("float_array")
    if array is None:
        raise ValueError("a source has no numbers")
    values = np.array(array.text().split(), dtype=float)
    accessors = [item for item in source.everything() if item.tag == "accessor"]
    stride = int(accessors[0].get("stride", "3")) if accessors else 3
    return values[: len(values) // stride * stride].reshape(-1, stride)[:, :3]


def _triangles(kind: str, lists: list[NDArray[np.intp]], counts: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the triangles of polygons of a kind, (m, 3)."""
    if kind == "triangles":
        return np.concatenate([np.zeros((0, 3), dtype=np.intp), *(item.reshape(-1, 3) for item in lists)])
    if kind == "polylist":
        corners = sum(map(len, lists))
        if int(np.sum(counts)) != corners:
            raise ValueError(f"the polygons have {corners} corners, and {int(np.sum(counts))} are counted")
        lists = np.split(lists[0], np.cumsum(counts)[:-1]) if lists else []
    rows: list[NDArray[np.intp]] = [np.zeros((0, 3), dtype=np.intp)]
    for item in lists:
        if kind == "tristrips":
            strip = np.stack([item[:-2], item[1:-1], item[2:]], axis=1)
            strip[1::2] = strip[1::2, ::-1]
            rows.append(strip)
        else:
            rows.append(np.stack([np.full(max(len(item) - 2, 0), item[0]), item[1:-1], item[2:]], axis=1))
    return np.concatenate(rows)


def _matrix(node: Element) -> Array:
    """Return the matrix (4, 4) of a node: its transformations in their order."""
    result = np.eye(4)
    for item in node.children():
        if item.tag not in ("matrix", "translate", "rotate", "scale"):
            continue
        values, step = np.array(item.text().split(), dtype=float), np.eye(4)
        if item.tag == "matrix":
            step = values.reshape(4, 4)
        elif item.tag == "translate":
            step[:3, 3] = values
        elif item.tag == "scale":
            step[:3, :3] = np.diag(values)
        else:
            step[:3, :3] = _turned(values[:3], np.radians(values[3]))
        result = result @ step
    return result


def _turned(axis: Array, angle: float) -> Array:
    """Return the matrix of a rotation about an axis by an angle, rad."""
    x, y, z = axis / (np.linalg.norm(axis) or 1.0)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return turned
