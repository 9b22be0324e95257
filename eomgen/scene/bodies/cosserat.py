"""Geometrically exact beams: sections, and the bodies that are the nodes of their elements.

The inertia of each element is lumped at its two nodes: Hante, Tumiotto and Arnold, Multibody Syst. Dyn. 54 (2022) 97.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from eomgen.formula.nodes import ZERO, ZERO_VECTOR, Formula
from eomgen.scene.bodies.arithmetic import times
from eomgen.scene.bodies.model import Body

Rows = tuple[tuple[Formula, ...], ...]

#: Strains of a section in their order, by what resists them. A deflection along y is a rotation about z.
STRAINS = ("torsion", "bending_z", "bending_y", "stretch", "shear_y", "shear_z")
#: Models of geometrically exact beams, each with the strains that it does not have.
CONSTRAINED: Mapping[str, tuple[str, ...]] = {
    "cosserat": (),
    "kirchhoff": ("shear_y", "shear_z"),
    "inextensible": ("stretch", "shear_y", "shear_z"),
}
#: Numbers of an element: strain, mean load, load of its first and of its last section, 6 each, rotations and moments
#: first.
SECTION_ROW = 24
#: By kind of output: where its three numbers begin, at the first and at the last section.
SECTION_PARTS: Mapping[str, tuple[int, int]] = {
    "section_curvature": (0, 0),
    "section_strain": (3, 3),
    "section_moment": (12, 18),
    "section_force": (15, 21),
}


@dataclass(frozen=True)
class Cosserat:
    """A geometrically exact beam as it was read.

    Attributes
    ----------
    length : m, of the whole beam
    elements : number of equal elements
    mass_per_length : kg/m
    rotary_inertia : density times second moments of area, kg m: polar, about y and about z of the sections
    stiffness, damping : rows of 6, rotations first, section axes: GJ, EI about y and z (N m^2), EA and GA along y and
        z (N) on the diagonal, 0 for strains that it does not have; damping by rates of strain
    model : one of ``CONSTRAINED``
    curvature : of the beam at rest, (3,), 1/m, section axes: twist about x, then bending about y and z
    """

    name: str
    length: float
    elements: int
    mass_per_length: Formula
    rotary_inertia: tuple[Formula, Formula, Formula]
    stiffness: Rows
    damping: Rows
    model: str = "cosserat"
    curvature: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def spacing(self) -> float:
        """Length of an element at rest, m."""
        return self.length / self.elements

    @property
    def constrained(self) -> tuple[int, ...]:
        """Which of ``STRAINS`` the beam does not have."""
        return tuple(number for number, strain in enumerate(STRAINS) if strain in CONSTRAINED[self.model])

    @property
    def nodes(self) -> tuple[str, ...]:
        """Names of the nodes; no name of a scene has a dot in it."""
        return (self.name, *(f"{self.name}.{number}" for number in range(1, self.elements + 1)))

    def bodies(self) -> tuple[Body, ...]:
        """Return the nodes as bodies, each with the inertia of half of the elements that it joins."""
        found = []
        for number, name in enumerate(self.nodes):
            shared = 1 if number in (0, self.elements) else 2
            part = Fraction(self.length) * shared / (2 * self.elements)
            about = tuple(times(part, entry) for entry in self.rotary_inertia)
            inertia = (about[0], about[1], about[2], ZERO, ZERO, ZERO)
            found.append(Body(name, times(part, self.mass_per_length), ZERO_VECTOR, inertia, node_of=self.name))
        return tuple(found)
