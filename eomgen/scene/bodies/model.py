"""The base, the bodies and the Euler-Bernoulli beams of a Scene.

A beam has bending, stretch and torsion as requested. The beam lies along its frame's x axis, from x = ``start`` to x =
``start + length``; its joint carries its frame. A material point of the axis sits at (x + u - shortening, v, w), with
u, v, w sums of shape functions times elastic coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from eomgen.base.data import dataclass, field
from eomgen.base.rounding import WRITTEN
from eomgen.formula.nodes import ONE, ZERO, ZERO_VECTOR, Formula, Vector
from eomgen.scene.rotations import Rotation

DeformationKind = Literal["bending_y", "bending_z", "stretch", "torsion"]
Ends = Literal["clamped_free", "free_free", "pinned_pinned"]
ShapeFunctions = Literal["clamped_free", "free_free", "pinned_pinned", "polynomial", "finite_elements"]
Normalisation = Literal["natural", "mean_square", "unit"]

#: Order in which the elastic coordinates of a beam come.
KINDS: tuple[DeformationKind, ...] = ("bending_y", "bending_z", "stretch", "torsion")

#: Tolerance in parts of the length of a beam: places beyond an end by less than this count as at that end.
AT_END = WRITTEN

#: Nodal coordinates held at the ends; negative indices are counted from the last coordinate.
_FIXED_IN_BENDING: dict[Ends, tuple[int, ...]] = {"clamped_free": (0, 1), "free_free": (), "pinned_pinned": (0, -2)}
_FIXED: dict[Ends, tuple[int, ...]] = {"clamped_free": (0,), "free_free": (), "pinned_pinned": (0, -1)}


def free_nodal(kind: DeformationKind, ends: Ends, elements: int) -> list[int]:
    """Return the nodal coordinates of a mesh that the ends do not hold."""
    bending = kind.startswith("bending")
    size = 2 * elements + (2 if bending else 1)
    fixed = {dof % size for dof in (_FIXED_IN_BENDING if bending else _FIXED)[ends]}
    return [dof for dof in range(size) if dof not in fixed]


@dataclass(frozen=True)
class Deformation:
    """One family of elastic coordinates.

    Attributes
    ----------
    kind : ``bending_y`` deflects along the beam's y axis, ``bending_z`` along z, ``stretch`` along x, ``torsion`` turns
        about x
    shapes : family of the shape functions
    modes : number of elastic coordinates
    elements : of the mesh for ``finite_elements``, else 0
    ends : conditions at the ends for ``polynomial`` and ``finite_elements``: ``clamped_free``, ``free_free``,
        ``pinned_pinned``
    stiffness : EI of bending in this direction (N m^2), EA of stretch (N), GJ of torsion (N m^2); multiplied by a
        profile
    damping_ratio : modal damping, a part of critical; fixed
    stiffness_damping : D = this times K, s
    inertia_factor : factor of the mutual inertia of these coordinates; 1 unless published data require another factor
    initial_position, initial_velocity : one number per coordinate, empty for zeros
    nodal : coordinates are the nodal displacements of the mesh (m; slopes in rad), not modes
    normalisation : ``natural`` is the family's own; ``mean_square`` makes int f^2 = 1 over s = 0 .. 1; ``unit`` makes
        the
        deflection of a free second end 1, else the greatest one
    masses : (x, mass, inertia) added to the mesh for the computation of modes, x in m, factors of ``mass_per_length``
    (of ``polar_inertia`` for torsion) at the default; the beam's mass is unchanged
    """

    kind: DeformationKind
    shapes: ShapeFunctions
    modes: int
    stiffness: Formula
    elements: int = 0
    ends: Ends = "clamped_free"
    damping_ratio: float = 0.0
    stiffness_damping: Formula = ZERO
    inertia_factor: Formula = ONE
    initial_position: tuple[float, ...] = ()
    initial_velocity: tuple[float, ...] = ()
    nodal: bool = False
    normalisation: Normalisation = "natural"
    masses: tuple[tuple[float, float, float], ...] = ()

    @property
    def free_nodal(self) -> list[int]:
        """Indices of the nodal coordinates of a mesh that conditions at the ends leave free; for bending, deflections
        and slopes alternate."""
        return free_nodal(self.kind, self.ends, self.elements)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the elastic coordinates."""
        if self.nodal and self.kind.startswith("bending"):
            return tuple("rad" if dof % 2 else "m" for dof in self.free_nodal)
        return ("rad" if self.kind == "torsion" else "m",) * self.modes


@dataclass(frozen=True)
class Beam:
    """The elastic part of a body; the body's mass, centre and inertia are the undeformed beam's.

    Attributes
    ----------
    start, length : m, fixed
    mass_per_length : rho A, kg/m; multiplied by a profile
    polar_inertia : rho I_p of the sections about the axis, kg m
    profiles : of ``mass``, ``bending_y``, ``bending_z``, ``stretch``, ``torsion`` and ``polar``: coefficients, constant
        first, of a polynomial in s = (x - start) / length that multiplies the property along the beam; absent: 1
    deformations : at most one of each kind, in the order of ``KINDS``
    order : 1 keeps the kinetic energy to second order in elastic coordinates and their rates, so that the equations of
        these coordinates are linear; 2 keeps all terms of the kinematics
    stiffening : whether the shortening of the bent axis is kept, which centrifugal stiffening comes from
    """

    start: float
    length: float
    mass_per_length: Formula
    deformations: tuple[Deformation, ...]
    polar_inertia: Formula = ZERO
    profiles: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    order: Literal[1, 2] = 1
    stiffening: bool = True

    @property
    def size(self) -> int:
        """Number of elastic coordinates."""
        return sum(item.modes for item in self.deformations)

    def nearest(self, x: float) -> float:
        """Return the place on the beam that is nearest to x."""
        return min(max(x, self.start), self.start + self.length)

    def is_beyond(self, x: float) -> bool:
        """Return whether x lies beyond an end of the beam by more than the tolerance."""
        return abs(x - self.nearest(x)) > AT_END * self.length


@dataclass(frozen=True)
class Base:
    """Prescribed motion of the base: position in world axes and intrinsic rotations, formulas of t and parameters.

    ``added_by``: keys of products that make the leading rotations, one for each; further rotations are written as such.
    ``integrals``: sentences on the accelerations whose integrals are parts of the position, by axis.
    """

    position: Vector = ZERO_VECTOR
    rotations: tuple[Rotation, ...] = ()
    added_by: tuple[str, ...] = ()
    integrals: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Body:
    """A body. Inertia (xx, yy, zz, xy, xz, yz) about the centre of mass, body axes; products as tensor entries.

    ``beam``: the elastic part, None for a rigid body; mass, centre of mass and inertia are then the undeformed beam's.
    ``node_of``: the geometrically exact beam of which the body is a node.
    """

    name: str
    mass: Formula
    center_of_mass: Vector
    inertia: tuple[Formula, Formula, Formula, Formula, Formula, Formula]
    beam: Beam | None = None
    node_of: str = ""
