"""The scene that a file of another format becomes, while its parts are converted one after another."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.base.messages import is_legal, legal_name, listed
from eomgen.formula.words import RESERVED
from eomgen.lie.numeric import rotation_matrix
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.scene.inertia import Inertia
from eomgen.scene.reading.report import Report
from eomgen.scene.rotations import quaternion_of_matrix, rows
from eomgen.system.description import BASE, WORLD


@dataclass(frozen=True)
class LinkPlace:
    """The body in the scene that carries a frame of the file, by name, with orientation (3, 3) and position (3,), m, of
    this frame in the body."""

    body: str
    orientation: Array
    position: Array

    def of(self, position: Array, quaternion: Array | None = None) -> LinkPlace:
        """Return the place, in the same body, of a frame with this position (3,) and unit quaternion (w, x, y, z) in
        this one."""
        turned = self.orientation if quaternion is None else self.orientation @ rotation_matrix(np.array(quaternion))
        return LinkPlace(self.body, turned, self.orientation @ position + self.position)

    @property
    def pose(self) -> dict[str, Any]:
        """Position and orientation, as keys of a joint or a frame."""
        return {"position": self.position.tolist(), "orientation": [list(row) for row in rows(self.orientation)]}

    def end(self, *, turned: bool = True) -> dict[str, Any]:
        """Return body and position as an end of a constraint or a bushing, with the axes z and x if it is turned."""
        axes = {"axis": self.orientation[:, 2].tolist(), "x_axis": self.orientation[:, 0].tolist()}
        return {"body": self.body, "position": self.position.tolist(), **(axes if turned else {})}


def number(value: float) -> str:
    """Return a number as part of a formula: in brackets if it is negative."""
    text = repr(float(value))
    return f"({text})" if text.startswith("-") else text


_ENTRIES = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


def body_entry(inertia: Inertia) -> dict[str, Any]:
    """Return the entry of a body with the given mass properties."""
    tensor = [float(inertia.about_center[index]) for index in _ENTRIES.values()]
    return {"mass": inertia.mass, "center_of_mass": np.asarray(inertia.center).tolist(), "inertia": tensor}


def tunable_body(link: str, inertia: Inertia) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return ten tunable parameters with the mass properties of a link, and the entry of a body that names these
    parameters.

    The first result maps names of parameters to entries of the section ``parameters``: ``LINK_mass``, ``LINK_center_x``
    (and y, z), m in the link's frame, and ``LINK_inertia_xx`` (yy, zz, xy, xz, yz), kg m^2 about the centre of mass in
    the link's axes.
    """
    fixed = body_entry(inertia)
    values = {f"{link}_mass": (fixed["mass"], "kg")}
    values |= {f"{link}_center_{x}": (value, "m") for x, value in zip("xyz", fixed["center_of_mass"], strict=True)}
    values |= {f"{link}_inertia_{x}": (value, "kg m^2") for x, value in zip(_ENTRIES, fixed["inertia"], strict=True)}
    names = list(values)
    parameters = {name: {"value": value, "unit": unit, "tunable": True} for name, (value, unit) in values.items()}
    return parameters, {"mass": names[0], "center_of_mass": names[1:4], "inertia": names[4:]}


def turns_of(orientation: Array) -> list[dict[str, Any]]:
    """Return a rotation matrix (3, 3) as entries of a key ``rotation``: one axis and angle, rad, or an empty list for
    none."""
    w, *vector = quaternion_of_matrix(orientation.tolist())
    sine = float(np.linalg.norm(vector))
    return [{"axis": vector, "angle": 2.0 * float(np.arctan2(sine, w))}] if sine else []


@dataclass
class SceneDraft:
    """The scene file that another format becomes, filled part by part.

    Attributes
    ----------
    report : of problems that refuse the file
    data, lines : sections of the scene, and lines of the file by key, as of ``ConvertedScene``
    notes : on names, frames and starts
    warnings : places and texts of elements that are left out
    taken : names that are taken, by kind of element
    omitted : names of elements of which a property is left out, by the property
    included : whether the file is a part of a scene, in which the base may move
    kept : legal names of the file by kind, which no other element may take
    """

    report: Report
    data: dict[str, Any]
    lines: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    warnings: list[tuple[ElementPlace, str]] = field(default_factory=list)
    taken: dict[str, set[str]] = field(default_factory=dict)
    omitted: dict[str, list[str]] = field(default_factory=dict)
    included: bool = False
    kept: dict[str, set[str]] = field(default_factory=dict)

    def keep(self, kind: str, names: Iterable[str]) -> None:
        """Keep the legal names of a kind for the elements that have them in the file."""
        self.kept.setdefault(kind, set()).update(name for name in names if is_legal(name))

    def section(self, name: str) -> dict[str, Any]:
        """Return a section of the scene."""
        section: dict[str, Any] = self.data.setdefault(name, {})
        return section

    def name(self, kind: str, written: str, default: str, *, joined: bool = False) -> str:
        """Return a legal name that no other element of the kind (``body``, ``joint``, ...) has, and take the name.
        ``written`` is the name in the file, empty for an element without one, for which ``default`` is wanted; a change
        of ``written`` is noted. With ``joined`` the name is made of several names of the file, and leaves these names
        to their elements."""
        taken = self.taken.setdefault(kind, {BASE, WORLD} if kind == "body" else set(RESERVED))
        wanted = written or default
        if kind == "body" and wanted in (BASE, WORLD):
            wanted = f"{wanted}_body"
        kept = self.kept.get(kind, set())
        # a name that is made here, or made legal, leaves the names of the file to their elements
        owner = wanted == written and not joined
        name = legal_name(wanted, taken if owner or wanted not in kept else {*taken, wanted}, kept)
        taken.add(name)
        if written and name != written:
            self.notes.append(f"{kind} {written!r} of the file is called {name} [W0143]")
        return name

    def add(self, section: str, kind: str, wanted: str, entry: dict[str, Any]) -> str:
        """Add an entry to a section under the wanted name, changed if another element of the kind has this name; return
        the name."""
        name = self.name(kind, "", wanted)
        self.section(section)[name] = entry
        return name

    def put(self, section: str, name: str, entry: dict[str, Any], location: ElementPlace) -> None:
        """Add an entry with the place in the file to a section."""
        self.section(section)[name] = entry
        self.lines[f"{section}.{name}"] = str(location)

    def carry_mass(self, entry: dict[str, Any]) -> None:
        """Add a body ``base_links``, fixed to the base, with the mass properties of the links on the base. Only in an
        included file, whose base may move, and only for a mass other than 0; `entry` is the entry of the body."""
        if self.included and entry["mass"]:
            body = self.add("bodies", "body", "base_links", entry)
            self.add("joints", "joint", "base_links", {"type": "fixed", "parent": BASE, "child": body})

    def constrain(self, name: str, kind: str, ends: Sequence[LinkPlace]) -> dict[str, Any]:
        """Add a constraint of a type ``kind`` between two places in bodies, and return the entry; axes for all but
        spherical ones."""
        first, second = (end.end(turned=kind != "spherical") for end in ends)
        entry = self.section("constraints")[name] = {"type": kind, "first": first, "second": second}
        return entry

    def refuse(self, location: ElementPlace, key: str, fault: str, hint: str) -> None:
        """Report an element that would change the motion and cannot be converted."""
        self.report.add_place(location.file, location.line, key, fault, hint)

    def leave_out(self, location: ElementPlace, note: str) -> None:
        """Note an element that has no part in the scene."""
        self.warnings.append((location, note))

    def left_out(self, feature: str, name: str) -> None:
        """Note a property of an element that has no part in the scene; one note lists all elements."""
        self.omitted.setdefault(feature, []).append(name)

    def all_warnings(self) -> list[tuple[ElementPlace, str]]:
        """Return the place and the text of all omissions: single elements first, then one note for each property left
        out."""
        many = [
            (self.place_of(names[0]), f"not modelled: {feature} ({len(names)}: {listed(names)}) [W0197]")
            for feature, names in self.omitted.items()
        ]
        return [*self.warnings, *many]

    def place_of(self, name: str) -> ElementPlace:
        """Return file and line of a joint, constraint or body by name in the scene; the file's first line if
        unknown."""
        keys = (f"{section}.{name}" for section in ("joints", "constraints", "bodies"))
        location = next((self.lines[key] for key in keys if key in self.lines), f"{self.report.file}:1")
        file, _, line = location.rpartition(":")
        return ElementPlace(file, int(line))
