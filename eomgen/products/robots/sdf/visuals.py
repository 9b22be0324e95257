"""Visual geometry of SDF as entries in the section of shapes; a faulty visual does not refuse a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from eomgen.products.robots.draft import Visual
from eomgen.products.robots.leftovers import Leftovers
from eomgen.products.robots.sdf.values import STATUSES, SdfValues
from eomgen.products.robots.uris import is_remote
from eomgen.products.robots.visuals import SDF_SIZES, NotDrawnError, color_of, solid_of, visuals_of
from eomgen.scene.bodies.mesh_files import ENDINGS
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import Element


def visuals_of_link(element: Element, values: SdfValues, path: Callable[[str], str]) -> tuple[list[Visual], list[str]]:
    """Return the visuals of a link that can be drawn, and the reasons for which others cannot.

    Parameters
    ----------
    element : Element
        Of the link.
    values : SdfValues
        Reads the file of the link.
    path : callable
        From the address of a mesh to the path from the folder of the converted file.
    """

    def read(visual: Element, report: Report) -> Visual:
        reader = SdfValues(values.file, report, Leftovers(STATUSES), values.minor)
        pose = reader.pose(visual, "")
        entry = solid_of(visual, reader.vector, lambda mesh: _mesh(mesh, reader, path), SDF_SIZES)
        return Visual(pose, entry | _color(visual, reader))

    return visuals_of(element.children_with_tag("visual"), read)


def _mesh(element: Element, values: SdfValues, path: Callable[[str], str]) -> tuple[str, tuple[float, ...]]:
    address = values.text(element, "uri")
    if Path(address).suffix.lower() in ENDINGS:
        if is_remote(address):
            raise NotDrawnError("meshes lie in a network")
        address = path(address)
    return address, values.vector(element, "scale", (1.0, 1.0, 1.0))


def _color(element: Element, values: SdfValues) -> dict[str, Any]:
    """Return ``color`` and ``opacity`` of a visual from diffuse colour and transparency; empty without such a colour.
    Raises NotDrawnError for a transparent one."""
    material = element.first("material")
    diffuse = None if material is None else material.first("diffuse")
    if material is None or diffuse is None:
        return {}
    words = diffuse.text().split()
    parts = values.numbers(material, "diffuse", " ".join(words), (0.5,) * (4 if len(words) != 3 else 3))
    return color_of(parts, 1.0 - min(max(values.number(element, "transparency", 0.0), 0.0), 1.0))
