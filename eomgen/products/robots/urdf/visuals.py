"""Visual geometry of a URDF as entries in the section of shapes; a faulty visual does not refuse a robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from eomgen.base.arrays import Array
from eomgen.products.robots.draft import Visual, WrittenPose
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.products.robots.visuals import LEFT_OUT, Numbers, color_of, solid_of, visuals_of
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import Element

#: From the report of a visual's faults to two functions: numbers of an attribute, and orientation (3, 3) and position
#: (3,), m, of an element with an ``origin``.
Values = Callable[[Report], tuple[Numbers, Callable[[Element], tuple[Array, Array]]]]
#: Notes on visuals that pictures replace or show in another colour.
_SUBSTITUTED = "pictures show collision geometry in place of visuals [W0200]"
_LIMITED = "colours that pictures limit to parts from 0 to 1 [W0201]"


class UrdfVisualReader:
    """Reads the visuals of links; ``undrawn`` has links by a note on their visuals and the reason.

    Parameters
    ----------
    root : of the robot, whose materials visuals name
    values : reads numbers and placements
    """

    def __init__(self, root: Element, values: Values) -> None:
        self.values = values
        self.materials = {item.get("name"): item for item in root.children_with_tag("material")}
        self.undrawn: dict[tuple[str, str], list[str]] = {}

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
            self.undrawn.setdefault((_SUBSTITUTED if instead else LEFT_OUT, reason), []).append(name)
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
            self.undrawn.setdefault((_LIMITED, reason), []).append(name)
        return color_of(parts)
