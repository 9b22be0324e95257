"""Shapes of pictures: the section with its mistakes, meshes of files, and models that do not depend on them."""

from __future__ import annotations

import json
import re
import struct
import sys
from pathlib import Path
from string import Template

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.describe import describe
from eomgen.products.pictures.scenery import scenery
from eomgen.products.pictures.solids import drawn_shape
from eomgen.scene.bodies.mesh_files import MOST, read_mesh

#: A scene up to the first key of its shape.
CART = Path(__file__).with_name("cart_with_shape.txt").read_text(encoding="utf-8")
BALL = 'type = "sphere"\nbody = "hull"\nradius = 1\n'
BOX = 'type = "box"\nbody = "hull"\nsize = [1, 1, 1]\n'
WHEEL = 'type = "wheel"\nbody = "hull"\nradius = 1\nwidth = 0.2\n'
MESH = 'type = "mesh"\nbody = "hull"\nfile = "{}"\n'
CORNERS = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4]], dtype=float)
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


def binary(corners: np.ndarray, promised: int | None = None) -> bytes:
    triangles = corners.reshape(-1, 9).astype("<f4")
    count = len(triangles) if promised is None else promised
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *row, 0) for row in triangles.tolist())
    return b"solid of a program".ljust(80) + struct.pack("<I", count) + body


def text_of(corners: np.ndarray) -> bytes:
    lines = [f"  vertex {x} {y} {z}" for x, y, z in corners.reshape(-1, 3).tolist()]
    return "\n".join(["solid part", *lines, "endsolid part"]).encode()


def glb(document: dict[str, object] | None = None, **changes: object) -> bytes:
    """Return the tetrahedron as a binary glTF file: the node is scaled by 2, turned by 90 deg about z and shifted, in
    a node that is shifted; y is up."""
    x, y, z = CORNERS.T
    places = np.stack([x, z, -y], axis=1).astype("<f4").tobytes()
    buffer = places + np.array(FACES, "<u2").tobytes()
    root = {"children": [1], "translation": [0, 0, 5]}
    turned = {"mesh": 0, "scale": [2, 2, 2], "rotation": [0, 0, 0.5**0.5, 0.5**0.5], "translation": [1, 0, 0]}
    whole: dict[str, object] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [root, turned],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 24},
        ],
        "buffers": [{"byteLength": len(buffer)}],
    }
    text = json.dumps({**whole, **(document or {}), **changes}).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


#: Another face of the mesh, without a material.
TRIANGLE = b"""<triangles count="1"><input semantic="VERTEX" source="#places" offset="0"/><p>0 1 2</p></triangles>"""


def collada(kind: str = "polylist") -> bytes:
    """Return the tetrahedron as a COLLADA file in cm with y up: orange, scaled by 2 and turned by 90 deg about z in a
    node that is shifted; each corner has a normal as well."""
    faces = [" ".join(f"{corner} 0" for corner in face) for face in FACES]
    lists = [" ".join(faces)] if kind in ("triangles", "polylist") else faces
    count = "<vcount>3 3 3 3</vcount>" if kind == "polylist" else ""
    corners = " ".join(map(str, CORNERS.ravel().tolist()))
    text = Template(Path(__file__).with_name("tetrahedron.dae.txt").read_text(encoding="utf-8"))
    written = "".join(f"<p>{item}</p>" for item in lists)
    return text.substitute(kind=kind, count=count, corners=corners, lists=written).encode()


def refused(tmp_path: Path, text: str) -> str:
    (tmp_path / "cart.toml").write_text(CART + text, encoding="utf-8")
    with pytest.raises(eomgen.DescriptionError) as caught:
        eomgen.load(tmp_path / "cart.toml")
    (problem,) = caught.value.problems
    return str(problem).replace(str(tmp_path), "FOLDER")


#: The section of a shape, and the message after an arrow.
MISTAKES = Path(__file__).with_name("mistakes_in_shapes.txt").read_text(encoding="utf-8").strip().split("\n\n")


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: re.findall(r"=> .*?: (.{1,40})", mistake)[0])
def test_each_mistake_in_a_shape_has_one_message(mistake: str, tmp_path: Path) -> None:
    (tmp_path / "hull.stl").write_bytes(binary(CORNERS[FACES]))
    text, message = mistake.split("\n=> ")
    assert refused(tmp_path, text + "\n") == message


#: Files whose messages, which begin with the name of the file, are the lines of faults_of_meshes.txt.
FAULTS = (
    binary(CORNERS[FACES], promised=6).replace(b"solid", b"mesh:"),
    b"abc",
    b"solid\nendsolid",
    b"solid\nvertex 0 0 0\nvertex 1 zero 0\nvertex 0 1 0\n",
    b"solid\nvertex 0 0 0\nvertex 1 0 0\n",
    b"solid\n" + 3 * b"vertex 1 2 3\n",
    binary(np.where(CORNERS[FACES] == 3, np.inf, CORNERS[FACES])),
    glb()[:-30],
    glb(nodes=[{}]),
    b"<mesh/>",
    b"v 0 0 0\nv 1 0 0\nf 1 2 3\n",
    b"v 0 0 zero\n",
)
MESSAGES = Path(__file__).with_name("faults_of_meshes.txt").read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize(("data", "message"), list(zip(FAULTS, MESSAGES, strict=True)), ids=MESSAGES)
def test_each_fault_of_a_mesh_has_one_message(tmp_path: Path, data: bytes, message: str) -> None:
    name = re.split("[ :]", message)[0]
    (tmp_path / name).write_bytes(data)
    assert refused(tmp_path, MESH.format(name)) == message


# -- meshes ------------------------------------------------------------------------------------------------------------


def volume(vertices: np.ndarray, faces: object) -> float:
    """Return the volume that triangles or convex polygons enclose, by the divergence theorem."""
    total = 0.0
    for face in faces:  # type: ignore[attr-defined]
        for k in range(1, len(face) - 1):
            a, b, c = (np.array(vertices[place]) for place in (face[0], face[k], face[k + 1]))
            total += float(a @ np.cross(b, c)) / 6.0
    return total


@pytest.mark.parametrize("inward", [False, True])
@pytest.mark.parametrize("name", ["binary.stl", "text.stl", "part.obj"])
def test_formats_hold_the_same_tetrahedron_and_its_faces_look_outward(tmp_path: Path, name: str, inward: bool) -> None:
    faces = [face[::-1] if inward else face for face in FACES]
    triangles = CORNERS[faces]
    lines = [
        *(f"v {x} {y} {z}" for x, y, z in CORNERS),
        "vn 0 0 1",
        *(f"f {a - 4}//1 {b + 1} {c + 1}/2" for a, b, c in faces),
    ]
    data = {"binary.stl": binary(triangles), "text.stl": text_of(triangles), "part.obj": "\n".join(lines).encode()}
    (tmp_path / name).write_bytes(data[name])
    vertices, read, _, closed = read_mesh(tmp_path / name)
    assert closed
    assert sorted(vertices.tolist()) == sorted(CORNERS.tolist())
    assert len(read) == 4 and volume(vertices, read) == pytest.approx(4.0)


def test_nodes_of_a_binary_gltf_file_place_the_mesh_with_z_up(tmp_path: Path) -> None:
    (tmp_path / "part.glb").write_bytes(glb())
    vertices, faces, _, closed = read_mesh(tmp_path / "part.glb")
    x, y, z = CORNERS.T
    in_file = 2.0 * np.stack([-z, x, -y], axis=1) + [1, 0, 5]  # of (x, z, -y), turned about z
    expected = np.stack([in_file[:, 0], -in_file[:, 2], in_file[:, 1]], axis=1)
    assert sorted(np.round(vertices, 5).tolist()) == sorted(np.round(expected, 5).tolist())
    assert volume(vertices, faces) == pytest.approx(32.0, rel=1e-6) and closed


def test_a_surface_with_a_hole_is_open_and_one_with_a_turned_face_too(tmp_path: Path) -> None:
    for name, faces in (("hole.stl", FACES[:3]), ("turned.stl", [*FACES[:3], FACES[3][::-1]])):
        (tmp_path / name).write_bytes(binary(CORNERS[faces]))
        assert not read_mesh(tmp_path / name).closed


@pytest.mark.parametrize("kind", ["triangles", "polylist", "polygons", "trifans", "tristrips"])
def test_a_collada_file_holds_the_tetrahedron_in_its_place_units_and_colour(tmp_path: Path, kind: str) -> None:
    (tmp_path / "part.dae").write_bytes(collada(kind))
    vertices, faces, colors, closed = read_mesh(tmp_path / "part.dae")
    x, y, z = CORNERS.T
    turned = np.stack([-y, x, z], axis=1) * [2.0, 2.0, 2.0] + [1.0, 2.0, 3.0]  # about z, then moved: inner nodes first
    expected = 0.01 * np.stack([turned[:, 0], -turned[:, 2], turned[:, 1]], axis=1)  # y of the file is up
    assert sorted(np.round(vertices, 7).tolist()) == sorted(np.round(expected, 7).tolist())  # of single precision
    assert volume(vertices, faces) == pytest.approx(32.0e-6, rel=1e-6)
    assert colors.tolist() == [[255, 128, 0]] * 4 and closed


@pytest.mark.parametrize(
    ("ending", "package", "name"), [("dae", "pycollada", "collada"), ("glb", "trimesh", "trimesh")]
)
def test_a_mesh_of_an_optional_package_names_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, package: str, name: str
) -> None:
    monkeypatch.setitem(sys.modules, name, None)
    (tmp_path / f"a.{ending}").write_bytes(glb())
    assert refused(tmp_path, MESH.format(f"a.{ending}")) == (
        f"a.{ending} (shapes.part.file): .{ending} files are read by {package}, which is not installed; try: python -m"
        " pip install 'eomgen[meshes]', or an STL file"
    )


def test_faces_of_a_collada_file_have_the_colours_of_their_materials_unless_the_shape_has_one(tmp_path: Path) -> None:
    second = collada().replace(b"</mesh>", TRIANGLE + b"</mesh>")
    (tmp_path / "part.dae").write_bytes(second)
    for color, expected in (("", {"#ff8000", ""}), ('color = "red"', {"#d62728"})):
        (tmp_path / "cart.toml").write_text(CART + MESH.format("part.dae") + color, encoding="utf-8")
        (shape,) = eomgen.load(tmp_path / "cart.toml").shapes
        parts = drawn_shape(shape, [1.0], [0.0, 0.0, 0.0])
        assert {part["color"] for part in parts} == expected
        assert sum(len(part["faces"]) for part in parts) == 5


def triangles_of(grid: np.ndarray) -> np.ndarray:
    """Return two triangles for each square of a grid of places, (n, 3, 3)."""
    a, b, c, d = (part.reshape(-1, 3) for part in (grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def test_a_fine_mesh_is_thinned_and_keeps_its_form(tmp_path: Path) -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 121)
    heights = np.linspace(-1.0, 1.0, 41)
    place = [[np.cos(a) * np.sqrt(1 - h * h), np.sin(a) * np.sqrt(1 - h * h), h] for a in angles for h in heights]
    triangles = triangles_of(np.array(place).reshape(121, 41, 3))
    assert len(triangles) > 4 * MOST
    (tmp_path / "ball.stl").write_bytes(binary(triangles))
    vertices, faces, _, closed = read_mesh(tmp_path / "ball.stl")
    assert 0.3 * MOST < len(faces) <= MOST and closed
    assert volume(vertices, faces) == pytest.approx(4.0 / 3.0 * np.pi, rel=0.03)
    assert np.ptp(vertices, axis=0) == pytest.approx(2.0, rel=0.03)


def test_a_thinned_box_keeps_its_corners(tmp_path: Path) -> None:
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 41), indexing="ij")
    sides = []
    for axis in range(3):
        for end in (0.0, 1.0):
            side = triangles_of(np.roll(np.stack([np.full_like(u, end), u, v], axis=2), axis, axis=2))
            sides.append(side if end else side[:, ::-1])
    (tmp_path / "box.stl").write_bytes(binary(np.concatenate(sides)))
    vertices, faces, _, closed = read_mesh(tmp_path / "box.stl")
    assert 0.3 * MOST < len(faces) <= MOST and closed
    for corner in np.ndindex(2, 2, 2):
        assert np.min(np.linalg.norm(vertices - corner, axis=1)) < 1e-3  # means of cells are 1e-2 away
    assert volume(vertices, faces) == pytest.approx(1.0, rel=1e-3)


# -- models ------------------------------------------------------------------------------------------------------------


def test_shapes_are_no_part_of_the_model(tmp_path: Path) -> None:
    file = tmp_path / "cart.toml"
    digests, colors = set(), []
    for text in (
        "",
        BALL,
        BALL + 'color = "red"',
        BALL + 'opacity = 0.5\ncolor = "red"',
    ):
        file.write_text(CART + text if text else CART.replace("[shapes.part]\n", ""), encoding="utf-8")
        scene = eomgen.load(file)
        digests.add(scene.digest)
        colors += [part["color"] for part in scenery(describe(scene), {"side": 0.4}).get("shapes", ())]
        assert eomgen.load(file).shapes == scene.shapes  # by the record of the reading
    assert len(digests) == 1
    assert colors == ["", "#d62728", "#d62728"]
    file.write_text(CART + BALL.replace("= 1\n", '= "side"\n'), encoding="utf-8")
    scene = eomgen.load(file)
    assert scene.digest in digests and not scene.requirements
    for side in (0.4, 1.2):
        (part,) = scenery(describe(scene), {"side": side})["shapes"]
        assert np.max(np.linalg.norm(part["vertices"], axis=1)) == pytest.approx(side)
    with pytest.raises(eomgen.NumericalError, match=re.escape("shapes.part: cannot be drawn: a size is -1")):
        scenery(describe(scene), {"side": -1.0})


def test_a_changed_mesh_is_read_again(tmp_path: Path) -> None:
    file = tmp_path / "cart.toml"
    file.write_text(CART + MESH.format("part.stl"), encoding="utf-8")
    (tmp_path / "part.stl").write_bytes(binary(CORNERS[FACES]))
    first = eomgen.load(file)
    (tmp_path / "part.stl").write_bytes(binary(2.0 * CORNERS[FACES]))
    second = eomgen.load(file)
    largest = [np.max(np.frombuffer(scene.shapes[0].vertices, np.float32)) for scene in (first, second)]
    assert largest[1] == 2.0 * largest[0]
    assert first.digest == second.digest


def in_the_world(folder: Path, text: str) -> np.ndarray:
    """Return the vertices of a shape whose body is turned and shifted."""
    place = 'position = [0.1, 0.2, 0.3]\nrotation = [{ axis = [0, 0, 1], angle = "90 deg" }]\n'
    cart = CART.replace("axis = [1, 0, 0]\n", f"axis = [1, 0, 0]\n{place}")
    (part,) = scenery(describe(eomgen.load(_written(folder, cart + text))), {"side": 0.4})["shapes"]
    return np.array(part["vertices"]) @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]).T + [0.1, 0.2, 0.3]


def test_a_shape_is_where_its_body_is_at_the_design_position(tmp_path: Path) -> None:
    """A box given in the world lies there although its body is turned and shifted."""
    there = in_the_world(tmp_path, BOX + 'position = [1, 2, 3]\nin = "world"')
    np.testing.assert_allclose([there.min(axis=0), there.max(axis=0)], [[0.5, 1.5, 2.5], [1.5, 2.5, 3.5]], atol=1e-9)


def test_a_capsule_reaches_from_one_point_to_another(tmp_path: Path) -> None:
    """Ends on two bodies, one turned and one at rest: the capsule is their segment, a radius longer at each end."""
    ends = 'first = "a"\nsecond = "b"\n[points]\na = { body = "hull", position = [1, 0, 0.5] }\n'
    ends += 'b = { body = "world", position = [0.5, -1, 2] }\n'
    there = in_the_world(tmp_path, 'type = "capsule"\nbody = "hull"\nradius = 0.05\n' + ends)
    first, second = np.array([0.1, 1.2, 0.8]), np.array([0.5, -1.0, 2.0])
    way = second - first
    along = np.clip((there - first) @ way / (way @ way), 0.0, 1.0)
    np.testing.assert_allclose(np.linalg.norm(there - first - along[:, None] * way, axis=1), 0.05, atol=2e-6)
    outward = 0.05 * way / np.linalg.norm(way)
    for tip in (first - outward, second + outward):
        assert np.linalg.norm(there - tip, axis=1).min() < 2e-6


def test_a_cylinder_follows_a_tunable_length(tmp_path: Path) -> None:
    ends = 'type = "cylinder"\nbody = "hull"\nradius = 0.05\nfirst = "a"\nsecond = "b"\n'
    ends += '[points]\na = { body = "hull", position = [1, 2, 0] }\nb = { body = "hull", position = [1, 2, "-side"] }\n'
    scene = eomgen.load(_written(tmp_path, CART + ends))
    for side in (0.4, 1.5):
        (part,) = scenery(describe(scene), {"side": side})["shapes"]
        vertices = np.array(part["vertices"])
        np.testing.assert_allclose([vertices[:, 2].min(), vertices[:, 2].max()], [-side, 0.0], atol=1e-9)


def _written(folder: Path, text: str) -> Path:
    (folder / "cart.toml").write_text(text, encoding="utf-8")
    return folder / "cart.toml"


@pytest.mark.parametrize(
    ("shape", "length", "hint"),
    [
        ('type = "wheel"\nbody = "hull"\nradius = 310\nwidth = 200\n', "310", "m"),
        (
            'type = "mesh"\nbody = "hull"\nfile = "hull.stl"\n',
            "4e+03",
            'm; scale = "1 mm" is for a file in millimetres',
        ),
        ('type = "mesh"\nbody = "hull"\nfile = "hull.stl"\nscale = "1 mm"\n', "", ""),
        ('type = "wheel"\nbody = "world"\nradius = 310\nwidth = 200\n', "", ""),
        (WHEEL, "", ""),
    ],
)
def test_shapes_beyond_the_size_of_the_scene_are_noted(shape: str, length: str, hint: str, tmp_path: Path) -> None:
    (tmp_path / "hull.stl").write_bytes(binary(1e3 * CORNERS[FACES]))
    (tmp_path / "scene.toml").write_text(f'{CART}{shape}[points]\na = {{ body = "hull", position = [0.6, 0, 0] }}\n')
    notes = [note for note in eomgen.load(tmp_path / "scene.toml").notes if note.startswith("shapes.")]
    text = f"shapes.part: the size of the shape is {length} m, and the scene is no larger than 0.6 m; numbers without a"
    assert notes == ([f"{text} unit are in {hint}"] if length else [])
    assert not any(note.startswith("shapes.") for note in eomgen.derive(tmp_path / "scene.toml").notes)
