"""The section of shapes: solids and meshes by which pictures show bodies, the base and the world, without a part in the
equations."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from eomgen.base.data import replace
from eomgen.base.messages import key_of, listed, nearest, shown
from eomgen.errors import FileError
from eomgen.formula.nodes import Formula, Vector
from eomgen.scene.bodies.mesh_files import MOST, is_readable, mesh_path, with_mesh
from eomgen.scene.design_poses import attach, size_of
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.key_metadata import Table, given_in, key, of_fixed_parameters, of_parameters, optional
from eomgen.scene.reading.kinds import ORIGIN, Finite, Rotations, Triple, Value
from eomgen.scene.reading.kinds import Values as OneOrMore
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.requirements import above_zero, is_zero
from eomgen.scene.reading.values import Values, read_orientation, read_placement
from eomgen.scene.rotations import frame_about, rows
from eomgen.scene.section import Reading, Section
from eomgen.system.description import BASE, WORLD, Point, Shape, UnreadMesh

#: Keys of each type; needed sizes, in the axes of the shape, with an example.
_KEYS: Mapping[str, str] = {
    "box": "size=[0.4,0.2,0.1]",
    "cylinder": "radius=0.1 length=0.5",
    "sphere": "radius=0.1",
    "capsule": "radius=0.1 length=0.5",
    "wheel": "radius=0.1 width=0.2",
    "ellipsoid": "semi_axes=[0.2,0.1,0.1]",
    "mesh": 'file="part.stl" scale',
}
#: Axis of symmetry in the frame of the shape.
_AXES = {"cylinder": (0.0, 0.0, 1.0), "capsule": (0.0, 0.0, 1.0), "wheel": (0.0, 1.0, 0.0)}
#: Colours by name.
COLORS = {
    "black": "#1b1f24", "white": "#f5f5f5", "grey": "#8a94a3", "gray": "#8a94a3", "silver": "#c3cad3",
    "red": "#d62728", "orange": "#ef8b2c", "yellow": "#f2c744", "gold": "#c99a1d", "brown": "#8c5a3c",
    "green": "#2f9e57", "olive": "#8a8f3c", "teal": "#1f8f86", "cyan": "#24a4b5", "blue": "#3f7fdb",
    "navy": "#22407a", "purple": "#8d70d8", "magenta": "#c8479a", "pink": "#e79ab8", "beige": "#dccfae",
}  # fmt: skip  # a table
_HEXADECIMAL = re.compile(r"#(?:[0-9a-fA-F]{3}|[0-9a-fA-F]{6})")


class DrawnShape(Table):
    """A solid or a mesh by which pictures show a body, the base or the world; the equations do not know it."""

    type: Literal["box", "cylinder", "sphere", "capsule", "wheel", "ellipsoid", "mesh"] = key("kind of solid")
    body: str = key("the body that carries it", refers="bodies", kind="body, `base` or `world`")
    position: Triple = key("centre of the solid or origin of the mesh, in the body", ORIGIN, unit="m", names=PARAMETERS)
    rotation: Rotations | None = optional("its axes in the body; intrinsic rotations in order", shown_default="`[]`")
    axis: Triple | None = of_fixed_parameters(
        "axis of symmetry of a cylinder, a capsule or a wheel, in the body's axes, in place of `rotation`",
        shown_default="`[0, 0, 1]`, of a wheel `[0, 1, 0]`",
    )
    given_in: str | None = given_in("position and axes are given")
    first: str | None = optional(
        "one end of the axis of a cylinder or a capsule, at the design position, in place of position, axes and"
        " `length`",
        refers="points",
    )
    second: str | None = optional("the other end", refers="points")
    size: Triple | None = of_parameters("sides of a box along its axes", unit="m", shown_default="required for a box")
    radius: Value | None = of_parameters(
        "radius of a cylinder, a sphere, a capsule or a wheel", unit="m", shown_default="required for round types"
    )
    length: Value | None = of_parameters(
        "length, of a capsule without its ends", unit="m", shown_default="required for a cylinder and a capsule"
    )
    width: Value | None = of_parameters("width of a wheel", unit="m", shown_default="required for a wheel")
    semi_axes: Triple | None = of_parameters(
        "semi-axes of an ellipsoid along its axes", unit="m", shown_default="required for an ellipsoid"
    )
    file: Annotated[str, Field(min_length=1, max_length=1000)] | None = optional(
        "path of an STL file (binary or text), an OBJ file, a COLLADA file (DAE) or a binary glTF file (GLB), from the"
        " folder of the scene file; `package://NAME/...` for a file of a folder NAME around that folder",
        path=True,
        shown_default="required for a mesh",
    )
    scale: OneOrMore | None = of_parameters(
        'length of one unit in the file of the mesh; `"1 mm"` for millimetres; or three, along the axes of the mesh,'
        " negative ones for mirrored meshes",
        unit="m",
        shown_default="1",
    )
    color: str = key("`#rrggbb`, or one of " + ", ".join(COLORS), "", shown_default="the colour of the body")
    opacity: Finite = key("1 hides the parts behind the shape", 1.0)
    required: bool = key("`false`: a mesh is read when drawn, and left out with a note if it cannot be read", True)


class _ShapeReader:
    """Reads one shape for pictures; faults go to the report of ``values``. ``most`` is the largest number of triangles
    of a mesh, and ``missing`` becomes the reason for which an optional mesh is left out."""

    def __init__(self, name: str, entry: DrawnShape, values: Values, reading: Reading, most: int) -> None:
        self.name, self.entry, self.values, self.reading = name, entry, values, reading
        self.key, self.report = key_of("shapes", name), values.report
        self.most = most  # triangles of a mesh
        self.missing = ""  # reason for which an optional mesh is left out

    def shape(self) -> Shape | None:
        """Return the shape; None if axes or mesh have a fault, which is reported, and for an optional mesh that cannot
        be read."""
        entry, values = self.entry, self.values
        bodies = [BASE, WORLD, *self.reading.bodies]
        known = check_reference(f"{self.key}.body", entry.body, bodies, "body", self.report)
        if entry.first is not None or entry.second is not None:
            return self._between(known=known)
        values.check_kind(self.key, entry, "type", _KEYS)
        position = values.vector(f"{self.key}.position", entry.position, PARAMETERS)
        axes = self._axes()
        if axes is None:
            return None
        if known:
            positioned = "position" in entry.model_fields_set
            position, axes = read_placement(self.key, entry.given_in, positioned, entry.body, position, axes, values)
        sizes = self._sizes()
        shape = Shape(self.name, entry.body, entry.type, position, axes, sizes, self._color(), self._opacity())
        return self._read_mesh(shape) if entry.type == "mesh" and entry.file is not None else shape

    def _between(self, *, known: bool) -> Shape | None:
        """Return a cylinder or a capsule between two points at the design position; None for a fault, which is
        reported. ``known``: whether the body of the entry exists."""
        entry, values = self.entry, self.values
        if entry.type not in ("cylinder", "capsule"):
            fault = f"{_noun(entry.type)} has no ends: first and second are for a cylinder or a capsule [E1395]"
            self.report.add(self.key, fault, 'type = "capsule"')
            return None
        for name in ("position", "rotation", "axis", "in", "length"):
            if ("given_in" if name == "in" else name) in entry.model_fields_set:
                self.report.add(f"{self.key}.{name}", f"first and second give the {name} [E1397]", f"no {name}")
        if entry.radius is None:
            self.report.add(self.key, f"{_noun(entry.type)} needs a radius [E1398]", "radius = 0.1")
        points: Mapping[str, Point] = self.reading.items["points"]
        ends: list[Vector] = []
        for side in ("first", "second"):
            name = getattr(entry, side)
            if name is None:
                self.report.add(f"{self.key}.{side}", f"the key {side} is missing [E1343]", f"{side} = ...")
            elif values.point(f"{self.key}.{side}", name) and known and name in points:
                point = points[name]
                placement = point.body, True, entry.body, point.position, rows(np.eye(3))
                ends.append(read_placement(f"{self.key}.{side}", *placement, values)[0])
        if len(ends) < len(("first", "second")) or self.report.concerns(self.key):
            return None
        (x0, y0, z0), (x1, y1, z1) = ends
        way, middle = (x1 - x0, y1 - y0, z1 - z0), (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1))
        direction = np.array([values.value(part) for part in way])
        size = float(np.linalg.norm(direction))
        if not size > 0.0:
            if size == 0.0:
                fault = "both points are at the same place at the design position [E1399]"
                self.report.add(self.key, fault, "other points")
            return None
        if np.count_nonzero(direction) > 1 and values.is_tunable(*way):
            fault = "tunable parameters turn the line between both points, and axes of shapes are fixed [E1396]"
            self.report.add(self.key, fault, "fixed parameters in the points' positions")
            return None
        sizes = values.formula(f"{self.key}.radius", entry.radius or 0.0, PARAMETERS), size_of(way)
        axes = rows(frame_about(direction / size))
        return Shape(self.name, entry.body, entry.type, middle, axes, sizes, self._color(), self._opacity())

    def _axes(self) -> tuple[tuple[float, float, float], ...] | None:
        """Return the axes of the shape, rows of a rotation (3, 3) to the frame in which the entry is given; z is the
        axis of symmetry. None for a fault, which is reported."""
        entry, symmetry = self.entry, _AXES.get(self.entry.type)
        turned = read_orientation(self.key, entry.rotation, None, self.values)
        if entry.axis is None and symmetry is None:
            return turned
        if entry.axis is not None and symmetry is None:
            fault = f"{_noun(entry.type)} has no axis of symmetry [E1404]"
            self.report.add(f"{self.key}.axis", fault, "rotation = [{ axis = [0, 0, 1], angle = 0.5 }]")
            return None
        if entry.axis is not None and entry.rotation is not None:
            self.report.add(f"{self.key}.axis", "axis and rotation are both given [E1405]", "one of them")
            return None
        axis = np.array(symmetry) if entry.axis is None else self.values.axis(f"{self.key}.axis", entry.axis)
        return None if axis is None else rows(np.array(turned) @ frame_about(axis))

    def _sizes(self) -> tuple[Formula, ...]:
        """Return the sizes of the type, m, formulas of parameters, in the order of the type's keys; for a mesh one
        scale or three."""
        entry, values = self.entry, self.values
        if entry.type == "mesh":
            scale = entry.scale or (1.0,)
            if len(scale) not in (1, 3):
                fault = f"a mesh has one scale or three, not {len(scale)} [E1406]"
                self.report.add(f"{self.key}.scale", fault, "scale = 0.001")
            if len(scale) == 1:
                return (values.formula(f"{self.key}.scale", scale[0], PARAMETERS),)
            return tuple(values.formula(f"{self.key}.scale[{k}]", value, PARAMETERS) for k, value in enumerate(scale))
        sizes = values.keys(self.key, entry, *(word.partition("=")[0] for word in _KEYS[entry.type].split()))
        return tuple(part for size in sizes.values() for part in (size if isinstance(size, tuple) else (size,)))

    def _color(self) -> str:
        """Return the colour as ``#rrggbb``; empty for the colour of the body, and after a report for an unknown
        colour."""
        written = self.entry.color.strip()
        if not written or written.lower() in COLORS:
            return COLORS.get(written.lower(), "")
        if _HEXADECIMAL.fullmatch(written):
            digits = written[1:].lower()
            return "#" + (digits if len(digits) == 6 else "".join(2 * digit for digit in digits))
        hint = '"#3f7fdb"' if written.startswith("#") else f'{nearest(written.lower(), COLORS)}, or "#3f7fdb"'
        self.report.add(f"{self.key}.color", f"{shown(written)} is not a known colour [E1407]", hint)
        return ""

    def _opacity(self) -> float:
        opacity = self.entry.opacity
        if 0.0 < opacity <= 1.0:
            return opacity
        hint = f"{opacity / 100.0:.6g}" if 1.0 < opacity <= 100.0 else "1, or a part of 1 to see through it"
        self.report.add(f"{self.key}.opacity", f"the opacity is {opacity:.6g}, not above 0 and up to 1 [E1408]", hint)
        return 1.0

    def _read_mesh(self, shape: Shape) -> Shape | None:
        """Return a shape with the mesh of the file; for an optional mesh with a readable file, a shape that reads the
        mesh when drawn. None if the file cannot be read, which is reported or, for an optional mesh, noted in
        ``missing``."""
        path = mesh_path(self.reading.folder / str(self.entry.file))
        if not self.entry.required and is_readable(path):
            return replace(shape, unread=UnreadMesh(str(path.absolute()), self.most, with_mesh))
        try:
            return with_mesh(shape, str(path), self.most)
        except FileError as error:
            (fault,) = error.problems
            if not self.entry.required:
                self.missing = str(fault)
                return None
            self.report.add_problem(f"{self.key}.file", replace(fault, where=f"{fault.where} ({self.key}.file)"))
            return None


def _noun(kind: str) -> str:
    return f"an {kind}" if kind.startswith("e") else f"a {kind}"


class _Shapes(Section):
    def read(self, reading: Reading) -> Mapping[str, Any]:
        """Return the shapes by name, without faulty ones and optional meshes that cannot be read, which are noted.
        Rules for sizes stay out of the scene's requirements, since no run depends on them."""
        values = reading.reader()
        values.design = reading.values.design
        entries: Mapping[str, DrawnShape] = reading.document.section(self.key)
        meshes = sum(entry.type == "mesh" for entry in entries.values())
        most = min(MOST, 12_000 // max(meshes, 1))  # pages of animations are slow with more triangles
        readers = {name: _ShapeReader(name, entry, values, reading, most) for name, entry in entries.items()}
        read = {name: reader.shape() for name, reader in readers.items()}
        if missing := {name: reader.missing for name, reader in readers.items() if reader.missing}:
            first = next(iter(missing.values()))
            values.note([f"meshes left out of pictures ({len(missing)}: {listed(list(missing))}): {first} [W0280]"])
        reading.values.mentioned |= values.mentioned
        reading.values.note(values.notes)
        return {  # on a geometrically exact beam the nearest node carries a shape, which makes no nodes
            name: attach(shape, reading.attach, key_of(self.key, name, "position"))
            for name, shape in read.items()
            if shape is not None
        }


SHAPES = _Shapes(
    key="shapes",
    entry=DrawnShape,
    scene_field="shapes",
    after=("frames",),
    drawn=True,
    positional=("type", "body"),
    bounds={
        "position": None,
        "size": above_zero("a side of a box [E1734]"),
        "radius": above_zero("the radius of a shape [E1735]"),
        "length": above_zero("the length of a shape [E1736]"),
        "width": above_zero("the width of a wheel [E1737]"),
        "semi_axes": above_zero("a semi-axis of an ellipsoid [E1738]"),
        "scale": (is_zero, "the scale of a mesh is {0} [E1409]", "a number other than 0; a negative one mirrors"),
    },
    documentation="""
    Add a solid or a mesh by which pictures show a body, the base or the world; equations do not depend on it.

    Types and their sizes: box (``size``, three sides), cylinder and capsule (``radius``, ``length``), sphere
    (``radius``), wheel (``radius``, ``width``), ellipsoid (``semi_axes``), mesh (``file``, STL, OBJ, DAE or GLB, with
    ``scale``). A cylinder or a capsule between two points has ``first`` and ``second`` in place of its length.""",
)
