"""Geometrically exact beams: elements with their sections, and the bodies that are the nodes of these elements.

The inertia of each element is lumped at its two nodes: Hante, Tumiotto and Arnold, Multibody Syst. Dyn. 54 (2022) 97.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, reduce
from itertools import accumulate

from eomgen.formula.nodes import ZERO, ZERO_VECTOR, Formula
from eomgen.scene.bodies.arithmetic import times, total
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
class BeamSection:
    """What the sections of an element resist with, and what they weigh.

    Attributes
    ----------
    mass_per_length : kg/m
    rotary_inertia : density times second moments of area, kg m: polar, about y and about z of the sections
    stiffness, damping : rows of 6, rotations first, section axes: GJ, EI about y and z (N m^2), EA and GA along y and
        z (N) on the diagonal, 0 for strains that it does not have; damping by rates of strain
    prestrain : (6,), strains in the initial shape, 1/m for rotations
    """

    mass_per_length: Formula
    rotary_inertia: tuple[Formula, Formula, Formula]
    stiffness: Rows
    damping: Rows
    prestrain: tuple[Formula, ...] = (ZERO,) * 6


@dataclass(frozen=True)
class BeamElement:
    """A part of a beam between two nodes.

    Attributes
    ----------
    length : m
    twist : logarithm of the pose of the second node in the first, (6,), in the initial shape; rotations first
    """

    length: Fraction
    section: BeamSection
    twist: tuple[float, ...]


@dataclass(frozen=True)
class Cosserat:
    """A geometrically exact beam as it was read: its elements along the axis, and its model, one of ``CONSTRAINED``."""

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
            beside = self.parts[max(number - 1, 0) : number + 1]
            mass, *about = (
                _sum(
                    [
                        (part.length / 2, (part.section.mass_per_length, *part.section.rotary_inertia)[k])
                        for part in beside
                    ]
                )
                for k in range(4)
            )
            inertia = (about[0], about[1], about[2], ZERO, ZERO, ZERO)
            found.append(Body(name, mass, ZERO_VECTOR, inertia, node_of=self.name))
        return tuple(found)


def _sum(terms: list[tuple[Fraction, Formula]]) -> Formula:
    """Return a sum of numbers times formulas, of which equal ones are taken together."""
    if all(formula == terms[0][1] for _, formula in terms):
        return times(sum((factor for factor, _ in terms), Fraction(0)), terms[0][1])
    return reduce(total, (times(factor, formula) for factor, formula in terms))
