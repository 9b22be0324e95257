"""Meshes with fewer triangles: no change up to the limit, and volumes, sides and sizes of what is left."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from eomgen.scene.bodies.mesh_files import PictureMesh, read_mesh


def sphere(path: Path, rings: int) -> Path:
    """Write a unit sphere around (5, 0, 0) as an OBJ file of quadrangles and triangles."""
    rows = [f"v 5 0 {z}" for z in (1, -1)]
    angles = np.arange(2 * rings) * np.pi / rings
    for ring in range(1, rings):
        height, radius = np.cos(np.pi * ring / rings), np.sin(np.pi * ring / rings)
        rows += [f"v {5 + radius * np.cos(a)} {radius * np.sin(a)} {height}" for a in angles]
    width = 2 * rings
    for k in range(width):
        after = (k + 1) % width
        rows.append(f"f 1 {3 + k} {3 + after}")
        for ring in range(rings - 2):
            first = 3 + width * ring
            rows.append(f"f {first + k} {first + width + k} {first + width + after} {first + after}")
        last = 3 + width * (rings - 2)
        rows.append(f"f {last + after} {last + k} 2")
    path.write_text("\n".join(rows), encoding="utf-8")
    return path


def volume(mesh: PictureMesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] - [5.0, 0.0, 0.0] for k in range(3))
    return float(np.sum(a * np.cross(b, c)) / 6.0)


def test_a_mesh_of_as_many_triangles_as_wanted_is_unchanged(tmp_path: Path) -> None:
    path = sphere(tmp_path / "ball.obj", 8)
    whole = read_mesh(path)
    count = 2 * 16 * 7
    assert len(whole.faces) == count and whole.closed
    same, fewer = read_mesh(path, count), read_mesh(path, count - 1)
    assert np.array_equal(same.vertices, whole.vertices) and np.array_equal(same.faces, whole.faces)
    assert 0.5 * count < len(fewer.faces) < count


@pytest.mark.parametrize("most", [100, 400, 1500])
def test_a_thinned_sphere_is_a_sphere(most: int, tmp_path: Path) -> None:
    path = sphere(tmp_path / "ball.obj", 40)
    whole, mesh = read_mesh(path, 10**6), read_mesh(path, most)
    assert 0.6 * most < len(mesh.faces) <= most < len(whole.faces) == 2 * 80 * 39
    assert mesh.closed and len(np.unique(mesh.faces)) == len(mesh.vertices)
    assert volume(mesh) == pytest.approx(volume(whole), rel=12.0 / most)
    radii = np.linalg.norm(mesh.vertices - [5.0, 0.0, 0.0], axis=1)
    assert np.max(np.abs(radii - 1.0)) < 6.0 / most
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    outward = np.sum(np.cross(b - a, c - a) * (a + b + c - [15.0, 0.0, 0.0]), axis=1)
    assert np.mean(outward > 0.0) > 0.98
