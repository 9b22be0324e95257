"""Strains and section loads of geometrically exact beams, of which outputs and figures are made."""

from __future__ import annotations

from itertools import pairwise

from eomgen.mechanics.derivation import Derivation
from eomgen.system.system import Block


def section_loads(derivation: Derivation) -> list[Block]:
    """Return x of the elements' middles at rest, m, their strains, and the loads of their sections.

    A load is exerted by the part beyond on a section: moment, N m, then force, N, in the axes of the section. Elements
    transmit it from node to node; loads on their halves are a separate block.
    """
    beams = derivation.section_loads.beams
    rows = [row for beam in beams for row in derivation.section_loads.rows(beam.name)]
    middles = [derivation.algebra.scalar(0.5 * (start + end)) for beam in beams for start, end in pairwise(beam.places)]
    count = len(rows)
    strain = [value for row in rows for value in row[:6]]
    mean = [value for row in rows for value in row[6:12]]
    ends = [value for row in rows for value in row[12:]]
    halves = [value for beam in beams for row in derivation.section_loads.halves(beam.name) for value in row]
    where = f"of each element of {', '.join(beam.name for beam in beams)}"
    return [
        derivation.block("x", (count,), middles, f"place at rest of the middle {where}, m"),
        derivation.block("strain", (count, 6), strain, f"twist, curvature about y and z, stretch, shear {where}"),
        derivation.block("load", (count, 6), mean, f"mean moment and force of the sections {where}"),
        derivation.block("load_at_ends", (count, 2, 6), ends, f"load at the first and the last node {where}"),
        derivation.block("load_on_halves", (count, 2, 6), halves, f"distributed load, weight, inertia, halves {where}"),
    ]
