"""Constrained strains of geometrically exact beams, as loops over the elements: equations and transmitted forces.

A row is a component of d - d_0 in m, d = log(H_A^-1 H_B), so that its multiplier is the section force there: Hante,
Tumiotto and Arnold, Multibody Syst. Dyn. 54 (2022) 97, section 3. Forces B^T lam are recorded as forces of a section
that has lam in place of the elasticity, once for all elements, so that their partials are a loop too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from eomgen.mechanics.constraints.rows import ConstraintRow, ConstraintRows
from eomgen.mechanics.forces.cosserat_beams import Chain, ElementStrain
from eomgen.mechanics.forces.frame_pairs import magnitude
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.fields import Wrench
from eomgen.scene.bodies.cosserat import STRAINS, Cosserat
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.symbolic.scalar import Scalar

#: Returns the generalized forces, (nv,), of a wrench for each link, None for links without one; takes a label, too.
Generalized = Callable[[Sequence[Wrench | None], str], list[Scalar]]


class ConstrainedStrains:
    """The constraint equations of one geometrically exact beam with constrained strains, and the forces of these
    equations. Equations are ordered by element, then by the strains of ``beam.absent_strains``; ``count`` is their
    number. ``generalized`` maps a wrench for each link, and a label, to generalized forces, (nv,)."""

    def __init__(self, quantities: Quantities, beam: Cosserat, generalized: Generalized) -> None:
        self.beam, self.generalized = beam, generalized
        self.links, self.count = len(quantities.tree.links), beam.elements * len(beam.absent_strains)
        self.elements = Chain.of(quantities, beam)

    def rows(self) -> list[ConstraintRow]:
        """Return one holonomic equation, d - d_0 = 0 in m, for each constrained strain of each element, in this order.
        The values of all elements are recorded as one loop. Each equation has this object as ``group``."""
        beam = self.beam

        def gaps(element: ElementStrain) -> list[Scalar]:
            return [element.gap(strain) for strain in beam.absent_strains]

        values = self.elements.each(gaps, f"constrained strains of beam {beam.name}")
        result: list[ConstraintRow] = []
        for number, (gap, (first, second)) in enumerate(zip(values, self.elements.pairs, strict=True), 1):
            places = [magnitude(part) for node in (first, second) for part in self.elements.nodes[node].origin]
            length = self.elements.sections[first].length
            size = sum(places, length)
            for strain, value in zip(beam.absent_strains, gap, strict=True):
                strain_name = STRAINS[strain].replace("_", " along ")
                name = f"{beam.name}: no {strain_name} of element {number}"
                result.append(ConstraintRow(name, value, "m", size, length, length, group=self, in_group=len(result)))
        return result

    def forces(self, multipliers: Sequence[Scalar]) -> list[Scalar]:
        """Return the beam's part of the generalized constraint forces B^T lam, (nv,), recorded as one loop.

        Parameters
        ----------
        multipliers : one for each of ``rows``, N
        """
        per_element = len(self.beam.absent_strains)
        against = [[-force for force in multipliers[k : k + per_element]] for k in range(0, self.count, per_element)]
        wrenches: list[Wrench | None] = [None] * self.links
        label = f"forces of the constrained strains of beam {self.beam.name}"
        _push(self.elements, self.beam, against, wrenches, label)
        return self.generalized(wrenches, label)


def strain_rows(quantities: Quantities, generalized: Generalized) -> list[ConstraintRow]:
    """Return the constraint equations of all geometrically exact beams of the scene that have constrained strains.
    ``generalized`` maps a wrench for each link, and a label, to generalized forces, (nv,)."""
    beams = [element.beam for element in quantities.scene.elements if isinstance(element, CosseratBeam)]
    return [
        row for beam in beams if beam.absent_strains for row in ConstrainedStrains(quantities, beam, generalized).rows()
    ]


def section_multipliers(quantities: Quantities, rows: ConstraintRows | None, beam: Cosserat) -> list[list[Scalar]]:
    """Return the multipliers of a beam's constrained strains, N, as a list for each element. Each list has the length
    of ``beam.absent_strains`` and holds inputs "lam" of the tape. Entries are 0 for equations that ``rows`` does not
    contain, and all are 0 if ``rows`` is None."""
    count = len(beam.absent_strains)
    result = [[quantities.algebra.zero] * count for _ in range(beam.elements)]
    for number, row in enumerate([] if rows is None else rows.all):
        if isinstance(row.group, ConstrainedStrains) and row.group.beam is beam:
            element, strain = divmod(row.in_group, count)
            result[element][strain] = quantities.input("lam", number)
    return result


def add_section_forces(quantities: Quantities, rows: ConstraintRows | None, wrenches: list[Wrench | None]) -> None:
    """Add to ``wrenches``, in place, the wrenches on the nodes of beams from their constrained strains. ``wrenches``
    has one wrench for each link, or None. The section forces are the multipliers of ``rows``."""
    for item in quantities.scene.elements:
        if isinstance(item, CosseratBeam) and item.beam.absent_strains:
            forces = section_multipliers(quantities, rows, item.beam)
            label = f"section forces of beam {item.name}"
            _push(Chain.of(quantities, item.beam), item.beam, forces, wrenches, label)


def _push(
    elements: Chain, beam: Cosserat, forces: Sequence[Sequence[Scalar]], wrenches: list[Wrench | None], label: str
) -> None:
    """Add to ``wrenches`` (by link, or None), in place, the wrenches of section forces on the nodes of a beam.
    ``forces`` holds, for each element, one force, N, for each strain of ``beam.absent_strains``. All elements are
    recorded as one loop with the label."""

    def transmit(element: ElementStrain, *parts: Scalar) -> list[Scalar]:
        return element.node_forces(element.held_forces(dict(zip(beam.absent_strains, parts, strict=True))))

    elements.push(wrenches, elements.each(transmit, label, forces))
