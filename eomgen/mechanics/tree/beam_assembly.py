"""From a beam of a scene to the elastic part of its link: constants folded, parameters kept as factors."""

from __future__ import annotations

from collections.abc import Callable

from eomgen.mechanics.shape_functions.shape_integrals import ShapeIntegrals
from eomgen.mechanics.tree.beam_body import ElasticBody
from eomgen.mechanics.tree.beam_fields import Deflections, DistributedMass
from eomgen.mechanics.tree.coordinates import Coordinates
from eomgen.scene.bodies.beam import Beam, Deformation
from eomgen.scene.formula.nodes import Formula
from eomgen.symbolic.scalar import Algebra, Scalar


def elastic_body(
    algebra: Algebra, beam: Beam, integrals: ShapeIntegrals, coordinates: Coordinates, number: Callable[[Formula], Scalar]
) -> ElasticBody:
    """Return the elastic part of a beam's link."""
    density = number(beam.mass_per_length)
    constant = density.constant
    unit, factor = (1.0, density) if constant is None else (constant, algebra.one)
    polar = number(beam.polar_inertia)
    n = beam.size
    beyond = [[algebra.zero] * n for _ in range(n)]
    twists = [[polar * float(entry) for entry in row] for row in integrals.t2]
    for item, here in deformations(beam):
        inertia_factor = number(item.inertia_factor)
        for k in here:
            for j in here:
                beyond[k][j] = (inertia_factor - 1.0) * (unit * float(integrals.m[k, j]))
                twists[k][j] = inertia_factor * twists[k][j]
    extra = None if all(entry.is_zero for row in beyond for entry in row) else tuple(tuple(row) for row in beyond)
    return ElasticBody(
        algebra=algebra,
        beam=beam,
        coordinates=coordinates,
        mass=DistributedMass(algebra, integrals, unit, beam.order == 2, extra),
        density=factor,
        deflections=Deflections(algebra, integrals, beam.stiffening, coordinates.q, coordinates.v, coordinates.a),
        twist=tuple(polar * float(entry) for entry in integrals.t0),
        twists=tuple(tuple(row) for row in twists),
    )


def deformations(beam: Beam) -> list[tuple[Deformation, range]]:
    """Return each deformation of a beam with the places of its coordinates."""
    found, start = [], 0
    for item in beam.deformations:
        found.append((item, range(start, start + item.modes)))
        start += item.modes
    return found
