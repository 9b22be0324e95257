"""Visual geometry of SDF as entries in the section of shapes; a faulty visual does not refuse a file."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from eomgen.products.robots.draft import Visual
from eomgen.products.robots.leftovers import Leftovers
from eomgen.products.robots.sdf.values import STATUSES, SdfValues
from eomgen.products.robots.uris import is_remote, locate
from eomgen.products.robots.visuals import SDF_SIZES, NotDrawnError, color_of, solid_of, visuals_of
from eomgen.scene.bodies.mesh_files import ENDINGS
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import Element


class SdfVisualReader:
    """Reads the visuals of links; ``left_out`` has the reasons for which visuals are left out, with the links.

    Parameters
    ----------
    home : Path
        Folder of the file that is converted: paths of meshes are written from there.
    """

    def __init__(self, home: Path) -> None:
        self.home = home
        self.left_out: dict[str, list[str]] = {}

    def link_visuals(
        self, link: str, element: Element, values: SdfValues, folder: Path, packages: Mapping[str, Path]
    ) -> tuple[Visual, ...]:
        """Return the visuals of a link that can be drawn; others are added to ``left_out`` with the reason.

        Parameters
        ----------
        link, element : str, Element
            Name and element of the link.
        values : SdfValues
            Reads the file of the link.
        folder : Path
            Folder of this file, from which meshes are named.
        packages : mapping
            Folders of packages by name.
        """

        def path(address: str) -> str:
            if "://" not in address and folder == self.home:
                return address
            return os.path.relpath(locate(address, folder, packages), self.home)

        def read(visual: Element, report: Report) -> Visual:
            reader = SdfValues(values.file, report, Leftovers(STATUSES), values.minor)
            pose = reader.pose(visual, "")
            entry = solid_of(visual, reader.vector, lambda mesh: _mesh(mesh, reader, path), SDF_SIZES)
            return Visual(pose, entry | _color(visual, reader))

        visuals, reasons = visuals_of(element.children_with_tag("visual"), values.file, read)
        for reason in reasons:
            self.left_out.setdefault(reason, []).append(link)
        return tuple(visuals)


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
    transparency = values.number(element, "transparency", 0.0)
    return color_of(parts, 1.0 - min(max(transparency, 0.0), 1.0))
