"""Geoms of MJCF as shapes of pictures, if in the groups that MuJoCo shows."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import listed
from eomgen.lie.numeric import rotation_matrix
from eomgen.products.robots.mjcf.draft import MjcfDraft
from eomgen.products.robots.scene_draft import LinkPlace, turns_of
from eomgen.products.robots.visuals import color_of
from eomgen.scene.bodies.mesh_files import ENDINGS
from eomgen.scene.rotations import snapped_rotation

#: MuJoCo's colour of a geom without a colour, in place of which the one of its material is shown.
_PLAIN = (0.5, 0.5, 0.5, 1.0)


def convert_geoms(draft: MjcfDraft) -> None:
    """Add the visible geoms of the groups that MuJoCo shows to the shapes of the scene; list the ones without a shape
    in a note."""
    model = draft.model
    left_out: dict[str, list[str]] = {}
    for geom in range(model.ngeom):
        color = _color(draft, geom)
        if int(model.geom_group[geom]) >= 3 or color[3] == 0.0:
            continue
        written = draft.element_name("geom", geom)
        carrier = draft.places[int(model.geom_bodyid[geom])]
        name = written or draft.element_name("body", int(model.geom_bodyid[geom])) or "world"
        placement = carrier.of(np.array(model.geom_pos[geom]), model.geom_quat[geom])
        solid = _solid(draft, geom, placement)
        if isinstance(solid, str):
            left_out.setdefault(solid, []).append(name)
            continue
        placement, entry = solid
        draft.section("shapes")[draft.name("shape", "", name)] = {
            **entry,
            "body": placement.body,
            "position": placement.position.tolist(),
            "rotation": turns_of(snapped_rotation(placement.orientation)),
            **color_of(color),
        }
    for reason, names in left_out.items():
        draft.notes.append(f"geoms that pictures leave out ({len(names)}: {listed(names)}): {reason} [W0253]")


def _color(draft: MjcfDraft, geom: int) -> tuple[float, ...]:
    model = draft.model
    color = tuple(float(part) for part in model.geom_rgba[geom])
    material = int(model.geom_matid[geom])
    if material >= 0 and np.allclose(color, _PLAIN):
        color = tuple(float(part) for part in model.mat_rgba[material])
    return tuple(round(min(max(part, 0.0), 1.0), 4) for part in color)


def _solid(draft: MjcfDraft, geom: int, placement: LinkPlace) -> tuple[LinkPlace, dict[str, Any]] | str:
    """Return placement and entry (type and sizes) of the solid of a geom at ``placement``, or the reason why there is
    none, as a text. A plane is a thin box below the surface."""
    model, kinds, kind = draft.model, draft.mujoco.mjtGeom, int(draft.model.geom_type[geom])
    x, y, z = (float(part) for part in model.geom_size[geom])
    if kind == kinds.mjGEOM_MESH:
        return _mesh(draft, int(model.geom_dataid[geom]), placement)
    if kind == kinds.mjGEOM_PLANE:
        # a size of 0 is a plane without end; a large one would make the machine small in the picture
        widest = float(model.stat.extent)
        sides = [2.0 * (min(half, widest) or widest) for half in (x, y)]
        return placement.of(np.array([0.0, 0.0, -0.001])), {"type": "box", "size": [*sides, 0.002]}
    entries: dict[int, dict[str, Any]] = {
        int(kinds.mjGEOM_SPHERE): {"type": "sphere", "radius": x},
        int(kinds.mjGEOM_CAPSULE): {"type": "capsule", "radius": x, "length": 2.0 * y},
        int(kinds.mjGEOM_CYLINDER): {"type": "cylinder", "radius": x, "length": 2.0 * y},
        int(kinds.mjGEOM_BOX): {"type": "box", "size": [2.0 * x, 2.0 * y, 2.0 * z]},
        int(kinds.mjGEOM_ELLIPSOID): {"type": "ellipsoid", "semi_axes": [x, y, z]},
    }
    word = kinds(kind).name.removeprefix("mjGEOM_").lower()
    return (placement, entries[kind]) if kind in entries else f"no shape of pictures is of the type {word}"


def _mesh(draft: MjcfDraft, mesh: int, placement: LinkPlace) -> tuple[LinkPlace, dict[str, Any]] | str:
    """Return place and entry of a mesh's file, or the reason for its absence: MuJoCo moves the frame of a mesh to the
    principal axes of inertia, and this is undone. ``placement`` is the place of the geom."""
    model = draft.model
    file = _file_of_mesh(draft, mesh)
    if file is None:
        return "a mesh without a file"
    if file.suffix.lower() not in ENDINGS:
        return f"meshes of the kind {file.suffix} are not read"
    turned: Array = rotation_matrix(np.array(model.mesh_quat[mesh])).T
    back = LinkPlace(placement.body, placement.orientation @ turned, np.zeros(3))
    position = placement.position - back.orientation @ np.array(model.mesh_pos[mesh])
    scale = [float(part) for part in model.mesh_scale[mesh]]
    entry = {"type": "mesh", "file": file.as_posix(), "scale": scale, "required": False}
    return LinkPlace(placement.body, back.orientation, position), entry


def _file_of_mesh(draft: MjcfDraft, mesh: int) -> Path | None:
    start = int(draft.model.mesh_pathadr[mesh])
    if start < 0:
        return None
    paths = bytes(draft.model.paths)
    file = Path(paths[start : paths.index(b"\0", start)].decode("utf-8", "replace"))
    return file if draft.folder is None else Path(os.path.relpath(file, draft.folder))
