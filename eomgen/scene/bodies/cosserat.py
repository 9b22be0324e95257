"""Geometrically exact beams: elements with their sections, and the bodies that are the nodes of these elements.

The inertia of each element is lumped at its two nodes: Hante, Tumiotto and Arnold, Multibody Syst. Dyn. 54 (2022) 97.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property, reduce
from itertools import accumulate

from eomgen.base.data import dataclass, replace
from eomgen.formula.nodes import ZERO, Formula
from eomgen.formula.substitution import fold, times, total
from eomgen.scene.bodies.model import Body

Rows = tuple[tuple[Formula, ...], ...]

#: Strains of a section in order, named by the stiffness against the strain. Deflection along y is rotation about z.
STRAINS = ("torsion", "bending_z", "bending_y", "stretch", "shear_y", "shear_z")
#: Models of geometrically exact beams, each with the strains that are zero in the model.
CONSTRAINED: Mapping[str, tuple[str, ...]] = {
    "cosserat": (),
    "kirchhoff": ("shear_y", "shear_z"),
    "inextensible": ("stretch", "shear_y", "shear_z"),
}
#: By kind of output: index of the first of three numbers at the first and at the last section.
SECTION_PARTS: Mapping[str, tuple[int, int]] = {
    "section_curvature": (0, 0),
    "section_strain": (3, 3),
    "section_moment": (24, 30),
    "section_force": (27, 33),
}
#: Numbers of an element: strain, mean load, wrenches on both nodes, loads of the first and the last section, 6 each,
#: rotations and moments first.
SECTION_ROW = max(last for _, last in SECTION_PARTS.values()) + 3


@dataclass(frozen=True)
class BeamSection:
    """Stiffness, damping and mass of the sections of an element.

    Attributes
    ----------
    mass_per_length : kg/m
    rotary_inertia : density times second moments of area, kg m: polar, about y and about z of the sections
    center_of_mass : m, along y and z of the sections; ``rotary_inertia`` and ``products`` are about this centre
    products : of inertia per length, kg m, as entries xy, xz and yz of the tensor
    stiffness, damping : rows of 6, rotations first, section axes: GJ, EI about y and z (N m^2), EA and GA along y and z
        (N) on the diagonal, 0 for strains without stiffness; damping by rates of strain
    prestrain : (6,), strains in the initial shape, 1/m for rotations
    """

    mass_per_length: Formula
    rotary_inertia: tuple[Formula, Formula, Formula]
    stiffness: Rows
    damping: Rows
    prestrain: tuple[Formula, ...] = (ZERO,) * 6
    center_of_mass: tuple[Formula, Formula] = (ZERO, ZERO)
    products: tuple[Formula, Formula, Formula] = (ZERO,) * 3


@dataclass(frozen=True)
class SectionMoments:
    """Compliance C of sections that vary within an element, and C D C of their damping D: each the mean over the
    element and the means of products with the distance from the middle, m, and with its square.

    Rows of 6 as of stiffnesses, zeros for strains that the beam does not have.
    """

    compliance: tuple[Rows, Rows, Rows]
    dissipation: tuple[Rows, Rows, Rows]


@dataclass(frozen=True)
class BeamElement:
    """A part of a beam between two nodes.

    Attributes
    ----------
    length : m
    section : in the middle, with the mean prestrain
    twist : logarithm of the pose of the second node in the first, (6,), in the initial shape; rotations first
    halves : sections with the mean inertia of both halves; empty if all sections are alike
    moments : None if all sections have the stiffness and the damping of the middle
    """

    length: Fraction
    section: BeamSection
    twist: tuple[float, ...]
    halves: tuple[BeamSection, ...] = ()
    moments: SectionMoments | None = None

    def half(self, end: int) -> BeamSection:
        """Return a section with the inertia of the first (0) or of the second half (1)."""
        return self.halves[end] if self.halves else self.section


@dataclass(frozen=True)
class Cosserat:
    """A geometrically exact beam as read: elements along the axis, and model, one of ``CONSTRAINED``."""

    name: str
    parts: tuple[BeamElement, ...]
    model: str = "cosserat"

    @property
    def elements(self) -> int:
        """Number of elements."""
        return len(self.parts)

    @cached_property
    def places(self) -> tuple[float, ...]:
        """Place of each node along the axis in the initial shape, m."""
        return tuple(float(x) for x in accumulate((part.length for part in self.parts), initial=Fraction(0)))

    @property
    def length(self) -> float:
        """Length of the beam in the initial shape, m."""
        return self.places[-1]

    @property
    def absent_strains(self) -> tuple[int, ...]:
        """Which of ``STRAINS`` the beam does not have."""
        return tuple(number for number, strain in enumerate(STRAINS) if strain in CONSTRAINED[self.model])

    @cached_property
    def nodes(self) -> tuple[str, ...]:
        """Names of the nodes; contain a dot, unlike all other names of a scene."""
        return (self.name, *(f"{self.name}.{number}" for number in range(1, self.elements + 1)))

    def bodies(self) -> tuple[Body, ...]:
        """Return the nodes as bodies in order, each with the inertia of the adjacent half of each adjacent element, in
        the axes of the node's section."""
        made: dict[tuple[tuple[Fraction, int], ...], Body] = {}
        result = []
        for number, name in enumerate(self.nodes):
            beside = [(part, part.half(1)) for part in self.parts[max(number - 1, 0) : number]]
            beside += [(part, part.half(0)) for part in self.parts[number : number + 1]]
            alike = tuple((part.length, id(section)) for part, section in beside)
            if alike not in made:
                made[alike] = _node(name, [(part.length / 2, section) for part, section in beside], self.name)
            result.append(replace(made[alike], name=name))
        return tuple(result)


def _node(name: str, beside: list[tuple[Fraction, BeamSection]], beam: str) -> Body:
    """Return the body ``name``, a node of ``beam``, with the inertia of one or two lengths, m, each with a section;
    inertia is about the common centre of mass."""
    mass = _sum([(length, section.mass_per_length) for length, section in beside])
    xx, yy, zz, xy, xz, yz = (
        _sum([(length, (*section.rotary_inertia, *section.products)[entry]) for length, section in beside])
        for entry in range(6)
    )
    y, z = beside[0][1].center_of_mass
    if beside[-1][1].center_of_mass != (y, z):
        masses = [times(length, section.mass_per_length) for length, section in beside]
        others = beside[-1][1].center_of_mass
        reduced = fold(masses[0] * masses[1] / mass)
        off_y, off_z = (fold(a - b) for a, b in zip((y, z), others, strict=True))
        y, z = (fold((masses[0] * a + masses[1] * b) / mass) for a, b in zip((y, z), others, strict=True))
        xx = fold(xx + reduced * (off_y * off_y + off_z * off_z))
        yy, zz = fold(yy + reduced * off_z * off_z), fold(zz + reduced * off_y * off_y)
        yz = fold(yz - reduced * off_y * off_z)
    return Body(name, mass, (ZERO, y, z), (xx, yy, zz, xy, xz, yz), node_of=beam)


def _sum(terms: list[tuple[Fraction, Formula]]) -> Formula:
    """Return a sum of numbers times formulas, with equal formulas collected."""
    if all(formula == terms[0][1] for _, formula in terms):
        return times(sum((factor for factor, _ in terms), Fraction(0)), terms[0][1])
    return reduce(total, (times(factor, formula) for factor, formula in terms))
