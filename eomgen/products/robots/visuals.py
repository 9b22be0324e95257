"""Numbers in XML formats, and solids of visuals as entries in the section of shapes."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import shown
from eomgen.lie.numeric import rotation_matrix
from eomgen.products.robots.draft import Visual
from eomgen.products.robots.leftovers import FEW_DIGITS
from eomgen.scene.bodies.mesh_files import ENDINGS
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import Element

#: Note on visuals that no shape of a picture stands for.
LEFT_OUT = "visuals that pictures leave out [W0175]"
NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
#: Numbers of an attribute or element.
Row = tuple[float, ...]
#: From an element, the name of a value and the default to the values. Raises NotDrawnError.
Numbers = Callable[[Element, str, Row], Row]
#: Sizes by type of geometry: name in the format, key of the section, and the default.
_Sizes = Mapping[str, Sequence[tuple[str, str, Row]]]
SDF_SIZES: _Sizes = {
    "box": (("size", "size", (1.0, 1.0, 1.0)),),
    "cylinder": (("radius", "radius", (1.0,)), ("length", "length", (1.0,))),
    "sphere": (("radius", "radius", (1.0,)),),
    "capsule": (("radius", "radius", (0.5,)), ("length", "length", (1.0,))),
    "ellipsoid": (("radii", "semi_axes", (1.0, 1.0, 1.0)),),
    "mesh": (),
}


def read_numbers(name: str, text: str, default: Row, refuse: Callable[[str, str], None], hint: str) -> Row:
    """Return the finite numbers in ``text``, as many as the default has. For a fault the default is returned, and
    ``refuse`` called with a message, which begins with ``name``, and a hint."""
    words = text.split()
    if len(words) != len(default) or not all(NUMBER.fullmatch(word) for word in words):
        count = f"{len(default)} numbers are" if len(default) > 1 else "a number is"
        refuse(f"{name}: {count} needed here, not {shown(text)} [E1704]", hint)
        return default
    values = tuple(float(word) for word in words)
    if not all(math.isfinite(value) for value in values):
        refuse(f"{name}: {shown(text)} is too large [E1705]", "")
        return default
    return values


#: Of URDF, which has no defaults, and no ellipsoids.
URDF_SIZES: _Sizes = {
    kind: [(name, key, (0.0,) * len(default)) for name, key, default in sizes]
    for kind, sizes in SDF_SIZES.items()
    if kind != "ellipsoid"
}


def turn_of(name: str, values: Sequence[float], refuse: Callable[[str, str], None]) -> Array | None:
    """Return the rotation matrix (3, 3) of a quaternion (x, y, z, w); None, after a call of ``refuse`` as in
    ``read_numbers``, for a length other than 1."""
    x, y, z, w = values
    length = math.hypot(*values)
    if not abs(length - 1.0) <= FEW_DIGITS:
        fault = f"{name}: the quaternion has the length {length:.6g}, and a rotation has 1 [E1728]"
        refuse(fault, "x, y, z and w of a unit quaternion")
        return None
    return rotation_matrix(np.array([w, x, y, z]) / length)


class NotDrawnError(Exception):
    """A visual that pictures leave out, with the reason."""


def visuals_of(
    elements: Iterable[Element], read: Callable[[Element, Report], Visual]
) -> tuple[list[Visual], list[str]]:
    """Return the visuals that ``read`` makes of elements, and the reasons for which others are left out; faults of
    visuals refuse no file."""
    visuals, reasons = [], []
    for element in elements:
        report = Report("", {})
        try:
            visual = read(element, report)
            if report.noted:
                raise NotDrawnError(report.noted[0][1].what)
            visuals.append(visual)
        except NotDrawnError as error:
            reasons.append(str(error))
        element.read_whole()
    return visuals, reasons


def solid_of(
    visual: Element,
    numbers: Numbers,
    mesh: Callable[[Element], tuple[str, Row]],
    sizes: _Sizes = URDF_SIZES,
) -> dict[str, Any]:
    """Return type and sizes of the first known geometry in a visual, as keys of an entry in ``[shapes]``.

    ``numbers`` reads the numbers of an attribute or child from element, name and default; ``mesh`` returns file and
    scale of a mesh element; ``sizes`` has for each type of geometry the sizes: name in the format, key, default. Raises
    NotDrawnError without a known geometry, for a size that is not above 0, a mesh of an unknown kind, or a scale of 0.
    """
    geometry = visual.first("geometry")
    solids = [(kind, item) for kind in sizes for item in (geometry.children_with_tag(kind) if geometry else ())]
    if not solids:
        raise NotDrawnError(f"no geometry is one of {', '.join(sizes)}")
    kind, solid = solids[0]
    entry: dict[str, Any] = {"type": kind}
    for name, key, default in sizes[kind]:
        values = numbers(solid, name, default)
        if not min(values) > 0.0:
            raise NotDrawnError(f"{name} of a {kind} is not above 0")
        entry[key] = list(values) if len(values) > 1 else values[0]
    if kind == "mesh":
        file, scale = mesh(solid)
        ending = Path(file).suffix.lower()
        if ending not in ENDINGS:
            reason = f"meshes of the kind {shown(ending)} are not read" if ending else "a mesh names no file"
            raise NotDrawnError(reason)
        if not all(scale):
            raise NotDrawnError("the scale of a mesh is 0")
        entry |= {"file": file, "scale": list(scale), "required": False}
    return entry


def color_of(parts: Sequence[float], opaque: float = 1.0) -> dict[str, Any]:
    """Return ``color`` (#rrggbb) and ``opacity`` of red, green, blue and perhaps alpha, limited to the range from 0 to
    1.

    The opacity is alpha, 1 by default, times ``opaque``.

    Raises
    ------
    NotDrawnError
        For a transparent colour.
    """
    red, green, blue, *rest = (min(max(part, 0.0), 1.0) for part in parts)
    opacity = (rest[0] if rest else 1.0) * opaque
    if opacity == 0.0:
        raise NotDrawnError("the colour is transparent")
    return {"color": "#" + "".join(f"{round(255 * part):02x}" for part in (red, green, blue)), "opacity": opacity}
