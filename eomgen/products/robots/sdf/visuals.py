"""Visual geometry of SDF as entries of the section of shapes; no fault of a visual refuses a file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from eomgen.base.data import dataclass
from eomgen.base.messages import listed
from eomgen.products.robots.draft import Visual
from eomgen.products.robots.leftovers import Leftovers
from eomgen.products.robots.sdf.coverage import STATUSES
from eomgen.products.robots.sdf.values import Values
from eomgen.products.robots.uris import is_remote, located
from eomgen.products.robots.visuals import SDF_SIZES, NotDrawnError, color_of, solid_of
from eomgen.scene.bodies.mesh_files import ENDINGS
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import Element


class VisualReader:
    """Reads the visuals of links; ``left_out`` has the reasons for which visuals are left out, with the links.

    Parameters
    ----------
    home : Path
        Folder of the file that is converted: paths of meshes are written from there.
    """

    def __init__(self, home: Path) -> None:
        self.home = home
        self.left_out: dict[str, list[str]] = {}

    def notes(self) -> list[str]:
        """Return notes on visuals that pictures do not show."""
        return [
            f"visuals that pictures leave out ({len(names)}: {listed(list(dict.fromkeys(names)))}): {reason} [W0175]"
            for reason, names in self.left_out.items()
        ]

    def of_link(
        self, link: str, element: Element, values: Values, folder: Path, packages: Mapping[str, Path]
    ) -> tuple[Visual, ...]:
        """Return the visuals of a link that can be drawn."""
        result = []
        for visual in element.named("visual"):
            # faults of visuals are notes, so they have a report of their own
            own = Values(values.file, Report(values.file, {}), Leftovers(STATUSES), values.minor)
            try:
                drawn = _visual(visual, own, _Folders(self.home, folder, packages))
                if own.report.noted:
                    _, problem = own.report.noted[0]
                    raise NotDrawnError(problem.what)
                result.append(drawn)
            except NotDrawnError as error:
                self.left_out.setdefault(str(error), []).append(link)
            visual.read_whole()
        return tuple(result)


@dataclass(frozen=True)
class _Folders:
    """Folders of files of meshes: the folder of the file that names them, and folders of packages."""

    home: Path
    folder: Path
    packages: Mapping[str, Path]

    def path(self, address: str) -> str:
        """Return the path of a mesh from the folder of the file that is converted."""
        if "://" not in address and self.folder == self.home:
            return address
        return os.path.relpath(located(address, self.folder, self.packages), self.home)


def _visual(element: Element, values: Values, folders: _Folders) -> Visual:
    pose = values.pose(element, "")
    entry = solid_of(element, values.vector, lambda mesh: _mesh(mesh, values, folders), SDF_SIZES)
    return Visual(pose, entry | _color(element, values))


def _mesh(element: Element, values: Values, folders: _Folders) -> tuple[str, tuple[float, ...]]:
    address = values.text(element, "uri")
    if Path(address).suffix.lower() in ENDINGS:
        if is_remote(address):
            raise NotDrawnError("meshes lie in a network")
        address = folders.path(address)
    return address, values.vector(element, "scale", (1.0, 1.0, 1.0))


def _color(element: Element, values: Values) -> dict[str, Any]:
    """Return colour and opacity of a visual; none without a colour, or with a transparent one."""
    material = element.first("material")
    if material is None or material.first("diffuse") is None:
        return {}
    diffuse = material.first("diffuse")
    words = diffuse.text().split() if diffuse is not None else []
    parts = values.numbers(material, "diffuse", " ".join(words), (0.5,) * (4 if len(words) != 3 else 3))
    transparency = values.number(element, "transparency", 0.0)
    return color_of(parts, 1.0 - min(max(transparency, 0.0), 1.0))
