"""The register of force elements: one row for each kind, in the order of the sections in a file."""

from __future__ import annotations

from eomgen.scene.forces import (
    bushings,
    cosserat_beams,
    distributed_loads,
    efforts,
    forces,
    hulls,
    springs,
    torsion_springs,
    tyres,
)
from eomgen.scene.forces.element import ForceElement, Row
from eomgen.scene.reading.requirements import BOUNDS, bounds

ELEMENTS: tuple[Row, ...] = (
    springs.ROW,
    torsion_springs.ROW,
    bushings.ROW,
    tyres.ROW,
    forces.ROW,
    distributed_loads.ROW,
    efforts.ROW,
    hulls.ROW,
)
#: Force elements that entries of other sections bring with them.
STRUCTURE: tuple[type[ForceElement], ...] = (cosserat_beams.CosseratBeam,)
#: What every value of a scene must be by itself.
ALL_BOUNDS = dict(BOUNDS) | bounds(
    {f"{row.section}.{key}": bound for row in ELEMENTS for key, bound in row.bounds.items() if bound is not None}
)
