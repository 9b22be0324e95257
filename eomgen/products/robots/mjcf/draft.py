"""The scene that an MJCF file becomes, while its parts are converted one after another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.products.robots.mjcf.compiled import MjcfElements
from eomgen.products.robots.scene_draft import LinkPlace, SceneDraft, number

#: Flags of parts that MuJoCo solves as constraints, which the flag ``constraint`` switches off together.
_CONSTRAINTS = ("CONTACT", "EQUALITY", "FRICTIONLOSS", "LIMIT")


def times(factor: float, term: str) -> str:
    """Return the product of a number and a term, which is a name, a number or in brackets."""
    return term if factor == 1.0 else f"{number(factor)} * {term}"


def total(terms: Sequence[str]) -> str:
    """Return the sum of terms in brackets, 0.0 of none."""
    return f"({' + '.join(terms)})" if len(terms) > 1 else terms[0] if terms else "0.0"


def dot(first: Sequence[str], second: Sequence[str]) -> str:
    """Return the formula of the scalar product of two vectors, whose components are terms."""
    return total([f"{a} * {b}" for a, b in zip(first, second, strict=True)])


def cross(first: Sequence[str], second: Sequence[str]) -> list[str]:
    """Return formulas of the components of the vector product of two vectors, whose components (3 each) are terms."""
    return [f"({first[i]} * {second[j]} - {first[j]} * {second[i]})" for i, j in ((1, 2), (2, 0), (0, 1))]


def clip(term: str, low: float, high: float) -> str:
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
class MjcfDraft(SceneDraft):
    """The scene that an MJCF file becomes, filled part by part, with MuJoCo's compiled model.

    Attributes
    ----------
    mujoco : the package
    model : the compiled ``mujoco.MjModel``
    elements : of the file and the included files
    folder : of the file, to which paths of meshes are relative; None for a text
    places, joints, tendons : places of bodies, names of joints, and names of the definitions of lengths of tendons, by
        number in the compiled model
    qpos, qvel : MuJoCo's coordinates and velocities at the start
    key : number of the keyframe at the start; -1 for none
    moving_targets : whether motions from outside move mocap bodies
    tendon_joints : joints of fixed tendons with their coefficients
    points : names of the points at sites
    frame_origins : names of the points at frames, by wanted name, body and position
    actuator_forces, actuator_motions : formulas of the forces of actuators, and of their lengths and rates
    efforts : terms of the efforts of actuators on hinges and slides, by joint
    branches : of spatial tendons: names in the scene, and the divisors of their lengths
    pulls : of spatial tendons: formulas of tensions from springs, dampers and actuators
    """

    mujoco: Any = None
    model: Any = None
    elements: MjcfElements = field(default_factory=MjcfElements)
    folder: Path | None = None
    places: dict[int, LinkPlace] = field(default_factory=dict)
    joints: dict[int, str] = field(default_factory=dict)
    tendons: dict[int, str] = field(default_factory=dict)
    qpos: Array = field(default_factory=lambda: np.zeros(0))
    qvel: Array = field(default_factory=lambda: np.zeros(0))
    key: int = -1
    moving_targets: bool = False
    tendon_joints: dict[int, list[tuple[int, float]]] = field(default_factory=dict)
    points: dict[int, str] = field(default_factory=dict)
    frame_origins: dict[tuple[Any, ...], str] = field(default_factory=dict)
    actuator_forces: dict[int, str] = field(default_factory=dict)
    actuator_motions: dict[int, tuple[str, str]] = field(default_factory=dict)
    efforts: dict[int, list[str]] = field(default_factory=dict)
    branches: dict[int, list[tuple[str, float]]] = field(default_factory=dict)
    pulls: dict[int, list[str]] = field(default_factory=dict)

    def element_name(self, kind: str, index: int) -> str:
        """Return the name of an element in the file; empty without one."""
        kinds = self.mujoco.mjtObj
        return self.mujoco.mj_id2name(self.model, getattr(kinds, f"mjOBJ_{kind.upper()}"), index) or ""

    def define(self, wanted: str, formula: str) -> str:
        """Return the name of a definition, which is added."""
        return self.add("definitions", "signal", wanted, {"formula": formula})

    def define_each(self, wanted: str, formulas: Sequence[str], letters: str = "xyz") -> list[str]:
        """Return the names of the components of a vector or a quaternion, which are added as definitions."""
        return [self.define(f"{wanted}_{x}", formula) for x, formula in zip(letters, formulas, strict=True)]

    def point(self, name: str, placement: LinkPlace) -> str:
        """Return the name of a point at the origin of a frame, which is added once for each wanted name and place:
        a site ``a_x``, and the point along x from a site ``a``, want the same name."""
        key = name, placement.body, *placement.position.tolist()
        if key not in self.frame_origins:
            self.frame_origins[key] = self.add_point(name, placement)
        return self.frame_origins[key]

    def add_point(self, name: str, placement: LinkPlace) -> str:
        """Return the name of a point at the origin of a frame, which is added."""
        return self.add("points", "point", name, {"body": placement.body, "position": placement.position.tolist()})

    def frame_points(self, name: str, placement: LinkPlace) -> tuple[str, list[str]]:
        """Return the name of a point at the origin of the frame at ``placement``, and the names of three points 1 m
        along the axes; all are added to the scene, under names that begin with ``name``."""
        ends = [
            self.point(f"{name}_{axis}", LinkPlace(placement.body, placement.orientation, placement.position + column))
            for axis, column in zip("xyz", placement.orientation.T, strict=True)
        ]
        return self.point(name, placement), ends

    def along(self, start: str, end: str) -> list[str]:
        """Return the components of the vector from a point to another, in world axes."""
        return [f"(position.{end}[{i}] - position.{start}[{i}])" for i in range(3)]

    def place(self, kind: str, index: int, count: int) -> ElementPlace:
        """Return file and line of an element."""
        return self.elements.place(kind, self.element_name(kind, index), index, count, self.report.file)

    def sum_of(self, word: str, terms: Sequence[str]) -> str:
        """Return the formula of the sum of any number of terms; more than 20 are summed in definitions, which are added
        under names that begin with ``word``."""
        parts = [total(terms[k : k + 20]) for k in range(0, len(terms), 20)]
        return parts[0] if len(parts) == 1 else total([self.define(f"{word}_of_part", part) for part in parts])

    def is_disabled(self, flag: str) -> bool:
        """Return whether the file switches a part of the physics off; ``flag`` is the name of a bit of
        ``mjtDisableBit`` without prefix. Contact, equalities, dry friction and limits are off with all constraints,
        too."""
        flags = (flag, "CONSTRAINT") if flag in _CONSTRAINTS else (flag,)
        bits = self.mujoco.mjtDisableBit
        return any(self.model.opt.disableflags & getattr(bits, f"mjDSBL_{name}") for name in flags)

    @property
    def without_passive_forces(self) -> bool:
        """Whether there are no passive forces at all: as in MuJoCo if springs and dampers are both off."""
        return self.is_disabled("SPRING") and self.is_disabled("DAMPER")
