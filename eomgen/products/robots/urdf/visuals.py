"""Visual geometry of a URDF as entries in the section of shapes; a faulty visual does not refuse a robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from eomgen.base.arrays import Array
from eomgen.base.messages import listed
from eomgen.products.robots.draft import Visual, WrittenPose
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.products.robots.visuals import Numbers, color_of, solid_of, visuals_of
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import Element

#: From the report of a visual's faults to two functions: numbers of an attribute, and orientation (3, 3) and position
#: (3,), m, of an element with an ``origin``.
Values = Callable[[Report], tuple[Numbers, Callable[[Element], tuple[Array, Array]]]]
#: Notes on visuals that pictures replace, leave out or show in another colour.
_NOTES = {
    "substituted": "pictures show collision geometry in place of visuals [W0200]",
    "left out": "visuals that pictures leave out [W0175]",
    "limited": "colours that pictures limit to parts from 0 to 1 [W0201]",
}


class UrdfVisualReader:
    """Reads the visuals of links; ``reasons`` has links by reason, by kind of note.

    Parameters
    ----------
    root : of the robot, whose materials visuals name
    values : reads numbers and placements
    """

    def __init__(self, root: Element, values: Values) -> None:
        self.values = values
        self.materials = {item.get("name"): item for item in root.children_with_tag("material")}
        #: Links by the reason, by the kind of note.
        self.reasons: dict[str, dict[str, list[str]]] = {kind: {} for kind in _NOTES}

    def notes(self) -> list[str]:
        """Return notes on visuals that pictures do not show, or show in another colour."""
        result = []
        for kind, note in _NOTES.items():
            for reason, links in self.reasons[kind].items():
                names = list(dict.fromkeys(links))
                result.append(f"{note} ({len(names)}: {listed(names)}): {reason}")
        return result

    def link(self, name: str, element: Element) -> Sequence[Visual]:
        """Return the visuals of a link, or its collision geometry if no visual can be drawn."""

        def read(visual: Element, report: Report) -> Visual:
            numbers, placement = self.values(report)
            entry = solid_of(
                visual, numbers, lambda mesh: (mesh.get("filename"), numbers(mesh, "scale", (1.0, 1.0, 1.0)))
            )
            entry |= self._color(name, visual, numbers)
            return Visual(WrittenPose(ElementPlace("", visual.line), *placement(visual)), entry)

        drawn, reasons = visuals_of(element.children_with_tag("visual"), "", read)
        collisions = element.children_with_tag("collision") if reasons and not drawn else ()
        instead, _ = visuals_of(collisions, "", read)
        for reason in reasons:
            self.reasons["substituted" if instead else "left out"].setdefault(reason, []).append(name)
        return drawn or instead

    def _color(self, name: str, element: Element, numbers: Numbers) -> dict[str, Any]:
        """Return ``color`` and ``opacity`` of a visual of the link ``name``: by the colour in the visual, or of the
        named material; empty without a colour. Parts beyond 0 to 1 are noted. A colour in a visual also defines the
        material."""
        material = element.first("material")
        if material is not None and material.first("color") is not None:
            self.materials[material.get("name")] = material
        named = self.materials.get(material.get("name")) if material is not None else None
        color = named.first("color") if named is not None else None
        if color is None:
            return {}
        parts = numbers(color, "rgba", (0.5, 0.5, 0.5, 1.0))
        if any(not 0.0 <= part <= 1.0 for part in parts):
            written = " ".join(f"{part:g}" for part in parts)
            reason = f'rgba="{written}"; try: parts of 255 divided by 255'
            self.reasons["limited"].setdefault(reason, []).append(name)
        return color_of(parts)
