"""Schema of elastic beams: section, material, deformations, and the keys of geometrically exact beams and their
parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import Field

from eomgen.base.data import dataclass
from eomgen.scene.bodies import model as beam
from eomgen.scene.bodies.model import Ends, Normalisation, ShapeFunctions
from eomgen.scene.formula.scope import FIXED_PARAMETERS, PARAMETERS
from eomgen.scene.reading.key_metadata import Table, key, of_fixed_parameters, of_parameters, optional
from eomgen.scene.reading.kinds import Pair, Rotations, SixBySixValues, Triple, Value, Values

#: Elastic coordinates of one deformation: each is a state, and the time to build grows faster than the square of this
#: number.
MOST_MODES = 100
MOST_ELEMENTS = 400
#: Elements of a geometrically exact beam: each has six states and as many velocities.
MOST_EXACT_ELEMENTS = 10_000
_PROFILE = "polynomial in s, 0 to 1 along the beam, that multiplies"
_OF_MATRIX = {"names": PARAMETERS, "kind": "6x6 values of parameters"}
_OF_CENTER = {"unit": "m", "names": PARAMETERS, "kind": "2 values of parameters, m"}
_COEFFICIENTS = "list of values of fixed parameters, constant first"


class SectionEntry(Table):
    """Material and dimensions of a section, from which stiffnesses and masses follow."""

    elastic_modulus: Value = key("Young's modulus", unit="Pa", names=PARAMETERS)
    density: Value = key("density of the material", unit="kg/m^3", names=PARAMETERS)
    shape: Literal["rectangle", "circle", "tube", "ellipse"] | None = optional(
        "shape that gives area, second moments, torsion constant and, with `cosserat`, shear factors"
    )
    width: Value | None = of_parameters("width of a rectangle or an ellipse, along y", unit="m")
    height: Value | None = of_parameters("height of a rectangle or an ellipse, along z", unit="m")
    diameter: Value | None = of_parameters("diameter of a circle, or outer diameter of a tube", unit="m")
    thickness: Value | None = of_parameters("thickness of a tube's wall", unit="m")
    area: Value | None = of_parameters("area of the section", unit="m^2", shown_default="of the shape")
    second_moments: Pair | None = optional(
        "∫ y² dA, which resists `bending_y`, and ∫ z² dA, which resists `bending_z`",
        unit="m^4",
        names=PARAMETERS,
        kind="2 values of parameters, m⁴",
    )
    shear_modulus: Value | None = of_parameters("shear modulus, for torsion and for shear", unit="Pa")
    poisson_ratio: Value | None = of_parameters("Poisson's ratio, in place of the shear modulus, E/(2 (1 + ratio))")
    torsion_constant: Value | None = of_parameters(
        "torsion constant; the sum of the second moments only for a round section", unit="m^4"
    )
    shear_factors: Pair | None = optional(
        "`cosserat`: shear areas along y and z by the area; 5/6 for a rectangle, 0.9 for a circle",
        names=PARAMETERS,
        kind="2 values of parameters",
        shown_default="of the shape",
    )


def _coordinates(unit: str) -> Any:
    """Return the key of a quantity of the elastic coordinates."""
    return key("one value for each coordinate", (), unit=unit, names=FIXED_PARAMETERS, shown_default="zeros")


class ElasticInitial(Table):
    """Elastic coordinates of bending or stretch at the start."""

    position: Values = _coordinates("m")
    velocity: Values = _coordinates("m/s")


class TwistInitial(Table):
    """Elastic coordinates of torsion at the start."""

    position: Values = _coordinates("rad")
    velocity: Values = _coordinates("rad/s")


class ModeMass(Table):
    """A rigid mass on a beam that the modes of a mesh are found with."""

    at: Value = key("x in the beam's frame", unit="m", names=FIXED_PARAMETERS)
    mass: Value = key("moves with the deflection", 0.0, unit="kg", names=FIXED_PARAMETERS)
    inertia: Value = key("turns with the slope, or with the twist", 0.0, unit="kg m^2", names=FIXED_PARAMETERS)


class DeformationEntry(Table):
    """One way in which a beam deforms."""

    shapes: ShapeFunctions = key("family of the shape functions, see below", "clamped_free")
    modes: Annotated[int, Field(ge=1, le=MOST_MODES)] | None = optional(
        "number of elastic coordinates", kind=f"1 to {MOST_MODES}", shown_default="required, but for nodal coordinates"
    )
    ends: Ends | None = optional(
        "conditions at the ends, for `polynomial` and `finite_elements`", shown_default=f"`{beam.Deformation.ends}`"
    )
    elements: Annotated[int, Field(ge=1, le=MOST_ELEMENTS)] | None = optional(
        "number of elements of the mesh, for `finite_elements`: cubic in bending, quadratic in stretch and torsion",
        kind=f"1 to {MOST_ELEMENTS}",
        shown_default="required for `finite_elements`",
    )
    coordinates: Literal["modal", "nodal"] | None = optional(
        f"coordinates of `finite_elements`: lowest modes of the mesh, or all nodal displacements, up to {MOST_MODES}",
        shown_default="`modal`",
    )
    normalisation: Normalisation = key("normalisation of the shape functions, see below", "natural")
    profile: Values = key(f"{_PROFILE} the stiffness", (1.0,), names=FIXED_PARAMETERS, kind=_COEFFICIENTS)
    damping_ratio: Value = key("modal damping, a part of critical", 0.0, names=FIXED_PARAMETERS)
    stiffness_damping: Value = key("damping matrix by stiffness matrix", 0.0, unit="s", names=PARAMETERS)
    inertia_factor: Value = key("factor of the inertia of these coordinates among themselves", 1.0, names=PARAMETERS)
    masses: Annotated[tuple[ModeMass, ...], Field(strict=False)] = key(
        "added to the mesh for the modes of `finite_elements`; a body joined to the beam has the mass itself",
        (),
        shown_default="`[]`",
    )


class Bending(DeformationEntry):
    """Deflection across the beam, along its y or its z axis."""

    stiffness: Value | None = of_parameters("E times second moment", unit="N m^2", shown_default="of the section")
    initial: ElasticInitial = key("state at the start, in place of rest", ElasticInitial(), shown_default="zeros")


class Stretch(DeformationEntry):
    """Elongation along the beam."""

    stiffness: Value | None = of_parameters("elastic modulus times area", unit="N", shown_default="of the section")
    initial: ElasticInitial = key("state at the start, in place of rest", ElasticInitial(), shown_default="zeros")


class Torsion(DeformationEntry):
    """Twist about the beam's axis."""

    stiffness: Value | None = of_parameters("G times torsion constant", unit="N m^2", shown_default="of the section")
    initial: TwistInitial = key("state at the start, in place of rest", TwistInitial(), shown_default="zeros")


class SectionStiffness(Table):
    """Stiffness of the sections of a geometrically exact beam, by strain."""

    stretch: Value | None = of_parameters("EA", unit="N", shown_default="required, but for `inextensible`")
    shear_y: Value | None = of_parameters(
        "shear area along y times shear modulus", unit="N", shown_default="required for `cosserat`"
    )
    shear_z: Value | None = of_parameters("the same along z", unit="N", shown_default="required for `cosserat`")
    torsion: Value = key("GJ", unit="N m^2", names=PARAMETERS)
    bending_y: Value = key("EI, E ∫ y² dA, which resists deflection along y", unit="N m^2", names=PARAMETERS)
    bending_z: Value = key("E ∫ z² dA, which resists deflection along z", unit="N m^2", names=PARAMETERS)


class SectionDamping(Table):
    """Section force or moment by rate of strain, of a geometrically exact beam."""

    stretch: Value = key("axial force by rate of elongation", 0.0, unit="N s", names=PARAMETERS)
    shear_y: Value = key("shear force by rate of shear along y", 0.0, unit="N s", names=PARAMETERS)
    shear_z: Value = key("shear force by rate of shear along z", 0.0, unit="N s", names=PARAMETERS)
    torsion: Value = key("torque by rate of twist", 0.0, unit="N m^2 s", names=PARAMETERS)
    bending_y: Value = key("moment by rate of curvature, of deflection along y", 0.0, unit="N m^2 s", names=PARAMETERS)
    bending_z: Value = key("moment by rate of curvature, of deflection along z", 0.0, unit="N m^2 s", names=PARAMETERS)


class SectionStrain(Table):
    """Strains of the sections of a geometrically exact beam, by kind."""

    stretch: Value = key("elongation along x", 0.0, names=PARAMETERS)
    shear_y: Value = key("shear along y", 0.0, names=PARAMETERS)
    shear_z: Value = key("shear along z", 0.0, names=PARAMETERS)
    torsion: Value = key("twist per length", 0.0, unit="rad/m", names=PARAMETERS)
    bending_y: Value = key("curvature about z", 0.0, unit="rad/m", names=PARAMETERS)
    bending_z: Value = key("curvature about y", 0.0, unit="rad/m", names=PARAMETERS)


class BeamPart(Table):
    """A part of a geometrically exact beam; keys that it does not give are taken from the beam."""

    length: Value = key("undeformed", unit="m", names=FIXED_PARAMETERS)
    elements: Annotated[int, Field(ge=1, le=MOST_EXACT_ELEMENTS)] = key(
        "equal elements", kind=f"1 to {MOST_EXACT_ELEMENTS}"
    )
    section: SectionEntry | None = optional("shape and material", shown_default="the beam's")
    mass_per_length: Value | None = of_parameters("density times area", unit="kg/m", shown_default="the beam's")
    rotary_inertia: Triple | None = of_parameters(
        "density times second moments of area: polar, about y, about z", unit="kg m", shown_default="the beam's"
    )
    center_of_mass: Pair | None = optional("centre of mass of the sections", **_OF_CENTER, shown_default="the beam's")
    inertia_matrix: SixBySixValues | None = optional("section inertia", **_OF_MATRIX, shown_default="the beam's")
    stiffness: SectionStiffness | None = optional("section stiffness", shown_default="the beam's")
    stiffness_matrix: SixBySixValues | None = optional(
        "stiffness of all strains together", **_OF_MATRIX, shown_default="the beam's"
    )
    damping: SectionDamping | None = optional("section damping", shown_default="the beam's")
    stiffness_damping: Value | None = of_parameters("damping by stiffness", unit="s", shown_default="the beam's")
    curvature: Triple | None = of_fixed_parameters("initial curvature", unit="rad/m", shown_default="the beam's")
    prestrain: SectionStrain | None = optional("initial strains", shown_default="the beam's")


class ShapeFrame(Table):
    """A frame of a section on a beam's initial shape."""

    position: Triple = key("place of its origin, in the beam's frame", unit="m", names=FIXED_PARAMETERS)
    rotation: Rotations = key(
        "its axes in the axes of the beam's frame; x along the beam",
        (),
        kind="list of `axis`, `angle`",
        shown_default="`[]`",
    )


class BeamShape(Table):
    """An initial shape by places that a geometrically exact beam goes through."""

    points: tuple[Triple, ...] | None = optional(
        "places that the axis goes through, in the beam's frame, the first one its origin; it leaves along x",
        unit="m",
        names=FIXED_PARAMETERS,
        kind="list of 3 values of fixed parameters, m",
        strict=False,
    )
    frames: tuple[ShapeFrame, ...] | None = optional(
        "frames of sections, the first one the beam's frame; helices join them", strict=False
    )


class BeamEntry(Table):
    """An elastic beam along the x axis of its frame; a body to all that refers to bodies."""

    model: Literal["euler_bernoulli", "cosserat", "kirchhoff", "inextensible"] | None = optional(
        "shape functions for deflections that are small against the length; or geometrically exact, for any deflection:"
        " with shear and stretch, without shear, without both",
        shown_default="`euler_bernoulli`",
    )
    length: Value | None = of_fixed_parameters(
        "undeformed length", unit="m", shown_default="required; from `parts` or `shape` if given"
    )
    start: Value = key("x of its first end in its frame", 0.0, unit="m", names=FIXED_PARAMETERS)
    section: SectionEntry | None = optional("shape and material, in place of masses and stiffnesses")
    mass_per_length: Value | None = of_parameters("density times area", unit="kg/m", shown_default="of the section")
    polar_inertia: Value | None = of_parameters(
        "density times polar second moment of area; needed by torsion, and by joints that let the beam turn about its"
        " axis",
        unit="kg m",
        shown_default="of the section, else 0",
    )
    mass_profile: Values = key(f"{_PROFILE} the mass", (1.0,), names=FIXED_PARAMETERS, kind=_COEFFICIENTS)
    polar_profile: Values = key(f"{_PROFILE} the polar inertia", (1.0,), names=FIXED_PARAMETERS, kind=_COEFFICIENTS)
    order: Annotated[int, Field(ge=1, le=2)] = key(
        "1 keeps kinetic energy to second order in the elastic coordinates and their rates, 2 keeps all of it",
        1,
    )
    stiffening: bool = key("keep the shortening of the bent axis, which centrifugal stiffening comes from", True)
    bending_y: Bending | None = optional("deflection along y")
    bending_z: Bending | None = optional("deflection along z")
    stretch: Stretch | None = optional("elongation along x")
    torsion: Torsion | None = optional("twist about x")
    elements: Annotated[int, Field(ge=1, le=MOST_EXACT_ELEMENTS)] | None = optional(
        "exact: equal elements along the beam",
        kind=f"1 to {MOST_EXACT_ELEMENTS}",
        shown_default="required for exact beams, but with `parts`",
    )
    parts: Annotated[tuple[BeamPart, ...], Field(strict=False)] = key(
        "exact: parts of other sections or elements, one after the other, in place of `length` and `elements`",
        (),
        shown_default="none",
    )
    stiffness: SectionStiffness | None = optional("exact: section stiffness", shown_default="of the section")
    stiffness_matrix: SixBySixValues | None = optional(
        "exact: symmetric stiffness of all strains together, in place of `stiffness`: twist, bending about y"
        " and z (N m²), stretch, shear along y and z (N)",
        **_OF_MATRIX,
    )
    damping: SectionDamping | None = optional("exact: section damping", shown_default="zeros")
    stiffness_damping: Value | None = of_parameters("exact: damping by stiffness", unit="s", shown_default="`0`")
    rotary_inertia: Triple | None = of_parameters(
        "exact: density times second moments of area: polar, ρ ∫ z² dA about y, ρ ∫ y² dA about z",
        unit="kg m",
        shown_default="of the section",
    )
    center_of_mass: Pair | None = optional(
        "exact: centre of mass of the sections, y and z; `rotary_inertia` is about the axes through it",
        **_OF_CENTER,
        shown_default="`[0, 0]`",
    )
    inertia_matrix: SixBySixValues | None = optional(
        "exact: inertia of the sections about the beam's axis, in place of the two keys before and"
        " `mass_per_length`: rotary inertia (kg m), products of mass and centre of mass (kg), mass (kg/m)",
        **_OF_MATRIX,
    )
    curvature: Triple | None = of_fixed_parameters(
        "exact: curvature of the initial shape, in section axes: twist per length about x, then curvature"
        " about y and z; an arc or a helix",
        unit="rad/m",
        shown_default="`[0, 0, 0]`",
    )
    shape: BeamShape | None = optional("exact: the initial shape, in place of `curvature` and `length`")
    pretwist: Value | None = of_fixed_parameters(
        "exact: angle by which sections are turned about the axis of the initial shape, 0 at s = 0",
        unit="rad",
        shown_default="`0`",
    )
    prestrain: SectionStrain | None = optional("exact: strains of the initial shape", shown_default="zeros")
    group: Literal["SE3", "R3xSO3"] | None = optional(
        "exact: group of nodes, for [absolute coordinates](absolute_coordinates.md) only", shown_default="`SE3`"
    )


#: Keys of a part that take precedence over the beam's key.
_IN_PLACE_OF: Mapping[str, Sequence[str]] = {
    "stiffness": ("section", "stiffness_matrix"),
    "stiffness_matrix": ("section", "stiffness"),
    "mass_per_length": ("section", "inertia_matrix"),
    "rotary_inertia": ("section", "inertia_matrix"),
    "center_of_mass": ("section", "inertia_matrix"),
    "inertia_matrix": ("section", "mass_per_length", "rotary_inertia", "center_of_mass"),
}


@dataclass(frozen=True)
class BeamKeys:
    """Keys of a beam or of a part of a beam; ``self[field]`` is the value in the part, else in the beam, None if the
    part has a key that takes precedence.

    Attributes
    ----------
    key, part_key : dotted keys of beam and part
    entry, part : entries of beam and part; None for a beam without parts
    """

    key: str
    entry: BeamEntry
    part_key: str = ""
    part: BeamPart | None = None

    @property
    def model(self) -> str:
        return str(self.entry.model)

    def __getitem__(self, field: str) -> Any:
        if self._own(field):
            return getattr(self.part, field)
        hidden = any(self._own(field) for field in _IN_PLACE_OF.get(field, ()))
        return None if hidden else getattr(self.entry, field)

    def of(self, field: str) -> str:
        """Return the dotted key under which a key is written."""
        return f"{self.part_key if self._own(field) else self.key}.{field}"

    def together(self, first: str, second: str) -> bool:
        """Return whether two keys are written in one table."""
        return self._own(first) == self._own(second)

    def _own(self, field: str) -> bool:
        return self.part is not None and getattr(self.part, field) is not None
