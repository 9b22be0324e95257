"""The register of force elements: one row for each kind, in the order of the sections in a file."""

from __future__ import annotations

from eomgen.scene.forces import bushings, cosserat_beams, distributed_loads, forces, springs, tyres
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection

ELEMENTS: tuple[ElementSection, ...] = (
    springs.SECTION,
    springs.TORSION_SECTION,
    bushings.SECTION,
    tyres.SECTION,
    forces.SECTION,
    distributed_loads.SECTION,
    forces.EFFORT_SECTION,
)
#: Force elements that entries of other sections imply.
STRUCTURE: tuple[type[ForceElement], ...] = (cosserat_beams.CosseratBeam,)
