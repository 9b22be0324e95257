"""The scene that an MJCF file becomes, while its parts are converted one after another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.base.messages import listed
from eomgen.formula.words import RESERVED
from eomgen.lie.numeric import rotation_matrix
from eomgen.scene.reading.report import Report
from eomgen.scene.rotations import rows, snapped_rotation
from eomgen.scene.sources.mjcf.compiled import Elements, Place
from eomgen.scene.sources.urdf.reading import legal_name
from eomgen.system.description import BASE, WORLD


@dataclass(frozen=True)
class LinkPlace:
    """Body of the scene that carries a frame of the file, and the pose of this frame in the body."""

    body: str
    orientation: Array
    position: Array

    def of(self, position: Array, quaternion: Array | None = None) -> LinkPlace:
        """Return the pose in the body of a frame that is given in this one."""
        turned = self.orientation if quaternion is None else self.orientation @ rotation_matrix(np.array(quaternion))
        return LinkPlace(self.body, turned, self.orientation @ position + self.position)

    @property
    def entry(self) -> dict[str, Any]:
        """Body, position and orientation, as keys of a scene."""
        return {"body": self.body, "position": self.position.tolist(), "orientation": matrix(self.orientation)}


def matrix(orientation: Array) -> list[list[float]]:
    """Return an orientation as the key of a scene."""
    return [list(row) for row in rows(snapped_rotation(orientation))]


def number(value: float) -> str:
    """Return a number as part of a formula: in brackets if it is negative."""
    text = repr(float(value))
    return f"({text})" if text.startswith("-") else text


def times(factor: float, term: str) -> str:
    """Return the product of a number and a term, which is a name, a number or in brackets."""
    return term if factor == 1.0 else f"{number(factor)} * {term}"


def total(terms: Sequence[str]) -> str:
    """Return the sum of terms in brackets, 0.0 of none."""
    return f"({' + '.join(terms)})" if len(terms) > 1 else terms[0] if terms else "0.0"


def clipped(term: str, low: float, high: float) -> str:
    """Return a term within a range."""
    return f"max({number(low)}, min({number(high)}, {term}))"


def polynomial(variable: str, coefficients: Sequence[float], power: Callable[[str, int], str]) -> str:
    """Return the sum of coefficients times powers of a variable, from the power 1 on."""
    return total([times(c, power(variable, k)) for k, c in enumerate(coefficients, 1) if c != 0.0])


def plain_power(variable: str, exponent: int) -> str:
    """Return a power."""
    return variable if exponent == 1 else f"{variable}**{exponent}"


def odd_power(variable: str, exponent: int) -> str:
    """Return a power with the sign of the variable."""
    return plain_power(variable, exponent) if exponent % 2 else f"{variable} * abs({variable})**{exponent - 1}"


@dataclass
class Draft:
    """The scene so far.

    Attributes
    ----------
    model : the compiled ``mujoco.MjModel``
    data, lines : of the scene, as of ``ConvertedScene``
    notes : on names, frames and starts
    warnings : places and words of omissions
    taken : names that are taken, by kind
    places, joints, tendons : places of bodies, names of joints, and the definitions of the lengths of tendons,
        by number in the compiled model
    qpos, qvel : MuJoCo's coordinates and velocities at the start
    key : number of the keyframe at the start; -1 for none
    tendon_joints : joints of fixed tendons with their coefficients
    points : names of the points at sites
    frame_origins : names of the points at frames, by the wanted names
    actuator_forces : formulas of the forces of actuators
    branches : of spatial tendons: names in the scene, and the divisors of their lengths
    pulls : of spatial tendons: formulas of actuators that pull the ends together
    omitted : names of elements of which a property is left out, by the property
    """

    mujoco: Any
    model: Any
    report: Report
    elements: Elements
    data: dict[str, Any]
    lines: dict[str, int | str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    warnings: list[tuple[Place, str]] = field(default_factory=list)
    taken: dict[str, set[str]] = field(default_factory=dict)
    places: dict[int, LinkPlace] = field(default_factory=dict)
    joints: dict[int, str] = field(default_factory=dict)
    tendons: dict[int, str] = field(default_factory=dict)
    qpos: Array = field(default_factory=lambda: np.zeros(0))
    qvel: Array = field(default_factory=lambda: np.zeros(0))
    key: int = -1
    tendon_joints: dict[int, list[tuple[int, float]]] = field(default_factory=dict)
    points: dict[int, str] = field(default_factory=dict)
    frame_origins: dict[str, str] = field(default_factory=dict)
    actuator_forces: dict[int, str] = field(default_factory=dict)
    branches: dict[int, list[tuple[str, float]]] = field(default_factory=dict)
    pulls: dict[int, list[str]] = field(default_factory=dict)
    omitted: dict[str, list[str]] = field(default_factory=dict)

    def section(self, name: str) -> dict[str, Any]:
        """Return a section of the scene."""
        section: dict[str, Any] = self.data.setdefault(name, {})
        return section

    def written(self, kind: str, index: int) -> str:
        """Return the name of an element in the file; empty without one."""
        kinds = self.mujoco.mjtObj
        return self.mujoco.mj_id2name(self.model, getattr(kinds, f"mjOBJ_{kind.upper()}"), index) or ""

    def name(self, kind: str, written: str, default: str) -> str:
        """Return a legal name that no other element of the kind has, and take it."""
        taken = self.taken.setdefault(kind, {BASE, WORLD} if kind == "body" else set(RESERVED))
        wanted = written or default
        if kind == "body" and wanted in (BASE, WORLD):
            wanted = f"{wanted}_body"
        name = legal_name(wanted, taken)
        taken.add(name)
        if written and name != written:
            self.notes.append(f"{kind} {written!r} of the file is called {name}")
        return name

    def point(self, wanted: str, place: LinkPlace) -> str:
        """Return the name of a point at the origin of a frame, which is added once for each wanted name."""
        if wanted not in self.frame_origins:
            name = self.name("point", "", wanted)
            self.section("points")[name] = {"body": place.body, "position": place.position.tolist()}
            self.frame_origins[wanted] = name
        return self.frame_origins[wanted]

    def frame_points(self, wanted: str, place: LinkPlace) -> tuple[str, list[str]]:
        """Return the names of points at the origin of a frame, and 1 m along its axes."""
        ends = [
            self.point(f"{wanted}_{axis}", LinkPlace(place.body, place.orientation, place.position + column))
            for axis, column in zip("xyz", place.orientation.T, strict=True)
        ]
        return self.point(wanted, place), ends

    def along(self, start: str, end: str) -> list[str]:
        """Return the components of the vector from a point to another, in world axes."""
        return [f"(position.{end}[{i}] - position.{start}[{i}])" for i in range(3)]

    def place(self, kind: str, index: int, count: int) -> Place:
        """Return file and line of an element."""
        return self.elements.place(kind, self.written(kind, index), index, count, self.report.file)

    def refuse(self, place: Place, key: str, fault: str, hint: str) -> None:
        """Report an element that would change the motion and cannot be converted."""
        self.report.add_place(place.file, place.line, key, fault, hint)

    def leave_out(self, place: Place, note: str) -> None:
        """Note an element that has no part in the scene."""
        self.warnings.append((place, note))

    def left_out(self, feature: str, name: str) -> None:
        """Note a property of an element that has no part in the scene; one note lists all elements."""
        self.omitted.setdefault(feature, []).append(name)

    def all_warnings(self) -> list[tuple[Place, str]]:
        """Return a place and a note for all that is left out."""
        start = Place(self.report.file, 1)
        many = [
            (start, f"not modelled: {feature} ({len(names)}: {listed(names)})")
            for feature, names in self.omitted.items()
        ]
        return [*self.warnings, *many]

    def disabled(self, flag: str) -> bool:
        """Return whether the file switches a part of the physics off."""
        return bool(self.model.opt.disableflags & getattr(self.mujoco.mjtDisableBit, f"mjDSBL_{flag}"))
