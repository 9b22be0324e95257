"""Visuals of URDF files as shapes of pictures: placements, colours, meshes in packages, and faults that refuse no
robot."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.describe import describe
from eomgen.pipeline.readings import from_record, record_of_document
from eomgen.pipeline.scenes import SCENES
from eomgen.products.pictures.scenery import scenery
from tests.models.urdf import load_urdf
from tests.pictures.test_shapes import CORNERS, FACES, binary, volume
from tests.robots.tables import table

ROBOT = Path(__file__).with_name("arm_with_visuals.txt").read_text(encoding="utf-8")
BOX = "<visual><origin xyz='{}' rpy='{}'/><geometry><box size='0.2 0.4 0.6'/></geometry>{}</visual>"
MESH = "<visual><geometry><mesh filename='{}' {}/></geometry></visual>"


def robot(floor: str = "", upper: str = "", hand: str = "") -> str:
    return ROBOT.format(floor=floor, upper=upper, hand=hand)


def drawn(scene: object) -> list[dict[str, object]]:
    return scenery(describe(scene), {}).get("shapes", [])  # type: ignore[arg-type]


def test_shapes_stand_at_the_merged_place_of_their_links_with_colours_of_materials() -> None:
    """The hand is turned by 90 deg about z, 2 m above its body: its box spans 0.4 m along x and 0.2 m along y."""
    dark = "<material name='dark'/>"
    round_ones = "<visual><geometry><cylinder radius='0.1' length='0.3'/></geometry></visual>"
    scene = load_urdf(robot(floor=round_ones, hand=BOX.format("1 0 0", "0 0 0", dark)))
    cylinder, box = scene.shapes
    assert (cylinder.name, cylinder.body, cylinder.kind, cylinder.color) == ("floor", "base", "cylinder", "")
    assert (box.body, box.kind, box.color, box.opacity) == ("upper", "box", "#336699", 0.5)
    vertices = np.array(drawn(scene)[1]["vertices"])
    np.testing.assert_allclose(vertices.min(axis=0), [-0.2, 0.9, 1.7], atol=1e-9)
    np.testing.assert_allclose(vertices.max(axis=0), [0.2, 1.1, 2.3], atol=1e-9)


@pytest.mark.parametrize(("roll", "pitch", "yaw"), [(0.3, -0.7, 2.0), (0.0, 0.0, 0.0), (3.141592653589793, 0.0, 1.0)])
def test_origins_turn_about_fixed_axes(roll: float, pitch: float, yaw: float) -> None:
    scene = load_urdf(robot(upper=BOX.format("0.1 0.2 0.3", f"{roll} {pitch} {yaw}", "")))
    sines, cosines = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    x, y, z = (np.eye(3) for _ in range(3))
    for matrix, axis in ((x, 0), (y, 1), (z, 2)):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        matrix[first, first] = matrix[second, second] = cosines[axis]
        matrix[first, second], matrix[second, first] = -sines[axis], sines[axis]
    np.testing.assert_allclose(scene.shapes[0].axes, z @ y @ x, atol=1e-14)


def test_meshes_of_packages_have_their_scale_and_mirrored_ones_keep_their_outside(tmp_path: Path) -> None:
    """The package is the folder around both the meshes and the description; a scale of -2 mirrors."""
    (tmp_path / "arm_robot" / "meshes").mkdir(parents=True)
    (tmp_path / "arm_robot" / "urdf").mkdir()
    (tmp_path / "arm_robot" / "meshes" / "hand.stl").write_bytes(binary(CORNERS[FACES]))
    file = tmp_path / "arm_robot" / "urdf" / "arm.urdf"
    package = MESH.format("package://arm_robot/meshes/hand.stl", "scale='1 -2 3'")
    beside = MESH.format("../meshes/hand.stl", "")
    whole = MESH.format(f"file://{tmp_path}/arm_robot/meshes/hand.stl", "")
    file.write_text(robot(upper=package + beside + whole), encoding="utf-8")
    (tmp_path / "scene.toml").write_text(
        "format = 1\nname = 'two'\n[include.left]\nfile = 'arm_robot/urdf/arm.urdf'\n", encoding="utf-8"
    )
    for path in (file, tmp_path / "scene.toml"):
        parts = drawn(eomgen.load(path))
        volumes = [volume(np.array(part["vertices"]), part["faces"]) for part in parts]
        np.testing.assert_allclose(volumes, [24.0, 4.0, 4.0], rtol=1e-6)


def test_a_missing_mesh_is_a_note_until_it_is_there(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(robot(hand=MESH.format("hand.stl", "")), encoding="utf-8")
    for _ in range(2):  # the second time by the record of the reading
        scene = eomgen.load(file)
        assert not scene.shapes
        assert any(
            note.startswith("meshes left out of pictures (1: hand): ") and "hand.stl': cannot be read" in note
            for note in scene.notes
        )
    (tmp_path / "hand.stl").write_bytes(binary(CORNERS[FACES]))
    assert len(eomgen.load(file).shapes) == 1


def test_a_mesh_is_read_when_it_is_drawn_and_again_when_it_has_changed(tmp_path: Path) -> None:
    file, mesh = tmp_path / "arm.urdf", tmp_path / "hand.stl"
    file.write_text(robot(hand=MESH.format("hand.stl", "")), encoding="utf-8")
    mesh.write_bytes(b"solid no mesh")
    for _ in range(2):  # the second time by the record of the reading
        scene = eomgen.load(file)
        (shape,) = scene.shapes
        assert shape.unread is not None and shape.unread.file == str(mesh)
    with pytest.warns(RuntimeWarning, match=r"^the shape hand is left out of pictures: hand.stl: the mesh has no tri"):
        assert drawn(scene) == []
    for size in (1.0, 2.0):
        mesh.write_bytes(binary(size * CORNERS[FACES]))
        os.utime(mesh, (size, size))
        (part,) = drawn(scene)
        assert volume(np.array(part["vertices"]), part["faces"]) == pytest.approx(4.0 * size**3)
        assert drawn(scene) == [part]
    mesh.unlink()
    with pytest.warns(RuntimeWarning, match="cannot be read: No such file or directory"):
        assert drawn(scene) == []


def test_a_saved_scene_holds_the_meshes_of_its_files(tmp_path: Path) -> None:
    file, mesh = tmp_path / "arm.urdf", tmp_path / "hand.stl"
    file.write_text(robot(hand=MESH.format("hand.stl", "")), encoding="utf-8")
    mesh.write_bytes(binary(CORNERS[FACES]))
    scene = eomgen.load(file)
    record = from_record(record_of_document(scene, SCENES))
    mesh.unlink()
    parts = [scenery(record.description, {})["shapes"], drawn(record.scene)]
    assert parts[0] == parts[1] and volume(np.array(parts[0][0]["vertices"]), parts[0][0]["faces"]) == pytest.approx(
        4.0
    )


@pytest.mark.parametrize(("visual", "note"), table("faults_of_visuals"))
def test_faults_of_visuals_are_notes_also_if_strict(visual: str, note: str) -> None:
    scene = load_urdf(robot(hand=visual), strict=True)
    assert [text for text in scene.notes if "pictures" in text] == [note]
    assert [shape.kind for shape in scene.shapes] == (["sphere"] if "<collision>" in visual else [])


def test_colours_of_255_are_noted() -> None:
    scene = load_urdf(
        robot(hand=BOX.format("0 0 0", "0 0 0", "<material name='red'><color rgba='255 0 0 1'/></material>"))
    )
    assert [text for text in scene.notes if "pictures" in text] == [
        'colours that pictures limit to parts from 0 to 1 (1: hand): rgba="255 0 0 1"; try: parts of 255 divided by 255'
    ]
    assert [shape.color for shape in scene.shapes] == ["#ff0000"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "options", "colors"),
    [
        ("panda_description/urdf/panda.urdf", {}, {"#ffffff", "#404040"}),
        ("anymal_c_simple_description/urdf/anymal.urdf", {"root": "free"}, set()),
    ],
)
def test_robots_have_their_own_surfaces_within_the_budget(file: str, options: dict[str, str], colors: set[str]) -> None:
    from tests.oracles.pinocchio_oracle import robot_file

    scene = eomgen.load(robot_file(file), **options)
    assert not [note for note in scene.notes if "left out" in note or "collision geometry in place" in note]
    assert all(shape.vertices == b"" for shape in scene.shapes)  # meshes are read for pictures alone
    meshes = [shape.whole() for shape in scene.shapes if shape.kind == "mesh"]
    triangles = sum(len(shape.faces) // 12 for shape in meshes)
    assert 3_000 < triangles <= 12_000
    shown = {color for shape in meshes for color in _colors(shape)}
    assert colors <= shown
    assert any(shape.closed for shape in meshes)


def _colors(shape: object) -> set[str]:
    rows = np.frombuffer(shape.face_colors, "<i2").reshape(-1, 3)  # type: ignore[attr-defined]
    return {"#" + "".join(f"{part:02x}" for part in row) for row in np.unique(rows, axis=0).tolist() if row[0] >= 0}
